#include "expr/print/print.hpp"

#include <algorithm>

#include "base/text.hpp"
#include "expr/print/latex_width.hpp"
#include "expr/print/print_writer.hpp"

namespace pendula {
namespace {

const Notation& notation_of(const PrintOptions& options) {
  return options.latex ? latex_notation() : unicode_notation();
}

bool is_number(const std::string& cell) {
  const std::size_t first = cell.find_first_not_of("-");
  return first != std::string::npos && cell.find_first_not_of("0123456789./e+-") == std::string::npos;
}

std::string padded(const std::string& cell, int width, bool right) {
  const int free = width - display_width(cell), left = right ? free : free / 2;
  return std::string(static_cast<std::size_t>(left), ' ') + cell +
         std::string(static_cast<std::size_t>(free - left), ' ');
}

/// Right-aligns columns of numbers, centres others.
std::string grid(const std::vector<std::vector<std::string>>& cells) {
  const std::size_t rows = cells.size(), columns = rows ? cells[0].size() : 0;
  std::vector<std::string> lines(rows);
  for (std::size_t j = 0; j < columns; ++j) {
    int width = 0;
    bool numbers = true;
    for (const auto& row : cells) {
      width = std::max(width, display_width(row[j]));
      numbers = numbers && is_number(row[j]);
    }
    for (std::size_t i = 0; i < rows; ++i) lines[i] += (j ? "  " : "") + padded(cells[i][j], width, numbers);
  }
  if (rows == 0 || columns == 0) return "[]";
  if (rows == 1) return "[" + lines[0] + "]";
  for (std::size_t i = 0; i < rows; ++i) {
    const bool first = i == 0, last = i + 1 == rows;
    lines[i] = (first ? "⎡" : last ? "⎣" : "⎢") + lines[i] + (first ? "⎤" : last ? "⎦" : "⎥");
  }
  return join(lines, "\n");
}

/// The width of the grid: the widest entries of the columns plus the gaps.
int width_of(const std::vector<std::vector<std::string>>& cells) {
  int width = 0;
  for (std::size_t j = 0; !cells.empty() && j < cells[0].size(); ++j) {
    int column = 0;
    for (const auto& row : cells) column = std::max(column, visible_width(row[j]));
    width += column + 2;
  }
  return width;
}

/// amsmath's matrices have at most ten columns, unlike array. A matrix wider than a page is set
/// in small type.
std::string bmatrix(const std::vector<std::vector<std::string>>& cells) {
  std::vector<std::string> rows;
  for (const auto& row : cells) rows.push_back(join(row, " & "));
  const bool tall = std::any_of(rows.begin(), rows.end(), [](const std::string& row) {
    return row.find("\\frac") != std::string::npos;
  });
  const std::string body = join(rows, tall ? " \\\\[1ex] " : " \\\\ ");
  constexpr std::size_t most_columns = 10;  // MaxMatrixCols
  if (!cells.empty() && cells[0].size() > most_columns)
    return "\\left[\\begin{array}{" + std::string(cells[0].size(), 'c') + "} " + body +
           " \\end{array}\\right]";
  if (width_of(cells) > line_width)
    return "\\left[\\begin{smallmatrix} " + body + " \\end{smallmatrix}\\right]";
  return "\\begin{bmatrix} " + body + " \\end{bmatrix}";
}

}  // namespace

PrintOptions& default_print_options() {
  static PrintOptions options;
  return options;
}

std::string to_text(Expr e, const PrintOptions& options) {
  NormalForms forms;
  const Columns columns(options);
  const SumId sum = forms.form(e);
  const NumberStyleScope style(forms, {sum});
  return Writer(forms, columns, notation_of(options)).whole(sum);
}

std::string to_text(Expr e) {  // aliases name columns
  return e.is_symbol() ? to_text(e, PrintOptions{}) : to_text(e, default_print_options());
}

std::string to_latex(Expr e) {
  PrintOptions options = default_print_options();
  options.latex = true;
  return to_text(e, options);
}

std::string vector_to_text(const VecX& v, const PrintOptions& options) {
  NormalForms forms;
  const Columns columns(options);
  std::vector<SumId> sums;
  for (Expr e : entries(v)) sums.push_back(forms.form(e));
  const NumberStyleScope style(forms, sums);
  return Writer(forms, columns, notation_of(options)).whole(sums);
}

std::string matrix_to_text(const MatX& m, const PrintOptions& options) {
  NormalForms forms;
  const Columns columns(options);
  std::vector<std::vector<std::string>> cells(static_cast<std::size_t>(m.rows()));
  std::vector<SumId> sums;
  for (Eigen::Index i = 0; i < m.rows(); ++i)
    for (Eigen::Index j = 0; j < m.cols(); ++j) sums.push_back(forms.form(m(i, j)));
  const NumberStyleScope style(forms, sums);
  auto sum = sums.begin();
  for (auto& row : cells)
    for (Eigen::Index j = 0; j < m.cols(); ++j)
      row.push_back(Writer(forms, columns, notation_of(options)).whole(*sum++));
  return options.latex ? bmatrix(cells) : grid(cells);
}

std::string unit_text(Expr leaf) {
  const Symbol& s = symbol_of(leaf);
  if (s.order == 0) return s.unit;
  std::string unit = symbol_of(s.base).unit;
  int seconds = s.order;
  for (const auto& [ending, power] : {std::pair{"/s", 1}, {"/s^2", 2}, {"/s²", 2}})
    if (unit.ends_with(ending) && !unit.empty()) {
      unit.resize(unit.size() - std::string_view(ending).size());
      seconds += power;
      break;
    }
  if (unit.empty()) return "";
  return unit + "/s" + (seconds == 1 ? "" : superscript(seconds));
}

}  // namespace pendula
