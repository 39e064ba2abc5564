#include "dae/model/derivation_markup.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "dae/model/equation_lines.hpp"
#include "dae/model/latex_lines.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/truncated_text.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

constexpr char begin_ref = '\x1d', end_ref = '\x1e', begin_formula = '\x1c', end_formula = '\x1f';
constexpr char from_full = '\x1a', from_every = '\x1b';

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

/// "p" or "r", the function, a colon and the ids of x: ∂L/∂x or d/dt ∂L/∂x.
std::string written_partial(const std::string& code, const PrintOptions& options) {
  const std::size_t colon = code.find(':');
  const std::string function = code.substr(1, colon - 1);
  const auto list = expressions(code.substr(colon + 1));
  const std::string x = list.size() == 1 ? to_text(list[0], options) : vector_to_text(column(list), options);
  const bool rate = code[0] == 'r';
  if (!options.latex) return text(rate ? "d/dt " : "", "∂", function, "/∂", x);
  return text(rate ? "\\frac{\\mathrm{d}}{\\mathrm{d}t} " : "", "\\frac{\\partial ",
              latex_words(function, true), "}{\\partial ", x, "}");
}

/// The text between the marks of a reference: kind, for matrices the number of rows and a colon, ids.
std::string written(const std::string& code, Notation notation) {
  PrintOptions options = default_print_options();
  options.latex = notation == Notation::latex;
  if (code[0] == 'p' || code[0] == 'r') return written_partial(code, options);
  if (code[0] == 'm') {
    const std::size_t colon = code.find(':');
    const auto list = expressions(code.substr(colon + 1));
    const Index rows = std::atol(code.c_str() + 1);
    const MatX m = Eigen::Map<const MatX>(list.data(), rows, static_cast<Index>(list.size()) / rows);
    return matrix_to_text(m, options);
  }
  const auto list = expressions(code.substr(1));
  if (const std::string elided = unprintable(list); !elided.empty()) return elided;
  if (code[0] == 'u') return side(column(list), notation);
  return list.size() == 1 ? to_text(list[0], options) : vector_to_text(column(list), options);
}

struct Sign {
  const char *sign, *latex;
};

constexpr std::array signs{
    Sign{"′", "'"},       Sign{"″", "''"},         Sign{"‴", "'''"},        Sign{"α", "\\alpha "},
    Sign{"β", "\\beta "}, Sign{"γ", "\\gamma "},   Sign{"δ", "\\delta "},   Sign{"λ", "\\lambda "},
    Sign{"μ", "\\mu "},   Sign{"θ", "\\theta "},   Sign{"φ", "\\varphi "},  Sign{"ω", "\\omega "},
    Sign{"π", "\\pi "},   Sign{"∂", "\\partial "}, Sign{"·", "\\cdot "},    Sign{"±", "\\pm "},
    Sign{"√", "\\surd "}, Sign{"∈", "\\in "},      Sign{"ℝ", "\\mathbf R"}, Sign{"≠", "\\ne "},
    Sign{"≤", "\\le "},   Sign{"≥", "\\ge "},      Sign{"→", "\\to "},      Sign{"ᵀ", "^{\\mathsf T}"},
    Sign{"⁻", "^{-}"},    Sign{"⁰", "^{0}"},       Sign{"¹", "^{1}"},       Sign{"²", "^{2}"},
    Sign{"³", "^{3}"},    Sign{"⁴", "^{4}"},       Sign{"⁵", "^{5}"},       Sign{"⁶", "^{6}"},
    Sign{"⁷", "^{7}"},    Sign{"⁸", "^{8}"},       Sign{"⁹", "^{9}"},       Sign{"₀", "_{0}"},
    Sign{"₁", "_{1}"},    Sign{"₂", "_{2}"},       Sign{"₃", "_{3}"},       Sign{"₄", "_{4}"},
    Sign{"₅", "_{5}"},    Sign{"₆", "_{6}"},       Sign{"₇", "_{7}"},       Sign{"₈", "_{8}"},
    Sign{"₉", "_{9}"},    Sign{"…", "\\ldots "},
};

/// Replacements within formulas only, not between words.
constexpr std::array in_formulas{
    Sign{"d/dt ∂L/∂q′", "\\frac{\\mathrm d}{\\mathrm dt} \\frac{\\partial L}{\\partial \\dot{q}}"},
    Sign{"∂L/∂q", "\\frac{\\partial L}{\\partial q}"},
    Sign{"(∂C/∂q)ᵀ", "\\left(\\frac{\\partial C}{\\partial q}\\right)^{\\mathsf T}"},
    Sign{"∂²T/∂q′²", "\\frac{\\partial^2 T}{\\partial \\dot{q}^2}"},
    Sign{"∂C/∂q", "\\frac{\\partial C}{\\partial q}"},
    Sign{"d²/dt²", "\\mathrm{d}^2/\\mathrm{d}t^2"},
    Sign{"d/dt", "\\mathrm{d}/\\mathrm{d}t"},
    Sign{"[W Cqᵀ; Cq 0]", "\\begin{bmatrix} W & C_q^{\\mathsf T} \\\\ C_q & 0 \\end{bmatrix}"},
    Sign{"Cq", "C_q"},
    Sign{"det ", "\\det "},
};

const Sign* sign_at(const std::string& s, std::size_t i, bool inside) {
  const auto stands_here = [&](const Sign& sign) {
    return s.compare(i, std::char_traits<char>::length(sign.sign), sign.sign) == 0;
  };
  if (inside)
    if (const auto it = std::ranges::find_if(in_formulas, stands_here); it != in_formulas.end()) return &*it;
  const auto it = std::ranges::find_if(signs, stands_here);
  return it == signs.end() ? nullptr : &*it;
}

/// Braces what a prime follows, since a prime carries an exponent of its own.
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

/// Turns primes after a letter and its index into dots: q_{1}'' becomes \ddot{q}_{1}.
std::string with_dots(std::string latex) {
  constexpr std::array accents{"\\dot{", "\\ddot{", "\\dddot{"};
  for (std::size_t at = 0; (at = latex.find('\'', at)) != std::string::npos;) {
    const std::size_t primes = latex.find_first_not_of('\'', at) - at;
    std::size_t end = at;
    if (end > 0 && latex[end - 1] == '}') end = latex.rfind("_{", end);
    const std::size_t count = std::min(primes, latex.size() - at);
    if (end == 0 || end == std::string::npos || count > accents.size() ||
        std::isalpha(static_cast<unsigned char>(latex[end - 1])) == 0) {
      at += count;
      continue;
    }
    latex.erase(at, count);
    const std::string accent = accents[count - 1];
    latex.insert(end, "}").insert(end - 1, accent);
    at += accent.size() + 1;
  }
  return latex;
}

/// Removes and returns the symbol at the end of `text`, x or C_A; empty if there is none.
std::string taken_symbol(std::string& text) {
  const auto is_letter = [&](std::size_t i) {
    return std::isalnum(static_cast<unsigned char>(text[i])) != 0;
  };
  std::size_t last = text.size();
  while (last > 0 && is_letter(last - 1)) --last;
  std::string index = text.substr(last);
  std::size_t first = last;
  if (last > 2 && text.compare(last - 2, 2, "\\_") == 0) {
    first = last - 2;
    while (first > 0 && is_letter(first - 1)) --first;
    index = "_{\\mathrm{" + index + "}}";
  } else {
    index.clear();
    last = text.size();
  }
  const std::string letter = text.substr(first, (index.empty() ? last : last - 2) - first);
  if (letter.size() != 1 || std::isalpha(static_cast<unsigned char>(letter[0])) == 0) return "";
  text.erase(first);
  return letter + index;
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

std::string ref_side(const VecX& v) { return text(begin_ref, "u", numbers(entries(v)), end_ref); }
std::string ref_partial(const std::string& function, const VecX& x) {
  return text(begin_ref, "p", function, ":", numbers(entries(x)), end_ref);
}
std::string ref_rate_of_partial(const std::string& function, const VecX& x) {
  return text(begin_ref, "r", function, ":", numbers(entries(x)), end_ref);
}

std::string shown_from(Detail least, const std::string& line) {
  return (least == Detail::brief ? "" : std::string(1, least == Detail::full ? from_full : from_every)) +
         line;
}

bool is_shown(const std::string& line, Detail detail) {
  if (line.empty() || detail == Detail::every) return true;
  return line[0] != from_every && (detail == Detail::full || line[0] != from_full);
}

/// Is the letter at `i` a word of its own that denotes a quantity, as in "neither q nor z"?
static bool is_symbol_alone(const std::string& words, std::size_t i) {
  const auto borders = [&](std::size_t k, const char* marks) {
    return k >= words.size() || std::strchr(marks, words[k]) != nullptr;
  };
  return std::strchr("CLQTVWpqruvwxyz", words[i]) != nullptr && borders(i - 1, " (") &&
         borders(i + 1, " ,.:;)");
}

std::string latex_words(const std::string& words, bool inside) {
  std::string out;
  for (std::size_t i = 0; i < words.size();) {
    std::string mathematics;
    while (i < words.size()) {
      const Sign* sign = sign_at(words, i, inside);
      if (!sign) break;
      mathematics += sign->latex;
      i += std::char_traits<char>::length(sign->sign);
    }
    if (!mathematics.empty()) {
      if (!inside) mathematics = with_dots(taken_symbol(out) + mathematics);
      mathematics = two_indices_as_one(mathematics);
      out += inside ? mathematics : "$" + mathematics + "$";
    } else {
      const bool symbol = !inside && is_symbol_alone(words, i);
      const std::string sign = escaped(words[i++], inside);
      out += symbol ? "$" + sign + "$" : sign;
    }
  }
  return inside ? with_dots(out) : out;
}

/// Is the line a single formula, to be displayed?
static bool is_display(const std::string& line) {
  return line.size() > 1 && line.front() == begin_formula && line.find(end_formula) == line.size() - 1;
}

/// Indents the lines of a grid so that they align to the right of `before`.
static std::string aligned(std::string grid, const std::string& before) {
  const std::string blanks(static_cast<std::size_t>(display_width(before.substr(before.rfind('\n') + 1))),
                           ' ');
  for (std::size_t k = 0; (k = grid.find('\n', k)) != std::string::npos; k += blanks.size() + 1)
    grid.insert(k + 1, blanks);
  return grid;
}

std::string rendered(const std::string& line, Notation notation) {
  const bool latex = notation == Notation::latex;
  std::string out, words;
  bool inside = false;
  std::size_t start = 0;  // of the formula
  const auto flush = [&] {
    out += latex ? latex_words(words, inside) : words;
    words.clear();
  };
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == from_full || line[i] == from_every) continue;
    if (line[i] == begin_formula || line[i] == end_formula) {
      flush();
      inside = line[i] == begin_formula;
      if (!inside && !is_display(line) && out.find("\\frac", start) != std::string::npos)
        out.insert(start, "\\displaystyle ");
      if (latex) out += "$";
      start = out.size();
    } else if (line[i] == begin_ref) {
      flush();
      const std::size_t end = line.find(end_ref, i);
      std::string e = written(line.substr(i + 1, end - i - 1), notation);
      if (!latex) e = aligned(e, out);
      const bool tall = latex && !inside && e.find("\\frac") != std::string::npos;
      out += latex && !inside ? text("$", tall ? "\\displaystyle " : "", e, "$") : e;
      i = end;
    } else {
      words += line[i];
    }
  }
  flush();
  return out;
}

namespace {

/// The label "2a" of a line "(2a)  formula", or nothing.
std::string label_of_formula(const std::string& line) {
  const std::size_t close = line.find(')'), open = line.find(begin_formula);
  const bool only = open != std::string::npos && is_display(line.substr(open));
  if (line[0] != '(' || !only || line.find_first_not_of(' ', close + 1) != open) return "";
  return line.substr(1, close - 1);
}

constexpr const char *line_end = "\\\\\n", *tall_line = "\\\\[1ex]\n";

std::string latex_line(std::string line) {
  if (!line.empty() && (line[0] == from_full || line[0] == from_every)) line.erase(0, 1);
  const std::size_t first = line.find_first_not_of(' ');
  if (first == std::string::npos) return "";
  line.erase(0, first);
  const std::string label = label_of_formula(line);
  if (!label.empty()) line.erase(0, line.find(begin_formula));
  const std::string set = rendered(line, Notation::latex);
  if (is_display(line))
    return text("\\begin{equation*}\n", broken_equation(set.substr(1, set.size() - 2)),
                label.empty() ? "" : " \\tag{" + label + "}", "\n\\end{equation*}\n");
  const bool tall =
      set.find("\\displaystyle") != std::string::npos && set.find("\\frac") != std::string::npos;
  return text(first > 0 ? "\\quad " : "", set, tall ? tall_line : line_end);
}

/// Appends a line; a line that continues a sentence stays in its paragraph.
void append_latex(std::string& out, const std::string& line) {
  const std::string set = latex_line(line), indented = "\\quad ";
  const std::string paragraph = out.ends_with(tall_line) ? tall_line : line_end;
  const std::size_t start = set.compare(0, indented.size(), indented) == 0 ? indented.size() : 0;
  const bool goes_on = start < set.size() && std::islower(static_cast<unsigned char>(set[start])) != 0 &&
                       out.size() > paragraph.size() && out.ends_with(paragraph) &&
                       std::isalpha(static_cast<unsigned char>(out[out.size() - paragraph.size() - 1])) != 0;
  if (goes_on) out.replace(out.size() - paragraph.size(), paragraph.size(), " ");
  out += goes_on ? set.substr(start) : set;
}

}  // namespace

std::string written_out(const std::vector<std::string>& lines, Detail detail, Notation notation) {
  std::string out;
  for (const std::string& line : lines) {
    if (!is_shown(line, detail)) continue;
    if (notation == Notation::latex)
      append_latex(out, line);
    else
      out += rendered(line) + "\n";
  }
  return out;
}

std::string trace(const Model& m, Detail detail, Notation notation) {
  return (m.parent ? trace(*m.parent, detail, notation) : "") + written_out(m.trace, detail, notation);
}

}  // namespace pendula::dae
