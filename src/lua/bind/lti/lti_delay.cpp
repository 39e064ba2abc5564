// Linear systems with delays. Reads arguments, calls src/lti/delay.
#include "lti/delay.hpp"

#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "lua/bind/lti/lti.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {

using Eigen::Index;
using lti::DelaySystem;
using lti::System;

namespace {

DelaySystem read_delayed(Call& call, int i, const char* name, int channels = 1) {
  if (call.is<DelaySystem>(i)) return call.object<DelaySystem>(i, name);
  System g = read_system(call, i, name);
  if (!call.is<System>(i) && is_expression(call.L, i) && channels > 1)
    g = lti::make_gain(lti::scaled(g.ss.D(0, 0), MatX::Identity(channels, channels)));
  return {std::move(g), {}, false};
}

/// Pushes a system whose delays have cancelled as an ordinary system.
int push_delayed(Call& call, DelaySystem g) {
  if (g.delays.empty()) return push_system(call, std::move(g.core));
  return call.push(std::make_shared<const DelaySystem>(std::move(g)));
}

const DelaySystem& delayed_of(Call& call) { return call.object<DelaySystem>(1, "G"); }

int delayed(Call& call) {
  const System g = read_system(call, 1, "G");
  return push_delayed(call, lti::delayed(g, call.number(2, "T")));
}
int exponential(Call& call) { return push_delayed(call, lti::exponential_of(system_of(call))); }

int lti_delay_multiply(Call& call) {
  const int a = call.is<DelaySystem>(2) ? call.object<DelaySystem>(2, "G").outputs() : 1;
  const int b = call.is<DelaySystem>(1) ? call.object<DelaySystem>(1, "G").inputs() : 1;
  return push_delayed(call, lti::series(read_delayed(call, 1, "the left operand", a),
                                        read_delayed(call, 2, "the right operand", b)));
}
int lti_delay_divide(Call& call) {
  return push_delayed(call, lti::series(read_delayed(call, 1, "the left operand"),
                                        lti::inverse(read_delayed(call, 2, "the right operand"))));
}
int lti_delay_add(Call& call) {
  return push_delayed(call, lti::parallel(read_delayed(call, 1, "the left operand"),
                                          read_delayed(call, 2, "the right operand")));
}
int lti_delay_subtract(Call& call) {
  return push_delayed(call, lti::parallel(read_delayed(call, 1, "the left operand"),
                                          lti::negative(read_delayed(call, 2, "the right operand"))));
}
int lti_delay_negative(Call& call) { return push_delayed(call, lti::negative(delayed_of(call))); }

int closed(Call& call) {
  const DelaySystem g = read_delayed(call, 1, "G1");
  const DelaySystem h = call.has(2)
                            ? read_delayed(call, 2, "G2", std::max(g.inputs(), g.outputs()))
                            : DelaySystem{lti::make_gain(MatX::Identity(g.inputs(), g.outputs())), {}, false};
  const long sign = call.integer(3, "sign", -1);
  if (sign != 1 && sign != -1) throw Error(text("sign must be -1 (negative feedback) or 1, got ", sign));
  return push_delayed(call, lti::feedback(g, h, static_cast<int>(sign)));
}

// ── responses ──

Vec frequencies(Call& call, int i, const DelaySystem& g) {
  if (!call.has(i)) return lti::bode_frequencies(g);
  const Vec w = to_numeric_matrix(call.L, i, "w").reshaped();
  if (w.size() != 2 || !(w[0] > 0 && w[0] < w[1])) return w;
  return Vec::LinSpaced(600, std::log10(w[0]), std::log10(w[1])).unaryExpr([](double v) {
    return std::pow(10, v);
  });
}
int freqresp(Call& call) {
  const DelaySystem& g = delayed_of(call);
  return call.push(
      std::make_shared<const lti::FrequencyResponse>(lti::frequency_response(g, frequencies(call, 2, g))));
}

/// The times of a response; without a given end it is that of the rational part plus five times the delays.
Vec delay_times(Call& call, int i, const DelaySystem& g) {
  return read_times(call, i, [&](std::optional<double> given) {
    double to = given.value_or(0);
    if (!given) {
      const Vec t = lti::response_times(lti::to_ss(g.core));
      to = t[t.size() - 1];
      for (const double T : g.delays) to += 5 * T;
    }
    if (!(to > 0)) throw Error("the end of the response must be positive");
    return Vec(Vec::LinSpaced(601, 0, to));
  });
}
int push_response(Call& call, lti::Response r) {
  return call.push(std::make_shared<const lti::Response>(std::move(r)));
}
int step(Call& call) {
  const DelaySystem& g = delayed_of(call);
  return push_response(call, lti::step(g, delay_times(call, 2, g)));
}

/// u: a function of t, an expression in t, or samples at the times (lines between them).
int lsim(Call& call) {
  const DelaySystem& g = delayed_of(call);
  lua_State* L = call.L;
  const Vec t = delay_times(call, 3, g);
  if (lua_isfunction(L, 2)) {
    const auto u = [L, &g](double at) {
      lua_pushvalue(L, 2);
      lua_pushnumber(L, at);
      protected_call(L, 1, 1);
      const Vec v = is_expression(L, -1) ? Vec(Vec::Constant(1, to_number(L, lua_gettop(L), "u(t)")))
                                         : to_numbers(L, lua_gettop(L), "u(t)");
      lua_pop(L, 1);
      if (v.size() != g.inputs())
        throw Error(text("u(t) has ", v.size(), " values for ", g.inputs(), " inputs"));
      return v;
    };
    return push_response(call, lti::simulate(g, u, t, {}));
  }
  Mat u = to_numeric_matrix(L, 2, "u");
  if (u.cols() != g.inputs()) u.transposeInPlace();
  if (u.cols() != g.inputs() || u.rows() != t.size())
    throw Error(text("u must have a row for each of the ", t.size(), " times, or be a function of t"));
  const auto line = [&](double at) {
    const auto after = std::upper_bound(t.begin(), t.end(), at);
    const Index k = std::clamp<Index>(after - t.begin(), 1, t.size() - 1);
    const double share = std::clamp((at - t[k - 1]) / (t[k] - t[k - 1]), 0.0, 1.0);
    return Vec(((1 - share) * u.row(k - 1) + share * u.row(k)).transpose());
  };
  return push_response(call, lti::simulate(g, line, t, {t.begin(), t.end()}));
}

int lti_delay_dcgain(Call& call) {
  const DelaySystem& g = delayed_of(call);
  if (g.product) {
    const MatX K = lti::dcgain(g.core);
    return K.size() == 1 ? push_number_or_expression(call.L, K(0, 0)) : push_entries(call.L, K);
  }
  const lti::ComplexMat K = lti::value(g, 0);
  if (!K.allFinite()) throw Error("the static gain is infinite");
  return push_value(call.L, Mat(K.real()));
}

int evaluate_at(Call& call) {
  const ComplexNumber s = read_complex(call.L, 2, "s");
  const lti::ComplexMat v = lti::value(delayed_of(call), {lti::number(s.re), lti::number(s.im)});
  if (v.size() != 1) throw Error("of several channels use G:freqresp(w)");
  return push_complex(call.L, {Expr(v(0, 0).real()), Expr(v(0, 0).imag())});
}

int pade(Call& call) {
  const long n = call.integer(2, "n", 1);
  if (n < 1 || n > 20) throw Error(text("the order of an approximant is from 1 to 20, got ", n));
  return push_system(call, lti::rational(delayed_of(call), static_cast<int>(n)));
}
int sampled(Call& call) {
  const double Ts = call.number(2, "Ts");
  if (!(Ts > 0)) throw Error("the sampling time must be positive");
  if (call.string(3, "method", "zoh") != "zoh")
    throw Error("a system with delay is sampled exactly by \"zoh\"; others take pade(G, n)");
  return push_system(call, lti::sampled(delayed_of(call), Ts));
}

int rational_part(Call& call) { return push_system(call, delayed_of(call).core); }
int delays(Call& call) {
  const auto& list = delayed_of(call).delays;
  return push_matrix(call.L, Mat(Eigen::Map<const Vec>(list.data(), static_cast<Index>(list.size()))));
}
int lti_delay_Ts(Call& call) { return push_number_or_expression(call.L, 0); }
int push_channels(Call& call, int n, const char* letter) {
  std::vector<std::string> names;
  for (int k = 1; k <= n; ++k) names.push_back(n == 1 ? letter : letter + std::to_string(k));
  return push_names(call.L, names);
}
int lti_delay_inputs(Call& call) { return push_channels(call, delayed_of(call).inputs(), "u"); }
int lti_delay_outputs(Call& call) { return push_channels(call, delayed_of(call).outputs(), "y"); }
int to_text(Call& call) { return call.push(lti::describe(delayed_of(call))); }

}  // namespace

int delayed_operator(Call& call, char operation) {
  switch (operation) {
    case '*':
      return lti_delay_multiply(call);
    case '/':
      return lti_delay_divide(call);
    case '+':
      return lti_delay_add(call);
    case '-':
      return lti_delay_subtract(call);
    case 'c':
      return sampled(call);
    default:
      return closed(call);
  }
}

extern const Module lti_delay_module = {
    "lti delays",
    "Linear systems: delays",
    {
        {"delayed", delayed, "delayed(G, T) -> G",
         R"(G(s) e^{-T s}: the output comes T seconds later. The same as exp(-T*s)*G with s = tf "s". Products, sums
            and feedback keep delays exact: frequency responses, margin(G), step and lsim; :pade(n) makes the
            system rational, :c2d(Ts) samples a delay outside of loops exactly.)",
         "G = delayed(tf({2}, {1, 1}), 0.5)  return G:dcgain(), G:freqresp{math.pi}.mag(1, 1) == tf({2}, {1, "
         "1}):freqresp{math.pi}.mag(1, 1)",
         "2 true"},
        {"lti:__exp", exponential, "exp(-T*s) -> G", R"(The delay of T seconds, with s = tf "s".)",
         "s = tf \"s\"  return (exp(-2*s)/(s + 1)).delays[1]", "2.0"},
        {"delay system:__mul", lti_delay_multiply, "G1 * G2", "In series.",
         "(delayed(tf({1}, {1, 1}), 1)*delayed(tf({1}, {1}), 2)):dcgain()", "1"},
        {"delay system:__div", lti_delay_divide, "G1 / G2", "G1 times the inverse of G2, which has no delay.",
         "(delayed(tf({1}, {1, 1}), 1)/tf({2}, {1})):dcgain()", "0.5"},
        {"delay system:__add", lti_delay_add, "G1 + G2", "In parallel.",
         "(delayed(tf({1}, {1, 1}), 1) + 2):dcgain()", "3.0"},
        {"delay system:__sub", lti_delay_subtract, "G1 - G2",
         "In parallel, the second with the opposite sign.", "(1 - delayed(tf({1}, {1, 1}), 1)):dcgain()",
         "0.0"},
        {"delay system:__unm", lti_delay_negative, "-G", "The opposite sign.",
         "(-delayed(tf({1}, {1, 1}), 1)):dcgain()", "-1"},
        {"delay system:__call", evaluate_at, "G(s) -> number", "The value at a complex number.",
         "delayed(tf({1}, {1, 1}), 1)(0)", "1"},
        {"delay system:__tostring", to_text, "print(G)", "The rational part and the delays."},
        {"delay system:feedback", closed, "G:feedback([H [, sign]]) -> G",
         "The closed loop, delays in it exact.", "return delayed(tf({1}, {1, 1}), 1):feedback():dcgain()",
         "0.5"},
        {"delay system:freqresp", freqresp, "G:freqresp([frequencies]) -> frequency response",
         "G(iω), exact.", "return delayed(tf({1}, {1}), 1):freqresp{1}.phase(1, 1) + 180/math.pi < 1e-12",
         "true"},
        {"delay system:bode", freqresp, "G:bode([frequencies or { from, to }]) -> frequency response",
         "Gain and phase over the frequency; :plot().", "delayed(tf({1}, {1, 1}), 1):bode()"},
        {"delay system:step", step, "G:step([to or times]) -> response",
         "The step response by the method of steps, to about 12 digits.",
         "return math.abs(delayed(tf({1}, {1, 1}), 1):step({0, 3}).y(2, 1) - (1 - math.exp(-2))) < 1e-11",
         "true"},
        {"delay system:lsim", lsim, "G:lsim(u, t) -> response",
         "The response from rest to a function of t, or to samples at the times joined by straight lines.",
         "return math.abs(delayed(tf({1}, {1, 0}), 1):lsim(function(t) return t end, {0, 3}).y(2, 1) - 2) < 1e-12",
         "true"},
        {"delay system:dcgain", lti_delay_dcgain, "G:dcgain() -> number or matrix", "The static gain.",
         "delayed(tf({6}, {1, 3}), 1):dcgain()", "2"},
        {"delay system:pade", pade, "G:pade([n = 1]) -> G", "Every delay as its Padé approximant of order n.",
         "return delayed(tf({1}, {1}), 2):pade():zeros().re[1]", "1"},
        {"delay system:c2d", sampled, "G:c2d(Ts) -> G",
         "The samples of G with a held input, exact; inputs under way are states.",
         "return #delayed(tf({1}, {1, 1}), 2.5):c2d(1).A", "4"},
        {"delay system#rational", rational_part, "G.rational -> G",
         "The system without its delays; where they lie in loops, with a channel for each."},
        {"delay system#delays", delays, "G.delays -> column", "The delays in seconds."},
        {"delay system#Ts", lti_delay_Ts, "G.Ts -> number", "0: continuous time."},
        {"delay system#inputs", lti_delay_inputs, "G.inputs -> list", "Names of the inputs."},
        {"delay system#outputs", lti_delay_outputs, "G.outputs -> list", "Names of the outputs."},
    }};

}  // namespace pendula::lua
