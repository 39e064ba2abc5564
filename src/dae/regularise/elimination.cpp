#include "dae/regularise/elimination.hpp"

#include <algorithm>
#include <numeric>
#include <optional>
#include <unordered_set>
#include <utility>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/points/consistent_point_rank.hpp"
#include "dae/rank/rank.hpp"
#include "dae/rank/tracked_elimination.hpp"
#include "dae/structure/signature.hpp"
#include "expr/generic/generic.hpp"
#include "expr/print/primes.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {
namespace {

/// Entries that vanish at two points modulo a prime; a cheap test, to be confirmed by the caller.
std::vector<std::size_t> suspected_zeros(const std::vector<Entry>& entries) {
  std::vector<Expr> values;
  for (const Entry& e : entries) values.push_back(e.value);
  std::vector<char> nonzero(entries.size(), 0);
  for (int attempt = 0; attempt < 2; ++attempt) {
    const auto residues = evaluate_modular(values, attempt);
    for (std::size_t k = 0; k < residues.size(); ++k) nonzero[k] |= residues[k] != 0;
  }
  std::vector<std::size_t> zeros;
  for (std::size_t k = 0; k < entries.size(); ++k)
    if (!nonzero[k]) zeros.push_back(k);
  return zeros;
}

bool has_unknown(Expr e, const std::vector<Expr>& variables) {
  const std::unordered_set<Expr> bases(variables.begin(), variables.end());
  for (Expr leaf : leaves({&e, 1}))
    if (bases.count(symbol_of(leaf).base)) return true;
  return false;
}

/// e, which does not depend on the leaf, without it: at the first value for which e is defined, 0 or near 0.
Expr without_leaf(Expr e, Expr leaf) {
  for (const Expr value : {Expr(0), Expr(1), Expr(0x1p-20), Expr(0x1p-60)}) try {
      return substitute(e, {{leaf, value}});
    } catch (const Error&) {  // a quotient undefined at 0, or an exponential that overflows at 1
    }
  return substitute(e, {{leaf, Expr(0x1p-300)}});
}

}  // namespace

Equations equations_of(const Model& m) {
  Equations e;
  e.residuals = m.residuals;
  for (const Variable& v : m.variables) e.variables.push_back(v.leaf);
  for (std::size_t i = 0; i < m.residuals.size(); ++i) e.labels.push_back(m.label(i));
  e.notes.resize(m.residuals.size());
  e.differentiated.assign(m.residuals.size(), 0);
  return e;
}

Structure structure_of(const Equations& e) {
  PENDULA_ASSERT(e.residuals.size() == e.variables.size(), "the equations to be regularised are square");
  Structure s;
  const auto n = static_cast<int>(e.variables.size());
  s.sigma = signature(e.residuals, e.variables);
  s.offsets = offsets(s.sigma, n);
  s.matched = s.offsets.unmatched.empty();
  if (!s.matched) return s;
  s.jacobian = system_jacobian(e.residuals, e.variables, s.offsets, s.sigma);
  s.rank = generic_rank(s.jacobian, n, n, e.residuals);
  s.regular = s.rank.rank == n;
  if (!s.regular) return s;
  if (const ConsistentPointRank there(e.residuals, e.variables, s.offsets, s.jacobian, e.nonzero);
      there.applies() && there.ranks().always_below(n)) {
    s.regular = false;
    s.singular_on_solutions = true;
  }
  return s;
}

Expr without_cancelled(Expr e, const std::vector<Expr>& variables) {
  const std::unordered_set<Expr> bases(variables.begin(), variables.end());
  std::vector<Expr> unknowns;
  for (Expr leaf : leaves({&e, 1}))
    if (bases.count(symbol_of(leaf).base)) unknowns.push_back(leaf);
  const auto slopes = gradient(e, unknowns);
  for (std::size_t k = 0; k < unknowns.size(); ++k)
    if (slopes[k].is_zero() || generic::is_zero(slopes[k])) e = without_leaf(e, unknowns[k]);
  return tidied(e);
}

Step replace_equation(Equations& e, std::size_t i, Expr residual, const std::string& how,
                      std::vector<std::string>& log) {
  if (!has_unknown(residual, e.variables)) {
    const bool zero = residual.is_zero() || generic::is_zero(residual);
    const bool never = !zero && residual.is_constant();
    log.push_back(text(how, ":  0 = ", zero ? "0" : to_text(residual),
                       zero ? "   the equations depend on each other: one more is needed"
                       : never
                           ? "   the equations contradict each other"
                           : "   contains no unknown: the equations contradict each other unless it holds"));
    return Step::dependent;
  }
  log.push_back(text(how, ":  0 = ", to_text(residual), "   replaces ", e.labels[i]));
  if (std::string& label = e.labels[i]; !label.ends_with("*)")) {  // the new equation needs a name of its own
    label.insert(label.size() - 1, "*");
    log.back() += " as " + label;
  }
  e.residuals[i] = residual;
  e.notes[i] = how;
  return Step::changed;
}

Step drop_cancelled(Equations& e, const Structure& s, std::vector<std::string>& log) {
  Step step = Step::nothing;
  for (std::size_t k : suspected_zeros(s.jacobian)) {
    const auto& [i, j, value] = s.jacobian[k];
    if (!generic::is_zero(value)) continue;
    const Expr leaf = derivative_leaf(e.variables[j], s.offsets.d[j] - s.offsets.c[i]);
    const Step done =
        replace_equation(e, static_cast<std::size_t>(i), tidied(without_leaf(e.residuals[i], leaf)),
                         text(e.labels[i], " without ", to_text(leaf), ", which cancels"), log);
    if (done == Step::dependent) return done;
    step = Step::changed;
  }
  return step;
}

/// Replaces equation i, the last of the combination, by Σ u_r F_r^(c_r - c_i).
static Step replace_by_combination(Equations& e, const Equations& before, std::size_t i,
                                   std::map<int, mpq_class> combination, const std::vector<int>& c,
                                   std::vector<std::string>& log) {
  make_coprime(combination);
  if (combination.at(static_cast<int>(i)) < 0)
    for (auto& [r, value] : combination) value = -value;
  Expr sum = 0;
  int times = 0;
  for (const auto& [r, value] : combination) {
    sum += Expr(value) * total_derivative(before.residuals[r], c[r] - c[i]);
    times = std::max(times, before.differentiated[r] + c[r] - c[i]);
  }
  const std::string how =
      combination_text(combination, [&](int r) { return e.labels[r] + primes(std::max(c[r] - c[i], 0)); });
  const Step step = replace_equation(e, i, without_cancelled(sum, e.variables), how, log);
  if (step == Step::changed) e.differentiated[i] = times;
  return step;
}

Step eliminate_constant_rows(Equations& e, const Structure& s, std::vector<std::string>& log) {
  std::vector<TrackedRow> rows(e.residuals.size());
  std::vector<char> constant(e.residuals.size(), 1);
  for (const auto& [i, j, value] : s.jacobian) {
    const mpq_class* q = exact_value(value);
    if (q)
      rows[i].entries[j] = *q;
    else
      constant[i] = 0;
  }
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (constant[i]) {
      rows[i].combination[i] = 1;
      order.push_back(i);
    }
  // the last row of a combination has the least offset and may therefore be replaced
  const auto& c = s.offsets.c;
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return c[a] > c[b]; });
  TrackedElimination elimination;
  const Equations before = e;
  Step step = Step::nothing;
  for (std::size_t i : order) {
    poll_interrupt();
    TrackedRow left = elimination.add(std::move(rows[i]));
    if (!left.entries.empty()) continue;
    if (replace_by_combination(e, before, i, std::move(left.combination), c, log) == Step::dependent)
      return Step::dependent;
    step = Step::changed;
  }
  return step;
}

namespace {

constexpr std::int64_t prime = (std::int64_t{1} << 61) - 1;  // a Mersenne prime

std::int64_t product(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<unsigned __int128>(a) * static_cast<unsigned __int128>(b) %
                                   prime);
}

std::int64_t power(std::int64_t base, std::int64_t exponent) {
  std::int64_t result = 1;
  for (; exponent > 0; exponent /= 2) {
    if (exponent % 2 == 1) result = product(result, base);
    base = product(base, base);
  }
  return result;
}

/// Reconstructs a fraction with numbers up to a million from a residue, by Euclid's algorithm.
std::optional<mpq_class> fraction_of(std::int64_t residue) {
  constexpr std::int64_t bound = 1'000'000;  // 2 · bound² < prime: the fraction is the only one
  std::int64_t r0 = prime, r1 = residue, t0 = 0, t1 = 1;
  while (r1 > bound) {
    const std::int64_t q = r0 / r1;
    r0 = std::exchange(r1, r0 - q * r1);
    t0 = std::exchange(t1, t0 - q * t1);
  }
  if (std::abs(t1) > bound || t1 == 0) return {};
  mpq_class value(static_cast<long>(r1), static_cast<long>(std::abs(t1)));
  value.canonicalize();
  return t1 < 0 ? mpq_class(-value) : value;
}

}  // namespace

std::optional<mpq_class> rational_of(Residue residue) {
  constexpr int thousands = 8;  // 1/L² in nanometres is 10¹⁸
  const std::int64_t thousand = 1000, thousandth = power(thousand, prime - 2);
  const auto number = static_cast<std::int64_t>(residue);
  for (int k = 0; k <= thousands; ++k) {
    mpz_class unit;
    mpz_ui_pow_ui(unit.get_mpz_t(), thousand, k);
    if (const auto large = fraction_of(product(number, power(thousandth, k))))
      return mpq_class(*large * unit);
    if (const auto small = fraction_of(product(number, power(thousand, k)))) return mpq_class(*small / unit);
  }
  return {};
}

namespace {

/// A constant left null vector of J: eliminates the rows at several points simultaneously, recording the
/// combinations, until a row vanishes.
std::optional<std::map<int, mpq_class>> constant_null_vector(const Structure& s,
                                                             const std::vector<int>& order) {
  constexpr int points = 3;  // an accident has probability (degree) 2⁻⁶¹ at each
  std::vector<Expr> values;
  for (const Entry& e : s.jacobian) values.push_back(e.value);
  std::vector<std::map<int, Residue>> rows(order.size());
  std::vector<std::size_t> position(s.sigma.size());
  for (std::size_t k = 0; k < order.size(); ++k) position[order[k]] = k;
  const auto n = static_cast<int>(s.sigma.size());
  for (int point = 0, attempt = 0; point < points && attempt < 20; ++attempt) {
    const auto at = evaluate_modular(values, attempt);
    if (at.empty()) continue;
    for (std::size_t k = 0; k < at.size(); ++k)
      if (at[k]) rows[position[s.jacobian[k].row]][point * n + s.jacobian[k].column] = at[k];
    ++point;
  }
  const auto u = first_dependency(std::move(rows));
  if (u.empty()) return {};
  std::map<int, mpq_class> combination;
  for (const auto& [k, residue] : u) {
    const auto q = rational_of(residue);
    if (!q) return {};
    combination[order[k]] = *q;
  }
  return combination;
}

bool cancels(const Structure& s, const std::map<int, mpq_class>& combination) {
  std::map<int, Expr> sum;
  for (const Entry& e : s.jacobian)
    if (const auto it = combination.find(e.row); it != combination.end())
      sum[e.column] += Expr(it->second) * e.value;
  return std::all_of(sum.begin(), sum.end(), [](const auto& c) { return generic::is_zero(c.second); });
}

}  // namespace

Step eliminate_by_constants(Equations& e, const Structure& s, std::vector<std::string>& log) {
  constexpr std::size_t affordable = 200;
  if (e.residuals.size() > affordable) return Step::nothing;
  const auto& c = s.offsets.c;
  std::vector<int> order(e.residuals.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return c[a] > c[b]; });
  const auto combination = constant_null_vector(s, order);
  if (!combination || !cancels(s, *combination)) return Step::nothing;
  int last = -1;  // the last in this order has the least offset and may therefore be replaced
  for (int i : order)
    if (combination->count(i)) last = i;
  const Equations before = e;
  return replace_by_combination(e, before, static_cast<std::size_t>(last), *combination, c, log);
}

}  // namespace pendula::dae
