#include "integrate/problem/sensitivity.hpp"

#include <algorithm>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"

namespace pendula::integrate {
namespace {

Expr slot(const std::string& what, int i, int j) {
  return symbol(Kind::slot, text(what, "_", j + 1, "_", i + 1));
}

bool contains(const std::vector<Expr>& list, Expr e) {
  return std::find(list.begin(), list.end(), e) != list.end();
}

}  // namespace

Expr Variational::derivative(Expr e, int j) const {
  const Expr p = with_respect_to[j];
  std::vector<Expr> unknowns(form.x.begin(), form.x.begin() + n);
  unknowns.insert(unknowns.end(), form.xdot.begin(), form.xdot.begin() + n);
  unknowns.insert(unknowns.end(), form.z.begin(), form.z.begin() + m);
  Expr sum = contains(form.p, p) ? partial(e, p) : Expr();
  for (const Entry& entry : sparse_jacobian({&e, 1}, unknowns)) {
    const int c = entry.column;
    sum += entry.value * (c < n ? S(c, j) : c < 2 * n ? S_dot(c - n, j) : Z(c - 2 * n, j));
  }
  return sum;
}

Variational variational(const dae::FirstOrder& form, const std::vector<Expr>& with_respect_to) {
  Variational result;
  result.form = form;
  result.with_respect_to = with_respect_to;
  result.n = static_cast<int>(form.x.size());
  result.m = static_cast<int>(form.z.size());
  dae::FirstOrder& all = result.form;
  const int n = result.n, m = result.m, k = static_cast<int>(with_respect_to.size());
  for (Expr p : with_respect_to)
    if (!contains(form.p, p) && !contains(form.x, p))
      throw Error(text("sensitivities: ", to_text(p), " is neither a parameter nor a state of the model"));
  for (int j = 0; j < k; ++j)
    for (int i = 0; i < n; ++i) {
      all.x.push_back(slot("S", i, j));
      all.xdot.push_back(slot("dS", i, j));
    }
  for (int j = 0; j < k; ++j)
    for (int i = 0; i < m; ++i) all.z.push_back(slot("Z", i, j));
  const std::vector<Expr> F = form.F, f = form.f, g = form.g;
  all.label.resize(F.size());
  all.sides.resize(F.size());
  for (int j = 0; j < k; ++j) {
    const std::string name = to_text(with_respect_to[j]);
    for (std::size_t i = 0; i < F.size(); ++i) {
      all.F.push_back(result.derivative(F[i], j));
      all.label.push_back(
          text("the sensitivity to ", name, " of ", form.label.size() > i ? form.label[i] : "an equation"));
    }
    for (Expr e : f) all.f.push_back(result.derivative(e, j));
    for (Expr e : g) all.g.push_back(result.derivative(e, j));
  }
  return result;
}

Mat initial_sensitivity(const Variational& model, const std::vector<Expr>& conditions,
                        const std::vector<char>& held, const std::unordered_map<Expr, double>& values) {
  const int n = model.n, k = static_cast<int>(model.with_respect_to.size());
  Mat wanted = Mat::Zero(n, k);
  const std::vector<Expr> x(model.form.x.begin(), model.form.x.begin() + n);
  std::vector<char> kept = held;
  kept.resize(static_cast<std::size_t>(n), 1);
  for (int j = 0; j < k; ++j) {
    const auto at = std::find(x.begin(), x.end(), model.with_respect_to[j]);
    if (at != x.end()) {
      wanted(at - x.begin(), j) = 1;
      kept[at - x.begin()] = 1;
    }
  }
  if (conditions.empty()) return wanted;
  const auto rows = static_cast<Eigen::Index>(conditions.size());
  Mat C = Mat::Zero(rows, n), right = Mat::Zero(rows, k);
  for (const Entry& e : sparse_jacobian(conditions, x))
    C(e.row, e.column) = evaluate({&e.value, 1}, values)[0];
  for (int j = 0; j < k; ++j) {
    const Expr p = model.with_respect_to[j];
    if (contains(x, p)) continue;
    for (Eigen::Index i = 0; i < rows; ++i) {
      const Expr slope = partial(conditions[i], p);
      right(i, j) = -evaluate({&slope, 1}, values)[0];
    }
  }
  // dx = C⁺ r + N w, with w such that the fixed states change as little as possible from the wanted values
  const Eigen::JacobiSVD<Mat> svd(C, Eigen::ComputeThinU | Eigen::ComputeFullV);
  constexpr double dependent = 1e-9;  // of σ₁: rounding is far below, and smaller σ would amplify r by 10⁹
  const double smallest = dependent * (svd.singularValues().size() > 0 ? svd.singularValues()[0] : 0);
  const auto rank = (svd.singularValues().array() > smallest).count();
  const Mat particular = C.completeOrthogonalDecomposition().solve(right);
  const Mat N = svd.matrixV().rightCols(n - rank);
  Mat weights = Mat::Zero(n, n);
  for (int i = 0; i < n; ++i) weights(i, i) = kept[i] ? 1 : 0;
  if (N.cols() == 0) return particular;
  const Mat w =
      Mat(weights * N).completeOrthogonalDecomposition().solve(Mat(weights * (wanted - particular)));
  return particular + N * w;
}

}  // namespace pendula::integrate
