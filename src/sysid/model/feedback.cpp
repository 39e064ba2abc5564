// Tests whether data were taken in closed loop. Residuals of a long ARX model are the innovations in any
// loop; in open loop they are uncorrelated with later inputs (Ljung, 2nd ed., §13.4). Inputs are whitened
// first, so that correlations at different lags are independent and N Σ r² has a χ² distribution.
#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "sysid/model/validation.hpp"

namespace pendula::sysid {
namespace {

// Choices: models this long whiten most signals; feedback acts within 25 samples.
constexpr int order = 10;  // of the models of y and of u
constexpr Index lags = 25;
constexpr double unpredictable = 0.05;  // of u: below it the innovations of u are too small to correlate with
constexpr Index rows_per_parameter = 10;

/// u(t) minus its prediction from past samples, 0 at the first ones. Empty if u is (nearly) predictable, like
/// a sine or a sweep, and therefore uninformative.
Vec innovations(Vec u) {
  u.array() -= u.mean();
  const Index rows = u.size() - order;
  Mat past(rows, order);
  for (Index k = 0; k < order; ++k) past.col(k) = u.segment(order - 1 - k, rows);
  constexpr double rounding = 1e-12;  // 4500 ε: keeps the normal equations of a sine positive definite
  const Mat gram = past.transpose() * past + rounding * past.squaredNorm() * Mat::Identity(order, order);
  const Vec e = u.tail(rows) - past * Vec(gram.llt().solve(Vec(past.transpose() * u.tail(rows))));
  if (!(e.norm() > unpredictable * u.norm())) return {};
  Vec out = Vec::Zero(u.size());
  out.tail(rows) = e;
  return out;
}

/// N Σ r(k)² of the correlations between residuals and inputs k = 1 … 25 samples later.
double statistic(const Response& r, const Vec& u) {
  double sum = 0, power = 0;
  for (Index k = 1; k <= lags; ++k) {
    double product = 0;
    for (Index i = 0; i < r.errors.size(); ++i)
      if (r.rows[i] + k < u.size()) product += r.errors[i] * u[r.rows[i] + k];
    sum += product * product;
  }
  for (Index i = 0; i < r.errors.size(); ++i) power += r.errors[i] * r.errors[i];
  return sum / (power * u.squaredNorm() / static_cast<double>(u.size() - order));
}

}  // namespace

std::string later_inputs_text(const Validation& v) {
  std::vector<std::string> counts;
  for (std::size_t i = 0; i < v.u_names.size(); ++i)
    counts.push_back(text(v.u_names[i], ": ", v.later_outside[i], " of ", v.lags, " correlations outside ±",
                          rounded(v.cross_bound[i], 3)));
  return join(counts, ", ");
}

std::string feedback_in(const IdData& d, Index output) {
  constexpr double chance = 1e-3;  // of a warning without feedback
  const IdData one = channel(d, output, false);
  const Index inputs = one.inputs(), parameters = order * (1 + inputs);
  if (inputs == 0 || one.experiments() > 1 || one.samples() < rows_per_parameter * parameters) return "";
  if (!one.y.allFinite() || !one.u.allFinite()) return "";
  Orders orders;
  orders.na = order;
  orders.nb.assign(static_cast<std::size_t>(inputs), order);
  orders.nk.assign(static_cast<std::size_t>(inputs), 1);
  orders.nf.assign(static_cast<std::size_t>(inputs), 0);
  try {
    IdModel m;
    m.inputs = inputs;
    m.outputs = {arx(one, 0, orders, InitialCondition::drop)};
    const Validation v = validate(m, 0, one);
    // residuals explained by past inputs indicate a model that is too small, not feedback
    if (v.bound == 0 || !v.white || !v.independent) return "";
    const Response r = predict(m, one, 1, Seed::data).front();
    std::vector<std::string> seen;
    for (Index i = 0; i < inputs; ++i) {
      const Vec u = innovations(one.u.col(i));
      if (u.size() == 0) continue;
      const double Q = statistic(r, u);
      if (chi_square_tail(Q, lags) < chance / static_cast<double>(inputs))
        seen.push_back(text(one.u_names[i], ": χ² = ", rounded(Q, 3), " on ", lags, " degrees of freedom"));
    }
    return join(seen, ", ");
  } catch (const UserFacing&) {
    return "";  // data that do not determine such a model do not allow the test
  }
}

std::string feedback_warning(const IdData& d, Index output, const std::string& consequence) {
  const std::string seen = feedback_in(d, output);
  if (seen.empty()) return "";
  return text("the data may have been taken in closed loop (", seen,
              " of residuals and later inputs): ", consequence);
}

}  // namespace pendula::sysid
