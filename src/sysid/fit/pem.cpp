#include "sysid/fit/pem.hpp"

#include <cmath>
#include <limits>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"

namespace pendula::sysid {
namespace {

const Vec one = Vec::Ones(1);

/// Column `to` of J: the signal delayed by k.
void put_delayed(Eigen::Ref<Vec> to, const Vec& x, Index k, double sign) {
  const Index n = x.size(), lag = std::min(k, n);
  to.head(lag).setZero();
  to.tail(n - lag) = sign * x.head(n - lag);
}

/// The initial-state responses: impulses in rows 0 … count-1 through 1/P; as many of n rows as they last.
Mat start_responses(const Vec& P, Index n, Index count) {
  const Vec g = ringing(P, one, n);
  Index last = n - 1;
  const double negligible = 1e-18 * g.cwiseAbs().maxCoeff();
  while (last > 0 && std::abs(g[last]) <= negligible) --last;
  Mat Z(std::min(n, last + 1 + count), count);
  for (Index j = 0; j < count; ++j) put_delayed(Z.col(j), g.head(Z.rows()), j, 1);
  return Z;
}

/// One experiment.
struct Part {
  Vec y;
  std::vector<Vec> u;
};

class Evaluator {
 public:
  Evaluator(const Part& part, const Orders& orders, const Polynomials& p, Start start)
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
    skipped = start_ == Start::drop ? memory : 0;
    if (start_ == Start::estimate && memory > 0) {
      Z_ = start_responses(convolve(p_.C, F), n, memory);
      qr_.compute(Z_);
      free_start = memory;
      added_ = -(Z_ * qr_.solve(e_.head(Z_.rows())));
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
    const Mat Q = qr_.householderQ() * Mat::Identity(Z_.rows(), Z_.cols());
    const auto rows = J.middleRows(first, Z_.rows());
    const Mat share = Q.transpose() * rows;
    J.middleRows(first, Z_.rows()).noalias() -= Q * share;
  }

  const Part& part_;
  const Orders& orders_;
  const Polynomials& p_;
  Start start_;
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

bool admissible(const Polynomials& p) {
  bool good = stable(p.C);
  for (const Vec& f : p.F) good = good && stable(f);
  return good;
}

PredictionErrors evaluate(const std::vector<Part>& parts, const Orders& orders, const Vec& theta, Start start,
                          bool gradient) {
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
    out.free_start += free_start, out.rows += n - skipped;
    first += n;
  }
  return out;
}

struct Search {
  Vec theta;
  PredictionErrors at;
  double sse = std::numeric_limits<double>::infinity();
  int iterations = 0;
  std::string end;
};

/// Gauss–Newton with damping λ diag(JᵀJ) when the full step does not help or leaves the stable region. Gives
/// up with an infinite loss when it comes within 0.1 % of a minimum that is already known.
Search minimise(const std::vector<Part>& parts, const Orders& orders, Vec theta, const PemOptions& o,
                const Vec& known) {
  Search s;
  s.theta = std::move(theta);
  s.at = evaluate(parts, orders, s.theta, o.start, true);
  s.sse = s.at.e.squaredNorm();
  if (!std::isfinite(s.sse)) return s.sse = std::numeric_limits<double>::infinity(), s;
  double damping = 0, last = 1;
  for (s.end = "the search did not settle";; ++s.iterations) {
    if (s.iterations >= o.iterations) return s;
    const Vec g = s.at.J.transpose() * s.at.e;
    Mat H = Mat::Zero(g.size(), g.size());
    H.selfadjointView<Eigen::Lower>().rankUpdate(s.at.J.transpose());
    const Vec scale = H.diagonal().cwiseMax(1e-300);
    if (known.size() == s.theta.size() &&
        (s.theta - known).cwiseAbs2().dot(scale) < 1e-6 * known.cwiseAbs2().dot(scale))
      return s.sse = std::numeric_limits<double>::infinity(), s;
    bool improved = false;
    double size = 0;
    for (int tries = 0; tries < 40 && !improved; ++tries) {
      Mat damped = H;
      damped.diagonal() += (damping + 1e-15) * scale;
      const Eigen::LLT<Mat, Eigen::Lower> llt(damped);
      const Vec step = llt.info() == Eigen::Success ? Vec(-llt.solve(g)) : Vec::Zero(g.size());
      size = std::sqrt(step.cwiseAbs2().dot(scale) / (s.theta.cwiseAbs2().dot(scale) + 1e-300));
      const Vec next = s.theta + step;
      if (llt.info() == Eigen::Success && admissible(polynomials_of(next, orders))) {
        PredictionErrors at = evaluate(parts, orders, next, o.start, true);
        const double sse = at.e.squaredNorm();
        // Near the minimum the loss is all rounding: there the shrinking step is what tells progress.
        const bool settling = size < 1e-6 && size < 0.9 * last && sse <= s.sse * (1 + 1e-11);
        if (sse < s.sse || settling) {
          improved = true, last = size;
          s.theta = next, s.sse = sse, s.at = std::move(at);
          damping = damping < 1e-8 ? 0 : damping / 10;
          break;
        }
        if (size < 1e-6) break;  // rounding decides: this is the minimum
      }
      damping = damping == 0 ? 1e-4 : damping * 10;
    }
    if (!improved || size < 1e-13) break;
  }
  s.end = "";
  return s;
}

/// Σ (y - ȳ)² over the data.
double variation(const Vec& y) { return (y.array() - y.mean()).matrix().squaredNorm(); }

/// Without noise nothing is known of C and D: their columns of J are rounding. They become 1.
void forget_noise(PolyModel& m, Mat& J) {
  Index at = m.orders.na;
  for (const int b : m.orders.nb) at += b;
  const Index count = m.orders.nc + m.orders.nd;
  J.middleCols(at, count).setZero();
  m.theta.segment(at, count).setZero();
  m.p = polynomials_of(m.theta, m.orders);
}

void complete(PolyModel& m, const IdData& d, Search& best) {
  const Vec y = d.y.col(m.output);
  m.exact = std::sqrt(best.sse) <= 1e-13 * std::sqrt(static_cast<double>(m.theta.size())) * 10 * y.norm();
  if (m.exact) forget_noise(m, best.at.J);
  TriangularFactor factor(m.theta.size() + 1);
  for (Index t = 0; t < best.at.e.size(); t += 1024) {
    const Index n = std::min<Index>(1024, best.at.e.size() - t);
    Mat block(n, m.theta.size() + 1);
    block << best.at.J.middleRows(t, n), -best.at.e.segment(t, n);
    factor.add(block);
  }
  const LeastSquares ls = solve_triangular(factor.R(), best.at.rows);
  m.rank = ls.rank, m.null_space = ls.null_space;
  m.unidentifiable = free_directions(ls.null_space, m.names);
  m.quality = criteria(best.sse, best.at.rows, ls.rank, variation(y));
  const Index left = best.at.rows - ls.rank - best.at.free_start;
  m.quality.sigma2 = left > 0 ? best.sse / static_cast<double>(left) : 0;
  m.covariance = (m.exact ? 0 : m.quality.sigma2) * ls.inverse;
  m.std = standard_deviations(ls, m.covariance);
  if (ls.rank < m.theta.size() - m.orders.nc - m.orders.nd && m.exact)
    m.advice = {"the data follow a model of lower order exactly: common factors are free; lower the orders"};
  else if (ls.rank < m.theta.size() && m.exact)
    m.advice = {"there is no noise in the data from which C and D could be found"};
  else if (ls.rank < m.theta.size())
    m.advice = {
        "the gradient does not separate these parameters: lower the orders, or excite the input more"};
  m.simulation_start = seed_text(m, Seed::estimate);
  m.simulation_fit = simulation_fit(m, d, Seed::estimate);
}

}  // namespace

PredictionErrors prediction_errors(const IdData& d, Index output, const Orders& orders, const Vec& theta,
                                   Start start, bool gradient) {
  return evaluate(parts_of(d, output), orders, theta, start, gradient);
}

PolyModel pem(const IdData& d, Index output, const Orders& wanted, const std::string& kind,
              const PemOptions& options) {
  const Orders orders = checked(wanted, d);
  const std::string gaps = missing_text(d);
  if (!gaps.empty())
    throw Error(text(gaps, "; this model needs every sample: d:fill(), or merge(d:slice(…), d:slice(…))"));
  for (std::size_t i = 0; i < orders.nb.size(); ++i)
    if (orders.nb[i] == 0 && orders.nf[i] > 0)
      throw Error(text("nf without nb: input ", d.u_names[i], " has no numerator; give nb ≥ 1"));
  if (d.samples() <= 2 * orders.parameters())
    throw Error(text(d.samples(), " samples are too few for ", orders.parameters(),
                     " parameters of a nonlinear problem"));
  const std::vector<Part> parts = parts_of(d, output);
  std::vector<Vec> starts;
  if (options.theta)
    starts = {*options.theta};
  else
    starts = starting_values(d, output, orders);
  Search best;
  for (const Vec& start : starts) {
    if (start.size() != orders.parameters())
      throw Error(text("start: expected ", orders.parameters(), " numbers (",
                       join(parameter_names(orders, d.u_names), ", "), "), got ", start.size()));
    if (!admissible(polynomials_of(start, orders))) {
      if (options.theta) throw Error("start: C and F must be stable (zeros inside the unit circle)");
      continue;
    }
    Search s = minimise(parts, orders, start, options, best.theta);
    if (s.sse < best.sse) best = std::move(s);
  }
  if (!std::isfinite(best.sse)) throw Failure("no finite start was found: is the data constant?");
  PolyModel m;
  m.kind = kind, m.orders = orders, m.theta = best.theta, m.output = output;
  m.p = polynomials_of(best.theta, orders);
  m.Ts = d.Ts, m.start = options.start, m.samples = d.samples();
  m.y_name = d.y_names[output], m.u_names = d.u_names;
  m.estimated = true;
  m.names = parameter_names(orders, d.u_names);
  m.iterations = std::max(1, best.iterations);
  m.search = text("Gauss–Newton (", m.iterations, m.iterations == 1 ? " iteration)" : " iterations)",
                  best.end.empty() ? "" : "; " + best.end);
  complete(m, d, best);
  return m;
}

}  // namespace pendula::sysid
