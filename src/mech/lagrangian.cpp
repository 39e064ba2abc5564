#include "mech/lagrangian.hpp"

#include <algorithm>
#include <unordered_set>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/make_model.hpp"
#include "dae/rank/rank.hpp"
#include "dae/regularise/least_norm.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "mech/redundancy.hpp"

namespace pendula::mech {
VecX dot(const VecX& q, int order) {
  return q.unaryExpr([=](Expr e) { return derivative_leaf(e, order); });
}

namespace {

using Index = Eigen::Index;

using Set = std::unordered_set<Expr>;

Set set_of(const VecX& v) { return {v.begin(), v.end()}; }

std::vector<Entry> simplified(std::vector<Entry> list) {
  for (Entry& e : list) e.value = simplify(e.value);
  std::erase_if(list, [](const Entry& e) { return e.value.is_zero(); });
  return list;
}

VecX gradient_column(Expr e, const VecX& x) { return column(gradient(e, entries(x))); }

void check_coordinates(const Lagrangian& s) {
  if (s.q.size() == 0)
    throw Error("q is empty; give the generalised coordinates: q = { theta, x } or q = var(\"q\", 6)");
  std::unordered_set<Expr> seen;
  for (Expr q : s.q) {
    if (!q.is_symbol() || symbol_of(q).kind != Kind::variable || symbol_of(q).order != 0)
      throw Error(text("q must contain variables (var \"x\"), got '", to_text(q), "'"));
    if (!seen.insert(q).second) throw Error(text("'", to_text(q), "' occurs twice in q"));
  }
}

void check_energies(const Lagrangian& s) {
  const Set coordinates = set_of(s.q);
  if (!depends_on_any(s.T, set_of(dot(s.q))))
    throw Error(text("T = ", to_text(s.T),
                     " contains no velocity; kinetic energy is made of q.dot, for example m/2*x.dot^2"));
  const Expr energies[] = {s.T, s.V};
  for (Expr leaf : leaves(energies)) {
    const Symbol& sym = symbol_of(leaf);
    if (sym.kind != Kind::variable) continue;
    if (!coordinates.count(sym.base))
      throw Error(text("the energies contain '", to_text(leaf), "', but '", sym.name,
                       "' is not in q; add it to q, or make it an input or a parameter"));
    if (sym.order > 1)
      throw Error(text("the energies contain '", to_text(leaf), "'; they may depend on q, q.dot and t only"));
  }
}

void check_constraints(const Lagrangian& s) {
  const Set coordinates = set_of(s.q), velocities = set_of(dot(s.q));
  for (Index i = 0; i < s.C.size(); ++i) {
    const Expr c = s.C[i];
    if (!depends_on_any(c, coordinates))
      throw Error(text("constraint C[", i + 1, "] = ", to_text(c),
                       " depends on no coordinate of q; C(q) = 0 has to restrict q"));
    if (depends_on_any(c, velocities))
      throw Error(text("constraint C[", i + 1, "] = ", to_text(c),
                       " contains velocities; only C(q) = 0 has a multiplier of this "
                       "kind. Write the equations with dae{ … }"));
  }
}

/// The rows of ∂C/∂q that belong to the given constraints.
std::vector<Entry> rows_of(const std::vector<Entry>& dCdq, const std::vector<int>& constraints) {
  std::vector<Entry> part;
  for (const Entry& e : dCdq)
    if (const auto at = std::find(constraints.begin(), constraints.end(), e.row); at != constraints.end())
      part.push_back({static_cast<int>(at - constraints.begin()), e.column, e.value});
  return part;
}

/// W must be regular on ker ∂C/∂q, which is equivalent to [W Cqᵀ; Cq 0] being regular if the m rows of
/// Cq are independent.
void check_mass(const Lagrangian& s, const std::vector<Entry>& M, const std::vector<Entry>& dCdq, int m) {
  const auto n = static_cast<int>(s.q.size());
  std::vector<Entry> list = M;
  for (const Entry& e : dCdq) {
    list.push_back({n + e.row, e.column, e.value});
    list.push_back({e.column, n + e.row, e.value});
  }
  if (dae::generic_rank(list, n + m, n + m).rank == n + m) return;
  const MatX K = dae::dense(list, n + m, n + m);
  const Mat value = dae::evaluate(K, dae::random_point(entries(K), 0));
  const Mat N = dae::null_space(value);
  std::vector<std::string> free;
  // entries of unit vectors; those of the null space err by ε times a condition
  constexpr double rounding = 1e-9;
  for (int i = 0; i < n; ++i)
    if (N.cols() && N.row(i).norm() > rounding) free.push_back(to_text(s.q[i]));
  throw Error(text("the mass matrix is singular", m ? " on the directions the constraints leave free" : "",
                   ": the kinetic energy is 0 for a motion of ", join(free, ", "), ". Give it a mass in T",
                   m ? ", or constrain it" : "", "; massless coordinates must be determined by constraints"));
}

VecX multipliers(const Lagrangian& s) {
  const auto m = static_cast<int>(s.C.size());
  if (m == 0) return {};
  std::vector<Expr> used(s.C.begin(), s.C.end());
  used.insert(used.end(), {s.T, s.V});
  used.insert(used.end(), s.Q.begin(), s.Q.end());
  for (Expr leaf : leaves(used))
    if (symbol_of(leaf).name == s.multipliers || (m > 1 && symbol_of(leaf).vector == s.multipliers))
      throw Error(text("'", s.multipliers,
                       "' names the multipliers, but the model uses it already; choose another name: "
                       "multipliers = \"lambda\""));
  if (m == 1) return column(newly_declared({symbol(Kind::variable, s.multipliers)}));
  return column(newly_declared(symbol_vector(Kind::variable, s.multipliers, m)));
}

/// Redundant constraints make z non-unique; adds the equations that select the z of least norm.
void add_conditions_on_multipliers(const Lagrangian& s, const dae::Mechanics& mech,
                                   const Redundancy& redundant, std::vector<dae::Block>& blocks,
                                   dae::ModelOptions& options) {
  if (redundant.rest.empty()) {
    for (std::size_t k = 0; k < redundant.combination.size(); ++k)
      blocks.push_back({VecX::Zero(1), VecX::Constant(1, redundant.combination[k].dot(mech.multipliers)),
                        redundant.follows[k] + ": z of least norm, " + redundant.proofs[k]});
    return;
  }
  dae::LeastNorm least{mech.multipliers,    {},
                       redundant.kept,      dae::force_weights(s.q, redundant.units),
                       s.C(redundant.rest), redundant.sizes};
  for (const Entry& e : mech.dCdq) least.B.push_back({e.column, e.row, e.value});
  std::vector<Expr> used(s.C.begin(), s.C.end());
  used.insert(used.end(), {s.T, s.V});
  used.insert(used.end(), s.Q.begin(), s.Q.end());
  std::unordered_set<std::string> names{s.multipliers};
  for (Expr leaf : leaves(used)) names.insert({symbol_of(leaf).name, symbol_of(leaf).vector});
  std::string note = "z of least norm";
  for (const std::string& proof : redundant.proofs) note += "; " + proof;
  dae::add_least_norm(least, note + redundant.ranks, names, blocks, options);
}

}  // namespace

dae::ModelPtr lagrange(const Lagrangian& s) {
  check_coordinates(s);
  check_energies(s);
  check_constraints(s);
  const Index n = s.q.size();
  if (s.Q.size() && s.Q.size() != n)
    throw Error(text("Q has ", s.Q.size(), " rows, but there are ", n,
                     " coordinates in q; see generalized_force(q, { {p, F} })"));
  dae::Mechanics mech;
  mech.q = s.q;
  mech.T = s.T;
  mech.V = s.V;
  mech.forces = s.forces;
  mech.C = s.C;
  mech.Q = s.Q.size() ? s.Q : VecX(VecX::Zero(n));
  const VecX v = dot(s.q), a = dot(s.q, 2);
  const Expr L = s.T - s.V;
  const VecX momentum = gradient_column(L, v);                          // ∂L/∂q′
  mech.M = simplified(sparse_jacobian(entries(momentum), entries(v)));  // W = ∂²L/∂q′²
  Substitution at_rest;
  for (Expr leaf : a) at_rest[leaf] = Expr(0);
  mech.rhs = VecX(n);
  const VecX slope = gradient_column(L, s.q);
  for (Index i = 0; i < n; ++i)  // d/dt ∂L/∂q′ = W q″ + (terms without q″)
    mech.rhs[i] = simplify(mech.Q[i] + slope[i] - substitute(total_derivative(momentum[i]), at_rest));
  mech.dCdq = simplified(sparse_jacobian(entries(s.C), entries(s.q)));
  mech.multipliers = multipliers(s);
  const Redundancy redundant = redundancy(s.C, s.q, mech.dCdq);
  check_mass(s, mech.M, rows_of(mech.dCdq, redundant.kept), static_cast<int>(redundant.kept.size()));

  const auto count = static_cast<Index>(redundant.kept.size());
  VecX left = VecX::Zero(n);
  for (const Entry& e : mech.M) left[e.row] += e.value * a[e.column];
  for (const Entry& e : mech.dCdq) left[e.column] += e.value * mech.multipliers[e.row];
  std::vector<dae::Block> blocks{{left, mech.rhs, ""}};
  dae::ModelOptions options;
  options.name = s.name;
  options.x.assign(s.q.begin(), s.q.end());
  options.z.assign(mech.multipliers.begin(), mech.multipliers.end());
  add_conditions_on_multipliers(s, mech, redundant, blocks, options);
  if (s.C.size()) blocks.push_back({VecX::Zero(count), s.C(redundant.kept), ""});
  options.mechanics = std::move(mech);
  return dae::make_model(std::move(blocks), std::move(options));
}

VecX generalized_force(const VecX& q, const std::vector<std::pair<VecX, VecX>>& forces) {
  VecX Q = VecX::Zero(q.size());
  for (std::size_t k = 0; k < forces.size(); ++k) {
    const auto& [p, F] = forces[k];
    if (p.size() != F.size())
      throw Error(text("pair ", k + 1, ": the point has ", p.size(), " components, the force ", F.size()));
    Q += jacobian(entries(p), entries(q)).transpose() * F;  // δW = Fᵀ δp = Fᵀ (∂p/∂q) δq
  }
  return Q;
}

MatrixForm matrix_form(const dae::Mechanics& mech) {
  const Index n = mech.q.size(), m = mech.C.size();
  MatrixForm form{MatX::Zero(n + m, n + m), VecX(n + m), VecX(n + m)};
  form.A.topLeftCorner(n, n) = dae::dense(mech.M, n, n);
  form.A.bottomLeftCorner(m, n) = dae::dense(mech.dCdq, m, n);
  form.A.topRightCorner(n, m) = form.A.bottomLeftCorner(m, n).transpose();
  form.unknowns << dot(mech.q, 2), mech.multipliers;
  form.c.head(n) = mech.rhs;
  Substitution at_rest;
  for (Expr leaf : dot(mech.q, 2)) at_rest[leaf] = Expr(0);
  for (Index i = 0; i < m; ++i)  // C″ = Cq q″ + (velocity terms)
    form.c[n + i] = -simplify(substitute(total_derivative(mech.C[i], 2), at_rest));
  return form;
}

std::string describe(const MatrixForm& form) {
  const auto lines = [](const MatX& m) {
    std::vector<std::string> out(1);
    for (char c : matrix_to_text(m))
      if (c == '\n')
        out.emplace_back();
      else
        out.back() += c;
    if (out.back().empty()) out.pop_back();
    return out;
  };
  const auto A = lines(form.A), x = lines(form.unknowns), c = lines(form.c);
  Table table;
  for (std::size_t i = 0; i < A.size(); ++i) table.row({A[i], x[i], i == A.size() / 2 ? "=" : "", c[i]});
  std::string out = table.str();
  return out.substr(0, out.size() - 1);
}

}  // namespace pendula::mech
