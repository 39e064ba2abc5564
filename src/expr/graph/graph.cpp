#include "expr/graph/graph.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <deque>
#include <unordered_map>

#include "base/error.hpp"
#include "base/remembered.hpp"
#include "base/text.hpp"
#include "base/utf8.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/fold.hpp"
#include "expr/graph/node_map.hpp"
#include "expr/graph/node_store.hpp"
#include "expr/graph/post_order.hpp"

namespace pendula {
namespace {

struct Graph {
  NodeStore nodes;
  std::deque<Symbol> symbols;
  std::deque<FunctionCall> calls;
  std::unordered_map<std::string, Expr> symbol_ids, call_ids;
  std::unordered_map<std::string, std::vector<Expr>> vectors;
  std::vector<std::string> vector_names;

  template <class T>
  Expr leaf(Op op, std::deque<T>& table, T entry) {
    table.push_back(std::move(entry));
    return nodes.leaf(op, static_cast<std::uint32_t>(table.size() - 1));
  }
};

Graph* the_graph = nullptr;

Graph& new_graph() {
  static Graph g;
  the_graph = &g;
  return g;
}
/// Called for every node; a static variable would require a lock.
inline Graph& graph() { return the_graph ? *the_graph : new_graph(); }

std::string key_of(Kind kind, const std::string& name, int order) {
  return text(static_cast<int>(kind), ':', order, ':', name);
}

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

/// "cell", "cell[3]": one step of a path.
bool is_step(std::string_view step) {
  if (step.ends_with(']')) {
    const std::size_t open = step.find('[');
    if (open == step.npos || open + 2 >= step.size()) return false;
    const std::string_view number = step.substr(open + 1, step.size() - open - 2);
    if (!std::all_of(number.begin(), number.end(), is_digit)) return false;
    step = step.substr(0, open);
  }
  if (step.empty() || is_digit(step[0])) return false;
  return std::all_of(step.begin(), step.end(), [](unsigned char c) {
    return std::isalnum(c) || c == '_' || c >= 0x80;  // UTF-8 letters pass
  });
}

void check_utf8(const std::string& name) {
  const std::size_t place = malformed_utf8(name);
  if (place == name.size()) return;
  std::string shown;
  for (const char c : name) shown += static_cast<unsigned char>(c) < 0x80 ? c : '?';
  throw Error(
      text("'", shown, "' is not a name: byte ", place + 1, " is ",
           static_cast<int>(static_cast<unsigned char>(name[place])),
           ", and no part of a letter in UTF-8; write the letter, or utf8.char(number of the letter)"));
}

void check_name(const std::string& name) {
  check_utf8(name);
  bool good = true;
  for (std::size_t begin = 0; good && begin <= name.size();) {
    const std::size_t end = std::min(name.find('.', begin), name.size());
    good = is_step(std::string_view(name).substr(begin, end - begin));
    begin = end + 1;
  }
  if (!good)
    throw Error(text(
        "'", name, "' is not a name: use letters, digits and _, not starting with a digit",
        name.find_first_of(" ,") == name.npos ? "" : "; several are declared by vars, params and inputs"));
}

}  // namespace

const OpInfo& info(Op op) {
  static const OpInfo table[] = {
#define OP(name, arity, style, parity, exact, code, value, da, db, dc, lo, hi, latex, help) \
  {#name, arity, Style::style, lo, hi, latex, help},
#include "expr/ops.def"
#undef OP
  };
  static const OpInfo solve = {"solve", 0, Style::named, 0, 0, "solve", "component of a linear system"};
  static const OpInfo call = {"call", 0, Style::named, 0, 0, "call", "unspecified function"};
  if (op == Op::solve || op == Op::call) return op == Op::solve ? solve : call;
  PENDULA_ASSERT(op >= first_op && op < end_op, "information about what is no operation");
  return table[static_cast<int>(op) - static_cast<int>(first_op)];
}

Op Expr::op() const { return graph().nodes[id_].op; }

std::span<const Expr> Expr::operands() const {
  const Node& n = graph().nodes[id_];
  if (n.op == Op::call) return graph().calls[n.operand[0].id()].arguments;
  if (n.op <= Op::symbol) return {};
  if (n.op == Op::solve) {
    if (n.operand[1].id() == 0) return solve_operands(n.operand[0].id());
    return {&n.operand[2], 1};
  }
  return {n.operand.data(), static_cast<std::size_t>(info(n.op).arity)};
}

// ── constants ──────────────────────────────────────────────────────────────────────────────────────────────

Expr::Expr(int value) : Expr(static_cast<long>(value)) {}
Expr::Expr(long value)
    : Expr(value == 0 || value == 1 ? at(static_cast<std::uint32_t>(value)) : graph().nodes.whole(value)) {}
Expr::Expr(const mpq_class& value) : Expr(graph().nodes.exact(value)) {}

Expr::Expr(double value) {
  if (!std::isfinite(value))
    throw Error(text("the number ", shortest(value), " cannot be part of an expression"));
  auto q = simplest_rational(value);
  if (!q) q = typed_decimal(value);
  *this = q ? graph().nodes.exact(*q) : graph().nodes.inexact(value);
}

const mpq_class* exact_value(Expr e) {
  if (!e.is_constant()) return nullptr;
  const Constant& c = graph().nodes.constant(e);
  return c.exact ? &*c.exact : nullptr;
}

double constant_value(Expr e) { return graph().nodes.constant(e).value; }

// ── symbols ────────────────────────────────────────────────────────────────────────────────────────────────

static Expr leaf_of(Symbol s) {
  Graph& g = graph();
  const auto [it, made] = g.symbol_ids.try_emplace(key_of(s.kind, s.name, s.order));
  if (made) {
    const Expr base = s.base;
    it->second = g.leaf(Op::symbol, g.symbols, std::move(s));
    if (g.symbols.back().order == 0) {
      g.symbols.back().base = it->second;
      newly_made(it->second);
    }
    PENDULA_ASSERT(g.symbols.back().order == 0 || base.is_symbol(), "a derivative leaf needs its base");
  }
  return it->second;
}

Expr symbol(Kind kind, const std::string& name) {
  check_name(name);
  Symbol s;
  s.kind = kind;
  s.name = name;
  return leaf_of(std::move(s));
}

std::vector<Expr> symbol_vector(Kind kind, const std::string& name, int size) {
  check_name(name);
  std::vector<Expr> components;
  for (int i = 1; i <= size; ++i) {
    const std::string component = name + std::to_string(i);
    components.push_back(symbol(kind, component));
    for (int order = 0;; ++order) {  // and its derivatives, if it was a scalar before
      const auto leaf = graph().symbol_ids.find(key_of(kind, component, order));
      if (leaf == graph().symbol_ids.end()) break;
      Symbol& s = attributes(leaf->second);
      s.vector = name;
      s.component = i;
    }
  }
  const auto [it, made] = graph().vectors.insert_or_assign(name, components);
  if (made) graph().vector_names.push_back(name);
  return components;
}

Expr time_symbol() {
  static const Expr t = symbol(Kind::time, "t");
  return t;
}

Expr pi() {
  static const Expr p = [] {
    const Expr leaf = symbol(Kind::constant, "pi");
    attributes(leaf).value = Expr(std::acos(-1.0));
    return leaf;
  }();
  return p;
}

const Symbol& symbol_of(Expr leaf) { return attributes(leaf); }

Symbol& attributes(Expr leaf) {
  PENDULA_ASSERT(leaf.is_symbol(), "attributes of something that is not a symbol");
  return graph().symbols[graph().nodes[leaf.id()].operand[0].id()];
}

Expr derivative_leaf(Expr leaf, int k) {
  if (k == 0) return leaf;
  static std::unordered_map<Expr, Expr> first;  // creating the name takes longer
  if (k == 1)
    if (const auto known = first.find(leaf); known != first.end()) return known->second;
  const Symbol& s = symbol_of(leaf);
  PENDULA_ASSERT(s.kind == Kind::variable || s.kind == Kind::input,
                 "only functions of time have derivatives");
  Symbol d;
  d.kind = s.kind;
  d.name = s.name;
  d.order = s.order + k;
  d.base = s.base;
  const Symbol& base = symbol_of(s.base);
  d.vector = base.vector;
  d.component = base.component;
  const Expr made = leaf_of(std::move(d));
  if (k == 1) first[leaf] = made;
  return made;
}

std::vector<Expr> vector_components(const std::string& name) {
  const auto it = graph().vectors.find(name);
  return it == graph().vectors.end() ? std::vector<Expr>{} : it->second;
}

const std::vector<std::string>& vector_names() { return graph().vector_names; }

// ── unspecified functions ──────────────────────────────────────────────────────────────────────────────────

static std::string key_of(const FunctionCall& application) {
  std::string key = application.name;
  for (int g : application.groups) key += text('|', g);
  for (std::size_t i = 0; i < application.arguments.size(); ++i)
    key += text(',', application.arguments[i].id(), '^', application.partial[i]);
  return key;
}

Expr call(const FunctionCall& application) {
  check_name(application.name);
  PENDULA_ASSERT(application.partial.size() == application.arguments.size(), "one order per argument");
  const auto [it, made] = graph().call_ids.try_emplace(key_of(application));
  if (made) it->second = graph().leaf(Op::call, graph().calls, application);
  touch(it->second);
  return it->second;
}

std::span<const Expr> call_operands(std::uint32_t place) { return graph().calls[place].arguments; }

const FunctionCall& call_of(Expr e) {
  PENDULA_ASSERT(e.op() == Op::call, "not an application of an unspecified function");
  return graph().calls[graph().nodes[e.id()].operand[0].id()];
}

// ── construction ───────────────────────────────────────────────────────────────────────────────────────────

Expr make(Op op, Expr a, Expr b, Expr c) {
  if (const auto folded = fold(op, a, b, c)) return *folded;
  const bool commutes = op == Op::add || op == Op::mul || op == Op::min || op == Op::max;
  if (commutes && b.id() < a.id()) std::swap(a, b);
  return graph().nodes.intern({op, {a, b, c}});
}

Expr solve_node(std::uint32_t system, std::uint32_t component, Expr head) {
  return graph().nodes.intern({Op::solve, {Expr::at(system), Expr::at(component), head}});
}

SolveIndex solve_index(Expr e) {
  PENDULA_ASSERT(e.op() == Op::solve, "not a component of a linear system");
  const Node& n = graph().nodes[e.id()];
  return {n.operand[0].id(), n.operand[1].id()};
}

double apply(Op op, double a, double b, double c) {
  static_cast<void>(b);
  static_cast<void>(c);
  switch (op) {
#define OP(name, arity, style, parity, exact, code, value, ...) \
  case Op::name:                                                \
    return static_cast<double>(value);
#include "expr/ops.def"
#undef OP
    default:
      internal_error(__FILE__, __LINE__, "apply: not an operation");
  }
}

Expr local_derivative(Expr e, int i) {
  if (e.op() == Op::call) {
    FunctionCall d = call_of(e);
    ++d.partial[i];
    return call(d);
  }
  const Expr zero = 0, one = 1, two = 2, r = e;
  const auto x = e.operands();
  const Expr a = x[0], b = x.size() > 1 ? x[1] : zero, c = x.size() > 2 ? x[2] : zero;
  static_cast<void>(two);
  static_cast<void>(c);
  switch (e.op()) {
#define OP(name, arity, style, parity, exact, code, value, da, db, dc, ...) \
  case Op::name:                                                            \
    return i == 0 ? da : i == 1 ? db : dc;
#include "expr/ops.def"
#undef OP
    default:
      internal_error(__FILE__, __LINE__, "local_derivative: not an operation");
  }
}

// ── traversal ──────────────────────────────────────────────────────────────────────────────────────────────

std::vector<Expr> topological(std::span<const Expr> outputs) {
  static NodeMap<char> seen;
  seen.clear();
  const auto enter = [](Expr e) {
    if (seen.has(e)) return false;
    seen[e] = 1;
    return true;
  };
  std::vector<Expr> order;
  for (Expr output : outputs) append_post_order(output, enter, order);
  return order;
}

std::vector<Expr> leaves(std::span<const Expr> outputs) {
  std::vector<Expr> found;
  for (Expr e : topological(outputs))
    if (e.is_symbol()) found.push_back(e);
  sort_by_declaration(found);
  return found;
}

bool depends_on(Expr e, Expr leaf) {
  for (Expr node : topological({&e, 1}))
    if (node == leaf) return true;
  return false;
}

// ── memory ─────────────────────────────────────────────────────────────────────────────────────────────────

std::uint32_t graph_size() { return graph().nodes.size(); }
std::uint32_t expressions_in_use() { return graph().nodes.in_use(); }
std::uint16_t expression_window() { return graph().nodes.window(); }
std::uint32_t begin_window() {
  graph().nodes.begin_window();
  return graph_size();
}
void touch(Expr e) { graph().nodes.touch(e.id()); }

void give_back(const std::vector<std::uint16_t>& windows, const std::function<void()>& touch_known) {
  Graph& g = graph();
  if (!g.nodes.begin_window()) return;
  Remembered::forget_all();
  touch_known();
  for (const auto& [name, leaf] : g.symbol_ids) {
    touch(leaf);
    if (const auto& value = symbol_of(leaf).value) touch(*value);
  }
  g.nodes.give_back(windows);
}

void give_back_call(std::uint32_t place) {
  FunctionCall& gone = graph().calls[place];
  graph().call_ids.erase(key_of(gone));
  gone = {};
}

}  // namespace pendula
