#include "dae/model/piecewise.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/limits/stack.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

constexpr std::size_t most_choices = 3;  // that are expanded: 2³ cases

/// A choice in the equations: the two expressions it can become, and the border.
struct Found {
  Expr node, first, second;
  std::string where_first, where_second;
  Expr margin;  ///< positive where the first one holds, negative where the second one does
};

std::string negated(Expr condition) {
  if (condition.op() == Op::lt) return to_text(condition.operand(0)) + " ≥ " + to_text(condition.operand(1));
  if (condition.op() == Op::le) return to_text(condition.operand(0)) + " > " + to_text(condition.operand(1));
  return "not (" + to_text(condition) + ")";
}

/// Positive where the condition holds.
Expr margin_of(Expr condition) {
  if (!condition.is_constant() && (condition.op() == Op::lt || condition.op() == Op::le))
    return condition.operand(1) - condition.operand(0);
  return ifelse(condition, Expr(1), Expr(-1));
}

std::optional<Found> piece_of(Expr node) {
  if (node.is_constant() || node.is_symbol()) return {};
  const auto x = node.operands();
  const auto order = [&](Expr low, Expr high) { return to_text(low) + " < " + to_text(high); };
  switch (node.op()) {
    case Op::ifelse:
      return Found{node, x[1], x[2], to_text(x[0]), negated(x[0]), margin_of(x[0])};
    case Op::abs:
      return Found{node, x[0], -x[0], to_text(x[0]) + " > 0", to_text(x[0]) + " < 0", x[0]};
    case Op::min:
      return Found{node, x[0], x[1], order(x[0], x[1]), order(x[1], x[0]), x[1] - x[0]};
    case Op::max:
      return Found{node, x[0], x[1], order(x[1], x[0]), order(x[0], x[1]), x[0] - x[1]};
    default:
      return {};
  }
}

/// The w for which √e = |w|: e = v², v⁶, c v². A constant if there is none.
Expr root_of_square(Expr e) {
  check_stack();
  if (e.is_constant() || e.is_symbol()) return {};
  if (e.op() == Op::mul && e.operand(0) == e.operand(1)) return e.operand(0);
  for (const int k : {0, 1})
    if (e.op() == Op::mul && e.operand(k).is_constant() && constant_value(e.operand(k)) > 0) {
      const Expr v = root_of_square(e.operand(1 - k));
      return v.is_constant() ? Expr() : sqrt(e.operand(k)) * v;
    }
  if (e.op() != Op::pow || !e.operand(1).is_constant()) return {};
  const double half = constant_value(e.operand(1)) / 2;
  if (half < 1 || half != std::floor(half) || std::fmod(half, 2) != 1) return {};
  return pow(e.operand(0), Expr(half));
}

/// As piece_of(), for models with other pieces: √(v²) is |v| there.
std::optional<Found> piece_or_root_of(Expr node) {
  if (auto found = piece_of(node)) return found;
  if (node.is_constant() || node.is_symbol() || node.op() != Op::sqrt) return {};
  const Expr v = root_of_square(node.operand(0));
  if (v.is_constant()) return {};
  return Found{node, v, -v, to_text(v) + " > 0", to_text(v) + " < 0", v};
}

/// Has the argument of a root borders that no other equation depends on: |…| with equal slopes on both sides,
/// or max(x, 0) and similar in t, parameters and states?
bool hides_borders(Expr root, const Model& model) {
  bool pieces = false, only_abs = true;
  for (Expr node : topological({&root, 1})) {
    if (!piece_of(node)) continue;
    pieces = true;
    only_abs = only_abs && node.op() == Op::abs;
  }
  const auto is_state = [&](Expr leaf) {
    return std::any_of(model.variables.begin(), model.variables.end(), [&](const Variable& v) {
      return v.leaf == symbol_of(leaf).base && symbol_of(leaf).order < v.order;
    });
  };
  const std::vector<Expr> inside = leaves({&root, 1});
  return pieces && (only_abs || std::all_of(inside.begin(), inside.end(), [&](Expr leaf) {
                      return symbol_of(leaf).kind != Kind::variable || is_state(leaf);
                    }));
}

}  // namespace

bool is_root(Expr e) {
  if (e.op() == Op::sqrt) return true;
  if (e.op() != Op::pow || !e.operand(1).is_constant()) return false;
  const double q = constant_value(e.operand(1));
  return q > 0 && q < 1;
}

bool is_complementarity(Expr residual) {
  if (residual.op() == Op::neg) residual = residual.operand(0);
  return residual.op() == Op::min || residual.op() == Op::max;
}

void Choices::hide_roots() {
  std::vector<Expr> found;
  for (Expr node : topological(model_.residuals))
    if (is_root(node) && hides_borders(node, model_)) found.push_back(node);
  if (found.empty()) return;
  Substitution hidden;
  const auto used = used_names(model_);
  for (Expr root : found) {
    const std::string name = text("root_", hidden.size() + 1);
    const Expr whole = symbol(Kind::variable, fresh_name(used, name, name + "_"));
    hidden[root] = whole;
    roots_[whole] = root;
  }
  for (Expr& residual : model_.residuals) residual = substitute(residual, hidden);
}

Choices::Choices(const Model& model) : model_(model) {
  hide_roots();
  const std::vector<Expr> nodes = topological(model_.residuals);
  if (std::none_of(nodes.begin(), nodes.end(), piece_of)) return;
  for (Expr node : nodes) {
    const auto found = piece_or_root_of(node);
    if (!found) continue;
    const auto written = roots_.empty() ? found : piece_or_root_of(substitute(node, roots_));
    if (!written) continue;
    bool reversed = false;
    const std::size_t choice =
        choice_of(written->margin, written->where_first, written->where_second, reversed);
    if (choice == hidden_margins_.size()) hidden_margins_.push_back(found->margin);
    pieces_.push_back({node, found->first, found->second, choice, reversed});
  }
}

std::size_t Choices::choice_of(Expr margin, const std::string& first, const std::string& second,
                               bool& reversed) {
  const Expr other = -margin;
  for (std::size_t k = 0; k < margins_.size(); ++k) {
    reversed = margins_[k] == other;
    if (reversed || margins_[k] == margin) return k;
  }
  reversed = false;
  margins_.push_back(margin);
  where_.emplace_back(first, second);
  return margins_.size() - 1;
}

std::vector<Expr> Choices::with(std::vector<Expr> e, std::uint64_t choice) const {
  const auto chosen = [&](const Piece& piece) {
    const bool second = (choice >> piece.choice & 1) != 0;
    return second != piece.reversed ? piece.second : piece.first;
  };
  for (std::size_t k = pieces_.size(); k-- > 0;)  // outermost first: choices that it removes need not be made
    e = substitute(e, {{pieces_[k].node, chosen(pieces_[k])}});
  for (const Piece& piece : pieces_)
    e = substitute(e, {{piece.node, chosen(piece)}});  // within the substituted expressions
  return roots_.empty() ? e : substitute(e, roots_);
}

Region Choices::region(std::uint64_t choice) const {
  Region r{"", model_, {}};
  std::vector<std::string> where;
  for (std::size_t k = 0; k < margins_.size(); ++k) {
    const bool second = (choice >> k & 1) != 0;
    where.push_back(second ? where_[k].second : where_[k].first);
    r.margins.push_back(second ? -hidden_margins_[k] : hidden_margins_[k]);
  }
  r.margins = with(std::move(r.margins), choice);
  r.where = join(where, ", ");
  r.model.residuals = with(model_.residuals, choice);
  for (Expr residual : model_.residuals)
    for (const Piece& piece : pieces_)
      if (is_complementarity(residual) && (residual == piece.node || residual == -piece.node)) {
        const bool first = ((choice >> piece.choice & 1) != 0) == piece.reversed;
        const Expr chosen = first ? piece.second : piece.first;
        const Expr other = with({chosen}, choice).front();
        r.margins[piece.choice] = piece.node.op() == Op::min ? other : -other;
      }
  return r;
}

std::uint64_t Choices::active(const std::unordered_map<Expr, double>& values) const {
  std::unordered_map<Expr, double> all = values;
  for (Expr leaf : leaves(margins_))
    if (symbol_of(leaf).kind == Kind::variable) all.try_emplace(leaf, 0.0);
  const std::vector<double> at = pendula::evaluate(margins_, all);
  std::uint64_t choice = 0;
  for (std::size_t k = 0; k < at.size(); ++k)
    if (at[k] < 0) choice |= std::uint64_t{1} << k;
  return choice;
}

Choices::Decided Choices::decided(const std::unordered_map<Expr, double>& values) const {
  constexpr double rounding = 1e-9;  // relative to the terms
  Decided known;
  for (std::size_t k = 0; k < margins_.size(); ++k) {
    const std::vector<Expr> inside = leaves({&margins_[k], 1});
    if (std::any_of(inside.begin(), inside.end(), [&](Expr leaf) { return values.count(leaf) == 0; }))
      continue;
    double size = 0;
    for (Expr leaf : inside) {
      const Expr term = partial(margins_[k], leaf) * leaf;
      size += std::fabs(pendula::evaluate({&term, 1}, values)[0]);
    }
    const double margin = pendula::evaluate({&margins_[k], 1}, values)[0];
    if (!(std::fabs(margin) > rounding * size)) continue;
    known.choices |= std::uint64_t{1} << k;
    if (margin < 0) known.sides |= std::uint64_t{1} << k;
  }
  return known;
}

Substitution resting_signs(const std::vector<Expr>& residuals, const std::vector<Expr>& conditions) {
  Substitution resting;
  for (Expr node : topological(residuals)) {
    if (node.op() != Op::sign) continue;
    const Expr argument = node.operand(0);
    if (std::any_of(conditions.begin(), conditions.end(),
                    [&](Expr c) { return simplify(argument / c).is_constant(); }))
      resting[node] = Expr(0);
  }
  return resting;
}

std::vector<Region> regions(const Model& m) {
  std::vector<Region> list;
  const Choices choices(m);
  if (choices.size() == 0 || choices.size() > most_choices) return list;
  for (std::uint64_t choice = 0; choice < std::uint64_t{1} << choices.size(); ++choice)
    list.push_back(choices.region(choice));
  return list;
}

}  // namespace pendula::dae
