// Conversion between state space and fractions.
#include "lti/system.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "lti/structure.hpp"

namespace pendula::lti {
namespace {

// Doubles as coefficients do not determine the zeros of longer polynomials; exact ones of 40 states with
// entries of one digit take 0.1 s.
constexpr int most_states = 40;

/// det(sI - A) and C adj(sI - A) B, row by row.
struct Resolvent {
  Polynomial den;
  std::vector<Polynomial> num;
};

// N₀ = I, cₖ = -tr(A Nₖ₋₁)/k, Nₖ = A Nₖ₋₁ + cₖ I:  det(sI - A) = Σ cₖ sⁿ⁻ᵏ, adj(sI - A) = Σ Nₖ sⁿ⁻¹⁻ᵏ
// (Faddeev & LeVerrier; Gantmacher, The Theory of Matrices I, §IV.5)

/// In integers, A = M/d, which avoids reducing fractions.
Resolvent of_rationals(const dae::RationalMatrix& A, const dae::RationalMatrix& B,
                       const dae::RationalMatrix& C) {
  const int n = A.rows(), m = B.cols(), p = C.rows();
  mpz_class d = 1;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) d = lcm(d, A(i, j).get_den());
  const auto at = [n](int i, int j) { return static_cast<std::size_t>(i * n + j); };
  std::vector<mpz_class> M(static_cast<std::size_t>(n) * n), N(M.size()), AN(M.size());
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      M[at(i, j)] = mpq_class(A(i, j) * d).get_num();
      N[at(i, j)] = i == j;
    }
  dae::Polynomial den(static_cast<std::size_t>(n) + 1);
  std::vector<dae::Polynomial> num(static_cast<std::size_t>(p) * m,
                                   dae::Polynomial(static_cast<std::size_t>(n)));
  den.back() = 1;
  mpq_class scale = 1;  // d⁻ᵏ
  for (int k = 1; k <= n; ++k) {
    dae::RationalMatrix now(n, n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) now(i, j) = N[at(i, j)];
    const dae::RationalMatrix part = scale * (C * (now * B));
    for (int i = 0; i < p * m; ++i) num[i][n - k] = part(i / m, i % m);
    mpz_class trace = 0;
    for (int i = 0; i < n; ++i) {
      poll_interrupt();
      for (int j = 0; j < n; ++j) {
        mpz_class sum = 0;
        for (int l = 0; l < n; ++l)
          if (M[at(i, l)] != 0) sum += M[at(i, l)] * N[at(l, j)];
        AN[at(i, j)] = sum;
      }
      trace += AN[at(i, i)];
    }
    const mpz_class c = -trace / k;
    scale /= d;
    den[n - k] = c * scale;
    for (int i = 0; i < n; ++i) AN[at(i, i)] += c;
    std::swap(N, AN);
  }
  Resolvent r{expressions(den), {}};
  for (dae::Polynomial& q : num) {
    while (!q.empty() && q.back() == 0) q.pop_back();
    r.num.push_back(expressions(q));
  }
  return r;
}

Resolvent of_symbols(const MatX& A, const MatX& B, const MatX& C) {
  const Index n = A.rows();
  Resolvent r;
  r.den.assign(static_cast<std::size_t>(n) + 1, Expr(0));
  r.den.back() = 1;
  r.num.assign(static_cast<std::size_t>(C.rows() * B.cols()), Polynomial(static_cast<std::size_t>(n)));
  MatX N = MatX::Identity(n, n);
  for (Index k = 1; k <= n; ++k) {
    const MatX part = product(C, product(N, B));
    for (Index i = 0; i < part.size(); ++i) r.num[i][n - k] = part(i / B.cols(), i % B.cols());
    N = tidy(product(A, N));
    Expr trace = 0;
    for (Index i = 0; i < n; ++i) trace += N(i, i);
    const Expr c = simplify(-trace / Expr(static_cast<long>(k)));
    r.den[n - k] = c;
    for (Index i = 0; i < n; ++i) N(i, i) = simplify(N(i, i) + c);
  }
  for (Polynomial& q : r.num) q = tidy(std::move(q));
  return r;
}

std::string roots_text(const Polynomial& p, const char* variable) { return "(" + to_text(p, variable) + ")"; }

/// Sets leading coefficients c A^{k-1} b of a numerator to 0 if they are rounding errors: smaller than 64 ε
/// of the same product of absolute values. Stops at the first coefficient that is not.
void drop_rounding(Polynomial& num, const StateSpace& g, Index i, Index j) {
  if (!g.D(i, j).is_zero()) return;
  const Mat A = numbers(g.A).cwiseAbs();
  Vec seen = numbers(g.C).row(i).cwiseAbs().transpose();
  const Vec b = numbers(g.B).col(j).cwiseAbs();
  num.resize(std::min(num.size(), static_cast<std::size_t>(g.order())));
  for (Index k = g.order() - 1; k > 0; --k) {
    if (static_cast<Index>(num.size()) == k + 1) {
      // |A|ᵏ|b|: the terms that cancel; their sum errs by some ε of it, 64 is a choice
      const double bound = 64 * eps * seen.dot(b);
      if (!(std::fabs(constant_value(num.back())) <= bound)) return;
      num.pop_back();
    }
    seen = (A.transpose() * seen).eval();
  }
}

System tf_of_ss(const System& g) {
  const int n = g.ss.order();
  const Field f = field(g);
  if (n > most_states)
    throw Error(text("a transfer function of order ", n, " is not a useful set of numbers (at most ",
                     most_states,
                     "); keep the state space: G:poles(), G:bode(), G(s) at a number work on it"));
  const Resolvent r = f == Field::symbolic
                          ? of_symbols(g.ss.A, g.ss.B, g.ss.C)
                          : of_rationals(rational(g.ss.A), rational(g.ss.B), rational(g.ss.C));
  std::vector<Fraction> list;
  std::vector<Polynomial> dropped;
  for (int i = 0; i < g.outputs; ++i)
    for (int j = 0; j < g.inputs; ++j) {
      Fraction full{r.num[i * g.inputs + j] + scaled(g.ss.D(i, j), r.den), r.den};
      if (f == Field::numeric) {
        for (Polynomial* p : {&full.num, &full.den})
          for (Expr& c : *p) c = Expr(constant_value(c));
        drop_rounding(full.num, g.ss, i, j);
        list.push_back(full);
        continue;
      }
      Fraction short_form = cancelled(full);
      if (g.siso() && degree(short_form.den) < n)
        dropped.push_back(divide(full.den, short_form.den).quotient);
      list.push_back(std::move(short_form));
    }
  System h = make_tf(std::move(list), g.outputs, g.inputs, g.Ts);
  for (const Polynomial& p : dropped)
    h.notes.push_back("cancelled: " + roots_text(p, g.variable()) + ", not controllable or not observable");
  return h;
}

System tf_of_zpk(const System& g) {
  std::vector<Fraction> list;
  for (const Factored& f : g.zpk) list.push_back({scaled(f.gain, from_zeros(f.zeros)), from_zeros(f.poles)});
  return make_tf(std::move(list), g.outputs, g.inputs, g.Ts);
}

/// One input, several outputs over a common monic denominator: the controllable canonical form.
StateSpace phase_variables(const Polynomial& den, const std::vector<Polynomial>& nums) {
  const Index n = degree(den), p = static_cast<Index>(nums.size());
  StateSpace s{MatX::Zero(n, n), MatX::Zero(n, 1), MatX::Zero(p, n), MatX::Zero(p, 1)};
  for (Index i = 0; i + 1 < n; ++i) s.A(i, i + 1) = 1;
  for (Index j = 0; j < n; ++j) s.A(n - 1, j) = -den[j];
  if (n > 0) s.B(n - 1, 0) = 1;
  for (Index i = 0; i < p; ++i) {
    const Polynomial& b = nums[i];
    const Expr d = degree(b) == n ? b.back() : Expr(0);
    s.D(i, 0) = d;
    for (Index j = 0; j < n; ++j) {
      const Expr bj = static_cast<std::size_t>(j) < b.size() ? b[j] : Expr(0);
      s.C(i, j) = bj - d * den[j];
    }
  }
  s.A = tidy(s.A);
  s.C = tidy(s.C);
  return s;
}

void require_proper(const System& g) {
  for (int i = 0; i < g.outputs; ++i)
    for (int j = 0; j < g.inputs; ++j)
      if (const Fraction& f = g.fraction(i, j); degree(f.num) > degree(f.den))
        throw Error(text("a transfer function that is not proper has no state space: the numerator ",
                         to_text(f.num, g.variable()), " has degree ", degree(f.num), ", the denominator ",
                         to_text(f.den, g.variable()), " degree ", degree(f.den),
                         g.siso() ? "" : text(" (from ", input_name(g, j), " to ", output_name(g, i), ")"),
                         "; add a fast pole, such as 1/(0.01 s + 1)"));
}

System ss_of_tf(const System& g) {
  require_proper(g);
  std::vector<StateSpace> columns;
  for (int j = 0; j < g.inputs; ++j) {
    Polynomial den = {1};
    std::vector<Fraction> list;
    for (int i = 0; i < g.outputs; ++i) {
      Fraction f = g.fraction(i, j);
      const Expr lead = 1 / f.den.back();
      list.push_back({tidy(scaled(lead, f.num)), tidy(scaled(lead, f.den))});
      list.back().den.back() = 1;
      const Polynomial& d = list.back().den;
      if (d == den) continue;
      const Polynomial common = gcd(den, d);
      den = den * divide(d, common).quotient;
    }
    std::vector<Polynomial> nums;
    for (const Fraction& f : list) nums.push_back(f.den == den ? f.num : f.num * divide(den, f.den).quotient);
    columns.push_back(phase_variables(den, nums));
  }
  StateSpace s = columns[0];
  for (std::size_t j = 1; j < columns.size(); ++j)
    s = {block_diagonal(s.A, columns[j].A), block_diagonal(s.B, columns[j].B), hstack(s.C, columns[j].C),
         hstack(s.D, columns[j].D)};
  System h = make_ss(s.A, s.B, s.C, s.D, g.Ts);
  return g.siso() || field(h) == Field::symbolic ? h : minimal(h, 0);
}

}  // namespace

System to_tf(const System& g) {
  if (g.form == Form::tf) return g;
  if (g.inputs == 0 || g.outputs == 0)
    throw Error(text("a system without ", g.inputs == 0 ? "inputs" : "outputs",
                     " has no transfer function; give B and C, as in ss(A, B, C)"));
  System h = g.form == Form::ss ? tf_of_ss(g) : tf_of_zpk(g);
  h.input_names = g.input_names;
  h.output_names = g.output_names;
  return h;
}

System to_ss(const System& g) {
  if (g.form == Form::ss) return g;
  System h = ss_of_tf(to_tf(g));
  h.input_names = g.input_names;
  h.output_names = g.output_names;
  return h;
}

System to_zpk(const System& given) {
  if (given.form == Form::zpk) return given;
  const System g = to_tf(with_numbers(given));
  std::vector<Factored> list;
  for (const Fraction& f : g.tf) {
    Factored entry;
    if (!f.num.empty()) {
      entry.gain = f.num.back() / f.den.back();
      for (const auto& [p, roots] : {std::pair{&f.num, &entry.zeros}, std::pair{&f.den, &entry.poles}})
        for (const dae::Mode& z : zeros(*p))
          for (int k = 0; k < z.multiplicity; ++k)
            roots->push_back(z.exact ? *z.exact : std::pair(Expr(z.value.real()), Expr(z.value.imag())));
    }
    list.push_back(std::move(entry));
  }
  System h = make_zpk(std::move(list), g.outputs, g.inputs, g.Ts);
  h.input_names = g.input_names;
  h.output_names = g.output_names;
  h.notes = g.notes;
  return h;
}

int order(const System& g) {
  if (g.form == Form::ss) return g.ss.order();
  if (g.siso()) return degree(to_tf(g).tf[0].den);
  return to_ss(g).ss.order();
}

}  // namespace pendula::lti
