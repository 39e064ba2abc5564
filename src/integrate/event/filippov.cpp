#include "integrate/event/filippov.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "base/error.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/solve.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::integrate {
namespace {

using Values = std::unordered_map<Expr, double>;

bool is_zero_at(Expr e, const Values& at) {
  const double value = evaluate(std::span(&e, 1), at)[0];
  return !std::isfinite(value) || value == 0;
}

/// Time derivatives with the given expressions for x′, and those of z from the equations without x′:
/// 0 = g(t, x, z), z′ = -g_z⁻¹ (g_t + g_x x′).
class Rates {
 public:
  Rates(const dae::FirstOrder& form, const std::vector<Expr>& xdot)
      : form_(form),
        z_(form.z.begin(), form.z.end()),
        constant_(form.p.begin(), form.p.end()),
        xdot_leaves_(form.xdot.begin(), form.xdot.end()) {
    for (std::size_t i = 0; i < form.x.size(); ++i) xdot_[form.x[i]] = xdot[i];
  }

  bool contains_z(Expr e) const { return depends_on_any(e, z_); }
  /// s′; empty if s contains inputs, whose derivatives are unknown, or z that has none.
  std::optional<Expr> operator()(Expr s) {
    std::optional<Expr> result = along_states(s);
    if (!result || !contains_z(s)) return result;
    if (!zdot_) zdot_ = rates_of_z();
    if (zdot_->empty()) return {};
    for (std::size_t j = 0; j < form_.z.size(); ++j) *result += partial(s, form_.z[j]) * (*zdot_)[j];
    return result;
  }

 private:
  std::optional<Expr> along_states(Expr s) const {
    Expr result = partial(s, time_symbol());
    for (Expr leaf : leaves({&s, 1})) {
      if (const auto at = xdot_.find(leaf); at != xdot_.end())
        result += partial(s, leaf) * at->second;
      else if (leaf != time_symbol() && symbol_of(leaf).kind != Kind::constant && !z_.count(leaf) &&
               !constant_.count(leaf))
        return {};
    }
    return result;
  }
  std::vector<Expr> rates_of_z() const {
    std::vector<Expr> g;
    for (Expr row : form_.F)
      if (!depends_on_any(row, xdot_leaves_)) g.push_back(row);
    if (g.size() != form_.z.size()) return {};
    VecX right(static_cast<Eigen::Index>(g.size()));
    for (std::size_t i = 0; i < g.size(); ++i) {
      const std::optional<Expr> slope = along_states(g[i]);
      if (!slope) return {};
      right[i] = -*slope;
    }
    try {
      const VecX solution = linear_solution(sparse_jacobian(g, form_.z), right);
      return {solution.begin(), solution.end()};
    } catch (const Error&) {  // a z that no equation determines
      return {};
    }
  }

  const dae::FirstOrder& form_;
  std::unordered_map<Expr, Expr> xdot_;  ///< by state
  std::unordered_set<Expr> z_, constant_, xdot_leaves_;
  std::optional<std::vector<Expr>> zdot_;
};

/// The equations on the two sides of the border.
class Sides {
 public:
  Sides(const Substitution& above, const Substitution& below) : above_(above), below_(below) {}
  Expr plus(Expr e) const { return substitute(e, above_); }
  /// F₊ - F₋
  Expr jump(Expr e) const { return simplify(plus(e) - substitute(e, below_)); }
  /// (1 - μ) F₊ + μ F₋ with μ = a/b. Where the jump is a constant multiple of b the quotient is cancelled: it
  /// would be 0/0 where a normal force vanishes.
  void combine(std::vector<Expr>& list, Expr a, Expr b) const {
    for (Expr& e : list)
      if (const Expr D = jump(e); D.is_zero())
        e = plus(e);
      else if (const Expr multiple = simplify(D / b); multiple.is_constant())
        e = plus(e) - multiple * a;
      else
        e = plus(e) - a / b * D;
  }

 private:
  const Substitution &above_, &below_;
};

/// μ = a/b
void combine_all(SlidingForm& sliding, const Sides& sides, Expr a, Expr b) {
  for (auto* list : {&sliding.form.F, &sliding.form.f, &sliding.form.g, &sliding.weights})
    sides.combine(*list, a, b);
  for (auto& written : sliding.form.sides) written.reset();
  sliding.weights.push_back(a / b);
}

/// The residual from which μ is eliminated: the one with the simplest jump.
std::optional<std::size_t> eliminated_row(const std::vector<Expr>& F, const Sides& sides, const Values& at) {
  std::optional<std::size_t> best;
  std::size_t fewest = 0;
  for (std::size_t i = 0; i < F.size(); ++i) {
    const Expr D = sides.jump(F[i]);
    if (D.is_zero() || is_zero_at(D, at)) continue;
    const std::size_t size = topological(std::vector{D}).size();
    if (best && size >= fewest) continue;
    best = i;
    fewest = size;
  }
  return best;
}

/// Solves 0 = s for a state that s contains with a constant factor.
Substitution on_border(Expr s, const dae::FirstOrder& form) {
  for (Expr leaf : leaves({&s, 1}))
    if (std::find(form.x.begin(), form.x.end(), leaf) != form.x.end())
      if (const Expr factor = simplify(partial(s, leaf)); factor.is_constant() && !factor.is_zero())
        return {{leaf, simplify(leaf - s / factor)}};
  return {};
}

/// μ from the first of s′, s″ … that jumps on the border; the derivatives before it vanish like s. √|s| has
/// no derivative there: in equations with such a root, the state that s determines is substituted. Returns
/// false if no derivative jumps.
bool slide_by_slope(SlidingForm& sliding, Expr border, const Sides& sides, bool has_root, const Values& at) {
  constexpr int highest = 3;  // derivative: every one is longer than the one before
  Rates rate(sliding.form, sliding.form.f);
  std::vector<Expr> conditions{border};
  const Substitution on = has_root ? on_border(border, sliding.form) : Substitution{};
  if (has_root && on.empty()) return false;
  const auto here = [&](Expr e) { return has_root ? simplify(substitute(e, on)) : e; };
  for (int order = 1; order <= highest; ++order) {
    const auto slope = rate(conditions.back());
    if (!slope) return false;
    const Expr D = here(sides.jump(*slope));
    if (D.is_zero()) {
      conditions.push_back(here(sides.plus(*slope)));
      continue;
    }
    if (is_zero_at(D, at)) return false;
    combine_all(sliding, sides, here(sides.plus(*slope)), D);
    if (has_root)
      for (auto* list : {&sliding.form.F, &sliding.form.f, &sliding.form.g, &sliding.weights})
        for (Expr& e : *list) e = here(e);
    for (Expr condition : conditions)
      if (!rate.contains_z(condition)) sliding.conditions.push_back(condition);
    return true;
  }
  return false;
}

}  // namespace

bool slide_along(SlidingForm& sliding, Expr border, const Substitution& above, const Substitution& below,
                 bool has_root, const std::unordered_map<Expr, double>& at) {
  dae::FirstOrder& form = sliding.form;
  const Sides sides(above, below);
  if (form.semi_explicit && slide_by_slope(sliding, border, sides, has_root, at)) return true;
  if (has_root) return false;
  Rates rate(form, form.xdot);
  const auto slope = rate(border);
  const auto row = eliminated_row(form.F, sides, at);
  if (!row) return false;
  const Expr a = sides.plus(form.F[*row]), b = sides.jump(form.F[*row]);
  form.semi_explicit = false;
  form.f.clear();
  form.g.clear();
  combine_all(sliding, sides, a, b);
  form.F[*row] = slope ? *slope : border;
  if (slope && !rate.contains_z(border)) sliding.conditions.push_back(border);
  return true;
}

}  // namespace pendula::integrate
