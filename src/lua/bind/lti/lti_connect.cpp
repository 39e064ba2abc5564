// Connections of linear systems, and sampling. Reads arguments, calls src/lti.
#include <algorithm>
#include <numbers>

#include "base/text.hpp"
#include "lti/discrete.hpp"
#include "lua/bind/lti/lti.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {
namespace {

using lti::System;

bool is_scalar(Call& call, int i) { return !call.is<System>(i) && is_expression(call.L, i); }

/// A scalar combined with a system of several channels applies to all of them.
System operand(Call& call, int i, const char* name, int channels) {
  System g = read_system(call, i, name);
  if (is_scalar(call, i) && channels > 1) {
    const Expr k = g.ss.D(0, 0);
    g = lti::make_gain(lti::scaled(k, MatX::Identity(channels, channels)));
  }
  return g;
}

int system_multiply(Call& call) {
  if (call.is<lti::DelaySystem>(2)) return delayed_operator(call, '*');
  const int channels = call.is<System>(1) ? (is_scalar(call, 2) ? system_of(call).inputs : 1)
                                          : call.object<System>(2, "the right operand").outputs;
  return push_system(call, lti::series(operand(call, 1, "the left operand", channels),
                                       operand(call, 2, "the right operand", channels)));
}
int system_divide(Call& call) {
  if (call.is<lti::DelaySystem>(2)) return delayed_operator(call, '/');
  const System a = read_system(call, 1, "the left operand"),
               b = operand(call, 2, "the right operand", a.inputs);
  return push_system(call, lti::series(operand(call, 1, "the left operand", b.outputs), lti::inverse(b)));
}
int system_add(Call& call) {
  if (call.is<lti::DelaySystem>(2)) return delayed_operator(call, '+');
  return push_system(call, lti::parallel(read_system(call, 1, "the left operand"),
                                         read_system(call, 2, "the right operand")));
}
int system_subtract(Call& call) {
  if (call.is<lti::DelaySystem>(2)) return delayed_operator(call, '-');
  return push_system(call, lti::parallel(read_system(call, 1, "the left operand"),
                                         lti::negative(read_system(call, 2, "the right operand"))));
}
int system_negative(Call& call) { return push_system(call, lti::negative(system_of(call))); }
int system_power(Call& call) {
  const long n = call.integer(2, "exponent");
  if (std::labs(n) > 100) throw Error("the exponent of a system must be an integer of at most 100");
  return push_system(call, lti::power(system_of(call), static_cast<int>(n)));
}

int series(Call& call) {
  bool system = false;
  for (int i = 1; i <= call.count(); ++i) system = system || call.is<System>(i);
  if (!system && call.count() > 0)
    throw Error(
        "connects systems, series(G1, G2), and none of these is one; a Taylor polynomial is written by diff");
  System g = read_system(call, 1, "G1");
  for (int i = 2; i <= call.count(); ++i) g = lti::series(read_system(call, i, "G2"), g);
  return push_system(call, std::move(g));
}
int parallel(Call& call) {
  System g = read_system(call, 1, "G1");
  for (int i = 2; i <= call.count(); ++i) g = lti::parallel(g, read_system(call, i, "G2"));
  return push_system(call, std::move(g));
}
int feedback(Call& call) {
  if (call.is<lti::DelaySystem>(1) || call.is<lti::DelaySystem>(2)) return delayed_operator(call, 'f');
  const System g = read_system(call, 1, "G1");
  const System h = call.has(2) ? operand(call, 2, "G2", std::max(g.inputs, g.outputs))
                               : lti::make_gain(MatX::Identity(g.inputs, g.outputs));
  const long sign = call.integer(3, "sign", -1);
  if (sign != 1 && sign != -1) throw Error(text("sign must be -1 (negative feedback) or 1, got ", sign));
  return push_system(call, lti::feedback(g, h, static_cast<int>(sign)));
}
int append(Call& call) {
  System g = read_system(call, 1, "G1");
  for (int i = 2; i <= call.count(); ++i) g = lti::append(g, read_system(call, i, "G2"));
  return push_system(call, std::move(g));
}

int c2d(Call& call) {
  if (call.is<lti::DelaySystem>(1)) return delayed_operator(call, 'c');
  const System g = read_system(call, 1, "G");
  if (!call.has(2)) call.wrong(2, "Ts", "a sampling time");
  double prewarp = 0;
  if (call.has(4)) {
    prewarp = call.options(4).number("prewarp");
    if (!(prewarp > 0)) throw Error("option 'prewarp' must be a positive frequency in rad/s");
  }
  const std::string method = call.string(3, "method", "zoh");
  if (prewarp > 0 && method != "tustin" && method != "bilinear")
    throw Error(text("prewarp is for method \"tustin\", not for \"", method, "\""));
  const Expr Ts = to_expr(call.L, 2, "Ts");
  if (prewarp > 0 && !(prewarp * lti::number(Ts) < std::numbers::pi))
    throw Error(text("option 'prewarp': samples contain only frequencies below π/Ts = ",
                     rounded(std::numbers::pi / lti::number(Ts), 6), " rad/s, got ", rounded(prewarp, 6)));
  return push_system(call, lti::c2d(g, Ts, method, prewarp));
}
int d2c(Call& call) {
  return push_system(call, lti::d2c(read_system(call, 1, "G"), call.string(2, "method", "zoh")));
}

/// place: position of the argument `method`.
OptionTable c2d_options_with(const char* place) {
  return {
      {place, "string", "\"zoh\"", "the input between samples, or the substitution for s",
       "zoh|foh|tustin|bilinear|euler|backward|impulse|matched"},
      {"prewarp", "number", "", "tustin: the frequency, in rad/s, at which both agree"},
  };
}
const OptionTable c2d_options = c2d_options_with("3"), c2d_method_options = c2d_options_with("2");

}  // namespace

extern const Module lti_connect_module = {
    "lti",
    "",
    {
        {"lti:__mul", system_multiply, "G1 * G2",
         "In series: the output of G2 is the input of G1. Numbers and matrices are gains.",
         "tf({1}, {1, 1})*tf({2}, {1, 3})", R"(
             transfer function, continuous time
                    2
               ────────────
               s² + 4 s + 3)"},
        {"lti:__div", system_divide, "G1 / G2", "G1 times the inverse of G2.",
         "tf({1}, {1, 1})/tf({1, 2}, {1, 3})", R"(
             transfer function, continuous time
                  s + 3
               ────────────
               s² + 3 s + 2)"},
        {"lti:__add", system_add, "G1 + G2", "In parallel.", "tf({1}, {1, 1}) + tf({1}, {1, 2})", R"(
             transfer function, continuous time
                 2 s + 3
               ────────────
               s² + 3 s + 2)"},
        {"lti:__sub", system_subtract, "G1 - G2", "In parallel, the second with the opposite sign.",
         "1 - tf({1}, {1, 1})", R"(
             transfer function, continuous time
                 s
               ─────
               s + 1)"},
        {"lti:__unm", system_negative, "-G", "The opposite sign.", "-tf({1}, {1, 1})", R"(
             transfer function, continuous time
                -1
               ─────
               s + 1)"},
        {"lti:__pow", system_power, "G ^ n", "n in series; -1 is the inverse.", "tf({1}, {1, 1})^2", R"(
             transfer function, continuous time
                    1
               ────────────
               s² + 2 s + 1)"},
        {"series", series, "series(G1, G2, …) -> G",
         "A series connection, the first system first: series(G1, G2) is G2*G1.",
         "series(tf({1}, {1, 1}), tf({1}, {1, 4})):dcgain()", "0.25"},
        {"parallel", parallel, "parallel(G1, G2, …) -> G", "The sum of the outputs.",
         "parallel(tf({1}, {1, 1}), tf({1}, {1, 4})):dcgain()", "1.25"},
        {"feedback", feedback, "feedback(G1 [, G2 [, sign = -1]]) -> G",
         R"(The closed loop y = G1 (r + sign·G2 y); G2 is 1 if it is not given. An algebraic loop is an
            error.)",
         "feedback(tf({1}, {1, 0}), 2)", R"(
            transfer function, continuous time
                1
              ─────
              s + 2)"},
        {"append", append, "append(G1, G2, …) -> G", "Side by side: block diagonal.",
         "#append(tf({1}, {1, 1}), ss({{-2}}, {1}, {1})).inputs", "2"},
        {"lti:feedback", feedback, "G:feedback([G2 [, sign]]) -> G", "The same as feedback(G, G2, sign).",
         "return tf({1}, {1, 1}):feedback()", R"(transfer function, continuous time
    1
  ─────
  s + 2)"},
        {"c2d", c2d, R"(c2d(G, Ts [, method = "zoh" [, { prewarp = ω }]]) -> G)",
         R"(Sampling: "zoh" (inputs held), "foh" (straight lines), "tustin", "euler", "backward",
            "impulse", "matched" (poles and zeros go to e^{s Ts}). Exact where the result is rational or
            symbolic.)",
         R"(Ts = param "Ts"  return c2d(ss({{0, 1}, {0, 0}}, {0, 1}, {1, 0}), Ts).B[1])", "Ts²/2",
         &c2d_options},
        {"d2c", d2c, R"(d2c(G [, method = "zoh"]) -> G)",
         R"(Back to continuous time by the matrix logarithm ("zoh") or by "tustin"; poles on the negative
            axis have no "zoh".)",
         "d2c(c2d(tf({1}, {1, 2}), 0.5)):poles()", "poles: -2"},
        {"lti:c2d", c2d, "G:c2d(Ts [, method [, { prewarp = ω }]]) -> G", "The same as c2d(G, Ts, method).",
         "return tf({1}, {1, 1}):c2d(0.1)", R"(transfer function, sampling time 0.1
   0.09516258196
  ───────────────
  z - 0.904837418)",
         &c2d_method_options},
        {"lti:d2c", d2c, "G:d2c([method]) -> G", "The same as d2c(G, method).",
         "return tf({1}, {1, 1}):c2d(0.1):d2c()", R"(transfer function, continuous time
    1
  ─────
  s + 1)"},
    }};

}  // namespace pendula::lua
