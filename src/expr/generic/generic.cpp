#include "expr/generic/generic.hpp"

#include <unordered_map>

#include "base/error.hpp"
#include "expr/generic/random_point.hpp"
#include "expr/graph/angle.hpp"
#include "expr/graph/node_map.hpp"
#include "expr/graph/solve.hpp"

namespace pendula::generic {
namespace {

constexpr std::uint64_t prime = (std::uint64_t{1} << 61) - 1;  // of Mersenne: remainders by shifts

__extension__ using wide = unsigned __int128;

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

struct Undefined {};  // a division by zero at this point; another one is drawn

Residue quotient(Residue a, Residue b) {
  if (b.is_zero()) throw Undefined{};
  return a / b;
}

Residue constant_residue(Expr e) {
  const mpq_class* exact = exact_value(e);
  const mpq_class q = exact ? *exact : mpq_class(constant_value(e));
  return quotient(residue_of(q.get_num()), residue_of(q.get_den()));
}

/// A point of the unit circle, representing an angle.
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
  // of sums inside a sine; deeper sums are represented by one random angle. A bound on the stack.
  static constexpr int deepest = 200;
  // Whole exponents and multiples of angles beyond these are hashed like unknown functions: choices, since
  // powers modulo the prime cost only their number of bits, but identities of such powers do not occur.
  static constexpr long largest_exponent = 1'000'000, largest_multiple = 1000;

  Residue drawn(Expr node) const { return {random_bits(seed_, node) % prime}; }
  /// exp(x) and the tangent of x/2 are drawn independently of x, since x - exp(x) is not 0.
  static constexpr std::uint64_t of_exponential = 0xd1342543de82ef95ull, of_angle = 0xaf251af3b0f025b5ull;
  Residue drawn(Expr node, std::uint64_t function) const {
    return {random_bits(seed_ ^ function, node) % prime};
  }

  /// A function without identities: equal arguments give equal values.
  Residue hashed(Expr node) const {
    std::uint64_t h = seed_ * 0x9e3779b97f4a7c15ull + static_cast<std::uint64_t>(node.op());
    for (Expr operand : node.operands()) {
      h = (h ^ values_[operand].value) * 0xbf58476d1ce4e5b9ull;
      h ^= h >> 29;
    }
    h *= 0x94d049bb133111ebull;
    return {(h ^ (h >> 31)) % prime};
  }

  /// In the first region, conditions hold and the arguments of abs and sign are positive.
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

  /// A component of a linear system; its head solves for all components.
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
    if (!n || n->get_den() > 2 || abs(n->get_num()) > largest_exponent) return hashed(node);
    const Residue base = values_[node.operand(0)];
    const Residue whole =
        power(n->get_den() == 1 ? base : root(base, node.operand(0)), mpz_class(abs(n->get_num())).get_ui());
    return *n >= 0 ? whole : quotient(Residue{1}, whole);
  }

  /// Splits a small integer factor from a product; 0 if there is none.
  static std::pair<long, Expr> multiple(Expr e) {
    if (e.op() == Op::mul)
      for (int i : {0, 1})
        if (const mpq_class* q = exact_value(e.operand(i));
            q && q->get_den() == 1 && abs(*q) <= largest_multiple)
          return {q->get_num().get_si(), e.operand(1 - i)};
    return {0, e};
  }

  /// Numbers with small denominators are represented as multiples of one number, so that e² is the
  /// square of e.
  static constexpr long common_denominator = 2520;  ///< the least common multiple of 1 … 10
  static std::optional<long> multiple_of_unit(Expr e) {
    const mpq_class* q = exact_value(e);
    if (!q || common_denominator % q->get_den() != 0 || abs(*q) > largest_multiple) return {};
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

}  // namespace pendula::generic
