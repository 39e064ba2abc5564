// Poles and invariant zeros.
#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/generic/generic.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "lti/structure.hpp"

namespace pendula::lti {
namespace {

using dae::RationalMatrix;

std::vector<dae::Mode> sorted(std::vector<dae::Mode> list) {
  std::stable_sort(list.begin(), list.end(), [](const auto& a, const auto& b) {
    return std::pair(a.value.real(), a.value.imag()) < std::pair(b.value.real(), b.value.imag());
  });
  return list;
}

std::vector<dae::Mode> eigenvalues(const Mat& given) {
  std::vector<dae::Mode> list;
  if (given.rows() == 0) return list;
  const Mat m = linalg::similar(given, linalg::balancing(given));
  const auto e = linalg::eigensystem(m);
  // Parts below the backward error of the eigenvalue iteration are rounding errors, so that a pole on the
  // axis is printed there.
  const double rounding = 4 * static_cast<double>(m.rows()) * eps * m.norm();
  for (Index k = 0; k < e.re.size(); ++k) {
    const double re = std::fabs(e.re[k]) <= rounding ? 0 : e.re[k],
                 im = std::fabs(e.im[k]) <= rounding ? 0 : e.im[k];
    list.push_back({Complex(re, im), 1, {}});
  }
  return sorted(std::move(list));
}

std::vector<dae::Mode> eigenvalues(const RationalMatrix& m) {
  return dae::modes(dae::factors(dae::characteristic(m)));
}

// ── zeros: one algorithm, two kinds of numbers ──

/// [c; 0] = U d with c of full row rank, and U.
template <class M>
struct Rows {
  M U;
  int rank;
};
/// A regular V with c V = [0 S] and S of full column rank; nullity = number of zero columns.
template <class M>
struct Columns {
  M V, back;
  int nullity;
};

Rows<RationalMatrix> compress_rows(const RationalMatrix& d, double) {
  const int p = d.rows(), m = d.cols();
  const auto r = dae::reduced(dae::hstack(d, RationalMatrix::identity(p)), m);
  return {r.form.block(0, m, p, p), static_cast<int>(r.pivots.size())};
}

Columns<RationalMatrix> compress_columns(const RationalMatrix& c, double) {
  const RationalMatrix null = dae::kernel(c);
  const RationalMatrix V = dae::hstack(null, dae::complement(null, RationalMatrix::identity(c.cols())));
  const auto back = dae::inverse(V);
  PENDULA_ASSERT(back.has_value(), "a basis that is singular");
  return {V, *back, null.cols()};
}

Rows<Mat> compress_rows(const Mat& d, double tol) {
  if (d.rows() == 0 || d.cols() == 0) return {Mat::Identity(d.rows(), d.rows()), 0};
  const Eigen::JacobiSVD<Mat> svd(d, Eigen::ComputeFullU);
  return {svd.matrixU().transpose(), static_cast<int>((svd.singularValues().array() > tol).count())};
}

Columns<Mat> compress_columns(const Mat& c, double tol) {
  const Index n = c.cols();
  if (c.rows() == 0 || n == 0) return {Mat::Identity(n, n), Mat::Identity(n, n), static_cast<int>(n)};
  const Eigen::JacobiSVD<Mat> svd(c, Eigen::ComputeFullV);
  const auto rank = static_cast<int>((svd.singularValues().array() > tol).count());
  const Mat V = svd.matrixV().rowwise().reverse();  // small singular values first
  return {V, V.transpose(), static_cast<int>(n) - rank};
}

template <class M>
M block(const M& m, int row, int col, int rows, int cols) {
  return m.block(row, col, rows, cols);
}
Mat stack(const Mat& a, const Mat& b) {
  Mat c(a.rows() + b.rows(), a.cols());
  c << a, b;
  return c;
}
RationalMatrix stack(const RationalMatrix& a, const RationalMatrix& b) {
  RationalMatrix c(a.rows() + b.rows(), a.cols());
  c.set(0, 0, a);
  c.set(a.rows(), 0, b);
  return c;
}
Mat transposed(const Mat& m) { return m.transpose(); }
RationalMatrix transposed(const RationalMatrix& m) { return m.transposed(); }

template <class M>
struct Quadruple {
  M A, B, C, D;
};

/// Outputs that depend on states without an input force these states to zero. Removes both until D has full
/// row rank, which preserves the zeros.
template <class M>
Quadruple<M> row_reduced(Quadruple<M> s, double tol) {
  for (;;) {
    const int n = static_cast<int>(s.A.rows()), m = static_cast<int>(s.D.cols()),
              p = static_cast<int>(s.D.rows());
    const Rows<M> r = compress_rows(s.D, tol);
    const M D = r.U * s.D, C = r.U * s.C;
    const int rank = r.rank, free = p - rank;
    if (free == 0) return s;
    const Columns<M> k = compress_columns(block(C, rank, 0, free, n), tol);
    const int kept = k.nullity, fixed = n - kept;
    const M A = k.back * M(s.A * k.V), B = k.back * s.B, CV = C * k.V;
    s = {block(A, 0, 0, kept, kept), block(B, 0, 0, kept, m), block(CV, 0, 0, rank, kept),
         block(D, 0, 0, rank, m)};
    if (fixed == 0) return s;
    s.C = stack(s.C, block(A, kept, 0, fixed, kept));
    s.D = stack(s.D, block(B, kept, 0, fixed, m));
  }
}

template <class M>
Quadruple<M> dual(const Quadruple<M>& s) {
  return {transposed(s.A), transposed(s.C), transposed(s.B), transposed(s.D)};
}

template <class M>
Quadruple<M> core(const Quadruple<M>& s, double tol) {
  return row_reduced(dual(row_reduced(s, tol)), tol);
}

/// A power of two near x > 0, else 1.
double power_of_two(double x) { return x > 0 ? std::exp2(std::round(std::log2(x))) : 1; }

/// The system with time, states, inputs and outputs scaled so that all entries are near 1 and one tolerance
/// suffices; s = unit·s̃.
Quadruple<Mat> in_units(Quadruple<Mat> q, double& unit) {
  const Vec d = linalg::balancing(q.A);
  q.A = linalg::similar(q.A, d);
  q.B = d.cwiseInverse().asDiagonal() * q.B;
  q.C = q.C * d.asDiagonal();
  unit = power_of_two(q.A.norm());
  q.A /= unit;
  q.B /= unit;
  for (Index j = 0; j < q.B.cols(); ++j) {
    const double size = power_of_two(std::max(q.B.col(j).norm(), q.D.col(j).norm()));
    q.B.col(j) /= size;
    q.D.col(j) /= size;
  }
  for (Index i = 0; i < q.C.rows(); ++i) {
    const double size = power_of_two(std::max(q.C.row(i).norm(), q.D.row(i).norm()));
    q.C.row(i) /= size;
    q.D.row(i) /= size;
  }
  return q;
}

std::vector<dae::Mode> zeros_of(const StateSpace& g) {
  const bool exact = common(common(field(g.A), field(g.B)), common(field(g.C), field(g.D))) == Field::exact;
  if (exact && g.order() <= most_exact_states) {
    const auto s =
        core(Quadruple<RationalMatrix>{rational(g.A), rational(g.B), rational(g.C), rational(g.D)}, 0);
    if (s.A.rows() == 0) return {};
    const auto back = dae::inverse(s.D);
    PENDULA_ASSERT(back.has_value(), "the reduced system has a singular D");
    return eigenvalues(s.A - s.B * (*back * s.C));
  }
  double unit = 1;
  const Quadruple<Mat> q = in_units({numbers(g.A), numbers(g.B), numbers(g.C), numbers(g.D)}, unit);
  const double size = std::max({q.A.norm(), q.B.norm(), q.C.norm(), q.D.norm()});
  // rows are compressed by up to 2 n orthogonal factorisations, each of which errs by some ε; 100 is a choice
  const auto s = core(q, 100 * eps * size);
  if (s.A.rows() == 0) return {};
  return eigenvalues(Mat(unit * (s.A - s.B * Mat(s.D.partialPivLu().solve(s.C)))));
}

std::vector<dae::Mode> listed(const std::vector<std::pair<Expr, Expr>>& roots) {
  std::vector<dae::Mode> list;
  for (const auto& [re, im] : roots) {
    const auto same = std::find_if(list.begin(), list.end(), [&, a = re, b = im](const dae::Mode& m) {
      return m.exact && m.exact->first == a && m.exact->second == b;
    });
    if (same != list.end())
      ++same->multiplicity;
    else
      list.push_back({Complex(number(re), number(im)), 1, std::pair(re, im)});
  }
  for (dae::Mode& m : list)
    if (field(std::vector<Expr>{m.exact->first, m.exact->second}) == Field::numeric) m.exact.reset();
  return sorted(std::move(list));
}

}  // namespace

std::vector<dae::Mode> poles(const System& given) {
  const System g = with_numbers(given);
  if (g.form == Form::zpk && g.siso()) return listed(g.zpk[0].poles);
  if (g.form != Form::ss && g.siso()) return zeros(g.tf[0].den);
  const System s = to_ss(g);
  if (field(s.ss.A) == Field::exact && s.ss.order() <= most_exact_states)
    return eigenvalues(rational(s.ss.A));
  return eigenvalues(numbers(s.ss.A));
}

std::vector<dae::Mode> zeros(const System& given) {
  const System g = with_numbers(given);
  if (g.form == Form::zpk && g.siso()) return listed(g.zpk[0].zeros);
  if (g.form == Form::tf && g.siso()) {
    if (g.tf[0].num.empty()) throw Error("the system is zero: every s is a zero of it");
    return zeros(g.tf[0].num);
  }
  return zeros_of(to_ss(g).ss);
}

Polynomial characteristic(const System& g) {
  if (g.form != Form::ss) {
    const System f = to_tf(g);
    if (f.siso()) return f.tf[0].den;
    return characteristic(to_ss(f));
  }
  if (g.ss.order() == 0) return {1};
  if (field(g.ss.A) == Field::exact) return expressions(dae::characteristic(rational(g.ss.A)));
  const VecX c = linalg::characteristic(g.ss.A);
  Polynomial p;
  for (Index k = c.size(); k-- > 0;) p.push_back(c[k]);
  return tidy(std::move(p));
}

std::optional<std::vector<Expr>> symbolic_zeros(const Polynomial& given) {
  Polynomial p = given;
  std::vector<Expr> list;
  while (p.size() > 1 && p.front().is_zero()) {
    p.erase(p.begin());
    list.push_back(0);
  }
  if (p.size() == 2) list.push_back(simplify(-p[0] / p[1]));
  if (p.size() == 3) {
    const Expr centre = simplify(-p[1] / (2 * p[2])), root = sqrt(simplify(centre * centre - p[0] / p[2]));
    list.push_back(simplify(centre - root));
    list.push_back(simplify(centre + root));
  }
  if (p.size() > 3) return {};
  return list;
}

}  // namespace pendula::lti
