#include "sysid/model/kalman_errors.hpp"

#include <cmath>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"

namespace pendula::sysid {
namespace {

/// The Kalman filter of one experiment; `slope` is ∂x̂/∂x₀.
class Filter {
 public:
  Filter(const StateSpaceModel& m, const Mat& Lambda) : m_(m), Lambda_(Lambda), factor_(Lambda) {}

  struct Output {
    Vec predicted, deviation, whitened;
    Mat whitened_slope;
    double log_det = 0;
  };

  void begin(const Vec& x) {
    x_ = x;
    P_ = Mat::Zero(x.size(), x.size());
    slope_ = Mat::Identity(x.size(), x.size());
    steady_ = true;
  }

  Output step(const Vec& u, const Vec& y) {
    Output out;
    out.predicted = m_.C * x_ + m_.D * u;
    std::vector<Index> there;
    for (Index i = 0; i < y.size(); ++i)
      if (!std::isnan(y[i])) there.push_back(i);
    const bool complete = static_cast<Index>(there.size()) == y.size();
    if (steady_ && complete)
      known_state(y - out.predicted, u, out);
    else
      update(there, y, u, out);
    return out;
  }

  const Vec& x() const { return x_; }
  const Mat& P() const { return P_; }

 private:
  void known_state(const Vec& e, const Vec& u, Output& out) {
    out.deviation = Lambda_.diagonal().cwiseSqrt();
    out.whitened = factor_.matrixL().solve(e);
    out.whitened_slope = -factor_.matrixL().solve(m_.C * slope_);
    out.log_det = 2 * factor_.matrixLLT().diagonal().array().log().sum();
    x_ = (m_.A * x_ + m_.B * u + m_.K * e).eval();
    slope_ = (m_.A * slope_ - m_.K * (m_.C * slope_)).eval();
  }

  void update(const std::vector<Index>& there, const Vec& y, const Vec& u, Output& out) {
    const Mat S = m_.C * P_ * m_.C.transpose() + Lambda_;
    out.deviation = S.diagonal().cwiseSqrt();
    const Mat AP = m_.A * P_;
    const Mat cross = AP * m_.C.transpose() + m_.K * Lambda_;  // cov(x⁺, y - ŷ)
    Mat next = AP * m_.A.transpose() + m_.K * Lambda_ * m_.K.transpose();
    x_ = (m_.A * x_ + m_.B * u).eval();
    Mat slope = m_.A * slope_;
    if (!there.empty()) {
      const Eigen::LLT<Mat> factor(S(there, there));
      const Vec e = (y - out.predicted)(there);
      const Mat C = m_.C(there, Eigen::all);
      const Mat gain = Mat(factor.solve(Mat(cross(Eigen::all, there).transpose()))).transpose();
      out.whitened = factor.matrixL().solve(e);
      out.whitened_slope = -factor.matrixL().solve(C * slope_);
      out.log_det = 2 * factor.matrixLLT().diagonal().array().log().sum();
      x_ += gain * e;
      slope -= gain * (C * slope_);
      next -= gain * cross(Eigen::all, there).transpose();
    }
    slope_ = std::move(slope);
    P_ = 0.5 * (next + next.transpose());
    // the remaining P, relative to the contribution of one missing sample
    const double fresh = (m_.K * Lambda_ * m_.K.transpose()).norm();
    constexpr double last_bits = 1e-15;  // 4.5 ε
    steady_ = P_.norm() <= last_bits * fresh;
    if (steady_) P_.setZero();
  }

  const StateSpaceModel& m_;
  const Mat& Lambda_;
  Eigen::LLT<Mat> factor_;
  Vec x_;
  Mat P_, slope_;
  bool steady_ = true;
};

/// The state at the first sample that minimises Σ|whitened|².
Vec best_start(Filter& filter, const IdData& d, Index from, Index to, Index n) {
  filter.begin(Vec::Zero(n));
  TriangularFactor factor(n + 1);
  Mat block(TriangularFactor::block_rows, n + 1);
  Index count = 0;
  Index rows = 0;
  for (Index t = from; t < to; ++t) {
    const Filter::Output out = filter.step(d.u.row(t).transpose(), d.y.row(t).transpose());
    for (Index i = 0; i < out.whitened.size(); ++i) {
      block.row(count) << out.whitened_slope.row(i), -out.whitened[i];
      ++rows;
      if (++count < block.rows()) continue;
      poll_interrupt();
      factor.add(block);
      count = 0;
    }
  }
  if (count > 0) factor.add(block.topRows(count));
  if (rows == 0 || !factor.R().allFinite()) return Vec::Zero(n);
  return solve_triangular(factor.R(), rows).theta;
}

}  // namespace

KalmanErrors kalman_errors(const StateSpaceModel& m, const Mat& Lambda, const IdData& d, FirstState first,
                           bool keep) {
  KalmanErrors out;
  out.predicted.resize(d.samples(), d.outputs());
  out.deviation.resize(d.samples(), d.outputs());
  std::vector<double> whitened;
  Filter filter(m, Lambda);
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index from = d.starts[k];
    const Vec x0 = first == FirstState::estimated ? best_start(filter, d, from, d.end(k), m.order())
                   : first == FirstState::given   ? m.x0[k]
                                                  : Vec(Vec::Zero(m.order()));
    out.x0.push_back(x0);
    filter.begin(x0);
    for (Index t = from; t < d.end(k); ++t) {
      if (keep) {
        out.x.push_back(filter.x());
        out.P.push_back(filter.P());
      }
      const Filter::Output one = filter.step(d.u.row(t).transpose(), d.y.row(t).transpose());
      out.predicted.row(t) = one.predicted.transpose();
      out.deviation.row(t) = one.deviation.transpose();
      whitened.insert(whitened.end(), one.whitened.begin(), one.whitened.end());
      out.log_det += one.log_det;
    }
  }
  out.whitened = Eigen::Map<const Vec>(whitened.data(), static_cast<Index>(whitened.size()));
  return out;
}

StateSpaceModel innovations_form(const PolyModel& m) {
  const auto padded = [](const Vec& v, Index n) {
    Vec out = Vec::Zero(n);
    out.head(v.size()) = v;
    return out;
  };
  Vec F = Vec::Ones(1);
  for (const Vec& f : m.p.F) F = convolve(F, f);
  const Vec a = convolve(convolve(m.p.A, m.p.D), F);
  const Vec c = convolve(m.p.C, F);
  std::vector<Vec> b;
  Index length = std::max(a.size(), c.size());
  for (Index i = 0; i < static_cast<Index>(m.p.B.size()); ++i) {
    Vec others = convolve(m.p.D, m.p.B[i]);
    for (Index j = 0; j < static_cast<Index>(m.p.F.size()); ++j)
      if (j != i) others = convolve(others, m.p.F[j]);
    length = std::max(length, others.size());
    b.push_back(others);
  }
  const Index n = length - 1;
  StateSpaceModel s;
  const Vec poles = padded(a, length).tail(n);
  s.A = Mat::Zero(n, n);
  if (n > 1) s.A.diagonal(1).setOnes();
  if (n > 0) s.A.col(0) = -poles;
  s.C = Mat::Zero(1, n);
  if (n > 0) s.C(0, 0) = 1;
  s.K = padded(c, length).tail(n) - poles;
  s.B = Mat::Zero(n, static_cast<Index>(b.size()));
  s.D = Mat::Zero(1, static_cast<Index>(b.size()));
  for (Index i = 0; i < s.B.cols(); ++i) {
    const Vec all = padded(b[i], length);
    s.D(0, i) = all[0];
    s.B.col(i) = all.tail(n) - all[0] * poles;
  }
  s.feedthrough = !s.D.isZero(0);
  return s;
}

std::pair<StateSpaceModel, Mat> innovations_form(const IdModel& m) {
  const auto p = static_cast<Index>(m.outputs.size());
  if (m.state_space) {
    Mat Lambda = m.state_space->innovations;
    if (Lambda.size() == 0 || !(Lambda.diagonal().minCoeff() > 0)) Lambda = Mat::Identity(p, p);
    return {*m.state_space, Lambda};
  }
  Mat Lambda = Mat::Identity(p, p);
  for (Index i = 0; i < p; ++i)
    if (m.outputs[i].quality.sigma2 > 0) Lambda(i, i) = m.outputs[i].quality.sigma2;
  if (m.coupled) return {observer_form(m), Lambda};
  StateSpaceModel all = innovations_form(m.outputs[0]);
  for (Index i = 1; i < p; ++i) {
    const StateSpaceModel one = innovations_form(m.outputs[i]);
    const auto joined = [](const Mat& a, const Mat& b) {
      Mat out = Mat::Zero(a.rows() + b.rows(), a.cols() + b.cols());
      out.topLeftCorner(a.rows(), a.cols()) = a;
      out.bottomRightCorner(b.rows(), b.cols()) = b;
      return out;
    };
    const auto stacked = [](const Mat& a, const Mat& b) {
      Mat out(a.rows() + b.rows(), a.cols());
      out << a, b;
      return out;
    };
    all.A = joined(all.A, one.A);
    all.C = joined(all.C, one.C);
    all.K = joined(all.K, one.K);
    all.B = stacked(all.B, one.B);
    all.D = stacked(all.D, one.D);
    all.feedthrough = all.feedthrough || one.feedthrough;
  }
  return {all, Lambda};
}

void require_inputs(const IdData& d) {
  IdData inputs = d;
  inputs.y.setZero();
  const std::string gaps = missing_text(inputs);
  if (!gaps.empty())
    throw Error(text(gaps, "; inputs must be known at every sample: d:fill(), or d:slice(…)"));
}

namespace {

/// C A^(h-1) x(t - h + 1) plus the effect of the inputs since then: ŷ(t | t - h) from the
/// stored filter states.
Mat ahead(const StateSpaceModel& m, const KalmanErrors& e, const IdData& d, Index horizon) {
  Mat out = e.predicted;
  for (Index k = 0; k < d.experiments(); ++k)
    for (Index t = d.starts[k]; t < d.end(k); ++t) {
      if (t % 1024 == 0) poll_interrupt();
      const Index from = std::max(d.starts[k], t - horizon + 1);
      Vec x = e.x[from];
      for (Index s = from; s < t; ++s) x = (m.A * x + m.B * d.u.row(s).transpose()).eval();
      out.row(t) = (m.C * x + m.D * d.u.row(t).transpose()).transpose();
    }
  return out;
}

}  // namespace

std::vector<Response> predict_with_gaps(const StateSpaceModel& m, const Mat& Lambda, const IdData& d,
                                        Index horizon, Seed seed) {
  require_inputs(d);
  const FirstState first = seed == Seed::zero ? FirstState::zero : FirstState::estimated;
  StateSpaceModel used = m;
  if (horizon == 0) used.K.setZero();
  const KalmanErrors e = kalman_errors(used, Lambda, d, first, horizon > 1);
  const Mat values = horizon > 1 ? ahead(m, e, d, horizon) : e.predicted;
  if (!values.allFinite())
    throw Failure("the response overflows: the model is unstable; predict with a short horizon");
  std::vector<Response> out;
  for (Index j = 0; j < d.outputs(); ++j) {
    Response one;
    one.values = values.col(j);
    for (Index t = 0; t < d.samples(); ++t)
      if (!std::isnan(d.y(t, j))) one.rows.push_back(t);
    one.compared = d.y.col(j)(one.rows);
    one.errors = one.compared - one.values(one.rows);
    one.fit = fit_percent(one.compared, one.errors);
    out.push_back(std::move(one));
  }
  return out;
}

Forecast forecast(const IdModel& m, const IdData& data, const Mat& u, Index steps) {
  if (data.experiments() != 1) throw Error("forecast continues one experiment; take one with d:slice(…)");
  constexpr Index most_steps = 1'000'000;  // 8 MB per output
  if (steps < 1 || steps > most_steps)
    throw Error(text("steps must be a whole number from 1 to ", most_steps, ", got ", steps));
  if (u.cols() != data.inputs() || u.rows() != steps)
    throw Error(text("u: the future inputs are ", steps, "×", data.inputs(),
                     " numbers, one row per step, got ", u.rows(), "×", u.cols()));
  IdData d = data;
  d.y.conservativeResize(data.samples() + steps, Eigen::NoChange);
  d.u.conservativeResize(data.samples() + steps, Eigen::NoChange);
  d.y.bottomRows(steps).setConstant(NAN);
  d.u.bottomRows(steps) = u;
  require_inputs(d);
  const auto [model, Lambda] = innovations_form(m);
  const KalmanErrors e = kalman_errors(model, Lambda, d, FirstState::estimated);
  return {e.predicted.bottomRows(steps), e.deviation.bottomRows(steps)};
}

}  // namespace pendula::sysid
