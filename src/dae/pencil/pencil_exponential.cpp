// e^{m t} v for rational m. docs/derivations.md#partial-fractions.
#include <algorithm>

#include "base/error.hpp"
#include "base/math.hpp"
#include "dae/pencil/pencil_modes.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

using ComplexMat = Eigen::MatrixXcd;
using Index = Eigen::Index;

VecX scaled(Expr factor, VecX v) {
  for (Index i = 0; i < v.size(); ++i) v[i] = factor * v[i];
  return v;
}

/// The part D of m = D + N with p(D) = 0, N nilpotent, DN = ND, by Newton's iteration D ← D - p(D) p′(D)⁻¹,
/// which doubles the correct power of N (Chevalley; Couty, Esterle & Zarouf, Quadrature 82, 2011).
RationalMatrix semisimple_part(const RationalMatrix& m, const Polynomial& p) {
  RationalMatrix D = m;
  const Polynomial slope = derivative(p);
  for (int step = 0; step <= m.rows(); ++step) {
    const RationalMatrix rest = value(p, D);
    if (rest.is_zero()) return D;
    const auto back = inverse(value(slope, D));
    PENDULA_ASSERT(back.has_value(), "a factor without multiple zeros has a singular derivative");
    D = D - rest * *back;
  }
  PENDULA_ASSERT(false, "the semisimple part of a matrix was not found");
  return D;
}

/// D² - 2a D + c = 0: e^{at} (cos bt + (D - a)/b sin bt), or real exponentials.
VecX quadratic(const RationalMatrix& D, const Factor& f, Expr t, const VecX& v) {
  const mpq_class a = -f.p[1] / 2, square = a * a - f.p[0];
  RationalMatrix companion(2, 2), shifted = D;
  companion(0, 1) = square;
  companion(1, 0) = 1;
  for (int i = 0; i < D.rows(); ++i) shifted(i, i) -= a;
  const auto zeros = linalg::exact_eigenvalues(expressions(companion));
  PENDULA_ASSERT(zeros && zeros->size() == 2, "a quadratic factor has no exact zeros");
  const VecX w = product(shifted, v);
  if (square < 0) {
    const Expr b = (*zeros)[1].im, growth = exp(Expr(a) * t);
    return scaled(growth * cos(b * t), v) + scaled(growth * sin(b * t) / b, w);
  }
  const Expr b = (*zeros)[1].re, half = Expr(mpq_class(1, 2));
  const Expr up = exp((Expr(a) + b) * t), down = exp((Expr(a) - b) * t);
  return scaled(half * (up + down), v) + scaled(half * (up - down) / b, w);
}

/// Σ over the zeros r of e^{rt} Π (D - q)/(r - q), in decimals; conjugate zeros are combined.
VecX numerical(const RationalMatrix& D, const Factor& f, Expr t, const VecX& v) {
  const Index n = D.rows();
  ComplexMat d(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) d(i, j) = D(static_cast<int>(i), static_cast<int>(j)).get_d();
  VecX sum = VecX::Zero(n);
  for (std::size_t k = 0; k < f.zeros.size(); ++k) {
    const std::complex<double> r = f.zeros[k];
    if (r.imag() < 0) continue;
    ComplexMat projector = ComplexMat::Identity(n, n);
    for (std::size_t other = 0; other < f.zeros.size(); ++other)
      if (other != k)
        projector =
            ((d - f.zeros[other] * ComplexMat::Identity(n, n)) * projector / (r - f.zeros[other])).eval();
    const double twice = r.imag() > 0 ? 2 : 1;
    const Expr growth = exp(Expr(r.real()) * t), angle = Expr(r.imag()) * t;
    for (Index i = 0; i < n; ++i)
      for (Index j = 0; j < n; ++j) {
        if (v[j].is_zero()) continue;
        const std::complex<double> c = twice * projector(i, j);
        Expr part = Expr(c.real());
        if (r.imag() > 0) part = Expr(c.real()) * cos(angle) - Expr(c.imag()) * sin(angle);
        sum[i] += growth * part * v[j];
      }
  }
  return sum;
}

VecX component(const RationalMatrix& m, const Factor& f, Expr t, VecX v) {
  if (std::all_of(v.data(), v.data() + v.size(), [](Expr e) { return e.is_zero(); })) return v;
  const RationalMatrix D = semisimple_part(m, f.p), N = m - D;
  VecX polynomial = v;  // e^{Nt} v, a finite sum
  RationalMatrix power = N;
  Expr factor = 1;
  for (long k = 1; !power.is_zero(); power = power * N, ++k) {
    factor = factor * t / Expr(k);
    polynomial += scaled(factor, product(power, v));
  }
  if (f.degree() == 1) return scaled(exp(Expr(mpq_class(-f.p[0])) * t), polynomial);
  if (f.degree() == 2) return quadratic(D, f, t, polynomial);
  return numerical(D, f, t, polynomial);
}

}  // namespace

VecX exponential(const RationalMatrix& m, Expr t, const VecX& v) {
  const int n = m.rows();
  if (n == 0) return v;
  const auto list = factors(characteristic(m));
  RationalMatrix basis(n, 0);
  std::vector<int> sizes;
  for (const Factor& f : list) {
    RationalMatrix power = RationalMatrix::identity(n);
    for (int i = 0; i < f.multiplicity; ++i) power = power * value(f.p, m);
    const RationalMatrix part = kernel(power);
    basis = hstack(basis, part);
    sizes.push_back(part.cols());
  }
  const auto back = inverse(basis);
  PENDULA_ASSERT(back.has_value(), "the primary components of a matrix do not fill the space");
  const RationalMatrix inner = *back * m * basis;
  const VecX y = product(*back, v);
  VecX result(n);
  int at = 0;
  for (std::size_t i = 0; i < list.size(); at += sizes[i], ++i) {
    const VecX part = y.segment(at, sizes[i]).unaryExpr([](Expr e) { return simplify(e); });
    result.segment(at, sizes[i]) = component(inner.block(at, at, sizes[i], sizes[i]), list[i], t, part);
  }
  return product(basis, result);
}

}  // namespace pendula::dae
