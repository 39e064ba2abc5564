#include "integrate/solution/pieces.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pendula::integrate {
namespace {

constexpr double accuracy = 1e-10;  // relative to the largest values: below the tolerances of most runs
// points of a piece: a degree that usually suffices, and one for high orders
constexpr int low = 5, high = 9;
constexpr int deepest = 20;  // halvings

/// The k-th of `count` Chebyshev points of (0, 1), ascending, and its barycentric weight.
/// Berrut, Trefethen, SIAM Rev. 46(3), 2004, (5.3).
double node(Eigen::Index k, Eigen::Index count) {
  return (1 - std::cos((2.0 * static_cast<double>(k) + 1) * std::numbers::pi /
                       (2.0 * static_cast<double>(count)))) /
         2;
}
double weight(Eigen::Index k, Eigen::Index count) {
  const double sine =
      std::sin((2.0 * static_cast<double>(k) + 1) * std::numbers::pi / (2.0 * static_cast<double>(count)));
  return k % 2 == 0 ? sine : -sine;
}

Vec value_at(const Piece& piece, double t) {
  const Eigen::Index count = piece.values.cols();
  const double s = (t - piece.from) / (piece.to - piece.from);
  Vec sum = Vec::Zero(piece.values.rows());
  double weights = 0;
  for (Eigen::Index k = 0; k < count; ++k) {
    const double distance = s - node(k, count);
    if (distance == 0) return piece.values.col(k);
    const double share = weight(k, count) / distance;
    sum += share * piece.values.col(k);
    weights += share;
  }
  return sum / weights;
}

/// x, x′ and z of the user's variables in one column.
Vec stacked(const Problem& problem, const Point& point) {
  const int n = problem.visible_n(), m = problem.visible_m();
  Vec all(2 * n + m);
  all << point.x.head(n), point.xdot.head(n), point.z.head(m);
  return all;
}

class Sampler {
 public:
  explicit Sampler(const Solution& solution) : solution_(solution), problem_(solution.problem()) {
    scale_ = Vec::Constant(2 * problem_.visible_n() + problem_.visible_m(), 1e-300);
    for (int i = 0; i < solution.size(); ++i)
      scale_ = scale_.cwiseMax(stacked(problem_, solution.point(i)).cwiseAbs());
  }

  /// above: the error on the interval of which this is a half. If halving does not reduce it, the values
  /// contain noise, such as that of Newton's method in z, and the piece is accepted.
  void add(double from, double to, int depth, double above) {
    double wrong = 0;
    for (const int count : {low, high}) {
      Piece piece{from, to, Mat(scale_.size(), count)};
      for (int k = 0; k < count; ++k) piece.values.col(k) = at(from + node(k, count) * (to - from));
      wrong = error_of(piece);
      const bool noise = count == high && depth > 2 && wrong > above / 4;
      if (wrong <= accuracy || noise || depth == deepest) return pieces.push_back(std::move(piece));
    }
    const double middle = from + (to - from) / 2;
    if (!(from < middle && middle < to)) return;
    add(from, middle, depth + 1, wrong);
    add(middle, to, depth + 1, wrong);
  }

  std::vector<Piece> pieces;

 private:
  Vec at(double t) const { return stacked(problem_, solution_.at(t)); }

  /// The largest error, relative to the largest value, between the points and near the ends, where
  /// interpolation is worst.
  double error_of(const Piece& piece) const {
    double worst = 0;
    for (const double s : {0.002, 0.27, 0.62, 0.998}) {
      const double t = piece.from + s * (piece.to - piece.from);
      worst = std::max(worst, ((value_at(piece, t) - at(t)).array().abs() / scale_.array()).maxCoeff());
    }
    return worst;
  }

  const Solution& solution_;
  const Problem& problem_;
  Vec scale_;
};

class PieceCurve : public Continuation {
 public:
  PieceCurve(std::vector<Piece> pieces, int n, int m) : pieces_(std::move(pieces)), n_(n), m_(m) {}

  std::pair<double, double> interval(const Points&) const override {
    return {pieces_.front().from, pieces_.back().to};
  }
  Point at(const Points&, double t) override {
    const auto behind = std::upper_bound(pieces_.begin(), pieces_.end(), t,
                                         [](double time, const Piece& piece) { return time < piece.from; });
    const Vec all = value_at(behind == pieces_.begin() ? *behind : *(behind - 1), t);
    return {t, all.head(n_), all.segment(n_, n_), all.tail(m_)};
  }

 private:
  std::vector<Piece> pieces_;
  int n_, m_;
};

}  // namespace

std::vector<Piece> pieces_of(const Solution& solution) {
  if (solution.size() == 0) return {};
  Sampler sampler(solution);
  std::vector<double> ends = solution.t();
  for (const EventRecord& event : solution.events()) ends.push_back(event.t);
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  try {
    for (std::size_t i = 1; i < ends.size(); ++i) sampler.add(ends[i - 1], ends[i], 0, 0);
  } catch (const UserFacing&) {
    return {};  // the steps were not kept, or there is nothing between the points
  }
  return std::move(sampler.pieces);
}

std::shared_ptr<Continuation> continuation_of(std::vector<Piece> pieces, int n, int m) {
  if (pieces.empty()) return nullptr;
  double end = pieces.front().from;
  for (const Piece& piece : pieces) {
    if (!(piece.from < piece.to && piece.from >= end && std::isfinite(piece.to)))
      throw Error("the pieces of a solution must follow one another in time");
    if (piece.values.rows() != 2 * n + m || piece.values.cols() < 1)
      throw Error(text("a piece of a solution has ", piece.values.rows(), " rows, but the model has ",
                       2 * n + m, ": states, their derivatives, algebraic variables"));
    end = piece.to;
  }
  return std::make_shared<PieceCurve>(std::move(pieces), n, m);
}

}  // namespace pendula::integrate
