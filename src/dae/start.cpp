#include "dae/start.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/rank.hpp"
#include "dae/reduce.hpp"
#include "expr/print.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

constexpr double solved_below = 1e-10;  // scaled residual that counts as satisfied
constexpr int max_iterations = 60;

/// The equations of a start: residuals of the index-1 form, invariants, and one row per fix.
class System {
 public:
  System(const ModelPtr& model, const StartRequest& request) : request_(request) {
    low = reduce_acc(model);
    for (const auto& list : {low->states(), low->top_derivatives(), low->algebraic()})
      unknowns.insert(unknowns.end(), list.begin(), list.end());
    for (std::size_t j = 0; j < unknowns.size(); ++j) column_[unknowns[j]] = static_cast<Index>(j);
    state_count = low->states().size();
    bind(*model);
    if (request.keep_invariants)
      for (const Constraint& c : low->invariants) add(c.residual, c.label);
    for (std::size_t i = 0; i < low->residuals.size(); ++i)
      add(low->residuals[i], "equation " + low->label(i));
    first_fix = rows.size();
    for (const auto& [leaf, value] : request.fix)
      add(resolve(*model, leaf) - Expr(value), text(to_text(leaf), " = ", rounded(value)));
    jacobian_ = sparse_jacobian(rows, unknowns);
    for (const auto& entry : jacobian_) slopes_.push_back(entry.value);
    check_known();
  }

  ModelPtr low;
  std::vector<Expr> unknowns, rows;
  std::vector<std::string> labels;
  std::size_t state_count = 0, first_fix = 0;
  std::unordered_map<Expr, double> known;  ///< parameters, t, inputs

  std::optional<Index> position(Expr leaf) const {
    const auto it = column_.find(leaf);
    return it == column_.end() ? std::nullopt : std::optional(it->second);
  }

  Vec residual(const Vec& w, const std::vector<char>& active) const {
    const auto values = pendula::evaluate(rows, point(w));
    Vec r = Eigen::Map<const Vec>(values.data(), static_cast<Index>(values.size()));
    for (Index i = 0; i < r.size(); ++i)
      if (!active[static_cast<std::size_t>(i)]) r[i] = 0;
    return r;
  }

  Mat jacobian(const Vec& w, const std::vector<char>& active) const {
    Mat J = Mat::Zero(static_cast<Index>(rows.size()), w.size());
    const auto values = pendula::evaluate(slopes_, point(w));
    for (std::size_t k = 0; k < values.size(); ++k)
      if (active[static_cast<std::size_t>(jacobian_[k].row)])
        J(jacobian_[k].row, jacobian_[k].column) = values[k];
    return J;
  }

  std::unordered_map<Expr, double> point(const Vec& w) const {
    auto p = known;
    for (std::size_t j = 0; j < unknowns.size(); ++j) p[unknowns[j]] = w[static_cast<Index>(j)];
    return p;
  }

 private:
  void add(Expr e, std::string label) {
    rows.push_back(substitute(e, request_.inputs));
    labels.push_back(std::move(label));
  }

  void bind(const Model& model) {
    known[time_symbol()] = request_.t;
    for (Expr p : low->parameters) {
      const auto given = request_.parameters.find(p), own = model.values.find(p);
      if (given != request_.parameters.end())
        known[p] = pendula::evaluate({&given->second, 1}, {})[0];
      else if (own != model.values.end())
        known[p] = pendula::evaluate({&own->second, 1}, {})[0];
      else
        throw Error(text("parameter '", symbol_of(p).name, "' has no value; give one: sys:with{ ",
                         symbol_of(p).name, " = … } or params = { ", symbol_of(p).name, " = … }"));
    }
  }

  void check_known() const {
    for (Expr leaf : leaves(rows)) {
      const Symbol& s = symbol_of(leaf);
      if (known.count(leaf) || column_.count(leaf) || s.kind == pendula::Kind::constant) continue;
      if (s.kind == pendula::Kind::input)
        throw Error(text("input '", to_text(leaf), "' has no value; give inputs = { ", s.name,
                         " = function(t) … end }",
                         s.order ? " as an expression in t, so that it can be differentiated" : ""));
      if (s.kind == pendula::Kind::parameter) throw Error(text("parameter '", s.name, "' has no value"));
      throw Error(
          text("'", to_text(leaf), "' is not an unknown of this model", did_you_mean_unknown(s.name)));
    }
  }

  std::string did_you_mean_unknown(const std::string& name) const {
    std::vector<std::string> names;
    for (Expr e : unknowns) names.push_back(symbol_of(e).name);
    return did_you_mean(name, names);
  }

  const StartRequest& request_;
  std::unordered_map<Expr, Index> column_;
  std::vector<Entry> jacobian_;
  std::vector<Expr> slopes_;
};

/// Size of each residual relative to its own terms: |r_i| / (1 + Σ_j |J_ij w_j|).
Vec scaled(const Vec& r, const Mat& J, const Vec& w) {
  return r.cwiseAbs().cwiseQuotient(Vec::Ones(r.size()) + J.cwiseAbs() * w.cwiseAbs());
}

struct Solution {
  Vec w;
  Vec scaled_residual;
  bool solved = false;
};

/// Damped Gauss-Newton with least-norm steps: stays close to the guess where the equations leave freedom.
Solution gauss_newton(const System& s, Vec w, const std::vector<char>& active) {
  Solution out;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    poll_interrupt();
    const Vec r = s.residual(w, active);
    const Mat J = s.jacobian(w, active);
    if (!r.allFinite() || !J.allFinite()) break;
    out.w = w;
    out.scaled_residual = scaled(r, J, w);
    if (out.scaled_residual.maxCoeff() < solved_below) out.solved = true;
    if (r.norm() == 0) break;
    Eigen::CompleteOrthogonalDecomposition<Mat> qr;
    qr.setThreshold(1e-11);  // relative pivot below which a direction counts as undetermined
    qr.compute(J);
    const Vec step = qr.solve(-r);
    if (!step.allFinite()) break;
    double alpha = 1;
    Vec trial = w + step;
    for (; alpha > 1e-4; alpha /= 2) {
      trial = w + alpha * step;
      const Vec next = s.residual(trial, active);
      if (next.allFinite() && next.norm() <= (1 - 0.1 * alpha) * r.norm()) break;
    }
    const bool stalled = alpha <= 1e-4 || (trial - w).norm() <= 1e-15 * (1 + w.norm());
    if (out.solved && (stalled || (trial - w).norm() <= 4e-16 * (1 + w.norm()))) break;
    if (stalled) break;
    w = trial;
  }
  if (out.w.size() == 0)
    out.w = w, out.scaled_residual = Vec::Constant(static_cast<Index>(s.rows.size()), INFINITY);
  return out;
}

/// Starting points in order: the guess with zeros elsewhere, then zeros replaced by small distinct numbers
/// (symmetric points such as 0 are often singular), then two larger spreads.
Vec first_guess(const System& s, const StartRequest& request, const Model& model, int attempt) {
  Vec w(static_cast<Index>(s.unknowns.size()));
  constexpr double golden = 0.6180339887498949;
  const double spread[] = {0, 0.1, 1, 3};
  for (Index j = 0; j < w.size(); ++j) {
    const double fraction = std::fmod((static_cast<double>(j) + 1) * golden, 1.0);
    w[j] = spread[attempt] * (attempt < 2 ? fraction : 2 * fraction - 1);
  }
  for (const auto& list : {request.guess, request.fix})
    for (const auto& [leaf, value] : list)
      if (const auto j = s.position(resolve(model, leaf))) w[*j] = value;
  return w;
}

Solution solve(const System& s, const StartRequest& request, const Model& model,
               const std::vector<char>& active) {
  Solution best;
  for (int attempt = 0; attempt < 4; ++attempt) {
    Solution next = gauss_newton(s, first_guess(s, request, model, attempt), active);
    if (next.solved) return next;
    if (attempt == 0 || next.scaled_residual.maxCoeff() < best.scaled_residual.maxCoeff())
      best = std::move(next);
  }
  return best;
}

/// Too many fixes: drops every fix that is not needed for the contradiction; what remains is a smallest
/// conflict.
[[noreturn]] void explain_conflict(const System& s, const StartRequest& request, const Model& model,
                                   const Solution& failed) {
  std::vector<char> active(s.rows.size(), 1);
  for (std::size_t i = s.first_fix; i < s.rows.size(); ++i) active[i] = 0;
  const Solution without = solve(s, request, model, active);
  if (!without.solved) {
    Index worst = 0;
    failed.scaled_residual.maxCoeff(&worst);
    throw Failure(text("no consistent start was found; the worst residual remains in ",
                       s.labels[static_cast<std::size_t>(worst)],
                       ". Give a guess near the solution: guess = { … }"));
  }
  std::fill(active.begin(), active.end(), 1);
  for (std::size_t i = s.first_fix; i < s.rows.size(); ++i) {
    active[i] = 0;
    if (solve(s, request, model, active).solved) active[i] = 1;  // needed for the contradiction
  }
  std::vector<std::string> fixes, violated;
  for (std::size_t i = s.first_fix; i < s.rows.size(); ++i)
    if (active[i]) fixes.push_back(s.labels[i]);
  Vec w = without.w;
  for (const auto& [leaf, value] : request.fix)
    if (const auto j = s.position(resolve(model, leaf))) w[*j] = value;
  const std::vector<char> all(s.rows.size(), 1);
  const Vec r = s.residual(w, all), size = scaled(r, s.jacobian(w, all), w);
  for (std::size_t i = 0; request.keep_invariants && i < s.low->invariants.size(); ++i)
    if (size[static_cast<Index>(i)] > solved_below)
      violated.push_back(
          text(s.labels[i], ":  0 ≠ ", rounded(r[static_cast<Index>(i)], 6), " = ", to_text(s.rows[i])));
  throw Error(
      text("the fixed values contradict each other and the constraints.\n  conflict: ", join(fixes, ", "),
           violated.empty() ? "" : "\n  violated: " + join(violated, "\n            "),
           "\n  Leave one of them out of fix, or move it to guess."));
}

/// Rows of the null space that can move: which unknowns are undetermined, and a good choice among the states.
[[noreturn]] void explain_freedom(const System& s, const Mat& N) {
  std::vector<std::string> candidates, choice;
  std::vector<Index> rows;
  for (Index j = 0; j < N.rows(); ++j)
    if (N.row(j).norm() > 1e-8 && (static_cast<std::size_t>(j) < s.state_count ||
                                   N.topRows(static_cast<Index>(s.state_count)).norm() < 1e-8))
      candidates.push_back(to_text(s.unknowns[static_cast<std::size_t>(j)])), rows.push_back(j);
  Mat candidates_matrix(static_cast<Index>(rows.size()), N.cols());
  for (std::size_t k = 0; k < rows.size(); ++k) candidates_matrix.row(static_cast<Index>(k)) = N.row(rows[k]);
  const Eigen::ColPivHouseholderQR<Mat> qr(
      candidates_matrix.transpose());  // the most independent rows come first
  std::vector<Index> chosen;
  for (Index k = 0; k < std::min(N.cols(), qr.rank()); ++k)
    chosen.push_back(qr.colsPermutation().indices()[k]);
  std::sort(chosen.begin(), chosen.end());
  for (Index k : chosen) choice.push_back(candidates[static_cast<std::size_t>(k)]);
  throw Error(text(N.cols(), N.cols() == 1 ? " initial value is" : " initial values are",
                   " neither fixed nor determined.\n  candidates: ", join(candidates, ", "),
                   "\n  for example fix: ", join(choice, ", "),
                   "   (or give a guess for them: guess = { … })"));
}

std::vector<char> guessed(const System& s, const StartRequest& request, const Model& model) {
  std::vector<char> covered(s.unknowns.size(), 0);
  for (const auto& [leaf, value] : request.guess)
    if (const auto j = s.position(resolve(model, leaf))) covered[static_cast<std::size_t>(*j)] = 1;
  return covered;
}

/// Directions that neither equations, nor fixes, nor guesses determine.
Mat undetermined(const Mat& J, const std::vector<char>& covered) {
  const auto extra = std::count(covered.begin(), covered.end(), 1);
  Mat full = Mat::Zero(J.rows() + extra, J.cols());
  full.topRows(J.rows()) = J;
  for (Index j = 0, i = J.rows(); j < J.cols(); ++j)
    if (covered[static_cast<std::size_t>(j)]) full(i++, j) = 1;
  return null_space(full);
}

/// A fix is redundant when the equations and the fixes before it already determine its value.
std::vector<char> redundant_fixes(const System& s, const Mat& J) {
  std::vector<char> redundant(s.rows.size(), 0);
  auto rows = static_cast<Index>(s.first_fix);
  Mat kept = J.topRows(rows);
  int rank = numeric_rank(kept);
  for (std::size_t i = s.first_fix; i < s.rows.size(); ++i) {
    kept.conservativeResize(++rows, Eigen::NoChange);
    kept.row(rows - 1) = J.row(static_cast<Index>(i));
    const int next = numeric_rank(kept);
    redundant[i] = next == rank;
    rank = next;
  }
  return redundant;
}

void fill_ledger(Start& at, const System& s, const StartRequest& request, const Model& model, const Mat& J) {
  const auto redundant = redundant_fixes(s, J);
  std::unordered_map<Expr, Origin> origin;
  for (std::size_t i = 0; i < request.fix.size(); ++i)
    origin[resolve(model, request.fix[i].first)] =
        redundant[s.first_fix + i] ? Origin::redundant : Origin::fixed;
  const Mat N = null_space(J);
  const auto covered = guessed(s, request, model);
  for (std::size_t j = 0; j < s.unknowns.size(); ++j) {
    const Expr leaf = s.unknowns[j];
    const auto it = origin.find(leaf);
    const bool chosen = covered[j] && N.cols() && N.row(static_cast<Index>(j)).norm() > 1e-8;
    at.rows.push_back({leaf, at.values.at(leaf),
                       it != origin.end() ? it->second
                       : chosen           ? Origin::chosen
                                          : Origin::computed});
  }
  at.free = static_cast<int>(s.unknowns.size()) - numeric_rank(J.topRows(static_cast<Index>(s.first_fix)));
}

/// Fixed values exactly as given, and zero where zero satisfies the equations to rounding: least-norm steps
/// leave 1e-16.
void clean(const System& s, const StartRequest& request, const Model& model, Vec& w) {
  const std::vector<char> all(s.rows.size(), 1);
  constexpr double rounding = 1e-14;
  const auto try_value = [&](Index j, double value) {
    const double old = std::exchange(w[j], value);
    const Vec r = s.residual(w, all);
    if (!r.allFinite() || scaled(r, s.jacobian(w, all), w).maxCoeff() > rounding) w[j] = old;
  };
  for (const auto& [leaf, value] : request.fix)
    if (const auto j = s.position(resolve(model, leaf))) try_value(*j, value);
  const double largest = w.size() ? w.cwiseAbs().maxCoeff() : 0;
  for (Index j = 0; j < w.size(); ++j)
    if (w[j] != 0 && std::fabs(w[j]) < rounding * 10 * (1 + largest)) try_value(j, 0);
}

}  // namespace

StartPtr init(const ModelPtr& model, const StartRequest& request) {
  const System s(model, request);
  const std::vector<char> all(s.rows.size(), 1);
  Solution solution = solve(s, request, *model, all);
  if (!solution.solved) explain_conflict(s, request, *model, solution);
  clean(s, request, *model, solution.w);
  const Mat J = s.jacobian(solution.w, all);
  if (const Mat N = undetermined(J, guessed(s, request, *model)); N.cols() > 0) explain_freedom(s, N);
  auto at = std::make_shared<Start>();
  at->model = model;
  at->t = request.t;
  at->values = s.point(solution.w);
  for (const auto& [leaf, value] : request.inputs)
    at->values[leaf] = pendula::evaluate({&value, 1}, at->values)[0];
  fill_ledger(*at, s, request, *model, J);
  for (const Constraint& c : s.low->invariants) {
    const Expr residual = substitute(c.residual, request.inputs);
    at->constraints.push_back({c, pendula::evaluate({&residual, 1}, at->values)[0]});
  }
  return at;
}

}  // namespace pendula::dae
