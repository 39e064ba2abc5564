// Derivatives at a start that its model does not contain, such as z′ of an algebraic variable, computed from
// the equations and their derivatives.
#include "dae/start/start_derivatives.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/decompositions.hpp"
#include "base/math.hpp"
#include "dae/points/derivative_array.hpp"
#include "dae/rank/rank_with_gap.hpp"

namespace pendula::dae {
namespace {

using Eigen::Index;

/// The equations differentiated k times, as a linear problem for the unknown derivatives; nonlinear ones take
/// several Gauss–Newton steps.
class Extension {
 public:
  Extension(const DerivativeArray& array, const std::unordered_map<Expr, double>& known)
      : rows_(array.rows()), point_(known) {
    for (Expr leaf : leaves(rows_)) {
      if (known.count(leaf) || symbol_of(leaf).kind != Kind::variable) continue;
      unknowns_.push_back(leaf);
      point_[leaf] = 0;
    }
  }

  /// The values of `wanted` if the equations determine all of them.
  std::optional<std::vector<double>> values(const std::vector<Expr>& wanted) {
    std::vector<Index> places;
    for (Expr leaf : wanted) {
      const auto at = std::find(unknowns_.begin(), unknowns_.end(), leaf);
      if (at == unknowns_.end()) return {};
      places.push_back(at - unknowns_.begin());
    }
    const auto entries = sparse_jacobian(rows_, unknowns_);
    const Balance scale = balance(numbers(entries));
    constexpr int steps = 8;            // Newton steps; a linear level takes one
    constexpr double accuracy = 1e-13;  // of all unknowns, relative to their units
    for (int step = 1;; ++step) {
      const Mat J = scale(numbers(entries));
      const Eigen::CompleteOrthogonalDecomposition<Mat> decomposition(J);
      const Vec d = decomposition.solve(Vec(-scale.rows.cwiseProduct(residual())));
      if (!d.allFinite()) return {};
      for (std::size_t i = 0; i < unknowns_.size(); ++i) point_[unknowns_[i]] += d[i] * scale.columns[i];
      const Vec x = point().cwiseQuotient(scale.columns);
      if (step < steps && d.norm() > accuracy * x.norm()) continue;
      if (!determined(decomposition, J, places) || !solved(J, x, scale.rows.cwiseProduct(residual())))
        return {};
      std::vector<double> found;
      for (Index i : places)
        found.push_back(std::fabs(x[i]) > accuracy * x.norm() ? x[i] * scale.columns[i] : 0);
      return found;
    }
  }

 private:
  Vec point() const {
    Vec x(static_cast<Index>(unknowns_.size()));
    for (std::size_t i = 0; i < unknowns_.size(); ++i) x[i] = point_.at(unknowns_[i]);
    return x;
  }
  Vec residual() const {
    return Eigen::Map<const Vec>(evaluate(rows_, point_).data(), static_cast<Index>(rows_.size()));
  }
  Mat numbers(const std::vector<Entry>& entries) const {
    std::vector<Expr> expressions;
    for (const Entry& e : entries) expressions.push_back(e.value);
    const auto values = evaluate(expressions, point_);
    Mat J = Mat::Zero(static_cast<Index>(rows_.size()), static_cast<Index>(unknowns_.size()));
    for (std::size_t k = 0; k < entries.size(); ++k) J(entries[k].row, entries[k].column) = values[k];
    return J;
  }
  /// Unknown i is determined if the null space of J has no component along it: (J⁺ J)ᵢᵢ = 1.
  static bool determined(const Eigen::CompleteOrthogonalDecomposition<Mat>& decomposition, const Mat& J,
                         const std::vector<Index>& places) {
    constexpr double visible = 1e-9;  // (J⁺ J)ᵢᵢ = 1 - the square of the component in the null space
    return std::all_of(places.begin(), places.end(), [&](Index i) {
      return std::fabs(Vec(decomposition.solve(Vec(J.col(i))))[i] - 1) < visible;
    });
  }

  /// Do the rows hold? They do not if pivots were taken for 0. Known values satisfy the equations to 10⁻¹⁰ of
  /// their terms, and derivatives to some digits less.
  static bool solved(const Mat& J, const Vec& x, const Vec& r) {
    // relative to the terms of the row; relative to the largest unknown
    constexpr double visible = 1e-6, rounding = 1e-12;
    const Mat size = J.cwiseAbs();
    const Vec terms =
        visible * size * x.cwiseAbs() + rounding * x.lpNorm<Eigen::Infinity>() * size.rowwise().sum();
    return (r.cwiseAbs().array() <= terms.array() || size.rowwise().sum().array() == 0).all();
  }

  std::vector<Expr> rows_, unknowns_;
  std::unordered_map<Expr, double> point_;
};

}  // namespace

bool add_derivatives(const Model& model, const std::vector<Expr>& wanted, const Substitution& inputs,
                     std::unordered_map<Expr, double>& values) {
  constexpr int deepest = 8;         // differentiations; practical models have an index of at most 5
  constexpr std::size_t most = 400;  // equations: an orthogonal decomposition of them per differentiation
  std::vector<Expr> residuals = model.residuals;
  if (residuals.size() > most) return false;
  if (!inputs.empty()) residuals = substitute(residuals, inputs);
  DerivativeArray array(residuals, model.variables);
  for (int k = 1; k <= deepest; ++k) {
    array.extend();
    auto known = values;
    for (Expr leaf : leaves(array.rows())) {
      const Symbol& s = symbol_of(leaf);
      if (s.kind == Kind::variable || s.kind == Kind::constant || known.count(leaf)) continue;
      if (!s.value) return false;  // the derivative of an input that is given by numbers only
      known[leaf] = evaluate(std::span<const Expr>(&*s.value, 1), {})[0];
    }
    if (const auto found = Extension(array, known).values(wanted)) {
      for (std::size_t i = 0; i < wanted.size(); ++i) values[wanted[i]] = (*found)[i];
      return true;
    }
  }
  return false;
}

}  // namespace pendula::dae
