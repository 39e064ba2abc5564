// Least squares for predictors given as expressions.
#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/search/least_squares.hpp"
#include "base/text.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"
#include "sysid/fit/predictor_fit.hpp"

namespace pendula::sysid {
namespace {

/// The column of u with this name: its own name, u (if it is the only one), or u1, u2, …
Index input_column(const std::string& name, const IdData& d) {
  for (std::size_t i = 0; i < d.u_names.size(); ++i)
    if (d.u_names[i] == name) return static_cast<Index>(i);
  if (d.inputs() == 1) return 0;
  for (Index i = 0; i < d.inputs(); ++i)
    if (name == "u" + std::to_string(i + 1)) return i;
  throw Error(text("the predictor uses ", name, ", but the data has ",
                   d.inputs() == 0 ? "no inputs" : "the inputs " + join(d.u_names, ", ")));
}

class Recursion {
 public:
  Recursion(const Predictor& p, const IdData& d, InitialCondition start) : p_(p), d_(d), start_(start) {
    std::vector<Expr> slots;
    Substitution by_slot;
    for (std::size_t i = 0; i < p.terms.size(); ++i) {
      slots.push_back(symbol(Kind::slot, "s" + std::to_string(i)));
      by_slot[p.terms[i].node] = slots[i];
      column_.push_back(p.terms[i].kind == SignalTerm::Kind::input ? input_column(p.terms[i].name, d) : 0);
    }
    const Expr f = substitute(p.expression, by_slot);
    std::vector<Expr> outputs{f}, inputs = p.parameters;
    for (const Expr q : p.parameters) outputs.push_back(partial(f, q));
    for (std::size_t i = 0; i < p.terms.size(); ++i)
      if (p.terms[i].kind == SignalTerm::Kind::prediction) {
        outputs.push_back(partial(f, slots[i]));
        fed_back_.push_back(i);
      }
    inputs.insert(inputs.end(), slots.begin(), slots.end());
    inputs.push_back(time_symbol());
    for (const Expr leaf : leaves(outputs)) {  // parameters that are not estimated keep their values
      if (symbol_of(leaf).kind != Kind::parameter ||
          std::find(inputs.begin(), inputs.end(), leaf) != inputs.end())
        continue;
      fixed_.push_back(pendula::evaluate({&*symbol_of(leaf).value, 1}, {})[0]);
      inputs.push_back(leaf);
    }
    kernel_ = codegen::Kernel(outputs, inputs);
  }

  /// Errors y - ŷ and the gradient of ŷ at the usable rows.
  void run(const Vec& theta, Vec& e, Mat& J, Vec& yhat) {
    const auto n = static_cast<Index>(theta.size());
    const Index N = d_.samples();
    Vec all = d_.y.col(0);
    Mat slope = Mat::Zero(n, N);
    std::vector<double> in(static_cast<std::size_t>(n) + p_.terms.size() + 1 + fixed_.size()),
        out(kernel_.outputs());
    std::copy(theta.begin(), theta.end(), in.begin());
    std::copy(fixed_.begin(), fixed_.end(), in.end() - static_cast<std::ptrdiff_t>(fixed_.size()));
    std::vector<Index> rows;
    for (Index k = 0; k < d_.experiments(); ++k) {
      const Index begin = d_.starts[k];
      const Index from = start_ == InitialCondition::zero ? begin : std::min(begin + p_.memory(), d_.end(k));
      for (Index t = from; t < d_.end(k); ++t) {
        if (t % 1024 == 0) poll_interrupt();
        fill(t, begin, all, in.data() + n);
        kernel_(in.data(), out.data());
        all[t] = out[0];
        for (Index i = 0; i < n; ++i) slope(i, t) = out[i + 1];
        for (std::size_t j = 0; j < fed_back_.size(); ++j) {
          const Index s = t - p_.terms[fed_back_[j]].lag;
          if (s >= begin) slope.col(t) += out[n + 1 + j] * slope.col(s);
        }
        // Usable rows must not depend on θ, or the sum would be smallest with the fewest rows; for nonlinear
        // predictors only the data determine them.
        const bool usable =
            p_.recursive || (p_.linear ? std::isfinite(all[t]) : known(in.data() + n, p_.terms.size()));
        if (std::isfinite(d_.y(t, 0)) && usable) rows.push_back(t);
      }
    }
    rows_ = rows;
    e.resize(static_cast<Index>(rows.size()));
    J.resize(e.size(), n);
    yhat.resize(e.size());
    for (Index i = 0; i < e.size(); ++i) {
      const Index t = rows[i];
      yhat[i] = all[t];
      e[i] = d_.y(t, 0) - all[t];
      J.row(i) = slope.col(t).transpose();
    }
  }

  const std::vector<Index>& rows() const { return rows_; }  ///< used in the last run

 private:
  static bool known(const double* slots, std::size_t terms) {
    return std::all_of(slots, slots + terms, [](double value) { return std::isfinite(value); });
  }
  void fill(Index t, Index begin, const Vec& predicted, double* slots) const {
    for (std::size_t i = 0; i < p_.terms.size(); ++i) {
      const SignalTerm& s = p_.terms[i];
      const Index at = t - s.lag;
      slots[i] = at < begin                               ? 0
                 : s.kind == SignalTerm::Kind::output     ? d_.y(at, 0)
                 : s.kind == SignalTerm::Kind::prediction ? predicted[at]
                                                          : d_.u(at, column_[i]);
    }
    slots[p_.terms.size()] = static_cast<double>(t) * d_.Ts;
  }

  const Predictor& p_;
  const IdData& d_;
  InitialCondition start_;
  codegen::Kernel kernel_;
  std::vector<Index> column_;
  std::vector<std::size_t> fed_back_;
  std::vector<double> fixed_;
  std::vector<Index> rows_;
};

LeastSquares linearised(const Mat& J, const Vec& e) {
  return solve_triangular(pendula::triangular_factor(J, e).R(), e.size());
}

/// Minimises ½‖y - ŷ(θ)‖² from theta. e, J and yhat belong to the minimum; `iterates` has one row per point
/// of the search.
Minimum search(Recursion& recursion, Vec& theta, Vec& e, Mat& J, Vec& yhat, Mat& iterates) {
  const auto loss = [&](Vec& at) -> std::optional<QuadraticModel> {
    recursion.run(at, e, J, yhat);
    if (!e.allFinite() || !J.allFinite()) return {};
    return gauss_newton_model(-J, e);
  };
  if (!loss(theta)) {
    Index row = 0;
    while (row < e.size() && std::isfinite(e[row]) && J.row(row).allFinite()) ++row;
    const Index sample = row < e.size() ? recursion.rows()[row] + 1 : 1;
    throw Failure(text("the predictor is not finite at the start, first at sample ", sample,
                       "; give start = { … } nearer to the solution"));
  }
  MinimiserOptions options;
  options.iterations = 500;  // a cap; predictors of users may be far from linear
  options.is_known = [&iterates](const Vec& at, const Vec&) {
    iterates.conservativeResize(iterates.rows() + 1, at.size());
    iterates.bottomRows(1) = at.transpose();
    return false;
  };
  Minimum m = minimise(loss, theta, options);
  theta = m.theta;
  recursion.run(theta, e, J, yhat);
  return m;
}

}  // namespace

namespace {

void check(const Predictor& p, const IdData& d, InitialCondition start) {
  if (d.outputs() != 1) throw Error("a predictor explains one output; the data has several");
  if (p.parameters.empty()) throw Error("the predictor has no parameters to estimate");
  if (p.recursive && missing(d) > 0)
    throw Error(text(missing_text(d), "; the recursion cannot run across them: d:fill()"));
  if (start == InitialCondition::estimate) throw Error("ic: \"drop\" or \"zero\" for a predictor");
}

[[noreturn]] void no_row(const Predictor& p, const IdData& d) {
  throw Error(text("no row is left: the predictor needs ", p.memory(), " earlier samples and the data has ",
                   d.samples(), missing(d) > 0 ? "; " + missing_text(d) : ""));
}

/// Replaces the least-squares estimate by the maximum-likelihood estimate for this density.
void maximise_likelihood(PredictorFit& f, const Regression& r, const Density& density) {
  const LikelihoodFit best = maximise(r, density);
  f.theta = best.theta;
  f.covariance = best.covariance;
  f.std = best.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  f.log_likelihood = best.log_likelihood;
  f.noise = described(density, best);
  f.residuals = r.y - r.Phi * f.theta;
  f.predictions = f.predictions + (r.Phi * f.theta - r.Phi * f.ls.theta);
  f.exact = false;
  const Vec y = f.residuals + f.predictions;
  f.quality = criteria(f.residuals.squaredNorm(), r.y.size(), f.theta.size(),
                       (y.array() - y.mean()).matrix().squaredNorm());
}

}  // namespace

Regression regression(const Predictor& p, const IdData& d, InitialCondition start) {
  check(p, d, start);
  if (!p.linear) throw Error("noise = … needs a predictor that is linear in its parameters");
  Recursion recursion(p, d, start);
  Regression r;
  Vec yhat;
  recursion.run(Vec::Zero(static_cast<Index>(p.parameters.size())), r.y, r.Phi, yhat);
  if (r.y.size() == 0) no_row(p, d);
  for (const Expr q : p.parameters) r.names.push_back(symbol_of(q).name);
  for (const Index t : recursion.rows()) r.sample.push_back(t + 1);
  return r;
}

PredictorFit fit(const Predictor& p, const IdData& d, InitialCondition start, const Vec& theta0,
                 const Density* density) {
  check(p, d, start);
  PredictorFit f;
  f.predictor = p;
  for (const Expr q : p.parameters) f.names.push_back(symbol_of(q).name);
  Recursion recursion(f.predictor, d, start);
  Vec e, yhat;
  Mat J;
  f.theta = p.linear ? Vec(Vec::Zero(theta0.size())) : theta0;
  recursion.run(f.theta, e, J, yhat);
  if (e.size() == 0) no_row(p, d);
  if (p.linear) {
    f.theta = linearised(J, e).theta;
    f.ls = linearised(J, e);
    recursion.run(f.theta, e, J, yhat);
  } else {
    const Minimum m = search(recursion, f.theta, e, J, yhat, f.iterates);
    const auto accepted = static_cast<Index>(m.values.size());
    if (f.iterates.rows() > accepted) f.iterates.conservativeResize(accepted, Eigen::NoChange);
    f.losses = 2 * Eigen::Map<const Vec>(m.values.data(), static_cast<Index>(m.values.size()));
    f.iterations = m.iterations;
    f.ending = ending_text(m);
    f.ls = linearised(J, e);
  }
  f.ls.theta = f.theta;
  f.ls.sse = e.squaredNorm();
  const Vec y = e + yhat;
  f.ls.y_norm = y.norm();
  f.exact = f.ls.exact();
  f.quality = criteria(e.squaredNorm(), e.size(), f.ls.rank, (y.array() - y.mean()).matrix().squaredNorm());
  f.covariance = (f.exact ? 0 : f.quality.sigma2) * f.ls.inverse;
  f.std = standard_deviations(f.ls, f.covariance);
  f.unidentifiable =
      free_directions(f.ls.null_space, f.names, p.linear ? InParameters::linear : InParameters::nonlinear);
  f.residuals = e;
  f.predictions = yhat;
  f.first = start == InitialCondition::zero ? 0 : p.memory();
  if (density) {
    const Regression r = regression(p, d, start);
    // otherwise the rank is reported first
    if (f.unidentifiable.empty()) maximise_likelihood(f, r, *density);
  }
  return f;
}

std::string describe(const PredictorFit& f) {
  std::string out =
      text("predictor fitted to ", f.residuals.size(), f.residuals.size() == 1 ? " row" : " rows", " by ",
           !f.noise.empty() ? "maximum likelihood"
           : f.predictor.linear
               ? "linear least squares"
               : text("Gauss–Newton (", f.iterations, f.iterations == 1 ? " iteration" : " iterations",
                      f.ending.empty() ? ")" : "; " + f.ending + ")"),
           "\n", describe(f.predictor), "\n");
  if (!f.noise.empty()) out += text("  ", f.noise, ", ln L = ", rounded(f.log_likelihood, 7), "\n");
  Table table({false, true, false});
  for (std::size_t i = 0; i < f.names.size(); ++i) {
    const auto k = static_cast<Index>(i);
    table.row({f.names[i], rounded(f.theta[k], 9),
               k >= f.std.size()          ? ""
               : !std::isfinite(f.std[k]) ? "not identifiable"
               : f.exact                  ? ""
                                          : "± " + rounded(f.std[k], 4)});
  }
  out += table.str(4);
  if (f.exact)
    out += "  the data are reproduced exactly (to rounding)\n";
  else
    out += text("  loss V = ", rounded(f.quality.loss, 8),
                std::isfinite(f.quality.fpe) ? ", FPE = " + rounded(f.quality.fpe, 8) : "", ", fit ",
                rounded(f.quality.fit, 6), " % (1-step prediction)\n");
  if (!f.unidentifiable.empty())
    out += text("  rank ", f.ls.rank, " of ", f.names.size(),
                ": the estimate shown is the one of minimum norm\n");
  for (const std::string& line : f.unidentifiable) out += "    " + line + "\n";
  out.pop_back();
  return out;
}

}  // namespace pendula::sysid
