#include "integrate/event/surfaces.hpp"

#include <algorithm>
#include <cfloat>
#include <unordered_set>
#include <utility>

#include "base/error.hpp"
#include "base/limits/stack.hpp"
#include "dae/analysis/determinant_factors.hpp"
#include "expr/print/print.hpp"
#include "integrate/event/border_smoothness.hpp"

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

/// Does the form of e show that it is ≥ 0 for all values of its leaves?
bool never_negative(Expr e) {
  check_stack();
  if (e.is_constant()) return constant_value(e) >= 0;
  const bool square = e.op() == Op::mul && e.operand(0) == e.operand(1);
  if (square || is_even_power(e) || e.op() == Op::exp || e.op() == Op::sqrt) return true;
  const std::span<const Expr> parts = e.operands();
  return (e.op() == Op::add || e.op() == Op::mul) && std::all_of(parts.begin(), parts.end(), never_negative);
}

/// What must be positive where a function is defined on one side only; a constant where it is defined
/// everywhere.
Expr edge_of_domain(Expr node) {
  if (node.is_constant() || node.is_symbol() || node.operands().empty()) return {};
  const Expr a = node.operand(0);
  switch (node.op()) {
    case Op::sqrt:
      return never_negative(a) ? Expr() : a;
    case Op::log:
      return a;
    case Op::asin:
    case Op::acos:
    case Op::atanh:
      return 1 - a * a;
    case Op::acosh:
      return a - 1;
    case Op::pow: {
      const mpq_class* n = exact_value(node.operand(1));
      return (n && n->get_den() == 1) || never_negative(a) ? Expr() : a;
    }
    default:
      return {};
  }
}

/// A function as it is written, and the value that it has at the edge of its domain beyond that; a constant
/// if it has none: log x at x = 0. Its argument stays just inside the edge, where slopes are finite.
Expr within_domain(Expr node) {
  const Expr a = node.operand(0), least(DBL_MIN), below_one(1 - DBL_EPSILON / 2);
  switch (node.op()) {
    case Op::sqrt:
      return sqrt(max(a, least));
    case Op::asin:
      return asin(min(max(a, -below_one), below_one));
    case Op::acos:
      return acos(min(max(a, -below_one), below_one));
    case Op::acosh:
      return acosh(max(a, Expr(1 + DBL_EPSILON)));
    case Op::pow: {
      const Expr n = node.operand(1);
      return n.is_constant() && constant_value(n) > 0 ? pow(max(a, least), n) : Expr();
    }
    default:
      return {};
  }
}

bool is_function(Expr e, Op op) { return !e.is_constant() && !e.is_symbol() && e.op() == op; }

/// The v for which √e = |v| √g with smooth g, except where g vanishes: e = v², v⁶, c v², v² u/w. A constant
/// if there is none.
Expr base_of_square(Expr e) {
  check_stack();
  if (e.is_constant() || e.is_symbol()) return {};
  if (e.op() == Op::div) return base_of_square(e.operand(0));
  if (e.op() == Op::mul) {
    if (e.operand(0) == e.operand(1)) return e.operand(0);
    const Expr a = base_of_square(e.operand(0)), b = base_of_square(e.operand(1));
    return a.is_constant() ? b : b.is_constant() ? a : a * b;
  }
  if (!is_even_power(e)) return {};
  const mpq_class& power = *exact_value(e.operand(1));
  return power <= 0 || mpz_divisible_ui_p(power.get_num_mpz_t(), 4) ? Expr() : e.operand(0);
}

/// A function with a kink or a jump, but without a branch that could be frozen, has it where this
/// expression vanishes: atan2(y, x) at y = 0, asin(sin u) at cos u = 0, √(v²) at v = 0. Returns a constant
/// for other functions.
Expr border_without_branch(Expr node) {
  if (node.is_constant() || node.is_symbol() || node.operands().empty()) return {};
  const Expr a = is_function(node.operand(0), Op::neg) ? node.operand(0).operand(0) : node.operand(0);
  switch (node.op()) {
    case Op::atan2:
      return a;
    case Op::asin:
    case Op::acos:
      return is_function(a, Op::sin)   ? cos(a.operand(0))
             : is_function(a, Op::cos) ? sin(a.operand(0))
                                       : Expr();
    case Op::atan:
      return is_function(a, Op::tan) ? cos(a.operand(0)) : Expr();
    case Op::sqrt:
      return base_of_square(a);
    case Op::pow:
      return exact_value(node.operand(1)) && *exact_value(node.operand(1)) == mpq_class(1, 2)
                 ? base_of_square(a)
                 : Expr();
    default:
      return {};
  }
}

/// Splits c e into e and whether the number c is positive.
std::pair<Expr, bool> without_factor(Expr e) {
  bool positive = true;
  while (!e.is_constant() && !e.is_symbol()) {
    if (e.op() == Op::neg) {
      positive = !positive;
      e = e.operand(0);
      continue;
    }
    const bool product = e.op() == Op::mul;
    if (!product && e.op() != Op::div) break;
    const int number = product && e.operand(0).is_constant() ? 0 : 1;
    if (!e.operand(number).is_constant()) break;
    positive = positive == (constant_value(e.operand(number)) > 0);
    e = e.operand(1 - number);
  }
  return {e, positive};
}

std::vector<Expr> equations_of(const dae::FirstOrder& form) {
  std::vector<Expr> all = form.F;
  all.insert(all.end(), form.f.begin(), form.f.end());
  all.insert(all.end(), form.g.begin(), form.g.end());
  return all;
}

}  // namespace

PiecewiseForm::PiecewiseForm(dae::FirstOrder form, std::span<const double> values) : form_(std::move(form)) {
  const std::vector<Expr> equations = equations_of(form_);
  const std::vector<Expr> nodes = topological(equations);
  if (std::none_of(nodes.begin(), nodes.end(),
                   [](Expr e) { return switches(e.op()) || !border_without_branch(e).is_constant(); }))
    return;
  find_branches(nodes);
  if (surfaces_.empty()) return;
  number_modes(std::vector<char>(surfaces_.size(), 1));
  const Substitution all = frozen(std::vector<Treatment>(surfaces_.size(), Treatment::frozen));
  std::vector<Expr> whens;
  for (const Surface& surface : surfaces_) whens.push_back(surface.when);
  const BorderSmoothness smoothness(substitute(form_.F, all), modes_, surfaces_, substitute(whens, all),
                                    form_.p, values);
  const std::vector<std::vector<Limited>> limited = limited_functions(nodes, all);
  std::vector<char> freeze(surfaces_.size(), 1);
  for (std::size_t k = 0; k < surfaces_.size(); ++k) {
    Surface& surface = surfaces_[k];
    if (surface.modes.empty()) continue;
    surface.smoothness = smoothness(k);
    if (limited[k].empty()) continue;
    std::vector<Expr> edges;
    for (const Limited& one : limited[k]) edges.push_back(edge_of_domain(substitute(one.node, all)));
    const std::vector<char> clear = smoothness.are_positive_around(k, edges);
    for (std::size_t i = 0; i < clear.size(); ++i) {
      const Limited& one = limited[k][i];
      surface.is_edge = surface.is_edge || !clear[i];
      // a solution may also meet the edge at one point of the border only
      if (surface.smoothness == Smoothness::open && !within_domain(one.node).is_constant())
        limited_.push_back(one);
      else if (!clear[i])
        freeze[k] = 0;
    }
  }
  std::sort(limited_.begin(), limited_.end(),
            [](const Limited& a, const Limited& b) { return a.place < b.place; });
  number_modes(freeze);
}

void PiecewiseForm::find_branches(const std::vector<Expr>& nodes) {
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const Expr node = nodes[k];
    const Op op = node.op();
    if (const Expr border = border_without_branch(node);
        !border.is_constant() && (op == Op::atan2 || dae::sign_of(border) == 0)) {
      bool reversed = false;
      surface_of(border, reversed);
    }
    if (!switches(op)) continue;
    const bool two = op != Op::abs && op != Op::sign;
    const Expr when = node.operand(0) - (two ? node.operand(1) : Expr());
    if (when.is_constant()) continue;
    if (const int sign = dae::sign_of(when); sign != 0) {  // as in ||x|/2|, which at most touches 0
      if (op == Op::abs || op == Op::min || op == Op::max)
        branches_.push_back({node, k, 0, {}, false, -1, sign});
      continue;
    }
    const Mode::Kind kind = !two           ? Mode::Kind::sign
                            : op == Op::le ? Mode::Kind::less_or_equal
                                           : Mode::Kind::less;
    bool reversed = false;
    const std::size_t surface = surface_of(when, reversed);
    branches_.push_back({node, k, surface, kind, reversed});
  }
}

/// a < b and b < a have one border; x/1000 < 0 has that of x < 0.
std::size_t PiecewiseForm::surface_of(Expr when, bool& reversed) {
  const auto [e, positive] = without_factor(when);
  for (std::size_t k = 0; k < surfaces_.size(); ++k) {
    const auto [known, same] = without_factor(surfaces_[k].when);
    reversed = (known == e && same != positive) || surfaces_[k].when == -when;
    if (reversed || known == e) return k;
  }
  reversed = false;
  surfaces_.push_back({when, {}});
  return surfaces_.size() - 1;
}

/// One mode per kind of branch for every surface that may be frozen.
void PiecewiseForm::number_modes(const std::vector<char>& frozen) {
  modes_.clear();
  for (Surface& surface : surfaces_) surface.modes.clear();
  for (Branch& branch : branches_) {
    branch.mode.reset();
    branch.combined.reset();
    if (branch.settled != 0) continue;
    const bool fixed = frozen[branch.surface] != 0;
    if (!fixed || surfaces_[branch.surface].is_edge)
      branch.combined = symbol(Kind::slot, text("side_", &branch - branches_.data() + 1));
    if (!fixed) continue;
    std::vector<Mode>& modes = surfaces_[branch.surface].modes;
    const auto same = std::find_if(modes.begin(), modes.end(), [&](const Mode& mode) {
      return mode.kind == branch.kind && mode.reversed == branch.reversed;
    });
    if (same != modes.end()) {
      branch.mode = same->number;
      continue;
    }
    branch.mode = static_cast<int>(modes_.size());
    modes.push_back({*branch.mode, branch.kind, branch.reversed});
    modes_.push_back(symbol(Kind::slot, text("mode_", modes_.size() + 1)));
  }
}

Substitution PiecewiseForm::frozen(const std::vector<Treatment>& treatment) const {
  Substitution replacements;
  auto limited = limited_.begin();
  for (const Branch& branch : branches_) {
    for (; limited != limited_.end() && limited->place < branch.place; ++limited)
      keep_in_domain(*limited, treatment, replacements);
    replace(branch, treatment, replacements);
  }
  for (; limited != limited_.end(); ++limited) keep_in_domain(*limited, treatment, replacements);
  return replacements;
}

void PiecewiseForm::replace(const Branch& branch, const std::vector<Treatment>& treatment,
                            Substitution& replacements) const {
  const Expr node = branch.node;
  const auto inner = [&](int i) { return substitute(node.operand(i), replacements); };
  if (branch.settled != 0) {
    const bool positive = branch.settled > 0;
    if (node.op() == Op::abs)
      replacements[node] = positive ? inner(0) : -inner(0);
    else
      replacements[node] = inner(positive == (node.op() == Op::max) ? 0 : 1);
    return;
  }
  const Treatment treated = treatment[branch.surface];
  if (treated == Treatment::unfrozen || (!branch.mode && treated != Treatment::sliding)) return;
  const bool is_fixed = branch.mode && (treated != Treatment::sliding || !branch.combined);
  const Expr mode = is_fixed ? modes_[*branch.mode] : *branch.combined;
  switch (node.op()) {
    case Op::abs:
      replacements[node] = mode * inner(0);
      break;
    case Op::min:
      replacements[node] = ifelse(mode, inner(0), inner(1));
      break;
    case Op::max:
      replacements[node] = ifelse(mode, inner(1), inner(0));
      break;
    default:
      replacements[node] = mode;
  }
}

/// A step across a border evaluates the branch that is held fixed behind it, too, √x of √max(0, x) at x < 0:
/// there the function takes the value that it has at the edge of its domain.
void PiecewiseForm::keep_in_domain(const Limited& one, const std::vector<Treatment>& treatment,
                                   Substitution& replacements) const {
  const Surface& surface = surfaces_[one.surface];
  if (treatment[one.surface] != Treatment::frozen || surface.modes.empty()) return;
  const Mode& mode = surface.modes.front();
  const Expr value = modes_[mode.number], side = mode.kind == Mode::Kind::sign ? value : 1 - 2 * value;
  const Expr when = substitute(surface.when, replacements);
  replacements[one.node] = ifelse(lt((mode.reversed ? -side : side) * when, 0), within_domain(one.node),
                                  substitute(one.node, replacements));
}

Substitution PiecewiseForm::modes_on(std::size_t surface, double side) const {
  Substitution result;
  for (const Mode& mode : surfaces_[surface].modes) result[modes_[mode.number]] = Expr(mode.value(side));
  for (const Branch& branch : branches_)
    if (branch.combined && branch.surface == surface)
      result[*branch.combined] = Expr(Mode{-1, branch.kind, branch.reversed}.value(side));
  return result;
}

SlidingForm PiecewiseForm::form(const std::vector<Treatment>& treatment,
                                const std::unordered_map<Expr, double>& at) const {
  SlidingForm result{form_, {}, {}};
  result.form.p.insert(result.form.p.end(), modes_.begin(), modes_.end());
  const Substitution replacements = frozen(treatment);
  if (replacements.empty()) return result;
  for (auto* equations : {&result.form.F, &result.form.f, &result.form.g})
    *equations = substitute(*equations, replacements);
  for (std::size_t k = 0; k < surfaces_.size(); ++k) {
    if (treatment[k] != Treatment::sliding) continue;
    const Surface& surface = surfaces_[k];
    if (!slide_along(result, substitute(surface.when, replacements), modes_on(k, 1), modes_on(k, -1),
                     surface.modes.empty() || surface.is_edge, at))
      throw Failure("no combination of both sides stays on " + to_text(surface.when) + " = 0");
  }
  return result;
}

/// For each surface: functions that are defined on one side of something only, and depend on its modes, by
/// value or by being chosen. all: the modes of all branches in their place.
std::vector<std::vector<PiecewiseForm::Limited>> PiecewiseForm::limited_functions(
    const std::vector<Expr>& nodes, const Substitution& all) const {
  std::vector<std::vector<Limited>> result(surfaces_.size());
  std::unordered_map<Expr, std::size_t> place;  // of the functions
  for (std::size_t k = 0; k < nodes.size(); ++k)
    if (!edge_of_domain(nodes[k]).is_constant() && !edge_of_domain(substitute(nodes[k], all)).is_constant())
      place.emplace(nodes[k], k);
  if (place.empty()) return result;
  std::unordered_map<Expr, std::size_t> surface_of_mode;
  for (std::size_t k = 0; k < surfaces_.size(); ++k)
    for (const Mode& mode : surfaces_[k].modes) surface_of_mode[modes_[mode.number]] = k;
  const auto add = [&](Expr e, const std::vector<Expr>& functions) {
    if (functions.empty()) return;
    const Expr with_modes = substitute(e, all);
    for (Expr leaf : leaves({&with_modes, 1}))
      if (const auto at = surface_of_mode.find(leaf); at != surface_of_mode.end())
        for (Expr function : functions)
          result[at->second].push_back({function, at->second, place.at(function)});
  };
  const auto limited_in = [&](std::vector<Expr> list) {
    list.erase(std::remove_if(list.begin(), list.end(), [&](Expr e) { return !place.count(e); }), list.end());
    return list;
  };
  for (Expr node : nodes) {
    add(node, limited_in({node}));
    const bool chooses = node.op() == Op::ifelse || node.op() == Op::min || node.op() == Op::max;
    if (!chooses) continue;
    const int first = node.op() == Op::ifelse ? 1 : 0;
    add(node.op() == Op::ifelse ? node.operand(0) : node,
        limited_in(topological(std::vector{node.operand(first), node.operand(first + 1)})));
  }
  for (std::vector<Limited>& list : result) {
    std::sort(list.begin(), list.end(), [](const Limited& a, const Limited& b) { return a.place < b.place; });
    list.erase(std::unique(list.begin(), list.end(),
                           [](const Limited& a, const Limited& b) { return a.node == b.node; }),
               list.end());
  }
  return result;
}

}  // namespace pendula::integrate
