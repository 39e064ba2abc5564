#include "dae/structure.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/rank.hpp"
#include "dae/truth.hpp"
#include "expr/print.hpp"

namespace pendula::dae {
namespace {

constexpr int written_out = 12;  // larger tables are summarised

std::string unknown_name(const Model& m, int j) {
  return to_text(m.variables[static_cast<std::size_t>(j)].leaf);
}

std::string equation_list(const Model& m, const std::vector<int>& rows) {
  std::vector<std::string> words;
  for (std::size_t k = 0; k < rows.size() && k < written_out; ++k)
    words.push_back(m.label(static_cast<std::size_t>(rows[k])));
  if (rows.size() > written_out) words.push_back(text("… ", rows.size(), " in all"));
  return join(words, ", ");
}

std::string unknown_list(const Model& m, const std::vector<int>& columns) {
  std::vector<std::string> words;
  for (std::size_t k = 0; k < columns.size() && k < written_out; ++k)
    words.push_back(unknown_name(m, columns[k]));
  if (columns.size() > written_out) words.push_back(text("… ", columns.size(), " in all"));
  return join(words, ", ");
}

Pattern jacobian_pattern(const Analysis& a, std::size_t rows) {
  Pattern pattern(rows);
  for (const Entry& e : a.jacobian) pattern[static_cast<std::size_t>(e.row)].push_back(e.column);
  return pattern;
}

/// σ_n/σ_1 of the system Jacobian at a start, rows and columns scaled; nothing if the start lacks a leaf or
/// is too large.
std::optional<double> gap_at(const StructureReport& s, const Start& at) {
  constexpr std::size_t affordable = 300;
  const std::size_t n = s.model->variables.size();
  if (n > affordable) return {};
  Mat J = Mat::Zero(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
  for (const Entry& e : s.analysis.jacobian) J(e.row, e.column) = at(e.value);
  double gap = 0;
  return numeric_rank(J, &gap) < static_cast<int>(n) ? 0 : gap;
}

/// Σ with * on the transversal, c at the right, d below.
std::string sigma_table(const StructureReport& s) {
  const Model& m = *s.model;
  const Analysis& a = s.analysis;
  const auto n = static_cast<int>(m.variables.size());
  if (n > written_out || static_cast<int>(m.residuals.size()) > written_out)
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
      const bool chosen =
          offsets_known && a.offsets.equation_of[static_cast<std::size_t>(e.variable)] == static_cast<int>(i);
      row[static_cast<std::size_t>(e.variable) + 1] = text(e.order, chosen ? "*" : "");
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
  if (!s.blocks.over.rows.empty())
    out += text("over-determined: ", s.blocks.over.rows.size(), " equations ",
                equation_list(m, s.blocks.over.rows), " for ", s.blocks.over.columns.size(),
                s.blocks.over.columns.size() == 1 ? " unknown " : " unknowns ",
                unknown_list(m, s.blocks.over.columns), "\n");
  if (!s.blocks.under.columns.empty())
    out += text("under-determined: ", s.blocks.under.rows.size(),
                s.blocks.under.rows.size() == 1 ? " equation " : " equations ",
                equation_list(m, s.blocks.under.rows), " for ", s.blocks.under.columns.size(), " unknowns ",
                unknown_list(m, s.blocks.under.columns), "\n");
  if (s.blocks.square.size() > 1 && s.blocks.square.size() <= written_out) {
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

std::string verdict_text(const StructureReport& s) {
  const Analysis& a = s.analysis;
  const std::size_t n = s.model->variables.size();
  switch (s.verdict) {
    case Verdict::structurally_singular:
      return "structurally singular: no unknown can be assigned to every equation, so there is no structural "
             "index";
    case Verdict::identically_singular:
      return text("identically singular: the system Jacobian has rank ", a.rank.rank, " of ", n,
                  " at every point (exact, modulo 2⁶¹ - 1 at random points); equations ",
                  equation_list(*s.model, a.rank.dependent_rows),
                  " depend on the others, so structural index and degrees of freedom are wrong");
    case Verdict::singular_here:
      return text("valid in general (rank ", n, " of ", n,
                  "), but singular at this point: the index changes here");
    case Verdict::valid:
      return text("valid: the system Jacobian has full rank ", n, " of ", n,
                  " (exact, modulo 2⁶¹ - 1 at random points",
                  s.gap ? text("; at the given point σ_min/σ_max = ", rounded(*s.gap, 3)) : "", ")");
  }
  return "";
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

StructureReport structure(const ModelPtr& model, const StartPtr& at) {
  StructureReport s;
  s.model = model;
  const Model& m = *model;
  const auto n = static_cast<int>(m.variables.size());
  const bool square = m.residuals.size() == m.variables.size();
  if (square)
    s.analysis = analyse(m);
  else
    s.analysis.sigma = signature(m);
  if (!square || !s.analysis.offsets.unmatched.empty()) {
    s.verdict = Verdict::structurally_singular;
    s.analysis.offsets.unmatched.resize(std::max<std::size_t>(1, s.analysis.offsets.unmatched.size()));
    s.blocks = dulmage_mendelsohn(incidence(m), n);
    return s;
  }
  s.structural_index = s.analysis.offsets.index();
  s.structural_dof = s.analysis.offsets.value;
  s.blocks = dulmage_mendelsohn(jacobian_pattern(s.analysis, m.residuals.size()), n);
  try {
    const Truth known = truth(m, s.analysis);
    s.index = known.index;
    s.dof = known.dof;
    s.by = known.by;
    s.index_is_bound = known.index_is_bound;
  } catch (const Failure& e) {
    s.by = e.what();
  }
  if (!s.analysis.regular) {
    s.verdict = Verdict::identically_singular;
    return s;
  }
  if (at) s.gap = gap_at(s, *at);
  if (s.gap && *s.gap == 0) s.verdict = Verdict::singular_here;
  return s;
}

std::string describe(const StructureReport& s) {
  std::string out = s.model->name.empty() ? "" : s.model->name + "\n";
  out += sigma_table(s) + blocks_text(s);
  if (s.verdict != Verdict::structurally_singular)
    out += text("structural index ", s.structural_index, ", structural degrees of freedom ", s.structural_dof,
                "\n");
  out += "verdict: " + verdict_text(s);
  if (!s.index) return out + (s.by.empty() ? "" : "\n" + s.by);
  return out + text("\ntrue index ", s.index_is_bound ? "at most " : "", *s.index, ", ", *s.dof,
                    *s.dof == 1 ? " free initial value" : " free initial values", " (", s.by, ")");
}

}  // namespace pendula::dae
