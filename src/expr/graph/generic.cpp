#include "expr/graph/generic.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "base/error.hpp"
#include "expr/graph/angle.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/node_map.hpp"
#include "expr/graph/solve.hpp"

namespace pendula::generic {
namespace {

constexpr std::uint64_t prime = (std::uint64_t{1} << 61) - 1;
constexpr double solve_error = 1e-12;  // relative; small systems at points where they are not singular
constexpr int attempts = 16;           // points tried until one lies in the domain

__extension__ using wide = unsigned __int128;

/// splitmix64 of a seed and a name: the same symbol has the same value in every call with the same seed, and
/// in every session. Applications of one function to different arguments are told apart by their ids.
std::uint64_t random_bits(std::uint64_t seed, Expr e) {
  const std::uint64_t who = e.is_symbol() ? name_hash(e) : e.id();
  std::uint64_t h = seed * 0x9e3779b97f4a7c15ull + who + 0x632be59bd9b4e019ull;
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9ull;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebull;
  return h ^ (h >> 31);
}

Residue power(Residue base, std::uint64_t n) {
  Residue result{1};
  for (; n > 0; n /= 2) {
    if (n % 2 == 1) result = result * base;
    base = base * base;
  }
  return result;
}

Residue residue_of(const mpz_class& n) {
  mpz_class r = n % mpz_class(prime);
  if (r < 0) r += mpz_class(prime);
  return {mpz_get_ui(r.get_mpz_t())};
}

struct Undefined {};  // a division by zero at this point: draw another

Residue quotient(Residue a, Residue b) {
  if (b.is_zero()) throw Undefined{};
  return a / b;
}

Residue constant_residue(Expr e) {
  const mpq_class* exact = exact_value(e);
  const mpq_class q = exact ? *exact : mpq_class(constant_value(e));
  return quotient(residue_of(q.get_num()), residue_of(q.get_den()));
}

/// A point of the unit circle: what stands for an angle.
struct Rotation {
  Residue cosine, sine;
};

Rotation turn(Rotation a, Rotation b) {
  return {a.cosine * b.cosine - a.sine * b.sine, a.sine * b.cosine + a.cosine * b.sine};
}
Rotation power(Rotation one, std::uint64_t n) {
  Rotation result{Residue{1}, Residue{0}};
  while (n > 0) {
    if (n % 2 == 1) result = turn(result, one);
    one = turn(one, one);
    n /= 2;
  }
  return result;
}
Rotation back(Rotation a) { return {a.cosine, Residue{} - a.sine}; }

/// One random point and the values of all nodes there.
class Point {
 public:
  Point(std::uint64_t seed, Pieces pieces, NodeMap<Residue>& values)
      : seed_(seed), pieces_(pieces), values_(values) {}

  Residue value(Expr node) {
    if (node.is_constant()) return constant_residue(node);
    if (node.is_symbol() || node.op() == Op::call) return drawn(node);  // π too: it is transcendental
    const auto x = [&](int i) { return values_[node.operand(i)]; };
    switch (node.op()) {
      case Op::neg:
        return Residue{} - x(0);
      case Op::add:
        return x(0) + x(1);
      case Op::sub:
        return x(0) - x(1);
      case Op::mul:
        return x(0) * x(1);
      case Op::div:
        return quotient(x(0), x(1));
      case Op::pow:
        return power_value(node);
      case Op::sqrt:
        return root(x(0), node);
      case Op::solve:
        return solved(node);
      case Op::sin:
        return angle(node.operand(0), 0).sine;
      case Op::cos:
        return angle(node.operand(0), 0).cosine;
      case Op::tan:
        return quotient(angle(node.operand(0), 0).sine, angle(node.operand(0), 0).cosine);
      case Op::exp:
        return exponential(node.operand(0), 0);
      case Op::sinh:
        return hyperbolic(node.operand(0), true);
      case Op::cosh:
        return hyperbolic(node.operand(0), false);
      case Op::tanh:
        return quotient(hyperbolic(node.operand(0), true), hyperbolic(node.operand(0), false));
      default:
        return pieces_ == Pieces::drawn ? hashed(node) : piece(node);
    }
  }

 private:
  static constexpr int deepest = 200;  // of a sum inside a sine; below that the sum is drawn as one angle

  Residue drawn(Expr node) const { return {random_bits(seed_, node) % prime}; }
  /// exp(x) and the tangent of x/2: numbers of their own, since x - exp(x) is not 0.
  static constexpr std::uint64_t of_exponential = 0xd1342543de82ef95ull, of_angle = 0xaf251af3b0f025b5ull;
  Residue drawn(Expr node, std::uint64_t function) const {
    return {random_bits(seed_ ^ function, node) % prime};
  }

  /// A function without identities: the same value for the same values of its arguments.
  Residue hashed(Expr node) const {
    std::uint64_t h = seed_ * 0x9e3779b97f4a7c15ull + static_cast<std::uint64_t>(node.op());
    for (Expr operand : node.operands()) {
      h = (h ^ values_[operand].value) * 0xbf58476d1ce4e5b9ull;
      h ^= h >> 29;
    }
    h *= 0x94d049bb133111ebull;
    return {(h ^ (h >> 31)) % prime};
  }

  /// In the first region conditions hold and what abs and sign are of is positive.
  Residue piece(Expr node) const {
    const bool first = pieces_ == Pieces::first;
    switch (node.op()) {
      case Op::ifelse:
        return values_[node.operand(first ? 1 : 2)];
      case Op::abs:
        return first ? values_[node.operand(0)] : Residue{} - values_[node.operand(0)];
      case Op::sign:
        return first ? Residue{1} : Residue{} - Residue{1};
      case Op::min:
      case Op::max:
        return values_[node.operand((node.op() == Op::min) == first ? 0 : 1)];
      default:
        return hashed(node);
    }
  }

  /// A component of a linear system; the head solves it for all of them.
  Residue solved(Expr node) {
    std::vector<Residue>& x = solutions_[head_of(node)];
    if (component_of(node) == 0) {
      std::vector<Residue> operands;
      for (Expr operand : node.operands()) operands.push_back(values_[operand]);
      x = eliminate(system_of(node), operands, [](Residue r) { return r.is_zero() ? 0 : 1; });
      if (x.empty()) throw Undefined{};
    }
    return x[component_of(node)];
  }

  Residue root(Residue square, Expr node) const {
    const Residue r = power(square, (prime + 1) / 4);  // the prime is 3 modulo 4
    return (r * r - square).is_zero() ? r : hashed(node);
  }

  Residue power_value(Expr node) {
    const mpq_class* n = exact_value(node.operand(1));
    if (!n || n->get_den() > 2 || abs(n->get_num()) > 1'000'000) return hashed(node);
    const Residue base = values_[node.operand(0)];
    const Residue whole =
        power(n->get_den() == 1 ? base : root(base, node.operand(0)), mpz_class(abs(n->get_num())).get_ui());
    return *n >= 0 ? whole : quotient(Residue{1}, whole);
  }

  /// A small integer factor of a product, and the rest; 0 if there is none.
  static std::pair<long, Expr> multiple(Expr e) {
    if (e.op() == Op::mul)
      for (int i : {0, 1})
        if (const mpq_class* q = exact_value(e.operand(i)); q && q->get_den() == 1 && abs(*q) <= 1000)
          return {q->get_num().get_si(), e.operand(1 - i)};
    return {0, e};
  }

  /// Numbers with small denominators are multiples of one number, so that e² is the square of e.
  static constexpr long common_denominator = 2520;
  static std::optional<long> multiple_of_unit(Expr e) {
    const mpq_class* q = exact_value(e);
    if (!q || common_denominator % q->get_den() != 0 || abs(*q) > 1000) return {};
    return mpz_class(q->get_num() * (common_denominator / q->get_den())).get_si();
  }

  /// A multiple of π/4 as a rotation; the square root of 2 is one modulo the prime.
  static std::optional<Rotation> eighths_of_turn(Expr e) {
    const auto q = half_turns(e);
    if (!q || (4 % q->get_den()) != 0) return {};
    const Residue half = power(Residue{2}, (prime + 1) / 4) / Residue{2};  // √2/2
    return power(Rotation{half, half},
                 mpz_fdiv_ui(mpz_class(q->get_num() * (4 / q->get_den())).get_mpz_t(), 8));
  }

  Rotation angle(Expr e, int depth) {
    if (e.is_zero()) return {Residue{1}, Residue{0}};
    if (const auto known = eighths_of_turn(e)) return *known;
    if (const auto n = multiple_of_unit(e)) {
      const Rotation one = power(angle_of(Expr(1)), static_cast<std::uint64_t>(std::labs(*n)));
      return *n > 0 ? one : back(one);
    }
    if (depth < deepest) {
      if (e.op() == Op::neg) return back(angle(e.operand(0), depth + 1));
      if (e.op() == Op::add) return turn(angle(e.operand(0), depth + 1), angle(e.operand(1), depth + 1));
      if (e.op() == Op::sub)
        return turn(angle(e.operand(0), depth + 1), back(angle(e.operand(1), depth + 1)));
      if (const auto [n, rest] = multiple(e); n != 0) {
        Rotation total{Residue{1}, Residue{0}};
        const Rotation one = n > 0 ? angle(rest, depth + 1) : back(angle(rest, depth + 1));
        for (long k = 0; k < std::labs(n); ++k) total = turn(total, one);
        return total;
      }
    }
    return angle_of(e);
  }

  Rotation angle_of(Expr e) {
    const Residue h = drawn(e, of_angle), square = h * h,
                  low = Residue{1} + square;  // the tangent of half the angle
    return {quotient(Residue{1} - square, low), quotient(h + h, low)};
  }

  Residue exponential(Expr e, int depth) {
    if (e.is_zero()) return Residue{1};
    if (const auto n = multiple_of_unit(e)) {
      const Residue whole = power(drawn(Expr(1), of_exponential), static_cast<std::uint64_t>(std::labs(*n)));
      return *n > 0 ? whole : quotient(Residue{1}, whole);
    }
    if (depth < deepest) {
      if (e.op() == Op::neg) return quotient(Residue{1}, exponential(e.operand(0), depth + 1));
      if (e.op() == Op::add)
        return exponential(e.operand(0), depth + 1) * exponential(e.operand(1), depth + 1);
      if (e.op() == Op::sub)
        return quotient(exponential(e.operand(0), depth + 1), exponential(e.operand(1), depth + 1));
      if (const auto [n, rest] = multiple(e); n != 0) {
        const Residue whole = power(exponential(rest, depth + 1), static_cast<std::uint64_t>(std::labs(n)));
        return n > 0 ? whole : quotient(Residue{1}, whole);
      }
    }
    return drawn(e, of_exponential);
  }

  Residue hyperbolic(Expr e, bool odd) {
    const Residue up = exponential(e, 0), down = quotient(Residue{1}, up);
    return (odd ? up - down : up + down) / Residue{2};
  }

  std::uint64_t seed_;
  Pieces pieces_;
  NodeMap<Residue>& values_;
  std::unordered_map<Expr, std::vector<Residue>> solutions_;  // of linear systems, by their heads
};

std::vector<Residue> residues_in_order(std::span<const Expr> outputs, std::span<const Expr> order,
                                       std::uint64_t seed, Pieces pieces) {
  static NodeMap<Residue> values;
  values.clear();
  Point point(seed, pieces, values);
  for (Expr node : order) {
    const Residue value = point.value(node);
    values[node] = value;
  }
  std::vector<Residue> result;
  for (Expr output : outputs) result.push_back(values[output]);
  return result;
}

// ── double precision ──

constexpr double unit = 1.2e-16;  // of rounding

/// A value with a bound on its rounding error (running error analysis: Higham, Accuracy and Stability of
/// Numerical Algorithms, 2nd ed., §3.3).
struct Real {
  double value = 0, error = 0;
  /// The bound is of first order and library functions round worse than arithmetic: hence the factor.
  bool is_zero() const { return std::fabs(value) <= 16 * error; }
};

/// exp(-800) is not 0, nor is 1/cosh(800): what lies outside the range of doubles.
bool is_out_of_range(Op op, double value, const std::array<Real, 3>& x, int arity) {
  if (std::fabs(value) >= std::numeric_limits<double>::min()) return false;
  if (op != Op::exp && op != Op::mul && op != Op::div && op != Op::pow) return false;
  return std::all_of(x.begin(), x.begin() + arity,
                     [&](const Real& r) { return r.value != 0 || op == Op::exp; });
}

/// An operation with its rounding and the operands' errors times the slopes; NaN outside the range of doubles.
Real operation(Op op, const std::array<Real, 3>& x, int arity) {
  const double value = apply(op, x[0].value, x[1].value, x[2].value);
  if (is_out_of_range(op, value, x, arity)) return {std::numeric_limits<double>::quiet_NaN(), 0};
  double error = unit * std::fabs(value);
  for (int i = 0; i < arity; ++i) {
    if (x[i].error == 0) continue;
    std::array<double, 3> moved = {x[0].value, x[1].value, x[2].value};
    const double h = std::max(x[i].error, 1e-7 * std::max(std::fabs(moved[i]), 1e-3));
    moved[i] += h;
    const double slope = (apply(op, moved[0], moved[1], moved[2]) - value) / h;
    if (std::isfinite(slope)) error += std::fabs(slope) * x[i].error;
  }
  return {value, error};
}

Real real_at(Expr e, std::uint64_t seed) {
  static NodeMap<Real> values;
  values.clear();
  std::unordered_map<Expr, std::vector<double>> solutions;
  for (Expr node : topological({&e, 1})) {
    if (node.is_constant() || (node.is_symbol() && symbol_of(node).kind == Kind::constant)) {
      const double value = constant_value(node.is_constant() ? node : *symbol_of(node).value);
      values[node] = {value, unit * std::fabs(value)};
    } else if (node.is_symbol() || node.op() == Op::call || node.op() >= end_op) {
      // Around 1 at first, where roots and logarithms are defined; every other point lies in (-1, 1).
      const double u = static_cast<double>(random_bits(seed, node) >> 11) * 0x1p-53;
      values[node] = {seed % 2 == 0 ? 0.5 + u : 2 * u - 1, 0};
    } else if (node.op() == Op::solve) {
      if (component_of(node) == 0)
        solutions[node] = solution_value(node, [](Expr operand) { return values[operand].value; });
      const double value = solutions[head_of(node)][component_of(node)];
      values[node] = {value, solve_error * std::fabs(value)};
    } else {
      std::array<Real, 3> x;
      const auto operands = node.operands();
      for (std::size_t i = 0; i < operands.size(); ++i) x[i] = values[operands[i]];
      values[node] = operation(node.op(), x, static_cast<int>(operands.size()));
    }
  }
  return values[e];
}

/// Does a number stand there, with roots, π or functions of numbers in it?
bool is_number(Expr e) {
  for (Expr node : topological({&e, 1}))
    if (node.op() == Op::call || (node.is_symbol() && symbol_of(node).kind != Kind::constant)) return false;
  return true;
}

/// Functions that are drawn or folded above without all their identities.
bool has_other_functions(Expr e) {
  for (Expr node : topological({&e, 1}))
    if (node.op() > Op::pow && node.op() != Op::sin && node.op() != Op::cos && node.op() != Op::exp)
      return true;
  return false;
}

}  // namespace

Residue operator+(Residue a, Residue b) { return {(a.value + b.value) % prime}; }
Residue operator-(Residue a, Residue b) { return {(a.value + prime - b.value) % prime}; }
Residue operator*(Residue a, Residue b) {
  return {static_cast<std::uint64_t>(wide{a.value} * b.value % prime)};
}
Residue operator/(Residue a, Residue b) { return a * power(b, prime - 2); }  // Fermat

std::vector<Residue> residues(std::span<const Expr> outputs) {
  const std::vector<Expr> order = topological(outputs);
  for (std::uint64_t seed = 1; seed <= attempts; ++seed) {
    try {
      return residues_in_order(outputs, order, seed, Pieces::drawn);
    } catch (Undefined) {
    }
  }
  throw Error("an expression divides by a term that is zero for all values of its symbols");
}

std::vector<Residue> residues_at(std::span<const Expr> outputs, std::uint64_t seed, Pieces pieces) {
  try {
    return residues_in_order(outputs, topological(outputs), seed, pieces);
  } catch (Undefined) {
    return {};
  }
}

bool decided_by_residues(std::span<const Expr> outputs, bool pieces) {
  for (Expr node : topological(outputs)) {
    if (node.is_constant() || node.is_symbol()) continue;
    switch (node.op()) {
      case Op::neg:
      case Op::add:
      case Op::sub:
      case Op::mul:
      case Op::div:
      case Op::solve:
      case Op::sin:
      case Op::cos:
      case Op::tan:
      case Op::exp:
      case Op::sinh:
      case Op::cosh:
      case Op::tanh:
      case Op::call:
        break;
      case Op::pow:
        if (const mpq_class* n = exact_value(node.operand(1)); !n || n->get_den() != 1) return false;
        break;
      case Op::ifelse:
      case Op::abs:
      case Op::sign:
      case Op::min:
      case Op::max:
      case Op::lt:
      case Op::le:
      case Op::both:
      case Op::either:
        if (!pieces) return false;
        break;
      default:
        return false;
    }
  }
  return true;
}

bool is_zero(Expr e) {
  if (e.is_constant()) return constant_value(e) == 0;
  if (residues({&e, 1})[0].is_zero()) return true;
  if (!has_other_functions(e) && !is_number(e)) return false;
  int finite = 0;
  for (std::uint64_t seed = 2; seed < 2 + attempts && finite < 4; ++seed) {
    const Real r = real_at(e, seed);
    if (!std::isfinite(r.value)) continue;
    ++finite;
    if (!r.is_zero()) return false;
  }
  return finite > 0;
}

}  // namespace pendula::generic
