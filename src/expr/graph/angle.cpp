#include "expr/graph/angle.hpp"

#include "base/error.hpp"
#include "base/text.hpp"

namespace pendula {
namespace {

/// sin(k π/12), 0 ≤ k ≤ 6.
std::optional<Expr> first_quadrant(unsigned long k) {
  switch (k) {
    case 0:
      return Expr(0);
    case 2:
      return Expr(1) / Expr(2);
    case 3:
      return sqrt(Expr(2)) / Expr(2);
    case 4:
      return sqrt(Expr(3)) / Expr(2);
    case 6:
      return Expr(1);
    default:
      return {};
  }
}

std::optional<Expr> sine(const mpq_class& half_turns) {
  const mpq_class twelfths = half_turns * 12;
  if (twelfths.get_den() != 1) return {};
  const unsigned long k = mpz_fdiv_ui(twelfths.get_num_mpz_t(), 24), half = k % 12;
  const auto value = first_quadrant(half <= 6 ? half : 12 - half);
  if (!value) return {};
  return k < 12 ? *value : -*value;
}

std::optional<Expr> tangent(const mpq_class& half_turns) {
  const mpq_class twelfths = half_turns * 12;
  if (twelfths.get_den() != 1) return {};
  switch (mpz_fdiv_ui(twelfths.get_num_mpz_t(), 12)) {
    case 0:
      return Expr(0);
    case 2:
      return sqrt(Expr(3)) / Expr(3);
    case 3:
      return Expr(1);
    case 4:
      return sqrt(Expr(3));
    case 6:
      throw Error(text("tan(", half_turns.get_str(), " pi) has no finite real value"));
    case 8:
      return -sqrt(Expr(3));
    case 9:
      return Expr(-1);
    case 10:
      return -(sqrt(Expr(3)) / Expr(3));
    default:
      return {};
  }
}

}  // namespace

std::optional<mpq_class> half_turns(Expr e) {
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
