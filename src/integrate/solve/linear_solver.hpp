// Linear systems of one fixed pattern, solved again and again: the iteration matrices of Newton's method.
//
// At first small systems, and those that are full, are dense with partial pivoting and row scaling; above
// `dense_limit` unknowns those whose entries lie in a narrow band are eliminated in it, and KLU has the
// others: the pattern is analysed once, later factorisations keep the pivots (klu_refactor) as long as their
// growth is harmless. A system that is factorised so often that it pays gets straight-line code for its
// pattern (what was factorised in earlier runs counts), with the pivots of the matrix at hand. Where later
// matrices need others, the first solver takes over until there is code for them, too. The last few programs
// are kept beyond the life of the solver, and the one that suits is used. The limits are measured:
// bench/linear.cpp, bench/linear.txt. Davis & Palamadai Natarajan, Algorithm 907: KLU, ACM TOMS 37(3), 2010.
#pragma once

#include <atomic>
#include <complex>
#include <memory>
#include <vector>

#include "codegen/linear/straight_lu.hpp"
#include "integrate/solve/band_lu.hpp"

namespace pendula::integrate {

/// Of matrices of one pattern, whoever solves them.
struct PatternUse {
  std::atomic<long> count{0};      ///< factorisations so far
  std::atomic<long> next_plan{0};  ///< when code is thought of again where it was too long
};

/// Scalar: double or std::complex<double>.
template <class Scalar>
class LinearSolver {
 public:
  /// Below 16 unknowns dense beats KLU, up to 40 it loses at most 3 µs, for the dozen
  /// factorisations before there is code; straight-line code beats KLU 2 to 6 times up to 400 and
  /// beyond, but choosing pivots costs O(n³).
  static constexpr int dense_limit = 40, straight_limit = 400;
  /// With so many entries in n² dense elimination beats KLU 2 to 4 times at any size
  /// (up to what fits in memory).
  static constexpr double full = 0.3;
  static constexpr int full_limit = 1000;

  LinearSolver();
  ~LinearSolver();
  LinearSolver(LinearSolver&&) noexcept;
  LinearSolver& operator=(LinearSolver&&) noexcept;

  /// Which of the four to use: by size and use, or always the same one (bench/linear.cpp compares them;
  /// `straight` from the first matrix on, and only where code can be made; `band` only where it is narrow,
  /// else `sparse`).
  enum class Factorisation { chosen, dense, straight, sparse, band };

  /// positions: where the entries of an n × n matrix are; an entry may be given in parts (they are added).
  void analyse(int n, const std::vector<Position>& positions,
               Factorisation factorisation = Factorisation::chosen);

  /// values in the order of positions. False if the matrix is singular to rounding or not finite.
  /// Cost: O(n³) dense, the fill of KLU otherwise. No allocation after the first call.
  bool factorise(const Scalar* values);

  /// b ← A⁻¹ b.
  void solve(Scalar* b);

  /// Makes straight-line code now, for a matrix like those to come; nothing for large systems.
  void prepare(const Scalar* values);
  /// The straight-line factorisation at hand, if the last one was such.
  const codegen::StraightLU* straight() const { return use_straight_ ? straight_.data() : nullptr; }

  /// Sign of det A of the last factorisation, 0 where it is not known (code, complex); log |det A|.
  int determinant(double& log) const;

  int size() const { return n_; }
  /// The smallest pivot of the last factorisation relative to its row (dense, band),
  /// or KLU's estimate 1/condition.
  double weakest_pivot() const;

 private:
  struct Sparse;
  bool factorise_dense(const Scalar* values);
  bool factorise_by_rows(const Scalar* values);
  bool factorise_by_columns(const Scalar* values);
  void solve_dense(Scalar* b) const;
  bool factorise_straight(const Scalar* values);
  bool plan(const Scalar* values);
  int n_ = 0, straight_limit_ = straight_limit;
  double weakest_ = 0;
  std::vector<Position> positions_;
  std::vector<Scalar> lu_;            ///< dense: rows one after the other
  std::vector<double> row_scale_;     ///< dense
  std::vector<double> column_scale_;  ///< of the factors at hand; empty where columns are as given
  std::vector<int> pivot_;
  std::unique_ptr<Sparse> sparse_;
  std::unique_ptr<BandLU<Scalar>> band_;
  std::vector<codegen::StraightLU> straight_;  ///< the one that suited last comes first
  bool use_straight_ = false;                  ///< it holds the factors at hand
  std::shared_ptr<PatternUse> use_;            ///< nothing where there is no code
  long first_plan_ = 0;                        ///< as many factorisations of all runs before there is code
  long count_ = 0, next_plan_ = 0;             ///< of this solver; when code is thought of again
  int plans_ = 0;
};

extern template class LinearSolver<double>;
extern template class LinearSolver<std::complex<double>>;

}  // namespace pendula::integrate
