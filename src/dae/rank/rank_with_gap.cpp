#include "dae/rank/rank_with_gap.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "base/decompositions.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

constexpr double rank_cut = 1e-8;   // relative to σ₁; larger σ always count
constexpr double rounding = 1e-16;  // ≈ ε/2, relative to σ₁: the size of a σ that is 0 without rounding

/// The rank if a QR factorisation with pivoting proves it: with diagonal blocks R₁₁ (r × r) and R₂₂, σ_r ≥
/// 1/‖R₁₁⁻¹‖ and σ_{r+1} ≤ ‖R₂₂‖, Frobenius norms (Golub & Van Loan 2013, §5.4.2). Empty if these bounds do
/// not show the widest gap.
std::optional<RankGap> proved_rank(const Mat& m) {
  const Eigen::ColPivHouseholderQR<Mat> qr(m);
  const Mat& R = qr.matrixQR();
  const Index n = std::min(m.rows(), m.cols()), cols = m.cols();
  Index r = 0;
  while (r < n && std::fabs(R(r, r)) > rank_cut * std::fabs(R(0, 0))) ++r;
  const Mat R11 = R.topLeftCorner(r, r).triangularView<Eigen::Upper>(),
            R22 = R.block(r, r, n - r, cols - r).triangularView<Eigen::Upper>();
  const double most = m.norm();  // ≥ σ₁
  const double last = 1 / (R11.triangularView<Eigen::Upper>().solve(Mat::Identity(r, r)).norm() * most);
  const double next = std::max(R22.norm() / std::fabs(R(0, 0)), rounding);
  if (!(last > rank_cut) || next / rounding > last / next) return {};
  return RankGap{static_cast<int>(r), last / next};
}

}  // namespace

LargestEntries divide_by_largest(Mat& m) {
  LargestEntries largest{Vec::Ones(m.rows()), Vec::Ones(m.cols())};
  if (m.size() == 0) return largest;
  for (Index i = 0; i < m.rows(); ++i)
    if (const double s = m.row(i).cwiseAbs().maxCoeff(); s > 0) m.row(i) /= largest.rows[i] = s;
  for (Index j = 0; j < m.cols(); ++j)
    if (const double s = m.col(j).cwiseAbs().maxCoeff(); s > 0) m.col(j) /= largest.columns[j] = s;
  return largest;
}

Mat equilibrated(Mat m) {
  divide_by_largest(m);
  return m;
}

Balance balance(const Mat& m) {
  std::vector<EntrySize> entries;
  for (Index j = 0; j < m.cols(); ++j)
    for (Index i = 0; i < m.rows(); ++i) entries.push_back({i, j, std::fabs(m(i, j))});
  return balance(m.rows(), m.cols(), entries);
}

/// Curtis & Reid (J. Inst. Maths Applics 10, 1972): minimises the sum of squares of log |m_ij rᵢ cⱼ|
/// over the entries.
Balance balance(Index rows, Index columns, const std::vector<EntrySize>& entries) {
  const Index n = rows + columns;
  constexpr double slight = 1e-10;  // fixes the open factors: r and 1/c of an isolated block
  std::vector<Eigen::Triplet<double>> lower;
  Vec right = Vec::Zero(n);
  for (Index k = 0; k < n; ++k) lower.emplace_back(k, k, slight);
  for (const auto& [i, j, size] : entries) {
    if (size == 0) continue;
    lower.emplace_back(i, i, 1);
    lower.emplace_back(rows + j, rows + j, 1);
    lower.emplace_back(rows + j, i, 1);
    right[i] -= std::log(size);
    right[rows + j] -= std::log(size);
  }
  Eigen::SparseMatrix<double> normal(n, n);
  normal.setFromTriplets(lower.begin(), lower.end());
  const Vec logs = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(normal).solve(right);
  return {logs.head(rows).array().exp(), logs.tail(columns).array().exp()};
}

RankGap rank_with_gap(const Mat& given) {
  if (given.size() == 0) return {0, 1 / rounding};
  const Mat m = equilibrated(given);
  if (m.isZero(0)) return {0, 1 / rounding};
  if (const auto proved = proved_rank(m)) return *proved;
  constexpr Index affordable = 260;  // singular values of larger matrices take seconds
  if (std::min(m.rows(), m.cols()) > affordable) return {0, 0};
  const Eigen::JacobiSVD<Mat> svd(m);
  Vec s = svd.singularValues();
  s = (s / s[0]).cwiseMax(rounding);
  RankGap best{static_cast<int>(s.size()), s[s.size() - 1] / rounding};
  if (s[s.size() - 1] > rank_cut) return best;
  best.gap = 0;
  for (Index i = 0; i + 1 < s.size(); ++i)
    if (s[i + 1] <= rank_cut && s[i] / s[i + 1] > best.gap) best = {static_cast<int>(i) + 1, s[i] / s[i + 1]};
  return best;
}

RankGap rank_in_any_units(const Mat& m) {
  const RankGap first = rank_with_gap(m);
  if (first.rank == std::min(m.rows(), m.cols()) || !m.allFinite()) return first;
  const Mat even = equilibrated(m), other = balance(even)(even);
  if (!other.allFinite()) return first;
  const RankGap second = rank_with_gap(other);
  return second.rank > first.rank && second.gap >= clear_gap ? second : first;
}

}  // namespace pendula::dae
