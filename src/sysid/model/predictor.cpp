#include "sysid/model/predictor.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::sysid {
namespace {

Expr at(const std::string& signal, Index lag) {
  return call({signal, {1}, {0}, {lag == 0 ? time_symbol() : time_symbol() - Expr(static_cast<long>(lag))}});
}

SignalTerm term_of(Expr node) {
  const FunctionCall& f = call_of(node);
  const std::string shown = to_text(node);
  if (f.arguments.size() != 1 ||
      std::any_of(f.partial.begin(), f.partial.end(), [](int k) { return k != 0; }))
    throw Error(text(shown, ": a signal is a function of one time such as y(t-1)"));
  const Expr argument = f.arguments[0];
  for (const Expr leaf : leaves({&argument, 1}))
    if (leaf != time_symbol())
      throw Error(text(shown, ": the argument of a signal must be t - k with a whole number k"));
  const double zero = evaluate({&argument, 1}, {{time_symbol(), 0.0}})[0];
  const double one = evaluate({&argument, 1}, {{time_symbol(), 1.0}})[0];
  if (one - zero != 1 || zero != std::round(zero))
    throw Error(text(shown, ": the argument of a signal must be t - k with a whole number k"));
  if (zero > 0)
    throw Error(text(shown, " lies in the future of t; a predictor uses y(t-1), u(t) and earlier"));
  constexpr int longest = 10000;  // a choice: the state of the predictor holds so many samples
  if (zero < -longest) throw Error(text(shown, ": the lag is too large, at most ", longest, " samples"));
  SignalTerm s{SignalTerm::Kind::input, f.name, static_cast<Index>(-zero), node};
  if (f.name == "y") s.kind = SignalTerm::Kind::output;
  if (f.name == "yhat" || f.name == "e") s.kind = SignalTerm::Kind::prediction;
  if (s.kind != SignalTerm::Kind::input && s.lag == 0)
    throw Error(text(shown, " is not known at time t - 1; the prediction of y(t) may use ", f.name,
                     "(t-1) and earlier"));
  return s;
}

std::vector<Expr> calls_in(Expr e) {
  std::vector<Expr> out;
  for (const Expr node : topological({&e, 1}))
    if (node.op() == Op::call) out.push_back(node);
  return out;
}

/// Splits ŷ(t) = offset + φᵀθ, if the predictor is linear.
void split_linear(Predictor& p) {
  p.regressor.resize(static_cast<Index>(p.parameters.size()));
  p.offset = p.expression;
  p.linear = !p.recursive;
  for (std::size_t i = 0; i < p.parameters.size(); ++i) {
    const Expr slope = simplify(partial(p.expression, p.parameters[i]));
    p.regressor[i] = slope;
    for (const Expr q : p.parameters) p.linear = p.linear && !depends_on(slope, q);
  }
  Substitution zero;
  for (const Expr q : p.parameters) zero[q] = Expr(0);
  if (p.linear) p.offset = simplify(substitute(p.expression, zero));
}

}  // namespace

Index Predictor::memory() const {
  Index m = 0;
  for (const SignalTerm& s : terms) m = std::max(m, s.lag);
  return m;
}

namespace {

/// Order by name, with trailing numbers by value: a, b2, b10. θ thus does not depend on earlier definitions
/// of the program.
bool by_name(Expr a, Expr b) {
  const auto key = [](Expr e) {
    const std::string& name = symbol_of(e).name;
    const auto digits = name.find_last_not_of("0123456789") + 1;
    const std::string number = name.substr(digits);
    return std::tuple(name.substr(0, digits), number.size(), number);
  };
  return key(a) < key(b);
}

}  // namespace

Predictor predictor(Expr expression, std::vector<Expr> parameters) {
  Predictor p;
  Substitution innovations;  // e(t-k) = y(t-k) - yhat(t-k)
  for (const Expr node : calls_in(expression))
    if (call_of(node).name == "e") {
      const Index lag = term_of(node).lag;
      innovations[node] = at("y", lag) - at("yhat", lag);
    }
  p.expression = innovations.empty() ? expression : substitute(expression, innovations);
  const bool all = parameters.empty();
  for (const Expr leaf : leaves({&p.expression, 1})) {
    const Symbol& s = symbol_of(leaf);
    if (s.kind == Kind::time || s.kind == Kind::constant) continue;
    if (all && s.kind == Kind::parameter) parameters.push_back(leaf);
    if (std::find(parameters.begin(), parameters.end(), leaf) == parameters.end() && !s.value)
      throw Error(
          text(s.name,
               " is neither among the parameters nor a parameter with a value; signals are written y(t-1), "
               "u(t-1) with y = func \"y\", u = func \"u\""));
  }
  if (all) std::sort(parameters.begin(), parameters.end(), by_name);
  p.parameters = std::move(parameters);
  for (const Expr node : calls_in(p.expression)) p.terms.push_back(term_of(node));
  for (const SignalTerm& s : p.terms) p.recursive = p.recursive || s.kind == SignalTerm::Kind::prediction;
  split_linear(p);
  return p;
}

std::string describe(const Predictor& p) {
  std::vector<std::string> names, phi;
  for (const Expr q : p.parameters) names.push_back(to_text(q));
  std::string out = text("  ŷ(t) = ", to_text(p.expression), "\n");
  std::string::size_type at_name;
  while ((at_name = out.find("yhat(")) != std::string::npos) out.replace(at_name, 4, "ŷ");
  const std::string theta = text("θ = (", join(names, ", "), ")");
  if (p.parameters.empty()) return out + "  no parameters";
  if (!p.linear) {
    return out + text("  not linear in ", theta,
                      p.recursive ? ": earlier predictions ŷ(t-k) depend on θ themselves" : "",
                      "\n  least squares is a nonlinear problem (Gauss–Newton)");
  }
  for (const Expr e : entries(p.regressor)) phi.push_back(to_text(e));
  out += text("  linear in ", theta, ": ŷ(t) = ", p.offset.is_zero() ? "" : to_text(p.offset) + " + ",
              "φ(t)ᵀθ with φ(t) = [", join(phi, ", "), "]ᵀ\n");
  return out + "  least squares is a linear problem: ΦᵀΦ θ̂ = Φᵀ y; covariance σ²(ΦᵀΦ)⁻¹ if Φ has full rank";
}

// ── from polynomials ──

bool SymbolicPolynomials::numeric() const {
  const auto plain = [](const VecX& v) {
    return std::all_of(v.begin(), v.end(), [](Expr e) { return e.is_constant(); });
  };
  bool good = plain(A) && plain(C) && plain(D);
  for (const VecX& b : B) good = good && plain(b);
  for (const VecX& f : F) good = good && plain(f);
  return good;
}

Polynomials SymbolicPolynomials::values() const {
  const auto convert = [](const VecX& v) {
    return Vec(v.unaryExpr([](Expr e) { return constant_value(e); }));
  };
  Polynomials p;
  p.A = convert(A);
  p.C = convert(C);
  p.D = convert(D);
  for (const VecX& b : B) p.B.push_back(convert(b));
  for (const VecX& f : F) p.F.push_back(convert(f));
  return p;
}

std::string SymbolicPolynomials::class_name() const {
  const bool a = A.size() > 1, c = C.size() > 1, d = D.size() > 1;
  bool f = false;
  for (const VecX& each : F) f = f || each.size() > 1;
  if (!a && !c && !d) return f ? "OE" : B.empty() ? "white noise" : "FIR";
  if (!f && !c && !d) return B.empty() ? "AR" : "ARX";
  if (!f && !d) return B.empty() ? (a ? "ARMA" : "MA") : a ? "ARMAX" : "FIR with coloured noise";
  return a ? "polynomial" : "BJ";
}

namespace {

VecX product(const VecX& a, const VecX& b) {
  VecX c = VecX::Constant(a.size() + b.size() - 1, Expr(0));
  for (Index i = 0; i < a.size(); ++i)
    for (Index j = 0; j < b.size(); ++j) c[i + j] += a[i] * b[j];
  return c;
}

VecX difference(const VecX& a, const VecX& b) {
  VecX c = VecX::Constant(std::max(a.size(), b.size()), Expr(0));
  c.head(a.size()) = a;
  for (Index i = 0; i < b.size(); ++i) c[i] -= b[i];
  return c;
}

const VecX unity = VecX::Constant(1, Expr(1));

VecX other_denominators(const SymbolicPolynomials& p, std::size_t skip) {
  VecX f = unity;
  for (std::size_t i = 0; i < p.F.size(); ++i)
    if (i != skip && p.F[i].size() > 1) f = product(f, p.F[i]);
  return f;
}

void add_terms(Expr& sum, const VecX& coefficients, Index first, const std::string& signal, double sign) {
  for (Index k = first; k < coefficients.size(); ++k) {
    const Expr c = simplify(coefficients[k]);
    if (c.is_zero()) continue;
    sum = sign > 0 ? sum + c * at(signal, k) : sum - c * at(signal, k);
  }
}

}  // namespace

Predictor predictor(const SymbolicPolynomials& p, const std::vector<std::string>& inputs) {
  const VecX F = other_denominators(p, p.F.size());
  Expr sum(0);
  add_terms(sum, product(F, difference(p.C, product(p.A, p.D))), 1, "y", 1);
  for (std::size_t i = 0; i < p.B.size(); ++i)
    add_terms(sum, product(product(p.D, p.B[i]), other_denominators(p, i)), 0, inputs[i], 1);
  add_terms(sum, product(p.C, F), 1, "yhat", -1);
  std::vector<Expr> order;  // θ = [a  b  c  d  f], restricted to parameters in ŷ
  const std::vector<Expr> present = leaves({&sum, 1});
  const auto take = [&](const VecX& polynomial) {
    for (const Expr c : polynomial) {
      std::vector<Expr> here = leaves({&c, 1});
      std::sort(here.begin(), here.end(),
                [](Expr a, Expr b) { return symbol_of(a).name < symbol_of(b).name; });
      for (const Expr q : here)
        if (symbol_of(q).kind == Kind::parameter && std::find(order.begin(), order.end(), q) == order.end() &&
            std::find(present.begin(), present.end(), q) != present.end())
          order.push_back(q);
    }
  };
  take(p.A);
  for (const VecX& b : p.B) take(b);
  take(p.C);
  take(p.D);
  for (const VecX& f : p.F) take(f);
  return predictor(sum, std::move(order));
}

std::string derivation(const SymbolicPolynomials& p) {
  const bool a = p.A.size() > 1, c = p.C.size() > 1, d = p.D.size() > 1;
  std::string G, H = c ? "C" : "1";
  const std::string below = a && d ? "/(A D)" : a ? "/A" : d ? "/D" : "";
  bool f = false;
  for (const VecX& each : p.F) f = f || each.size() > 1;
  if (!p.B.empty()) G = a && f ? "B/(A F)" : a ? "B/A" : f ? "B/F" : "B";
  H += below;
  std::string left = text(c ? "C " : "", f ? "F " : "", "ŷ");
  std::string right = p.B.empty() ? "" : text(d ? "D " : "", "B u");
  std::string rest =
      text(c ? "C" : "1", " - ", a ? "A" : "", a && d ? " " : "", d ? "D" : "", !a && !d ? "1" : "");
  if (a || c || d) right += text(right.empty() ? "" : " + ", f ? "F " : "", "(", rest, ") y");
  return text("H ŷ = G u + (H - 1) y with ", G.empty() ? "" : "G = " + G + ", ", "H = ", H,
              "\n  multiplied out: ", left, " = ", right.empty() ? "0" : right);
}

std::string describe(const SymbolicPolynomials& p, const std::vector<std::string>& inputs) {
  const auto shown = [](const VecX& v) {
    Expr sum(0);
    std::string out;
    for (Index k = 0; k < v.size(); ++k) {
      const Expr c = simplify(v[k]);
      if (c.is_zero()) continue;
      std::string words = to_text(c);
      const bool compound = words.find(' ') != std::string::npos;
      bool minus = !compound && words[0] == '-';
      if (minus) words = words.substr(1);
      if (k > 0)
        words = (words == "1" ? ""
                 : compound   ? "(" + words + ") "
                              : words + " ") +
                "q" + superscript(-static_cast<long>(k));
      out += out.empty() ? (minus ? "-" : "") : minus ? " - " : " + ";
      out += words;
    }
    return out.empty() ? "0" : out;
  };
  std::string out = p.class_name() + " model";
  const auto line = [&](const std::string& name, const VecX& v, bool always) {
    if (always || v.size() > 1) out += text("\n  ", name, "(q) = ", shown(v));
  };
  line("A", p.A, false);
  for (std::size_t i = 0; i < p.B.size(); ++i) {
    const std::string k = p.B.size() > 1 ? subscript(static_cast<long>(i + 1)) : "";
    line("B" + k, p.B[i], true);
    line("F" + k, p.F[i], false);
  }
  line("C", p.C, false);
  line("D", p.D, false);
  if (p.B.size() > 1) out += text("\n  inputs ", join(inputs, ", "));
  return out;
}

}  // namespace pendula::sysid
