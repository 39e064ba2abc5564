#include "integrate/simulation/natural_sizes.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "dae/structure/blocks.hpp"

namespace pendula::integrate {
namespace {

/// A term of an equation. Row and column scales and τ are sought with value + row + column - slope τ
/// ≈ 0 (logarithms).
struct Term {
  int row, column;
  bool slope;  ///< a derivative with respect to x′
  double value;
};

/// Least squares for the logarithms of rows, columns and τ, by conjugate gradients on the normal equations.
class Scaling {
 public:
  Scaling(std::vector<Term> terms, int rows, int columns, double interval)
      : terms_(std::move(terms)), rows_(rows), columns_(columns), prior_(std::log(interval)) {}

  /// rows, columns, τ
  Vec solve() const {
    constexpr double close = 1e-8;  // of the first residual: sizes are used to one digit
    const Eigen::Index size = rows_ + columns_ + 1;
    Vec found = Vec::Zero(size), r = right(), p = r, weight = times_diagonal();
    Vec z = r.cwiseQuotient(weight);
    p = z;
    double rz = r.dot(z);
    const double enough = close * close * rz;
    for (Eigen::Index k = 0; k < 2 * size && rz > enough; ++k) {
      const Vec q = times(p);
      const double a = rz / p.dot(q);
      found += a * p;
      r -= a * q;
      z = r.cwiseQuotient(weight);
      const double next = r.dot(z);
      p = z + next / rz * p;
      rz = next;
    }
    return found;
  }

 private:
  static constexpr double trust = 0.01;  ///< weight of τ = interval, where no equation determines τ

  Vec right() const {
    Vec b = Vec::Zero(rows_ + columns_ + 1);
    for (const Term& e : terms_) add(e, -e.value, b);
    b[rows_ + columns_] += trust * prior_;
    return b;
  }
  Vec times(const Vec& v) const {
    Vec result = Vec::Zero(v.size());
    const double tau = v[rows_ + columns_];
    for (const Term& e : terms_) add(e, v[e.row] + v[rows_ + e.column] - (e.slope ? tau : 0), result);
    result[rows_ + columns_] += trust * tau;
    return result;
  }
  Vec times_diagonal() const {
    Vec result = Vec::Zero(rows_ + columns_ + 1);
    for (const Term& e : terms_) {
      result[e.row] += 1;
      result[rows_ + e.column] += 1;
      if (e.slope) result[rows_ + columns_] += 1;
    }
    result[rows_ + columns_] += trust;
    return result.cwiseMax(trust);
  }
  void add(const Term& e, double amount, Vec& to) const {
    to[e.row] += amount;
    to[rows_ + e.column] += amount;
    if (e.slope) to[rows_ + columns_] -= amount;
  }

  std::vector<Term> terms_;
  Eigen::Index rows_, columns_;
  double prior_;
};

/// A point nearby, at which the rounding residue of a cancelling sum differs.
Point nearby(const Point& at) {
  constexpr double distance = 1e-6;  // relative: a sum that cancels to 10⁻⁶ changes by itself
  Point p = at;
  double random = 0.3;
  for (Vec* part : {&p.x, &p.xdot, &p.z})
    for (double& value : *part) {
      random = 3.9 * random * (1 - random);
      value *= 1 + distance * (random - 0.5);
    }
  return p;
}

/// The terms of the user's equations at one point, where they have finite values.
class Terms {
 public:
  Terms(Problem& problem, const Point& at, double t)
      : problem_(problem), n_(problem.n()), size_(problem.n() + problem.m()) {
    const Point other = nearby(at);
    problem.set_point(t, other.x.data(), other.xdot.data(), other.z.data());
    const std::vector<double> there = problem.jacobian();
    problem.set_point(t, at.x.data(), at.xdot.data(), at.z.data());
    const std::vector<double>& values = problem.jacobian();
    const std::vector<Problem::Entry>& pattern = problem.pattern();
    std::vector<char> foreign(static_cast<std::size_t>(size_), 0);  // rows of sensitivities
    for (const auto& e : pattern)
      if (!is_shown(unknown(e.column))) foreign[e.row] = 1;
    pattern_.resize(static_cast<std::size_t>(size_));
    for (std::size_t k = 0; k < pattern.size(); ++k) {
      const auto [row, column] = pattern[k];
      if (foreign[row]) continue;
      const int own = unknown(column);
      const double value = std::fabs(values[k]);
      if (!(value > 0) || !std::isfinite(value)) continue;
      // the rounding residue of a cancelling sum
      if (!(std::fabs(there[k] - values[k]) < 0.1 * value)) continue;
      list_.push_back({row, own, column >= n_ && column < 2 * n_, std::log(value)});
      if (auto& inside = pattern_[row]; std::find(inside.begin(), inside.end(), own) == inside.end())
        inside.push_back(own);
    }
  }

  const std::vector<Term>& list() const { return list_; }
  bool is_shown(int unknown) const {
    return unknown < n_ ? unknown < problem_.visible_n() : unknown - n_ < problem_.visible_m();
  }

  /// Sets of equations that determine unknowns together, in order of dependence; a single set if the pattern
  /// does not determine them.
  std::vector<dae::Part> blocks() const {
    dae::Blocks found = dae::dulmage_mendelsohn(pattern_, size_);
    std::size_t covered = 0, rows = 0;
    for (const dae::Part& block : found.square) covered += block.rows.size();
    for (const auto& row : pattern_) rows += !row.empty();
    if (covered == rows) return std::move(found.square);
    dae::Part all;
    for (int k = 0; k < size_; ++k) {
      all.rows.push_back(k);
      all.columns.push_back(k);
    }
    return {all};
  }

 private:
  int unknown(int column) const { return column < 2 * n_ ? column % n_ : column - n_; }
  Problem& problem_;
  int n_, size_;
  dae::Pattern pattern_;
  std::vector<Term> list_;
};

/// The change of each residual by time alone: its rate times τ, at most the change over the interval. Larger
/// rates, as of exponentials of inputs, are transients that the unknowns do not follow.
Vec forcing(Problem& problem, const Point& start, double from, double interval, double tau) {
  const Eigen::Index size = problem.n() + problem.m();
  Vec first(size), later(size), slope, largest = Vec::Zero(size);
  const auto change_within = [&](double time) {
    problem.set_point(from + time, start.x.data(), start.xdot.data(), start.z.data());
    problem.residual(later.data());
    return Vec((later - first).cwiseAbs());
  };
  try {
    first.setZero();
    first = change_within(0).cwiseProduct(later.cwiseSign());
    const double moment = 1e-6 * std::min(tau, interval);
    slope = change_within(moment) * (tau / moment);
    for (const double share : {0.01, 0.123, 0.37, 0.81})
      largest = largest.cwiseMax(change_within(share * interval));
  } catch (const Failure&) {  // an input without a value there
    return Vec::Zero(size);
  }
  return slope.cwiseMin(largest);
}

}  // namespace

Vec natural_sizes(Problem& problem, const Point& start, double from, double interval) {
  constexpr int affordable = 500;  // unknowns
  const int n = problem.n(), size = n + problem.m();
  Vec result = Vec::Zero(size);
  if (size == 0 || size > affordable || problem.has_dense_jacobian() || !(interval > 0)) return result;
  const Terms terms(problem, start, from);
  const Vec logs = Scaling(terms.list(), size, size, interval).solve();
  if (!logs.allFinite()) return result;
  const double slopes = logs[2 * size], tau = std::exp(slopes);
  std::vector<std::vector<Term>> rows(static_cast<std::size_t>(size));
  for (const Term& e : terms.list()) rows[e.row].push_back(e);
  const Vec forced = forcing(problem, start, from, interval, tau);
  for (const dae::Part& block : terms.blocks()) {
    double c = 0;
    for (int row : block.rows) {
      if (std::isfinite(forced[row])) c = std::max(c, forced[row] * std::exp(logs[row]));
      for (const Term& e : rows[row])  // unknowns of earlier blocks
        c = std::max(c, result[e.column] * std::exp(e.value + logs[row] - (e.slope ? slopes : 0)));
    }
    for (int i : block.columns) {
      if (!terms.is_shown(i)) continue;
      const double value =
          i < n ? std::max(std::fabs(start.x[i]), tau * std::fabs(start.xdot[i])) : std::fabs(start.z[i - n]);
      c = std::max(c, value * std::exp(-logs[size + i]));
    }
    for (int i : block.columns) result[i] = c * std::exp(logs[size + i]);
  }
  return result.allFinite() ? result : Vec::Zero(size);
}

}  // namespace pendula::integrate
