// LU factorisation of matrices of one sparsity pattern as straight-line code: no loops, no indices, no zeros.
//
// The pivots are chosen once, on actual numbers: the sparsest of those that are not small (Markowitz with
// threshold; Duff, Erisman & Reid, Direct Methods for Sparse Matrices, 2nd ed., §7.2 and §5.2). The
// elimination with these pivots becomes machine code. Later matrices may need other pivots: then the
// multipliers grow, factorise() notices and refuses.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "codegen/program/writer.hpp"

namespace pendula::codegen {

class StraightLU {
 public:
  struct Position {
    int row, column;
  };
  struct Code;  ///< pivots and what was made for them

  /// A plan for n×n matrices with these positions (an entry may be given in parts: they are added), from the
  /// values of one of them; complex numbers are pairs (re, im). Nothing if that matrix is singular to
  /// rounding, if the elimination would need more than `longest` operations, or where there is no machine
  /// code. Cost: O(n · fill) for the pivots and 0.15 µs per operation.
  static std::optional<StraightLU> plan(int n, const std::vector<Position>& positions, const double* values,
                                        bool complex, std::size_t longest = 60'000);
  /// The last plans for these positions, newest first, at most
  /// `most_remembered`: whose pivots suit, factorise() will say.
  static std::vector<StraightLU> remembered(int n, const std::vector<Position>& positions, bool complex);
  static constexpr std::size_t most_remembered = 4;

  /// False if a pivot is zero, the multipliers of a row add up to more than 10⁴ (rows of this matrix scaled
  /// to largest entries of 1; Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., §9.3), or a
  /// number is not finite: nothing is factorised then.
  bool factorise(const double* values);
  /// b ← A⁻¹ b, n numbers or pairs. Requires a factorisation.
  void solve(double* b);

  /// The smallest pivot of the factorisation, rows scaled to largest entries of 1:
  /// near 0 close to a singular matrix.
  double weakest_pivot() const;

  std::size_t instructions() const;  ///< of factorisation and solution together

  /// For programs that solve on the way, with these pivots, in real or complex numbers (pairs), whichever the
  /// plan was made for.
  std::size_t factor_count() const { return factors_; }
  /// The program of factorise() for these values, in the order of the positions: the factors, and growth ≤ 1
  /// if they can be used (it is not finite where they are not).
  std::vector<Slot> write_factors(Writer& writer, std::span<const Slot> values, bool complex,
                                  Slot& growth) const;
  /// x with A x = b from values that hold the factors.
  std::vector<Slot> write_solution(Writer& writer, std::span<const Slot> factors, std::span<const Slot> b,
                                   bool complex) const;
  /// Equal for two factorisations with the same pivots, whose factors mean the same.
  const std::shared_ptr<const Code>& pivots() const { return code_; }

 private:
  StraightLU() = default;
  static void remember(const StraightLU& plan);
  double* factors() { return numbers_.data() + 1 + n_; }
  const double* factors() const { return numbers_.data() + 1 + n_; }
  int n_ = 0, width_ = 1;  ///< width: numbers per entry
  std::size_t multipliers_ = 0, factors_ = 0;
  std::shared_ptr<const Code> code_;
  /// growth | sizes of the rows | multipliers | upper part and reciprocal pivots | right side
  std::vector<double> numbers_;
  std::vector<double> work_;
};

}  // namespace pendula::codegen
