#include "integrate/simulation/array_run.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/lru_cache.hpp"
#include "base/text.hpp"
#include "codegen/kernel/kernel.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/forms.hpp"
#include "dae/model/lineage.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "expr/print/print.hpp"
#include "integrate/simulation/problem_setup.hpp"
#include "integrate/simulation/run_parts.hpp"

namespace pendula::integrate {
namespace {

using Index = Eigen::Index;
using Values = std::unordered_map<Expr, double>;

// regularity relative to that of the first step below which the rows are chosen again
constexpr double min_regularity = 0.1;
constexpr long most_choices = 10'000;
// of the run: progress that failed rows must have made to be chosen once more
constexpr double min_progress = 1e-3;

/// What is left of the regularity of the chosen rows: the reciprocal condition number of their Jacobian,
/// relative to that at the first point, in the scaling of that point. Balanced: divided by largest entries,
/// in nanometres other directions may hide the one that is lost. Where rounding errors in place of 0 spoil
/// that, divided by largest entries.
class Regularity {
 public:
  Regularity(const dae::ModelPtr& model, const Simulation& simulation)
      : problem_(make_problem(model, simulation)), entries_(dae::top_jacobian(*model)) {
    std::vector<Expr> slopes;
    for (const Entry& e : entries_) slopes.push_back(substitute(e.value, simulation.inputs));
    kernel_ = codegen::Kernel(slopes, problem_->arguments());
    size_ = static_cast<Index>(model->residuals.size());
  }

  double operator()(const Point& point) {
    problem_->set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
    const std::vector<double> values = kernel_(problem_->values());
    Mat J = Mat::Zero(size_, size_);
    for (std::size_t k = 0; k < values.size(); ++k) J(entries_[k].row, entries_[k].column) = values[k];
    if (J.size() == 0 || !J.allFinite()) return 0;
    if (!std::exchange(measured_, true)) measure(J);
    return first_ > 0 ? rcond(scaling_(J)) / first_ : 1;
  }

 private:
  static double rcond(const Mat& J) {
    const double rcond = Eigen::PartialPivLU<Mat>(J).rcond();
    return std::isfinite(rcond) ? rcond : 0;  // a zero pivot gives NaN
  }

  void measure(const Mat& J) {
    scaling_ = dae::balance(J);
    first_ = rcond(scaling_(J));
    if (first_ > eps) return;
    Mat divided = J;
    const dae::LargestEntries largest = dae::divide_by_largest(divided);
    scaling_ = {largest.rows.cwiseInverse(), largest.columns.cwiseInverse()};
    first_ = rcond(scaling_(J));
  }

  ProblemPtr problem_;
  std::vector<Entry> entries_;
  codegen::Kernel kernel_;
  Index size_ = 0;
  bool measured_ = false;
  dae::Balance scaling_;
  double first_ = 0;
};

class ArrayRun {
 public:
  ArrayRun(const dae::ModelPtr& model, const Simulation& simulation)
      : first_(model),
        simulation_(simulation),
        source_(dae::to_first_order(dae::original(model))),
        whole_(model, simulation, leaves_in_source(*model, *make_problem(model, simulation))) {}

  TrajectoryPtr run() {
    Simulation part = simulation_;
    part.plan.times.reset();
    dae::ModelPtr model = chosen_for_start(part);
    if (model != first_) record_states(*first_, part.plan.from, *model, part.plan.from);
    RunOutcome outcome;
    for (long k = 0; k < most_choices; ++k) {
      const double from = part.plan.from;
      const TrajectoryPtr trajectory = piece(model, part);
      outcome = trajectory->solution().outcome();
      if (whole_.is_stopped()) break;
      const Solution& done = *whole_.pieces().last().solution;
      const bool broke =
          outcome.ending == Ending::stopped && done.size() > 0 && (k == 0 || done.t().back() > from);
      const auto next = outcome.ending == Ending::stop_when || broke
                            ? chosen_anew(model, done.problem(), done.final(), part)
                            : std::nullopt;
      if (k == 0 && model == first_ && !simulation_.plan.times && outcome.ending != Ending::stop_when &&
          (!next || *next == model))
        return trajectory;  // unchanged, with its steps for adjoints
      const bool stays = next && *next == model && done.t().back() == from;
      if ((!next || stays) && outcome.ending == Ending::stop_when) {
        if (!keeps(model, part)) {
          outcome =
              stopped_at(done.t().back(), "no other rows of the derivative array determine the solution");
          break;
        }
        watches_ = false;  // continue with the present rows until they fail, so that the message tells why
        continue;
      }
      if (!next) break;
      watches_ = true;
      const bool hardly_advances =
          has_rows_of(**next, *model) && done.t().back() - from < min_progress * length();
      if (broke && hardly_advances) break;
      if (*next != model) record_states(*model, simulation_.plan.from, **next, done.t().back());
      model = *next;
    }
    return whole_.finish(outcome);
  }

 private:
  /// The leaves of a problem, in the order x, x′, z, as leaves of the model that the form was made from.
  static std::vector<Expr> leaves_in_source(const dae::Model& model, const Problem& problem) {
    std::vector<Expr> list = leaves_of(problem);
    for (Expr& leaf : list) leaf = dae::original_leaf(model, leaf);
    return list;
  }

  TrajectoryPtr piece(const dae::ModelPtr& model, Simulation& part) {
    const auto regularity = std::make_shared<Regularity>(model, simulation_);
    part.chosen = ChosenOutside::all;
    part.plan.stop_when = whole_.stop_when(model, [this, regularity](const Point& point) {
      return watches_ && (*regularity)(point) < min_regularity;
    });
    part.rtol = whole_.tolerances_in(model, simulation_.rtol);
    part.atol = whole_.tolerances_in(model, simulation_.atol);
    const TrajectoryPtr trajectory = simulate(model, part);
    const SolutionPtr solution(trajectory, &trajectory->solution());
    whole_.add({model, solution, part.plan.from}, simulation_.events.size());
    return trajectory;
  }

  /// Chooses the rows for the start. Rows that were chosen at another point may determine the unknowns here
  /// only together with the constants that replaced open derivatives, as for a moving mechanism at rest: they
  /// are regular but wrong. The last choices are cached for loops that start again and again at one point.
  dae::ModelPtr chosen_for_start(Simulation& part) const {
    constexpr std::size_t few = 8;
    using Key = std::pair<dae::ModelPtr, dae::ConsistentStatePtr>;
    struct Hash {
      std::size_t operator()(const Key& key) const {
        return std::hash<dae::ModelPtr>()(key.first) ^ 31 * std::hash<dae::ConsistentStatePtr>()(key.second);
      }
    };
    static LruCache<Key, dae::ModelPtr, Hash> known(few);
    const Key key{first_, simulation_.start};
    const bool plain = simulation_.parameters.empty() && simulation_.inputs.empty() &&
                       simulation_.numeric_inputs.empty() && simulation_.plan.from == simulation_.start->t;
    const auto* found = plain ? known.find(key) : nullptr;
    if (found && *found == first_) return first_;
    const ProblemPtr problem = make_problem(first_, simulation_);
    const Point start = start_point(*problem, simulation_);
    if (found) {
      part.start = dae::init(*found, request(**found, values_at(*first_, *problem, start), start.t));
      return *found;
    }
    const auto next = chosen_anew(first_, *problem, start, part);
    if (!next || *next == first_) part.start = simulation_.start;
    return plain ? known.insert(key, next.value_or(first_)) : next.value_or(first_);
  }

  double length() const { return simulation_.plan.to - simulation_.plan.from; }

  /// Do both use the same rows of the derivative array and the same states? Constants in the rows may differ.
  static bool has_rows_of(const dae::Model& model, const dae::Model& other) {
    return model.states() == other.states() &&
           std::equal(model.blocks.begin(), model.blocks.end(), other.blocks.begin(), other.blocks.end(),
                      [](const dae::Block& a, const dae::Block& b) { return a.note == b.note; });
  }

  /// Records a change of the states; other rows may have the same ones.
  void record_states(const dae::Model& before, double from, const dae::Model& next, double t) {
    const std::string old = dae::grouped_names(before.states()), now = dae::grouped_names(next.states());
    if (old == now) return;
    if (!std::exchange(switched_, true)) whole_.solution().add_states({from, old});
    whole_.solution().add_states({t, now});
  }

  /// Chooses rows for a point of a run with other rows and sets the start in `part`; empty if there are none.
  std::optional<dae::ModelPtr> chosen_anew(const dae::ModelPtr& before, const Problem& problem,
                                           const Point& end, Simulation& part) const {
    dae::ReduceOptions options;
    options.at = values_at(*before, problem, end);
    try {
      dae::ModelPtr model = dae::reduce_array(source_, options);
      if (model->residuals == before->residuals) model = before;
      const dae::ConsistentStatePtr start = dae::init(model, request(*model, options.at, end.t));
      if (!whole_.continues_at(*start)) return {};
      part.start = start;
      part.plan.from = end.t;
      return model;
    } catch (const UserFacing&) {
      return {};
    }
  }

  /// Sets the start in `part` to the end of the last piece, with the same rows.
  bool keeps(const dae::ModelPtr& model, Simulation& part) {
    const Solution& solution = *whole_.pieces().last().solution;
    const Point end = solution.final();
    try {
      const auto start = dae::init(model, request(*model, values_at(*model, solution.problem(), end), end.t));
      if (!whole_.continues_at(*start)) return false;
      part.start = start;
      part.plan.from = end.t;
      return true;
    } catch (const UserFacing&) {
      return false;
    }
  }

  /// Values by the names of the source and by those of the form, which may differ: v_x of a second-order
  /// model is x′ there. From the start of the run only parameters and other constants are taken.
  Values values_at(const dae::Model& model, const Problem& problem, const Point& end) const {
    Values values;
    for (const auto& [leaf, value] : simulation_.start->values)
      if (symbol_of(leaf).kind != Kind::variable) values[leaf] = value;
    values[time_symbol()] = end.t;
    const std::vector<Expr> own = leaves_of(problem), leaves = leaves_in_source(model, problem);
    for (std::size_t i = leaves.size(); i-- > 0;)  // x last: x′ may be a state itself
      values[leaves[i]] = values[own[i]] = entry_of(end, i);
    return values;
  }

  dae::StartRequest request(const dae::Model& model, const Values& values, double t) const {
    dae::StartRequest request;
    set_conditions(simulation_, t, request);
    request.keep_invariants = false;
    for (Expr x : model.states()) request.fix.emplace_back(x, values.at(x));
    for (const auto& list : {model.top_derivatives(), model.algebraic()})
      for (Expr leaf : list)
        if (const auto at = values.find(dae::original_leaf(model, leaf)); at != values.end())
          request.guess.emplace_back(leaf, at->second);
    return request;
  }

  dae::ModelPtr first_;
  const Simulation& simulation_;
  dae::ModelPtr source_;
  SolutionInParts whole_;
  bool switched_ = false;
  bool watches_ = true;  ///< whether a piece ends when its rows have lost most of their regularity
};

}  // namespace

bool chooses_rows(const dae::Model& model, const Simulation& simulation) {
  return model.form == "array" && std::all_of(simulation.events.begin(), simulation.events.end(),
                                              [](const ModelEvent& event) { return event.reset.empty(); });
}

TrajectoryPtr simulate_rechoosing(const dae::ModelPtr& model, const Simulation& simulation) {
  return ArrayRun(model, simulation).run();
}

}  // namespace pendula::integrate
