#include "expr/graph/angle.hpp"

#include <array>

#include "base/error.hpp"
#include "base/limits/stack.hpp"
#include "base/text.hpp"

namespace pendula {
namespace {

Expr root(long n) { return sqrt(Expr(n)); }

/// sin(q π) and tan(q π) for 0 < q < 1/2, for all angles whose values are at most a quotient of roots. The
/// values are created on demand, since expressions do not outlive a call.
struct KnownAngle {
  mpq_class half_turns;
  Expr (*sine)();
  Expr (*tangent)();
};

const std::array<KnownAngle, 11>& known_angles() {
  static const std::array<KnownAngle, 11> angles = {{
      {mpq_class(1, 12), [] { return (root(6) - root(2)) / 4; }, [] { return 2 - root(3); }},
      {mpq_class(1, 10), [] { return (root(5) - 1) / 4; }, [] { return sqrt(25 - 10 * root(5)) / 5; }},
      {mpq_class(1, 8), [] { return sqrt(2 - root(2)) / 2; }, [] { return root(2) - 1; }},
      {mpq_class(1, 6), [] { return Expr(1) / 2; }, [] { return root(3) / 3; }},
      {mpq_class(1, 5), [] { return sqrt(10 - 2 * root(5)) / 4; }, [] { return sqrt(5 - 2 * root(5)); }},
      {mpq_class(1, 4), [] { return root(2) / 2; }, [] { return Expr(1); }},
      {mpq_class(3, 10), [] { return (1 + root(5)) / 4; }, [] { return sqrt(25 + 10 * root(5)) / 5; }},
      {mpq_class(1, 3), [] { return root(3) / 2; }, [] { return root(3); }},
      {mpq_class(3, 8), [] { return sqrt(2 + root(2)) / 2; }, [] { return 1 + root(2); }},
      {mpq_class(2, 5), [] { return sqrt(10 + 2 * root(5)) / 4; }, [] { return sqrt(5 + 2 * root(5)); }},
      {mpq_class(5, 12), [] { return (root(6) + root(2)) / 4; }, [] { return 2 + root(3); }},
  }};
  return angles;
}

constexpr unsigned long most_below = 12;  // the greatest denominator of a known angle

const KnownAngle* find_angle(const mpq_class& half_turns) {
  for (const KnownAngle& angle : known_angles())
    if (angle.half_turns == half_turns) return &angle;
  return nullptr;
}

/// q modulo 1, 2, …
mpq_class modulo(const mpq_class& q, unsigned long n) {
  const mpz_class period = n * q.get_den();
  mpz_class above;
  mpz_fdiv_r(above.get_mpz_t(), q.get_num_mpz_t(), period.get_mpz_t());
  mpq_class rest(above, q.get_den());
  rest.canonicalize();
  return rest;
}

std::optional<Expr> sine(const mpq_class& half_turns) {
  if (half_turns.get_den() > most_below) return {};
  mpq_class q = modulo(half_turns, 2);
  const bool minus = q > 1;
  if (minus) q -= 1;
  if (2 * q > 1) q = 1 - q;
  const KnownAngle* angle = find_angle(q);
  if (!angle && q != 0 && 2 * q != 1) return {};
  const Expr value = angle ? angle->sine() : q == 0 ? Expr(0) : Expr(1);
  return minus ? -value : value;
}

std::optional<Expr> tangent(const mpq_class& half_turns) {
  if (half_turns.get_den() > most_below) return {};
  mpq_class q = modulo(half_turns, 1);
  if (q == 0) return Expr(0);
  if (2 * q == 1) throw Error(text("tan(", half_turns.get_str(), " pi) has no finite real value"));
  const bool minus = 2 * q > 1;
  if (minus) q = 1 - q;
  const KnownAngle* angle = find_angle(q);
  if (!angle) return {};
  return minus ? -angle->tangent() : angle->tangent();
}

}  // namespace

std::optional<mpq_class> half_turns(Expr e) {
  check_stack();
  if (e == pi()) return mpq_class(1);
  if (e.is_zero()) return mpq_class(0);
  if (e.op() == Op::neg) {
    if (const auto q = half_turns(e.operand(0))) return -*q;
    return {};
  }
  if (e.op() != Op::mul && e.op() != Op::div) return {};
  const Expr a = e.operand(0), b = e.operand(1);
  if (const mpq_class* factor = exact_value(b)) {
    const auto q = half_turns(a);
    if (!q || *factor == 0) return {};
    return mpq_class(e.op() == Op::mul ? mpq_class(*q * *factor) : mpq_class(*q / *factor));
  }
  if (const mpq_class* factor = exact_value(a); factor && e.op() == Op::mul)
    if (const auto q = half_turns(b)) return *factor * *q;
  return {};
}

std::optional<Expr> trigonometric_value(Op op, const mpq_class& half_turns) {
  switch (op) {
    case Op::sin:
      return sine(half_turns);
    case Op::cos:
      return sine(half_turns + mpq_class(1, 2));
    case Op::tan:
      return tangent(half_turns);
    default:
      return {};
  }
}

std::optional<Expr> known_angle(Op op, const mpq_class& value) {
  const mpq_class twice = 2 * value;
  const auto part = [](long above, long below) { return Expr(mpq_class(above, below)) * pi(); };
  if (op == Op::atan) {
    if (value == 1) return pi() / Expr(4);
    if (value == -1) return -(pi() / Expr(4));
    return {};
  }
  if ((op != Op::asin && op != Op::acos) || twice.get_den() != 1 || abs(twice) > 2) return {};
  const long k = twice.get_num().get_si();  // asin(k/2)
  if (op == Op::asin) {
    const long below = k == 0 ? 1 : std::labs(k) == 1 ? 6 : 2;
    if (k == 0) return Expr(0);
    return k > 0 ? pi() / Expr(below) : -(pi() / Expr(below));
  }
  switch (k) {  // acos(k/2)
    case 2:
      return Expr(0);
    case 1:
      return pi() / Expr(3);
    case 0:
      return pi() / Expr(2);
    case -1:
      return part(2, 3);
    default:
      return pi();
  }
}

}  // namespace pendula
