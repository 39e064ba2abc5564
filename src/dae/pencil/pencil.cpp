#include "dae/pencil/pencil.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/pencil/pencil_shuffle.hpp"
#include "expr/print/primes.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

RationalMatrix at(const LinearForm& f, long s) { return mpq_class(s) * f.E - f.A; }

/// An s with det(sE - A) ≠ 0, or nothing: a polynomial of degree ≤ n with n + 1 zeros is zero.
std::optional<long> regular_point(const LinearForm& f) {
  if (f.rows() != f.size()) return {};
  for (long s = 0; s <= f.size(); ++s)
    if (rank(at(f, s)) == f.size()) return s;
  return {};
}

/// The generic rank of sE - A: at most min(rows, columns) values of s have a smaller one.
int generic_rank_of(const LinearForm& f) {
  int best = 0;
  const int limit = std::min(f.rows(), f.size());
  for (long s = 0; s <= limit && best < limit; ++s) best = std::max(best, rank(at(f, s)));
  return best;
}

/// A minimal basis of {x(s) : (sE - A) x(s) = 0}: vectors of degree 0, 1, … that are not combinations of
/// shifted earlier ones. With x = Σ xₖ sᵏ the equations are E xₖ₋₁ = A xₖ, k = 0 … d+1.
std::vector<PolynomialVector> minimal_basis(const RationalMatrix& E, const RationalMatrix& A, int count) {
  const int m = E.rows(), n = E.cols();
  std::vector<PolynomialVector> basis;
  for (int d = 0; static_cast<int>(basis.size()) < count; ++d) {
    PENDULA_ASSERT(d <= std::min(m, n) + 1, "a minimal basis of a pencil is incomplete");
    RationalMatrix toeplitz((d + 2) * m, (d + 1) * n);
    for (int k = 0; k <= d; ++k) {
      toeplitz.set(k * m, k * n, mpq_class(-1) * A);
      toeplitz.set((k + 1) * m, k * n, E);
    }
    RationalMatrix known((d + 1) * n, 0);
    for (const PolynomialVector& v : basis)
      for (int shift = 0; shift + v.coefficient.cols() <= d + 1; ++shift) {
        RationalMatrix stacked((d + 1) * n, 1);
        for (int k = 0; k < v.coefficient.cols(); ++k)
          stacked.set((k + shift) * n, 0, v.coefficient.columns(k, 1));
        known = hstack(known, stacked);
      }
    const RationalMatrix fresh = complement(known, kernel(toeplitz));
    for (int j = 0; j < fresh.cols(); ++j) {
      PolynomialVector v{RationalMatrix(n, d + 1)};
      for (int k = 0; k <= d; ++k) v.coefficient.set(0, k, fresh.block(k * n, j, n, 1));
      basis.push_back(std::move(v));
    }
  }
  return basis;
}

struct WongSpaces {
  RationalMatrix V, W;
  int index = 0;  ///< the number of steps until W is stationary
};

WongSpaces wong_spaces(const RationalMatrix& E, const RationalMatrix& A) {
  const int n = E.cols();
  WongSpaces s{RationalMatrix::identity(n), RationalMatrix(n, 0), 0};
  while (true) {
    RationalMatrix next = preimage(A, E * s.V);
    if (next.cols() == s.V.cols()) break;
    s.V = std::move(next);
  }
  while (true) {
    RationalMatrix next = preimage(E, A * s.W);
    if (next.cols() == s.W.cols()) break;
    s.W = std::move(next);
    ++s.index;
  }
  return s;
}

/// Scales every set of columns that the block-diagonal matrix m couples to coprime integers as a whole, which
/// leaves m unchanged.
RationalMatrix scaled_chains(RationalMatrix basis, const RationalMatrix& m) {
  for (int first = 0, last; first < m.rows(); first = last + 1) {
    last = first;
    for (int i = first; i <= last; ++i)
      for (int j = i + 1; j < m.rows(); ++j)
        if (m(i, j) != 0 || m(j, i) != 0) last = std::max(last, j);
    const RationalMatrix chain = basis.columns(first, last - first + 1);
    basis.set(0, first,
              primitive_factor(chain.columns(0, 1)) < 0 ? -abs(primitive_factor(chain)) * chain
                                                        : abs(primitive_factor(chain)) * chain);
  }
  return basis;
}

void weierstrass(Pencil& p, long regular_at) {
  const RationalMatrix &E = p.form.E, &A = p.form.A;
  const int n = E.rows();
  const WongSpaces s = wong_spaces(E, A);
  p.dof = s.V.cols();
  p.index = s.index;
  PENDULA_ASSERT(s.V.cols() + s.W.cols() == n, "the Wong spaces of a regular pencil do not fill the space");
  const auto transform = [&](const RationalMatrix& V, const RationalMatrix& W) {
    const auto S = inverse(hstack(E * V, A * W));
    PENDULA_ASSERT(S.has_value(), "[E V, A W] of a regular pencil is singular");
    p.T = hstack(V, W);
    p.S = *S;
    const RationalMatrix SAT = p.S * A * p.T, SET = p.S * E * p.T;
    p.J = SAT.block(0, 0, p.dof, p.dof);
    p.N = SET.block(p.dof, p.dof, n - p.dof, n - p.dof);
  };
  transform(s.V, s.W);
  p.det = characteristic(p.J);
  const std::vector<Factor> split = factors(p.det);
  p.modes = modes(split);
  transform(s.V * jordan_basis(p.J, split), s.W * nilpotent_chains(p.N));
  transform(scaled_chains(p.T.columns(0, p.dof), p.J), scaled_chains(p.T.columns(p.dof, n - p.dof), p.N));

  RationalMatrix power = RationalMatrix::identity(n - p.dof);
  for (int k = 0; k < p.index; ++k) power = power * p.N;
  PENDULA_ASSERT(p.S * E * p.T == diagonal(RationalMatrix::identity(p.dof), p.N), "S E T is not diag(I, N)");
  PENDULA_ASSERT(p.S * A * p.T == diagonal(p.J, RationalMatrix::identity(n - p.dof)),
                 "S A T is not diag(J, I)");
  PENDULA_ASSERT(power.is_zero(), "N is not nilpotent of the index of the Wong sequence");

  // det(sE - A) = det(sI - J) det(sN - I) / (det S det T), and det(sN - I) = (-1)ⁿ⁻ᵈ.
  const mpq_class factor = ((n - p.dof) % 2 ? -1 : 1) / (determinant(p.S) * determinant(p.T));
  for (mpq_class& c : p.det) c *= factor;
  PENDULA_ASSERT(value(p.det, mpq_class(regular_at)) == determinant(at(p.form, regular_at)),
                 "det(sE - A) differs from its value at a point");
}

/// The coefficients of the unknowns in a linear expression.
RationalMatrix row_of(Expr residual, const LinearForm& f) {
  RationalMatrix row(1, f.size());
  const std::vector<Expr> slopes = gradient(residual, f.x);
  for (int j = 0; j < f.size(); ++j) {
    const Expr slope = simplify(slopes[j]);
    PENDULA_ASSERT(exact_value(slope) != nullptr, "a constraint of a linear system is not linear");
    row(0, j) = *exact_value(slope);
  }
  return row;
}

/// "(1c) - (1a) - (1b)": the combination of equations that yields a constraint, the
/// most differentiated first.
std::string combined_label(const LinearForm& f, const Combination& of) {
  constexpr int widest = 48;  // columns of a label
  const auto name = [&](const std::pair<int, int>& equation) {
    return f.label[equation.second] + primes(equation.first);
  };
  std::vector<std::pair<std::pair<int, int>, mpq_class>> terms(of.begin(), of.end());
  std::stable_sort(terms.begin(), terms.end() - 1,  // the last one stays last, the others are sorted
                   [](const auto& a, const auto& b) { return a.first.first > b.first.first; });
  std::rotate(terms.begin(), terms.end() - 1, terms.end());
  RationalMatrix values(1, static_cast<int>(of.size()));
  for (std::size_t k = 0; k < terms.size(); ++k) values(0, static_cast<int>(k)) = terms[k].second;
  mpq_class scale = abs(primitive_factor(values));
  if (terms[0].second < 0) scale = -scale;
  std::string sum, list;
  for (const auto& [equation, factor] : terms) {
    const mpq_class q = scale * factor, size = abs(q);
    if (!sum.empty()) list += (list.empty() ? " with " : ", ") + name(equation);
    if (!sum.empty()) sum += q < 0 ? " - " : " + ";
    sum += (size == 1 ? "" : size.get_str() + " ") + name(equation);
  }
  if (display_width(sum) <= widest) return sum;
  constexpr std::size_t listed = 4;  // equations in a label
  return name(terms[0].first) +
         (of.size() <= listed ? list : text(" with ", of.size() - 1, " other equations and derivatives"));
}

Constraint constraint_of(const LinearForm& f, const ShuffleConstraint& c) {
  Expr residual = c.g;
  for (int j = f.size(); j-- > 0;)
    if (c.a(0, j) != 0) residual = Expr(c.a(0, j)) * f.x[j] + residual;
  if (c.of.size() > 1) return {simplify(residual), {}, 0, c.derivative, combined_label(f, c.of)};
  const auto& origin = f.origin[c.row];
  return {simplify(residual), origin ? std::optional(origin->first) : std::nullopt,
          origin ? origin->second : 0, c.derivative, f.label[c.row] + primes(c.derivative)};
}

}  // namespace

LinearIndex linear_index(const LinearForm& f) {
  LinearIndex result;
  const Shuffle s = shuffle(f, ShuffleScope::constraints);
  result.regular = s.regular;
  if (!s.regular) return result;
  result.index = s.rounds();
  result.dof = f.size() - static_cast<int>(s.constraints.size());
  std::vector<int> algebraic;
  for (int j = 0; j < f.size(); ++j)
    if (f.E.columns(j, 1).is_zero()) algebraic.push_back(j);
  // Conditions that contain algebraic variables are solved for one each; the remaining ones
  // contain states only.
  std::vector<std::pair<int, ShuffleConstraint>> pivots;
  for (ShuffleConstraint c : s.constraints) {
    for (const auto& [j, row] : pivots) {
      if (c.a(0, j) == 0) continue;
      const mpq_class factor = c.a(0, j) / row.a(0, j);
      c.a = c.a - factor * row.a;
      c.g = c.g - Expr(factor) * row.g;
      add_multiple(c.of, -factor, row.of);
      c.derivative = std::max(c.derivative, row.derivative);
    }
    const mpq_class scale = primitive_factor(c.a);
    c.a = scale * c.a;
    c.g = simplify(Expr(scale) * c.g);
    const auto pivot =
        std::find_if(algebraic.begin(), algebraic.end(), [&](int j) { return c.a(0, j) != 0; });
    (pivot == algebraic.end() ? result.constraints : result.algebraic).push_back(constraint_of(f, c));
    if (pivot != algebraic.end()) pivots.emplace_back(*pivot, std::move(c));
  }
  return result;
}

Pencil pencil(const LinearForm& form) {
  Pencil p;
  p.form = form;
  const auto point = regular_point(form);
  p.regular = point.has_value();
  p.rank = p.regular ? form.size() : generic_rank_of(form);
  if (p.regular) {
    weierstrass(p, *point);
    LinearIndex low = linear_index(form);
    PENDULA_ASSERT(low.regular && low.index == p.index && low.dof == p.dof,
                   "the shuffle algorithm and the Wong sequences differ");
    for (const auto* list : {&low.constraints, &low.algebraic})
      for (const Constraint& c : *list)
        PENDULA_ASSERT((row_of(c.residual, form) * p.basis()).is_zero(),
                       "a constraint of the shuffle is violated by a solution");
    p.constraints = std::move(low.constraints);
    p.algebraic = std::move(low.algebraic);
  } else {
    p.columns = minimal_basis(form.E, form.A, form.size() - p.rank);
    p.rows = minimal_basis(form.E.transposed(), form.A.transposed(), form.rows() - p.rank);
  }
  return p;
}

Pencil pencil(const Model& model) {
  std::string reason;
  const auto form = linear_form(model, &reason);
  if (!form) throw Error(reason);
  return pencil(*form);
}

}  // namespace pendula::dae
