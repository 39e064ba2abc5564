// Statistics and drift of a run: the types "stats" and "drift".
#include <optional>

#include "base/text.hpp"
#include "lua/bind/integrate/integrate.hpp"
#include "lua/core/objects.hpp"
#include "lua/core/table_text.hpp"
#include "lua/core/values.hpp"

namespace pendula::lua {

struct SolutionStats {
  integrate::Stats counts;
  double errors;
  std::optional<double> growth;
  std::string method, text, why, borders, rounding, not_unique, untested;
  double seconds;
};
template <>
struct TypeName<SolutionStats> {
  static constexpr const char* value = "stats";
};
template <>
struct TypeName<integrate::Drift> {
  static constexpr const char* value = "drift";
};

namespace {

const integrate::Trajectory& recorded_run(Call& call) {
  return call.object<integrate::Trajectory>(1, "solution");
}

int stats(Call& call) {
  const integrate::Solution& solution = recorded_run(call).solution();
  std::string why;
  for (const integrate::MethodInUse& use : solution.methods_in_use())
    why += text(why.empty() ? "" : "\n", use.name, " from t = ", rounded(use.t, 6), ": ", use.why);
  return call.push(std::make_shared<const SolutionStats>(SolutionStats{
      solution.stats(), solution.errors(), solution.passed_growth(), solution.method_name(),
      without_newline(solution.stats_text()), why, without_newline(solution.borders_text()),
      solution.rounding(), solution.not_unique(), solution.untested(), solution.cpu_seconds()}));
}

int drift(Call& call) {
  return call.push(std::make_shared<const integrate::Drift>(recorded_run(call).drift()));
}

const SolutionStats& counted(Call& call) { return call.object<SolutionStats>(1, "stats"); }
int stats_text(Call& call) { return call.push(counted(call).text); }
int stats_method(Call& call) { return call.push(counted(call).method); }
int stats_steps(Call& call) { return call.push(counted(call).counts.steps); }
int stats_rejected(Call& call) { return call.push(counted(call).counts.rejected); }
int stats_evaluations(Call& call) { return call.push(counted(call).counts.evaluations); }
int stats_jacobians(Call& call) { return call.push(counted(call).counts.jacobians); }
int stats_factorisations(Call& call) { return call.push(counted(call).counts.factorisations); }
int stats_newton(Call& call) { return call.push(counted(call).counts.newton_iterations); }
int stats_why(Call& call) { return call.push(counted(call).why); }
int stats_borders(Call& call) { return call.push(counted(call).borders); }
int stats_rounding(Call& call) { return call.push(counted(call).rounding); }
int stats_not_unique(Call& call) { return call.push(counted(call).not_unique); }
int stats_untested(Call& call) { return call.push(counted(call).untested); }
int stats_rest(Call& call) { return call.push(counted(call).counts.rest); }
int stats_regrowth(Call& call) {
  const auto& regrowth = counted(call).counts.regrowth;
  return call.push(regrowth ? std::optional(regrowth->t) : std::nullopt);
}
int stats_growth(Call& call) { return call.push(counted(call).growth); }
int stats_errors(Call& call) { return call.push(counted(call).errors); }
int stats_time(Call& call) { return call.push(counted(call).seconds); }

const integrate::Drift& drifted(Call& call) { return call.object<integrate::Drift>(1, "drift"); }
int drift_text(Call& call) { return call.push(without_newline(drifted(call).str())); }
int drift_length(Call& call) { return call.push(static_cast<long>(drifted(call).rows.size())); }
int drift_verdict(Call& call) { return call.push(drifted(call).verdict()); }

int drift_item(Call& call) {
  const auto& rows = drifted(call).rows;
  const long i = call.integer(2, "index");
  if (i < 1 || i > static_cast<long>(rows.size())) {
    throw Error(
        text(rows.size() == 1 ? "there is 1 constraint" : text("there are ", rows.size(), " constraints"),
             "; number ", i, " does not exist"));
  }
  const integrate::DriftRow& row = rows[i - 1];
  lua_createtable(call.L, 0, 7);
  const auto field = [&](const char* key, double number) {
    lua_pushnumber(call.L, number);
    lua_setfield(call.L, -2, key);
  };
  field("C", row.start[0]);
  if (row.start.size() > 1) field("slope", row.start[1]);
  field("line", row.predicted);
  field("numerical", row.remainder);
  field("largest", row.largest);
  for (const auto& [key, words] :
       {std::pair{"name", row.label}, std::pair{"verdict", verdict_name(row.verdict)}}) {
    lua_pushlstring(call.L, words.data(), words.size());
    lua_setfield(call.L, -2, key);
  }
  return 1;
}

}  // namespace

extern const Module run_records_module = {
    "integrate",
    "Integration",
    {
        {"solution:stats", stats, "sol:stats() -> stats",
         R"(Steps, evaluations, Jacobians, factorisations, Newton iterations; .time is the CPU time in
            seconds.)",
         R"(x = var "x"  sol = dae{ der(x) ~ -x }:integrate{ start = { x = 1 }, to = 1 }
return sol:stats().steps > 1)",
         "true"},
        {"solution:drift", drift, "sol:drift() -> drift",
         R"(For each constraint C(0), C′(0), the straight line or the decay that an inconsistent start
            causes, the numerical part, and the verdict in words.)",
         R"(x, y, z = vars "x y z"
sol = dae{ der(x) ~ y, der(y) ~ z, 0 ~ x - sin(t) }:reduce "project":integrate{ start = {}, to = 1 }
return sol:drift())",
         ""},
        {"stats#method", stats_method, "stats.method -> string", "The name of the method."},
        {"stats#steps", stats_steps, "stats.steps -> integer", "Steps taken."},
        {"stats#rejected", stats_rejected, "stats.rejected -> integer",
         "Steps that were tried and repeated with a smaller one (adaptive runs)."},
        {"stats#evaluations", stats_evaluations, "stats.evaluations -> integer",
         "Evaluations of the equations, one per stage."},
        {"stats#jacobians", stats_jacobians, "stats.jacobians -> integer",
         "Evaluations of their Jacobian, one per stage."},
        {"stats#factorisations", stats_factorisations, "stats.factorisations -> integer",
         "LU factorisations."},
        {"stats#newton", stats_newton, "stats.newton -> integer", "Newton iterations."},
        {"stats#time", stats_time, "stats.time -> seconds", "CPU time; differs from run to run."},
        {"stats#borders", stats_borders, "stats.borders -> string",
         "How the borders of abs, sign, min, max and ifelse were treated, a line each: smooth (both sides agree "
         "in value and slope) and kink (in value): located, or integrated through where that costs less; jump "
         "or kink (not decided by the expressions): located.",
         "dae{ der(var 'x') ~ 2 - abs(var 'x') }:integrate{ start = { x = -1 }, to = 3 }:stats().borders",
         "border x = 0: kink, located 1 time"},
        {"stats#rounding", stats_rounding, "stats.rounding -> string",
         "Why the requested digits are not reached: rounding errors of the equations compared with the tolerances (implicit "
         "methods, rtol below 1e-7). Empty where they are harmless."},
        {"stats#not_unique", stats_not_unique, "stats.not_unique -> string",
         "Where more than one solution goes on: from x = 0, x′ = √|x| may stay or leave; or where an error has "
         "changed the sign of a divisor, which no solution does. Empty if neither was met.",
         "dae{ der(var 'x') ~ sqrt(var 'x') }:integrate{ start = { x = 0 }, to = 1 }:stats().not_unique",
         "not unique from t = 0 on: x = 0 there, where √x has an infinite slope; one solution stays, others leave"},
        {"stats#untested", stats_untested, "stats.untested -> string",
         "Runs with direct = true: the unknowns of index 3 and more, whose errors no step tests. Empty if there are none."},
        {"stats#errors", stats_errors, "stats.errors -> number",
         "The estimated errors of all steps of an adaptive run, in tolerances: their sum, in which steps of Runge-Kutta methods whose "
         "estimate may be wrong are judged by two half steps. It bounds the error at the end "
         "where the equations amplify no error; oscillations preserve errors, damping removes most of them."},
        {"stats#rest", stats_rest, "stats.rest -> number or nil",
         "A time at which the solution almost stood still (of equations without t: at that speed it would have moved by "
         "less than 1000 tolerances until the end) before it moved: an error of one tolerance there decides where to; else nil."},
        {"stats#regrowth", stats_regrowth, "stats.regrowth -> number or nil",
         "When a state was smallest that fell below its tolerance and grew again, x' = x g(t, …), as an infected population "
         "between two outbreaks: what is left of it there decides the rest. The run is made again with steps that keep rtol "
         "alone for it, unless atol was given for it or events call functions: then an error decides, and print(sol) "
         "says so. nil if none did.",
         "dae{ der(var 'x') ~ (t - 12)*var 'x' }:integrate{ start = { x = 1 }, to = 24 }:stats().regrowth ~= nil",
         "true"},
        {"stats#growth", stats_growth, "stats.growth -> number or nil",
         "When the first step of an implicit method began that damped a growing mode: the run stays on a solution whose "
         "neighbours depart from it. nil if none did.",
         "dae{ der(var 'x') ~ 1e6*(6 - t - var 'x')*(var 'x' - 5) }:integrate{ start = { x = 6 }, to = 2, method = 'rodas', rtol = 1e-3 }:stats().growth ~= nil",
         "true"},
        {"stats#why", stats_why, "stats.why -> string",
         "The choices of the method, one line each: from which time on, which method, and why."},
        {"stats:__tostring", stats_text, "print(sol:stats())", "The counts, without the time."},
        {"drift#verdict", drift_verdict, "drift.verdict -> string",
         R"("kept", "inconsistent start", "numerical drift", or both, over all constraints.)"},
        {"drift:__index", drift_item, "drift[i] -> table",
         R"(Constraint i: name, C = C(0), slope = C′(0), line = C(0) + t C′(0) at the end, numerical,
            largest, verdict.)",
         R"(x, z = vars "x z"  low = dae{ der(x) ~ z, 0 ~ x - sin(t) }:reduce "acc"
return low:integrate{ start = { x = 0 }, to = 5 }:drift()[1].verdict)",
         "kept"},
        {"drift:__len", drift_length, "#drift", "The number of constraints."},
        {"drift:__tostring", drift_text, "print(sol:drift())", "The table and the verdicts in words."},
    }};

}  // namespace pendula::lua
