#include "method/tableau_text.hpp"

#include <algorithm>
#include <cctype>
#include <functional>
#include <optional>
#include <sstream>

#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"

namespace pendula::integrate {
namespace {

/// Recursive descent: sum = product {± product}, product = power {*/ power}, power = atom [^ power].
class EntryParser {
 public:
  explicit EntryParser(const std::string& source) : text_(source) {}

  Expr parse() {
    const Expr value = sum();
    if (skip() < text_.size()) fail("an operator or the end");
    return value;
  }

 private:
  static constexpr int deepest = 100;  // parentheses: bounds the stack
  static constexpr std::string_view root = "√";

  bool at_root() { return text_.compare(skip(), root.size(), root) == 0; }

  std::size_t skip() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
    return at_;
  }

  bool accept(char c) {
    if (skip() >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  [[noreturn]] void fail(const char* expected) const {
    throw Error(text("'", text_, "' is not a number: expected ", expected, " ",
                     at_ < text_.size() ? text("at '", text_.substr(at_), "'") : "at its end"));
  }

  Expr sum() {
    if (++depth_ > deepest) fail("fewer parentheses");
    Expr value = accept('-') ? -product() : (accept('+'), product());
    for (;;) {
      if (accept('+'))
        value = value + product();
      else if (accept('-'))
        value = value - product();
      else
        break;
    }
    --depth_;
    return value;
  }

  Expr product() {
    Expr value = power();
    for (;;) {
      if (accept('*'))
        value = value * power();
      else if (accept('/'))
        value = value / power();
      else if (at_root())  // 2√3
        value = value * power();
      else
        return value;
    }
  }

  Expr power() {
    if (++depth_ > deepest) fail("fewer signs and powers");
    const Expr base = accept('-') ? -power() : atom();
    const Expr value = accept('^') ? pow(base, power()) : base;
    --depth_;
    return value;
  }

  Expr atom() {
    if (accept('(')) {
      const Expr value = sum();
      if (!accept(')')) fail("')'");
      return value;
    }
    if (at_root()) {
      at_ += root.size();
      return make(Op::sqrt, atom());
    }
    if (at_ < text_.size() && std::isalpha(static_cast<unsigned char>(text_[at_]))) return named();
    return number();
  }

  Expr number() {
    const std::size_t start = at_;
    const auto digit = [&](std::size_t i) {
      return i < text_.size() && std::isdigit(static_cast<unsigned char>(text_[i]));
    };
    while (digit(at_) || (at_ < text_.size() && text_[at_] == '.')) ++at_;
    if (at_ == start) fail("a number");
    if (at_ < text_.size() && (text_[at_] == 'e' || text_[at_] == 'E')) {
      const std::size_t sign = at_ + 1;
      const bool has_sign = sign < text_.size() && (text_[sign] == '-' || text_[sign] == '+');
      if (digit(sign + has_sign)) at_ = sign + has_sign;
      while (digit(at_)) ++at_;
    }
    return parse_number(text_.substr(start, at_ - start));
  }

  Expr named() {
    const std::size_t start = at_;
    while (at_ < text_.size() && std::isalnum(static_cast<unsigned char>(text_[at_]))) ++at_;
    const std::string name = text_.substr(start, at_ - start);
    if (name == "pi") return pi();
    for (Op op = first_op; op < end_op; op = next(op)) {
      if (info(op).arity != 1 || info(op).style != Style::named || name != info(op).name) continue;
      if (!accept('(')) fail("'('");
      const Expr argument = sum();
      if (!accept(')')) fail("')'");
      return make(op, argument);
    }
    at_ = start;
    fail("a number, pi or a function such as sqrt");
  }

  const std::string& text_;
  std::size_t at_ = 0;
  int depth_ = 0;
};

/// Joins words at signs: a sign alone is no entry, and "1/4", "-", "√3/6" are one entry, as printed.
std::vector<std::string> joined_at_signs(const std::vector<std::string>& words) {
  std::vector<std::string> result;
  bool goes_on = false;
  for (const std::string& word : words) {
    const bool sign = word == "-" || word == "+";
    if ((sign || goes_on) && !result.empty())
      result.back() += word;
    else
      result.push_back(word);
    goes_on = sign;
  }
  return result;
}

/// Splits at blanks that are outside parentheses.
std::vector<std::string> split_entries(const std::string& line) {
  std::vector<std::string> result(1);
  int depth = 0;
  for (char c : line) {
    depth += (c == '(') - (c == ')');
    const bool blank = std::isspace(static_cast<unsigned char>(c)) || c == ',';
    if (!blank || depth > 0)
      result.back() += c;
    else if (!result.back().empty())
      result.emplace_back();
  }
  if (result.back().empty()) result.pop_back();
  return joined_at_signs(result);
}

struct Line {
  int number;
  std::vector<std::string> left, right;
};

std::vector<Line> split_lines(const std::string& drawing) {
  std::vector<Line> lines;
  std::istringstream in(drawing);
  std::string content;
  for (int number = 1; std::getline(in, content); ++number) {
    for (std::size_t at; (at = content.find("│")) != std::string::npos;) content.replace(at, 3, "|");
    if (content.find_first_of("0123456789") == std::string::npos &&
        content.find_first_of("|(") == std::string::npos) {
      continue;  // a blank or dashed line
    }
    if (content.find_first_not_of(" \t\r-+|=") == std::string::npos) continue;
    const std::size_t bar = content.find('|');
    const bool title = bar == std::string::npos && content.find(':') != std::string::npos;
    // the title of a printed tableau, "rk4: 4 stages, order 4, explicit"
    if (title && lines.empty()) continue;
    if (bar == std::string::npos || content.find('|', bar + 1) != std::string::npos) {
      throw Error(text("line ", number, " needs one '|' between c and the row of A: '", content, "'"));
    }
    lines.push_back({number, split_entries(content.substr(0, bar)), split_entries(content.substr(bar + 1))});
  }
  return lines;
}

Expr entry_of_line(const Line& line, const std::string& entry) {
  try {
    return parse_entry(entry);
  } catch (const Error& error) {
    throw Error(text("line ", line.number, ": ", error.what()));
  }
}

VecX weights(const Line& line, Eigen::Index s) {
  if (static_cast<Eigen::Index>(line.right.size()) != s) {
    throw Error(text("line ", line.number, " has ", counted(line.right.size(), "weight"), " for ",
                     counted(s, "stage")));
  }
  VecX b(s);
  for (Eigen::Index j = 0; j < s; ++j) b[j] = entry_of_line(line, line.right[j]);
  return b;
}

/// The printed cells: one row per stage, then b and bhat.
std::vector<std::vector<std::string>> cells(const Tableau& rk, const std::function<std::string(Expr)>& show) {
  const TableauData& data = rk.data();
  const bool triangle = rk.is_explicit() && rk.stages() > 1;
  std::vector<std::vector<std::string>> rows;
  for (int i = 0; i < rk.stages(); ++i) {
    rows.push_back({show((*data.c)[i])});
    for (int j = 0; j < rk.stages(); ++j) rows.back().push_back(triangle && j >= i ? "" : show(data.A(i, j)));
  }
  const auto add = [&](const VecX& b) {
    rows.push_back({""});
    for (int j = 0; j < rk.stages(); ++j) rows.back().push_back(show(b[j]));
  };
  add(data.b);
  if (data.bhat) add(*data.bhat);
  return rows;
}

std::string pad(const std::string& cell, int width) {
  return cell + std::string(static_cast<std::size_t>(std::max(0, width - display_width(cell))), ' ');
}

std::string repeat(const std::string& piece, int count) {
  std::string result;
  for (int i = 0; i < count; ++i) result += piece;
  return result;
}

/// The fraction to be printed, unless it is a long decimal that represents a rounded number.
std::optional<mpq_class> shown_fraction(Expr e) {
  const mpq_class* exact = exact_value(e);
  if (!exact || exact->get_den() > mpz_class("1000000000000")) return {};
  return *exact;
}

std::string show_text(Expr e) {
  if (const auto fraction = shown_fraction(e)) return fraction->get_str();
  return e.is_constant() ? rounded(constant_value(e), 8) : to_text(e);
}

std::string show_latex(Expr e) {
  const auto fraction = shown_fraction(e);
  if (!fraction) return e.is_constant() ? rounded(constant_value(e), 8) : to_latex(e);
  if (fraction->get_den() == 1) return fraction->get_str();
  const mpz_class numerator = abs(fraction->get_num());
  return text(sgn(*fraction) < 0 ? "-" : "", "\\frac{", numerator.get_str(), "}{",
              fraction->get_den().get_str(), "}");
}

std::string drawn(const std::vector<std::vector<std::string>>& rows, int stages) {
  std::vector<int> widths(rows[0].size(), 0);
  for (const auto& row : rows)
    for (std::size_t j = 0; j < row.size(); ++j) widths[j] = std::max(widths[j], display_width(row[j]));
  int total = 0;
  for (std::size_t j = 1; j < widths.size(); ++j) total += widths[j] + (j > 1 ? 2 : 0);
  std::string result;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (static_cast<int>(i) == stages)
      result += repeat("─", widths[0] + 1) + "┼" + repeat("─", total + 1) + "\n";
    std::string line = pad(rows[i][0], widths[0]) + " │ ";
    for (std::size_t j = 1; j < rows[i].size(); ++j) line += (j > 1 ? "  " : "") + pad(rows[i][j], widths[j]);
    line.erase(line.find_last_not_of(' ') + 1);
    result += line + "\n";
  }
  return result;
}

}  // namespace

Expr parse_entry(const std::string& entry) { return EntryParser(entry).parse(); }

TableauData parse_tableau(const std::string& drawing) {
  const std::vector<Line> lines = split_lines(drawing);
  const auto is_stage = [](const Line& line) { return !line.left.empty(); };
  const auto end = std::find_if_not(lines.begin(), lines.end(), is_stage);
  const Eigen::Index s = end - lines.begin();
  if (s == 0) throw Error("no line of the form 'c | a …' found");
  if (end == lines.end()) throw Error("the weights are missing; add a last line '| b1 b2 …'");
  TableauData data;
  data.A = MatX::Constant(s, s, Expr());
  data.c = VecX(s);
  for (Eigen::Index i = 0; i < s; ++i) {
    const Line& line = lines[i];
    if (line.left.size() != 1)
      throw Error(text("line ", line.number, " has ", line.left.size(), " entries left of '|', not 1"));
    if (static_cast<Eigen::Index>(line.right.size()) > s) {
      throw Error(text("line ", line.number, " has ", counted(line.right.size(), "entry"), " for ",
                       counted(s, "stage")));
    }
    (*data.c)[i] = entry_of_line(line, line.left[0]);
    for (std::size_t j = 0; j < line.right.size(); ++j)
      data.A(i, static_cast<Eigen::Index>(j)) = entry_of_line(line, line.right[j]);
  }
  data.b = weights(*end, s);
  if (end + 1 != lines.end()) data.bhat = weights(*(end + 1), s);
  if (lines.end() - end > 2) throw Error(text("line ", (end + 2)->number, " follows the weights b and bhat"));
  return data;
}

std::string Tableau::str() const {
  const std::string kind = is_explicit()              ? "explicit"
                           : is_diagonally_implicit() ? "diagonally implicit"
                                                      : "fully implicit";
  std::string head = text(name(), ": ", stages(), stages() == 1 ? " stage" : " stages", ", order ", order());
  if (data_.bhat) head += text(" (embedded ", embedded_order(), ")");
  return head + ", " + kind + "\n\n" + drawn(cells(*this, show_text), stages());
}

std::string Tableau::latex() const {
  const auto rows = cells(*this, show_latex);
  std::string result = "\\begin{array}{c|" + repeat("c", stages()) + "}\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (static_cast<int>(i) == stages()) result += "\\hline\n";
    result += join(rows[i], " & ") + (i + 1 < rows.size() ? " \\\\\n" : "\n");
  }
  return result + "\\end{array}";
}

}  // namespace pendula::integrate
