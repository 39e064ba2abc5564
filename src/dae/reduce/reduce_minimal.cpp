// Form "minimal": dependent coordinates are solved from the constraints and substituted.
//
// A constraint 0 = a(q) y + r(q), linear in a coordinate y, gives y = φ(q) = -r/a wherever a ≠ 0, and total
// derivatives give y′ = φ′, y″ = φ″. The constraint and its hidden conditions disappear. A constraint that is
// quadratic in every coordinate, 0 = a y² + b y + r, gives y = (-b ± √(b² - 4 a r))/(2 a) with the sign of a
// start, valid while the radicand is positive.
#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/analysis/determinant_factors.hpp"
#include "dae/model/derivation_markup.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/rank/rank.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "dae/regularise/regularise.hpp"
#include "dae/structure/differentiation.hpp"
#include "expr/generic/generic.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

constexpr double equally_good = 1e-12;  // relative: slopes that differ by their rounding, 4500 ε

using Index = Eigen::Index;

struct Candidate {
  Expr leaf, slope;
  bool safe;        ///< the coefficient contains no unknown: the solution holds everywhere
  double strength;  ///< |coefficient| at the point
};

bool has_unknown(Expr e) {
  const auto inside = leaves({&e, 1});
  return std::any_of(inside.begin(), inside.end(),
                     [](Expr leaf) { return symbol_of(leaf).kind == Kind::variable; });
}

double strength_at(Expr slope, const Model& m, const std::unordered_map<Expr, double>& at) {
  auto point = random_point({&slope, 1}, 0);
  for (auto& [leaf, value] : point) {
    if (symbol_of(leaf).kind == Kind::time) value = 0;  // at the usual start of an integration
    if (const auto it = m.values.find(leaf); it != m.values.end())
      value = pendula::evaluate({&it->second, 1}, {})[0];
    if (const auto it = at.find(leaf); it != at.end()) value = it->second;
  }
  const double s = std::fabs(pendula::evaluate({&slope, 1}, point)[0]);
  return std::isfinite(s) ? s : 0;
}

/// Solves constraints one after the other.
class Dependents {
 public:
  Dependents(const Model& m, const ReduceOptions& options) : m_(m), at_(options.at) {}

  std::vector<std::pair<Expr, Expr>> solved;  ///< y, φ in independent unknowns
  std::vector<SingularityCondition> domain;   ///< what was divided by, in the model's unknowns
  std::vector<std::string> trace;

  void add(const Constraint& c) {
    const Expr e = simplify(substitute(c.residual, derivatives()));
    if (e.is_zero() || generic::is_zero(e)) return;  // a derivative of a constraint that was solved before
    const auto best = choose(e);
    if (!best) return add_root(c, e);
    const Expr rest = substitute(e, {{best->leaf, Expr(0)}});
    const Expr phi = simplify(-rest / best->slope);
    keep(best->leaf, phi);
    for (Expr factor : vanishing_factors(best->slope))
      if (varies(factor))
        domain.push_back(
            {factor,
             text(c.label, " cannot be solved for ", to_text(best->leaf), ", as form \"minimal\" did"),
             "reduce \"dummy\" and reduce \"project\" divide by no expression and pass this point"});
    trace.push_back(text("minimal: ", c.label, " = 0 is linear in ", ref(best->leaf), ":  ",
                         formula(ref(best->leaf), " = ", ref(phi)),
                         best->safe ? "" : ",  valid where " + formula(ref(simplify(best->slope)), " ≠ 0")));
    trace_derivatives(best->leaf, phi);
  }

  /// y -> φ, y′ -> φ′ … for everything solved so far.
  Substitution derivatives() const {
    Substitution all;
    for (const auto& [leaf, phi] : solved) {
      const Substitution own = with_derivatives(leaf, phi);
      all.insert(own.begin(), own.end());
    }
    return all;
  }

 private:
  Substitution with_derivatives(Expr leaf, Expr phi) const {
    Substitution s{{leaf, phi}};
    int order = 1;
    for (const Variable& v : m_.variables)
      if (v.leaf == leaf) order = std::max(order, v.order);
    for (int k = 1; k <= order; ++k) s[derivative_leaf(leaf, k)] = phi = total_derivative(phi);
    return s;
  }

  std::optional<Candidate> choose(Expr e) const {
    const auto inside = leaves({&e, 1});
    std::optional<Candidate> best;
    for (const Variable& v : m_.variables) {
      if (std::find(inside.begin(), inside.end(), v.leaf) == inside.end()) continue;
      const bool moves = std::any_of(inside.begin(), inside.end(), [&](Expr leaf) {
        return leaf != v.leaf && symbol_of(leaf).base == v.leaf;
      });
      const Expr slope = simplify(partial(e, v.leaf));
      if (moves || slope.is_zero() || depends_on(slope, v.leaf)) continue;
      const Candidate next{v.leaf, slope, !has_unknown(slope), strength_at(slope, m_, at_)};
      if (next.strength == 0) continue;
      const bool better = !best || (next.safe && !best->safe) ||
                          (next.safe == best->safe && next.strength >= best->strength * (1 - equally_good));
      if (better) best = next;  // the last of equally good ones, so that the first coordinates stay
    }
    return best;
  }

  void keep(Expr leaf, Expr phi) {
    for (auto& [other, older] : solved) older = simplify(substitute(older, with_derivatives(leaf, phi)));
    solved.push_back({leaf, phi});
  }

  /// 0 = a y² + b y + r in one coordinate.
  struct Quadratic {
    Expr leaf, a, b, r;
    double slope;  ///< ∂e/∂y = 2 a y + b at the start, with the sign of the root
  };

  std::vector<Quadratic> quadratics(Expr e) const {
    const auto inside = leaves({&e, 1});
    std::vector<Quadratic> list;
    for (const Variable& v : m_.variables) {
      if (std::find(inside.begin(), inside.end(), v.leaf) == inside.end()) continue;
      const bool moves = std::any_of(inside.begin(), inside.end(), [&](Expr leaf) {
        return leaf != v.leaf && symbol_of(leaf).base == v.leaf;
      });
      const Expr slope = partial(e, v.leaf), a = simplify(partial(slope, v.leaf) / 2);
      if (moves || a.is_zero() || depends_on(a, v.leaf)) continue;
      const Substitution zero{{v.leaf, Expr(0)}};
      list.push_back({v.leaf, a, simplify(substitute(slope, zero)), simplify(substitute(e, zero)),
                      at_.empty() ? 0 : signed_at(slope)});
    }
    return list;
  }

  /// The value at the start; NaN if it is undefined.
  double signed_at(Expr e) const {
    std::unordered_map<Expr, double> point;
    for (Expr leaf : leaves({&e, 1})) {
      if (symbol_of(leaf).kind == Kind::constant) continue;
      if (const auto it = at_.find(leaf); it != at_.end())
        point[leaf] = it->second;
      else if (const auto known = m_.values.find(leaf); known != m_.values.end())
        point[leaf] = pendula::evaluate({&known->second, 1}, {})[0];
      else if (symbol_of(leaf).kind == Kind::time)
        point[leaf] = 0;
      else
        return NAN;
    }
    return pendula::evaluate({&e, 1}, point)[0];
  }

  void add_root(const Constraint& c, Expr e) {
    const std::vector<Quadratic> list = quadratics(e);
    if (list.empty()) refuse(c, e);
    std::vector<Expr> names;
    for (const Quadratic& q : list) names.push_back(q.leaf);
    if (at_.empty())
      throw Error(text("form \"minimal\": the constraint ", c.label, "  0 = ", to_text(e),
                       " is quadratic in ", grouped_names(names),
                       ", and which root holds depends on where the solution is. Name a "
                       "start: reduce(\"minimal\", { at = sys:init{ fix = … } })"));
    const auto best = std::max_element(list.begin(), list.end(), [](const Quadratic& p, const Quadratic& q) {
      return std::fabs(p.slope) < std::fabs(q.slope) * (1 - equally_good);
    });
    constexpr double vanished = 1e-12;  // at a start that is exact to rounding: 4500 ε of unknowns of size 1
    if (!(std::fabs(best->slope) > vanished))
      throw Error(
          text("form \"minimal\": at this start both roots of the constraint ", c.label, "  0 = ", to_text(e),
               " coincide for each of ", grouped_names(names),
               ", so it can be solved for none of them there. Use reduce \"dummy\" or reduce \"project\""));
    const Expr two_a = simplify(2 * best->a), D = simplify(best->b * best->b - 4 * best->a * best->r);
    const mpq_class* number = exact_value(two_a);
    const Expr inside =
        number && *number != 0 ? simplify(D / (two_a * two_a)) : D;  // √(L² - x²) instead of √(4 L² - …)/2
    const bool flip = number && *number < 0;
    const bool plus = (best->slope > 0) != flip;
    const Expr root = plus ? pendula::sqrt(inside) : -pendula::sqrt(inside);
    const Expr phi = number ? simplify(root - best->b / two_a) : simplify((root - best->b) / two_a);
    keep(best->leaf, phi);
    const auto name = to_text(best->leaf);
    const std::string remedy =
        "reduce \"dummy\" and reduce \"project\" divide by no expression and pass this point";
    domain.push_back(
        {pendula::sqrt(inside),
         text("the two roots of ", c.label, " for ", name, " meet, of which form \"minimal\" took one"),
         remedy});
    for (Expr factor : vanishing_factors(two_a))
      if (varies(factor))
        domain.push_back(
            {factor, text(c.label, " cannot be solved for ", name, ", as form \"minimal\" did"), remedy});
    trace.push_back(text("minimal: ", c.label, " = 0 is quadratic in ", ref(best->leaf), ":  ",
                         formula(ref(best->leaf), " = ", ref(phi)), ",  the root of the start (",
                         formula(ref(best->leaf), " = "), rounded(at_.at(best->leaf), 6), "),  valid while ",
                         formula(ref(inside), " > 0")));
    trace_derivatives(best->leaf, phi);
  }

  /// Reports the consequences of y = φ for y′ and y″.
  void trace_derivatives(Expr leaf, Expr phi) {
    constexpr int widest = 120;  // columns of a terminal
    const Substitution own = with_derivatives(leaf, phi);
    for (int k = 1; k < static_cast<int>(own.size()); ++k) {
      const Expr y = derivative_leaf(leaf, k), rate = simplify(own.at(y));
      if (display_width(to_text(rate)) <= widest)
        trace.push_back(shown_from(Detail::full, "     " + formula(ref(y), " = ", ref(rate))));
    }
  }

  [[noreturn]] void refuse(const Constraint& c, Expr e) const {
    std::vector<Expr> names;
    for (Expr leaf : leaves({&e, 1}))
      if (symbol_of(leaf).kind == Kind::variable) names.push_back(leaf);
    throw Error(text("form \"minimal\": the constraint ", c.label, "  0 = ", to_text(e),
                     " is linear or quadratic in none of ", grouped_names(names),
                     ", so no coordinate can be written explicitly. Use reduce \"dummy\", which needs no "
                     "solved form, or describe the model by other coordinates (angles)"));
  }

  const Model& m_;
  const std::unordered_map<Expr, double>& at_;
};

/// The remaining equations after all substitutions, without rows that have become trivial.
std::vector<Block> remaining(const Model& m, const std::vector<Chain>& removed, const Dependents& d) {
  const Substitution dependent = d.derivatives();
  const Substitution known = kinematics(m);
  std::vector<Block> blocks;
  for (std::size_t b = 0; b < m.blocks.size(); ++b) {
    std::vector<Expr> left, right;
    std::vector<std::string> how = m.blocks[b].rewritten, kept;
    how.resize(static_cast<std::size_t>(m.blocks[b].lhs.size()));
    for (Index r = 0; r < m.blocks[b].lhs.size(); ++r) {
      if (std::any_of(removed.begin(), removed.end(),
                      [&](const Chain& c) { return c.block == b && c.row == r; }))
        continue;
      const Expr l = substitute(m.blocks[b].lhs[r], dependent), e = substitute(m.blocks[b].rhs[r], dependent);
      const Expr before = m.blocks[b].lhs[r] - m.blocks[b].rhs[r];
      const auto inside = leaves({&before, 1});
      const auto contains = [&](bool derivative) {
        return std::any_of(inside.begin(), inside.end(), [&](Expr leaf) {
          return dependent.count(leaf) > 0 && (!derivative || symbol_of(leaf).order > 0);
        });
      };
      // drops y′ = v_y of a dependent y, but keeps x′ = u of a dependent u
      if (contains(true) && generic::is_zero(substitute(substitute(l - e, known), dependent))) continue;
      const Expr shown = simplify(l), of = simplify(e);
      if (contains(false) && shown == of) continue;  // a constraint that is contained in another one
      left.push_back(shown);
      right.push_back(of);
      kept.push_back(how[r]);
    }
    if (!left.empty()) blocks.push_back({column(left), column(right), m.blocks[b].note, kept});
  }
  return blocks;
}

/// The equations after the substitution, before multipliers are eliminated.
void trace_equations(const std::vector<Block>& blocks, std::vector<std::string>& trace) {
  constexpr Index most = 8;
  constexpr int widest = 150;  // columns of a terminal
  Index rows = 0;
  for (const Block& b : blocks) rows += b.lhs.size();
  if (rows > most) return;
  trace.push_back(shown_from(Detail::full, "     What remains of the equations:"));
  for (const Block& b : blocks)
    for (Index r = 0; r < b.lhs.size(); ++r)
      if (display_width(to_text(b.lhs[r])) + display_width(to_text(b.rhs[r])) <= widest)
        trace.push_back(shown_from(Detail::full, "     " + formula(ref(b.lhs[r]), " = ", ref(b.rhs[r]))));
}

ModelPtr eliminated(const ModelPtr& m) {
  if (m->kind == ModelKind::ode) return m;
  try {
    const ModelPtr low = reduce_ode(m);
    auto done = std::make_shared<Model>(*low);
    done->form = "minimal";
    return done;
  } catch (const Error&) {
    return m;  // nonlinear in its multipliers: stays at index 1
  }
}

}  // namespace

ModelPtr reduce_minimal(const ModelPtr& model, const ReduceOptions& request) {
  const ModelPtr source = regular_form(original(model));
  const ModelPtr low = reduce_acc(source);
  const std::vector<Chain> list = chains(*source, *low);
  if (list.empty())
    refuse_form("minimal", *source,
                "no constraint that has to be differentiated: all its states are independent");
  Dependents d(*source, request);
  for (const Chain& chain : list)
    for (const Constraint& c : chain.below) d.add(c);
  ModelOptions options = child_of(source);
  options.form = "minimal";
  const Substitution dependent = d.derivatives();
  options.singularity_conditions.insert(options.singularity_conditions.end(), d.domain.begin(),
                                        d.domain.end());
  move_invariants(options, dependent);
  for (SingularityCondition& n : options.singularity_conditions) n.factor = simplify(n.factor);
  for (const auto& [leaf, meaning] : dependent) options.relations[leaf] = meaning;
  options.mechanics.reset();  // T, V, q refer to the larger set of coordinates
  options.u = source->inputs;
  std::vector<Expr> gone, kept;
  for (const auto& [leaf, phi] : d.solved) gone.push_back(leaf);
  for (const Variable& v : source->variables) {
    if (std::find(gone.begin(), gone.end(), v.leaf) != gone.end()) continue;
    (v.order ? options.x : options.z).push_back(v.leaf);
    if (v.order) kept.push_back(v.leaf);
  }
  options.trace = std::move(d.trace);
  options.trace.push_back(
      text("     Substituting ", grouped_names(gone), gone.size() == 1 ? " and its" : " and their",
           " derivatives leaves the coordinates ", kept.empty() ? "none" : grouped_names(kept),
           "; the constraints hold identically, so nothing drifts."));
  std::vector<Block> rest = remaining(*source, list, d);
  trace_equations(rest, options.trace);
  const ModelPtr small = make_model(std::move(rest), std::move(options));
  if (small->residuals.size() != small->variables.size())
    throw Failure(text("form \"minimal\": substituting ", grouped_names(gone), " leaves ",
                       small->residuals.size(), " equations for ", small->variables.size(),
                       " unknowns; use reduce \"dummy\""));
  if (require_regular(*small).index > 1)
    throw Failure(
        "form \"minimal\": substituting the dependent coordinates left constraints hidden; use "
        "reduce \"dummy\"");
  return eliminated(small);
}

}  // namespace pendula::dae
