#include "dae/model/linear_systems.hpp"

#include <algorithm>

#include "base/text.hpp"
#include "dae/model/derivation_markup.hpp"
#include "expr/graph/solve.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/one_fraction.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

/// Component of a solution -> the eliminated unknown that it equals.
Substitution names_of_components(const Model& m) {
  Substitution names;
  for (const auto& [leaf, meaning] : m.relations)
    if (meaning.op() == Op::solve && symbol_of(leaf).order == 0) names[meaning] = leaf;
  return names;
}

/// A linear system with the names of its components: eliminated unknowns, or derivatives on the left
/// of an equation.
struct NamedSystem {
  Expr head;
  VecX unknowns;
  bool complete = true;  ///< every component has a name
};

std::vector<NamedSystem> named_systems(const Model& m, Substitution names) {
  for (const Block& b : m.blocks)
    for (Index i = 0; i < b.rhs.size(); ++i)
      if (b.rhs[i].op() == Op::solve) names.try_emplace(b.rhs[i], b.lhs[i]);
  std::vector<NamedSystem> systems;
  for (const auto& [part, name] : names) {
    const Expr head = head_of(part);
    auto at = std::find_if(systems.begin(), systems.end(), [&](const auto& s) { return s.head == head; });
    if (at == systems.end())
      at = systems.insert(systems.end(), {head, VecX::Zero(system_of(head).size), true});
    at->unknowns[component_of(part)] = name;
  }
  for (NamedSystem& s : systems)
    s.complete = std::none_of(s.unknowns.begin(), s.unknowns.end(), [](Expr e) { return e.is_zero(); });
  std::sort(systems.begin(), systems.end(),
            [](const auto& a, const auto& b) { return a.head.id() < b.head.id(); });
  return systems;
}

Expr readable(Expr e) { return is_short(e, 400) ? simplify(e) : e; }

MatX matrix_of(const LinearSystem& s) {
  MatX A = MatX::Zero(s.size, s.size);
  for (std::size_t k = 0; k < s.entries(); ++k)
    A(s.places[k].first, s.places[k].second) = readable(s.operands[k]);
  return A;
}

bool fits(const std::string& line) {
  constexpr int widest = 160;  // columns of a terminal
  const std::string shown = rendered(line);
  for (std::size_t i = 0, end = 0; end != std::string::npos; i = end + 1) {
    end = shown.find('\n', i);
    if (display_width(shown.substr(i, end == std::string::npos ? end : end - i)) > widest) return false;
  }
  return true;
}

/// "so that x = …, y = …" if the formulas are short.
std::string solution_line(const VecX& unknowns, const LinearSystem& s) {
  constexpr int largest = 3, widest = 100;  // unknowns; columns of a terminal
  constexpr double short_entry = 30;        // nodes
  if (s.size > largest ||
      !std::all_of(s.operands.begin(), s.operands.end(), [](Expr e) { return is_short(e, short_entry); }))
    return "";
  VecX b(s.size);
  for (int i = 0; i < s.size; ++i) b[i] = s.b(i);
  const VecX x =
      linalg::solve(matrix_of(s), b).col(0).unaryExpr([](Expr e) { return one_fraction(simplify(e)); });
  std::vector<std::string> parts;
  for (Index i = 0; i < x.size(); ++i) parts.push_back(formula(ref(unknowns[i]), " = ", ref(x[i])));
  const std::string line = "so that  " + join(parts, ",  ");
  return display_width(rendered(line)) <= widest ? line : "";
}

}  // namespace

std::vector<Block> blocks_with_names(const Model& m) {
  std::vector<Block> blocks = m.blocks;
  const Substitution names = names_of_components(m);
  if (names.empty()) return blocks;
  std::vector<Expr*> places;  // together, since the rows of a chain share one system
  for (Block& b : blocks)
    for (Expr& e : b.rhs)
      if (e.op() != Op::solve) places.push_back(&e);
  std::vector<Expr> sides(places.size());
  std::transform(places.begin(), places.end(), sides.begin(), [](const Expr* e) { return *e; });
  sides = substitute(sides, names);
  for (std::size_t i = 0; i < places.size(); ++i) *places[i] = sides[i];
  return blocks;
}

std::vector<std::string> linear_system_lines(const Model& m) {
  constexpr int largest = 8;  // rows that a screen shows beside other lines
  std::vector<std::string> lines;
  for (const NamedSystem& s : named_systems(m, names_of_components(m))) {
    if (!s.complete) continue;
    const LinearSystem& system = system_of(s.head);
    const std::string equation = formula("A ", ref(s.unknowns), " = b");
    const std::string size = text(system.size, " equations, solved at every evaluation");
    std::vector<std::string> parts;
    if (system.size <= largest) {
      VecX b(system.size);
      for (int i = 0; i < system.size; ++i) b[i] = readable(system.b(i));
      parts = {"  " + formula("A = ", ref(matrix_of(system))), "  " + formula("b = ", ref(b))};
      if (!std::all_of(parts.begin(), parts.end(), fits)) parts[1] = "  " + formula("b = ", ref(MatX(b)));
    }
    const bool shown = !parts.empty() && std::all_of(parts.begin(), parts.end(), fits);
    lines.push_back("where " + equation + (shown ? " with" : ", " + size));
    if (shown) lines.insert(lines.end(), parts.begin(), parts.end());
    const std::string solved = shown ? solution_line(s.unknowns, system) : "";
    if (!solved.empty()) lines.push_back(solved);
  }
  return lines;
}

}  // namespace pendula::dae
