// The expression graph: one process-wide, hash-consed arena of scalar nodes.
//
// An Expr is a 4-byte index. Structurally equal expressions have the same index, so == is one comparison and
// building the same model twice costs no memory. Operands precede their operation: indices are a topological
// order, and every algorithm over a graph is a loop over increasing (values, tangents) or decreasing
// (adjoints) indices.
//
// Construction folds lightly (constants, x + 0, 1·x, -(-x)); it never reorders floating-point work. What
// people read is put in order by print.hpp, what they ask to be simplified by rewrite.hpp. Constants are
// exact rationals whenever they can be: a double is read as its simplest rational if the denominator is at
// most 10⁶ (docs/language.md#numbers).
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <gmpxx.h>

namespace pendula {

enum class Op : std::uint8_t {
  constant,
  symbol,
  call,   ///< an unspecified function g(x, z) or one of its formal partial derivatives
  solve,  ///< a component of the solution of a linear system (solve.hpp)
#define OP(name, ...) name,
#include "expr/ops.def"
#undef OP
};

enum class Style : std::uint8_t { infix, named, cond };

struct OpInfo {
  const char* name;
  int arity;
  Style style;
  double lo, hi;
  const char* latex;
  const char* help;
};

/// The row of ops.def; of solve only the name. Not for constant, symbol, call.
const OpInfo& info(Op op);
/// First and one past the last operation of the table: `for (Op op = first_op; op < end_op; op = next(op))`.
constexpr Op first_op = Op::neg;
constexpr Op end_op = static_cast<Op>(static_cast<int>(Op::ifelse) + 1);
constexpr Op next(Op op) { return static_cast<Op>(static_cast<int>(op) + 1); }

/// What a symbol stands for. The identity of a symbol is (kind, name, order).
enum class Kind : std::uint8_t {
  time,       ///< t
  variable,   ///< unknown function of time
  input,      ///< known function of time
  parameter,  ///< constant, value given later or by default
  constant,   ///< a number with a name: π
  slot        ///< internal argument of a kernel (a stage derivative), never seen by users
};

class Expr {
 public:
  Expr() = default;  ///< zero, so that Eigen can fill matrices
  Expr(int value);
  Expr(long value);
  Expr(double value);  ///< exact where it can be read as a simple rational; throws Error unless finite
  explicit Expr(const mpq_class& value);

  static Expr at(std::uint32_t id) {
    Expr e;
    e.id_ = id;
    return e;
  }
  std::uint32_t id() const { return id_; }
  friend bool operator==(Expr a, Expr b) { return a.id_ == b.id_; }
  friend bool operator!=(Expr a, Expr b) { return a.id_ != b.id_; }
  friend bool operator<(Expr a, Expr b) = delete;  // conditions are lt(a, b)

  Op op() const;
  /// Operands of an operation (arity of them), the arguments of a call, the entries of a
  /// linear system; empty for leaves.
  std::span<const Expr> operands() const;
  Expr operand(int i) const { return operands()[i]; }

  bool is_constant() const { return op() == Op::constant; }
  bool is_symbol() const { return op() == Op::symbol; }
  bool is_zero() const { return id_ == 0; }
  bool is_one() const { return id_ == 1; }

  Expr& operator+=(Expr b);
  Expr& operator-=(Expr b);
  Expr& operator*=(Expr b);
  Expr& operator/=(Expr b);

 private:
  std::uint32_t id_ = 0;
};

// ── constants ──────────────────────────────────────────────────────────────────────────────────────────────
// Exact rationals where they can be, doubles otherwise.

/// The exact value of a constant, or nothing if it is not a constant or was only known as a double.
const mpq_class* exact_value(Expr e);
/// The value of a constant as a double. Requires is_constant().
double constant_value(Expr e);
/// "3", "-1/3", "2.5", "1e-3" read exactly. Throws Error.
Expr parse_number(const std::string& text);
/// The simplest rational that is this double, if its denominator is at most 10⁶ (continued fraction).
std::optional<mpq_class> simplest_rational(double value);

// ── symbols ────────────────────────────────────────────────────────────────────────────────────────────────
// Leaves with a name; all their other properties are in a table beside the graph.

struct Symbol {
  Kind kind;
  std::string name;    ///< "x", or "q3" for the third component of q
  int order = 0;       ///< x, x′, x″ …: a time derivative is a leaf, not an operation
  Expr base;           ///< the leaf of order 0
  std::string vector;  ///< name of the column this is a component of, or ""
  int component = 0;   ///< 1-based, 0 for a scalar
  std::string unit;
  std::string label;          ///< words for axes and ledgers
  std::optional<Expr> value;  ///< parameters: default; named constants: their value
};

/// The leaf of this kind and name, made on first use. Names: letters, digits, underscores, not starting with
/// a digit; or a path of such names, "motor.shaft.w", "rod.cell[3].T". Throws Error on anything else.
Expr symbol(Kind kind, const std::string& name);
/// The n leaves name1 … namen of a column; prints as one vector.
std::vector<Expr> symbol_vector(Kind kind, const std::string& name, int size);
/// t, the independent variable, and π.
Expr time_symbol();
Expr pi();
/// The description of a leaf. Requires is_symbol(). The reference stays valid.
const Symbol& symbol_of(Expr leaf);
Symbol& attributes(Expr leaf);  ///< to set unit, label, value
/// x, order + k -> the leaf x^(order+k). Requires a variable or input leaf.
Expr derivative_leaf(Expr leaf, int k = 1);
/// The latest column declared with this name, or empty.
std::vector<Expr> vector_components(const std::string& name);
/// Names of all columns declared so far, in order of declaration.
const std::vector<std::string>& vector_names();

// ── unspecified functions ──────────────────────────────────────────────────────────────────────────────────
// g(x, z) of which only the name is known.

/// The application of an unspecified function to arguments, or a formal partial derivative of it.
struct FunctionCall {
  std::string name;         ///< "g", or "g2" for the second of several outputs
  std::vector<int> groups;  ///< sizes of the arguments as the user gave them: g(x, z) with x ∈ ℝ³ is {3, 1}
  std::vector<int> partial;     ///< order of differentiation with respect to every scalar argument
  std::vector<Expr> arguments;  ///< scalar arguments, flattened
};
Expr call(const FunctionCall& application);
/// Requires op() == Op::call.
const FunctionCall& call_of(Expr e);

// ── construction ───────────────────────────────────────────────────────────────────────────────────────────
// Every node is folded (fold.hpp) and interned: equal expressions are one node.

/// The node of an operation, folded and interned. Throws Error where a constant
/// operation has no real value (1/0).
Expr make(Op op, Expr a, Expr b = {}, Expr c = {});

inline Expr operator+(Expr a, Expr b) { return make(Op::add, a, b); }
inline Expr operator-(Expr a, Expr b) { return make(Op::sub, a, b); }
inline Expr operator*(Expr a, Expr b) { return make(Op::mul, a, b); }
inline Expr operator/(Expr a, Expr b) { return make(Op::div, a, b); }
inline Expr operator-(Expr a) { return make(Op::neg, a); }
inline Expr& Expr::operator+=(Expr b) { return *this = *this + b; }
inline Expr& Expr::operator-=(Expr b) { return *this = *this - b; }
inline Expr& Expr::operator*=(Expr b) { return *this = *this * b; }
inline Expr& Expr::operator/=(Expr b) { return *this = *this / b; }
#define PENDULA_ARITY1(name) \
  inline Expr name(Expr a) { return make(Op::name, a); }
#define PENDULA_ARITY2(name) \
  inline Expr name(Expr a, Expr b) { return make(Op::name, a, b); }
#define PENDULA_ARITY3(name) \
  inline Expr name(Expr a, Expr b, Expr c) { return make(Op::name, a, b, c); }
#define OP(name, arity, ...) PENDULA_ARITY##arity(name)
#include "expr/ops.def"
#undef OP
#undef PENDULA_ARITY1
#undef PENDULA_ARITY2
#undef PENDULA_ARITY3

/// The node of a component of a linear system; only solve.cpp, which keeps the systems, calls these. The head
/// of the components that follow it is their operand.
struct SolveIndex {
  std::uint32_t system, component;
};
Expr solve_node(std::uint32_t system, std::uint32_t component, Expr head);
SolveIndex solve_index(Expr e);
std::span<const Expr> solve_operands(std::uint32_t system);  ///< defined in solve.cpp

std::span<const Expr> call_operands(std::uint32_t place);

// ── memory ─────────────────────────────────────────────────────────────────────────────────────────────────
// Expressions have no owner. The time of a session is divided into windows, and a node keeps the first and
// the last one in which it was made or asked for. An object that was made in a window can refer to nodes that
// were touched in it, to what it was made of (Origins in base/remembered.hpp), and to operands of these. A
// node that was touched in no window of a living object is given back; its id is not used again.

std::uint32_t graph_size();          ///< nodes ever made: the id of the next one
std::uint32_t expressions_in_use();  ///< nodes that were not given back
std::uint16_t expression_window();
std::uint32_t begin_window();  ///< returns the size of the graph
/// The expression is used in the present window.
void touch(Expr e);
/// Begins a window and forgets everything remembered (base/remembered.hpp). Gives back what was touched in
/// none of `windows`, sorted, and is not touched by `touch_known`, nor an operand or the value of a
/// symbol. Cost: O(nodes in use).
void give_back(const std::vector<std::uint16_t>& windows, const std::function<void()>& touch_known);
void give_back_call(std::uint32_t place);
void give_back_system(std::uint32_t system);  ///< of linear equations; defined in solve.cpp

/// ∂/∂operand[i] of an operation or call, as an expression.
Expr local_derivative(Expr e, int i);
/// The operation in double arithmetic.
double apply(Op op, double a, double b, double c);

// ── traversal ──────────────────────────────────────────────────────────────────────────────────────────────
// Operands come before what uses them.

/// Every node the outputs depend on, operands first. Iterative: depth does not matter. One thread at a time
/// (its marks are kept between calls). Cost: linear in the result.
std::vector<Expr> topological(std::span<const Expr> outputs);
/// The leaves (symbols) the outputs depend on, in order of first declaration.
std::vector<Expr> leaves(std::span<const Expr> outputs);
bool depends_on(Expr e, Expr leaf);

}  // namespace pendula

template <>
struct std::hash<pendula::Expr> {
  std::size_t operator()(pendula::Expr e) const noexcept { return e.id(); }
};
