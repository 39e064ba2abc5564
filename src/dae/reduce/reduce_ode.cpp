// Form "ode": accelerations and multipliers from a linear solve, so that x′ = f(t, x) is explicit.
#include <algorithm>
#include <iterator>
#include <unordered_set>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/derivation_markup.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/model/solved_rows.hpp"
#include "dae/rank/definite.hpp"
#include "dae/rank/rank.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "dae/reduce/saddle_point.hpp"
#include "dae/regularise/elimination.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/graph/solve.hpp"
#include "expr/graph/switched_by.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/one_fraction.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {
namespace {

/// Simplified if it is short enough to read; for long expressions that would dominate the reduction.
Expr readable(Expr e) { return is_short(e, 60) ? one_fraction(simplify(e)) : e; }

using Index = Eigen::Index;

/// Does a coefficient vanish at the parameter values, like a mass of 0, so that it must not be a divisor?
bool vanishes(Expr slope, const Model& m) {
  std::unordered_map<Expr, double> values;
  for (Expr leaf : leaves({&slope, 1})) {
    if (symbol_of(leaf).kind == Kind::constant) continue;
    const auto it = m.values.find(leaf);
    if (it == m.values.end()) return false;
    values[leaf] = pendula::evaluate({&it->second, 1}, {})[0];
  }
  return pendula::evaluate({&slope, 1}, values)[0] == 0;
}

/// Eliminates all top derivatives and algebraic variables of an index-1 model.
class Elimination {
 public:
  explicit Elimination(const Model& low) : m_(low) {
    const auto top = m_.top_derivatives(), z = m_.algebraic();
    top_.insert(top.begin(), top.end());
    take_explicit_rows();
    for (Expr leaf : top)
      if (!solved.count(leaf)) unknowns.push_back(leaf);
    unknowns.insert(unknowns.end(), z.begin(), z.end());
    if (!unknowns.empty()) solve_rest();
  }

  Substitution solved;         ///< top derivative or algebraic variable -> expression in states
  std::vector<Expr> unknowns;  ///< of the linear system
  std::vector<Entry> A;
  VecX b;
  bool definite = false;          ///< A needs no pivoting
  bool by_mass_matrix = false;    ///< w by the mass matrix first, if no pivot is small
  bool expanded = false;          ///< A consists of numbers, and w is written out
  std::vector<std::size_t> rows;  ///< residuals that make the system

 private:
  /// Takes rows that are solved for x′ = f(x, z), each with a nonvanishing constant coefficient.
  void take_explicit_rows() {
    std::unordered_set<std::size_t> used;
    for (const Solved& row : solved_rows(m_)) {
      const Expr slope = partial(m_.residuals[row.residual], row.derivative);
      if (depends_on_any(row.f, top_) || varies(slope) || vanishes(slope, m_)) continue;
      solved[row.derivative] = row.f;
      used.insert(row.residual);
    }
    for (std::size_t i = 0; i < m_.residuals.size(); ++i)
      if (!used.count(i)) rows.push_back(i);
  }

  /// Writes unknowns that switch branches into them, where rows define them by states, one after the other:
  /// w = h(x) in sign(w). Slopes of a sign are 0, so that a linear system would not contain it. Returns the
  /// unknowns taken.
  Substitution take_switching_unknowns(std::vector<Expr>& rest) {
    Substitution taken;
    for (bool again = true; again;) {
      again = false;
      const std::unordered_set<Expr> all(unknowns.begin(), unknowns.end());
      if (std::none_of(rest.begin(), rest.end(), [&](Expr row) { return is_switched_by(row, all); })) break;
      for (std::size_t i = 0; i < rest.size() && !again; ++i) {
        const std::vector<Expr> inside = leaves({&rest[i], 1});
        std::vector<Expr> own;
        std::copy_if(inside.begin(), inside.end(), std::back_inserter(own),
                     [&](Expr leaf) { return all.count(leaf) > 0; });
        if (own.size() != 1 || is_switched_by(rest[i], all)) continue;
        const Expr w = own[0], slope = partial(rest[i], w);
        if (varies(slope) || vanishes(slope, m_)) continue;
        taken[w] = -substitute(rest[i], {{w, Expr(0)}}) / slope;
        const auto place = static_cast<std::ptrdiff_t>(i);
        rest.erase(rest.begin() + place);
        rows.erase(rows.begin() + place);
        std::erase(unknowns, w);
        for (Expr& row : rest) row = substitute(row, taken);
        again = true;
      }
    }
    const std::unordered_set<Expr> left(unknowns.begin(), unknowns.end());
    for (std::size_t i = 0; i < rest.size(); ++i)
      if (is_switched_by(rest[i], left)) refuse_row(rows[i], grouped_names(unknowns));
    return taken;
  }

  void solve_rest() {
    PENDULA_ASSERT(rows.size() == unknowns.size(), "an index-1 model that is not square");
    std::vector<Expr> rest;
    for (std::size_t i : rows) rest.push_back(substitute(m_.residuals[i], solved));
    Substitution values = take_switching_unknowns(rest);
    if (!unknowns.empty()) solve_linear(rest, values);
    for (auto& [leaf, f] : solved) f = expanded ? tidied(substitute(f, values)) : substitute(f, values);
    solved.insert(values.begin(), values.end());
  }

  void solve_linear(const std::vector<Expr>& rest, Substitution& values) {
    const auto n = static_cast<Index>(unknowns.size());
    const auto tidy = [&](Expr e) { return n <= 12 ? readable(e) : e; };
    A = sparse_jacobian(rest, unknowns);
    for (Entry& e : A) e.value = tidy(e.value);
    check_linear();
    definite = n > 1 && is_definite(static_cast<int>(n), A, parameter_numbers());
    Substitution zero;
    for (Expr w : unknowns) zero[w] = Expr(0);
    b = -column(substitute(rest, zero)).unaryExpr(tidy);
    const VecX w = is_short_and_rational(n) ? exact_solution(n)
                   : is_small(n)            ? written_solution(n)
                                            : numeric_solution();
    for (Index j = 0; j < n; ++j) values[unknowns[j]] = w[j];
  }

  /// A short matrix of rationals, which is inverted immediately: x₁′ = x₁/2 instead of (A⁻¹b)₁.
  bool is_short_and_rational(Index n) const {
    constexpr Index readable_system = 6;
    return n <= readable_system &&
           std::all_of(A.begin(), A.end(), [](const Entry& e) { return exact_value(e.value) != nullptr; });
  }

  /// A few unknowns with short coefficients, or a short chain of them, for which a reader expects a formula.
  bool is_small(Index n) const {
    constexpr Index few = 3, short_chain = 6;
    const bool chain = n <= short_chain && A.size() <= 3 * static_cast<std::size_t>(n);
    return (n <= few || chain) &&
           std::all_of(A.begin(), A.end(), [](const Entry& e) { return is_short(e.value, 60); });
  }

  /// The solution written out if it stays readable. A matrix that varies along a solution must be definite,
  /// like mass matrices and Cq W⁻¹ Cqᵀ; any other needs pivoting.
  VecX written_solution(Index n) {
    constexpr int widest = 400;  // characters
    const bool moving = std::any_of(A.begin(), A.end(), [](const Entry& e) { return varies(e.value); });
    const bool mass_matrix = m_.mechanics && m_.mechanics->C.size() == 0;
    if (moving && (n > 2 || !(mass_matrix || definite))) return numeric_solution();
    const VecX w = exact_solution(n);
    expanded = std::all_of(w.begin(), w.end(), [&](Expr e) {
      return is_short(e, 300) && (!moving || display_width(to_text(e)) <= widest);
    });
    return expanded ? w : numeric_solution();
  }

  /// A solution that is computed numerically at every evaluation. The multipliers of a mechanism
  /// follow its accelerations.
  VecX numeric_solution() {
    constexpr int worth_it = 4;
    if (!definite && b.size() >= worth_it) {
      const auto multipliers = static_cast<int>(m_.algebraic().size());
      if (const auto w = saddle_point_solution(A, b, multipliers, parameter_numbers())) {
        by_mass_matrix = true;
        return *w;
      }
    }
    return linear_solution(A, b, definite);
  }

  static Expr tidied(Expr e) { return is_short(e, 400) ? one_fraction(simplify(e)) : e; }

  VecX exact_solution(Index n) {
    MatX matrix = MatX::Zero(n, n);
    for (const Entry& a : A) matrix(a.row, a.column) = a.value;
    expanded = true;
    return linalg::solve(matrix, b).col(0).unaryExpr([](Expr e) { return one_fraction(simplify(e)); });
  }

  void check_linear() const {
    const std::unordered_set<Expr> set(unknowns.begin(), unknowns.end());
    for (const Entry& e : A) {
      if (depends_on_any(e.value, set)) refuse_row(rows[e.row], to_text(unknowns[e.column]));
    }
  }

  [[noreturn]] void refuse_row(std::size_t row, const std::string& unknown) const {
    throw Error(text("form \"ode\": equation ", m_.label(row), "  ", m_.equation_text(row),
                     " is not linear in ", unknown,
                     ", so it cannot be solved for it by a linear solve. Use reduce \"acc\" (index 1), "
                     "which is solved by Newton's method in every step"));
  }

  std::unordered_map<Expr, double> parameter_numbers() const {
    std::unordered_map<Expr, double> numbers;
    for (const auto& [p, value] : m_.values) numbers[p] = pendula::evaluate({&value, 1}, {})[0];
    return numbers;
  }

  const Model& m_;
  std::unordered_set<Expr> top_;
};

std::vector<std::string> derivation(const Elimination& e, const Model& low) {
  std::vector<std::string> lines, labels;
  for (std::size_t i : e.rows)
    if (labels.empty() || labels.back() != text("(", low.origin[i].first + 1, ")"))
      labels.push_back(text("(", low.origin[i].first + 1, ")"));
  if (e.unknowns.empty()) {
    lines.push_back("ode: every derivative has a row of its own; there is nothing to eliminate.");
    return lines;
  }
  if (e.unknowns.size() < low.top_derivatives().size() + low.algebraic().size())
    lines.push_back(
        text("ode: substitute the rows that are solved for a derivative into ", join(labels, ", "), "."));
  const bool one = e.unknowns.size() == 1;
  lines.push_back(text("ode: ", join(labels, ", "), labels.size() == 1 ? " is" : " are", " linear in ",
                       one ? formula(ref(e.unknowns[0]), ":  A ", ref(e.unknowns[0]), " = b")
                           : text(formula("w = ", ref(column(e.unknowns))), ":  ", formula("A w = b"))));
  constexpr Index widest = 8;
  if (e.b.size() <= widest) {
    MatX A = MatX::Zero(e.b.size(), e.b.size());
    for (const Entry& a : e.A) A(a.row, a.column) = is_short(a.value, 400) ? simplify(a.value) : a.value;
    lines.push_back("     " + formula("A = ", one ? ref(A(0, 0)) : ref(A)));
    lines.push_back("     " + formula("b = ", ref(e.b)));
  }
  if (e.expanded && e.unknowns.size() > 1)
    lines.push_back("     w = A⁻¹ b is written out.");
  else if (e.unknowns.size() > 1)
    lines.push_back(text(
        "     A w = b is solved numerically at every evaluation (",
        e.definite ? "A is symmetric and definite: L D Lᵀ"
        : e.by_mass_matrix
            ? "W, its symmetric and definite part, first, then Cq W⁻¹ Cqᵀ: L D Lᵀ; LU with pivoting where a pivot is small"
            : "LU with pivoting",
        "); the formula of w is not written out."));
  return lines;
}

/// "The multiplier is eliminated: z = …", short values written out.
std::vector<std::string> eliminated_variables(const Model& low, const Substitution& values) {
  constexpr int widest = 160;  // columns of a terminal
  const auto list = low.algebraic();
  if (list.empty()) return {};
  const bool one = list.size() == 1;
  const bool multipliers = low.mechanics && list.size() == static_cast<std::size_t>(low.mechanics->C.size());
  std::vector<std::string> lines{
      text("     ", multipliers ? one ? "The multiplier " : "The multipliers " : "", grouped_names(list),
           one ? " is eliminated" : " are eliminated", "; ", one ? "its value" : "their values",
           " along a solution: sol(", to_text(list[0]), ").")};
  for (Expr leaf : list) {
    const Expr value = readable(values.at(leaf));
    if (value.op() == Op::solve) continue;  // a component of w, which was written above
    if (is_short(value, 400) && display_width(to_text(value)) <= widest)
      lines.push_back("     " + formula(ref(leaf), " = ", ref(value)));
  }
  return lines;
}

/// Is every row already x′ = f, or with a factor of x′ that may pass through 0 and is not a divisor?
bool is_solved(const Model& m) {
  const auto slopes = top_jacobian(m);
  if (std::any_of(slopes.begin(), slopes.end(), [](const Entry& e) { return varies(e.value); })) return true;
  const auto top = m.top_derivatives();
  const std::unordered_set<Expr> derivatives(top.begin(), top.end());
  for (const Block& b : m.blocks)
    for (Index i = 0; i < b.lhs.size(); ++i)
      if (!derivatives.count(b.lhs[i]) || depends_on_any(b.rhs[i], derivatives)) return false;
  return true;
}

}  // namespace

ModelPtr reduce_ode(const ModelPtr& model) {
  const ModelPtr low = reduce_acc(model);
  if (low->kind == ModelKind::ode && low == model && is_solved(*low)) return model;
  const Elimination e(*low);
  ModelOptions options = child_of(low);
  options.form = "ode";
  options.trace = derivation(e, *low);
  Substitution z;
  for (Expr leaf : low->algebraic()) z[leaf] = e.solved.at(leaf);
  move_invariants(options, z);
  for (const auto& [leaf, meaning] : z) options.relations[leaf] = meaning;
  std::vector<Block> blocks;
  for (const Group& g : groups(*low)) {
    if (g.order == 0) continue;
    Block block{VecX(static_cast<Index>(g.leaves.size())), VecX(static_cast<Index>(g.leaves.size())), ""};
    for (std::size_t i = 0; i < g.leaves.size(); ++i) {
      const Expr top = derivative_leaf(g.leaves[i], g.order);
      block.lhs[i] = top;
      const Expr f = e.solved.at(top);
      block.rhs[i] = low->variables.size() <= 12 ? readable(f) : f;
      options.x.push_back(g.leaves[i]);
    }
    blocks.push_back(std::move(block));
  }
  options.u = low->inputs;
  if (blocks.empty())
    throw Error(
        "form \"ode\": the model has no differential variable; its equations are "
        "algebraic, and sys:init{…} solves them");
  const auto eliminated = eliminated_variables(*low, z);
  options.trace.insert(options.trace.end(), eliminated.begin(), eliminated.end());
  options.trace.push_back("     The model is an explicit ODE: index 0.");
  return make_model(std::move(blocks), std::move(options));
}

}  // namespace pendula::dae
