#include "sysid/fit/hankel.hpp"

#include <algorithm>
#include <optional>

#include "base/decompositions.hpp"
#include "base/interrupt.hpp"
#include "base/triangular_factor.hpp"

namespace pendula::sysid {
namespace {

using LongMat = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

/// The column of [U_f W_p Y_f] for each signal (inputs, then outputs) at each offset -i … i-1.
std::vector<Index> columns(const Hankel& h) {
  const Index m = h.inputs, p = h.outputs, c = m + p, f = h.future(), w = h.past();
  std::vector<Index> at(static_cast<std::size_t>(2 * h.i * c));
  for (Index k = 0; k < 2 * h.i; ++k)
    for (Index s = 0; s < c; ++s) {
      const Index ahead = k - h.i;
      const Index past = f + (-ahead - 1) * c + s, input = ahead * m + s, output = f + w + ahead * p + s - m;
      at[k * c + s] = ahead < 0 ? past : s < m ? input : output;
    }
  return at;
}

/// aᵀ b: long double sums over blocks in double, whose rounding errors average out.
long double dot(const double* a, const double* b, Index n) {
  constexpr Index block = 256;  // one slow long double addition in 256; a block errs by at most 256 ε/2
  long double sum = 0;
  for (Index t = 0; t < n; t += block) {
    const Index count = std::min(block, n - t);
    sum += Eigen::Map<const Vec>(a + t, count).dot(Eigen::Map<const Vec>(b + t, count));
  }
  return sum;
}

/// Moments Σ s(t+k) s(t+l)ᵀ of one experiment over all windows: S_kᵀ S_l with S_k = rows k … k+windows-1. The
/// first block row by sums, the others by S_{k+1}ᵀ S_{l+1} = S_kᵀ S_l + s_{last}… - s_{first}….
LongMat moments(const Mat& s, Index blocks, Index windows) {
  const Index c = s.cols();
  LongMat G(blocks * c, blocks * c);
  for (Index l = 0; l < blocks; ++l) {
    poll_interrupt();
    for (Index a = 0; a < c; ++a)
      for (Index b = 0; b < c; ++b) G(a, l * c + b) = dot(&s(0, a), &s(l, b), windows);
  }
  for (Index k = 0; k + 1 < blocks; ++k)
    for (Index l = k; l + 1 < blocks; ++l)
      for (Index a = 0; a < c; ++a)
        for (Index b = 0; b < c; ++b)
          G((k + 1) * c + a, (l + 1) * c + b) =
              G(k * c + a, l * c + b) + static_cast<long double>(s(k + windows, a)) * s(l + windows, b) -
              static_cast<long double>(s(k, a)) * s(l, b);
  G.triangularView<Eigen::StrictlyLower>() = G.transpose();
  return G;
}

/// Empty if the factor would have lost digits: a diagonal entry r, relative to the norm of its column, has
/// the relative error u/r² with u ≈ 1e-17 from the sums above.
std::optional<Mat> cholesky(const LongMat& G) {
  const auto scale = G.diagonal().cwiseSqrt().eval();
  if (!(scale.minCoeff() > 0)) return std::nullopt;
  const auto inverse = scale.cwiseInverse().asDiagonal();
  const Eigen::LLT<LongMat> llt(LongMat(inverse * G * inverse));
  if (llt.info() != Eigen::Success) return std::nullopt;
  const LongMat R = llt.matrixU();
  if (!(R.diagonal().minCoeff() > 3e-4L)) return std::nullopt;
  return Mat((R * scale.asDiagonal()).cast<double>());
}

bool by_moments(Hankel& h, const IdData& d) {
  const Index c = h.inputs + h.outputs, width = 2 * h.i * c;
  const std::vector<Index> at = columns(h);
  LongMat all = LongMat::Zero(width, width), shorter = all;
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index from = d.starts[k], rows = d.end(k) - from, windows = rows - 2 * h.i + 1;
    if (windows < 1) continue;
    Mat s(rows, c);
    s << d.u.middleRows(from, rows), d.y.middleRows(from, rows);
    const LongMat one = moments(s, 2 * h.i, windows);
    const LongMat last = s.bottomRows(2 * h.i).transpose().reshaped(width, 1).cast<long double>();
    all += one;
    shorter += one - last * last.transpose();
  }
  Eigen::PermutationMatrix<Eigen::Dynamic> order(width);
  for (Index j = 0; j < width; ++j) order.indices()[j] = static_cast<int>(at[j]);
  const auto R = cholesky(order * all * order.transpose());
  if (!R) return false;
  const auto S = cholesky(order * shorter * order.transpose());
  if (!S) return false;
  h.R = *R;
  h.shorter = *S;
  return true;
}

void by_rows(Hankel& h, const IdData& d) {
  const Index c = h.inputs + h.outputs, width = 2 * h.i * c,
              size = std::max(TriangularFactor::block_rows, 2 * width);
  const std::vector<Index> at = columns(h);
  TriangularFactor factor(width);
  Mat block(size, width), last(d.experiments(), width);
  Index n = 0, ends = 0;
  const auto window = [&](Index t, auto row) {
    for (Index k = 0; k < 2 * h.i; ++k)
      for (Index s = 0; s < c; ++s) {
        const Index from = t + k - h.i;
        row[at[k * c + s]] = s < h.inputs ? d.u(from, s) : d.y(from, s - h.inputs);
      }
  };
  for (Index k = 0; k < d.experiments(); ++k)
    for (Index t = d.starts[k] + h.i; t + h.i <= d.end(k); ++t) {
      if (t + h.i == d.end(k)) {
        window(t, last.row(ends++));
        continue;
      }
      window(t, block.row(n));
      if (++n < size) continue;
      poll_interrupt();
      factor.add(block);
      n = 0;
    }
  factor.add(block.topRows(n));
  h.shorter = factor.R();
  factor.add(last.topRows(ends));
  h.R = factor.R();
}

}  // namespace

Hankel hankel(const IdData& d, Index i) {
  Hankel h{i, d.inputs(), d.outputs(), {}, {}};
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index windows = std::max<Index>(0, d.end(k) - d.starts[k] - 2 * i + 1);
    h.windows += windows;
    h.ends += windows > 0 ? 1 : 0;
  }
  if (!by_moments(h, d)) by_rows(h, d);
  return h;
}

}  // namespace pendula::sysid
