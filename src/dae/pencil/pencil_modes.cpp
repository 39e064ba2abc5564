#include "dae/pencil/pencil_modes.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.hpp"
#include "dae/model/lineage.hpp"
#include "expr/graph/rational.hpp"
#include "expr/linalg/linalg.hpp"

namespace pendula::dae {
namespace {

using Complex = std::complex<long double>;

void trim(Polynomial& p) {
  while (!p.empty() && p.back() == 0) p.pop_back();
}

Polynomial monic(Polynomial p) {
  const mpq_class lead = p.back();
  for (mpq_class& c : p) c /= lead;
  return p;
}

Complex horner(const std::vector<long double>& p, Complex s) {
  Complex sum = 0;
  for (std::size_t k = p.size(); k-- > 0;) sum = sum * s + p[k];
  return sum;
}

std::vector<long double> in_doubles(const Polynomial& p) {
  std::vector<long double> d;
  for (const mpq_class& c : p) d.push_back(static_cast<long double>(c.get_d()));
  return d;
}

/// k such that 2^k is close to the geometric mean of the moduli of the nonzero zeros.
long binary_size(const Polynomial& p) {
  std::size_t low = 0;
  while (low + 1 < p.size() && p[low] == 0) ++low;
  if (low + 1 == p.size()) return 0;
  const mpq_class q = abs(p[low]);
  const auto bits = static_cast<long>(mpz_sizeinbase(q.get_num_mpz_t(), 2)) -
                    static_cast<long>(mpz_sizeinbase(q.get_den_mpz_t(), 2));
  return std::lround(static_cast<double>(bits) / static_cast<double>(p.size() - 1 - low));
}

/// p(2^k s) / 2^(kn), monic again.
Polynomial in_units(Polynomial p, long k) {
  for (std::size_t i = 0; i < p.size(); ++i) {
    const long shift = k * static_cast<long>(p.size() - 1 - i);
    if (shift >= 0)
      mpq_div_2exp(p[i].get_mpq_t(), p[i].get_mpq_t(), static_cast<mp_bitcnt_t>(shift));
    else
      mpq_mul_2exp(p[i].get_mpq_t(), p[i].get_mpq_t(), static_cast<mp_bitcnt_t>(-shift));
  }
  return p;
}

/// The simple zeros of a monic polynomial: eigenvalues of its companion matrix, scaled to their size, refined
/// by Newton's method.
std::vector<std::complex<double>> zeros(const Polynomial& given) {
  const long unit = binary_size(given);
  const Polynomial p = in_units(given, unit);
  const auto n = static_cast<Eigen::Index>(p.size()) - 1;
  Mat companion = Mat::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    companion(i, n - 1) = -p[i].get_d();
    if (i > 0) companion(i, i - 1) = 1;
  }
  const auto eigen = linalg::eigensystem(companion);
  const auto exact = in_doubles(p), slope = in_doubles(derivative(p));
  std::vector<std::complex<double>> list;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Complex start(eigen.re[i], eigen.im[i]);
    // Next to much larger ones an eigenvalue may have lost all its digits (s² - 10⁸ s + 1: 7.5e-9 instead of
    // 1e-8). Newton's method may therefore move it by a third of the distance to the next one.
    long double isolated = INFINITY;
    for (Eigen::Index j = 0; j < n; ++j)
      if (j != i) isolated = std::min(isolated, std::abs(Complex(eigen.re[j], eigen.im[j]) - start) / 3);
    Complex s = start;
    for (int step = 0; step < 20; ++step) {
      const Complex d = horner(slope, s);
      if (std::abs(d) == 0) break;
      const Complex change = horner(exact, s) / d;
      const bool near = std::abs(change) < 0.1L * (std::abs(s) + 1e-3L);
      // do not leave the neighbourhood of the zero
      if (!near && !(std::abs(s - change - start) < isolated)) break;
      s -= change;
      if (std::abs(change) < 1e-18L * std::abs(s)) break;
    }
    s = {std::ldexp(s.real(), static_cast<int>(unit)), std::ldexp(s.imag(), static_cast<int>(unit))};
    list.emplace_back(static_cast<double>(s.real()), static_cast<double>(s.imag()));
    constexpr double rounding = 1e-14;  // 45 ε
    if (std::fabs(list.back().imag()) < rounding * std::abs(list.back())) list.back().imag(0);
  }
  return list;
}

/// The rational with the leading coefficient of the primitive integer polynomial as denominator (rational
/// root theorem: coefficients of monic factors have no other).
std::optional<mpq_class> candidate(double v, const mpz_class& lead) {
  const double scaled = v * lead.get_d();
  constexpr double last_integer = 1e15;  // below 2⁵³, where the nearest integer means something
  if (!(std::fabs(scaled) < last_integer)) return {};
  mpq_class q(mpz_class(std::nearbyint(scaled)), lead);
  q.canonicalize();
  return q;
}

mpz_class integer_lead(const Polynomial& p) {
  mpz_class lead = 1;
  for (const mpq_class& c : p) lead = lcm(lead, c.get_den());
  return lead;
}

/// Divides p by `factor` if that is exact.
bool take(Polynomial& p, const Polynomial& factor) {
  Division d = divide(p, factor);
  if (!d.remainder.empty()) return false;
  p = std::move(d.quotient);
  return true;
}

/// The linear and quadratic factors of a squarefree monic polynomial, and the rest.
void split(Polynomial p, int multiplicity, std::vector<Factor>& list) {
  const mpz_class lead = integer_lead(p);
  std::vector<std::complex<double>> rest;
  for (const auto& z : zeros(p)) {
    const auto q = candidate(z.real(), lead);
    if (z.imag() == 0 && q && take(p, {-*q, 1}))
      list.push_back({{-*q, 1}, multiplicity, {q->get_d()}});
    else
      rest.push_back(z);
  }
  for (std::size_t i = 0; i < rest.size(); ++i)
    for (std::size_t j = i + 1; j < rest.size(); ++j) {
      constexpr double conjugate = 1e-12;  // 4500 ε; the product is verified by division
      if (std::fabs(rest[i].imag() + rest[j].imag()) > conjugate * std::abs(rest[i])) continue;
      const auto sum = candidate((rest[i] + rest[j]).real(), lead);
      const auto prod = candidate((rest[i] * rest[j]).real(), lead);
      if (!sum || !prod || p.size() < 3 || !take(p, {*prod, -*sum, 1})) continue;
      list.push_back({{*prod, -*sum, 1}, multiplicity, {rest[i], rest[j]}});
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(j));
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
      --i;
      break;
    }
  if (p.size() > 1) list.push_back({p, multiplicity, rest});
}

}  // namespace

Polynomial product(const Polynomial& a, const Polynomial& b) {
  if (a.empty() || b.empty()) return {};
  Polynomial c(a.size() + b.size() - 1);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) c[i + j] += a[i] * b[j];
  return c;
}

Division divide(Polynomial a, const Polynomial& b) {
  Division d;
  if (a.size() >= b.size()) d.quotient.resize(a.size() - b.size() + 1);
  while (a.size() >= b.size()) {
    const std::size_t shift = a.size() - b.size();
    const mpq_class factor = a.back() / b.back();
    d.quotient[shift] = factor;
    for (std::size_t i = 0; i < b.size(); ++i) a[shift + i] -= factor * b[i];
    trim(a);
  }
  d.remainder = std::move(a);
  return d;
}

Polynomial derivative(const Polynomial& a) {
  Polynomial d;
  for (std::size_t k = 1; k < a.size(); ++k) d.push_back(a[k] * static_cast<unsigned long>(k));
  return d;
}

Polynomial gcd(Polynomial a, Polynomial b) {
  while (!b.empty()) {
    Polynomial r = divide(a, b).remainder;
    a = std::move(b);
    b = r.empty() ? r : monic(std::move(r));
  }
  return monic(std::move(a));
}

mpq_class value(const Polynomial& a, const mpq_class& s) {
  mpq_class sum = 0;
  for (std::size_t k = a.size(); k-- > 0;) sum = sum * s + a[k];
  return sum;
}

RationalMatrix value(const Polynomial& a, const RationalMatrix& m) {
  RationalMatrix sum(m.rows(), m.cols());
  for (std::size_t k = a.size(); k-- > 0;) {
    sum = sum * m;
    for (int i = 0; i < m.rows(); ++i) sum(i, i) += a[k];
  }
  return sum;
}

Expr expression(const Polynomial& a, Expr s) {
  Expr sum = 0;
  for (std::size_t k = a.size(); k-- > 0;) {
    if (a[k] == 0) continue;
    const Expr power = k == 0 ? Expr(1) : k == 1 ? s : pow(s, Expr(static_cast<long>(k)));
    sum += Expr(a[k]) * power;
  }
  return sum;
}

Polynomial characteristic(const RationalMatrix& m) {
  if (m.rows() == 0) return {1};
  Polynomial p = rational::characteristic(expressions(m));
  std::reverse(p.begin(), p.end());
  return p;
}

std::vector<Factor> factors(const Polynomial& given) {
  std::vector<Factor> list;
  if (given.size() < 2) return list;
  // Yun's squarefree decomposition: p = Π aᵢⁱ.
  const Polynomial p = monic(given), slope = derivative(p), common = gcd(p, slope);
  Polynomial b = divide(p, common).quotient, c = divide(slope, common).quotient;
  for (int i = 1; b.size() > 1; ++i) {
    Polynomial d = c;
    const Polynomial bs = derivative(b);
    d.resize(std::max(d.size(), bs.size()));
    for (std::size_t k = 0; k < bs.size(); ++k) d[k] -= bs[k];
    trim(d);
    const Polynomial a = d.empty() ? b : gcd(b, d);
    if (a.size() > 1) split(a, i, list);
    b = divide(b, a).quotient;
    c = d.empty() ? d : divide(d, a).quotient;
  }
  return list;
}

std::vector<Mode> modes(const std::vector<Factor>& factors) {
  std::vector<Mode> list;
  for (const Factor& f : factors) {
    if (f.degree() == 1) {
      list.push_back({f.zeros[0], f.multiplicity, std::pair(Expr(mpq_class(-f.p[0])), Expr(0))});
    } else if (f.degree() == 2) {
      RationalMatrix companion(2, 2);
      companion(0, 1) = -f.p[0];
      companion(1, 0) = 1;
      companion(1, 1) = -f.p[1];
      const auto exact = linalg::exact_eigenvalues(expressions(companion));
      PENDULA_ASSERT(exact && exact->size() == 2, "a quadratic factor has no exact zeros");
      auto z = f.zeros;
      const auto key = [](const std::complex<double>& s) { return std::pair(s.real(), s.imag()); };
      if (z[0].imag() != 0)  // both zeros share the real part of the factor, exactly
        for (auto& each : z) each.real(-f.p[1].get_d() / 2);
      std::sort(z.begin(), z.end(), [&](auto& a, auto& b) { return key(a) < key(b); });
      std::array<Expr, 2> re{(*exact)[0].re, (*exact)[1].re};
      // -p/2 ± √… would cancel for a small zero next to a large one; the product of the zeros gives it
      constexpr double apart = 1e-4;
      const bool real = z[0].imag() == 0 && z[1].imag() == 0;
      const std::size_t small = std::abs(z[0]) < std::abs(z[1]) ? 0 : 1;
      if (real && std::abs(z[small]) < apart * std::abs(z[1 - small]))
        re[small] = Expr(f.p[0]) / re[1 - small];
      for (std::size_t i = 0; i < 2; ++i)
        list.push_back({z[i], f.multiplicity, std::pair(re[i], (*exact)[i].im)});
    } else {
      for (const auto& z : f.zeros) list.push_back({z, f.multiplicity, {}});
    }
  }
  std::stable_sort(list.begin(), list.end(), [](const Mode& a, const Mode& b) {
    return std::pair(a.value.real(), a.value.imag()) < std::pair(b.value.real(), b.value.imag());
  });
  return list;
}

RationalMatrix nilpotent_chains(const RationalMatrix& m) {
  const int n = m.rows();
  std::vector<RationalMatrix> kernels{RationalMatrix(n, 0)};  // of m⁰, m¹, …
  for (RationalMatrix power = m; kernels.back().cols() < n; power = power * m) {
    kernels.push_back(kernel(power));
    PENDULA_ASSERT(static_cast<int>(kernels.size()) <= n + 1, "chains of a matrix that is not nilpotent");
  }
  // From the longest chains down: the first vectors of chains of length k complement ker mᵏ⁻¹ + m ker mᵏ⁺¹
  // in ker mᵏ.
  RationalMatrix chains(n, 0);
  for (std::size_t k = kernels.size() - 1; k > 0; --k) {
    RationalMatrix known = kernels[k - 1];
    if (k + 1 < kernels.size()) known = hstack(known, m * kernels[k + 1]);
    const RationalMatrix tops = complement(known, kernels[k]);
    for (int j = 0; j < tops.cols(); ++j) {
      RationalMatrix chain = tops.columns(j, 1);
      for (std::size_t i = 1; i < k; ++i) chain = hstack(m * chain.columns(0, 1), chain);
      chains = hstack(chains, primitive_factor(chain) * chain);
    }
  }
  return chains;
}

RationalMatrix jordan_basis(const RationalMatrix& m, const std::vector<Factor>& factors) {
  const int n = m.rows();
  RationalMatrix basis(n, 0),
      others = RationalMatrix::identity(n);  // others: Π (m - λI)ᵏ, whose image is the complement
  for (const Factor& f : factors) {
    if (f.degree() != 1) continue;
    const RationalMatrix shifted = value(f.p, m);
    RationalMatrix power = RationalMatrix::identity(n);
    for (int i = 0; i < f.multiplicity; ++i) power = power * shifted;
    others = others * power;
    // m - λI maps its component to itself; in coordinates of the component it is a nilpotent matrix.
    const RationalMatrix component = kernel(power);
    const int size = component.cols();
    const Reduced r = reduced(hstack(component, shifted * component), size);
    basis = hstack(basis, component * nilpotent_chains(r.form.block(0, size, size, size)));
  }
  return basis.cols() == 0 ? others : hstack(basis, span(others));
}

}  // namespace pendula::dae
