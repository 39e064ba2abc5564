#include "lua/bind/expr/expr_evaluate.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "base/counted.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "codegen/kernel/kernel.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/cancellation.hpp"
#include "expr/print/print.hpp"
#include "lua/bind/expr/expr.hpp"
#include "lua/read/traced.hpp"

namespace pendula::lua {

/// fn(arguments, e): a kernel with the data for reading its arguments and explaining its failures.
struct CompiledFunction {
  codegen::Kernel kernel;
  MatX outputs;
  std::vector<Expr> inputs;        ///< listed leaves, then the parameters that keep their defaults
  std::vector<double> defaults;    ///< values of these parameters
  std::vector<std::size_t> sizes;  ///< of the arguments
  std::vector<std::string> names;
  std::size_t listed() const { return inputs.size() - defaults.size(); }
};
template <>
struct TypeName<CompiledFunction> {
  static constexpr const char* value = "fn";
};

namespace {

using Point = std::unordered_map<Expr, double>;

/// The symbols that a key may name: those of the expression, then t and every declared symbol of another
/// name, which does no harm.
std::vector<Expr> nameable(std::span<const Expr> outputs) {
  std::vector<Expr> known = leaves(outputs);
  const auto taken = known;
  std::vector<Expr> extras = declared_symbols();
  extras.insert(extras.begin(), time_symbol());
  for (Expr leaf : extras) {
    const bool clash = std::any_of(taken.begin(), taken.end(), [&](Expr e) {
      return symbol_of(e).name == symbol_of(leaf).name && symbol_of(e).order == 0;
    });
    if (!clash) known.push_back(leaf);
  }
  return known;
}

/// Gives parameters their defaults; throws an error with the names of all that have no value.
void complete(Point& point, std::span<const Expr> outputs, const char* remedy) {
  std::vector<std::string> missing;
  for (Expr leaf : leaves(outputs)) {
    const Symbol& s = symbol_of(leaf);
    if (point.count(leaf) || s.kind == Kind::constant) continue;
    if (s.value) {
      point[leaf] = *number_value(*s.value);
    } else {
      missing.push_back("'" + leaf_name(leaf) + "'");
    }
  }
  if (!missing.empty()) throw Error(text("no value for ", join(missing, ", "), "; ", remedy));
}

[[noreturn]] void undefined(Expr e, const Point& point) {
  const auto culprit = first_undefined(e, point);
  const Expr subexpression = culprit.value_or(e);
  std::vector<std::string> where;
  for (Expr leaf : leaves({&subexpression, 1}))
    if (const auto it = point.find(leaf); it != point.end() && where.size() < 6)
      where.push_back(text(leaf_name(leaf), " = ", rounded(it->second, 6)));
  throw Error(text("'", to_text(subexpression), "' has no finite value", where.empty() ? "" : " at ",
                   join(where, ", ")));
}

/// fn(function(x, y) … end): traces the function with symbols named like its parameters.
void read_lua_function(Call& call, CompiledFunction& f) {
  const int function = call.has(2) ? 2 : 1;
  if (function == 1)
    for (const std::string& name : parameter_names(call.L, 1)) {
      f.inputs.push_back(symbol(Kind::variable, name));
      f.names.push_back(name);
      f.sizes.push_back(1);
    }
  std::vector<Expr> arguments = f.inputs;
  if (arguments.empty())
    throw Error("a function without named parameters needs a list of arguments: fn({x, y}, f)");
  std::string why;
  const auto traced = trace(call.L, function, arguments, why);
  if (!traced)
    throw Error(text("the function cannot be evaluated with symbols: ", why,
                     "\nUse the vocabulary's functions (sin, not math.sin; ifelse, not if)"));
  f.outputs = *traced;
}

/// The arguments of fn: a list whose entries are symbols or columns, or one of them.
void read_signature(Call& call, CompiledFunction& f, std::span<const Expr> known) {
  lua_State* L = call.L;
  const bool list = lua_istable(L, 1);
  const lua_Integer n = list ? list_size(L, 1, "the list of arguments") : 1;
  for (lua_Integer i = 1; i <= n; ++i) {
    if (list)
      lua_rawgeti(L, 1, i);
    else
      lua_pushvalue(L, 1);
    const auto some = to_leaves(L, lua_gettop(L), text("argument ", i, " of the function"), known);
    f.names.push_back(lua_type(L, -1) == LUA_TSTRING ? lua_tostring(L, -1)
                      : some.size() == 1             ? leaf_name(some[0])
                                                     : vector_to_text(column(some)));
    lua_pop(L, 1);
    f.sizes.push_back(some.size());
    for (Expr leaf : some) {
      if (std::find(f.inputs.begin(), f.inputs.end(), leaf) != f.inputs.end())
        throw Error(text("'", leaf_name(leaf), "' is listed twice among the arguments"));
      f.inputs.push_back(leaf);
    }
  }
}

/// Parameters that are not listed keep their defaults; anything else that is not listed is an error.
void add_defaults(CompiledFunction& f) {
  Point point;
  for (Expr leaf : f.inputs) point[leaf] = 0;
  complete(point, entries(f.outputs), "list it among the arguments");
  for (Expr leaf : leaves(entries(f.outputs))) {
    if (symbol_of(leaf).kind == Kind::constant) continue;
    if (std::find(f.inputs.begin(), f.inputs.end(), leaf) != f.inputs.end()) continue;
    f.inputs.push_back(leaf);
    f.defaults.push_back(point[leaf]);
  }
}

/// Points by rows. `single`: the arguments were a single point.
struct Points {
  Mat rows;
  bool single = true;
};

Mat argument(Call& call, int i, const std::string& name) {
  if (lua_type(call.L, i) == LUA_TNUMBER) return Mat::Constant(1, 1, lua_tonumber(call.L, i));
  return to_numeric_matrix(call.L, i, text("argument '", name, "'"));
}

Points one_matrix(Call& call, const CompiledFunction& f, Mat m) {
  const auto width = static_cast<Eigen::Index>(f.listed());
  if (f.sizes.size() == 1 && m.cols() == 1 && m.rows() == width) return {m.transpose(), true};
  if (m.cols() != width)
    throw Error(text("a matrix argument holds one point per row: it needs ", width, " columns (",
                     join(f.names, ", "), "), not ", m.cols()));
  const bool scalar = m.size() == 1 && lua_type(call.L, 2) == LUA_TNUMBER;
  return {std::move(m), scalar};
}

Points read_points(Call& call, const CompiledFunction& f) {
  const int given = call.count() - 1, expected = static_cast<int>(f.sizes.size());
  if (given == 1 && expected != 1 && lua_type(call.L, 2) == LUA_TUSERDATA)
    return one_matrix(call, f, argument(call, 2, "points"));
  if (given != expected)
    throw Error(text("expected ", expected, expected == 1 ? " argument" : " arguments", " (",
                     join(f.names, ", "), "), got ", given));
  if (expected == 1) return one_matrix(call, f, argument(call, 2, f.names[0]));
  std::vector<Mat> blocks;
  Eigen::Index points = 1;
  for (int i = 0; i < expected; ++i) {
    Mat m = argument(call, i + 2, f.names[i]);
    const auto size = static_cast<Eigen::Index>(f.sizes[i]);
    if (size > 1 && m.cols() == 1 && m.rows() == size) m.transposeInPlace();
    if (m.cols() != size)
      throw Error(text("argument '", f.names[i], "' needs ", size, size == 1 ? " number" : " numbers",
                       " per point, not ", m.cols() == 1 ? m.rows() : m.cols()));
    if (m.rows() != 1 && points != 1 && m.rows() != points)
      throw Error(text("argument '", f.names[i], "' has ", m.rows(), " points, another one ", points));
    if (m.rows() != 1) points = m.rows();  // none, too
    blocks.push_back(std::move(m));
  }
  Points result{Mat(points, static_cast<Eigen::Index>(f.listed())), points == 1};
  Eigen::Index at = 0;
  for (const Mat& m : blocks) {
    for (Eigen::Index r = 0; r < points; ++r)
      result.rows.row(r).segment(at, m.cols()) = m.row(m.rows() == 1 ? 0 : r);
    at += m.cols();
  }
  return result;
}

}  // namespace

int push_evaluated(Call& call) {
  if (call.is<Matrix>(1) && call.object<Matrix>(1, "e").numeric()) {
    lua_settop(call.L, 1);
    return 1;
  }
  const MatX e = to_matrix(call.L, 1, "e");
  Point point;
  if (call.has(2))
    for (const auto& [leaf, value] : to_symbol_numbers(call.L, 2, "the table", nameable(entries(e))))
      point[leaf] = value;
  complete(point, entries(e), "give it in the table: evaluate(e, { x = 1 })");
  auto values = evaluate(entries(e), point);
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (!std::isfinite(values[k])) undefined(entries(e)[k], point);
    if (const auto careful = value_without_cancellation(entries(e)[k], point)) values[k] = *careful;
  }
  return push_value(call.L, Mat(Eigen::Map<const Mat>(values.data(), e.rows(), e.cols())));
}

int push_compiled(Call& call) {
  auto f = std::make_shared<CompiledFunction>();
  if (lua_isfunction(call.L, 1) && !call.has(2)) {
    read_lua_function(call, *f);
  } else if (lua_isfunction(call.L, 2)) {
    read_signature(call, *f, declared_symbols());
    read_lua_function(call, *f);
  } else {
    f->outputs = to_matrix(call.L, 2, "e");
    const auto known = leaves(entries(f->outputs));
    read_signature(call, *f, known);
  }
  add_defaults(*f);
  // row by row: a result row contains the outputs of one point in this order
  const MatX by_rows = f->outputs.transpose();
  f->kernel = codegen::Kernel(entries(by_rows), f->inputs);
  return call.push(std::shared_ptr<const CompiledFunction>(std::move(f)));
}

int call_compiled(Call& call) {
  const auto& f = call.object<CompiledFunction>(1, "function");
  const Points points = read_points(call, f);
  const Eigen::Index width = f.outputs.size();
  check_size(points.rows.rows(), width);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> results(points.rows.rows(), width);
  std::vector<double> in(f.inputs.size()), work(f.kernel.workspace_size());
  std::copy(f.defaults.begin(), f.defaults.end(), in.begin() + static_cast<std::ptrdiff_t>(f.listed()));
  for (Eigen::Index r = 0; r < results.rows(); ++r) {
    poll_interrupt();
    for (std::size_t j = 0; j < f.listed(); ++j) in[j] = points.rows(r, static_cast<Eigen::Index>(j));
    f.kernel.run(in.data(), results.row(r).data(), work.data());
    for (Eigen::Index k = 0; k < width; ++k) {
      if (std::isfinite(results(r, k))) continue;
      Point point;
      for (std::size_t j = 0; j < in.size(); ++j) point[f.inputs[j]] = in[j];
      undefined(f.outputs(k / f.outputs.cols(), k % f.outputs.cols()), point);
    }
  }
  if (!points.single) return push_matrix(call.L, Mat(results));
  const Mat shaped = Eigen::Map<decltype(results)>(results.data(), f.outputs.rows(), f.outputs.cols());
  return push_value(call.L, shaped);
}

int compiled_to_string(Call& call) {
  const auto& f = call.object<CompiledFunction>(1, "function");
  return call.push(
      text("fn(", join(f.names, ", "), "): compiled, ", counted(f.kernel.operations(), "operation")));
}

}  // namespace pendula::lua
