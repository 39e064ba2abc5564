#include "sysid/fit/continuous.hpp"

#include <cmath>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/linalg/linalg.hpp"

namespace pendula::sysid {
namespace {

/// Controllable canonical form, with time scaled by the fastest coefficient so that entries are of size 1.
struct Realisation {
  Mat A;
  Vec B;
  Eigen::RowVectorXd C;
  double D = 0;
};

Realisation realisation(const ContinuousModel& m) {
  const Index n = m.den.size() - 1;
  Vec num = Vec::Zero(n + 1);
  if (m.num.size() > n + 1 || m.den[0] == 0)
    throw Error("the numerator has a higher degree than the denominator");
  num.tail(m.num.size()) = m.num / m.den[0];
  const Vec den = m.den / m.den[0];
  Realisation r;
  r.D = num[0];
  r.A = Mat::Zero(n, n);
  r.B = Vec::Zero(n);
  r.C = Eigen::RowVectorXd::Zero(n);
  if (n == 0) return r;
  // x_i in units of w^i with w = |a_n|^(1/n), or the largest coefficient's root where a_n = 0
  double w = 0;
  for (Index k = 1; k <= n; ++k) w = std::max(w, std::pow(std::abs(den[k]), 1.0 / static_cast<double>(k)));
  if (w == 0) w = 1;
  for (Index k = 0; k < n; ++k) {
    const double unit = std::pow(w, static_cast<double>(k));
    if (k > 0) r.A(k, k - 1) = w;
    r.A(0, k) = -den[k + 1] / unit;
    r.C[k] = (num[k + 1] - r.D * den[k + 1]) / unit;
  }
  r.B[0] = 1;
  return r;
}

/// e^{At} and ∫₀ᵗ e^{As} ds B.
std::pair<Mat, Vec> held(const Realisation& r, double t) {
  const Index n = r.A.rows();
  Mat M = Mat::Zero(n + 1, n + 1);
  M.topLeftCorner(n, n) = r.A * t;
  M.topRightCorner(n, 1) = r.B * t;
  const Mat E = linalg::exponential(M);
  return {E.topLeftCorner(n, n), E.topRightCorner(n, 1)};
}

struct Sampled {
  Mat Phi;
  Vec before, after;  ///< Γ₁ of u(k-d-1), Γ₀ of u(k-d)
  Index d = 0;
  bool fraction = false;
};

/// Discretises for a record of so many samples; longer delays have no effect on it.
Sampled sampled(const Realisation& r, double delay, double Ts, Index samples) {
  Sampled s;
  constexpr double rounding = 1e-9;  // of a sample: ε of the number of samples in a delay
  const double periods = std::floor(delay / Ts + rounding), most = static_cast<double>(samples);
  s.d = static_cast<Index>(std::min(periods, most));
  const double f = periods < most ? std::max(0.0, delay - periods * Ts) : 0;
  s.fraction = f > rounding * Ts;
  const auto [Phi, whole] = held(r, Ts);
  s.Phi = Phi;
  s.before = Vec::Zero(r.A.rows());
  s.after = whole;
  if (!s.fraction) return s;
  const auto [rest, after] = held(r, Ts - f);
  s.after = after;
  s.before = rest * held(r, f).second;
  return s;
}

}  // namespace

Vec simulate_held(const ContinuousModel& m, const Vec& u, double Ts, bool settled) {
  const Realisation r = realisation(m);
  const Sampled s = sampled(r, m.delay, Ts, u.size());
  const auto past = [&](Index k) { return k >= 0 ? u[k] : settled ? u[0] : 0.0; };
  Vec x = Vec::Zero(r.A.rows());
  Vec next = x;
  Vec y(u.size());
  for (Index k = 0; k < u.size(); ++k) {
    // with a fraction of a sample the new input value is still delayed
    y[k] = r.C * x + r.D * past(s.fraction ? k - s.d - 1 : k - s.d);
    next.noalias() = s.Phi.lazyProduct(x);
    next += s.after * past(k - s.d) + s.before * past(k - s.d - 1);
    x.swap(next);
  }
  return y;
}

Vec continuous_errors(const ContinuousModel& m, const IdData& d, bool free) {
  std::vector<double> all;
  const Realisation r = realisation(m);
  const Index n = r.A.rows();
  const Mat Phi = n > 0 ? linalg::exponential(r.A * d.Ts) : Mat(0, 0);
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index from = d.starts[k];
    const Index size = d.end(k) - from;
    const Vec e = d.y.col(0).segment(from, size) - simulate_held(m, d.u.col(0).segment(from, size), d.Ts);
    std::vector<Index> rows;
    for (Index t = 0; t < size; ++t)
      if (!std::isnan(d.y(from + t, 0))) rows.push_back(t);
    Vec kept = e(rows);
    if (free && n > 0 && static_cast<Index>(rows.size()) > n) {
      Mat O(size, n);
      Eigen::RowVectorXd row = r.C;
      for (Index t = 0; t < size; ++t) {
        O.row(t) = row;
        row = (row * Phi).eval();
      }
      const Mat seen = O(rows, Eigen::all);
      if (seen.allFinite() && kept.allFinite()) kept -= seen * Vec(seen.colPivHouseholderQr().solve(kept));
    }
    all.insert(all.end(), kept.begin(), kept.end());
  }
  return Eigen::Map<const Vec>(all.data(), static_cast<Index>(all.size()));
}

}  // namespace pendula::sysid
