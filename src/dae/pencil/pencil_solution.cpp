// x = T (x₁, x₂): x₁ by the exponential of J, inputs as outputs of further linear equations; x₂ by
// differentiation.
#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/pencil/pencil.hpp"
#include "dae/pencil/pencil_forcing.hpp"
#include "expr/generic/generic.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

VecX simplified(VecX v) {
  for (Index i = 0; i < v.size(); ++i) v[i] = simplify(v[i]);
  return v;
}

VecX at_time(VecX v, Expr time) {
  for (Index i = 0; i < v.size(); ++i) v[i] = substitute(v[i], {{time_symbol(), time}});
  return v;
}

/// The forcing with parameter values and the given inputs substituted.
VecX forcing(const Pencil& p, const SolutionRequest& request) {
  Substitution values, known;
  for (const auto& [parameter, v] : p.form.values) values[parameter] = v;
  known = values;
  VecX g = p.form.forcing();
  for (Expr leaf : leaves(entries(g))) {
    const Symbol& s = symbol_of(leaf);
    if (s.kind == Kind::time || s.kind == Kind::parameter) continue;
    if (const auto it = request.inputs.find(s.base); it != request.inputs.end())
      known[leaf] = substitute(s.order == 0 ? it->second : total_derivative(it->second, s.order), values);
  }
  return column(substitute(entries(g), known));
}

/// x₁′ = J x₁ + h(t), h a sum of exponentials times polynomials.
class Differential {
 public:
  Differential(const Pencil& p, const VecX& h) : J_(p.J), particular_(VecX::Zero(p.dof)), M_(p.J) {
    std::vector<std::pair<ForcingGroup, int>> others;
    for (Index i = 0; i < h.size(); ++i) {
      Expr culprit;
      const auto terms = forcing_of(h[i], &culprit);
      if (!terms) refuse(culprit);
      for (const ForcingGroup& g : grouped(*terms)) {
        const Expr square = simplify(g.frequency * g.frequency);
        if (exact_value(g.rate) && exact_value(square))
          generate(g, *exact_value(g.rate), *exact_value(square), static_cast<int>(i));
        else
          respond(g, static_cast<int>(i));
      }
    }
  }

  /// x₁(t) from x₁(0).
  VecX operator()(const VecX& start) const {
    VecX v(M_.rows());
    v.head(J_.rows()) = start - at_time(particular_, 0);
    for (std::size_t i = 0; i < w_.size(); ++i) v[J_.rows() + static_cast<Index>(i)] = w_[i];
    return VecX(exponential(M_, time_symbol(), v).head(J_.rows())) + particular_;
  }

 private:
  [[noreturn]] static void refuse(Expr culprit) {
    for (Expr leaf : leaves({&culprit, 1}))
      if (symbol_of(leaf).kind == Kind::input || symbol_of(leaf).kind == Kind::variable)
        throw Error(text("the input '", symbol_of(leaf).name, "' needs an expression in t: { inputs = { ",
                         symbol_of(leaf).name, " = sin(t) } }"));
    throw Error(
        text("the forcing ", to_text(culprit),
             " is not a polynomial, exponential, sine or cosine of t; use sys:integrate{ … } for it"));
  }

  /// Appends the group to M as y₀ of yⱼ′ = a yⱼ + zⱼ + yⱼ₊₁, zⱼ′ = a zⱼ - b² yⱼ + zⱼ₊₁.
  void generate(const ForcingGroup& g, const mpq_class& a, const mpq_class& square, int row) {
    const int first = M_.rows(), size = static_cast<int>(g.p.size()), width = square == 0 ? 1 : 2;
    RationalMatrix grown(first + width * size, first + width * size);
    grown.set(0, 0, M_);
    grown(row, first) = 1;
    Expr factorial = 1;
    for (int j = 0; j < size; ++j) {
      const int y = first + width * j, z = y + 1;
      if (j > 0) factorial = factorial * Expr(j);
      for (int k = 0; k < width; ++k) {
        grown(y + k, y + k) = a;
        if (j + 1 < size) grown(y + k, y + k + width) = 1;
      }
      const auto power = static_cast<std::size_t>(j);
      w_.push_back(factorial * g.p[power]);
      if (width == 1) continue;
      grown(y, z) = 1;
      grown(z, y) = -square;
      w_.push_back(factorial * g.frequency * g.q[power]);
    }
    M_ = std::move(grown);
  }

  /// A particular solution e^{at}(P(t) cos bt + Q(t) sin bt) where a or b is no rational: from the highest
  /// power down (aI - J) Pₖ + b Qₖ = pₖ - (k+1) Pₖ₊₁,  (aI - J) Qₖ - b Pₖ = qₖ - (k+1) Qₖ₊₁.
  void respond(const ForcingGroup& g, int row) {
    const Index n = J_.rows();
    MatX a = MatX::Zero(2 * n, 2 * n), last = MatX::Zero(2 * n, 1);
    const MatX j = expressions(J_);
    for (Index i = 0; i < n; ++i) {
      for (Index k = 0; k < n; ++k) a(i, k) = a(n + i, n + k) = (i == k ? g.rate : Expr(0)) - j(i, k);
      a(i, n + i) = g.frequency;
      a(n + i, i) = -g.frequency;
    }
    const Expr t = time_symbol(), growth = exp(g.rate * t);
    for (std::size_t k = g.p.size(); k-- > 0;) {
      MatX right = MatX::Zero(2 * n, 1);
      for (Index i = 0; i < 2 * n; ++i) right(i, 0) = -Expr(static_cast<long>(k + 1)) * last(i, 0);
      right(row, 0) += g.p[k];
      right(n + row, 0) += g.q[k];
      try {
        last = linalg::solve(a, right);
      } catch (const Error&) {
        const Expr wave = g.frequency.is_zero() ? growth : growth * cos(g.frequency * t);
        throw Error(text(
            "the forcing ", to_text(wave),
            " is in resonance with a mode of the system, and its exponent is not rational; use rational numbers"));
      }
      const Expr power = k == 0 ? Expr(1) : pow(t, Expr(static_cast<long>(k)));
      for (Index i = 0; i < n; ++i)
        particular_[i] +=
            growth * power * (last(i, 0) * cos(g.frequency * t) + last(n + i, 0) * sin(g.frequency * t));
    }
  }

  RationalMatrix J_;
  VecX particular_;
  RationalMatrix M_;     // of x₁ and the generators of the inputs
  std::vector<Expr> w_;  // their initial values
};

std::string names(const std::vector<Expr>& list) {
  std::vector<std::string> words;
  for (Expr e : list) words.push_back(to_text(e));
  return join(words, ", ");
}

[[noreturn]] void contradiction(const SolutionRequest& request, const RationalMatrix& y, Expr shift) {
  const mpq_class factor = primitive_factor(y);
  Expr condition = 0, got = 0;
  for (int i = 0; i < y.cols(); ++i) {
    const auto& [leaf, v] = request.x0[i];
    if (y(0, i) == 0) continue;
    condition += Expr(mpq_class(factor * y(0, i))) * leaf;
    got += Expr(mpq_class(factor * y(0, i))) * v;
  }
  shift = simplify(Expr(factor) * shift);
  throw Error(text("x0 is not consistent: 0 ≠ ", to_text(simplify(got - shift)), " = ",
                   to_text(simplify(condition - shift)),
                   " follows from the constraints; see p.constraints, or leave one of these values out"));
}

/// Is y · right 0 up to the rounding errors of its terms, as at a start made by init?
bool is_rounding(const RationalMatrix& y, const VecX& right) {
  constexpr double rounding = 1e-12;  // 4500 ε of the terms
  double sum = 0, size = 0;
  for (Index i = 0; i < right.size(); ++i) {
    const Expr e = right[i];
    for (Expr leaf : leaves({&e, 1}))
      if (symbol_of(leaf).kind != Kind::constant) return false;
    const double term = y(0, static_cast<int>(i)).get_d() * pendula::evaluate({&e, 1}, {})[0];
    sum += term;
    size += std::fabs(term);
  }
  return std::fabs(sum) <= rounding * size;
}

/// c with T₁ c + shift = x0 in the given components.
VecX start(const Pencil& p, const SolutionRequest& request, const VecX& shift) {
  if (request.general) {  // scalars give "c₁ cos(t) + …" instead of multiples of a column c
    if (p.dof == 1) return column(newly_declared({symbol(Kind::parameter, "c")}));
    VecX c(p.dof);
    for (int i = 0; i < p.dof; ++i) c[i] = newly_declared({symbol(Kind::parameter, text("c", i + 1))})[0];
    return c;
  }
  const int rows = static_cast<int>(request.x0.size());
  RationalMatrix given(rows, p.dof);
  VecX right(rows), shifts(rows);
  for (int i = 0; i < rows; ++i) {
    const auto& [leaf, v] = request.x0[i];
    const auto it = std::find(p.form.x.begin(), p.form.x.end(), leaf);
    if (it == p.form.x.end())
      throw Error(
          text("x0: '", to_text(leaf), "' is not a state of this system; its states are ", names(p.form.x)));
    const int j = static_cast<int>(it - p.form.x.begin());
    given.set(i, 0, p.T.block(j, 0, 1, p.dof));
    shifts[i] = shift[j];
    right[i] = simplify(v - shift[j]);
  }
  const Reduced r = reduced(hstack(given, RationalMatrix::identity(rows)), p.dof);
  const int rank = static_cast<int>(r.pivots.size());
  for (int i = rank; i < rows; ++i) {
    const RationalMatrix y = r.form.block(i, p.dof, 1, rows);
    if (!generic::is_zero(product(y, right)[0]) && !is_rounding(y, right))
      contradiction(request, y, product(y, shifts)[0]);
  }
  if (rank < p.dof) {
    std::vector<Expr> candidates;
    for (int j = 0; j < p.form.size(); ++j) {
      RationalMatrix more(rows + 1, p.dof);
      more.set(0, 0, given);
      more.set(rows, 0, p.T.block(j, 0, 1, p.dof));
      if (dae::rank(more) > rank) candidates.push_back(p.form.x[j]);
    }
    throw Error(text("x0 leaves ", p.dof - rank, p.dof - rank == 1 ? " value" : " values", " free: give ",
                     p.dof - rank == 1 ? "one" : text(p.dof - rank), " of ", names(candidates),
                     ", or ask for the general solution with p:solution()"));
  }
  return product(r.form.block(0, p.dof, p.dof, rows), right);
}

}  // namespace

VecX solution(const Pencil& p, const SolutionRequest& request) {
  if (!p.regular)
    throw Error(
        "the pencil is singular: solutions do not exist for every input, or "
        "are not unique; print(p) says which "
        "equations and unknowns are the cause");
  const int n = p.form.size(), m = n - p.dof;
  const Expr from = Expr(request.from), t = time_symbol();
  const VecX h = simplified(product(p.S, at_time(forcing(p, request), t + from)));  // in τ = t - from
  VecX x2 = VecX::Zero(m), derivative = h.tail(m);
  RationalMatrix power = RationalMatrix::identity(m);
  for (int i = 0; i < p.index; ++i) {
    if (i > 0) {
      power = power * p.N;
      for (Index k = 0; k < m; ++k) derivative[k] = simplify(total_derivative(derivative[k]));
    }
    x2 -= product(power, derivative);
  }
  VecX x = product(p.T.columns(p.dof, m), x2);
  const VecX shift = simplified(at_time(x, 0));
  const VecX c = start(p, request, shift);
  if (p.dof > 0) x += product(p.T.columns(0, p.dof), Differential(p, h.head(p.dof))(c));
  return simplified(request.from == 0 ? x : at_time(x, t - from));
}

}  // namespace pendula::dae
