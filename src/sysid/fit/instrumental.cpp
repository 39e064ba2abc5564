#include "sysid/fit/instrumental.hpp"

#include <cmath>
#include <numeric>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "sysid/model/validation.hpp"
#include "sysid/regression/structured.hpp"

namespace pendula::sysid {
namespace {

/// Filters every signal of every experiment by num/den, initially at rest; y is replaced if given.
IdData filtered_data(const IdData& d, const Vec& num, const Vec& den) {
  IdData out = d;
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index from = d.starts[k];
    const Index n = d.end(k) - from;
    for (Mat* m : {&out.y, &out.u})
      for (Index j = 0; j < m->cols(); ++j) {
        const Vec x = m->col(j).segment(from, n);
        m->col(j).segment(from, n) = filtered(num, den, x);
      }
  }
  return out;
}

/// Σ B/A u: the response to the inputs alone.
Vec simulated(const IdData& d, const Polynomials& p) {
  Vec out = Vec::Zero(d.samples());
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index from = d.starts[k];
    const Index n = d.end(k) - from;
    for (Index i = 0; i < d.inputs(); ++i)
      out.segment(from, n) += filtered(p.B[i], reflected(p.A), Vec(d.u.col(i).segment(from, n)));
  }
  return out;
}

struct Estimate {
  Vec theta, errors;
  Mat covariance;
};

/// Solves Zᵀ(y - Φθ) = 0 on the common rows.
Estimate solve_instruments(const IdData& d, const IdData& instruments, const Orders& orders) {
  const Regressor Phi(d, 0, orders, InitialCondition::drop);
  const Regressor Z(instruments, 0, orders, InitialCondition::drop);
  const Mat phi = Phi.matrix();
  const Mat z = Z.matrix();
  const Vec y = Phi.targets();
  const Mat cross = z.transpose() * phi;
  const Eigen::ColPivHouseholderQR<Mat> qr(cross);
  if (qr.rank() < cross.cols())
    throw Error(
        "the simulated output does not determine the parameters: the input excites too little; lower na or nb");
  Estimate out;
  out.theta = qr.solve(Vec(z.transpose() * y));
  out.errors = y - phi * out.theta;
  const double sigma2 =
      out.errors.squaredNorm() / static_cast<double>(std::max<Index>(1, y.size() - phi.cols()));
  const Mat inverse = qr.solve(Mat(Mat::Identity(cross.rows(), cross.rows())));
  out.covariance = sigma2 * inverse * (z.transpose() * z) * inverse.transpose();
  return out;
}

/// A(q) of an AR model of the equation errors A y - B u.
Vec noise_model(const IdData& d, const Polynomials& p, int order) {
  IdData v = d;
  v.u.resize(d.samples(), 0);
  v.u_names.clear();
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index from = d.starts[k];
    const Index n = d.end(k) - from;
    Vec e = filtered(p.A, Vec::Ones(1), Vec(d.y.col(0).segment(from, n)));
    for (Index i = 0; i < d.inputs(); ++i)
      e -= filtered(p.B[i], Vec::Ones(1), Vec(d.u.col(i).segment(from, n)));
    e.head(std::min(n, p.memory())).setZero();
    v.y.col(0).segment(from, n) = e;
  }
  Orders ar;
  ar.na = order;
  return arx(v, 0, ar, InitialCondition::drop).p.A;
}

}  // namespace

PolyModel iv4(const IdData& given, Index output, const Orders& wanted) {
  if (missing(given) > 0)
    throw Error(text(missing_text(given), "; instruments need every sample: d:fill(), or armax"));
  if (given.inputs() == 0) throw Error("the data has no input to make instruments of; take arx or armax");
  IdData d = given;
  d.y = given.y.col(output);
  d.y_names = {given.y_names[output]};
  PolyModel m = arx(d, 0, wanted, InitialCondition::drop);
  if (m.identifiability.rank < m.theta.size() || m.exact) return m;
  const auto instruments = [&](const Polynomials& p) {
    IdData z = d;
    z.y.col(0) = simulated(d, p);
    return z;
  };
  Estimate now = solve_instruments(d, instruments(m.p), m.orders);
  const Polynomials second = polynomials_of(now.theta, m.orders);
  const int order = m.orders.na + std::accumulate(m.orders.nb.begin(), m.orders.nb.end(), 0);
  const Vec L = noise_model(d, second, order);
  now = solve_instruments(filtered_data(d, L, Vec::Ones(1)),
                          filtered_data(instruments(second), L, Vec::Ones(1)), m.orders);
  m.theta = now.theta;
  m.covariance = now.covariance;
  m.std = now.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  m.p = polynomials_of(m.theta, m.orders);
  m.output = output;
  m.weighting = text("instrumental variables (four steps, noise model of order ", order, ")");
  const Regressor regressor(d, 0, m.orders, InitialCondition::drop);
  const Vec y = regressor.targets();
  const double variation = (y.array() - y.mean()).matrix().squaredNorm();
  m.quality = criteria((y - regressor.matrix() * m.theta).squaredNorm(), y.size(), m.theta.size(), variation);
  m.simulation.percent = simulation_fit(m, given, Seed::data);
  const char* consequence =
      "the estimate may then be biased, because inputs are its instruments; armax or arx are not";
  if (std::string line = feedback_warning(given, output, consequence); !line.empty())
    m.search.warnings.push_back(std::move(line));
  return m;
}

}  // namespace pendula::sysid
