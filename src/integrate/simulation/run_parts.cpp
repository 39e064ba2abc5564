#include "integrate/simulation/run_parts.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "codegen/kernel/kernel.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/lineage.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "integrate/simulation/problem_setup.hpp"
#include "integrate/simulation/usual_tolerances.hpp"

namespace pendula::integrate {

std::vector<Expr> leaves_of(const Problem& problem) {
  const dae::FirstOrder& form = problem.model();
  std::vector<Expr> list = form.x;
  for (Expr x : form.x) list.push_back(derivative_leaf(x));
  list.insert(list.end(), form.z.begin(), form.z.end());
  return list;
}

static Point point_of(double t, const Vec& values, int n) {
  return {t, values.head(n), values.segment(n, n), values.tail(values.size() - 2 * n)};
}

Meanings RunParts::meanings_in(const dae::Model& model, const std::vector<Expr>& known) const {
  const std::unordered_set<Expr> has_value(known.begin(), known.end());
  Meanings own;
  for (std::size_t i = 0; i < leaves_.size(); ++i) {
    Expr meaning = substitute(dae::resolve(model, leaves_[i]), inputs_);
    const std::vector<Expr> inside = pendula::leaves({&meaning, 1});
    if (!std::all_of(inside.begin(), inside.end(), [&](Expr leaf) {
          return has_value.count(leaf) || symbol_of(leaf).kind == Kind::constant;
        })) {
      own.open.push_back(static_cast<Eigen::Index>(i));
      meaning = Expr(0);
    }
    own.expressions.push_back(meaning);
  }
  return own;
}

void RunParts::add(RunPart piece) {
  meanings_.push_back(meanings_in(*piece.model, piece.solution->problem().arguments()));
  pieces_.push_back(std::move(piece));
}

Point RunParts::with_values(double t, Vec values, const Meanings& meanings) const {
  for (Eigen::Index i : meanings.open) values[i] = NAN;
  return point_of(t, values, n_);
}

Point RunParts::translated(const Point& point) const {
  return with_values(point.t, last().solution->values(meanings_.back().expressions, point), meanings_.back());
}

std::pair<double, double> RunParts::interval(const Points& saved) const {
  if (pieces_.empty()) return Continuation::interval(saved);
  return {pieces_.front().solution->t().front(), pieces_.back().solution->t().back()};
}

double RunParts::errors_beyond_estimates() {
  double sum = 0;
  for (const RunPart& piece : pieces_) sum += piece.solution->errors() - piece.solution->stats().errors;
  return sum;
}

std::optional<double> RunParts::passed_growth() {
  for (const RunPart& piece : pieces_)
    if (const std::optional<double> when = piece.solution->passed_growth()) return when;
  return {};
}

Point RunParts::at(const Points&, double t) {
  std::size_t k = pieces_.size() - 1;
  while (k > 0 && pieces_[k].from > t) --k;
  return with_values(t, pieces_[k].solution->values(meanings_[k].expressions, t), meanings_[k]);
}

SolutionInParts::SolutionInParts(dae::ModelPtr model, const Simulation& simulation, std::vector<Expr> leaves)
    : model_(std::move(model)),
      simulation_(simulation),
      problem_(make_problem(model_, simulation)),
      pieces_(std::make_shared<RunParts>(std::move(leaves), problem_->n(), simulation.inputs)),
      merged_(std::make_shared<Solution>(problem_)) {
  if (simulation.plan.times) times_ = *simulation.plan.times;
}

ToleranceRequest SolutionInParts::tolerances_in(const dae::ModelPtr& part,
                                                const ToleranceRequest& asked) const {
  if (part == model_) return asked;
  const dae::FirstOrder& form = *dae::shared_first_order(part);
  std::unordered_set<Expr> unknowns(form.x.begin(), form.x.end());
  unknowns.insert(form.z.begin(), form.z.end());
  ToleranceRequest own;
  own.all = asked.all;
  const auto ask = [&](Expr leaf, double value) {
    if (const Expr here = dae::resolve(*part, leaf); unknowns.count(here)) own.some.emplace_back(here, value);
  };
  const auto n = static_cast<std::size_t>(problem_->n());
  for (std::size_t i = 0; i < asked.list.size(); ++i)
    ask(pieces_->leaves()[i < n ? i : n + i], asked.list[i]);  // leaves: x, x′, z
  for (const auto& [leaf, value] : asked.some) ask(dae::original_leaf(*model_, leaf), value);
  return own;
}

double entry_of(const Point& point, std::size_t i) {
  const auto n = static_cast<std::size_t>(point.x.size());
  const auto k = static_cast<Eigen::Index>(i < n ? i : i < 2 * n ? i - n : i - 2 * n);
  return i < n ? point.x[k] : i < 2 * n ? point.xdot[k] : point.z[k];
}

Point start_point(const Problem& problem, const Simulation& simulation) {
  const dae::FirstOrder& form = problem.model();
  const auto& known = simulation.start->values;
  const auto values = [&](const std::vector<Expr>& list) {
    Vec v = Vec::Zero(static_cast<Eigen::Index>(list.size()));
    for (std::size_t i = 0; i < list.size(); ++i)
      if (const auto at = known.find(list[i]); at != known.end()) v[i] = at->second;
    return v;
  };
  return {simulation.plan.from, values(form.x), values(form.xdot), values(form.z)};
}

void set_conditions(const Simulation& simulation, double t, dae::StartRequest& request) {
  request.t = t;
  request.parameters = simulation.parameters;
  request.inputs = simulation.inputs;
  for (const auto& [leaf, function] : simulation.numeric_inputs) {
    request.inputs[leaf] = Expr(function(t));
    request.numeric_inputs.push_back(leaf);
  }
}

std::function<bool(const Point&)> SolutionInParts::stop_when(const dae::ModelPtr& part,
                                                             std::function<bool(const Point&)> own) {
  stopped_ = false;
  if (!simulation_.plan.stop_when) return own;
  const ProblemPtr problem = make_problem(part, simulation_);
  const auto meanings = std::make_shared<Meanings>(pieces_->meanings_in(*part, problem->arguments()));
  const auto kernel = std::make_shared<codegen::Kernel>(meanings->expressions, problem->arguments());
  return [this, own = std::move(own), problem, meanings, kernel](const Point& point) {
    problem->set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
    const std::vector<double> values = (*kernel)(problem->values());
    const auto n = static_cast<Eigen::Index>(values.size());
    stopped_ = simulation_.plan.stop_when(
        pieces_->with_values(point.t, Eigen::Map<const Vec>(values.data(), n), *meanings));
    return stopped_ || own(point);
  };
}

bool SolutionInParts::continues_at(const dae::ConsistentState& start) const {
  // near dependent equations errors reach many tolerances, but stay far below the motion itself
  constexpr double most = 1e-2, tolerances = 1e6, most_of_usual_size = 10;
  if (pieces_->empty()) return true;
  const Point end = pieces_->translated(pieces_->last().solution->final());
  const double share = std::min(tolerances, most_of_usual_size / usual_rtol(simulation_));
  const Vec usual = usual_atol(simulation_, problem_, start_point(*problem_, simulation_));
  for (Eigen::Index i = 0; i < end.x.size(); ++i) {
    const double atol = simulation_.atol.all.value_or(usual[i]);
    const auto value = start.value_for(*start.model, dae::resolve(*start.model, leaves()[i]));
    if (value && !(std::fabs(*value - end.x[i]) <= most * std::fabs(end.x[i]) + share * atol)) return false;
  }
  return true;
}

/// Do the vectors differ by more than errors of a run?
static bool differ(const Vec& a, const Vec& b) {
  constexpr double share = 1e-3, least = 1e-9;
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    const double allowed = std::max(share * std::max(std::fabs(a[i]), std::fabs(b[i])), least);
    if (std::fabs(a[i] - b[i]) > allowed) return true;
  }
  return false;
}

static bool differ(const Point& a, const Point& b) {
  return differ(a.x, b.x) || differ(a.xdot, b.xdot) || differ(a.z, b.z);
}

double SolutionInParts::rounding_of_times() const {
  const std::vector<double>& t = pieces_->last().solution->t();
  constexpr double rounding = 1e-14;  // 45 ε
  return rounding * std::max(std::fabs(t.front()), std::fabs(t.back()));
}

/// Saves the times up to `end` that have no point yet, from the last part.
void SolutionInParts::save_times(double end) {
  const Solution& part = *pieces_->last().solution;
  for (; next_time_ < times_.size() && times_[next_time_] <= end; ++next_time_) {
    Point point =
        pieces_->translated(part.at(std::clamp(times_[next_time_], part.t().front(), part.t().back())));
    point.t = times_[next_time_];
    merged_->save(point);
  }
}

void SolutionInParts::add(RunPart piece, std::size_t shown) {
  const SolutionPtr solution = piece.solution;
  const bool may_jump = piece.may_jump;
  const std::vector<char> deferred = piece.deferred;
  std::optional<Point> before;
  if (!pieces_->empty()) before = pieces_->translated(pieces_->last().solution->final());
  pieces_->add(std::move(piece));
  const bool with_start = !before || (may_jump && differ(*before, pieces_->translated(solution->point(0))));
  for (int i = with_start ? 0 : 1; !simulation_.plan.times && i < solution->size(); ++i)
    merged_->save(pieces_->translated(solution->point(i)));
  save_times(solution->t().back() - rounding_of_times());
  for (EventRecord event : solution->events()) {
    const auto which = static_cast<std::size_t>(event.which);
    if (which >= shown || (which < deferred.size() && deferred[which] && event.action == "stop")) continue;
    event.before = pieces_->translated(event.before);
    event.after = pieces_->translated(event.after);
    merged_->add_event(event);
  }
  const Stats& s = solution->stats();
  stats_.steps += s.steps;
  stats_.rejected += s.rejected;
  stats_.evaluations += s.evaluations;
  stats_.jacobians += s.jacobians;
  stats_.factorisations += s.factorisations;
  stats_.newton_iterations += s.newton_iterations;
  stats_.errors += s.errors;
  if (s.rest) stats_.rest = s.rest;
  if (s.regrowth) stats_.regrowth = s.regrowth;
  if (merged_->not_unique().empty()) merged_->set_not_unique(solution->not_unique());
  seconds_ += solution->cpu_seconds();
}

TrajectoryPtr SolutionInParts::finish(const RunOutcome& outcome) {
  const Solution& last = *pieces_->last().solution;
  save_times(last.t().back() + rounding_of_times());
  merged_->set_method(last.method_name(), last.dt());
  merged_->set_continuation(pieces_);
  merged_->finish(outcome, stats_, seconds_);
  return std::make_shared<const Trajectory>(model_, simulation_.inputs, merged_, simulation_.events);
}

}  // namespace pendula::integrate
