#include "lti/design/kalman_filter.hpp"

#include <cmath>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"

namespace pendula::lti {
namespace {

void check(const System& g, const Mat& Q, const Mat& R, const Mat& u, const Mat& y, const Vec& x0,
           const Mat& P0) {
  const Index n = g.ss.A.rows();
  const auto size = [](const Mat& m, Index rows, Index cols, const char* what) {
    if (m.rows() != rows || m.cols() != cols)
      throw Error(text(what, " must be ", rows, "×", cols, ", got ", m.rows(), "×", m.cols()));
  };
  if (g.continuous()) throw Error("the filter runs over samples: sample the system first, c2d(G, Ts)");
  size(Q, n, n, "Q");
  size(R, g.outputs, g.outputs, "R");
  size(P0, n, n, "P0");
  size(y, y.rows(), g.outputs, "y");
  size(u, y.rows(), g.inputs, "u");
  size(x0, n, 1, "x0");
  if (u.hasNaN()) throw Error("u must be known at every sample");
}

/// Backward pass: x̂(k|N) and its covariances from those of the filter.
void smooth_back(FilterRun& run, const Mat& A, const std::vector<Mat>& before,
                 const std::vector<Mat>& after) {
  const Index N = run.filtered.rows();
  run.smoothed = run.filtered;
  run.smoothed_std = run.std;
  Mat P = after[N - 1];
  for (Index k = N - 1; k-- > 0;) {
    if (k % 1024 == 0) poll_interrupt();
    const Mat transposed = before[k + 1].completeOrthogonalDecomposition().solve(Mat(A * after[k]));
    const Mat G = transposed.transpose();
    const Vec step = (run.smoothed.row(k + 1) - run.predicted.row(k + 1)).transpose();
    run.smoothed.row(k) += (G * step).transpose();
    P = (after[k] + G * (P - before[k + 1]) * G.transpose()).eval();
    run.smoothed_std.row(k) = P.diagonal().cwiseMax(0.0).cwiseSqrt().transpose();
  }
}

}  // namespace

FilterRun kalman_filter(const System& given, const Mat& Q, const Mat& R, const Mat& u, const Mat& y,
                        const Vec& x0, const Mat& P0, bool smooth) {
  const System g = to_ss(with_numbers(given));
  check(g, Q, R, u, y, x0, P0);
  const Mat A = numbers(g.ss.A), B = numbers(g.ss.B), C = numbers(g.ss.C), D = numbers(g.ss.D);
  const Index n = A.rows();
  const Index N = y.rows();
  FilterRun run;
  run.predicted.resize(N, n);
  run.filtered.resize(N, n);
  run.std.resize(N, n);
  run.y.resize(N, y.cols());
  std::vector<Mat> before, after;
  Vec x = x0;
  Mat P = P0;
  for (Index k = 0; k < N; ++k) {
    if (k % 1024 == 0) poll_interrupt();
    run.predicted.row(k) = x.transpose();
    const Vec expected = C * x + D * u.row(k).transpose();
    run.y.row(k) = expected.transpose();
    if (smooth) before.push_back(P);
    std::vector<Index> there;
    for (Index i = 0; i < y.cols(); ++i)
      if (!std::isnan(y(k, i))) there.push_back(i);
    Mat gain = Mat::Zero(n, y.cols());
    if (!there.empty()) {
      const Mat H = C(there, Eigen::all);
      const Mat noise = R(there, there);
      const Mat S = H * P * H.transpose() + noise;
      const Eigen::LLT<Mat> factor(S);
      if (factor.info() != Eigen::Success)
        throw Error(text("the covariance of the innovations is singular at sample ", k + 1, ": give R > 0"));
      const Mat K = Mat(factor.solve(Mat(H * P))).transpose();
      const Vec e = (y.row(k).transpose() - expected)(there);
      const Mat rest = Mat::Identity(n, n) - K * H;
      x += K * e;
      P = (rest * P * rest.transpose() + K * noise * K.transpose()).eval();
      gain(Eigen::all, there) = K;
      run.log_likelihood -=
          0.5 * (e.dot(factor.solve(e)) + static_cast<double>(there.size()) * std::log(2 * M_PI)) +
          factor.matrixLLT().diagonal().array().log().sum();
    }
    run.gains.push_back(gain);
    run.filtered.row(k) = x.transpose();
    run.std.row(k) = P.diagonal().cwiseMax(0.0).cwiseSqrt().transpose();
    if (smooth) after.push_back(P);
    x = (A * x + B * u.row(k).transpose()).eval();
    P = A * P * A.transpose() + Q;
    P = (0.5 * (P + P.transpose())).eval();
  }
  run.innovations = y - run.y;
  run.P = P;
  run.next = x;
  if (smooth && N > 0) smooth_back(run, A, before, after);
  return run;
}

}  // namespace pendula::lti
