#include "dae/regularise/least_norm.hpp"

#include <algorithm>
#include <map>
#include <unordered_set>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/points/implied_constraints.hpp"
#include "dae/rank/rank.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "dae/regularise/cofactors.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

std::vector<Expr> new_unknowns(std::unordered_set<std::string> used, const std::string& name,
                               std::size_t count) {
  const std::string fresh = fresh_name(used, name, name + "_");
  return newly_declared(count == 1 ? std::vector<Expr>{symbol(Kind::variable, fresh)}
                                   : symbol_vector(Kind::variable, fresh, static_cast<int>(count)));
}

/// Σ (∂c/∂qⱼ)² (qⱼ² + sⱼ²): the squared size of a constraint's terms at any position and parameters.
Expr squared_size(Expr c, const std::unordered_map<Expr, double>& sizes) {
  Expr sum(0);
  for (Expr leaf : leaves({&c, 1}))
    if (const auto size = sizes.find(leaf); size != sizes.end()) {
      const Expr slope = partial(c, leaf), s(size->second);
      sum += slope * slope * (leaf * leaf + s * s);
    }
  return sum;
}

}  // namespace

std::vector<double> force_weights(const VecX& q, const std::unordered_map<Expr, double>& units) {
  double largest = 0;
  for (const auto& [leaf, unit] : units) largest = std::max(largest, unit);
  std::vector<double> weights;
  for (Expr leaf : q) {
    const auto unit = units.find(leaf);
    const double decades = unit == units.end() ? 0 : std::round(std::log10(largest / unit->second) - 1);
    weights.push_back(decades > 0 ? std::pow(100.0, -decades) : 1.0);
  }
  return weights;
}

void add_least_norm(const LeastNorm& least, const std::string& note,
                    const std::unordered_set<std::string>& used, std::vector<Block>& blocks,
                    ModelOptions& options) {
  constexpr double failing = 1e-3;  // relative to the terms of a constraint that the others should imply
  const std::vector<Expr> y = new_unknowns(used, "independent", least.columns.size());
  const std::vector<Expr> excess =
      new_unknowns(used, "excess", static_cast<std::size_t>(least.left_out.size()));
  std::map<int, Expr> forces;  // D B_K y
  for (std::size_t k = 0; k < least.columns.size(); ++k)
    for (const Entry& e : least.B)
      if (e.column == least.columns[k]) forces.try_emplace(e.row, Expr(0)).first->second += e.value * y[k];
  VecX z = VecX::Zero(least.z.size());
  for (const Entry& e : least.B)
    if (const auto force = forces.find(e.row); force != forces.end())
      z[e.column] += Expr(least.weights[e.row]) * e.value * force->second;
  blocks.push_back({least.z, z, note});
  blocks.push_back({column(excess), least.left_out, "follows from the others: 0"});
  for (std::size_t k = 0; k < excess.size(); ++k) {
    options.start_values.push_back({excess[k], Expr(0)});
    // beyond a position at which the chosen constraints are dependent they no longer imply the others
    const Expr size = squared_size(least.left_out[k], least.sizes);
    options.events.push_back(
        {excess[k] * excess[k] - Expr(failing * failing) * size, Direction::rising, true, {}});
  }
  for (const auto* made : {&y, &excess})
    if (!options.z.empty() || !options.x.empty())
      options.z.insert(options.z.end(), made->begin(), made->end());
}

namespace {

/// Constraints, the states that they restrict, and the equations that contain their forces.
struct Parts {
  std::vector<Expr> C, q, z;
  std::vector<std::string> labels;  ///< of C
  std::vector<std::size_t> others;  ///< residuals that are no constraints
  std::vector<Entry> B;             ///< ∂others/∂z
};

/// Rows that contain states only are constraints. The unknowns z without derivative enter the other rows.
Parts parts_of(const Model& m) {
  const std::vector<Expr> states = m.states(), z = m.algebraic();
  const std::unordered_set<Expr> is_state(states.begin(), states.end());
  Parts p;
  std::unordered_set<Expr> restricted;
  std::vector<Expr> rest;
  for (std::size_t i = 0; i < m.residuals.size(); ++i) {
    std::vector<Expr> own;
    bool is_constraint = true;
    for (Expr leaf : leaves({&m.residuals[i], 1})) {
      if (symbol_of(leaf).kind != Kind::variable) continue;
      if (is_state.count(leaf))
        own.push_back(leaf);
      else
        is_constraint = false;
    }
    if (is_constraint && !own.empty()) {
      p.C.push_back(m.residuals[i]);
      p.labels.push_back(m.label(i));
      restricted.insert(own.begin(), own.end());
    } else {
      p.others.push_back(i);
      rest.push_back(m.residuals[i]);
    }
  }
  for (Expr leaf : states)
    if (restricted.count(leaf)) p.q.push_back(leaf);
  p.z = z;
  p.B = sparse_jacobian(rest, z);
  return p;
}

Parts parts_of_mechanism(const Model& m) {
  const Mechanics& mech = *m.mechanics;
  Parts p;
  p.C.assign(mech.C.begin(), mech.C.end());
  p.q.assign(mech.q.begin(), mech.q.end());
  p.z.assign(mech.multipliers.begin(), mech.multipliers.end());
  for (Index i = 0; i < mech.q.size(); ++i) p.others.push_back(static_cast<std::size_t>(i));
  for (const Entry& e : mech.dCdq) p.B.push_back({e.column, e.row, e.value});
  return p;
}

[[noreturn]] void refuse(const ConstraintRank& found, std::size_t count) {
  using Verdict = ConstraintRank::Verdict;
  if (found.verdict == Verdict::no_position)
    throw Failure("no position near these values satisfies the constraints; give other values in guess");
  if (found.verdict == Verdict::independent)
    throw Failure(text("the gradients of the ", count,
                       " constraints are independent at this position; the model can be used as it is"));
  throw Failure(text("the gradients of the constraints have rank ", found.rank, " of ", count,
                     " at this position and ", found.beside,
                     " nearby: it is singular, and no constraint is redundant; give another one"));
}

/// Independent columns of B, evaluated at the given point or at random values. If z and constraints
/// correspond in number and order, as for B = (∂C/∂q)ᵀ, the columns of the kept constraints are taken, so
/// that both become dependent at the same positions.
std::vector<int> independent_columns(const Parts& p, const ParameterValues& values,
                                     const std::unordered_map<Expr, double>& at,
                                     const std::vector<int>& kept) {
  std::vector<Expr> slopes;
  for (const Entry& e : p.B) slopes.push_back(e.value);
  slopes = at_values(slopes, values);
  auto point = random_point(slopes, 0);
  for (auto& [leaf, value] : point)
    if (const auto it = at.find(leaf); it != at.end()) value = it->second;
  const auto numbers = pendula::evaluate(slopes, point);
  Mat B = Mat::Zero(static_cast<Index>(p.others.size()), static_cast<Index>(p.z.size()));
  for (std::size_t k = 0; k < p.B.size(); ++k) B(p.B[k].row, p.B[k].column) = numbers[k];
  const Mat scaled = equilibrated(B);
  const int rank = rank_with_gap(B).rank;
  if (p.z.size() == p.C.size() && static_cast<int>(kept.size()) == rank &&
      rank_with_gap(B(Eigen::all, kept)).rank == rank)
    return kept;
  const Eigen::ColPivHouseholderQR<Mat> qr(scaled);
  std::vector<int> columns;
  for (Index k = 0; k < rank; ++k) columns.push_back(static_cast<int>(qr.colsPermutation().indices()[k]));
  std::sort(columns.begin(), columns.end());
  return columns;
}

/// The equations that are not constraints, with the options of the model for their unknowns.
ModelOptions without_constraints(const Model& m, const Parts& p, std::vector<Block>& blocks,
                                 std::unordered_set<std::string>& used) {
  std::unordered_set<Expr> known;
  const auto knows = [&](Expr e) {
    const auto inside = leaves({&e, 1});
    return std::all_of(inside.begin(), inside.end(),
                       [&](Expr leaf) { return known.count(symbol_of(leaf).base); });
  };
  std::vector<Expr> rows = p.C;
  for (std::size_t i : p.others) {
    const auto [block, row] = m.origin[i];
    const Block& own = m.blocks[block];
    blocks.push_back(
        {VecX::Constant(1, own.lhs[row]), VecX::Constant(1, own.rhs[row]), row == 0 ? own.note : ""});
    rows.push_back(m.residuals[i]);
  }
  for (Expr leaf : leaves(rows)) {
    known.insert(symbol_of(leaf).base);
    used.insert({symbol_of(leaf).name, symbol_of(leaf).vector});
  }
  ModelOptions options;
  options.name = m.name;
  options.values = m.values;
  for (const Transition& event : m.events)
    if (knows(event.when)) options.events.push_back(event);
  for (const auto& [from, to] : {std::pair{&m.start_values, &options.start_values},
                                 std::pair{&m.start_guesses, &options.start_guesses}})
    for (const auto& value : *from)
      if (knows(value.first)) to->push_back(value);
  return options;
}

void require_linear(const Parts& p) {
  for (const Entry& e : p.B)
    for (Expr leaf : leaves({&e.value, 1}))
      if (std::find(p.z.begin(), p.z.end(), leaf) != p.z.end())
        throw Error(text("'", to_text(leaf), "' enters the equations nonlinearly; forces of least norm ",
                         "are defined for multipliers that enter linearly"));
}

}  // namespace

ModelPtr independent(const ModelPtr& model, const std::unordered_map<Expr, double>& near) {
  const Model& m = *model;
  const Parts p = m.mechanics ? parts_of_mechanism(m) : parts_of(m);
  if (p.C.empty() || p.z.empty())
    throw Error(
        "expected a model made by lagrange{ …, C = { … } }, or by dae{ … } with equations 0 = C(q) "
        "between its states and unknowns without derivative in the others");
  const ConstraintRank found = ConstraintPositions(p.C, p.q, m.values).near(near);
  if (found.verdict != ConstraintRank::Verdict::implied) refuse(found, p.C.size());
  require_linear(p);
  LeastNorm least{column(p.z), p.B, {}, {}, {}, found.sizes};
  if (m.mechanics) {  // forces act along the gradients: B = (∂C/∂q)ᵀ
    least.columns = found.kept;
    least.weights = force_weights(m.mechanics->q, found.units);
  } else {
    least.columns = independent_columns(p, m.values, found.position, found.kept);
    least.weights.assign(p.others.size(), 1.0);
  }
  const std::size_t open = p.z.size() - least.columns.size(), redundant = p.C.size() - found.kept.size();
  if (open != redundant)
    throw Failure(text("", redundant, " of the ", p.C.size(), " constraints follow from the others, but ",
                       "the equations leave ", open, " combinations of ", names_of(p.z), " open"));
  std::vector<Block> blocks;
  std::unordered_set<std::string> used;
  ModelOptions options = without_constraints(m, p, blocks, used);
  std::vector<Expr> kept, rest;
  for (std::size_t i = 0; i < p.C.size(); ++i) {
    const bool stays =
        std::find(found.kept.begin(), found.kept.end(), static_cast<int>(i)) != found.kept.end();
    (stays ? kept : rest).push_back(p.C[i]);
  }
  least.left_out = column(rest);
  add_least_norm(least,
                 text("z of least norm; gradients of the constraints: rank ", found.rank, " of ", p.C.size()),
                 used, blocks, options);
  blocks.push_back({VecX::Zero(static_cast<Index>(kept.size())), column(kept), ""});
  options.dependent = model;
  return make_model(std::move(blocks), std::move(options));
}

DependentConstraints dependent_constraints(const Model& m) {
  if (m.mechanics) return {m.mechanics->C, m.mechanics->q, m.mechanics->dCdq, m.mechanics->M};
  const Parts p = parts_of(m);
  DependentConstraints all{column(p.C), column(p.q), sparse_jacobian(p.C, p.q), {}};
  if (p.C.empty()) return all;
  const Vec unit = ConstraintPositions(p.C, p.q, m.values).units();
  for (int j = 0; j < static_cast<int>(p.q.size()); ++j)
    all.M.push_back({j, j, Expr(1 / (unit[j] * unit[j]))});
  return all;
}

std::vector<Expr> multipliers_of(const Model& m) {
  const Parts p = m.mechanics ? parts_of_mechanism(m) : parts_of(m);
  return p.C.size() < 2 ? std::vector<Expr>{} : p.z;
}

std::string why_forces_are_open(const Model& m) {
  const Parts p = parts_of(m);
  if (p.C.size() < 2 || p.z.empty()) return "";
  const ConstraintRank found = ConstraintPositions(p.C, p.q, m.values).anywhere();
  if (found.verdict != ConstraintRank::Verdict::implied) return "";
  std::vector<Expr> rest = p.C;
  std::vector<std::string> labels = p.labels, proofs;
  for (std::size_t at = rest.size(); at-- > 0 && static_cast<int>(rest.size()) > found.rank;) {
    std::vector<Expr> others = rest;
    std::vector<std::string> names = labels;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(at));
    names.erase(names.begin() + static_cast<std::ptrdiff_t>(at));
    const auto factors = cofactors(rest[at], others);
    if (!factors) continue;
    proofs.push_back(labels[at] + " = " + combination_text(*factors, names));
    rest = std::move(others);
    labels = std::move(names);
  }
  if (static_cast<int>(rest.size()) > found.rank)
    proofs.push_back(text("the gradients of ", join(labels, ", "), " have rank ", found.rank, " of ",
                          rest.size(), " where these hold"));
  return text("the constraints ", join(p.labels, ", "), " follow from each other: ", join(proofs, "; "),
              ". Their multipliers, ", names_of(p.z),
              ", are not unique, though the motion may be: sys:independent{ guess = … } ",
              "has the forces of least norm");
}

}  // namespace pendula::dae
