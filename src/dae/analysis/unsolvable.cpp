#include "dae/analysis/unsolvable.hpp"

#include <numeric>

#include "base/error.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/points/interval_proof.hpp"
#include "dae/structure/balance.hpp"

namespace pendula::dae {

std::string why_unsolvable(const Model& m) {
  constexpr std::size_t most_together = 12, most_alone = 500;  // equations
  if (m.residuals.size() > most_alone) return "";
  std::vector<Expr> rows = residuals_at_values(m);
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (has_no_solution({&rows[i], 1}, {}))
      return text("equation ", m.label(i), "  ", m.equation_text(i), " has no solution");
  if (rows.size() > most_together || !has_no_solution(rows, {})) return "";
  std::vector<int> needed(rows.size());
  std::iota(needed.begin(), needed.end(), 0);
  for (std::size_t k = rows.size(); k-- > 0;) {
    const Expr row = rows[k];
    rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(k));
    if (has_no_solution(rows, {}))
      needed.erase(needed.begin() + static_cast<std::ptrdiff_t>(k));
    else
      rows.insert(rows.begin() + static_cast<std::ptrdiff_t>(k), row);
  }
  return "the equations " + equation_list(m, needed) + " have no solution in common";
}

}  // namespace pendula::dae
