// Printing of matrices: exact ones by names or as a grid, numbers aligned with at most 10 digits,
// long ones abbreviated.
#include <algorithm>

#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "lua/bind/expr/expr.hpp"

namespace pendula::lua {
namespace {

constexpr Eigen::Index most_rows = 24, most_cols = 12, ends = 4;

/// The first and last few of n indices, with -1 for the omitted ones.
std::vector<Eigen::Index> shown_indices(Eigen::Index n, Eigen::Index most, Eigen::Index at_the_ends) {
  std::vector<Eigen::Index> list;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (n <= most || i < at_the_ends || i >= n - at_the_ends)
      list.push_back(i);
    else if (i == at_the_ends)
      list.push_back(-1);
  }
  return list;
}

std::string without_last_newline(std::string s) {
  if (s.ends_with('\n')) s.pop_back();
  return s;
}

}  // namespace

std::string shown(const Mat& m) {
  if (m.size() == 0) return text("(empty ", m.rows(), "×", m.cols(), " matrix)");
  const auto cols = shown_indices(m.cols(), most_cols, ends);
  Table table(std::vector<bool>(cols.size(), true));
  for (Eigen::Index i : shown_indices(m.rows(), most_rows, 2 * ends)) {
    std::vector<std::string> cells;
    for (Eigen::Index j : cols) cells.push_back(i < 0 || j < 0 ? "…" : rounded(m(i, j)));
    table.row(std::move(cells));
  }
  const bool partly = m.rows() > most_rows || m.cols() > most_cols;
  return without_last_newline(table.str()) +
         (partly ? text("\n(", m.rows(), "×", m.cols(), " numbers)") : "");
}

std::string shown(const MatX& m) {
  if (m.size() == 0) return text("(empty ", m.rows(), "×", m.cols(), " matrix)");
  if (m.rows() <= 100 && m.cols() <= 100)
    return m.cols() == 1 ? vector_to_text(m.col(0)) : without_last_newline(matrix_to_text(m));
  const auto rows = shown_indices(m.rows(), 100, ends), cols = shown_indices(m.cols(), 100, ends);
  Table table(std::vector<bool>(cols.size(), true));
  for (Eigen::Index i : rows) {
    std::vector<std::string> cells;
    for (Eigen::Index j : cols) cells.push_back(i < 0 || j < 0 ? "…" : to_text(m(i, j)));
    table.row(std::move(cells));
  }
  return table.str() + text("(", m.rows(), "×", m.cols(), " expressions)");
}

}  // namespace pendula::lua
