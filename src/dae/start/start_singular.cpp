// Starts at singular points, where the index-1 equations do not determine x′ and z. Either the start does not
// determine the solution, or only one of the values that satisfy the equations continues smoothly. Also
// nearly singular starts, some values of which have no correct digits.
#include <algorithm>
#include <cmath>
#include <functional>
#include <unordered_set>

#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/points/array_points.hpp"
#include "dae/points/derivative_array.hpp"
#include "dae/points/repeated_factors.hpp"
#include "dae/rank/rank.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "dae/reduce/reduce.hpp"
#include "dae/regularise/least_norm.hpp"
#include "dae/singular/singularity_conditions.hpp"
#include "dae/start/continuations.hpp"
#include "dae/start/start_system.hpp"
#include "expr/polynomial/rational_form.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

constexpr std::size_t most_by_svd = 60;  // unknowns; singular values cost O(n³)
constexpr double zero = 1e-9;  // of a vanishing expression: a point near a double root has √ε = 1.5e-8
constexpr std::size_t continued = 12;  // unknowns of a model up to which a smooth continuation is searched

std::vector<Expr> unknowns_of_step(const Model& low) {
  std::vector<Expr> list = low.top_derivatives();
  const auto z = low.algebraic();
  list.insert(list.end(), z.begin(), z.end());
  return list;
}

/// "t = 0, y = 0": the vanishing expressions.
std::string vanishing(const ModelPtr& model, const std::unordered_map<Expr, double>& point) {
  std::vector<std::string> words;
  for (const SingularityCondition& c : singularity_conditions(model)) {
    const auto inside = leaves({&c.factor, 1});
    const bool known = std::all_of(inside.begin(), inside.end(), [&](Expr leaf) {
      return point.count(leaf) || symbol_of(leaf).kind == Kind::constant;
    });
    if (known && std::fabs(pendula::evaluate({&c.factor, 1}, point)[0]) < zero)
      words.push_back(to_text(c.factor) + " = 0");
  }
  return join(words, ", ");
}

/// Does a vanishing expression vanish along the solution as well, by its derivative? Then unknowns stay open.
/// An isolated singular point, such as z = 0 of z³ = t, is passed.
bool stays_singular(const ModelPtr& model, const std::unordered_map<Expr, double>& point) {
  for (const SingularityCondition& c : singularity_conditions(model)) {
    const Expr slope = total_derivative(c.factor);
    const auto inside = leaves(std::vector<Expr>{c.factor, slope});
    const bool known = std::all_of(inside.begin(), inside.end(), [&](Expr leaf) {
      return point.count(leaf) || symbol_of(leaf).kind == Kind::constant;
    });
    if (!known) continue;
    const auto values = pendula::evaluate(std::vector<Expr>{c.factor, slope}, point);
    if (std::fabs(values[0]) < zero && std::fabs(values[1]) < zero) return true;
  }
  return false;
}

/// Rejects starts of an explicit form x′ = f at which f divides by zero; they give no information
/// about the model.
void refuse_division(const ModelPtr& model, const std::unordered_map<Expr, double>& point) {
  if (!stays_singular(model, point)) return;
  throw Error(text("the start lies on a singular point (", vanishing(model, point), "), where form \"",
                   model->form,
                   "\" is not equivalent to the model: it has divided by an expression that is 0 there.\n",
                   "  Start near it: other values in fix or guess"));
}

/// x′ and z of the smooth continuation if the differentiated equations determine them for these states: t x′
/// = -x + 2 t differentiated gives x′ = 1 at t = 0.
struct SmoothContinuation {
  std::string text;      ///< "x′ = 1"; empty if there is none
  bool is_here = false;  ///< the start has these values
};

SmoothContinuation smooth_continuation(const StartSystem& s, const Vec& w) {
  constexpr int most = 3;                          // differentiations
  constexpr double rounding = 1e-12, same = 1e-6;  // in units: of a value 0; of the six digits that are shown
  if (s.low->variables.size() > continued || !s.low->invariants.empty()) return {};
  const std::vector<Expr> asked = unknowns_of_step(*s.low), states = s.low->states();
  const auto point = s.point(w);
  DerivativeArray array(s.low->residuals, s.low->variables);
  for (int k = 1; k <= most; ++k) {
    array.extend();
    std::vector<Expr> columns = states;
    columns.insert(columns.end(), asked.begin(), asked.end());
    for (Expr leaf : array.columns())
      if (std::find(columns.begin(), columns.end(), leaf) == columns.end()) columns.push_back(leaf);
    const NumericArray numeric(array.rows(), columns);
    auto known = numeric.known(0);
    for (auto& [leaf, value] : known) {
      const auto it = point.find(leaf);
      if (it == point.end()) return {};
      value = it->second;
    }
    Vec start = Vec::Zero(static_cast<Index>(columns.size()));
    for (std::size_t j = 0; j < states.size() + asked.size(); ++j) start[j] = point.at(columns[j]);
    const auto held = static_cast<Index>(states.size());
    const auto solution = numeric.project(start, known, held);
    if (!solution) return {};
    const Mat J = numeric.jacobian(solution->w, known);
    const auto count = static_cast<Index>(asked.size());
    const int both = rank_with_gap(J.rightCols(J.cols() - held)).rank,
              rest = rank_with_gap(J.rightCols(J.cols() - held - count)).rank;
    if (both != rest + count) continue;
    std::vector<std::string> words;
    SmoothContinuation found{"", true};
    for (std::size_t j = 0; j < asked.size(); ++j) {
      const Index at = held + static_cast<Index>(j);
      const double value = solution->w[at], noise = rounding * s.unit[at];
      words.push_back(text(to_text(asked[j]), " = ", rounded(std::fabs(value) <= noise ? 0 : value, 6)));
      found.is_here = found.is_here &&
                      std::fabs(solution->w[at] - start[at]) <= same * (s.unit[at] + std::fabs(start[at]));
    }
    found.text = join(words, ", ");
    return found;
  }
  return {};
}

/// The model with 0 = change(residual) for its equations; nothing for a residual leaves an equation as it is.
template <class Change>
ModelPtr with_residuals(const ModelPtr& model, Change change) {
  ModelOptions options = child_of(model);
  declare_unknowns(options, *model);
  std::vector<Block> blocks = model->blocks;
  for (std::size_t i = 0; i < model->residuals.size(); ++i)
    if (const std::optional<Expr> residual = change(model->residuals[i])) {
      const auto [block, row] = model->origin[i];
      blocks[block].lhs[row] = 0;
      blocks[block].rhs[row] = *residual;
    }
  return make_model(std::move(blocks), std::move(options));
}

/// The equations multiplied by their denominators; an error if that is not possible.
ModelPtr without_denominators(const ModelPtr& model) {
  return with_residuals(model, [](Expr residual) { return std::optional(quotient_of(residual).numerator); });
}

}  // namespace

std::string smooth_values(const ModelPtr& model, const StartRequest& request) {
  if (model->variables.size() > continued || !model->form.empty()) return "";
  try {
    const ModelPtr cleared = without_denominators(model);
    const StartSystem s(cleared, request);
    const StartSolution at = solve_start(s);
    return at.solved ? smooth_continuation(s, at.w).text : "";
  } catch (const UserFacing&) {
    return "";
  }
}

ModelPtr without_repeated_factors(const ModelPtr& model, const ParameterValues& parameters) {
  constexpr std::size_t most = 60;
  if (model->residuals.size() > most) return nullptr;
  std::unordered_set<Expr> bases;
  for (const Variable& v : model->variables) bases.insert(v.leaf);
  Substitution values(model->values.begin(), model->values.end());
  for (const auto& [parameter, value] : parameters) values[parameter] = value;
  bool repeated = false;
  const auto square_free = [&](Expr residual) -> std::optional<Expr> {
    const auto factors = repeated_factors(substitute(residual, values), bases);
    if (!factors) return {};
    repeated = true;
    return factors->square_free;
  };
  try {
    const ModelPtr simple = with_residuals(model, square_free);
    return repeated && analyse(*simple).regular ? simple : nullptr;
  } catch (const UserFacing&) {  // an equation that is no longer there
    return nullptr;
  }
}

Crossing crossing_at(const ModelPtr& model, const StartSystem& s, const Vec& w) {
  const auto point = s.point(w);
  Crossing crossing{vanishing(model, point), "", ""};
  if (!model->form.empty()) return crossing;
  if (const std::vector<Continuation> continuations = continuations_at(*model, point);
      continuations.size() > 1) {
    crossing.continuations = continuations_text(continuations);
    crossing.choices = choices_text(continuations);
  }
  return crossing;
}

std::string ConsistentState::crossing() const {
  if (request.nearest || rows.empty() || !model->form.empty() || model->variables.size() > continued)
    return "";
  const StartSystem s(model, request);
  Vec w(static_cast<Index>(s.unknowns.size()));
  for (Index j = 0; j < w.size(); ++j) w[j] = values.at(s.unknowns[j]);
  const Mat J = s.top_jacobian(w);
  if (J.size() == 0 || !J.allFinite() || rank_with_gap(J).rank == J.rows()) return "";
  const Crossing here = crossing_at(model, s, w);
  if (here.continuations.empty()) return "";
  return text(here.factors.empty() ? "" : here.factors + " here, ", "where solutions meet: they go on with ",
              here.continuations, "; integrate follows one with branch = ", here.choices);
}

std::string redundancy_hint(const ModelPtr& model, const std::vector<Expr>& open) {
  const std::vector<Expr> forces = multipliers_of(*original(model));
  if (open.empty() || !std::all_of(open.begin(), open.end(), [&](Expr leaf) {
        return std::find(forces.begin(), forces.end(), leaf) != forces.end();
      }))
    return "";
  return "\n  The gradients of the constraints depend on each other here, so that their forces are not unique. If that "
         "is so wherever the mechanism moves, use sys:independent{ fix = …, guess = … }.";
}

void require_regular_point(const ModelPtr& model, const StartSystem& s, const Vec& w, bool is_determined) {
  if (s.low->variables.size() > most_by_svd || !s.request.keep_invariants) return;
  const Mat J = s.top_jacobian(w);
  if (J.size() == 0 || !J.allFinite()) return;
  const RankGap rank = rank_with_gap(J);
  if (rank.rank == J.rows() && s.low->kind == ModelKind::ode && !s.low->form.empty())
    refuse_division(model, s.point(w));
  if (rank.rank == J.rows() || !(rank.gap >= clear_gap)) return;
  const std::vector<Expr> unknowns = unknowns_of_step(*s.low);
  std::vector<Expr> open;
  const Mat N = null_space(equilibrated(J));
  for (Index j = 0; j < N.rows(); ++j)
    if (N.row(j).norm() > visible_in_null_vector) open.push_back(unknowns[j]);
  const std::string where = vanishing(model, s.point(w));
  const SmoothContinuation smooth = smooth_continuation(s, w);
  if (smooth.text.empty() && !is_determined) return;  // open unknowns are the better explanation
  if (smooth.text.empty() && !stays_singular(model, s.point(w))) return;
  if (smooth.is_here) return;
  throw Error(text(
      "the start lies on a singular point", where.empty() ? "" : " (" + where + ")",
      ": the equations do not determine ", names_of(open), " there (rank ", rank.rank, " of ", J.rows(), ").",
      smooth.text.empty() ? "" : "\n  The solution that continues smoothly has " + smooth.text + ".",
      "\n  Start near it: another time, or other values in fix or guess", redundancy_hint(model, open)));
}

/// Rows and columns without the fixed values, which are exact, and the rows that fix them.
static std::pair<std::vector<Index>, std::vector<Index>> what_is_not_fixed(const StartSystem& s) {
  const std::vector<char> fixed = s.fixed();
  std::pair<std::vector<Index>, std::vector<Index>> list;
  for (std::size_t i = 0; i < s.rows.size(); ++i)
    if (i < s.first_fix || !s.fixed_unknown(i - s.first_fix)) list.first.push_back(static_cast<Index>(i));
  for (std::size_t j = 0; j < fixed.size(); ++j)
    if (!fixed[j]) list.second.push_back(static_cast<Index>(j));
  return list;
}

/// The effect of rounding errors of the residuals on the unknowns: J⁻¹ (F(w + δ) - F(w) - J δ) for δ of some
/// units in the last place.
static Vec rounding_in_unknowns(const StartSystem& s, const Vec& w) {
  constexpr int looks = 3;  // at perturbations of up to 4 ε: one may round alike
  const auto [rows, columns] = what_is_not_fixed(s);
  const Eigen::SparseMatrix<double> J = s.jacobian(w);
  const Vec here = s.residual(w);
  Vec worst = Vec::Zero(w.size());
  if (!here.allFinite() || rows.empty() || columns.empty()) return worst;
  Mat scaled = Mat(J)(rows, columns);
  if (!scaled.allFinite()) return worst;
  const auto inverse_of_largest = [](const auto& list) {
    const double largest = list.cwiseAbs().maxCoeff();
    return largest > 0 ? 1 / largest : 1.0;
  };
  Vec row(scaled.rows()), column(scaled.cols());
  for (Index i = 0; i < scaled.rows(); ++i) scaled.row(i) *= row[i] = inverse_of_largest(scaled.row(i));
  for (Index j = 0; j < scaled.cols(); ++j) scaled.col(j) *= column[j] = inverse_of_largest(scaled.col(j));
  Mat noise = Mat::Zero(scaled.rows(), looks);
  for (int look = 0; look < looks; ++look) {
    Vec moved = w;
    for (Index j = 0; j < w.size(); ++j)
      moved[j] *= 1 + eps * static_cast<double>((5 * j + 4 * look) % 9 - 4);
    const Vec linear = J * Vec((moved - w).cwiseQuotient(s.unit));
    const Vec off = s.residual(moved) - here - linear;
    if (off.allFinite()) noise.col(look) = row.cwiseProduct(Vec(off(rows)));
  }
  // Elimination keeps entries of size 10²⁰⁰ apart from unrelated small ones; orthogonal
  // transformations mix them.
  const Mat moves = scaled.rows() == scaled.cols()
                        ? Mat(Eigen::PartialPivLU<Mat>(scaled).solve(noise))
                        : Mat(Eigen::CompleteOrthogonalDecomposition<Mat>(scaled).solve(noise));
  for (int look = 0; look < looks; ++look) {
    if (!moves.col(look).allFinite()) continue;
    for (Index k = 0; k < moves.rows(); ++k) {
      const Index j = columns[k];
      worst[j] = std::max(worst[j], std::fabs(column[k] * moves(k, look)) * s.unit[j]);
    }
  }
  return worst;
}

std::optional<LostDigits> lost_digits(const StartSystem& s, const Vec& w) {
  constexpr double many = 1e-2, visible = 1e-9;  // relative to the value; relative to its unit
  if (w.size() == 0 || w.size() > dense_up_to) return {};
  const Vec error = rounding_in_unknowns(s, w);
  std::optional<LostDigits> lost;
  double worst = 1;
  for (Index j = 0; j < w.size(); ++j) {
    if (w[j] == 0) continue;  // 0 satisfies the equations to within rounding
    const double share = error[j] / (many * std::fabs(w[j]) + visible * s.unit[j]);
    if (share > worst) {
      worst = share;
      lost = LostDigits{{s.unknowns[j]}, error[j]};
    }
  }
  return lost;
}

/// Uses the singular vectors u, v of the smallest singular value σ: uᵀF(w + e v) = σ e + ½ κ e² with κ = uᵀ
/// F″(v, v). The residuals are known to noise = |u|ᵀ (their rounding errors), hence e is known to the smaller
/// of noise/σ and √(2 noise/|κ|).
std::optional<LostDigits> digits_at_double_root(const StartSystem& s, const Vec& w) {
  constexpr double step = 1e-4;  // relative to ω, of a difference of slopes: it errs by step and by ε/step
  constexpr double open = 1e-3;  // relative to the largest component of v
  constexpr double visible = 1e-9;  // relative to the unit, as in lost_digits()
  if (w.size() == 0 || w.size() > dense_up_to) return {};
  const auto [rows, columns] = what_is_not_fixed(s);
  const Mat whole(s.jacobian(w));
  const Vec errors = s.rounding_errors(w);
  if (rows.empty() || columns.empty() || !whole.allFinite() || !errors.allFinite()) return {};
  const Mat J = whole(rows, columns);
  const Eigen::JacobiSVD<Mat> svd(J, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Index last = std::min(J.rows(), J.cols()) - 1;
  const Vec u = svd.matrixU().col(last), v = svd.matrixV().col(last);
  const double sigma = svd.singularValues()[last];
  const double h = step * (1 + w.cwiseQuotient(s.unit).cwiseAbs().maxCoeff());
  Vec moved = w;
  for (Index k = 0; k < v.size(); ++k) moved[columns[k]] += h * v[k] * s.unit[columns[k]];
  const Mat there = Mat(s.jacobian(moved))(rows, columns);
  const double curvature = std::fabs(u.dot((there - J) * v)) / h, noise = u.cwiseAbs().dot(Vec(errors(rows)));
  if (!(noise > 0) || !(curvature > 0)) return {};
  const double e = std::min(noise / sigma, std::sqrt(2 * noise / curvature));
  LostDigits lost{{}, 0, true};
  for (Index k = 0; k < v.size(); ++k) {
    const double size = std::fabs(v[k]), unit = s.unit[columns[k]];
    if (size < open * v.cwiseAbs().maxCoeff() || e * size < visible) continue;
    lost.leaves.push_back(s.unknowns[columns[k]]);
    if (lost.leaves.size() == 1) lost.error = e * size * unit;
  }
  return lost.leaves.empty() ? std::nullopt : std::optional(lost);
}

}  // namespace pendula::dae
