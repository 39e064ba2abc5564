// print(sys:structure()): Σ, blocks, indices, and whether they are confirmed.
#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/analysis/classification.hpp"
#include "dae/report/structure_report.hpp"
#include "dae/structure/balance.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

constexpr int most_written = 12;  // larger tables are summarised

std::string unknown_name(const Model& m, int j) { return to_text(m.variables[j].leaf); }

/// Σ with * on the transversal, c at the right, d below.
std::string sigma_table(const StructureReport& s) {
  const Model& m = *s.model;
  const Analysis& a = s.analysis;
  const auto n = static_cast<int>(m.variables.size());
  if (n > most_written || static_cast<int>(m.residuals.size()) > most_written)
    return text("Σ: ", m.residuals.size(), " × ", n, ", ", a.jacobian.size(),
                " entries in the system Jacobian\n");
  Table table(std::vector<bool>(static_cast<std::size_t>(n) + 2, true));
  std::vector<std::string> head{"Σ"};
  for (int j = 0; j < n; ++j) head.push_back(unknown_name(m, j));
  const bool offsets_known = a.offsets.unmatched.empty();
  if (offsets_known) head.push_back("c");
  table.row(head);
  for (std::size_t i = 0; i < a.sigma.size(); ++i) {
    std::vector<std::string> row{m.label(i)};
    row.resize(static_cast<std::size_t>(n) + 1, "·");
    for (const SignatureEntry& e : a.sigma[i]) {
      const bool chosen = offsets_known && a.offsets.equation_of[e.variable] == static_cast<int>(i);
      row[e.variable + 1] = text(e.order, chosen ? "*" : "");
    }
    if (offsets_known) row.push_back(std::to_string(a.offsets.c[i]));
    table.row(row);
  }
  if (offsets_known) {
    std::vector<std::string> row{"d"};
    for (int d : a.offsets.d) row.push_back(std::to_string(d));
    table.row(row);
  }
  return table.str(2);
}

std::string blocks_text(const StructureReport& s) {
  const Model& m = *s.model;
  std::string out;
  for (const std::string& line : balance_lines(m, s.blocks)) out += line + "\n";
  if (s.blocks.square.size() > 1 && s.blocks.square.size() <= most_written) {
    out += "blocks, each solvable after those before it:\n";
    Table table;
    for (const Part& part : s.blocks.square)
      table.row({equation_list(m, part.rows), "for " + unknown_list(m, part.columns)});
    out += table.str(2);
  } else if (!s.blocks.square.empty()) {
    std::size_t largest = 0;
    for (const Part& part : s.blocks.square) largest = std::max(largest, part.rows.size());
    out += text(s.blocks.square.size(), s.blocks.square.size() == 1 ? " block" : " blocks",
                ", the largest of size ", largest, "\n");
  }
  return out;
}

/// The singular-value gap at the given point; empty if there is none.
std::string gap_text(const StructureReport& s) {
  return s.gap ? text("; at the given point σ_min/σ_max = ", rounded(*s.gap, 3)) : "";
}

std::string values_text(const StructureReport& s) {
  std::vector<std::string> words;
  for (const DeterminantFactor& c : s.validity.conditions)
    for (Expr leaf : leaves({&c.factor, 1})) {
      const auto it = s.model->values.find(leaf);
      if (it == s.model->values.end()) continue;
      const std::string word = to_text(leaf) + " = " + to_text(it->second);
      if (std::find(words.begin(), words.end(), word) == words.end()) words.push_back(word);
    }
  return words.empty() ? "the given parameter values" : join(words, ", ");
}

std::string on_solutions_text(const ConsistentPointRanks& r) {
  if (r.points == 0) return text("no rank at ", r.slow, " consistent points, where the equations lose rank");
  return text("rank ", r.most, " at ", r.points, r.points == 1 ? " consistent point" : " consistent points");
}

std::string dependent_text(const Model& m, const std::vector<int>& rows) {
  return text("; ", rows.size() == 1 ? "equation " : "equations ", equation_list(m, rows),
              rows.size() == 1 ? " depends" : " depend", " on the others");
}

std::string singular_text(const StructureReport& s) {
  const Analysis& a = s.analysis;
  const std::size_t n = s.model->variables.size();
  const std::string wrong = "so structural index and degrees of freedom are wrong";
  switch (a.jacobian_status) {
    case JacobianStatus::at_values:
      return text("identically singular for ", values_text(s), " (full rank ", n,
                  " for almost all other values), ", wrong);
    case JacobianStatus::on_solutions:
      return text("identically singular where the equations hold (full rank ", n, " in general; ",
                  on_solutions_text(*a.solutions), "), ", wrong);
    default:
      return text("identically singular: the system Jacobian has rank ", a.rank.rank, " of ", n,
                  " at every point (exact, modulo 2⁶¹ - 1 at random points)",
                  a.rank.dependent_rows.empty() ? "" : dependent_text(*s.model, a.rank.dependent_rows), ", ",
                  wrong);
  }
}

std::string verdict_text(const StructureReport& s) {
  const std::size_t n = s.model->variables.size();
  switch (s.verdict) {
    case Verdict::structurally_singular:
      return "structurally singular: no unknown can be assigned to every "
             "equation, so there is no structural index";
    case Verdict::identically_singular:
      return singular_text(s);
    case Verdict::singular_here:
      return text("valid in general (rank ", n, " of ", n, "), but singular at this point", gap_text(s),
                  s.null_vector.empty() ? "" : "; null vector in " + join(s.null_vector, ", "),
                  ": the index changes here");
    case Verdict::valid:
      return text("structural result confirmed: the system Jacobian has full rank ", n, " of ", n,
                  " (exact, modulo 2⁶¹ - 1 at random points", gap_text(s), ")");
  }
  return "";
}

std::string index_text(const StructureReport& s) {
  if (!s.index) return s.evidence;
  return text(s.is_unconfirmed ? "if the equations have solutions: index " : "true index ",
              s.index_is_bound ? "at most " : "", *s.index, ", ", *s.dof,
              *s.dof == 1 ? " free initial value" : " free initial values", " (", s.evidence, ")");
}

}  // namespace

const char* verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::valid:
      return "valid";
    case Verdict::singular_here:
      return "valid but singular at this point";
    case Verdict::identically_singular:
      return "identically singular";
    case Verdict::structurally_singular:
      return "structurally singular";
  }
  return "";
}

std::string describe(const StructureReport& s) {
  std::string out = s.model->name.empty() ? "" : s.model->name + "\n";
  out += sigma_table(s) + blocks_text(s);
  if (s.verdict != Verdict::structurally_singular)
    out += text("structural index ", s.structural_index, ", structural degrees of freedom ", s.structural_dof,
                "\n");
  out += "verdict: " + verdict_text(s);
  std::vector<std::string> lines = condition_lines(*s.model, s.analysis, s.validity);
  if (const std::string known = index_text(s); !known.empty()) lines.push_back(known);
  lines.insert(lines.end(), s.notes.begin(), s.notes.end());
  for (const std::string& line : lines) out += "\n" + line;
  return out;
}

}  // namespace pendula::dae
