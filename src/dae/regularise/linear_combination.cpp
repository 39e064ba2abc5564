// Conversion by a linear combination of equations (regularise.hpp, 2).
#include "dae/regularise/regularise.hpp"

#include <numeric>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/regularise/null_vectors.hpp"
#include "expr/print/primes.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {
namespace {

/// The multiplier and label of a term: "+ x y (1)", "- (2)"; sums as multipliers in parentheses.
std::string factor_text(Expr u, const std::string& label, bool first) {
  std::string size = to_text(u);
  const bool negative = size.starts_with("-") && size.find_first_of("+-", 1) == std::string::npos;
  if (negative) size = to_text(tidied(-u));
  if (!negative && size.find_first_of("+-") != std::string::npos) size = "(" + size + ")";
  const std::string sign = first ? (negative ? "-" : "") : (negative ? " - " : " + ");
  return sign + (size == "1" ? "" : size + " ") + label;
}

}  // namespace

Step convert_by_combination(Equations& e, const Structure& s, std::vector<std::string>& log) {
  const auto n = static_cast<int>(e.variables.size());
  if (e.residuals.size() > largest_circuit) return Step::nothing;
  const auto rows = circuit(s.jacobian, n);
  if (rows.size() > symbolic_circuit) return Step::nothing;
  const auto u = null_vector_of(s.jacobian, rows, n);
  if (!u) return Step::nothing;
  const auto& [c, d] = std::pair(s.offsets.c, s.offsets.d);
  int least = c[rows[0]];
  for (int i : rows) least = std::min(least, c[i]);
  std::optional<Scaled> best;
  std::size_t replaced = 0;
  for (std::size_t l = 0; l < rows.size(); ++l) {
    if (c[rows[l]] != least) continue;
    const Scaled candidate = scaled(*u, l);
    const auto order = orders_in(candidate.u, e.variables);
    bool allowed = true;
    for (std::size_t j = 0; j < order.size(); ++j)
      allowed = allowed && (order[j] < 0 || order[j] < d[j] - least);
    if (allowed && (!best || candidate.complexity() <= best->complexity())) {
      best = candidate;
      replaced = l;
    }
  }
  if (!best) return Step::nothing;
  Expr sum = 0;
  std::string how;
  int times = 0;
  std::vector<std::size_t> terms(rows.size());
  std::iota(terms.begin(), terms.end(), std::size_t{0});
  std::swap(terms[0], terms[replaced]);  // "(2) - x (1)": the replaced equation comes first
  for (std::size_t k : terms) {
    const int i = rows[k];
    sum += best->u[k] * total_derivative(e.residuals[i], c[i] - least);
    how += factor_text(best->u[k], e.labels[i] + primes(c[i] - least), how.empty());
    times = std::max(times, e.differentiated[i] + c[i] - least);
  }
  const auto target = static_cast<std::size_t>(rows[replaced]);
  const Step step = replace_equation(e, target, without_cancelled(sum, e.variables), how, log);
  log.back() += ", " + validity_text(best->nonzero);
  if (step == Step::dependent) return step;
  e.differentiated[target] = times;
  add_new(e.nonzero, best->nonzero);
  return step;
}

}  // namespace pendula::dae
