#include "integrate/event/event_conditions.hpp"

#include <algorithm>
#include <optional>
#include <unordered_set>

#include "base/lru_cache.hpp"
#include "dae/model/first_order.hpp"
#include "expr/graph/derivative.hpp"
#include "integrate/problem/per_equations.hpp"

namespace pendula::integrate {
namespace {

using GivenConditions = std::span<const EventConditions::Condition>;
using LeafSet = std::unordered_set<Expr>;

bool is_clock(std::span<const Expr> inside) {
  return std::all_of(inside.begin(), inside.end(), [](Expr leaf) {
    const Kind kind = symbol_of(leaf).kind;
    return leaf == time_symbol() || kind == Kind::constant || kind == Kind::parameter;
  });
}

/// Branches chosen by a mode count as the one in force.
bool is_polynomial_of_sines(Expr when) {
  const std::vector<Expr> nodes = topological({&when, 1});
  return std::all_of(nodes.begin(), nodes.end(), [](Expr node) {
    switch (node.op()) {
      case Op::constant:
      case Op::symbol:
      case Op::neg:
      case Op::add:
      case Op::sub:
      case Op::mul:
      case Op::sin:
      case Op::cos:
        return true;
      case Op::ifelse:
        return node.operand(0).op() == Op::symbol;
      case Op::div:
        return node.operand(1).is_constant();
      case Op::pow: {
        const mpq_class* n = exact_value(node.operand(1));
        return n && n->get_den() == 1 && *n >= 0;
      }
      default:
        return false;
    }
  });
}

/// Rates of the arguments of sines in the conditions. Where a slope is measured, sines in the equations
/// count, too: a sinusoidal voltage makes the unknowns of a condition oscillate.
template <class Known>
std::vector<Expr> phases_of(GivenConditions list, const std::vector<Expr>& equations, const Known& is_known,
                            EventConditions& out) {
  std::vector<Expr> phases;
  bool whole = false;
  for (std::size_t i = 0; i < list.size(); ++i) {
    std::vector<Expr> sources{list[i].when};
    if (out.measured[i] && !whole) sources.insert(sources.end(), equations.begin(), equations.end());
    whole = whole || out.measured[i];
    for (Expr node : topological(sources)) {
      if (node.op() != Op::sin && node.op() != Op::cos && node.op() != Op::tan) continue;
      const Expr phase = total_derivative(node.operand(0));
      if (!is_known(phase, i)) continue;
      out.phases.push_back(i);
      phases.push_back(phase);
    }
  }
  return phases;
}

/// What turns where a narrow part of g is highest or lowest: see EventConditions::narrow. 0: nothing does.
Expr turning_part(Expr node) {
  const auto has_number = [](Expr e) { return e.is_constant(); };
  switch (node.op()) {
    case Op::exp:
    case Op::sqrt:
    case Op::log:
    case Op::asin:
    case Op::acos:
      return node.operand(0);
    case Op::div:
      return node.operand(1);
    case Op::pow: {
      const mpq_class* n = exact_value(node.operand(1));
      const bool smooth = n && n->get_den() == 1 && *n >= 0;
      return smooth || !has_number(node.operand(1)) ? Expr() : node.operand(0);
    }
    case Op::abs:
    case Op::tanh:
    case Op::atan:
    case Op::cosh:
      return node.operand(0) * node.operand(0);
    case Op::min:
    case Op::max: {
      const Expr apart = node.operand(0) - node.operand(1);
      return apart * apart;
    }
    default:
      return {};
  }
}

EventConditions conditions_of(const Problem& problem, GivenConditions list) {
  const dae::FirstOrder& model = problem.model();
  const LeafSet known(problem.arguments().begin(), problem.arguments().end());
  LeafSet late(model.xdot.begin(), model.xdot.end());
  late.insert(model.z.begin(), model.z.end());
  for (Expr x : model.x) late.erase(x);
  const auto are_known = [&](Expr e, bool solved) {
    const std::vector<Expr> inside = leaves({&e, 1});
    return std::all_of(inside.begin(), inside.end(), [&](Expr leaf) {
      return (known.count(leaf) && (solved || !late.count(leaf))) || symbol_of(leaf).kind == Kind::constant;
    });
  };
  EventConditions out;
  std::vector<Expr> outputs, slopes;
  std::optional<bool> smooth;
  for (const auto& [when, guard] : list) {
    outputs.push_back(when);
    const Expr slope = total_derivative(when);
    const bool usable = are_known(slope, problem.is_ode() || !guard);
    out.slope_known.push_back(usable);
    out.measured.push_back(!usable && !guard);
    slopes.push_back(usable ? slope : Expr());
    const std::vector<Expr> own = leaves({&when, 1});
    for (Expr leaf : own) out.needs_derivatives = out.needs_derivatives || late.count(leaf);
    out.clock.push_back(is_clock(own));
    // z and x′ are as smooth as their equations
    const auto& F = model.F;
    if (out.measured.back() && !smooth) smooth = std::all_of(F.begin(), F.end(), is_polynomial_of_sines);
    out.may_dip.push_back(!is_polynomial_of_sines(when) || (out.measured.back() && !*smooth));
  }
  const auto is_known = [&](Expr phase, std::size_t i) {
    return are_known(phase, false) || (problem.is_ode() && out.slope_known[i]);
  };
  const std::vector<Expr> phases = phases_of(list, model.F, is_known, out);
  outputs.insert(outputs.end(), slopes.begin(), slopes.end());
  outputs.insert(outputs.end(), phases.begin(), phases.end());
  std::vector<Expr> bends;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (list[i].guard) continue;
    const Expr when = list[i].when;
    std::unordered_set<Expr> seen;
    for (Expr node : topological({&when, 1})) {
      if (node.is_constant() || node.is_symbol()) continue;
      const Expr part = turning_part(node);
      if (part.is_constant() || !seen.insert(part).second) continue;
      const Expr bend = out.slope_known[i] ? total_derivative(part) : Expr();
      if (out.slope_known[i] && (bend.is_constant() || !are_known(bend, true))) continue;
      out.narrow.push_back(i);
      out.is_exponent.push_back(node.op() == Op::exp);
      outputs.push_back(part);
      bends.push_back(bend);
    }
  }
  outputs.insert(outputs.end(), bends.begin(), bends.end());
  for (Expr leaf : leaves(slopes)) out.needs_derivatives = out.needs_derivatives || late.count(leaf);
  out.kernel = codegen::Kernel(outputs, problem.arguments());
  return out;
}

}  // namespace

std::shared_ptr<const EventConditions> EventConditions::of(const Problem& problem, GivenConditions list) {
  using Lists = LruCache<std::vector<std::uint32_t>, std::shared_ptr<const EventConditions>, WordsHash>;
  static constexpr std::size_t lists = 8;  // cached lists of events per model
  static PerEquations<std::shared_ptr<Lists>> known;
  Lists& of_model = *known.of(problem, [] { return std::make_shared<Lists>(lists); });
  std::vector<std::uint32_t> key;
  for (const auto& [when, guard] : list) {
    key.push_back(when.id());
    key.push_back(guard);
  }
  if (const auto* found = of_model.find(key)) return *found;
  return of_model.insert(key, std::make_shared<const EventConditions>(conditions_of(problem, list)));
}

}  // namespace pendula::integrate
