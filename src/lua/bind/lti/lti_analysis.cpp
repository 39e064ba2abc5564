// Poles, zeros, stability, controllability, Gramians, e^{At}. Reads arguments, calls src/lti.
#include <cmath>

#include "base/text.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "lti/exponential.hpp"
#include "lti/frequency.hpp"
#include "lti/structure.hpp"
#include "lua/bind/lti/lti.hpp"

namespace pendula::lua {

template <>
struct TypeName<lti::Reach> {
  static constexpr const char* value = "reachability";
};
template <>
struct TypeName<lti::Stability> {
  static constexpr const char* value = "lti_stability";
};
template <>
struct TypeName<lti::Margins> {
  static constexpr const char* value = "margins";
};
/// The result of damp(G): poles with damping.
struct Damping {
  std::vector<dae::Mode> poles;
  double Ts = 0;
};
template <>
struct TypeName<Damping> {
  static constexpr const char* value = "damping";
};

namespace {

using lti::System;

bool has_free_parameters(const System& g) {
  const std::vector<Expr> all = lti::entries(g);
  for (Expr leaf : leaves(all))
    if (symbol_of(leaf).kind == Kind::parameter && !symbol_of(leaf).value) return true;
  return false;
}

int poles(Call& call) {
  const System& g = system_of(call);
  if (has_free_parameters(g)) {
    if (const auto list = lti::symbolic_zeros(lti::characteristic(g)))
      return push_roots(call, {"poles", {}, *list});
    throw Error(text("the poles are the zeros of ", lti::to_text(lti::characteristic(g), g.variable()),
                     ", which have no short form; give values with G:with{ … }"));
  }
  return push_roots(call, {"poles", lti::poles(g), {}});
}

int zeros(Call& call) {
  const System& g = system_of(call);
  if (has_free_parameters(g)) {
    const System f = lti::to_tf(g);
    if (f.siso() && !f.tf[0].num.empty())
      if (const auto list = lti::symbolic_zeros(f.tf[0].num)) return push_roots(call, {"zeros", {}, *list});
    throw Error("the zeros of this symbolic system have no short form; give values with G:with{ … }");
  }
  return push_roots(call, {"zeros", lti::zeros(g), {}});
}

int charpoly(Call& call) {
  const lti::Polynomial p = lti::characteristic(system_of(call));
  if (call.has(2)) return push_expr(call.L, lti::expression(p, to_expr(call.L, 2, "s")));
  MatX c(static_cast<Eigen::Index>(p.size()), 1);
  for (std::size_t k = 0; k < p.size(); ++k) c(static_cast<Eigen::Index>(p.size() - 1 - k), 0) = p[k];
  return push_entries(call.L, c);
}

// ── stability ──

int stability(Call& call) {
  return call.push(std::make_shared<const lti::Stability>(lti::stability(system_of(call))));
}
int is_stable(Call& call) {
  const lti::Stability s = lti::stability(system_of(call));
  if (s.symbolic) throw Error("it depends on the parameters: " + lti::describe(s));
  return call.push(s.asymptotic);
}
const lti::Stability& verdict_of(Call& call) { return call.object<lti::Stability>(1, "stability"); }
int verdict(Call& call) { return call.push(verdict_of(call).verdict); }
int reason(Call& call) { return call.push(verdict_of(call).reason); }
int asymptotic(Call& call) { return call.push(verdict_of(call).asymptotic); }
int routh(Call& call) {
  const auto& s = verdict_of(call);
  return push_matrix(call.L, MatX(column(s.routh)));
}
int stability_text(Call& call) { return call.push(lti::describe(verdict_of(call))); }

int damp(Call& call) {
  auto d = std::make_shared<Damping>();
  const System g = lti::with_numbers(system_of(call));
  d->poles = lti::poles(g);
  d->Ts = g.continuous() ? 0 : lti::number(g.Ts);
  return call.push(std::shared_ptr<const Damping>(std::move(d)));
}

lti::Complex in_continuous_time(const dae::Mode& m, double Ts) {
  return Ts > 0 ? std::log(m.value) / Ts : m.value;
}

int damping_column(Call& call, double (*value)(lti::Complex)) {
  const auto& d = call.object<Damping>(1, "damping");
  std::vector<double> list;
  for (const dae::Mode& m : d.poles)
    for (int k = 0; k < m.multiplicity; ++k) list.push_back(value(in_continuous_time(m, d.Ts)));
  return push_matrix(call.L, Mat(Eigen::Map<const Vec>(list.data(), static_cast<Eigen::Index>(list.size()))));
}
double frequency_of(lti::Complex s) { return std::abs(s); }
double damping_of(lti::Complex s) { return std::abs(s) == 0 ? 1 : -s.real() / std::abs(s) + 0.0; }
int frequencies(Call& call) { return damping_column(call, frequency_of); }
int dampings(Call& call) { return damping_column(call, damping_of); }

int damping_text(Call& call) {
  const auto& d = call.object<Damping>(1, "damping");
  Table table({false, true, true, true});
  table.row({"pole", "ζ", "ωₙ [rad/s]", "time constant [s]"});
  for (const dae::Mode& m : d.poles) {
    if (m.value.imag() < 0) continue;
    const lti::Complex s = in_continuous_time(m, d.Ts);
    std::string pole = rounded(m.value.real(), 6);
    if (m.value.imag() != 0)
      pole = (m.value.real() == 0 ? "±" : pole + " ± ") + rounded(m.value.imag(), 6) + " i";
    if (m.multiplicity > 1) pole += text(" (", m.multiplicity, " times)");
    table.row({pole, rounded(damping_of(s), 6), rounded(std::abs(s), 6),
               s.real() == 0 ? "∞" : rounded(-1 / s.real(), 6)});
  }
  std::string out = table.str();
  out.pop_back();
  return call.push(out);
}

// ── controllability ──

const lti::Reach& reach(Call& call) { return call.object<lti::Reach>(1, "report"); }
int controllability(Call& call) {
  return call.push(std::make_shared<const lti::Reach>(lti::controllability(system_of(call))));
}
int observability(Call& call) {
  return call.push(std::make_shared<const lti::Reach>(lti::observability(system_of(call))));
}
int reach_rank(Call& call) { return call.push(reach(call).rank); }
int reach_matrix(Call& call) { return push_entries(call.L, lti::matrix(reach(call))); }
int reach_full(Call& call) { return call.push(reach(call).rank == reach(call).order); }
int reach_stable(Call& call) { return call.push(reach(call).stable); }
int reach_modes(Call& call) {
  Roots r{"modes", {}, {}};
  for (const auto& h : reach(call).modes) r.list.push_back(h.mode);
  return push_roots(call, std::move(r));
}
int reach_text(Call& call) { return call.push(lti::describe(reach(call))); }

/// ctrb(G) or ctrb(A, B); obsv(G) or obsv(A, C).
int ctrb(Call& call) {
  if (call.is<System>(1)) return push_entries(call.L, lti::controllability_matrix(system_of(call)));
  const MatX A = to_matrix(call.L, 1, "A"), B = to_matrix(call.L, 2, "B");
  return push_entries(call.L, lti::controllability_matrix(
                                  lti::make_ss(A, B, MatX::Zero(0, A.cols()), MatX::Zero(0, B.cols()))));
}
int obsv(Call& call) {
  if (call.is<System>(1)) return push_entries(call.L, lti::observability_matrix(system_of(call)));
  const MatX A = to_matrix(call.L, 1, "A");
  MatX C = to_matrix(call.L, 2, "C");
  if (C.cols() == 1 && C.rows() == A.rows()) C = MatX(C.transpose());
  return push_entries(call.L, lti::observability_matrix(
                                  lti::make_ss(A, MatX::Zero(A.rows(), 0), C, MatX::Zero(C.rows(), 0))));
}

int minreal(Call& call) {
  const double tol = call.number(2, "tol", 0);
  if (call.has(2) && !(tol > 0)) throw Error("tol must be positive");
  return push_system(call, lti::minimal(read_system(call, 1, "G"), tol));
}

int gram(Call& call) {
  const std::string which = call.string(2, "which", "c");
  if (which != "c" && which != "o")
    throw Error(text("which must be \"c\" (controllability) or \"o\" (observability), got '", which, "'"));
  return push_entries(call.L, lti::gramian(system_of(call), which == "c"));
}
int lyap(Call& call) {
  return push_entries(call.L, lti::lyapunov(to_matrix(call.L, 1, "A"), to_matrix(call.L, 2, "Q"), true));
}
int dlyap(Call& call) {
  return push_entries(call.L, lti::lyapunov(to_matrix(call.L, 1, "A"), to_matrix(call.L, 2, "Q"), false));
}

// ── norms and margins ──

int norm(Call& call) {
  const bool inf = lua_type(call.L, 2) == LUA_TNUMBER ? std::isinf(lua_tonumber(call.L, 2))
                                                      : call.string(2, "which", "2") == "inf";
  if (!inf) {
    if (call.has(2) &&
        !(lua_type(call.L, 2) == LUA_TNUMBER ? lua_tonumber(call.L, 2) == 2 : call.string(2, "which") == "2"))
      throw Error("which must be 2 or \"inf\"");
    return call.push(lti::h2_norm(system_of(call)));
  }
  const lti::PeakGain p = lti::hinf_norm(system_of(call));
  call.push(p.value);
  call.push(p.at);
  return 2;
}

int margin(Call& call) {
  if (call.is<lti::DelaySystem>(1))
    return call.push(
        std::make_shared<const lti::Margins>(lti::margins(call.object<lti::DelaySystem>(1, "G"))));
  return call.push(std::make_shared<const lti::Margins>(lti::margins(read_system(call, 1, "G"))));
}
int push_optional(Call& call, const std::optional<double>& v) {
  return call.push(v ? *v : std::numeric_limits<double>::infinity());
}
const lti::Margins& margins(Call& call) { return call.object<lti::Margins>(1, "margins"); }
int gain_margin(Call& call) { return push_optional(call, margins(call).gain); }
int phase_margin(Call& call) { return push_optional(call, margins(call).phase); }
int gain_at(Call& call) { return push_optional(call, margins(call).gain_at); }
int phase_at(Call& call) { return push_optional(call, margins(call).phase_at); }
int loop_stable(Call& call) { return call.push(margins(call).closed_loop_stable); }
int margins_text(Call& call) { return call.push(lti::describe(margins(call))); }

// ── exponentials ──

int transition(Call& call) {
  const System g = lti::to_ss(system_of(call));
  if (!g.continuous()) throw Error("a discrete system has Aᵏ: G.A^k");
  const Expr time = call.has(2) ? to_expr(call.L, 2, "t") : time_symbol();
  if (const auto Phi = lti::transition(g.ss.A, time)) return push_matrix(call.L, *Phi);
  throw Error(
      "e^{At} of this matrix has no closed form here; give values with G:with{ … }, or a number: expm(A*2)");
}

int solution(Call& call) {
  const System g = lti::to_ss(system_of(call));
  const VecX x0 = call.has(2) ? read_state(call.L, 2, "x0", g) : VecX(VecX::Zero(g.ss.order()));
  if (call.has(3) && lua_isfunction(call.L, 3)) {  // u(t) with the symbol t
    lua_pushvalue(call.L, 3);
    push_expr(call.L, time_symbol());
    protected_call(call.L, 1, 1);
    lua_replace(call.L, 3);
  }
  const VecX u = call.has(3) ? to_column(call.L, 3, "u") : VecX(VecX::Zero(g.inputs));
  for (const VecX* v : {&x0, &u})
    for (Expr leaf : leaves(entries(*v)))
      if (is_varying(leaf) && !(v == &u && leaf == time_symbol()))
        throw Error(text(v == &u ? "u" : "x0", " must not depend on ", to_text(leaf),
                         v == &u ? ": write an expression in t" : ""));
  return push_matrix(call.L, MatX(lti::solution(g, x0, u)));
}

int logm(Call& call) { return push_value(call.L, linalg::logarithm(to_numeric_matrix(call.L, 1, "A"))); }

// ── values ──

int value(Call& call) {
  const System& g = system_of(call);
  if (!call.has(2)) call.wrong(2, "s", "a symbol, a number or complex(re, im)");
  const ComplexNumber z = call.is<ComplexNumber>(2) || lua_istable(call.L, 2)
                              ? read_complex(call.L, 2, g.variable())
                              : ComplexNumber{to_expr(call.L, 2, g.variable()), 0};
  if (z.im.is_zero() &&
      !(z.re.is_constant() && g.form == lti::Form::ss && lti::field(g) == lti::Field::numeric)) {
    const MatX v = lti::value(g, z.re);
    return push_entries_or_one(call.L, v);
  }
  const lti::ComplexMat v = lti::value(g, lti::Complex(lti::number(z.re), lti::number(z.im)));
  if (z.im.is_zero()) return push_entries_or_one(call.L, lti::expressions(Mat(v.real())));
  if (g.siso()) return push_complex(call.L, {Expr(v(0, 0).real()), Expr(v(0, 0).imag())});
  lua_createtable(call.L, 0, 2);
  push_matrix(call.L, Mat(v.real()));
  lua_setfield(call.L, -2, "re");
  push_matrix(call.L, Mat(v.imag()));
  lua_setfield(call.L, -2, "im");
  return 1;
}

int dcgain(Call& call) {
  const MatX K = lti::dcgain(system_of(call));
  return K.size() == 1 ? push_number_or_expression(call.L, K(0, 0)) : push_entries(call.L, K);
}

}  // namespace

extern const Module lti_analysis_module = {
    "lti analysis",
    "Linear systems: poles, zeros, structure",
    {
        {"lti:__call", value, "G(s) -> value",
         R"(The transfer function at a symbol, a number or complex(re, im); of several channels a matrix
            (complex: { re =, im = }).)",
         R"(s = param "s"  return tf({1, 2}, {1, 3, 1})(s), tf({1}, {1, 1})(complex(0, 1)))",
         "(s + 2)/(s² + 3 s + 1) 1/2 - 1/2 i"},
        {"lti:dcgain", dcgain, "G:dcgain() -> number or matrix",
         "The static gain G(0), in discrete time G(1).", "tf({6}, {1, 2, 3}):dcgain()", "2"},
        {"lti:poles", poles, "G:poles() -> roots",
         R"(Eigenvalues of A, zeros of the denominator, or the poles of a minimal realisation (several
            channels): exact where rational or quadratic, symbolic up to degree two. [i], #, .re, .im,
            .values.)",
         "tf({1}, {1, 2, 5}):poles()", "poles: -1 ± 2 i"},
        {"lti:zeros", zeros, "G:zeros() -> roots",
         R"(Invariant zeros: s at which [sI - A, -B; C, D] loses rank; of a fraction the zeros of its
            numerator.)",
         "ss({{0, 1}, {-2, -3}}, {0, 1}, {3, 1}):zeros()", "zeros: -3"},
        {"lti:charpoly", charpoly, "G:charpoly([s]) -> column or polynomial",
         "det(sI - A), or the denominator.",
         R"(s = param "s"  return ss({{0, 1}, {-2, -3}}, {0, 1}, {1, 0}):charpoly(s))", "s² + 3 s + 2"},
        {"lti:stability", stability, "G:stability() -> verdict",
         R"("asymptotically stable", "stable, not asymptotically" or "unstable" with the poles that decide;
            for parameters without values Routh's conditions. Fields: .verdict .reason .asymptotic .routh.)",
         R"(a, b = params "a b"  return tf({1}, {1, a, b, 1}):stability())",
         "asymptotically stable if and only if a > 0, b - 1/a > 0 (Routh)"},
        {"lti:is_stable", is_stable, "G:is_stable() -> boolean", "All poles decay.",
         "tf({1}, {1, 0}):is_stable()", "false"},
        {"lti_stability#verdict", verdict, "G:stability().verdict -> string", "The verdict in words."},
        {"lti_stability#reason", reason, "G:stability().reason -> string", "The poles that decide."},
        {"lti_stability#asymptotic", asymptotic, "G:stability().asymptotic -> boolean", "All poles decay."},
        {"lti_stability#routh", routh, "G:stability().routh -> column",
         "The first column of Routh's array (symbolic systems)."},
        {"lti_stability:__tostring", stability_text, "print(G:stability())", "Verdict and reason."},
        {"lti:damp", damp, "G:damp() -> damping",
         "Damping ratio ζ, natural frequency ωₙ and time constant of every pole: .zeta, .wn.",
         "tf({1}, {1, 2, 4}):damp()",
         R"(
            pole              ζ  ωₙ [rad/s]  time constant [s]
            -1 ± 1.73205 i  0.5           2                  1)"},
        {"damping#zeta", dampings, "G:damp().zeta -> column", "Damping ratios, pole by pole."},
        {"damping#wn", frequencies, "G:damp().wn -> column", "Natural frequencies in rad/s."},
        {"damping:__tostring", damping_text, "print(G:damp())", "One pole, or pair, per line."},
        {"lti:controllability", controllability, "G:controllability() -> report",
         R"(The rank of [B, AB, …], and the modes no input reaches with the combination of states that
            moves by itself. .matrix .rank .modes .full .stable.)",
         "ss({{-1, 0}, {0, -2}}, {1, 0}, {1, 1}):controllability()",
         R"(
            not controllable: the controllability matrix has rank 1 of 2
              uncontrollable mode -2  no input reaches x₂: x₂′ = -2 x₂
            stabilizable: these modes decay)"},
        {"lti:observability", observability, "G:observability() -> report",
         "The same for [C; CA; …] and the outputs.",
         "ss({{0, 1}, {-2, -3}}, {0, 1}, {1, 0}):observability().rank", "2"},
        {"reachability#rank", reach_rank, "report.rank -> integer", "The rank."},
        {"reachability#matrix", reach_matrix, "report.matrix -> matrix", "[B, AB, …] or [C; CA; …]."},
        {"reachability#full", reach_full, "report.full -> boolean", "Controllable (observable)."},
        {"reachability#stable", reach_stable, "report.stable -> boolean",
         "Stabilizable (detectable): the hidden modes decay."},
        {"reachability#modes", reach_modes, "report.modes -> roots", "The hidden modes."},
        {"reachability:__tostring", reach_text, "print(report)", "Rank, hidden modes and their directions."},
        {"ctrb", ctrb, "ctrb(A, B) or ctrb(G) -> matrix", "The controllability matrix [B, AB, …, Aⁿ⁻¹B].",
         "ctrb({{0, 1}, {-2, -3}}, {0, 1})", R"(
            ⎡0   1⎤
            ⎣1  -3⎦)"},
        {"obsv", obsv, "obsv(A, C) or obsv(G) -> matrix", "The observability matrix [C; CA; …; CAⁿ⁻¹].",
         "obsv({{0, 1}, {-2, -3}}, {1, 0})", R"(
            ⎡1  0⎤
            ⎣0  1⎦)"},
        {"minreal", minreal, "minreal(G [, tol]) -> G",
         R"(A minimal realisation: without uncontrollable and unobservable states, without common factors.
            Exact for exact systems where tol is not given. With tol, zeros and poles closer than
            tol·|z| cancel (1e-8 for decimals), states that inputs reach or outputs see with less
            than tol·‖A‖ are removed (n·1e-12).)",
         "minreal(tf({1, 1}, {1, 3, 2}))",
         R"(
            transfer function, continuous time
                1
              ─────
              s + 2
              minimal: 1 common factor removed)"},
        {"lti:minreal", minreal, "G:minreal([tol]) -> G", "The same as minreal(G, tol).",
         "return tf({1, 1}, {1, 3, 2}):minreal()", R"(transfer function, continuous time
    1
  ─────
  s + 2
  minimal: 1 common factor removed)"},
        {"lti:gram", gram, R"(G:gram(["c" or "o"]) -> matrix)",
         "The controllability (observability) Gramian of a stable system.",
         R"(ss({{-1}}, {1}, {1}):gram "c")", "(1/2)"},
        {"lyap", lyap, "lyap(A, Q) -> matrix", "P with A P + P Aᵀ + Q = 0.", "lyap({{-1}}, {{2}})", "(1)"},
        {"dlyap", dlyap, "dlyap(A, Q) -> matrix", "P with A P Aᵀ - P + Q = 0.", R"(dlyap({{"1/2"}}, {{3}}))",
         "(4)"},
        {"lti:norm", norm, R"(G:norm([2 or "inf"]) -> number)",
         R"(The H₂ (H2) norm, or the H∞ norm (the largest gain over all frequencies) and the frequency where it
            is taken.)",
         "tf({1}, {1, 1}):norm()^2", "0.5"},
        {"margin", margin, "margin(G) -> margins",
         R"(Gain and phase margin of the loop G/(1 + G), and whether that is stable. .gain .gain_at .phase
            .phase_at .stable.)",
         "margin(tf({4}, {1, 3, 3, 1}))",
         R"(
            gain margin   2 (6.021 dB) at ω = 1.73205
            phase margin  27.1416° at ω = 1.23282
            closed loop   asymptotically stable)"},
        {"lti:margin", margin, "G:margin() -> margins", "The same as margin(G).",
         "return tf({1}, {1, 2, 1, 0}):margin()", R"(gain margin   2 (6.021 dB) at ω = 1
phase margin  21.3864° at ω = 0.682328
closed loop   asymptotically stable)"},
        {"margins#gain", gain_margin, "m.gain -> number", "The gain margin as a factor."},
        {"margins#phase", phase_margin, "m.phase -> number", "The phase margin in degrees."},
        {"margins#gain_at", gain_at, "m.gain_at -> number", "The frequency at which the phase is -180°."},
        {"margins#phase_at", phase_at, "m.phase_at -> number", "The frequency at which |G| = 1."},
        {"margins#stable", loop_stable, "m.stable -> boolean", "The closed loop is asymptotically stable."},
        {"margins:__tostring", margins_text, "print(margin(G))", "Both margins and the verdict."},
        {"lti:transition", transition, "G:transition([t]) -> matrix", "e^{At} as expressions in t.",
         "ss({{0, 1}, {-1, 0}}, {0, 1}):transition()", R"(
            ⎡cos(t)   sin(t)⎤
            ⎣-sin(t)  cos(t)⎦)"},
        {"lti:solution", solution, "G:solution([x0 [, u]]) -> column",
         R"(x(t) = e^{At}x₀ + ∫e^{A(t-τ)}Bu dτ as expressions in t. u: polynomials, exponentials, sines and
            cosines of t. Exact where modes are rational or quadratic; symbolic where e^{At} is.)",
         "ss({{-1}}, {1}):solution({2}, {sin(t)})", "(sin(t)/2 - cos(t)/2 + 5 exp(-t)/2)"},
        {"logm", logm, "logm(A) -> matrix",
         "The principal logarithm of a matrix without eigenvalues on the closed negative axis.",
         "logm(expm{{0, 1}, {0, 0}})(1, 2)", "1.0"},
    }};

}  // namespace pendula::lua
