// Entries, rows, blocks and sizes of matrices, and iteration over them.
#include <cmath>

#include "lua/bind/expr/matrix.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/trampoline.hpp"

namespace pendula::lua {
namespace {

// ── indexing ──

/// 0-based position of the i-th of n entries, or an error that names the size. `what`:
/// "entry", "row", "column".
Eigen::Index position(lua_Integer i, Eigen::Index n, const std::string& what, const std::string& of) {
  if (i >= 1 && i <= n) return i - 1;
  const std::string plural = what == "entry" ? "entries" : what + "s";
  throw Error(text(what, " ", i, " is out of range: a ", of, " has ", n, " ", n == 1 ? what : plural,
                   i == 0 ? " (the first is 1)" : ""));
}

int matrix_index(Call& call) {
  if (!lua_isinteger(call.L, 2)) {
    if (lua_type(call.L, 2) == LUA_TNUMBER)
      throw Error(text("the index ", lua_tonumber(call.L, 2), " is not an integer"));
    return call.push_nil();
  }
  const lua_Integer i = lua_tointeger(call.L, 2);
  return visit(call, [&](const auto& m) {
    using M = std::decay_t<decltype(m)>;
    if (m.rows() == 1 || m.cols() == 1)
      return push_entry(call.L, m.data()[position(i, m.size(), "entry", shape(m))]);
    return push_matrix(call.L, M(m.row(position(i, m.rows(), "row", shape(m)))));
  });
}

int entry(Call& call) {
  if (call.count() == 1 || (call.count() == 2 && call.is<Matrix>(2)))  // A:T() means A.T(A)
    throw Error("A.T is a value: write it without ( )");
  if (call.count() != 3)
    throw Error("expected a row and a column, as in A(2, 3); entry i of a column is q[i]");
  const long i = call.integer(2, "row"), j = call.integer(3, "column");
  return visit(call, [&](const auto& m) {
    return push_entry(call.L,
                      m(position(i, m.rows(), "row", shape(m)), position(j, m.cols(), "column", shape(m))));
  });
}

struct Range {
  Eigen::Index first, count;
};
Range range(long from, long to, Eigen::Index n, const char* what, const std::string& of) {
  if (from < 1 || to > n || from > to + 1)
    throw Error(text(what, " ", from, " to ", to, " are out of range: a ", of, " has ", what, " 1 to ", n));
  return {from - 1, to - from + 1};
}

int slice(Call& call) {
  const long from = call.integer(2, "from"), to = call.integer(3, "to");
  return visit(call, [&](const auto& m) {
    using M = std::decay_t<decltype(m)>;
    if (m.rows() == 1 && m.cols() > 1) {
      const Range r = range(from, to, m.cols(), "entries", shape(m));
      return push_matrix(call.L, M(m.middleCols(r.first, r.count)));
    }
    const Range r = range(from, to, m.rows(), m.cols() == 1 ? "entries" : "rows", shape(m));
    return push_matrix(call.L, M(m.middleRows(r.first, r.count)));
  });
}

int block(Call& call) {
  const long r1 = call.integer(2, "row1"), r2 = call.integer(3, "row2");
  const long c1 = call.integer(4, "column1"), c2 = call.integer(5, "column2");
  return visit(call, [&](const auto& m) {
    using M = std::decay_t<decltype(m)>;
    const Range r = range(r1, r2, m.rows(), "rows", shape(m)),
                c = range(c1, c2, m.cols(), "columns", shape(m));
    return push_matrix(call.L, M(m.block(r.first, c.first, r.count, c.count)));
  });
}

int rows_of(Call& call) { return call.push(static_cast<long>(call.object<Matrix>(1, "matrix").rows())); }
int cols_of(Call& call) { return call.push(static_cast<long>(call.object<Matrix>(1, "matrix").cols())); }

/// The number of elements that [] counts: entries of a vector, rows of a matrix.
long length_of(const Matrix& m) { return m.rows() == 1 ? m.cols() : m.rows(); }
int length(Call& call) { return call.push(length_of(call.object<Matrix>(1, "matrix"))); }

int transpose(Call& call) {
  return visit(call, [&](const auto& m) {
    using M = std::decay_t<decltype(m)>;
    return push_matrix(call.L, M(m.transpose()));
  });
}

int column_of(Call& call) {
  const long j = call.integer(2, "column");
  return visit(call, [&](const auto& m) {
    using M = std::decay_t<decltype(m)>;
    return push_matrix(call.L, M(m.col(position(j, m.cols(), "column", shape(m)))));
  });
}

int matrix_equal(Call& call) {
  if (!call.is<Matrix>(1) || !call.is<Matrix>(2)) return call.push(false);
  const auto &a = call.object<Matrix>(1, "left"), &b = call.object<Matrix>(2, "right");
  if (a.rows() != b.rows() || a.cols() != b.cols()) return call.push(false);
  if (a.numeric() && b.numeric()) return call.push(std::get<Mat>(a.store) == std::get<Mat>(b.store));
  return call.push(exact(a, "the left matrix") == exact(b, "the right matrix"));
}

// ── iteration ──

/// next(m, i) -> i + 1, m[i + 1]. Has no upvalues, so that the loops of ipairs and pairs share one function.
int next_entry(lua_State* L) {
  const auto* held = object_at(L, 1, TypeName<Matrix>::value);
  const lua_Integer i = lua_tointeger(L, 2) + 1;
  if (!held || !*held || i > length_of(*static_cast<const Matrix*>(held->get()))) return 0;
  lua_pushinteger(L, i);
  lua_geti(L, 1, i);
  return 2;
}

int next_in_list(lua_State* L) {
  const lua_Integer i = lua_tointeger(L, 2) + 1;
  lua_pushinteger(L, i);
  return lua_geti(L, 1, i) == LUA_TNIL ? 1 : 2;
}

/// The iterator of counted values (constraints, runs, …), for which an index after the last entry is an error
/// instead of nil.
int next_counted(lua_State* L) {
  const lua_Integer i = lua_tointeger(L, 2) + 1;
  if (i > luaL_len(L, 1)) return 0;
  lua_pushinteger(L, i);
  lua_geti(L, 1, i);
  return 2;
}

lua_CFunction iterator_of(Call& call) {
  if (call.is<Matrix>(1)) return guarded<next_entry>;
  if (lua_type(call.L, 1) != LUA_TUSERDATA || luaL_getmetafield(call.L, 1, "__len") == LUA_TNIL)
    return next_in_list;
  return next_counted;
}

int walk(Call& call) {
  if (call.count() == 0) call.wrong(1, "list", "a list");
  const lua_CFunction next = iterator_of(call);
  lua_settop(call.L, 1);
  lua_pushcfunction(call.L, next);
  lua_insert(call.L, 1);
  lua_pushinteger(call.L, 0);
  return 3;
}

int matrix_to_string(Call& call) {
  collect_aliases(call.L);
  return visit(call, [&](const auto& m) { return call.push(shown(m)); });
}

}  // namespace

extern const Module entries_module = {
    "entries",
    "Entries of vectors and matrices",
    {
        {"ipairs", walk, "for i, e in ipairs(list)",
         "Lua's ipairs, which also walks through columns, matrices, constraints, the runs of a sweep, ….",
         "s = 0; for i, e in ipairs(vec{1, 2, 3}) do s = s + i*e end; s", "14"},
        {"matrix#rows", rows_of, "A.rows", "The number of rows."},
        {"matrix#cols", cols_of, "A.cols", "The number of columns."},
        {"matrix#T", transpose, "A.T", "The transpose."},
        {"matrix:slice", slice, "v:slice(i, j) -> vector",
         "Entries i to j of a vector, rows i to j of a matrix.", "vec{1, 2, 3, 4}:slice(2, 3)[1]", "2"},
        {"matrix:block", block, "A:block(r1, r2, c1, c2) -> matrix", "Rows r1 to r2, columns c1 to c2.",
         "eye(4):block(1, 2, 1, 3).cols", "3"},
        {"matrix:col", column_of, "A:col(j) -> column", "Column j.", "eye(3):col(2)[2]", "1"},
        {"matrix:__index", matrix_index, "v[i]",
         "Entry i of a vector, row i of a matrix; out of range is an error.",
         R"(
             A = mat{{1, 2}, {3, 4}}
             A[2], A[2][1])",
         "[3  4] 3"},
        {"matrix:__call", entry, "A(i, j)", "The entry in row i and column j.", "mat{{1, 2}, {3, 4}}(1, 2)",
         "2"},
        {"matrix:__len", length, "#v", "The number of entries of a vector, of rows of a matrix."},
        {"matrix:__eq", matrix_equal, "a == b", "Same shape and same entries (structure, not value).",
         "vec{1, 2} == vec{1, 2}, vec{1, 2} == vec{2, 1}", "true false"},
        {"matrix:__pairs", walk, "for i, e in pairs(v)", "Entries of a vector, rows of a matrix, in order.",
         "for i, e in pairs(vec{5, 7}) do print(i, e) end", R"(
             1 5
             2 7)"},
        {"matrix:__tostring", matrix_to_string, "tostring(A)",
         "A column as a vector expression by names, a matrix as a grid."},
    }};

}  // namespace pendula::lua
