// Controllability, observability, minimal realisations.
#include "lti/structure.hpp"

#include <algorithm>
#include <cmath>

#include "base/counted.hpp"
#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/stoppable.hpp"
#include "base/text.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"

namespace pendula::lti {
namespace {

using dae::RationalMatrix;
constexpr int most_exact_pairs = 20;  // states: minreal takes 0.1 s for a full matrix of small whole numbers

/// The span of [B, AB, A²B, …] as columns.
RationalMatrix reachable(const RationalMatrix& A, const RationalMatrix& B) {
  RationalMatrix space = dae::span(B), newest = space;
  while (newest.cols() > 0) {
    newest = dae::complement(space, A * newest);
    if (newest.cols() > 0) space = dae::hstack(space, newest);
  }
  return space;
}

/// An orthonormal basis; a direction counts if it exceeds `relative` times ‖A‖ and ‖B‖ (staircase algorithm,
/// Van Dooren, IEEE Trans. Automat. Control 26(1), 1981).
Mat reachable(const Mat& A, const Mat& B, double relative) {
  const Index n = A.rows();
  Mat space(n, 0), newest = B;
  double size = B.norm();
  while (newest.cols() > 0 && space.cols() < n) {
    for (int pass = 0; pass < 2; ++pass) newest -= space * (space.transpose() * newest);
    const Eigen::JacobiSVD<Mat> svd(newest, Eigen::ComputeThinU);
    const double tol = relative * std::max(size, least_size);
    const Index rank = (svd.singularValues().array() > tol).count();
    const Mat directions = svd.matrixU().leftCols(rank);
    Mat grown(n, space.cols() + rank);
    grown << space, directions;
    space = grown;
    newest = A * directions;
    size = A.norm();
  }
  return space;
}

struct Split {
  MatX V;     ///< the subspace, then a complement
  MatX back;  ///< V⁻¹
  int dimension;
};

/// Coordinates with the reachable states first. tol ≤ 0: exact for exact entries, else n·1e-12.
Split split(const MatX& A, const MatX& B, double tol = 0) {
  const Index n = A.rows();
  if (tol <= 0 && common(field(A), field(B)) == Field::exact && n <= most_exact_pairs) {
    const RationalMatrix space = reachable(rational(A), rational(B));
    const RationalMatrix V =
        dae::hstack(space, dae::complement(space, RationalMatrix::identity(static_cast<int>(n))));
    const auto back = dae::inverse(V);
    PENDULA_ASSERT(back.has_value(), "a basis that is singular");
    return {dae::expressions(V), dae::expressions(*back), space.cols()};
  }
  // scales the states to comparable size
  const Vec d = linalg::balancing(numbers(A)), inverse = d.cwiseInverse();
  const Mat a = linalg::similar(numbers(A), d), b = inverse.asDiagonal() * numbers(B);
  const double cubic = std::pow(static_cast<double>(n), 3);
  const Mat space = stoppable(8 * cubic, [&] {
    constexpr double rounding = 1e-12;  // 4500 ε per state: the staircase works with orthogonal bases
    return std::vector<Mat>{reachable(a, b, tol > 0 ? tol : rounding * static_cast<double>(n))};
  })[0];
  if (space.cols() == n) return {MatX(MatX::Identity(n, n)), MatX(MatX::Identity(n, n)), static_cast<int>(n)};
  Mat V(n, n);
  V << space, Mat(full_q(Eigen::HouseholderQR<Mat>(space).householderQ()).rightCols(n - space.cols()));
  return {expressions(Mat(d.asDiagonal() * V)), expressions(Mat(V.transpose() * inverse.asDiagonal())),
          static_cast<int>(space.cols())};
}

System transformed(const System& g, const Split& s, int keep) {
  const MatX A = product(s.back, product(g.ss.A, s.V)), B = product(s.back, g.ss.B), C = product(g.ss.C, s.V);
  System h = make_ss(A.topLeftCorner(keep, keep), B.topRows(keep), C.leftCols(keep), g.ss.D, g.Ts);
  h.input_names = g.input_names;
  h.output_names = g.output_names;
  return h;
}

System transposed(const System& g) {
  System h = make_ss(g.ss.A.transpose(), g.ss.C.transpose(), g.ss.B.transpose(), g.ss.D.transpose(), g.Ts);
  h.state_names = g.state_names;
  return h;
}

std::string signed_sum(const std::vector<std::pair<mpq_class, std::string>>& terms) {
  std::string out;
  for (const auto& [c, name] : terms) {
    if (c == 0) continue;
    const mpq_class size = abs(c);
    const std::string term = size == 1 ? name : size.get_str() + " " + name;
    out += out.empty() ? (c < 0 ? "-" : "") + term : (c < 0 ? " - " : " + ") + term;
  }
  return out;
}

bool single_name(const std::vector<std::pair<mpq_class, std::string>>& terms) {
  return std::count_if(terms.begin(), terms.end(), [](const auto& t) { return t.first != 0; }) == 1;
}

/// A row w with w A = λ w and w B = 0 in terms of the states, for a rational λ of an exact system.
std::string combination(const System& g, const mpq_class& lambda, bool controllability) {
  const int n = g.ss.order();
  RationalMatrix shifted = rational(g.ss.A);
  for (int i = 0; i < n; ++i) shifted(i, i) -= lambda;
  const RationalMatrix w = dae::kernel(dae::hstack(shifted, rational(g.ss.B)).transposed());
  if (w.cols() == 0) return "";
  RationalMatrix first = w.columns(0, 1);
  first = dae::primitive_factor(first) * first;
  std::vector<std::pair<mpq_class, std::string>> terms;
  for (int i = 0; i < n; ++i) terms.emplace_back(first(i, 0), state_name(g, i));
  if (!controllability) {
    std::vector<std::string> parts;
    for (int i = 0; i < n; ++i) parts.push_back(first(i, 0).get_str());
    return "the outputs do not depend on the direction (" + join(parts, ", ") + ")";
  }
  const std::string sum = signed_sum(terms);
  const bool single = single_name(terms);
  const std::string moving = single_name(terms) ? sum + "′" : "(" + sum + ")′";
  const std::string rate = lambda == 0   ? "0"
                           : lambda == 1 ? sum
                                         : lambda.get_str() + (single ? " " + sum : " (" + sum + ")");
  return g.continuous()
             ? "no input reaches " + sum + ": " + moving + " = " + rate
             : "no input reaches " + sum + ", which is multiplied by " + lambda.get_str() + " in every step";
}

Reach reach(const System& g, bool controllability) {
  Reach r;
  r.controllability = controllability;
  r.order = g.ss.order();
  if (field(g) == Field::symbolic) {
    r.rank = r.order == 0 ? 0 : linalg::rank(controllability_matrix(g));
    r.stable = r.rank == r.order;
    return r;
  }
  const Split s = split(g.ss.A, g.ss.B);
  r.rank = s.dimension;
  if (r.rank == r.order) return r;
  const int rest = r.order - r.rank;
  const MatX A = product(s.back, product(g.ss.A, s.V)).bottomRightCorner(rest, rest);
  System hidden = make_ss(A, MatX::Zero(rest, 0), MatX::Zero(0, rest), MatX::Zero(0, 0), g.Ts);
  const bool exact = field(g) == Field::exact;
  for (const dae::Mode& m : poles(hidden)) {
    const mpq_class* q = m.exact && m.value.imag() == 0 ? exact_value(m.exact->first) : nullptr;
    r.modes.push_back({m, exact && q ? combination(g, *q, controllability) : ""});
    const double x = g.continuous() ? m.value.real() : std::abs(m.value) - 1;
    r.stable = r.stable && x < 0;
  }
  return r;
}

Complex value_of(const std::pair<Expr, Expr>& root) { return {number(root.first), number(root.second)}; }

/// Are x and y equal, independent of the time unit: relative to their size, or both at the rounding level of
/// the largest root?
bool near(Complex x, Complex y, double tol, double largest) {
  const double size = std::max(std::abs(x), std::abs(y));
  return std::abs(x - y) <= tol * size || size <= tol * tol * largest;
}

/// Removes pairs of zeros and poles that are equal within tol.
Factored without_pairs(Factored f, double tol, int& pairs) {
  double largest = 0;
  for (const auto* roots : {&f.zeros, &f.poles})
    for (const auto& r : *roots) largest = std::max(largest, std::abs(value_of(r)));
  for (std::size_t i = 0; i < f.zeros.size();) {
    const auto pole = std::find_if(f.poles.begin(), f.poles.end(), [&](const auto& p) {
      return near(value_of(f.zeros[i]), value_of(p), tol, largest);
    });
    if (pole == f.poles.end()) {
      ++i;
      continue;
    }
    f.poles.erase(pole);
    f.zeros.erase(f.zeros.begin() + static_cast<std::ptrdiff_t>(i));
    ++pairs;
  }
  return f;
}

System minimal_fractions(const System& g, double tol) {
  constexpr double double_root = 1e-8;  // relative: computed double zeros err by √ε
  const double closeness = tol > 0 ? tol : double_root;
  System h = g;
  int removed = 0;
  if (g.form == Form::zpk) {
    for (Factored& f : h.zpk) f = without_pairs(f, closeness, removed);
  } else {
    for (Fraction& f : h.tf) {
      const int before = degree(f.den);
      const Field kind = common(field(std::span<const Expr>(f.num)), field(std::span<const Expr>(f.den)));
      if (kind == Field::symbolic || (kind == Field::exact && tol == 0)) {
        f = cancelled(f);
        removed += before - degree(f.den);
        continue;
      }
      int pairs = 0;
      const System factored = to_zpk(make_tf({f}, 1, 1, g.Ts));
      const Factored z = without_pairs(factored.zpk[0], closeness, pairs);
      if (pairs > 0) f = to_tf(make_zpk({z}, 1, 1, g.Ts)).tf[0];
      removed += pairs;
    }
  }
  h.notes.clear();
  if (removed) h.notes.push_back("minimal: " + counted(removed, "common factor") + " removed");
  return h;
}

}  // namespace

MatX controllability_matrix(const System& given) {
  const System g = to_ss(given);
  const int n = g.ss.order(), m = g.inputs;
  if (field(g) != Field::symbolic && n > most_exact_pairs) {
    const Mat A = numbers(g.ss.A);
    Mat all(n, n * m), part = numbers(g.ss.B);
    for (int k = 0; k < n; ++k, part = A * part) all.middleCols(k * m, m) = part;
    if (!all.allFinite())
      throw Failure(text("the entries of A^", n - 1,
                         " B overflow in this unit of time; G:controllability() does not need them"));
    return expressions(all);
  }
  MatX all(n, n * m), part = g.ss.B;
  for (int k = 0; k < n; ++k) {
    all.middleCols(k * m, m) = part;
    if (k + 1 < n) part = tidy(product(g.ss.A, part));
  }
  return all;
}

MatX observability_matrix(const System& given) {
  return controllability_matrix(transposed(to_ss(given))).transpose();
}

Reach controllability(const System& g) {
  Reach r = reach(to_ss(g), true);
  r.system = std::make_shared<const System>(g);
  return r;
}

Reach observability(const System& g) {
  Reach r = reach(transposed(to_ss(g)), false);
  r.system = std::make_shared<const System>(g);
  return r;
}

MatX matrix(const Reach& r) {
  return r.controllability ? controllability_matrix(*r.system) : observability_matrix(*r.system);
}

std::string describe(const Reach& r) {
  const char* word = r.controllability ? "controllable" : "observable";
  std::string out = text(r.rank == r.order ? "" : "not ", word, ": the ",
                         r.controllability ? "controllability" : "observability", " matrix has rank ", r.rank,
                         " of ", r.order);
  Table table;
  for (const auto& h : r.modes) {
    std::string value =
        h.mode.exact ? pendula::to_text(h.mode.exact->first) : pendula::rounded(h.mode.value.real(), 6);
    if (h.mode.value.imag() != 0) {
      if (h.mode.value.imag() < 0) continue;
      const std::string im =
          h.mode.exact ? pendula::to_text(h.mode.exact->second) : pendula::rounded(h.mode.value.imag(), 6);
      value = (h.mode.value.real() == 0 ? "±" : value + " ± ") + (im == "1" ? "" : im + " ") + "i";
    }
    table.row({text(r.controllability ? "uncontrollable" : "unobservable", " mode ", value), h.text});
  }
  if (!r.modes.empty()) {
    out += "\n" + table.str(2);
    out += text(r.stable ? "" : "not ", r.controllability ? "stabilizable" : "detectable", ": ",
                r.stable ? "these modes decay" : "not all of these modes decay");
  }
  return out;
}

System minimal(const System& g, double tol) {
  if (tol > 0 && field(g) == Field::symbolic)
    throw Error(
        "tol compares numbers, but the system has symbols; leave it out, or give values with G:with{ … }");
  if (g.form != Form::ss) return minimal_fractions(g, tol);
  if (field(g) == Field::symbolic) {
    if (!g.siso())
      throw Error(
          "a minimal realisation with symbols needs one input and one output; give values with G:with{ … }");
    System h = to_ss(to_tf(g));
    if (h.ss.order() == g.ss.order()) return g;
    h.notes.push_back("minimal: " + counted(g.ss.order() - h.ss.order(), "state") + " removed");
    return h;
  }
  const Split c = split(g.ss.A, g.ss.B, tol);
  System h = c.dimension == g.ss.order() ? g : transformed(g, c, c.dimension);
  const int uncontrollable = g.ss.order() - h.ss.order();
  const System t = transposed(h);
  const Split o = split(t.ss.A, t.ss.B, tol);
  const int unobservable = h.ss.order() - o.dimension;
  if (unobservable > 0) {
    System dual = transformed(t, o, o.dimension);
    System back = transposed(dual);
    back.input_names = g.input_names;
    back.output_names = g.output_names;
    h = std::move(back);
  }
  if (h.ss.order() != g.ss.order()) h.state_names.clear();
  h.notes.clear();
  std::vector<std::string> parts;
  if (uncontrollable) parts.push_back(counted(uncontrollable, "uncontrollable state"));
  if (unobservable) parts.push_back(counted(unobservable, "unobservable state"));
  if (!parts.empty()) h.notes.push_back("minimal: " + join(parts, " and ") + " removed");
  return h;
}

// ── Lyapunov equations ──

namespace {

MatX exact_lyapunov(const MatX& A, const MatX& Q, bool continuous) {
  const Index n = A.rows();
  MatX K = MatX::Zero(n * n, n * n);  // acting on vec P, the stacked columns
  for (Index j = 0; j < n; ++j)
    for (Index i = 0; i < n; ++i)
      for (Index l = 0; l < n; ++l)
        if (continuous) {
          K(j * n + i, j * n + l) += A(i, l);
          K(j * n + i, l * n + i) += A(j, l);
        } else {
          for (Index k = 0; k < n; ++k) K(j * n + i, k * n + l) += A(i, l) * A(j, k);
        }
  if (!continuous)
    for (Index k = 0; k < n * n; ++k) K(k, k) -= 1;
  const MatX right = scaled(-1, MatX(Q.reshaped(n * n, 1)));
  const auto p = solve(K, right);
  if (!p)
    throw Error(
        "the Lyapunov equation has no unique solution: A has eigenvalues that are opposite to each other");
  return p->reshaped(n, n);
}

/// With scaled states, x = D x̃: P = D P̃ D.
Mat schur_lyapunov(const Mat& A, const Mat& Q, bool continuous, const Vec& d) {
  const Index n = A.rows();
  const Vec inverse = d.cwiseInverse();
  const Eigen::ComplexSchur<Mat> schur(linalg::similar(A, d));
  const ComplexMat &T = schur.matrixT(), &U = schur.matrixU();
  const ComplexMat scaled = (inverse.asDiagonal() * Q * inverse.asDiagonal()).cast<Complex>(),
                   F = U.adjoint() * scaled * U;
  ComplexMat Y = ComplexMat::Zero(n, n);
  const double smallest = 1e-14 * T.norm();  // 45 ε: eigenvalues of A that are opposite but for rounding
  // Columns from the right: in A P + P Aᴴ + Q = 0 with T upper triangular, (T + t̄ⱼⱼ I) yⱼ = -fⱼ -
  // Σ_{k>j} t̄ⱼₖ yₖ.
  for (Index j = n; j-- > 0;) {
    ComplexVec right = -F.col(j);
    ComplexMat M = T;
    if (continuous) {
      for (Index k = j + 1; k < n; ++k) right -= std::conj(T(j, k)) * Y.col(k);
      M.diagonal().array() += std::conj(T(j, j));
    } else {
      ComplexVec later = ComplexVec::Zero(n);
      for (Index k = j + 1; k < n; ++k) later += std::conj(T(j, k)) * Y.col(k);
      right -= T * later;
      M *= std::conj(T(j, j));
      M.diagonal().array() -= 1.0;
    }
    for (Index i = 0; i < n; ++i)
      if (std::abs(M(i, i)) <= smallest)
        throw Error(
            "the Lyapunov equation has no unique solution: A has "
            "eigenvalues that are opposite to each other");
    Y.col(j) = M.triangularView<Eigen::Upper>().solve(right);
  }
  const Mat P = d.asDiagonal() * Mat(ComplexMat(U * Y * U.adjoint()).real()) * d.asDiagonal();
  return (P + P.transpose()) / 2;
}

/// The largest entry of the residual relative to the sum of its terms, independent of units.
double entrywise_residual(const Mat& A, const Mat& Q, const Mat& P, bool continuous) {
  const Mat a = A.cwiseAbs(), p = P.cwiseAbs();
  const Mat residual = continuous ? Mat(A * P + P * A.transpose() + Q) : Mat(A * P * A.transpose() - P + Q);
  const Mat size =
      (continuous ? Mat(a * p + p * a.transpose()) : Mat(a * p * a.transpose() + p)) + Q.cwiseAbs();
  return (size.array() > 0).select(residual.cwiseAbs().cwiseQuotient(size), 0).maxCoeff();
}

/// Solves with A balanced and, if the result is inaccurate, also in the given units, which are better if
/// small entries of A are rounding errors (poles at 0).
Mat numeric_lyapunov(const Mat& A, const Mat& Q, bool continuous) {
  const Vec d = linalg::balancing(A);
  const Mat P = schur_lyapunov(A, Q, continuous, d);
  const double error = entrywise_residual(A, Q, P, continuous);
  constexpr double rounding = 1e-13;  // 450 ε per state
  if (d.isOnes(0) || error <= rounding * static_cast<double>(A.rows())) return P;
  try {
    const Mat plain = schur_lyapunov(A, Q, continuous, Vec::Ones(A.rows()));
    return entrywise_residual(A, Q, plain, continuous) < error ? plain : P;
  } catch (const Error&) {
    return P;
  }
}

}  // namespace

MatX lyapunov(const MatX& A, const MatX& Q, bool continuous) {
  if (A.rows() != A.cols() || Q.rows() != A.rows() || Q.cols() != A.cols())
    throw Error(text("A and Q must be square and of one size, but they are ", A.rows(), "×", A.cols(),
                     " and ", Q.rows(), "×", Q.cols()));
  if (A.rows() == 0) return A;
  const Field f = common(field(A), field(Q));
  // n(n + 1)/2 unknowns: 10 with symbols, 36 in rational numbers (3 ms)
  constexpr Index most_symbolic = 4, most_exact = 8;
  if (f == Field::symbolic ? A.rows() <= most_symbolic : f == Field::exact && A.rows() <= most_exact)
    return exact_lyapunov(A, Q, continuous);
  const Mat q = numbers(Q);
  constexpr double rounding = 1e-12;  // of a product such as CᵀC: 4500 ε
  if (!q.isApprox(q.transpose(), rounding)) throw Error("Q must be symmetric");
  const double n = static_cast<double>(A.rows());
  return expressions(stoppable(
      100 * n * n * n, [&] { return std::vector<Mat>{numeric_lyapunov(numbers(A), q, continuous)}; })[0]);
}

MatX gramian(const System& given, bool controllability) {
  const System g = to_ss(given);
  if (field(g) != Field::symbolic)
    if (const Stability s = stability(g); !s.asymptotic)
      throw Error(text("a Gramian needs an asymptotically stable system; this one is ", describe(s)));
  if (controllability) return lyapunov(g.ss.A, product(g.ss.B, g.ss.B.transpose()), g.continuous());
  return lyapunov(g.ss.A.transpose(), product(g.ss.C.transpose(), g.ss.C), g.continuous());
}

}  // namespace pendula::lti
