#include "sysid/fit/pem.hpp"

#include <cmath>
#include <limits>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/search/least_squares.hpp"
#include "base/text.hpp"
#include "sysid/fit/bounded_search.hpp"
#include "sysid/model/kalman_errors.hpp"
#include "sysid/model/validation.hpp"

namespace pendula::sysid {
namespace {

const Vec one = Vec::Ones(1);

/// Sets column `to` of J to the signal delayed by k.
void put_delayed(Eigen::Ref<Vec> to, const Vec& x, Index k, double sign) {
  const Index n = x.size(), lag = std::min(k, n);
  to.head(lag).setZero();
  to.tail(n - lag) = sign * x.head(n - lag);
}

/// The responses to initial states: impulses in rows 0 … count-1 filtered by 1/P, in as many of n rows as
/// they are visible.
Mat start_responses(const Vec& P, Index n, Index count) {
  const Vec g = ringing(P, one, n);
  Index last = n - 1;
  const double negligible = negligible_tail * g.cwiseAbs().maxCoeff();
  while (last > 0 && std::abs(g[last]) <= negligible) --last;
  Mat Z(std::min(n, last + 1 + count), count);
  for (Index j = 0; j < count; ++j) put_delayed(Z.col(j), g.head(Z.rows()), j, 1);
  return Z;
}

/// The data of one experiment.
struct Part {
  Vec y;
  std::vector<Vec> u;
};

class Evaluator {
 public:
  Evaluator(const Part& part, const Orders& orders, const Polynomials& p, InitialCondition start)
      : part_(part), orders_(orders), p_(p), start_(start) {}

  void run(Eigen::Ref<Vec> e, Mat* J, Index first, Index& free_start, Index& skipped) {
    const Index n = part_.y.size();
    v_ = filtered(p_.A, one, part_.y);
    Vec F = one;
    for (std::size_t i = 0; i < part_.u.size(); ++i) {
      w_.push_back(filtered(p_.B[i], p_.F[i], part_.u[i]));
      v_ -= w_.back();
      if (p_.F[i].size() > 1) F = convolve(F, p_.F[i]);
    }
    e_ = filtered(p_.D, p_.C, v_);
    const Index memory = std::min(p_.memory(), n);
    skipped = start_ == InitialCondition::drop ? memory : 0;
    if (start_ == InitialCondition::estimate && memory > 0) {
      Z_ = start_responses(convolve(p_.C, F), n, memory);
      qr_.compute(Z_);
      free_start = memory;
      added_ = -(Z_ * Vec(qr_.solve(Vec(e_.head(Z_.rows())))));
      e_.head(Z_.rows()) += added_;
    }
    if (J) gradient(*J, first);
    e = e_;
    e.head(skipped).setZero();
    if (J) J->middleRows(first, skipped).setZero();
  }

 private:
  void gradient(Mat& J, Index first) {
    const Index n = part_.y.size();
    Index column = 0;
    const auto put = [&](const Vec& x, Index from, Index count, double sign) {
      for (Index k = 0; k < count; ++k) put_delayed(J.col(column++).segment(first, n), x, from + k, sign);
    };
    if (orders_.na) put(filtered(p_.D, p_.C, part_.y), 1, orders_.na, 1);
    for (std::size_t i = 0; i < part_.u.size(); ++i)
      if (orders_.nb[i])
        put(filtered(p_.D, convolve(p_.C, p_.F[i]), part_.u[i]), orders_.nk[i], orders_.nb[i], -1);
    if (orders_.nc) put(filtered(one, p_.C, e_), 1, orders_.nc, -1);
    if (orders_.nd) put(filtered(one, p_.C, v_), 1, orders_.nd, 1);
    for (std::size_t i = 0; i < part_.u.size(); ++i) {
      if (orders_.nf[i] == 0) continue;
      Vec g = filtered(p_.D, convolve(p_.C, p_.F[i]), w_[i]);
      if (added_.size()) g -= ringing(p_.F[i], added_, n);
      put(g, 1, orders_.nf[i], 1);
    }
    if (Z_.size() == 0) return;
    // P⊥ J, by a thin orthonormal basis of Z.
    const Mat Q = thin_q(qr_.householderQ(), Z_.cols());
    const auto rows = J.middleRows(first, Z_.rows());
    const Mat share = Q.transpose() * rows;
    J.middleRows(first, Z_.rows()).noalias() -= Q * share;
  }

  const Part& part_;
  const Orders& orders_;
  const Polynomials& p_;
  InitialCondition start_;
  Vec v_, e_, added_;
  std::vector<Vec> w_;
  Mat Z_;
  Eigen::HouseholderQR<Mat> qr_;
};

std::vector<Part> parts_of(const IdData& d, Index output) {
  std::vector<Part> parts;
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index from = d.starts[k], n = d.end(k) - from;
    Part part{d.y.col(output).segment(from, n), {}};
    for (Index i = 0; i < d.inputs(); ++i) part.u.emplace_back(d.u.col(i).segment(from, n));
    parts.push_back(std::move(part));
  }
  return parts;
}

/// Replaces zeros of C and F outside the unit circle by their mirror images 1/z̄, which preserves the
/// spectrum of C e up to a factor (Ljung §10.2, (10.63)). False if a polynomial is not finite.
bool make_admissible(Vec& theta, const Orders& orders) {
  if (!theta.allFinite()) return false;
  Polynomials p = polynomials_of(theta, orders);
  if (admissible(p)) return true;
  p.C = reflected(p.C);
  for (Vec& f : p.F) f = reflected(f);
  theta = parameters_of(p, orders);
  return admissible(p);
}

PredictionErrors evaluate(const std::vector<Part>& parts, const Orders& orders, const Vec& theta,
                          InitialCondition start, bool gradient) {
  const Polynomials p = polynomials_of(theta, orders);
  PredictionErrors out;
  Index total = 0;
  for (const Part& part : parts) total += part.y.size();
  out.e.resize(total);
  if (gradient) out.J.resize(total, theta.size());
  Index first = 0;
  for (const Part& part : parts) {
    poll_interrupt();
    Index free_start = 0, skipped = 0;
    const Index n = part.y.size();
    Evaluator(part, orders, p, start)
        .run(out.e.segment(first, n), gradient ? &out.J : nullptr, first, free_start, skipped);
    out.free_start += free_start;
    out.rows += n - skipped;
    first += n;
  }
  return out;
}

/// ε and its gradient if samples of y are missing: the whitened errors of the Kalman filter, scaled so that
/// their sum of squares is the likelihood with eliminated variance.
PredictionErrors evaluate_with_gaps(const std::vector<Part>& parts, const Orders& orders, const Vec& theta,
                                    InitialCondition start) {
  double unit = 1;
  const auto errors = [&](const Vec& at) {
    PolyModel m;
    m.p = polynomials_of(at, orders);
    if (!admissible(m.p)) return Vec(Vec::Constant(1, std::numeric_limits<double>::quiet_NaN()));
    const StateSpaceModel model = innovations_form(m);
    Vec all(0);
    double log_det = 0;
    for (const Part& part : parts) {
      IdData d;
      d.y = part.y;
      d.u.resize(part.y.size(), static_cast<Index>(part.u.size()));
      for (Index i = 0; i < d.u.cols(); ++i) d.u.col(i) = part.u[i];
      const KalmanErrors e =
          kalman_errors(model, Mat::Ones(1, 1), d,
                        start == InitialCondition::zero ? FirstState::zero : FirstState::estimated);
      all.conservativeResize(all.size() + e.whitened.size());
      all.tail(e.whitened.size()) = e.whitened;
      log_det += e.log_det;
    }
    unit = std::exp(log_det / (2 * static_cast<double>(all.size())));
    return Vec(unit * all);
  };
  PredictionErrors out;
  out.e = errors(theta);
  out.unit = unit;
  // of parameters that are nearly 0; coefficients of monic polynomials are about 1
  constexpr double size = 0.1;
  out.J = difference_jacobian(errors, theta, Vec::Constant(theta.size(), size), {});
  out.rows = out.e.size();
  if (start != InitialCondition::zero)
    out.free_start = polynomials_of(theta, orders).memory() * static_cast<Index>(parts.size());
  return out;
}

/// The search for one minimum. Keeps the last evaluation, which usually is the one at the minimum.
class Search {
 public:
  Search(const std::vector<Part>& parts, const Orders& orders, const PemOptions& o, bool gaps)
      : parts_(parts), orders_(orders), o_(o), gaps_(gaps) {}

  /// Runs from `start` if the loss is finite there; ends with Ending::known within 0.1 % of `known`.
  std::optional<Minimum> run(const Vec& start, const Vec& known) {
    const auto loss = [&](Vec& theta) -> std::optional<QuadraticModel> {
      if (!make_admissible(theta, orders_)) return {};
      const PredictionErrors& at = errors(theta);
      return gauss_newton_model(at.J, at.e);
    };
    Vec begin = start;
    const auto first = loss(begin);
    if (!first || !std::isfinite(first->value) || !first->R.allFinite()) return {};
    MinimiserOptions options;
    options.iterations = o_.iterations;
    if (gaps_) {  // J by differences
      options.noise = difference_noise;
      options.accuracy = difference_accuracy;
    }
    constexpr double nearby = 1e-3;  // relative: a search that comes so near is not a new minimum
    options.is_known = [&](const Vec& theta, const Vec& scale) {
      return known.size() == theta.size() &&
             (theta - known).cwiseProduct(scale).norm() < nearby * known.cwiseProduct(scale).norm();
    };
    return minimise(loss, begin, options);
  }

  PredictionErrors& errors(const Vec& theta) {
    if (last_.size() != theta.size() || last_ != theta) {
      at_ = gaps_ ? evaluate_with_gaps(parts_, orders_, theta, o_.start)
                  : evaluate(parts_, orders_, theta, o_.start, true);
      last_ = theta;
    }
    return at_;
  }

 private:
  const std::vector<Part>& parts_;
  const Orders& orders_;
  const PemOptions& o_;
  bool gaps_;
  Vec last_;
  PredictionErrors at_;
};

/// Does the polynomial have a zero on the unit circle, or beyond 1 - 1e-4?
bool reaches_circle(Vec p) {
  constexpr double radius = 1 - 1e-4;  // a zero there decays in 10⁴ samples
  for (Index k = 1; k < p.size(); ++k) p[k] *= std::pow(radius, -static_cast<double>(k));
  return !stable(p);
}

std::vector<std::string> warnings(const PolyModel& m) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < m.p.F.size(); ++i)
    if (reaches_circle(m.p.F[i]))
      out.push_back(text("the search ended with a zero of F on the unit circle; if ", m.u_names[i], " → ",
                         m.y_name, " is unstable or integrates, use arx or armax, whose A may be unstable"));
  if (reaches_circle(m.p.C))
    out.push_back(
        m.start == InitialCondition::estimate
            ? "the search ended with a zero of C on the unit circle: the values before the first sample then "
              "explain a part of the noise that never decays; lower nc, or take ic = \"drop\""
            : "the search ended with a zero of C on the unit circle: lower nc, or give other orders");
  return out;
}

/// A start of the search with its result.
struct Attempt {
  std::string start;
  double value;  ///< ½ Σ ε²
  bool known;    ///< reached a minimum found from another start
};

/// "a minimum (slope 2e-10), from the start of Steiglitz and McBride; 2 other starts converge to it".
std::string verdict(const PolyModel& m, const Minimum& best, const std::vector<Attempt>& attempts) {
  if (m.exact) return "the errors are rounding errors only";
  std::string out = !m.search.warnings.empty()
                        ? "no minimum: the loss falls up to the boundary of stable predictors"
                    : !best.converged() ? "no minimum: " + ending_text(best)
                                        : "a minimum";
  out += best.angle < 1e-6 ? " (slope < 1e-6)" : text(" (slope ", rounded(best.angle, 1), ")");
  std::size_t same = 0;
  std::vector<std::string> higher;
  const Attempt* from = nullptr;
  for (const Attempt& a : attempts) {
    constexpr double one_minimum = 1e-6;  // relative: searches know the loss to 10⁻¹² (see minimise)
    if (a.known || a.value <= best.value * (1 + one_minimum)) {
      if (!from && !a.known)
        from = &a;
      else
        ++same;
    } else {
      higher.push_back(
          text(a.start, ": V = ", rounded(2 * a.value / static_cast<double>(m.quality.rows), 4)));
    }
  }
  if (from) out += ", from the start: " + from->start;
  if (same > 0)
    out += text("; ", same, same == 1 ? " other start converges" : " other starts converge", " to it");
  if (!higher.empty()) out += text("; higher from ", join(higher, ", "));
  return out;
}

/// Without noise C and D are undetermined, since their columns of J are rounding; sets them to 1.
void forget_noise(PolyModel& m, Mat& J) {
  Index at = m.orders.na;
  for (const int b : m.orders.nb) at += b;
  const Index count = m.orders.nc + m.orders.nd;
  J.middleCols(at, count).setZero();
  m.theta.segment(at, count).setZero();
  m.p = polynomials_of(m.theta, m.orders);
}

void complete(PolyModel& m, const IdData& d, PredictionErrors& at) {
  const Vec y = d.y.col(m.output).array().isNaN().select(0, d.y.col(m.output));
  const double sse = at.e.squaredNorm();
  // 4500 ε √d, since filters amplify rounding: without noise an OE model with poles at 0.95 ± 0.06i and 0.98
  // left 6e-13 of y (5000 samples)
  constexpr double rounding = 1e-12;
  m.exact = std::sqrt(sse) <= rounding * std::sqrt(static_cast<double>(m.theta.size())) * y.norm();
  if (m.exact) forget_noise(m, at.J);
  const LeastSquares ls = solve_triangular(pendula::triangular_factor(at.J, -at.e).R(), at.rows);
  m.identifiability.rank = ls.rank;
  m.identifiability.null_space = ls.null_space;
  m.identifiability.directions = free_directions(ls.null_space, m.names, InParameters::nonlinear);
  m.quality = criteria(sse, at.rows, ls.rank, compared_variation(d, m));
  const Index left = at.rows - ls.rank - at.free_start;
  m.quality.sigma2 = left > 0 ? sse / static_cast<double>(left) : 0;
  m.covariance = (m.exact ? 0 : m.quality.sigma2) * ls.inverse;
  m.std = standard_deviations(ls, m.covariance);
  if (ls.rank < m.theta.size() - m.orders.nc - m.orders.nd && m.exact)
    m.identifiability.advice = {
        "the data follow a model of lower order exactly: common factors are free; lower the orders"};
  else if (ls.rank < m.theta.size() && m.exact)
    m.identifiability.advice = {"there is no noise in the data from which C and D could be found"};
  else if (ls.rank < m.theta.size())
    m.identifiability.advice = {
        "the gradient does not separate these parameters: lower the orders, or excite the input more"};
  if (at.unit != 1) {
    const double sigma2 = m.quality.sigma2 / (at.unit * at.unit);
    m.quality = criteria(sse / (at.unit * at.unit), at.rows, ls.rank, compared_variation(d, m));
    m.quality.sigma2 = sigma2;
    m.quality.fit = predict(m, d, 1, Seed::estimate).fit;
  }
  const Seed seed = seed_of_estimation(m);
  m.simulation.start = seed_text(m, seed);
  m.simulation.percent = simulation_fit(m, d, seed);
}

}  // namespace

PredictionErrors prediction_errors(const IdData& d, Index output, const Orders& orders, const Vec& theta,
                                   InitialCondition start, bool gradient) {
  return evaluate(parts_of(d, output), orders, theta, start, gradient);
}

double compared_variation(const IdData& d, const PolyModel& m) {
  std::vector<double> kept;
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index skipped = m.start == InitialCondition::drop ? m.p.memory() : 0;
    for (Index t = std::min(d.starts[k] + skipped, d.end(k)); t < d.end(k); ++t)
      if (!std::isnan(d.y(t, m.output))) kept.push_back(d.y(t, m.output));
  }
  const auto y = Eigen::Map<const Vec>(kept.data(), static_cast<Index>(kept.size()));
  return kept.empty() ? 0 : (y.array() - y.mean()).matrix().squaredNorm();
}

PolyModel pem(const IdData& d, Index output, const Orders& wanted, const std::string& kind,
              const PemOptions& options) {
  const Orders orders = checked(wanted, d);
  require_inputs(d);
  const bool gaps = d.y.col(output).hasNaN();
  for (std::size_t i = 0; i < orders.nb.size(); ++i)
    if (orders.nb[i] == 0 && orders.nf[i] > 0)
      throw Error(text("nf without nb: input ", d.u_names[i], " has no numerator; give nb ≥ 1"));
  if (d.samples() <= 2 * orders.parameters())
    throw Error(text(d.samples(), " samples are too few for ", orders.parameters(),
                     " parameters of a nonlinear problem"));
  const std::vector<Part> parts = parts_of(d, output);
  std::vector<StartingValues> starts;
  if (options.theta)
    starts = {{*options.theta, "the given one"}};
  else
    starts = starting_values(gaps ? fill(d, Filling::linear) : d, output, orders);
  Search search(parts, orders, options, gaps);
  std::optional<Minimum> best;
  std::vector<Attempt> attempts;
  for (const auto& [start, name] : starts) {
    if (start.size() != orders.parameters())
      throw Error(text("start: expected ", orders.parameters(), " numbers (",
                       join(parameter_names(orders, d.u_names), ", "), "), got ", start.size()));
    for (Index i = 0; options.theta && i < start.size(); ++i)
      if (!std::isfinite(start[i])) throw Error(text("start: entry ", i + 1, " is not a finite number"));
    if (!start.allFinite()) continue;
    if (options.theta && !admissible(polynomials_of(start, orders)))
      throw Error("start: C and F must be stable (zeros inside the unit circle)");
    auto m = search.run(start, best ? best->theta : Vec());
    if (!m) continue;
    attempts.push_back({name, m->value, m->ending == Ending::known});
    if (m->ending != Ending::known && (!best || m->value < best->value)) best = std::move(m);
  }
  if (!best)
    throw Failure(
        "the sums of squares overflow at every start: scale the data, for example to values near 1");
  PolyModel m;
  m.kind = kind;
  m.orders = orders;
  m.theta = best->theta;
  m.output = output;
  m.p = polynomials_of(best->theta, orders);
  m.Ts = d.Ts;
  m.start = options.start;
  m.samples = d.samples();
  m.y_name = d.y_names[output];
  m.u_names = d.u_names;
  m.estimated = true;
  m.names = parameter_names(orders, d.u_names);
  m.search.iterations = std::max(1, best->iterations);
  const std::string ending = ending_text(*best);
  m.search.method = text(gaps ? "Gauss–Newton on the measured samples (" : "Gauss–Newton (",
                         m.search.iterations, m.search.iterations == 1 ? " iteration" : " iterations",
                         ending.empty() ? ")" : "; " + ending + ")");
  complete(m, d, search.errors(best->theta));
  m.search.warnings = warnings(m);
  m.search.angle = m.exact ? 0 : best->angle;
  m.search.settled = best->converged() && m.search.warnings.empty();
  m.search.verdict = verdict(m, *best, attempts);
  for (std::string& line : offsets_in(d, output)) m.search.warnings.push_back(std::move(line));
  const bool output_error = m.p.A.size() + m.p.C.size() + m.p.D.size() == 3;
  const char* consequence =
      "B and F may then be biased, because the noise is taken as white; arx, armax or bj are not";
  if (std::string line = output_error && !m.exact ? feedback_warning(d, output, consequence) : "";
      !line.empty())
    m.search.warnings.push_back(std::move(line));
  return m;
}

}  // namespace pendula::sysid
