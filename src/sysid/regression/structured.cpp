#include "sysid/regression/structured.hpp"

#include <array>
#include <cmath>
#include <optional>

#include "base/decompositions.hpp"
#include "base/interrupt.hpp"

namespace pendula::sysid {
namespace {

constexpr Index block_rows = 1024;  // of residuals: 8 KB, which stay in the first-level cache

/// A sum carried in twice the working precision (Ogita, Rump & Oishi, SIAM J. Sci.
/// Comput. 26(6), 2005, Sum2).
struct Sum {
  double high = 0, low = 0;
  void add(double x) {
    const double s = high + x, z = s - high;
    low += (high - (s - z)) + (x - z);
    high = s;
  }
  double value() const { return high + low; }
};

/// A SIMD register of two doubles, available on every x86-64 and AArch64 processor.
typedef double Pair __attribute__((vector_size(16)));

inline Pair load(const double* p) {
  Pair v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}

/// out[k] = Σ_t x[t] z[t - k] for k = 0..3, t = 0..n-1.
void four_products(const double* x, const double* z, Index n, double* out) {
  std::array<Pair, 8> s{};
  Index t = 0;
  for (; t + 4 <= n; t += 4) {
    const Pair x0 = load(x + t), x1 = load(x + t + 2);
    s[0] += x0 * load(z + t);
    s[4] += x1 * load(z + t + 2);
    s[1] += x0 * load(z + t - 1);
    s[5] += x1 * load(z + t + 1);
    s[2] += x0 * load(z + t - 2);
    s[6] += x1 * load(z + t);
    s[3] += x0 * load(z + t - 3);
    s[7] += x1 * load(z + t - 1);
  }
  for (std::size_t k = 0; k < 4; ++k) {
    const Pair sum = s[k] + s[k + 4];
    out[k] = sum[0] + sum[1];
  }
  for (; t < n; ++t)
    for (Index k = 0; k < 4; ++k) out[k] += x[t] * z[t - k];
}

double one_product(const double* x, const double* z, Index n) {
  Pair a{}, b{};
  Index t = 0;
  for (; t + 4 <= n; t += 4) {
    a += load(x + t) * load(z + t);
    b += load(x + t + 2) * load(z + t + 2);
  }
  double sum = (a[0] + a[1]) + (b[0] + b[1]);
  for (; t < n; ++t) sum += x[t] * z[t];
  return sum;
}

/// out[k] += Σ_t x[t] z[t - k] for k = 0..count-1.
void products(const double* x, const double* z, Index n, Index count, Sum* out) {
  Index k = 0;
  std::array<double, 4> four{};
  for (; k + 4 <= count; k += 4) {
    four_products(x, z - k, n, four.data());
    for (Index i = 0; i < 4; ++i) out[k + i].add(four[i]);
  }
  for (; k < count; ++k) out[k].add(one_product(x, z - k, n));
}

/// Consecutive lags of one signal; the target y(t) is appended to its own past if that occurs.
struct Band {
  const double* signal;  ///< at the segment's first row, lag 0
  Index lag, count;
  std::vector<Index> column;  ///< of each lag; the target is the last column
  std::vector<double> sign;
};

/// A contiguous range of rows with the signals it reads, zero-padded where there is no past.
struct Segment {
  std::vector<std::vector<double>> padded;
  std::vector<Band> bands;
  const double* target = nullptr;
  Index rows = 0;
};

Band band_of(const double* signal, Index lag, Index count, double sign, Index first) {
  Band band{signal, lag, count, {}, std::vector<double>(static_cast<std::size_t>(count), sign)};
  for (Index i = 0; i < count; ++i) band.column.push_back(first + i);
  return band;
}

std::vector<Band> bands_of(const Regressor& regressor) {
  std::vector<Band> bands;
  bool joined = false;
  for (const Regressor::Group& g : regressor.groups()) {
    bands.push_back(band_of(g.signal, g.lag, g.count, g.sign, g.first));
    if (g.signal != regressor.target() || g.lag != 1) continue;
    Band& past = bands.back();
    past.lag = 0;
    past.count += 1;
    joined = true;
    past.column.insert(past.column.begin(), regressor.columns());
    past.sign.insert(past.sign.begin(), 1.0);
  }
  if (!joined) bands.push_back(band_of(regressor.target(), 0, 1, 1.0, regressor.columns()));
  return bands;
}

Segment make_segment(const Regressor& regressor, const RowRange& range) {
  Segment s;
  s.rows = range.last - range.first;
  s.target = regressor.target() + range.first;
  s.bands = bands_of(regressor);
  const Index past = range.first - range.begin;
  for (Band& band : s.bands) {
    band.signal += range.first;
    // one more than the last lag: the sample that enters by the displacement
    const Index need = band.lag + band.count;
    if (past >= need) continue;
    s.padded.emplace_back(static_cast<std::size_t>(need - past), 0.0);
    s.padded.back().insert(s.padded.back().end(), band.signal - past, band.signal + s.rows);
    band.signal = s.padded.back().data() + need;
  }
  return s;
}

/// Σ_t over one segment of a(t - la - i) b(t - lb - j) for (0, j) and (i, 0), j < nb, i < na.
struct Edges {
  std::vector<Sum> row, column;
};

void add_block(const Segment& s, const Band& a, const Band& b, Mat& gram) {
  Edges e{std::vector<Sum>(static_cast<std::size_t>(b.count)),
          std::vector<Sum>(static_cast<std::size_t>(a.count))};
  for (Index t = 0; t < s.rows; t += block_rows) {
    const Index n = std::min(block_rows, s.rows - t);
    products(a.signal + t - a.lag, b.signal + t - b.lag, n, b.count, e.row.data());
    if (&a != &b && a.count > 1)
      products(b.signal + t - b.lag, a.signal + t - a.lag - 1, n, a.count - 1, e.column.data() + 1);
  }
  Mat m(a.count, b.count);
  for (Index j = 0; j < b.count; ++j) m(0, j) = e.row[j].value();
  for (Index i = 1; i < a.count; ++i) m(i, 0) = (&a == &b ? e.row : e.column)[i].value();
  const double* const pa = a.signal - a.lag;
  const double* const pb = b.signal - b.lag;
  for (Index j = 1; j < b.count; ++j)
    for (Index i = 1; i < a.count; ++i)
      m(i, j) = m(i - 1, j - 1) + pa[-i] * pb[-j] - pa[s.rows - i] * pb[s.rows - j];
  for (std::size_t j = 0; j < b.column.size(); ++j)
    for (std::size_t i = 0; i < a.column.size(); ++i) {
      const double value = a.sign[i] * b.sign[j] * m(static_cast<Index>(i), static_cast<Index>(j));
      gram(a.column[i], b.column[j]) += value;
      if (&a != &b) gram(b.column[j], a.column[i]) += value;
    }
}

/// r = y - Φθ, g += Φᵀr without the signs of Φ, and ‖r‖².
void residual_pass(const Segment& s, const Regressor& regressor, const Vec& theta, std::vector<Sum>& g,
                   Sum& norm2) {
  std::array<double, block_rows> r{};
  const std::vector<Regressor::Group>& groups = regressor.groups();
  const auto at = [&](std::size_t k, Index t) { return s.bands[k].signal + t - groups[k].lag; };
  for (Index t = 0; t < s.rows; t += block_rows) {
    const Index n = std::min(block_rows, s.rows - t);
    std::copy(s.target + t, s.target + t + n, r.begin());
    for (std::size_t k = 0; k < groups.size(); ++k) {
      const double* const x = at(k, t);
      const double* const c = theta.data() + groups[k].first;
      Index j = 0;
      for (; j + 4 <= groups[k].count; j += 4) {
        const double c0 = groups[k].sign * c[j], c1 = groups[k].sign * c[j + 1],
                     c2 = groups[k].sign * c[j + 2], c3 = groups[k].sign * c[j + 3];
        const double* const z = x - j;
        for (Index i = 0; i < n; ++i) r[i] -= (c0 * z[i] + c1 * z[i - 1]) + (c2 * z[i - 2] + c3 * z[i - 3]);
      }
      for (; j < groups[k].count; ++j) {
        const double c0 = groups[k].sign * c[j];
        for (Index i = 0; i < n; ++i) r[i] -= c0 * x[i - j];
      }
    }
    for (std::size_t k = 0; k < groups.size(); ++k)
      products(r.data(), at(k, t), n, groups[k].count, g.data() + groups[k].first);
    norm2.add(one_product(r.data(), r.data(), n));
  }
}

std::vector<Segment> segments_of(const Regressor& regressor) {
  std::vector<Segment> all;
  for (const RowRange& range : regressor.ranges()) all.push_back(make_segment(regressor, range));
  return all;
}

Mat gram_of(const std::vector<Segment>& segments, Index d) {
  Mat gram = Mat::Zero(d + 1, d + 1);
  for (const Segment& s : segments)
    for (std::size_t i = 0; i < s.bands.size(); ++i) {
      poll_interrupt();
      for (std::size_t j = i; j < s.bands.size(); ++j) add_block(s, s.bands[i], s.bands[j], gram);
    }
  return gram;
}

/// Refines until the correction is at the rounding level; returns ‖y - Φθ‖² at the last θ.
double refine(const std::vector<Segment>& segments, const Regressor& regressor, const Mat& inverse,
              Vec& theta) {
  double sse = 0, previous = INFINITY;
  // The inverse errs by cond(ΦᵀΦ) ε ≤ 2e-8 (see solve_structured), and so does a step relative to the one
  // before: two passes suffice, a third one measures the last step.
  constexpr double next_is_rounding = 1e-9;  // times 2e-8 it is below ε
  constexpr double exact = 1e-12;            // of ‖y‖²: below it the sum of squares itself is rounding
  constexpr double no_progress = 0.1;
  constexpr int most = 4;
  for (int pass = 0; pass < most; ++pass) {
    poll_interrupt();
    std::vector<Sum> g(static_cast<std::size_t>(theta.size()));
    Sum norm2;
    for (const Segment& s : segments) residual_pass(s, regressor, theta, g, norm2);
    Vec gradient(theta.size());
    for (Index i = 0; i < theta.size(); ++i) gradient[i] = g[i].value();
    for (const Regressor::Group& group : regressor.groups())
      gradient.segment(group.first, group.count) *= group.sign;
    const Vec step = inverse * gradient;
    theta += step;
    sse = norm2.value() - step.dot(gradient);
    const double size = step.norm();
    if (size <= next_is_rounding * theta.norm() && sse > exact * norm2.value()) break;
    if (size >= no_progress * previous) break;
    previous = size;
  }
  return std::max(sse, 0.0);
}

}  // namespace

TriangularFactor triangular_factor(const Regressor& regressor, const Mat* outputs) {
  const Index d = regressor.columns(), p = outputs ? outputs->cols() : 1;
  TriangularFactor factor(d + p);
  const Index size = std::max(TriangularFactor::block_rows, 2 * d);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> block(size, d + p);
  for (const RowRange& range : regressor.ranges())
    for (Index t = range.first; t < range.last;) {
      poll_interrupt();
      Index n = 0;
      for (; n < size && t < range.last; ++n, ++t) {
        regressor.row(t, range.begin, block.data() + n * (d + p));
        if (outputs)
          block.row(n).tail(p) = outputs->row(t);
        else
          block(n, d) = regressor.target()[t];
      }
      factor.add(Mat(block.topRows(n)));
    }
  return factor;
}

LeastSquares solve_blocked(const Regressor& regressor) {
  const TriangularFactor factor = triangular_factor(regressor);
  return solve_triangular(factor.R(), factor.rows());
}

std::optional<LeastSquares> solve_structured(const Regressor& regressor) {
  const Index d = regressor.columns();
  const std::vector<Segment> segments = segments_of(regressor);
  const Mat gram = gram_of(segments, d);
  LeastSquares out;
  out.rows = regressor.rows();
  out.scale = gram.diagonal().head(d).cwiseSqrt();
  out.y_norm = std::sqrt(gram(d, d));
  if (!(out.scale.minCoeff() > 0)) return {};
  const Mat scaled = out.scale.cwiseInverse().asDiagonal() * gram.topLeftCorner(d, d) *
                     out.scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Mat> spectrum(scaled, Eigen::EigenvaluesOnly);
  constexpr double well_conditioned = 1e-8;  // the inverse keeps half of its digits, and refine() the others
  if (!(spectrum.eigenvalues()[0] > well_conditioned * spectrum.eigenvalues()[d - 1])) return {};
  out.inverse = out.scale.cwiseInverse().asDiagonal() * Mat(scaled.llt().solve(Mat(Mat::Identity(d, d)))) *
                out.scale.cwiseInverse().asDiagonal();
  out.theta = out.inverse * gram.col(d).head(d);
  out.sse = refine(segments, regressor, out.inverse, out.theta);
  out.rank = d;
  out.null_space.resize(d, 0);
  return out;
}

LeastSquares solve_regression(const Regressor& regressor) {
  // fewer rows are factored in milliseconds; every range of rows without gaps has its own sums
  constexpr Index many = 2000;
  constexpr std::size_t few = 1000;
  if (regressor.rows() >= many && regressor.columns() > 0 && regressor.ranges().size() < few) {
    if (auto fast = solve_structured(regressor)) return std::move(*fast);
  }
  return solve_blocked(regressor);
}

}  // namespace pendula::sysid
