#include "dae/reduce/rank_reason.hpp"

#include <algorithm>
#include <set>
#include <unordered_set>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/analysis/determinant_factors.hpp"
#include "dae/model/derivation_markup.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/solved_rows.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/polynomial/rational_form.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

constexpr std::size_t most_variables = 40;  // of a model that is explained: ranks at several points
constexpr Index largest_shown = 3;          // size up to which a matrix is shown with its determinant
constexpr int widest_shown = 140;           // characters of an explanatory formula
constexpr double longest_node = 400;        // nodes up to which a formula is simplified

bool is_variable(Expr leaf) { return symbol_of(leaf).kind == Kind::variable; }

bool has_variables(Expr e) {
  const auto inside = leaves({&e, 1});
  return std::any_of(inside.begin(), inside.end(), is_variable);
}

Expr readable_entry(Expr e) { return is_short(e, longest_node) ? simplify(e) : e; }

bool is_readable(Expr e) { return is_short(e, longest_node) && display_width(to_text(e)) <= widest_shown; }

/// The unknowns left after rows x′ = f are substituted into the others.
struct Remainder {
  explicit Remainder(const Model& m) : model(m) {
    const auto top = m.top_derivatives(), z = m.algebraic();
    const std::unordered_set<Expr> derivatives(top.begin(), top.end());
    std::set<std::size_t> used;
    for (const Solved& row : solved_rows(m)) {
      if (depends_on_any(row.f, derivatives) || has_variables(row.slope)) continue;
      known[row.derivative] = row.f;
      used.insert(row.residual);
      direct.push_back(row.derivative);
    }
    for (Expr x : top)
      if (!known.count(x)) unknowns.push_back(x);
    unknowns.insert(unknowns.end(), z.begin(), z.end());
    for (std::size_t i = 0; i < m.residuals.size(); ++i) {
      auto& labels = used.count(i) ? solved_labels : labels_left;
      const std::string label = text("(", m.origin[i].first + 1, ")");
      if (labels.empty() || labels.back() != label) labels.push_back(label);
      if (!used.count(i)) rows.push_back(substitute(m.residuals[i], known));
    }
  }

  bool is_small() const {
    return !unknowns.empty() && static_cast<Index>(unknowns.size()) <= largest_shown &&
           rows.size() == unknowns.size();
  }

  const Model& model;
  Substitution known;
  std::vector<Expr> direct, unknowns, rows;
  std::vector<std::string> solved_labels, labels_left;
};

/// "p² ≠ 0 and m ≠ 0", with the values that the constraints imply.
std::string conditions(Expr determinant, const Model& m) {
  std::vector<std::string> words;
  for (Expr factor : vanishing_factors(determinant)) {
    if (!has_variables(factor)) continue;
    const Expr value = on_constraints(factor, m.invariants);
    words.push_back(value == factor
                        ? text(formula(ref(factor), " ≠ 0"))
                        : text(formula(ref(factor), " = ", ref(value), " ≠ 0"), " by the constraints"));
  }
  return join(words, " and ");
}

/// b of A w = b: the rows at w = 0.
VecX right_side(const Remainder& r) {
  Substitution none;
  for (Expr w : r.unknowns) none[w] = Expr(0);
  return -column(substitute(r.rows, none));
}

/// Substitutes a constraint that is linear in a variable, with a constant coefficient, if that makes e
/// shorter: C_A = C_B/K_eq.
Expr shorter_on_constraints(Expr e, const std::vector<Constraint>& constraints) {
  for (const Constraint& c : constraints)
    for (Expr x : leaves({&c.residual, 1})) {
      if (!is_variable(x) || !depends_on(e, x) || !is_short(c.residual, longest_node)) continue;
      const Expr slope = simplify(partial(c.residual, x));
      if (slope.is_zero() || has_variables(slope)) continue;
      const Expr other = readable_entry(substitute(e, {{x, x - c.residual / slope}}));
      if (to_text(other).size() < to_text(e).size()) e = other;
    }
  return e;
}

/// (m p′ᵀp′ + uᵀp)/L² if that is shorter than m (p′ᵀp′ + uᵀp/m)/L².
Expr over_one_denominator(Expr e) {
  if (!is_short(e, longest_node)) return e;
  try {
    const Quotient q = quotient_of(e);
    const Expr other = q.numerator / q.denominator;
    return display_width(to_text(other)) < display_width(to_text(e)) ? other : e;
  } catch (const Error&) {  // too long, or with decimals
    return e;
  }
}

void add_solution(const Remainder& r, const MatX& A, std::vector<std::string>& lines) {
  const VecX b = right_side(r).unaryExpr(&readable_entry);
  if (std::any_of(b.begin(), b.end(), [](Expr e) { return !is_short(e, longest_node); })) {
    lines.push_back(shown_from(Detail::every, "     " + formula("b = ", ref(b))));
    return;
  }
  const VecX unknowns = column(r.unknowns);
  const MatX there = A.unaryExpr([&](Expr e) { return on_constraints(e, r.model.invariants); });
  const MatX solution = linalg::solve(there, b);
  bool by_constraints = there != A;
  Substitution values;
  for (Index i = 0; i < b.size(); ++i) {
    const Expr exact = readable_entry(solution(i, 0));
    const Expr on_them = shorter_on_constraints(exact, r.model.invariants), w = over_one_denominator(on_them);
    by_constraints = by_constraints || on_them != exact;
    if (!is_readable(w)) break;
    values[unknowns[i]] = w;
  }
  if (static_cast<Index>(values.size()) < b.size()) {
    lines.push_back(shown_from(Detail::every, "     " + formula("b = ", ref(b))));
    return;
  }
  for (Index i = 0; i < b.size(); ++i)
    lines.push_back(
        shown_from(Detail::full, text(i == 0 ? "     so that  " : "              ",
                                      formula(ref(unknowns[i]), " = ", ref(values.at(unknowns[i]))),
                                      by_constraints ? "  on the constraints" : "")));
  for (Expr x : r.direct) {
    const Expr f = readable_entry(substitute(r.known.at(x), values));
    if (is_readable(f)) lines.push_back(shown_from(Detail::every, "     " + formula(ref(x), " = ", ref(f))));
  }
}

void add_mechanics(const Model& m, std::vector<std::string>& lines) {
  if (!m.mechanics || m.mechanics->C.size() == 0) return;
  // the rows for z of least norm are included
  if (m.blocks.back().rhs.size() < m.mechanics->C.size()) return;
  lines.push_back(shown_from(Detail::full,
                             text("     It is  ", formula("[W Cqᵀ; Cq 0]"), "  with  ", formula("Cq = ∂C/∂q"),
                                  ": regular where ", formula("W > 0"), " on ker ", formula("Cq"))));
  lines.push_back(shown_from(Detail::full, text("     (every motion has kinetic energy) and ", formula("Cq"),
                                                " has full row rank; it fails where")));
  lines.push_back(shown_from(Detail::full, "     the gradients of the constraints become dependent."));
}

}  // namespace

Expr on_constraints(Expr e, const std::vector<Constraint>& constraints) {
  if (!has_variables(e) || !is_short(e, longest_node)) return e;
  for (const Constraint& c : constraints) {
    if (!is_short(c.residual, longest_node)) continue;
    for (Expr x : leaves({&c.residual, 1})) {
      if (!is_variable(x)) continue;
      const Expr slope = simplify(partial(c.residual, x));
      if (slope.is_zero()) continue;
      const Expr k = simplify(partial(e, x) / slope);
      if (k.is_zero() || has_variables(k)) break;
      const Expr value = simplify(expand(e - k * c.residual));
      if (!has_variables(value)) return value;
      break;
    }
  }
  return e;
}

std::vector<std::string> rank_reason(const Model& low) {
  std::vector<std::string> lines;
  if (low.variables.size() > most_variables) return lines;
  add_mechanics(low, lines);
  Remainder r(low);
  if (!r.is_small()) return lines;
  const auto n = static_cast<Index>(r.unknowns.size());
  MatX A = jacobian(r.rows, r.unknowns).unaryExpr(&readable_entry);
  if (n == 1 && to_text(A(0, 0)).starts_with("-")) {  // a single equation may change its sign
    r.rows[0] = -r.rows[0];
    A(0, 0) = readable_entry(-A(0, 0));
  }
  const std::unordered_set<Expr> unknown(r.unknowns.begin(), r.unknowns.end());
  if (std::any_of(A.reshaped().begin(), A.reshaped().end(),
                  [&](Expr e) { return depends_on_any(e, unknown) || !is_readable(e); }))
    return lines;
  if (!r.direct.empty())
    lines.push_back(shown_from(
        Detail::full,
        text("     ", join(r.solved_labels, ", "), r.solved_labels.size() == 1 ? " gives " : " give ",
             grouped_names(r.direct), " directly; substituting into ", join(r.labels_left, ", "), " leaves  ",
             n == 1 ? formula("A ", ref(r.unknowns[0]), " = b")
                    : formula("A w = b, w = ", ref(column(r.unknowns))),
             "  with")));
  lines.push_back(
      shown_from(Detail::full, "     " + (n == 1 ? formula("A = ", ref(A(0, 0))) : formula("A = ", ref(A)))));
  const Expr determinant = readable_entry(linalg::determinant(A));
  if (is_readable(determinant)) {
    if (n > 1) lines.push_back(shown_from(Detail::full, "     " + formula("det A = ", ref(determinant))));
    const std::string where = conditions(determinant, low);
    if (!where.empty())
      lines.push_back(
          shown_from(Detail::full, text("     ", formula("A"), " is regular where  ", where, ".")));
  }
  add_solution(r, A, lines);
  return lines;
}

}  // namespace pendula::dae
