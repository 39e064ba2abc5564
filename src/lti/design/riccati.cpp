#include "lti/design/riccati.hpp"

#include <cmath>

#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/stoppable.hpp"
#include "base/text.hpp"
#include "expr/linalg/linalg.hpp"
#include "lti/structure.hpp"

namespace pendula::lti {
namespace {

Mat symmetric(const Mat& m) { return 0.5 * (m + m.transpose()); }
Mat solved(const Mat& a, const Mat& b) { return a.partialPivLu().solve(b); }

void require_size(const Mat& m, const char* name, Index rows, Index cols) {
  if (m.rows() != rows || m.cols() != cols)
    throw Error(text(name, " must be ", rows, "×", cols, ", but it is ", m.rows(), "×", m.cols()));
  if (!m.allFinite()) throw Error(text(name, " has entries that are not finite numbers"));
}

void require_symmetric(const Mat& m, const char* name) {
  constexpr double printed = 1e-10;  // relative: matrices may be printed with ten digits
  if ((m - m.transpose()).cwiseAbs().maxCoeff() > printed * m.cwiseAbs().maxCoeff())
    throw Error(text(name, " must be symmetric"));
}

bool definite(const Mat& R) { return Eigen::LLT<Mat>(R).info() == Eigen::Success; }

void check(RiccatiProblem& p) {
  const Index n = p.A.rows(), m = p.B.cols();
  if (n == 0) throw Error("the system has no states");
  if (m == 0) throw Error("the system has no inputs");
  require_size(p.A, "A", n, n);
  require_size(p.B, "B", n, m);
  require_size(p.Q, "Q", n, n);
  require_size(p.R, "R", m, m);
  if (p.S.size() == 0) p.S = Mat::Zero(n, m);
  require_size(p.S, "N", n, m);
  require_symmetric(p.Q, "Q");
  require_symmetric(p.R, "R");
  if (definite(p.R)) return;
  if (p.continuous) throw Error("R must be positive definite: every input needs a weight");
  constexpr double rounding = 1e-12;  // 4500 ε, of an eigenvalue that is 0
  if (Eigen::SelfAdjointEigenSolver<Mat>(p.R, Eigen::EigenvaluesOnly).eigenvalues().minCoeff() <
      -rounding * p.R.norm())
    throw Error("R must be positive semidefinite: no input may have a negative weight");
}

/// The problem without cross term: u = v - R⁻¹Sᵀx.
struct Reduced {
  Mat A, G, H;  ///< G = B R⁻¹ Bᵀ, H = Q - S R⁻¹ Sᵀ
};
Reduced without_cross_term(const RiccatiProblem& p) {
  const Mat back = solved(p.R, p.S.transpose());
  return {p.A - p.B * back, symmetric(p.B * solved(p.R, p.B.transpose())), symmetric(p.Q - p.S * back)};
}

/// A ← A W A, G ← G + A W G Aᵀ, H ← H + Aᵀ H W A with W = (I + G H)⁻¹, until H is stationary. Empty if the
/// iteration does not converge.
std::optional<Mat> doubled(Mat A, Mat G, Mat H) {
  constexpr int most_doublings = 60;  // 2⁶⁰ steps: A decays even with eigenvalues of modulus 1 - ε
  const Index n = A.rows();
  for (int k = 0; k < most_doublings; ++k) {
    poll_interrupt();
    const Eigen::PartialPivLU<Mat> lu(Mat(Mat::Identity(n, n) + G * H));
    const Mat WA = lu.solve(A), WG = lu.solve(G);
    const Mat change = symmetric(A.transpose() * H * WA);
    G = symmetric(G + A * WG * A.transpose());
    H += change;
    A = A * WA;
    if (!H.allFinite() || !G.allFinite() || !A.allFinite()) return {};
    constexpr double half_a_bit = 1e-16;  // 0.45 ε: the sum no longer changes
    if (change.norm() <= half_a_bit * H.norm() || A.norm() < least_size) return H;
  }
  return {};
}

/// The doubling iteration, after a Cayley transform in continuous time.
std::optional<Mat> by_doubling(const Reduced& r, bool continuous) {
  if (!continuous) return doubled(r.A, r.G, r.H);
  const Index n = r.A.rows();
  const double size =
      std::sqrt((2 * r.A.squaredNorm() + r.G.squaredNorm() + r.H.squaredNorm()) / static_cast<double>(2 * n));
  // γ must not be an eigenvalue: other factors without a simple relation to the first
  constexpr double regular = 1e-14;  // reciprocal condition number; below 45 ε no digit is left
  for (const double factor : {1.0, 1.37, 0.61, 4.3, 0.23}) {
    const double gamma = factor * (size > 0 ? size : 1);
    const Mat I = Mat::Identity(n, n);
    const Eigen::PartialPivLU<Mat> shifted(Mat(r.A - gamma * I));
    const Eigen::PartialPivLU<Mat> W(Mat((r.A - gamma * I).transpose() + r.H * Mat(shifted.solve(r.G))));
    if (!(shifted.rcond() > regular) || !(W.rcond() > regular)) continue;
    const Mat W_inverse = inverse_by_lu(W);
    const auto X = doubled(I + 2 * gamma * W_inverse.transpose(),
                           symmetric(2 * gamma * Mat(shifted.solve(r.G)) * W_inverse),
                           symmetric(2 * gamma * W_inverse * r.H * inverse_by_lu(shifted)));
    if (X) return X;
  }
  return {};
}

/// The stable subspace of the Hamiltonian matrix by its sign, Z ← (c Z + (c Z)⁻¹)/2 (Byers, Linear Algebra
/// Appl. 85, 1987). Continuous time only; works also if X hardly depends on H, where doubling would start
/// from nearly zero.
std::optional<Mat> by_sign(const Reduced& r) {
  const Index n = r.A.rows();
  Mat Z(2 * n, 2 * n);
  Z << r.A, -r.G, -r.H, -r.A.transpose();
  // Scaled steps bring the eigenvalues near ±1 (20 is a choice), then each step squares the error.
  constexpr int most_scaled = 20, most = 100;
  constexpr double rounding = 1e-13;  // 450 ε; refine() follows
  for (int k = 0; k < most; ++k) {
    poll_interrupt();
    const Mat back = inverse_by_lu(Z);
    if (!back.allFinite()) return {};
    const double c = k < most_scaled ? std::sqrt(back.norm() / Z.norm()) : 1;
    const Mat next = 0.5 * (c * Z + back / c);
    const double change = (next - Z).norm();
    Z = next;
    if (change <= rounding * Z.norm()) break;
  }
  // sign(Z) [I; X] = -[I; X]
  Mat left(2 * n, n), right(2 * n, n);
  left << Z.topRightCorner(n, n), Z.bottomRightCorner(n, n) + Mat::Identity(n, n);
  right << -Z.topLeftCorner(n, n) - Mat::Identity(n, n), -Z.bottomLeftCorner(n, n);
  return symmetric(left.colPivHouseholderQr().solve(right));
}

Mat gain(const RiccatiProblem& p, const Mat& X) {
  if (p.continuous) return solved(p.R, p.B.transpose() * X + p.S.transpose());
  return solved(p.R + p.B.transpose() * X * p.B, p.B.transpose() * X * p.A + p.S.transpose());
}

struct Residual {
  Mat value;
  double relative;
};
Residual residual(const RiccatiProblem& p, const Mat& X, const Mat& K) {
  const Mat linear = p.continuous ? Mat(p.A.transpose() * X + X * p.A) : Mat(p.A.transpose() * X * p.A - X);
  const Mat M = p.continuous ? Mat(X * p.B + p.S) : Mat(p.A.transpose() * X * p.B + p.S);
  const Mat value = symmetric(linear - M * K + p.Q);
  const double size = linear.norm() + (M * K).norm() + p.Q.norm();
  return {value, size > 0 ? value.norm() / size : 0};
}

bool stabilises(const RiccatiProblem& p, const ComplexVec& poles) {
  for (const Complex z : poles)
    if (!(p.continuous ? z.real() < 0 : std::abs(z) < 1)) return false;
  return true;
}

ComplexVec poles_of(const Mat& A) { return Eigen::EigenSolver<Mat>(A, false).eigenvalues(); }

/// Newton's method from a stabilising X: (A - BK)ᵀD + D(A - BK) + residual = 0, as long as
/// the residual decreases.
void refine(const RiccatiProblem& p, RiccatiSolution& s) {
  constexpr int most_steps = 50;  // near the stability boundary each step only halves the error
  Residual now = residual(p, s.X, s.K);
  for (int k = 0; k < most_steps && now.relative > 0; ++k) {
    const Mat closed = p.A - p.B * s.K;
    Mat D;
    try {
      D = numbers(lyapunov(expressions(closed.transpose()), expressions(now.value), p.continuous));
    } catch (const Error&) {
      break;
    }
    const Mat X = symmetric(s.X + D), K = gain(p, X);
    const Residual next = residual(p, X, K);
    if (!(next.relative < now.relative)) break;
    s.X = X;
    s.K = K;
    now = next;
  }
  s.residual = now.relative;
  s.poles = poles_of(p.A - p.B * s.K);
}

/// A stabilising solution to start from.
std::optional<RiccatiSolution> first_solution(const RiccatiProblem& p) {
  Reduced r = without_cross_term(p);
  const double g = r.G.norm(), h = r.H.norm();
  const double scale = g > 0 && h > 0 ? std::sqrt(h / g) : 1;  // X = scale X̃ makes G and H equally large
  r.G *= scale;
  r.H /= scale;
  for (const bool sign : {false, true}) {
    if (sign && !p.continuous) break;
    const auto X = sign ? by_sign(r) : by_doubling(r, p.continuous);
    if (!X || !X->allFinite()) continue;
    RiccatiSolution s{scale * *X, gain(p, scale * *X), {}, 0};
    if (s.K.allFinite() && stabilises(p, poles_of(p.A - p.B * s.K))) return s;
  }
  return {};
}

/// For singular R in discrete time: any weights give stabilising gains, and the cost of those gains is a
/// start for Newton's method, which needs R + BᵀXB only (Hewer, IEEE Trans. Autom. Control 16, 1971).
std::optional<RiccatiSolution> start_without_weight(const RiccatiProblem& p) {
  RiccatiProblem weighted = p;
  const double size = std::max({p.R.norm(), p.Q.norm() * p.B.squaredNorm(), least_size});
  weighted.R.diagonal().array() += size;
  auto s = first_solution(weighted);
  if (!s) return {};
  const Mat closed = p.A - p.B * s->K;
  const Mat cost = p.Q + s->K.transpose() * p.R * s->K - p.S * s->K - (p.S * s->K).transpose();
  s->X = numbers(lyapunov(expressions(closed.transpose()), expressions(symmetric(cost)), false));
  s->K = gain(p, s->X);
  if (!s->K.allFinite() || !stabilises(p, poles_of(p.A - p.B * s->K)))
    throw Error("R + BᵀXB is singular: give the inputs that cost nothing a weight in R");
  return s;
}

[[noreturn]] void no_solution(const RiccatiProblem& p) {
  const Index n = p.A.rows();
  const Expr Ts = p.continuous ? 0 : 1;
  const Reach inputs = controllability(
      make_ss(expressions(p.A), expressions(p.B), MatX::Identity(n, n), MatX::Zero(n, p.B.cols()), Ts));
  if (!inputs.stable)
    throw Error(
        text("there is no stabilising solution, because (A, B) cannot be stabilised: ", describe(inputs)));
  throw Error(text("there is no stabilising solution: A has a mode on the ",
                   p.continuous ? "imaginary axis" : "unit circle",
                   " that Q does not weight, or Q is not positive semidefinite"));
}

}  // namespace

namespace {

/// Powers of two D, x = D x̃, for which the Hamiltonian matrix [A -G; -H -Aᵀ] is balanced (Benner, Linear
/// Algebra Appl. 323, 2001: the similarity must be diag(D, D⁻¹)).
Vec units(const RiccatiProblem& p) {
  if (!definite(p.R)) return Vec::Ones(p.A.rows());
  const Reduced r = without_cross_term(p);
  const Index n = p.A.rows();
  Mat hamiltonian(2 * n, 2 * n);
  hamiltonian << r.A, -r.G, -r.H, -r.A.transpose();
  const Vec d = linalg::balancing(hamiltonian);
  Vec out(n);
  for (Index i = 0; i < n; ++i) out[i] = std::exp2(std::round(0.5 * std::log2(d[i] / d[n + i])));
  return out;
}

RiccatiSolution solution(RiccatiProblem p) {
  const Vec d = units(p), inverse = d.cwiseInverse();
  p.A = inverse.asDiagonal() * p.A * d.asDiagonal();
  p.B = inverse.asDiagonal() * p.B;
  p.Q = d.asDiagonal() * p.Q * d.asDiagonal();
  p.S = d.asDiagonal() * p.S;
  const auto first = definite(p.R) ? first_solution(p) : start_without_weight(p);
  if (!first) no_solution(p);
  RiccatiSolution s = *first;
  refine(p, s);
  constexpr double poor = 1e-6;  // relative: after refine() well-posed problems reach the rounding level
  if (!stabilises(p, s.poles) || s.residual > poor) no_solution(p);
  s.X = inverse.asDiagonal() * s.X * inverse.asDiagonal();
  s.K = s.K * inverse.asDiagonal();
  return s;
}

}  // namespace

RiccatiSolution riccati(RiccatiProblem p) {
  check(p);
  const double n = static_cast<double>(p.A.rows());
  const std::vector<Mat> parts = stoppable(300 * n * n * n, [&] {
    const RiccatiSolution s = solution(p);
    Mat poles(s.poles.size(), 2);
    poles << s.poles.real(), s.poles.imag();
    return std::vector<Mat>{s.X, s.K, poles, Mat::Constant(1, 1, s.residual)};
  });
  ComplexVec poles(parts[2].rows());
  for (Index i = 0; i < poles.size(); ++i) poles[i] = {parts[2](i, 0), parts[2](i, 1)};
  return {parts[0], parts[1], poles, parts[3](0, 0)};
}

void require_costs(const Mat& Q, const char* equation) {
  if (Q.rows() == 0 || Q.rows() != Q.cols() || !Q.allFinite()) return;  // the equation reports it
  const double least = Eigen::SelfAdjointEigenSolver<Mat>(Q, Eigen::EigenvaluesOnly).eigenvalues()[0];
  constexpr double printed = 1e-10;  // Q may be printed with ten digits
  if (least < -printed * Q.norm())
    throw Error(text("Q must be positive semidefinite, but it has the eigenvalue ",
                     pendula::rounded(least, 4), ": deviations would be rewarded; ", equation,
                     " solves the equation alone"));
}

namespace {

RiccatiProblem problem_of(const System& given, const Mat& Q, const Mat& R) {
  const System g = to_ss(with_numbers(given));
  return {numbers(g.ss.A), numbers(g.ss.B), Q, R, {}, g.continuous()};
}

}  // namespace

RiccatiSolution lqi(const System& given, const Mat& Q, const Mat& R) {
  const System g = to_ss(with_numbers(given));
  const Index n = g.ss.order(), q = g.outputs, m = g.inputs;
  const Mat A = numbers(g.ss.A), B = numbers(g.ss.B), C = numbers(g.ss.C), D = numbers(g.ss.D);
  RiccatiProblem p{Mat::Zero(n + q, n + q), Mat::Zero(n + q, m), Q, R, {}, g.continuous()};
  const double h = g.continuous() ? 1 : number(g.Ts);  // ∫(r - y) by Euler's rule in discrete time
  p.A.topLeftCorner(n, n) = A;
  p.A.bottomLeftCorner(q, n) = -h * C;
  if (!g.continuous()) p.A.bottomRightCorner(q, q).setIdentity();
  p.B.topRows(n) = B;
  p.B.bottomRows(q) = -h * D;
  return riccati(std::move(p));
}

RiccatiSolution kalman(const System& given, const Mat& Q, const Mat& R) {
  RiccatiProblem p = problem_of(given, Q, R);
  const System g = to_ss(with_numbers(given));
  if (g.outputs == 0) throw Error("the system has no outputs to filter");
  p.A.transposeInPlace();
  p.B = numbers(g.ss.C).transpose();
  require_size(p.R, "R", g.outputs, g.outputs);
  require_symmetric(p.R, "R");
  if (p.continuous && !definite(p.R))
    throw Error("R must be positive definite: every output needs a noise of its own, however small");
  try {
    RiccatiSolution s = riccati(std::move(p));
    s.K.transposeInPlace();
    return s;
  } catch (const Error&) {  // messages about the transposed system are rewritten for the filter
    const Reach seen = observability(g);
    if (seen.stable) throw;
    throw Error(text("there is no stable filter, because y does not see a mode that does not decay: ",
                     describe(seen)));
  }
}

System estimator(const System& given, const Mat& L) {
  const System g = to_ss(with_numbers(given));
  const Index n = g.ss.order(), q = g.outputs, m = g.inputs;
  const Mat A = numbers(g.ss.A), B = numbers(g.ss.B), C = numbers(g.ss.C), D = numbers(g.ss.D);
  require_size(L, "L", n, q);
  Mat inputs(n, m + q), outputs(q + n, n), through = Mat::Zero(q + n, m + q);
  inputs << B - L * D, L;
  outputs << C, Mat::Identity(n, n);
  through.topLeftCorner(q, m) = D;
  return make_ss(expressions(A - L * C), expressions(inputs), expressions(outputs), expressions(through),
                 g.Ts);
}

}  // namespace pendula::lti
