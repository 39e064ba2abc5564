#include "dae/model/equation_lines.hpp"

#include <algorithm>

#include "dae/model/truncated_text.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

constexpr std::size_t longest_side = 1000;  // characters of a side
constexpr Index most_split = 60;            // rows; longer columns are not searched for mechanical points

Index nonzero(const VecX& v) {
  return std::count_if(v.begin(), v.end(), [](Expr e) { return !e.is_zero(); });
}

/// Can the equations be written with names of vectors alone, in a line of readable length?
bool reads_as_vectors(const VecX& lhs, const VecX& rhs) {
  constexpr int widest = 100;           // columns of a terminal
  if (nonzero(lhs) == 1) return false;  // x₁′ e₁ = … reads better row by row
  const std::string line = side(lhs) + " = " + side(rhs);
  return line.find(", ") == std::string::npos && display_width(line) <= widest;
}

}  // namespace

std::string side(const VecX& v, Notation notation) {
  PrintOptions options = default_print_options();
  options.latex = notation == Notation::latex;
  if (const std::string elided = unprintable({v.data(), static_cast<std::size_t>(v.size())}); !elided.empty())
    return elided;
  if (v.size() == 1) return options.latex ? to_text(v[0], options) : truncated_text(v[0], longest_side);
  const Index entries = nonzero(v);
  if (entries == 0) return "0";
  if (entries != 1) return vector_to_text(v, options);
  const auto only = std::find_if(v.begin(), v.end(), [](Expr e) { return !e.is_zero(); }) - v.begin();
  const std::string factor = to_text(v[only], options);
  const bool sum = factor.find(" + ") != std::string::npos || factor.find(" - ") != std::string::npos;
  const std::string unit =
      options.latex ? text("\\mathbf{e}_{", only + 1, "}") : "e" + subscript(static_cast<long>(only + 1));
  return (v[only].is_one() ? "" : sum ? "(" + factor + ") " : factor + " ") + unit;
}

Index rows_per_line(const VecX& lhs, const VecX& rhs) {
  const Index n = lhs.size();
  if (n == 1 || reads_as_vectors(lhs, rhs)) return n;
  if (n > most_split) return 1;
  for (Index parts = 2; parts <= n / 2; ++parts) {
    if (n % parts) continue;
    const Index size = n / parts;
    Index good = 0;
    while (good < parts && reads_as_vectors(lhs.segment(good * size, size), rhs.segment(good * size, size)))
      ++good;
    if (good == parts) return size;
  }
  return 1;
}

EquationLines equation_lines(const Block& b, Index most, Notation notation) {
  const Index n = b.lhs.size();
  const bool rewritten =
      std::any_of(b.rewritten.begin(), b.rewritten.end(), [](const auto& how) { return !how.empty(); });
  const Index size = rewritten ? 1 : rows_per_line(b.lhs, b.rhs);
  EquationLines lines;
  lines.rows = n > 1 && size == 1;
  for (Index i = 0; i < (lines.rows ? std::min(n, most) : n); i += size)
    lines.sides.push_back({side(b.lhs.segment(i, size), notation), side(b.rhs.segment(i, size), notation)});
  return lines;
}

}  // namespace pendula::dae
