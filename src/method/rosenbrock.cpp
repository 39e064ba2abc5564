#include "method/rosenbrock.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "method/trees.hpp"

namespace pendula::integrate {
namespace {

constexpr mp_bitcnt_t bits = 256;  // conditions on coefficients to 2⁻¹⁰⁰ after products of up to six of them
constexpr int largest_order = 6;  // of methods in the literature; the trees of higher ones are not searched

RealMatrix zero_matrix(int s) { return RealMatrix(s, bits); }

RealMatrix product(const RealMatrix& a, const RealMatrix& b) {
  const int s = a.size();
  RealMatrix c = zero_matrix(s);
  for (int i = 0; i < s; ++i)
    for (int j = 0; j < s; ++j)
      for (int k = 0; k < s; ++k) c(i, j) += a(i, k) * b(k, j);
  return c;
}

/// The inverse of a lower triangular matrix without zeros on its diagonal.
RealMatrix inverse_of_lower(const RealMatrix& L) {
  const int s = L.size();
  RealMatrix X = zero_matrix(s);
  for (int j = 0; j < s; ++j) {
    X(j, j) = 1 / L(j, j);
    for (int i = j + 1; i < s; ++i) {
      for (int k = j; k < i; ++k) X(i, j) -= L(i, k) * X(k, j);
      X(i, j) /= L(i, i);
    }
  }
  return X;
}

RealVector times(const RealVector& row, const RealMatrix& M) {
  RealVector result(row.size(), Real(0, bits));
  for (int j = 0; j < M.size(); ++j)
    for (int i = 0; i < M.size(); ++i) result[j] += row[i] * M(i, j);
  return result;
}

RealVector image(const RealMatrix& M, const RealVector& v) {
  RealVector result(v.size(), Real(0, bits));
  for (int i = 0; i < M.size(); ++i)
    for (int j = 0; j < M.size(); ++j) result[i] += M(i, j) * v[j];
  return result;
}

RealVector componentwise(const RealVector& a, const RealVector& b) {
  RealVector result = a;
  for (std::size_t i = 0; i < a.size(); ++i) result[i] *= b[i];
  return result;
}

Real inner(const RealVector& a, const RealVector& b) {
  Real sum(0, bits);
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

/// φ(τ) of all trees: β after a vertex with one child, α after one with several (Thm IV.7.4).
std::vector<RealVector> stage_weights(const RealMatrix& alpha, const RealMatrix& beta, int order) {
  const auto trees = rooted_trees(order);
  std::vector<RealVector> phi;
  for (const RootedTree& tree : trees) {
    RealVector value(static_cast<std::size_t>(alpha.size()), Real(1, bits));
    const RealMatrix& edge = tree.children.size() == 1 ? beta : alpha;
    for (int child : tree.children) value = componentwise(value, image(edge, phi[child]));
    phi.push_back(std::move(value));
  }
  return phi;
}

/// Numbers as the nearest doubles.
Mat rounded_matrix(const RealMatrix& M) {
  Mat result(M.size(), M.size());
  for (int i = 0; i < M.size(); ++i)
    for (int j = 0; j < M.size(); ++j) result(i, j) = rounded_coefficient(M(i, j));
  return result;
}

Vec rounded_vector(const RealVector& v) {
  Vec result(static_cast<Eigen::Index>(v.size()));
  for (std::size_t i = 0; i < v.size(); ++i) result[i] = rounded_coefficient(v[i]);
  return result;
}

}  // namespace

Rosenbrock::Rosenbrock(RosenbrockData data) : data_(std::move(data)) {
  transform();
  decide_orders();
}

void Rosenbrock::transform() {
  const std::string subject = "rosenbrock method '" + data_.name + "'";
  const int s = static_cast<int>(data_.m.size());
  if (s == 0 || data_.A.rows() != s || data_.A.cols() != s || data_.C.rows() != s || data_.C.cols() != s)
    throw Error(subject + ": A, C and m must have one row per stage");
  if (data_.mhat && data_.mhat->size() != s) throw Error(subject + ": mhat must have one entry per stage");
  if (data_.dense.size() > 0 && data_.dense.cols() != s)
    throw Error(subject + ": every row of dense must have one entry per stage");
  double error = 0;
  const auto value = [&](Expr e) { return precise_value(e, bits, error); };
  const Real gamma = value(data_.gamma);
  if (gamma == 0) throw Error(subject + ": gamma must not be 0");
  RealMatrix A = zero_matrix(s), inverse = zero_matrix(s);  // Γ⁻¹ = 1/γ - C
  RealVector m, mhat;
  for (int i = 0; i < s; ++i) {
    inverse(i, i) = 1 / gamma;
    for (int j = 0; j < s; ++j) {
      if (j >= i && !(data_.A(i, j).is_zero() && data_.C(i, j).is_zero()))
        throw Error(text(subject, ": A and C must be strictly lower triangular; row ", i + 1, " is not"));
      if (j >= i) continue;
      A(i, j) = value(data_.A(i, j));
      inverse(i, j) = -value(data_.C(i, j));
    }
    m.push_back(value(data_.m[i]));
    if (data_.mhat) mhat.push_back(value((*data_.mhat)[i]));
  }
  dense_ = Mat(data_.dense.rows(), s);
  for (Eigen::Index i = 0; i < dense_.size(); ++i)
    dense_.data()[i] = rounded_coefficient(value(data_.dense.data()[i]));
  // The error of an order condition with 16-digit coefficients after inversion of Γ: 2⁻⁵³ times
  // a few hundred.
  unit_ = error > 0 ? std::max(512 * error, 0x1p-100) : 0x1p-100;

  real_gamma_ = inverse_of_lower(inverse);
  real_alpha_ = product(A, real_gamma_);
  real_beta_ = real_alpha_;
  for (int i = 0; i < s; ++i)
    for (int j = 0; j <= i; ++j) real_beta_(i, j) += real_gamma_(i, j);
  real_b_ = times(m, real_gamma_);
  if (data_.mhat) real_bhat_ = times(mhat, real_gamma_);

  const RealVector ones(static_cast<std::size_t>(s), Real(1, bits));
  gamma_ = rounded_coefficient(gamma);
  A_ = rounded_matrix(A);
  C_ = -rounded_matrix(inverse);
  C_.diagonal().setZero();
  alphas_ = rounded_matrix(real_alpha_);
  Gamma_ = rounded_matrix(real_gamma_);
  beta_ = rounded_matrix(real_beta_);
  m_ = rounded_vector(m);
  b_ = rounded_vector(real_b_);
  alpha_ = rounded_vector(image(real_alpha_, ones));
  gammas_ = rounded_vector(image(real_gamma_, ones));
  for (int i = 0; i < s; ++i) {  // sums that are 0 or 1 up to the digits of their terms
    for (double exact : {0.0, 1.0})
      if (std::fabs(alpha_[i] - exact) < unit_) alpha_[i] = exact;
    if (std::fabs(gammas_[i]) < unit_) gammas_[i] = 0;
  }
  if (data_.mhat) e_ = rounded_vector(m) - rounded_vector(mhat);
}

namespace {

/// The largest q ≤ limit with Σ bᵢφᵢ(τ) = target(τ) for all |τ| ≤ q.
template <class Target>
int tree_order(const std::vector<RealVector>& phi, const RealVector& b, int limit, double unit,
               const Target& target) {
  const auto trees = rooted_trees(limit);
  for (std::size_t tree = 0; tree < trees.size(); ++tree) {
    Real size(1, bits);
    for (std::size_t i = 0; i < b.size(); ++i) size += abs(b[i] * phi[tree][i]);
    if (abs(inner(b, phi[tree]) - target(trees[tree])) > unit * size) return trees[tree].order - 1;
  }
  return limit;
}

}  // namespace

void Rosenbrock::decide_orders() {
  const std::string subject = "rosenbrock method '" + data_.name + "'";
  const auto phi = stage_weights(real_alpha_, real_beta_, largest_order);
  const auto whole = [](const RootedTree& tree) { return Real(Real(1, bits) / tree.gamma); };
  order_ = tree_order(phi, real_b_, largest_order, unit_, whole);
  if (order_ == 0) throw Error(subject + ": the weights b = mΓ do not sum to 1");
  if (data_.mhat) embedded_order_ = tree_order(phi, real_bhat_, largest_order, unit_, whole);

  // x(θ) - x₀ = Σᵢ bᵢ(θ)kᵢ, power by power of θ: m + d₁, d₂ - d₁, d₃ - d₂, …, -dᵣ (times Γ).
  const int rows = static_cast<int>(data_.dense.rows());
  dense_order_ = rows > 0 ? order_ : 0;
  double error = 0;
  for (int k = 1; k <= rows + 1 && rows > 0; ++k) {
    RealVector column(real_b_.size(), Real(0, bits));
    for (int i = 0; i < stages(); ++i) {
      if (k == 1) column[i] += precise_value(data_.m[i], bits, error);
      if (k <= rows) column[i] += precise_value(data_.dense(k - 1, i), bits, error);
      if (k > 1) column[i] -= precise_value(data_.dense(k - 2, i), bits, error);
    }
    dense_order_ = std::min(
        dense_order_, tree_order(phi, times(column, real_gamma_), order_, unit_, [&](const RootedTree& tree) {
          return tree.order == k ? whole(tree) : Real(0, bits);
        }));
  }

  // Index 1 (§VI.4): a fat vertex with children stands for ω = β⁻¹. Checks the y-condition of order 4 in
  // addition to those of ODEs, and the z-conditions of order 2 and 3; global order q needs y up to q and z up
  // to q - 1.
  const RealMatrix omega = inverse_of_lower(real_beta_);
  const RealVector ones(real_b_.size(), Real(1, bits)), a = image(real_alpha_, ones),
                                                        bw = times(real_b_, omega);
  const auto is = [&](const RealVector& weights, const RealVector& v, const mpq_class& target) {
    Real size(1, bits);
    for (std::size_t i = 0; i < v.size(); ++i) size += abs(weights[i] * v[i]);
    return abs(inner(weights, v) - Real(target, bits)) <= unit_ * size;
  };
  const RealVector a2 = componentwise(a, a), fat = image(real_alpha_, image(omega, a2));
  const bool z2 = is(bw, a2, 1);
  const bool z3 = z2 && is(bw, componentwise(a2, a), 1) && is(bw, componentwise(a, fat), 1) &&
                  is(bw, componentwise(a, image(real_alpha_, image(real_beta_, ones))), mpq_class(1, 2));
  const bool y4 = order_ >= 4 && is(real_b_, componentwise(a, fat), mpq_class(1, 4));
  dae_order_ = std::min(order_, y4 && z3 ? 4 : z2 ? 3 : 2);

  const auto claim = [&](const std::optional<int>& claimed, int found, const char* what) {
    if (claimed && *claimed != found)
      throw Error(
          text(subject, ": ", what, " ", *claimed, " is claimed, but the order conditions give ", found));
  };
  claim(data_.order, order_, "order");
  claim(data_.embedded, embedded_order_, "embedded order");
  claim(data_.dense_order, dense_order_, "dense output of order");
  claim(data_.dae_order, dae_order_, "order for index 1");
}

bool Rosenbrock::is_stiffly_accurate() const {
  const int last = stages() - 1;
  for (int j = 0; j <= last; ++j)
    if (abs(real_beta_(last, j) - real_b_[j]) > unit_ * (1 + abs(real_b_[j]))) return false;
  return alpha_[last] == 1;
}

/// Do the first s of these numbers vanish? R(z) - R̂(z) = Σₖ zᵏ⁺¹ (b - b̂)ᵀ βᵏ 1 + … vanishes with them.
bool Rosenbrock::error_estimate_sees_linear() const {
  const Vec difference = Gamma_.transpose() * *e_;
  Vec power = Vec::Ones(stages());
  for (int k = 0; k < stages(); ++k) {
    const double size = difference.cwiseAbs().dot(power.cwiseAbs());
    constexpr double rounding = 1e-10;  // of the terms: coefficients are often published with 12 digits
    if (std::fabs(difference.dot(power)) > rounding * size) return true;
    power = beta_ * power;
  }
  return false;
}

std::string Rosenbrock::str() const {
  std::string result = text(name(), ": Rosenbrock method, ", stages(), stages() == 1 ? " stage" : " stages",
                            ", order ", order_);
  if (data_.mhat) result += text(" (embedded ", embedded_order_, ")");
  return result + text(", γ = ", rounded(gamma_, 8));
}

std::string Rosenbrock::report() const {
  std::string result = str() + "\n\n";
  const auto table = [&](const char* what, const Mat& M, bool diagonal) {
    Table cells(std::vector<bool>(static_cast<std::size_t>(M.cols()), true));
    for (Eigen::Index i = diagonal ? 0 : 1; i < M.rows(); ++i) {
      std::vector<std::string> row;
      for (Eigen::Index j = 0; j < i + (diagonal ? 1 : 0); ++j) row.push_back(rounded(M(i, j), 6));
      cells.row(std::move(row));
    }
    result += text(what, "\n", cells.str(2));
  };
  table("αᵢⱼ", alphas_, false);
  table("γᵢⱼ", Gamma_, true);
  result += "bᵢ\n ";
  for (double weight : b_) result += " " + rounded(weight, 6);
  result += text("\n\norder            ", order_,
                 " by rooted trees: β = α + γ below a vertex with one child, α below ", "one with several\n");
  if (data_.mhat) result += text("embedded         order ", embedded_order_, ", for the error estimate\n");
  if (dense_order_ > 0) result += text("dense output     order ", dense_order_, "\n");
  result += text("index 1          order ", dae_order_, " for x and z",
                 dae_order_ == 4 && order_ > 4 ? " at least (checked up to 4)" : "", "\n");
  result += text("stiffly accurate ", is_stiffly_accurate() ? "yes: R(∞) = 0, a good z at mesh points" : "no",
                 "\n");
  result += "work per step    one Jacobian, one factorisation, " +
            text(stages(), " solves; no Newton iteration, so the Jacobian must be exact");
  return result;
}

}  // namespace pendula::integrate
