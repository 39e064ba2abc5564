#include "dae/start/sparse_solution.hpp"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>

namespace pendula::dae {
namespace {

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

}  // namespace pendula::dae
