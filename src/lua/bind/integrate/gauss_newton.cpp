// gauss_newton{…} and the type "gauss_newton". Reads arguments, calls src/integrate.
#include <cmath>

#include "base/text.hpp"
#include "lab/gauss_newton.hpp"
#include "lua/bind/integrate/iterates.hpp"
#include "lua/read/traced.hpp"

namespace pendula::lua {

struct LeastSquaresRecord {
  lab::NumericFunction f;
  lab::GaussNewtonSettings settings;
  lab::GaussNewtonRun run;
};
template <>
struct TypeName<LeastSquaresRecord> {
  static constexpr const char* value = "gauss_newton";
};

namespace {

using lab::Damping;

void read_damping(Call& call, const Options& options, lab::GaussNewtonSettings& settings) {
  if (options.has("alpha")) {
    const int index = options.push("alpha");
    if (lua_type(call.L, index) == LUA_TSTRING) {
      const std::string name = lua_tostring(call.L, index);
      if (name != "line search")
        throw Error(text("unknown alpha '", name, "'; give a number 0 < alpha ≤ 1 or \"line search\""));
      settings.damping = Damping::line_search;
    } else {
      settings.damping = Damping::fixed;
      settings.alpha = to_number(call.L, index, "alpha");
      if (!(settings.alpha > 0 && settings.alpha <= 1))
        throw Error(text("alpha = ", rounded(settings.alpha),
                         "; the step length must satisfy 0 < alpha ≤ 1, or be \"line search\""));
    }
    lua_settop(call.L, call.count());
  }
  if (!options.has("method")) return;
  const std::string method = options.string("method");
  if (method == "levenberg-marquardt")
    settings.damping = Damping::marquardt;
  else if (method != "gauss-newton")
    throw Error(text("unknown method '", method, "'.",
                     did_you_mean(method, {"gauss-newton", "levenberg-marquardt"}),
                     " (\"gauss-newton\" or \"levenberg-marquardt\")"));
}

int gauss_newton(Call& call) {
  call.table(1, "{ R =, x =, start = }");
  const Options options = call.options(1);
  auto record = std::make_shared<LeastSquaresRecord>();
  Problem problem = read_problem(call, options, "R", true);
  read_damping(call, options, record->settings);
  record->settings.tol = options.number("tol", 1e-10);
  if (!(record->settings.tol > 0) || !std::isfinite(record->settings.tol))
    throw Error(
        text("tol = ", rounded(record->settings.tol), "; it must be a positive number, such as tol = 1e-10"));
  const long max = options.integer("max", 200);
  if (max < 1 || max > 10'000'000)
    throw Error(text("max = ", max, "; the number of iterations must lie between 1 and 10 000 000"));
  record->settings.max = static_cast<int>(max);
  record->run = lab::gauss_newton(problem.f, record->settings, problem.start);
  record->f = std::move(problem.f);
  return call.push(std::shared_ptr<const LeastSquaresRecord>(std::move(record)));
}

// ── fields ──

const lab::GaussNewtonRun& run_of(Call& call) {
  return call.object<LeastSquaresRecord>(1, "gauss_newton").run;
}

int push_or_nil(Call& call, bool known, const Mat& value) {
  if (!known) return call.push_nil();
  return push_value(call.L, value);
}

int solution(Call& call) { return push_value(call.L, Mat(run_of(call).x.back())); }
int converged(Call& call) { return call.push(run_of(call).converged()); }
int status(Call& call) { return call.push(ending_name(run_of(call).ending)); }
int iterations(Call& call) { return call.push(run_of(call).iterations()); }
int verdict(Call& call) { return call.push(run_of(call).verdict); }
int residuals(Call& call) { return push_column(call, run_of(call).norm); }
int gradients(Call& call) { return push_column(call, run_of(call).gradient); }
int alphas(Call& call) { return push_column(call, run_of(call).alpha); }
int lambdas(Call& call) { return push_column(call, run_of(call).lambda); }
int final_R(Call& call) { return push_matrix(call.L, Mat(run_of(call).R)); }
int final_J(Call& call) { return push_matrix(call.L, run_of(call).J); }
int loss(Call& call) { return call.push(run_of(call).norm.back() * run_of(call).norm.back() / 2); }
int rank(Call& call) { return call.push(run_of(call).rank); }
int variance(Call& call) { return push_or_nil(call, run_of(call).variance > 0, run_of(call).variance); }
int covariance(Call& call) {
  return push_or_nil(call, run_of(call).covariance.size() > 0, run_of(call).covariance);
}
int deviation(Call& call) {
  const Mat& covariance = run_of(call).covariance;
  return push_or_nil(call, covariance.size() > 0, Mat(covariance.diagonal().cwiseSqrt()));
}
int correlation(Call& call) {
  const Mat& covariance = run_of(call).covariance;
  const Vec inverse = covariance.diagonal().cwiseSqrt().cwiseInverse();
  return push_or_nil(call, covariance.size() > 0,
                     Mat(inverse.asDiagonal() * covariance * inverse.asDiagonal()));
}
int undetermined(Call& call) {
  return push_or_nil(call, run_of(call).undetermined.size() > 0, run_of(call).undetermined);
}
int approximation(Call& call) { return push_value(call.L, Mat(run_of(call).J.transpose() * run_of(call).J)); }
int hessian(Call& call) {
  const auto& run = run_of(call);
  return push_or_nil(call, run.S.size() > 0, Mat(run.J.transpose() * run.J + run.S));
}
int order(Call& call) {
  return push_or_nil(call, run_of(call).observed.order > 0, run_of(call).observed.order);
}
int rate(Call& call) { return push_or_nil(call, run_of(call).observed.rate > 0, run_of(call).observed.rate); }
int predicted(Call& call) { return call.push(run_of(call).predicted); }
int errors(Call& call) {
  if (run_of(call).observed.error.empty()) return call.push_nil();
  return push_column(call, run_of(call).observed.error);
}
int iterates(Call& call) {
  const auto& x = run_of(call).x;
  lua_createtable(call.L, static_cast<int>(x.size()), 0);
  for (std::size_t k = 0; k < x.size(); ++k) {
    push_value(call.L, Mat(x[k]));
    lua_rawseti(call.L, -2, static_cast<lua_Integer>(k) + 1);
  }
  return 1;
}
int run_text(Call& call) {
  const auto& g = call.object<LeastSquaresRecord>(1, "gauss_newton");
  return call.push(lab::gauss_newton_text(g.f, g.settings, g.run));
}

const OptionTable gauss_newton_options = {
    {"R", "expression, list or function", "", "the residuals R(x); ½‖R(x)‖² is minimised"},
    {"x", "list of symbols", "", "the unknowns, in this order; else in order of declaration"},
    {"start", "number, list or table", "", "where it begins"},
    {"alpha", "number or string", "", "length of the step; by default it is halved where needed",
     "line search"},
    {"method", "string", "", "which steps are taken", "gauss-newton|levenberg-marquardt"},
    {"tol", "number", "1e-10", "it ends where steps become smaller, relative to x"},
    {"max", "integer", "200", "most iterations"},
    {"params", "table", "", "values of parameters: { m = 2 }"},
};

}  // namespace

extern const Module gauss_newton_module = {
    "gauss_newton",
    "Nonlinear least squares",
    {
        {"gauss_newton", gauss_newton,
         R"(gauss_newton{ R =, x =, start =, alpha = number | "line search", method = "gauss-newton" |
            "levenberg-marquardt", tol = 1e-10, max = 200, params = } -> gauss_newton)",
         R"(Solves min ½‖R(x)‖², with the Hessian approximated by JᵀJ, J = ∂R/∂x (the term Σ Rᵢ ∇²Rᵢ is
            neglected). By default steps are halved where ‖R‖ would not fall, and Levenberg–Marquardt steps
            help where that is not enough; alpha = 1 takes full steps as they are. print shows the
            iterates, each parameter ± standard deviation, and whether the neglected term explains the
            rate. R: expressions or equations, or a Lua function.)",
         R"(
            a, b = vars "a b"
            g = gauss_newton{ R = { a + b - 1, a + 2*b - 3, a + 3*b - 4 }, start = {0, 0} }
            print(("%.6f %.6f"):format(g.x[1], g.x[2])))",
         "-0.333333 1.500000", &gauss_newton_options},
        {"gauss_newton#x", solution, "g.x -> column or number", "The last iterate.", "", ""},
        {"gauss_newton#converged", converged, "g.converged -> boolean",
         "No component of the Gauss–Newton step is above tol relative to x.", "", ""},
        {"gauss_newton#status", status, "g.status -> string",
         R"("converged", "not converged", "diverged", "stalled" or "undefined".)", "", ""},
        {"gauss_newton#iterations", iterations, "g.iterations -> integer", "Steps taken.", "", ""},
        {"gauss_newton#iterates", iterates, "g.iterates -> list of columns", "iterates[1] is the start.", "",
         ""},
        {"gauss_newton#residuals", residuals, "g.residuals -> column", "‖R‖ of every iterate.", "", ""},
        {"gauss_newton#gradients", gradients, "g.gradients -> column", "‖JᵀR‖ of every iterate.", "", ""},
        {"gauss_newton#alphas", alphas, "g.alphas -> column", "The step length of every iteration.", "", ""},
        {"gauss_newton#lambdas", lambdas, "g.lambdas -> column",
         "λ of every Levenberg–Marquardt step, 0 for Gauss–Newton steps.", "", ""},
        {"gauss_newton#errors", errors, "g.errors -> column",
         "‖x - x⋆‖ of every iterate, x⋆ found with the exact Hessian.", "", ""},
        {"gauss_newton#R", final_R, "g.R -> column", "The residuals at the solution.", "", ""},
        {"gauss_newton#J", final_J, "g.J -> matrix", "∂R/∂x at the solution.", "", ""},
        {"gauss_newton#loss", loss, "g.loss -> number", "½‖R‖² at the solution.", "", ""},
        {"gauss_newton#rank", rank, "g.rank -> integer", "The rank of ∂R/∂x at the solution.", "", ""},
        {"gauss_newton#sigma2", variance, "g.sigma2 -> number",
         "σ² = ‖R‖²/(residuals - rank); nil where there are no more residuals than unknowns.", "", ""},
        {"gauss_newton#covariance", covariance, "g.covariance -> matrix",
         "σ²(JᵀJ)⁻¹; nil where J is rank-deficient or square.", "", ""},
        {"gauss_newton#cov", covariance, "g.cov -> matrix", "The same as covariance.", "", ""},
        {"gauss_newton#std", deviation, "g.std -> column", "Standard deviations, the roots of its diagonal.",
         "", ""},
        {"gauss_newton#correlation", correlation, "g.correlation -> matrix",
         "The covariance scaled to a diagonal of 1.", "", ""},
        {"gauss_newton#undetermined", undetermined, "g.undetermined -> matrix",
         "Directions that change no residual to first order, one per column; nil at full rank.", "", ""},
        {"gauss_newton#approximation", approximation, "g.approximation -> matrix", "JᵀJ at the solution.", "",
         ""},
        {"gauss_newton#hessian", hessian, "g.hessian -> matrix",
         "The exact Hessian JᵀJ + Σ Rᵢ ∇²Rᵢ at the solution.", "", ""},
        {"gauss_newton#order", order, "g.order -> number", "The observed order.", "", ""},
        {"gauss_newton#rate", rate, "g.rate -> number",
         "The last measured ‖e₊‖/‖e‖ where convergence is linear, ‖e₊‖/‖e‖² otherwise.", "", ""},
        {"gauss_newton#predicted_rate", predicted, "g.predicted_rate -> number",
         "The spectral radius of I - α (JᵀJ)⁻¹(JᵀJ + Σ Rᵢ ∇²Rᵢ) at the solution.", "", ""},
        {"gauss_newton#verdict", verdict, "g.verdict -> string",
         "The rate and its reason, and which combination of unknowns is not determined.", "", ""},
        {"gauss_newton:__tostring", run_text, "print(g)",
         "Iterates, parameters ± standard deviation, verdict.", "", ""},
    }};

}  // namespace pendula::lua
