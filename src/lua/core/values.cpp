#include "lua/core/values.hpp"

#include <algorithm>
#include <cmath>

#include "base/counted.hpp"
#include "base/interrupt.hpp"
#include "base/remembered.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/node_map.hpp"
#include "expr/print/print.hpp"
#include "lua/core/key_in_words.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/trampoline.hpp"

namespace pendula::lua {
namespace {

char interned_key;  // registry: the weak table id -> userdata

[[noreturn]] void must_be(lua_State* L, int index, const std::string& what, const std::string& expected) {
  const char* remedy =
      lua_isboolean(L, index) ? ": == compares at once; an equation is lhs ~ rhs, a condition lt(a, b)" : "";
  throw Error(text(what, " must be ", expected, ", not ", describe(L, index), remedy));
}

/// Pushes the table of interned expressions.
void push_interned_table(lua_State* L) {
  if (lua_rawgetp(L, LUA_REGISTRYINDEX, &interned_key) == LUA_TTABLE) return;
  lua_pop(L, 1);
  lua_newtable(L);
  lua_createtable(L, 0, 1);
  lua_pushliteral(L, "v");
  lua_setfield(L, -2, "__mode");
  lua_setmetatable(L, -2);
  lua_pushvalue(L, -1);
  lua_rawsetp(L, LUA_REGISTRYINDEX, &interned_key);
}

void touch_all(const MatX& m) {
  for (Expr e : entries(m)) touch(e);
}
void touch_all(Expr e) { touch(e); }
void touch_all(const Matrix& m) {
  if (!m.numeric()) touch_all(std::get<MatX>(m.store));
}
void touch_all(const Equation& e) {
  touch_all(e.lhs);
  touch_all(e.rhs);
}
template <class T>
void touch_inside(const void* object) {
  touch_all(*static_cast<const T*>(object));
}

void push_interned(lua_State* L, Expr e) {
  luaL_checkstack(L, 8, nullptr);
  push_interned_table(L);
  if (lua_rawgeti(L, -1, e.id()) == LUA_TNIL) {
    lua_pop(L, 1);
    push_object(L, std::make_shared<const Expr>(e), TypeName<Expr>::value, touch_inside<Expr>);
    lua_pushvalue(L, -1);
    lua_rawseti(L, -3, e.id());
  }
  lua_remove(L, -2);
}

Expr from_lua_number(lua_State* L, int index, const std::string& what) {
  if (lua_isinteger(L, index)) return Expr(static_cast<long>(lua_tointeger(L, index)));
  const double value = lua_tonumber(L, index);
  if (!std::isfinite(value))
    throw Error(text(what, " is ", std::isnan(value) ? "nan" : "infinite", ", not a number"));
  return Expr(value);
}

bool is_scalar(lua_State* L, int index) {
  return lua_type(L, index) == LUA_TNUMBER || lua_type(L, index) == LUA_TSTRING || object<Expr>(L, index);
}

/// Calls visit for the entries 1..n of a list, each on top of the stack.
template <class Visit>
void each_entry(lua_State* L, int list, const std::string& what, const Visit& visit) {
  luaL_checkstack(L, 8, nullptr);
  const lua_Integer n = list_size(L, list, what);
  for (lua_Integer i = 1; i <= n; ++i) {
    poll_interrupt();
    lua_rawgeti(L, list, i);
    visit(i);
    lua_pop(L, 1);
  }
}

std::string entry_of(lua_Integer i, const std::string& what) { return text("entry ", i, " of ", what); }

MatX side_by_side(const std::vector<MatX>& blocks, const std::string& what) {
  Eigen::Index cols = 0;
  for (const MatX& block : blocks) cols += block.cols();
  MatX row(blocks.empty() ? 0 : blocks[0].rows(), cols);
  cols = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (blocks[i].rows() != row.rows())
      throw Error(text(entry_of(static_cast<lua_Integer>(i) + 1, what), " has ", blocks[i].rows(),
                       " rows but entry 1 has ", row.rows()));
    row.middleCols(cols, blocks[i].cols()) = blocks[i];
    cols += blocks[i].cols();
  }
  return row;
}

MatX on_top(const std::vector<MatX>& blocks, const std::string& what) {
  Eigen::Index rows = 0;
  for (const MatX& block : blocks) rows += block.rows();
  MatX all(rows, blocks.empty() ? 1 : blocks[0].cols());
  rows = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (blocks[i].cols() != all.cols())
      throw Error(text("row ", i + 1, " of ", what, " has ", counted(blocks[i].cols(), "entry"),
                       " but row 1 has ", all.cols()));
    all.middleRows(rows, blocks[i].rows()) = blocks[i];
    rows += blocks[i].rows();
  }
  return all;
}

/// A list inside a list: a row of scalars or of blocks.
MatX read_row(lua_State* L, int list, const std::string& what) {
  std::vector<MatX> blocks;
  each_entry(L, list, what, [&](lua_Integer i) {
    if (lua_istable(L, -1)) must_be(L, -1, entry_of(i, what), "a number or an expression");
    blocks.push_back(to_matrix(L, lua_gettop(L), entry_of(i, what)));
  });
  return side_by_side(blocks, what);
}

MatX read_list(lua_State* L, int list, const std::string& what) {
  std::vector<MatX> blocks;
  std::vector<Expr> scalars;  // consecutive scalars form one block, since long lists of numbers are common
  const auto flush = [&] {
    if (!scalars.empty())
      blocks.push_back(Eigen::Map<const VecX>(scalars.data(), static_cast<Eigen::Index>(scalars.size())));
    scalars.clear();
  };
  each_entry(L, list, what, [&](lua_Integer i) {
    const int top = lua_gettop(L);
    if (is_scalar(L, top)) {
      scalars.push_back(to_expr(L, top, entry_of(i, what)));
      return;
    }
    flush();
    blocks.push_back(lua_istable(L, top) ? read_row(L, top, entry_of(i, what))
                                         : to_matrix(L, top, entry_of(i, what)));
  });
  flush();
  return on_top(blocks, what);
}

double number_in(Expr e, const std::string& what) {
  if (const auto value = number_value(e)) return *value;
  throw Error(text(what, " must be a number, but it is the expression ", to_text(e)));
}

Mat numeric_of(const MatX& m, const std::string& what) {
  Mat values(m.rows(), m.cols());
  for (Eigen::Index j = 0; j < m.cols(); ++j) {
    poll_interrupt();
    for (Eigen::Index i = 0; i < m.rows(); ++i) {
      const auto value = number_value(m(i, j));
      const auto where = [&] {
        return m.cols() == 1 ? entry_of(i + 1, what) : text("entry (", i + 1, ", ", j + 1, ") of ", what);
      };
      values(i, j) = value ? *value : number_in(m(i, j), where());
    }
  }
  return values;
}

}  // namespace

Eigen::Index Matrix::rows() const {
  return std::visit([](const auto& m) { return m.rows(); }, store);
}
Eigen::Index Matrix::cols() const {
  return std::visit([](const auto& m) { return m.cols(); }, store);
}

// ── reading ──

static thread_local int nested_lists = 0;

Nesting::Nesting(lua_State* L) {
  constexpr int most = 50;
  if (nested_lists >= most) throw Error("lists inside lists, more than 50 deep: does a list contain itself?");
  luaL_checkstack(L, LUA_MINSTACK, nullptr);
  ++nested_lists;
}

Nesting::~Nesting() { --nested_lists; }

void refuse_callable(lua_State* L, int index, const std::string& what) {
  if (luaL_getmetafield(L, index, "__call") == LUA_TNIL) return;
  const bool named = luaL_getmetafield(L, index, "__name") == LUA_TSTRING;
  const std::string kind = named ? text("a ", lua_tostring(L, -1)) : "a function";
  throw Error(text(what, " is ", kind, "; call it with its argument, f(x)"));
}

lua_Integer list_size(lua_State* L, int list, const std::string& what) {
  lua_Integer count = 0, largest = 0;
  lua_pushnil(L);
  while (lua_next(L, list) != 0) {
    lua_pop(L, 1);
    if (!lua_isinteger(L, -1) || lua_tointeger(L, -1) < 1) refuse_callable(L, list, what);
    if (!lua_isinteger(L, -1) || lua_tointeger(L, -1) < 1)
      throw Error(text(what, " must be a list { a, b, … }, but it has the key '", key_in_words(L, -1), "'"));
    ++count;
    largest = std::max(largest, lua_tointeger(L, -1));
  }
  if (count == largest) return count;
  for (lua_Integer i = 1;; ++i) {  // reports a missing key among 1 … largest
    const bool missing = lua_rawgeti(L, list, i) == LUA_TNIL;
    lua_pop(L, 1);
    if (missing) throw Error(text(entry_of(i, what), " is nil"));
  }
}

bool is_expression(lua_State* L, int index) {
  if (lua_type(L, index) != LUA_TSTRING) return lua_type(L, index) == LUA_TNUMBER || object<Expr>(L, index);
  try {
    parse_number(lua_tostring(L, index));
    return true;
  } catch (const Error&) {
    return false;
  }
}

/// Does an expression contain a symbol (other than π and e) or a call? Cached by node, since expressions are
/// tested while they grow.
class SymbolsInside : public Remembered {
 public:
  bool operator()(Expr e) {
    for (std::vector<Expr> open{e}; !open.empty();) {
      const Expr node = open.back();
      const auto size = open.size();
      if (!known_.has(node)) visit(node, open);
      if (open.size() == size) open.pop_back();
    }
    return known_[e] != 0;
  }

 private:
  /// Decides a node, or pushes the operands to be decided first.
  void visit(Expr node, std::vector<Expr>& open) {
    const auto size = open.size();
    bool inside = node.op() == Op::call || (node.is_symbol() && symbol_of(node).kind != Kind::constant);
    for (Expr operand : node.operands()) {
      if (!known_.has(operand))
        open.push_back(operand);
      else
        inside = inside || known_[operand] != 0;
    }
    if (open.size() == size) known_[node] = inside ? 1 : 0;
  }
  void forget() override { known_.clear(); }

  NodeMap<char> known_;
};

static bool has_symbols(Expr e) {
  static SymbolsInside inside;
  return inside(e);
}

std::optional<double> number_value(Expr e) {
  if (e.is_constant()) return constant_value(e);
  if (has_symbols(e)) return {};
  return evaluate({&e, 1}, {})[0];
}

std::optional<double> constant_at(lua_State* L, int index) {
  const Expr* e = object<Expr>(L, index);
  return e ? number_value(*e) : std::nullopt;
}

double to_number(lua_State* L, int index, const std::string& what) {
  if (lua_type(L, index) == LUA_TNUMBER) return lua_tonumber(L, index);
  return number_in(to_expr(L, index, what), what);
}

Expr to_expr(lua_State* L, int index, const std::string& what) {
  switch (lua_type(L, index)) {
    case LUA_TNUMBER:
      return from_lua_number(L, index, what);
    case LUA_TSTRING:
      try {
        return parse_number(lua_tostring(L, index));
      } catch (const Error& e) {
        throw Error(text(what, ": ", e.what()));
      }
    case LUA_TUSERDATA:
      if (const Expr* e = object<Expr>(L, index)) return *e;
      if (const Matrix* m = object<Matrix>(L, index)) {
        if (m->rows() != 1 || m->cols() != 1)
          throw Error(text(what, " must be a scalar, not a ", m->rows(), "×", m->cols(), " matrix"));
        return m->numeric() ? Expr(std::get<Mat>(m->store)(0, 0)) : std::get<MatX>(m->store)(0, 0);
      }
      [[fallthrough]];
    default:
      must_be(L, index, what, "a number or an expression");
  }
}

MatX exact(const Matrix& m, const std::string& what) {
  if (!m.numeric()) return std::get<MatX>(m.store);
  const Mat& values = std::get<Mat>(m.store);
  if (!values.allFinite()) throw Error(text(what, " has an entry that is not a finite number"));
  MatX e(values.rows(), values.cols());
  for (Eigen::Index j = 0; j < values.cols(); ++j) {
    poll_interrupt();  // a million numbers take a second
    for (Eigen::Index i = 0; i < values.rows(); ++i) e(i, j) = Expr(values(i, j));
  }
  return e;
}

MatX to_matrix(lua_State* L, int index, const std::string& what) {
  index = lua_absindex(L, index);
  if (lua_istable(L, index)) return read_list(L, index, what);
  if (const Matrix* m = object<Matrix>(L, index)) return exact(*m, what);
  if (!is_scalar(L, index)) must_be(L, index, what, "a number, an expression, a vector or a matrix");
  return MatX::Constant(1, 1, to_expr(L, index, what));
}

VecX to_column(lua_State* L, int index, const std::string& what) {
  const MatX m = to_matrix(L, index, what);
  if (m.cols() == 1) return m.col(0);
  throw Error(text(what, " must be a column, not a ", m.rows(), "×", m.cols(), " matrix",
                   m.rows() == 1 ? "; write .T to transpose it" : ""));
}

Vec to_numbers(lua_State* L, int index, const std::string& what) {
  const Mat m = to_numeric_matrix(L, index, what);
  if (m.cols() == 1) return m.col(0);
  throw Error(text(what, " must be a column of numbers, not a ", m.rows(), "×", m.cols(), " matrix",
                   m.rows() == 1 ? "; write .T to transpose it" : ""));
}

Mat to_numeric_matrix(lua_State* L, int index, const std::string& what) {
  index = lua_absindex(L, index);
  if (const Matrix* m = object<Matrix>(L, index)) {
    if (m->numeric()) return std::get<Mat>(m->store);
    return numeric_of(std::get<MatX>(m->store), what);
  }
  if (!lua_istable(L, index)) return numeric_of(to_matrix(L, index, what), what);
  // lists of plain numbers are data; they are read without creating constants
  std::vector<double> data;
  bool plain = true;
  each_entry(L, index, what, [&](lua_Integer) {
    plain = plain && lua_type(L, -1) == LUA_TNUMBER;
    if (plain) data.push_back(lua_tonumber(L, -1));
  });
  if (plain) return Eigen::Map<const Mat>(data.data(), static_cast<Eigen::Index>(data.size()), 1);
  return numeric_of(to_matrix(L, index, what), what);
}

// ── pushing ──

int push_expr(lua_State* L, Expr e) {
  if (!e.is_constant()) {
    push_interned(L, e);
  } else if (const mpq_class* q = exact_value(e); !q) {
    lua_pushnumber(L, constant_value(e));
  } else if (q->get_den() == 1 && abs(q->get_num()) <= mpz_class(1L << 31)) {
    lua_pushinteger(L, q->get_num().get_si());
  } else {
    push_interned(L, e);
  }
  return 1;
}

int push_matrix(lua_State* L, MatX m) {
  push_object(L, std::make_shared<const Matrix>(Matrix{std::move(m)}), TypeName<Matrix>::value,
              touch_inside<Matrix>);
  return 1;
}

int push_matrix(lua_State* L, Mat m) {
  push_object(L, std::make_shared<const Matrix>(Matrix{std::move(m)}), TypeName<Matrix>::value,
              touch_inside<Matrix>);
  return 1;
}

int push_value(lua_State* L, const MatX& m) {
  return m.size() == 1 ? push_expr(L, m(0, 0)) : push_matrix(L, m);
}

int push_value(lua_State* L, const Mat& m) {
  if (m.size() != 1) return push_matrix(L, m);
  lua_pushnumber(L, m(0, 0));
  return 1;
}

int push_equation(lua_State* L, Equation e) {
  push_object(L, std::make_shared<const Equation>(std::move(e)), TypeName<Equation>::value,
              touch_inside<Equation>);
  return 1;
}

namespace {

/// __index of numbers, which have the members of type expr. Has no upvalues.
int index_number(lua_State* L) {
  const bool named = lua_type(L, 2) == LUA_TSTRING;
  if (named && std::string("T") == lua_tostring(L, 2)) {
    lua_settop(L, 1);
    return 1;
  }
  if (!named || !push_member(L, TypeName<Expr>::value, lua_tostring(L, 2))) {
    if (lua_isinteger(L, 2) && lua_tointeger(L, 2) == 1) {
      lua_settop(L, 1);
      return 1;
    }
    throw Error(text("a number has no entry '", luaL_tolstring(L, 2, nullptr), "'"));
  }
  push_interned(L, from_lua_number(L, 1, "the number"));
  lua_pushvalue(L, 2);
  lua_gettable(L, -2);
  return 1;
}

int length_of_number(lua_State* L) {
  lua_pushinteger(L, 1);
  return 1;
}

}  // namespace

void open_numbers(lua_State* L) {
  lua_pushinteger(L, 0);
  lua_createtable(L, 0, 3);
  lua_pushcfunction(L, guarded<index_number>);
  lua_setfield(L, -2, "__index");
  lua_pushcfunction(L, length_of_number);
  lua_setfield(L, -2, "__len");
  lua_pushliteral(L, "number");
  lua_setfield(L, -2, "__metatable");
  lua_setmetatable(L, -2);
  lua_pop(L, 1);
}

}  // namespace pendula::lua
