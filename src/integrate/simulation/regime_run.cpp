#include "integrate/simulation/regime_run.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "dae/start/regime_jump.hpp"
#include "dae/start/regimes.hpp"
#include "expr/print/print.hpp"
#include "integrate/event/zeno_detector.hpp"
#include "integrate/simulation/problem_setup.hpp"
#include "integrate/simulation/regime_impacts.hpp"
#include "integrate/simulation/run_parts.hpp"
#include "integrate/simulation/usual_tolerances.hpp"

namespace pendula::integrate {
namespace {

constexpr long most_regimes = 100'000;

/// The values, together with their largest magnitudes so far.
dae::Sizes sizes_with(const dae::PointValues& values, const std::unordered_map<Expr, double>& before) {
  dae::Sizes sizes{values};
  for (const auto& [leaf, size] : before)
    if (const auto at = sizes.of.find(leaf); at != sizes.of.end())
      at->second = std::max(std::fabs(at->second), size);
  return sizes;
}

dae::PointValues values_at(const Solution& solution, const Point& point, Expr e) {
  dae::PointValues values;
  values[time_symbol()] = point.t;
  const std::vector<Expr> inside = leaves({&e, 1});
  const Vec there = solution.values(inside, point);
  for (std::size_t k = 0; k < inside.size(); ++k) values[inside[k]] = there[k];
  return values;
}

/// The start of a regime, translated to the unknowns of its form.
dae::ConsistentStatePtr translated(const dae::ConsistentStatePtr& at, const dae::ModelPtr& form) {
  if (at->model == form) return at;
  auto there = std::make_shared<dae::ConsistentState>(*at);
  there->model = form;
  there->piece = nullptr;  // refers to other unknowns
  for (const auto& list : {form->states(), form->top_derivatives(), form->algebraic()})
    for (Expr leaf : list)
      if (const auto value = at->value_for(*form, leaf)) there->values[leaf] = *value;
  return there;
}

/// Tolerance of the values at the end of a piece: the largest rtol, and the sizes below which atol dominates.
dae::Regimes::Tolerance tolerance_of(const dae::Model& model, const Simulation& simulation) {
  const ToleranceRequest &relative = simulation.rtol, &absolute = simulation.atol;
  dae::Regimes::Tolerance known{usual_rtol(simulation), {}};
  const double usual = absolute.all.value_or(1e-3 * known.rtol);
  for (const auto& [leaf, value] : relative.some) known.rtol = std::max(known.rtol, value);
  for (double value : relative.list) known.rtol = std::max(known.rtol, value);
  if (known.rtol <= 0) return {};
  for (const auto& list : {model.states(), model.algebraic()})
    for (Expr leaf : list) {
      const std::size_t i = known.least.size();
      double atol = i < absolute.list.size() ? absolute.list[i] : usual;
      for (const auto& [some, value] : absolute.some)
        if (dae::resolve(model, some) == leaf) atol = value;
      known.least.emplace_back(leaf, atol / known.rtol);
    }
  return known;
}

Error none_goes_on(double t, const std::string& why) {
  return Error(text("at the start, t = ", rounded(t, 6), ", no regime of this piecewise model goes on from ",
                    "these values.", why));
}

std::string not_shared(Expr law) {
  return text("an impact propagates through the contact ", to_text(law),
              ", for which an event names a law, while ",
              "another contact in its path has none: the model does not determine how they share it. Give ",
              "every contact that they touch an event with a reset, or none");
}

/// The signs of the event conditions.
std::vector<double> sides_of(const std::vector<ModelEvent>& events, const dae::ModelPtr& model,
                             const dae::StartRequest& here) {
  std::vector<double> sides;
  if (events.empty()) return sides;
  const dae::PointValues values = dae::values_before(*model, here);
  for (const ModelEvent& event : events) {
    const double g = dae::value_at(dae::resolve(*model, event.when), values);
    sides.push_back((g > 0) - (g < 0));
  }
  return sides;
}

/// Can the reset of an event change the sign of a margin?
bool is_reset(Expr margin, const std::vector<ModelEvent>& events, const dae::Model& model) {
  for (const ModelEvent& event : events)
    for (const auto& [state, value] : event.reset)
      if (depends_on(margin, dae::resolve(model, state))) return true;
  return false;
}

class RegimeRun {
 public:
  RegimeRun(const dae::ModelPtr& model, const Simulation& simulation)
      : model_(model),
        simulation_(simulation),
        tolerance_(tolerance_of(*model, simulation)),
        regimes_(model),
        whole_(model, simulation, leaves_of(*make_problem(model, simulation))),
        impacts_(model, simulation, regimes_),
        t_(simulation.plan.from) {}

  TrajectoryPtr run() {
    std::string why;
    for (const auto& list : {model_->states(), model_->top_derivatives(), model_->algebraic()})
      for (Expr leaf : list)
        if (const auto value = simulation_.start->value_for(*model_, leaf)) values_[leaf] = *value;
    auto next = regimes_.enter(request(), regimes_.active(simulation_.start->values), {}, why, {});
    if (!next) throw none_goes_on(t_, why);
    RunOutcome outcome;
    for (long k = 0; next; ++k) {
      outcome = piece(*next);
      if (in_wrong_regime_) {  // another regime holds from here on
        next = was_in_wrong_regime_
                   ? std::nullopt
                   : regimes_.enter(request(), next->regime->choice, next->regime->choice, why, {});
        if (!next && whole_.pieces().empty()) throw none_goes_on(t_, why);
        if (!next) outcome = stopped_at(t_, "no regime of this piecewise model goes on from here." + why);
        was_in_wrong_regime_ = true;
        continue;
      }
      was_in_wrong_regime_ = false;
      const bool stuck = outcome.ending == Ending::stopped;  // for example where events accumulate
      if (t_ >= simulation_.plan.to && (left_ || outcome.ending == Ending::finished)) {
        outcome = {Ending::finished, ""};
        if (left_ || is_near_border(*whole_.pieces().last().solution, *next)) arrive(*next->regime);
      }
      if ((!left_ && !stuck) || outcome.ending == Ending::finished || k == most_regimes) break;
      why.clear();
      const std::uint64_t here = next->regime->choice;
      const double interval = simulation_.plan.to - simulation_.plan.from;
      const bool accumulates = zeno_.add(t_, whole_.stats().steps, interval) || stuck;
      if (accumulates) zeno_ = {};
      next =
          regimes_.enter(request(), here, accumulates ? std::optional(here) : std::nullopt, why, tolerance_);
      if (!next && !stuck)
        outcome = stopped_at(t_, "no regime of this piecewise model goes on from here." + why);
      if (next && !accumulates && is_shared(*next, outcome)) next.reset();
    }
    return whole_.finish(outcome);
  }

 private:
  /// Integrates in one regime; left_ tells whether the piece ended at its border.
  RunOutcome piece(const dae::RegimeStart& start) {
    const dae::Regime& regime = *start.regime;
    Simulation part = simulation_;
    if (!events_applied_ && !whole_.pieces().empty())
      part.plan.events.sides = sides_of(simulation_.events, model_, request());
    events_applied_ = false;
    part.plan.from = t_;
    part.plan.times.reset();
    part.events = impacts_.events_in(regime);
    const std::size_t asked = part.events.size();
    for (std::size_t i = 0; i < regime.region.margins.size(); ++i) {
      ModelEvent end;
      end.when = regime.region.margins[i] + Expr(start.slack[i]);
      end.direction = is_reset(end.when, simulation_.events, *model_) ? dae::Direction::falling_or_negative
                                                                      : dae::Direction::falling;
      end.stop = true;
      part.events.push_back(std::move(end));
    }
    part.start = translated(start.at, regime.form);
    const TrajectoryPtr trajectory = simulate(regime.form, part);
    const SolutionPtr solution(trajectory, &trajectory->solution());
    in_wrong_regime_ = is_left_unseen(*solution, start);
    if (in_wrong_regime_) return solution->outcome();
    const std::vector<EventRecord>& events = solution->events();
    left_ = solution->ending() == Ending::event && !events.empty() &&
            std::any_of(events.begin(), events.end(), [&](const EventRecord& e) {
              return static_cast<std::size_t>(e.which) >= asked && e.t == events.back().t;
            });
    if (solution->ending() == Ending::event && stops_by_user(events)) left_ = false;
    add(regime, solution, asked);
    const int apart = 1 + solution->size() / 100;
    for (int i = 0; i < solution->size(); i += apart) measure(whole_.pieces().translated(solution->point(i)));
    const Point end = whole_.pieces().translated(solution->final());
    remember(end);
    RunOutcome outcome = solution->outcome();
    if (outcome.ending == Ending::event) apply_events(regime, events, outcome);
    return outcome;
  }

  /// Applies the events that ended the piece.
  void apply_events(const dae::Regime& regime, const std::vector<EventRecord>& events, RunOutcome& outcome) {
    std::vector<RegimeImpacts::Impact> impacts;
    try {
      impacts = impacts_.settle(events, regime, request(), measures(), values_);
    } catch (const Failure& e) {
      left_ = false;
      outcome = stopped_at(t_, e.what());
    }
    if (!impacts_.remark().empty() && whole_.solution().not_unique().empty())
      whole_.solution().set_not_unique(impacts_.remark());
    events_applied_ = !impacts.empty();
    for (const RegimeImpacts::Impact& impact : impacts) {
      left_ = !impact.stop;
      const bool resets = impact.before != impact.after;
      whole_.solution().add_event({t_, impact.which,
                                   impact.stop ? "stop"
                                   : resets    ? "reset"
                                               : "",
                                   point_of(impact.before), point_of(impact.after)});
    }
    if (events_applied_ && !left_ && outcome.ending == Ending::event) arrive(regime);
  }

  /// Ends the run at a border of the regime: the final values are those of the next regime if there is one.
  void arrive(const dae::Regime& regime) {
    const Solution& ended = *whole_.pieces().last().solution;
    std::string why;
    const auto next = regimes_.enter(request(), regime.choice, {}, why, tolerance_);
    if (!next || (!next->jumps && !events_applied_ && next->regime->choice == regime.choice)) return;
    Simulation part = simulation_;
    part.plan.from = t_;
    part.start = translated(next->at, next->regime->form);
    const ProblemPtr problem = make_problem(next->regime->form, part);
    const auto solution = std::make_shared<Solution>(problem);
    solution->set_method(ended.method_name(), ended.dt());
    solution->save(start_point(*problem, part));
    solution->finish({Ending::finished, ""}, {}, 0);
    add(*next->regime, solution, simulation_.events.size());
  }

  /// Does a margin that was 0 at the beginning of the piece vanish, to within rounding, at its end?
  bool is_near_border(const Solution& ended, const dae::RegimeStart& start) const {
    constexpr double near = 1e-13;  // relative to the terms, for rounding; Regimes::enter() decides
    for (std::size_t i = 0; i < start.slack.size(); ++i) {
      const Expr margin = dae::resolve(*start.regime->form, start.regime->region.margins[i]);
      if (start.slack[i] > 0) continue;
      const dae::PointValues values = values_at(ended, ended.final(), margin);
      if (dae::value_at(margin, values) <= near * dae::size_of(margin, values, sizes_with(values, sizes_)))
        return true;
    }
    return false;
  }

  void add(const dae::Regime& regime, const SolutionPtr& solution, std::size_t shown) {
    if (const std::string where = text(regime.region.where, " (index ", regime.index, ")"); where != regime_)
      whole_.solution().add_regime({t_, regime_ = where});
    whole_.add({regime.form, solution, t_, true, impacts_.deferred()}, shown);
  }

  /// Has a margin become negative that is 0 at the beginning of the piece, together with all its known
  /// derivatives? A root at the beginning is not detected as a crossing.
  bool is_left_unseen(const Solution& solution, const dae::RegimeStart& start) const {
    constexpr double visible = 100;  // tolerances of the run
    for (Expr undecided : start.undecided) {
      const Expr margin = dae::resolve(*start.regime->form, undecided);
      Eigen::Index at = 0;
      if (!(solution.values({&margin, 1}).col(0).minCoeff(&at) < 0)) continue;
      const Point& point = solution.point(static_cast<int>(at));
      dae::PointValues values = start.at->values;
      values[time_symbol()] = point.t;
      const std::vector<Expr> inside = leaves({&margin, 1});
      const Vec there = solution.values(inside, point);
      for (std::size_t k = 0; k < inside.size(); ++k) values[inside[k]] = there[k];
      dae::Sizes sizes{values};
      for (const auto& [leaf, least] : tolerance_.least)
        if (const auto known = sizes.of.find(leaf); known != sizes.of.end())
          known->second = std::max(std::fabs(known->second), least);
      const double size = dae::size_of(margin, values, sizes);
      if (dae::value_at(margin, values) < -visible * tolerance_.rtol * size) return true;
    }
    return false;
  }

  bool stops_by_user(const std::vector<EventRecord>& events) const {
    return std::any_of(events.begin(), events.end(), [&](const EventRecord& e) {
      const auto which = static_cast<std::size_t>(e.which);
      return which < impacts_.deferred().size() && !impacts_.deferred()[which] && e.action == "stop";
    });
  }

  /// Does an impulse act on a contact that has a law in an event together with one that has none?
  bool is_shared(const dae::RegimeStart& next, RunOutcome& outcome) const {
    const Expr law = impacts_.law_sharing_impulse(next, request(), measures());
    if (law.is_zero()) return false;
    outcome = stopped_at(t_, not_shared(law));
    return true;
  }

  dae::Sizes measures() const { return {sizes_}; }

  Point point_of(const RegimeImpacts::Values& values) const {
    const std::vector<Expr>& leaves = whole_.leaves();
    const auto n = static_cast<Eigen::Index>(model_->states().size());
    Vec all(static_cast<Eigen::Index>(leaves.size()));
    for (std::size_t i = 0; i < leaves.size(); ++i) all[i] = values.at(leaves[i]);
    return {t_, all.head(n), all.segment(n, n), all.tail(all.size() - 2 * n)};
  }

  /// Updates the sizes relative to which values are judged.
  void measure(const Point& point) {
    const std::vector<Expr>& leaves = whole_.pieces().leaves();
    for (std::size_t i = 0; i < leaves.size(); ++i) {
      const double value = entry_of(point, i);
      double& size = sizes_[leaves[i]];
      if (std::isfinite(value)) size = std::max(size, std::fabs(value));
    }
  }

  void remember(const Point& end) {
    t_ = end.t;
    const std::vector<Expr>& leaves = whole_.pieces().leaves();
    for (std::size_t i = leaves.size(); i-- > 0;)  // x last: x′ may be a state itself
      values_[leaves[i]] = entry_of(end, i);
  }

  /// The states as fixes, everything else as guesses.
  dae::StartRequest request() const {
    dae::StartRequest request;
    set_conditions(simulation_, t_, request);
    for (Expr x : model_->states()) request.fix.emplace_back(x, values_.at(x));
    for (const auto& list : {model_->top_derivatives(), model_->algebraic()})
      for (Expr leaf : list)
        if (const auto at = values_.find(leaf); at != values_.end())
          request.guess.emplace_back(leaf, at->second);
    request.sizes.assign(sizes_.begin(), sizes_.end());
    return request;
  }

  dae::ModelPtr model_;
  const Simulation& simulation_;
  const dae::Regimes::Tolerance tolerance_;
  dae::Regimes regimes_;
  SolutionInParts whole_;
  RegimeImpacts impacts_;
  std::unordered_map<Expr, double> values_;  ///< of the model's leaves, where the next piece begins
  std::unordered_map<Expr, double> sizes_;   ///< the largest they have been
  double t_;
  std::string regime_;
  bool left_ = false;
  bool events_applied_ = false;       ///< events have changed the states since the last piece
  bool in_wrong_regime_ = false;      ///< the last piece was in a wrong regime
  bool was_in_wrong_regime_ = false;  ///< the one before, too
  ZenoDetector zeno_;
};

}  // namespace

bool changes_regime(const dae::Model& model, const Simulation& simulation) {
  if (simulation.plan.dt || simulation.plan.direct || !simulation.sensitivities.empty()) return false;
  if (!model.form.empty() || !model.invariants.empty() || simulation.plan.stop_when) return false;
  return dae::regimes_differ(model);
}

TrajectoryPtr simulate_regimes(const dae::ModelPtr& model, const Simulation& simulation) {
  return RegimeRun(model, simulation).run();
}

}  // namespace pendula::integrate
