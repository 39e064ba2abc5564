// LaTeX: \ddot{x}, \mathbf{p}_1^\top \mathbf{p}_1, \frac{…}{…}, \begin{cases}. The text is valid
// in math mode.
#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/print/print_notation.hpp"

namespace pendula {
namespace {

std::string braced(const std::string& s) { return "{" + s + "}"; }

/// A letter, or an upright word; Greek names become commands.
std::string letters(const std::string& head) {
  if (!greek_letter(head).empty()) return head == "epsilon" || head == "phi" ? "\\var" + head : "\\" + head;
  if (head.size() == 1 || static_cast<unsigned char>(head[0]) >= 0x80) return head;
  std::string escaped;
  for (char c : head) escaped += c == '_' ? std::string("\\_") : std::string(1, c);
  return "\\mathrm{" + escaped + "}";
}

std::string below_line(const std::string& below) {
  if (below.empty()) return "";
  if (below.size() == 1) return "_" + below;
  if (!greek_letter(below).empty()) return "_{" + letters(below) + "}";
  const bool number = below.find_first_not_of("0123456789") == std::string::npos;
  std::string escaped;
  for (char c : below) escaped += c == '_' ? std::string("\\_") : std::string(1, c);
  return number ? "_{" + below + "}" : "_{\\mathrm{" + escaped + "}}";
}

std::string dotted(const std::string& head, int order) {
  static constexpr const char* accents[] = {"", "\\dot", "\\ddot", "\\dddot"};
  return order == 0 ? head : order < 4 ? accents[order] + braced(head) : head;
}

/// From the fourth derivative on, the order is written as a superscript.
std::string above_line(int order) { return order < 4 ? "" : text("^{(", order, ")}"); }

constexpr std::array angle_functions{"\\sinh", "\\cosh", "\\tanh", "\\sin", "\\cos", "\\tan"};

/// The length of \sin, \cos … if the piece is a single function call; the exponent is inserted there:
/// \sin^2\theta, \sin^2\left(2 x\right). 0 for other pieces.
std::size_t name_of_function(const Piece& p) {
  const std::string& text = p.text;
  for (const char* name : angle_functions) {
    if (p.bind != Bind::atom || !text.starts_with(name)) continue;
    const std::size_t end = std::strlen(name);
    if (text.compare(end, 6, "\\left(") != 0) return text.find("\\left(") == std::string::npos ? end : 0;
    int depth = 0;  // the first parenthesis must close at the end
    for (std::size_t i = end; i < text.size(); ++i) {
      if (text.compare(i, 6, "\\left(") == 0) ++depth;
      if (text.compare(i, 7, "\\right)") == 0 && --depth == 0) return i + 7 == text.size() ? end : 0;
    }
  }
  return 0;
}

/// A single symbol with its sub- and superscripts, which needs no parentheses after \sin.
bool is_symbol(const Piece& p) {
  return p.bind == Bind::atom && p.text.find_first_of(" (|") == std::string::npos &&
         p.text.find("\\frac") == std::string::npos;
}

class Latex final : public Notation {
 public:
  std::string parenthesised(const std::string& inside) const override {
    return "\\left(" + inside + "\\right)";
  }

  Piece symbol(const Symbol& s) const override {
    if (const auto d = stands_for(s.base)) return symbol(symbol_of(derivative_leaf(*d, s.order)));
    if (s.component > 0) {
      const SplitName name = split_name(s.vector);
      const std::string below =
          name.below.empty() ? std::to_string(s.component) : text(name.below, ",", s.component);
      return set(letters(name.head), below.size() > 1 ? "_{" + below + "}" : "_" + below, s.order);
    }
    const SplitName name = split_name(s.name);
    return set(letters(name.head), below_line(name.below), s.order);
  }

  Piece column(const std::string& name, int order) const override {
    const SplitName s = split_name(name);
    const bool is_greek = !greek_letter(s.head).empty();
    return set((is_greek ? "\\boldsymbol" : "\\mathbf") + braced(is_greek ? letters(s.head) : s.head),
               below_line(s.below), order);
  }

  Piece solution(int i) const override { return {"(A^{-1} b)_{" + std::to_string(i) + "}"}; }
  Piece unit_vector(int i) const override { return {"\\mathbf{e}" + below_line(std::to_string(i))}; }

  Piece power(const Piece& base, const mpq_class& exponent) const override {
    if (exponent == 1) return base;
    const std::string n = exponent.get_str();
    if (const std::size_t end = name_of_function(base); end > 0 && exponent.get_den() == 1)
      return {base.text.substr(0, end) + "^" + (n.size() == 1 ? n : braced(n)) + base.text.substr(end),
              Bind::power};
    return {within(base, Bind::atom) + "^" + (n.size() == 1 ? n : braced(n)), Bind::power};
  }

  Piece power(const Piece& base, const Piece& exponent) const override {
    return {within(base, Bind::atom) + "^" + braced(exponent.text), Bind::power};
  }

  Piece product(const Number& coefficient, std::vector<Piece> above,
                std::vector<Piece> below) const override {
    const NumberText c = numbers(coefficient, !above.empty());
    if (c.above != "1" || above.empty()) above.insert(above.begin(), {c.above});
    if (!c.below.empty()) below.insert(below.begin(), {c.below});
    if (below.empty()) return above.size() == 1 ? above[0] : Piece{juxtaposed(above), Bind::product};
    return {"\\frac" + braced(juxtaposed(above)) + braced(juxtaposed(below)), Bind::product};
  }

  Piece dot(const Piece& a, const Piece& b) const override {
    const bool raised = a.bind == Bind::power;  // has a superscript already
    return {(raised ? parenthesised(a.text) : within(a, Bind::power)) + "^\\top " + within(b, Bind::power),
            Bind::dot};
  }

  Piece root(const Piece& a) const override { return {"\\sqrt" + braced(a.text)}; }
  Piece absolute(const Piece& a) const override { return {"\\left|" + a.text + "\\right|"}; }
  Piece norm(const Piece& a) const override { return {"\\left\\|" + a.text + "\\right\\|"}; }

  Piece function(Op op, const std::vector<Piece>& args) const override {
    switch (op) {
      case Op::lt:
      case Op::le:
        return {args[0].text + " " + info(op).latex + " " + args[1].text, Bind::condition};
      case Op::both:
      case Op::either:
        return {parenthesised(args[0].text) + " " + info(op).latex + " " + parenthesised(args[1].text),
                Bind::condition};
      case Op::ifelse:
        return {"\\begin{cases} " + args[1].text + " & \\text{if } " + args[0].text + " \\\\ " +
                args[2].text + " & \\text{else} \\end{cases}"};
      default: {
        const std::string name = info(op).latex;
        const bool angle =
            std::find(angle_functions.begin(), angle_functions.end(), name) != angle_functions.end();
        if (angle && is_symbol(args[0])) return {name + (args[0].text[0] == '\\' ? "" : " ") + args[0].text};
        return {name + list(args).text};
      }
    }
  }

  Piece call(const std::string& name, const std::vector<Piece>& args) const override {
    return {name_of(name) + list(args).text};
  }

  Piece partial(const std::string& name, const std::vector<Piece>& wrt) const override {
    std::string below;
    for (std::size_t i = 0, n; i < wrt.size(); i += n) {
      for (n = 1; i + n < wrt.size() && wrt[i + n].text == wrt[i].text;) ++n;
      below += (i ? " \\partial " : "\\partial ") + wrt[i].text + (n > 1 ? text("^{", n, "}") : "");
    }
    const std::string order = wrt.size() > 1 ? text("^{", wrt.size(), "}") : "";
    return {"\\frac{\\partial" + order + " " + name_of(name) + "}" + braced(below), Bind::quotient};
  }

  Piece partial_at(const std::string& name, const std::vector<int>& places,
                   const std::vector<Piece>& args) const override {
    std::string d;
    for (int place : places) d += text("\\partial_{", place, "} ");
    return {d + name_of(name) + list(args).text};
  }

  Piece list(const std::vector<Piece>& entries) const override {
    std::vector<std::string> texts;
    for (const Piece& p : entries) texts.push_back(p.text);
    return {parenthesised(join(texts, ", "))};
  }

  Piece elided(const std::string& what) const override { return {"\\langle\\text{" + what + "}\\rangle"}; }

 private:
  static std::string name_of(const std::string& name) {
    const SplitName s = split_name(name);
    return letters(s.head) + below_line(s.below);
  }

  static Piece set(const std::string& head, const std::string& below, int order) {
    return {dotted(head, order) + below + above_line(order), order < 4 ? Bind::atom : Bind::power};
  }

  /// 1e-09 is written as 10^{-9}.
  static NumberText numbers(const Number& magnitude, bool has_factors = false) {
    NumberText n = has_factors ? coefficient_text(magnitude) : number_text(magnitude);
    if (const std::size_t e = n.above.find('e'); e != std::string::npos)
      n.above = text(n.above.substr(0, e), " \\cdot 10^{", std::stol(n.above.substr(e + 1)), "}");
    return n;
  }

  std::string juxtaposed(const std::vector<Piece>& factors) const {
    std::string out;
    for (const Piece& p : factors) {
      const std::string next = within(p, factors.size() == 1 ? Bind::sum : Bind::product);
      const bool digit = std::isdigit(static_cast<unsigned char>(next[0]));
      out += (out.empty() ? "" : digit ? " \\cdot " : " ") + next;
    }
    return out;
  }
};

}  // namespace

const Notation& latex_notation() {
  static const Latex notation;
  return notation;
}

}  // namespace pendula
