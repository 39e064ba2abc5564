// From the graph to normal forms: selects the nodes that need a form of their own, and computes each by one
// sweep over the sum or product below it.
#include <unordered_set>

#include "base/interrupt.hpp"
#include "expr/graph/post_order.hpp"
#include "expr/normal/normal.hpp"

namespace pendula {
namespace {

/// The n of x^n if it is an integer of at most 10⁶: sums of nested exponents then stay within a long.
std::optional<long> whole_exponent(Expr power) {
  const mpq_class* n = exact_value(power.operand(1));
  if (!n || n->get_den() != 1 || !n->get_num().fits_slong_p() || abs(*n) > 1'000'000) return {};
  return n->get_num().get_si();
}

}  // namespace

NormalForms::Role NormalForms::role(Expr e) {
  switch (e.op()) {
    case Op::neg:
    case Op::add:
    case Op::sub:
      return Role::sum;
    case Op::mul:
    case Op::div:
      return Role::product;
    case Op::pow:
      return whole_exponent(e) ? Role::product : Role::other;
    default:
      return Role::other;
  }
}

SumId NormalForms::form(Expr e) {
  const std::vector<Expr> order = topological({&e, 1});
  // heads need a form of their own: the output, and operands that do not continue the sum or product above
  std::unordered_map<Expr, bool> head;
  head[e] = true;
  for (Expr node : order) {
    const Role r = role(node);
    for (Expr operand : node.operands())
      if (r == Role::other || role(operand) != r) head[operand] = true;
  }
  for (Expr node : order) {
    poll_interrupt();
    if (head.contains(node) && !memo_.contains(node)) {
      const SumId s = rewritten_sum(form_of_head(node));
      memo_[node] = s;
    }
  }
  return memo_[e];
}

SumId NormalForms::form_of_head(Expr e) {
  switch (role(e)) {
    case Role::sum:
      return form_of_sum(e);
    case Role::product:
      return form_of_product(e);
    default:
      return form_of_other(e);
  }
}

/// The nodes of the sum (product) that ends in `head`, operands first, down to nodes that already
/// have a form.
std::vector<Expr> NormalForms::region(Expr head) const {
  const Role r = role(head);
  std::vector<Expr> order;
  std::unordered_set<Expr> seen;
  append_post_order(
      head, [&](Expr e) { return (e == head || inside(e, r)) && seen.insert(e).second; }, order);
  return order;
}

void NormalForms::append(Sum& terms, SumId part, const mpz_class& weight) {
  const Number w{mpq_class(weight)};
  const Sum& add = sum(part);
  copied_ += static_cast<double>(add.size());
  if (add.size() > 1 && copied_ > copy_limit) {
    terms.push_back({w, {{sum_atom(part), 1}}});
    return;
  }
  for (const Term& t : add) terms.push_back({t.coefficient * w, t.factors});
}

SumId NormalForms::form_of_sum(Expr e) {
  const std::vector<Expr> nodes = region(e);
  std::unordered_map<Expr, mpz_class> weight;
  Sum terms;
  weight[e] = 1;
  for (auto it = nodes.rbegin(); it != nodes.rend(); ++it) {
    const mpz_class w = weight[*it];
    const auto operands = it->operands();
    for (std::size_t i = 0; i < operands.size(); ++i) {
      const bool minus = it->op() == Op::neg || (it->op() == Op::sub && i == 1);
      const mpz_class wi = minus ? mpz_class(-w) : w;
      if (!inside(operands[i], Role::sum)) {
        append(terms, memo_.at(operands[i]), wi);
      } else if (mpz_sizeinbase(wi.get_mpz_t(), 2) > weight_bits) {
        terms.push_back(
            {Number(mpq_class(wi)), {{intern(Atom{AtomKind::opaque, Op::add, operands[i], {}, {}}), 1}}});
      } else {
        weight[operands[i]] += wi;
      }
    }
    weight.erase(*it);
  }
  return intern(std::move(terms));
}

SumId NormalForms::form_of_product(Expr e) {
  const std::vector<Expr> nodes = region(e);
  std::unordered_map<Expr, mpz_class> exponent;
  std::vector<std::pair<Expr, mpz_class>> bases;
  exponent[e] = 1;
  for (auto it = nodes.rbegin(); it != nodes.rend(); ++it) {
    const mpz_class n = exponent[*it];
    const auto operands = it->operands();
    for (std::size_t i = 0; i < operands.size(); ++i) {
      if (it->op() == Op::pow && i == 1) continue;
      const mpz_class ni = it->op() == Op::pow             ? mpz_class(n * *whole_exponent(*it))
                           : it->op() == Op::div && i == 1 ? mpz_class(-n)
                                                           : n;
      const bool longer = mpz_sizeinbase(ni.get_mpz_t(), 2) > weight_bits;
      if (inside(operands[i], Role::product) && !longer) {
        exponent[operands[i]] += ni;
      } else {
        bases.emplace_back(operands[i], ni);
      }
    }
    exponent.erase(*it);
  }
  Term term{1, {}};
  for (const auto& [base, n] : bases) {
    const auto it = memo_.find(base);
    const bool undefined =
        it != memo_.end() && sum(it->second).empty() && n < 0;  // 1/(x - x) is left unchanged
    if (it == memo_.end() || undefined) {
      term.factors.push_back({intern(Atom{AtomKind::opaque, Op::mul, base, {}, {}}), mpq_class(n)});
    } else {
      multiply(term, it->second, mpq_class(n));
    }
  }
  return product(std::move(term));
}

SumId NormalForms::form_of_other(Expr e) {
  if (e.is_constant()) return number(Number::of(e));
  if (e.is_symbol()) return single(leaf_atom(e));
  if (e.op() == Op::solve) {  // printed by name, rewritten as a whole
    Atom atom{AtomKind::opaque, Op::solve, e, {}, {}};
    atom.traits.level = 2;
    return single(intern(std::move(atom)));
  }
  std::vector<SumId> args;
  for (Expr operand : e.operands()) args.push_back(memo_.at(operand));
  if (e.op() == Op::call) return single(intern(Atom{AtomKind::call, Op::call, e, std::move(args), {}}));
  if (e.op() == Op::min || e.op() == Op::max)
    if (compare_sums(args[1], args[0], 0) < 0) std::swap(args[0], args[1]);
  if (e.op() != Op::pow) return function(e.op(), std::move(args));
  if (const mpq_class* q = exact_value(e.operand(1)); q && !sum(args[0]).empty()) {
    Term term{1, {}};
    multiply(term, args[0], *q);
    return product(std::move(term));
  }
  return power(args[0], args[1]);
}

}  // namespace pendula
