#include "dae/model/model.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <unordered_set>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
const char* kind_name(ModelKind kind) {
  switch (kind) {
    case ModelKind::ode:
      return "ODE";
    case ModelKind::implicit_ode:
      return "implicit ODE";
    case ModelKind::semi_explicit:
      return "semi-explicit";
    case ModelKind::fully_implicit:
      return "fully implicit";
  }
  return "";
}

MatX dense(const std::vector<Entry>& entries, Eigen::Index rows, Eigen::Index columns) {
  MatX m = MatX::Zero(rows, columns);
  for (const Entry& e : entries) m(e.row, e.column) = e.value;
  return m;
}

std::vector<Expr> Model::states() const {
  std::vector<Expr> x;
  int highest = 0;
  for (const Variable& v : variables) highest = std::max(highest, v.order);
  for (int k = 0; k < highest; ++k)
    for (const Variable& v : variables)
      if (k < v.order) x.push_back(derivative_leaf(v.leaf, k));
  return x;
}

std::vector<Expr> Model::algebraic() const {
  std::vector<Expr> z;
  for (const Variable& v : variables)
    if (v.order == 0) z.push_back(v.leaf);
  return z;
}

std::vector<Expr> Model::top_derivatives() const {
  std::vector<Expr> top;
  for (const Variable& v : variables)
    if (v.order > 0) top.push_back(derivative_leaf(v.leaf, v.order));
  return top;
}

std::string row_letter(int row, Eigen::Index rows) {
  constexpr Eigen::Index letters = 26;
  return rows <= letters ? std::string(1, static_cast<char>('a' + row)) : text(".", row + 1);
}

std::string row_label(const Block& b, int block, int row) {
  const auto r = static_cast<std::size_t>(row);
  const bool rewritten = r < b.rewritten.size() && !b.rewritten[r].empty();
  return text("(", block + 1, b.lhs.size() == 1 ? "" : row_letter(row, b.lhs.size()), rewritten ? "*" : "",
              ")");
}

std::string Model::label(std::size_t residual) const {
  const auto [block, row] = origin[residual];
  return row_label(blocks[block], block, row);
}

std::string Model::equation_text(std::size_t residual) const {
  const auto [block, row] = origin[residual];
  return to_text(blocks[block].lhs[row]) + " = " + to_text(blocks[block].rhs[row]);
}

}  // namespace pendula::dae
