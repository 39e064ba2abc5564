// Systems in series, in parallel and in feedback loops.
#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "lti/system.hpp"

namespace pendula::lti {
namespace {

bool is_static(const System& g) {
  if (g.form == Form::ss) return g.ss.order() == 0;
  if (g.form == Form::zpk)
    return std::all_of(g.zpk.begin(), g.zpk.end(),
                       [](const Factored& f) { return f.zeros.empty() && f.poles.empty(); });
  return std::all_of(g.tf.begin(), g.tf.end(),
                     [](const Fraction& f) { return f.num.size() <= 1 && f.den.size() <= 1; });
}

bool has_states(const System& g) { return g.form == Form::ss && g.ss.order() > 0; }

std::string time_clause(const System& g) {
  return g.continuous() ? "is continuous"
                        : text("has the sampling time ",
                               g.Ts.is_constant() ? pendula::rounded(constant_value(g.Ts)) : to_text(g.Ts));
}

/// The sampling time of two connected systems; a static gain has none of its own.
Expr common_time(const System& a, const System& b) {
  if (a.Ts == b.Ts) return a.Ts;
  if (is_static(a) && a.continuous()) return b.Ts;
  if (is_static(b) && b.continuous()) return a.Ts;
  throw Error(text("the sampling times differ: the first system ", time_clause(a), ", the second ",
                   time_clause(b), "; convert one with c2d(G, Ts) or d2c(G)"));
}

/// Is the result in state space? If one of the systems has states, otherwise fractions.
bool in_state_space(const System& a, const System& b) {
  return has_states(a) || has_states(b) || (a.form == Form::ss && b.form == Form::ss);
}

std::vector<std::string> all_names(int count, const std::vector<std::string>& given,
                                   std::string (*name)(const System&, int), const System& g) {
  if (!given.empty()) return given;
  std::vector<std::string> list;
  for (int i = 0; i < count; ++i) list.push_back(name(g, i));
  return list;
}

std::vector<std::string> joined(std::vector<std::string> a, const std::vector<std::string>& b) {
  for (std::string name : b) {
    while (std::find(a.begin(), a.end(), name) != a.end()) name += "*";
    a.push_back(name);
  }
  return a;
}

std::vector<std::string> states_of_both(const System& a, const System& b) {
  if (a.state_names.empty() && b.state_names.empty()) return {};
  if (b.ss.order() == 0) return a.state_names;
  if (a.ss.order() == 0) return b.state_names;
  return joined(all_names(a.ss.order(), a.state_names, state_name, a),
                all_names(b.ss.order(), b.state_names, state_name, b));
}

std::string channels(const System& g) {
  return text(g.inputs, g.inputs == 1 ? " input" : " inputs", " and ", g.outputs,
              g.outputs == 1 ? " output" : " outputs");
}

System named(System g, const std::vector<std::string>& in, const std::vector<std::string>& out) {
  g.input_names = in;
  g.output_names = out;
  return g;
}

std::vector<Fraction> fraction_product(const System& a, const System& b) {
  std::vector<Fraction> list;
  for (int i = 0; i < a.outputs; ++i)
    for (int j = 0; j < b.inputs; ++j) {
      Fraction total{{}, {1}};
      for (int k = 0; k < a.inputs; ++k) total = sum(total, product(a.fraction(i, k), b.fraction(k, j)));
      list.push_back(std::move(total));
    }
  return list;
}

[[noreturn]] void algebraic_loop(const std::string& why) {
  throw Error("the loop is an algebraic loop without a unique solution: " + why +
              "; a delay or a state must break it");
}

System siso_feedback(const System& g1, const System& g2, int sign, Expr Ts) {
  const Fraction a = to_tf(g1).tf[0], b = to_tf(g2).tf[0];
  const Polynomial num = a.num * b.den, den = a.den * b.den - scaled(Expr(sign), a.num * b.num);
  const bool proper = degree(a.num) <= degree(a.den) && degree(b.num) <= degree(b.den);
  if (den.empty() || (proper && degree(den) < degree(a.den) + degree(b.den)))
    algebraic_loop(text(sign < 0 ? "1 + G₁G₂" : "1 - G₁G₂", " = 0 at ", g1.continuous() ? "s" : "z", " = ∞"));
  System h = make_tf({{num, den}}, 1, 1, Ts);
  return h;
}

}  // namespace

System series(const System& second, const System& first) {
  const Expr Ts = common_time(second, first);
  if (second.inputs != first.outputs)
    throw Error(text("the outputs of one system must be the inputs of the next: the first to act has ",
                     channels(first), ", the other ", channels(second)));
  if (second.siso() && first.siso() && !in_state_space(second, first)) {
    const auto gain_of = [](const System& g) { return g.form == Form::ss ? g.ss.D(0, 0) : g.zpk[0].gain; };
    const bool z2 = second.form == Form::zpk, z1 = first.form == Form::zpk;
    if ((z2 && (z1 || first.form == Form::ss)) || (z1 && second.form == Form::ss)) {
      Factored f{gain_of(second) * gain_of(first), {}, {}};
      for (const System* g : {&second, &first})
        if (g->form == Form::zpk) {
          f.zeros.insert(f.zeros.end(), g->zpk[0].zeros.begin(), g->zpk[0].zeros.end());
          f.poles.insert(f.poles.end(), g->zpk[0].poles.begin(), g->zpk[0].poles.end());
        }
      return named(make_zpk({f}, 1, 1, Ts), first.input_names, second.output_names);
    }
  }
  if (!in_state_space(second, first))
    return named(make_tf(fraction_product(to_tf(second), to_tf(first)), second.outputs, first.inputs, Ts),
                 first.input_names, second.output_names);
  const System a = to_ss(second), b = to_ss(first);
  const MatX A = vstack(hstack(a.ss.A, product(a.ss.B, b.ss.C)),
                        hstack(MatX(MatX::Zero(b.ss.order(), a.ss.order())), b.ss.A));
  System h = make_ss(tidy(A), tidy(vstack(product(a.ss.B, b.ss.D), b.ss.B)),
                     tidy(hstack(a.ss.C, product(a.ss.D, b.ss.C))), tidy(product(a.ss.D, b.ss.D)), Ts);
  h.state_names = states_of_both(a, b);
  return named(std::move(h), first.input_names, second.output_names);
}

System parallel(const System& a, const System& b) {
  const Expr Ts = common_time(a, b);
  if (a.inputs != b.inputs || a.outputs != b.outputs)
    throw Error(text("systems in parallel need the same inputs and outputs: the first has ", channels(a),
                     ", the second ", channels(b)));
  if (!in_state_space(a, b)) {
    const System f = to_tf(a), g = to_tf(b);
    std::vector<Fraction> list;
    for (std::size_t k = 0; k < f.tf.size(); ++k) list.push_back(sum(f.tf[k], g.tf[k]));
    return named(make_tf(std::move(list), a.outputs, a.inputs, Ts), a.input_names, a.output_names);
  }
  const System f = to_ss(a), g = to_ss(b);
  System h = make_ss(block_diagonal(f.ss.A, g.ss.A), vstack(f.ss.B, g.ss.B), hstack(f.ss.C, g.ss.C),
                     tidy(MatX(f.ss.D + g.ss.D)), Ts);
  h.state_names = states_of_both(f, g);
  return named(std::move(h), a.input_names, a.output_names);
}

System feedback(const System& g1, const System& g2, int sign) {
  const Expr Ts = common_time(g1, g2);
  if (g2.inputs != g1.outputs || g2.outputs != g1.inputs)
    throw Error(text("the system in the feedback path must have ", g1.outputs,
                     g1.outputs == 1 ? " input" : " inputs", " and ", g1.inputs,
                     g1.inputs == 1 ? " output" : " outputs", ", but it has ", channels(g2)));
  if (g1.siso() && g2.siso() && !in_state_space(g1, g2))
    return named(siso_feedback(g1, g2, sign, Ts), g1.input_names, g1.output_names);
  const System a = to_ss(g1), b = to_ss(g2);
  const Expr s(sign);
  // u₁ = u + s (C₂x₂ + D₂ y), y = C₁x₁ + D₁u₁:  (I - s D₂D₁) u₁ = u + s (D₂C₁ x₁ + C₂ x₂)
  const MatX E = MatX::Identity(g1.inputs, g1.inputs) - scaled(s, product(b.ss.D, a.ss.D));
  const MatX right =
      hstack(scaled(s, hstack(product(b.ss.D, a.ss.C), b.ss.C)), MatX::Identity(g1.inputs, g1.inputs));
  const auto u1 = solve(E, right);
  if (!u1) algebraic_loop(text("I ", sign < 0 ? "+" : "-", " D₂D₁ is singular"));
  const int n1 = a.ss.order(), n2 = b.ss.order(), n = n1 + n2;
  const MatX K = u1->leftCols(n), L = u1->rightCols(g1.inputs);
  const MatX C1 = hstack(a.ss.C, MatX(MatX::Zero(g1.outputs, n2)));
  const MatX Cy = tidy(C1 + product(a.ss.D, K)), Dy = tidy(product(a.ss.D, L));  // y
  const MatX A = vstack(hstack(a.ss.A, MatX(MatX::Zero(n1, n2))) + product(a.ss.B, K),
                        hstack(MatX(MatX::Zero(n2, n1)), b.ss.A) + product(b.ss.B, Cy));
  System h = make_ss(tidy(A), tidy(vstack(product(a.ss.B, L), product(b.ss.B, Dy))), Cy, Dy, Ts);
  h.state_names = states_of_both(a, b);
  h = named(std::move(h), g1.input_names, g1.output_names);
  return g1.form == Form::ss || g2.form == Form::ss ? h : to_tf(h);
}

System negative(const System& g) {
  System h = g;
  h.ss.C = scaled(-1, g.ss.C);
  h.ss.D = scaled(-1, g.ss.D);
  for (Fraction& f : h.tf) f.num = scaled(-1, f.num);
  for (Factored& f : h.zpk) f.gain = -f.gain;
  return h;
}

System inverse(const System& g) {
  if (g.inputs != g.outputs)
    throw Error(text("only a square system has an inverse; this one has ", channels(g)));
  if (g.siso() && g.form != Form::ss) {
    if (g.form == Form::zpk) {
      const Factored& f = g.zpk[0];
      if (f.gain.is_zero()) throw Error("division by a system that is zero");
      return make_zpk({{1 / f.gain, f.poles, f.zeros}}, 1, 1, g.Ts);
    }
    if (g.tf[0].num.empty()) throw Error("division by a system that is zero");
    return make_tf({{g.tf[0].den, g.tf[0].num}}, 1, 1, g.Ts);
  }
  const System a = to_ss(g);
  const auto u = solve(a.ss.D, hstack(scaled(-1, a.ss.C), MatX::Identity(g.outputs, g.outputs)));
  if (!u)
    throw Error(
        "the inverse is not proper, since D is singular; for one input and output "
        "G:tf() has an inverse as a fraction");
  const MatX K = u->leftCols(a.ss.order()), L = u->rightCols(g.inputs);
  System h = make_ss(tidy(MatX(a.ss.A + product(a.ss.B, K))), tidy(product(a.ss.B, L)), K, L, g.Ts);
  h.state_names = g.state_names;
  return g.form == Form::ss ? h : to_tf(h);
}

System power(const System& g, int n) {
  if (n < 0) return power(inverse(g), -n);
  if (n == 0) return make_gain(MatX::Identity(g.inputs, g.inputs), g.Ts);
  System h = g;
  for (int k = 1; k < n; ++k) h = series(h, g);
  return h;
}

namespace {

/// a and b with inputs (`right`) or outputs concatenated.
System stacked(const System& a, const System& b, bool right) {
  const Expr Ts = common_time(a, b);
  if (right ? a.outputs != b.outputs : a.inputs != b.inputs)
    throw Error(text("a block with ", channels(a), " and one with ", channels(b), " cannot stand ",
                     right ? "beside" : "above", " each other"));
  const auto in = [](const System& g) { return all_names(g.inputs, g.input_names, input_name, g); };
  const auto out = [](const System& g) { return all_names(g.outputs, g.output_names, output_name, g); };
  const bool named_in = !a.input_names.empty() || !b.input_names.empty();
  const bool named_out = !a.output_names.empty() || !b.output_names.empty();
  System h;
  if (!in_state_space(a, b)) {
    const System f = to_tf(a), g = to_tf(b);
    std::vector<Fraction> list;
    if (right) {
      for (int i = 0; i < f.outputs; ++i) {
        for (int j = 0; j < f.inputs; ++j) list.push_back(f.fraction(i, j));
        for (int j = 0; j < g.inputs; ++j) list.push_back(g.fraction(i, j));
      }
      h = make_tf(std::move(list), f.outputs, f.inputs + g.inputs, Ts);
    } else {
      list = f.tf;
      list.insert(list.end(), g.tf.begin(), g.tf.end());
      h = make_tf(std::move(list), f.outputs + g.outputs, f.inputs, Ts);
    }
  } else {
    const System f = to_ss(a), g = to_ss(b);
    const MatX A = block_diagonal(f.ss.A, g.ss.A);
    h = right
            ? make_ss(A, block_diagonal(f.ss.B, g.ss.B), hstack(f.ss.C, g.ss.C), hstack(f.ss.D, g.ss.D), Ts)
            : make_ss(A, vstack(f.ss.B, g.ss.B), block_diagonal(f.ss.C, g.ss.C), vstack(f.ss.D, g.ss.D), Ts);
    h.state_names = states_of_both(f, g);
  }
  if (right) {
    if (named_in) h.input_names = joined(in(a), in(b));
    h.output_names = a.output_names;
  } else {
    if (named_out) h.output_names = joined(out(a), out(b));
    h.input_names = a.input_names;
  }
  return h;
}

}  // namespace

System append(const System& a, const System& b) {
  const System zero_right = make_gain(MatX::Zero(a.outputs, b.inputs)),
               zero_left = make_gain(MatX::Zero(b.outputs, a.inputs));
  return assemble({{a, zero_right}, {zero_left, b}});
}

System assemble(const std::vector<std::vector<System>>& blocks) {
  PENDULA_ASSERT(!blocks.empty() && !blocks[0].empty(), "a matrix of systems without entries");
  std::optional<System> all;
  for (const auto& row : blocks) {
    System line = row[0];
    for (std::size_t j = 1; j < row.size(); ++j) line = stacked(line, row[j], true);
    all = all ? stacked(*all, line, false) : line;
  }
  return *all;
}

System select(const System& g, const std::vector<int>& out, const std::vector<int>& in) {
  System h = g;
  h.outputs = static_cast<int>(out.size());
  h.inputs = static_cast<int>(in.size());
  h.input_names.clear();
  h.output_names.clear();
  for (int j : in) h.input_names.push_back(input_name(g, j));
  for (int i : out) h.output_names.push_back(output_name(g, i));
  if (g.form == Form::ss) {
    h.ss.B = MatX(g.ss.order(), h.inputs);
    h.ss.C = MatX(h.outputs, g.ss.order());
    h.ss.D = MatX(h.outputs, h.inputs);
    for (int j = 0; j < h.inputs; ++j) h.ss.B.col(j) = g.ss.B.col(in[j]);
    for (int i = 0; i < h.outputs; ++i) {
      h.ss.C.row(i) = g.ss.C.row(out[i]);
      for (int j = 0; j < h.inputs; ++j) h.ss.D(i, j) = g.ss.D(out[i], in[j]);
    }
    return h;
  }
  h.tf.clear();
  h.zpk.clear();
  for (int i : out)
    for (int j : in) {
      const auto k = static_cast<std::size_t>(i * g.inputs + j);
      if (g.form == Form::tf)
        h.tf.push_back(g.tf[k]);
      else
        h.zpk.push_back(g.zpk[k]);
    }
  return h;
}

}  // namespace pendula::lti
