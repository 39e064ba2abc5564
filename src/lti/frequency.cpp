#include "lti/frequency.hpp"

#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/search/golden_section.hpp"
#include "base/stoppable.hpp"
#include "base/text.hpp"
#include "expr/linalg/linalg.hpp"
#include "lti/structure.hpp"

namespace pendula::lti {
namespace {

double sampling(const System& g) { return g.continuous() ? 0 : number(g.Ts); }

Complex point(double w, double Ts) { return Ts > 0 ? std::polar(1.0, w * Ts) : Complex(0, w); }

/// Evaluates one system at many frequencies: state spaces by the complex Schur form, O(n²) per frequency,
/// fractions by Horner's rule.
class Evaluator {
 public:
  explicit Evaluator(const System& given) : g_(with_numbers(given)), Ts_(sampling(g_)) {
    if (g_.form == Form::ss) {
      if (g_.ss.order()) {
        const Mat A = numbers(g_.ss.A);
        const Vec d = linalg::balancing(A);
        const Eigen::ComplexSchur<Mat> schur(linalg::similar(A, d));
        T_ = schur.matrixT();
        B_ = schur.matrixU().adjoint() *
             ComplexMat((d.cwiseInverse().asDiagonal() * numbers(g_.ss.B)).cast<Complex>());
        C_ = ComplexMat((numbers(g_.ss.C) * d.asDiagonal()).cast<Complex>()) * schur.matrixU();
      }
      D_ = numbers(g_.ss.D).cast<Complex>();
    } else {
      if (g_.form == Form::zpk) g_ = to_tf(g_);
      for (const Fraction& f : g_.tf) {
        num_.push_back(numbers(f.num));
        den_.push_back(numbers(f.den));
      }
    }
  }
  double Ts() const { return Ts_; }
  ComplexMat operator()(double w) const {
    const Complex s = point(w, Ts_);
    if (g_.form != Form::ss) {
      ComplexMat v(g_.outputs, g_.inputs);
      for (int i = 0; i < g_.outputs; ++i)
        for (int j = 0; j < g_.inputs; ++j) {
          const auto k = static_cast<std::size_t>(i * g_.inputs + j);
          v(i, j) = value(num_[k], s) / value(den_[k], s);
        }
      return v;
    }
    if (g_.ss.order() == 0) return D_;
    ComplexMat M = -T_;
    M.diagonal().array() += s;
    return C_ * M.triangularView<Eigen::Upper>().solve(B_) + D_;
  }

 private:
  System g_;
  double Ts_;
  ComplexMat T_, B_, C_, D_;
  std::vector<std::vector<double>> num_, den_;
};

/// Pole and zero frequencies in rad/s with their damping.
std::vector<std::pair<double, double>> corners(const System& g) {
  std::vector<std::pair<double, double>> list;
  const double Ts = sampling(g);
  auto modes = poles(g);
  if (!(g.siso() && g.form == Form::tf && g.tf[0].num.empty()))
    for (const auto& z : zeros(g)) modes.push_back(z);
  for (const dae::Mode& m : modes) {
    if (m.value.imag() < 0 || std::abs(m.value) == 0) continue;
    const Complex s = Ts > 0 ? std::log(m.value) / Ts : m.value;
    const double w = std::abs(s);
    if (w > 0 && std::isfinite(w)) list.emplace_back(w, std::fabs(s.real()) / w);
  }
  return list;
}

double bisect(const std::function<double(double)>& f, double a, double b) {
  constexpr double last_bits = 1e-15;  // 4.5 ε
  double fa = f(a);
  constexpr int most = 200;  // 60 halvings suffice for intervals of ten decades
  for (int k = 0; k < most && std::fabs(b - a) > last_bits * std::fabs(b); ++k) {
    const double c = std::sqrt(a * b), fc = f(c);
    if ((fc < 0) == (fa < 0)) {
      a = c;
      fa = fc;
    } else
      b = c;
  }
  return std::sqrt(a * b);
}

}  // namespace

const ComplexVec& FrequencyResponse::channel(int i, int j) const { return G[i * system->inputs + j]; }

Vec bode_frequencies(const System& given) {
  const System g = with_numbers(given);
  const auto list = corners(g);
  const double Ts = sampling(g), top = Ts > 0 ? M_PI / Ts : 0;
  double low = Ts > 0 ? top / 10 : 1, high = Ts > 0 ? top : 1;
  if (!list.empty()) {
    low = high = list[0].first;
    for (const auto& [w, zeta] : list) {
      low = std::min(low, w);
      high = std::max(high, w);
    }
  }
  // whole decades, one at least beyond the corners: there asymptotes show
  low = std::pow(10, std::floor(std::log10(low) - 0.99));
  high = std::pow(10, std::ceil(std::log10(high) + 0.99));
  if (Ts > 0) {
    high = top;
    low = std::min(low, top / 100);  // two decades are shown
  }
  std::vector<double> w;
  const double decades = std::log10(high / low);
  // steps of 4 %; limits: the dots of a terminal, and what is quickly computed
  const int count = static_cast<int>(std::clamp(60 * decades, 200.0, 1000.0));
  for (int k = 0; k <= count; ++k) w.push_back(low * std::pow(high / low, static_cast<double>(k) / count));
  // The width of a resonance is its damping: 41 points over 8 widths to each side, 0.02 apart at the centre.
  // Peaks narrower than 10⁻⁴ are lines in a plot; with ζ ≥ 0.5 the grid above is dense enough.
  constexpr double narrowest = 1e-4, broad = 0.5;
  for (const auto& [centre, zeta] : list) {
    const double width = std::max(zeta, narrowest);
    if (zeta < broad)
      for (int k = -20; k <= 20; ++k) w.push_back(centre * std::exp(width * k * std::fabs(k) / 50.0));
  }
  std::erase_if(w, [&](double v) { return v < low || v > high; });
  std::sort(w.begin(), w.end());
  constexpr double same = 1e-12;  // relative: 4500 ε
  w.erase(std::unique(w.begin(), w.end(), [](double a, double b) { return b - a < same * b; }), w.end());
  return Eigen::Map<const Vec>(w.data(), static_cast<Index>(w.size()));
}

FrequencyResponse frequency_response(const System& g, const Vec& w) {
  if (w.size() == 0) throw Error("there are no frequencies");
  for (Index k = 0; k < w.size(); ++k)
    if (!(w[k] >= 0) || !std::isfinite(w[k]))
      throw Error(text("frequencies are not negative, but w[", k + 1, "] = ", pendula::rounded(w[k])));
  const Evaluator at(g);
  FrequencyResponse r{std::make_shared<const System>(g), w, {}};
  r.G.assign(static_cast<std::size_t>(g.outputs * g.inputs), ComplexVec(w.size()));
  for (Index k = 0; k < w.size(); ++k) {
    poll_interrupt();
    const ComplexMat v = at(w[k]);
    for (int i = 0; i < g.outputs; ++i)
      for (int j = 0; j < g.inputs; ++j) r.G[i * g.inputs + j][k] = v(i, j);
  }
  return r;
}

Vec phase(const ComplexVec& G) {
  Vec p(G.size());
  double turn = 0, last = 0;
  for (Index k = 0; k < G.size(); ++k) {
    double now = std::arg(G[k]) * 180 / M_PI;
    constexpr double rounding = 1e-9;  // degrees, of a real negative number
    if (now <= -180 + rounding) now = 180;
    if (std::isfinite(now) && k > 0) {
      turn += std::round((last - now - turn) / 360) * 360;
      now += turn;
    }
    p[k] = now;
    if (std::isfinite(now)) last = now;
  }
  return p;
}

namespace {

constexpr double on_axis = 1e-9;  // of |z|, or of 1: simple poles err by ε times a condition number

/// arg(at(ω) - z) relative to ω = 0, for a zero or pole z away from that point. Roots on the axis (circle)
/// count as stable.
double turn(Complex z, double w, double Ts) {
  if (Ts == 0) {
    if (std::fabs(z.real()) <= on_axis * std::abs(z)) z = {-on_axis * std::abs(z), z.imag()};
    return std::arg(1.0 - Complex(0, w) / z);
  }
  if (std::fabs(std::abs(z) - 1) <= on_axis) z *= 1 - on_axis;
  return std::arg((point(w, Ts) - z) / (1.0 - z));
}

/// The continuous phase in degrees at all ω, from poles, zeros and the sign of the gain at low frequencies.
std::optional<Vec> sheet(const System& given, const Vec& w) {
  constexpr int largest_order = 60;  // a choice: zeros of larger systems are too uncertain
  if (order(given) > largest_order) return {};
  const System g = with_numbers(given);
  const double Ts = sampling(g);
  std::vector<dae::Mode> up, down;
  try {
    up = zeros(g);
    down = poles(g);
  } catch (const Error&) {
    return {};
  }
  const Complex origin = Ts > 0 ? 1 : 0;
  const auto is_origin = [&](const dae::Mode& m) {
    return Ts > 0 ? std::abs(m.value - origin) < on_axis : m.value == origin;
  };
  const auto is_unstable = [&](const dae::Mode& m) {
    return m.value.imag() == 0 && (Ts > 0 ? m.value.real() > 1 : m.value.real() > 0);
  };
  int integrators = 0;
  bool odd = false;
  double slowest = std::numeric_limits<double>::infinity();
  for (const auto* list : {&up, &down})
    for (const dae::Mode& m : *list) {
      const int sign = list == &up ? -1 : 1;
      if (is_origin(m)) {
        integrators += sign * m.multiplicity;
        continue;
      }
      if (list == &down && is_unstable(m) && m.multiplicity % 2) odd = !odd;
      const Complex s = Ts > 0 ? (m.value == 0.0 ? Complex(1 / Ts) : std::log(m.value) / Ts) : m.value;
      slowest = std::min(slowest, std::abs(s));
    }
  if (!std::isfinite(slowest)) slowest = Ts > 0 ? 1 / Ts : 1;
  const Evaluator at(g);
  const double low = 1e-4 * slowest;  // there 60 roots turn the phase by 60·10⁻⁴ rad = 0.3° at most
  const Complex first = at(low)(0, 0) * std::pow(Complex(0, 1), integrators);
  double base = first.real() >= 0 ? 0 : odd ? -180 : 180;
  base -= 90 * integrators;
  Vec out = Vec::Constant(w.size(), base);
  for (Index k = 0; k < w.size(); ++k)
    for (const auto* list : {&up, &down})
      for (const dae::Mode& m : *list)
        if (!is_origin(m))
          out[k] += (list == &up ? 1 : -1) * m.multiplicity * turn(m.value, w[k], Ts) * 180 / M_PI;
  return out;
}

}  // namespace

Vec phase(const FrequencyResponse& r, int i, int j) {
  Vec p = phase(r.channel(i, j));
  const System& all = *r.system;
  const auto expected = sheet(all.siso() ? all : select(all, {i}, {j}), r.w);
  if (!expected || !r.sheet_known) return p;
  for (Index k = 0; k < p.size(); ++k)
    if (std::isfinite(p[k]))
      p[k] += 360 * std::round(((*expected)[k] - r.w[k] * r.delay * 180 / M_PI - p[k]) / 360);
  return p;
}

namespace {

/// G(∞) of one channel; empty if it is infinite.
std::optional<double> feedthrough(const System& g) {
  if (g.form == Form::ss) return numbers(g.ss.D)(0, 0);
  const System f = to_tf(g);
  const int above = degree(f.tf[0].num), below = degree(f.tf[0].den);
  if (f.tf[0].num.empty() || above < below) return 0;
  if (above > below) return {};
  return number(f.tf[0].num.back()) / number(f.tf[0].den.back());
}

}  // namespace

Margins margins(const System& given) {
  if (!given.siso())
    throw Error("margins are for one input and one output; choose a channel with G:channel(i, j)");
  const System g = with_numbers(given);
  const Evaluator at(g);
  Vec base = bode_frequencies(g);
  std::vector<double> w(base.data(), base.data() + base.size());
  // four more decades to both sides, in steps of 4.7 %: the curves are smooth there
  for (int k = 1; k <= 200; ++k) w.push_back(base[0] * std::pow(1e-4, k / 200.0));
  if (at.Ts() == 0)
    for (int k = 1; k <= 200; ++k) w.push_back(base[base.size() - 1] * std::pow(1e4, k / 200.0));
  std::sort(w.begin(), w.end());
  const auto size = [&](double x) { return std::log(std::abs(at(x)(0, 0))); };
  const auto side = [&](double x) { return at(x)(0, 0).imag(); };
  Margins m;
  for (std::size_t k = 0; k + 1 < w.size(); ++k) {
    const Complex a = at(w[k])(0, 0), b = at(w[k + 1])(0, 0);
    if (!std::isfinite(std::abs(a)) || !std::isfinite(std::abs(b))) continue;
    if ((std::abs(a) < 1) != (std::abs(b) < 1)) {
      const double x = bisect(size, w[k], w[k + 1]);
      double margin = 180 + std::arg(at(x)(0, 0)) * 180 / M_PI;
      if (margin > 180) margin -= 360;
      if (!m.phase || std::fabs(margin) < std::fabs(*m.phase)) {
        m.phase = margin;
        m.phase_at = x;
      }
    }
    constexpr double noise = 1e-13;  // 450 ε: imaginary parts of a response that is real
    // after bisection to ε a crossing of 0 leaves less, a pole on the axis more
    constexpr double jump = 1e-6;
    if ((a.imag() < 0) != (b.imag() < 0) && a.real() + b.real() < 0 &&
        std::max(std::fabs(a.imag()) / std::abs(a), std::fabs(b.imag()) / std::abs(b)) > noise) {
      const double x = bisect(side, w[k], w[k + 1]);
      const Complex v = at(x)(0, 0);
      if (!(v.real() < 0) || std::fabs(v.imag()) > jump * std::abs(v)) continue;
      const double margin = 1 / std::abs(v);
      if (!m.gain || std::fabs(std::log(margin)) < std::fabs(std::log(*m.gain))) {
        m.gain = margin;
        m.gain_at = x;
      }
    }
  }
  // The ends of the curve, where G is real, count as well: a pole of the closed loop may cross
  // the axis there.
  const auto consider_end = [&](double frequency, double value) {
    if (!(value < 0) || !std::isfinite(value)) return;
    if (m.gain && std::fabs(std::log(-1 / value)) >= std::fabs(std::log(*m.gain))) return;
    m.gain = -1 / value;
    m.gain_at = frequency;
  };
  consider_end(0, at(0)(0, 0).real());
  if (at.Ts() > 0)
    consider_end(M_PI / at.Ts(), at(M_PI / at.Ts())(0, 0).real());
  else if (const auto through = feedthrough(g))
    consider_end(std::numeric_limits<double>::infinity(), *through);
  m.closed_loop_stable = stability(feedback(g, make_gain(MatX::Identity(1, 1)))).asymptotic;
  return m;
}

std::string describe(const Margins& m) {
  const auto r = [](double v) { return pendula::rounded(v, 6); };
  const auto level = [](double v, int digits) {  // values below 1e-9 are errors of the bisection
    return std::fabs(v) < 1e-9 ? std::string("0") : pendula::rounded(v, digits);
  };
  std::string out;
  out += m.gain ? text("gain margin   ", r(*m.gain), " (", level(20 * std::log10(*m.gain), 4),
                       " dB) at ω = ", r(*m.gain_at), "\n")
                : "gain margin   infinite: the phase does not cross -180°\n";
  out += m.phase ? text("phase margin  ", level(*m.phase, 6), "° at ω = ", r(*m.phase_at), "\n")
                 : "phase margin  infinite: |G| does not cross 1\n";
  return out + "closed loop   " +
         (m.closed_loop_stable ? "asymptotically stable" : "not asymptotically stable");
}

double h2_norm(const System& given) {
  const System g = to_ss(with_numbers(given));
  const Mat D = numbers(g.ss.D);
  if (g.continuous() && D.norm() > 0) throw Error("the H2 norm is infinite: D is not zero");
  const Mat P = numbers(gramian(g, true)), C = numbers(g.ss.C);
  return std::sqrt((C * P * C.transpose()).trace() + (g.continuous() ? 0 : D.squaredNorm()));
}

namespace {

double peak_at(const Evaluator& at, double w) {
  const ComplexMat G = at(w);
  return G.size() == 0 ? 0 : Eigen::JacobiSVD<ComplexMat>(G).singularValues()[0];
}

/// Frequencies at which a singular value of G(iω) equals gamma: the imaginary eigenvalues of
/// the Hamiltonian matrix.
std::vector<double> level_frequencies(const System& g, double gamma) {
  const Mat A = numbers(g.ss.A), B = numbers(g.ss.B), C = numbers(g.ss.C), D = numbers(g.ss.D);
  const Mat R = gamma * gamma * Mat::Identity(g.inputs, g.inputs) - D.transpose() * D;
  const Mat S = gamma * gamma * Mat::Identity(g.outputs, g.outputs) - D * D.transpose();
  const Mat Ri = inverse_by_lu(R), Si = inverse_by_lu(S);
  const Index n = A.rows();
  Mat H(2 * n, 2 * n);
  const Mat F = A + B * Ri * D.transpose() * C;
  H << F, gamma * B * Ri * B.transpose(), -gamma * C.transpose() * Si * C, -F.transpose();
  const Mat eigenvalues = stoppable(25 * std::pow(2.0 * static_cast<double>(n), 3), [&] {
    const ComplexVec e =
        Eigen::EigenSolver<Mat>(linalg::similar(H, linalg::balancing(H)), false).eigenvalues();
    Mat parts(e.size(), 2);
    parts << e.real(), e.imag();
    return std::vector<Mat>{parts};
  })[0];
  constexpr double double_root = 1e-8;  // near the norm eigenvalues are double: computed ones err by √ε
  std::vector<double> list;
  for (Index k = 0; k < 2 * n; ++k) {
    const Complex e(eigenvalues(k, 0), eigenvalues(k, 1));
    if (std::fabs(e.real()) < double_root * (1 + std::abs(e)) && e.imag() >= 0) list.push_back(e.imag());
  }
  std::sort(list.begin(), list.end());
  return list;
}

}  // namespace

PeakGain hinf_norm(const System& given) {
  const System g = to_ss(with_numbers(given));
  if (const Stability s = stability(g); !s.asymptotic)
    throw Error(text("the H∞ norm needs an asymptotically stable system; this one is ", describe(s)));
  poll_interrupt();
  const Evaluator at(g);
  poll_interrupt();
  PeakGain best{peak_at(at, 0), 0};
  const auto consider = [&](double w) {
    if (const double v = peak_at(at, w); v > best.value) best = {v, w};
  };
  const Vec grid = bode_frequencies(g);
  for (Index k = 0; k < grid.size(); ++k) consider(grid[k]);
  if (!g.continuous()) {  // golden section search around the best grid point
    const auto gain = [&](double w) { return -peak_at(at, w); };
    const auto follow = [&](const GoldenSection& s, int) {
      consider(s.middle());
      return false;
    };
    if (best.at > 0)
      // the grid has steps of 4 %, so its best point is within 2 % of a symmetric peak; 0.618¹⁰⁰ = 1e-21
      golden_section(gain, best.at * 0.97, std::min(best.at * 1.03, M_PI / at.Ts()), 100, follow);
    return best;
  }
  const double limit = g.inputs && g.outputs ? Eigen::JacobiSVD<Mat>(numbers(g.ss.D)).singularValues()[0] : 0;
  if (limit > best.value) best = {limit, std::numeric_limits<double>::infinity()};
  if (g.ss.order() == 0 || best.value == 0) return best;
  constexpr double accuracy = 1e-10;  // of the norm
  constexpr int most = 40;            // a cap: convergence is quadratic
  for (int k = 0; k < most; ++k) {    // Bruinsma & Steinbuch, Systems Control Lett. 14(4), 1990
    const auto w = level_frequencies(g, best.value * (1 + accuracy));
    const double before = best.value;
    for (std::size_t i = 0; i + 1 < w.size(); ++i) consider((w[i] + w[i + 1]) / 2);
    if (best.value <= before * (1 + accuracy)) break;
  }
  return best;
}

}  // namespace pendula::lti
