#include "dae/report/report_latex.hpp"

#include <cmath>
#include <sstream>

#include "base/text.hpp"
#include "dae/model/derivation_markup.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

constexpr int largest_table = 12;  // rows and columns of Σ, as in describe()

std::vector<std::string> lines_of(const std::string& report) {
  std::vector<std::string> lines;
  std::istringstream in(report);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::string displayed_array(const std::string& columns, const std::vector<std::string>& rows) {
  return text("\\begin{equation*}\n\\begin{array}{", columns, "}\n", join(rows, "\n"),
              "\n\\end{array}\n\\end{equation*}\n");
}

std::string sigma_array(const StructureReport& s) {
  const Model& m = *s.model;
  const Analysis& a = s.analysis;
  const std::size_t n = m.variables.size();
  const bool offsets_known = a.offsets.unmatched.empty();
  std::vector<std::string> head{"\\Sigma"}, rows;
  for (const Variable& v : m.variables) head.push_back(to_latex(v.leaf));
  if (offsets_known) head.emplace_back("c");
  rows.push_back(join(head, " & ") + " \\\\\n\\hline");
  for (std::size_t i = 0; i < a.sigma.size(); ++i) {
    std::vector<std::string> row(n + 1, "\\cdot");
    row[0] = text("\\text{", m.label(i), "}");
    for (const SignatureEntry& e : a.sigma[i]) {
      const bool chosen = offsets_known && a.offsets.equation_of[e.variable] == static_cast<int>(i);
      *(row.begin() + e.variable + 1) = text(e.order, chosen ? "^*" : "");
    }
    if (offsets_known) row.push_back(std::to_string(a.offsets.c[i]));
    rows.push_back(join(row, " & ") + " \\\\");
  }
  if (offsets_known) {
    std::vector<std::string> row{"\\hline\nd"};
    for (int d : a.offsets.d) row.push_back(std::to_string(d));
    rows.push_back(join(row, " & ") + " &");
  }
  return displayed_array(text("r|", std::string(n, 'c'), offsets_known ? "|c" : ""), rows);
}

/// The last cell of a line, where columns are separated by two or more blanks.
std::string last_cell(const std::string& line) {
  const std::size_t gap = line.rfind("  ");
  return gap == std::string::npos ? line : line.substr(gap + 2);
}

}  // namespace

std::string latex(const StructureReport& s) {
  const auto rows = static_cast<int>(s.model->residuals.size());
  const bool shown = rows <= largest_table && static_cast<int>(s.model->variables.size()) <= largest_table;
  std::string out = shown ? sigma_array(s) : "";
  const auto lines = lines_of(describe(s));
  const std::size_t table =
      shown ? static_cast<std::size_t>(rows) + 1 + s.analysis.offsets.unmatched.empty() : 0;
  for (std::size_t i = table; i < lines.size(); ++i)
    out += latex_words(lines[i], false) + (i + 1 < lines.size() ? "\\\\\n" : "\n");
  return out;
}

std::string latex(const ConsistentState& at) {
  const auto lines = lines_of(at.ledger());
  std::vector<std::string> rows;
  for (std::size_t i = 0; i < at.rows.size() && i + 1 < lines.size(); ++i)
    rows.push_back(text(to_latex(at.rows[i].leaf), " & ", rounded(at.rows[i].value), " & \\text{",
                        latex_words(last_cell(lines[i + 1]), false), "} \\\\"));
  std::string out =
      latex_words(lines.empty() ? "" : lines[0], false) + "\\\\\n" + displayed_array("rrl", rows);
  if (at.constraints.empty()) return out;
  std::vector<std::string> conditions;
  for (const auto& [c, residual] : at.constraints)
    conditions.push_back(text("\\text{", latex_words(c.label, false), "} & ",
                              std::fabs(residual) < 1e-12 ? "\\le 10^{-12}" : rounded(residual, 2),
                              " & 0 = ", to_latex(c.residual), " \\\\"));
  return out + "Constraints and their residuals:\n" + displayed_array("lrl", conditions);
}

}  // namespace pendula::dae
