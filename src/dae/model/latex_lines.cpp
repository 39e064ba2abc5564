#include "dae/model/latex_lines.hpp"

#include <algorithm>

#include "base/text.hpp"
#include "dae/model/equation_lines.hpp"
#include "dae/model/linear_systems.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

/// The nesting that a command or brace at `i` opens (+1) or closes (-1).
int nesting(const std::string& s, std::size_t i) {
  if (s[i] == '{' || s[i] == '(' || s[i] == '[') return 1;
  if (s[i] == '}' || s[i] == ')' || s[i] == ']') return -1;
  if (s.compare(i, 6, "\\begin") == 0) return 1;
  if (s.compare(i, 4, "\\end") == 0) return -1;
  return 0;
}

constexpr int beside_fraction = 10;  ///< characters for the left side and the number of an equation

/// A term whose fractions have their numerators broken into lines if they are too wide.
std::string with_broken_numerators(const std::string& term, int widest) {
  std::string out;
  int depth = 0;
  for (std::size_t i = 0; i < term.size(); ++i) {
    depth += nesting(term, i);
    out += term[i];
    if (depth != 1 || term[i] != '{' || i < 5 || term.compare(i - 5, 5, "\\frac") != 0) continue;
    const std::size_t end = end_of_group(term, i + 1);
    const auto pieces = line_pieces(term.substr(i + 1, end - i - 1), widest);
    out += pieces.size() == 1 ? pieces[0]
                              : text("\\begin{gathered} ", join(pieces, " \\\\ "), " \\end{gathered}");
    i = end - 1;
  }
  return out;
}

}  // namespace

std::vector<std::string> line_pieces(const std::string& latex, int widest) {
  std::vector<std::string> terms{""};
  int depth = 0;
  for (std::size_t i = 0; i < latex.size(); ++i) {
    depth += nesting(latex, i);
    const bool cut = depth == 0 && i > 0 && latex[i] == ' ' && i + 2 < latex.size() && latex[i + 2] == ' ' &&
                     (latex[i + 1] == '+' || latex[i + 1] == '-');
    if (cut) terms.emplace_back();
    terms.back() += latex[i];
  }
  std::vector<std::string> pieces{""};
  for (std::string& term : terms) {
    const int inside = widest - beside_fraction;
    if (visible_width(term) > inside) term = with_broken_numerators(term, inside);
    if (!pieces.back().empty() && visible_width(pieces.back() + term) > widest) pieces.emplace_back();
    pieces.back() += pieces.back().empty() && pieces.size() > 1 ? term.substr(1) : term;
  }
  return pieces;
}

std::string broken_equation(const std::string& equation) {
  const std::size_t equals = equation.find(" = ");
  if (equals == std::string::npos) return equation;
  const auto pieces = line_pieces(equation.substr(equals + 3));
  if (pieces.size() == 1) return equation.substr(0, equals + 3) + pieces[0];
  return text("\\begin{aligned}\n", equation.substr(0, equals), " &= ", join(pieces, " \\\\\n&\\quad "),
              "\n\\end{aligned}");
}

std::string latex(const Model& m) {
  constexpr Index most = 1000;
  std::vector<std::string> rows;
  const std::vector<Block> blocks = blocks_with_names(m);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const EquationLines lines = equation_lines(blocks[b], most, Notation::latex);
    for (std::size_t i = 0; i < lines.sides.size(); ++i) {
      auto left = line_pieces(lines.sides[i].left);
      const auto right = line_pieces(lines.sides[i].right);
      if (visible_width(left.back()) + visible_width(right[0]) > line_width) left.push_back("");
      std::string number = row_label(blocks[b], static_cast<int>(b), static_cast<int>(i));
      if (!lines.rows) number = text("(", b + 1, ")");
      const bool tagged = lines.rows || i == 0;
      std::vector<std::string> cut(left.begin(), left.end() - 1);
      for (std::string& piece : cut) piece = "&" + piece;
      cut.push_back((cut.empty() ? "" : "&\\quad ") + left.back() + (cut.empty() ? " &= " : " = ") +
                    right[0]);
      for (std::size_t k = 1; k < right.size(); ++k) cut.push_back("&\\quad " + right[k]);
      for (std::size_t k = 0; k + 1 < cut.size(); ++k) cut[k] += " \\notag";
      cut.back() += tagged ? " \\tag{" + number.substr(1, number.size() - 2) + "}" : " \\notag";
      rows.insert(rows.end(), cut.begin(), cut.end());
    }
  }
  const std::string systems = written_out(linear_system_lines(m), Detail::full, Notation::latex);
  return "\\begin{align}\n  " + join(rows, " \\\\\n  ") + "\n\\end{align}" +
         (systems.empty() ? "" : "\n" + systems);
}

}  // namespace pendula::dae
