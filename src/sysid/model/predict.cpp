// Prediction and simulation by one recursion. With F = Π F_i the predictor of
// A y = Σ B_i/F_i u_i + C/D e is  P ε = Q y - Σ R_i u_i,  P = C F,  Q = D A F,  R_i = D B_i F/F_i;
// in simulation the error y - y_s obeys the same with P = Q = A F, R_i = B_i F/F_i.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/counted.hpp"
#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "sysid/model/kalman_errors.hpp"

namespace pendula::sysid {

namespace {

/// y ← 1/den y with the past outputs in registers; den monic of degree N.
template <int N>
void all_pole(const double* den, Index n, double* y) {
  std::array<double, N> a{}, past{};
  for (std::size_t k = 0; k < N; ++k) a[k] = den[k + 1];
  for (Index t = 0; t < n; ++t) {
    double sum = y[t];
    for (std::size_t k = N - 1; k > 0; --k) {
      sum -= a[k] * past[k];
      past[k] = past[k - 1];
    }
    past[0] = y[t] = sum - a[0] * past[0];
  }
}

void all_pole(const Vec& den, Index n, double* y) {
  using Filter = void (*)(const double*, Index, double*);
  static const Filter of_order[] = {all_pole<1>, all_pole<2>, all_pole<3>, all_pole<4>,
                                    all_pole<5>, all_pole<6>, all_pole<7>, all_pole<8>};
  const Index order = den.size() - 1;
  if (order == 0) return;
  if (order <= 8) return of_order[order - 1](den.data(), n, y);
  for (Index t = 0; t < n; ++t) {
    double sum = y[t];
    for (Index k = std::min(order, t); k > 0; --k) sum -= den[k] * y[t - k];
    y[t] = sum;
  }
}

}  // namespace

void filter(const Vec& num, const Vec& den, const double* x, Index n, double* y) {
  const double scale = den[0];
  std::vector<double> copy;
  if (x == y) {
    copy.assign(x, x + n);
    x = copy.data();
  }
  for (Index t = 0; t < n; ++t) y[t] = num[0] / scale * x[t];
  for (Index k = 1; k < std::min(num.size(), n); ++k) {
    const double b = num[k] / scale;
    if (b == 0) continue;
    for (Index t = k; t < n; ++t) y[t] += b * x[t - k];
  }
  all_pole(scale == 1 ? den : Vec(den / scale), n, y);
}

Vec ringing(const Vec& den, const Vec& head, Index n) {
  Vec y = Vec::Zero(n);
  const Index order = den.size() - 1;
  double largest = 0;
  for (Index t = 0; t < n; ++t) {
    double sum = t < head.size() ? head[t] : 0;
    for (Index k = std::min(order, t); k > 0; --k) sum -= den[k] * y[t - k];
    y[t] = sum;
    largest = std::max(largest, std::abs(sum));
    if (t < head.size() + order) continue;
    double recent = 0;
    for (Index k = 0; k < std::max<Index>(order, 1); ++k) recent = std::max(recent, std::abs(y[t - k]));
    constexpr double died_out = 1e-40;  // far below any effect; avoids denormal numbers, which are slow
    if (recent <= died_out * largest) break;
  }
  return y;
}

Vec filtered(const Vec& num, const Vec& den, const Vec& x) {
  Vec y(x.size());
  filter(num, den, x.data(), x.size(), y.data());
  return y;
}

Vec convolve(const Vec& a, const Vec& b) {
  Vec c = Vec::Zero(a.size() + b.size() - 1);
  for (Index i = 0; i < a.size(); ++i) c.segment(i, b.size()) += a[i] * b;
  return c;
}

bool stable(const Vec& p) {
  Vec a = p;
  while (a.size() > 1) {
    const Index n = a.size() - 1;
    if (!(std::abs(a[n]) < std::abs(a[0]))) return false;
    const double k = a[n] / a[0];
    const Vec reversed = a.reverse();
    a = (a - k * reversed).head(n).eval();
  }
  return true;
}

bool admissible(const Polynomials& p) {
  return stable(p.C) && std::all_of(p.F.begin(), p.F.end(), [](const Vec& f) { return stable(f); });
}

Vec reflected(const Vec& p) {
  Index n = p.size() - 1;
  while (n > 0 && p[n] == 0) --n;
  if (n == 0) return p;
  Mat companion = Mat::Zero(n, n);
  companion.row(0) = -p.segment(1, n).transpose() / p[0];
  companion.diagonal(-1).setOnes();
  const Eigen::EigenSolver<Mat> solver(companion, false);
  // zeros on the circle are moved inside, by more than rounding of the coefficients moves simple ones
  constexpr double largest = 1 - 1e-9;
  Eigen::VectorXcd product = Eigen::VectorXcd::Unit(p.size(), 0) * p[0];
  for (std::complex<double> z : solver.eigenvalues()) {
    const double size = std::abs(z);
    if (size > 1) z /= size * size;
    if (size > largest && std::abs(z) > largest) z *= largest / std::abs(z);
    for (Index k = product.size() - 1; k > 0; --k) product[k] -= z * product[k - 1];
  }
  return product.real();
}

Seed seed_named(const std::string& name) {
  if (name == "zero") return Seed::zero;
  if (name == "data") return Seed::data;
  if (name == "estimate") return Seed::estimate;
  if (name == "drop") return Seed::data;
  throw Error(text("unknown ic '", name, "'.", did_you_mean(name, {"zero", "data", "estimate"}),
                   " (ic = \"data\": the first measured samples seed the filters; \"zero\": from rest; "
                   "\"estimate\": "
                   "the initial state is fitted)"));
}

Seed seed_of_estimation(const PolyModel& m) {
  if (m.start == InitialCondition::zero) return Seed::zero;
  return m.p.equation_error() ? Seed::data : Seed::estimate;
}

std::string seed_text(const PolyModel& m, Seed seed) {
  if (seed == Seed::zero) return "from rest";
  if (seed == Seed::estimate) return "initial state estimated";
  const Index n = m.p.memory();
  return n == 0   ? "without memory"
         : n == 1 ? "seeded with the first sample"
                  : text("seeded with the first ", counted(n, "sample"));
}

namespace {

struct ErrorFilter {
  Vec P, Q;
  std::vector<Vec> R;
  Index memory() const {
    Index n = std::max(P.size(), Q.size());
    for (const Vec& r : R) n = std::max(n, r.size());
    return n - 1;
  }
};

bool all_equal(const std::vector<Vec>& F) {
  return std::all_of(F.begin(), F.end(), [&](const Vec& f) { return f.size() == F[0].size() && f == F[0]; });
}

ErrorFilter error_filter(const Polynomials& p, bool simulation) {
  const bool shared = !p.F.empty() && all_equal(p.F);
  const auto others = [&](std::size_t skip) {
    Vec f = Vec::Ones(1);
    for (std::size_t i = 0; i < p.F.size(); ++i)
      if (i != skip && !(shared && (skip < p.F.size() || i > 0))) f = convolve(f, p.F[i]);
    return f;
  };
  const Vec F = others(p.F.size()), D = simulation ? Vec::Ones(1) : p.D;
  ErrorFilter out;
  out.Q = convolve(convolve(D, p.A), F);
  out.P = simulation ? out.Q : convolve(p.C, F);
  for (std::size_t i = 0; i < p.B.size(); ++i) out.R.push_back(convolve(convolve(D, p.B[i]), others(i)));
  return out;
}

/// v = Q y - Σ R_i u_i on one experiment, with zero samples before it.
Vec right_side(const ErrorFilter& f, const Eigen::Ref<const Vec>& y, const Eigen::Ref<const Mat>& u) {
  Vec v = filtered(f.Q, Vec::Ones(1), y);
  for (std::size_t i = 0; i < f.R.size(); ++i)
    v -= filtered(f.R[i], Vec::Ones(1), u.col(static_cast<Index>(i)));
  return v;
}

/// h_0 … h_{k-1} of C/(A D): the k-step error is Σ h_j ε(t - j).
Vec noise_impulse(const Polynomials& p, Index horizon) {
  Vec impulse = Vec::Zero(horizon);
  impulse[0] = 1;
  return filtered(p.C, convolve(p.A, p.D), impulse);
}

/// Removes the effect of the unknown initial state: impulses in the first rows, filtered by H/P.
void fit_initial_state(Vec& e, const Vec& H, const Vec& P, Index memory) {
  const Vec g = filtered(H, Vec::Ones(1), ringing(P, Vec::Ones(1), e.size()));
  const Index n = std::min(memory, e.size());
  TriangularFactor factor(n + 1);
  Index last = e.size() - 1;  // later rows do not depend on the start
  const double negligible = negligible_tail * g.cwiseAbs().maxCoeff();
  while (last > 0 && std::abs(g[last]) <= negligible) --last;
  const Index rows = std::min(e.size(), last + 1 + n);
  for (Index t = 0; t < rows; t += TriangularFactor::block_rows) {
    poll_interrupt();
    Mat block = Mat::Zero(std::min(TriangularFactor::block_rows, rows - t), n + 1);
    for (Index i = 0; i < block.rows(); ++i) {
      for (Index j = 0; j < std::min(n, t + i + 1); ++j) block(i, j) = g[t + i - j];
      block(i, n) = e[t + i];
    }
    factor.add(block);
  }
  const Vec start = solve_triangular(factor.R(), rows).theta;
  for (Index j = 0; j < n; ++j) e.segment(j, rows - j) -= start[j] * g.head(rows - j);
}

/// The errors of one experiment; `seeded` receives the number of initial rows that are not compared.
Vec errors_of(const PolyModel& m, const Vec& y, const Mat& u, Index horizon, Seed seed, Index& seeded) {
  const ErrorFilter f = error_filter(m.p, horizon == 0);
  const Vec H = horizon > 1 ? noise_impulse(m.p, horizon) : Vec::Ones(1);
  Vec v = right_side(f, y, u);
  seeded = seed == Seed::data ? std::min(f.memory(), y.size()) : 0;
  v.head(seeded).setZero();
  Vec e = filtered(H, f.P, v);
  if (seed == Seed::estimate) fit_initial_state(e, H, f.P, f.memory());
  return e;
}

}  // namespace

Response predict(const PolyModel& m, const IdData& d, Index horizon, Seed seed) {
  if (d.inputs() != static_cast<Index>(m.p.B.size()))
    throw Error(text("the model has ", m.p.B.size(), " input", m.p.B.size() == 1 ? "" : "s", ", the data ",
                     d.inputs()));
  if (m.output >= d.outputs())
    throw Error(text("the data has ", d.outputs(), " outputs, the model needs output ", m.output + 1));
  check_horizon(horizon);
  if (missing(d) > 0) {
    IdData one = d;
    one.y = d.y.col(m.output);
    const double variance = m.quality.sigma2 > 0 ? m.quality.sigma2 : 1;
    return predict_with_gaps(innovations_form(m), Mat::Constant(1, 1, variance), one, horizon, seed)[0];
  }
  Response out;
  out.values = d.y.col(m.output);
  std::vector<double> errors, compared;
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index from = d.starts[k], n = d.end(k) - from;
    Index seeded = 0;
    const Vec y = d.y.col(m.output).segment(from, n);
    const Vec e = errors_of(m, y, d.u.middleRows(from, n), horizon, seed, seeded);
    out.values.segment(from, n) -= e;
    for (Index t = seeded; t < n; ++t) {
      errors.push_back(e[t]);
      compared.push_back(y[t]);
      out.rows.push_back(from + t);
    }
  }
  out.errors = Eigen::Map<Vec>(errors.data(), static_cast<Index>(errors.size()));
  out.compared = Eigen::Map<Vec>(compared.data(), static_cast<Index>(compared.size()));
  if (!out.values.allFinite())
    throw Failure(
        "the response overflows: the model is unstable; simulate fewer "
        "samples or predict with a short horizon");
  out.fit = fit_percent(out.compared, out.errors);
  return out;
}

double simulation_fit(const PolyModel& m, const IdData& d, Seed seed) {
  try {
    return predict(m, d, 0, seed).fit;
  } catch (const Failure&) {
    return -std::numeric_limits<double>::infinity();
  }
}

}  // namespace pendula::sysid
