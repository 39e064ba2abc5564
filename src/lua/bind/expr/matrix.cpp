// The `matrices` module: construction and concatenation of vectors and matrices, sums and
// products of vectors.
#include "lua/bind/expr/matrix.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/text.hpp"

namespace pendula::lua {
namespace {

// ── construction ──

long size_argument(Call& call, int i, const char* name, std::optional<long> fallback = {}) {
  const long n = fallback ? call.integer(i, name, *fallback) : call.integer(i, name);
  if (n < 0) throw Error(text(name, " is ", n, ", but a size cannot be negative"));
  return n;
}

int vec(Call& call) {
  if (call.count() != 1) lua_createtable(call.L, call.count(), 0);  // vec(1, 2, 3) means vec{1, 2, 3}
  if (call.count() != 1) {
    lua_insert(call.L, 1);
    for (int i = call.count(); i >= 1; --i) lua_rawseti(call.L, 1, i);
  }
  const MatX m = to_matrix(call.L, 1, "the list");
  if (m.cols() != 1 && m.rows() != 1)
    throw Error(text("a vector has one column, but this is a ", shape(m), "; write mat{ {…}, {…} }"));
  return push_matrix(call.L, m.cols() == 1 ? m : MatX(m.transpose()));
}

/// Rejects a list without rows: mat{1,2;3,4}, as in MATLAB, is such a list, since the semicolon is a
/// comma in Lua.
int mat(Call& call) {
  lua_State* L = call.L;
  if (lua_istable(L, 1) && lua_rawlen(L, 1) > 1) {
    lua_rawgeti(L, 1, 1);
    const bool entry =
        lua_type(L, -1) == LUA_TNUMBER || lua_type(L, -1) == LUA_TSTRING || is_expression(L, -1);
    lua_pop(L, 1);
    if (entry)
      throw Error(
          "a matrix is written by its rows, mat{{1, 2}, {3, 4}}; a column is vec{1, 2}, a row mat{{1, 2}}");
  }
  return push_matrix(L, to_matrix(L, 1, "the matrix"));
}

int eye(Call& call) {
  const long n = size_argument(call, 1, "n");
  check_size(n, n);
  return push_matrix(call.L, MatX(MatX::Identity(n, n)));
}

int constant(Call& call, int value) {
  const long rows = size_argument(call, 1, "rows"), cols = size_argument(call, 2, "cols", 1);
  check_size(rows, cols);
  return push_matrix(call.L, MatX(MatX::Constant(rows, cols, Expr(value))));
}
int zeros(Call& call) { return constant(call, 0); }
int ones(Call& call) { return constant(call, 1); }

int linspace(Call& call) {
  const double from = to_number(call.L, 1, "from"), to = to_number(call.L, 2, "to");
  const long n = call.integer(3, "n");
  if (n < 2) throw Error(text("expected at least 2 points, not ", n));
  check_size(n, 1);
  if (!std::isfinite(from) || !std::isfinite(to)) throw Error("from and to must be finite");
  Vec v(n);
  for (long i = 0; i < n; ++i) {
    const double s = static_cast<double>(i) / static_cast<double>(n - 1);
    v[i] = i == n - 1 ? to : from + s * (to - from);
  }
  return push_matrix(call.L, Mat(v));
}

int logspace(Call& call) {
  constexpr double largest = 307;  // 10^308 is near the overflow threshold
  for (const auto& [i, name] : {std::pair{1, "from"}, std::pair{2, "to"}})
    if (std::fabs(to_number(call.L, i, name)) > largest)
      throw Error(
          text(name, " is an exponent of 10, between -307 and 307: logspace(-1, 2, 4) is 0.1, 1, 10, 100"));
  linspace(call);
  const Mat exponents = to_numeric_matrix(call.L, -1, "exponents");
  return push_matrix(call.L, Mat(exponents.unaryExpr([](double e) { return std::pow(10.0, e); })));
}

// ── concatenation ──

/// The arguments as matrices: doubles only if all are.
struct Blocks {
  std::vector<Value> values;
  bool doubles = true;
};

Blocks read_blocks(Call& call) {
  Blocks blocks;
  for (int i = 1; i <= call.count(); ++i) {
    Value v = to_value(call.L, i, text("argument ", i));
    if (const Expr* e = std::get_if<Expr>(&v)) v = MatX(MatX::Constant(1, 1, *e));
    if (const double* d = std::get_if<double>(&v)) v = Mat(Mat::Constant(1, 1, *d));
    blocks.doubles = blocks.doubles && std::holds_alternative<Mat>(v);
    blocks.values.push_back(std::move(v));
  }
  if (blocks.values.empty()) throw Error("expected at least one matrix" + call.usage());
  return blocks;
}

const MatX& exact_block(Value& v) {
  if (const Mat* m = std::get_if<Mat>(&v)) v = exact(Matrix{*m}, "the matrix");
  return std::get<MatX>(v);
}

enum class Join { below, beside, diagonal };

template <class M>
M joined(const std::vector<M>& blocks, Join how) {
  Eigen::Index rows = 0, cols = 0;
  for (const M& b : blocks) {
    const M& first = blocks.front();
    if ((how == Join::below && b.cols() != first.cols()) || (how == Join::beside && b.rows() != first.rows()))
      throw Error(text("a ", shape(first), " and a ", shape(b), " cannot be joined: they need as many ",
                       how == Join::below ? "columns" : "rows"));
    rows = how == Join::beside ? b.rows() : rows + b.rows();
    cols = how == Join::below ? b.cols() : cols + b.cols();
  }
  check_size(rows, cols);
  M all = M::Zero(rows, cols);
  rows = cols = 0;
  for (const M& b : blocks) {
    all.block(rows, cols, b.rows(), b.cols()) = b;
    if (how != Join::beside) rows += b.rows();
    if (how != Join::below) cols += b.cols();
  }
  return all;
}

int join_blocks(Call& call, Join how) {
  Blocks blocks = read_blocks(call);
  if (blocks.doubles) {
    std::vector<Mat> list;
    for (Value& v : blocks.values) list.push_back(std::get<Mat>(std::move(v)));
    return push_matrix(call.L, joined(list, how));
  }
  std::vector<MatX> list;
  for (Value& v : blocks.values) list.push_back(exact_block(v));
  return push_matrix(call.L, joined(list, how));
}
int vstack(Call& call) { return join_blocks(call, Join::below); }
int hstack(Call& call) { return join_blocks(call, Join::beside); }
int blkdiag(Call& call) { return join_blocks(call, Join::diagonal); }

int diag(Call& call) {
  const MatX m = to_matrix(call.L, 1, "v");
  if (m.cols() == 1 || m.rows() == 1) {
    check_size(m.size(), m.size());
    MatX d = MatX::Zero(m.size(), m.size());
    for (Eigen::Index i = 0; i < m.size(); ++i) d(i, i) = m.data()[i];
    return push_matrix(call.L, d);
  }
  return push_matrix(call.L, MatX(m.diagonal()));
}

// ── sums ──

/// sum(list) by Lua's own +, so that values of any type with + can be summed.
int sum_of(Call& call) {
  if (call.count() != 1) throw Error("expected one list, as in sum{a, b, c}");
  if (call.is<Matrix>(1)) return visit(call, [&](const auto& m) { return push_entry(call.L, m.sum()); });
  if (!lua_istable(call.L, 1)) {
    lua_settop(call.L, 1);
    return push(call.L, to_value(call.L, 1, "the list"));
  }
  const lua_Integer n = list_size(call.L, 1, "the list");
  lua_pushinteger(call.L, 0);
  for (lua_Integer i = 1; i <= n; ++i) {
    const int type = lua_rawgeti(call.L, 1, i);
    if (type != LUA_TNUMBER && type != LUA_TUSERDATA && type != LUA_TSTRING)
      throw Error(text("entry ", i, " of the list must be a number, an expression or a matrix, got ",
                       describe(call.L, -1)));
    if (type == LUA_TSTRING) {  // Lua's + reads "2" but not "1/2"
      push_expr(call.L, to_expr(call.L, -1, text("entry ", i, " of the list")));
      lua_remove(call.L, -2);
    }
    if (i == 1)
      lua_remove(call.L, -2);  // the sum of vectors starts with the first one
    else
      lua_arith(call.L, LUA_OPADD);
  }
  return 1;
}

int map(Call& call) {
  call.function(2, "f");
  const bool of_matrix = call.is<Matrix>(1);
  if (!of_matrix) call.table(1, "list");
  lua_settop(call.L, 2);
  const lua_Integer n = of_matrix ? 0 : list_size(call.L, 1, "the list");
  if (!of_matrix) {
    lua_createtable(call.L, static_cast<int>(std::min<lua_Integer>(n, 1 << 20)), 0);
    for (lua_Integer i = 1; i <= n; ++i) {
      lua_pushvalue(call.L, 2);
      lua_rawgeti(call.L, 1, i);
      lua_pushinteger(call.L, i);
      protected_call(call.L, 2, 1);
      lua_rawseti(call.L, 3, i);
    }
    return 1;
  }
  return visit(call, [&](const auto& m) {
    using M = std::decay_t<decltype(m)>;
    M result(m.rows(), m.cols());
    for (Eigen::Index k = 0; k < m.size(); ++k) {
      lua_pushvalue(call.L, 2);
      push_entry(call.L, m.data()[k]);
      lua_pushinteger(call.L, k + 1);
      protected_call(call.L, 2, 1);
      const std::string what = text("what the function returned for entry ", k + 1);
      if constexpr (std::is_same_v<M, Mat>) {
        result.data()[k] = to_number(call.L, lua_gettop(call.L), what);
      } else {
        result.data()[k] = to_expr(call.L, lua_gettop(call.L), what);
      }
      lua_pop(call.L, 1);
    }
    return push_matrix(call.L, result);
  });
}

// ── products of vectors ──

MatX vector(Call& call, int i, const char* name) {
  const MatX m = to_matrix(call.L, i, name);
  if (m.cols() == 1) return m;
  if (m.rows() == 1) return m.transpose();
  throw Error(text(name, " must be a vector, not a ", shape(m)));
}

Value as_column(Call& call, int i, const char* name) {
  if (call.is<Matrix>(i) && call.object<Matrix>(i, name).numeric()) {
    const Mat& m = std::get<Mat>(call.object<Matrix>(i, name).store);
    if (m.cols() == 1) return m;
    if (m.rows() == 1) return Mat(m.transpose());
  }
  return vector(call, i, name);
}

int matrix_dot(Call& call) {
  Value a = as_column(call, 1, "a"), b = as_column(call, 2, "b");
  if (shape(a) != shape(b)) throw Error(text("a ", shape(a), " and a ", shape(b), " have no inner product"));
  Value row = std::visit(
      [](const auto& m) -> Value {
        if constexpr (requires { m.transpose(); })
          return std::decay_t<decltype(m)>(m.transpose());
        else
          return m;
      },
      a);
  return push(call.L, product(row, b));
}

int cross(Call& call) {
  const MatX a = vector(call, 1, "a"), b = vector(call, 2, "b");
  if (a.size() != 3 || b.size() != 3)
    throw Error(
        text("the cross product needs two vectors with 3 entries, not ", a.size(), " and ", b.size()));
  MatX c(3, 1);
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    c(i, 0) = a(j, 0) * b(k, 0) - a(k, 0) * b(j, 0);
  }
  return push_matrix(call.L, c);
}

/// The norm of a linear system: norm(G, "inf") is G:norm "inf".
int norm_of_system(Call& call) {
  lua_getfield(call.L, 1, "norm");
  lua_insert(call.L, 1);
  protected_call(call.L, call.count(), LUA_MULTRET);
  return lua_gettop(call.L);
}

/// ‖v‖₁ = Σ|vᵢ|, ‖v‖₂, ‖v‖∞ = max |vᵢ|.
int other_norm(Call& call) {
  const VecX size = to_column(call.L, 1, "v").unaryExpr([](const Expr& e) { return abs(e); });
  const bool text = lua_type(call.L, 2) == LUA_TSTRING;
  const double p = text && call.string(2, "p") == "inf" ? HUGE_VAL : text ? 0 : call.number(2, "p");
  if (p == 1) return push_expr(call.L, size.sum());
  if (p == 2) return push_expr(call.L, sqrt(multiply(size.transpose(), size)(0, 0)));
  if (p != HUGE_VAL) call.wrong(2, "p", "1, 2 or \"inf\"");
  Expr largest = 0;
  for (const Expr& e : size) largest = max(largest, e);
  return push_expr(call.L, largest);
}

int norm(Call& call) {
  if (object_type(call.L, 1) == std::string("lti")) return norm_of_system(call);
  if (call.has(2)) return other_norm(call);
  if (call.is<Matrix>(1) && call.object<Matrix>(1, "v").numeric()) {
    const Mat& m = std::get<Mat>(call.object<Matrix>(1, "v").store);
    if (m.cols() == 1 || m.rows() == 1) return call.push(m.norm());
  }
  const MatX v = vector(call, 1, "v");
  if (v.size() == 1) return push_expr(call.L, abs(v(0, 0)));
  return push_expr(call.L, sqrt(multiply(v.transpose(), v)(0, 0)));
}

}  // namespace

extern const Module matrix_module = {
    "matrices",
    "Vectors and matrices",
    {
        {"vec", vec, "vec{a, b, …} -> column", "A column; columns in the list are stacked.",
         "vec{1, 2, 3}.T*vec{1, 1, 1}", "6"},
        {"mat", mat, "mat{{a, b}, {c, d}} -> matrix",
         "A matrix from its rows; entries may be blocks that fit.", "A = mat{{1, 2}, {3, 4}}; A(2, 1)", "3"},
        {"eye", eye, "eye(n) -> matrix", "The n×n identity.", "eye(2)*vec{3, 4} == vec{3, 4}", "true"},
        {"zeros", zeros, "zeros(rows [, cols]) -> matrix", "A matrix of zeros; one column by default.",
         "zeros(2, 3).cols", "3"},
        {"ones", ones, "ones(rows [, cols]) -> matrix", "A matrix of ones; one column by default.",
         "sum(ones(2, 3))", "6"},
        {"diag", diag, "diag(v) -> matrix",
         "The diagonal matrix of a vector, or the diagonal of a matrix as a column.", "diag{1, 2}(2, 2)",
         "2"},
        {"linspace", linspace, "linspace(from, to, n) -> column",
         "n numbers at equal distances, both ends included.", "linspace(0, 1, 11)[4]", "0.3"},
        {"logspace", logspace, "logspace(from, to, n) -> column",
         "n numbers from 10^from to 10^to at equal ratios.", "logspace(-1, 1, 3)[3]", "10.0"},
        {"vstack", vstack, "vstack(a, b, …) -> matrix", "One above the other.", "#vstack(vec{1, 2}, 3)", "3"},
        {"hstack", hstack, "hstack(a, b, …) -> matrix", "Side by side.", "hstack(eye(2), vec{5, 6})(2, 3)",
         "6"},
        {"blkdiag", blkdiag, "blkdiag(A, B, …) -> matrix", "Blocks on the diagonal, zeros elsewhere.",
         "blkdiag(eye(2), 7)(3, 3)", "7"},
        {"sum", sum_of, "sum(list) or sum{a, b, c} -> value",
         "The sum of a list or of all entries of a matrix.", "sum{1, 2, 3.5}", "6.5"},
        {"map", map, "map(list, f) -> list", "f(entry, i) for every entry of a list or a matrix.",
         "map({1, 2, 3}, function(x) return x^2 end)[3]", "9.0"},
        {"dot", matrix_dot, "dot(a, b) -> scalar", "The inner product aᵀb.", "dot({1, 2}, {3, 4})", "11"},
        {"cross", cross, "cross(a, b) -> column", "The vector product of two vectors with three entries.",
         "cross({1, 0, 0}, {0, 1, 0})[3]", "1"},
        {"norm", norm, "norm(v [, p]) -> scalar",
         "The Euclidean length √(vᵀv); with p = 1 the sum of the sizes, with p = \"inf\" the largest; of a linear "
         "system G:norm(), norm(G, \"inf\").",
         "norm{3, 4}, norm({3, -4}, 1), norm({3, -4}, \"inf\")", "5 7 4"},
    }};

}  // namespace pendula::lua
