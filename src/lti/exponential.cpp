#include "lti/exponential.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/pencil/pencil.hpp"
#include "dae/pencil/pencil_forcing.hpp"
#include "expr/generic/generic.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::lti {
namespace {

bool vanishes(const MatX& m) {
  return std::all_of(m.data(), m.data() + m.size(),
                     [](Expr e) { return e.is_constant() ? e.is_zero() : generic::is_zero(e); });
}

MatX of_rational(const dae::RationalMatrix& A, Expr t) {
  MatX result(A.rows(), A.rows());
  for (int j = 0; j < A.rows(); ++j) {
    VecX e = VecX::Zero(A.rows());
    e[j] = 1;
    result.col(j) = dae::exponential(A, t, e);
  }
  return tidy(result);
}

/// A = R s, where s is the first irrational entry without its rational factor.
std::optional<std::pair<MatX, Expr>> common_factor(const MatX& A) {
  for (Index k = 0; k < A.size(); ++k) {
    const Expr s = A.data()[k];
    if (s.is_constant()) continue;
    MatX R(A.rows(), A.cols());
    for (Index i = 0; i < A.size(); ++i) {
      R.data()[i] = A.data()[i].is_zero() ? Expr(0) : simplify(A.data()[i] / s);
      if (!exact_value(R.data()[i])) return {};
    }
    return std::pair{R, s};
  }
  return {};
}

std::optional<MatX> nilpotent(const MatX& A, Expr t) {
  const Index n = A.rows();
  MatX power = MatX::Identity(n, n), total = power;
  for (Index k = 1; k <= n; ++k) {
    power = tidy(product(power, A));
    if (vanishes(power)) return tidy(total);
    power = scaled(t / Expr(static_cast<long>(k)), power);
    total += power;
  }
  return {};
}

/// Newton's form of the interpolation polynomial: e^{At} = Σₖ f[λ₁, …, λₖ] Π_{j<k} (A - λⱼI), f(λ) = e^{λt}
/// (Higham, Functions of Matrices, 2008, eq. (1.10)); equal eigenvalues are adjacent.
MatX newton_form(const MatX& A, std::vector<Expr> lambda, Expr t) {
  const auto n = lambda.size();
  for (std::size_t i = 0; i < n; ++i) {  // group equal ones
    auto next = i + 1;
    for (std::size_t j = i + 1; j < n; ++j)
      if (lambda[j] == lambda[i]) std::swap(lambda[next++], lambda[j]);
    i = next - 1;
  }
  std::vector<Expr> f;  // f[λᵢ, …, λᵢ₊ₖ] for all i, with increasing k
  for (Expr l : lambda) f.push_back(exp(simplify(l * t)));
  MatX total = scaled(f[0], MatX::Identity(A.rows(), A.cols())), factor = MatX::Identity(A.rows(), A.cols());
  Expr factorial = 1;
  for (std::size_t k = 1; k < n; ++k) {
    factorial = factorial * Expr(static_cast<long>(k));
    for (std::size_t i = 0; i + k < n; ++i)
      f[i] = lambda[i] == lambda[i + k]
                 ? pow(t, Expr(static_cast<long>(k))) * exp(simplify(lambda[i] * t)) / factorial
                 : (f[i + 1] - f[i]) / (lambda[i + k] - lambda[i]);
    MatX shifted = A;
    for (Index i = 0; i < A.rows(); ++i) shifted(i, i) -= lambda[k - 1];
    factor = tidy(product(factor, shifted));
    total += scaled(f[0], factor);
  }
  return tidy(total);
}

/// The sign of e for positive symbols at several points; 0 if it varies. The points are pseudo-random, spread
/// from e⁻³ to e³: a sign that changes on a tenth of them is overlooked in 0.9²⁴ = 8 % of the cases.
int sign_for_positive(Expr e) {
  const auto symbols = leaves({&e, 1});
  int sign = 0;
  double seed = 0.618;
  constexpr int points = 24;
  for (int point = 0; point < points; ++point) {
    std::unordered_map<Expr, double> values;
    for (Expr s : symbols) {
      seed = std::fmod(seed * 97.31 + 0.377, 1.0);
      values[s] = std::exp(6 * seed - 3);
    }
    const double v = evaluate({&e, 1}, values)[0];
    const int now = v < 0 ? -1 : v > 0;
    if (now == 0 || (sign != 0 && now != sign)) return 0;
    sign = now;
  }
  return sign;
}

/// √e for use in even functions, where b for b² suffices.
Expr even_root(Expr e) {
  if (e.op() == Op::pow && e.operand(1) == Expr(2)) return e.operand(0);
  return simplify(sqrt(e));
}

/// e^{At} = e^{μt} (cos(ωt) I + sin(ωt)/ω (A - μI)), μ = tr A/2, ω² = det A - μ²; with cosh and sinh if
/// ω² < 0.
std::optional<MatX> two_by_two(const MatX& A, Expr t) {
  const Expr mu = simplify((A(0, 0) + A(1, 1)) / 2);
  const Expr square = simplify(A(0, 0) * A(1, 1) - A(0, 1) * A(1, 0) - mu * mu);
  const int sign = square.is_zero() ? 1 : sign_for_positive(square);
  if (sign == 0) return {};
  const Expr w = even_root(sign > 0 ? square : simplify(-square));
  const MatX I = MatX::Identity(2, 2), shifted = A - scaled(mu, I);
  const Expr c = sign > 0 ? cos(w * t) : cosh(w * t), s = (sign > 0 ? sin(w * t) : sinh(w * t)) / w;
  return tidy(scaled(exp(simplify(mu * t)), MatX(scaled(c, I) + scaled(s, shifted))));
}

bool triangular(const MatX& A, bool upper) {
  for (Index i = 0; i < A.rows(); ++i)
    for (Index j = 0; j < A.cols(); ++j)
      if ((upper ? j < i : j > i) && !A(i, j).is_zero()) return false;
  return true;
}

}  // namespace

std::optional<MatX> transition(const MatX& given, Expr t) {
  const MatX A = tidy(given);
  if (A.rows() == 0) return A;
  if (field(A) == Field::exact) {
    if (auto finite = nilpotent(A, t)) return finite;
    return of_rational(rational(A), t);
  }
  if (auto finite = nilpotent(A, t)) return finite;
  if (const auto f = common_factor(A)) return of_rational(rational(f->first), f->second * t);
  if (field(A) == Field::numeric) return {};
  if (triangular(A, true) || triangular(A, false)) {
    std::vector<Expr> diagonal;
    for (Index i = 0; i < A.rows(); ++i) diagonal.push_back(A(i, i));
    return newton_form(A, diagonal, t);
  }
  if (A.rows() == 2) return two_by_two(A, t);
  return {};
}

std::optional<MatX> exponential(const MatX& A) {
  if (field(A) == Field::numeric) return {};
  return transition(A, 1);
}

namespace {

/// A particular solution of x′ = A x + b g(t) for one group of exponentials, sines and cosines with
/// symbolic rates: from the highest power down (aI - A) Pₖ + ω Qₖ = b pₖ - (k+1) Pₖ₊₁, (aI - A)
/// Qₖ - ω Pₖ = b qₖ - (k+1) Qₖ₊₁.
VecX particular(const MatX& A, const VecX& b, const dae::ForcingGroup& g) {
  const Index n = A.rows();
  MatX M = MatX::Zero(2 * n, 2 * n), last = MatX::Zero(2 * n, 1);
  for (Index i = 0; i < n; ++i) {
    for (Index k = 0; k < n; ++k) M(i, k) = M(n + i, n + k) = (i == k ? g.rate : Expr(0)) - A(i, k);
    M(i, n + i) = g.frequency, M(n + i, i) = -g.frequency;
  }
  const bool still = g.frequency.is_zero();
  if (still) {
    M = MatX(M.topLeftCorner(n, n));
    last = MatX::Zero(n, 1);
  }
  const Expr t = time_symbol();
  VecX x = VecX::Zero(n);
  for (std::size_t k = g.p.size(); k-- > 0;) {
    MatX right = scaled(-Expr(static_cast<long>(k + 1)), last);
    for (Index i = 0; i < n; ++i) {
      right(i, 0) += b[i] * g.p[k];
      if (!still) right(n + i, 0) += b[i] * g.q[k];
    }
    const auto next = solve(M, right);
    if (!next)
      throw Error(
          text("the input ", pendula::to_text(exp(g.rate * t) * cos(g.frequency * t)),
               " may be in resonance with a mode of the symbolic system; give values with G:with{ … }"));
    last = *next;
    const Expr growth = exp(g.rate * t) * (k == 0 ? Expr(1) : pow(t, Expr(static_cast<long>(k))));
    for (Index i = 0; i < n; ++i)
      x[i] += still ? growth * last(i, 0)
                    : growth * (last(i, 0) * cos(g.frequency * t) + last(n + i, 0) * sin(g.frequency * t));
  }
  return x;
}

/// The terms of an input in closed form.
std::vector<dae::ForcingGroup> groups_of(Expr u) {
  Expr culprit;
  const auto terms = dae::forcing_of(u, &culprit);
  if (!terms)
    throw Error(text("the input ", pendula::to_text(culprit),
                     " is not a polynomial, exponential, sine or cosine of t; use lsim(G, u, t) for it"));
  return dae::grouped(*terms);
}

VecX symbolic_solution(const System& g, const VecX& x0, const VecX& u) {
  const Expr t = time_symbol();
  const auto Phi = transition(g.ss.A, t);
  if (!Phi)
    throw Error(
        "e^{At} of this symbolic matrix has no closed form here; give values "
        "with G:with{ … }, or simulate with lsim(G, u, t)");
  VecX x_p = VecX::Zero(g.ss.order());
  for (int j = 0; j < g.inputs; ++j)
    for (const dae::ForcingGroup& group : groups_of(u[j])) x_p += particular(g.ss.A, g.ss.B.col(j), group);
  const VecX at_zero = tidy(MatX(column(substitute(entries(x_p), {{t, 0}}))));
  return tidy(MatX(product(*Phi, MatX(x0 - at_zero)) + x_p));
}

/// Does e consist of numbers and π?
bool is_number(Expr e) {
  const std::vector<Expr> inside = leaves({&e, 1});
  return std::all_of(inside.begin(), inside.end(),
                     [](Expr x) { return symbol_of(x).kind == Kind::constant; });
}

/// The times at which inputs switch: the c > 0 of conditions lt(t, c), ascending. Empty without ifelse, or if
/// other conditions occur.
std::optional<std::vector<Expr>> switching_times(const VecX& u) {
  std::vector<Expr> times;
  bool switches = false;
  for (Expr node : topological(entries(u))) {
    switches = switches || node.op() == Op::ifelse;
    if (node.op() != Op::lt && node.op() != Op::le) continue;
    const Expr a = node.operand(0), b = node.operand(1), c = a == time_symbol() ? b : a;
    if ((a != time_symbol() && b != time_symbol()) || !is_number(c)) return {};
    if (number(c) > 0 && std::find(times.begin(), times.end(), c) == times.end()) times.push_back(c);
  }
  if (!switches) return {};
  std::sort(times.begin(), times.end(), [](Expr a, Expr b) { return number(a) < number(b); });
  return times;
}

/// u with its conditions evaluated at t = `inside`.
VecX branch_at(VecX u, double inside) {
  for (;;) {
    Substitution chosen;
    for (Expr node : topological(entries(u)))
      if (node.op() == Op::ifelse)
        chosen[node] = evaluate({&node.operands()[0], 1}, {{time_symbol(), inside}})[0] != 0
                           ? node.operand(1)
                           : node.operand(2);
    if (chosen.empty()) return u;
    u = column(substitute(entries(u), chosen));
  }
}

/// The solution between consecutive switching times, each piece starting from the end of the previous one.
VecX solution_by_pieces(const System& g, VecX start, const VecX& u, const std::vector<Expr>& times) {
  const Expr t = time_symbol();
  std::vector<VecX> pieces;
  Expr from;
  for (std::size_t k = 0; k <= times.size(); ++k) {
    const double begin = number(from);
    const double inside = k < times.size() ? (begin + number(times[k])) / 2 : begin + 1;
    const VecX forcing = column(substitute(entries(branch_at(u, inside)), {{t, t + from}}));
    const VecX x = solution(g, start, forcing);
    pieces.push_back(column(substitute(entries(x), {{t, t - from}})));
    if (k == times.size()) break;
    start = tidy(MatX(column(substitute(entries(x), {{t, times[k] - from}}))));
    from = times[k];
  }
  VecX all = pieces.back();
  for (std::size_t k = times.size(); k-- > 0;)
    for (Index i = 0; i < all.size(); ++i)
      all[i] = make(Op::ifelse, make(Op::lt, t, times[k]), pieces[k][i], all[i]);
  return all;
}

}  // namespace

VecX solution(const System& given, const VecX& x0, const VecX& u) {
  const System g = to_ss(given);
  const int n = g.ss.order();
  if (!g.continuous())
    throw Error("the model must be in continuous time; in discrete time use lsim(G, u, t, x0)");
  if (x0.size() != n)
    throw Error(text("x0 has ", x0.size(), x0.size() == 1 ? " entry" : " entries", " for ", n,
                     n == 1 ? " state" : " states"));
  if (u.size() != g.inputs)
    throw Error(text("u has ", u.size(), u.size() == 1 ? " entry" : " entries", " for ", g.inputs,
                     g.inputs == 1 ? " input" : " inputs"));
  if (n == 0) return VecX(0);
  if (const auto times = switching_times(u)) return solution_by_pieces(g, x0, u, *times);
  for (Expr input : u) groups_of(input);  // rejects inputs without a closed form
  if (field(g.ss.A) == Field::symbolic) {
    const std::vector<Expr> all = entries(g);
    const auto symbols = leaves(all);
    const bool values =
        std::all_of(symbols.begin(), symbols.end(), [](Expr s) { return symbol_of(s).value.has_value(); });
    if (!values || transition(g.ss.A, time_symbol())) return symbolic_solution(g, x0, u);
    return solution(with_numbers(g), x0, u);  // no closed form: uses default values
  }
  // The pencil of x′ = A x + f(t) handles the other cases.
  dae::LinearForm form;
  form.E = dae::RationalMatrix::identity(n);
  form.A = rational(g.ss.A);
  form.B = dae::RationalMatrix(n, 0);
  form.x = symbol_vector(Kind::variable, "x", n);
  form.f = VecX(product(g.ss.B, u));
  for (int i = 0; i < n; ++i) {
    form.origin.push_back(std::pair(i, 0));
    form.label.push_back(text("(", i + 1, ")"));
  }
  dae::SolutionRequest request;
  for (int i = 0; i < n; ++i) request.x0.emplace_back(form.x[i], x0[i]);
  return dae::solution(dae::pencil(form), request);
}

}  // namespace pendula::lti
