// Gaussian elimination over the rationals that remembers which combination of the given rows every row is.
#pragma once

#include <functional>
#include <map>
#include <string>

#include <gmpxx.h>

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

}  // namespace pendula::dae
