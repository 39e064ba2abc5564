#include "integrate/event/surfaces.hpp"

#include <algorithm>
#include <unordered_set>

#include "base/error.hpp"
#include "expr/graph/derivative.hpp"

namespace pendula::integrate {
namespace {

bool switches(Op op) {
  return op == Op::lt || op == Op::le || op == Op::abs || op == Op::sign || op == Op::min || op == Op::max;
}

bool is_even_power(Expr e) {
  if (e.op() != Op::pow) return false;
  const mpq_class* n = exact_value(e.operand(1));
  return n && n->get_den() == 1 && mpz_even_p(n->get_num_mpz_t());
}

/// For every value of its leaves, as far as its form tells.
bool never_negative(Expr e) {
  if (e.is_constant()) return constant_value(e) >= 0;
  const bool square = e.op() == Op::mul && e.operand(0) == e.operand(1);
  if (square || is_even_power(e) || e.op() == Op::exp || e.op() == Op::sqrt) return true;
  const std::span<const Expr> parts = e.operands();
  return (e.op() == Op::add || e.op() == Op::mul) && std::all_of(parts.begin(), parts.end(), never_negative);
}

/// Defined on one side only, so that a branch held fixed may leave its domain.
bool may_leave_domain(Expr node) {
  switch (node.op()) {
    case Op::sqrt:
      return !never_negative(node.operand(0));
    case Op::log:
    case Op::asin:
    case Op::acos:
    case Op::acosh:
    case Op::atanh:
      return !node.operand(0).is_constant();
    case Op::pow: {
      const mpq_class* n = exact_value(node.operand(1));
      return (!n || n->get_den() != 1) && !never_negative(node.operand(0));
    }
    default:
      return false;
  }
}

class Freezer {
 public:
  explicit Freezer(const std::vector<Expr>& nodes) {
    for (Expr node : nodes)
      if (switches(node.op())) replace(node);
  }
  Surfaces surfaces;
  Substitution replacements;
  std::vector<Expr> modes;

  /// Nothing that depends on a mode, by value or by being chosen, can leave its domain.
  bool is_safe(const std::vector<Expr>& equations) const {
    const std::unordered_set<Expr> mode(modes.begin(), modes.end());
    std::unordered_set<Expr> dependent;
    std::vector<Expr> branches;
    for (Expr node : topological(equations)) {
      bool depends = mode.count(node) > 0;
      for (Expr part : node.operands()) depends = depends || dependent.count(part);
      if (!depends) continue;
      dependent.insert(node);
      if (may_leave_domain(node)) return false;
      if (node.op() == Op::ifelse) branches.push_back(node.operand(1)), branches.push_back(node.operand(2));
    }
    const std::vector<Expr> chosen = topological(branches);
    return std::none_of(chosen.begin(), chosen.end(), may_leave_domain);
  }

 private:
  Expr mode_of(Expr when, Mode::Kind kind) {
    auto at = std::find_if(surfaces.list.begin(), surfaces.list.end(),
                           [&](const Surface& s) { return s.when == when; });
    if (at == surfaces.list.end()) at = surfaces.list.insert(at, {when, {}});
    for (const Mode& mode : at->modes)
      if (mode.kind == kind) return modes[mode.number];
    at->modes.push_back({surfaces.modes++, kind});
    modes.push_back(symbol(Kind::slot, text("mode_", surfaces.modes)));
    return modes.back();
  }

  void replace(Expr node) {
    const Op op = node.op();
    const bool two = op != Op::abs && op != Op::sign;
    const Expr a = node.operand(0), b = two ? node.operand(1) : Expr();
    const Expr when = a - b;
    if (when.is_constant()) return;
    const auto inner = [&](Expr e) { return substitute(std::vector{e}, replacements)[0]; };
    if (op == Op::abs) {
      replacements[node] = mode_of(when, Mode::Kind::sign) * inner(a);
    } else if (op == Op::sign) {
      replacements[node] = mode_of(when, Mode::Kind::sign);
    } else if (op == Op::min) {
      replacements[node] = ifelse(mode_of(when, Mode::Kind::less), inner(a), inner(b));
    } else if (op == Op::max) {
      replacements[node] = ifelse(mode_of(when, Mode::Kind::less), inner(b), inner(a));
    } else {
      replacements[node] = mode_of(when, op == Op::lt ? Mode::Kind::less : Mode::Kind::less_or_equal);
    }
  }
};

}  // namespace

Surfaces switching_surfaces(dae::FirstOrder& form, bool freeze) {
  std::vector<Expr> all = form.F;
  all.insert(all.end(), form.f.begin(), form.f.end());
  all.insert(all.end(), form.g.begin(), form.g.end());
  const std::vector<Expr> nodes = topological(all);
  if (std::none_of(nodes.begin(), nodes.end(), [](Expr e) { return switches(e.op()); })) return {};
  Freezer freezer(nodes);
  if (freezer.surfaces.list.empty()) return {};
  const std::vector<Expr> frozen = substitute(all, freezer.replacements);
  if (!freeze || !freezer.is_safe(frozen)) {
    for (Surface& surface : freezer.surfaces.list) surface.modes.clear();
    freezer.surfaces.modes = 0;
    return freezer.surfaces;
  }
  for (auto* equations : {&form.F, &form.f, &form.g})
    *equations = substitute(*equations, freezer.replacements);
  form.p.insert(form.p.end(), freezer.modes.begin(), freezer.modes.end());
  return freezer.surfaces;
}

}  // namespace pendula::integrate
