// The volume of a simple polytope {θ : g_iᵀθ ≤ h_i} from its vertices alone: with any c that is not
// orthogonal to an edge and c = G_vᵀγ at the vertex v, where G_v has the rows of the d facets there,
//   vol = Σ_v (cᵀv)ᵈ / (d! |det G_v| Π γ_i)                       Lawrence, Math. Comp. 57, 1991.
// The terms cancel; the loss of digits is measured and compensated by higher precision.
#include <array>
#include <cmath>

#include <gmpxx.h>

#include "base/interrupt.hpp"
#include "sysid/noise/polytope.hpp"

namespace pendula::sysid {
namespace {

using Real = mpf_class;

/// Solves Gᵀγ = c by elimination with pivoting; G and c are overwritten, c by γ. Returns |det G|,
/// 0 if singular.
class Corner {
 public:
  Corner(Index d, mp_bitcnt_t bits)
      : d_(static_cast<std::size_t>(d)),
        columns_(d_, std::vector<Real>(d_, Real(0, bits))),
        gamma_(d_, Real(0, bits)),
        product_(0, bits),
        factor_(0, bits),
        det_(0, bits) {}

  Real& entry(std::size_t row_of_g, std::size_t column) { return columns_[column][row_of_g]; }
  std::vector<Real>& gamma() { return gamma_; }

  const Real& solve() {
    det_ = 1;
    for (std::size_t k = 0; k < d_; ++k) {
      std::size_t pivot = k;
      for (std::size_t i = k + 1; i < d_; ++i)
        if (cmp(abs(columns_[i][k]), abs(columns_[pivot][k])) > 0) pivot = i;
      std::swap(columns_[k], columns_[pivot]);
      std::swap(gamma_[k], gamma_[pivot]);
      det_ *= columns_[k][k];
      if (det_ == 0) return det_;
      for (std::size_t i = k + 1; i < d_; ++i) {
        factor_ = columns_[i][k] / columns_[k][k];
        for (std::size_t j = k + 1; j < d_; ++j) subtract(columns_[i][j], columns_[k][j]);
        subtract(gamma_[i], gamma_[k]);
      }
    }
    for (std::size_t k = d_; k-- > 0;) {
      for (std::size_t j = k + 1; j < d_; ++j) {
        factor_ = columns_[k][j];
        subtract(gamma_[k], gamma_[j]);
      }
      gamma_[k] /= columns_[k][k];
    }
    det_ = abs(det_);
    return det_;
  }

 private:
  void subtract(Real& from, const Real& times) {  // from ← from - factor · times, without allocation
    product_ = factor_ * times;
    from -= product_;
  }

  std::size_t d_;
  std::vector<std::vector<Real>> columns_;  ///< of G: the rows of Gᵀ
  std::vector<Real> gamma_;
  Real product_, factor_, det_;
};

/// Σ_v (cᵀv)ᵈ / (|det G_v| Π γ_i), and the size of its largest term; (0, 0) where a denominator is 0.
std::pair<Real, Real> lawrence_sum(const FeasibleSet& s, const Polytope& p, const Vec& c, const Vec& middle,
                                   mp_bitcnt_t bits) {
  const Index d = p.vertices.cols();
  Real sum(0, bits), largest(0, bits), term(0, bits), height(0, bits), shift(0, bits), product(0, bits);
  Corner corner(d, bits);
  std::vector<Real> h(static_cast<std::size_t>(d), Real(0, bits));
  for (std::size_t v = 0; v < p.active.size(); ++v) {
    if (v % 64 == 0) poll_interrupt();
    for (std::size_t i = 0; i < h.size(); ++i) {
      const Index constraint = p.active[v][i];
      const double sign = constraint % 2 ? 1 : -1;
      h[i] = sign * (constraint % 2 ? s.upper : s.lower)[constraint / 2];
      for (std::size_t j = 0; j < h.size(); ++j) {
        corner.entry(i, j) = sign * s.Phi(constraint / 2, static_cast<Index>(j));
        shift = middle[j];
        product = corner.entry(i, j) * shift;
        h[i] -= product;
      }
      corner.gamma()[i] = c[i];
    }
    term = corner.solve();
    for (const Real& g : corner.gamma()) term *= g;
    if (term == 0) return {Real(0), Real(0)};
    term = 1 / term;
    height = 0;
    for (std::size_t i = 0; i < h.size(); ++i) {
      product = corner.gamma()[i] * h[i];
      height += product;
    }
    for (Index k = 0; k < d; ++k) term *= height;
    sum += term;
    if (cmp(abs(term), largest) > 0) largest = abs(term);
  }
  return {sum, largest};
}

}  // namespace

std::optional<double> simple_volume(const FeasibleSet& s, const Polytope& p) {
  const Index d = p.vertices.cols();
  for (const auto& set : p.active)
    if (static_cast<Index>(set.size()) != d) return {};
  const Vec low = p.vertices.colwise().minCoeff(), high = p.vertices.colwise().maxCoeff();
  if (!((high - low).minCoeff() > 0)) return {};
  Vec c(d);  // multiples of the golden ratio: directions that are not orthogonal to edges of measured data
  for (Index i = 0; i < d; ++i)
    c[i] = (1 + std::fmod(0.6180339887498949 * static_cast<double>(i + 1), 1)) / (high[i] - low[i]);
  constexpr std::array<mp_bitcnt_t, 3> precisions = {256, 512, 1024};
  for (const mp_bitcnt_t bits : precisions) {
    auto [sum, largest] = lawrence_sum(s, p, c, (low + high) / 2, bits);
    Real lost(largest, bits);
    mpf_div_2exp(lost.get_mpf_t(), lost.get_mpf_t(), bits / 2);
    if (cmp(sum, lost) <= 0) continue;  // more than half of the digits cancelled
    for (Index k = 2; k <= d; ++k) sum /= static_cast<unsigned long>(k);
    return sum.get_d();
  }
  return {};
}

}  // namespace pendula::sysid
