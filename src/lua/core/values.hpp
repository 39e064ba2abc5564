// Expressions, matrices, equations and symbol-keyed tables between Lua and C++.
//
// One matrix type in Lua, two stores behind it: exact/symbolic (MatX) and double (Mat); operations promote.
// Data and trajectories are never interned in the expression graph. Expressions are interned userdata: one
// per id, so that symbols work as table keys.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "base/error.hpp"
#include "expr/graph/matrix.hpp"
#include "lua/core/call.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {

/// The object at `index` if it is a T, else nullptr. Throws Error where a script's __gc has taken it back.
template <class T>
const T* object(lua_State* L, int index) {
  const std::shared_ptr<const void>* held = object_at(L, index, TypeName<T>::value);
  if (held && !*held) throw Error("a value cannot be used after its __gc has run");
  return held ? static_cast<const T*>(held->get()) : nullptr;
}

struct Matrix {
  std::variant<MatX, Mat> store;
  Eigen::Index rows() const;
  Eigen::Index cols() const;
  bool numeric() const { return std::holds_alternative<Mat>(store); }
};

/// lhs ~ rhs, elementwise; both sides have the same shape.
struct Equation {
  MatX lhs, rhs;
};

template <>
struct TypeName<Expr> {
  static constexpr const char* value = "expr";
};
template <>
struct TypeName<Matrix> {
  static constexpr const char* value = "matrix";
};
template <>
struct TypeName<Equation> {
  static constexpr const char* value = "equation";
};

/// The entries as expressions; what is a double becomes a constant.
MatX exact(const Matrix& m, const std::string& what);

// ── reading; `what` names the argument in error texts; all throw Error ──

bool is_expression(lua_State* L, int index);  ///< expr, number, or number string ("1/3")
/// The value of an expression without symbols (√2, 2π), or nothing.
std::optional<double> number_value(Expr e);
/// A number, or anything that has one value: "1/3", 2*pi, sqrt(2).
double to_number(lua_State* L, int index, const std::string& what);
/// The value if there is an expr without symbols at `index` (2*pi); what Call::number takes besides numbers.
std::optional<double> constant_at(lua_State* L, int index);
/// A number, a number string, an expr or a 1×1 matrix.
Expr to_expr(lua_State* L, int index, const std::string& what);
/// One level of lists inside lists, while it lives. Throws Error when there are too many, as in a list that
/// contains itself, and makes room on the Lua stack for what reading one level takes.
class Nesting {
 public:
  explicit Nesting(lua_State* L);
  ~Nesting();
  Nesting(const Nesting&) = delete;
  Nesting& operator=(const Nesting&) = delete;
};
/// The number of entries of a list at an absolute index. A hole ("entry 2 of C is nil") and a key that is not
/// 1, 2, … are errors.
lua_Integer list_size(lua_State* L, int list, const std::string& what);
/// Throws Error if a table can be called like a function, as one of lookup{…}, and was meant to be: f(x).
void refuse_callable(lua_State* L, int index, const std::string& what);
/// A scalar, a list (column), a list of equally long lists (rows), a list of columns (stacked), or a matrix.
/// A nil inside a list is reported.
MatX to_matrix(lua_State* L, int index, const std::string& what);
/// The same, required to be a column (a 1×n row is not accepted).
VecX to_column(lua_State* L, int index, const std::string& what);
/// Numeric column: list of numbers or a matrix with one column (exact
/// constants are converted). Never interned.
Vec to_numbers(lua_State* L, int index, const std::string& what);
Mat to_numeric_matrix(lua_State* L, int index, const std::string& what);
/// A leaf or a column of leaves, from a symbol, a matrix of symbols, a list of these, or a
/// name ("x", "q" for a declared column, "q3", "x'" for derivatives). `known` resolves
/// names; throws with "did you mean" over its names.
std::vector<Expr> to_leaves(lua_State* L, int index, const std::string& what, std::span<const Expr> known);

struct SymbolEntry {
  std::vector<Expr> leaves;  ///< one, or all components of a column
  std::string name;          ///< as the user wrote it; "" where that was no string
  int value;                 ///< absolute stack index while the callback runs
  std::string key() const;   ///< as the user wrote it, for messages
};
/// Visits { [x] = …, q = {…}, ["x"] = … } sorted by first leaf. The same leaf twice (in
/// both spellings too) is an error.
void each_symbol_entry(lua_State* L, int table, const std::string& what, std::span<const Expr> known,
                       const std::function<void(const SymbolEntry&)>& visit);
/// The same where a symbol that is not in `known` is refused, as its name would be.
void each_known_entry(lua_State* L, int table, const std::string& what, std::span<const Expr> known,
                      const std::function<void(const SymbolEntry&)>& visit);
/// each_symbol_entry with numeric values: a number per leaf (scalar values are not
/// broadcast). Constants only (√2 is one).
std::vector<std::pair<Expr, double>> to_symbol_numbers(lua_State* L, int table, const std::string& what,
                                                       std::span<const Expr> known);
/// A list of equations (or one); column equations stay whole. Booleans and
/// numbers in it: "write ~, not == or =".
std::vector<Equation> to_equations(lua_State* L, int index, const std::string& what);

// ── pushing; each returns 1 ──

/// The one Lua value of an expression, so that == means "same": a Lua integer for a whole number up to 2³¹, a
/// Lua float for a constant that is only known as a double, else the interned expr (1/3, √2, x). Numbers
/// answer the fields and methods of expr too (open_numbers), so nobody has to ask which of the two came.
int push_expr(lua_State* L, Expr e);
int push_matrix(lua_State* L, MatX m);  ///< always a matrix userdata
int push_matrix(lua_State* L, Mat m);
int push_value(lua_State* L, const MatX& m);  ///< an expr if 1×1, else a matrix
int push_value(lua_State* L, const Mat& m);   ///< a number if 1×1, else a matrix
int push_equation(lua_State* L, Equation e);

/// Gives numbers the fields and methods of expr: (3).T, (3).dot, (3):latex(). Called once per state.
void open_numbers(lua_State* L);

// ── names ──

/// Every symbol a script has declared so far (order 0), in order; for names
/// that an expression does not contain.
const std::vector<Expr>& declared_symbols();
void note_declared(std::span<const Expr> leaves);
/// Forgets them: names and the order of listing are those of the new session.
void begin_session();

/// "x", "x'" or "q3''": a leaf as a user writes it in a string.
std::string leaf_name(Expr leaf);
/// Words for an axis: the label if there is one, of a variable of a part its path, else the printed
/// expression; " [unit]" where the unit is known.
std::string label_of(Expr e);

/// Sets the printer's aliases from the user's variables: every global and every local or upvalue of the
/// running user functions that holds a column of leaves lends its name (p1 = q:slice(1, 3)).
void collect_aliases(lua_State* L);

}  // namespace pendula::lua
