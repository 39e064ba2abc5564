#include "integrate/problem/invariant_zeros.hpp"

#include <algorithm>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "base/interrupt.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/graph.hpp"
#include "integrate/problem/per_equations.hpp"

namespace pendula::integrate {
namespace {

using Set = std::vector<int>;
using Leaves = std::unordered_set<Expr>;

constexpr std::size_t algebraic_unknowns = 200;  // every row is looked at in every round
constexpr int tries_for_each = 30;               // sets, so that a search among many products ends
constexpr std::size_t looks_at_each = 20;        // node of the equations
constexpr std::size_t largest_inside = 20;       // sets of others: a cascade has one for each of its states

/// Of an expression, where some leaves are 0.
enum class AtZero {
  vanishes,
  remains,  ///< log 0 counts as this: x log x has no slope at 0, but no solution passes through it either
  open      ///< a divisor or a root there: no finite value or slope
};

/// Lipschitz continuous, and 0 at 0.
bool passes_zero(Op op) {
  switch (op) {
    case Op::neg:
    case Op::sin:
    case Op::tan:
    case Op::asin:
    case Op::atan:
    case Op::sinh:
    case Op::tanh:
    case Op::asinh:
    case Op::atanh:
    case Op::abs:
      return true;
    default:
      return false;
  }
}

AtZero of_power(AtZero base, Expr exponent) {
  if (base != AtZero::vanishes) return base;
  return exponent.is_constant() && constant_value(exponent) >= 1 ? AtZero::vanishes : AtZero::open;
}

AtZero of_operation(Expr e, const std::vector<AtZero>& of) {
  const auto vanishes = [&](std::size_t i) { return of[i] == AtZero::vanishes; };
  const Op op = e.op();
  if (std::count(of.begin(), of.end(), AtZero::open) > 0) return AtZero::open;
  if (op == Op::mul) return vanishes(0) || vanishes(1) ? AtZero::vanishes : AtZero::remains;
  if (op == Op::div) return vanishes(1) ? AtZero::open : of[0];
  if (op == Op::pow) return of_power(of[0], e.operand(1));
  if (op == Op::sqrt || op == Op::acosh) return vanishes(0) ? AtZero::open : AtZero::remains;
  if (op == Op::ifelse) return vanishes(1) && vanishes(2) ? AtZero::vanishes : AtZero::remains;
  if (passes_zero(op)) return of[0];
  const bool combines = op == Op::add || op == Op::sub || op == Op::min || op == Op::max;
  return combines && vanishes(0) && vanishes(1) ? AtZero::vanishes : AtZero::remains;
}

/// Algebraic unknowns z = e, from rows 0 = g that are linear in them, e by states and others of these.
using Definitions = std::unordered_map<Expr, Expr>;

Definitions definitions_in(const dae::FirstOrder& form, Definitions list) {
  const Leaves unknown(form.z.begin(), form.z.end());
  for (const Expr row : form.g) {
    poll_interrupt();
    for (const Expr z : leaves({&row, 1})) {
      if (unknown.count(z) == 0 || list.count(z) > 0) continue;
      const Expr slope = partial(row, z);
      if (!slope.is_constant() || slope.is_zero()) continue;
      const Expr rest = substitute(row, {{z, Expr(0)}}) / -slope;
      const std::vector<Expr> inside = leaves({&rest, 1});
      const bool is_known = std::all_of(inside.begin(), inside.end(), [&](Expr leaf) {
        return unknown.count(leaf) == 0 || list.count(leaf) > 0;
      });
      if (!is_known) continue;
      list.emplace(z, rest);
      break;
    }
  }
  return list;
}

/// `known`: what has been found so far for these zeros.
AtZero at_zero(Expr e, const Leaves& zeros, const Definitions& definitions,
               std::unordered_map<Expr, AtZero>& known) {
  for (const Expr node : topological({&e, 1})) {
    if (known.count(node) > 0) continue;
    AtZero own = AtZero::remains;
    if (const auto defined = definitions.find(node); defined != definitions.end())
      own = at_zero(defined->second, zeros, definitions, known);
    else if (node.is_symbol())
      own = zeros.count(node) > 0 ? AtZero::vanishes : AtZero::remains;
    else if (node.is_constant())
      own = node.is_zero() ? AtZero::vanishes : AtZero::remains;
    else if (node.op() == Op::call || node.op() == Op::solve)
      own = AtZero::open;
    else {
      std::vector<AtZero> of;
      for (const Expr operand : node.operands()) of.push_back(known.at(operand));
      own = of_operation(node, of);
    }
    known.emplace(node, own);
  }
  return known.at(e);
}

/// What is to vanish with the state from which a search begins, as far as it is settled.
struct Closure {
  int start = 0;
  Leaves zeros;                ///< states
  Set states;                  ///< those of zeros
  std::vector<Expr> open;      ///< must vanish
  std::vector<Expr> products;  ///< must vanish, one factor or the other
  Leaves seen;                 ///< nodes that have been in `open`
};

class Search {
 public:
  /// Among the first `states`; the others are sensitivities.
  Search(const dae::FirstOrder& form, int states)
      : form_(form), results_(static_cast<std::size_t>(states), unknown) {
    for (int i = 0; i < states; ++i) number_[form.x[i]] = i;
    for (std::size_t again = 0, known = 1; known > again && form.z.size() <= algebraic_unknowns;) {
      again = definitions_.size();
      definitions_ = definitions_in(form, std::move(definitions_));
      known = definitions_.size();
    }
    const std::vector<Expr> determining = leaves(form.g);
    decides_z_.insert(determining.begin(), determining.end());
    looks_ = looks_at_each * (100 + topological(form.f).size());
  }

  std::vector<Set> sets() {
    for (int i = 0; i < static_cast<int>(results_.size()); ++i) {
      poll_interrupt();
      left_ = tries_for_each;
      Closure closure;
      closure.start = i;
      add(closure, i);
      results_[i] = completed(std::move(closure));
    }
    return std::move(list_);
  }

 private:
  /// Of a search: a place in list_, or one of these.
  using Result = int;
  static constexpr Result unknown = -1, none = -2;

  void add(Closure& closure, int state) const {
    closure.zeros.insert(form_.x[state]);
    closure.states.push_back(state);
    closure.open.push_back(form_.f[state]);
  }

  /// With the states that it lacks.
  Result completed(Closure closure) {
    if (left_-- <= 0) return unknown;
    while (!closure.open.empty()) {
      const Expr next = closure.open.back();
      closure.open.pop_back();
      if (!closure.seen.insert(next).second) continue;
      if (!may_look(1)) return unknown;
      if (const auto result = require(closure, next)) return *result;
    }
    std::unordered_map<Expr, AtZero> known;
    while (!closure.products.empty()) {
      const Expr product = closure.products.back();
      closure.products.pop_back();
      if (at_zero(product, closure.zeros, definitions_, known) == AtZero::vanishes) continue;
      if (!may_look(known.size())) return unknown;
      return completed_by(product, closure);
    }
    if (!is_invariant(closure, known)) return none;
    std::sort(closure.states.begin(), closure.states.end());
    list_.push_back(std::move(closure.states));
    return static_cast<Result>(list_.size()) - 1;
  }

  /// One factor of the product vanishes, or the other.
  Result completed_by(Expr product, const Closure& closure) {
    Result last = none;
    for (const Expr factor : product.operands()) {
      Closure one = closure;
      one.open = {factor};
      const Result result = completed(std::move(one));
      if (result >= 0) return result;
      if (result == unknown) last = unknown;
    }
    return last;
  }

  /// Where the search has become too long, left_ is 0 and it has no result.
  bool may_look(std::size_t times) {
    looks_ -= std::min(times, looks_);
    if (looks_ == 0) left_ = 0;
    return looks_ > 0;
  }

  /// Passes on to its operands that an expression vanishes; a result where the search ends with it.
  std::optional<Result> require(Closure& closure, Expr e) {
    if (e.is_constant()) return e.is_zero() ? std::nullopt : std::optional(none);
    if (e.is_symbol()) return require_leaf(closure, e);
    const auto operands = e.operands();
    switch (e.op()) {
      case Op::add:
      case Op::sub:
      case Op::min:
      case Op::max:
        closure.open.insert(closure.open.end(), operands.begin(), operands.end());
        return {};
      case Op::ifelse:
        closure.open.insert(closure.open.end(), operands.begin() + 1, operands.end());
        return {};
      case Op::mul:
        return require_product(closure, e);
      case Op::div:
      case Op::pow:  // with an exponent of 1 and more, as is_invariant() finds out
        closure.open.push_back(operands.front());
        return {};
      default:
        if (!passes_zero(e.op())) return none;
        closure.open.push_back(operands.front());
        return {};
    }
  }

  std::optional<Result> require_leaf(Closure& closure, Expr leaf) const {
    if (closure.zeros.count(leaf) > 0) return {};
    if (const auto defined = definitions_.find(leaf); defined != definitions_.end()) {
      closure.open.push_back(defined->second);
      return {};
    }
    const auto state = number_.find(leaf);
    if (state == number_.end()) return none;
    const Result known = results_[state->second];
    if (known == none) return none;
    if (known == unknown)
      add(closure, state->second);
    else
      return require_set(closure, known);
    return {};
  }

  /// One that is known. The search ends where it is the one that is sought, or would be a set with large ones
  /// inside.
  std::optional<Result> require_set(Closure& closure, Result known) const {
    const Set& set = list_[known];
    if (std::binary_search(set.begin(), set.end(), closure.start)) return known;
    if (set.size() > largest_inside) return unknown;
    for (const int i : set)
      if (closure.zeros.insert(form_.x[i]).second) closure.states.push_back(i);
    return {};
  }

  std::optional<Result> require_product(Closure& closure, Expr e) {
    std::vector<Expr> able;
    for (const Expr factor : e.operands())
      if (has_states(factor)) able.push_back(factor);
    if (able.empty()) return none;
    if (able.size() > 1 && able.front() != able.back())
      closure.products.push_back(e);
    else
      closure.open.push_back(able.front());
    return {};
  }

  bool has_states(Expr e) {
    if (const auto known = has_states_.find(e); known != has_states_.end()) return known->second;
    for (const Expr node : topological({&e, 1})) {
      if (has_states_.count(node) > 0) continue;
      const auto defined = definitions_.find(node);
      const auto operands = node.operands();
      has_states_[node] = number_.count(node) > 0 ||
                          (defined != definitions_.end() && has_states(defined->second)) ||
                          std::any_of(operands.begin(), operands.end(),
                                      [&](Expr operand) { return has_states_.at(operand); });
    }
    return has_states_.at(e);
  }

  /// z without a definition may grow beyond all bounds where the states that determine it vanish.
  bool is_invariant(const Closure& closure, std::unordered_map<Expr, AtZero>& known) const {
    const bool decides_z = std::any_of(closure.zeros.begin(), closure.zeros.end(),
                                       [&](Expr x) { return decides_z_.count(x) > 0; });
    return std::all_of(closure.states.begin(), closure.states.end(), [&](int i) {
      return at_zero(form_.f[i], closure.zeros, definitions_, known) == AtZero::vanishes &&
             !(decides_z && has_z(form_.f[i]));
    });
  }

  bool has_z(Expr f) const {
    const std::vector<Expr> inside = leaves_of(f);
    return std::any_of(inside.begin(), inside.end(), [&](Expr leaf) {
      return std::find(form_.z.begin(), form_.z.end(), leaf) != form_.z.end();
    });
  }

  /// With those of definitions in place of what they define.
  std::vector<Expr> leaves_of(Expr e) const {
    std::vector<Expr> open = leaves({&e, 1}), list;
    for (std::size_t k = 0; k < open.size(); ++k) {
      const auto defined = definitions_.find(open[k]);
      if (defined == definitions_.end()) {
        list.push_back(open[k]);
        continue;
      }
      for (const Expr leaf : leaves({&defined->second, 1}))
        if (std::find(open.begin(), open.end(), leaf) == open.end()) open.push_back(leaf);
    }
    return list;
  }

  const dae::FirstOrder& form_;
  std::unordered_map<Expr, int> number_;
  Definitions definitions_;
  Leaves decides_z_;  ///< leaves of 0 = g
  std::unordered_map<Expr, bool> has_states_;
  std::vector<Set> list_;
  std::vector<Result> results_;  ///< of the searches from the states
  int left_ = 0;                 ///< choices that may still be made for a state
  std::size_t looks_ = 0;        ///< at nodes, left for all states
};

}  // namespace

const std::vector<std::vector<int>>& invariant_zeros(const Problem& problem) {
  static PerEquations<std::vector<Set>> known;
  return known.of(problem, [&] {
    const dae::FirstOrder& form = problem.model();
    return form.semi_explicit ? Search(form, problem.visible_n()).sets() : std::vector<Set>();
  });
}

}  // namespace pendula::integrate
