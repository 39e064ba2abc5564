#include "dae/newton/block_solution.hpp"

#include "base/decompositions.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "dae/structure/blocks.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

/// Solves one block; empty if it is not clearly regular.
std::optional<Vec> solve_plainly(Mat A, const Vec& b) {
  constexpr double regular = 1e-6;  // the reciprocal condition: ε / regular, ten digits, are right
  const LargestEntries largest = divide_by_largest(A);
  if (!A.allFinite()) return {};
  const Eigen::PartialPivLU<Mat> lu(A);
  if (!(lu.rcond() > regular)) return {};
  return Vec(lu.solve(b.cwiseQuotient(largest.rows)).cwiseProduct(largest.columns.cwiseInverse()));
}

}  // namespace

std::optional<Vec> solve_by_blocks(const Mat& A, const Vec& b) {
  if (A.rows() != A.cols() || A.rows() == 0 || !A.allFinite()) return {};
  Pattern pattern;
  for (Index i = 0; i < A.rows(); ++i) {
    std::vector<int>& row = pattern.emplace_back();
    for (Index j = 0; j < A.cols(); ++j)
      if (A(i, j) != 0) row.push_back(static_cast<int>(j));
  }
  const Blocks blocks = dulmage_mendelsohn(pattern, static_cast<int>(A.cols()));
  if (!blocks.over.rows.empty() || !blocks.under.columns.empty()) return {};
  Vec x = Vec::Zero(A.cols());
  for (const Part& block : blocks.square) {
    const std::vector<Index> rows(block.rows.begin(), block.rows.end());
    const std::vector<Index> columns(block.columns.begin(), block.columns.end());
    const auto part = solve_plainly(A(rows, columns), b(rows) - A(rows, Eigen::all) * x);
    if (!part || !part->allFinite()) return {};
    for (std::size_t k = 0; k < columns.size(); ++k) x[columns[k]] = (*part)[k];
  }
  return x;
}

Vec balanced_solution(Mat A, const Vec& b) {
  if (const auto x = solve_by_blocks(A, b)) return *x;
  const LargestEntries largest = divide_by_largest(A);
  Eigen::CompleteOrthogonalDecomposition<Mat> qr;
  qr.setThreshold(1e-13);  // smaller pivots of the balanced matrix are rounding
  qr.compute(A);
  return largest.columns.cwiseInverse().cwiseProduct(Vec(qr.solve(Vec(b.cwiseQuotient(largest.rows)))));
}

}  // namespace pendula::dae
