#include "expr/graph/operation.hpp"

#include <cmath>

#include "base/error.hpp"

namespace pendula {
namespace {

struct Properties {
  Parity parity;
  std::optional<ExactPoint> exact;
  CodeKind code;
};

constexpr std::optional<ExactPoint> at(long x, long y) { return ExactPoint{x, y}; }
constexpr std::optional<ExactPoint> nowhere;

constexpr Properties table[] = {
#define OP(name, arity, style, parity, exact, code, ...) {Parity::parity, exact, CodeKind::code},
#include "expr/ops.def"
#undef OP
};
static_assert(std::size(table) == static_cast<std::size_t>(end_op) - static_cast<std::size_t>(first_op),
              "ifelse must stay the last row of ops.def: loops over operations end with it");

const Properties& row(Op op) { return table[static_cast<int>(op) - static_cast<int>(first_op)]; }

}  // namespace

Parity parity(Op op) { return row(op).parity; }
CodeKind code_kind(Op op) { return row(op).code; }
std::optional<ExactPoint> exact_point(Op op) { return row(op).exact; }

double apply_slope(Op op, int i, double a, double b, double c) {
  using std::cos, std::cosh, std::log, std::pow, std::sin, std::sinh, std::sqrt;
  constexpr double zero = 0, one = 1, two = 2;
  const auto sign = [](double x) { return static_cast<double>((x > 0) - (x < 0)); };
  const auto lt = [](double x, double y) { return x < y; };
  const auto ifelse = [](double condition, double p, double q) { return condition != 0 ? p : q; };
  const double r = apply(op, a, b, c);
  static_cast<void>(two);
  switch (op) {
#define OP(name, arity, style, parity, exact, code, value, da, db, dc, ...) \
  case Op::name:                                                            \
    return i == 0 ? da : i == 1 ? db : dc;
#include "expr/ops.def"
#undef OP
    default:
      internal_error(__FILE__, __LINE__, "apply_slope: not an operation");
  }
}

}  // namespace pendula
