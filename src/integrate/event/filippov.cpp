#include "integrate/event/filippov.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <unordered_set>

#include "base/error.hpp"
#include "base/limits/stack.hpp"
#include "dae/structure/blocks.hpp"
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

/// Time derivatives with the given expressions for x′, and those of z from the equations that determine
/// them: 0 = g(t, x, z), z′ = -g_z⁻¹ (g_t + g_x x′), block by block, so that other z may follow from x′ or
/// from hidden constraints (index 2). x′ in such an equation is replaced by its own row, x′ = f.
class Rates {
 public:
  /// modes: leaves that jump on the border.
  Rates(const dae::FirstOrder& form, const std::vector<Expr>& xdot, const std::unordered_set<Expr>& modes)
      : z_(form.z.begin(), form.z.end()),
        modes_(modes),
        constant_(form.p.begin(), form.p.end()),
        xdot_leaves_(form.xdot.begin(), form.xdot.end()) {
    for (std::size_t i = 0; i < form.x.size(); ++i) xdot_[form.x[i]] = xdot[i];
    rows_ = rows_without_slopes(form);
    blocks_of(rows_, form.z, determined_);
    std::vector<Expr> smooth;
    std::copy_if(rows_.begin(), rows_.end(), std::back_inserter(smooth),
                 [&](Expr row) { return !depends_on_any(row, modes_); });
    std::unordered_map<Expr, Place> settled;
    blocks_of(smooth, form.z, settled);
    for (const auto& [leaf, place] : settled) settled_.insert(leaf);
  }

  bool contains_z(Expr e) const { return depends_on_any(e, z_); }
  /// May it differ on the two sides: does it contain modes, x′, or z that follow from these?
  bool may_jump(Expr e) const {
    const auto inside = leaves({&e, 1});
    return std::any_of(inside.begin(), inside.end(), [&](Expr leaf) {
      return modes_.count(leaf) || xdot_leaves_.count(leaf) || (z_.count(leaf) && !settled_.count(leaf));
    });
  }
  /// s′; empty if s contains inputs, whose derivatives are unknown, or z that has none.
  std::optional<Expr> operator()(Expr s) {
    std::optional<Expr> result = along_states(s);
    for (Expr leaf : leaves({&s, 1})) {
      if (!result) break;
      if (!z_.count(leaf)) continue;
      if (!find_rate(leaf)) return {};
      *result += partial(s, leaf) * zdot_.at(leaf);
    }
    return result;
  }

 private:
  /// Equations that determine some z together, and these.
  struct Block {
    std::vector<Expr> rows, z;
  };
  using Place = std::shared_ptr<const Block>;

  /// The rows in which x′ does not occur, or can be replaced.
  std::vector<Expr> rows_without_slopes(const dae::FirstOrder& form) const {
    Substitution slopes;
    std::unordered_set<std::size_t> used;
    for (std::size_t i = 0; i < form.F.size(); ++i)
      if (const auto solved = solved_for_slope(form.F[i]); solved && slopes.emplace(*solved).second)
        used.insert(i);
    std::vector<Expr> list;
    for (std::size_t i = 0; i < form.F.size(); ++i) {
      const Expr row = used.count(i) ? Expr() : substitute(form.F[i], slopes);
      if (!row.is_constant() && !depends_on_any(row, xdot_leaves_)) list.push_back(row);
    }
    return list;
  }
  /// x′ and f of a row c (x′ - f) with a number c.
  std::optional<std::pair<Expr, Expr>> solved_for_slope(Expr row) const {
    std::optional<Expr> slope;
    for (Expr leaf : leaves({&row, 1})) {
      if (!xdot_leaves_.count(leaf)) continue;
      if (slope) return {};
      slope = leaf;
    }
    if (!slope) return {};
    const Expr factor = partial(row, *slope);
    if (!factor.is_constant() || factor.is_zero()) return {};
    return std::pair(*slope, -substitute(row, {{*slope, Expr(0)}}) / factor);
  }
  static void blocks_of(const std::vector<Expr>& rows, const std::vector<Expr>& z,
                        std::unordered_map<Expr, Place>& places) {
    std::unordered_map<Expr, int> column;
    for (Expr leaf : z) column.emplace(leaf, static_cast<int>(column.size()));
    dae::Pattern pattern;
    for (Expr row : rows) {
      pattern.emplace_back();
      for (Expr leaf : leaves({&row, 1}))
        if (const auto at = column.find(leaf); at != column.end()) pattern.back().push_back(at->second);
    }
    for (const dae::Part& part : dae::dulmage_mendelsohn(pattern, static_cast<int>(z.size())).square) {
      Block block;
      for (int i : part.rows) block.rows.push_back(rows[i]);
      for (int j : part.columns) block.z.push_back(z[j]);
      const auto shared = std::make_shared<const Block>(std::move(block));
      for (Expr leaf : shared->z) places[leaf] = shared;
    }
  }

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
  /// z′ of one z and of those before it; false if there is none.
  bool find_rate(Expr leaf) {
    check_stack();
    if (zdot_.count(leaf)) return true;
    const auto at = determined_.find(leaf);
    if (at == determined_.end()) return false;
    const Block& block = *at->second;
    const std::unordered_set<Expr> own(block.z.begin(), block.z.end());
    VecX right(static_cast<Eigen::Index>(block.rows.size()));
    for (std::size_t i = 0; i < block.rows.size(); ++i) {
      std::optional<Expr> slope = along_states(block.rows[i]);
      if (!slope) return false;
      for (Expr other : leaves({&block.rows[i], 1})) {
        if (!z_.count(other) || own.count(other)) continue;
        if (!find_rate(other)) return false;
        *slope += partial(block.rows[i], other) * zdot_.at(other);
      }
      right[i] = -*slope;
    }
    try {
      const VecX solution = linear_solution(sparse_jacobian(block.rows, block.z), right);
      for (std::size_t j = 0; j < block.z.size(); ++j) zdot_.emplace(block.z[j], solution[j]);
      return true;
    } catch (const Error&) {  // singular
      return false;
    }
  }

  std::unordered_map<Expr, Expr> xdot_;  ///< by state
  std::unordered_set<Expr> z_, modes_, constant_, xdot_leaves_;
  std::vector<Expr> rows_;
  std::unordered_map<Expr, Place> determined_;  ///< by z
  std::unordered_set<Expr> settled_;            ///< z that are the same on both sides
  std::unordered_map<Expr, Expr> zdot_;         ///< of those that were asked for
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

constexpr int highest = 3;  // derivative of s: every one is longer than the one before

/// μ from the first of s′, s″ … that jumps on the border; the derivatives before it vanish like s. √|s| has
/// no derivative there: in equations with such a root, the state that s determines is substituted. Returns
/// false if no derivative jumps.
bool slide_by_slope(SlidingForm& sliding, Expr border, const Sides& sides,
                    const std::unordered_set<Expr>& modes, bool has_root, const Values& at) {
  Rates rate(sliding.form, sliding.form.f, modes);
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
      if (rate.may_jump(conditions.back())) return false;  // with z, which the sides determine
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
  std::unordered_set<Expr> modes;
  for (const auto& [mode, value] : above) modes.insert(mode);
  if (form.semi_explicit && slide_by_slope(sliding, border, sides, modes, has_root, at)) return true;
  if (has_root) return false;
  Rates rate(form, form.xdot, modes);
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
