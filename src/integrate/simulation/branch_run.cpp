#include "integrate/simulation/branch_run.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "dae/start/continuation_check.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"
#include "integrate/simulation/problem_setup.hpp"
#include "integrate/simulation/run_parts.hpp"
#include "integrate/simulation/usual_tolerances.hpp"
#include "integrate/solution/pieces.hpp"

namespace pendula::integrate {
namespace {

constexpr long most_branches = 10'000;  // one run each

dae::PointValues values_at(const Problem& problem, const dae::ConsistentState& start, const Point& point) {
  dae::PointValues values = start.values;
  const dae::FirstOrder& form = problem.model();
  values[time_symbol()] = point.t;
  for (std::size_t j = 0; j < form.x.size(); ++j) values[derivative_leaf(form.x[j])] = point.xdot[j];
  for (std::size_t j = 0; j < form.x.size(); ++j) values[form.x[j]] = point.x[j];
  for (std::size_t j = 0; j < form.z.size(); ++j) values[form.z[j]] = point.z[j];
  return values;
}

/// Computes, by Taylor polynomials from a regular point, the end of a run that was stopped where branches
/// meet. The last steps of the run may already be on another branch or end before that point.
class Approach {
 public:
  Approach(const dae::Model& model, const Problem& problem, const Simulation& simulation)
      : model_(model), problem_(problem), simulation_(simulation) {}

  /// stop: the reported stopping time. back: distance of the regular point before it, as a share of the time
  /// since the start of the piece. Returns why the point was not found, or "".
  std::string follow(const Solution& piece, double stop, int most_steps, double back = 0.02) {
    constexpr double beyond = 0.05;  // of the time since the start of the piece, and of the run
    constexpr double failed = 2;     // in steps of the last size, one of which may have failed at the point
    constexpr std::size_t affordable = 12;  // unknowns; derivatives of high order are formed symbolically
    if (model_.variables.size() > affordable || !model_.inputs.empty())
      return "the model is too large for that";
    measure(piece);
    steps_.clear();
    const double begin = piece.t().front(), last = piece.t().back(), since = std::max(stop, last) - begin;
    dae::PointValues here =
        values_at(problem_, *simulation_.start, piece.at(std::min(last, begin + (1 - back) * since)));
    const auto& t = piece.t();
    const double step = t.size() > 1 ? t.back() - t[t.size() - 2] : 0;
    const double ahead =
        std::max(beyond * std::max(since, simulation_.plan.to - simulation_.plan.from), failed * step);
    const double end = std::min(begin + since + ahead, simulation_.plan.to);
    for (int k = 0; k < most_steps; ++k) {
      const auto continuation = dae::expansion(model_, {"", here, {}, ""}, false);
      if (!continuation) return "its derivatives were not found";
      arrived_ = *continuation;
      const double distance = std::min(distance_of(*continuation), end - continuation->t);
      if (!(distance > 0)) return "the equations are not singular there, or the solution changes too fast";
      const auto meeting =
          dae::meeting_time(model_, *continuation, simulation_.start->values, continuation->t + distance);
      const double to = meeting.value_or(continuation->t + distance);
      steps_.emplace_back(*continuation, to);
      for (const auto& [leaf, value] : continuation->at(to)) here[leaf] = value;
      if (meeting) return arrived_at(std::move(here), *meeting);
    }
    return "too many steps";
  }

  /// As follow(), for a run that begins where branches meet.
  std::string start_at_meeting(const Solution& piece) {
    measure(piece);
    steps_.clear();
    return at_meeting(values_at(problem_, *simulation_.start, piece.point(0)));
  }

  const std::vector<dae::Continuation>& continuations() const { return continuations_; }
  const std::vector<dae::ContinuationExpansion>& expansions() const { return expansions_; }
  /// The polynomials up to the point, each with its end; empty if the run begins there.
  const std::vector<std::pair<dae::ContinuationExpansion, double>>& steps() const { return steps_; }
  double meeting() const { return steps_.back().second; }
  const dae::ContinuationExpansion& arrived() const { return arrived_; }

  double size_of(Expr leaf) const {
    const double size = size_so_far(leaf);
    return size > 0 ? size : 1;
  }

  /// The largest value so far of an unknown or a first derivative; 0 if unknown.
  double size_so_far(Expr leaf) const {
    const auto it = sizes_.find(leaf);
    return it != sizes_.end() ? it->second : 0;
  }

  /// The distance over which a polynomial is accurate; 0 if it is too short to leave the point.
  double distance_of(const dae::ContinuationExpansion& continuation) const {
    // of the tolerance; of the interval; of the interval
    constexpr double share = 0.1, first = 0.05, least = 1e-6;
    const double rtol = usual_rtol(simulation_);
    const double interval = simulation_.plan.to - simulation_.plan.from;
    const auto serves = [&](double distance) {
      for (std::size_t j = 0; j < continuation.derivatives.size(); ++j)
        if (!(continuation.last_terms(j, distance) <=
              share * rtol * size_of(continuation.derivatives[j].first)))
          return false;
      return true;
    };
    for (double distance = first * interval; distance >= least * interval; distance /= 2)
      if (serves(distance)) return distance;
    return 0;
  }

 private:
  /// The largest values of x and z so far.
  void measure(const Solution& piece) {
    for (int i = 0; i < piece.size(); ++i)
      for (const auto& [leaf, value] : values_at(problem_, *simulation_.start, piece.point(i)))
        sizes_[leaf] = std::max(sizes_[leaf], std::fabs(value));
  }

  /// If the derivatives at the point determine no continuation, the arriving solution may be one itself.
  std::string arrived_at(dae::PointValues here, double meeting) {
    std::string why = at_meeting(here);
    if (!continuations_.empty()) return why;
    const auto continuation = dae::arrived_continuation(model_, here, arrived_);
    if (!continuation) return why;
    continuations_ = {*continuation};
    expansions_ = {arrived_.about(meeting)};
    return "";
  }

  std::string at_meeting(const dae::PointValues& here) {
    expansions_.clear();
    continuations_ = dae::continuations_at(model_, here);
    if (continuations_.empty()) return "no continuation was found";
    for (const dae::Continuation& continuation : continuations_) {
      const auto expansion = dae::expansion(model_, continuation, true);
      if (!expansion) return "the derivatives of " + continuation.text + " were not found";
      expansions_.push_back(*expansion);
    }
    return "";
  }

  const dae::Model& model_;
  const Problem& problem_;
  const Simulation& simulation_;
  dae::PointValues sizes_;
  std::vector<std::pair<dae::ContinuationExpansion, double>> steps_;
  dae::ContinuationExpansion arrived_;  ///< the last expansion before the point
  std::vector<dae::Continuation> continuations_;
  std::vector<dae::ContinuationExpansion> expansions_;
};

class BranchRun {
 public:
  BranchRun(const dae::ModelPtr& model, const Simulation& simulation)
      : model_(model),
        simulation_(simulation),
        part_(simulation),
        problem_(make_problem(model, simulation)),
        whole_(model, simulation, leaves_of(*problem_)),
        approach_(*model_, *problem_, simulation) {
    part_.branch.reset();
    part_.plan.times.reset();
  }

  TrajectoryPtr run() {
    RunOutcome outcome;
    for (long k = 0; k < most_branches; ++k) {
      TrajectoryPtr trajectory;
      try {
        trajectory = simulate(model_, part_);
      } catch (const Failure& e) {
        if (k > 0) {
          outcome = stopped_at(part_.plan.from, e.what());
          break;
        }
        const std::string why = go_on_from_start();
        if (why.empty()) continue;
        if (approach_.continuations().size() < 2) throw;
        throw Failure(text(e.what(), "; branch: ", why));
      }
      const SolutionPtr piece(trajectory, &trajectory->solution());
      outcome = piece->outcome();
      whole_.add({model_, piece, part_.plan.from}, part_.events.size());
      if (outcome.ending != Ending::stopped) break;
      if (const std::string why = go_on(*piece); !why.empty()) {
        outcome.message += "; branch: " + why;
        break;
      }
      if (part_.plan.from >= simulation_.plan.to) {
        outcome = {Ending::finished, "", 0};
        break;
      }
    }
    return whole_.finish(outcome);
  }

 private:
  /// Continues a run whose start is a branch point, so that the method cannot take a step.
  std::string go_on_from_start() {
    const auto point = std::make_shared<Solution>(problem_);
    point->save(start_point(*problem_, simulation_));
    point->finish({Ending::stopped, "", simulation_.plan.from}, {}, 0);
    whole_.add({model_, point, simulation_.plan.from}, 0);
    return go_on(*point);
  }

  /// Continues beyond the end of a piece; returns why that is not possible, or "".
  std::string go_on(const Solution& piece) {
    const bool begins = piece.t().back() == piece.t().front() && whole_.pieces().is_one();
    if (const std::string why =
            begins ? approach_.start_at_meeting(piece) : approach_.follow(piece, piece.outcome().t, 1000);
        !why.empty())
      return why;
    std::string why;
    const auto chosen = simulation_.branch->derivatives.empty() ? smooth(why) : asked_for(why);
    if (!chosen) return why;
    const dae::ContinuationExpansion& continuation = approach_.expansions()[*chosen];
    const double distance = approach_.distance_of(continuation);
    if (distance == 0) return "the solution " + approach_.continuations()[*chosen].text + " changes too fast";
    return begin_at(continuation, std::min(continuation.t + distance, simulation_.plan.to), piece.t().back());
  }

  /// The continuation that agrees with the polynomial of the solution so far.
  std::optional<std::size_t> smooth(std::string& why) const {
    constexpr double clearly = 0.1;
    if (approach_.steps().empty()) {
      why = text("the run begins there, and nothing tells which of them is smooth: write branch = ",
                 dae::choices_text(approach_.continuations()));
      return {};
    }
    std::vector<double> miss;
    const double meeting = approach_.meeting();
    for (const dae::ContinuationExpansion& continuation : approach_.expansions()) {
      const double back =
          std::min(approach_.distance_of(continuation), approach_.distance_of(approach_.arrived()));
      const auto expected = continuation.at(meeting - back), values = approach_.arrived().at(meeting - back);
      double worst = back > 0 ? 0 : INFINITY;
      for (const auto& [leaf, derivatives] : continuation.derivatives)
        worst = std::max(worst, std::fabs(values.at(leaf) - expected.at(leaf)) / approach_.size_of(leaf));
      miss.push_back(worst);
    }
    constexpr double visible = 1e-2;  // of the size of an unknown
    if (miss.size() == 1 && miss[0] > visible) {
      why = "the continuation that was found, with " + approach_.continuations()[0].text + ", is not smooth";
      return {};
    }
    return clear_least(miss, clearly, "which of them goes on smoothly is not clear", why);
  }

  /// The continuation with the requested derivatives, to which a tolerance of a tenth is granted.
  std::optional<std::size_t> asked_for(std::string& why) const {
    constexpr double roughly = 0.1, clearly = 0.5,
                     rounding = 1e-6;  // the last: relative to the largest value so far
    const auto& continuations = approach_.continuations();
    std::vector<double> miss(continuations.size(), 0);
    for (const auto& [leaf, value] : simulation_.branch->derivatives) {
      const Expr own = dae::resolve(*model_, leaf);
      const auto inside = leaves({&own, 1});
      if (continuations.size() > 1 && std::none_of(inside.begin(), inside.end(), [&](Expr e) {
            return std::find(continuations[0].differs.begin(), continuations[0].differs.end(), e) !=
                   continuations[0].differs.end();
          })) {
        why = text(to_text(leaf),
                   " does not tell them apart; write branch = ", dae::choices_text(continuations));
        return {};
      }
      std::vector<double> here;
      double size = std::max(std::fabs(value), rounding * approach_.size_so_far(own));
      for (const dae::Continuation& continuation : continuations) {
        for (Expr e : inside)
          if (symbol_of(e).kind != Kind::constant && !continuation.values.count(e)) {
            why =
                text(to_text(leaf), " has no value there; write branch = ", dae::choices_text(continuations));
            return {};
          }
        here.push_back(evaluate({&own, 1}, continuation.values)[0]);
        size = std::max(size, std::fabs(here.back()));
      }
      for (std::size_t k = 0; k < continuations.size() && size > 0; ++k)
        miss[k] += std::fabs(here[k] - value) / size;
    }
    const bool is_one = continuations.size() == 1;
    const std::string none =
        text(is_one ? "the only continuation is not the one that was asked for"
                    : "none of them is clearly the one that was asked for",
             "; write branch = ",
             is_one && continuations[0].text.empty() ? "\"smooth\"" : dae::choices_text(continuations));
    const auto best = clear_least(miss, clearly, none, why);
    if (best && miss[*best] > roughly * static_cast<double>(simulation_.branch->derivatives.size())) {
      why = none;
      return {};
    }
    return best;
  }

  static std::optional<std::size_t> clear_least(const std::vector<double>& miss, double clearly,
                                                const std::string& not_clear, std::string& why) {
    const auto best = std::min_element(miss.begin(), miss.end());
    for (auto other = miss.begin(); other != miss.end(); ++other)
      if (other != best && !(*best < clearly * *other)) {
        why = not_clear;
        return {};
      }
    return static_cast<std::size_t>(best - miss.begin());
  }

  /// Prepares the next piece from a time on the continuation; the solution up to it is given by polynomials.
  std::string begin_at(const dae::ContinuationExpansion& continuation, double to, double reached) {
    dae::StartRequest request;
    request.t = to;
    auto there = continuation.at(to);
    constexpr double rounding = 1e-14;  // 45 ε
    for (auto& [leaf, value] : there)
      if (std::fabs(value) < rounding * approach_.size_of(leaf)) value = 0;
    for (Expr leaf : model_->states()) request.fix.emplace_back(leaf, there.at(leaf));
    for (const auto& list : {model_->top_derivatives(), model_->algebraic()})
      for (Expr leaf : list)
        if (const auto value = there.find(leaf); value != there.end())
          request.guess.emplace_back(leaf, value->second);
    request.parameters = simulation_.parameters;
    request.inputs = simulation_.inputs;
    request.nearest = true;
    try {
      part_.start = dae::init(model_, request);
    } catch (const UserFacing& e) {
      return text("no consistent start was found further along the branch: ", e.what());
    }
    for (const auto& [step, end] : approach_.steps())
      if (end > reached) add_polynomial(step, std::max(step.t, reached), end);
    if (const double from = std::max(continuation.t, reached); to > from)
      add_polynomial(continuation, from, to);
    part_.plan.from = to;
    return "";
  }

  void add_polynomial(const dae::ContinuationExpansion& continuation, double from, double to) {
    constexpr Eigen::Index count = 9;  // Chebyshev points: more than the coefficients of the polynomial
    const auto leaves = leaves_of(*problem_);
    const auto values = [&](double t) {
      const auto at = continuation.at(t);
      Vec list(static_cast<Eigen::Index>(leaves.size()));
      for (std::size_t j = 0; j < leaves.size(); ++j) list[j] = at.at(leaves[j]);
      return list;
    };
    const Eigen::Index n = problem_->n();
    const auto point = [&](double t) {
      const Vec all = values(t);
      return Point{t, all.head(n), all.segment(n, n), all.tail(all.size() - 2 * n)};
    };
    Piece piece{from, to, Mat(static_cast<Eigen::Index>(leaves.size()), count)};
    for (Eigen::Index k = 0; k < count; ++k) {
      const double angle = (2.0 * static_cast<double>(k) + 1) * std::numbers::pi / (2.0 * count);
      piece.values.col(k) = values(from + (to - from) * (1 - std::cos(angle)) / 2);
    }
    const auto solution = std::make_shared<Solution>(problem_);
    solution->save(point(from));
    solution->save(point(to));
    solution->set_continuation(continuation_of({piece}, problem_->n(), problem_->m()));
    solution->finish({Ending::finished, "", 0}, {}, 0);
    whole_.add({model_, solution, from}, 0);
  }

  dae::ModelPtr model_;
  const Simulation& simulation_;
  Simulation part_;
  ProblemPtr problem_;
  SolutionInParts whole_;
  Approach approach_;
};

/// Is the model x′ = f(t, x)? Then no solution continues where f is undefined.
bool is_explicit(const dae::Model& model) {
  if (!model.algebraic().empty()) return false;
  const std::vector<Expr> top = model.top_derivatives();
  const std::vector<Entry> slopes = sparse_jacobian(model.residuals, top);
  return std::none_of(slopes.begin(), slopes.end(), [](const Entry& e) { return varies(e.value); });
}

/// Is the end a pole? Some x′ is very large relative to the change of x so far, like x = √(1 - 2 t) at 1/2,
/// or some z relative to its values shortly before, like z = 1/(1 - t) at 1.
bool is_pole(const Solution& solution, const Point& end) {
  constexpr double beyond = 1e5, before = 0.02;  // the last: share of the time since the start
  const Point start = solution.point(0);
  for (Eigen::Index i = 0; i < end.xdot.size(); ++i) {
    const double size = std::max(std::fabs(start.x[i]), std::fabs(end.x[i]));
    if (std::fabs(end.xdot[i]) * (end.t - start.t) > beyond * size) return true;
  }
  Vec largest = Vec::Zero(end.z.size());
  for (int i = 0; i < solution.size() && end.t - solution.t()[i] >= before * (end.t - start.t); ++i)
    largest = largest.cwiseMax(solution.point(i).z.cwiseAbs());
  return (end.z.array().abs() > beyond * largest.array() && largest.array() > 0).any();
}

}  // namespace

std::string continuations_at_end_text(const dae::ModelPtr& model, const Simulation& simulation,
                                      const Solution& solution, const Point& point, bool here) {
  if (solution.size() == 0 || is_explicit(*model) || is_pole(solution, point)) return "";
  Approach approach(*model, solution.problem(), simulation);
  std::vector<dae::Continuation> continuations;
  std::string where = "there";
  for (const double back : {0.02, 0.2, 0.5}) {  // the last steps may be off all branches
    try {
      if (!approach.follow(solution, point.t, 40, back).empty()) continue;
      continuations = approach.continuations();
      if (!here) where = "where they meet, at t = " + rounded(approach.meeting(), 6) + ",";
      break;
    } catch (const UserFacing&) {  // this regular point gives no information
    }
  }
  const bool arrived = !continuations.empty();
  if (here && continuations.size() < 2) {
    auto at_end = dae::continuations_at(*model, values_at(solution.problem(), *simulation.start, point));
    if (at_end.size() > 1) continuations = std::move(at_end);
  }
  if (arrived && continuations.size() == 1 && !continuations[0].text.empty())
    return text("; a solution goes on ", where, " with ", continuations[0].text,
                " (branch = \"smooth\" follows it)");
  if (continuations.size() < 2) return "";
  return text("; solutions go on ", where, " with ", dae::continuations_text(continuations),
              " (branch = … follows one)");
}

TrajectoryPtr simulate_branches(const dae::ModelPtr& model, const Simulation& simulation) {
  if (simulation.plan.dt)
    throw Error("branch = … needs steps chosen by the error: leave dt out and give rtol = 1e-8");
  if (!simulation.sensitivities.empty())
    throw Error("sensitivities do not follow a solution through branch = …; leave one of them out");
  return BranchRun(model, simulation).run();
}

}  // namespace pendula::integrate
