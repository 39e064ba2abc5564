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

constexpr std::size_t largest_set = 4;
constexpr std::size_t states_for_sets = 40;
constexpr std::size_t algebraic_unknowns = 200;  // every row is looked at in every round
constexpr int tries_for_each = 30;               // sets, so that a search among many summands ends

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

AtZero at_zero(Expr e, const Leaves& zeros, const Definitions& definitions) {
  std::unordered_map<Expr, AtZero> known;
  return at_zero(e, zeros, definitions, known);
}

/// The summands of a sum, signs left aside.
std::vector<Expr> summands(Expr e) {
  std::vector<Expr> open{e}, list;
  while (!open.empty()) {
    const Expr next = open.back();
    open.pop_back();
    if (next.op() == Op::add || next.op() == Op::sub || next.op() == Op::neg)
      open.insert(open.end(), next.operands().begin(), next.operands().end());
    else
      list.push_back(next);
  }
  return list;
}

class Search {
 public:
  /// Among the first `states`; the others are sensitivities.
  Search(const dae::FirstOrder& form, int states) : form_(form) {
    for (int i = 0; i < states; ++i) number_[form.x[i]] = i;
    for (std::size_t again = 0, known = 1; known > again && form.z.size() <= algebraic_unknowns;) {
      again = definitions_.size();
      definitions_ = definitions_in(form, std::move(definitions_));
      known = definitions_.size();
    }
    const std::vector<Expr> determining = leaves(form.g);
    decides_z_.insert(determining.begin(), determining.end());
  }

  std::vector<Set> sets() {
    std::vector<Set> list;
    for (int i = 0; i < static_cast<int>(number_.size()); ++i) {
      poll_interrupt();
      left_ = tries_for_each;
      const auto found = completed({i});
      if (found && std::find(list.begin(), list.end(), *found) == list.end()) list.push_back(*found);
    }
    const auto contains_another = [&](const Set& set) {
      return std::any_of(list.begin(), list.end(), [&](const Set& other) {
        return other.size() < set.size() && std::includes(set.begin(), set.end(), other.begin(), other.end());
      });
    };
    std::vector<Set> minimal;
    std::copy_if(list.begin(), list.end(), std::back_inserter(minimal),
                 [&](const Set& set) { return !contains_another(set); });
    return minimal;
  }

 private:
  /// The set itself where it is one, else with states that it lacks.
  std::optional<Set> completed(Set set) {
    if (left_-- <= 0) return {};
    std::sort(set.begin(), set.end());
    Leaves zeros;
    for (const int i : set) zeros.insert(form_.x[i]);
    for (const int i : set) {
      const AtZero own = at_zero(form_.f[i], zeros, definitions_);
      if (own == AtZero::vanishes && is_free_of_z(form_.f[i], zeros)) continue;
      if (own != AtZero::remains || set.size() == largest_set || number_.size() > states_for_sets) return {};
      return extended(set, form_.f[i], zeros);
    }
    return set;
  }

  /// z without a definition may grow beyond all bounds where the states that determine it vanish.
  bool is_free_of_z(Expr f, const Leaves& zeros) const {
    if (std::none_of(zeros.begin(), zeros.end(), [&](Expr x) { return decides_z_.count(x) > 0; }))
      return true;
    const std::vector<Expr> inside = leaves_of(f);
    return std::none_of(inside.begin(), inside.end(), [&](Expr leaf) {
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

  /// A state is added with which the first summand that remains vanishes, too.
  std::optional<Set> extended(const Set& set, Expr f, const Leaves& zeros) {
    const std::vector<Expr> terms = summands(f);
    const auto open = std::find_if(terms.begin(), terms.end(), [&](Expr term) {
      return at_zero(term, zeros, definitions_) != AtZero::vanishes;
    });
    if (open == terms.end()) return {};
    const Expr term = *open;
    for (const Expr leaf : leaves_of(term)) {
      const auto state = number_.find(leaf);
      if (state == number_.end() || zeros.count(leaf) > 0) continue;
      Leaves more = zeros;
      more.insert(leaf);
      if (at_zero(term, more, definitions_) != AtZero::vanishes) continue;
      Set larger = set;
      larger.push_back(state->second);
      if (const auto found = completed(std::move(larger))) return found;
    }
    return {};
  }

  const dae::FirstOrder& form_;
  std::unordered_map<Expr, int> number_;
  Definitions definitions_;
  Leaves decides_z_;  ///< leaves of 0 = g
  int left_ = 0;      ///< sets that may still be tried
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
