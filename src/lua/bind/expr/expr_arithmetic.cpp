// Arithmetic on values of any shape.
#include <array>
#include <cmath>
#include <optional>

#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "lua/bind/expr/expr.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {
namespace {

Expr scalar(const Value& v) {
  return std::holds_alternative<double>(v) ? Expr(std::get<double>(v)) : std::get<Expr>(v);
}

const MatX* exact_matrix(const Value& v) { return std::get_if<MatX>(&v); }
const Mat* double_matrix(const Value& v) { return std::get_if<Mat>(&v); }

MatX to_exact(const Value& v) {
  if (const MatX* m = exact_matrix(v)) return *m;
  return exact(Matrix{std::get<Mat>(v)}, "the matrix");
}

/// The matrix in doubles, or nothing if it contains a symbol.
std::optional<Mat> in_doubles(const Value& v) {
  if (const Mat* m = double_matrix(v)) return *m;
  const MatX& e = std::get<MatX>(v);
  Mat values(e.rows(), e.cols());
  for (Eigen::Index k = 0; k < e.size(); ++k) {
    const auto value = number_value(e.data()[k]);
    if (!value) return {};
    values.data()[k] = *value;
  }
  return values;
}

std::optional<double> scalar_in_double(const Value& v) {
  return std::holds_alternative<double>(v) ? std::get<double>(v) : number_value(std::get<Expr>(v));
}

Value finite(Mat m) {
  if (!m.allFinite()) throw Failure("the result has entries that are not finite numbers");
  return m;
}

struct Size {
  Eigen::Index rows, cols;
  bool operator==(const Size&) const = default;
};

/// A scalar counts as 1×1.
Size size_of(const Value& v) {
  if (const MatX* m = exact_matrix(v)) return {m->rows(), m->cols()};
  if (const Mat* m = double_matrix(v)) return {m->rows(), m->cols()};
  return {1, 1};
}

bool is_zero(const Value& v) {
  return std::holds_alternative<double>(v) ? std::get<double>(v) == 0
                                           : std::holds_alternative<Expr>(v) && std::get<Expr>(v).is_zero();
}

/// a + s b for s = ±1.
Value linear(const Value& a, const Value& b, int s) {
  if (!is_matrix(a) && !is_matrix(b)) return s > 0 ? scalar(a) + scalar(b) : scalar(a) - scalar(b);
  if (is_zero(b)) return a;
  if (is_zero(a)) return s > 0 ? b : product(Expr(-1), b);
  if (!is_matrix(a) || !is_matrix(b))
    throw Error(text("a ", shape(is_matrix(a) ? a : b), " and a scalar cannot be ",
                     s > 0 ? "added" : "subtracted", "; to shift every entry write v + c*ones(rows, cols)"));
  if (size_of(a) != size_of(b))
    throw Error(text("a ", shape(a), " and a ", shape(b), " cannot be ", s > 0 ? "added" : "subtracted"));
  if (double_matrix(a) || double_matrix(b)) {
    const auto x = in_doubles(a), y = in_doubles(b);
    if (x && y) return finite(*x + s * *y);
  }
  const MatX x = to_exact(a), y = to_exact(b);
  return s > 0 ? MatX(x + y) : MatX(x - y);
}

Value scaled(const Value& factor, const Value& m) {
  if (const Mat* data = double_matrix(m))
    if (const auto c = scalar_in_double(factor)) return finite(*c * *data);
  const Expr c = scalar(factor);
  return MatX(to_exact(m).unaryExpr([&](Expr e) { return c * e; }));
}

[[noreturn]] void cannot_multiply(const Value& a, const Value& b) {
  std::string advice;
  const auto column = [](const Value& v) { return shape(v).ends_with("column"); };
  if (column(a) && column(b)) advice = "; for the inner product write a.T*b or dot(a, b)";
  throw Error(text("a ", shape(a), " and a ", shape(b),
                   " cannot be multiplied: the columns of the "
                   "first must match the rows of the second",
                   advice));
}

Value whole_power(const Value& base, long n) {
  const auto rows = size_of(base).rows;
  Value result =
      double_matrix(base) ? Value(Mat(Mat::Identity(rows, rows))) : Value(MatX(MatX::Identity(rows, rows)));
  Value square = base;
  if (n < 0)
    square = double_matrix(base) ? Value(linalg::inverse(*double_matrix(base)))
                                 : Value(linalg::inverse(*exact_matrix(base)));
  for (unsigned long k = n < 0 ? 0ul - static_cast<unsigned long>(n) : static_cast<unsigned long>(n); k > 0;
       k /= 2) {
    if (k % 2 == 1) result = product(result, square);
    if (k > 1) square = product(square, square);
  }
  return result;
}

}  // namespace

bool is_matrix(const Value& v) { return v.index() >= 2; }

static std::string shape_of(Eigen::Index rows, Eigen::Index cols) {
  return text(rows, "×", cols, cols == 1 ? " column" : rows == 1 ? " row" : " matrix");
}
std::string shape(const MatX& m) { return shape_of(m.rows(), m.cols()); }
std::string shape(const Mat& m) { return shape_of(m.rows(), m.cols()); }
std::string shape(const Value& v) {
  if (const MatX* m = exact_matrix(v)) return shape(*m);
  if (const Mat* m = double_matrix(v)) return shape(*m);
  return "scalar";
}

Value to_value(lua_State* L, int index, const std::string& what) {
  if (lua_type(L, index) == LUA_TNUMBER && !lua_isinteger(L, index)) {
    const double value = lua_tonumber(L, index);
    if (!std::isfinite(value)) throw Error(text(what, " is ", shortest(value), ", not a finite number"));
    return value;
  }
  if (const auto* held = object_at(L, index, TypeName<Matrix>::value); held && *held) {
    const auto& m = *static_cast<const Matrix*>(held->get());
    const bool one = m.rows() == 1 && m.cols() == 1;  // a 1×1 matrix is a scalar
    if (m.numeric()) return one ? Value(std::get<Mat>(m.store)(0, 0)) : std::get<Mat>(m.store);
    return one ? Value(std::get<MatX>(m.store)(0, 0)) : std::get<MatX>(m.store);
  }
  if (lua_istable(L, index)) {
    const MatX m = to_matrix(L, index, what);
    return m.size() == 1 ? Value(m(0, 0)) : Value(m);
  }
  if (lua_type(L, index) != LUA_TNUMBER && lua_type(L, index) != LUA_TSTRING &&
      !object_at(L, index, TypeName<Expr>::value))
    to_matrix(L, index, what);  // reports what it must be
  return to_expr(L, index, what);
}

Value to_condition(lua_State* L, int index, const std::string& what) {
  if (lua_isboolean(L, index)) return Expr(lua_toboolean(L, index));
  return to_value(L, index, what);
}

int push(lua_State* L, const Value& value) {
  if (const Expr* e = std::get_if<Expr>(&value)) return push_expr(L, *e);
  if (const MatX* m = exact_matrix(value)) return push_value(L, *m);
  if (const Mat* m = double_matrix(value)) return push_value(L, *m);
  lua_pushnumber(L, std::get<double>(value));
  return 1;
}

Value sum(const Value& a, const Value& b) { return linear(a, b, 1); }
Value difference(const Value& a, const Value& b) { return linear(a, b, -1); }

MatX multiply(const MatX& a, const MatX& b) {
  MatX c(a.rows(), b.cols());
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    poll_interrupt();
    for (Eigen::Index j = 0; j < b.cols(); ++j) {
      Expr entry = 0;
      for (Eigen::Index k = 0; k < a.cols(); ++k)
        if (!a(i, k).is_zero() && !b(k, j).is_zero()) entry += a(i, k) * b(k, j);
      c(i, j) = entry;
    }
  }
  return c;
}

Value product(const Value& a, const Value& b) {
  if (!is_matrix(a) && !is_matrix(b)) return scalar(a) * scalar(b);
  if (!is_matrix(a)) return scaled(a, b);
  if (!is_matrix(b)) return scaled(b, a);
  if (size_of(a).cols != size_of(b).rows) cannot_multiply(a, b);
  if (double_matrix(a) || double_matrix(b)) {
    const auto x = in_doubles(a), y = in_doubles(b);
    if (x && y) return finite(*x * *y);
  }
  return multiply(to_exact(a), to_exact(b));
}

Value quotient(const Value& a, const Value& b) {
  if (is_matrix(b))
    throw Error(
        text("division by a ", shape(b), ": to solve A x = b write solve(A, b); the inverse is inv(A)"));
  if (!is_matrix(a)) return scalar(a) / scalar(b);
  if (is_zero(b)) throw Error("division by zero");
  if (const Mat* data = double_matrix(a))
    if (const auto c = scalar_in_double(b)) return finite(*data / *c);
  const Expr divisor = scalar(b);
  return MatX(to_exact(a).unaryExpr([&](Expr e) { return e / divisor; }));
}

Value power(const Value& a, const Value& b) {
  if (is_matrix(b))
    throw Error(text("a ", shape(b), " cannot be an exponent; for the matrix exponential write expm(A)"));
  if (!is_matrix(a)) return pow(scalar(a), scalar(b));
  const mpq_class* n = exact_value(scalar(b));
  const std::string form = shape(a);
  if (size_of(a).rows != size_of(a).cols)
    throw Error(
        text("a ", form, " has no powers; for entry by entry write map(v, function(e) return e^2 end)"));
  if (!n || n->get_den() != 1 || abs(*n) > 100000)
    throw Error("the exponent of a matrix must be an integer of at most 100000");
  return whole_power(a, n->get_num().get_si());
}

namespace {

struct Common {
  Size size{1, 1};
  bool matrix = false;
};

/// True if a float or a matrix of doubles occurs and all other operands are numbers; the result
/// is in doubles.
bool all_numbers(const std::vector<Value>& operands) {
  bool floating = false;
  for (const Value& v : operands) {
    const bool doubles = std::holds_alternative<double>(v) || double_matrix(v);
    floating = floating || doubles;
    if (!doubles && !(is_matrix(v) ? in_doubles(v).has_value() : scalar_in_double(v).has_value()))
      return false;
  }
  return floating;
}

Common common_shape(Op op, const std::vector<Value>& operands) {
  Common common;
  const Value* first = nullptr;
  for (const Value& v : operands) {
    if (!is_matrix(v)) continue;
    if (first && size_of(*first) != size_of(v))
      throw Error(
          text(info(op).name, ": a ", shape(*first), " and a ", shape(v), " have no entries in common"));
    first = &v;
    common.size = size_of(v);
    common.matrix = true;
  }
  return common;
}

double checked(Op op, const std::array<double, 3>& x) {
  const double value = pendula::apply(op, x[0], x[1], x[2]);
  if (std::isfinite(value)) return value;
  const int arity = info(op).arity;
  const std::string arguments = arity == 1 ? shortest(x[0]) : text(shortest(x[0]), ", ", shortest(x[1]));
  throw Error(text(info(op).name, "(", arguments, ") has no finite real value"));
}

}  // namespace

Value apply_entrywise(Op op, const std::vector<Value>& operands) {
  const Common common = common_shape(op, operands);
  std::vector<Value> x = operands;
  const auto [rows, cols] = common.size;
  if (all_numbers(operands)) {
    for (Value& v : x)
      v = is_matrix(v) ? *in_doubles(v) : Mat(Mat::Constant(rows, cols, *scalar_in_double(v)));
    Mat result(rows, cols);
    for (Eigen::Index k = 0; k < result.size(); ++k) {
      std::array<double, 3> at{};
      for (std::size_t i = 0; i < x.size(); ++i) at[i] = std::get<Mat>(x[i]).data()[k];
      result.data()[k] = checked(op, at);
    }
    return common.matrix ? Value(result) : Value(result(0, 0));
  }
  for (Value& v : x) v = is_matrix(v) ? to_exact(v) : MatX(MatX::Constant(rows, cols, scalar(v)));
  MatX result(rows, cols);
  for (Eigen::Index k = 0; k < result.size(); ++k) {
    std::array<Expr, 3> at;
    for (std::size_t i = 0; i < x.size(); ++i) at[i] = std::get<MatX>(x[i]).data()[k];
    result.data()[k] = make(op, at[0], at[1], at[2]);
  }
  return common.matrix ? Value(result) : Value(result(0, 0));
}

void check_size(long rows, long cols) {
  constexpr long most = 10'000'000;
  if (rows < 0 || cols < 0) throw Error(text("the size ", rows, "×", cols, " is negative"));
  if (rows > most || cols > most || rows * cols > most)
    throw Error(text("a ", rows, "×", cols, " matrix is too large: at most 10 million entries"));
}

}  // namespace pendula::lua
