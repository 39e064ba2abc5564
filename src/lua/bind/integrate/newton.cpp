// The Newton laboratory: newton{…} and the type "newton". Reads arguments, calls src/integrate.
#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "lab/newton_lab.hpp"
#include "lua/bind/integrate/iterates.hpp"
#include "lua/read/traced.hpp"

namespace pendula::lua {

/// A run with the data needed to repeat it from other starts.
struct NewtonRecord {
  lab::NumericFunction f;
  std::vector<Expr> x;
  lab::NewtonSettings settings;
  lab::NewtonRun run;
};
template <>
struct TypeName<NewtonRecord> {
  static constexpr const char* value = "newton";
};
struct BasinsRecord {
  lab::Basins basins;
  std::vector<std::string> names;
};
template <>
struct TypeName<BasinsRecord> {
  static constexpr const char* value = "basins";
};

namespace {

using lab::JacobianKind;

void read_jacobian(Call& call, const Options& options, const Problem& problem,
                   lab::NewtonSettings& settings) {
  lua_State* L = call.L;
  settings.jacobian = problem.r.empty() ? JacobianKind::finite_difference : JacobianKind::exact;
  if (!options.has("jacobian")) return;
  const int index = options.push("jacobian");
  if (lua_type(L, index) == LUA_TSTRING) {
    const std::string name = lua_tostring(L, index);
    const std::vector<std::string> known = {"exact", "finite difference", "frozen"};
    const auto it = std::find(known.begin(), known.end(), name);
    if (it == known.end())
      throw Error(text("unknown jacobian '", name, "'.", did_you_mean(name, known),
                       " (\"exact\", \"finite difference\", \"frozen\", or a matrix)"));
    const JacobianKind kinds[] = {JacobianKind::exact, JacobianKind::finite_difference, JacobianKind::frozen};
    settings.jacobian = kinds[it - known.begin()];
  } else {
    MatX M;
    std::string why;
    if (lua_isfunction(L, index)) {
      const auto traced = trace(L, index, problem.x, why);
      if (!traced) throw Error(text("jacobian is a function that cannot be evaluated with symbols: ", why));
      M = *traced;
    } else {
      M = to_matrix(L, index, "jacobian");
    }
    const auto n = static_cast<Eigen::Index>(problem.x.size());
    if (M.rows() != n || M.cols() != n)
      throw Error(text("jacobian is ", M.rows(), "×", M.cols(), "; for ", n,
                       n == 1 ? " unknown" : " unknowns", " it must be ", n, "×", n));
    auto values = problem.values;  // parameters that occur only in the given matrix
    for (Expr leaf : leaves({M.data(), static_cast<std::size_t>(M.size())}))
      if (const auto& value = symbol_of(leaf).value; value && !values.count(leaf))
        values[leaf] = number_value(*value).value_or(NAN);
    settings.jacobian = JacobianKind::given;
    settings.given = lab::compile_matrix({M.data(), M.data() + M.size()}, problem.x, values);
  }
  lua_settop(L, call.count());
}

void read_alpha(Call& call, const Options& options, lab::NewtonSettings& settings) {
  if (!options.has("alpha")) return;
  const int index = options.push("alpha");
  if (lua_type(call.L, index) == LUA_TSTRING) {
    const std::string name = lua_tostring(call.L, index);
    if (name != "line search")
      throw Error(text("unknown alpha '", name, "'; give a number 0 < alpha ≤ 1 or \"line search\""));
    settings.line_search = true;
  } else {
    settings.alpha = to_number(call.L, index, "alpha");
    if (!(settings.alpha > 0 && settings.alpha <= 1))
      throw Error(text("alpha = ", rounded(settings.alpha), settings.alpha == 0 ? " never moves" : "",
                       "; the step length must satisfy 0 < alpha ≤ 1, or be \"line search\""));
  }
  lua_settop(call.L, call.count());
}

double read_tolerance(const Options& options) {
  const double tol = options.number("tol", 1e-12);
  if (!(tol > 0) || !std::isfinite(tol))
    throw Error(text("tol = ", rounded(tol), "; it must be a positive number, such as tol = 1e-12"));
  return tol;
}

int read_max(const Options& options) {
  const long max = options.integer("max", 0);
  if (options.has("max") && (max < 1 || max > 10'000'000))
    throw Error(text("max = ", max, "; the number of iterations must lie between 1 and 10 000 000"));
  return static_cast<int>(max);
}

bool wants_exact(lua_State* L, const Options& options) {
  if (!options.has("jacobian")) return true;
  const bool differences = lua_type(L, options.push("jacobian")) == LUA_TSTRING &&
                           std::string(lua_tostring(L, -1)) == "finite difference";
  lua_pop(L, 1);
  return !differences;
}

int newton(Call& call) {
  call.table(1, "{ r =, x =, start = }");
  const Options options = call.options(1);
  auto record = std::make_shared<NewtonRecord>();
  Problem problem = read_problem(call, options, "r", !wants_exact(call.L, options));
  const auto n = static_cast<int>(problem.x.size());
  if (problem.f.outputs != n)
    throw Error(text(
        "r has ", problem.f.outputs, problem.f.outputs == 1 ? " equation" : " equations", " for ", n,
        n == 1 ? " unknown" : " unknowns", " (", join(problem.f.unknowns, ", "),
        "); Newton's method needs as many equations as unknowns. For least squares: gauss_newton{ R = … }"));
  read_alpha(call, options, record->settings);
  read_jacobian(call, options, problem, record->settings);
  record->settings.tol = read_tolerance(options);
  record->settings.max = read_max(options);
  record->settings.difference = options.number("h", 0);
  if (options.has("h") && !(record->settings.difference > 0 && record->settings.difference < 1))
    throw Error("h is the relative step of finite differences; it must lie between 0 and 1");
  record->run = lab::iterate(problem.f, record->settings, problem.start);
  lab::judge(problem.f, record->settings, record->run);
  record->f = std::move(problem.f);
  record->x = std::move(problem.x);
  return call.push(std::shared_ptr<const NewtonRecord>(std::move(record)));
}

// ── fields ──

const NewtonRecord& newton_of(Call& call) { return call.object<NewtonRecord>(1, "newton"); }

int newton_solution(Call& call) { return push_value(call.L, Mat(newton_of(call).run.x.back())); }
int newton_converged(Call& call) { return call.push(newton_of(call).run.converged()); }
int newton_status(Call& call) { return call.push(ending_name(newton_of(call).run.ending)); }
int newton_iterations(Call& call) { return call.push(newton_of(call).run.iterations()); }
int newton_verdict(Call& call) { return call.push(newton_of(call).run.verdict); }
int newton_residuals(Call& call) { return push_column(call, newton_of(call).run.norm); }
int steps(Call& call) { return push_column(call, newton_of(call).run.alpha); }

int newton_iterates(Call& call) {
  const auto& x = newton_of(call).run.x;
  lua_createtable(call.L, static_cast<int>(x.size()), 0);
  for (std::size_t k = 0; k < x.size(); ++k) {
    push_value(call.L, Mat(x[k]));
    lua_rawseti(call.L, -2, static_cast<lua_Integer>(k) + 1);
  }
  return 1;
}

int newton_order(Call& call) {
  return push_or_nil(call, newton_of(call).run.observed.order > 0, newton_of(call).run.observed.order);
}
int newton_rate(Call& call) {
  return push_or_nil(call, newton_of(call).run.observed.rate > 0, newton_of(call).run.observed.rate);
}
int newton_predicted(Call& call) { return call.push(newton_of(call).run.predicted); }
int newton_errors(Call& call) {
  const auto& run = newton_of(call).run;
  if (run.observed.error.empty()) return call.push_nil();
  return push_column(call, run.observed.error);
}
int null_vector(Call& call) {
  const auto& run = newton_of(call).run;
  if (run.null_vector.size() == 0) return call.push_nil();
  return push_value(call.L, Mat(run.null_vector));
}
int newton_text(Call& call) {
  const NewtonRecord& k = newton_of(call);
  return call.push(lab::newton_text(k.f, k.settings, k.run));
}

// ── basins ──

Vec grid(double low, double high, long n) { return Vec::LinSpaced(n, low, high); }

int basins(Call& call) {
  const NewtonRecord& k = newton_of(call);
  lua_State* L = call.L;
  if (k.f.n() != 2)
    throw Error(text("a picture of basins needs two unknowns, these equations have ", k.f.n()));
  long n = 60;
  std::array<std::array<double, 2>, 2> range;
  for (std::size_t j = 0; j < 2; ++j) {  // by default a square around the start and the solution
    const double a = k.run.x.front()[j], b = k.run.x.back()[j];
    const double reach =
        std::isfinite(b) && std::fabs(b) < 1e6 ? std::max({2.0, std::fabs(a), std::fabs(b)}) : 2.0;
    range[j] = {-1.5 * reach, 1.5 * reach};
  }
  if (call.has(2)) {
    call.table(2, "{ x = { low, high }, y = { low, high }, n = 60 }");
    lua_newtable(L);  // the ranges, without n
    const int ranges = lua_gettop(L);
    for (lua_pushnil(L); lua_next(L, 2) != 0;) {
      if (lua_type(L, -2) == LUA_TSTRING && std::string(lua_tostring(L, -2)) == "n") {
        n = static_cast<long>(to_number(L, lua_gettop(L), "n"));
        lua_pop(L, 1);
        continue;
      }
      lua_pushvalue(L, -2);
      lua_insert(L, -2);
      lua_settable(L, ranges);
    }
    each_symbol_entry(L, ranges, "basins", k.x, [&](const SymbolEntry& entry) {
      const auto j =
          static_cast<std::size_t>(std::find(k.x.begin(), k.x.end(), entry.leaves[0]) - k.x.begin());
      const Vec ends = to_numbers(L, entry.value, "the range of " + entry.key());
      if (j > 1 || ends.size() != 2 || !(ends[0] < ends[1]) || !ends.allFinite())
        throw Error(
            text("the range of ", entry.key(), " must be { low, high } of an unknown, with low < high"));
      range[j] = {ends[0], ends[1]};
    });
  }
  if (n < 2 || n > 2000)
    throw Error(text("n = ", n, "; the grid must have between 2 and 2000 points per side"));
  auto record = std::make_shared<BasinsRecord>();
  record->names = k.f.unknowns;
  record->basins =
      lab::basins(k.f, k.settings, grid(range[0][0], range[0][1], n), grid(range[1][0], range[1][1], n));
  return call.push(std::shared_ptr<const BasinsRecord>(std::move(record)));
}

const BasinsRecord& basin(Call& call) { return call.object<BasinsRecord>(1, "basins"); }

int basin_roots(Call& call) {
  const auto& roots = basin(call).basins.roots;
  lua_createtable(call.L, static_cast<int>(roots.size()), 0);
  for (std::size_t k = 0; k < roots.size(); ++k) {
    push_value(call.L, Mat(roots[k]));
    lua_rawseti(call.L, -2, static_cast<lua_Integer>(k) + 1);
  }
  return 1;
}
int basin_numbers(Call& call) {
  return push_matrix(call.L, Mat(basin(call).basins.root.cast<double>().transpose()));
}
int basin_iterations(Call& call) {
  return push_matrix(call.L, Mat(basin(call).basins.iterations.cast<double>().transpose()));
}
int basin_names(Call& call) {
  lua_createtable(call.L, 2, 0);
  for (int j = 0; j < 2; ++j) {
    const std::string& name = basin(call).names[j];
    lua_pushlstring(call.L, name.data(), name.size());
    lua_rawseti(call.L, -2, j + 1);
  }
  return 1;
}
int basin_first(Call& call) { return push_matrix(call.L, Mat(basin(call).basins.first)); }
int basin_second(Call& call) { return push_matrix(call.L, Mat(basin(call).basins.second)); }

int basin_text(Call& call) {
  const auto& b = basin(call).basins;
  Table table({true, false, true, true});
  const auto row = [&](int number, const std::string& where) {
    long count = 0, iterations = 0;
    for (Eigen::Index i = 0; i < b.root.size(); ++i)
      if (b.root.data()[i] == number) ++count, iterations += b.iterations.data()[i];
    if (count == 0) return;
    table.row({number ? std::to_string(number) : "", where,
               rounded(100.0 * static_cast<double>(count) / static_cast<double>(b.root.size()), 3) + " %",
               number ? rounded(static_cast<double>(iterations) / static_cast<double>(count), 3) : ""});
  };
  table.row({"", "root", "starts", "mean iterations"});
  for (std::size_t k = 0; k < b.roots.size(); ++k) {
    std::vector<std::string> values;
    for (double v : b.roots[k]) values.push_back(rounded(std::fabs(v) < 1e-9 ? 0 : v, 8));
    row(static_cast<int>(k) + 1, "(" + join(values, ", ") + ")");
  }
  row(0, "none");
  const std::string out = table.str(2);
  return call.push(text("basins of Newton's method on ", b.first.size(), "×", b.second.size(), " starts in (",
                        join(basin(call).names, ", "), "): ", b.roots.size(),
                        b.roots.size() == 1 ? " root\n" : " roots\n", out.substr(0, out.size() - 1)));
}

const OptionTable newton_options = {
    {"r", "expression, list or function", "",
     "the equations r(x) = 0: expressions, equations or a Lua function"},
    {"x", "list of symbols", "", "the unknowns, in this order; else in order of declaration"},
    {"start", "number, list or table", "", "where it begins"},
    {"alpha", "number or string", "1", "length of the step, or a line search", "line search"},
    {"tol", "number", "1e-12", "it ends where ‖r‖ ≤ tol"},
    {"jacobian", "string or matrix", "\"exact\"", "how ∂r/∂x is found", "exact|finite difference|frozen"},
    {"max", "integer", "", "most iterations"},
    {"h", "number", "", "relative step of finite differences"},
    {"params", "table", "", "values of parameters: { m = 2 }"},
};

}  // namespace

extern const Module newton_module = {
    "newton",
    "Newton's method",
    {
        {"newton", newton,
         R"(newton{ r =, x =, start =, alpha = 1 | "line search", tol = 1e-12, jacobian = "exact" | "finite
            difference" | "frozen" | matrix, max =, h =, params = } -> newton)",
         R"(Solves r(x) = 0 by ∂r/∂x Δx + r = 0, x ← x + α Δx, and keeps every iterate. print shows the
            table with ‖r‖, contraction and observed order, and says why convergence is quadratic, linear
            or absent. r: expressions or equations, or a Lua function (its derivatives come from tracing it
            with symbols). h: relative step of finite differences.)",
         R"(
            x = var "x"
            k = newton{ r = x^2 - 2, start = {1} }
            print(("%.9f"):format(k.x), k.converged))",
         "1.414213562 true", &newton_options},
        {"newton#x", newton_solution, "k.x -> column or number", "The last iterate.", "", ""},
        {"newton#converged", newton_converged, "k.converged -> boolean",
         "‖r‖ ≤ tol, or at the rounding level of its terms.", "", ""},
        {"newton#status", newton_status, "k.status -> string",
         R"("converged", "singular Jacobian", "cycle", "diverged", "undefined", "line search stalled", "no
            root" or "not converged".)",
         "", ""},
        {"newton#iterations", newton_iterations, "k.iterations -> integer", "Steps taken.", "", ""},
        {"newton#iterates", newton_iterates, "k.iterates -> list of columns", "iterates[1] is the start.", "",
         ""},
        {"newton#residuals", newton_residuals, "k.residuals -> column",
         "‖r‖ of every iterate, for semilogy(k.residuals).", "", ""},
        {"newton#errors", newton_errors, "k.errors -> column",
         "‖x - x⋆‖ of every iterate, x⋆ found by further exact steps; nil without convergence.", "", ""},
        {"newton#order", newton_order, "k.order -> number",
         R"(The slope of log ‖e₊‖ over log ‖e‖ through the last pairs of errors above rounding; nil if
            there are too few.)",
         "", ""},
        {"newton#rate", newton_rate, "k.rate -> number",
         R"(The last measured ‖e₊‖/‖e‖ where convergence is linear, ‖e₊‖/‖e‖² otherwise; nil if there is
            none.)",
         "", ""},
        {"newton#predicted_rate", newton_predicted, "k.predicted_rate -> number",
         R"(The spectral radius of I - α M⁻¹ ∂r/∂x at the solution, M the Jacobian used: the linear rate to
            expect.)",
         "", ""},
        {"newton#alphas", steps, "k.alphas -> column", "The step length of every iteration.", "", ""},
        {"newton#null_vector", null_vector, "k.null_vector -> column",
         "Where ∂r/∂x is singular (the last iterate or the root): the direction in which it does not change r; else nil.",
         "", ""},
        {"newton#verdict", newton_verdict, "k.verdict -> string",
         "Why convergence is quadratic, linear or absent, in words.", "", ""},
        {"newton:basins", basins, "k:basins{ x = { low, high }, y = { low, high }, n = 60 } -> basins",
         R"(Which root the method finds from every start of a grid (two unknowns); :plot() draws the
            picture.)",
         R"(
             x, y = vars "x y"
             k = newton{ r = { x^2 - y, y - 1 }, x = { x, y }, start = { 1, 1 } }
             k:basins{ x = { -2, 2 }, y = { -2, 2 }, n = 20 })",
         R"(
             basins of Newton's method on 20×20 starts in (x, y): 2 roots
                  root     starts  mean iterations
               1  (-1, 1)    50 %                5
               2  (1, 1)     50 %                5)"},
        {"newton:__tostring", newton_text, "print(k)", "The table of iterates and the verdict.", "", ""},
        {"basins#roots", basin_roots, "b.roots -> list of columns",
         "The roots found, ordered by the first unknown.", "", ""},
        {"basins#root", basin_numbers, "b.root -> matrix",
         "The number of the root found from each start, 0: none; rows follow the second unknown.", "", ""},
        {"basins#iterations", basin_iterations, "b.iterations -> matrix", "Iterations from each start.", "",
         ""},
        {"basins#names", basin_names, "b.names -> list of strings", "The two unknowns.", "", ""},
        {"basins#first", basin_first, "b.first -> column", "The grid along the first unknown.", "", ""},
        {"basins#second", basin_second, "b.second -> column", "The grid along the second unknown.", "", ""},
        {"basins:__tostring", basin_text, "print(b)",
         "The roots and the part of the starts that leads to each.", "", ""},
    }};

}  // namespace pendula::lua
