#include "integrate/solution/curve.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "base/interrupt.hpp"

namespace pendula::integrate {
namespace {

struct Node {
  double t;
  Vec values;
  bool lifted = false;  ///< the line is interrupted before this point
  bool saved = false;
};

bool is_finite(const Vec& v) { return v.allFinite(); }

/// The saved points, with both sides of every jump.
std::vector<Node> saved_nodes(const Solution& solution, std::span<const Expr> expressions) {
  const Mat rows = solution.values(expressions);
  std::vector<Node> nodes;
  std::size_t next = 0;
  const auto& events = solution.events();
  const auto add_event = [&](const EventRecord& e) {
    if (e.before.x.size() != e.after.x.size() || e.before.x == e.after.x) return;
    nodes.push_back({e.t, solution.values(expressions, e.before)});
    nodes.push_back({e.t, solution.values(expressions, e.after), true});
  };
  for (int i = 0; i < solution.size(); ++i) {
    const double t = solution.t()[i];
    for (; next < events.size() && events[next].t < t; ++next)
      if (!nodes.empty() && events[next].t > nodes.back().t) add_event(events[next]);
    const bool jump = !nodes.empty() && nodes.back().t == t;
    nodes.push_back({t, rows.row(i).transpose(), jump, true});
  }
  return nodes;
}

/// The transformation from values to pixels.
class Sheet {
 public:
  Sheet(const CurvePlan& plan, const std::vector<Node>& nodes) : plan_(plan) {
    for (const auto& curve : plan.curves)
      for (std::size_t k = 0; k < curve.size(); ++k) measure(curve, k, nodes);
  }

  /// Is p, at this share of the time from a to b, close to the chord of every curve, and close to the point
  /// reached at constant speed along the chord? The second test detects a steep front whose turning point
  /// lies on the chord.
  bool on_chord(const Node& a, const Node& b, const Node& p, double share) const {
    constexpr double uneven = 1;  // pixels along the chord
    return std::all_of(plan_.curves.begin(), plan_.curves.end(), [&](const std::vector<int>& curve) {
      const Offset off = offset(curve, a, b, p, share);
      return off.across <= plan_.tolerance && off.along <= uneven;
    });
  }
  /// The longest chord in pixels.
  double length(const Node& a, const Node& b) const {
    double largest = 0;
    for (const auto& curve : plan_.curves) {
      double square = 0;
      for (std::size_t k = 0; k < curve.size(); ++k) {
        const double d = place(curve, k, b) - place(curve, k, a);
        square += d * d;
      }
      largest = std::max(largest, std::sqrt(square));  // NaN: not drawn
    }
    return largest;
  }

 private:
  /// Is the point within the limits of all axes except this one?
  bool is_seen(const std::vector<int>& curve, std::size_t axis, const Node& node) const {
    for (std::size_t k = 0; k < curve.size(); ++k) {
      const auto& limits = plan_.axes[k].limits;
      const double v = node.values[curve[k]];
      if (k != axis && limits && (v < limits->first || v > limits->second)) return false;
    }
    return true;
  }

  /// Sets the range of an axis to that of the visible points.
  void measure(const std::vector<int>& curve, std::size_t axis, const std::vector<Node>& nodes) {
    const auto column = static_cast<std::size_t>(curve[axis]);
    const SheetAxis& a = plan_.axes[axis];
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Node& node : nodes) {
      const double v = scaled(node.values[curve[axis]], a.log);
      if (std::isfinite(v) && is_seen(curve, axis, node)) {
        low = std::min(low, v);
        high = std::max(high, v);
      }
    }
    if (a.limits) {
      low = scaled(a.limits->first, a.log);
      high = scaled(a.limits->second, a.log);
    }
    const double span = high - low;
    per_unit_.resize(std::max(per_unit_.size(), plan_.axes.size()));
    auto& scales = per_unit_[axis];
    scales.resize(std::max(scales.size(), column + 1), 0);
    scales[column] = span > 0 && std::isfinite(span) ? a.pixels / span : 0;
  }
  static double scaled(double v, bool log) { return log ? std::log10(v) : v; }
  double place(const std::vector<int>& curve, std::size_t k, const Node& node) const {
    const auto column = static_cast<std::size_t>(curve[k]);
    return scaled(node.values[curve[k]], plan_.axes[k].log) * per_unit_[k][column];
  }
  struct Offset {
    double across, along;  ///< pixels; 0 where a point is not drawn
  };
  Offset offset(const std::vector<int>& curve, const Node& a, const Node& b, const Node& p,
                double share) const {
    double along = 0, chord = 0, offset = 0;
    for (std::size_t k = 0; k < curve.size(); ++k) {
      const double u = place(curve, k, b) - place(curve, k, a), v = place(curve, k, p) - place(curve, k, a);
      along += u * v;
      chord += u * u;
      offset += v * v;
    }
    const double s = chord > 0 ? std::clamp(along / chord, 0.0, 1.0) : 0;
    const double square = offset - 2 * s * along + s * s * chord;
    if (!std::isfinite(square)) return {0, 0};
    const double length = std::sqrt(chord);
    return {std::sqrt(std::max(square, 0.0)), length > 0 ? std::abs(along / length - share * length) : 0};
  }

  const CurvePlan& plan_;
  std::vector<std::vector<double>> per_unit_;  ///< by axis, then column
};

/// Divides pieces from left to right.
class Refinement {
 public:
  Refinement(const Solution& solution, std::span<const Expr> expressions, const CurvePlan& plan,
             std::vector<Node> saved)
      : solution_(solution), expressions_(expressions), plan_(plan), saved_(std::move(saved)) {}

  std::vector<Node> run() && {
    // The extent of the curves follows from a few points per piece, or from many saved ones.
    std::vector<Node> coarse;
    const int pieces = many_saved() ? 1 : 3;
    for (std::size_t i = 0; i < saved_.size(); ++i) {
      if (i > 0 && !saved_[i].lifted) add_between(saved_[i - 1], saved_[i], pieces, coarse);
      coarse.push_back(saved_[i]);
    }
    add_where_seen(coarse);
    const Sheet sheet(plan_, coarse);
    std::vector<Node> result;
    for (std::size_t i = 0; i < coarse.size(); ++i) {
      poll_interrupt();
      // A jump of a quantity that is not drawn (the velocity of a bouncing ball) does not interrupt the line.
      if (coarse[i].lifted && sheet.length(coarse[i - 1], coarse[i]) < one_pixel / 2)
        coarse[i].lifted = false;
      if (i > 0 && !coarse[i].lifted) divide(sheet, coarse[i - 1], coarse[i], deepest, result);
      result.push_back(coarse[i]);
    }
    return result;
  }

 private:
  static constexpr int deepest = 9;
  static constexpr double one_pixel = 1, long_piece = 30;  // pixels

  bool many_saved() const { return saved_.size() * 8 >= plan_.most; }

  std::optional<Node> at(double t) {
    if (++evaluations_ > plan_.most) return {};
    try {
      return Node{t, solution_.values(expressions_, t)};
    } catch (const UserFacing&) {  // no continuous extension here; the saved points are joined
      return {};
    }
  }

  /// Points at uneven distances, which cannot coincide with the period of an oscillation.
  void add_between(const Node& a, const Node& b, int pieces, std::vector<Node>& to) {
    for (int k = 1; k < pieces; ++k) {
      constexpr double uneven = 0.07;  // of a distance
      const double share = (k + uneven * (k % 2)) / pieces;
      if (auto node = at(a.t + share * (b.t - a.t))) to.push_back(std::move(*node));
    }
  }

  /// If the limits of the time axis select few steps, adds points there to find the range of the values.
  void add_where_seen(std::vector<Node>& nodes) {
    const auto& limits = plan_.axes[0].limits;
    const bool over_time = expressions_[0] == time_symbol();
    if (!limits || !over_time || many_saved() || nodes.empty()) return;
    constexpr int pieces = 200;
    const double low = std::max(limits->first, nodes.front().t),
                 high = std::min(limits->second, nodes.back().t);
    std::vector<Node> more;
    for (int k = 0; k <= pieces && low < high; ++k) {
      const double t = low + k * (high - low) / pieces;
      const auto next = std::lower_bound(nodes.begin(), nodes.end(), t,
                                         [](const Node& node, double time) { return node.t < time; });
      if (next != nodes.end() && next->t == t) continue;
      if (auto node = at(t)) more.push_back(std::move(*node));
    }
    std::vector<Node> all;
    std::merge(nodes.begin(), nodes.end(), more.begin(), more.end(), std::back_inserter(all),
               [](const Node& a, const Node& b) { return a.t < b.t; });
    nodes = std::move(all);
  }

  void divide(const Sheet& sheet, const Node& a, const Node& b, int depth, std::vector<Node>& to) {
    if (depth == 0 || !(b.t > a.t)) return;
    // With few points every piece is refined, since the curve may turn between neighbours.
    if (many_saved() && is_finite(a.values) && is_finite(b.values) && sheet.length(a, b) < one_pixel) return;
    constexpr double first = 0.31, second = 0.64;  // no simple fractions, which a period could repeat
    const auto p = at(a.t + first * (b.t - a.t)), q = at(a.t + second * (b.t - a.t));
    if (!p || !q) return;
    const bool straight = sheet.on_chord(a, b, *p, first) && sheet.on_chord(a, b, *q, second);
    const bool far = sheet.length(a, b) > long_piece && depth == deepest;
    const bool defined =
        is_finite(a.values) && is_finite(b.values) && is_finite(p->values) && is_finite(q->values);
    const bool undefined =
        !is_finite(a.values) && !is_finite(b.values) && !is_finite(p->values) && !is_finite(q->values);
    if (undefined || (defined && straight && !far)) return;
    divide(sheet, a, *p, depth - 1, to);
    to.push_back(*p);
    divide(sheet, *p, *q, depth - 1, to);
    to.push_back(*q);
    divide(sheet, *q, b, depth - 1, to);
  }

  const Solution& solution_;
  std::span<const Expr> expressions_;
  const CurvePlan& plan_;
  std::vector<Node> saved_;
  std::size_t evaluations_ = 0;
};

}  // namespace

CurvePoints curve_points(const Solution& solution, std::span<const Expr> expressions, const CurvePlan& plan) {
  const std::vector<Node> nodes =
      Refinement(solution, expressions, plan, saved_nodes(solution, expressions)).run();
  CurvePoints result;
  result.values.resize(static_cast<Eigen::Index>(nodes.size()),
                       static_cast<Eigen::Index>(expressions.size()));
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    result.values.row(row) = nodes[i].values.transpose();
    if (nodes[i].lifted) result.breaks.push_back(row);
    if (nodes[i].saved) result.saved.push_back(row);
  }
  return result;
}

}  // namespace pendula::integrate
