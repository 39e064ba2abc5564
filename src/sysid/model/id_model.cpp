#include "sysid/model/id_model.hpp"

#include <cmath>
#include <limits>

#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "sysid/model/kalman_errors.hpp"

namespace pendula::sysid {

IdData channel(const IdData& d, Index output, bool coupled) {
  if (!coupled) return d;
  IdData out = d;
  for (Index j = 0; j < d.outputs(); ++j) {
    if (j == output) continue;
    out.u.conservativeResize(Eigen::NoChange, out.u.cols() + 1);
    out.u.rightCols(1) = d.y.col(j);
    out.u_names.push_back(d.y_names[j]);
  }
  return out;
}

IdModel arx(const IdData& d, const std::vector<Orders>& orders,
            const std::vector<std::vector<int>>& couplings, InitialCondition start) {
  IdModel m;
  m.inputs = d.inputs();
  m.coupled = d.outputs() > 1;
  for (Index i = 0; i < d.outputs(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    Orders o = checked(orders[k], d);
    for (Index j = 0; m.coupled && j < d.outputs(); ++j)
      if (j != i) {
        o.nb.push_back(couplings[k][j]);
        o.nk.push_back(1);
        o.nf.push_back(0);
      }
    m.outputs.push_back(arx(channel(d, i, m.coupled), i, o, start));
  }
  if (m.coupled && !d.u.hasNaN()) {  // all outputs jointly, not one given the others
    std::vector<Response> free;
    try {
      free = predict(m, d, 0, start == InitialCondition::zero ? Seed::zero : Seed::data);
    } catch (const Failure&) {
    }
    for (std::size_t i = 0; i < m.outputs.size(); ++i)
      m.outputs[i].simulation.percent = free.empty() ? -std::numeric_limits<double>::infinity() : free[i].fit;
  }
  return m;
}

Regression regression(const IdData& d, Index output, const Orders& orders, InitialCondition start) {
  const Regressor regressor(d, output, orders, start);
  if (regressor.rows() == 0) arx(d, output, orders, start);  // throws the reason
  Regression r{regressor.matrix(), regressor.targets(), regressor.names(), {}};
  for (const RowRange& range : regressor.ranges())
    for (Index t = range.first; t < range.last; ++t) r.sample.push_back(t + 1);
  return r;
}

namespace {

/// Restricts per-sample weights to the used rows.
void choose_rows(Weighting& w, const Regression& r, Index samples) {
  const auto rows = r.y.size();
  const auto wrong = [&](const char* what, Index got) {
    throw Error(text(what, ": expected ", samples, " entries (one per sample) or ", rows,
                     " (one per row of the regressor), got ", got));
  };
  std::vector<Index> kept;
  for (const Index t : r.sample) kept.push_back(t - 1);
  if (w.weights.size() > 0 && w.weights.size() != rows) {
    if (w.weights.size() != samples) wrong("weights", w.weights.size());
    w.weights = w.weights(kept).eval();
  }
  Mat& S = w.covariance;
  if (S.size() == 1) S = Mat(Mat::Constant(rows, 1, S(0, 0)));
  if (S.size() == 0 || S.rows() == rows) return;
  if (S.rows() != samples || (S.cols() != 1 && S.cols() != samples)) wrong("covariance", S.rows());
  S = S.cols() == 1 ? Mat(S(kept, Eigen::all)) : Mat(S(kept, kept));
}

}  // namespace

PolyModel arx(const IdData& d, Index output, const Orders& orders, InitialCondition start,
              Weighting weighting) {
  PolyModel m = arx(d, output, orders, start);
  const Regression r = regression(d, output, m.orders, start);
  choose_rows(weighting, r, d.samples());
  const WeightedLeastSquares fit = least_squares(r.Phi, r.y, weighting);
  m.theta = fit.theta;
  m.identifiability.rank = fit.rank;
  m.identifiability.null_space = fit.null_space;
  m.covariance = fit.covariance;
  m.std = standard_deviations(fit, fit.covariance);
  m.p = polynomials_of(m.theta, m.orders);
  m.identifiability.directions = free_directions(fit.null_space, m.names);
  m.weighting =
      fit.known_noise ? "least squares with the given covariance of the noise" : "weighted least squares";
  m.quality = criteria((r.y - r.Phi * m.theta).squaredNorm(), r.y.size(), fit.rank,
                       (r.y.array() - r.y.mean()).matrix().squaredNorm());
  if (missing(d) == 0)
    m.simulation.percent = simulation_fit(m, d, start == InitialCondition::zero ? Seed::zero : Seed::data);
  return m;
}

PolyModel arx(const IdData& d, Index output, const Orders& orders, InitialCondition start,
              const Density& density) {
  PolyModel m = arx(d, output, orders, start);
  // the rank report contains the first thing to change
  if (m.identifiability.rank < m.theta.size()) return m;
  const Regression r = regression(d, output, m.orders, start);
  const LikelihoodFit fit = maximise(r, density);
  m.theta = fit.theta;
  m.covariance = fit.covariance;
  m.std = fit.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  m.p = polynomials_of(m.theta, m.orders);
  m.exact = false;
  m.log_likelihood = fit.log_likelihood;
  const Vec e = r.y - r.Phi * m.theta;
  m.quality = criteria(e.squaredNorm(), r.y.size(), m.theta.size(),
                       (r.y.array() - r.y.mean()).matrix().squaredNorm());
  m.noise = described(density, fit);
  if (missing(d) == 0)
    m.simulation.percent = simulation_fit(m, d, start == InitialCondition::zero ? Seed::zero : Seed::data);
  return m;
}

namespace {

/// Simulates all outputs jointly, step by step: A_i y_i = Σ B u with simulated values of the other outputs.
void simulate_experiment(const IdModel& m, const IdData& d, Index from, Index end, Index seeded, Mat& y) {
  for (Index t = from + seeded; t < end; ++t) {
    if (t % 4096 == 0) poll_interrupt();
    for (std::size_t i = 0; i < m.outputs.size(); ++i) {
      const auto row = static_cast<Index>(i);
      const Polynomials& p = m.outputs[i].p;
      const auto past = [&](const Mat& x, Index column, Index lag) {
        return t - lag < from ? 0 : x(t - lag, column);
      };
      double sum = 0;
      for (Index k = 1; k < p.A.size(); ++k) sum -= p.A[k] * past(y, row, k);
      for (std::size_t j = 0; j < p.B.size(); ++j) {
        const auto c = static_cast<Index>(j);
        const Index other = c - m.inputs < row ? c - m.inputs : c - m.inputs + 1;
        for (Index k = 0; k < p.B[j].size(); ++k)
          if (p.B[j][k] != 0) sum += p.B[j][k] * (c < m.inputs ? past(d.u, c, k) : past(y, other, k));
      }
      y(t, row) = sum;
    }
  }
}

std::vector<Response> simulate_coupled(const IdModel& m, const IdData& d, Seed seed) {
  if (seed == Seed::estimate)
    throw Error("the simulation of a coupled model starts with ic = \"data\" or \"zero\"");
  Index memory = 0;
  for (const PolyModel& row : m.outputs) memory = std::max(memory, row.p.memory());
  Mat y = d.y;
  std::vector<Index> rows;
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index from = d.starts[k];
    const Index seeded = seed == Seed::zero ? 0 : std::min(memory, d.end(k) - from);
    simulate_experiment(m, d, from, d.end(k), seeded, y);
    for (Index t = from + seeded; t < d.end(k); ++t) rows.push_back(t);
  }
  if (!y.allFinite()) throw Failure("the response overflows: the model is unstable");
  std::vector<Response> out;
  for (Index i = 0; i < d.outputs(); ++i) {
    Response r;
    r.values = y.col(i);
    r.rows = rows;
    r.compared = d.y.col(i)(rows);
    r.errors = r.compared - Vec(y.col(i)(rows));
    r.fit = fit_percent(r.compared, r.errors);
    out.push_back(std::move(r));
  }
  return out;
}

}  // namespace

std::vector<Response> predict(const IdModel& m, const IdData& d, Index horizon, Seed seed) {
  if (static_cast<Index>(m.outputs.size()) != d.outputs() || m.inputs != d.inputs())
    throw Error(text("the model has ", counted(m.outputs.size(), "output"), " and ",
                     counted(m.inputs, "input"), ", the data ", d.outputs(), " and ", d.inputs()));
  const PolyModel& first = m.outputs.front();
  constexpr double same = 1e-6;  // relative: times may be printed with seven digits
  if (first.estimated && std::fabs(first.Ts - d.Ts) > same * first.Ts)
    throw Error(text("the model was estimated from samples ", rounded(first.Ts, 6), " s apart, the data are ",
                     rounded(d.Ts, 6), " s apart: d:resample(", rounded(first.Ts, 6), ")"));
  if (m.state_space) return predict(*m.state_space, d, horizon, seed);
  if (m.coupled && missing(d) > 0) {
    const auto [model, Lambda] = innovations_form(m);
    return predict_with_gaps(model, Lambda, d, horizon, seed);
  }
  if (m.coupled && horizon == 0) return simulate_coupled(m, d, seed);
  if (m.coupled && horizon > 1)
    throw Error("a coupled model predicts one step or simulates; give horizon = 1");
  std::vector<Response> out;
  for (Index i = 0; i < d.outputs(); ++i)
    out.push_back(predict(m.outputs[i], channel(d, i, m.coupled), horizon, seed));
  return out;
}

namespace {

std::vector<Mat*> entries_of(StateSpaceModel& s) {
  std::vector<Mat*> out{&s.A, &s.B, &s.C};
  if (s.feedthrough) out.push_back(&s.D);
  if (!s.K.isZero(0)) out.push_back(&s.K);
  return out;
}

}  // namespace

Vec all_parameters(const IdModel& m) {
  std::vector<double> all;
  if (m.state_space) {
    StateSpaceModel s = *m.state_space;
    for (const Mat* M : entries_of(s)) all.insert(all.end(), M->data(), M->data() + M->size());
  } else {
    for (const PolyModel& row : m.outputs) all.insert(all.end(), row.theta.begin(), row.theta.end());
  }
  return Eigen::Map<const Vec>(all.data(), static_cast<Index>(all.size()));
}

IdModel with_parameters(const IdModel& m, const Vec& theta) {
  const Index need = all_parameters(m).size();
  if (theta.size() != need)
    throw Error(
        text("theta has ", counted(theta.size(), "number"), ", the model ", counted(need, "parameter")));
  IdModel out = m;
  Index at = 0;
  if (m.state_space) {
    StateSpaceModel s = *m.state_space;
    for (Mat* M : entries_of(s)) {
      *M = theta.segment(at, M->size()).reshaped(M->rows(), M->cols());
      at += M->size();
    }
    out.state_space = std::make_shared<const StateSpaceModel>(std::move(s));
    return out;
  }
  for (PolyModel& row : out.outputs) {
    row.theta = theta.segment(at, row.theta.size());
    row.p = polynomials_of(row.theta, row.orders);
    at += row.theta.size();
  }
  return out;
}

std::string describe(const IdModel& m) {
  if (m.state_space) return describe_state_space(m);
  std::string out;
  for (const PolyModel& row : m.outputs) {
    if (m.outputs.size() > 1) out += text(out.empty() ? "" : "\n", "output ", row.y_name, ": ");
    out += describe(row);
  }
  return out;
}

}  // namespace pendula::sysid
