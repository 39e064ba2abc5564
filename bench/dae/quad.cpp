#include "quad.hpp"

#include <algorithm>
#include <complex>

#include "base/error.hpp"
#include "codegen/program/program.hpp"
#include "integrate/solve/linear_solver.hpp"
#include "method/collocation.hpp"
#include "method/irk_formula.hpp"

using Quad = __float128;
using pendula::integrate::LinearSolver, pendula::integrate::Position;

// libquadmath, whose header only GCC finds
extern "C" {
Quad powq(Quad, Quad), sinq(Quad), cosq(Quad), tanq(Quad), asinq(Quad), acosq(Quad), atanq(Quad), sinhq(Quad),
    coshq(Quad), tanhq(Quad), asinhq(Quad), acoshq(Quad), atanhq(Quad), expq(Quad), logq(Quad), sqrtq(Quad),
    atan2q(Quad, Quad), fabsq(Quad);
int quadmath_snprintf(char*, size_t, const char*, ...);
}

namespace pendula::bench {
namespace {

namespace quad {
namespace std {  // the names in the value column of ops.def
Quad pow(Quad a, Quad b) { return powq(a, b); }
Quad sin(Quad a) { return sinq(a); }
Quad cos(Quad a) { return cosq(a); }
Quad tan(Quad a) { return tanq(a); }
Quad asin(Quad a) { return asinq(a); }
Quad acos(Quad a) { return acosq(a); }
Quad atan(Quad a) { return atanq(a); }
Quad sinh(Quad a) { return sinhq(a); }
Quad cosh(Quad a) { return coshq(a); }
Quad tanh(Quad a) { return tanhq(a); }
Quad asinh(Quad a) { return asinhq(a); }
Quad acosh(Quad a) { return acoshq(a); }
Quad atanh(Quad a) { return atanhq(a); }
Quad exp(Quad a) { return expq(a); }
Quad log(Quad a) { return logq(a); }
Quad sqrt(Quad a) { return sqrtq(a); }
Quad fabs(Quad a) { return fabsq(a); }
Quad atan2(Quad a, Quad b) { return atan2q(a, b); }
}  // namespace std

Quad value(Op op, Quad a, Quad b, Quad c) {
  switch (op) {
#define OP(name, arity, style, parity, exact, code, value, ...) \
  case Op::name:                                                \
    return value;
#include "expr/ops.def"
#undef OP
    default:
      return 0;
  }
}
}  // namespace quad

/// F(t, x, x′, z, u, p) in quadruple precision.
class Residual {
 public:
  explicit Residual(const integrate::Problem& problem)
      : program_(codegen::lower(problem.model().F, problem.arguments())) {
    for (const double v : problem.values()) values_.push_back(v);
    for (const double v : program_.constants) values_.push_back(v);
    for (const auto& i : program_.instructions)
      if (i.part != codegen::Part::none) throw Error("quad: the form contains linear systems; take \"acc\"");
    values_.resize(values_.size() + program_.instructions.size());
  }
  Quad* inputs() { return values_.data(); }
  void operator()(Quad* F) {
    std::size_t at = program_.first_instruction();
    for (const auto& i : program_.instructions) {
      const auto operand = [&](int k) { return values_[i.operand[static_cast<std::size_t>(k)]]; };
      const int count = i.operands();
      values_[at++] = quad::value(i.op, operand(0), count > 1 ? operand(1) : 0, count > 2 ? operand(2) : 0);
    }
    for (const codegen::Slot slot : program_.results) *F++ = values_[slot];
  }

 private:
  codegen::Program program_;
  std::vector<Quad> values_;
};

/// X with A X = B, B of several columns behind A; Gauss and Jordan.
void solve(std::vector<std::vector<Quad>>& rows) {
  const std::size_t s = rows.size();
  for (std::size_t k = 0; k < s; ++k) {
    std::size_t best = k;
    for (std::size_t i = k; i < s; ++i)
      if (fabsq(rows[i][k]) > fabsq(rows[best][k])) best = i;
    std::swap(rows[k], rows[best]);
    for (std::size_t j = rows[k].size(); j-- > k;) rows[k][j] /= rows[k][k];
    for (std::size_t i = 0; i < s; ++i)
      if (i != k)
        for (std::size_t j = rows[k].size(); j-- > k;) rows[i][j] -= rows[i][k] * rows[k][j];
  }
}

/// A method with 33 digits: nodes, W = A⁻¹, and its formula in doubles for the iteration.
struct Method {
  Method(int stages, bool gauss)
      : formula(std::make_shared<const integrate::Tableau>(gauss ? integrate::gauss(stages)
                                                                 : integrate::radau(stages))),
        s(static_cast<std::size_t>(stages)) {
    for (const double node : formula.c) c.push_back(refined(node, stages, gauss));
    // Z(τ) = Σ aⱼ τʲ, j = 1 … s: W takes the values at the nodes to the slopes there.
    std::vector<std::vector<Quad>> rows(s);
    for (std::size_t i = 0; i < s; ++i) {  // Wᵀ from Vᵀ Wᵀ = V′ᵀ
      for (std::size_t j = 0; j < s; ++j) rows[i].push_back(power(c[j], i + 1));
      for (std::size_t j = 0; j < s; ++j) rows[i].push_back(static_cast<Quad>(i + 1) * power(c[j], i));
    }
    auto ends = rows;
    solve(rows);
    for (std::size_t i = 0; i < s; ++i)
      for (std::size_t j = 0; j < s; ++j) W.push_back(rows[j][s + i]);
    for (std::size_t i = 0; i < s; ++i) ends[i].resize(s), ends[i].push_back(1);
    solve(ends);
    for (std::size_t j = 0; j < s; ++j) end.push_back(ends[j][s]);
  }

  integrate::IrkFormula formula;
  std::size_t s;
  std::vector<Quad> c, W, end;  ///< y₁ = y₀ + Σ endⱼ Zⱼ

  static Quad power(Quad x, std::size_t n) {
    Quad result = 1;
    for (; n > 0; --n) result *= x;
    return result;
  }
  /// A zero of P_s (Gauss) or P_s - P_{s-1} (Radau) of 2c - 1, by Newton's iteration.
  static Quad refined(double node, int s, bool gauss) {
    Quad x = node;
    for (int k = 0; k < 5; ++k) {
      const Quad u = 2 * x - 1;
      Quad before = 1, now = u, d_before = 0, d_now = 1;
      for (int n = 1; n < s; ++n) {
        const Quad next = ((2 * n + 1) * u * now - n * before) / (n + 1);
        const Quad d_next = ((2 * n + 1) * (now + u * d_now) - n * d_before) / (n + 1);
        before = now, now = next, d_before = d_now, d_now = d_next;
      }
      const Quad f = gauss ? now : now - before, d = gauss ? d_now : d_now - d_before;
      x -= f / (2 * d);
    }
    return x;
  }
};

class Run {
 public:
  Run(integrate::Problem& problem, const integrate::Point& start, const QuadOptions& options)
      : problem_(problem),
        residual_(problem),
        method_(options.stages, options.gauss),
        o_(options),
        n_(static_cast<std::size_t>(problem.n())),
        N_(n_ + static_cast<std::size_t>(problem.m())),
        t_(start.t) {
    for (const double v : start.x) y_.push_back(v);
    for (const double v : start.z) y_.push_back(v);
    Z_.assign(method_.s * N_, 0);
    for (const auto& e : problem.pattern()) {
      const int n = problem.n();
      mass_.push_back(e.column >= n && e.column < 2 * n);
      positions_.push_back({e.row, e.column < n ? e.column : e.column - n});
    }
    real_.analyse(static_cast<int>(N_), positions_);
    pairs_.resize(method_.formula.pairs.size());
    for (auto& pair : pairs_) pair.analyse(static_cast<int>(N_), positions_);
    slopes_.assign(start.xdot.begin(), start.xdot.end());
  }

  QuadResult go() {
    settle();
    std::vector<double> ends = o_.breaks;
    ends.push_back(o_.to);
    Quad dt = (o_.to - t_) * 1e-8;
    for (const double end : ends) {
      while (t_ < end) {
        Quad h = std::min<Quad>(dt, end - t_);
        if (end - t_ < 1.01 * h) h = end - t_;
        const double error = attempt(h, end);
        const double factor =
            error > 1e9 ? 0.3 : 0.9 * std::pow(std::max(error, 1e-8), -1.0 / (o_.stages + 1));
        if (h < 1e-25 * (o_.to - t_)) throw Failure("quad: the step size vanished");
        if (error > 1 || h == dt) dt = h * std::clamp(factor, 0.2, 4.0);
        if (error > 1) continue;
        t_ = end - t_ == h ? static_cast<Quad>(end) : t_ + h;
        y_ = next_;
        ++result_.steps;
      }
      dt = dt * 1e-3;
    }
    for (const Quad v : y_) {
      char text[64];
      quadmath_snprintf(text, sizeof text, "%.25Qg", v);
      result_.y.push_back(text);
    }
    return result_;
  }

 private:
  void evaluate(Quad t, const Quad* y, const Quad* slope, Quad* F) {
    Quad* at = residual_.inputs();
    at[0] = t;
    std::copy_n(y, n_, at + 1);
    std::copy_n(slope, n_, at + 1 + n_);
    std::copy(y + n_, y + N_, at + 1 + 2 * n_);
    residual_(F);
  }
  void place() {
    std::vector<double> y(y_.begin(), y_.end()), slopes(slopes_.begin(), slopes_.end());
    problem_.set_point(static_cast<double>(t_), y.data(), slopes.data(), y.data() + n_);
    entries_ = problem_.jacobian();
  }
  template <class Number>
  bool factorise(LinearSolver<Number>& solver, Number factor) {
    std::vector<Number> shifted(entries_.begin(), entries_.end());
    for (std::size_t k = 0; k < shifted.size(); ++k)
      if (mass_[k]) shifted[k] *= factor;
    return solver.factorise(shifted.data());
  }

  /// x′ and z at a point where they follow from x: (∂F/∂x′, ∂F/∂z) Δ = -F. Where M is singular they stay.
  void settle() {
    std::vector<Position> places;
    std::vector<std::size_t> which;
    for (std::size_t k = 0; k < positions_.size(); ++k)
      if (mass_[k] || positions_[k].column >= static_cast<int>(n_))
        places.push_back(positions_[k]), which.push_back(k);
    LinearSolver<double> solver;
    solver.analyse(static_cast<int>(N_), places);
    std::vector<Quad> F(N_);
    std::vector<double> values(which.size()), right(N_);
    const auto y = y_, slopes = slopes_;
    for (int k = 0; k < 40; ++k) {
      place();
      for (std::size_t i = 0; i < which.size(); ++i) values[i] = entries_[which[i]];
      evaluate(t_, y_.data(), slopes_.data(), F.data());
      for (std::size_t i = 0; i < N_; ++i) right[i] = -static_cast<double>(F[i]);
      if (!solver.factorise(values.data())) return;
      solver.solve(right.data());
      if (!std::all_of(right.begin(), right.end(), [](double r) { return std::fabs(r) < 1e30; })) {
        y_ = y, slopes_ = slopes;
        return;
      }
      for (std::size_t i = 0; i < n_; ++i) slopes_[i] += right[i];
      for (std::size_t i = n_; i < N_; ++i) y_[i] += right[i];
    }
  }

  double scale(std::size_t i) const { return static_cast<double>(fabsq(y_[i])) + o_.size; }

  /// ΔZ in doubles; its norm in units of the tolerance.
  double correct(std::vector<double>& R) {
    const auto& f = method_.formula;
    std::vector<double> w(R.size(), 0.0);
    const auto mix = [&](const Mat& by, const std::vector<double>& from, std::vector<double>& to) {
      std::fill(to.begin(), to.end(), 0.0);
      for (int i = 0; i < f.s; ++i)
        for (int j = 0; j < f.s; ++j)
          for (std::size_t k = 0; k < N_; ++k)
            to[static_cast<std::size_t>(i) * N_ + k] += by(i, j) * from[static_cast<std::size_t>(j) * N_ + k];
    };
    mix(f.T_inverse, R, w);
    double* at = w.data();
    if (f.has_real) {
      for (std::size_t k = 0; k < N_; ++k) at[k] = -at[k];
      real_.solve(at);
      at += N_;
    }
    std::vector<std::complex<double>> right(N_);
    for (auto& pair : pairs_) {
      for (std::size_t k = 0; k < N_; ++k) right[k] = {-at[k], at[N_ + k]};
      pair.solve(right.data());
      for (std::size_t k = 0; k < N_; ++k) at[k] = right[k].real(), at[N_ + k] = -right[k].imag();
      at += 2 * N_;
    }
    mix(f.T, w, R);
    double largest = 0;
    for (std::size_t k = 0; k < R.size(); ++k) {
      Z_[k] += R[k];
      const double part = std::fabs(R[k]) / (o_.tolerance * scale(k % N_));
      if (!(part <= largest)) largest = part;
    }
    return largest;
  }

  /// The error of a step in units of the inner tolerance; 1e10: no solution.
  double attempt(Quad h, double end) {
    constexpr double none = 1e10;
    const double hd = static_cast<double>(h);
    const auto& f = method_.formula;
    place();
    if (!factorise(real_, f.gamma / hd)) return none;
    for (std::size_t k = 0; k < pairs_.size(); ++k)
      if (!factorise(pairs_[k], f.pairs[k] / hd)) return none;
    std::fill(Z_.begin(), Z_.end(), 0);
    double before = 0;
    for (int k = 0;; ++k) {
      if (k > 60) return none;
      auto R = stages(h, end);
      const double length = correct(R);
      if (!(length < 1e40) || (k > 1 && length > 0.7 * before)) return length < 1e-3 ? finish(h, end) : none;
      if (k > 0 && length * std::min(1.0, length / before) < 1e-3) return finish(h, end);
      before = length;
    }
  }

  std::vector<double> stages(Quad h, double end) {
    std::vector<double> R(Z_.size());
    std::vector<Quad> y(N_), slope(n_), F(N_);
    for (std::size_t i = 0; i < method_.s; ++i) {
      for (std::size_t k = 0; k < N_; ++k) y[k] = y_[k] + Z_[i * N_ + k];
      for (std::size_t k = 0; k < n_; ++k) {
        slope[k] = 0;
        for (std::size_t j = 0; j < method_.s; ++j)
          slope[k] += method_.W[i * method_.s + j] * Z_[j * N_ + k] / h;
      }
      evaluate(before(t_ + method_.c[i] * h, end), y.data(), slope.data(), F.data());
      for (std::size_t k = 0; k < N_; ++k) R[i * N_ + k] = static_cast<double>(F[k]);
    }
    return R;
  }
  /// Conditions t < end still hold at the end of the last step before it.
  static Quad before(Quad t, double end) {
    const Quad last = end - fabsq(end) * static_cast<Quad>(1e-32);
    return t < last ? t : last;
  }

  double finish(Quad h, double end) {
    const auto& f = method_.formula;
    next_ = y_;
    for (std::size_t j = 0; j < method_.s; ++j)
      for (std::size_t k = 0; k < N_; ++k) next_[k] += method_.end[j] * Z_[j * N_ + k];
    std::vector<Quad> v(n_, 0), F(N_);
    for (std::size_t j = 0; j < method_.s; ++j)
      for (std::size_t k = 0; k < n_; ++k)
        v[k] -= static_cast<Quad>(f.error[static_cast<Eigen::Index>(j)]) / h * Z_[j * N_ + k];
    evaluate(before(t_, end), y_.data(), v.data(), F.data());
    std::vector<double> error(F.begin(), F.end());
    real_.solve(error.data());
    const double s = o_.stages, inner = 0.1 * std::pow(o_.tolerance, (s + 1) / (2 * s));
    double largest = 0;
    for (std::size_t k = 0; k < N_; ++k) {
      const double part = std::fabs(error[k]) / (inner * scale(k));
      if (!(part <= largest)) largest = part;
    }
    return largest;
  }

  integrate::Problem& problem_;
  Residual residual_;
  Method method_;
  QuadOptions o_;
  std::size_t n_, N_;
  Quad t_;
  std::vector<Quad> y_, next_, Z_, slopes_;
  std::vector<char> mass_;
  std::vector<Position> positions_;
  std::vector<double> entries_;
  LinearSolver<double> real_;
  std::vector<LinearSolver<std::complex<double>>> pairs_;
  QuadResult result_;
};

}  // namespace

QuadResult run_quad(integrate::Problem& problem, const integrate::Point& start, const QuadOptions& options) {
  return Run(problem, start, options).go();
}

}  // namespace pendula::bench
