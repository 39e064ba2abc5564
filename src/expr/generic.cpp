#include "expr/generic.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pendula::generic {
namespace {

constexpr std::uint64_t prime = (std::uint64_t{1} << 61) - 1;
constexpr int attempts = 8;  // points tried until one lies in the domain

__extension__ using wide = unsigned __int128;

/// splitmix64 of a seed and a node: the same symbol has the same value in every call with the same seed.
std::uint64_t random_bits(std::uint64_t seed, Expr e) {
  std::uint64_t h = seed * 0x9e3779b97f4a7c15ull + e.id() + 0x632be59bd9b4e019ull;
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9ull;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebull;
  return h ^ (h >> 31);
}

Residue power(Residue base, std::uint64_t n) {
  Residue result{1};
  for (; n > 0; n /= 2, base = base * base)
    if (n % 2 == 1) result = result * base;
  return result;
}

Residue residue_of(const mpz_class& n) {
  mpz_class r = n % mpz_class(prime);
  if (r < 0) r += mpz_class(prime);
  return {mpz_get_ui(r.get_mpz_t())};
}

struct Undefined {};  // a division by zero at this point: draw another
struct NotRational {};

Residue constant_residue(Expr e) {
  const mpq_class* exact = exact_value(e);
  const mpq_class q = exact ? *exact : mpq_class(constant_value(e));
  const Residue low = residue_of(q.get_den());
  if (low.is_zero()) throw NotRational{};
  return residue_of(q.get_num()) / low;
}

Residue operation_residue(Expr node, const std::vector<Residue>& x) {
  switch (node.op()) {
    case Op::neg:
      return Residue{} - x[0];
    case Op::add:
      return x[0] + x[1];
    case Op::sub:
      return x[0] - x[1];
    case Op::mul:
      return x[0] * x[1];
    case Op::div:
      if (x[1].is_zero()) throw Undefined{};
      return x[0] / x[1];
    case Op::pow: {
      const mpq_class* n = exact_value(node.operand(1));
      if (!n || n->get_den() != 1 || abs(*n) > 1'000'000) throw NotRational{};
      const Residue whole = power(x[0], mpz_class(abs(n->get_num())).get_ui());
      if (*n >= 0) return whole;
      if (whole.is_zero()) throw Undefined{};
      return Residue{1} / whole;
    }
    default:
      throw NotRational{};
  }
}

std::vector<Residue> residues_at(std::span<const Expr> outputs, std::span<const Expr> order,
                                 std::uint64_t seed) {
  static NodeMap<Residue> values;
  values.clear();
  std::vector<Residue> x;
  for (Expr node : order) {
    if (node.is_constant()) {
      values[node] = constant_residue(node);
    } else if (node.is_symbol() || node.op() == Op::call) {  // π too: it is transcendental
      values[node] = Residue{random_bits(seed, node) % prime};
    } else {
      x.clear();
      for (Expr operand : node.operands()) x.push_back(values[operand]);
      values[node] = operation_residue(node, x);
    }
  }
  std::vector<Residue> result;
  for (Expr output : outputs) result.push_back(values[output]);
  return result;
}

Real operation_real(Expr node, const std::vector<Real>& x) {
  switch (node.op()) {
    case Op::neg:
      return {-x[0].value, x[0].scale};
    case Op::add:
      return x[0] + x[1];
    case Op::sub:
      return x[0] - x[1];
    case Op::mul:
      return x[0] * x[1];
    case Op::div:
      return x[0] / x[1];
    default:
      break;
  }
  std::array<double, 3> v{};
  double scale = 1;
  for (std::size_t i = 0; i < x.size(); ++i)
    v[i] = x[i].is_zero() ? 0 : x[i].value, scale = std::max(scale, x[i].scale);
  const double value = apply(node.op(), v[0], v[1], v[2]);
  return {value, std::max(std::fabs(value), scale * 1e-3)};
}

std::vector<Real> reals_at(std::span<const Expr> outputs, std::span<const Expr> order, std::uint64_t seed) {
  static NodeMap<Real> values;
  values.clear();
  std::vector<Real> x;
  for (Expr node : order) {
    double leaf = 0;
    if (node.is_constant()) {
      leaf = constant_value(node);
    } else if (node.is_symbol() && symbol_of(node).kind == Kind::constant) {
      leaf = constant_value(*symbol_of(node).value);
    } else if (node.is_symbol() || node.op() == Op::call) {
      // Around 1 at first, where roots and logarithms are defined; later points lie in (-1, 1) too.
      const double u = static_cast<double>(random_bits(seed, node) >> 11) * 0x1p-53;
      leaf = seed % 2 == 0 ? 0.5 + u : 2 * u - 1;
    } else {
      x.clear();
      for (Expr operand : node.operands()) x.push_back(values[operand]);
      values[node] = operation_real(node, x);
      continue;
    }
    values[node] = {leaf, std::fabs(leaf)};
  }
  std::vector<Real> result;
  for (Expr output : outputs) result.push_back(values[output]);
  return result;
}

}  // namespace

Residue operator+(Residue a, Residue b) { return {(a.value + b.value) % prime}; }
Residue operator-(Residue a, Residue b) { return {(a.value + prime - b.value) % prime}; }
Residue operator*(Residue a, Residue b) {
  return {static_cast<std::uint64_t>(wide{a.value} * b.value % prime)};
}
Residue operator/(Residue a, Residue b) { return a * power(b, prime - 2); }  // Fermat

Real operator+(Real a, Real b) { return {a.value + b.value, a.scale + b.scale}; }
Real operator-(Real a, Real b) { return {a.value - b.value, a.scale + b.scale}; }
Real operator*(Real a, Real b) { return {a.value * b.value, a.scale * b.scale}; }
Real operator/(Real a, Real b) {
  const double low = std::fabs(b.value);
  return {a.value / b.value, a.scale / low * std::max(1.0, b.scale / low)};
}
// 10⁵ roundings at the size of the terms: far above what is met, far below what a true value leaves.
bool Real::is_zero() const { return std::fabs(value) <= 2e-11 * scale; }

std::optional<std::vector<Residue>> residues(std::span<const Expr> outputs) {
  const std::vector<Expr> order = topological(outputs);
  for (std::uint64_t seed = 1; seed <= attempts; ++seed) {
    try {
      return residues_at(outputs, order, seed);
    } catch (Undefined) {
    } catch (NotRational) {
      return {};
    }
  }
  return {};
}

std::vector<Real> reals(std::span<const Expr> outputs) {
  const std::vector<Expr> order = topological(outputs);
  std::vector<Real> values;
  for (std::uint64_t seed = 2; seed < 2 + attempts; ++seed) {
    values = reals_at(outputs, order, seed);
    if (std::all_of(values.begin(), values.end(), [](Real r) { return std::isfinite(r.value); })) break;
  }
  return values;
}

bool is_zero(Expr e) {
  if (e.is_constant()) return constant_value(e) == 0;
  if (const auto value = residues({&e, 1})) return value->front().is_zero();
  return reals({&e, 1})[0].is_zero();
}

}  // namespace pendula::generic
