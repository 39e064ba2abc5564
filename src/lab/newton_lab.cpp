#include "lab/newton_lab.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "integrate/solve/newton.hpp"

namespace pendula::lab {
namespace {

using Eigen::Index;
constexpr double smallest_step = 1.0 / (1 << 20);  // 10⁻⁶: shorter steps hardly move x
constexpr int longest_cycle = 12;                  // a choice: longer ones look like chaos in a table
constexpr int largest_inverse = 50;                // a choice: n³ operations per row for its last column
constexpr double same_point = 1e-10;  // of 1 + ‖x‖: a cycle, which attracts, is as good as exact
constexpr double same_root = 1e-5;    // of 1 + ‖x‖: double roots are found to √tol = 10⁻⁶

class Iteration {
 public:
  Iteration(const NumericFunction& r, const NewtonSettings& settings, const Vec& start)
      : r_(r), settings_(settings), x_(start), residual_(r.outputs), M_(r.outputs, r.n()), step_(r.n()) {
    blur_ = Vec::Zero(r.n());
    far_ = 1e10 * (1 + start.norm());  // a choice: from there no root is found with any digit of the start
  }

  NewtonRun run() {
    r_.value(x_, residual_);
    while (true) {
      poll_interrupt();
      if (!residual_.allFinite()) return end(Ending::undefined);
      matrix();
      record();
      if (settled()) return end(Ending::converged);
      if (!M_.allFinite()) return end(Ending::undefined);
      if (run_.iterations() >= most()) return end(Ending::exhausted);
      if (!lu_.factorise(M_)) return singular();
      lu_.solve(residual_, step_);
      step_ = -step_;
      find_blur();
      if (!step_.allFinite()) return singular();
      if (!advance()) return end(Ending::stuck);
      if (x_.norm() > far_ || !x_.allFinite()) return record_last(Ending::diverged);
      if (const int p = period()) {
        run_.period = p;
        return record_last(Ending::cycle);
      }
    }
  }

 private:
  int most() const {
    if (settings_.max > 0) return settings_.max;
    // full steps that converge need a few; damped ones, which leave 1 - α of the error, 28/α for 10⁻¹²
    constexpr int usual = 100, most_damped = 100'000;
    return settings_.line_search ? usual
                                 : static_cast<int>(std::min<double>(usual / settings_.alpha, most_damped));
  }

  void matrix() {
    switch (settings_.jacobian) {
      case JacobianKind::exact:
        r_.jacobian(x_, M_);
        break;
      case JacobianKind::given:
        settings_.given(x_, M_);
        break;
      case JacobianKind::frozen:
        if (run_.x.empty()) derivative(x_, M_);
        break;
      case JacobianKind::finite_difference:
        difference_jacobian(r_, x_, residual_, settings_.difference, M_);
        break;
    }
  }
  void derivative(const Vec& x, Mat& J) {
    if (r_.jacobian)
      r_.jacobian(x, J);
    else
      difference_jacobian(r_, x, residual_, settings_.difference, J);
  }

  void record() {
    run_.x.push_back(x_);
    run_.norm.push_back(residual_.norm());
    // |∂rᵢ/∂xⱼ xⱼ| is the size of the terms of rᵢ; values of a few roundings of them are
    // indistinguishable from zero
    const double terms = M_.allFinite() ? (M_.cwiseAbs() * x_.cwiseAbs()).norm() : 0;
    run_.noise.push_back(rounding_of_terms * terms);
    run_.blur.push_back(blur_);
  }
  /// The uncertainty of x: the rounding error of the residual, multiplied by M⁻¹.
  void find_blur() {
    blur_ = eps * x_.cwiseAbs();
    if (M_.rows() <= largest_inverse)
      blur_ += inverse_by_lu(M_).cwiseAbs() * (2 * eps * (M_.cwiseAbs() * x_.cwiseAbs()));
  }
  bool settled() const { return run_.norm.back() <= settings_.tol || run_.norm.back() <= run_.noise.back(); }

  /// x ← x + α Δx; false if the line search finds no α.
  bool advance() {
    if (!settings_.line_search) {
      x_ += settings_.alpha * step_;
      run_.alpha.push_back(settings_.alpha);
      r_.value(x_, residual_);
      return true;
    }
    const Vec from = x_;
    const double before = run_.norm.back();
    for (double alpha = 1; alpha >= smallest_step; alpha /= 2) {
      x_ = from + alpha * step_;
      r_.value(x_, residual_);
      if (!residual_.allFinite() || residual_.norm() > (1 - alpha / 4) * before) continue;
      run_.alpha.push_back(alpha);
      return true;
    }
    x_ = from;
    r_.value(x_, residual_);
    return false;
  }

  /// The period of a cycle of the last iterates (the map x ↦ x₊ is the same in every iteration).
  int period() const {
    const auto k = static_cast<int>(run_.x.size());  // x_ is iterate k, not yet recorded
    const double close = same_point * (1 + x_.norm());
    if (settings_.line_search) return 0;
    for (int p = 2; p <= longest_cycle && 2 * p <= k + 1; ++p) {
      if ((x_ - at(k - p)).norm() > close || (at(k - 1) - at(k - 1 - p)).norm() > close) continue;
      if ((x_ - at(k - 1)).norm() > 1e4 * close) return p;  // steps that are no convergence
    }
    return 0;
  }
  const Vec& at(int k) const { return run_.x[std::max(k, 0)]; }

  NewtonRun record_last(Ending ending) {
    if (residual_.allFinite()) {
      run_.x.push_back(x_);
      run_.norm.push_back(residual_.norm());
      run_.noise.push_back(0);
      run_.blur.push_back(blur_);
    } else {
      run_.alpha.pop_back();
    }
    return end(ending);
  }
  /// Do the iterates diverge? Then a singular Jacobian far away is not the cause.
  bool is_running_away() const {
    const std::size_t k = run_.x.size();
    constexpr double far = 5, growing = 2;  // choices: relative to the start; relative to two steps before
    if (k < 2 || !(x_.norm() > far * (1 + run_.x.front().norm()))) return false;
    return x_.norm() > growing * run_.x[k - 2].norm();
  }
  NewtonRun singular() {
    if (is_running_away()) return end(Ending::diverged);
    run_.null_vector = conditioning(M_).null_vector;
    return end(Ending::singular);
  }
  NewtonRun end(Ending ending) {
    run_.ending = ending;
    if (ending == Ending::undefined) {
      run_.explanation = r_.undefined ? r_.undefined(x_) : "";
      if (run_.x.empty() || !residual_.allFinite()) {  // a point without a residual is an iterate as well
        run_.x.push_back(x_);
        run_.norm.push_back(std::numeric_limits<double>::quiet_NaN());
        run_.noise.push_back(0);
        run_.blur.push_back(blur_);
      }
    }
    return std::move(run_);
  }

  const NumericFunction& r_;
  const NewtonSettings& settings_;
  Vec x_, residual_, blur_;
  Mat M_;
  Vec step_;
  integrate::ScaledLU lu_;
  double far_;
  NewtonRun run_;
};

}  // namespace

const char* ending_name(Ending ending) {
  const char* const names[] = {"converged", "singular Jacobian",   "cycle",   "diverged",
                               "undefined", "line search stalled", "no root", "not converged"};
  return names[static_cast<int>(ending)];
}

NewtonRun iterate(const NumericFunction& r, const NewtonSettings& settings, const Vec& start) {
  PENDULA_ASSERT(r.outputs == r.n() && start.size() == r.n(),
                 "Newton's method on a system that is not square");
  return Iteration(r, settings, start).run();
}

Basins basins(const NumericFunction& r, const NewtonSettings& settings, const Vec& first, const Vec& second) {
  PENDULA_ASSERT(r.n() == 2, "basins of a system that has not two unknowns");
  Basins result{{},
                Eigen::MatrixXi::Zero(first.size(), second.size()),
                Eigen::MatrixXi::Zero(first.size(), second.size()),
                first,
                second};
  std::vector<Vec> found;
  for (Index j = 0; j < second.size(); ++j)
    for (Index i = 0; i < first.size(); ++i) {
      const NewtonRun run = iterate(r, settings, Vec(Eigen::Vector2d(first[i], second[j])));
      result.iterations(i, j) = run.iterations();
      if (!run.converged()) continue;
      const Vec& x = run.x.back();
      const auto same = [&](const Vec& root) { return (x - root).norm() <= same_root * (1 + root.norm()); };
      auto it = std::find_if(found.begin(), found.end(), same);
      if (it == found.end()) it = found.insert(found.end(), x);
      result.root(i, j) = static_cast<int>(it - found.begin()) + 1;
    }
  // The order of the roots must not depend on the first point of the grid.
  std::vector<int> order(found.size()), place(found.size() + 1, 0);
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<int>(k);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const Vec &p = found[a], &q = found[b];
    return std::fabs(p[0] - q[0]) > same_root * (1 + std::fabs(p[0])) ? p[0] < q[0] : p[1] < q[1];
  });
  for (std::size_t k = 0; k < order.size(); ++k) {
    place[order[k] + 1] = static_cast<int>(k) + 1;
    result.roots.push_back(found[order[k]]);
  }
  for (int& root : result.root.reshaped()) root = place[root];
  return result;
}

}  // namespace pendula::lab
