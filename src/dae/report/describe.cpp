#include "dae/report/describe.hpp"

#include <algorithm>

#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/analysis/classification.hpp"
#include "dae/index/differentiation_index.hpp"
#include "dae/model/derivation_markup.hpp"
#include "dae/model/equation_lines.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/linear_systems.hpp"
#include "dae/model/model.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/model/truncated_text.hpp"
#include "dae/rank/rank.hpp"
#include "dae/singular/singularity_conditions.hpp"
#include "dae/structure/balance.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

constexpr Index most_lines = 60;        // of equations; sys.equations shows all
constexpr std::size_t most_names = 30;  // a few lines

/// Has ∂F/∂x′ full generic rank, but not where the equations hold? Then a DAE looks like an implicit ODE.
bool loses_leading_rank(const Model& m) {
  if (m.kind != ModelKind::implicit_ode) return false;
  try {
    return differentiation_index(m).index > 0;
  } catch (const UserFacing&) {
    return false;
  }
}

std::string header(const Model& m) {
  std::string out = m.name.empty() ? "" : m.name + ": ";
  const bool is_dae = loses_leading_rank(m);
  out += is_dae ? "fully implicit" : kind_name(m.kind);
  if (is_dae || m.kind == ModelKind::semi_explicit || m.kind == ModelKind::fully_implicit) out += " DAE";
  const std::size_t n = m.states().size(), z = m.algebraic().size();
  out += text(", ", n, " differential",
              z ? text(" + ", z, " algebraic variable", n + z == 1 ? "" : "s")
                : text(" variable", n == 1 ? "" : "s"));
  if (m.residuals.size() != m.variables.size())
    return out + text("; ", m.residuals.size() > m.variables.size() ? "over" : "under",
                      "-determined: ", counted(m.residuals.size(), "equation"), " for ",
                      counted(m.variables.size(), "unknown"));
  try {
    const IndexResult known = differentiation_index(m);
    return out + text(known.is_unconfirmed ? ", if the equations have solutions index " : ", index ",
                      known.index_is_bound ? "at most " : "", known.index, ", ",
                      counted(static_cast<std::size_t>(known.dof), "free initial value"));
  } catch (const Failure&) {
    return out + ", no index (sys:structure() says why)";
  }
}

/// x, y, q (6): columns by name and size.
std::string grouped(const std::vector<Expr>& list) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < list.size();) {
    const Symbol& s = symbol_of(list[i]);
    std::size_t n = 1;
    if (!s.vector.empty())
      while (i + n < list.size() && symbol_of(list[i + n]).vector == s.vector &&
             symbol_of(list[i + n]).order == s.order)
        ++n;
    const bool whole = n > 1 && vector_components(s.vector).size() == n;
    if (!whole)
      for (std::size_t k = 0; k < std::min(n, most_names + 1); ++k) names.push_back(to_text(list[i + k]));
    else
      names.push_back(text(vector_to_text(column(std::span(list).subspan(i, n))), " (", n, ")"));
    i += n;
    if (names.size() > most_names) {
      names.resize(most_names);
      names.push_back(text("… ", list.size(), " in all"));
      break;
    }
  }
  return join(names, ", ");
}

/// For form "array": a remark that x′ among the algebraic variables is not the derivative of a state.
std::string own_derivatives(const Model& m) {
  const auto z = m.algebraic();
  const bool some = std::any_of(z.begin(), z.end(), [](Expr leaf) { return stands_for(leaf).has_value(); });
  return some ? "; the derivatives among them are unknowns of their own" : "";
}

/// The value of a parameter as a short decimal if there is one: L = 0.5, g = 9.81.
std::string value_text(Expr value) {
  const mpz_class six_places = 1'000'000;
  const mpq_class* q = exact_value(value);
  const bool decimal = q && q->get_den() != 1 && six_places % q->get_den() == 0;
  return decimal ? rounded(constant_value(value), 10) : to_text(value);
}

std::string parameter_values(const Model& m) {
  std::vector<std::string> words;
  for (Expr p : m.parameters) {
    const auto it = m.values.find(p);
    words.push_back(to_text(p) + (it == m.values.end() ? " (no value)" : " = " + value_text(it->second)));
  }
  return join(words, ", ");
}

/// If every unknown is differentiated, the rank of ∂F/∂x′ distinguishes implicit ODEs from DAEs.
void leading_rank(const Model& m, Table& symbols) {
  constexpr std::size_t affordable = 300;  // rows: ranks of dense matrices
  const auto top = m.top_derivatives();
  if (m.kind == ModelKind::ode || !m.algebraic().empty() || top.size() != m.residuals.size() ||
      top.size() > affordable)
    return;
  const auto n = static_cast<int>(top.size());
  const ModularRank rank =
      generic_rank(sparse_jacobian(residuals_at_values(m), top), n, n, residuals_at_values(m));
  const char* word = m.variables[0].order > 1 ? "∂F/∂x″" : "∂F/∂x′";
  if (rank.rank == n && loses_leading_rank(m)) {
    symbols.row({word, text("nonsingular in general (rank ", n,
                            "), but singular where the equations hold: a DAE, "
                            "though every unknown is differentiated")});
    return;
  }
  symbols.row({word, rank.rank == n ? text("nonsingular (rank ", n, "): an implicit ODE")
                                    : text("singular (rank ", rank.rank, " of ", n,
                                           rank.dependent_rows.empty()
                                               ? ""
                                               : text("; ", equation_list(m, rank.dependent_rows),
                                                      " depends on the others"),
                                           "): a DAE, though every unknown is differentiated")});
}

}  // namespace

std::string describe(const Model& m) {
  std::string out = header(m) + "\n";
  if (m.mechanics)
    out += m.mechanics->C.size() ? "Lagrange, L = T - V - zᵀC:  W(q) q″ + (∂C/∂q)ᵀ z = rhs,  0 = C(q)\n"
                                 : "Lagrange, L = T - V:  W(q) q″ = rhs\n";
  Table equations;
  Index written = 0;  // rows
  const std::vector<Block> blocks = blocks_with_names(m);
  for (std::size_t b = 0; b < blocks.size() && written < most_lines; ++b) {
    const EquationLines lines = equation_lines(blocks[b], most_lines);
    const auto number = [&](std::size_t i) {
      if (lines.rows) return row_label(blocks[b], static_cast<int>(b), static_cast<int>(i));
      return i > 0                       ? ""
             : blocks[b].lhs.size() == 1 ? row_label(blocks[b], static_cast<int>(b), 0)
                                         : text("(", b + 1, ")");
    };
    const auto note = [&](std::size_t i) {
      const auto& how = blocks[b].rewritten;
      if (i < how.size() && !how[i].empty()) return "[" + how[i] + "]";
      return i == 0 && !blocks[b].note.empty() ? "[" + blocks[b].note + "]" : "";
    };
    for (std::size_t i = 0; i < lines.sides.size(); ++i)
      equations.row({number(i), lines.sides[i].left + " = " + lines.sides[i].right, note(i)});
    written += lines.rows ? std::min(blocks[b].lhs.size(), most_lines) : blocks[b].lhs.size();
  }
  const auto rows = static_cast<Index>(m.residuals.size());
  if (written < rows)
    equations.row({"…", text(rows - written, " more (sys.equations has all ", m.blocks.size(), ")"), ""});
  out += equations.str(2);
  for (const std::string& line : linear_system_lines(m)) out += rendered("  " + line) + "\n";
  Table symbols;
  if (!m.states().empty()) symbols.row({"differential", grouped(m.states())});
  if (!m.algebraic().empty()) symbols.row({"algebraic", grouped(m.algebraic()) + own_derivatives(m)});
  if (!m.inputs.empty()) symbols.row({"inputs", grouped(m.inputs)});
  if (!m.parameters.empty()) symbols.row({"parameters", parameter_values(m)});
  leading_rank(m, symbols);
  for (const auto& [word, line] : classification(m)) symbols.row({word, line});
  if (!m.singularity_conditions.empty()) symbols.row({"valid where", singularity_conditions_text(m)});
  if (!m.invariants.empty()) {
    std::vector<std::string> words;
    for (const Constraint& c : m.invariants)
      if (words.size() < most_names) words.push_back(condition_text(c));
    if (m.invariants.size() > most_names) words.push_back(text("… ", m.invariants.size(), " in all"));
    symbols.row({"start must keep", join(words, ", ")});
  }
  out += symbols.str(2);
  return out.substr(0, out.size() - 1);
}

}  // namespace pendula::dae
