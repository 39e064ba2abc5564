#include "lti/design/placement.hpp"

#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/stoppable.hpp"
#include "base/text.hpp"
#include "expr/linalg/linalg.hpp"
#include "lti/structure.hpp"

namespace pendula::lti {
namespace {

std::string shown(Complex z) {
  if (z.imag() == 0) return pendula::rounded(z.real(), 6);
  return text(pendula::rounded(z.real(), 6), z.imag() < 0 ? " - " : " + ",
              pendula::rounded(std::fabs(z.imag()), 6), " i");
}

/// Real poles first, then pairs z, z̄ with Im z > 0. Throws Error if a pole lacks its conjugate.
std::vector<Complex> paired(const ComplexVec& poles) {
  std::vector<Complex> real, complex, waiting;
  for (const Complex z : poles) {
    if (z.imag() == 0) {
      real.push_back(z);
      continue;
    }
    const auto partner = std::find(waiting.begin(), waiting.end(), std::conj(z));
    if (partner == waiting.end()) {
      waiting.push_back(z);
      continue;
    }
    waiting.erase(partner);
    const Complex up(z.real(), std::fabs(z.imag()));
    complex.push_back(up);
    complex.push_back(std::conj(up));
  }
  if (!waiting.empty())
    throw Error(text("the pole ", shown(waiting[0]), " needs its conjugate ", shown(std::conj(waiting[0])),
                     ", so that K is real"));
  real.insert(real.end(), complex.begin(), complex.end());
  return real;
}

void require_controllable(const Mat& A, const Mat& B) {
  const Index n = A.rows();
  const Reach r =
      controllability(make_ss(expressions(A), expressions(B), MatX::Identity(n, n), MatX::Zero(n, B.cols())));
  if (r.rank < r.order) throw Error(text("the poles cannot be placed: ", describe(r)));
}

void require_multiplicity(const std::vector<Complex>& poles, Index rank) {
  for (const Complex z : poles) {
    const auto times = std::count(poles.begin(), poles.end(), z);
    if (times > rank)
      throw Error(text("the pole ", shown(z), " is wanted ", times, " times, but B has rank ", rank,
                       ": repeat it at most that often, or use acker (one input)"));
  }
}

constexpr double vanished = 1e-12;  // of a unit vector, after a projection: its direction is rounding

/// Eigenvectors as real columns: x for a real pole, Re x and Im x for a pair.
class Eigenvectors {
 public:
  Eigenvectors(const Mat& A, const Mat& B, std::vector<Complex> poles) : poles_(std::move(poles)) {
    const Index n = A.rows(), m = B.cols();
    const Eigen::ColPivHouseholderQR<Mat> qr(B);
    const Mat Q = thin_q(qr.householderQ(), n);
    const Mat U1 = Q.rightCols(n - m);
    X_.resize(n, n);
    for (Index j = 0; j < n; ++j) {
      // x ∈ ker U1ᵀ(A - λI): then A x - λ x lies in the range of B.
      const ComplexMat M = (U1.transpose() * A).cast<Complex>() - poles_[j] * U1.transpose().cast<Complex>();
      if (M.rows() == 0)  // as many inputs as states: every vector is admissible
        spaces_.push_back(ComplexMat::Identity(n, m));
      else
        spaces_.push_back(Eigen::JacobiSVD<ComplexMat>(M, Eigen::ComputeFullV).matrixV().rightCols(m));
      put(j, spaces_.back().rowwise().sum().normalized());
      if (!pair(j)) continue;
      const ComplexMat conjugate = spaces_.back().conjugate();
      spaces_.push_back(conjugate);
      ++j;
    }
  }

  void improve() {
    // choices: the determinant grows with every sweep; it is a measure of quality, not a result
    constexpr int most_sweeps = 30;
    constexpr double settled = 1e-3;
    double before = size();
    for (int sweep = 0; sweep < most_sweeps; ++sweep) {
      for (Index j = 0; j < X_.cols(); ++j) {
        if (!pair(j)) {
          update_real(j);
          continue;
        }
        update_pair(j);
        ++j;
      }
      const double now = size();
      if (std::fabs(now - before) <= settled * std::fabs(now)) return;
      before = now;
    }
  }

  const Mat& X() const { return X_; }
  /// The Λ for which A X = X Λ after feedback.
  Mat Lambda() const {
    Mat L = Mat::Zero(X_.cols(), X_.cols());
    for (Index j = 0; j < L.cols(); ++j) {
      L(j, j) = poles_[j].real();
      if (!pair(j)) continue;
      L(j + 1, j + 1) = poles_[j].real();
      L(j, j + 1) = poles_[j].imag();
      L(j + 1, j) = -poles_[j].imag();
      ++j;
    }
    return L;
  }

 private:
  bool pair(Index j) const { return poles_[j].imag() > 0; }
  double size() const { return std::fabs(determinant_by_lu(X_)); }

  void put(Index j, const ComplexVec& x) {
    if (pair(j)) {
      X_.col(j) = std::sqrt(2.0) * x.real();
      X_.col(j + 1) = std::sqrt(2.0) * x.imag();
    } else {
      X_.col(j) = x.real().normalized();
    }
  }

  /// An orthonormal basis of the complement of all columns except `count` from j on.
  Mat complement(Index j, Index count) const {
    const Index n = X_.rows();
    Mat others(n, n - count);
    others << X_.leftCols(j), X_.rightCols(n - j - count);
    if (others.cols() == 0) return Mat::Identity(n, n);
    const Mat Q = thin_q(Eigen::HouseholderQR<Mat>(others).householderQ(), n);
    return Q.rightCols(count);
  }

  /// Replaces x by the vector of its space nearest to the normal of the other columns.
  void update_real(Index j) {
    const Mat S = spaces_[j].real();
    const Vec x = S * (S.transpose() * complement(j, 1).col(0));
    if (x.norm() > vanished) X_.col(j) = x.normalized();
  }

  /// Maximises |det of [Re x, Im x] in the complement|: the leading eigenvectors of Sᴴ(u uᴴ - ū uᵀ)S, u = q₁
  /// + i q₂ (Tits & Yang, §6.2); for a double eigenvalue the combination nearest to the old x.
  void update_pair(Index j) {
    const Mat q = complement(j, 2);
    const ComplexMat& S = spaces_[j];
    ComplexVec u = q.col(0).cast<Complex>() + Complex(0, 1) * q.col(1).cast<Complex>();
    const ComplexMat skew = u * u.adjoint() - u.conjugate() * u.transpose(), M = S.adjoint() * skew * S;
    const Eigen::JacobiSVD<ComplexMat> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Vec sigma = svd.singularValues();
    // directions of nearly equal singular values are rounding: ε/10⁻⁸ of them
    constexpr double equal = 1e-8;
    const bool tie = sigma.size() > 1 && sigma[1] > (1 - equal) * sigma[0];
    const ComplexMat best = S * svd.matrixU().leftCols(tie ? 2 : 1);
    const ComplexVec old = X_.col(j).cast<Complex>() + Complex(0, 1) * X_.col(j + 1).cast<Complex>();
    ComplexVec x = best * (best.adjoint() * old);
    if (x.norm() < vanished) x = best.col(0);
    put(j, x.normalized());
  }

  std::vector<Complex> poles_;
  std::vector<ComplexMat> spaces_;
  Mat X_;
};

/// The largest relative distance between wanted poles and the matched computed ones.
double miss(const std::vector<Complex>& wanted, ComplexVec found) {
  double worst = 0, scale = least_size;
  for (const Complex z : wanted) scale = std::max(scale, std::abs(z));
  std::vector<bool> used(wanted.size(), false);
  for (const Complex z : wanted) {
    std::size_t best = wanted.size();
    for (std::size_t k = 0; k < wanted.size(); ++k)
      if (!used[k] && (best == wanted.size() || std::abs(found[k] - z) < std::abs(found[best] - z))) best = k;
    used[best] = true;
    worst = std::max(worst, std::abs(found[best] - z) / scale);
  }
  return worst;
}

double condition(const Mat& X) {
  const Vec s = Eigen::JacobiSVD<Mat>(X).singularValues();
  return s[0] / s[s.size() - 1];
}

Placement placed(const Mat& A, const Mat& B, const ComplexVec& wanted) {
  const Index n = A.rows(), m = B.cols();
  if (A.cols() != n || B.rows() != n || m == 0)
    throw Error(
        text("A must be n×n and B n×m, but they are ", A.rows(), "×", A.cols(), " and ", B.rows(), "×", m));
  if (!A.allFinite() || !B.allFinite() || !wanted.allFinite())
    throw Error("A, B and the poles must be finite numbers");
  if (wanted.size() != n) throw Error(text("expected ", n, " poles, one per state, got ", wanted.size()));
  const std::vector<Complex> poles = paired(wanted);
  require_controllable(A, B);
  const Eigen::ColPivHouseholderQR<Mat> qr(B);
  const Index rank = qr.rank();
  require_multiplicity(poles, rank);
  if (rank < m) {  // inputs that are combinations of others stay zero
    const Mat kept = B * qr.colsPermutation() * Mat::Identity(m, rank);
    Placement p = placed(A, kept, wanted);
    Mat K = Mat::Zero(m, n);
    K.topRows(rank) = p.K;
    p.K = qr.colsPermutation() * K;
    return p;
  }
  Eigenvectors vectors(A, B, poles);
  if (m > 1) vectors.improve();
  // B K = A - X Λ X⁻¹
  const Mat closed =
      Mat(vectors.X().transpose()).partialPivLu().solve(Mat((vectors.X() * vectors.Lambda()).transpose()));
  Placement out;
  out.K = qr.solve(Mat(A - closed.transpose()));
  out.condition = condition(vectors.X());
  out.poles = Eigen::EigenSolver<Mat>(Mat(A - B * out.K), false).eigenvalues();
  // a choice: poles that far from the wanted ones are not those that were asked for
  constexpr double poor = 1e-3;
  if (!out.K.allFinite() || !(miss(poles, out.poles) <= poor))
    throw Failure(text("the poles are too sensitive to be placed: the condition of their eigenvectors is ",
                       pendula::rounded(out.condition, 3),
                       "; place them farther apart or nearer to those of A"));
  return out;
}

}  // namespace

Placement place(const Mat& A, const Mat& B, const ComplexVec& wanted) {
  const double n = static_cast<double>(A.rows());
  const double sweeps = B.cols() > 1 ? 10 * n : 0;  // of a factorisation for each eigenvector
  const bool square = A.rows() == A.cols() && B.rows() == A.rows() && A.allFinite();
  const Vec d = square ? linalg::balancing(A) : Vec(Vec::Ones(A.rows())), inverse = d.cwiseInverse();
  const std::vector<Mat> parts = stoppable((100 + sweeps) * n * n * n, [&] {
    const Placement p = square ? placed(linalg::similar(A, d), inverse.asDiagonal() * B, wanted)  // x = D x̃
                               : placed(A, B, wanted);
    Mat poles(p.poles.size(), 2);
    poles << p.poles.real(), p.poles.imag();
    return std::vector<Mat>{p.K * inverse.asDiagonal(), poles, Mat::Constant(1, 1, p.condition)};
  });
  ComplexVec poles(parts[1].rows());
  for (Index i = 0; i < poles.size(); ++i) poles[i] = {parts[1](i, 0), parts[1](i, 1)};
  return {parts[0], poles, parts[2](0, 0)};
}

namespace {

/// φ(A) = Σ cₖ Aᵏ, K = (0 … 0 1) [B AB …]⁻¹ φ(A); empty if [B AB …] is singular.
std::optional<MatX> ackermann(const MatX& A, const MatX& B, const std::vector<Expr>& polynomial) {
  const Index n = A.rows();
  MatX phi = MatX::Zero(n, n);
  for (const Expr c : polynomial) phi = MatX(product(phi, A) + scaled(c, MatX::Identity(n, n)));
  const System g = make_ss(A, B, MatX::Identity(n, n), MatX::Zero(n, 1));
  MatX last = MatX::Zero(n, 1);
  last(n - 1, 0) = 1;
  const auto row = solve(MatX(controllability_matrix(g).transpose()), last);
  if (!row) return {};
  return product(MatX(row->transpose()), phi);
}

/// The same in doubles, with scaled states (A balanced), time (‖A‖ near 1) and input (‖B‖ near 1).
std::optional<MatX> ackermann_of_numbers(const Mat& A, const Mat& B, std::vector<Expr> polynomial) {
  const Vec d = linalg::balancing(A), inverse = d.cwiseInverse();
  const auto near = [](double x) { return x > 0 ? std::exp2(std::round(std::log2(x))) : 1; };
  Mat a = linalg::similar(A, d), b = inverse.asDiagonal() * B;
  const double rate = near(a.norm()), size = near(b.norm());
  double power = 1;
  for (Expr& c : polynomial) {
    c = Expr(number(c) / power);
    power *= rate;
  }
  const auto K = ackermann(expressions(a / rate), expressions(b / size), polynomial);
  if (!K) return {};
  return expressions(numbers(*K) * inverse.asDiagonal() * (rate / size));
}

}  // namespace

MatX acker(const MatX& A, const MatX& B, const std::vector<Expr>& polynomial) {
  const Index n = A.rows();
  if (A.cols() != n || B.rows() != n || B.cols() != 1)
    throw Error(text("acker is for one input: A n×n and B n×1, but they are ", A.rows(), "×", A.cols(),
                     " and ", B.rows(), "×", B.cols(), "; for several inputs: place(A, B, poles)"));
  if (n == 0) throw Error("a system without states has no poles to place");
  if (static_cast<Index>(polynomial.size()) != n + 1)
    throw Error(text("expected ", n, " poles, one per state, got ", polynomial.size() - 1));
  const Field kind = common(common(field(A), field(B)), field(polynomial));
  auto K = kind == Field::numeric ? std::nullopt : ackermann(A, B, polynomial);
  if (!K) {  // also for fractions whose powers have too many digits for an exact solution
    const Reach reach = controllability(make_ss(A, B, MatX::Identity(n, n), MatX::Zero(n, 1)));
    if (kind != Field::symbolic && reach.rank == n)
      K = ackermann_of_numbers(numbers(A), numbers(B), polynomial);
    if (!K) throw Error(text("the poles cannot be placed: ", describe(reach)));
  }
  return tidy(*K);
}

}  // namespace pendula::lti
