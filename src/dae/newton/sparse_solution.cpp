#include "dae/newton/sparse_solution.hpp"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>
#include <Eigen/SparseQR>
#include <algorithm>

#include "base/interrupt.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;
using Sparse = Eigen::SparseMatrix<double>;

template <class Factors>
std::optional<Vec> refined_solution(const Eigen::SparseMatrix<double>& A, const Vec& b, int times) {
  const Factors factors(A);
  if (factors.info() != Eigen::Success) return {};
  Vec x = factors.solve(b);
  for (int k = 0; k < times && x.allFinite(); ++k) x += factors.solve(Vec(b - A * x));
  return x;
}

}  // namespace

std::optional<Vec> solve_by_lu(const Eigen::SparseMatrix<double>& A, const Vec& b) {
  return refined_solution<Eigen::SparseLU<Eigen::SparseMatrix<double>>>(A, b, 1);
}

std::optional<Vec> solve_by_ldlt(const Eigen::SparseMatrix<double>& A, const Vec& b) {
  return refined_solution<Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>>(A, b, 2);
}

Index sparse_rank(const Sparse& A) {
  Sparse compressed = A;
  compressed.makeCompressed();
  return Eigen::SparseQR<Sparse, Eigen::COLAMDOrdering<int>>(compressed).rank();
}

std::optional<Vec> square_step(const Sparse& J, const Vec& r) {
  constexpr double accurate = 1e-10;  // relative residual; a regular A leaves n ε, 10⁻¹² at n = 5000
  std::vector<int> row(static_cast<std::size_t>(J.rows()), -1),
      column(static_cast<std::size_t>(J.cols()), -1);
  for (Index j = 0; j < J.outerSize(); ++j)
    for (Sparse::InnerIterator it(J, j); it; ++it)
      if (it.value() != 0) row[it.row()] = column[j] = 0;
  int rows = 0, columns = 0;
  for (int& i : row)
    if (i == 0) i = rows++;
  for (int& j : column)
    if (j == 0) j = columns++;
  if (rows != columns || rows == 0) return {};
  std::vector<Eigen::Triplet<double>> entries;
  for (Index j = 0; j < J.outerSize(); ++j)
    for (Sparse::InnerIterator it(J, j); it; ++it)
      if (it.value() != 0) entries.emplace_back(row[it.row()], column[j], it.value());
  Sparse A(rows, rows);
  A.setFromTriplets(entries.begin(), entries.end());
  A.makeCompressed();
  Vec b(rows);
  for (std::size_t i = 0; i < row.size(); ++i)
    if (row[i] >= 0) b[row[i]] = -r[i];
  const auto solution = solve_by_lu(A, b);
  if (!solution) return {};
  const Vec& x = *solution;
  if (!x.allFinite() || (b - A * x).norm() > accurate * b.norm()) return {};
  Vec d = Vec::Zero(J.cols());
  for (std::size_t j = 0; j < column.size(); ++j)
    if (column[j] >= 0) d[j] = x[column[j]];
  return d;
}

Vec sparse_least_step(const Sparse& J, const Vec& r) {
  // Directions with σ < μ = 10⁻⁶ are left out, those with σ ≥ 10⁻³ are solved to μ²/σ² = 10⁻⁶. The
  // factorisation without pivots errs by ε/μ² = 2·10⁻⁴, after two refinements by its cube, 10⁻¹¹.
  constexpr double mu_squared = 1e-12, accurate = 1e-9;
  const Index m = J.rows(), n = J.cols();
  std::vector<Eigen::Triplet<double>> entries;
  for (Index i = 0; i < m; ++i) entries.emplace_back(i, i, 1);
  for (Index j = 0; j < n; ++j) entries.emplace_back(m + j, m + j, -mu_squared);
  for (Index j = 0; j < J.outerSize(); ++j)
    for (Sparse::InnerIterator it(J, j); it; ++it) {
      entries.emplace_back(m + j, it.row(), it.value());
      entries.emplace_back(it.row(), m + j, it.value());
    }
  Sparse K(m + n, m + n);
  K.setFromTriplets(entries.begin(), entries.end());
  Vec right = Vec::Zero(m + n);
  right.head(m) = -r;
  if (const auto x = solve_by_ldlt(K, right);
      x && x->allFinite() && (right - K * *x).norm() <= accurate * right.norm())
    return x->tail(n);
  poll_interrupt();
  K.makeCompressed();
  const auto x = solve_by_lu(K, right);
  return x ? Vec(x->tail(n)) : Vec::Constant(n, NAN);
}

}  // namespace pendula::dae
