#include "sysid/noise/linear_program.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"

namespace pendula::sysid {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// The rows of G scaled to norm 1, followed by the box |x_i| ≤ size.
struct Scaled {
  Mat rows;     ///< one constraint per column
  Vec h, norm;  ///< norm: divisors of the rows
  Index real;
};

Scaled scaled(const LinearProgram& lp, double size) {
  const Index m = lp.G.rows(), n = lp.c.size();
  Scaled s{Mat::Zero(n, m + 2 * n), Vec(m + 2 * n), Vec::Ones(m + 2 * n), m};
  for (Index i = 0; i < m; ++i) {
    const double norm = lp.G.row(i).norm();
    const double by = norm > 0 ? norm : 1;
    s.rows.col(i) = lp.G.row(i).transpose() / by;
    s.h[i] = lp.h[i] / by;
    s.norm[i] = by;
  }
  for (Index i = 0; i < n; ++i)
    for (const Index k : {0, 1}) {
      s.rows(i, m + 2 * i + k) = k == 0 ? 1 : -1;
      s.h[m + 2 * i + k] = size;
    }
  return s;
}

/// Index of the most violated constraint, if one is.
std::optional<Index> most_violated(const Scaled& s, const Vec& x, const std::vector<Index>& active) {
  Vec violation = s.rows.transpose() * x - s.h;
  for (const Index i : active) violation[i] = -infinity;
  Index worst = -1;
  const double excess = violation.maxCoeff(&worst);
  const double size = std::abs(s.h[worst]) + s.rows.col(worst).cwiseAbs().dot(x.cwiseAbs());
  // rounding of the terms: 4500 ε; rows are scaled to 1, and terms of less than 10⁻³ are not told from 0
  constexpr double rounding = 1e-12, least = 1e-3;
  return excess > rounding * (least + size) ? std::optional(worst) : std::nullopt;
}

}  // namespace

LinearSolution solve(const LinearProgram& lp) {
  const Index n = lp.c.size();
  // The box only bounds the iteration; results are computed from the given constraints alone.
  const double reach = lp.h.size() > 0 ? lp.h.cwiseAbs().maxCoeff() : 0;
  constexpr double far = 1e9;  // a solution beyond it counts as unbounded; with 1/ε the box would be rounding
  const Scaled s = scaled(lp, far * std::max(1.0, reach));
  LinearSolution out;
  for (Index i = 0; i < n; ++i) out.active.push_back(s.real + 2 * i + (lp.c[i] > 0 ? 1 : 0));
  Mat B(n, n);
  for (Index iteration = 0;; ++iteration) {
    if (iteration % 16 == 0) poll_interrupt();
    // a cap against cycles: the dual simplex method usually takes a small multiple of n exchanges
    if (iteration > 2000 + 50 * n)
      throw Failure("the linear program does not converge: the data are nearly degenerate");
    for (Index i = 0; i < n; ++i) B.row(i) = s.rows.col(out.active[i]).transpose();
    const Eigen::PartialPivLU<Mat> lu(B);
    Vec h(n);
    for (Index i = 0; i < n; ++i) h[i] = s.h[out.active[i]];
    out.x = lu.solve(h);
    out.multipliers = lu.transpose().solve(Vec(-lp.c));
    out.multipliers = out.multipliers.cwiseMax(0.0);
    const auto enter = most_violated(s, out.x, out.active);
    if (!enter) break;
    // the entering row as a combination of the active ones; those with positive weight may leave
    const Vec weight = lu.transpose().solve(Vec(s.rows.col(*enter)));
    Index leave = -1;
    double best = infinity;
    for (Index i = 0; i < n; ++i) {
      constexpr double pivot = 1e-11;  // of rows of length 1: smaller pivots are rounding, 45000 ε
      if (!(weight[i] > pivot)) continue;
      const double ratio = out.multipliers[i] / weight[i];
      if (ratio < best || (ratio == best && weight[i] > weight[leave])) {
        best = ratio;
        leave = i;
      }
    }
    if (leave < 0) {
      out.status = LinearSolution::Status::infeasible;
      return out;
    }
    out.active[leave] = *enter;
  }
  constexpr double zero = 1e-12;  // 4500 ε: the multiplier of a wall that rounding alone leans on
  for (std::size_t i = 0; i < out.active.size(); ++i)
    if (out.active[i] >= s.real && out.multipliers[i] > zero * lp.c.norm())
      out.status = LinearSolution::Status::unbounded;
  for (std::size_t i = 0; i < out.active.size(); ++i)  // relative to the given rows
    out.multipliers[i] /= s.norm[out.active[i]];
  out.value = lp.c.dot(out.x);
  return out;
}

namespace {

/// n rows of Φ that are independent, preferring small residuals.
std::vector<Index> starting_rows(const Mat& Phi, const Vec& e) {
  std::vector<Index> order(static_cast<std::size_t>(e.size()));
  std::iota(order.begin(), order.end(), Index{0});
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return std::abs(e[a]) < std::abs(e[b]); });
  std::vector<Index> rows;
  Mat Q(Phi.cols(), 0);
  for (const Index i : order) {
    Vec v = Phi.row(i).transpose();
    const double size = v.norm();
    for (int twice = 0; twice < 2; ++twice) v -= Q * (Q.transpose() * v);
    constexpr double dependent = 1e-7;  // keeps B invertible to half of the digits where the rows allow it
    if (!(v.norm() > dependent * size)) continue;
    Q.conservativeResize(Eigen::NoChange, Q.cols() + 1);
    Q.rightCols(1) = v.normalized();
    rows.push_back(i);
    if (static_cast<Index>(rows.size()) == Phi.cols()) break;
  }
  return rows;
}

/// The basic residual that leaves 0, and its sign.
struct Edge {
  std::optional<Index> row;  ///< none: no edge reduces the cost
  double sign = 1, rate = 0;
};

/// With g = Bᵀ z, θ - B⁻¹ e_i s makes residual i equal to s and changes the cost at the rate below.
Edge steepest_edge(const Vec& z, double up, double down) {
  Edge best;
  constexpr double rounding = 1e-10;  // 5·10⁵ ε: of z, the solution of a system in B
  best.rate = -rounding * (up + down);
  for (Index i = 0; i < z.size(); ++i)
    for (const double s : {1.0, -1.0})
      if (const double rate = -s * z[i] + (s > 0 ? up : down); rate < best.rate) best = {i, s, rate};
  return best;
}

}  // namespace

Vec least_absolute(const Mat& Phi, const Vec& measured, double up, double down) {
  const Index n = Phi.cols(), N = Phi.rows();
  // Distinct perturbations of relative size 1e-10 (multiples of the golden ratio mod 1 keep apart) break
  // ties, since degenerate vertices could stall the search; the end solves for the vertex of the true values.
  Vec y = measured;
  const double size = measured.cwiseAbs().maxCoeff();
  for (Index t = 0; t < N; ++t)
    y[t] += 1e-10 * size * std::fmod(0.618033988749895 * static_cast<double>(t + 1), 1.0);
  Vec theta = Eigen::ColPivHouseholderQR<Mat>(Phi).solve(y);
  std::vector<Index> rows = starting_rows(Phi, y - Phi * theta);
  if (static_cast<Index>(rows.size()) < n)
    throw Failure("least absolute deviations: the regressor is rank deficient");
  Mat B(n, n);
  std::vector<std::pair<double, double>> crossings;
  double previous = infinity;
  constexpr int most = 10000;  // a cap: each step lowers the cost, and a step costs N n
  for (int iteration = 0; iteration < most; ++iteration) {
    poll_interrupt();
    Vec rhs(n);
    std::vector<bool> basic(static_cast<std::size_t>(N), false);
    for (Index i = 0; i < n; ++i) {
      const Index row = rows[i];
      B.row(i) = Phi.row(row);
      rhs[i] = y[row];
      basic[row] = true;
    }
    const Eigen::PartialPivLU<Mat> lu(B);
    theta = lu.solve(rhs);
    const Vec e = y - Phi * theta;
    double cost = 0;
    Vec g = Vec::Zero(n);  // of Σ w(e) over the nonbasic rows
    for (Index t = 0; t < N; ++t) {
      if (basic[t]) continue;
      cost += e[t] >= 0 ? up * e[t] : -down * e[t];
      g -= (e[t] >= 0 ? up : -down) * Phi.row(t).transpose();
    }
    constexpr double last_bits = 1e-15;  // 4.5 ε
    if (!(cost < previous * (1 - last_bits))) break;
    previous = cost;
    const Edge edge = steepest_edge(lu.transpose().solve(g), up, down);
    if (!edge.row) break;
    const Vec direction = -edge.sign * Vec(lu.solve(Vec(Vec::Unit(n, *edge.row))));
    const Vec change = -(Phi * direction);  // of e per unit step
    crossings.clear();
    for (Index t = 0; t < N; ++t) {
      if (basic[t] || change[t] == 0 || e[t] / change[t] > 0) continue;
      crossings.emplace_back(-e[t] / change[t], static_cast<double>(t));
    }
    std::sort(crossings.begin(), crossings.end());
    double slope = edge.rate;
    Index stop = -1;
    for (const auto& [at, row] : crossings) {
      stop = static_cast<Index>(row);
      slope += std::abs(change[stop]) * (up + down);
      if (slope >= 0) break;
    }
    if (stop < 0) throw Failure("least absolute deviations: the problem is unbounded");
    rows[*edge.row] = stop;
  }
  Vec rhs(n);
  for (Index i = 0; i < n; ++i) {
    B.row(i) = Phi.row(rows[i]);
    rhs[i] = measured[rows[i]];
  }
  return B.partialPivLu().solve(rhs);
}

}  // namespace pendula::sysid
