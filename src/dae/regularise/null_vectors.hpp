// Common parts of the conversions of a singular structure (regularise.hpp): dependent sets of rows or
// columns of the system Jacobian, and their null vectors.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dae/regularise/elimination.hpp"
#include "expr/graph/matrix.hpp"

namespace pendula::dae {

constexpr std::size_t largest_circuit = 200;  ///< equations in one dependent set that is searched for
constexpr std::size_t symbolic_circuit = 8;   ///< beyond it null vectors are too long to be of use

std::vector<Entry> transposed(std::vector<Entry> entries);

/// A set of dependent rows of which none can be left out: exactly one null vector, without zeros. Empty if
/// the search would be too long.
std::vector<int> circuit(const std::vector<Entry>& entries, int n);

/// The null vector of the rows of a circuit: Σ u_i row_i = 0.
std::optional<VecX> null_vector_of(const std::vector<Entry>& J, const std::vector<int>& rows, int n);

/// u scaled so that u_l = 1, and where that is allowed.
struct Scaled {
  std::vector<Expr> u;
  std::vector<Expr> nonzero;
  int complexity() const;
};
Scaled scaled(const VecX& u, std::size_t l);

/// a/b where it is the same rational number everywhere, whatever the form of a and b.
std::optional<Expr> constant_ratio(Expr a, Expr b);

/// Highest order of every variable in the vector; -1 where it does not occur.
std::vector<int> orders_in(const std::vector<Expr>& vector, const std::vector<Expr>& variables);

/// "valid where x ≠ 0", "valid everywhere".
std::string validity_text(const std::vector<Expr>& nonzero);

void add_new(std::vector<Expr>& list, const std::vector<Expr>& more);

}  // namespace pendula::dae
