#include "integrate/event/monitor/peak_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>

#include "expr/graph/depends_on.hpp"
#include "expr/graph/derivative.hpp"
#include "integrate/event/monitor/guards.hpp"
#include "integrate/problem/per_equations.hpp"
#include "integrate/step/hermite.hpp"

namespace pendula::integrate {

namespace {

// How far the exponent at a peak that a step may miss exceeds its values at both ends of the step. With less,
// the nearer end lies within two half widths of the top (u = -θ²/2), on the flank of the peak, and the stages
// of the step detect it.
// (u = -θ²/2), and the step sees it.
constexpr double high = 2;

struct Candidate {
  Expr u, slope;
  bool divisor, parabola;
};

/// A power with a negative constant exponent, such as b^{-2}.
bool is_negative_power(Expr e) {
  return e.op() == Op::pow && e.operand(1).is_constant() && constant_value(e.operand(1)) < 0;
}

/// The coefficients of x′, and of z in equations without x′, where these are linear in it: z in z (ε² + x²) =
/// x² is a quotient.
std::vector<Expr> coefficients(const dae::FirstOrder& equations) {
  constexpr std::size_t most = 1000;  // equations; preparing more would take longer than their Jacobian
  std::vector<Expr> found;
  if (equations.F.size() > most) return found;
  const std::unordered_set<Expr> xdot(equations.xdot.begin(), equations.xdot.end()),
      z(equations.z.begin(), equations.z.end());
  for (Expr residual : equations.F) {
    const auto& solved_for = depends_on_any(residual, xdot) ? xdot : z;
    for (Expr leaf : leaves({&residual, 1})) {
      if (!solved_for.count(leaf)) continue;
      const Expr slope = gradient(residual, {&leaf, 1})[0];
      if (!slope.is_constant() && !depends_on_any(slope, {leaf})) found.push_back(slope);
    }
  }
  return found;
}

std::vector<Candidate> make_candidates(const Problem& problem) {
  std::vector<Candidate> list;
  std::unordered_set<Expr> seen;
  const auto add = [&](Expr u, bool divisor) {
    if (u.is_constant() || !seen.insert(u).second) return;
    const Expr slope = total_derivative(u);
    if (slope.is_constant() || !all_known(slope, problem)) return;
    list.push_back({u, slope, divisor, !varies(total_derivative(slope), problem)});
  };
  // Features that are confined to a neighbourhood of v = 0: u = -v² has its maximum there.
  const auto add_switch = [&](Expr v) { add(-(v * v), false); };
  for (Expr node : topological(problem.model().F)) {
    if (node.is_constant() || node.is_symbol()) continue;
    if (node.op() == Op::exp) add(node.operand(0), false);
    if (node.op() == Op::tanh || node.op() == Op::cosh || node.op() == Op::atan) add_switch(node.operand(0));
    const bool inverse = node.op() == Op::div || node.op() == Op::pow;
    if (!inverse) continue;
    const Expr divisor = node.operand(node.op() == Op::div ? 1 : 0);
    if (node.op() == Op::div || is_negative_power(node)) add(divisor, true);
    // 1 + eᵛ
    for (Expr part : topological({&divisor, 1}))
      if (!part.is_constant() && !part.is_symbol() && part.op() == Op::exp) add_switch(part.operand(0));
  }
  for (const dae::DomainCondition& c : domain_conditions_of(problem))
    if (c.pole) add(c.factor, true);
  for (Expr coefficient : coefficients(problem.model())) add(coefficient, true);
  return list;
}

}  // namespace

PeakMonitor::PeakMonitor(const Problem& problem, const Tolerances& tolerances, bool wanted)
    : tolerances_(tolerances) {
  if (!wanted) return;
  static PerEquations<Nodes> known;
  nodes_ = known.of(problem, [&] { return nodes_of(problem); });
}

PeakMonitor::Nodes PeakMonitor::nodes_of(const Problem& problem) {
  Nodes nodes;
  std::vector<Expr> values, slopes;
  for (const Candidate& c : make_candidates(problem)) {
    values.push_back(c.u);
    slopes.push_back(c.slope);
    nodes.is_divisor.push_back(c.divisor);
    nodes.is_parabola.push_back(c.parabola);
  }
  if (values.empty()) return nodes;
  values.insert(values.end(), slopes.begin(), slopes.end());
  nodes.kernel = codegen::Kernel(values, problem.arguments());
  return nodes;
}

/// Adopts the branches and parameters of the run, which may change during it.
void PeakMonitor::follow(const ProblemPtr& problem) {
  if (original_ == problem && version_ == problem->version()) return;
  original_ = problem;
  version_ = problem->version();
  arguments_ = problem->values();
  own_.reset();
  rhs_.reset();
}

/// A private copy of the problem, since the run sets the original to other points. Most runs need none.
const ProblemPtr& PeakMonitor::own() {
  if (!own_) own_ = std::make_shared<Problem>(*original_);
  return own_;
}

void PeakMonitor::evaluate(const Point& point, Values& out) {
  out.resize(nodes_.kernel.outputs());
  if (original_->model().u.empty()) {
    arguments_[0] = point.t;
    double* to = arguments_.data() + 1;  // Problem::arguments()
    for (const Vec* part : {&point.x, &point.xdot, &point.z})
      to = std::copy_n(part->data(), part->size(), to);
    nodes_.kernel(arguments_.data(), out.data());
    return;
  }
  own()->set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
  nodes_.kernel(own()->values().data(), out.data());
}

/// Evaluates a point of the cubic through the ends of a step.
void PeakMonitor::sample(const Point& from, const Point& to, double share, Sample& out) {
  out.share = share;
  hermite(from, to, share, inside_);
  evaluate(inside_, out.values);
}

void PeakMonitor::restart(const ProblemPtr& problem, const Point& point) {
  if (nodes() == 0) return;
  follow(problem);
  evaluate(point, last_.values);
}

bool PeakMonitor::has_reached_limit() const {
  constexpr long few = 20;  // number of peaks that are resolved by shorter steps at any cost
  return repeated_ > few && repeated_ > steps_ / 4;
}

std::optional<Rejection> PeakMonitor::after(const ProblemPtr& problem, const Point& from, const Point& to) {
  if (nodes() == 0) return {};
  follow(problem);
  evaluate(to, next_.values);
  ++steps_;
  dt_ = to.t - from.t;
  searched_ = 0;
  const double off = varies_fast() ? passes_peak(last_, next_, 0, from, to) : 0;
  if (!(off > 0)) {
    last_.values.swap(next_.values);
    return {};
  }
  ++repeated_;
  return Rejection{.error = off, .is_tolerated = has_reached_limit()};
}

/// Do the slopes at the ends of the step allow a peak inside it?
bool PeakMonitor::varies_fast() const {
  const Values &a = last_.values, &b = next_.values;
  for (std::size_t i = 0; i < nodes(); ++i) {
    if (nodes_.is_parabola[i] && !turns(i, a, b)) continue;
    const double reach = std::max(std::fabs(a[nodes() + i]), std::fabs(b[nodes() + i])) * dt_;
    const double size = nodes_.is_divisor[i] ? 0.5 * std::min(std::fabs(a[i]), std::fabs(b[i])) : high;
    if (reach > size) return true;
  }
  return false;
}

/// The error of the step in tolerances if it misses a peak, else 0. Halves the step until the middle of each
/// part follows from its ends, since it may contain several peaks.
double PeakMonitor::passes_peak(const Sample& low, const Sample& behind, int depth, const Point& from,
                                const Point& to) {
  if (depth < deepest) {
    Sample& middle = middles_[depth];
    sample(from, to, (low.share + behind.share) / 2, middle);
    if (shows_no_peak(low, middle, behind)) return 0;
    const double off = passes_peak(low, middle, depth + 1, from, to);
    return off > 0 ? off : passes_peak(middle, behind, depth + 1, from, to);
  }
  for (std::size_t i = 0; i < nodes(); ++i) {
    if (!turns(i, low.values, behind.values) || !may_reach_peak(i, low, behind)) continue;
    if (++searched_ > most_searched) break;
    const auto peak = peak_between(i, low, behind, from, to);
    const double off = peak ? peak_error(i, *peak, from, to) : 0;
    if (off > 0) return off;
  }
  return 0;
}

/// The height of ± u beyond which a maximum counts as a peak: more than e² times the function at the ends of
/// the step. The stages detect lower ones.
double PeakMonitor::peak_height(std::size_t i) const {
  constexpr double least_exponent = -60;  // e⁻⁶⁰ = 10⁻²⁶ is negligible for factors up to 10¹³
  static const double share = std::exp(-high);
  const double a = last_.values[i], b = next_.values[i];
  if (!nodes_.is_divisor[i]) return std::max(std::max(a, b) + high, least_exponent);
  if (!(a * b > 0)) return std::numeric_limits<double>::infinity();  // a pole, not a peak
  return -std::min(std::fabs(a), std::fabs(b)) * share;
}

/// Is every node lower than a peak between two samples? Bounds the cubics from the samples to their middle by
/// their control points, and the error of these cubics by `several` times that of the cubic through both
/// samples, measured in the middle.
bool PeakMonitor::shows_no_peak(const Sample& low, const Sample& middle, const Sample& behind) const {
  constexpr double several =
      8;  // asymptotically the cubics of the halves have 1/16 of the error of the whole
  constexpr double of_slope = 0.143;  // maximum of s²(1-s)²(s-½) relative to its slope at ½
  const double width = (behind.share - low.share) * dt_, third = width / 6;  // a third of the half width
  for (std::size_t i = 0; i < nodes(); ++i) {
    const double height = peak_height(i);
    if (height == std::numeric_limits<double>::infinity()) continue;
    if (nodes_.is_parabola[i] && !turns(i, last_.values, next_.values)) continue;
    const double side = nodes_.is_divisor[i] && last_.values[i] > 0 ? -1 : 1;
    const std::size_t slope = nodes() + i;
    const double a = side * low.values[i], m = side * middle.values[i], b = side * behind.values[i];
    const double da = side * low.values[slope], dm = side * middle.values[slope],
                 db = side * behind.values[slope];
    const double error = std::fabs((a + b) / 2 + width * (da - db) / 8 - m);
    const double slope_error = std::fabs(1.5 * (b - a) - width * ((da + db) / 4 + dm));
    const double highest = std::max({a, b, m, a + third * da, b - third * db, m + third * std::fabs(dm)});
    if (!(highest + several * (error + of_slope * slope_error) < height)) return false;
  }
  return true;
}

/// Does the tangent at one of two samples reach the height of a peak before the other?
bool PeakMonitor::may_reach_peak(std::size_t i, const Sample& low, const Sample& behind) const {
  const double side = nodes_.is_divisor[i] && last_.values[i] > 0 ? -1 : 1;
  const double width = (behind.share - low.share) * dt_;
  const double before = side * (low.values[i] + width * low.values[nodes() + i]);
  const double after = side * (behind.values[i] - width * behind.values[nodes() + i]);
  return !(std::max(before, after) < peak_height(i));
}

/// An exponent rises at the first sample and not at the second, which may be the maximum itself. For the size
/// of a divisor the other way round.
bool PeakMonitor::turns(std::size_t i, const Values& low, const Values& behind) const {
  const double side = !nodes_.is_divisor[i] ? 1 : low[i] > 0 ? -1 : 1;
  const bool same_sign = !nodes_.is_divisor[i] || low[i] * behind[i] > 0;
  return same_sign && side * low[nodes() + i] > 0 && side * behind[nodes() + i] <= 0;
}

/// Bisection for the maximum, abandoned once it cannot be that of a peak.
std::optional<PeakMonitor::Peak> PeakMonitor::peak_between(std::size_t i, const Sample& low,
                                                           const Sample& behind, const Point& from,
                                                           const Point& to) {
  // A maximum is located to 10⁻⁶ of the step. The peak of a divisor may be narrower and its height unknown;
  // its width is taken as 10⁻⁴ at least.
  constexpr double narrowest = 1e-6, least_width = 1e-4;
  const bool divisor = nodes_.is_divisor[i];
  const double side = divisor && last_.values[i] > 0 ? -1 : 1;
  low_ = low;
  behind_ = behind;
  while (behind_.share - low_.share > narrowest) {
    if (!may_reach_peak(i, low_, behind_)) return {};
    sample(from, to, (low_.share + behind_.share) / 2, middle_);
    if (divisor && !(middle_.values[i] * side < 0)) return {};  // a zero: a pole, or a point next to one
    std::swap(side * middle_.values[nodes() + i] > 0 ? low_ : behind_, middle_);
  }
  const double top = side * low_.values[i];
  if (!(top > peak_height(i))) return {};
  const double width = half_width(low_.share, [&](double share) {
    sample(from, to, share, middle_);
    const double there = side * middle_.values[i];
    return divisor ? there <= 2 * top : there <= top - 0.5;
  });
  return Peak{low_.share, divisor ? std::max(width, least_width) : width};
}

/// The distance from the maximum, as a share of the step, at which the peak has fallen to e^{-1/2}, or to
/// half for 1/d. The mean of the sides that lie within the step. (The curvature at the top does not determine
/// the width of 1/(1 + θ⁸).)
template <class Fallen>
double PeakMonitor::half_width(double top, const Fallen& has_fallen) {
  constexpr double narrowest = 1e-7;
  constexpr int halvings = 3;  // of an interval [w/2, w]: accurate to w/16
  double sum = 0;
  int sides = 0;
  for (const double side : {-1.0, 1.0}) {
    const auto is_inside = [&](double width) { return top + side * width >= 0 && top + side * width <= 1; };
    double far = narrowest;
    while (is_inside(far) && !has_fallen(top + side * far)) far *= 2;
    if (!is_inside(far)) continue;
    double near = far / 2;
    for (int k = 0; k < halvings; ++k) {
      const double middle = (near + far) / 2;
      (has_fallen(top + side * middle) ? far : near) = middle;
    }
    sum += far;
    ++sides;
  }
  return sides > 0 ? sum / sides : 1;
}

/// x′ of the equations on the cubic through the ends of the step, and the slope of the cubic, which is left
/// in inside_.xdot.
bool PeakMonitor::equations_at(const Point& from, const Point& to, double share, Vec& xdot) {
  hermite(from, to, share, inside_);
  const Vec slope = inside_.xdot;
  if (!rhs_) rhs_ = std::make_unique<RhsSolver>(own(), ignored_);
  if (!(*rhs_)(inside_.t, inside_.x.data(), inside_.xdot.data(), inside_.z.data())) return false;
  xdot = inside_.xdot;
  inside_.xdot = slope;
  return xdot.allFinite();
}

/// The area of the peak above its surroundings, in tolerances; 0 if it is within the admissible error of a
/// step. Infinite where the solution stops in the peak, as that of x′ = -1 + e^{-(x/ε)²} does at x = 0: how
/// narrow the peak is does not matter then. The height is the largest of three: a wall, v′ = x
/// e^{-(x/ε)²}/ε², has none at the top of the exponential.
double PeakMonitor::peak_error(std::size_t i, const Peak& peak, const Point& from, const Point& to) {
  constexpr double feet = 4;      // in half widths: e^{-θ²/2} has fallen to e^{-8} there
  constexpr double several = 3;   // tolerances: the admissible error of a step
  constexpr double area = 2.507;  // √(2π): the area of a Gaussian of height 1 and half width 1
  // Where an ODE is not defined a step must not lead. Elsewhere z may be on another branch: nothing is known.
  const double unknown = own()->is_ode() ? std::numeric_limits<double>::infinity() : 0;
  if (!equations_at(from, to, peak.at, at_peak_)) return unknown;
  const double low = peak.at - feet * peak.width, above = peak.at + feet * peak.width;
  const bool right = above < 1 && (low <= 0 || 1 - peak.at > peak.at);
  beside_ = Vec::Zero(at_peak_.size());  // the defect of the step as a whole
  if (right || low > 0) {
    if (!equations_at(from, to, right ? above : low, at_foot_)) return unknown;
    beside_ = at_foot_ - inside_.xdot;
    if (stops_in(i, peak, from, to)) return std::numeric_limits<double>::infinity();
  }
  const double factor = area * peak.width * (to.t - from.t);
  double off = 0;
  for (const double side : {0.0, -1.0, 1.0}) {
    const double share = peak.at + side * peak.width;
    if (!(share > 0 && share < 1)) continue;
    if (!equations_at(from, to, share, at_peak_)) return unknown;
    for (Eigen::Index k = 0; k < at_peak_.size(); ++k) {
      const double weight =
          tolerances_.atol[k] + tolerances_.rtol[k] * std::max(std::fabs(from.x[k]), std::fabs(to.x[k]));
      off = std::max(off, std::fabs(at_peak_[k] - inside_.xdot[k] - beside_[k]) * factor / weight);
    }
  }
  return off > several ? off : 0;
}

/// Does the exponent or divisor come to rest in the peak, or turn back, by x′ of the equations there? Its
/// slope beside the top, linear in x′, tells the speed at which the solution passes.
bool PeakMonitor::stops_in(std::size_t i, const Peak& peak, const Point& from, const Point& to) {
  constexpr double at_rest = 0.01;  // relative to the speed at the foot
  const double side = peak.at + peak.width < 1 ? 1 : -1;
  hermite(from, to, peak.at + side * peak.width, inside_);
  const Vec slope = inside_.xdot;
  const auto speed = [&](const Vec& xdot) {
    inside_.xdot = xdot;
    evaluate(inside_, middle_.values);
    return middle_.values[nodes() + i];
  };
  const double passing = speed(slope), in_peak = speed(at_peak_), at_foot = speed(at_foot_);
  const double direction = passing > 0 ? 1 : -1;
  return direction * in_peak < at_rest * std::fabs(at_foot) && direction * at_foot > 0;
}

}  // namespace pendula::integrate
