#include "lti/discrete.hpp"

#include <algorithm>
#include <cmath>

#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "lti/exponential.hpp"

namespace pendula::lti {
namespace {

MatX identity(Index n) { return MatX::Identity(n, n); }
MatX zeros_of(Index rows, Index cols) { return MatX::Zero(rows, cols); }

MatX chosen(const std::optional<MatX>& exact, const char* what) {
  if (!exact)
    throw Error(text(what, " of this symbolic system has no closed form; give values with G:with{ … }"));
  return *exact;
}

/// Can Mⁿ be 0? tr M = Σ λ and tr M² = Σ λ² exclude almost every other matrix at the cost of one product.
bool may_be_nilpotent(const MatX& M) {
  const dae::RationalMatrix m = rational(M);
  mpq_class trace = 0, squares = 0;
  for (int i = 0; i < m.rows(); ++i) {
    trace += m(i, i);
    for (int j = 0; j < m.cols(); ++j) squares += m(i, j) * m(j, i);
  }
  return trace == 0 && squares == 0;
}

/// e^{M Ts}: exact if M is nilpotent or something is symbolic, else in doubles.
MatX sampled_exponential(const MatX& M, Expr Ts) {
  if (field(M) == Field::symbolic || !Ts.is_constant())
    return chosen(transition(M, Ts), "the matrix exponential");
  if (field(M) == Field::exact && exact_value(Ts) && may_be_nilpotent(M)) {
    MatX power = M;
    for (Index k = 1; k < M.rows(); ++k) power = product(power, M);
    if (std::all_of(power.data(), power.data() + power.size(), [](Expr e) { return e.is_zero(); }))
      return chosen(transition(M, Ts), "the matrix exponential");
  }
  return expressions(linalg::exponential(Mat(numbers(M) * number(Ts))));
}

System with_hold(const System& g, Expr Ts, bool first_order) {
  const Index n = g.ss.order(), m = g.inputs;
  const Index size = n + m + (first_order ? m : 0);
  MatX M = zeros_of(size, size);
  M.topLeftCorner(n, n) = g.ss.A;
  M.block(0, n, n, m) = g.ss.B;
  if (first_order) M.block(n, n + m, m, m) = scaled(1 / Ts, identity(m));
  const MatX F = sampled_exponential(M, Ts);
  const MatX Phi = F.topLeftCorner(n, n), G1 = F.block(0, n, n, m);
  if (!first_order) return make_ss(Phi, G1, g.ss.C, g.ss.D, Ts);
  const MatX G2 = F.block(0, n + m, n, m);
  return make_ss(Phi, tidy(MatX(G1 + product(Phi, G2) - G2)), g.ss.C,
                 tidy(MatX(g.ss.D + product(g.ss.C, G2))), Ts);
}

/// D⁻¹ M D.
MatX in_units(MatX M, const Vec& d) {
  for (Index i = 0; i < M.rows(); ++i)
    for (Index j = 0; j < M.cols(); ++j)
      if (!M(i, j).is_zero()) M(i, j) = Expr(mpq_class(d[j] / d[i])) * M(i, j);
  return M;
}

/// M⁻¹, computed for the balanced matrix: the companion matrix of a transfer function in nanoseconds has
/// entries 1e9ⁿ apart.
std::optional<MatX> inverse(const MatX& M) {
  if (field(M) == Field::symbolic) return solve(M, identity(M.rows()));
  const Vec d = linalg::balancing(numbers(M));
  const auto back = solve(in_units(M, d), identity(M.rows()));
  if (!back) return {};
  return in_units(*back, d.cwiseInverse());
}

/// x₊ - x = h (A ((1-α) x + α x₊) + …): α = 0 Euler, 1/2 Tustin, 1 backward Euler.
System by_quadrature(const System& g, Expr Ts, Expr alpha, Expr h) {
  const Index n = g.ss.order();
  const auto back = inverse(identity(n) - scaled(alpha * h, g.ss.A));
  if (!back)
    throw Error(text("the method does not exist for this sampling time: I - ", pendula::to_text(alpha),
                     " Ts A is singular"));
  const MatX A = product(*back, identity(n) + scaled((1 - alpha) * h, g.ss.A)),
             B = scaled(h, product(*back, g.ss.B));
  return make_ss(tidy(A), tidy(B), tidy(product(g.ss.C, *back)),
                 tidy(MatX(g.ss.D + scaled(alpha, product(g.ss.C, B)))), Ts);
}

System by_impulse(const System& g, Expr Ts) {
  if (!std::all_of(g.ss.D.data(), g.ss.D.data() + g.ss.D.size(), [](Expr e) { return e.is_zero(); }))
    throw Error("\"impulse\" needs D = 0: the impulse response of this system begins with an impulse");
  const MatX Phi = sampled_exponential(g.ss.A, Ts);
  return make_ss(Phi, tidy(scaled(Ts, product(Phi, g.ss.B))), g.ss.C,
                 tidy(scaled(Ts, product(g.ss.C, g.ss.B))), Ts);
}

std::pair<Expr, Expr> sampled(const std::pair<Expr, Expr>& root, double Ts) {
  const Complex z = std::exp(Complex(number(root.first), number(root.second)) * Ts);
  return {Expr(z.real()), Expr(z.imag())};
}

/// Π (s - root)
Complex product_at(Complex s, const std::vector<std::pair<Expr, Expr>>& roots) {
  Complex p = 1;
  for (const auto& [re, im] : roots) p *= s - Complex(number(re), number(im));
  return p;
}

/// Maps every pole and zero to e^{s Ts}, and all but one of the zeros at infinity to -1; the gain is that of
/// G at s = 0, or at the first multiple of 0.1/Ts that is neither pole nor zero (Franklin, Powell & Workman,
/// Digital Control of Dynamic Systems, 3rd ed., §6.2).
System by_matching(const System& given, double Ts) {
  if (!given.siso()) throw Error("\"matched\" is for one input and one output; choose G:channel(i, j)");
  const Factored f = to_zpk(with_numbers(given)).zpk[0];
  if (f.zeros.size() > f.poles.size()) throw Error("\"matched\" needs at least as many poles as zeros");
  Factored h;
  for (const auto& z : f.zeros) h.zeros.push_back(sampled(z, Ts));
  for (const auto& p : f.poles) h.poles.push_back(sampled(p, Ts));
  for (std::size_t k = f.zeros.size() + 1; k < f.poles.size(); ++k) h.zeros.emplace_back(-1, 0);
  double s = 0;
  const auto is_root = [&](double at) {
    return std::abs(product_at(at, f.zeros)) == 0 || std::abs(product_at(at, f.poles)) == 0;
  };
  while (is_root(s)) s += 0.1 / Ts;  // any other point, well inside the frequencies that the samples show
  const double z = std::exp(s * Ts);
  const Complex gain = number(f.gain) * product_at(s, f.zeros) / product_at(s, f.poles) *
                       product_at(z, h.poles) / product_at(z, h.zeros);
  h.gain = Expr(gain.real());
  System out = make_zpk({h}, 1, 1, Expr(Ts));
  out.input_names = given.input_names;
  out.output_names = given.output_names;
  if (given.form == Form::zpk) return out;
  System converted = given.form == Form::tf ? to_tf(out) : to_ss(out);
  converted.input_names = given.input_names;
  converted.output_names = given.output_names;
  return converted;
}

/// Every pulse train Ts g(k Ts) with G proper has the factor z (partial fractions give z/(z - e^{p Ts})); any
/// other last coefficient of a numerator is a rounding error.
System with_zeros_at_the_origin(System h) {
  for (Fraction& f : h.tf)
    if (!f.num.empty()) {
      f.num.front() = 0;
      f.num = tidy(std::move(f.num));
    }
  return h;
}

System named_like(System h, const System& g) {
  h.state_names = g.state_names;
  h.input_names = g.input_names;
  h.output_names = g.output_names;
  if (g.form != Form::ss) {
    h.state_names.clear();
    h = to_tf(h);
  }
  if (g.form == Form::zpk) h = to_zpk(h);
  return h;
}

/// Do all parameters have default values?
bool has_values(const System& g) {
  const std::vector<Expr> all = entries(g);
  const auto list = leaves(all);
  return std::all_of(list.begin(), list.end(), [](Expr leaf) { return symbol_of(leaf).value.has_value(); });
}

/// log(I + N) = N - N²/2 + … for nilpotent N; otherwise empty.
std::optional<MatX> unipotent_logarithm(const MatX& M) {
  const Index n = M.rows();
  const MatX N = tidy(MatX(M - identity(n)));
  MatX power = identity(n), total = zeros_of(n, n);
  for (Index k = 1; k <= n; ++k) {
    power = tidy(product(power, N));
    if (std::all_of(power.data(), power.data() + power.size(), [](Expr e) { return e.is_zero(); }))
      return total;
    total += scaled(Expr(mpq_class(k % 2 ? 1 : -1, static_cast<unsigned long>(k))), power);
  }
  return {};
}

/// Sets entries to 0 that are rounding errors: small after balancing L.
Mat without_rounding(Mat L) {
  const Vec d = linalg::balancing(L);
  const Vec inverse = d.cwiseInverse();
  const Mat balanced = inverse.asDiagonal() * L * d.asDiagonal();
  const double rounding = 64 * eps * balanced.lpNorm<Eigen::Infinity>();  // of a logarithm: a choice
  return (balanced.array().abs() <= rounding).select(0, L);
}

System from_hold(const System& g) {
  const Index n = g.ss.order(), m = g.inputs;
  const MatX M = vstack(hstack(g.ss.A, g.ss.B), hstack(zeros_of(m, n), identity(m)));
  MatX log;
  if (const auto exact = field(M) == Field::numeric ? std::nullopt : unipotent_logarithm(M)) {
    log = scaled(1 / g.Ts, *exact);
  } else {
    if (field(M) == Field::symbolic || !g.Ts.is_constant())
      throw Error("the logarithm needs numbers; give values with G:with{ … }");
    try {
      log = expressions(without_rounding(linalg::logarithm(numbers(M)) / number(g.Ts)));
    } catch (const Error& e) {
      throw Error(text("no continuous system of this order gives these samples with inputs held constant: ",
                       e.what(), "; d2c(G, \"tustin\") always works unless -1 is a pole"));
    }
  }
  return make_ss(tidy(MatX(log.topLeftCorner(n, n))), tidy(MatX(log.block(0, n, n, m))), g.ss.C, g.ss.D);
}

System from_tustin(const System& g) {
  const Index n = g.ss.order();
  const auto half = inverse(g.ss.A + identity(n));
  if (!half) throw Error("z = -1 is a pole: s = 2/Ts (z-1)/(z+1) is infinite there");
  const Expr h = g.Ts;
  const MatX ima = scaled(2, *half);  // I - h/2 A
  const MatX A = scaled(2 / h, product(*half, MatX(g.ss.A - identity(n)))),
             B = scaled(1 / h, product(ima, g.ss.B));
  const MatX C = product(g.ss.C, ima);
  return make_ss(tidy(A), tidy(B), tidy(C),
                 tidy(MatX(g.ss.D - scaled(Expr(mpq_class(1, 2)), product(C, g.ss.B)))));
}

}  // namespace

const std::vector<std::string>& sampling_methods() {
  static const std::vector<std::string> list = {"zoh",   "foh",      "tustin",  "bilinear",
                                                "euler", "backward", "impulse", "matched"};
  return list;
}

System c2d(const System& given, Expr Ts, const std::string& method, double prewarp) {
  if (!given.continuous())
    throw Error(text(
        "the system is discrete already, with the sampling time ",
        given.Ts.is_constant() ? pendula::rounded(constant_value(given.Ts)) : pendula::to_text(given.Ts)));
  if (Ts.is_constant() && !(constant_value(Ts) > 0))
    throw Error(text("the sampling time must be positive, got Ts = ", pendula::to_text(Ts)));
  if (method == "matched") return by_matching(given, number(Ts));
  const System g = to_ss(given);
  const Expr half = Expr(mpq_class(1, 2));
  if (method == "zoh" || method == "foh") {
    if (field(g.ss.A) == Field::symbolic && Ts.is_constant() && has_values(g) && !transition(g.ss.A, Ts)) {
      System h = named_like(with_hold(with_numbers(g), Ts, method == "foh"), given);
      h.notes.push_back("with the default values of the parameters");
      return h;
    }
    return named_like(with_hold(g, Ts, method == "foh"), given);
  }
  if (method == "tustin" || method == "bilinear") {
    const Expr h = prewarp > 0 ? Expr(2 / prewarp * std::tan(prewarp * number(Ts) / 2)) : Ts;
    return named_like(by_quadrature(g, Ts, half, h), given);
  }
  if (method == "euler") return named_like(by_quadrature(g, Ts, 0, Ts), given);
  if (method == "backward") return named_like(by_quadrature(g, Ts, 1, Ts), given);
  if (method == "impulse") {
    const System h = by_impulse(g, Ts);
    if (given.form == Form::ss) return named_like(h, given);
    return named_like(with_zeros_at_the_origin(to_tf(h)), given);
  }
  throw Error(text("unknown method '", method, "'.", did_you_mean(method, sampling_methods()),
                   " (methods: ", join(sampling_methods(), ", "), ")"));
}

System d2c(const System& given, const std::string& method) {
  if (given.continuous()) throw Error("the system is continuous already");
  const System g = to_ss(given);
  if (method == "zoh") return named_like(from_hold(g), given);
  if (method == "tustin" || method == "bilinear") return named_like(from_tustin(g), given);
  throw Error(text("unknown method '", method, "' (methods: zoh, tustin)"));
}

}  // namespace pendula::lti
