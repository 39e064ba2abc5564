#include "dae/modular.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "base/interrupt.hpp"
#include "expr/solve.hpp"

namespace pendula::dae {
namespace {

__extension__ using Wide = unsigned __int128;

constexpr Residue prime = (Residue{1} << 61) - 1;

Residue reduce(Residue x) {
  x = (x & prime) + (x >> 61);
  return x >= prime ? x - prime : x;
}
Residue plus(Residue a, Residue b) { return reduce(a + b); }
Residue minus(Residue a) { return a ? prime - a : 0; }
Residue times(Residue a, Residue b) {
  const Wide product = static_cast<Wide>(a) * b;
  return reduce(static_cast<Residue>(product & prime) + static_cast<Residue>(product >> 61));
}
Residue power(Residue base, std::uint64_t n) {
  Residue result = 1;
  for (; n; n >>= 1, base = times(base, base))
    if (n & 1) result = times(result, base);
  return result;
}
Residue inverse(Residue a) { return power(a, prime - 2); }  // Fermat

Residue random_value(std::uint64_t seed) {  // splitmix64
  seed += 0x9e3779b97f4a7c15ull;
  seed = (seed ^ (seed >> 30)) * 0xbf58476d1ce4e5b9ull;
  seed = (seed ^ (seed >> 27)) * 0x94d049bb133111ebull;
  return reduce((seed ^ (seed >> 31)) >> 2);
}

Residue from_rational(const mpq_class& q) {
  const mpz_class p(static_cast<unsigned long>(prime));
  mpz_class n, d;
  mpz_mod(n.get_mpz_t(), q.get_num_mpz_t(), p.get_mpz_t());
  mpz_mod(d.get_mpz_t(), q.get_den_mpz_t(), p.get_mpz_t());
  return times(n.get_ui(), inverse(d.get_ui()));
}

/// Thrown at a pole: another random point is tried.
struct Pole {};

/// Arithmetic by operators, for the elimination that all number types share (solve.hpp).
struct Field {
  Residue value;
  friend Field operator-(Field a, Field b) { return {plus(a.value, minus(b.value))}; }
  friend Field operator*(Field a, Field b) { return {times(a.value, b.value)}; }
  friend Field operator/(Field a, Field b) { return {times(a.value, inverse(b.value))}; }
};

std::vector<Field> solved(Expr head, NodeMap<Residue>& known) {
  std::vector<Field> operands;
  for (Expr operand : head.operands()) operands.push_back({known[operand]});
  auto x = eliminate(system_of(head), operands, [](Field f) { return f.value ? 1 : 0; });
  if (x.empty()) throw Pole();
  return x;
}

class Evaluation {
 public:
  explicit Evaluation(int attempt) : seed_(static_cast<std::uint64_t>(attempt + 1) * 0xd1342543de82ef95ull) {}

  Residue value(Expr node, NodeMap<Residue>& known) const {
    if (node.is_constant()) {
      const mpq_class* q = exact_value(node);
      return from_rational(q ? *q : mpq_class(constant_value(node)));  // a double is a rational too
    }
    if (node.is_symbol() || node.op() == Op::call) return random_value(seed_ ^ node.id());
    const auto x = node.operands();
    const Residue a = known[x[0]], b = x.size() > 1 ? known[x[1]] : 0;
    switch (node.op()) {
      case Op::neg:
        return minus(a);
      case Op::add:
        return plus(a, b);
      case Op::sub:
        return plus(a, minus(b));
      case Op::mul:
        return times(a, b);
      case Op::div:
        return times(a, nonzero_inverse(b));
      case Op::pow:
        return to_power(a, b, x[1]);
      case Op::sqrt:
        return root(a);
      case Op::ifelse:
        return b;  // one region: where the conditions hold, and operands of abs and sign are positive
      case Op::abs:
      case Op::min:
      case Op::max:
        return a;
      case Op::sign:
      case Op::lt:
      case Op::le:
      case Op::both:
      case Op::either:
        return 1;
      default:
        return function(node.op(), a, b);
    }
  }

 private:
  static Residue nonzero_inverse(Residue a) {
    if (a == 0) throw Pole();
    return inverse(a);
  }

  Residue hash(Op op, Residue a, Residue b) const {
    return random_value(seed_ ^ (a * 0x9fb21c651e98df25ull) ^ (b << 7) ^
                        (static_cast<std::uint64_t>(op) << 55));
  }

  /// The circle and the hyperbola have rational parametrisations: sin² + cos² = 1 and cosh² - sinh² = 1 hold
  /// exactly.
  Residue function(Op op, Residue a, Residue b) const {
    const bool circle = op == Op::sin || op == Op::cos || op == Op::tan;
    if (!circle && op != Op::sinh && op != Op::cosh && op != Op::tanh) return hash(op, a, b);
    const Residue tau = hash(circle ? Op::sin : Op::sinh, a, 0), square = times(tau, tau);
    const Residue s = plus(tau, tau), c = plus(1, circle ? minus(square) : square),
                  r = plus(1, circle ? square : minus(square));
    if (op == Op::tan || op == Op::tanh) return times(s, nonzero_inverse(c));
    return times(op == Op::sin || op == Op::sinh ? s : c, nonzero_inverse(r));
  }

  /// (p + 1)/4 is an integer because p ≡ 3 mod 4; non-residues get a random value of their own.
  Residue root(Residue a) const {
    const Residue r = power(a, (prime + 1) / 4);
    return times(r, r) == a ? r : hash(Op::sqrt, a, 0);
  }

  Residue to_power(Residue a, Residue b, Expr exponent) const {
    const mpq_class* q = exact_value(exponent);
    if (!q || abs(q->get_num()) > 100000) return hash(Op::pow, a, b);
    const long n = q->get_num().get_si();
    Residue base = a;
    if (q->get_den() == 2)
      base = root(a);
    else if (q->get_den() != 1)
      return hash(Op::pow, a, b);
    return n >= 0 ? power(base, static_cast<std::uint64_t>(n))
                  : nonzero_inverse(power(base, static_cast<std::uint64_t>(-n)));
  }

  std::uint64_t seed_;
};

/// Sparse elimination over the field; rows with fewest entries first.
class Elimination {
 public:
  Elimination(std::span<const Entry> entries, const std::vector<Residue>& values, int rows, int columns)
      : rows_(rows), users_(columns), done_(rows, 0) {
    for (std::size_t k = 0; k < entries.size(); ++k) {
      if (values[k] == 0) continue;
      rows_[entries[k].row][entries[k].column] = values[k];
      users_[entries[k].column].push_back(entries[k].row);
    }
    for (int i = 0; i < rows; ++i) queue_.insert({rows_[i].size(), i});
  }

  ModularRank run(int columns) {
    ModularRank result;
    std::vector<char> pivot_column(columns, 0);
    while (!queue_.empty()) {
      poll_interrupt();
      const int i = queue_.begin()->second;
      queue_.erase(queue_.begin());
      done_[i] = 1;
      if (rows_[i].empty()) {
        result.dependent_rows.push_back(i);
        continue;
      }
      const int j = fewest_users(rows_[i]);
      pivot_column[j] = 1;
      ++result.rank;
      for (int k : std::vector<int>(users_[j]))
        if (!done_[k] && rows_[k].count(j)) eliminate(k, i, j);
      rows_[i].clear();
    }
    for (int j = 0; j < columns; ++j)
      if (!pivot_column[j]) result.dependent_columns.push_back(j);
    std::sort(result.dependent_rows.begin(), result.dependent_rows.end());
    return result;
  }

 private:
  using Row = std::map<int, Residue>;

  int fewest_users(const Row& row) const {
    return std::min_element(
               row.begin(), row.end(),
               [&](const auto& a, const auto& b) { return users_[a.first].size() < users_[b.first].size(); })
        ->first;
  }

  void eliminate(int k, int i, int j) {
    queue_.erase({rows_[k].size(), k});
    const Residue factor = minus(times(rows_[k].at(j), inverse(rows_[i].at(j))));
    for (const auto& [column, value] : rows_[i]) {
      const auto [entry, made] = rows_[k].try_emplace(column, 0);
      entry->second = plus(entry->second, times(factor, value));
      if (entry->second == 0)
        rows_[k].erase(entry);
      else if (made)
        users_[column].push_back(k);
    }
    queue_.insert({rows_[k].size(), k});
  }

  std::vector<Row> rows_;
  std::vector<std::vector<int>> users_;
  std::vector<char> done_;
  std::set<std::pair<std::size_t, int>> queue_;
};

}  // namespace

std::vector<Residue> evaluate_modular(std::span<const Expr> outputs, int attempt) {
  static NodeMap<Residue> known;
  known.clear();
  const Evaluation evaluation(attempt);
  std::unordered_map<Expr, std::vector<Field>> solutions;  // of linear systems, by their heads
  try {
    for (Expr node : topological(outputs)) {
      if (node.op() == Op::solve) {
        if (component_of(node) == 0) solutions[node] = solved(node, known);
        known[node] = solutions[head_of(node)][static_cast<std::size_t>(component_of(node))].value;
        continue;
      }
      const Residue v = evaluation.value(node, known);
      known[node] = v;
    }
  } catch (const Pole&) {
    return {};
  }
  std::vector<Residue> values;
  for (Expr output : outputs) values.push_back(known[output]);
  return values;
}

ModularRank modular_rank(std::span<const Entry> entries, int rows, int columns) {
  std::vector<Expr> outputs;
  for (const Entry& e : entries) outputs.push_back(e.value);
  std::optional<ModularRank> best;
  for (int attempt = 0, tried = 0; attempt < 20 && tried < 3; ++attempt) {
    const auto values = evaluate_modular(outputs, attempt);
    if (values.size() != outputs.size()) continue;
    ++tried;
    ModularRank next = Elimination(entries, values, rows, columns).run(columns);
    if (!best || next.rank > best->rank) best = std::move(next);
    if (best->rank == std::min(rows, columns)) break;
  }
  return best.value_or(ModularRank{});
}

}  // namespace pendula::dae
