#include "integrate/simulation/regime_impacts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/decompositions.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"
#include "integrate/event/resets.hpp"
#include "integrate/simulation/problem_setup.hpp"
#include "integrate/simulation/run_parts.hpp"

namespace pendula::integrate {

RegimeImpacts::RegimeImpacts(dae::ModelPtr model, const Simulation& simulation, dae::Regimes& regimes)
    : model_(std::move(model)), simulation_(simulation), regimes_(regimes) {
  for (const ModelEvent& event : simulation_.events) when_.push_back(dae::resolve(*model_, event.when));
  happened_.assign(when_.size(), -std::numeric_limits<double>::infinity());
  interval_ = simulation_.plan.to - simulation_.plan.from;
}

std::vector<ModelEvent> RegimeImpacts::events_in(const dae::Regime& regime) {
  std::vector<ModelEvent> events = simulation_.events;
  deferred_.assign(events.size(), 0);
  replies_.assign(events.size(), {});
  for (std::size_t i = 0; i < events.size(); ++i) {
    ModelEvent& event = events[i];
    if (event.reset.empty() && !event.call) continue;
    deferred_[i] = 1;
    event.call = [this, i, call = event.call, resets = !event.reset.empty(),
                  stops = event.stop](const std::shared_ptr<const Trajectory>& so_far) {
      EventReply reply = call ? call(so_far) : EventReply{};
      reply.stop = reply.stop || stops;
      replies_[i] = reply;
      reply.stop = reply.stop || resets || !reply.reset.empty();
      reply.reset.clear();
      return reply;
    };
    event.reset.clear();
    event.stop = false;
  }
  return events;
}

RegimeImpacts::Values RegimeImpacts::all(const Values& values) const {
  Values at = known_;
  for (const auto& [leaf, value] : values) at[leaf] = value;
  return at;
}

Vec RegimeImpacts::gradient_of(Expr e, const std::vector<Expr>& x, const Values& at) const {
  Vec d = Vec::Zero(static_cast<Eigen::Index>(x.size()));
  for (const Entry& entry : sparse_jacobian({&e, 1}, x)) d[entry.column] = dae::value_at(entry.value, at);
  return d;
}

/// d when/dt if the equations of the regime determine it from the states, which need not satisfy the
/// conditions of the regime.
std::optional<double> RegimeImpacts::slope(Expr when, const Values& at) const {
  constexpr double visible = 1e-9;  // of the row that is to be combined: rounding leaves far less
  std::vector<Expr> unknowns = form_.xdot;
  unknowns.insert(unknowns.end(), form_.z.begin(), form_.z.end());
  const auto n = static_cast<Eigen::Index>(form_.x.size());
  Mat A = Mat::Zero(static_cast<Eigen::Index>(form_.F.size()), static_cast<Eigen::Index>(unknowns.size()));
  for (const Entry& e : sparse_jacobian(form_.F, unknowns)) A(e.row, e.column) = dae::value_at(e.value, at);
  Vec right(A.rows()), y(A.cols());
  for (Eigen::Index i = 0; i < A.rows(); ++i) right[i] = -dae::value_at(form_.F[i], at);
  for (Eigen::Index j = 0; j < A.cols(); ++j) y[j] = dae::value_at(unknowns[j], at);
  right += A * y;
  Vec d = Vec::Zero(A.cols());
  d.head(n) = gradient_of(when, form_.x, at);
  double own = dae::value_at(total_derivative(when), at);
  for (Eigen::Index i = 0; i < n; ++i) own -= d[i] * dae::value_at(derivative_leaf(form_.x[i]), at);
  // solves d = Aᵀ w, equilibrated
  const auto inverse = [](double s) { return s > 0 ? 1 / s : 1.0; };
  const Vec row = A.rowwise().norm().unaryExpr(inverse);
  const Mat scaled = row.asDiagonal() * A;
  const Vec column = scaled.colwise().norm().transpose().unaryExpr(inverse);
  const Mat K = (scaled * column.asDiagonal()).transpose();
  const Vec wanted = column.cwiseProduct(d);
  const Vec w = K.completeOrthogonalDecomposition().solve(wanted);
  if (!((K * w - wanted).norm() <= visible * wanted.norm())) return {};
  return own + w.dot(row.cwiseProduct(right));
}

bool RegimeImpacts::is_at_root(Expr when, const Values& at, const dae::Sizes& sizes, double fastest) const {
  // relative to the terms; relative to the change over the run
  constexpr double of_terms = 1e-9, of_time = 1e-12;
  const double g = std::fabs(dae::value_at(when, at));
  const double t = std::fabs(known_.at(time_symbol()));
  return g <= of_time * fastest * std::max(interval_, t) || g <= of_terms * dae::size_of(when, at, sizes);
}

AtRoots RegimeImpacts::at_roots(const Values& before, const Values& here, const dae::Sizes& sizes) const {
  std::vector<dae::Direction> directions;
  for (const ModelEvent& event : simulation_.events) directions.push_back(event.direction);
  AtRoots roots(directions);
  std::vector<std::optional<double>> slopes;
  for (Expr when : when_) {
    slopes.push_back(slope(when, before));
    for (const auto& known : {slopes.back(), slope(when, here)})
      if (known) roots.measure(*known);
  }
  for (std::size_t i = 0; i < when_.size(); ++i) {
    if (!slopes[i] || !dae::is_strict(directions[i])) continue;
    if (is_at_root(when_[i], before, sizes, roots.fastest()) &&
        is_at_root(when_[i], here, sizes, roots.fastest()))
      roots.add(i, *slopes[i], known_.at(time_symbol()) - happened_[i], interval_);
  }
  return roots;
}

void RegimeImpacts::remark_order(int which) {
  if (remark_.empty()) remark_ = order_remark(known_.at(time_symbol()), when_[which]);
}

/// As EventHandler::overdue(), but at a root the slope alone decides.
std::optional<int> RegimeImpacts::overdue(const Values& here, const dae::Sizes& sizes,
                                          const AtRoots& roots) const {
  for (std::size_t i = 0; i < when_.size(); ++i) {
    const ModelEvent& event = simulation_.events[i];
    if (!dae::counts_beyond(event.direction)) continue;
    const double sign = dae::sign_of_slope(event.direction), beyond = sign * dae::value_at(when_[i], here);
    if (is_at_root(when_[i], here, sizes, roots.fastest())) {
      if (roots.is_leaving(sign * slope(when_[i], here).value_or(0))) return static_cast<int>(i);
    } else if (beyond > 0) {
      return static_cast<int>(i);
    }
  }
  return {};
}

/// Restores the conditions common to all regimes as a model without regimes does: by changing states that
/// were not reset.
void RegimeImpacts::keep_lasting(const dae::Regime& regime, const std::vector<Expr>& reset, Values& values) {
  const ProblemPtr problem = make_problem(model_, simulation_);
  std::vector<Expr> lasting;
  for (Expr c : regimes_.lasting_conditions(regime))
    lasting.push_back(substitute(dae::resolve(*model_, c), simulation_.inputs));
  const auto repair = reinitialiser(lasting, problem);
  if (!repair) return;
  const std::vector<Expr> leaves = leaves_of(*problem);
  const auto n = static_cast<std::size_t>(problem->n());
  Point point{known_.at(time_symbol()), Vec::Zero(problem->n()), Vec::Zero(problem->n()),
              Vec::Zero(problem->m())};
  std::vector<int> held;
  for (std::size_t i = 0; i < n; ++i) {
    point.x[i] = values.at(leaves[i]);
    if (std::find(reset.begin(), reset.end(), leaves[i]) != reset.end()) held.push_back(static_cast<int>(i));
  }
  repair(point, held);
  for (std::size_t i = 0; i < n; ++i) values[leaves[i]] = point.x[i];
}

RegimeImpacts::Impact RegimeImpacts::apply(int which, const EventReply& reply, const dae::Regime& regime,
                                           Values& values) {
  Impact impact{which, reply.stop, values, {}};
  happened_[which] = known_.at(time_symbol());
  const Values at = all(values);
  std::vector<std::pair<Expr, double>> changes = reply.reset;
  for (const auto& [state, value] : simulation_.events[which].reset)
    changes.emplace_back(state, dae::value_at(dae::resolve(*model_, value), at));
  const std::vector<Expr> states = model_->states();
  std::vector<Expr> reset;
  for (const auto& [state, value] : changes) {
    const Expr leaf = dae::resolve(*model_, state);
    if (std::find(states.begin(), states.end(), leaf) == states.end())
      throw Error(text("an event cannot reset ", to_text(state), ": it is not a state of the model"));
    if (!std::isfinite(value)) throw Failure(text("an event resets ", to_text(state), " to ", value));
    values[leaf] = value;
    reset.push_back(leaf);
  }
  if (!reset.empty()) keep_lasting(regime, reset, values);
  impact.after = values;
  return impact;
}

std::vector<RegimeImpacts::Impact> RegimeImpacts::settle(const std::vector<EventRecord>& events,
                                                         const dae::Regime& regime,
                                                         const dae::StartRequest& request,
                                                         const dae::Sizes& sizes, Values& values) {
  known_ = dae::values_before(*regime.model, request);
  form_ = dae::first_order(*regime.model);
  const Values before = all(values);
  std::vector<Impact> impacts;
  std::vector<int> pending;
  for (const EventRecord& e : events) {
    const auto which = static_cast<std::size_t>(e.which);
    if (e.t == events.back().t && e.action == "stop" && which < deferred_.size() && deferred_[which])
      pending.push_back(e.which);
  }
  if (pending.empty()) return impacts;
  std::optional<AtRoots> roots;
  do {
    std::optional<int> which;
    const auto now = [&, here = all(values)](int i) { return slope(when_[i], here).value_or(0); };
    if (!pending.empty()) {
      which = pending.front();
      pending.erase(pending.begin());
      if (roots) roots->update(now);
      if (roots && roots->order_matters(*which, slope(when_[*which], all(values)).value_or(NAN)))
        remark_order(*which);
      if (roots && is_thrown_back(*which, before, all(values), sizes, *roots)) continue;
      impacts.push_back(apply(*which, replies_[*which], regime, values));
    } else {
      which = overdue(all(values), sizes, *roots);
      if (which) {
        roots->update(now);
      } else if (const auto triggered = roots->first_triggered(now)) {
        which = triggered->which;
        if (triggered->order_matters) remark_order(*which);
      }
      if (!which) break;
      impacts.push_back(apply(*which, reply_to_triggered(*which, impacts.size()), regime, values));
    }
    if (!roots) roots = at_roots(before, all(values), sizes);
  } while (!impacts.back().stop);
  return impacts;
}

/// The reply to an event that was triggered by others.
EventReply RegimeImpacts::reply_to_triggered(int which, std::size_t count) const {
  constexpr std::size_t most = 1000;  // events at one time
  const ModelEvent& event = simulation_.events[which];
  const std::string name = to_text(when_[which]);
  if (event.call)
    throw Failure(text("another event sets off that of ", name,
                       " = 0 while a contact holds, and its function ",
                       "would see the values before: give it as reset = { … }"));
  if (count >= most)
    throw Failure(text("events set each other off without end; one of them is ", name, " = 0"));
  return {event.stop, {}};
}

/// As EventHandler::is_thrown_back().
bool RegimeImpacts::is_thrown_back(int which, const Values& before, const Values& here,
                                   const dae::Sizes& sizes, const AtRoots& roots) const {
  const double was = slope(when_[which], before).value_or(0), now = slope(when_[which], here).value_or(0);
  return was * now < 0 && roots.is_leaving(std::fabs(now)) &&
         is_at_root(when_[which], here, sizes, roots.fastest());
}

Expr RegimeImpacts::law_sharing_impulse(const dae::RegimeStart& start, const dae::StartRequest& request,
                                        const dae::Sizes& sizes) const {
  constexpr double parallel = 1e-9;  // 1 - cos of the angle: some 10⁻⁵ rad
  const std::vector<Expr> states = model_->states();
  const Values at = dae::values_before(*start.regime->model, request);
  const auto law_of = [&](Expr gap) {
    const Vec normal = gradient_of(gap, states, at);
    for (std::size_t i = 0; i < when_.size(); ++i) {
      if (simulation_.events[i].reset.empty()) continue;
      const Vec own = gradient_of(when_[i], states, at);
      const double both = own.norm() * normal.norm();
      if (both > 0 && std::fabs(own.dot(normal)) >= (1 - parallel) * both &&
          std::fabs(dae::value_at(when_[i], at)) <= 1e-7 * dae::size_of(when_[i], at, sizes))
        return when_[i];
    }
    return Expr(0);
  };
  Expr law(0);
  bool without = false;
  for (Expr gap : start.impulse_margins) {
    const Expr own = law_of(gap);
    if (own.is_zero())
      without = true;
    else
      law = own;
  }
  return without ? law : Expr(0);
}

}  // namespace pendula::integrate
