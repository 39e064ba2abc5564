// The `lti` module: the components of a linear system.
#include <algorithm>

#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "lua/bind/lti/lti.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {
namespace {

using lti::System;

const System& in_state_space(Call& call, const char* what) {
  const System& g = system_of(call);
  if (g.form != lti::Form::ss)
    throw Error(
        text("a transfer function has no ", what, "; G:ss().", what, " belongs to a realisation of it"));
  return g;
}
int A(Call& call) { return push_entries(call.L, in_state_space(call, "A").ss.A); }
int B(Call& call) { return push_entries(call.L, in_state_space(call, "B").ss.B); }
int C(Call& call) { return push_entries(call.L, in_state_space(call, "C").ss.C); }
int D(Call& call) { return push_entries(call.L, in_state_space(call, "D").ss.D); }

int push_polynomial(Call& call, bool numerator) {
  const System g = lti::to_tf(system_of(call));
  if (!g.siso()) throw Error("of several inputs or outputs: choose one with G:channel(i, j)");
  const lti::Polynomial& p = numerator ? g.tf[0].num : g.tf[0].den;
  MatX c = MatX::Zero(std::max<Eigen::Index>(1, static_cast<Eigen::Index>(p.size())), 1);
  for (std::size_t k = 0; k < p.size(); ++k) c(static_cast<Eigen::Index>(p.size() - 1 - k), 0) = p[k];
  return push_entries(call.L, c);
}
int num(Call& call) { return push_polynomial(call, true); }
int den(Call& call) { return push_polynomial(call, false); }

int gain(Call& call) {
  const System g = lti::to_zpk(system_of(call));
  if (!g.siso()) throw Error("of several inputs or outputs: choose one with G:channel(i, j)");
  return push_expr(call.L, g.zpk[0].gain);
}

int Ts(Call& call) { return push_number_or_expression(call.L, system_of(call).Ts); }
int form(Call& call) {
  static const char* const names[] = {"ss", "tf", "zpk"};
  return call.push(names[static_cast<int>(system_of(call).form)]);
}
int order(Call& call) { return call.push(lti::order(system_of(call))); }
int names(Call& call, int count, std::string (*name)(const System&, int)) {
  std::vector<std::string> list;
  for (int i = 0; i < count; ++i) list.push_back(name(system_of(call), i));
  return push_names(call.L, list);
}
int states(Call& call) { return names(call, system_of(call).ss.order(), lti::state_name); }
int inputs(Call& call) { return names(call, system_of(call).inputs, lti::input_name); }
int outputs(Call& call) { return names(call, system_of(call).outputs, lti::output_name); }
int notes(Call& call) { return push_names(call.L, system_of(call).notes); }

int with(Call& call) {
  call.table(2, "parameters");
  const System& g = system_of(call);
  std::vector<Expr> known;
  const std::vector<Expr> all = lti::entries(g);
  for (Expr leaf : leaves(all))
    if (symbol_of(leaf).kind == Kind::parameter) known.push_back(leaf);
  Substitution values;
  each_symbol_entry(call.L, 2, "with", known, [&](const SymbolEntry& e) {
    if (e.leaves.size() != 1) throw Error(text("with.", e.key(), " must name one parameter"));
    values[e.leaves[0]] = to_expr(call.L, e.value, "with." + e.key());
  });
  for (const auto& [leaf, v] : values)
    if (std::find(known.begin(), known.end(), leaf) == known.end())
      throw Error(text("the system does not contain '", to_text(leaf), "'"));
  return push_system(call, lti::substitute(g, values));
}

/// The index of a channel, from a number (from 1) or a name.
int channel_of(Call& call, int i, const char* what, int count, std::string (*name)(const System&, int)) {
  if (lua_type(call.L, i) == LUA_TSTRING) {
    std::vector<std::string> all;
    for (int k = 0; k < count; ++k) all.push_back(name(system_of(call), k));
    const std::string word = call.string(i, what);
    const auto at = std::find(all.begin(), all.end(), word);
    if (at == all.end())
      throw Error(
          text("there is no ", what, " '", word, "'.", did_you_mean(word, all), " (", join(all, ", "), ")"));
    return static_cast<int>(at - all.begin());
  }
  const long k = call.integer(i, what);
  if (k < 1 || k > count)
    throw Error(text("there ", count == 1 ? "is 1 " : text("are ", count, " "), what, count == 1 ? "" : "s",
                     "; number ", k, " does not exist"));
  return static_cast<int>(k) - 1;
}

int channel(Call& call) {
  const System& g = system_of(call);
  return push_system(call, lti::select(g, {channel_of(call, 2, "output", g.outputs, lti::output_name)},
                                       {channel_of(call, 3, "input", g.inputs, lti::input_name)}));
}

int latex(Call& call) { return call.push(lti::latex(system_of(call))); }
int system_shown(Call& call) { return call.push(lti::describe(system_of(call))); }

}  // namespace

extern const Module lti_module = {
    "lti",
    "Linear systems",
    {
        {"lti#A", A, "G.A -> matrix", "A of a state space."},
        {"lti#B", B, "G.B -> matrix", "B of a state space."},
        {"lti#C", C, "G.C -> matrix", "C of a state space."},
        {"lti#D", D, "G.D -> matrix", "D of a state space."},
        {"lti#num", num, "G.num -> column", "The numerator's coefficients, highest power first."},
        {"lti#den", den, "G.den -> column", "The denominator's coefficients, highest power first."},
        {"lti#gain", gain, "G.gain -> number", "The gain k of G:zpk()."},
        {"lti#Ts", Ts, "G.Ts -> number", "The sampling time; 0 in continuous time."},
        {"lti#form", form, "G.form -> string", R"("ss", "tf" or "zpk".)"},
        {"lti#order", order, "G.order -> integer", "The number of states."},
        {"lti#states", states, "G.states -> list", "The names of the states."},
        {"lti#inputs", inputs, "G.inputs -> list", "The names of the inputs."},
        {"lti#outputs", outputs, "G.outputs -> list", "The names of the outputs."},
        {"lti#notes", notes, "G.notes -> list",
         "Remarks on the construction: cancelled factors, the point of linearisation."},
        {"lti:with", with, "G:with{ k = 2 } -> G", "The same system with values for parameters.",
         R"(k = param "k"  return tf({k}, {1, k}):with{ k = 3 }:dcgain())", "1"},
        {"lti:channel", channel, "G:channel(output, input) -> G", "One channel, by numbers or names.",
         R"(
             G = ss({{-1, 0}, {0, -2}}, {{1, 0}, {0, 1}}, {{1, 0}, {0, 1}})
             G:channel(2, 2):poles())",
         "poles: -2, -1"},
        {"lti:latex", latex, "G:latex() -> string", "The system in LaTeX.", "tf({1}, {1, 2}):latex()",
         "G(s) = \\frac{1}{s + 2}"},
        {"lti:__tostring", system_shown, "print(G)", "The matrices as one table, or fractions with a rule."},
    }};

}  // namespace pendula::lua
