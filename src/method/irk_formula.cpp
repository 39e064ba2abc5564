#include "method/irk_formula.hpp"

#include <array>
#include <cmath>
#include <map>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "method/collocation.hpp"

namespace pendula::integrate {

/// |Im λ|/|λ| of a real eigenvalue: 10¹⁰ times the ε of long double, for condition numbers as large.
static constexpr long double real_eigenvalue = 1e-9L;

using LongMat = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
using LongVec = Eigen::Matrix<long double, Eigen::Dynamic, 1>;

IrkFormula::IrkFormula(TableauPtr rk)
    : tableau(std::move(rk)), s(tableau->stages()), stiffly_accurate(tableau->is_stiffly_accurate()) {
  const LongMat A = tableau->A().cast<long double>();
  const Eigen::FullPivLU<LongMat> lu(A);
  const std::string remedy =
      ": its steps cannot be chosen by the error. Give dt = 0.01 for fixed steps, or take method = \"radau\"";
  if (!lu.isInvertible()) throw Error(text("the method ", tableau->name(), " has a singular A", remedy));
  std::vector<double> sorted(tableau->c().begin(), tableau->c().end());
  sorted.push_back(0);
  std::sort(sorted.begin(), sorted.end());
  constexpr double rounding = 1e-12;  // of nodes in [0, 1], 4500 ε; 256 nodes are 10⁻⁵ apart
  for (std::size_t i = 0; i + 1 < sorted.size(); ++i)
    if (sorted[i + 1] - sorted[i] < rounding)
      throw Error(text("the nodes 0, c₁ … of the method ", tableau->name(), " are not distinct", remedy));
  const LongMat inverse = lu.inverse();
  W = inverse.cast<double>();
  for (double node : tableau->c()) c.push_back(node);

  const Eigen::EigenSolver<LongMat> eigen(inverse);
  const auto scaled = [&](int k) {  // with ones and zeros in the last row of T, as in RADAU5
    Eigen::Matrix<std::complex<long double>, Eigen::Dynamic, 1> v = eigen.eigenvectors().col(k);
    v /= std::complex<long double>(v[s - 1]);
    v[s - 1] = 1;
    return v;
  };
  LongMat basis(s, s);
  has_real = false;
  int filled = 0;
  for (int k = 0; k < s; ++k)
    if (std::fabs(eigen.eigenvalues()[k].imag()) < real_eigenvalue * std::abs(eigen.eigenvalues()[k]) &&
        !has_real) {
      has_real = true;
      gamma = static_cast<double>(eigen.eigenvalues()[k].real());
      basis.col(filled++) = scaled(k).real();
    }
  for (int k = 0; k < s; ++k) {
    if (!(eigen.eigenvalues()[k].imag() > real_eigenvalue * std::abs(eigen.eigenvalues()[k]))) continue;
    pairs.emplace_back(static_cast<double>(eigen.eigenvalues()[k].real()),
                       static_cast<double>(eigen.eigenvalues()[k].imag()));
    basis.col(filled++) = scaled(k).real();
    basis.col(filled++) = scaled(k).imag();
  }
  if (filled != s) throw Error(text("the method ", tableau->name(), " has several real eigenvalues", remedy));
  if (!has_real) gamma = std::abs(pairs[0]);
  T = basis.cast<double>();
  T_inverse = basis.inverse().cast<double>();

  // ŷ: weights γ₀ = 1/γ at 0 and b̂ at the nodes, of order s.
  LongMat powers(s, s);
  LongVec moments(s);
  for (int k = 0; k < s; ++k) {
    for (int i = 0; i < s; ++i) powers(k, i) = k == 0 ? 1 : std::pow(static_cast<long double>(c[i]), k);
    moments[k] = 1.0L / (k + 1) - (k == 0 ? 1.0L / gamma : 0);
  }
  const LongVec b = tableau->b().cast<long double>();
  const LongVec bhat = powers.fullPivLu().solve(moments);
  error = (inverse.transpose() * (bhat - b) * gamma).cast<double>();
  end = (inverse.transpose() * b).cast<double>();
  if (stiffly_accurate) end = Vec::Unit(s, s - 1);

  find_nodes();
  find_last_degrees();
  orthogonalise();
}

void IrkFormula::find_nodes() {
  nodes = {0};
  nodes.insert(nodes.end(), c.begin(), c.end());
  for (std::size_t j = 0; j < nodes.size(); ++j) {
    long double product = 1;
    for (std::size_t k = 0; k < nodes.size(); ++k)
      if (k != j) product *= static_cast<long double>(nodes[j]) - nodes[k];
    barycentric.push_back(static_cast<double>(1 / product));
  }
}

void IrkFormula::orthogonalise() {
  Q_.setZero(s, s);
  R_.setZero(s, s);
  for (int k = 0; k < s; ++k) {  // Gram–Schmidt
    for (int j = 0; j < s; ++j) Q_(j, k) = std::pow(nodes[j] - 1, k + 1);
    for (int twice = 0; twice < 2; ++twice) {
      const Vec part = Q_.leftCols(k).transpose() * Q_.col(k);
      Q_.col(k) -= Q_.leftCols(k) * part;
      R_.col(k).head(k) += part;
    }
    R_(k, k) = Q_.col(k).norm();
    Q_.col(k) /= R_(k, k);
  }
}

void IrkFormula::find_last_degrees() {
  LongMat legendre(s + 1, s + 1);  // values at the nodes, by (k + 1) P_k+1 = (2k + 1) x P_k - k P_k-1
  for (int i = 0; i <= s; ++i) {
    const long double x = 2 * static_cast<long double>(nodes[i]) - 1;
    legendre(i, 0) = 1;
    legendre(i, 1) = x;
    for (int k = 1; k < s; ++k)
      legendre(i, k + 1) = ((2 * k + 1) * x * legendre(i, k) - k * legendre(i, k - 1)) / (k + 1);
  }
  const LongMat coefficients = legendre.fullPivLu().inverse();
  const int rows = std::min(s, most_last_degrees);
  last_degrees.resize(rows, s);
  for (int r = 0; r < rows; ++r)
    for (int i = 0; i < s; ++i) last_degrees(r, i) = static_cast<double>(coefficients(s - r, i + 1));
}

void IrkFormula::lagrange(double theta, double* l) const {
  double product = 1;
  for (std::size_t j = 0; j < nodes.size(); ++j) {
    l[j] = barycentric[j] * product;
    product *= theta - nodes[j];
  }
  product = 1;
  for (std::size_t j = nodes.size(); j-- > 0;) {
    l[j] *= product;
    product *= theta - nodes[j];
  }
}

void IrkFormula::closest(double theta, int q, double* l) const {
  if (q == s) return lagrange(theta, l);
  std::fill_n(l, s, 0.0);
  // values of the orthogonal polynomials at θ
  constexpr int usual = 8;
  std::array<double, usual> few;
  std::vector<double> many(q > usual ? static_cast<std::size_t>(q) : 0);
  double* value = q > usual ? many.data() : few.data();
  double power = 1, sum = 0;
  const double *Q = Q_.data(), *R = R_.data();  // columns of s numbers
  for (int k = 0; k < q; ++k, Q += s, R += s) {
    power *= theta - 1;
    double rest = power;
    for (int i = 0; i < k; ++i) rest -= R[i] * value[i];
    const double v = value[k] = rest / R[k];
    for (int j = 0; j < s; ++j) l[j] += v * Q[j];
  }
  for (int j = 0; j < s; ++j) sum += l[j];
  l[s] = 1 - sum;
}

void IrkFormula::lagrange_slopes(double theta, double* slopes) const {
  for (std::size_t j = 0; j < nodes.size(); ++j) {
    double sum = 0;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      if (i == j) continue;
      double product = barycentric[j];
      for (std::size_t k = 0; k < nodes.size(); ++k)
        if (k != j && k != i) product *= theta - nodes[k];
      sum += product;
    }
    slopes[j] = sum;
  }
}

std::shared_ptr<const IrkFormula> radau_formula(int s) {
  static std::map<int, std::shared_ptr<const IrkFormula>> made;
  auto& formula = made[s];
  if (!formula) formula = std::make_shared<IrkFormula>(std::make_shared<const Tableau>(radau(s)));
  return formula;
}

}  // namespace pendula::integrate
