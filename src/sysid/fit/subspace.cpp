// From Hankel matrices to A, C, K and the states; the model is defined in state_space.cpp.
#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "sysid/fit/hankel.hpp"
#include "sysid/fit/state_space_pem.hpp"
#include "sysid/fit/subspace.hpp"
#include "sysid/model/kalman_errors.hpp"
#include "sysid/model/state_space_fit.hpp"
#include "sysid/model/validation.hpp"

namespace pendula::sysid {
namespace {

using Svd = Eigen::BDCSVD<Mat>;

/// Scales every output and input by its root mean square.
struct Scaled {
  IdData d;
  Vec y, u;
};

Scaled scaled(const IdData& d) {
  Scaled s{d, Vec::Ones(d.outputs()), Vec::Ones(d.inputs())};
  const auto scale = [](Mat& m, Vec& by) {
    for (Index j = 0; j < m.cols(); ++j) {
      const double size = m.col(j).norm() / std::sqrt(static_cast<double>(m.rows()));
      if (size > 0) {
        by[j] = size;
        m.col(j) /= size;
      }
    }
  };
  scale(s.d.y, s.y);
  scale(s.d.u, s.u);
  return s;
}

/// Weighted singular value decomposition of the future given the past: W₁ R₂₃ᵀ (W₂) = U S Vᵀ.
struct Decomposed {
  Mat left, inverse_left;  ///< W₁ and its inverse on the range
  Mat U;
  Vec S;
};

/// R₂₃ᵀ R₂₂⁻ᵀ: future outputs predicted by the past, per entry of w_p; R₂₂ may be singular.
Mat predicted_by_past(const Hankel& h) {
  return Mat(Mat(h.R22()).completeOrthogonalDecomposition().solve(Mat(h.R23()))).transpose();
}

Decomposed decompose(const Hankel& h, const std::string& weighting) {
  Decomposed out;
  const Index y = h.y();
  if (weighting == "CVA") {  // W₁ = (Y_f Π Y_fᵀ)^(-1/2) from the singular values of [R23; R33]
    Mat both(h.past() + y, y);
    both << h.R23(), h.R33();
    const Svd svd(both, Eigen::ComputeThinV);
    const Vec s = svd.singularValues();
    Index r = 0;
    constexpr double rounding = 1e-13;  // 450 ε: directions without signal would be scaled up to it
    while (r < s.size() && s[r] > rounding * s[0]) ++r;
    out.left = s.head(r).cwiseInverse().asDiagonal() * svd.matrixV().leftCols(r).transpose();
    out.inverse_left = svd.matrixV().leftCols(r) * s.head(r).asDiagonal();
  } else {
    out.left = out.inverse_left = Mat::Identity(y, y);
  }
  Mat O = h.R23().transpose();
  if (weighting == "N4SID") {
    const Mat L = predicted_by_past(h);
    O.resize(y, h.R12().rows() + h.R22().rows());
    O << L * h.R12().transpose(), L * h.R22().transpose();
  }
  const Svd svd(out.left * O, Eigen::ComputeThinU);
  out.U = svd.matrixU();
  out.S = svd.singularValues();
  for (Index j = 0; j < out.U.cols(); ++j) {  // the sign is free: makes the largest entry positive
    Index at = 0;
    out.U.col(j).cwiseAbs().maxCoeff(&at);
    if (out.U(at, j) < 0) out.U.col(j) *= -1;
  }
  return out;
}

/// Minimises σ²(n+1) + d(n) ln N / N; for exact data the rank.
int choose_order(const Vec& S, const SubspaceOptions& o, const IdData& d, Index windows, bool exact,
                 std::string& words) {
  const auto limit = std::min<int>(o.most, static_cast<int>(S.size()) - 1);
  if (exact) {
    int n = 0;
    // without noise the others were at most 3e-15 of the first (orders 1 to 3, 200 and 5000 samples); data
    // that are written with 7 digits count as exact, too
    constexpr double rounding = 1e-7;
    while (n < S.size() && S[n] > rounding * S[0]) ++n;
    words = "the rank of the data";
    return std::max(1, n);
  }
  const auto N = static_cast<double>(windows);
  int best = std::min(o.least, limit);
  double least = INFINITY;
  for (int n = o.least; n <= limit; ++n) {
    const double value =
        S[n] * S[n] + static_cast<double>(n * (2 * d.outputs() + d.inputs())) * std::log(N) / N;
    if (value < least) {
      least = value;
      best = n;
    }
  }
  words = text("the least σ²(n+1) + d(n) ln N / N for n = ", o.least, " … ", limit);
  return best;
}

Index default_horizon(const IdData& d, const SubspaceOptions& o) {
  const Index channels = d.inputs() + d.outputs(), p = d.outputs();
  const int wanted = o.order > 0 ? o.order : o.most;
  const Index least = (wanted + p - 1) / p + 1;
  // a choice: 15 samples show a transient; at least three windows for each of the 2·horizon·channels rows
  return std::max(least, std::min<Index>(15, d.samples() / (6 * channels)));
}

void check(const IdData& d, const SubspaceOptions& o) {
  require_inputs(d);
  // at order 100 a matrix of the horizon, with its 101 block rows past and future, takes 0.3 MB per channel²
  if (o.order < 0 || o.order > 100) throw Error(text("order must lie between 1 and 100, got ", o.order));
  if (o.least < 1 || o.most < o.least || o.most > 100)
    throw Error(text("order = {", o.least, ", ", o.most,
                     "} is not a range; give {from, to} with 1 ≤ from ≤ to ≤ 100"));
}

void check_size(const IdData& d, Index i, int order) {
  const Index need = 2 * i * (d.inputs() + d.outputs()) + 1;
  Index have = 0;
  for (Index k = 0; k < d.experiments(); ++k) have += std::max<Index>(0, d.end(k) - d.starts[k] - 2 * i + 1);
  if (have < need)
    throw Error(text(d.samples(), " samples are too few for order ", order, " with ", i,
                     " block rows: ", need + 2 * i - 1, " are needed; lower the order or the horizon"));
}

/// K from the residuals of x̂(t+1) and y(t) given x̂(t) and u(t), where x̂(t) = L w_p(t). w_p(t+1) is w_p(t)
/// with u(t) and y(t) appended and the oldest samples dropped.
Mat noise_gain(const Hankel& h, const Mat& A, const Mat& C, const Mat& L) {
  const Index n = A.rows(), m = h.inputs, p = h.outputs, past = h.past();
  Mat S(h.shorter.rows(), past + m + p);  // [w_p u y]
  S << h.shorter.middleCols(h.future(), past), h.shorter.leftCols(m),
      h.shorter.middleCols(h.future() + past, p);
  Mat T = Mat::Zero(S.cols(), n + m + p + n);  // [x u y x⁺] = [w_p u y] T
  T.topLeftCorner(past, n) = L.transpose();
  T.block(past, n, m + p, m + p).setIdentity();
  T.block(0, n + m + p, past - m - p, n) = L.rightCols(past - m - p).transpose();
  T.bottomRightCorner(m + p, n) = L.leftCols(m + p).transpose();
  TriangularFactor factor(T.cols());
  factor.add(S * T);
  const Mat tail = factor.R().bottomRightCorner(p + n, p + n);
  const Mat cov =
      tail.transpose() * tail / static_cast<double>(std::max<Index>(1, h.windows - h.ends - n - m));
  return kalman_gain(A, C, cov.bottomRightCorner(n, n), cov.bottomLeftCorner(n, p), cov.topLeftCorner(p, p));
}

/// A gain for which A - K C is stable.
Mat observer_gain(const Mat& A, const Mat& C) {
  const Index n = A.rows(), p = C.rows();
  return kalman_gain(A, C, Mat::Identity(n, n), Mat::Zero(n, p), Mat::Identity(p, p));
}

/// Names the columns of B that linearly dependent inputs leave undetermined.
std::vector<std::string> dependent_inputs(const IdData& d) {
  if (d.inputs() < 2) return {};
  const LeastSquares ls =
      solve_triangular(pendula::triangular_factor(d.u, Vec::Zero(d.samples())).R(), d.samples());
  std::vector<std::string> names;
  for (const std::string& u : d.u_names) names.push_back("B(" + u + ")");
  return free_directions(ls.null_space, names);
}

void unscale(StateSpaceModel& m, const Scaled& s) {
  m.C = s.y.asDiagonal() * m.C;
  m.D = s.y.asDiagonal() * m.D * s.u.cwiseInverse().asDiagonal();
  m.B = m.B * s.u.cwiseInverse().asDiagonal();
  m.K = m.K * s.y.cwiseInverse().asDiagonal();
}

}  // namespace

Mat kalman_gain(const Mat& A, const Mat& C, const Mat& Q, const Mat& S, const Mat& R) {
  // P > 0 also if Q = 0: for an unstable A the stabilising P grows from there
  Mat P = Mat::Identity(A.rows(), A.rows()) * (Q.trace() + least_size);
  Mat K;
  constexpr int most = 5000;  // the error falls by ρ(A - K C)² a step: to 10⁻¹⁴ for ρ up to 0.997
  for (int k = 0; k < most; ++k) {
    if (k % 64 == 0) poll_interrupt();
    const Mat G = A * P * C.transpose() + S;
    const Mat Re = C * P * C.transpose() + R;
    K = Mat(Re.ldlt().solve(Mat(G.transpose()))).transpose();
    Mat next = A * P * A.transpose() + Q - K * G.transpose();
    next = (0.5 * (next + next.transpose())).eval();
    const double change = (next - P).norm();
    P = std::move(next);
    constexpr double rounding = 1e-14;  // 45 ε
    if (!(change > rounding * P.norm())) break;
  }
  return K;
}

IdModel subspace(const IdData& given, const SubspaceOptions& o) {
  check(given, o);
  if (missing(given) > 0)  // sufficient as a start; the likelihood of the available samples has no bias
    return refined(*subspace(fill(given, Filling::linear), o).state_space, given);
  const IdData& data = given;
  const Scaled s = scaled(data);
  const IdData& d = s.d;
  StateSpaceModel m;
  m.feedthrough = o.feedthrough;
  m.weighting = o.weighting;
  m.horizon = o.horizon > 0 ? o.horizon : default_horizon(d, o);
  const Index p = d.outputs();
  if (o.order > (m.horizon - 1) * p)
    throw Error(text("horizon = ", m.horizon, " leaves at most order ", (m.horizon - 1) * p,
                     ", order = ", o.order, " needs horizon ≥ ", (o.order + p - 1) / p + 1));
  check_size(d, m.horizon, o.order > 0 ? o.order : o.least);
  const Hankel h = hankel(d, m.horizon);
  constexpr double rounding = 1e-9;  // of y: what remains of data without noise after the factorisation
  if (!(h.R23().norm() > rounding * h.y_size()))
    throw Error(text("the data do not determine a model of order ", std::max(1, o.order),
                     ": past samples do not improve the prediction of the "
                     "outputs by the inputs; excite the input, or take fir"));
  const bool exact = h.R33().norm() <= rounding * h.y_size();
  if (exact && m.weighting == "CVA") m.weighting = "MOESP";  // without noise there is no weighting
  const Decomposed part = decompose(h, m.weighting);
  m.singular_values = part.S;
  Index n = o.order;
  if (n == 0) {
    const bool reuse = m.weighting == "CVA" || exact;
    n = choose_order(reuse ? part.S : decompose(h, "CVA").S, o, d, h.windows, exact, m.choice);
    n = std::min(n, (m.horizon - 1) * p);
  }
  constexpr double none = 1e-14;  // 45 ε: a singular value that is 0 but for rounding
  if (part.S.size() < n || !(part.S[n - 1] > none * part.S[0]))
    throw Error(text("the data do not determine a model of order ", n, "; lower the order"));
  const Vec root = part.S.head(n).cwiseSqrt();
  const Mat gamma = part.inverse_left * part.U.leftCols(n) * root.asDiagonal();
  const Index rows = (m.horizon - 1) * p;
  m.C = gamma.topRows(p);
  m.A = Mat(gamma.topRows(rows)).colPivHouseholderQr().solve(Mat(gamma.bottomRows(rows)));
  const Mat L =
      root.cwiseInverse().asDiagonal() * part.U.leftCols(n).transpose() * part.left * predicted_by_past(h);
  if (exact)
    m.K = observer_gain(m.A, m.C);
  else if (o.noise)
    m.K = noise_gain(h, m.A, m.C, L);
  else
    m.K = spectral_radius(m.A) < 1 ? Mat::Zero(n, p) : observer_gain(m.A, m.C);
  if (!m.K.allFinite() || !(spectral_radius(m.A - m.K * m.C) < 1)) m.K = observer_gain(m.A, m.C);
  fit_inputs(m, d);
  m.free_inputs = dependent_inputs(data);
  if (exact && spectral_radius(m.A) < 1) m.K.setZero();
  unscale(m, s);
  IdModel out = completed(std::move(m), data, exact);
  const char* consequence =
      "A and B may then be biased: later inputs are taken as independent of the noise; pem(d, m) or arx are not";
  Index j = 0;
  for (PolyModel& row : out.outputs)
    if (std::string line = exact ? "" : feedback_warning(data, j++, consequence); !line.empty())
      row.search.warnings.push_back(std::move(line));
  return out;
}

}  // namespace pendula::sysid
