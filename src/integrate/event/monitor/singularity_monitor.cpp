#include "integrate/event/monitor/singularity_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

#include "base/text.hpp"
#include "dae/model/truncated_text.hpp"
#include "dae/singular/domain.hpp"
#include "expr/graph/derivative.hpp"

namespace pendula::integrate {
namespace {

bool all_known(Expr e, const std::unordered_set<Expr>& known) {
  const auto inside = leaves({&e, 1});
  return std::all_of(inside.begin(), inside.end(),
                     [&](Expr leaf) { return known.count(leaf) || symbol_of(leaf).kind == Kind::constant; });
}

}  // namespace

std::vector<Guard> guards_of(const dae::ModelPtr& model, const Substitution& inputs, const Problem& problem,
                             bool all_values) {
  const std::unordered_set<Expr> known(problem.arguments().begin(), problem.arguments().end());
  std::vector<Guard> guards;
  for (const dae::Nonzero& n : dae::domain(model, all_values)) {
    const Expr factor = substitute(n.factor, inputs);
    if (factor.is_constant() || !all_known(factor, known)) continue;
    const bool root = !factor.is_symbol() && factor.op() == Op::sqrt;
    guards.push_back({root ? factor.operand(0) : factor,
                      text(dae::elided_text(n.factor), " = 0 there, and ", n.where,
                           n.remedy.empty() ? "" : "; ", n.remedy),
                      root});
  }
  return guards;
}

std::vector<dae::LargeBlock> blocks_of(const dae::ModelPtr& model, const Substitution& inputs,
                                       const Problem& problem) {
  const std::unordered_set<Expr> known(problem.arguments().begin(), problem.arguments().end());
  std::vector<dae::LargeBlock> blocks = dae::large_blocks(model);
  std::erase_if(blocks, [&](dae::LargeBlock& block) {
    for (dae::LargeBlock::Matrix* m : {&block.gradients, &block.jacobian, &block.all}) {
      std::vector<Expr> values;
      for (const Entry& e : m->entries) values.push_back(e.value);
      if (!inputs.empty()) values = substitute(values, inputs);
      const auto inside = leaves(values);
      if (!std::all_of(inside.begin(), inside.end(), [&](Expr leaf) {
            return known.count(leaf) || symbol_of(leaf).kind == Kind::constant;
          }))
        return true;
      for (std::size_t k = 0; k < values.size(); ++k) m->entries[k].value = values[k];
    }
    return false;
  });
  return blocks;
}

RootWatch::RootWatch(const ProblemPtr& problem, const std::vector<Guard>& guards) {
  const std::vector<Expr>& arguments = problem->arguments();
  const std::unordered_set<Expr> known(arguments.begin(), arguments.end());
  std::vector<Expr> outputs, slopes;
  for (const Guard& guard : guards) {
    if (!guard.root) continue;
    const Expr root = pendula::sqrt(guard.factor), slope = total_derivative(root);
    if (!all_known(slope, known)) continue;
    roots_.push_back(guard);
    outputs.push_back(root), slopes.push_back(slope);
  }
  if (roots_.empty()) return;
  problem_ = std::make_shared<Problem>(*problem);
  outputs.insert(outputs.end(), slopes.begin(), slopes.end());
  kernel_ = codegen::Kernel(outputs, arguments);
  out_.resize(outputs.size());
  last_.resize(roots_.size());
  largest_.assign(roots_.size(), 0.0);
}

void RootWatch::start(const Point& point) {
  for (auto& list : last_) list.clear();
  after(point);
}

std::optional<RootWatch::Hit> RootWatch::after(const Point& point) {
  if (roots_.empty()) return {};
  problem_->place(point.t, point.x.data(), point.xdot.data(), point.z.data());
  kernel_(problem_->values().data(), out_.data());
  std::optional<Hit> hit;
  constexpr std::size_t most = 64;
  for (std::size_t i = 0; i < roots_.size(); ++i) {
    const Sample now{point.t, out_[i], out_[roots_.size() + i]};
    if (!std::isfinite(now.s) || !std::isfinite(now.slope)) continue;
    auto& list = last_[i];
    list.push_back(now);
    if (list.size() > most) list.pop_front();
    largest_[i] = std::max(largest_[i], now.s);
    constexpr double rounding = 1e-6;  // of √D, where D is the rounding of what it is made of
    const auto t = now.s <= rounding * largest_[i] ? std::optional(now.t) : kink(list);
    if (t && (!hit || *t < hit->t)) hit = Hit{*t, roots_[i].reason};
  }
  return hit;
}

/// From the last point back over the least √D to a point of the same size on the other side.
std::optional<double> RootWatch::kink(const std::deque<Sample>& list) const {
  const Sample& right = list.back();
  if (right.slope <= 0 || list.size() < 2) return {};
  double least = right.s;
  for (std::size_t k = list.size() - 1; k-- > 0;) {
    const Sample& left = list[k];
    least = std::min(least, left.s);
    if (left.slope >= 0) continue;
    if (left.s < right.s / 2 && k > 0 && list[k - 1].s > left.s) continue;  // further away it shows better
    const double half = (right.t - left.t) / 2;
    const double same = std::fabs(right.s - left.s - half * (left.slope + right.slope));
    const double through = std::fabs(right.s + left.s + half * (left.slope - right.slope));
    if (!(through < same / 4)) return {};
    return left.t + (right.t - left.t) * left.s / (left.s + right.s);
  }
  return {};
}

GuardWatch::GuardWatch(const ProblemPtr& problem, const Plan& plan)
    : guards_(plan.guards), ranks_(problem, plan.blocks, 1e-6), roots_(problem, plan.guards) {
  const std::vector<Guard>& guards = plan.guards;
  if (guards.empty()) return;
  problem_ = std::make_shared<Problem>(*problem);
  const std::vector<Expr>& arguments = problem->arguments();
  const std::unordered_set<Expr> known(arguments.begin(), arguments.end());
  std::vector<Expr> outputs, slopes;
  for (const Guard& guard : guards) {
    outputs.push_back(guard.factor);
    const Expr slope = total_derivative(guard.factor);
    slopes.push_back(all_known(slope, known) ? slope : Expr(0));
  }
  outputs.insert(outputs.end(), slopes.begin(), slopes.end());
  kernel_ = codegen::Kernel(outputs, arguments);
  out_.resize(outputs.size());
}

GuardWatch::Sample GuardWatch::evaluate(const Point& point) {
  if (guards_.empty()) return {};
  problem_->place(point.t, point.x.data(), point.xdot.data(), point.z.data());
  kernel_(problem_->values().data(), out_.data());
  const auto middle = out_.begin() + static_cast<std::ptrdiff_t>(guards_.size());
  return {{out_.begin(), middle}, {middle, out_.end()}};
}

void GuardWatch::start(const Point& point) {
  if (empty()) return;
  last_ = point;
  ranks_.start(point);
  roots_.start(point);
  here_ = evaluate(point);
  first_ = here_.g;
}

void between(const Point& from, const Point& to, double s, Point& out) {
  const double dt = to.t - from.t;
  out.t = from.t + s * dt;
  out.xdot = (1 - s) * from.xdot + s * to.xdot;
  out.z = (1 - s) * from.z + s * to.z;
  out.x = (1 - s) * from.x + s * to.x +
          s * (s - 1) * ((1 - 2 * s) * (to.x - from.x) + dt * ((s - 1) * from.xdot + s * to.xdot));
}

const Point& GuardWatch::point_between(const Point& end, double s) {
  integrate::between(last_, end, s, between_);
  return between_;
}

double GuardWatch::between(const Point& end, double share, std::size_t which) {
  return evaluate(point_between(end, share)).g[which];
}

/// Where the guard is zero, as a share of the step; nothing if it is not.
std::optional<double> GuardWatch::zero(const Point& end, const Sample& there, std::size_t i) {
  const double a = here_.g[i], b = there.g[i];
  if (b == 0) return 1;
  if (a == 0 || !std::isfinite(a) || !std::isfinite(b)) return {};
  double low = 0, high = 1;
  if ((a < 0) != (b < 0)) {
    for (int k = 0; k < 50; ++k) {
      const double middle = (low + high) / 2, g = between(end, middle, i);
      ((g < 0) == (a < 0) && g != 0 ? low : high) = middle;
    }
    return high;
  }
  if (a * here_.slope[i] >= 0 || b * there.slope[i] <= 0) return {};
  constexpr double golden = 0.3819660112501051;
  for (int k = 0; k < 80; ++k) {  // the least |g|
    const double l = low + golden * (high - low), r = high - golden * (high - low);
    if (std::fabs(between(end, l, i)) < std::fabs(between(end, r, i)))
      high = r;
    else
      low = l;
  }
  const double share = (low + high) / 2, least = between(end, share, i);
  const bool reached =
      (least < 0) != (a < 0) || std::fabs(least) <= 1e-9 * std::max(std::fabs(a), std::fabs(b));
  return reached ? std::optional(share) : std::nullopt;
}

std::optional<std::string> GuardWatch::after(const Point& point) {
  if (empty()) return {};
  const Sample there = evaluate(point);
  std::optional<double> first;
  std::size_t which = 0;
  for (std::size_t i = 0; i < guards_.size(); ++i)
    if (const auto share = zero(point, there, i); share && (!first || *share < *first))
      first = share, which = i;
  if (first)
    return text("stopped at t = ", rounded(last_.t + *first * (point.t - last_.t), 4), ": ",
                guards_[which].reason);
  const Stats none;
  const auto inside = [&](double t, Point& out) {
    out = point_between(point, (t - last_.t) / (point.t - last_.t));
  };
  if (const auto hit = ranks_.after(point, true, none, inside))
    return text("stopped at t = ", rounded(hit->t, 4), ": ", hit->reason);
  if (const auto hit = roots_.after(point)) {
    cut_ = hit->t;
    return text("stopped at t = ", rounded(hit->t, 4), ": ", hit->reason);
  }
  last_ = point;
  before_ = std::exchange(here_, there).g;
  return {};
}

std::string GuardWatch::almost_zero(const Point& point, double almost) {
  constexpr double tiny = 1e-3;
  if (empty()) return "";
  const Sample there = first_.empty() ? Sample{} : evaluate(point);
  const auto vanished = [&](std::size_t i) { return std::fabs(there.g[i]) <= tiny * std::fabs(first_[i]); };
  bool any = false;
  for (std::size_t i = 0; i < first_.size(); ++i) any = any || vanished(i);
  if (!any && almost > tiny)
    if (const std::string ranks = ranks_.almost_lost(point); !ranks.empty()) return ranks;
  for (std::size_t i = 0; i < first_.size(); ++i) {
    if (any && !vanished(i)) continue;
    const double ahead = before_.empty() ? there.g[i] : 3 * there.g[i] - 2 * before_[i];  // two steps on
    const bool small = std::fabs(there.g[i]) <= almost * std::fabs(first_[i]);
    if (small || (ahead < 0) != (there.g[i] < 0)) {
      std::string reason = guards_[i].reason;
      const std::string zero = " = 0 there, and ";
      const bool none = vanished(i);
      const std::string now = none    ? " is almost 0 there"
                              : small ? " is only " + rounded(there.g[i], 1) + " there"
                                      : " heads for 0";
      return ". " + reason.replace(reason.find(zero), zero.size(), now + "; where it is 0, ");
    }
  }
  return "";
}

}  // namespace pendula::integrate
