#include "integrate/collocation.hpp"

#include <cmath>

#include <Eigen/Eigenvalues>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "integrate/tableau_text.hpp"

namespace pendula::integrate {
namespace {

constexpr long most_stages = 100;

/// aᵢⱼ = ∫₀^τᵢ ℓⱼ and bⱼ = ∫₀¹ ℓⱼ for Number = mpq_class (exact) or Real. The coefficients of ℓⱼ grow like
/// 6^s and are cancelled again: Real needs 3 s bits more than the result is to have.
template <class Number, class Store>
void collocation_integrals(const std::vector<Number>& node, const Number& zero, const Store& store) {
  const int s = static_cast<int>(node.size());
  std::vector<Number> all(1, zero);  // ∏ (τ - τⱼ), coefficient of τ^k at k
  all[0] += 1;
  for (const Number& root : node) {
    all.push_back(zero);
    for (std::size_t k = all.size() - 1; k > 0; --k) all[k] = all[k - 1] - root * all[k];
    all[0] = -root * all[0];
  }
  for (int j = 0; j < s; ++j) {
    poll_interrupt();
    std::vector<Number> quotient(s, zero);  // ∏ over i ≠ j, by synthetic division
    quotient[s - 1] = all[s];
    for (int k = s - 1; k > 0; --k) quotient[k - 1] = all[k] + node[j] * quotient[k];
    Number scale = zero;
    for (int k = s - 1; k >= 0; --k) scale = scale * node[j] + quotient[k];
    const auto integral = [&](const Number& end) {  // ∫₀^end ℓⱼ
      Number sum = zero;
      for (int k = s - 1; k >= 0; --k) sum = sum * end + quotient[k] / (k + 1);
      sum = sum * end / scale;
      return sum;
    };
    for (int i = 0; i < s; ++i) store(i, j, integral(node[i]));
    Number one = zero;
    one += 1;
    store(s, j, integral(one));
  }
}

Expr exact(const mpq_class& value) { return Expr(value); }

TableauData exact_collocation(const std::vector<mpq_class>& nodes) {
  const Eigen::Index s = static_cast<Eigen::Index>(nodes.size());
  TableauData data;
  data.A = MatX(s, s);
  data.b = VecX(s);
  data.c = VecX(s);
  for (Eigen::Index i = 0; i < s; ++i) (*data.c)[i] = exact(nodes[static_cast<std::size_t>(i)]);
  collocation_integrals<mpq_class>(nodes, mpq_class(0), [&](int i, int j, const mpq_class& value) {
    (i < s ? data.A(i, j) : data.b[j]) = exact(value);
  });
  return data;
}

Tableau precise_collocation(TableauData data, const RealVector& nodes, mp_bitcnt_t bits, double unit) {
  const int s = static_cast<int>(nodes.size());
  Coefficients rk;
  rk.bits = bits;
  rk.unit = unit;
  rk.A = RealMatrix(s, bits);
  rk.b = RealVector(s, Real(0, bits));
  rk.c = nodes;
  collocation_integrals<Real>(
      nodes, Real(0, bits), [&](int i, int j, const Real& value) { (i < s ? rk.A(i, j) : rk.b[j]) = value; });
  data.A = MatX(s, s);
  data.b = VecX(s);
  data.c = VecX(s);
  for (int i = 0; i < s; ++i) {
    for (int j = 0; j < s; ++j) data.A(i, j) = Expr(nearest_double(rk.A(i, j)));
    data.b[i] = Expr(nearest_double(rk.b[i]));
    (*data.c)[i] = Expr(nearest_double(nodes[i]));
  }
  return Tableau(std::move(data), std::move(rk));
}

mp_bitcnt_t digits_for(std::size_t stages) { return 256 + 16 * stages; }

/// The zeros of the Jacobi polynomial P_n^(α,0) in (-1, 1) to double precision: eigenvalues of the symmetric
/// matrix of its recurrence (Golub & Welsch, Math. Comp. 23, 1969).
Vec jacobi_zeros(int n, double alpha) {
  if (n == 0) return Vec();
  Vec diagonal(n), off(n - 1);
  for (int k = 0; k < n; ++k) {
    const double d = 2 * k + alpha;
    diagonal[k] = alpha == 0 ? 0 : -alpha * alpha / (d * (d + 2));
  }
  for (int k = 1; k < n; ++k) {
    const double d = 2 * k + alpha;
    off[k - 1] = std::sqrt(4.0 * k * k * (k + alpha) * (k + alpha) / (d * d * (d + 1) * (d - 1)));
  }
  Eigen::SelfAdjointEigenSolver<Mat> solver;
  solver.computeFromTridiagonal(diagonal, off, Eigen::EigenvaluesOnly);
  return solver.eigenvalues();
}

/// P_n, P_{n-1} and their derivatives at x by the three-term recurrence k P_k = (2k-1) x P_{k-1} - (k-1)
/// P_{k-2}.
struct Legendre {
  Real p, previous, slope, previous_slope;
  Legendre(int n, const Real& x)
      : p(1, x.get_prec()),
        previous(0, x.get_prec()),
        slope(0, x.get_prec()),
        previous_slope(0, x.get_prec()) {
    for (int k = 1; k <= n; ++k) {
      const Real next(((2 * k - 1) * x * p - (k - 1) * previous) / k);
      const Real next_slope(slope * x + k * p);  // P_k′ = x P_{k-1}′ + k P_{k-1}
      previous = p, p = next;
      previous_slope = slope, slope = next_slope;
    }
  }
};

/// Newton on P_s - κ P_{s-1} (κ = 0: Gauss, κ = 1: Radau IIA), from a zero known to double precision: digits
/// double.
Real refine(int s, int kappa, double start, mp_bitcnt_t bits) {
  Real x(start, bits);
  for (int iteration = 0; iteration < 30; ++iteration) {
    const Legendre at(s, x);
    const Real step((at.p - kappa * at.previous) / (at.slope - kappa * at.previous_slope));
    x -= step;
    if (abs(step) <= Real(Real(1, bits) >> (bits - 16))) break;
  }
  return Real((x + 1) / 2, bits);  // from [-1, 1] to [0, 1]
}

void check_stages(const char* name, long stages) {
  if (stages >= 1 && stages <= most_stages) return;
  throw Error(text(name, "(", stages, "): the number of stages must be between 1 and ", most_stages));
}

Tableau drawn(const char* drawing, const std::string& name, const char* note, const char* cite) {
  TableauData data = parse_tableau(drawing);
  data.name = name;
  data.text = note;
  data.cite = cite;
  return Tableau(std::move(data));
}

}  // namespace

Tableau collocation(std::span<const Expr> nodes) {
  if (nodes.empty()) throw Error("needs at least one node: rk.collocation{ \"1/3\", 1 }");
  if (nodes.size() > most_stages) throw Error(text(nodes.size(), " nodes; the limit is ", most_stages));
  const mp_bitcnt_t bits = digits_for(nodes.size());
  double error = 0;
  bool rational = true;
  RealVector values;
  std::vector<mpq_class> fractions;
  for (Expr node : nodes) {
    values.push_back(precise_value(node, bits, error));
    const mpq_class* fraction = exact_value(node);
    rational = rational && fraction;
    if (fraction) fractions.push_back(*fraction);
  }
  for (std::size_t i = 0; i < values.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (nearest_double(values[i]) == nearest_double(values[j]))
        throw Error(text("nodes ", j + 1, " and ", i + 1, " are equal; the nodes must be distinct"));
  TableauData data;
  if (rational) data = exact_collocation(fractions);
  data.name = "collocation";
  data.cite = "Hairer, Nørsett & Wanner, Solving ODEs I, 2nd ed., §II.7";
  if (rational) return Tableau(std::move(data));
  // Whatever the nodes were rounded from, the method is the collocation at these nodes to all digits.
  return precise_collocation(std::move(data), values, bits, std::ldexp(1.0, -128));
}

Tableau gauss(long stages) {
  check_stages("gauss", stages);
  const std::string name = text("gauss(", stages, ")");
  const char* note = "Gauss-Legendre collocation, order 2s: symplectic, symmetric, A-stable, R(∞) = (-1)^s.";
  const char* cite =
      "Kuntzmann 1961; Butcher, Math. Comp. 18, 1964; Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.5";
  const char* exact_forms[] = {"1/2 | 1/2 \n | 1",
                               "1/2-sqrt(3)/6 | 1/4            1/4-sqrt(3)/6 \n"
                               "1/2+sqrt(3)/6 | 1/4+sqrt(3)/6  1/4           \n"
                               "              | 1/2            1/2",
                               "1/2-sqrt(15)/10 | 5/36              2/9-sqrt(15)/15  5/36-sqrt(15)/30 \n"
                               "1/2             | 5/36+sqrt(15)/24  2/9              5/36-sqrt(15)/24 \n"
                               "1/2+sqrt(15)/10 | 5/36+sqrt(15)/30  2/9+sqrt(15)/15  5/36             \n"
                               "                | 5/18              4/9              5/18"};
  if (stages <= 3) return drawn(exact_forms[stages - 1], name, note, cite);
  const int s = static_cast<int>(stages);
  const mp_bitcnt_t bits = digits_for(static_cast<std::size_t>(s));
  RealVector nodes;
  for (double start : jacobi_zeros(s, 0)) nodes.push_back(refine(s, 0, start, bits));
  TableauData data;
  data.name = name, data.text = note, data.cite = cite;
  return precise_collocation(std::move(data), nodes, bits, std::ldexp(1.0, -static_cast<int>(bits) / 2));
}

Tableau radau(long stages) {
  check_stages("radau", stages);
  const std::string name = text("radau(", stages, ")");
  const char* note = "Radau IIA collocation, order 2s - 1: stiffly accurate, L-stable.";
  const char* cite = "Ehle 1969; Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.5";
  const char* exact_forms[] = {
      "1 | 1 \n | 1", "1/3 | 5/12 -1/12 \n 1 | 3/4 1/4 \n | 3/4 1/4",
      "(4-sqrt(6))/10 | (88-7*sqrt(6))/360      (296-169*sqrt(6))/1800  (-2+3*sqrt(6))/225 \n"
      "(4+sqrt(6))/10 | (296+169*sqrt(6))/1800  (88+7*sqrt(6))/360      (-2-3*sqrt(6))/225 \n"
      "1              | (16-sqrt(6))/36         (16+sqrt(6))/36         1/9                \n"
      "               | (16-sqrt(6))/36         (16+sqrt(6))/36         1/9"};
  if (stages <= 3) return drawn(exact_forms[stages - 1], name, note, cite);
  const int s = static_cast<int>(stages);
  const mp_bitcnt_t bits = digits_for(static_cast<std::size_t>(s));
  RealVector nodes;
  // P_s - P_{s-1} = (x - 1) P_{s-1}^(1,0) up to a factor.
  for (double start : jacobi_zeros(s - 1, 1)) nodes.push_back(refine(s, 1, start, bits));
  nodes.push_back(Real(1, bits));
  TableauData data;
  data.name = name, data.text = note, data.cite = cite;
  return precise_collocation(std::move(data), nodes, bits, std::ldexp(1.0, -static_cast<int>(bits) / 2));
}

}  // namespace pendula::integrate
