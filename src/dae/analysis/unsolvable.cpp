#include "dae/analysis/unsolvable.hpp"

#include <algorithm>
#include <numeric>
#include <unordered_set>

#include "base/error.hpp"
#include "dae/analysis/determinant_factors.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/points/completed_squares.hpp"
#include "dae/points/interval_proof.hpp"
#include "dae/points/repeated_factors.hpp"
#include "dae/structure/balance.hpp"
#include "dae/structure/blocks.hpp"
#include "dae/structure/signature.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {

/// Rows without derivatives, after elimination of unknowns by rows that are linear in one with a constant
/// coefficient: with x + y + z = 2, x² + y² + z² = 1 becomes definite. Short rows only; spring forces
/// substituted into each other took half a minute to simplify.
static std::vector<Expr> without_linear_rows(std::vector<Expr> rows) {
  constexpr std::size_t few = 8, short_row = 60, short_solution = 20;  // rows; nodes
  const auto is_long = [](Expr e, std::size_t most) { return topological({&e, 1}).size() > most; };
  const auto is_dynamic = [](Expr row) {
    const auto inside = leaves({&row, 1});
    return std::any_of(inside.begin(), inside.end(), [](Expr leaf) { return symbol_of(leaf).order > 0; });
  };
  std::erase_if(rows, is_dynamic);
  if (rows.size() < 2 || rows.size() > few) return {};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Expr row = rows[i];
    if (is_long(row, short_row)) continue;
    for (Expr x : leaves({&row, 1})) {
      const Expr slope = simplify(partial(row, x));
      if (!exact_value(slope) || slope.is_zero()) continue;
      const Expr solved = simplify(x - row / slope);
      if (is_long(solved, short_solution)) continue;
      for (Expr& other : rows)
        if (!is_long(other, short_row)) other = simplify(substitute(other, {{x, solved}}));
      break;
    }
  }
  std::erase_if(rows, [](Expr row) { return row.is_zero(); });
  return rows;
}

/// Unsolvable by signs or intervals of the rows, or after completing their squares.
static bool are_unsolvable(std::vector<Expr> rows) {
  const bool one_is = std::any_of(rows.begin(), rows.end(), [](Expr r) { return std::abs(sign_of(r)) == 2; });
  if (one_is || has_no_solution(rows, {})) return true;
  const std::size_t given = rows.size();
  for (std::size_t i = 0; i < given; ++i)
    if (const auto squares = with_completed_squares(rows[i])) rows.push_back(*squares);
  return rows.size() > given && has_no_solution(rows, {});
}

/// Is e smooth and of one sign everywhere?
static bool is_extreme_where_zero(Expr e) {
  const auto nodes = topological({&e, 1});
  const bool has_kinks = std::any_of(nodes.begin(), nodes.end(), [](Expr n) {
    return n.op() == Op::abs || n.op() == Op::sqrt || (n.op() == Op::pow && !exact_value(n.operand(1)));
  });
  return !has_kinks && std::abs(sign_of(e)) == 1;
}

/// A minimal subset of the rows without a common solution; empty if none is found.
static std::optional<std::string> contradiction(const Model& m, const std::vector<Expr>& all,
                                                std::vector<int> rows) {
  const auto unsolvable = [&](const std::vector<int>& some) {
    std::vector<Expr> picked;
    for (int i : some) picked.push_back(all[i]);
    const std::vector<Expr> fewer = without_linear_rows(picked);
    return are_unsolvable(std::move(picked)) || are_unsolvable(fewer);
  };
  if (!unsolvable(rows)) return {};
  std::sort(rows.begin(), rows.end());
  for (std::size_t k = rows.size(); k-- > 0;) {
    std::vector<int> others = rows;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
    if (unsolvable(others)) rows = std::move(others);
  }
  return "the equations " + equation_list(m, rows) + " have no solution in common";
}

std::string why_unsolvable(const Model& m) {
  constexpr std::size_t most_together = 60, most_alone = 500;  // equations
  if (m.residuals.size() > most_alone) return "";
  const std::vector<Expr> rows = residuals_at_values(m);
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (are_unsolvable({rows[i]}))
      return text("equation ", m.label(i), "  ", m.equation_text(i), " has no solution");
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (const auto squares = with_completed_squares(rows[i]); squares && is_extreme_where_zero(*squares))
      return text("equation ", m.label(i), "  ", m.equation_text(i), " is 0 = ", to_text(*squares),
                  ", which has one sign: where it holds its gradient vanishes, as that of C² = 0 does. Write "
                  "each squared term as an equation of its own");
  std::unordered_set<Expr> bases;
  for (const Variable& v : m.variables) bases.insert(v.leaf);
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (const auto factors = repeated_factors(rows[i], bases); factors && factors->all)
      return text(
          "equation ", m.label(i), "  ", m.equation_text(i),
          " has every factor more than once: the Jacobian is singular where the equations hold, since "
          "the gradient of C² vanishes with C (write C = 0): 0 = ",
          to_text(factors->square_free));
  if (rows.size() > most_together) return "";
  for (const Part& part : dulmage_mendelsohn(incidence(m), static_cast<int>(m.variables.size())).square)
    if (part.rows.size() > 1)
      if (const auto why = contradiction(m, rows, part.rows)) return *why;
  std::vector<int> every(rows.size());
  std::iota(every.begin(), every.end(), 0);
  return contradiction(m, rows, every).value_or("");
}

}  // namespace pendula::dae
