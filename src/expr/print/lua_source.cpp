// to_code: an expression as Lua text (defined in print.hpp). One pass over the nodes, operands first. The
// text of an operand is moved into that of its only user; it becomes an entry of the table e if it has
// several users or would exceed the nesting limit of Lua's parser (200 levels).
#include <cstdlib>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/graph/solve.hpp"
#include "expr/print/print.hpp"

namespace pendula {
namespace {

constexpr int deepest_inline = 40;      // Lua's compiler accepts 200 levels of nesting (LUAI_MAXCCALLS)
constexpr double longest_inline = 100;  // nodes; longer expressions use a table

enum Strength { sums = 1, products = 2, signs = 3, powers = 4, whole = 5 };  // Lua's precedence, ascending

struct Snippet {
  std::string text;
  int strength = whole;
  int depth = 0;
};

std::string quoted(const std::string& name) { return "\"" + name + "\""; }

/// A constant in a form that Lua reads exactly; `exact`: as an expression even if no other operand is one.
Snippet constant_code(Expr e, bool exact) {
  const mpq_class* q = exact_value(e);
  if (!q) return {shortest(constant_value(e)), constant_value(e) < 0 ? signs : whole};
  const double d = constant_value(e);
  const std::string plain = q->get_den() == 1 && q->get_num().fits_slong_p() ? q->get_str() : shortest(d);
  const bool safe = plain.size() <= 15 &&  // digits that every double keeps
                    Expr(std::strtod(plain.c_str(), nullptr)) == e;
  if (exact || !safe) return {"rational(" + quoted(q->get_str()) + ")"};
  return {plain, *q < 0 ? signs : whole};
}

std::string default_of(Expr parameter) {
  const auto& value = symbol_of(parameter).value;
  if (!value || !value->is_constant()) return "";
  return constant_code(*value, false).text;
}

/// param("L", {1, 2})[1] where every component has a value; a component alone otherwise.
std::string parameter_code(Expr e, const Symbol& s, const std::vector<Expr>& column) {
  std::vector<std::string> values;
  if (s.component > 0)
    for (Expr c : column) values.push_back(default_of(c));
  if (!values.empty() && std::find(values.begin(), values.end(), "") == values.end())
    return text("param(", quoted(s.vector), ", {", join(values, ", "), "})[", s.component, "]");
  const std::string value = default_of(e);
  return "param(" + quoted(s.name) + (value.empty() ? "" : ", " + value) + ")";
}

Snippet symbol_code(Expr e) {
  const Symbol& s = symbol_of(e);
  if (s.kind == Kind::time) return {"t"};
  if (s.kind == Kind::constant) return {s.name};
  std::vector<Expr> column = vector_components(s.vector);
  const auto place = static_cast<std::size_t>(s.component);
  if (place == 0 || column.size() < place || column[place - 1] != s.base) column.clear();
  if (s.kind == Kind::parameter) return {parameter_code(e, s, column)};
  const std::string kind = s.kind == Kind::input ? "input" : "var";
  const std::string base =
      column.empty() ? text(kind, "(", quoted(s.name), ")")
                     : text(kind, "(", quoted(s.vector), ", ", column.size(), ")[", s.component, "]");
  if (s.order == 0) return {base};
  return {s.order == 1 ? "der(" + base + ")" : text("der(", base, ", ", s.order, ")")};
}

std::string named(Op op) { return op == Op::both ? "all" : op == Op::either ? "any" : info(op).name; }

std::string within(const Snippet& s, int least) { return s.strength < least ? "(" + s.text + ")" : s.text; }

class CodeWriter {
 public:
  explicit CodeWriter(Expr e) : output_(e), nodes_(topological({&e, 1})) {
    std::unordered_map<Expr, double> size;
    for (Expr node : nodes_) {
      double n = 1;
      for (Expr operand : node.operands()) {
        n = std::min(n + size[operand], 1e300);  // stays finite
        ++uses_[operand];
      }
      size[node] = n;
    }
    table_ = size[e] > longest_inline;
  }

  std::string write() {
    for (Expr node : nodes_) {
      Snippet s = code(node);
      const bool shared = uses_[node] > 1 && !node.is_constant();
      if (node != output_ && (s.depth >= deepest_inline || (table_ && shared))) s = stored(std::move(s));
      text_[node] = std::move(s);
    }
    Snippet& last = text_[output_];
    if (statements_.empty()) return std::move(last.text);
    return "(function()\nlocal e = {}\n" + statements_ + "return " + last.text + "\nend)()";
  }

 private:
  Snippet stored(Snippet s) {
    const std::string entry = text("e[", ++entries_, "]");
    statements_ += entry + " = " + s.text + "\n";
    return {entry};
  }

  /// The text of an operand; an operation on constants alone must not be computed by Lua.
  Snippet operand(Expr e, bool exact = false) {
    if (e.is_constant()) return constant_code(e, exact);
    return uses_[e] > 1 ? text_[e] : std::move(text_[e]);
  }

  Snippet code(Expr e) {
    if (e.is_constant()) return constant_code(e, true);
    if (e.is_symbol()) return symbol_code(e);
    if (e.op() == Op::call) return call_code(call_of(e));
    if (e.op() == Op::solve) return solution_code(e);
    const auto x = e.operands();
    const bool exact = std::all_of(x.begin(), x.end(), [](Expr o) { return o.is_constant(); });
    if (info(e.op()).style != Style::infix) {
      std::vector<Snippet> args;
      for (Expr o : x) args.push_back(operand(o, exact));
      return applied(named(e.op()), std::move(args));
    }
    Expr a = x[0], b = x.size() > 1 ? x[1] : Expr(0);
    // Numbers precede other factors. A sum with a number may fold in one order of its operands;
    // keep the other.
    const bool commutes = e.op() == Op::add || e.op() == Op::mul;
    if (e.op() == Op::mul && b.is_constant()) std::swap(a, b);
    if (commutes && make(e.op(), a, b) != e) std::swap(a, b);
    Snippet left = operand(a, exact);
    if (e.op() == Op::neg) {
      const bool sign = left.text[0] == '-';
      return {"-" + within(left, sign ? whole : signs), signs, left.depth + 1};
    }
    Snippet right = operand(b);
    return infix(e.op(), std::move(left), std::move(right));
  }

  static Snippet infix(Op op, Snippet a, Snippet b) {
    const int depth = std::max(a.depth, b.depth) + 1;
    switch (op) {
      case Op::add:
        return {a.text + " + " + within(b, products), sums, depth};
      case Op::sub:
        return {a.text + " - " + within(b, products), sums, depth};
      case Op::mul:
        return {within(a, products) + "*" + within(b, signs), products, depth};
      case Op::div:
        return {within(a, products) + "/" + within(b, signs), products, depth};
      default:
        return {within(a, whole) + "^" + within(b, whole), powers, depth};
    }
  }

  static Snippet applied(const std::string& function, std::vector<Snippet> args) {
    Snippet s{function + "("};
    for (std::size_t i = 0; i < args.size(); ++i) {
      s.text += (i ? ", " : "") + args[i].text;
      s.depth = std::max(s.depth, args[i].depth);
    }
    s.text += ")";
    ++s.depth;
    return s;
  }

  /// func("g")(vec{…}, z), with arguments grouped as in the original call.
  static Snippet application(const FunctionCall& f, std::vector<Snippet> args) {
    std::vector<Snippet> grouped;
    auto next = args.begin();
    for (int size : f.groups) {
      if (size == 1) {
        grouped.push_back(*next++);
        continue;
      }
      std::vector<Snippet> entries(next, next + size);
      next += size;
      Snippet list = listed(std::move(entries));
      list.text.insert(0, "vec");
      grouped.push_back(std::move(list));
    }
    return applied("func(" + quoted(f.name) + ")", std::move(grouped));
  }

  /// A formal partial derivative is formed with respect to placeholders, for which the
  /// arguments are substituted.
  Snippet call_code(const FunctionCall& f) {
    std::vector<Snippet> args;
    const bool differentiated = std::any_of(f.partial.begin(), f.partial.end(), [](int n) { return n > 0; });
    for (Expr a : f.arguments) args.push_back(operand(a));
    if (!differentiated) return application(f, std::move(args));
    std::vector<Snippet> places;
    for (std::size_t i = 0; i < args.size(); ++i) places.push_back({text("var(\"arg", i + 1, "\")")});
    Snippet d = application(f, places);
    for (std::size_t i = 0; i < args.size(); ++i)
      if (f.partial[i] > 0) d.text = text("diff(", d.text, ", ", places[i].text, ", ", f.partial[i], ")");
    std::string replacements;
    int depth = 0;
    for (std::size_t i = 0; i < args.size(); ++i) {
      replacements += text(i ? ", [" : "[", places[i].text, "] = ", args[i].text);
      depth = std::max(depth, args[i].depth);
    }
    return {"subs(" + d.text + ", {" + replacements + "})", whole, depth + 3};
  }

  /// A linear system is solved once, in the table; its components are entries of that column.
  Snippet solution_code(Expr e) {
    if (component_of(e) > 0) return {text(solutions_.at(head_of(e)), "[", component_of(e) + 1, "]")};
    const LinearSystem& system = system_of(e);
    const int n = system.size;
    std::vector<Snippet> rows, right;
    MatX A = MatX::Zero(n, n);
    for (std::size_t k = 0; k < system.entries(); ++k)
      A(system.places[k].first, system.places[k].second) = system.operands[k];
    for (int i = 0; i < n; ++i) {
      std::vector<Snippet> row;
      for (int j = 0; j < n; ++j) row.push_back(operand(A(i, j)));
      rows.push_back(listed(std::move(row)));
    }
    for (int i = 0; i < n; ++i) right.push_back(operand(system.b(i)));
    const Snippet column = stored(applied("solve", {listed(std::move(rows)), listed(std::move(right))}));
    solutions_[e] = column.text;
    return {column.text + "[1]"};
  }

  static Snippet listed(std::vector<Snippet> entries) {
    Snippet list = applied("", std::move(entries));
    list.text = "{" + list.text.substr(1, list.text.size() - 2) + "}";
    return list;
  }

  Expr output_;
  std::unordered_map<Expr, std::string> solutions_;  // by head
  std::vector<Expr> nodes_;
  std::unordered_map<Expr, int> uses_;
  std::unordered_map<Expr, Snippet> text_;
  bool table_ = false;
  int entries_ = 0;
  std::string statements_;
};

}  // namespace

std::string to_code(Expr e) { return CodeWriter(e).write(); }

}  // namespace pendula
