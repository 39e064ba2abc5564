#include "sysid/model/validation.hpp"

#include <cmath>
#include <limits>

#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "sysid/model/state_space.hpp"

namespace pendula::sysid {
namespace {

constexpr double significance = 0.01;         // of all tests
constexpr double level = 2.5758293035489004;  // 99 % quantile of |x| for the standard normal distribution

double correlation(const Vec& a, const Vec& b, Index lag) {  // Σ a(t) b(t - lag), unnormalised
  const Index n = a.size() - std::abs(lag);
  return lag >= 0 ? a.tail(n).dot(b.head(n)) : a.head(n).dot(b.tail(n));
}

/// Errors for all samples from the first compared one (0 if missing), with indicators of availability.
struct Series {
  Vec e, there;
};
Series series(const Response& r) {
  if (r.rows.empty()) return {};
  const Index first = r.rows.front();
  const Index size = r.rows.back() - first + 1;
  Series out{Vec::Zero(size), Vec::Zero(size)};
  const double mean = r.errors.mean();
  for (Index i = 0; i < r.errors.size(); ++i) {
    const Index t = r.rows[i] - first;
    out.e[t] = r.errors[i] - mean;
    out.there[t] = 1;
  }
  return out;
}

/// The smallest q with P(X > q) < 1 % for X ~ binomial(n, 0.01).
int chance(Index n) {
  double term = std::pow(1 - significance, static_cast<double>(n)), sum = term;
  int q = 0;
  while (sum < 1 - significance && q < n) {
    ++q;
    term *= static_cast<double>(n - q + 1) / q * significance / (1 - significance);
    sum += term;
  }
  return q;
}

}  // namespace

double chi_square_tail(double x, double dof) {
  if (!(x > 0)) return 1;
  const double a = dof / 2, z = x / 2;
  // terms: both expansions take some √a of them at z = a, i.e. 10⁸ degrees of freedom
  constexpr int most = 10000;
  const double front = std::exp(a * std::log(z) - z - std::lgamma(a));
  if (z < a + 1) {  // series for the lower part
    double term = 1 / a, sum = term;
    for (int k = 1; k < most && term > eps / 16 * sum; ++k) sum += term *= z / (a + k);
    return std::max(0.0, 1 - front * sum);
  }
  double b = z + 1 - a, c = 1 / least_size, d = 1 / b, h = d;  // continued fraction by Lentz; c begins at ∞
  for (int k = 1; k < most; ++k) {
    const double an = -k * (k - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    h *= d * c;
    if (d * c == 1) break;
  }
  return front * h;
}

namespace {

/// The number of noise-model parameters of an output, by which the portmanteau test reduces its
/// degrees of freedom.
Index noise_parameters(const IdModel& m, const PolyModel& row) {
  if (m.state_space) return m.state_space->K.isZero(0) ? 0 : m.state_space->order();
  return row.p.A.size() + row.p.C.size() + row.p.D.size() - 3;
}

/// The result for residuals that are rounding errors: nothing to test.
void reproduce_exactly(Validation& v, Index inputs) {
  v.autocorrelation = Vec::Zero(v.lags);
  v.cross = Mat::Zero(2 * v.lags + 1, inputs);
  v.cross_bound = Vec::Zero(inputs);
  v.cross_outside.assign(static_cast<std::size_t>(inputs), 0);
  v.white = v.independent = true;
  v.p = 1;
}

/// The autocorrelation of e and the Ljung–Box test; `there`: 1 for existing residuals, 0 in gaps.
void test_whiteness(Validation& v, const Vec& e, const Vec* there, Index noise_parameters) {
  const auto N = static_cast<double>(v.rows);
  const double power = e.squaredNorm();
  v.autocorrelation.resize(v.lags);
  v.bound = level / std::sqrt(N);
  v.allowed = chance(v.lags);
  for (Index k = 1; k <= v.lags; ++k) {
    double r = correlation(e, e, k) / power;
    // with fewer pairs: scaled to variance 1/N
    if (there) r *= std::sqrt((N - static_cast<double>(k)) / std::max(1.0, correlation(*there, *there, k)));
    v.autocorrelation[k - 1] = r;
    v.Q += N * (N + 2) * r * r / (N - static_cast<double>(k));
    if (std::abs(r) > v.bound) ++v.outside;
  }
  v.dof = static_cast<double>(std::max<Index>(1, v.lags - noise_parameters));
  v.p = chi_square_tail(v.Q, v.dof);
  v.white = v.p >= significance;
}

/// The correlations of e with every input, including later values (feedback).
void test_inputs(Validation& v, const Vec& e, const Mat& inputs) {
  const auto N = static_cast<double>(v.rows);
  v.cross.resize(2 * v.lags + 1, inputs.cols());
  v.cross_bound.resize(inputs.cols());
  v.independent = true;
  for (Index i = 0; i < inputs.cols(); ++i) {
    Vec u = inputs.col(i);
    u.array() -= u.mean();
    const double size = u.norm() * e.norm();
    double P = 1;
    if (size > 0)
      for (Index k = 1; k <= v.lags; ++k)
        P += 2 * v.autocorrelation[k - 1] * correlation(u, u, k) / u.squaredNorm();
    constexpr double least = 0.1;  // the estimate of the sum P > 0 may be negative, and 1 for white e or u
    v.cross_bound[i] = level * std::sqrt(std::max(P, least) / N);
    int count = 0, back = 0;
    for (Index k = -v.lags; k <= v.lags; ++k) {
      const double r = size > 0 ? correlation(e, u, k) / size : 0;
      v.cross(k + v.lags, i) = r;
      if (std::abs(r) > v.cross_bound[i]) ++(k >= 0 ? count : back);
    }
    v.cross_outside.push_back(count);
    v.later_outside.push_back(back);
    v.independent = v.independent && count <= chance(v.lags + 1);
    v.feedback = v.feedback || back > chance(v.lags);
  }
}

}  // namespace

Validation validate(const IdModel& model, Index output, const IdData& data, std::optional<Index> lags) {
  Validation v;
  const auto index = static_cast<std::size_t>(output);
  const PolyModel& m = model.outputs[index];
  const IdData d = channel(data, output, model.coupled);
  const bool equation = !model.state_space && m.p.equation_error();
  const Seed seed = equation ? Seed::data : Seed::estimate;
  const Response one = predict(model, data, 1, seed)[index];
  v.y_name = m.y_name;
  v.u_names = d.u_names;
  v.state_space = model.state_space != nullptr;
  v.rows = one.errors.size();
  // correlations at lag k are sums of rows - k products, at least 4; without `lags` at least three quarters
  constexpr Index least_products = 4, usual_lags = 25, least_rows = 2 * least_products;
  if (v.rows < least_rows)
    throw Error(text("validation needs at least ", least_rows, " residuals, the data give ", v.rows));
  v.lags = lags.value_or(std::min<Index>(usual_lags, v.rows / 4));
  if (v.lags > v.rows - least_products)
    throw Error(text("lags = ", v.lags, " is too many for ", v.rows, " residuals; give at most ",
                     v.rows - least_products));
  v.fit = one.fit;
  v.residuals = one.errors;
  try {
    v.simulation_fit = predict(model, data, 0, seed)[index].fit;
  } catch (const Failure&) {
    v.simulation_fit = -std::numeric_limits<double>::infinity();
  }
  v.fit_label = seed_text(m, seed);
  const auto [e, there] = series(one);
  const bool gaps = e.size() != one.errors.size();
  const double power = e.squaredNorm();
  constexpr double rounding = 1e-13;  // of y: 450 ε
  if (power <= rounding * rounding * one.compared.squaredNorm()) {
    reproduce_exactly(v, d.inputs());
    return v;
  }
  test_whiteness(v, e, gaps ? &there : nullptr, noise_parameters(model, m));
  for (Index i = 0; i < d.inputs(); ++i)
    v.direct.push_back(model.state_space ? model.state_space->feedthrough : m.p.B[i][0] != 0);
  test_inputs(v, e, d.u.middleRows(one.rows.front(), e.size()));
  return v;
}

namespace {

/// "; the largest is -0.81 at lag 0", if one exceeds the bound.
std::string strongest(const Validation& v, std::size_t input) {
  const auto i = static_cast<Index>(input);
  Index at = 0;
  const Vec forward = v.cross.col(i).tail(v.lags + 1);
  const double size = forward.cwiseAbs().maxCoeff(&at);
  if (!(size > v.cross_bound[i])) return "";
  return text("; the largest is ", rounded(forward[at], 2), " at lag ", at);
}

/// A remark on a correlation at lag 0 for models whose inputs act with a delay.
std::string without_delay(const Validation& v) {
  std::string out;
  for (std::size_t i = 0; i < v.u_names.size(); ++i)
    if (const double r = v.cross(v.lags, static_cast<Index>(i));
        !v.direct[i] && std::abs(r) > v.cross_bound[i])
      out += text("  ", v.u_names[i], " acts on ", v.y_name, " within the sample (correlation ",
                  rounded(r, 2), " at lag 0): take ", v.state_space ? "feedthrough = true" : "nk = 0",
                  ", or there is a feedback without delay\n");
  return out;
}

std::string feedback_remark(const Validation& v) {
  return text("  residuals and later inputs are correlated (", later_inputs_text(v),
              "): the data may have been taken in closed loop\n");
}

}  // namespace

std::string describe(const Validation& v) {
  std::string out = text("validation of ", v.y_name, " on ", v.rows, " samples\n");
  out += text("  fit: ", rounded(v.fit, 6), " % (1-step prediction), ",
              std::isfinite(v.simulation_fit) ? rounded(v.simulation_fit, 6) + " %" : std::string("diverges"),
              " (simulation, ", v.fit_label, ")\n");
  if (v.bound == 0) return out + "  the residuals are rounding errors only: there is nothing to test";
  out += text("  residuals ", v.white ? "are white" : "are not white", ": Ljung–Box Q = ", rounded(v.Q, 5),
              " on ", rounded(v.dof, 5), " degrees of freedom, p ",
              v.p < 1e-10 ? "< 1e-10" : "= " + rounded(v.p, 3), "; ", v.outside, " of ", v.lags,
              " autocorrelations outside ±", rounded(v.bound, 3), " (99 %)\n");
  for (std::size_t i = 0; i < v.u_names.size(); ++i)
    out += text("  ", v.cross_outside[i] <= v.allowed ? "no dependence" : "dependence", " on past ",
                v.u_names[i], ": ", v.cross_outside[i], " of ", v.lags + 1, " correlations outside ±",
                rounded(v.cross_bound[i], 3), strongest(v, i), "\n");
  if (!v.white)
    out += text("  structure is left in the residuals: raise ",
                v.state_space ? "the order\n" : "nc, nd (or na), or use bj\n");
  if (!v.independent)
    out += text("  the input explains more than the model uses: raise ",
                v.state_space ? "the order\n" : "nb, nf, or lower nk\n");
  out += without_delay(v);
  if (v.feedback) out += feedback_remark(v);
  out.pop_back();
  return out;
}

std::vector<ComparisonRow> compare(const std::vector<std::pair<std::string, const IdModel*>>& models,
                                   const IdData& d) {
  std::vector<ComparisonRow> rows;
  for (const auto& [name, model] : models) {
    ComparisonRow row;
    row.name = name;
    const auto one = predict(*model, d, 1, Seed::estimate);
    const Seed seed = model->coupled ? Seed::data : Seed::estimate;
    std::vector<Response> free;
    try {
      free = predict(*model, d, 0, seed);
    } catch (const Failure&) {
    }
    row.predictions.resize(d.outputs());
    row.simulations.resize(d.outputs());
    for (std::size_t i = 0; i < one.size(); ++i) {
      row.predictions[i] = one[i].fit;
      row.simulations[i] = free.empty() ? -std::numeric_limits<double>::infinity() : free[i].fit;
      row.prediction += one[i].fit / static_cast<double>(one.size());
      row.simulation += free.empty() ? -std::numeric_limits<double>::infinity()
                                     : free[i].fit / static_cast<double>(one.size());
      row.loss += one[i].errors.squaredNorm() / static_cast<double>(one[i].errors.size());
      if (!model->state_space) row.parameters += model->outputs[i].theta.size();
      const bool exact = model->outputs[i].exact;  // these criteria would be those of rounding errors
      row.fpe += exact ? std::numeric_limits<double>::quiet_NaN() : model->outputs[i].quality.fpe;
      row.aic += exact ? std::numeric_limits<double>::quiet_NaN() : model->outputs[i].quality.aic;
    }
    if (model->state_space) row.parameters = model->state_space->parameters();
    rows.push_back(row);
  }
  return rows;
}

namespace {

std::string fits(const Vec& by_output) {
  std::vector<std::string> words;
  for (const double v : by_output)
    words.push_back(std::isfinite(v) ? rounded(v, 5) : std::string("diverges"));
  return join(words, ", ");
}

}  // namespace

std::string describe(const std::vector<ComparisonRow>& rows, const IdData& d) {
  Table table({false, true, true, true, true, true});
  table.row({"model", "parameters", "1-step fit %", "simulation fit %", "FPE", "AIC"});
  std::size_t best = 0, free = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].prediction > rows[best].prediction) best = i;
    if (rows[i].simulation > rows[free].simulation) free = i;
    table.row({rows[i].name, std::to_string(rows[i].parameters), fits(rows[i].predictions),
               fits(rows[i].simulations), std::isnan(rows[i].fpe) ? "–" : rounded(rows[i].fpe, 6),
               std::isnan(rows[i].aic) ? "–" : rounded(rows[i].aic, 6)});
  }
  return text("comparison on ", d.samples(),
              " samples (initial states estimated; FPE and AIC from the estimation data",
              d.outputs() > 1 ? "; fits of " + join(d.y_names, ", ") : "", ")\n", table.str(2),
              "  best prediction: ", rows[best].name, ", best simulation: ", rows[free].name);
}

}  // namespace pendula::sysid
