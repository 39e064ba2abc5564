#include "expr/graph/operation.hpp"

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

}  // namespace pendula
