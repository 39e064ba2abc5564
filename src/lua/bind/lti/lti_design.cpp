// Control design: feedback and observer gains, Riccati equations, reduction. Reads
// arguments, calls src/lti/design.
#include <algorithm>

#include "base/text.hpp"
#include "expr/linalg/linalg.hpp"
#include "lti/design/kalman_filter.hpp"
#include "lti/design/placement.hpp"
#include "lti/design/reduction.hpp"
#include "lti/design/riccati.hpp"
#include "lua/bind/lti/lti.hpp"

namespace pendula::lua {

/// The result of kalman_filter for samples y.
struct FilteredStates {
  lti::FilterRun run;
  lti::System system;
  Mat y;
  bool smoothed = false;
};
template <>
struct TypeName<FilteredStates> {
  static constexpr const char* value = "kalman_result";
};

namespace {

using Eigen::Index;
using lti::System;

int push_poles(Call& call, const lti::ComplexVec& poles) {
  Roots r{"poles", {}, {}};
  for (const lti::Complex z : poles) r.list.push_back({z, 1, {}});
  std::sort(r.list.begin(), r.list.end(), [](const auto& a, const auto& b) {
    return std::pair(a.value.real(), a.value.imag()) < std::pair(b.value.real(), b.value.imag());
  });
  return push_roots(call, std::move(r));
}

/// A, B of a system or of two matrices; `next` is the index of the argument after them.
struct StateEquation {
  MatX A, B;
  bool continuous = true;
  int next = 3;
};
StateEquation state_equation(Call& call) {
  if (call.is<System>(1)) {
    const System g = lti::to_ss(call.object<System>(1, "G"));
    return {g.ss.A, g.ss.B, g.continuous(), 2};
  }
  return {to_matrix(call.L, 1, "A"), to_matrix(call.L, 2, "B"), true, 3};
}

Mat in_numbers(const MatX& m) {
  std::vector<Expr> all(m.data(), m.data() + m.size());
  return lti::numbers(
      MatX(column(pendula::substitute(all, lti::defaults(all))).reshaped(m.rows(), m.cols())));
}

/// A weight matrix; a number means a multiple of the identity.
Mat weight(Call& call, int i, const char* name, Index size) {
  if (lua_type(call.L, i) == LUA_TNUMBER) return call.number(i, name) * Mat::Identity(size, size);
  return to_numeric_matrix(call.L, i, name);
}

int push_riccati(Call& call, const Mat& gain, const lti::RiccatiSolution& s) {
  push_matrix(call.L, gain);
  push_matrix(call.L, s.X);
  push_poles(call, s.poles);
  return 3;
}

// ── pole placement ──

std::vector<ComplexNumber> read_poles(Call& call, int i) {
  std::vector<ComplexNumber> list;
  if (call.is<Roots>(i)) {
    for (const dae::Mode& m : call.object<Roots>(i, "poles").list)
      for (int k = 0; k < m.multiplicity; ++k)
        list.push_back(m.exact ? ComplexNumber{m.exact->first, m.exact->second}
                               : ComplexNumber{Expr(m.value.real()), Expr(m.value.imag())});
    return list;
  }
  if (lua_type(call.L, i) != LUA_TTABLE) {
    const VecX c = to_column(call.L, i, "poles");
    for (const Expr e : c) list.push_back({e, 0});
    return list;
  }
  for (lua_Integer k = 1, n = static_cast<lua_Integer>(lua_rawlen(call.L, i)); k <= n; ++k) {
    lua_rawgeti(call.L, i, k);
    list.push_back(read_complex(call.L, -1, text("poles[", k, "]")));
    lua_pop(call.L, 1);
  }
  return list;
}

int place(Call& call) {
  const StateEquation e = state_equation(call);
  const auto list = read_poles(call, e.next);
  lti::ComplexVec poles(static_cast<Index>(list.size()));
  for (std::size_t k = 0; k < list.size(); ++k) poles[k] = {lti::number(list[k].re), lti::number(list[k].im)};
  const lti::Placement p = lti::place(in_numbers(e.A), in_numbers(e.B), poles);
  push_matrix(call.L, p.K);
  push_poles(call, p.poles);
  call.push(p.condition);
  return 3;
}

/// Π (s - p): a real pole gives s - p, a pair s² - 2 Re p s + |p|².
std::vector<Expr> polynomial(const std::vector<ComplexNumber>& poles) {
  std::vector<Expr> c{1};
  const auto multiply = [&](const std::vector<Expr>& f) {
    std::vector<Expr> out(c.size() + f.size() - 1, Expr(0));
    for (std::size_t i = 0; i < c.size(); ++i)
      for (std::size_t j = 0; j < f.size(); ++j) out[i + j] = out[i + j] + c[i] * f[j];
    c = std::move(out);
  };
  std::vector<bool> used(poles.size(), false);
  for (std::size_t i = 0; i < poles.size(); ++i) {
    if (used[i]) continue;
    const auto& [re, im] = poles[i];
    if (im.is_zero()) {
      multiply({1, -re});
      continue;
    }
    std::size_t j = i + 1;
    while (j < poles.size() && (used[j] || !(poles[j].re == re) || !(poles[j].im + im).is_zero())) ++j;
    if (j == poles.size())
      throw Error(text("the pole ", complex_text(poles[i]), " needs its conjugate, so that K is real"));
    used[j] = true;
    multiply({1, -2 * re, re * re + im * im});
  }
  return c;
}

int acker(Call& call) {
  const StateEquation e = state_equation(call);
  return push_entries(call.L, lti::acker(e.A, e.B, polynomial(read_poles(call, e.next))));
}

// ── Riccati equations ──

lti::RiccatiSolution regulator(Call& call, const StateEquation& e, bool continuous) {
  lti::RiccatiProblem p{in_numbers(e.A), in_numbers(e.B), {}, {}, {}, continuous};
  p.Q = weight(call, e.next, "Q", p.A.rows());
  p.R = weight(call, e.next + 1, "R", p.B.cols());
  if (call.has(e.next + 2)) p.S = to_numeric_matrix(call.L, e.next + 2, "N");
  return lti::riccati(std::move(p));
}
int lqr(Call& call) {
  const StateEquation e = state_equation(call);
  lti::require_costs(weight(call, e.next, "Q", e.A.rows()),
                     e.continuous ? "care(A, B, Q, R)" : "dare(A, B, Q, R)");
  const auto s = regulator(call, e, e.continuous);
  return push_riccati(call, s.K, s);
}
int dlqr(Call& call) {
  const StateEquation e = state_equation(call);
  if (call.is<System>(1) && e.continuous)
    throw Error("the system is continuous: lqr(G, Q, R), or sample it first: c2d(G, Ts)");
  lti::require_costs(weight(call, e.next, "Q", e.A.rows()), "dare(A, B, Q, R)");
  const auto s = regulator(call, e, false);
  return push_riccati(call, s.K, s);
}
int riccati_equation(Call& call, bool continuous) {
  const auto s = regulator(call, state_equation(call), continuous);
  push_matrix(call.L, s.X);
  push_matrix(call.L, s.K);
  push_poles(call, s.poles);
  return 3;
}
int care(Call& call) { return riccati_equation(call, true); }
int dare(Call& call) { return riccati_equation(call, false); }

int lqi(Call& call) {
  const System g = lti::to_ss(lti::with_numbers(read_system(call, 1, "G")));
  const auto s = lti::lqi(g, weight(call, 2, "Q", g.ss.order() + g.outputs), weight(call, 3, "R", g.inputs));
  return push_riccati(call, s.K, s);
}

lti::RiccatiSolution filter(Call& call, const System& g) {
  return lti::kalman(g, weight(call, 2, "Q", g.ss.order()), weight(call, 3, "R", g.outputs));
}
int lqe(Call& call) {
  const System g = lti::to_ss(lti::with_numbers(read_system(call, 1, "G")));
  const auto s = filter(call, g);
  return push_riccati(call, s.K, s);
}
int kalman(Call& call) {
  const System g = lti::to_ss(lti::with_numbers(read_system(call, 1, "G")));
  const auto s = filter(call, g);
  System observer = lti::estimator(g, s.K);
  for (int j = 0; j < g.inputs; ++j) observer.input_names.push_back(lti::input_name(g, j));
  for (int i = 0; i < g.outputs; ++i) observer.input_names.push_back(lti::output_name(g, i));
  for (int i = 0; i < g.outputs; ++i) observer.output_names.push_back("ŷ" + std::to_string(i + 1));
  for (int i = 0; i < g.ss.order(); ++i) observer.output_names.push_back("x̂" + std::to_string(i + 1));
  push_system(call, std::move(observer));
  push_matrix(call.L, s.K);
  push_matrix(call.L, s.X);
  push_poles(call, s.poles);
  return 4;
}

/// kalman_filter for G in discrete time; y and u from data, or lists.
int kalman_filter(Call& call) {
  const System g = lti::to_ss(lti::with_numbers(read_system(call, 1, "G")));
  if (g.continuous()) throw Error("the filter runs over samples: sample the system first, c2d(G, Ts)");
  const Index n = g.ss.order();
  const Mat Q = weight(call, 2, "Q", n), R = weight(call, 3, "R", g.outputs);
  const Options o = call.options(4);
  const auto signal = [&](const char* key, int columns) {
    if (!o.has(key)) return Mat();
    Mat m = to_numeric_matrix(call.L, o.push(key), key);
    lua_settop(call.L, call.count());
    if (m.cols() != columns && m.rows() == columns) m.transposeInPlace();
    return m;
  };
  const Mat y = signal("y", g.outputs);
  if (y.size() == 0) throw Error("y is missing: kalman_filter(G, Q, R, { y = …, u = … })");
  Mat u = signal("u", g.inputs);
  const bool driven =
      std::any_of(g.ss.B.data(), g.ss.B.data() + g.ss.B.size(), [](Expr e) { return !e.is_zero(); });
  if (u.size() == 0 && driven)
    throw Error(text("u is missing: the system has ", g.inputs, g.inputs == 1 ? " input" : " inputs",
                     "; give u = …, or u = zeros(", y.rows(), ", ", g.inputs, ") where nothing acts"));
  if (u.size() == 0) u = Mat::Zero(y.rows(), g.inputs);
  Vec x0 = Vec::Zero(n);
  if (o.has("x0")) x0 = to_numbers(call.L, o.push("x0"), "x0");
  Mat P0 = Mat::Zero(n, n);
  if (o.has("P0")) {
    const int at = o.push("P0");
    P0 = lua_type(call.L, at) == LUA_TNUMBER ? Mat(lua_tonumber(call.L, at) * Mat::Identity(n, n))
                                             : to_numeric_matrix(call.L, at, "P0");
  }
  lua_settop(call.L, call.count());
  const bool smooth = o.boolean("smooth", false);
  const lti::FilterRun run = lti::kalman_filter(g, Q, R, u, y, x0, P0, smooth);
  return call.push(std::make_shared<const FilteredStates>(FilteredStates{run, g, y, smooth}));
}

const FilteredStates& filtered(Call& call) { return call.object<FilteredStates>(1, "kalman_result"); }
const Mat& states_of(const FilteredStates& f) { return f.smoothed ? f.run.smoothed : f.run.filtered; }
const Mat& deviations_of(const FilteredStates& f) { return f.smoothed ? f.run.smoothed_std : f.run.std; }
int filtered_x(Call& call) { return push_matrix(call.L, states_of(filtered(call))); }
int filtered_std(Call& call) { return push_matrix(call.L, deviations_of(filtered(call))); }
int filtered_predicted(Call& call) { return push_matrix(call.L, filtered(call).run.predicted); }
int filtered_y(Call& call) { return push_matrix(call.L, filtered(call).run.y); }
int filtered_innovations(Call& call) { return push_matrix(call.L, filtered(call).run.innovations); }
int filtered_next(Call& call) { return push_matrix(call.L, Mat(filtered(call).run.next)); }
int filtered_P(Call& call) { return push_matrix(call.L, filtered(call).run.P); }
int filtered_likelihood(Call& call) { return call.push(filtered(call).run.log_likelihood); }
int filtered_gains(Call& call) {
  const auto& gains = filtered(call).run.gains;
  lua_createtable(call.L, static_cast<int>(gains.size()), 0);
  lua_Integer k = 0;
  for (const Mat& gain : gains) {
    push_matrix(call.L, gain);
    lua_rawseti(call.L, -2, ++k);
  }
  return 1;
}
int filtered_names(Call& call) {
  const System& g = filtered(call).system;
  std::vector<std::string> names;
  for (int i = 0; i < g.ss.order(); ++i) names.push_back(lti::state_name(g, i));
  return push_names(call.L, names);
}
int filtered_times(Call& call) {
  const FilteredStates& f = filtered(call);
  const double Ts = lti::number(f.system.Ts);
  return push_matrix(call.L, Mat(Vec::LinSpaced(f.y.rows(), 0, Ts * static_cast<double>(f.y.rows() - 1))));
}

int filtered_text(Call& call) {
  const FilteredStates& f = filtered(call);
  const Index samples = f.y.rows(), n = f.system.ss.order(), missing = (f.y.array() != f.y.array()).count();
  std::string out =
      text(f.smoothed ? "Kalman smoother over " : "Kalman filter over ", samples,
           samples == 1 ? " sample of " : " samples of ", n, n == 1 ? " state" : " states",
           missing > 0 ? text(", ", missing, missing == 1 ? " value" : " values", " of y missing") : "",
           ": log-likelihood ", rounded(f.run.log_likelihood, 6));
  constexpr Index most = 20;
  for (Index i = 0; i < std::min(n, most); ++i)
    out += text("\n  ", lti::state_name(f.system, static_cast<int>(i)), " = ",
                rounded(states_of(f)(samples - 1, i), 6), " ± ", rounded(deviations_of(f)(samples - 1, i), 3),
                i == 0 ? " at the last sample" : "");
  if (n > most) out += text("\n  … ", n - most, " more in .x and .std");
  return call.push(out);
}

const OptionTable kalman_filter_options = {
    {"y", "matrix", "", "the measured outputs, one row per sample; NaN: missing"},
    {"u", "matrix", "0", "the inputs, one row per sample"},
    {"x0", "column", "0", "mean of the state at the first sample"},
    {"P0", "number or matrix", "0", "its covariance"},
    {"smooth", "boolean", "false", "x and std given all samples, not only the past ones"},
};

// ── reduction ──

int balreal(Call& call) {
  lti::Balanced b = lti::balanced(read_system(call, 1, "G"));
  push_system(call, std::move(b.system));
  push_matrix(call.L, Mat(b.hankel));
  push_matrix(call.L, b.T);
  return 3;
}
int balred(Call& call) {
  const System g = read_system(call, 1, "G");
  const lti::Reduction r =
      lti::reduced(g, static_cast<int>(call.integer(2, "order")), call.string(3, "method", "truncate"));
  push_system(call, r.system);
  push_matrix(call.L, Mat(r.hankel));
  call.push(r.bound);
  return 3;
}

int sqrtm(Call& call) { return push_matrix(call.L, linalg::square_root(to_numeric_matrix(call.L, 1, "A"))); }

}  // namespace

extern const Module lti_design_module = {
    "lti design",
    "Linear systems: control design",
    {
        {"place", place, "place(A, B, poles) or place(G, poles) -> K, poles, condition",
         R"(u = -K x with the given eigenvalues of A - B K (numbers and pairs complex(re, ±im)). With several
            inputs the eigenvectors are made as independent as possible (Kautsky, Nichols & Van Dooren 1985;
            Tits & Yang 1996); their condition says how sensitive the poles are. An observer: the transpose of
            place(G.A', G.C', poles).)",
         "(place({{0, 1}, {0, 0}}, {0, 1}, {-1, -2}))", "2  3"},
        {"acker", acker, "acker(A, B, poles) or acker(G, poles) -> K",
         "The same for one input by Ackermann's formula: exact where the entries are, and symbolic.",
         R"(k = param "k"  return acker({{0, 1}, {-k, 0}}, {0, 1}, {-1, -2}))", "[2 - k  3]"},
        {"lqr", lqr, "lqr(G, Q, R [, N]) or lqr(A, B, Q, R [, N]) -> K, X, poles",
         R"(u = -K x minimises ∫ xᵀQx + uᵀRu + 2 xᵀNu dt, or the sum over samples of a discrete G. X: the cost is
            x₀ᵀXx₀; poles: of the closed loop. A number is a multiple of the identity.)",
         "(lqr({{0, 1}, {0, 0}}, {0, 1}, 1, 1))", "1  1.732050808"},
        {"dlqr", dlqr, "dlqr(A, B, Q, R [, N]) or dlqr(G, Q, R [, N]) -> K, X, poles",
         "The same in discrete time: x⁺ = A x + B u.", "(dlqr({{1}}, {{1}}, 1, 1))", "0.6180339887"},
        {"care", care, "care(A, B, Q, R [, N]) -> X, K, poles",
         "The stabilising solution of AᵀX + XA - (XB + N)R⁻¹(BᵀX + Nᵀ) + Q = 0.",
         "(care({{0}}, {{1}}, {{4}}, {{1}}))", "2"},
        {"dare", dare, "dare(A, B, Q, R [, N]) -> X, K, poles",
         "The stabilising solution of AᵀXA - X - (AᵀXB + N)(R + BᵀXB)⁻¹(BᵀXA + Nᵀ) + Q = 0.",
         "(dare({{0}}, {{1}}, {{4}}, {{1}}))", "4"},
        {"lqi", lqi, "lqi(G, Q, R) -> K, X, poles",
         R"(The regulator with integral action: u = -K [x; z], z′ = r - y (discrete: z⁺ = z + Ts (r - y)). Q
            weights [x; z].)",
         "(lqi(ss({{-1}}, {1}, {1}), 1, 1))", "1  -1"},
        {"lqe", lqe, "lqe(G, Q, R) -> L, P, poles",
         R"(The gain of the stationary Kalman filter x̂′ = A x̂ + B u + L (y - C x̂ - D u) for x′ = A x + B u + w,
            y = C x + D u + v with intensities Q of w and R of v; P: covariance of x - x̂. Discrete G: L is the
            gain of the one-step predictor.)",
         "(lqe(ss({{0}}, {1}, {1}), 1, 1))", "1"},
        {"kalman", kalman, "kalman(G, Q, R) -> estimator, L, P, poles",
         "The same as lqe, and the filter as a system with the inputs u, y and the outputs ŷ, x̂.",
         "kalman(ss({{0}}, {1}, {1}), 1, 1):poles()", "poles: -1"},
        {"kalman_filter", kalman_filter,
         "kalman_filter(G, Q, R, { y =, u =, x0 =, P0 =, smooth = false }) -> kalman_result",
         R"(The time-varying Kalman filter of a discrete G over measured samples, from a state of mean x0 and covariance
            P0; missing samples (NaN) are bridged. r:plot() draws the states with ±2σ.)",
         "r = kalman_filter(ss({{1}}, {0}, {1}, {0}, 1), 0, 1, { y = {1, 3}, P0 = 1e9 })\nreturn math.abs(r.x(2, 1) - "
         "2) < 1e-8, math.abs(r.std(2, 1)^2 - 0.5) < 1e-8",
         "true true", &kalman_filter_options},
        {"kalman_result#x", filtered_x, "r.x -> matrix",
         "The states given the samples up to each one (all samples: smooth = true), a row per sample.", "",
         ""},
        {"kalman_result#std", filtered_std, "r.std -> matrix", "Their standard deviations.", "", ""},
        {"kalman_result#predicted", filtered_predicted, "r.predicted -> matrix",
         "The states given the samples before each one.", "", ""},
        {"kalman_result#y", filtered_y, "r.y -> matrix", "The outputs given the samples before each one.", "",
         ""},
        {"kalman_result#innovations", filtered_innovations, "r.innovations -> matrix",
         "The samples minus r.y; NaN where one is missing.", "", ""},
        {"kalman_result#gains", filtered_gains, "r.gains -> list", "The Kalman gains, a matrix per sample.",
         "", ""},
        {"kalman_result#next", filtered_next, "r.next -> column", "The state one sample behind the last one.",
         "", ""},
        {"kalman_result#P", filtered_P, "r.P -> matrix", "Its covariance.", "", ""},
        {"kalman_result#log_likelihood", filtered_likelihood, "r.log_likelihood -> number",
         "Of the samples, for normal noise.", "", ""},
        {"kalman_result#names", filtered_names, "r.names -> list", "The names of the states.", "", ""},
        {"kalman_result#t", filtered_times, "r.t -> column", "The times of the samples, from 0.", "", ""},
        {"kalman_result:__tostring", filtered_text, "print(r)",
         "The likelihood, and the states at the last sample with their deviations.", "", ""},
        {"balreal", balreal, "balreal(G) -> G, hankel, T",
         R"(A balanced realisation x = T x̃: both Gramians are diag(hankel), the Hankel singular values. G must be
            stable and minimal.)",
         "#select(2, balreal(tf({1}, {1, 3, 2})))", "2"},
        {"balred", balred, R"(balred(G, order [, "truncate" or "dc"]) -> G, hankel, bound)",
         R"(The first states of a balanced realisation; "dc" keeps the static gain. bound: the largest possible
            error max |G(iω) - Gᵣ(iω)|, twice the sum of the other Hankel singular values.)",
         R"(#balred(tf({1}, {1, 3, 2}), 1, "dc").A)", "1"},
        {"sqrtm", sqrtm, "sqrtm(A) -> matrix",
         "The principal square root X, X² = A, of a matrix without eigenvalues on the negative real axis.",
         "sqrtm{{4, 1}, {0, 9}}(1, 2)", "0.2"},
    }};

}  // namespace pendula::lua
