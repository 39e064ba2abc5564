#include "dae/model/piecewise.hpp"

#include <algorithm>

#include "base/text.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

constexpr std::size_t most_pieces = 3;

/// A choice that the equations contain: what it becomes and where.
struct Piece {
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

std::optional<Piece> piece_of(Expr node) {
  if (node.is_constant() || node.is_symbol()) return {};
  const auto x = node.operands();
  const auto order = [&](Expr low, Expr high) { return to_text(low) + " < " + to_text(high); };
  switch (node.op()) {
    case Op::ifelse:
      return Piece{node, x[1], x[2], to_text(x[0]), negated(x[0]), margin_of(x[0])};
    case Op::abs:
      return Piece{node, x[0], -x[0], to_text(x[0]) + " > 0", to_text(x[0]) + " < 0", x[0]};
    case Op::min:
      return Piece{node, x[0], x[1], order(x[0], x[1]), order(x[1], x[0]), x[1] - x[0]};
    case Op::max:
      return Piece{node, x[0], x[1], order(x[1], x[0]), order(x[0], x[1]), x[0] - x[1]};
    default:
      return {};
  }
}

std::vector<Expr> with_choice(std::vector<Expr> e, const std::vector<Piece>& pieces, unsigned choice) {
  for (std::size_t k = pieces.size();
       k-- > 0;) {  // the outermost first: what it leaves out need not be chosen
    const Expr chosen = choice >> k & 1 ? pieces[k].second : pieces[k].first;
    e = substitute(e, {{pieces[k].node, chosen}});
  }
  for (std::size_t k = 0; k < pieces.size(); ++k)  // and inside what was put in
    e = substitute(e, {{pieces[k].node, choice >> k & 1 ? pieces[k].second : pieces[k].first}});
  return e;
}

}  // namespace

std::vector<Region> regions(const Model& m) {
  std::vector<Piece> pieces;
  for (Expr node : topological(m.residuals)) {
    if (auto piece = piece_of(node)) pieces.push_back(std::move(*piece));
    if (pieces.size() > most_pieces) return {};
  }
  std::vector<Region> list;
  if (pieces.empty()) return list;
  for (unsigned choice = 0; choice < 1u << pieces.size(); ++choice) {
    Region r{"", m, {}};
    std::vector<std::string> where;
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      const bool second = choice >> k & 1;
      where.push_back(second ? pieces[k].where_second : pieces[k].where_first);
      r.margins.push_back(second ? -pieces[k].margin : pieces[k].margin);
    }
    r.where = join(where, ", ");
    r.model.residuals = with_choice(m.residuals, pieces, choice);
    list.push_back(std::move(r));
  }
  return list;
}

}  // namespace pendula::dae
