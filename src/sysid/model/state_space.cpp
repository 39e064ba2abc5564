#include "sysid/model/state_space.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "lti/system.hpp"
#include "sysid/model/kalman_errors.hpp"
#include "sysid/model/state_space_fit.hpp"

namespace pendula::sysid {

double spectral_radius(const Mat& A) { return A.rows() == 0 ? 0 : A.eigenvalues().cwiseAbs().maxCoeff(); }

Index StateSpaceModel::parameters() const {
  const Index n = order(), p = C.rows(), m = B.cols();
  return n * (p + m) + (K.isZero(0) ? 0 : n * p) + (feedthrough ? p * m : 0);
}

namespace {

/// The predictor x⁺ = F x + G u + K y, ŷ = C x + D u of one experiment; a simulation for K = 0.
struct Recursion {
  Mat F, G, C, D, K;
};

Recursion recursion(const StateSpaceModel& m, bool simulation) {
  if (simulation) return {m.A, m.B, m.C, m.D, Mat::Zero(m.order(), m.C.rows())};
  return {m.A - m.K * m.C, m.B - m.K * m.D, m.C, m.D, m.K};
}

/// y - ŷ, starting from the state x at the first row.
Mat errors_from(const Recursion& r, const Eigen::Ref<const Mat>& y, const Eigen::Ref<const Mat>& u, Vec x) {
  Mat e = y;
  Vec next(x.size());
  for (Index t = 0; t < y.rows(); ++t) {
    if (t % 4096 == 0) poll_interrupt();
    e.row(t).transpose() -= r.C.lazyProduct(x) + r.D.lazyProduct(u.row(t).transpose());
    next.noalias() =
        r.F.lazyProduct(x) + r.G.lazyProduct(u.row(t).transpose()) + r.K.lazyProduct(y.row(t).transpose());
    x.swap(next);
  }
  return e;
}

/// The size below which C Fᵗ is negligible against rounding, even in sums over 10⁴ errors.
constexpr double died_out = 1e-20;

/// The initial state that minimises the errors e(t) - C Fᵗ x, and the number of rows that depend on it.
std::pair<Vec, Index> initial_state(const Recursion& r, const Mat& e) {
  const Index n = r.F.rows(), p = e.cols();
  TriangularFactor factor(n + 1);
  Mat observed = r.C;
  const Index rows = std::max<Index>(1, TriangularFactor::block_rows / p);
  Index t = 0;
  while (t < e.rows() && observed.norm() > died_out * r.C.norm()) {
    const Index count = std::min(rows, e.rows() - t);
    Mat block(count * p, n + 1);
    for (Index k = 0; k < count; ++k) {
      block.block(k * p, 0, p, n) = observed;
      block.block(k * p, n, p, 1) = e.row(t + k).transpose();
      observed = (observed * r.F).eval();
    }
    if (!block.allFinite()) return {solve_triangular(factor.R(), e.size()).theta, e.rows()};
    factor.add(block);
    t += count;
  }
  return {solve_triangular(factor.R(), e.size()).theta, t};
}

/// The h-step errors Σ_j H_j e(t - j) with H_0 = I, H_j = C A^(j-1) K.
Mat ahead(const StateSpaceModel& m, const Mat& e, Index horizon) {
  Mat out = e, power = m.K;
  for (Index j = 1; j < std::min(horizon, e.rows()); ++j) {
    poll_interrupt();
    const Mat H = m.C * power;
    out.bottomRows(e.rows() - j) += e.topRows(e.rows() - j) * H.transpose();
    power = (m.A * power).eval();
  }
  return out;
}

}  // namespace

std::vector<Response> predict(const StateSpaceModel& m, const IdData& d, Index horizon, Seed seed) {
  check_horizon(horizon);
  if (missing(d) > 0) {
    const Mat one = Mat::Identity(d.outputs(), d.outputs());
    return predict_with_gaps(m, m.innovations.size() > 0 ? m.innovations : one, d, horizon, seed);
  }
  const Recursion r = recursion(m, horizon == 0);
  Mat e(d.samples(), d.outputs());
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index from = d.starts[k], n = d.end(k) - from;
    const auto y = d.y.middleRows(from, n);
    const auto u = d.u.middleRows(from, n);
    Mat one = errors_from(r, y, u, Vec::Zero(m.order()));
    if (seed != Seed::zero) {
      const auto [x, rows] = initial_state(r, one);
      one.topRows(rows) = errors_from(r, y.topRows(rows), u.topRows(rows), x);
    }
    e.middleRows(from, n) = horizon > 1 ? ahead(m, one, horizon) : one;
  }
  if (!e.allFinite())
    throw Failure(
        "the response overflows: the model is unstable; simulate fewer "
        "samples or predict with a short horizon");
  std::vector<Response> out;
  for (Index j = 0; j < d.outputs(); ++j) {
    Response one;
    one.compared = d.y.col(j);
    one.errors = e.col(j);
    one.values = one.compared - one.errors;
    one.rows.resize(static_cast<std::size_t>(d.samples()));
    for (Index t = 0; t < d.samples(); ++t) one.rows[t] = t;
    one.fit = fit_percent(one.compared, one.errors);
    out.push_back(std::move(one));
  }
  return out;
}

namespace {

/// The regression of the one-step errors on B, D, x0, row by row, and the remainder of y. With z_jk the
/// response of (qI - Fᵀ)⁻¹ Cᵀ to input k at output j, the response of y_j to B is zᵀ, to D it is u - zᵀ K, to
/// x0 it is C Fᵗ.
class InputRegression {
 public:
  InputRegression(const StateSpaceModel& m, const IdData& d)
      : m_(m), d_(d), Ft_((m.A - m.K * m.C).transpose()), Ct_(m.C.transpose()) {}
  Index nb() const { return m_.order() * d_.inputs(); }
  Index nd() const { return m_.feedthrough ? d_.outputs() * d_.inputs() : 0; }

  void start() {
    Z_ = Mat::Zero(m_.order(), d_.outputs() * d_.inputs());
    observed_ = Ct_;
    x_ = Vec::Zero(m_.order());
  }
  bool depends_on_start() const { return observed_.norm() > died_out * Ct_.norm(); }

  /// p rows: B, D, y - ŷ; the columns of x0 go into `start`.
  void fill(Index t, Eigen::Ref<Mat> rows, Eigen::Ref<Mat> start) {
    const Index n = m_.order(), p = d_.outputs(), inputs = d_.inputs();
    for (Index j = 0; j < p; ++j) {
      for (Index k = 0; k < inputs; ++k) {
        const auto z = Z_.col(k * p + j);
        rows.row(j).segment(k * n, n) = z.transpose();
        for (Index i = 0; nd() > 0 && i < p; ++i)
          rows(j, nb() + k * p + i) = (i == j ? d_.u(t, k) : 0.0) - z.dot(m_.K.col(i));
      }
      rows(j, rows.cols() - 1) = d_.y(t, j) - Ct_.col(j).dot(x_);
    }
    if (start.cols() > 0) start = observed_.transpose();
  }
  void advance(Index t) {
    next_.noalias() = Ft_.lazyProduct(Z_);
    for (Index k = 0; k < d_.inputs(); ++k)
      next_.middleCols(k * d_.outputs(), d_.outputs()) += d_.u(t, k) * Ct_;
    Z_.swap(next_);
    x_ = (Ft_.transpose().lazyProduct(x_) + m_.K.lazyProduct(d_.y.row(t).transpose())).eval();
    if (depends_on_start()) observed_ = (Ft_ * observed_).eval();
  }

 private:
  const StateSpaceModel& m_;
  const IdData& d_;
  Mat Ft_, Ct_, Z_, next_, observed_;
  Vec x_;
};

}  // namespace

void fit_inputs(StateSpaceModel& m, const IdData& d) {
  InputRegression regression(m, d);
  const Index n = m.order(), p = d.outputs(), inputs = d.inputs(), nb = regression.nb(), nd = regression.nd();
  const Index common = nb + nd, states = n * d.experiments(),
              size = std::max<Index>(1, TriangularFactor::block_rows / p);
  // columns x0, B, D, y; without x0 once its effect is negligible
  TriangularFactor factor(states + common + 1);
  for (Index k = 0; k < d.experiments(); ++k) {
    TriangularFactor later(common + 1);
    regression.start();
    for (Index t = d.starts[k]; t < d.end(k);) {
      poll_interrupt();
      const Index count = std::min(size, d.end(k) - t);
      const bool early = regression.depends_on_start();
      Mat block = Mat::Zero(count * p, (early ? states : 0) + common + 1);
      for (Index row = 0; row < count; ++row, ++t) {
        regression.fill(t, block.block(row * p, block.cols() - common - 1, p, common + 1),
                        block.block(row * p, early ? k * n : 0, p, early ? n : 0));
        regression.advance(t);
      }
      (early ? factor : later).add(block);
    }
    Mat rest = Mat::Zero(common + 1, states + common + 1);
    rest.rightCols(common + 1) = later.R();
    factor.add(rest);
  }
  const Vec theta = solve_triangular(factor.R(), d.y.size()).theta;
  m.B = theta.segment(states, nb).reshaped(n, inputs);
  m.D = nd > 0 ? Mat(theta.tail(nd).reshaped(p, inputs)) : Mat::Zero(p, inputs);
  for (Index k = 0; k < d.experiments(); ++k) m.x0.push_back(theta.segment(k * n, n));
}

IdModel completed(StateSpaceModel m, const IdData& d, bool exact) {
  const auto one = predict(m, d, 1, Seed::estimate);
  std::vector<Response> free;
  try {
    free = predict(m, d, 0, Seed::estimate);
  } catch (const Failure&) {  // unstable: a simulation cannot be compared
  }
  Mat e = Mat::Zero(d.samples(), d.outputs());
  IdModel out;
  out.inputs = d.inputs();
  const Index share = (m.parameters() + d.outputs() - 1) / d.outputs();
  for (Index j = 0; j < d.outputs(); ++j) {
    const auto i = static_cast<std::size_t>(j);
    e.col(j)(one[i].rows) = one[i].errors;
    PolyModel row;
    row.kind = "state space";
    row.estimated = true;
    row.Ts = d.Ts;
    row.output = j;
    row.start = InitialCondition::estimate;
    row.y_name = d.y_names[i];
    row.u_names = d.u_names;
    row.samples = d.samples();
    row.identifiability.rank = m.parameters();
    const Vec& y = one[i].compared;
    row.quality = criteria(one[i].errors.squaredNorm(), one[i].errors.size(), share,
                           (y.array() - y.mean()).matrix().squaredNorm());
    // without noise at most 2e-13 was left (orders 1 to 3, 200 and 5000 samples); more where states are
    // excited weakly
    constexpr double rounding = 1e-9;
    row.exact = exact && one[i].errors.norm() <= rounding * y.norm();
    row.simulation.percent = free.empty() ? -std::numeric_limits<double>::infinity() : free[i].fit;
    row.simulation.start = "initial state estimated";
    row.search.warnings = offsets_in(d, j);
    out.outputs.push_back(std::move(row));
  }
  if (missing(d) == 0) m.innovations = e.transpose() * e / static_cast<double>(d.samples());
  out.state_space = std::make_shared<const StateSpaceModel>(std::move(m));
  return out;
}

StateSpaceModel observer_form(const IdModel& m) {
  const auto p = static_cast<Index>(m.outputs.size());
  const auto coefficient = [](const Vec& v, Index k) { return k < v.size() ? v[k] : 0.0; };
  Index length = 0;
  for (const PolyModel& row : m.outputs) {
    length = std::max(length, row.p.A.size() - 1);
    for (const Vec& b : row.p.B) length = std::max(length, b.size() - 1);
  }
  // y(t) + Σ A_k y(t-k) = Σ B_k u(t-k) + e(t)
  const auto blocks = [&](Index k) {
    std::pair<Mat, Mat> AB{Mat::Zero(p, p), Mat::Zero(p, m.inputs)};
    for (Index i = 0; i < p; ++i) {
      const Polynomials& row = m.outputs[i].p;
      AB.first(i, i) = coefficient(row.A, k);
      for (std::size_t c = 0; c < row.B.size(); ++c) {
        const auto j = static_cast<Index>(c);
        if (j < m.inputs)
          AB.second(i, j) = coefficient(row.B[c], k);
        else
          AB.first(i, j - m.inputs < i ? j - m.inputs : j - m.inputs + 1) = -coefficient(row.B[c], k);
      }
    }
    return AB;
  };
  StateSpaceModel s;
  const Index n = p * length;
  s.A = Mat::Zero(n, n);
  s.B = Mat::Zero(n, m.inputs);
  s.C = Mat::Zero(p, n);
  s.K = Mat::Zero(n, p);
  s.D = blocks(0).second;
  s.feedthrough = !s.D.isZero(0);
  if (n > 0) s.C.leftCols(p).setIdentity();
  for (Index k = 1; k <= length; ++k) {
    const auto [Ak, Bk] = blocks(k);
    const Index at = (k - 1) * p;
    s.A.block(at, 0, p, p) = -Ak;
    if (k < length) s.A.block(at, at + p, p, p).setIdentity();
    s.B.middleRows(at, p) = Bk - Ak * s.D;
    s.K.middleRows(at, p) = -Ak;
  }
  return s;
}

namespace {

/// Relative size below which entries, imaginary parts and singular values are printed as 0: reports have up
/// to seven digits, and eigenvalues err by ε times their condition number.
constexpr double shown_as_zero = 1e-9;

/// Entries for printing: seven digits, with rounding errors relative to larger entries set to zero.
MatX presentable_matrix(const Mat& m) {
  const double size = m.size() > 0 ? m.cwiseAbs().maxCoeff() : 0;
  MatX out(m.rows(), m.cols());
  for (Index i = 0; i < m.rows(); ++i)
    for (Index j = 0; j < m.cols(); ++j)
      out(i, j) = std::abs(m(i, j)) <= shown_as_zero * size ? Expr(0) : Expr(std::stod(rounded(m(i, j), 7)));
  return out;
}

std::string matrices(const IdModel& model) {
  const StateSpaceModel& s = *model.state_space;
  const bool noise = !s.K.isZero(0);
  const Index p = s.C.rows(), inputs = s.B.cols();
  Mat B(s.order(), inputs + (noise ? p : 0)), D(p, B.cols());
  B.leftCols(inputs) = s.B;
  D.leftCols(inputs) = s.D;
  if (noise) {
    B.rightCols(p) = s.K;
    D.rightCols(p) = Mat::Identity(p, p);
  }
  if (B.cols() == 0) return "";
  lti::System g = lti::make_ss(presentable_matrix(s.A), presentable_matrix(B), presentable_matrix(s.C),
                               presentable_matrix(D), Expr(model.outputs[0].Ts));
  g.input_names = model.outputs[0].u_names;
  for (Index i = 0; noise && i < p; ++i)
    g.input_names.push_back(p == 1 ? "e" : "e" + subscript(static_cast<long>(i + 1)));
  for (const PolyModel& row : model.outputs) g.output_names.push_back(row.y_name);
  const std::string table = lti::describe(g);
  return table.substr(table.find('\n') + 1) + "\n";
}

std::string poles(const Mat& A) {
  const Eigen::VectorXcd all = A.eigenvalues();
  std::vector<std::pair<double, double>> list;
  for (const auto& z : all)
    if (z.imag() >= -shown_as_zero * std::abs(z))
      list.emplace_back(z.real(), std::abs(z.imag()) <= shown_as_zero * std::abs(z) ? 0 : z.imag());
  std::sort(list.begin(), list.end(), std::greater<>());
  std::vector<std::string> words;
  for (const auto& [re, im] : list)
    words.push_back(im == 0 ? rounded(re, 6) : text(rounded(re, 6), " ± ", rounded(im, 6), " i"));
  return join(words, ", ");
}

}  // namespace

std::string describe_state_space(const IdModel& model) {
  const StateSpaceModel& s = *model.state_space;
  const bool noise = !s.K.isZero(0);
  const PolyModel& first = model.outputs[0];
  std::string out = text("state-space model of order ", s.order(), ", estimated from ", first.samples,
                         " samples by the subspace method (", s.weighting, " weighting, ", s.horizon,
                         " block rows)", s.refinement.empty() ? "" : ", " + s.refinement, "\n");
  const bool inputs = model.inputs > 0;
  out += text("  x(t+1) = A x(t)", inputs ? " + B u(t)" : "", noise ? " + K e(t)" : "", ",  y(t) = C x(t)",
              s.feedthrough ? " + D u(t)" : "", " + e(t)\n");
  out += matrices(model);
  out += text("  poles ", poles(s.A), spectral_radius(s.A) < 1 ? "" : ": the model is unstable", "\n");
  std::vector<std::string> values;
  for (Index i = 0; i < std::min<Index>(s.singular_values.size(), std::max<Index>(8, s.order() + 2)); ++i)
    values.push_back(s.singular_values[i] <= shown_as_zero * s.singular_values[0]
                         ? "0"
                         : rounded(s.singular_values[i], 4));
  out += text("  singular values ", join(values, ", "),
              s.singular_values.size() > static_cast<Index>(values.size()) ? ", …" : "", "; order ",
              s.order(), s.choice.empty() ? "" : ": " + s.choice, "\n");
  if (!s.free_inputs.empty())
    out += text("  warning: the inputs depend on each other: ", join(s.free_inputs, "; "),
                "; B shown is the one of minimum norm\n");
  for (const PolyModel& row : model.outputs) {
    const std::string name = model.outputs.size() > 1 ? row.y_name + ": " : "";
    if (row.exact) {
      out += text("  ", name, "the data are reproduced exactly (to rounding)\n");
      continue;
    }
    out +=
        text("  ", name, "loss V = ", rounded(row.quality.loss, 8), ", FPE = ", rounded(row.quality.fpe, 8),
             ", AIC = ", rounded(row.quality.aic, 7), ", BIC = ", rounded(row.quality.bic, 7), "\n");
    out += text("  ", name, "fit on the estimation data: ", rounded(row.quality.fit, 6),
                " % (1-step prediction), ",
                std::isfinite(row.simulation.percent) ? rounded(row.simulation.percent, 6) + " %"
                                                      : std::string("diverges"),
                " (simulation, initial state estimated)\n");
    for (const std::string& line : row.search.warnings) out += text("  warning: ", line, "\n");
  }
  out.pop_back();
  return out;
}

}  // namespace pendula::sysid
