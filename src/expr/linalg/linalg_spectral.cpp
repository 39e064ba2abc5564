// Exact eigenvalues and exponentials of rational matrices.
#include <algorithm>
#include <map>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/limits/stack.hpp"
#include "base/text.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/fold.hpp"
#include "expr/graph/rational.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::linalg {
namespace {

Mat in_doubles(const MatX& a) {
  return a.unaryExpr([](Expr e) { return constant_value(e); });
}

bool before(const Eigenvalue& a, const Eigenvalue& b) {
  // surds are compared by their decimal values
  const auto number = [](Expr e) { return evaluate({&e, 1}, {})[0]; };
  return std::pair(number(a.re), number(a.im)) < std::pair(number(b.re), number(b.im));
}

/// The rational eigenvalues with multiplicity; `rest` receives the remaining factor of
/// the characteristic polynomial.
std::vector<mpq_class> rational_eigenvalues(const MatX& a, std::vector<mpq_class>& rest) {
  rest = rational::characteristic(a);
  const Vec re = eigensystem(in_doubles(a)).re;
  return rational::divide_rational_roots(rest, {re.data(), re.data() + re.size()});
}

/// √q as k √n with n free of small square factors.
Expr square_root(const mpq_class& q) {
  mpz_class n = q.get_num() * q.get_den(), k = 1;  // √(a/b) = √(a b)/b
  for (unsigned long p = 2; p <= largest_trial_divisor && mpz_class(p) * p <= n; ++p) {
    while (mpz_divisible_ui_p(n.get_mpz_t(), p * p)) {
      n /= p * p;
      k *= p;
    }
  }
  mpq_class factor(k, q.get_den());
  factor.canonicalize();
  return Expr(factor) * sqrt(Expr(mpq_class(n)));
}

/// s² + b s + c = 0
void add_quadratic(const std::vector<mpq_class>& p, std::vector<Eigenvalue>& values) {
  const mpq_class discriminant = p[1] * p[1] / 4 - p[2];
  const Expr centre(mpq_class(-p[1] / 2)), half = square_root(abs(discriminant));
  for (const Expr offset : {-half, half})
    values.push_back(discriminant < 0 ? Eigenvalue{centre, offset} : Eigenvalue{centre + offset, 0});
}

// ── exponentials ──

/// Splits a = r s with r rational and a scalar s, if possible.
struct Scaled {
  MatX r;
  Expr s;
};

/// -2·x/3 -> (-2/3, x)
std::pair<mpq_class, Expr> split(Expr e) {
  check_stack();
  if (const mpq_class* q = exact_value(e)) return {*q, 1};
  if (e.op() == Op::neg) {
    auto [q, core] = split(e.operand(0));
    return {-q, core};
  }
  if (e.op() == Op::mul)
    for (int i : {0, 1})
      if (const mpq_class* q = exact_value(e.operand(i))) {
        auto [inner, core] = split(e.operand(1 - i));
        return {*q * inner, core};
      }
  if (e.op() == Op::div)
    if (const mpq_class* q = exact_value(e.operand(1))) {
      auto [inner, core] = split(e.operand(0));
      return {inner / *q, core};
    }
  return {1, e};
}

std::optional<Scaled> scaled(const MatX& a) {
  Scaled result{MatX::Zero(a.rows(), a.cols()), 1};
  bool first = true;
  for (Eigen::Index k = 0; k < a.size(); ++k) {
    const Expr e = a.data()[k];
    if (e.is_zero()) continue;
    const auto [q, core] = split(e);
    if (!first && core != result.s) return {};
    result.r.data()[k] = Expr(q);
    result.s = core;
    first = false;
  }
  return result;
}

MatX product(const MatX& a, const MatX& b) {
  MatX c = MatX::Zero(a.rows(), b.cols());
  for (Eigen::Index i = 0; i < a.rows(); ++i)
    for (Eigen::Index k = 0; k < a.cols(); ++k) {
      poll_interrupt();
      if (!a(i, k).is_zero())
        for (Eigen::Index j = 0; j < b.cols(); ++j) c(i, j) += a(i, k) * b(k, j);
    }
  return c;
}

bool all_zero(const MatX& a) {
  return std::all_of(a.data(), a.data() + a.size(), [](Expr e) { return e.is_zero(); });
}

/// I + a + a²/2! + …, if aⁿ = 0.
std::optional<MatX> nilpotent_exponential(const MatX& a) {
  MatX power = MatX::Identity(a.rows(), a.cols()), total = power;
  for (Eigen::Index k = 1; k <= a.rows(); ++k) {
    power = product(power, a);
    if (all_zero(power)) return total;
    power = power.unaryExpr([&](Expr e) { return e / Expr(static_cast<long>(k)); });
    total += power;
  }
  return {};
}

/// Σ over λ of p_λ(t) e^{λt}, p by ascending powers.
using ExpPolynomial = std::map<mpq_class, std::vector<mpq_class>>;

/// r with r′ = λ r + f, r(0) = 0.
ExpPolynomial integrate(const mpq_class& lambda, const ExpPolynomial& f) {
  ExpPolynomial r;
  for (const auto& [mu, p] : f) {
    std::vector<mpq_class> q(p.size() + 1);
    const mpq_class d = mu - lambda;
    if (d == 0) {  // q′ = p
      for (std::size_t k = 0; k < p.size(); ++k) q[k + 1] = p[k] / static_cast<unsigned long>(k + 1);
      auto& slot = r[lambda];
      slot.resize(std::max(slot.size(), q.size()));
      for (std::size_t k = 0; k < q.size(); ++k) slot[k] += q[k];
      continue;
    }
    q.pop_back();  // q′ + d q = p, from the highest power down; then r(0) = 0 by adding a multiple of e^{λt}
    for (std::size_t k = p.size(); k-- > 0;)
      q[k] = (p[k] -
              (k + 1 < q.size() ? mpq_class(q[k + 1] * static_cast<unsigned long>(k + 1)) : mpq_class(0))) /
             d;
    auto& slot = r[mu];
    slot.resize(std::max(slot.size(), q.size()));
    for (std::size_t k = 0; k < q.size(); ++k) slot[k] += q[k];
    auto& start = r[lambda];
    start.resize(std::max<std::size_t>(start.size(), 1));
    start[0] -= q[0];
  }
  return r;
}

Expr value_of(const ExpPolynomial& r, Expr s) {
  Expr sum = 0;
  for (const auto& [lambda, p] : r) {
    Expr polynomial = 0;
    for (std::size_t k = 0; k < p.size(); ++k) polynomial += Expr(p[k]) * pow(s, Expr(static_cast<long>(k)));
    sum += polynomial * exp(Expr(lambda) * s);
  }
  return sum;
}

}  // namespace

Vec characteristic(const Mat& a) {
  if (a.rows() != a.cols())
    throw Error(text("the matrix must be square, not a ", a.rows(), "×", a.cols(), " matrix"));
  if (!a.allFinite()) throw Error("the matrix has entries that are not finite numbers");
  const Eigen::Index n = a.rows();
  Vec c = Vec::Zero(n + 1);
  c[0] = 1;
  constexpr Eigen::Index most_exact = 40;  // a choice: doubles as coefficients say little beyond it
  if (n <= most_exact) {
    const auto exact =
        rational::characteristic(MatX(a.unaryExpr([](double v) { return Expr(mpq_class(v)); })));
    for (Eigen::Index k = 0; k <= n; ++k) c[k] = exact[k].get_d();
    return c;
  }
  const Eigensystem e = eigensystem(a);
  Eigen::VectorXcd p = Eigen::VectorXcd::Zero(n + 1);
  p[0] = 1;
  for (Eigen::Index k = 0; k < n; ++k)
    for (Eigen::Index i = k + 1; i > 0; --i) p[i] -= std::complex(e.re[k], e.im[k]) * p[i - 1];
  return p.real();
}

std::optional<std::vector<Eigenvalue>> exact_eigenvalues(const MatX& a) {
  std::vector<mpq_class> rest;
  std::vector<Eigenvalue> values;
  for (const mpq_class& q : rational_eigenvalues(a, rest)) values.push_back({Expr(q), 0});
  if (rest.size() > 3) return {};
  if (rest.size() == 2)
    values.push_back({Expr(mpq_class(-rest[1])), 0});  // too large to be found near its double
  if (rest.size() == 3) add_quadratic(rest, values);
  std::sort(values.begin(), values.end(), before);
  return values;
}

std::optional<MatX> exact_exponential(const MatX& a) {
  PENDULA_ASSERT(a.rows() == a.cols(), "exponential of a matrix that is not square");
  if (auto finite = nilpotent_exponential(a)) return finite;
  const auto split_matrix = scaled(a);
  if (!split_matrix) return {};
  const auto& [r, s] = *split_matrix;
  std::vector<mpq_class> rest;
  std::vector<mpq_class> lambda = rational_eigenvalues(r, rest);
  if (rest.size() == 2) lambda.push_back(-rest[1]);
  if (rest.size() > 2) return {};
  // eᴿˢ = Σ rₖ₊₁(s) Pₖ,  P₀ = I, Pₖ = Pₖ₋₁(R - λₖI),  r₁ = e^{λ₁s}, rₖ₊₁′ = λₖ₊₁rₖ₊₁ + rₖ.
  MatX p = MatX::Identity(r.rows(), r.cols()), total = MatX::Zero(r.rows(), r.cols());
  ExpPolynomial coefficient{{lambda[0], {1}}};
  for (std::size_t k = 0; k < lambda.size(); ++k) {
    if (k > 0) {
      p = product(p, r - MatX(MatX::Identity(r.rows(), r.cols()).unaryExpr([&](Expr e) {
                       return e * Expr(lambda[k - 1]);
                     })));
      coefficient = integrate(lambda[k], coefficient);
    }
    const Expr weight = value_of(coefficient, s);
    total += p.unaryExpr([&](Expr e) { return e * weight; });
  }
  return MatX(total.unaryExpr([](Expr e) { return simplify(e); }));
}

}  // namespace pendula::linalg
