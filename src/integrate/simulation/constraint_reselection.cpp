#include "integrate/simulation/constraint_reselection.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_set>
#include <utility>

#include "base/decompositions.hpp"
#include "base/text.hpp"
#include "codegen/kernel/kernel.hpp"
#include "dae/model/lineage.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "dae/reduce/reduce.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "dae/regularise/least_norm.hpp"
#include "integrate/simulation/problem_setup.hpp"
#include "integrate/simulation/run_parts.hpp"
#include "integrate/simulation/usual_tolerances.hpp"

namespace pendula::integrate {
namespace {

using Index = Eigen::Index;

// Quality relative to the best choice below which the constraints are chosen again: the kept ones multiply
// errors by ten compared with the best. Switching takes milliseconds, for a new model.
constexpr double much_worse = 0.1;
constexpr double hardly = 0.03;           // steps become short from here on and finally fail
constexpr long most_rekeepings = 10'000;  // a model each

/// The model made by lagrange or independent() of which the given one is a form; null if there is none.
dae::ModelPtr mechanism_of(const dae::ModelPtr& model) {
  dae::ModelPtr source = model;
  while (source && !((source->mechanics || source->dependent) && source->form.empty()))
    source = source->parent;
  return source;
}

/// The model from which constraints are chosen, with the parameter values of the form.
dae::ModelPtr mechanism_with_values(const dae::ModelPtr& model) {
  const dae::ModelPtr made = mechanism_of(model), source = made->mechanics ? made : made->dependent;
  dae::ParameterValues values;
  for (Expr p : source->parameters)
    if (const auto it = model->values.find(p); it != model->values.end()) values[p] = it->second;
  return dae::with_values(source, values);
}

/// The constraints that are equations of the model that was made.
std::vector<Index> kept_in(const dae::Model& made, const dae::DependentConstraints& all) {
  const std::unordered_set<Expr> rows(made.residuals.begin(), made.residuals.end());
  std::vector<Index> kept;
  for (Index i = 0; i < all.C.size(); ++i)
    if (rows.count(all.C[i]) || rows.count(-all.C[i])) kept.push_back(i);
  return kept;
}

/// The message of a run that cannot choose other constraints; `why` is the reason.
std::string dependent_text(const dae::Model& made, const dae::DependentConstraints& all,
                           const std::vector<Index>& kept, const std::string& why) {
  std::vector<std::string> names;
  for (Index i : kept)
    for (std::size_t row = 0; row < made.residuals.size(); ++row)
      if (made.residuals[row] == all.C[i] || made.residuals[row] == -all.C[i])
        names.push_back(made.mechanics ? text("C[", i + 1, "]") : made.label(row));
  return text("the constraints that this form keeps, ", join(names, ", "),
              ", become dependent here, where all together hold the motion. ", why);
}

/// Compares how well the gradients of the kept constraints determine the motion with the best choice.
class KeptMonitor {
 public:
  KeptMonitor(dae::DependentConstraints all, std::vector<Index> kept, const dae::ModelPtr& model,
              const Simulation& simulation)
      : all_(std::move(all)), kept_(std::move(kept)), problem_(make_problem(model, simulation)) {
    std::vector<Expr> values;
    for (const std::vector<Entry>* entries : {&all_.dCdq, &all_.M})
      for (const Entry& e : *entries)
        values.push_back(substitute(dae::resolve(*model, e.value), simulation.inputs));
    kernel_ = codegen::Kernel(values, problem_->arguments());
  }

  /// False also where all gradients together lose their rank, since no choice is better there.
  bool is_much_worse(const Point& point, double share = much_worse) {
    return quality(point).value_or(1) < share * chosen_;
  }

  /// Sets the reference quality: the constraints may have been chosen in another metric.
  void begin(const Point& point) { chosen_ = std::min(1.0, quality(point).value_or(1)); }

 private:
  /// Quality relative to the best choice; empty where the best one does not determine the motion either.
  std::optional<double> quality(const Point& point) {
    constexpr double singular = 1e-6;  // of the largest pivot: errors are amplified by 10⁶
    const Mat J = gradients(point);
    if (!J.allFinite()) return {};
    const Eigen::ColPivHouseholderQR<Mat> all(J.transpose());
    const auto rank = static_cast<Index>(kept_.size());
    const auto& order = all.colsPermutation().indices();
    const std::vector<Index> best(order.data(), order.data() + rank);
    const double reachable = least_singular(J(best, Eigen::all));
    if (!(reachable > singular)) return {};
    return least_singular(J(kept_, Eigen::all)) / reachable;
  }

  /// The gradients of all constraints, normalised in the metric of the masses: √(g M⁻¹ gᵀ) does not
  /// depend on the units of the coordinates. If some coordinates have no inertia, rows and columns
  /// are equilibrated instead.
  Mat gradients(const Point& point) {
    problem_->set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
    const std::vector<double> values = kernel_(problem_->values());
    const Index n = all_.q.size();
    Mat J = Mat::Zero(all_.C.size(), n), M = Mat::Zero(n, n);
    const double* value = values.data();
    for (const Entry& e : all_.dCdq) J(e.row, e.column) = *value++;
    for (const Entry& e : all_.M) M(e.row, e.column) = *value++;
    if (!J.allFinite() || !M.allFinite()) return Mat::Constant(1, 1, NAN);
    const Vec unit = M.diagonal().cwiseAbs().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::LLT<Mat> root(unit.asDiagonal() * M * unit.asDiagonal());
    if (root.info() != Eigen::Success) return dae::equilibrated(J);
    J = root.matrixL().solve((J * unit.asDiagonal()).transpose()).transpose();
    return J.rowwise().normalized();
  }

  static double least_singular(const Mat& J) { return Eigen::JacobiSVD<Mat>(J).singularValues().minCoeff(); }

  dae::DependentConstraints all_;
  std::vector<Index> kept_;
  ProblemPtr problem_;
  codegen::Kernel kernel_;
  double chosen_ = 1;
};

class ConstraintReselection {
 public:
  ConstraintReselection(const dae::ModelPtr& model, const Simulation& simulation)
      : first_(model),
        simulation_(simulation),
        source_(mechanism_with_values(model)),
        problem_(make_problem(model, simulation)),
        whole_(model, simulation, original_leaves()),
        usual_atol_(usual_atol(simulation, problem_, start_point(*problem_, simulation))) {}

  TrajectoryPtr run() {
    Simulation part = simulation_;
    dae::ModelPtr model = first_, source = mechanism_of(first_);
    for (long k = 0; k < most_rekeepings; ++k) {
      const RunOutcome outcome = piece(model, *source, part);
      const Solution& done = *whole_.pieces().last().solution;
      const bool moved = done.size() > 0 && (k == 0 || done.final().t > part.plan.from);
      if (!degraded_ || !moved) return whole_.finish(outcome);
      const Point end = done.final();
      try {
        const dae::ModelPtr other = dae::independent(source_, values_at(end)), form = form_of(other, end);
        part = following(form, end);
        model = form;
        source = other;
      } catch (const UserFacing& e) {  // no other choice; the present one is used as long as possible
        if (outcome.ending != Ending::stop_when) return whole_.finish(outcome);
        no_choice_ = text("With others: ", e.what());
        part = following(model, end);
      }
    }
    return whole_.finish(stopped_at(whole_.pieces().last().solution->t().back(),
                                    text("the kept constraints were changed ", most_rekeepings, " times")));
  }

 private:
  RunOutcome piece(const dae::ModelPtr& model, const dae::Model& source, Simulation& part) {
    const auto all = dae::dependent_constraints(*source_);
    const std::vector<Index> kept = kept_in(source, all);
    KeptMonitor monitor(all, kept, model, simulation_);
    degraded_ = false;
    bool begun = whole_.pieces().empty();  // the first choice was made at another point
    part.chosen = ChosenOutside::constraints;
    part.plan.times.reset();
    part.plan.stop_when = [&](const Point& point) {
      if (!std::exchange(begun, true)) monitor.begin(point);
      if (!no_choice_.empty() && monitor.is_much_worse(point, hardly))
        throw Failure(dependent_text(source, all, kept, no_choice_));
      degraded_ = no_choice_.empty() && monitor.is_much_worse(point);
      return degraded_;
    };
    const TrajectoryPtr trajectory = simulate(model, part);
    const SolutionPtr solution(trajectory, &trajectory->solution());
    whole_.add({model, solution, part.plan.from}, simulation_.events.size());
    if (solution->ending() == Ending::stopped && solution->size() > 0)
      degraded_ =
          no_choice_.empty() && monitor.is_much_worse(ahead(solution->final(), solution->outcome().t));
    return solution->outcome();
  }

  /// Extrapolates the end of a stopped run to its stopping time, since the last step may end before the point
  /// where the kept gradients are dependent.
  static Point ahead(Point end, double t) {
    if (std::isfinite(t)) end.x += (t - end.t) * end.xdot;
    return end;
  }

  /// The leaves of the first model, as leaves of the mechanism that all choices of states and rows share.
  std::vector<Expr> original_leaves() const {
    std::vector<Expr> leaves = leaves_of(*problem_);
    for (Expr& leaf : leaves) leaf = dae::original_leaf(*first_, leaf);
    return leaves;
  }

  dae::ModelPtr form_of(const dae::ModelPtr& source, const Point& end) {
    if (first_->form.empty()) return source;
    dae::ReduceOptions options;
    if (chooses_at_point()) options.at = values_at(end);
    return dae::reduce(source, first_->form, options);
  }
  bool chooses_at_point() const { return first_->form == "dummy" || first_->form == "array"; }

  /// The values of the first model's leaves at the end of a piece, by their names in it and in the mechanism.
  std::unordered_map<Expr, double> values_at(const Point& end) {
    const Point point = whole_.pieces().translated(end);
    std::unordered_map<Expr, double> values = simulation_.start->values;
    values[time_symbol()] = end.t;
    const std::vector<Expr> own = leaves_of(*problem_);
    const std::vector<Expr>& leaves = whole_.leaves();
    for (std::size_t i = leaves.size(); i-- > 0;)  // x last: x′ may be a state itself
      if (const double value = entry_of(point, i); std::isfinite(value))
        values[own[i]] = values[leaves[i]] = value;
    return values;
  }

  Simulation following(const dae::ModelPtr& model, const Point& end) {
    dae::StartRequest request;
    set_conditions(simulation_, end.t, request);
    const auto values = values_at(end);
    const auto take = [&](const std::vector<Expr>& unknowns, auto& conditions) {
      for (Expr leaf : unknowns)
        if (const auto value = values.find(dae::original_leaf(*model, leaf)); value != values.end())
          conditions.emplace_back(leaf, value->second);
    };
    take(model->states(), request.fix);
    if (chooses_at_point()) take(model->algebraic(), request.guess);
    request.nearest = true;
    Simulation part = simulation_;
    part.start = dae::init(model, request);
    if (!whole_.continues_at(*part.start)) throw Failure("this choice has another solution");
    part.plan.from = end.t;
    part.rtol = whole_.tolerances_in(model, simulation_.rtol);
    part.atol = whole_.tolerances_in(model, atol());
    return part;
  }

  /// For unknowns that are 0 at the start of a later piece to within rounding, the tolerances of the
  /// first piece apply.
  ToleranceRequest atol() const {
    ToleranceRequest request = simulation_.atol;
    const std::vector<Expr>& leaves = whole_.leaves();
    const auto n = static_cast<std::size_t>(problem_->n());
    const bool given = request.all || !request.list.empty();
    for (std::size_t i = 0; i < static_cast<std::size_t>(usual_atol_.size()) && !given; ++i) {
      const Expr leaf = leaves[i < n ? i : n + i];  // leaves: x, x′, z
      const auto own = std::find_if(request.some.begin(), request.some.end(), [&](const auto& some) {
        return dae::original_leaf(*first_, dae::resolve(*first_, some.first)) == leaf;
      });
      if (own == request.some.end()) request.some.emplace_back(leaf, usual_atol_[i]);
    }
    return request;
  }

  dae::ModelPtr first_;
  const Simulation& simulation_;
  dae::ModelPtr source_;
  ProblemPtr problem_;
  SolutionInParts whole_;
  Vec usual_atol_;
  bool degraded_ = false;
  std::string no_choice_;  ///< why other constraints do not serve, once tried
};

}  // namespace

bool leaves_out_constraints(const dae::ModelPtr& model) {
  const dae::ModelPtr made = mechanism_of(model);
  if (!made) return false;
  const auto all = dae::dependent_constraints(made->mechanics ? *made : *made->dependent);
  if (all.C.size() < 2) return false;
  const std::size_t kept = kept_in(*made, all).size();
  if (kept == 0 || static_cast<Index>(kept) == all.C.size()) return false;
  // a form with gains of the user's choice is not made again
  return model->form != "baumgarte" || dae::reduce(made, model->form)->residuals == model->residuals;
}

TrajectoryPtr simulate_keeping(const dae::ModelPtr& model, const Simulation& simulation) {
  const dae::ModelPtr made = mechanism_of(model);
  const auto all = dae::dependent_constraints(*mechanism_with_values(model));
  const std::vector<Index> kept = kept_in(*made, all);
  Simulation plain = simulation;
  plain.sensitivities.clear();
  const auto monitor = std::make_shared<KeptMonitor>(all, kept, model, plain);
  Simulation watched = simulation;
  watched.chosen = ChosenOutside::constraints;
  const std::string why = dependent_text(*made, all, kept,
                                         "A run with sensitivities cannot choose others; without them it "
                                         "does: take differences of runs");
  watched.plan.stop_when = [monitor, why, own = simulation.plan.stop_when](const Point& point) {
    if (monitor->is_much_worse(point)) throw Failure(why);
    return own && own(point);
  };
  return simulate(model, watched);
}

TrajectoryPtr simulate_rekeeping(const dae::ModelPtr& model, const Simulation& simulation) {
  return ConstraintReselection(model, simulation).run();
}

}  // namespace pendula::integrate
