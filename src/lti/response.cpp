#include "lti/response.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "base/counted.hpp"
#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "expr/linalg/linalg.hpp"
#include "lti/curve_facts.hpp"
#include "lti/structure.hpp"

namespace pendula::lti {
namespace {

constexpr double same_step = 1e-12;     // relative: differences of times, 4500 ε
constexpr double on_grid = 1e-6;        // of Ts: times may be printed with seven digits
constexpr double time_rounding = 1e-9;  // of a quotient of times: ε of 10⁶ samples

/// The matrices in doubles.
struct Numbers {
  Mat A, B, C, D;
  double Ts;
};

Numbers numbers_of(const System& given) {
  const System g = to_ss(with_numbers(given));
  return {numbers(g.ss.A), numbers(g.ss.B), numbers(g.ss.C), numbers(g.ss.D),
          g.continuous() ? 0 : number(g.Ts)};
}

void check_times(const Numbers& s, const Vec& t) {
  if (t.size() == 0) throw Error("there are no times");
  if (!t.allFinite()) throw Error("a time is not a finite number");
  for (Index k = 1; k < t.size(); ++k) {
    if (!(t[k] > t[k - 1]))
      throw Error(text("times must increase, but t[", k + 1, "] = ", pendula::rounded(t[k]), " follows ",
                       pendula::rounded(t[k - 1])));
    if (s.Ts > 0 && std::fabs(t[k] - t[k - 1] - s.Ts) > on_grid * s.Ts)
      throw Error(
          text("the times of a discrete system are one sampling time apart (Ts = ", pendula::rounded(s.Ts),
               "), but t[", k + 1, "] - t[", k, "] = ", pendula::rounded(t[k] - t[k - 1])));
  }
  constexpr double most = 1e8;  // numbers of x and y: 0.8 GB
  if (static_cast<double>(t.size()) * static_cast<double>(s.A.rows() + s.C.rows()) > most)
    throw Error(text(t.size(), " times are too many for a system of ", s.A.rows(), " states and ", s.C.rows(),
                     " outputs: at most ", static_cast<Index>(most) / (s.A.rows() + s.C.rows())));
}

/// e^{[A B; 0 0] h} for piecewise constant inputs, or e^{[A B 0; 0 0 I/h; 0 0 0] h} for piecewise linear
/// ones; cached for the last step length.
class Hold {
 public:
  Hold(const Numbers& s, bool linear) : s_(s), linear_(linear) {}
  Vec operator()(const Vec& x, const Vec& u0, const Vec& u1, double h) {
    if (s_.Ts > 0) return s_.A * x + s_.B * u0;
    if (!h_ || !(std::fabs(h - *h_) <= same_step * h)) prepare(h);
    Vec next = Phi_ * x + G1_ * u0;
    if (linear_) next += G2_ * (u1 - u0);
    return next;
  }

 private:
  void prepare(double h) {
    const Index n = s_.A.rows(), m = s_.B.cols();
    Mat M = Mat::Zero(n + 2 * m, n + 2 * m);
    M.topLeftCorner(n, n) = s_.A * h;
    M.block(0, n, n, m) = s_.B * h;
    M.block(n, n + m, m, m).setIdentity();
    const Mat F = linalg::exponential(M);
    Phi_ = F.topLeftCorner(n, n);
    G1_ = F.block(0, n, n, m);
    G2_ = F.block(0, n + m, n, m);
    h_ = h;
  }
  const Numbers& s_;
  bool linear_;
  std::optional<double> h_;
  Mat Phi_, G1_, G2_;
};

/// x(t + h) = e^{Ah} x + ∫ e^{A(h-τ)} B u(τ) dτ, with u replaced by its interpolation polynomial of degree 4
/// at five Gauss nodes on parts of a step. The polynomial is integrated exactly by one exponential of [A B; 0
/// N] with a nilpotent N, so that stiff modes need no short parts.
class Quadrature {
 public:
  explicit Quadrature(const Numbers& s) : s_(s) {}
  Vec operator()(Vec x, const std::function<Vec(double)>& u, double t, double h) {
    if (!h_ || !(std::fabs(h - *h_) <= same_step * h)) prepare(h);
    const double piece = h / pieces_;
    for (int k = 0; k < pieces_; ++k) {
      x = Phi_ * x;
      for (std::size_t i = 0; i < nodes.size(); ++i) x += weight_[i] * u(t + piece * (k + nodes[i]));
    }
    return x;
  }

 private:
  void prepare(double h) {
    h_ = h;
    // u is taken at five nodes per time 1/‖A‖, the shortest in which x follows; 1000 pieces are a cap
    pieces_ = static_cast<int>(std::clamp(std::ceil(h * s_.A.lpNorm<1>()), 1.0, 1000.0));
    const double piece = h / pieces_;
    const Index n = s_.A.rows(), m = s_.B.cols();
    constexpr Index count = static_cast<Index>(nodes.size());
    Mat M = Mat::Zero(n + count * m, n + count * m);
    M.topLeftCorner(n, n) = s_.A * piece;
    M.block(0, n, n, m) = s_.B * piece;
    for (Index k = 0; k + 1 < count; ++k) M.block(n + k * m, n + (k + 1) * m, m, m).setIdentity();
    const Mat F = linalg::exponential(M);  // block k: ∫₀¹ e^{Ah(1-σ)} B h σᵏ/k! dσ
    Phi_ = F.topLeftCorner(n, n);
    Mat V(count, count);  // V⁻¹: the coefficients of Lagrange's polynomials
    for (Index i = 0; i < count; ++i)
      for (Index k = 0; k < count; ++k) V(i, k) = std::pow(nodes[i], k);
    const Mat lagrange = inverse_by_lu(V);
    for (Index i = 0; i < count; ++i) {
      Mat& w = weight_[i];
      w = Mat::Zero(n, m);
      double factorial = 1;
      for (Index k = 0; k < count; ++k) {
        w += lagrange(k, i) * factorial * F.block(0, n + k * m, n, m);
        factorial *= static_cast<double>(k + 1);
      }
    }
  }
  /// Gauss-Legendre on [0, 1] (Abramowitz & Stegun 1964, table 25.4).
  static constexpr std::array<double, 5> nodes = {0.046910077030668004, 0.23076534494715845, 0.5,
                                                  0.76923465505284155, 0.95308992296933200};
  const Numbers& s_;
  std::optional<double> h_;
  int pieces_ = 1;
  Mat Phi_;
  std::array<Mat, 5> weight_;
};

struct Run {
  Mat y, x;
};

Run run(const Numbers& s, const Vec& t, Vec x, const std::function<Vec(Index)>& input,
        const std::function<Vec(const Vec&, Index)>& next) {
  Run r{Mat(t.size(), s.C.rows()), Mat(t.size(), s.A.rows())};
  for (Index k = 0; k < t.size(); ++k) {
    poll_interrupt();
    r.x.row(k) = x.transpose();
    r.y.row(k) = (s.C * x + s.D * input(k)).transpose();
    if (!r.y.row(k).allFinite() || !x.allFinite())
      throw Failure(text("the response overflows at t = ", pendula::rounded(t[k], 6),
                         "; the system is unstable: end earlier"));
    if (k + 1 < t.size()) x = next(x, k);
  }
  return r;
}

double nice_up(double value) {
  const double decade = std::pow(10, std::floor(std::log10(value)));
  for (double f : {1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0})
    if (value <= f * decade * (1 + same_step)) return f * decade;
  return 10 * decade;
}

Response make(const char* kind, const System& g, const Vec& t) {
  Response r;
  r.kind = kind;
  r.system = std::make_shared<const System>(g);
  r.t = t;
  const System values = with_numbers(g);
  r.settles = true;
  for (const dae::Mode& m : poles(values))
    r.settles = r.settles && (g.continuous() ? m.value.real() < 0 : std::abs(m.value) < 1);
  return r;
}

/// Keeps the rows of the requested times, which are the last ones.
void keep(Response& r, const Run& one) {
  r.y.emplace_back(one.y.bottomRows(r.t.size()));
  r.x.emplace_back(one.x.bottomRows(r.t.size()));
}

/// The times, with a mesh inserted between 0, where steps and impulses occur, and the first of them.
Vec from_zero(const Numbers& s, const Vec& t) {
  check_times(s, t);
  if (t[0] == 0) return t;
  if (t[0] < 0)
    throw Error(text("the response begins at t = 0, but t[1] = ", pendula::rounded(t[0]),
                     "; lsim(G, u, t) begins at any time"));
  const double steps = s.Ts > 0 ? std::round(t[0] / s.Ts) : 1;
  if (s.Ts > 0 && std::fabs(t[0] - steps * s.Ts) > on_grid * s.Ts)
    throw Error(text("the times of a discrete system are multiples of Ts = ", pendula::rounded(s.Ts),
                     ", but t[1] = ", pendula::rounded(t[0])));
  constexpr double most = 1e7;  // steps that are computed before the first time
  if (steps > most)
    throw Error(text("t[1] = ", pendula::rounded(t[0]), " is ", steps,
                     " samples after 0; at most 10⁷ are computed before the first time"));
  const auto before = static_cast<Index>(steps);
  Vec all(before + t.size());
  for (Index k = 0; k < before; ++k) all[k] = static_cast<double>(k) * s.Ts;
  all.tail(t.size()) = t;
  return all;
}

}  // namespace

namespace {

struct Horizon {
  double end = 0;      ///< where the slowest mode has decayed; infinite beyond the range of double
  double fastest = 0;  ///< highest visible frequency
};

Horizon horizon(const System& g, double Ts) {
  double longest = 0, fastest = 0;
  bool forever = false;
  // Seven time constants: e⁻⁷ = 0.1 % of a mode is left; unstable modes grow by e⁴ = 55; at most 60 periods,
  // and five of undamped ones. 10⁻⁹ is the rounding of a pole on the axis; e⁻⁵⁰ = 2e-22 stands for z = 0.
  for (const dae::Mode& m : poles(g)) {
    const Complex p = Ts > 0 ? (std::abs(m.value) > 0 ? std::log(m.value) / Ts : Complex(-50 / Ts)) : m.value;
    const double decay = std::fabs(p.real()), size = std::abs(p);
    if (size > 0 && decay > 1e-9 * size)
      longest = std::max(longest, std::min((p.real() > 0 ? 4.0 : 7.0 + 2.0 * (m.multiplicity - 1)) / decay,
                                           60 * 2 * M_PI / size));
    else if (size > 0)
      longest = std::max(longest, 5 * 2 * M_PI / size);
    else
      forever = true;
    if (p.imag() != 0 && decay < 3 * std::fabs(p.imag())) fastest = std::max(fastest, std::fabs(p.imag()));
  }
  const double none = Ts > 0 ? 20 * Ts : 10;  // no poles, or integrators alone: no time is characteristic
  return {longest > 0 ? nice_up((forever ? 1.5 : 1) * longest) : none, fastest};
}

}  // namespace

Vec response_times(const System& given, std::optional<double> to) {
  const System g = with_numbers(given);
  const double Ts = g.continuous() ? 0 : number(g.Ts);
  if (to && !(*to > 0 && std::isfinite(*to)))
    throw Error(text("the end must be a positive time, got ", pendula::rounded(*to)));
  const Horizon natural = horizon(g, Ts);
  const double end = to ? *to : natural.end;
  if (!std::isfinite(end))
    throw Error("the slowest mode settles beyond the largest number; give the end or the times: step(G, 10)");
  if (Ts > 0) {
    const double steps = std::floor(end / Ts + time_rounding);
    constexpr double most = 1e6;  // far beyond what a plot shows; lsim takes more
    if (steps > most)
      throw Error(
          text("up to t = ", pendula::rounded(end), " there are more than 10⁶ samples; give an earlier end"));
    const auto n = static_cast<Index>(std::max(to ? 0.0 : 10.0, to ? steps : std::min(steps, 1000.0)));
    return Vec::LinSpaced(n + 1, 0, Ts * static_cast<double>(n));
  }
  // 40 times per period of the fastest visible oscillation, between the dots of a terminal and of a page
  const double wanted = std::clamp(end * natural.fastest / (2 * M_PI) * 40, 300.0, 3000.0);
  return Vec::LinSpaced(static_cast<Index>(wanted) + 1, 0, end);
}

namespace {

/// Rise, overshoot and settling are properties of the system. If the requested times are few or end early,
/// they are computed at the times of response_times.
Vec times_of_facts(const System& g, const Vec& t) {
  const System values = with_numbers(g);
  if (!std::isfinite(horizon(values, g.continuous() ? 0 : number(values.Ts)).end)) return t;
  const Vec whole = response_times(g);
  const auto widest = [](const Vec& times) {
    return times.size() < 2 ? 0 : (times.tail(times.size() - 1) - times.head(times.size() - 1)).maxCoeff();
  };
  const bool enough = t[t.size() - 1] * (1 + time_rounding) >= whole[whole.size() - 1] &&
                      widest(t) <= widest(whole) * (1 + time_rounding);
  return enough ? t : whole;
}

}  // namespace

Response step(const System& g, const Vec& wanted) {
  const Numbers s = numbers_of(g);
  const Vec t = from_zero(s, wanted);
  Response r = make("step", g, wanted);
  Mat final;
  if (r.settles) final = numbers(dcgain(with_numbers(g)));
  const Vec seen = r.settles ? times_of_facts(g, t) : t;
  const Vec zero = Vec::Zero(s.A.rows());
  for (Index j = 0; j < s.B.cols(); ++j) {
    const Vec u = Vec::Unit(s.B.cols(), j);
    Hold hold(s, false);
    const auto input = [&](Index) { return u; };
    const auto next_at = [&](const Vec& times) {
      return [&](const Vec& x, Index k) { return hold(x, u, u, times[k + 1] - times[k]); };
    };
    const Run one = run(s, t, zero, input, next_at(t));
    keep(r, one);
    if (!r.settles) continue;
    const bool same = seen.size() == t.size() && seen == t;
    const Run whole = same ? one : run(s, seen, zero, input, next_at(seen));
    r.facts.emplace_back();
    for (Index i = 0; i < s.C.rows(); ++i)
      r.facts.back().push_back(curve_facts(seen, whole.y.col(i), final(i, j)));
  }
  return r;
}

Response impulse(const System& g, const Vec& wanted) {
  const Numbers s = numbers_of(g);
  const Vec t = from_zero(s, wanted);
  Response r = make("impulse", g, wanted);
  const Vec none = Vec::Zero(s.B.cols());
  for (Index j = 0; j < s.B.cols(); ++j) {
    const Vec unit = Vec::Unit(s.B.cols(), j);
    Hold hold(s, false);
    if (s.Ts > 0)
      keep(r, run(
                  s, t, Vec::Zero(s.A.rows()), [&](Index k) { return k == 0 ? unit : none; },
                  [&](const Vec& x, Index k) { return hold(x, k == 0 ? unit : none, none, s.Ts); }));
    else
      keep(r, run(
                  s, t, s.B.col(j), [&](Index) { return none; },
                  [&](const Vec& x, Index k) { return hold(x, none, none, t[k + 1] - t[k]); }));
  }
  return r;
}

Response initial(const System& given, const Vec& x0, const Vec& wanted) {
  const System g = to_ss(given);
  const Numbers s = numbers_of(g);
  if (x0.size() != s.A.rows())
    throw Error(text("x0 has ", x0.size(), x0.size() == 1 ? " entry" : " entries", " for ", s.A.rows(),
                     s.A.rows() == 1 ? " state" : " states"));
  const Vec t = from_zero(s, wanted);
  Response r = make("initial", g, wanted);
  const Vec none = Vec::Zero(s.B.cols());
  Hold hold(s, false);
  keep(r, run(
              s, t, x0, [&](Index) { return none; },
              [&](const Vec& x, Index k) { return hold(x, none, none, t[k + 1] - t[k]); }));
  return r;
}

Response simulate(const System& g, const Mat& u, const Vec& t, const Vec& x0, bool hold_constant) {
  const Numbers s = numbers_of(g);
  check_times(s, t);
  if (u.rows() != t.size() || u.cols() != s.B.cols())
    throw Error(text("u must have one row per time and one column per input, ", t.size(), "×", s.B.cols(),
                     ", but it is ", u.rows(), "×", u.cols()));
  if (!u.allFinite()) throw Error("u has entries that are not finite numbers");
  if (x0.size() != s.A.rows())
    throw Error(text("x0 has ", counted(x0.size(), "entry"), " for ", counted(s.A.rows(), "state")));
  Response r = make("lsim", g, t);
  Hold hold(s, !hold_constant);
  keep(r, run(
              s, t, x0, [&](Index k) { return Vec(u.row(k)); },
              [&](const Vec& x, Index k) { return hold(x, u.row(k), u.row(k + 1), t[k + 1] - t[k]); }));
  return r;
}

Response simulate(const System& g, const std::function<Vec(double)>& u, const Vec& t, const Vec& x0) {
  const Numbers s = numbers_of(g);
  check_times(s, t);
  if (x0.size() != s.A.rows())
    throw Error(text("x0 has ", counted(x0.size(), "entry"), " for ", counted(s.A.rows(), "state")));
  Response r = make("lsim", g, t);
  Quadrature quadrature(s);
  const auto next = [&](const Vec& x, Index k) -> Vec {
    if (s.Ts > 0) return s.A * x + s.B * u(t[k]);
    return quadrature(x, u, t[k], t[k + 1] - t[k]);
  };
  keep(r, run(
              s, t, x0, [&](Index k) { return u(t[k]); }, next));
  return r;
}

std::string describe(const Response& r) {
  const System& g = *r.system;
  const char* title = r.kind == "step"      ? "step response"
                      : r.kind == "impulse" ? "impulse response"
                      : r.kind == "initial" ? "response to the initial state"
                                            : "simulation";
  std::string out = text(title, ": ", r.t.size(), " times, ", pendula::rounded(r.t[0], 6), " ≤ t ≤ ",
                         pendula::rounded(r.t[r.t.size() - 1], 6), "\n");
  if (r.kind == "step" && !r.settles) out += "  some poles do not decay: there is no final value\n";
  if (!r.facts.empty()) {
    Table table({false, true, true, true, true, true, true});
    table.row({"", "final", "rise 10–90 %", "settled to 2 %", "overshoot", "peak", "at t"});
    const auto shown = [](const std::optional<double>& v, const char* unit) {
      return v ? pendula::rounded(*v, 4) + unit : std::string("–");
    };
    for (std::size_t j = 0; j < r.facts.size(); ++j)
      for (std::size_t i = 0; i < r.facts[j].size(); ++i) {
        const CurveFacts& f = r.facts[j][i];
        const std::string name = output_name(g, static_cast<int>(i)) +
                                 (g.inputs == 1 ? "" : " from " + input_name(g, static_cast<int>(j)));
        const bool rises = f.overshoot && *f.overshoot == 0;
        table.row({name, pendula::rounded(f.final, 4), shown(f.rise_time, ""), shown(f.settling_time, ""),
                   shown(f.overshoot, " %"), rises ? "–" : pendula::rounded(f.peak, 4),
                   rises ? "–" : pendula::rounded(f.peak_time, 4)});
      }
    out += table.str(2);
  } else {
    Table table({false, true, true, true, true});
    table.row({"", "least", "at t", "greatest", "at t"});
    for (std::size_t j = 0; j < r.y.size(); ++j)
      for (Index i = 0; i < r.y[j].cols(); ++i) {
        Index low = 0, high = 0;
        const Vec y = r.y[j].col(i);
        y.minCoeff(&low);
        y.maxCoeff(&high);
        const std::string name = output_name(g, static_cast<int>(i)) +
                                 (r.y.size() == 1 ? "" : " from " + input_name(g, static_cast<int>(j)));
        table.row({name, pendula::rounded(y[low], 4), pendula::rounded(r.t[low], 4),
                   pendula::rounded(y[high], 4), pendula::rounded(r.t[high], 4)});
      }
    out += table.str(2);
  }
  out.pop_back();
  return out;
}

}  // namespace pendula::lti
