// e^A of a matrix of doubles, with an error bound.
//
// Three layers. (1) A diagonal similarity D⁻¹ A D by powers of two balances rows and columns (Parlett &
// Reinsch, Numer. Math. 13, 1969); it is exact, and e^A = D e^{D⁻¹AD} D⁻¹. (2) Scaling and squaring with Padé
// approximants after Al-Mohy & Higham (SIAM J. Matrix Anal. Appl. 31(3), 2009), who choose the scaling by
// ‖Aᵏ‖^{1/k} to avoid needless squarings; bounds of the rounding errors are computed entry by entry. (3) If
// that bound shows a loss of digits (time constants that differ by many decades, or intermediate results much
// larger than e^A), the Taylor series is summed in multiple precision, with as many bits as scaling and the
// growth of the squarings can cost.
#include <gmpxx.h>

#include <array>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/stoppable.hpp"
#include "base/text.hpp"
#include "expr/linalg/linalg.hpp"

namespace pendula::linalg {
namespace {

using Eigen::Index;
constexpr double unit = eps / 2;

double norm1(const Mat& m) { return m.cwiseAbs().colwise().sum().maxCoeff(); }

// ── double precision ──

/// A matrix with bounds of the errors of its entries.
struct Bounded {
  Mat value, error;
};

/// |x y| rounded: γₙ = n u / (1 - n u).
Bounded multiplied(const Bounded& a, const Bounded& b) {
  const Mat x = a.value.cwiseAbs(), y = b.value.cwiseAbs();
  const double gamma = 1.01 * static_cast<double>(a.value.cols()) * unit;
  return {a.value * b.value, gamma * (x * y) + a.error * (y + b.error) + x * b.error};
}

/// Coefficients of the numerator of the diagonal Padé approximant [m/m] of eˣ:
/// (2m-j)! m! / ((2m)! (m-j)! j!).
Vec pade_coefficients(int m) {
  Vec c(m + 1);
  c[0] = 1;
  for (int j = 1; j <= m; ++j) c[j] = c[j - 1] * (m - j + 1) / (static_cast<double>(2 * m - j + 1) * j);
  return c;
}

/// Even powers of A, computed on demand.
class Powers {
 public:
  explicit Powers(const Mat& A) : square_(A * A) { list_ = {Mat::Identity(A.rows(), A.rows()), square_}; }
  const Mat& operator[](int half) {
    while (static_cast<int>(list_.size()) <= half) list_.push_back(list_.back() * square_);
    return list_[half];
  }
  /// ‖A^{2k}‖₁^{1/(2k)}
  double root(int half) { return std::pow(norm1((*this)[half]), 0.5 / half); }

 private:
  Mat square_;
  std::vector<Mat> list_;
};

/// The number of additional squarings that keep the leading error term of [m/m] below the unit roundoff: ℓₘ
/// of Al-Mohy & Higham (2009), eq. (5.1), with ‖ |A|^{2m+1} ‖₁ by products with a vector.
int more_squarings(const Mat& A, int m) {
  const Mat absolute = A.cwiseAbs();
  Vec v = Vec::Ones(A.rows());
  double scale = 0;  // log₂ of the factors extracted from v
  for (int k = 0; k < 2 * m + 1; ++k) {
    v = absolute.transpose() * v;
    const double largest = v.maxCoeff();
    if (largest == 0) return 0;
    v /= largest;
    scale += std::log2(largest);
  }
  double log_c = 0;  // log₂ of C(2m, m) (2m+1)!
  log_c = (2 * std::lgamma(2 * m + 1) - 2 * std::lgamma(m + 1) + std::log(2 * m + 1)) / std::log(2.0);
  const double log_alpha = scale - std::log2(norm1(A)) - log_c - std::log2(unit);
  return std::max(0, static_cast<int>(std::ceil(log_alpha / (2 * m))));
}

/// [m/m](A): (V - U)⁻¹ (V + U), U odd, V even.
Bounded pade(const Mat& A, Powers& powers, int m) {
  const Vec c = pade_coefficients(m);
  Mat U = Mat::Zero(A.rows(), A.rows()), V = U;
  for (int j = 0; 2 * j <= m; ++j) V += c[2 * j] * powers[j];
  for (int j = 0; 2 * j + 1 <= m; ++j) U += c[2 * j + 1] * powers[j];
  U = A * U;
  const Mat down = V - U, up = V + U;
  const Eigen::PartialPivLU<Mat> lu(down);
  Mat X = lu.solve(up);
  X += lu.solve(Mat(up - down * X));
  // V - U is well conditioned in the region of the approximant (‖(V-U)⁻¹‖ ≤ 17 for θ₁₃, Higham 2005).
  const Mat inverse = inverse_by_lu(lu).cwiseAbs();
  const double n = static_cast<double>(A.rows());
  const double terms = unit * (static_cast<double>(m) + 2 * n);
  return {X, terms * (inverse * (up.cwiseAbs() + down.cwiseAbs() * X.cwiseAbs()))};
}

bool upper_triangular(const Mat& A) {
  for (Index j = 0; j < A.cols(); ++j)
    if ((A.col(j).tail(A.rows() - j - 1).array() != 0).any()) return false;
  return true;
}

/// Computes e^{λt} on the diagonal and the adjacent divided differences directly, since squaring would lose
/// their digits (Al-Mohy & Higham 2009, code fragment 2.1).
void exact_diagonals(Bounded& x, const Mat& A, double t) {
  const Index n = A.rows();
  // errors: of exponentials and of rounding their arguments; 4 and 8 units allow for three such operations
  constexpr double no_difference = 1e-8;  // sinh x/x = 1 + x²/6: 2e-17 there
  for (Index i = 0; i < n; ++i) {
    const double a = t * A(i, i);
    x.value(i, i) = std::exp(a);
    x.error(i, i) = 4 * unit * (1 + std::fabs(a)) * x.value(i, i);
    if (i + 1 == n) continue;
    const double b = t * A(i + 1, i + 1), half = (b - a) / 2;
    const double ratio = std::fabs(half) < no_difference ? 1 : std::sinh(half) / half;
    const double middle = (a + b) / 2;
    double f = std::exp(middle) * ratio;
    if (!std::isfinite(f)) f = (std::exp(b) - std::exp(a)) / (b - a);
    x.value(i, i + 1) = t * A(i, i + 1) * f;
    x.error(i, i + 1) = 8 * unit * (1 + std::fabs(middle) + std::fabs(half)) * std::fabs(x.value(i, i + 1));
  }
}

/// [m/m] with s squarings, s chosen so that the backward error of the approximant is below the unit roundoff:
/// θ₃ … θ₉ from Higham (SIAM J. Matrix Anal. Appl. 26(4), 2005, table 2.3), θ₁₃ from Al-Mohy & Higham (2009).
Bounded by_squaring(const Mat& A) {
  constexpr std::array<int, 4> degrees = {3, 5, 7, 9};
  constexpr std::array<double, 4> theta = {1.495585217958292e-2, 2.539398330063230e-1, 9.504178996162932e-1,
                                           2.097847961257068};
  constexpr double theta_13 = 4.25;
  Powers powers(A);
  for (std::size_t k = 0; k < degrees.size(); ++k) {
    const int low = k < 2 ? 2 : 3;
    const double eta = std::max(powers.root(low), powers.root(low + 1));
    if (eta > theta[k] || more_squarings(A, degrees[k]) > 0) continue;
    Bounded x = pade(A, powers, degrees[k]);
    if (upper_triangular(A)) exact_diagonals(x, A, 1);
    return x;
  }
  const double eta =
      std::min(std::max(powers.root(3), powers.root(4)), std::max(powers.root(4), powers.root(5)));
  if (!std::isfinite(eta)) return {};
  int s = std::max(0, static_cast<int>(std::ceil(std::log2(eta / theta_13))));
  s += more_squarings(A * std::ldexp(1.0, -s), 13);
  const Mat small = A * std::ldexp(1.0, -s);
  Powers small_powers(small);
  Bounded x = pade(small, small_powers, 13);
  const bool triangular = upper_triangular(A);
  if (triangular) exact_diagonals(x, A, std::ldexp(1.0, -s));
  for (int k = s; k-- > 0;) {
    x = multiplied(x, x);
    if (triangular) exact_diagonals(x, A, std::ldexp(1.0, -k));
  }
  return x;
}

// ── multiple precision ──

using Wide = std::vector<mpf_class>;

class WideExponential {
 public:
  WideExponential(const Mat& A, int squarings, unsigned bits) : n_(A.rows()), s_(squarings), bits_(bits) {
    for (const double a : A.reshaped<Eigen::RowMajor>()) {
      mpf_class entry(a, bits_);
      mpf_div_2exp(entry.get_mpf_t(), entry.get_mpf_t(), static_cast<unsigned long>(s_));
      A_.push_back(entry);
    }
  }

  /// Σ Aᵏ/k! until the terms are below the precision (‖A‖ ≤ 1/2), then s squarings.
  Mat operator()() {
    Wide sum = identity(), term = identity();
    constexpr unsigned long most = 4096;  // a cap: 2⁻ᵏ/k! < 2⁻⁴⁰⁹⁶ from k = 480 on
    for (unsigned long k = 1; k < most; ++k) {
      term = product(term, A_);
      bool vanishes = true;
      for (mpf_class& v : term) {
        v /= k;
        long exponent = 0;
        mpf_get_d_2exp(&exponent, v.get_mpf_t());
        vanishes = vanishes && (v == 0 || exponent < -static_cast<long>(bits_));
      }
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += term[i];
      if (vanishes) break;
    }
    for (int k = 0; k < s_; ++k) {
      sum = product(sum, sum);
      for (const mpf_class& v : sum) {
        long exponent = 0;
        mpf_get_d_2exp(&exponent, v.get_mpf_t());
        growth_ = std::max(growth_, static_cast<double>(exponent));
      }
    }
    Mat out(n_, n_);
    for (Index i = 0; i < n_; ++i)
      for (Index j = 0; j < n_; ++j) out(i, j) = sum[i * n_ + j].get_d();
    return out;
  }
  /// log₂ of the largest entry of the squarings.
  double growth() const { return growth_; }

 private:
  Wide zero() const { return Wide(static_cast<std::size_t>(n_ * n_), mpf_class(0, bits_)); }
  Wide identity() const {
    Wide I = zero();
    for (Index i = 0; i < n_; ++i) I[i * n_ + i] = 1;
    return I;
  }
  Wide product(const Wide& a, const Wide& b) const {
    poll_interrupt();
    const auto n = static_cast<std::size_t>(n_);
    Wide c = zero();
    mpf_class part(0, bits_);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < n; ++k) {
        if (a[i * n + k] == 0) continue;
        for (std::size_t j = 0; j < n; ++j) {
          part = a[i * n + k] * b[k * n + j];
          c[i * n + j] += part;
        }
      }
    return c;
  }
  Index n_;
  int s_;
  unsigned bits_;
  double growth_ = 0;
  Wide A_;
};

/// Taylor's series with increasing precision until the rounding errors, 2^{s - bits} times the square of the
/// largest intermediate result, are below 2⁻⁶⁰ of every row. Empty for matrices that are too large.
std::optional<Mat> in_multiple_precision(const Mat& A) {
  // choices: products of n³ long multiplications, about a hundred of them; log₂ 10⁶⁰ = 200 squarings
  constexpr Index most_states = 24;
  constexpr unsigned most_bits = 4096;
  constexpr double most_norm = 1e60;
  const double size = norm1(A);
  if (A.rows() > most_states || !(size < most_norm)) return {};
  const int s = std::max(0, static_cast<int>(std::ceil(std::log2(size))) + 1);
  for (unsigned bits = 192 + 2 * static_cast<unsigned>(s); bits <= most_bits; bits *= 2) {
    WideExponential wide(A, s, bits);
    const Mat X = wide();
    if (!X.allFinite()) return X;
    double smallest = 0;  // log₂ of the smallest row that is not zero
    for (const double row : X.cwiseAbs().rowwise().maxCoeff())
      if (row > least_size) smallest = std::min(smallest, std::log2(row));
    if (s - static_cast<double>(bits) + 2 * wide.growth() < smallest - 60) return X;
  }
  return {};
}

/// Is an error bound larger than 10⁻¹² of the row and column of its entry?
bool lost_digits(const Bounded& x) {
  constexpr double digits = 1e-12;
  const Mat absolute = x.value.cwiseAbs();
  const Vec rows = absolute.rowwise().maxCoeff();
  const Eigen::RowVectorXd columns = absolute.colwise().maxCoeff();
  for (Index i = 0; i < absolute.rows(); ++i)
    for (Index j = 0; j < absolute.cols(); ++j)
      if (!(x.error(i, j) <= digits * std::min(rows[i], columns[j]))) return true;
  return false;
}

}  // namespace

Mat similar(const Mat& A, const Vec& d) { return d.cwiseInverse().asDiagonal() * A * d.asDiagonal(); }

namespace {

/// Off-diagonal sizes in the current units.
class Balance {
 public:
  explicit Balance(const Mat& A) : B_(A.cwiseAbs()), d_(Vec::Ones(A.rows())), kept_(Vec::Ones(A.rows())) {
    const double diagonal = A.diagonal().cwiseAbs().maxCoeff();
    B_.diagonal().setZero();
    remove_ends();
    sweep();
    scale_ends(std::max(diagonal, kept_.cwiseProduct(B_ * kept_).maxCoeff()));
  }

  const Vec& d() const { return d_; }

 private:
  double column(Index i) const { return B_.col(i).dot(kept_); }
  double row(Index i) const { return B_.row(i).dot(kept_); }

  /// Removes states that act on no other state, or on which none acts: they lie on no cycle, and their
  /// entries must not change the units of the others (Parlett & Reinsch, Numer. Math. 13, 1969).
  void remove_ends() {
    for (bool found = true; found;) {
      found = false;
      for (Index i = 0; i < d_.size(); ++i)
        if (kept_[i] > 0 && (row(i) == 0 || column(i) == 0)) {
          kept_[i] = 0;
          ends_.push_back(i);
          found = true;
        }
    }
  }

  void sweep() {
    // a cap: every scaling lowers the norm by 5 % of a row and column at least
    constexpr int most_sweeps = 100;
    constexpr double worthwhile = 0.95;  // as in LAPACK's dgebal
    bool changed = true;
    for (int k = 0; k < most_sweeps && changed; ++k) {
      changed = false;
      for (Index i = 0; i < d_.size(); ++i) {
        if (kept_[i] == 0) continue;
        const double c = column(i), r = row(i);
        const int power = static_cast<int>(std::lround(0.5 * std::log2(r / c)));
        const double f = std::ldexp(1.0, power);
        if (power == 0 || c * f + r / f >= worthwhile * (c + r)) continue;
        rescale(i, power);
        changed = true;
      }
    }
  }

  /// Scales the entries of the removed states to the size of the others.
  void scale_ends(double usual) {
    // 2⁴⁰⁰ = 10¹²⁰: products of two such scales are within the range of doubles
    constexpr int most_binary = 400;
    for (auto end = ends_.rbegin(); end != ends_.rend(); ++end) {
      const double c = column(*end), r = row(*end);
      kept_[*end] = 1;
      if (usual == 0 || (c == 0) == (r == 0)) continue;
      const double size = c == 0 ? r / usual : usual / c;
      rescale(*end, std::clamp(static_cast<int>(std::lround(std::log2(size))), -most_binary, most_binary));
    }
  }

  void rescale(Index i, int power) {
    d_[i] = std::ldexp(d_[i], power);
    B_.col(i) *= std::ldexp(1.0, power);
    B_.row(i) *= std::ldexp(1.0, -power);
  }

  Mat B_;
  Vec d_, kept_;  ///< kept: 1 for states that take part, else 0
  std::vector<Index> ends_;
};

}  // namespace

Vec balancing(const Mat& A) { return A.size() == 0 ? Vec(Vec::Ones(A.rows())) : Balance(A).d(); }

BoundedExponential bounded_exponential(const Mat& a) {
  if (a.rows() != a.cols()) throw Error(text("the matrix must be square, not ", a.rows(), "×", a.cols()));
  if (!a.allFinite()) throw Error("the matrix has entries that are not finite numbers");
  if (a.size() == 0) return {a, a};
  const auto overflows = [&] {
    return Failure(text("the exponential overflows double precision: the largest entry of A is ",
                        rounded(a.cwiseAbs().maxCoeff(), 3)));
  };
  if (!std::isfinite(norm1(a))) throw overflows();
  const Vec d = balancing(a);
  const Mat B = similar(a, d);
  if (!std::isfinite(norm1(B))) throw overflows();
  Bounded x = by_squaring(B);
  if (x.value.size() == 0 || !x.value.allFinite() || lost_digits(x))
    if (const auto wide = in_multiple_precision(B)) x = {*wide, 2 * unit * wide->cwiseAbs()};
  if (x.value.size() == 0) throw overflows();
  const Vec inverse = d.cwiseInverse();
  BoundedExponential out{d.asDiagonal() * x.value * inverse.asDiagonal(),
                         d.asDiagonal() * x.error * inverse.asDiagonal()};
  if (!out.value.allFinite()) throw overflows();
  return out;
}

Mat exponential(const Mat& a) {
  const double products = 100;  // about twenty, of values and of bounds
  return stoppable(products * std::pow(static_cast<double>(a.rows()), 3),
                   [&] { return std::vector<Mat>{bounded_exponential(a).value}; })[0];
}

}  // namespace pendula::linalg
