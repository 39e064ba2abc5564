#include "integrate/event/monitor/switch_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "base/limits/stack.hpp"
#include "expr/graph/derivative.hpp"
#include "integrate/event/monitor/guards.hpp"
#include "integrate/problem/per_equations.hpp"
#include "integrate/step/hermite.hpp"

namespace pendula::integrate {

namespace {

// Change of v in a step above which a switch is located: from its middle to the ends of the step e⁻⁸ of it is
// left. Of 1800 runs of smooth rectifiers 41 are wrong without this, 2 with 20, 1 with 16, 12 and 8 (the last
// with 5 % more evaluations).
constexpr double wide = 16;

/// The addends of a sum that vary along a run, and the sum of the others.
struct Sum {
  std::vector<Expr> varying;
  Expr rest = Expr(0);
};

void collect(Expr e, bool negative, const Problem& problem, Sum& sum) {
  check_stack();
  if (!e.is_constant() && !e.is_symbol() && (e.op() == Op::add || e.op() == Op::sub)) {
    collect(e.operand(0), negative, problem, sum);
    collect(e.operand(1), negative != (e.op() == Op::sub), problem, sum);
  } else if (varies(e, problem)) {
    sum.varying.push_back(negative ? -e : e);
  } else {
    sum.rest = negative ? sum.rest - e : sum.rest + e;
  }
}

/// Returns v for an expression k b² + c = c (1 + v²).
std::optional<Expr> smoothed_corner(Expr e, const Problem& problem) {
  Sum sum;
  collect(e, false, problem, sum);
  if (sum.varying.size() != 1 || sum.rest == Expr(0)) return {};
  for (Expr node : topological(sum.varying)) {
    if (node.is_constant() || node.is_symbol() || node.op() != Op::pow) continue;
    if (!node.operand(1).is_constant() || constant_value(node.operand(1)) != 2) continue;
    const Expr square = symbol(Kind::slot, "square");
    const Expr factor = partial(substitute(sum.varying.front(), {{node, square}}), square);
    const std::vector<Expr> inside = leaves({&factor, 1});
    if (std::find(inside.begin(), inside.end(), square) != inside.end() || varies(factor, problem)) continue;
    const Expr ratio = factor / sum.rest;
    if (ratio.is_constant() && constant_value(ratio) <= 0) return {};  // 1 - b²
    return node.operand(0) * sqrt(ratio);
  }
  return {};
}

/// Exponents for which (1 + v²)ᵉ is a corner, a switch or a peak: -½, ½, -1, not 2.
bool is_bend(Expr exponent) {
  if (!exponent.is_constant()) return false;
  const double e = constant_value(exponent);
  return e < 0 || e != std::floor(e);
}

std::vector<Expr> switches_of(const Problem& problem) {
  std::vector<Expr> list;
  std::unordered_set<Expr> seen;
  const auto add = [&](Expr v) {
    if (!v.is_constant() && all_known(v, problem) && seen.insert(v).second) list.push_back(v);
  };
  for (Expr node : topological(problem.model().F)) {
    if (node.is_constant() || node.is_symbol()) continue;
    const Op op = node.op();
    if (op == Op::tanh || op == Op::atan || op == Op::cosh) add(node.operand(0));
    if (op != Op::log && op != Op::div && op != Op::pow && op != Op::sqrt) continue;
    const Expr inside = node.operand(op == Op::div ? 1 : 0);
    for (Expr part : topological({&inside, 1}))  // 1 + eᵛ
      if (!part.is_constant() && !part.is_symbol() && part.op() == Op::exp) add(part.operand(0));
    if (op != Op::sqrt && !(op == Op::pow && is_bend(node.operand(1)))) continue;
    if (const auto v = smoothed_corner(inside, problem)) add(*v);
  }
  return list;
}

}  // namespace

SwitchMonitor::SwitchMonitor(const Problem& problem) {
  static PerEquations<std::vector<Expr>> known;
  switches_ = known.of(problem, [&] { return switches_of(problem); });
  count_ = switches_.size();
  if (count_ == 0) return;
  located_.assign(count_, 0);
  kernel_ = codegen::Kernel(switches_, problem.arguments());
  samples_.resize(pieces + 1);
}

void SwitchMonitor::evaluate(Problem& problem, const Point& point, Values& out) const {
  problem.set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
  out.resize(count_);
  kernel_(problem.values().data(), out.data());
}

void SwitchMonitor::sample(Problem& problem, const Point& from, const Point& to, double share, Values& out) {
  hermite(from, to, share, there_);
  evaluate(problem, there_, out);
}

std::optional<Rejection> SwitchMonitor::after(const ProblemPtr& problem, const Point& from, const Point& to) {
  constexpr long few = 20;
  if (count_ == 0) return {};
  ++steps_;
  if (repeated_ > few && repeated_ > steps_ / 2) return {};
  evaluate(*problem, from, samples_.front());
  evaluate(*problem, to, samples_.back());
  if (!is_due(*problem, from, to)) return {};
  const Passage first = first_passage(*problem, from, to);
  if (!(first.share < 1)) return {};
  ++repeated_;
  ++located_[first.which];
  return Rejection{.until = from.t + first.share * (to.t - from.t)};
}

/// Does v change its sign between the ends, or would it on a tangent at one of them?
bool SwitchMonitor::is_due(Problem& problem, const Point& from, const Point& to) {
  const Values &begin = samples_.front(), &end = samples_.back();
  sample(problem, from, to, 1.0 / pieces, samples_[1]);
  sample(problem, from, to, 1 - 1.0 / pieces, samples_[pieces - 1]);
  for (std::size_t i = 0; i < count_; ++i) {
    if (begin[i] * end[i] < 0 && std::fabs(end[i] - begin[i]) > wide) return true;
    const double ahead = pieces * std::fabs(samples_[1][i] - begin[i]);
    const double back = pieces * std::fabs(samples_[pieces - 1][i] - end[i]);
    if (ahead > std::max(wide, std::fabs(begin[i])) || back > std::max(wide, std::fabs(end[i]))) return true;
  }
  return false;
}

SwitchMonitor::Passage SwitchMonitor::first_passage(Problem& problem, const Point& from, const Point& to) {
  constexpr double within = 1;  // the step begins within the switch
  for (int k = 2; k < pieces - 1; ++k)
    sample(problem, from, to, static_cast<double>(k) / pieces, samples_[k]);
  Passage first;
  for (std::size_t i = 0; i < count_; ++i) {
    double least = samples_[0][i], most = least;
    for (const Values& sample : samples_) {
      least = std::min(least, sample[i]);
      most = std::max(most, sample[i]);
    }
    if (!(most - least > wide)) continue;
    for (int k = std::fabs(samples_[0][i]) < within ? 2 : 1; k <= pieces; ++k)
      if (samples_[k - 1][i] * samples_[k][i] < 0) {
        if (const double share = root(problem, i, k, from, to); share < first.share) first = {i, share};
        break;
      }
  }
  return first;
}

/// Bisects for the zero of v in a piece of the step.
double SwitchMonitor::root(Problem& problem, std::size_t which, int piece, const Point& from,
                           const Point& to) {
  constexpr int halvings = 26;
  double low = static_cast<double>(piece - 1) / pieces, high = static_cast<double>(piece) / pieces;
  const bool positive = samples_[piece - 1][which] > 0;
  for (int k = 0; k < halvings; ++k) {
    const double middle = (low + high) / 2;
    sample(problem, from, to, middle, inside_);
    ((inside_[which] > 0) == positive ? low : high) = middle;
  }
  return high;
}

}  // namespace pendula::integrate
