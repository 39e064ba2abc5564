#include "dae/regularise/null_vectors.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_set>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/rank/rank.hpp"
#include "expr/generic/generic.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

constexpr double ratio_denominators = 5040;  // constant ratios p/q are recognised if q divides 7!
// operations of an entry of J up to which null vectors are formed from it
constexpr double longest_entry = 60;

/// The rows of a set, with new numbers.
std::vector<Entry> rows_of(const std::vector<Entry>& entries, const std::vector<int>& rows) {
  std::vector<Entry> part;
  for (const Entry& e : entries)
    if (const auto it = std::find(rows.begin(), rows.end(), e.row); it != rows.end())
      part.push_back({static_cast<int>(it - rows.begin()), e.column, e.value});
  return part;
}

bool dependent(const std::vector<Entry>& entries, const std::vector<int>& rows, int columns) {
  const auto n = static_cast<int>(rows.size());
  return generic_rank(rows_of(entries, rows), n, columns).rank < n;
}

/// Every non-constant denominator in e.
std::vector<Expr> denominators(Expr e) {
  std::vector<Expr> found;
  for (Expr node : topological({&e, 1})) {
    if (node.op() == Op::div && !node.operand(1).is_constant()) found.push_back(node.operand(1));
    if (node.op() == Op::pow)
      if (const mpq_class* q = exact_value(node.operand(1)); q && *q < 0) found.push_back(node.operand(0));
  }
  return found;
}

}  // namespace

std::vector<Entry> transposed(std::vector<Entry> entries) {
  for (Entry& e : entries) std::swap(e.row, e.column);
  return entries;
}

std::vector<int> circuit(const std::vector<Entry>& entries, int n) {
  std::vector<int> set(n);
  std::iota(set.begin(), set.end(), 0);
  const auto all = modular_rank(entries, n, n);
  if (!all.dependent_rows.empty()) {  // keeps the pivots and one dependent row
    std::unordered_set<int> rest(all.dependent_rows.begin() + 1, all.dependent_rows.end());
    std::erase_if(set, [&](int i) { return rest.count(i) > 0; });
  }
  for (std::size_t part = set.size() / 2; part >= 1; part /= 2)  // tries to remove large pieces first
    for (std::size_t at = 0; at < set.size();) {
      poll_interrupt();
      std::vector<int> less(set.begin(), set.begin() + static_cast<std::ptrdiff_t>(at));
      less.insert(less.end(), set.begin() + static_cast<std::ptrdiff_t>(std::min(at + part, set.size())),
                  set.end());
      if (!less.empty() && dependent(entries, less, n))
        set = std::move(less);
      else
        at += part;
    }
  return set;
}

std::optional<VecX> null_vector_of(const std::vector<Entry>& J, const std::vector<int>& rows, int n) {
  const auto part = rows_of(J, rows);
  const auto size = static_cast<int>(rows.size());
  const auto rank = modular_rank(part, size, n);
  const std::unordered_set<int> skipped(rank.dependent_columns.begin(), rank.dependent_columns.end());
  std::vector<int> position(n, -1);
  int columns = 0;
  for (int j = 0; j < n; ++j)
    if (!skipped.count(j)) position[j] = columns++;
  MatX m = MatX::Zero(columns, size);
  for (const Entry& e : part)
    if (position[e.column] >= 0) m(position[e.column], e.row) = e.value;
  for (Expr e : entries(m))
    if (!is_short(e, longest_entry)) return {};
  auto u = linalg::null_vector(m);
  if (!u || std::any_of(u->begin(), u->end(), [](Expr x) { return !is_short(x); })) return {};
  for (Expr& e : *u) {
    e = tidied(e);
    if (e.is_zero() || generic::is_zero(e)) return {};
  }
  return u;
}

int Scaled::complexity() const {
  int unknowns = 0;
  for (Expr e : nonzero)
    for (Expr leaf : leaves({&e, 1})) unknowns += symbol_of(leaf).kind == Kind::variable ? 10 : 1;
  return unknowns;
}

std::optional<Expr> constant_ratio(Expr a, Expr b) {
  const std::vector<Expr> both{a, b};
  const auto at = pendula::evaluate(both, random_point(both, 0));
  const double near = std::round(at[0] / at[1] * ratio_denominators) / ratio_denominators;
  constexpr double largest = 1e6;  // larger ratios are not tried; a smaller one is proved below
  if (!(std::fabs(near) < largest)) return {};
  const Expr ratio(near);
  return generic::is_zero(a - ratio * b) ? std::optional(ratio) : std::nullopt;
}

Scaled scaled(const VecX& u, std::size_t l) {
  Scaled s;
  const Expr pivot = u[l];
  for (Expr e : u) s.u.push_back(constant_ratio(e, pivot).value_or(tidied(e / pivot)));
  for (Expr e : s.u)
    for (Expr d : denominators(e))
      if (std::find(s.nonzero.begin(), s.nonzero.end(), d) == s.nonzero.end()) s.nonzero.push_back(d);
  if (s.nonzero.size() == 1) {  // multiplies by the denominator if that removes all fractions
    Scaled whole = s;
    for (Expr& e : whole.u) e = tidied(e * s.nonzero[0]);
    if (std::all_of(whole.u.begin(), whole.u.end(), [](Expr e) { return denominators(e).empty(); }))
      return whole;
  }
  return s;
}

std::vector<int> orders_in(const std::vector<Expr>& vector, const std::vector<Expr>& variables) {
  std::vector<int> order(variables.size(), -1);
  for (Expr leaf : leaves(vector)) {
    const Symbol& s = symbol_of(leaf);
    const auto it = std::find(variables.begin(), variables.end(), s.base);
    if (it != variables.end()) {
      int& here = order[it - variables.begin()];
      here = std::max(here, s.order);
    }
  }
  return order;
}

std::string validity_text(const std::vector<Expr>& nonzero) {
  std::vector<std::string> parts;
  for (Expr e : nonzero) parts.push_back(to_text(e) + " ≠ 0");
  return nonzero.empty() ? "valid everywhere" : "valid where " + join(parts, ", ");
}

void add_new(std::vector<Expr>& list, const std::vector<Expr>& more) {
  for (Expr e : more)
    if (std::find(list.begin(), list.end(), e) == list.end()) list.push_back(e);
}

}  // namespace pendula::dae
