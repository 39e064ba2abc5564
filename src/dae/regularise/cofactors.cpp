#include "dae/regularise/cofactors.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <unordered_set>

#include "base/interrupt.hpp"
#include "dae/regularise/elimination.hpp"
#include "expr/generic/generic.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

using Remainder = generic::Residue;  // with operators; the residues of dae/rank are plain numbers

constexpr std::size_t most_products = 240;  // products μ Cⱼ with a monomial μ
constexpr int highest_degree = 3;

/// The maximal subexpressions that are not polynomial operations.
std::vector<Expr> generators(const std::vector<Expr>& expressions) {
  std::unordered_set<Expr> inside(expressions.begin(), expressions.end());
  const std::vector<Expr> order = topological(expressions);
  std::vector<Expr> list;
  for (auto it = order.rbegin(); it != order.rend(); ++it) {  // operations before their operands
    const Expr e = *it;
    if (!inside.count(e) || e.is_constant()) continue;
    const bool by_number = (e.op() == Op::div || e.op() == Op::pow) && e.operand(1).is_constant();
    if (e.op() != Op::neg && e.op() != Op::add && e.op() != Op::sub && e.op() != Op::mul && !by_number)
      list.push_back(e);
    else
      inside.insert(e.operands().begin(), e.operands().end());
  }
  std::reverse(list.begin(), list.end());
  return list;
}

/// Monomials of one total degree: products of generators in ascending order.
struct Monomials {
  std::vector<Expr> value;
  std::vector<std::size_t> last;  ///< the greatest generator in each
};
Monomials next_degree(const Monomials& before, const std::vector<Expr>& generators) {
  Monomials next;
  for (std::size_t k = 0; k < before.value.size(); ++k)
    for (std::size_t g = before.last[k]; g < generators.size(); ++g) {
      next.value.push_back(before.value[k] * generators[g]);
      next.last.push_back(g);
    }
  return next;
}

/// Values of a function at the sampled points, with its representation by the given functions.
struct Sampled {
  std::vector<Remainder> values;
  std::map<std::size_t, Remainder> combination;
};

/// A basis of functions in echelon form.
class Span {
 public:
  void reduce(Sampled& f) const {
    for (const auto& [column, pivot] : pivots_) {
      if (f.values[column].is_zero()) continue;
      const Remainder factor = f.values[column] / pivot.values[column];
      for (std::size_t k = 0; k < f.values.size(); ++k) f.values[k] = f.values[k] - factor * pivot.values[k];
      for (const auto& [i, value] : pivot.combination) f.combination[i] = f.combination[i] - factor * value;
    }
  }
  void add(Sampled f) {
    reduce(f);
    for (std::size_t k = 0; k < f.values.size(); ++k)
      if (!f.values[k].is_zero()) return void(pivots_.push_back({k, std::move(f)}));
  }

 private:
  std::vector<std::pair<std::size_t, Sampled>> pivots_;
};

bool is_null(const Sampled& f) {
  return std::all_of(f.values.begin(), f.values.end(), [](Remainder r) { return r.is_zero(); });
}

/// c as a combination of these functions, by their numbers; empty if there is none. Requires c ≠ 0.
std::map<std::size_t, mpq_class> combination(const std::vector<Expr>& functions, Expr c) {
  // points beyond the number of functions; each makes a false zero 2⁶⁰ times less likely
  constexpr std::size_t more = 8;
  std::vector<Expr> outputs = functions;
  outputs.push_back(c);
  std::vector<Sampled> sampled(outputs.size());
  for (std::uint64_t seed = 1; sampled[0].values.size() < outputs.size() + more; ++seed) {
    if (seed > 4 * (outputs.size() + more)) return {};
    const auto values = generic::residues_at(outputs, seed, generic::Pieces::drawn);
    for (std::size_t i = 0; i < values.size(); ++i) sampled[i].values.push_back(values[i]);
  }
  Span span;
  for (std::size_t i = 0; i < functions.size(); ++i) {
    sampled[i].combination[i] = Remainder{1};
    span.add(std::move(sampled[i]));
  }
  span.reduce(sampled.back());
  if (!is_null(sampled.back())) return {};
  std::map<std::size_t, mpq_class> multipliers;
  for (const auto& [i, value] : sampled.back().combination) {
    const auto number = rational_of((Remainder{} - value).value);
    if (!number) return {};
    if (*number != 0) multipliers[i] = *number;
  }
  return multipliers;
}

}  // namespace

std::optional<std::vector<Expr>> cofactors(Expr c, const std::vector<Expr>& C) {
  std::vector<Expr> all = C;
  all.push_back(c);
  const std::vector<Expr> symbols = generators(all);
  std::vector<std::pair<Expr, std::size_t>> factors;  // μ and j of the products μ Cⱼ
  std::vector<Expr> products;
  Monomials monomials{{Expr(1)}, {0}};
  for (int degree = 0; degree <= highest_degree; ++degree) {
    poll_interrupt();
    if (degree > 0) monomials = next_degree(monomials, symbols);
    if (products.size() + monomials.value.size() * C.size() > most_products) return {};
    for (Expr mu : monomials.value)
      for (std::size_t j = 0; j < C.size(); ++j) {
        factors.push_back({mu, j});
        products.push_back(mu * C[j]);
      }
    const auto multipliers = combination(products, c);
    if (multipliers.empty()) continue;
    std::vector<Expr> a(C.size(), Expr(0));
    for (const auto& [i, number] : multipliers) a[factors[i].second] += Expr(number) * factors[i].first;
    Expr rest = c;
    for (std::size_t j = 0; j < C.size(); ++j) {
      a[j] = simplify(a[j]);
      rest -= a[j] * C[j];
    }
    if (generic::is_zero(rest)) return a;
  }
  return {};
}

std::string combination_text(const std::vector<Expr>& a, const std::vector<std::string>& names) {
  std::string sum;
  for (std::size_t j = 0; j < a.size(); ++j) {
    if (a[j].is_zero()) continue;
    std::string factor = to_text(a[j]);
    const bool is_sum = factor.find(" + ") != factor.npos || factor.find(" - ") != factor.npos;
    const bool negative = !is_sum && factor.rfind("-", 0) == 0;
    if (negative) factor.erase(0, 1);
    if (is_sum) factor = "(" + factor + ")";
    sum += sum.empty() ? (negative ? "-" : "") : (negative ? " - " : " + ");
    sum += (factor == "1" ? "" : factor + " ") + names[j];
  }
  return sum;
}

}  // namespace pendula::dae
