#include "lti/system.hpp"

#include <algorithm>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/limits/stack.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::lti {
namespace {

std::string size(const MatX& m) { return text(m.rows(), "×", m.cols()); }

void check_sampling(Expr Ts) {
  if (Ts.is_constant() && constant_value(Ts) < 0)
    throw Error(text("the sampling time must be positive, got Ts = ", to_text(Ts),
                     "; without it time is continuous"));
  // squares of Ts and of 1/Ts are within the range of doubles
  if (Ts.is_constant() && !Ts.is_zero() && !(constant_value(Ts) > 1e-150 && constant_value(Ts) < 1e150))
    throw Error(text("the sampling time must lie between 1e-150 and 1e150 seconds, got Ts = ", to_text(Ts)));
}

std::string name_or(const std::vector<std::string>& names, int i, const char* letter, int count) {
  if (static_cast<std::size_t>(i) < names.size()) return names[i];
  return count == 1 ? letter : letter + subscript(i + 1);
}

/// Reads a rational function, node by node.
class FractionReader {
 public:
  explicit FractionReader(Expr s) : s_(s) {}
  Fraction read(Expr e) const {
    check_stack();
    if (e == s_) return {{0, 1}, {1}};
    if (!depends_on(e, s_)) return {e.is_zero() ? Polynomial{} : Polynomial{e}, {1}};
    switch (e.op()) {
      case Op::add:
        return sum(read(e.operand(0)), read(e.operand(1)));
      case Op::sub:
        return sum(read(e.operand(0)), negated(read(e.operand(1))));
      case Op::neg:
        return negated(read(e.operand(0)));
      case Op::mul:
        return product(read(e.operand(0)), read(e.operand(1)));
      case Op::div:
        return product(read(e.operand(0)), turned(read(e.operand(1))));
      case Op::pow: {
        // of s: more is a mistake in writing; 40 states are the limit of use
        constexpr int largest_power = 100;
        const mpq_class* n = exact_value(e.operand(1));
        if (!n || n->get_den() != 1 || abs(*n) > largest_power) break;
        const int k = static_cast<int>(n->get_num().get_si());
        const Fraction base = k < 0 ? turned(read(e.operand(0))) : read(e.operand(0));
        return {lti::power(base.num, std::abs(k)), lti::power(base.den, std::abs(k))};
      }
      default:
        break;
    }
    throw Error(text(to_text(e), " is not a rational function of ", to_text(s_)));
  }

 private:
  static Fraction negated(Fraction f) { return {scaled(-1, f.num), f.den}; }
  static Fraction turned(Fraction f) {
    if (f.num.empty()) throw Error("division by zero in the transfer function");
    return {f.den, f.num};
  }
  Expr s_;
};

}  // namespace

System make_ss(MatX A, MatX B, MatX C, MatX D, Expr Ts) {
  check_sampling(Ts);
  if (A.rows() != A.cols()) throw Error(text("A must be square, but it is ", size(A)));
  if (B.rows() != A.rows())
    throw Error(text("B must have as many rows as A: A is ", size(A), ", B is ", size(B)));
  if (C.cols() != A.cols())
    throw Error(text("C must have as many columns as A: A is ", size(A), ", C is ", size(C)));
  if (D.rows() != C.rows() || D.cols() != B.cols())
    throw Error(text("D must be ", C.rows(), "×", B.cols(), " (outputs × inputs), but it is ", size(D)));
  System g;
  g.outputs = static_cast<int>(D.rows());
  g.inputs = static_cast<int>(D.cols());
  g.ss = {std::move(A), std::move(B), std::move(C), std::move(D)};
  g.Ts = Ts;
  return g;
}

System make_tf(std::vector<Fraction> entries, int outputs, int inputs, Expr Ts) {
  check_sampling(Ts);
  PENDULA_ASSERT(static_cast<int>(entries.size()) == outputs * inputs,
                 "a matrix of fractions of another size");
  System g;
  g.form = Form::tf;
  g.outputs = outputs;
  g.inputs = inputs;
  g.Ts = Ts;
  for (Fraction& f : entries) {
    f.num = tidy(std::move(f.num));
    f.den = tidy(std::move(f.den));
    if (f.den.empty()) throw Error("the denominator is zero");
    if (f.num.empty()) f.den = {1};
  }
  g.tf = std::move(entries);
  return g;
}

System make_zpk(std::vector<Factored> entries, int outputs, int inputs, Expr Ts) {
  check_sampling(Ts);
  System g;
  g.form = Form::zpk;
  g.outputs = outputs;
  g.inputs = inputs;
  g.Ts = Ts;
  for (const Factored& f : entries)
    for (const auto& [what, list] : {std::pair{"zero", &f.zeros}, std::pair{"pole", &f.poles}}) {
      std::vector<std::pair<Expr, Expr>> open;  // without a partner so far
      for (const auto& root : *list) {
        if (root.second.is_zero()) continue;
        const auto partner = std::find_if(open.begin(), open.end(), [&](const auto& o) {
          return o.first == root.first && (o.second + root.second).is_zero();
        });
        if (partner == open.end())
          open.push_back(root);
        else
          open.erase(partner);
      }
      if (!open.empty())
        throw Error(text("the complex ", what, " with real part ", to_text(open[0].first),
                         " and imaginary part ", to_text(open[0].second),
                         " needs its conjugate in the list, too"));
    }
  g.zpk = std::move(entries);
  return g;
}

System make_gain(const MatX& D, Expr Ts) {
  return make_ss(MatX::Zero(0, 0), MatX::Zero(0, D.cols()), MatX::Zero(D.rows(), 0), D, Ts);
}

Fraction fraction_of(Expr e, Expr s) { return FractionReader(s).read(e); }

std::string state_name(const System& g, int i) { return name_or(g.state_names, i, "x", g.ss.order()); }
std::string input_name(const System& g, int j) { return name_or(g.input_names, j, "u", g.inputs); }
std::string output_name(const System& g, int i) { return name_or(g.output_names, i, "y", g.outputs); }

std::vector<Expr> entries(const System& g) {
  std::vector<Expr> all;
  const auto add = [&](const auto& list) { all.insert(all.end(), list.data(), list.data() + list.size()); };
  add(g.ss.A);
  add(g.ss.B);
  add(g.ss.C);
  add(g.ss.D);
  for (const Fraction& f : g.tf) {
    add(f.num);
    add(f.den);
  }
  for (const Factored& f : g.zpk) {
    all.push_back(f.gain);
    for (const auto* list : {&f.zeros, &f.poles})
      for (const auto& [re, im] : *list) {
        all.push_back(re);
        all.push_back(im);
      }
  }
  if (!g.continuous()) all.push_back(g.Ts);
  return all;
}

Field field(const System& g) { return field(std::span<const Expr>(entries(g))); }

namespace {

/// The system with every entry replaced, in the order of entries().
System rebuilt(System g, const std::vector<Expr>& values) {
  std::size_t at = 0;
  for (MatX* m : {&g.ss.A, &g.ss.B, &g.ss.C, &g.ss.D})
    for (Index k = 0; k < m->size(); ++k) m->data()[k] = values[at++];
  for (Fraction& f : g.tf) {
    for (Polynomial* p : {&f.num, &f.den})
      for (Expr& c : *p) c = values[at++];
    f.num = tidy(f.num);
    f.den = tidy(f.den);
    if (f.den.empty()) throw Error("with these values the denominator is zero");
  }
  for (Factored& f : g.zpk) {
    f.gain = values[at++];
    for (auto* list : {&f.zeros, &f.poles})
      for (auto& [re, im] : *list) {
        re = values[at];
        im = values[at + 1];
        at += 2;
      }
  }
  if (!g.continuous()) g.Ts = values[at++];
  return g;
}

}  // namespace

System substitute(const System& g, const Substitution& values) {
  std::vector<Expr> all = pendula::substitute(entries(g), values);
  for (Expr& e : all)
    if (!e.is_constant() && !e.is_symbol()) e = simplify(e);
  return rebuilt(g, all);
}

System with_numbers(const System& g) {
  const std::vector<Expr> all = entries(g);
  if (field(std::span<const Expr>(all)) != Field::symbolic) return g;
  Substitution values = defaults(all);
  for (auto& [leaf, v] : values)
    if (symbol_of(leaf).kind == Kind::constant)
      v = leaf;  // sin(π) is not sin(3.14…): simplify first, then round
  System h = substitute(g, values);
  std::vector<Expr> exact = entries(h);
  for (Expr& e : exact)
    if (!e.is_constant()) e = Expr(number(e));
  return rebuilt(std::move(h), exact);
}

// ── values ──

MatX value(const System& g, Expr s) {
  const System f = to_tf(g);
  MatX values(g.outputs, g.inputs);
  for (int i = 0; i < g.outputs; ++i)
    for (int j = 0; j < g.inputs; ++j) {
      const Expr below = expression(f.fraction(i, j).den, s);
      if (below.is_zero())
        throw Error(text(g.variable(), " = ", to_text(s), " is a pole: the value is infinite"));
      values(i, j) = expression(f.fraction(i, j).num, s) / below;
    }
  return values;
}

ComplexMat value(const System& given, Complex s) {
  const System g = with_numbers(given);
  ComplexMat values(g.outputs, g.inputs);
  if (g.form == Form::ss) {
    const ComplexMat m =
        s * ComplexMat::Identity(g.ss.order(), g.ss.order()) - numbers(g.ss.A).cast<Complex>();
    values = numbers(g.ss.D).cast<Complex>();
    if (g.ss.order() > 0)
      values += ComplexMat(numbers(g.ss.C).cast<Complex>()) *
                ComplexMat(m.partialPivLu().solve(ComplexMat(numbers(g.ss.B).cast<Complex>())));
  } else {
    const System f = to_tf(g);
    for (int i = 0; i < g.outputs; ++i)
      for (int j = 0; j < g.inputs; ++j)
        values(i, j) = value(numbers(f.fraction(i, j).num), s) / value(numbers(f.fraction(i, j).den), s);
  }
  if (!values.allFinite())
    throw Error(text(g.variable(), " = ", pendula::rounded(s.real()), s.imag() < 0 ? " - " : " + ",
                     pendula::rounded(std::abs(s.imag())), " i is a pole: the value is infinite"));
  return values;
}

MatX dcgain(const System& g) {
  const Expr at = g.continuous() ? 0 : 1;
  if (g.form == Form::ss) {
    MatX m = g.continuous() ? scaled(-1, g.ss.A) : MatX(MatX::Identity(g.ss.order(), g.ss.order()) - g.ss.A);
    if (const auto x = solve(m, g.ss.B)) return tidy(product(g.ss.C, *x) + g.ss.D);
  }
  const System f = to_tf(g);
  MatX values(g.outputs, g.inputs);
  for (int i = 0; i < g.outputs; ++i)
    for (int j = 0; j < g.inputs; ++j) {
      const Fraction c = cancelled(f.fraction(i, j));
      const Expr below = simplify(expression(c.den, at));
      if (below.is_zero())
        throw Error(text("the static gain",
                         g.siso() ? "" : text(" from ", input_name(g, j), " to ", output_name(g, i)),
                         " is infinite: there is a pole at ", g.variable(), " = ", to_text(at),
                         g.continuous() ? " (an integrator)" : ""));
      values(i, j) = simplify(expression(c.num, at) / below);
    }
  return values;
}

}  // namespace pendula::lti
