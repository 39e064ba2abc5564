// Forms that keep a solution near its constraints by changing the equations: "ggl" and "baumgarte".
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/derivation_markup.hpp"
#include "dae/model/forms.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/model/solved_rows.hpp"
#include "dae/points/array_points.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "dae/regularise/regularise.hpp"
#include "dae/structure/differentiation.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

constexpr const char* nothing_hidden = "no constraint that has to be differentiated";

Expr power_of_ten(int exponent) {
  mpz_class power;
  mpz_ui_pow_ui(power.get_mpz_t(), 10, static_cast<unsigned long>(std::abs(exponent)));
  return Expr(exponent < 0 ? mpq_class(1) / power : mpq_class(power));
}

// ── ggl
// ──────────────────────────────────────────────────────────────────────────────────────────────────────

/// The index of the row q′ = f for every position.
struct Kinematic {
  std::size_t residual;
  Expr f;
};

std::unordered_map<Expr, Kinematic> kinematic_rows(const Model& m) {
  const Substitution known = kinematics(m);
  std::unordered_map<Expr, Kinematic> rows;
  for (const Solved& row : solved_rows(m))
    if (known.count(row.derivative)) rows[symbol_of(row.derivative).base] = {row.residual, row.f};
  return rows;
}

/// The constraints that are differentiated twice. Throws Error if there are none, or if one is
/// differentiated more often.
std::vector<Chain> position_constraints(const Model& first, const Model& low) {
  std::vector<Chain> positions;
  for (const Chain& chain : chains(first, low)) {
    if (chain.below.size() > 2)
      throw Error(text("form \"ggl\": ", chain.below[0].label, " = 0 has to be differentiated ",
                       chain.below.size(),
                       " times, but the form is made for two (positions, velocities); use reduce \"acc\" or "
                       "\"dummy\""));
    if (chain.below.size() == 2) positions.push_back(chain);
  }
  if (positions.empty())
    throw Error(
        "form \"ggl\": no constraint is differentiated twice, so there are no positions and velocities to "
        "treat apart; use reduce \"acc\" or \"project\"");
  return positions;
}

/// The units of positions and constraints as powers of ten, if they are far from 1. Otherwise a
/// multiplier may act on a q′ of size 10⁸ with a gradient of 10⁻¹⁸, and its column of the iteration
/// matrix is lost to rounding.
class MultiplierUnits {
 public:
  MultiplierUnits(const Model& first, const std::vector<Chain>& positions) {
    std::vector<Expr> rows = first.residuals, columns;
    for (const Chain& chain : positions) rows.push_back(chain.below[0].residual);
    for (const Variable& v : first.variables)
      for (int k = 0; k <= v.order; ++k) columns.push_back(derivative_leaf(v.leaf, k));
    const NumericArray numeric(rows, columns);
    for (std::size_t j = 0; j < columns.size(); ++j) position_[columns[j]] = decades(numeric.unit()[j]);
    for (std::size_t k = 0; k < positions.size(); ++k)
      constraint_.push_back(decades(numeric.row_unit()[first.residuals.size() + k]));
  }

  /// (∂C_k/∂q)ᵀ μ_k with a dimensionless μ_k.
  Expr factor(Expr q, std::size_t k) const { return power_of_ten(2 * position_.at(q) - constraint_[k]); }

 private:
  static int decades(double unit) { return static_cast<int>(std::lround(std::log10(unit))); }
  std::unordered_map<Expr, int> position_;
  std::vector<int> constraint_;
};

/// Writes q′ = f - (∂C/∂q)ᵀ μ into the rows of the positions; returns true if units were needed.
bool add_multipliers(std::vector<Block>& blocks, const Model& first, const std::vector<Chain>& positions,
                     const std::vector<Expr>& mu) {
  const auto rows = kinematic_rows(first);
  const MultiplierUnits units(first, positions);
  bool scaled = false;
  for (std::size_t k = 0; k < positions.size(); ++k) {
    const Expr C = positions[k].below[0].residual;
    for (Expr q : leaves({&C, 1})) {
      if (symbol_of(q).kind != Kind::variable) continue;
      const auto row = rows.find(q);
      if (row == rows.end())
        throw Error(text("form \"ggl\": the constraint ", positions[k].below[0].label, " = 0 contains ",
                         to_text(q), ", for which the model has no row ", to_text(q),
                         "′ = v; use reduce \"acc\" or \"dummy\""));
      const auto [b, r] = first.origin[row->second.residual];
      Block& block = blocks[b];
      if (block.lhs[r] != derivative_leaf(q)) {
        block.lhs[r] = derivative_leaf(q);
        block.rhs[r] = row->second.f;
      }
      const Expr factor = units.factor(q, k);
      scaled = scaled || !factor.is_one();
      block.rhs[r] -= factor * partial(C, q) * mu[k];
    }
  }
  return scaled;
}

/// Describes Cq Cqᵀ, which has to be regular; shows its entries if they are short.
std::string gram_matrix(const std::vector<Chain>& positions) {
  constexpr std::size_t most = 3;  // rows of a matrix that is shown
  constexpr int widest = 60;       // columns of a terminal
  if (positions.size() > most) return "";
  std::vector<Expr> C, q;
  for (const Chain& chain : positions) C.push_back(chain.below[0].residual);
  for (Expr leaf : leaves(C))
    if (symbol_of(leaf).kind == Kind::variable) q.push_back(leaf);
  const MatX Cq = jacobian(C, q);
  const MatX G = MatX(Cq * Cq.transpose()).unaryExpr([](Expr e) { return simplify(e); });
  for (Expr e : G.reshaped())
    if (!is_short(e, 200) || display_width(to_text(e)) > widest) return "";
  return formula("Cq Cqᵀ = ", G.size() == 1 ? ref(G(0, 0)) : ref(G));
}

std::vector<std::string> ggl_derivation(const std::vector<Chain>& positions, const std::vector<Expr>& mu,
                                        std::size_t equations) {
  const bool one = positions.size() == 1;
  std::vector<std::string> labels, lines;
  for (const Chain& chain : positions) labels.push_back(chain.below[0].label);
  lines.push_back(text("ggl: ", join(labels, ", "), one ? " is" : " are", " differentiated once, and ",
                       one ? "the derivative joins" : "the derivatives join", " the equations as (",
                       equations + 1, "):"));
  for (const Chain& chain : positions)
    lines.push_back(
        text("     ", chain.below[1].label, ":  ", formula("0 = ", ref(chain.below[1].residual))));
  lines.push_back(
      shown_from(Detail::full, text("     That makes ", mu.size(), one ? " equation" : " equations",
                                    " more than unknowns. ", one ? "A new multiplier " : "New multipliers ",
                                    grouped_names(mu), one ? " acts" : " act", " on q′ as z acts on v′:")));
  lines.push_back(text("     ", formula("q′ = v - Cqᵀ μ,  Cq = ∂C/∂q")));
  lines.push_back(shown_from(
      Detail::full,
      text("     On the exact solution ", formula("μ = 0"), ": ", formula("C = 0"), " gives ",
           formula("0 = Cq q′ = Cq v - Cq Cqᵀ μ"), ", the new equation is ", formula("0 = Cq v"), ",")));
  lines.push_back(shown_from(
      Detail::full, text("     and ", formula("Cq Cqᵀ μ = 0"), " implies ", formula("μ = 0"), " where ",
                         formula("Cq"), " has full row rank. So ", formula("q′ = v"), ", as before.")));
  if (const std::string gram = gram_matrix(positions); !gram.empty())
    lines.push_back(shown_from(Detail::every, "     " + gram));
  lines.push_back(shown_from(
      Detail::full, text("     One more differentiation of ", formula("C = 0"), " and ", formula("Cq v = 0"),
                         " contains ", formula("Cq Cqᵀ μ"), " and ", formula("Cq W⁻¹ Cqᵀ z"),
                         ", which determine ", formula("μ"), " and ", formula("z"), ".")));
  lines.push_back(
      "     The index is 2. Both conditions are equations, so nothing drifts. Suited to Radau IIA methods.");
  return lines;
}

}  // namespace

ModelPtr reduce_ggl(const ModelPtr& model) {
  const ModelPtr first = to_first_order(regular_form(original(model)));
  const ModelPtr low = reduce_acc(first);
  if (low == first) refuse_form("ggl", *first, nothing_hidden);
  const std::vector<Chain> positions = position_constraints(*first, *low);
  const std::vector<Expr> mu = new_variables(*first, "mu", positions.size());
  std::vector<Block> blocks = first->blocks;
  const bool scaled = add_multipliers(blocks, *first, positions, mu);
  VecX velocity(static_cast<Index>(positions.size()));
  std::vector<std::string> below;
  for (std::size_t k = 0; k < positions.size(); ++k) {
    velocity[k] = positions[k].below[1].residual;
    below.push_back(positions[k].below[0].label);
  }
  blocks.push_back({VecX::Zero(velocity.size()), velocity, text("d/dt of ", join(below, ", "))});
  ModelOptions options = child_of(first);
  options.form = "ggl";
  options.drift = DriftLaw::none;
  declare_unknowns(options, *first);
  options.z.insert(options.z.end(), mu.begin(), mu.end());
  options.vanishing = mu;
  options.trace = ggl_derivation(positions, mu, first->blocks.size());
  if (scaled)
    options.trace.push_back(text("     Units of q and C are far from 1 here: Cqᵀ ", names_of(mu),
                                 " is multiplied by powers of ten of them, so that ", names_of(mu),
                                 mu.size() == 1 ? " has" : " have", " none."));
  return make_model(std::move(blocks), std::move(options));
}

// ── baumgarte
// ────────────────────────────────────────────────────────────────────────────────────────────────

namespace {

struct Gains {
  Expr alpha, beta;
  bool chosen;     ///< chosen automatically
  Expr time = {};  ///< in that case: the time scale of the model, if far from 1
};

bool contains(const std::vector<Expr>& list, Expr e) {
  return std::find(list.begin(), list.end(), e) != list.end();
}

/// x x″ + x′² for the unknowns of the constraints, with the name v of x′ if it has one. Balancing these terms
/// gives the size of speeds, which x′ = v and v′ = g alone do not determine.
std::vector<Expr> rows_about_speeds(const Model& m, const std::vector<Expr>& constrained) {
  const Substitution known = kinematics(m);
  std::unordered_map<Expr, int> order;
  for (const Variable& v : m.variables) order[v.leaf] = v.order;
  std::vector<Expr> rows;
  for (Expr x : constrained) {
    const auto own = order.find(x);
    if (own == order.end() || own->second == 0) continue;
    const auto named = known.find(derivative_leaf(x));
    const bool renamed = named != known.end() && named->second.is_symbol();
    const Expr speed = renamed ? named->second : derivative_leaf(x);
    if (renamed ? order.count(speed) && order.at(speed) > 0 : own->second > 1)
      rows.push_back(x * derivative_leaf(speed) + pow(speed, Expr(2)));
  }
  return rows;
}

/// The time scale 10ᵏ on which the constrained unknowns change by their own size; 1 if all sizes are near 1.
Expr own_time(const Model& m, const std::vector<Chain>& list) {
  std::vector<Expr> rows = residuals_at_values(m), C, columns;
  for (const Chain& chain : list) C.push_back(chain.below[0].residual);
  std::vector<Expr> constrained;
  for (Expr leaf : leaves(C))
    if (const Symbol& s = symbol_of(leaf); s.kind == Kind::variable && !contains(constrained, s.base))
      constrained.push_back(s.base);
  for (Expr c : at_values(C, m.values)) rows.push_back(c);
  for (Expr row : rows_about_speeds(m, constrained)) rows.push_back(row);
  const Expr t = time_symbol();
  if (const auto inside = leaves(rows); contains(inside, t))  // cos(t/T) tells T, and x′ t is as large as x
    for (Expr x : constrained) rows.push_back(x + derivative_leaf(x) * t);
  for (Expr leaf : leaves(rows))
    if (symbol_of(leaf).kind == Kind::variable || leaf == t) columns.push_back(leaf);
  const NumericArray numeric(rows, columns);
  std::unordered_map<Expr, double> size;  // logarithm to base 10
  for (std::size_t j = 0; j < columns.size(); ++j) size[columns[j]] = std::log10(numeric.unit()[j]);
  std::vector<double> decades;
  for (Expr x : constrained)
    if (const Expr slope = derivative_leaf(x); size.count(x) && size.count(slope))
      decades.push_back(size[x] - size[slope]);
  if (decades.empty()) return Expr(1);
  const auto middle = decades.begin() + static_cast<std::ptrdiff_t>(decades.size() / 2);
  std::nth_element(decades.begin(), middle, decades.end());
  return power_of_ten(static_cast<int>(std::lround(*middle)));
}

Gains gains(const ReduceOptions& options, const Model& m, const std::vector<Chain>& list) {
  constexpr int usual = 10;  // a violation decays within about half a unit of the model's time
  const bool chosen = !options.alpha && !options.beta;
  const Expr time = chosen ? own_time(m, list) : Expr(1);
  const Expr alpha = options.alpha.value_or(options.beta.value_or(Expr(usual) / time));
  const Gains g{alpha, options.beta.value_or(alpha), chosen, time};
  for (const auto& [name, gain] : {std::pair{"alpha", g.alpha}, std::pair{"beta", g.beta}}) {
    if (gain.is_constant() && constant_value(gain) <= 0)
      throw Error(text("form \"baumgarte\": ", name, " = ", to_text(gain),
                       " must be positive: otherwise the violation of a constraint does not decay"));
    if (varies(gain))
      throw Error(text("form \"baumgarte\": ", name, " = ", to_text(gain),
                       " must be a number or made of parameters"));
  }
  return g;
}

/// C⁽ᵏ⁾ + … with the characteristic polynomial s + α, s² + 2αs + β², or (s + α)ᵏ.
Expr stabilised(const Chain& chain, const Gains& g) {
  const std::size_t k = chain.below.size();
  Expr sum = chain.last;
  if (k == 2) {
    sum += 2 * g.alpha * chain.below[1].residual;
    return sum + pow(g.beta, Expr(2)) * chain.below[0].residual;
  }
  long binomial = 1;
  for (std::size_t i = 1; i <= k; ++i) {
    binomial = binomial * static_cast<long>(k - i + 1) / static_cast<long>(i);
    sum += Expr(binomial) * pow(g.alpha, Expr(static_cast<long>(i))) * chain.below[k - i].residual;
  }
  return sum;
}

std::string law(const Chain& chain, const Gains& g) {
  const std::string& C = chain.below[0].label;
  const std::size_t k = chain.below.size();
  const std::string a = to_text(g.alpha), b = to_text(g.beta);
  if (k == 1) return text("0 = ", C, "′ + α ", C, ",  α = ", a);
  if (k == 2) return text("0 = ", C, "″ + 2α ", C, "′ + β² ", C, ",  α = ", a, ", β = ", b);
  return text("0 = (d/dt + α)", superscript(static_cast<long>(k)), " ", C, ",  α = ", a);
}

std::vector<std::string> meaning(const Gains& g) {
  std::vector<std::string> lines;
  lines.push_back(text(
      "     A violation C ≠ 0 decays ",
      g.alpha == g.beta
          ? text("like exp(-α t), with time constant 1/α = ", to_text(1 / g.alpha), " (critical damping)")
          : "like exp(s t) with the roots of s² + 2αs + β² = 0",
      "."));
  lines.push_back(
      text("     Warning: the gains", g.chosen ? ", chosen by default," : "",
           g.time.is_one() ? "" : text(" for a motion in units of ", to_text(g.time), ","),
           " are not part of the physics. Small gains let numerical drift grow; large gains make the "
           "equations stiff, and an explicit method needs α dt well below 2. Choose 1/α as a few "
           "steps, below the time constants of the model. While the violation of an inconsistent "
           "start decays, the multipliers are not those of the mechanism."));
  return lines;
}

}  // namespace

ModelPtr reduce_baumgarte(const ModelPtr& model, const ReduceOptions& request) {
  const ModelPtr source = regular_form(original(model));
  const ModelPtr low = reduce_acc(source);
  const std::vector<Chain> list = chains(*source, *low);
  if (list.empty()) refuse_form("baumgarte", *source, nothing_hidden);
  const Gains g = gains(request, *source, list);
  ModelOptions options = child_of(low);
  options.form = "baumgarte";
  options.drift = DriftLaw::decay;
  options.decay = {g.alpha, g.beta};
  declare_unknowns(options, *low);
  std::vector<Block> blocks = low->blocks;
  for (const Chain& chain : list) {
    Block& block = blocks[chain.block];
    block.rhs[chain.row] = stabilised(chain, g);
    if (block.rewritten.empty())
      block.note = text("(", chain.block + 1, ") stabilised");
    else
      block.rewritten[chain.row] = chain.below[0].label + " stabilised";
    options.trace.push_back((options.trace.empty() ? "baumgarte: " : "     ") + law(chain, g));
  }
  const auto lines = meaning(g);
  options.trace.insert(options.trace.end(), lines.begin(), lines.end());
  return make_model(std::move(blocks), std::move(options));
}

}  // namespace pendula::dae
