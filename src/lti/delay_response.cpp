// Time responses of systems with delays by the method of steps.
#include <algorithm>
#include <cmath>
#include <optional>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "lti/delay.hpp"

namespace pendula::lti {
namespace {

// A panel of the length 1/(2‖A‖) errs by (8!)²/(16! 17!) 2⁻¹⁷ = 2e-24 of the state (Gauss: R(z) is Padé's
// approximation of eᶻ).
constexpr Index stages = 8;
constexpr double norm_per_panel = 0.5;
constexpr double same_time = 1e-12;  // of the end: sums of delays err by some ε
constexpr int most_panels = 20000;   // a dense system of 8 n rows is solved for each

/// Gauss nodes on [0, 1] with the matrix and weights of the collocation method, and barycentric weights.
struct Collocation {
  Vec c, b, barycentric;
  Mat A;
  Collocation() : c(stages), b(stages), barycentric(stages), A(stages, stages) {
    // zeros of the Legendre polynomial: eigenvalues of the Jacobi matrix (Golub & Welsch, Math.
    // Comp. 23, 1969)
    Mat J = Mat::Zero(stages, stages);
    for (Index k = 1; k < stages; ++k) {
      const auto n = static_cast<double>(k);
      J(k, k - 1) = J(k - 1, k) = n / std::sqrt(4 * n * n - 1);
    }
    const Eigen::SelfAdjointEigenSolver<Mat> solver(J);
    c = 0.5 * (solver.eigenvalues().array() + 1);
    b = solver.eigenvectors().row(0).cwiseAbs2().transpose();
    for (Index i = 0; i < stages; ++i) {
      barycentric[i] = 1;
      for (Index j = 0; j < stages; ++j)
        if (j != i) barycentric[i] /= c[i] - c[j];
    }
    // ∫₀^{cᵢ} L_j: the same Gauss rule on [0, cᵢ] is exact
    for (Index i = 0; i < stages; ++i) {
      Vec sum = Vec::Zero(stages);
      for (Index k = 0; k < stages; ++k) sum += b[k] * c[i] * lagrange(c[i] * c[k]);
      A.row(i) = sum.transpose();
    }
  }
  /// L_1(x) … L_s(x).
  Vec lagrange(double x) const {
    Vec w(stages);
    for (Index i = 0; i < stages; ++i) {
      if (x == c[i]) return Vec::Unit(stages, i);
      w[i] = barycentric[i] / (x - c[i]);
    }
    return w / w.sum();
  }
};

/// One panel of the solution: outputs [y; z] at its nodes.
struct Panel {
  double from, to;
  Mat values;  ///< channels × stages
};

class MethodOfSteps {
 public:
  MethodOfSteps(const DelaySystem& g, const std::function<Vec(double)>& u) : g_(g), u_(u) {
    const System s = to_ss(with_numbers(g.core));
    A_ = numbers(s.ss.A);
    B_ = numbers(s.ss.B);
    C_ = numbers(s.ss.C);
    D_ = numbers(s.ss.D);
    x_ = Vec::Zero(A_.rows());
  }

  void advance(double from, double to) {
    const double h = to - from;
    const Index n = A_.rows();
    Mat v(B_.cols(), stages);
    for (Index i = 0; i < stages; ++i) v.col(i) = inputs(from + h * rule_.c[i]);
    Mat X(n, stages);
    if (n > 0) {
      factor(h);
      const Mat Bv = B_ * v;
      const Mat right = x_.replicate(1, stages) + h * Bv * rule_.A.transpose();
      X = lu_.solve(right.reshaped()).reshaped(n, stages);
      x_ += h * (A_ * X + Bv) * rule_.b;
    }
    panels_.push_back({from, to, C_ * X + D_ * v});
  }

  /// [y; z] at a time already computed; left-continuous at the ends of panels.
  Vec at(double t) const {
    const auto after = std::lower_bound(panels_.begin(), panels_.end(), t,
                                        [](const Panel& p, double value) { return p.to < value; });
    const Panel& p = after == panels_.end() ? panels_.back() : *after;
    return p.values * rule_.lagrange((t - p.from) / (p.to - p.from));
  }

  double norm() const { return A_.rows() ? A_.norm() : 0; }

 private:
  Vec inputs(double t) const {
    Vec v(B_.cols());
    const int m = g_.inputs(), p = g_.outputs();
    v.head(m) = u_(t);
    for (int i = 0; i < g_.inner(); ++i) {
      const double past = t - g_.delays[i];
      v[m + i] = past < 0 || panels_.empty() ? 0 : at(past)[p + i];
    }
    return v;
  }

  void factor(double h) {
    constexpr double last_bits = 1e-14;  // 45 ε: lengths of panels are differences of times
    if (factored_ && std::abs(h - *factored_) <= last_bits * h) return;
    const Index n = A_.rows();
    Mat M = Mat::Identity(n * stages, n * stages);
    for (Index i = 0; i < stages; ++i)
      for (Index j = 0; j < stages; ++j) M.block(i * n, j * n, n, n) -= h * rule_.A(i, j) * A_;
    lu_.compute(M);
    factored_ = h;
  }

  const DelaySystem& g_;
  const std::function<Vec(double)>& u_;
  const Collocation rule_;
  Mat A_, B_, C_, D_;
  Vec x_;
  std::vector<Panel> panels_;
  Eigen::PartialPivLU<Mat> lu_;
  std::optional<double> factored_;
};

/// Times up to `end` at which a discontinuity of u can arrive: sums of delays.
std::vector<double> arrivals(const std::vector<double>& corners, const std::vector<double>& delays,
                             double end) {
  // each pass gains one derivative; a choice, as corners of higher ones change digits beyond those of a plot
  constexpr int smooth = 8;
  std::vector<double> all = corners, last = corners;
  for (int k = 0; k < smooth && all.size() < most_panels; ++k) {
    std::vector<double> next;
    for (const double t : last)
      for (const double T : delays)
        if (t + T < end) next.push_back(t + T);
    std::sort(next.begin(), next.end());
    next.erase(
        std::unique(next.begin(), next.end(), [&](double a, double b) { return b - a < same_time * end; }),
        next.end());
    all.insert(all.end(), next.begin(), next.end());
    last = std::move(next);
  }
  return all;
}

std::vector<double> panel_ends(const DelaySystem& g, const std::vector<double>& corners, double end,
                               double norm) {
  const double shortest = *std::min_element(g.delays.begin(), g.delays.end());
  double h = std::min(shortest, norm > 0 ? norm_per_panel / norm : end);
  h = std::max(h, end / most_panels);
  if (h > shortest)
    throw Failure(text("the delay of ", pendula::rounded(shortest, 3), " s is too short for a response of ",
                       pendula::rounded(end, 3), " s; take pade(G, n)"));
  std::vector<double> ends = arrivals(corners, g.delays, end);
  ends.push_back(0);
  ends.push_back(end);
  std::sort(ends.begin(), ends.end());
  constexpr double rounding = 1e-9;  // of a panel: differences of up to 20000 of them err by 4e-12
  std::vector<double> out;
  for (const double t : ends) {
    if (t < 0 || t > end || (!out.empty() && t - out.back() < same_time * end)) continue;
    if (!out.empty()) {
      const double from = out.back();
      const auto parts = static_cast<int>(std::ceil((t - from) / h - rounding));
      for (int k = 1; k < parts; ++k) out.push_back(from + (t - from) * k / parts);
    }
    out.push_back(t);
  }
  return out;
}

Mat run(const DelaySystem& g, const std::function<Vec(double)>& u, const Vec& t,
        const std::vector<double>& corners) {
  Mat y = Mat::Zero(t.size(), g.outputs());
  const double end = t.size() > 0 ? t[t.size() - 1] : 0;
  if (!(end > 0)) return y;
  MethodOfSteps steps(g, u);
  const std::vector<double> ends = panel_ends(g, corners, end, steps.norm());
  for (std::size_t k = 0; k + 1 < ends.size(); ++k) {
    if (k % 64 == 0) poll_interrupt();
    steps.advance(ends[k], ends[k + 1]);
  }
  for (Index k = 0; k < t.size(); ++k)
    // right-continuous, like responses without delay: a step has occurred at t = 0; a shift above rounding of
    // times and below same_time
    y.row(k) = steps.at(std::min(end, t[k] + 1e-13 * end)).head(g.outputs()).transpose();
  return y;
}

void check_times(const Vec& t) {
  for (Index k = 0; k < t.size(); ++k)
    if (!(t[k] >= 0) || (k > 0 && !(t[k] > t[k - 1])))
      throw Error("times must begin at 0 or later and increase");
}

Response empty_response(const DelaySystem& g, const std::string& kind, const Vec& t) {
  Response r;
  r.kind = kind;
  System shape = make_gain(MatX::Zero(g.outputs(), g.inputs()));
  r.system = std::make_shared<const System>(std::move(shape));
  r.t = t;
  r.settles = true;  // no statement about its poles
  return r;
}

}  // namespace

Response step(const DelaySystem& g, const Vec& t) {
  check_times(t);
  Response r = empty_response(g, "step", t);
  const DelaySystem all = general(g);
  for (int j = 0; j < g.inputs(); ++j) {
    const Vec unit = Vec::Unit(g.inputs(), j);
    r.y.push_back(run(all, [&](double) { return unit; }, t, {0}));
    r.x.emplace_back(t.size(), 0);
  }
  return r;
}

Response simulate(const DelaySystem& g, const std::function<Vec(double)>& u, const Vec& t,
                  const std::vector<double>& corners) {
  check_times(t);
  Response r = empty_response(g, "lsim", t);
  std::vector<double> all = corners;
  all.push_back(0);
  r.y.push_back(run(general(g), u, t, all));
  r.x.emplace_back(t.size(), 0);
  return r;
}

}  // namespace pendula::lti
