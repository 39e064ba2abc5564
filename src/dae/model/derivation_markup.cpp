#include "dae/model/derivation_markup.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

#include "dae/model/lineage.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

constexpr char begin_ref = '\x1d', end_ref = '\x1e', begin_formula = '\x1c', end_formula = '\x1f';

std::string numbers(std::span<const Expr> list) {
  std::string out;
  for (Expr e : list) out += std::to_string(e.id()) + ",";
  return out;
}

std::vector<Expr> expressions(const std::string& list) {
  std::vector<Expr> out;
  for (const char* at = list.c_str(); *at;) {
    char* end = nullptr;
    out.push_back(Expr::at(static_cast<std::uint32_t>(std::strtoul(at, &end, 10))));
    at = end + 1;
  }
  return out;
}

std::string indented(std::string grid) {
  for (std::size_t k = 0; (k = grid.find('\n', k)) != std::string::npos; k += 10)
    grid.replace(k, 1, "\n         ");
  return grid;
}

/// What stands between the marks of a reference: kind, for matrices the number of rows and a colon, ids.
std::string written(const std::string& code, Notation notation) {
  PrintOptions options = default_print_options();
  options.latex = notation == Notation::latex;
  if (code[0] == 'm') {
    const std::size_t colon = code.find(':');
    const auto list = expressions(code.substr(colon + 1));
    const Index rows = std::atol(code.c_str() + 1);
    const MatX m = Eigen::Map<const MatX>(list.data(), rows, static_cast<Index>(list.size()) / rows);
    const std::string grid = matrix_to_text(m, options);
    return options.latex ? grid : indented(grid);
  }
  const auto list = expressions(code.substr(1));
  return list.size() == 1 ? to_text(list[0], options) : vector_to_text(column(list), options);
}

struct Sign {
  const char *sign, *latex;
};

constexpr std::array signs{
    Sign{"′", "'"},         Sign{"″", "''"},
    Sign{"‴", "'''"},       Sign{"α", "\\alpha "},
    Sign{"β", "\\beta "},   Sign{"γ", "\\gamma "},
    Sign{"δ", "\\delta "},  Sign{"λ", "\\lambda "},
    Sign{"μ", "\\mu "},     Sign{"θ", "\\theta "},
    Sign{"φ", "\\varphi "}, Sign{"ω", "\\omega "},
    Sign{"π", "\\pi "},     Sign{"∂", "\\partial "},
    Sign{"·", "\\cdot "},   Sign{"±", "\\pm "},
    Sign{"√", "\\surd "},   Sign{"≠", "\\ne "},
    Sign{"≤", "\\le "},     Sign{"≥", "\\ge "},
    Sign{"→", "\\to "},     Sign{"ᵀ", "^{\\mathsf T}"},
    Sign{"⁻", "^{-}"},      Sign{"⁰", "^{0}"},
    Sign{"¹", "^{1}"},      Sign{"²", "^{2}"},
    Sign{"³", "^{3}"},      Sign{"⁴", "^{4}"},
    Sign{"⁵", "^{5}"},      Sign{"⁶", "^{6}"},
    Sign{"⁷", "^{7}"},      Sign{"⁸", "^{8}"},
    Sign{"⁹", "^{9}"},      Sign{"₀", "_{0}"},
    Sign{"₁", "_{1}"},      Sign{"₂", "_{2}"},
    Sign{"₃", "_{3}"},      Sign{"₄", "_{4}"},
    Sign{"₅", "_{5}"},      Sign{"₆", "_{6}"},
    Sign{"₇", "_{7}"},      Sign{"₈", "_{8}"},
    Sign{"₉", "_{9}"},
};

const Sign* sign_at(const std::string& s, std::size_t i) {
  for (const Sign& sign : signs)
    if (s.compare(i, std::char_traits<char>::length(sign.sign), sign.sign) == 0) return &sign;
  return nullptr;
}

/// A prime carries its own exponent: what it follows must be closed first.
std::string two_indices_as_one(std::string latex) {
  for (const char* between : {"}^{", "}_{"})
    for (std::size_t k = 0; (k = latex.find(between, k)) != std::string::npos;) {
      const std::size_t open = latex.rfind('{', k);
      const bool same = open != std::string::npos && open > 0 && latex[open - 1] == between[1];
      if (same)
        latex.erase(k, 3);
      else
        k += 3;
    }
  return latex;
}

std::string escaped(char c, bool inside) {
  if (c == '{' || c == '}' || c == '#' || c == '%' || c == '&' || c == '_') return std::string("\\") + c;
  if (c == '"') return "''";
  if (!inside && (c == '^' || c == '~')) return std::string("\\") + c + "{}";
  return std::string(1, c);
}

}  // namespace

std::string ref(Expr e) { return text(begin_ref, "v", e.id(), ",", end_ref); }
std::string ref(const VecX& v) { return text(begin_ref, "v", numbers(entries(v)), end_ref); }
std::string ref(const MatX& m) { return text(begin_ref, "m", m.rows(), ":", numbers(entries(m)), end_ref); }

std::string latex_words(const std::string& words, bool inside) {
  std::string out;
  for (std::size_t i = 0; i < words.size();) {
    std::string mathematics;
    while (i < words.size()) {
      const Sign* sign = sign_at(words, i);
      if (!sign) break;
      mathematics += sign->latex;
      i += std::char_traits<char>::length(sign->sign);
    }
    if (!mathematics.empty()) {
      mathematics = two_indices_as_one(mathematics);
      out += inside ? mathematics : "$" + mathematics + "$";
    } else {
      out += escaped(words[i++], inside);
    }
  }
  return out;
}

std::string rendered(const std::string& line, Notation notation) {
  const bool latex = notation == Notation::latex;
  std::string out, words;
  bool inside = false;
  const auto flush = [&] {
    out += latex ? latex_words(words, inside) : words;
    words.clear();
  };
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == begin_formula || line[i] == end_formula) {
      flush();
      inside = line[i] == begin_formula;
      if (latex) out += "$";
    } else if (line[i] == begin_ref) {
      flush();
      const std::size_t end = line.find(end_ref, i);
      const std::string e = written(line.substr(i + 1, end - i - 1), notation);
      out += latex && !inside ? "$" + e + "$" : e;
      i = end;
    } else {
      words += line[i];
    }
  }
  flush();
  return out;
}

std::string trace_latex(const Model& m) {
  std::string out = m.parent ? trace_latex(*m.parent) : "";
  for (const std::string& line : m.trace) {
    const std::size_t first = line.find_first_not_of(' ');
    if (first == std::string::npos) continue;
    out += (first > 0 ? "\\quad " : "") + rendered(line.substr(first), Notation::latex) + "\\\\\n";
  }
  return out;
}

namespace {

std::string row_latex(const VecX& left, const VecX& right) {
  PrintOptions options = default_print_options();
  options.latex = true;
  const auto side = [&](const VecX& v) {
    if (v.size() == 1) return to_text(v[0], options);
    if (std::all_of(v.begin(), v.end(), [](Expr e) { return e.is_zero(); })) return std::string("0");
    return vector_to_text(v, options);
  };
  return side(left) + " &= " + side(right);
}

}  // namespace

std::string latex(const Model& m) {
  std::vector<std::string> rows;
  for (std::size_t b = 0; b < m.blocks.size(); ++b)
    rows.push_back(row_latex(m.blocks[b].lhs, m.blocks[b].rhs) + text(" \\tag{", b + 1, "}"));
  return "\\begin{align}\n  " + join(rows, " \\\\\n  ") + "\n\\end{align}";
}

std::string trace(const Model& m) {
  std::string lines = m.parent ? trace(*m.parent) : "";
  for (const std::string& line : m.trace) lines += rendered(line) + "\n";
  return lines;
}

}  // namespace pendula::dae
