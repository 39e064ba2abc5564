// Analysis of the iterates: errors, observed order and rate, and an explanation in words.
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/counted.hpp"
#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "lab/newton_lab.hpp"

namespace pendula::lab {
namespace {

using Eigen::Index;
/// Scaled singular value below which a root may be singular: at a double root it is as small as the error of
/// the last iterate, 10⁻⁶; the rate of the steps decides.
constexpr double flat = 1e-3;

double step(const NewtonRun& run, int k) { return (run.x[k + 1] - run.x[k]).norm(); }

/// The ratio of the last two steps; 0 if there are fewer.
double steps_ratio(const NewtonRun& run) {
  const int last = run.iterations();
  return last >= 2 ? step(run, last - 1) / step(run, last - 2) : 0;
}

bool no_root_near(const NewtonRun& run) {
  const int last = run.iterations();
  constexpr double long_step = 1e-3;  // relative: a choice
  return last >= 3 && steps_ratio(run) > contracting &&
         step(run, last - 1) > long_step * (1 + run.x.back().norm());
}

/// ∂r/∂x, by differences if there is no Jacobian.
Mat derivative(const NumericFunction& f, const Vec& x) {
  Mat J(f.outputs, f.n());
  if (f.jacobian) {
    f.jacobian(x, J);
  } else {
    Vec r(f.outputs);
    f.value(x, r);
    difference_jacobian(f, x, r, 0, J);
  }
  return J;
}

/// The text on a run that has been analysed.
class Words {
 public:
  Words(const NumericFunction& r, const NewtonSettings& settings, const NewtonRun& run)
      : r_(r), settings_(settings), run_(run) {}

  std::string converged(const Mat& at_start, const Mat& J) const {
    if (run_.singular_root) return singular_root_words();
    if (run_.predicted.value_or(0) > visibly_linear) return linear_words();
    const bool exact = settings_.jacobian == JacobianKind::exact;
    const std::string conditions =
        text(exact ? "the Jacobian is exact" : "the " + jacobian_words() + " is very nearly exact",
             ", full steps α = 1 are taken, and ∂r/∂x is regular at the solution (condition number ",
             condition_text(run_.condition), ")");
    constexpr double rounding = 1e-12;  // 4500 ε: J is the same at both points
    if (last() == 1 && (J - at_start).norm() <= rounding * J.norm())
      return "Converged in one step: the equations are linear, and a full Newton step solves them exactly.";
    // observed orders: halfway from 2 to 3, and a tenth for the next term; halfway from 1 to 2
    if (run_.observed.order >= 2.6)
      return text("Converged faster than quadratically, observed order ", order_text(),
                  ": the second-order term of the error vanishes at this solution; ", conditions, ".",
                  damping_words());
    if (run_.observed.order >= 1.5)
      return text("Converged quadratically: ‖e₊‖ ≈ ", rounded(run_.observed.rate, 3),
                  " ‖e‖², observed order ", order_text(), "; ", conditions,
                  ". Every step doubles the number of correct digits.", damping_words());
    return text("Converged. Convergence is quadratic in theory, since ", conditions,
                "; the iterates above rounding are too few or too far away to measure the order.",
                damping_words());
  }
  std::string not_converged() const {
    switch (run_.ending) {
      case Ending::singular:
        return singular_words();
      case Ending::cycle:
        return cycle_words();
      case Ending::diverged:
        return text("No convergence: the iterates diverge, ‖x‖ grows to ", rounded(run_.x.back().norm(), 2),
                    " in ", counted(last(), "iteration"),
                    ". Newton's method converges from a neighbourhood of a root only", help());
      case Ending::undefined:
        return text("No convergence: at iterate ", last(), " the equations cannot be evaluated",
                    run_.explanation.empty() ? "" : "; " + run_.explanation,
                    settings_.line_search || last() == 0
                        ? ". Start where they are defined."
                        : ". A step left their domain; alpha = \"line search\" shortens such steps.");
      case Ending::stuck:
        return stuck_words();
      default:
        return exhausted_words();
    }
  }

 private:
  int last() const { return run_.iterations(); }

  std::string jacobian_words() const {
    switch (settings_.jacobian) {
      case JacobianKind::exact:
        return "exact Jacobian";
      case JacobianKind::finite_difference:
        return "finite-difference Jacobian";
      case JacobianKind::frozen:
        return "frozen Jacobian";
      case JacobianKind::given:
        return "given Jacobian";
    }
    return "";
  }
  std::string null_words(const Vec& v) const {
    return r_.n() == 1 ? " (∂r/∂x = 0)" : "; its null vector is " + direction_text(r_.unknowns, v);
  }
  std::string help() const {
    return settings_.line_search ? "; start elsewhere."
                                 : "; start nearer, or shorten the steps with alpha = \"line search\".";
  }
  std::string damping_words() const {
    int damped = 0;
    for (double alpha : run_.alpha) damped += alpha < 1;
    if (!settings_.line_search || damped == 0) return "";
    return text(" The line search shortened ", counted(damped, "step"), "; near the solution α = 1.");
  }

  std::string order_text() const {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%.2f", run_.observed.order);
    return buffer;
  }

  std::string linear_words() const {
    const std::string observed =
        text("Converged linearly: ‖e₊‖ ≈ ",
             rounded(run_.observed.rate > 0 ? run_.observed.rate : *run_.predicted, 3), " ‖e‖, because ");
    const double alpha = run_.alpha.back();
    if (settings_.jacobian == JacobianKind::exact)
      return text(observed, "α = ", rounded(alpha, 6),
                  " < 1: near the solution a damped step leaves the part 1 - α = ", rounded(1 - alpha, 6),
                  " of the error. Full steps α = 1 would converge quadratically.");
    const std::string whose = settings_.jacobian == JacobianKind::frozen  ? "frozen at the start"
                              : settings_.jacobian == JacobianKind::given ? "the given approximation"
                                                                          : "a coarse difference quotient";
    return text(observed, "the Jacobian M is ", whose,
                alpha < 1 ? text(" and α = ", rounded(alpha, 6), " < 1") : "",
                ": the rate is the spectral radius of I - α M⁻¹ ∂r/∂x, ", rounded(*run_.predicted, 3),
                " at the solution. The exact Jacobian with α = 1 would converge quadratically.");
  }

  std::string singular_root_words() const {
    const double alpha = run_.alpha.back(),
                 q = run_.observed.rate > 0 ? run_.observed.rate : steps_ratio(run_);
    const int multiplicity = static_cast<int>(std::lround(alpha / (1 - q)));
    return text("Converged linearly to a singular solution: ‖e₊‖ ≈ ", rounded(q, 3),
                " ‖e‖, because ∂r/∂x is singular there", null_words(run_.null_vector),
                ". At a root of multiplicity m the rate is 1 - α/m",
                multiplicity >= 2 && multiplicity < 10 ? text(" (here m = ", multiplicity, ")") : "",
                ", and only about one m-th of the digits of x can be found.");
  }

  std::string singular_words() const {
    std::string out = text("No convergence: at iterate ", last(), " the ", jacobian_words(), " is singular",
                           null_words(run_.null_vector),
                           r_.n() > 1 ? ": to first order no equation changes in this direction" : "");
    return text(
        out, settings_.jacobian == JacobianKind::given ? ". Give a regular matrix." : ". Start elsewhere.");
  }

  std::string cycle_words() const {
    constexpr double zero = 1e-9;  // points of a cycle are known to 10⁻¹⁰ (same_point in newton_lab.cpp)
    std::vector<std::string> points;
    for (int i = 0; i < std::min(run_.period, 4); ++i) {
      std::vector<std::string> values;
      const Vec& x = run_.x[last() - run_.period + 1 + i];
      for (Index j = 0; j < std::min<Index>(x.size(), 4); ++j)
        values.push_back(rounded(std::fabs(x[j]) < zero * std::max(1.0, x.norm()) ? 0 : x[j], 6));
      points.push_back("(" + join(values, ", ") + (x.size() > 4 ? ", …)" : ")"));
    }
    return text("No convergence: the iterates run through a cycle of period ", run_.period, ": ",
                join(points, " → "), run_.period > 4 ? " → …" : "", help());
  }

  std::string stuck_words() const {
    const Mat J = derivative(r_, run_.x.back());
    const Conditioning c = conditioning(J, derivative(r_, run_.x.front()).cwiseAbs());
    const std::string where = text("No convergence: at iterate ", last(),
                                   " no step along Δx reduces ‖r‖ = ", rounded(run_.norm.back(), 3));
    if (c.smallest < flat)
      return text(where, ": a minimum of ‖r‖ that is not a root. ∂r/∂x is nearly singular there",
                  null_words(c.null_vector), ". Start elsewhere.");
    return text(where,
                settings_.jacobian == JacobianKind::exact
                    ? ". Start elsewhere."
                    : ": the approximate Jacobian gives no direction of descent. Use jacobian = \"exact\".");
  }

  std::string exhausted_words() const {
    const std::string start =
        text("Not converged after ", counted(last(), "iteration"), ": ‖r‖ = ", rounded(run_.norm.back(), 3));
    const int back = std::min(5, last());
    const auto end = static_cast<std::size_t>(last());
    bool falling = back > 0;
    for (int k = 0; k < back; ++k) {
      const auto i = end - static_cast<std::size_t>(k);
      falling = falling && run_.norm[i] < run_.norm[i - 1];
    }
    if (!falling) return text(start, " and it does not fall steadily: perhaps there is no root near", help());
    const double q =
        std::pow(run_.norm[end] / run_.norm[end - static_cast<std::size_t>(back)], 1.0 / std::max(1, back));
    const double more = std::ceil(std::log(settings_.tol / run_.norm[end]) / std::log(q));
    constexpr double stands_still = 0.9999, most = 1e5;  // a rate or number of iterations beyond patience
    if (q < stands_still && more < most)
      return text(start, " still falls by the factor ", rounded(q, 3), " per iteration; about ",
                  counted(static_cast<int>(more), "more iteration"), " would be needed: raise max.");
    return text(start, " falls by the factor ", rounded(q, 5), " per iteration, too slowly to converge",
                help());
  }

  const NumericFunction& r_;
  const NewtonSettings& settings_;
  const NewtonRun& run_;
};

/// Finds the limit of the iterates, measures errors and rate relative to it, and explains them.
class Judge {
 public:
  Judge(const NumericFunction& r, const NewtonSettings& settings, NewtonRun& run)
      : r_(r), settings_(settings), run_(run), root_(run.x.back()) {}

  void converged() {
    if (no_root_near(run_)) {
      run_.ending = Ending::vanishing;
      run_.verdict =
          text("No root is near: ‖r‖ falls below tol, but the steps do not become shorter (the last one is ",
               rounded(step(run_, last() - 1), 3), " long); r tends to zero only as x moves away.");
      return;
    }
    if (last() == 0) {
      run_.verdict = "Nothing to do: the start satisfies the equations within tol.";
      return;
    }
    const Mat at_start = derivative(r_, run_.x.front()), J = derivative(r_, root_);
    const Conditioning here = conditioning(J, at_start.cwiseAbs());
    // a double root with α = 1 has 1/2, higher ones more; quadratic convergence has 0
    constexpr double slow = 0.3;
    run_.singular_root = here.smallest < flat && last() > 2 && steps_ratio(run_) > slow;
    if (run_.singular_root) {
      run_.null_vector = here.null_vector;
      extrapolate();
    } else {
      polish();
    }
    const Mat final_J = derivative(r_, root_);
    run_.condition = conditioning(final_J).condition();
    predict(final_J);
    measure(final_J);
    run_.verdict = Words(r_, settings_, run_).converged(at_start, final_J);
  }

 private:
  int last() const { return run_.iterations(); }

  /// x⋆ by exact full steps from the last iterate, as long as they become shorter.
  void polish() {
    Vec r(r_.outputs);
    double previous = std::numeric_limits<double>::infinity();
    constexpr int most = 60;  // a cap: the steps must become shorter
    for (int k = 0; k < most; ++k) {
      r_.value(root_, r);
      const Vec correction = derivative(r_, root_).partialPivLu().solve(r);
      const double length = correction.norm();
      if (!std::isfinite(length) || length >= previous) return;
      root_ -= correction;
      previous = length;
      if (length <= 2 * eps * root_.norm()) return;
    }
  }

  /// x⋆ of a linearly convergent sequence, by the remainder of the geometric series (Aitken).
  void extrapolate() {
    const double q = std::min(steps_ratio(run_), 0.99);  // the remainder is at most 99 steps
    const auto k = static_cast<std::size_t>(last());
    root_ = run_.x[k] + (run_.x[k] - run_.x[k - 1]) * (q / (1 - q));
  }

  /// The matrix of the last step at the root, and the spectral radius of I - α M⁻¹ J there.
  void predict(const Mat& J) {
    if (run_.singular_root || !J.allFinite()) return;
    Mat M = J;
    if (settings_.jacobian == JacobianKind::given) settings_.given(root_, M);
    if (settings_.jacobian == JacobianKind::frozen) M = derivative(r_, run_.x.front());
    if (settings_.jacobian == JacobianKind::finite_difference) {
      Vec r(r_.outputs);
      r_.value(root_, r);
      difference_jacobian(r_, root_, r, settings_.difference, M);
    }
    const Mat map = Mat::Identity(J.rows(), J.rows()) - run_.alpha.back() * Mat(M.partialPivLu().solve(J));
    if (map.allFinite()) run_.predicted = map.eigenvalues().cwiseAbs().maxCoeff();
  }

  void measure(const Mat& J) {
    const bool linear = run_.singular_root || run_.predicted.value_or(0) > visibly_linear;
    double noise = 4 * eps * root_.norm();
    if (run_.singular_root)  // the extrapolated x⋆ is not better than the last iterates
      // so that errors above five times the last one are measured
      noise = 5 * (run_.x.back() - root_).norm() / above_noise;
    else
      noise += (inverse_by_lu(J).cwiseAbs() * (rounding_of_terms * (J.cwiseAbs() * root_.cwiseAbs()))).norm();
    run_.observed = observe(run_.x, root_, noise, linear);
  }

  const NumericFunction& r_;
  const NewtonSettings& settings_;
  NewtonRun& run_;
  Vec root_;
};

}  // namespace

void judge(const NumericFunction& r, const NewtonSettings& settings, NewtonRun& run) {
  if (run.converged())
    Judge(r, settings, run).converged();
  else
    run.verdict = Words(r, settings, run).not_converged();
}

}  // namespace pendula::lab
