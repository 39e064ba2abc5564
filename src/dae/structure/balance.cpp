#include "dae/structure/balance.hpp"

#include <algorithm>

#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/rank/modular.hpp"
#include "dae/structure/signature.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

constexpr std::size_t listed = 12;  // names: one line

template <class Word>
std::string some_of(const std::vector<int>& list, Word word) {
  std::vector<std::string> words;
  for (std::size_t k = 0; k < list.size() && k < listed; ++k)
    words.push_back(word(static_cast<std::size_t>(list[k])));
  if (list.size() > listed) words.push_back(text("… ", list.size(), " in all"));
  return join(words, ", ");
}

bool has_unknown(const Model& m, std::size_t row) {
  const Expr r = m.residuals[row];
  for (Expr leaf : leaves({&r, 1}))
    for (const Variable& v : m.variables)
      if (symbol_of(leaf).base == v.leaf) return true;
  return false;
}

/// " of R, C, connect(R.p, C.p)": the parts and connections from which these equations come, if known.
std::string origins(const Model& m, const std::vector<int>& rows) {
  std::vector<std::string> notes;
  for (int i : rows) {
    const std::string& note = m.blocks[m.origin[i].first].note;
    if (!note.empty() && std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(note);
  }
  if (notes.empty()) return "";
  if (notes.size() > listed) {
    notes.resize(listed);
    notes.push_back("…");
  }
  return " of " + join(notes, ", ");
}

/// Do the equations determine the other unknowns if these are inputs? Requires a transversal and a system
/// Jacobian of full generic rank.
bool determined_without(const Model& m, const std::vector<int>& given) {
  std::vector<Expr> rest;
  for (std::size_t j = 0; j < m.variables.size(); ++j)
    if (std::find(given.begin(), given.end(), static_cast<int>(j)) == given.end())
      rest.push_back(m.variables[j].leaf);
  const auto n = static_cast<int>(rest.size());
  if (m.residuals.size() != rest.size()) return false;
  const Signature sigma = signature(m.residuals, rest);
  const Offsets o = offsets(sigma, n);
  if (!o.unmatched.empty()) return false;
  return modular_rank(system_jacobian(m.residuals, rest, o, sigma), n, n).rank == n;
}

/// Verified sets of unknowns that can be inputs, as many as equations are missing. Empty if none was found.
std::vector<int> possible_inputs(const Model& m, const Blocks& blocks) {
  constexpr std::size_t affordable = 300;  // unknowns: a rank per candidate
  if (m.variables.size() > affordable || m.variables.size() <= m.residuals.size()) return {};
  std::vector<int> unmatched;
  for (std::size_t j = 0; j < blocks.row_of.size(); ++j)
    if (blocks.row_of[j] < 0) unmatched.push_back(static_cast<int>(j));
  const auto& under = blocks.under.columns;
  if (m.variables.size() == m.residuals.size() + 1)
    for (auto j = under.rbegin(); j != under.rend(); ++j)
      if (determined_without(m, {*j})) return {*j};
  if (unmatched.size() > 1 && determined_without(m, unmatched)) return unmatched;
  return {};
}

}  // namespace

/// A hint for an equation without unknowns that contains a single parameter, which may be meant
/// as an unknown.
static std::string declaration_hint(Expr residual) {
  const std::vector<Expr> inside = leaves({&residual, 1});
  if (inside.size() != 1 || symbol_of(inside[0]).kind != Kind::parameter) return "";
  const std::string& name = symbol_of(inside[0]).name;
  return text("; ", name, " is a parameter, an unknown is declared by ", name, " = var \"", name, "\"");
}

std::string equation_list(const Model& m, const std::vector<int>& rows) {
  return some_of(rows, [&](std::size_t i) { return m.label(i); });
}

std::string unknown_list(const Model& m, const std::vector<int>& columns) {
  return some_of(columns, [&](std::size_t j) { return to_text(m.variables[j].leaf); });
}

std::vector<std::string> balance_lines(const Model& m, const Blocks& blocks) {
  std::vector<std::string> lines;
  const auto part = [&](const char* what, const Part& p) {
    return text(what, ": ", counted(p.rows.size(), "equation"), p.rows.empty() ? "" : " ",
                equation_list(m, p.rows), origins(m, p.rows), " for ", counted(p.columns.size(), "unknown"),
                p.columns.empty() ? "" : " ", unknown_list(m, p.columns));
  };
  std::vector<int> bare;  // over-determined as well, but with a more specific message
  for (int i : blocks.over.rows)
    if (!has_unknown(m, static_cast<std::size_t>(i))) bare.push_back(i);
  for (std::size_t k = 0; k < bare.size() && k < listed; ++k) {
    const Expr r = m.residuals[bare[k]];
    lines.push_back(text("without unknown: equation ", m.label(static_cast<std::size_t>(bare[k])),
                         " reads 0 = ", to_text(r), declaration_hint(r)));
  }
  Part over = blocks.over;
  std::erase_if(over.rows, [&](int i) { return std::find(bare.begin(), bare.end(), i) != bare.end(); });
  if (!over.rows.empty()) lines.push_back(part("over-determined", over));
  if (!blocks.under.columns.empty()) lines.push_back(part("under-determined", blocks.under));
  return lines;
}

std::string imbalance(const Model& m) {
  const std::size_t equations = m.residuals.size(), unknowns = m.variables.size();
  const Blocks blocks = dulmage_mendelsohn(incidence(m), static_cast<int>(unknowns));
  std::string out =
      equations == unknowns
          ? "the model is structurally singular: some equations cannot all determine unknowns"
          : text("the model has ", counted(equations, "equation"), " for ", counted(unknowns, "unknown"));
  for (const std::string& line : balance_lines(m, blocks)) out += "\n  " + line;
  if (!blocks.over.rows.empty() && origins(m, blocks.over.rows).empty())
    out +=
        "\n  Remove one of the equations that are too many, or declare what should follow from it with var.";
  else if (!blocks.over.rows.empty()) {
    out += "\n  These parts fix the same quantity twice: remove one, or put another part between them.";
    if (equations == unknowns) return out;  // removing an equation balances the under-determined part, too
  }
  if (blocks.under.columns.empty()) return out;
  std::vector<std::string> calls;
  std::vector<int> given = possible_inputs(m, blocks);
  const std::size_t missing = unknowns > equations ? unknowns - equations : 0;
  if (missing == 0) given = {blocks.under.columns.back()};
  for (int j : given) {
    const std::string& plain = symbol_of(m.variables[j].leaf).name;
    calls.push_back(text(plain, " = input \"", plain, "\""));
  }
  if (calls.empty())
    out += text("\n  Add ", missing == 1 ? "an equation" : text(missing, " equations"),
                "; no unknown was found that could be an input instead.");
  else
    out += text("\n  Add ",
                calls.size() == 1 ? "an equation, or let one of the unknowns" : "equations, or let unknowns",
                " be given: ", join(calls, ", "), ".");
  return out;
}

}  // namespace pendula::dae
