#include "sysid/model/model.hpp"

#include <cmath>
#include <limits>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "sysid/regression/structured.hpp"

namespace pendula::sysid {

Index Polynomials::memory() const {
  Index all = 0;  // degree of Π F_i
  for (const Vec& f : F) all += f.size() - 1;
  Index m = std::max(C.size() - 1, A.size() + D.size() - 2) + all;
  for (std::size_t i = 0; i < B.size(); ++i)
    m = std::max(m, D.size() + B[i].size() - 2 + all - (F[i].size() - 1));
  return m;
}

bool Polynomials::equation_error() const {
  bool plain = C.size() == 1 && D.size() == 1;
  for (const Vec& f : F) plain = plain && f.size() == 1;
  return plain;
}

Criteria criteria(double sse, Index rows, Index parameters, double y_variation) {
  const auto N = static_cast<double>(rows), d = static_cast<double>(parameters);
  Criteria c;
  c.sse = sse;
  c.rows = rows;
  c.parameters = parameters;
  c.loss = sse / N;
  c.sigma2 = rows > parameters ? sse / (N - d) : 0;
  c.fpe = rows > parameters ? c.loss * (1 + d / N) / (1 - d / N) : std::numeric_limits<double>::infinity();
  c.aic = N * std::log(c.loss) + 2 * d;
  c.bic = N * std::log(c.loss) + d * std::log(N);
  c.fit = 100 * (1 - std::sqrt(sse / y_variation));
  return c;
}

void check_horizon(Index horizon) {
  constexpr Index most = 100000;
  if (horizon < 0 || horizon > most)
    throw Error(text("horizon must lie between 1 and ", most, ", got ", horizon));
}

double fit_percent(const Vec& y, const Vec& e) {
  if (y.size() == 0) return 0;
  const double variation = (y.array() - y.mean()).matrix().norm();
  if (variation == 0) return e.norm() == 0 ? 100 : -std::numeric_limits<double>::infinity();
  return 100 * (1 - e.norm() / variation);
}

Polynomials polynomials_of(const Vec& theta, const Orders& o) {
  Polynomials p;
  Index at = 0;
  const auto monic = [&](int order) {
    Vec v(order + 1);
    v << 1, theta.segment(at, order);
    at += order;
    return v;
  };
  p.A = monic(o.na);
  for (std::size_t i = 0; i < o.nb.size(); ++i) {
    Vec b = Vec::Zero(std::max(1, o.nk[i] + o.nb[i]));
    b.tail(o.nb[i]) = theta.segment(at, o.nb[i]);
    at += o.nb[i];
    p.B.push_back(o.nb[i] ? b : Vec::Zero(1));
  }
  p.C = monic(o.nc);
  p.D = monic(o.nd);
  for (const int f : o.nf) p.F.push_back(monic(f));
  return p;
}

Vec parameters_of(const Polynomials& p, const Orders& o) {
  Vec theta(o.parameters());
  Index at = 0;
  const auto take = [&](const Vec& v, Index first, Index count) {
    theta.segment(at, count) = v.segment(first, count);
    at += count;
  };
  take(p.A, 1, o.na);
  for (std::size_t i = 0; i < o.nb.size(); ++i) take(p.B[i], p.B[i].size() - o.nb[i], o.nb[i]);
  take(p.C, 1, o.nc);
  take(p.D, 1, o.nd);
  for (std::size_t i = 0; i < o.nf.size(); ++i) take(p.F[i], 1, o.nf[i]);
  return theta;
}

std::vector<std::string> parameter_names(const Orders& o, const std::vector<std::string>& u_names) {
  std::vector<std::string> names;
  const auto of = [&](std::size_t i) { return u_names.size() > 1 ? "(" + u_names[i] + ")" : std::string(); };
  const auto add = [&](const char* letter, int first, int count, const std::string& suffix) {
    for (int k = 0; k < count; ++k) names.push_back(letter + std::to_string(first + k) + suffix);
  };
  add("a", 1, o.na, "");
  for (std::size_t i = 0; i < o.nb.size(); ++i) add("b", o.nk[i], o.nb[i], of(i));
  add("c", 1, o.nc, "");
  add("d", 1, o.nd, "");
  for (std::size_t i = 0; i < o.nf.size(); ++i) add("f", 1, o.nf[i], of(i));
  return names;
}

namespace {

/// Σ (y - ȳ)² over the used rows.
double variation(const Regressor& regressor) {
  double sum = 0, n = 0, square = 0;
  for (const RowRange& r : regressor.ranges())
    for (Index t = r.first; t < r.last; ++t) {
      sum += regressor.target()[t];
      n += 1;
    }
  for (const RowRange& r : regressor.ranges())
    for (Index t = r.first; t < r.last; ++t) {
      const double v = regressor.target()[t] - sum / n;
      square += v * v;
    }
  return square;
}

[[noreturn]] void no_rows(const IdData& d, const Orders& o, InitialCondition start) {
  const std::string gaps = missing_text(d);
  if (!gaps.empty())
    throw Error(text("no row is complete: ", gaps, ". Fill them with d:fill() or use smaller orders"));
  throw Error(text("no row is left: φ(t) needs ", o.memory(), " earlier samples and the data has ",
                   d.samples(),
                   start == InitialCondition::drop ? "; use smaller orders or ic = \"zero\"" : ""));
}

/// y(0), y(-1), …, y(1-na) for which the first na rows are exact, with u zero before the data; empty if θ
/// does not determine them (a_na = 0) or there are fewer rows.
Vec past_outputs(const IdData& d, const PolyModel& m) {
  const Index na = m.orders.na;
  const Polynomials& p = m.p;
  constexpr double none = 1e-8;  // about √ε: divided by such an a_na, outputs keep half of their digits
  if (na == 0 || d.samples() < na || std::abs(p.A[na]) < none * p.A.cwiseAbs().maxCoeff()) return {};
  // Row t = 0: y(t) + Σ a_i y(t-i) = Σ b u: unknown y(-1) … y(-na) enter row t through a_{t+1} … a_na.
  Mat T = Mat::Zero(na, na);
  Vec rhs(na);
  for (Index t = 0; t < na; ++t) {
    double sum = 0;
    for (Index i = 0; i <= na; ++i)
      if (t - i >= 0) sum -= p.A[i] * d.y(t - i, m.output);
    for (std::size_t k = 0; k < p.B.size(); ++k)
      for (Index i = 0; i < p.B[k].size() && i <= t; ++i)
        sum += p.B[k][i] * d.u(t - i, static_cast<Index>(k));
    rhs[t] = sum;
    for (Index i = t + 1; i <= na; ++i) T(t, i - t - 1) = p.A[i];
  }
  return T.colPivHouseholderQr().solve(rhs);
}

}  // namespace

PolyModel arx(const IdData& d, Index output, const Orders& wanted, InitialCondition start) {
  PolyModel m;
  m.orders = checked(wanted, d);
  if (m.orders.nc || m.orders.nd) throw Error("arx: nc and nd belong to armax and bj");
  for (int& f : m.orders.nf) f = 0;
  const Regressor regressor(d, output, m.orders, start);
  if (regressor.rows() == 0) no_rows(d, m.orders, start);
  const LeastSquares ls = solve_regression(regressor);
  if (!ls.theta.allFinite() || !std::isfinite(ls.sse))
    throw Failure("the sums of squares overflow: scale the data, for example to values near 1");
  m.kind = m.orders.na == 0 ? "FIR" : d.inputs() == 0 ? "AR" : "ARX";
  m.p = polynomials_of(ls.theta, m.orders);
  m.Ts = d.Ts;
  m.output = output;
  m.start = start;
  m.y_name = d.y_names[output];
  m.u_names = d.u_names;
  m.estimated = true;
  m.names = regressor.names();
  m.theta = ls.theta;
  m.identifiability.rank = ls.rank;
  m.identifiability.null_space = ls.null_space;
  m.exact = ls.exact();
  m.samples = d.samples();
  m.left_out = regressor.left_out();
  m.quality = criteria(ls.sse, ls.rows, ls.rank, variation(regressor));
  m.covariance = (m.exact ? 0 : m.quality.sigma2) * ls.inverse;
  m.std = standard_deviations(ls, m.covariance);
  m.identifiability.directions = free_directions(ls.null_space, m.names);
  if (ls.rank < regressor.columns()) m.identifiability.advice = why_not_identifiable(d, m, ls.rows);
  m.search.warnings = offsets_in(d, output);
  if (start == InitialCondition::estimate) m.initial_past = past_outputs(d, m);
  m.simulation.percent = std::numeric_limits<double>::quiet_NaN();
  const Seed seed = seed_of_estimation(m);
  m.simulation.start = seed_text(m, seed);
  if (!d.u.hasNaN() && d.samples() > m.p.memory()) m.simulation.percent = simulation_fit(m, d, seed);
  return m;
}

}  // namespace pendula::sysid
