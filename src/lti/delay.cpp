#include "lti/delay.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/counted.hpp"
#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/limits/stack.hpp"
#include "base/text.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "lti/structure.hpp"

namespace pendula::lti {
namespace {

/// Closes u = F y + E v around h and solves for y as a function of v.
System interconnected(const System& given, const MatX& F, const MatX& E) {
  const System h = to_ss(given);
  const MatX I = MatX::Identity(h.outputs, h.outputs);
  const auto inverse = solve(I - product(h.ss.D, F), I);
  if (!inverse) throw Error("algebraic loop: a loop without delay has gain 1");
  const MatX C = product(*inverse, h.ss.C);  // y = C x + D v
  const MatX D = product(*inverse, product(h.ss.D, E));
  const MatX A = h.ss.A + product(h.ss.B, product(F, C));
  const MatX B = product(h.ss.B, MatX(product(F, D) + E));
  return make_ss(tidy(A), tidy(B), tidy(C), tidy(D));
}

DelaySystem as_general(const DelaySystem& g) {
  if (!g.delays.empty()) return general(g);
  return {to_ss(g.core), {}, false};
}

/// Offsets of the channels after appending [a; b]: a's outer, a's inner, b's outer, b's inner.
struct Layout {
  int outer_a, inner_a, outer_b, inner_b;
  int a(int i) const { return i; }
  int za(int i) const { return outer_a + i; }
  int b(int i) const { return outer_a + inner_a + i; }
  int zb(int i) const { return outer_a + inner_a + outer_b + i; }
  int size() const { return outer_a + inner_a + outer_b + inner_b; }
};

/// Both systems combined, with u = F y + E v for their outer inputs and the outer outputs M y; v are the
/// inputs of the result.
DelaySystem combined(
    const DelaySystem& ga, const DelaySystem& gb, int inputs,
    const std::function<void(MatX& F, MatX& E, MatX& M, const Layout& in, const Layout& out)>& wire,
    int outputs) {
  const DelaySystem a = as_general(ga), b = as_general(gb);
  const Layout in{a.inputs(), a.inner(), b.inputs(), b.inner()},
      out{a.outputs(), a.inner(), b.outputs(), b.inner()};
  const int k = a.inner() + b.inner();
  MatX F = MatX::Zero(in.size(), out.size());
  MatX E = MatX::Zero(in.size(), inputs + k);
  MatX M = MatX::Zero(outputs + k, out.size());
  wire(F, E, M, in, out);
  for (int i = 0; i < a.inner(); ++i) E(in.za(i), inputs + i) = M(outputs + i, out.za(i)) = 1;
  for (int i = 0; i < b.inner(); ++i)
    E(in.zb(i), inputs + a.inner() + i) = M(outputs + a.inner() + i, out.zb(i)) = 1;
  const System h = interconnected(append(a.core, b.core), F, E);
  DelaySystem g;
  g.core = make_ss(h.ss.A, h.ss.B, tidy(product(M, h.ss.C)), tidy(product(M, h.ss.D)));
  g.delays = a.delays;
  g.delays.insert(g.delays.end(), b.delays.begin(), b.delays.end());
  return g;
}

bool plain(const DelaySystem& g) { return g.product || g.delays.empty(); }
double total(const DelaySystem& g) { return g.delays.empty() ? 0 : g.delays[0]; }

DelaySystem made(System core, double delay) {
  DelaySystem g{std::move(core), {}, delay > 0};
  if (delay > 0) g.delays = {delay};
  return g;
}

}  // namespace

DelaySystem general(const DelaySystem& g) {
  if (!g.product) return g;
  const System a = to_ss(g.core);
  const int m = a.inputs, p = a.outputs, n = a.ss.order();
  DelaySystem out;
  out.delays.assign(static_cast<std::size_t>(m), g.delays.empty() ? 0 : g.delays[0]);
  const auto zero = [](int rows, int cols) { return MatX(MatX::Zero(rows, cols)); };
  const MatX B = hstack(zero(n, m), a.ss.B);
  const MatX C = vstack(a.ss.C, zero(m, n));
  const MatX D = vstack(hstack(zero(p, m), a.ss.D), hstack(MatX(MatX::Identity(m, m)), zero(m, m)));
  out.core = make_ss(a.ss.A, B, C, D);
  return out;
}

DelaySystem delayed(System g, double delay) {
  if (!g.continuous())
    throw Error("in discrete time a delay of d samples is 1/z^d: multiply by tf({1}, {1, 0}, Ts)^d");
  if (!(delay >= 0) || !std::isfinite(delay))
    throw Error(text("a delay must not be negative, got ", pendula::rounded(delay, 6), " s"));
  return made(std::move(g), delay);
}

DelaySystem exponential_of(const System& g) {
  if (!g.continuous() || !g.siso())
    throw Error("exp of a system is e^{-T s} only: exp(-T*s) with s = tf \"s\"");
  const System f = to_tf(g);
  const Polynomial &num = f.tf[0].num, &den = f.tf[0].den;
  if (degree(den) != 0 || degree(num) > 1)
    throw Error("exp of a system is e^{-T s} only: exp(-T*s) with s = tf \"s\" and a number T");
  const double unit = number(den[0]);
  const double slope = degree(num) == 1 ? number(num[1]) / unit : 0;
  if (slope > 0)
    throw Error(
        text("exp(", pendula::rounded(slope, 6), " s) is not causal: a delay is exp(-T*s) with T > 0"));
  const Expr gain = num.empty() || num[0].is_zero() ? Expr(1) : Expr(std::exp(number(num[0]) / unit));
  return made(make_tf({{{gain}, {1}}}, 1, 1), -slope);
}

bool has_delay(Expr e, Expr s) {
  check_stack();
  if (e.op() == Op::exp && depends_on(e, s)) return true;
  const auto parts = e.operands();
  return std::any_of(parts.begin(), parts.end(), [&](Expr part) { return has_delay(part, s); });
}

DelaySystem delay_system_of(Expr e, Expr s) {
  if (!has_delay(e, s)) return made(make_tf({fraction_of(e, s)}, 1, 1), 0);
  const auto part = [&](int i) { return delay_system_of(e.operand(i), s); };
  switch (e.op()) {
    case Op::exp:
      return exponential_of(make_tf({fraction_of(e.operand(0), s)}, 1, 1));
    case Op::add:
      return parallel(part(0), part(1));
    case Op::sub:
      return parallel(part(0), negative(part(1)));
    case Op::mul:
      return series(part(0), part(1));
    case Op::div:
      return series(part(0), inverse(part(1)));
    case Op::neg:
      return negative(part(0));
    default:
      throw Error(
          text("a transfer function is a rational function of s and delays exp(-T*s), not ", to_text(e)));
  }
}

DelaySystem series(const DelaySystem& second, const DelaySystem& first) {
  if (plain(second) && plain(first))
    return made(series(second.core, first.core), total(second) + total(first));
  if (second.inputs() != first.outputs()) throw Error("the numbers of channels differ");
  return combined(
      first, second, first.inputs(),
      [&](MatX& F, MatX& E, MatX& M, const Layout& in, const Layout& out) {
        for (int i = 0; i < first.inputs(); ++i) E(in.a(i), i) = 1;
        for (int i = 0; i < second.inputs(); ++i) F(in.b(i), out.a(i)) = 1;
        for (int i = 0; i < second.outputs(); ++i) M(i, out.b(i)) = 1;
      },
      second.outputs());
}

DelaySystem parallel(const DelaySystem& a, const DelaySystem& b) {
  if (plain(a) && plain(b) && total(a) == total(b)) return made(parallel(a.core, b.core), total(a));
  if (a.inputs() != b.inputs() || a.outputs() != b.outputs()) throw Error("the numbers of channels differ");
  return combined(
      a, b, a.inputs(),
      [&](MatX&, MatX& E, MatX& M, const Layout& in, const Layout& out) {
        for (int i = 0; i < a.inputs(); ++i) E(in.a(i), i) = E(in.b(i), i) = 1;
        for (int i = 0; i < a.outputs(); ++i) M(i, out.a(i)) = M(i, out.b(i)) = 1;
      },
      a.outputs());
}

DelaySystem negative(DelaySystem g) {
  return series(made(make_gain(scaled(-1, MatX::Identity(g.outputs(), g.outputs()))), 0), g);
}

DelaySystem feedback(const DelaySystem& g1, const DelaySystem& g2, int sign) {
  if (g2.inputs() != g1.outputs() || g2.outputs() != g1.inputs())
    throw Error(
        "the system in the feedback path must have as many inputs as the other one outputs, and the reverse");
  return combined(
      g1, g2, g1.inputs(),
      [&](MatX& F, MatX& E, MatX& M, const Layout& in, const Layout& out) {
        for (int i = 0; i < g1.inputs(); ++i) {
          E(in.a(i), i) = 1;
          F(in.a(i), out.b(i)) = sign;
        }
        for (int i = 0; i < g2.inputs(); ++i) F(in.b(i), out.a(i)) = 1;
        for (int i = 0; i < g1.outputs(); ++i) M(i, out.a(i)) = 1;
      },
      g1.outputs());
}

DelaySystem inverse(const DelaySystem& g) {
  if (!g.delays.empty())
    throw Error("the inverse of a delay is not causal; a quotient needs a divisor without delay");
  return made(inverse(g.core), 0);
}

// ── frequency ──

ComplexMat value(const DelaySystem& g, Complex s) {
  const ComplexMat G = value(g.core, s);
  if (g.delays.empty()) return G;
  if (g.product) return G * std::exp(-g.delays[0] * s);
  const int m = g.inputs(), p = g.outputs(), k = g.inner();
  ComplexVec theta(k);
  for (int i = 0; i < k; ++i) theta[i] = std::exp(-g.delays[i] * s);
  const ComplexMat inner = ComplexMat::Identity(k, k) - G.bottomRightCorner(k, k) * theta.asDiagonal();
  return G.topLeftCorner(p, m) +
         G.topRightCorner(p, k) * theta.asDiagonal() *
             ComplexMat(inner.partialPivLu().solve(ComplexMat(G.bottomLeftCorner(k, m))));
}

FrequencyResponse frequency_response(const DelaySystem& g, const Vec& w) {
  FrequencyResponse r;
  if (plain(g)) {
    r = frequency_response(g.core, w);
    for (ComplexVec& channel : r.G)
      for (Index k = 0; k < w.size(); ++k) channel[k] *= std::polar(1.0, -w[k] * total(g));
    r.delay = total(g);
    r.delayed = true;
    return r;
  }
  System shape = make_gain(MatX::Zero(g.outputs(), g.inputs()));
  r.system = std::make_shared<const System>(std::move(shape));
  r.w = w;
  r.delayed = true;
  r.sheet_known = false;
  r.G.assign(static_cast<std::size_t>(g.inputs() * g.outputs()), ComplexVec(w.size()));
  for (Index k = 0; k < w.size(); ++k) {
    const ComplexMat v = value(g, Complex(0, w[k]));
    for (int i = 0; i < g.outputs(); ++i)
      for (int j = 0; j < g.inputs(); ++j) r.G[i * g.inputs() + j][k] = v(i, j);
  }
  return r;
}

Vec bode_frequencies(const DelaySystem& g) {
  const Vec base = bode_frequencies(g.core);
  const double longest = g.delays.empty() ? 0 : *std::max_element(g.delays.begin(), g.delays.end());
  double low = base[0], high = base[base.size() - 1];
  if (longest > 0) {
    low = std::min(low, 0.01 / longest);         // there a delay turns the phase by 0.6°
    high = std::max(high, 20 * M_PI / longest);  // there by ten turns
  }
  const Index count = 600;  // three per dot column of a wide terminal
  return Vec::LinSpaced(count, std::log10(low), std::log10(high)).unaryExpr([](double v) {
    return std::pow(10, v);
  });
}

namespace {

/// A grid of ω from low to high on which the argument of f changes by less than 0.3 per step.
std::vector<double> following(const std::function<Complex(double)>& f, double low, double high) {
  // A crossing is missed if the argument turns by more than π between two points: a tenth of that, as it may
  // turn faster ahead. ω grows by 2 % at most; at 10⁻⁷ a jump, as at a pole on the axis, is stepped over.
  constexpr double turn = 0.3, longest = 1.02, shortest = 1e-7, growth = 1.5;
  constexpr std::size_t most_points = 200000;  // 0.3 rad each: ten thousand turns
  std::vector<double> out{low};
  double step = longest;
  Complex last = f(low);
  while (out.back() < high && out.size() < most_points) {
    const double w = std::min(high, out.back() * step);
    const Complex now = f(w);
    if (std::abs(std::arg(now / last)) > turn && step > 1 + shortest) {
      step = 1 + (step - 1) / 2;
      continue;
    }
    out.push_back(w);
    last = now;
    step = std::min(longest, 1 + (step - 1) * growth);
  }
  return out;
}

/// A zero of f, which has different signs at a and b.
double zero_between(const std::function<double(double)>& f, double a, double b) {
  const double sign = f(a) < 0 ? -1 : 1;
  constexpr int most = 80;  // of an interval of 2 % at most: to the last bit, after 47 halvings
  for (int k = 0; k < most; ++k) {
    const double c = std::sqrt(a * b);
    (f(c) * sign > 0 ? a : b) = c;
  }
  return std::sqrt(a * b);
}

/// Numbers of poles of the rational part in the right half-plane and at 0; loops with delays
/// have infinitely many.
std::pair<int, int> open_loop_poles(const DelaySystem& g) {
  constexpr double on_axis = 1e-9;  // computed poles err by more than ε
  int right = 0, origin = 0;
  for (const dae::Mode& m : poles(g.core)) {
    if (std::abs(m.value) < on_axis)
      origin += m.multiplicity;
    else if (m.value.real() > on_axis * std::abs(m.value))
      right += m.multiplicity;
  }
  return {right, origin};
}

}  // namespace

Margins margins(const DelaySystem& g) {
  if (g.inputs() != 1 || g.outputs() != 1)
    throw Error("margins are for one input and one output; choose a channel with G:channel(i, j)");
  const auto at = [&](double w) { return value(g, Complex(0, w))(0, 0); };
  const Vec base = bode_frequencies(g);
  // choices: three decades below the plotted range, and above it until |G| has left 1, eight decades at most
  const double low = 1e-3 * base[0];
  double high = base[base.size() - 1];
  for (int k = 0; k < 8 && std::abs(at(high)) > 0.5; ++k) high *= 10;
  const auto grid = following([&](double w) { return at(w); }, low, high);
  const auto size = [&](double w) { return std::log(std::abs(at(w))); };
  const auto side = [&](double w) { return at(w).imag(); };
  Margins m;
  for (std::size_t k = 0; k + 1 < grid.size(); ++k) {
    const Complex a = at(grid[k]), b = at(grid[k + 1]);
    if ((a.imag() < 0) != (b.imag() < 0) && a.real() + b.real() < 0) {
      const double w = zero_between(side, grid[k], grid[k + 1]);
      const double margin = 1 / std::abs(at(w));
      if (!m.gain || std::abs(std::log(margin)) < std::abs(std::log(*m.gain))) {
        m.gain = margin;
        m.gain_at = w;
      }
    }
    if ((std::abs(a) < 1) != (std::abs(b) < 1)) {
      const double w = zero_between(size, grid[k], grid[k + 1]);
      double margin = std::fmod(180 + std::arg(at(w)) * 180 / M_PI, 360);
      if (margin > 180) margin -= 360;
      if (!m.phase || std::abs(margin) < std::abs(*m.phase)) {
        m.phase = margin;
        m.phase_at = w;
      }
    }
  }
  if (!plain(g)) return m;  // inner loops have poles of their own
  const auto [right, origin] = open_loop_poles(g);
  const auto loop = [&](double w) { return 1.0 + at(w); };
  const auto path = following(loop, low, high);
  double turned = 0;
  for (std::size_t k = 0; k + 1 < path.size(); ++k) turned += std::arg(loop(path[k + 1]) / loop(path[k]));
  m.closed_loop_stable = std::abs(turned - M_PI * (right + 0.5 * origin)) < 0.5;
  return m;
}

// ── other forms ──

System rational(const DelaySystem& g, int order) {
  if (g.delays.empty()) return g.core;
  const auto approximant = [&](double T) {
    std::vector<Expr> num, den;
    double c = 1;
    for (int k = 0; k <= order; ++k) {
      if (k > 0) c *= static_cast<double>(order - k + 1) / static_cast<double>((2 * order - k + 1) * k);
      const double term = c * std::pow(T, k);
      den.push_back(Expr(term));
      num.push_back(Expr(k % 2 == 1 ? -term : term));
    }
    return make_tf({{num, den}}, 1, 1);
  };
  if (g.product && g.core.siso()) return series(approximant(g.delays[0]), g.core);
  const DelaySystem all = general(g);
  System theta = to_ss(approximant(all.delays[0]));
  for (std::size_t i = 1; i < all.delays.size(); ++i)
    theta = append(theta, to_ss(approximant(all.delays[i])));
  const int m = all.inputs(), p = all.outputs(), k = all.inner();
  // [y; z] = G [u; w], w = Θ z
  MatX F = MatX::Zero(m + 2 * k, p + 2 * k);
  MatX E = MatX::Zero(m + 2 * k, m);
  for (int i = 0; i < m; ++i) E(i, i) = 1;
  for (int i = 0; i < k; ++i) {
    F(m + i, p + k + i) = 1;
    F(m + k + i, p + i) = 1;
  }
  const System h = interconnected(append(all.core, theta), F, E);
  return make_ss(h.ss.A, h.ss.B, h.ss.C.topRows(p), h.ss.D.topRows(p));
}

System sampled(const DelaySystem& g, double Ts) {
  if (!plain(g))
    throw Error("a delay inside a loop has no exact sampled form; sample pade(G, n), or simulate with step");
  const System a = to_ss(with_numbers(g.core));
  const Mat A = numbers(a.ss.A), B = numbers(a.ss.B), C = numbers(a.ss.C), D = numbers(a.ss.D);
  const Index n = A.rows(), m = B.cols();
  const double T = total(g);
  constexpr double most_samples = 1000;  // states of a dense system
  if (!(T <= most_samples * Ts))
    throw Error(text("the delay of ", pendula::rounded(T, 6), " s is ", pendula::rounded(T / Ts, 6),
                     " samples of ", pendula::rounded(Ts, 6), " s; at most ", most_samples,
                     " are stored as states: take a longer Ts, or step and lsim of the continuous system"));
  constexpr double rounding = 1e-9;  // of a sample: most_samples ε = 2e-13
  const auto d = static_cast<Index>(std::floor(T / Ts + rounding));
  const double f = std::max(0.0, T - static_cast<double>(d) * Ts);
  const bool fraction = f > rounding * Ts;
  const auto held = [&](double t) {
    Mat M = Mat::Zero(n + m, n + m);
    M.topLeftCorner(n, n) = A * t;
    M.topRightCorner(n, m) = B * t;
    const Mat E = linalg::exponential(M);
    return std::pair<Mat, Mat>(E.topLeftCorner(n, n), E.topRightCorner(n, m));
  };
  const auto [Phi, whole] = held(Ts);
  const auto [rest, after] = fraction ? held(Ts - f) : std::pair(Phi, whole);
  const Mat before = fraction ? Mat(rest * held(f).second) : Mat(Mat::Zero(n, m));
  const Index stored = d + (fraction ? 1 : 0);  // u(k-1) … u(k-stored)
  const Index N = n + stored * m;
  Mat As = Mat::Zero(N, N), Bs = Mat::Zero(N, m), Cs = Mat::Zero(C.rows(), N), Ds = Mat::Zero(C.rows(), m);
  As.topLeftCorner(n, n) = Phi;
  Cs.leftCols(n) = C;
  const auto enter = [&](Index lag, const Mat& gain, auto&& into_state, auto&& into_input) {
    if (lag == 0)
      into_input(gain);
    else
      into_state(n + (lag - 1) * m, gain);
  };
  const auto to_x = [&](Index at, const Mat& gain) { As.block(0, at, n, m) += gain; };
  const auto to_x_now = [&](const Mat& gain) { Bs.topRows(n) += gain; };
  const auto to_y = [&](Index at, const Mat& gain) { Cs.middleCols(at, m) += gain; };
  const auto to_y_now = [&](const Mat& gain) { Ds += gain; };
  enter(d, after, to_x, to_x_now);
  if (fraction) enter(d + 1, before, to_x, to_x_now);
  enter(stored, D, to_y, to_y_now);
  for (Index i = 0; i < stored; ++i) {
    if (i == 0)
      Bs.middleRows(n, m).setIdentity();
    else
      As.block(n + i * m, n + (i - 1) * m, m, m).setIdentity();
  }
  return make_ss(expressions(As), expressions(Bs), expressions(Cs), expressions(Ds), Expr(Ts));
}

std::string describe(const DelaySystem& g) {
  if (g.delays.empty()) return describe(g.core);
  if (g.product) return text(describe(g.core), "\ntimes e^(-", pendula::rounded(g.delays[0], 6), " s)");
  std::vector<std::string> words;
  for (const double T : g.delays) words.push_back(pendula::rounded(T, 6));
  return text("system with delays in loops or branches: ", counted(g.inputs(), "input"), ", ",
              counted(g.outputs(), "output"), ", ", counted(g.core.ss.order(), "state"),
              words.size() == 1 ? ", delay " : ", delays ", join(words, ", "), " s");
}

}  // namespace pendula::lti
