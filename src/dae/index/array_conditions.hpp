// Conditions on x that a derivative array contains as combinations of its rows with rational multipliers.
#pragma once

#include <functional>
#include <map>

#include <gmpxx.h>

#include "dae/index/derivative_array.hpp"

namespace pendula::dae {

/// A row of rational numbers and the combination of original rows that it is.
struct TrackedRow {
  std::map<int, mpq_class> entries;      ///< by column
  std::map<int, mpq_class> combination;  ///< by original row
};

/// Adds rows one after the other; a row that is a combination of earlier ones is left with no entries.
class TrackedElimination {
 public:
  /// The row reduced by all earlier ones; kept as a pivot row unless nothing is left of it.
  TrackedRow add(TrackedRow row);

 private:
  std::map<int, TrackedRow> pivots_;  // by the last column of the row
};

/// Multiplies by the number that makes the multipliers coprime integers.
void make_coprime(std::map<int, mpq_class>& combination);

/// "(3) - (1)′ + 2 (2)": label(i) names row i.
std::string combination_text(const std::map<int, mpq_class>& combination,
                             const std::function<std::string(int)>& label);

/// The sign that makes the coefficient of the first unknown positive, where it is a number.
Expr with_leading_sign(Expr residual, const std::vector<Expr>& states);

/// All independent ones among the first `orders` derivatives, in the order in which they appear. Rows whose
/// derivatives with respect to y are not all rational constants are left out. `independent` decides whether
/// a condition adds to those found.
std::vector<ArrayCondition> explicit_conditions(
    const Model& model, const DerivativeArray& array, int orders,
    const std::function<bool(const std::vector<Expr>& found)>& independent);

}  // namespace pendula::dae
