// ln f as an expression that does not evaluate f: in the tails exp(-e²/2) underflows long before its
// logarithm becomes large.
#include "base/limits/stack.hpp"
#include "expr/graph/graph.hpp"
#include "sysid/noise/likelihood.hpp"

namespace pendula::sysid {
namespace {

bool positive(Expr e);

bool even_power(Expr e) {
  if (e.op() != Op::pow) return false;
  const mpq_class* n = exact_value(e.operand(1));
  return n && n->get_den() == 1 && mpz_even_p(n->get_num_mpz_t());
}

bool nonnegative(Expr e) {
  check_stack();
  if (positive(e) || even_power(e)) return true;
  switch (e.op()) {
    case Op::constant:
      return constant_value(e) >= 0;
    case Op::abs:
    case Op::sqrt:
      return true;
    case Op::mul:
      return e.operand(0) == e.operand(1) || (nonnegative(e.operand(0)) && nonnegative(e.operand(1)));
    case Op::add:
      return nonnegative(e.operand(0)) && nonnegative(e.operand(1));
    case Op::div:
      return nonnegative(e.operand(0)) && positive(e.operand(1));
    default:
      return false;
  }
}

/// Does the form of e show that it is positive for all values of its symbols?
bool positive(Expr e) {
  check_stack();
  switch (e.op()) {
    case Op::constant:
      return constant_value(e) > 0;
    case Op::symbol:
      return e == pi();
    case Op::exp:
    case Op::cosh:
      return true;
    case Op::mul:
    case Op::div:
      return positive(e.operand(0)) && positive(e.operand(1));
    case Op::add:
      return (positive(e.operand(0)) && nonnegative(e.operand(1))) ||
             (nonnegative(e.operand(0)) && positive(e.operand(1)));
    case Op::pow:
      return positive(e.operand(0));
    case Op::sqrt:
      return positive(e.operand(0));
    default:
      return false;
  }
}

}  // namespace

Expr log_density(Expr f) {
  check_stack();
  switch (f.op()) {
    case Op::exp:
      return f.operand(0);
    case Op::mul:
      if (positive(f.operand(0)) || positive(f.operand(1)))
        return log_density(f.operand(0)) + log_density(f.operand(1));
      break;
    case Op::div:
      if (positive(f.operand(0)) || positive(f.operand(1)))
        return log_density(f.operand(0)) - log_density(f.operand(1));
      break;
    case Op::pow:
      if (positive(f.operand(0))) return f.operand(1) * log_density(f.operand(0));
      break;
    case Op::sqrt:
      if (positive(f.operand(0))) return log_density(f.operand(0)) / Expr(2);
      break;
    case Op::ifelse:
      for (const int i : {1, 2})  // log 0 is infinite
        if (f.operand(i).is_constant() && !positive(f.operand(i))) return log(f);
      return ifelse(f.operand(0), log_density(f.operand(1)), log_density(f.operand(2)));
    default:
      break;
  }
  return log(f);
}

}  // namespace pendula::sysid
