// The system Jacobian at points that satisfy the equations: where its rank decides.
#pragma once

#include <optional>
#include <unordered_map>
#include <vector>

#include "base/math.hpp"
#include "dae/structure/sigma.hpp"
#include "expr/graph/derivative.hpp"

namespace pendula::dae {

class NumericArray;

/// Ranks of a system Jacobian at points that satisfy the equations.
struct ConsistentPointRanks {
  int points = 0;           ///< at which the rank was taken
  int most = 0, least = 0;  ///< the ranks met
  int slow =
      0;  ///< points that Newton's method reaches linearly only: the equations lose rank there (z³ = 0)
  int index_proved = 0;        ///< points of full rank where the differentiation index is the structural one
  std::vector<int> dependent;  ///< rows of J that depend on each other at a point of the least rank
  /// Less than n at every point that was found.
  bool always_below(int n) const { return points > 0 ? most < n : slow > 1; }
};

/// The system Jacobian of the Σ-method where it matters: at points that satisfy the equations and their
/// derivatives up to c_i. Its rank there is less than the generic one if an entry or the determinant contains
/// the equations themselves, as in F_2 + x F_1 = 0. See Pryce, BIT 41(2), 2001, Thm 4.2: offsets and degrees
/// of freedom are right at a consistent point where the Jacobian is regular.
class ConsistentPointRank {
 public:
  static constexpr int affordable = 60;  ///< rows; singular values cost O(n³)

  /// Points where one of `nonzero` vanishes do not count.
  ConsistentPointRank(const std::vector<Expr>& residuals, std::vector<Expr> variables, const Offsets& offsets,
                      std::vector<Entry> jacobian, const std::vector<Expr>& nonzero = {});

  /// Does the rank have to be looked at? Not if no entry contains an unknown (the generic rank decides), and
  /// not beyond `affordable` rows.
  bool applies() const { return applies_; }
  /// Ranks at `wanted` points, or all that are found from `seeds` starting values; ends with the first point
  /// of full rank if `wanted` is 1.
  ConsistentPointRanks ranks(int wanted = 1, int seeds = 20) const;
  /// Values of all leaves at the point of a seed, found stage by stage; nothing if there is none.
  std::optional<std::unordered_map<Expr, double>> consistent_values(int seed) const;
  /// Is there a point among the solutions where `factor` vanishes? False: none was found.
  bool reaches(Expr factor, int seeds = 8) const;

 private:
  struct Point {
    std::vector<double> slopes;
    std::vector<char> noise;
    Vec unit;  ///< of the columns of J: ranks are taken in units of the model
    bool slow;
  };
  std::optional<Point> point(int seed, const NumericArray& numeric, int held, double size = 1) const;
  struct StagedValues {
    std::unordered_map<Expr, double> known;
    Vec w, unit;
    bool slow;
  };
  std::optional<StagedValues> staged_values(int seed, const NumericArray& all) const;
  Vec leading_units(const std::vector<Expr>& columns, const Vec& unit) const;
  std::optional<Point> staged_point(int seed, const NumericArray& all) const;
  int points_of_one_equation() const;
  bool proves_index(const Mat& J) const;
  std::vector<Expr> with_held_first(std::vector<Expr> columns, int seed) const;
  std::vector<Expr> with_given_ones(std::vector<Expr> columns) const;

  int size_;
  Offsets offsets_;
  bool applies_ = false;
  bool vanishes_twice_ = false;                  ///< an equation is C² = 0
  std::vector<Expr> variables_, rows_, slopes_;  ///< slopes: entries of J, then what must not vanish
  std::vector<int> orders_;                      ///< of the variables: the highest derivative that occurs
  std::vector<std::size_t> as_written_;          ///< rows that are not derivatives
  std::vector<int> stages_;                      ///< of the rows: times differentiated, less c
  std::vector<Entry> jacobian_;
};

}  // namespace pendula::dae
