#include "integrate/solution/curve.hpp"

#include <algorithm>
#include <cmath>
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

/// The saved points, and both sides of jumps between them.
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

/// Where points lie on the sheet, in pixels.
class Sheet {
 public:
  Sheet(const CurvePlan& plan, const std::vector<Node>& nodes) : plan_(plan) {
    for (const auto& curve : plan.curves)
      for (std::size_t k = 0; k < curve.size(); ++k) measure(static_cast<std::size_t>(curve[k]), k, nodes);
  }

  /// The largest distance in pixels of p from the chord between a and b, over all curves.
  double distance(const Node& a, const Node& b, const Node& p) const {
    double largest = 0;
    for (const auto& curve : plan_.curves) largest = std::max(largest, distance(curve, a, b, p));
    return largest;
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
  void measure(std::size_t column, std::size_t axis, const std::vector<Node>& nodes) {
    const SheetAxis& a = plan_.axes[axis];
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Node& node : nodes) {
      const double v = scaled(node.values[static_cast<Eigen::Index>(column)], a.log);
      if (std::isfinite(v)) {
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
  double distance(const std::vector<int>& curve, const Node& a, const Node& b, const Node& p) const {
    double along = 0, chord = 0, offset = 0;
    for (std::size_t k = 0; k < curve.size(); ++k) {
      const double u = place(curve, k, b) - place(curve, k, a), v = place(curve, k, p) - place(curve, k, a);
      along += u * v;
      chord += u * u;
      offset += v * v;
    }
    const double s = chord > 0 ? std::clamp(along / chord, 0.0, 1.0) : 0;
    const double square = offset - 2 * s * along + s * s * chord;
    return std::isfinite(square) ? std::sqrt(std::max(square, 0.0)) : 0;
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
    // The extent of the curves is known well enough from a few points in every piece, or from many saved ones.
    std::vector<Node> coarse;
    const int pieces = many_saved() ? 1 : 3;
    for (std::size_t i = 0; i < saved_.size(); ++i) {
      if (i > 0 && !saved_[i].lifted) add_between(saved_[i - 1], saved_[i], pieces, coarse);
      coarse.push_back(saved_[i]);
    }
    const Sheet sheet(plan_, coarse);
    std::vector<Node> result;
    for (std::size_t i = 0; i < coarse.size(); ++i) {
      poll_interrupt();
      // A jump of what is not drawn (the velocity of a bouncing ball) does not interrupt the line.
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
    } catch (const UserFacing&) {  // no continuous extension, or it fails here: the saved points are joined
      return {};
    }
  }

  /// Uneven distances: an oscillation cannot be in step with them.
  void add_between(const Node& a, const Node& b, int pieces, std::vector<Node>& to) {
    for (int k = 1; k < pieces; ++k) {
      const double share = (k + 0.07 * (k % 2)) / pieces;
      if (auto node = at(a.t + share * (b.t - a.t))) to.push_back(std::move(*node));
    }
  }

  void divide(const Sheet& sheet, const Node& a, const Node& b, int depth, std::vector<Node>& to) {
    if (depth == 0 || !(b.t > a.t)) return;
    // Of few points every piece is looked at: the curve may turn back between neighbours.
    if (many_saved() && is_finite(a.values) && is_finite(b.values) && sheet.length(a, b) < one_pixel) return;
    const auto p = at(a.t + 0.31 * (b.t - a.t)), q = at(a.t + 0.64 * (b.t - a.t));
    if (!p || !q) return;
    const double off = std::max(sheet.distance(a, b, *p), sheet.distance(a, b, *q));
    const bool far = sheet.length(a, b) > long_piece && depth == deepest;
    const bool defined =
        is_finite(a.values) && is_finite(b.values) && is_finite(p->values) && is_finite(q->values);
    const bool undefined =
        !is_finite(a.values) && !is_finite(b.values) && !is_finite(p->values) && !is_finite(q->values);
    if (undefined || (defined && off <= plan_.tolerance && !far)) return;
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
