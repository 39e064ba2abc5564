#include "mech/redundancy.hpp"

#include <algorithm>
#include <optional>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/points/implied_constraints.hpp"
#include "dae/rank/rank.hpp"
#include "dae/regularise/cofactors.hpp"
#include "dae/regularise/null_vectors.hpp"
#include "expr/generic/generic.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::mech {
namespace {

using Index = Eigen::Index;

class Dependence {
 public:
  Dependence(const VecX& C, const VecX& q, const std::vector<Entry>& dCdq)
      : C_(C), dCdq_(dCdq), columns_(static_cast<int>(q.size())) {}

  bool depend(const std::vector<int>& rows) const {
    std::vector<Entry> part;
    for (const Entry& e : dCdq_)
      if (const auto at = std::find(rows.begin(), rows.end(), e.row); at != rows.end())
        part.push_back({static_cast<int>(at - rows.begin()), e.column, e.value});
    const auto count = static_cast<int>(rows.size());
    return dae::generic_rank(part, count, columns_).rank < count;
  }

  /// Removes rows on which the dependence of the last row does not rely.
  std::vector<int> least(std::vector<int> rows) const {
    for (std::size_t k = rows.size() - 1; k-- > 0;) {
      std::vector<int> fewer = rows;
      fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(k));
      if (depend(fewer)) rows = std::move(fewer);
    }
    return rows;
  }

  /// The vector λ with λᵀ ∂C/∂q = 0 for dependent rows, scaled to 1 at the last row; nothing if
  /// λ contains coordinates.
  std::optional<VecX> combination(const std::vector<int>& rows) const {
    std::vector<Expr> factors{Expr(1)};
    if (rows.size() > 1) {
      if (!may_be_constant(rows)) return {};
      const auto u = dae::null_vector_of(dCdq_, rows, columns_);
      if (!u) return {};
      factors = dae::scaled(*u, rows.size() - 1).u;
    }
    VecX lambda = VecX::Zero(C_.size());
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const Expr factor = simplify(factors[k]);
      for (Expr leaf : leaves({&factor, 1}))
        if (const Kind kind = symbol_of(leaf).kind; kind != Kind::parameter && kind != Kind::constant)
          return {};
      lambda[rows[k]] = factor;
    }
    return lambda;
  }

 private:
  /// Does λ, scaled to 1 at the last of these rows, have the same value at two random positions? Tested with
  /// numbers because a λ that depends on the position may be a very long expression: 10 distances of 5 points
  /// in space. True also if the numbers are not finite.
  bool may_be_constant(const std::vector<int>& rows) const {
    // λ errs by ε times a condition number; one that depends on the position differs by about 1
    constexpr double equal = 1e-6;
    std::vector<Expr> slopes;
    for (const Entry& e : dCdq_) slopes.push_back(e.value);
    auto point = dae::random_point(slopes, 0);
    const Vec first = combination_at(rows, slopes, point), scale = first.cwiseAbs().cwiseMax(1);
    for (const auto& [leaf, value] : dae::random_point(slopes, 1))
      if (symbol_of(leaf).kind != Kind::parameter) point[leaf] = value;
    const Vec second = combination_at(rows, slopes, point);
    return !first.allFinite() || !second.allFinite() ||
           (first - second).cwiseQuotient(scale).lpNorm<Eigen::Infinity>() < equal;
  }

  Vec combination_at(const std::vector<int>& rows, const std::vector<Expr>& slopes,
                     const std::unordered_map<Expr, double>& point) const {
    const std::vector<double> values = evaluate(slopes, point);
    Mat J = Mat::Zero(C_.size(), columns_);
    for (std::size_t k = 0; k < values.size(); ++k) J(dCdq_[k].row, dCdq_[k].column) = values[k];
    if (!J.allFinite()) return Vec::Constant(static_cast<Index>(rows.size()), NAN);
    const Mat others = J(std::vector<int>(rows.begin(), rows.end() - 1), Eigen::all).transpose();
    Vec lambda = Vec::Ones(static_cast<Index>(rows.size()));
    lambda.head(others.cols()) =
        others.completeOrthogonalDecomposition().solve(Vec(-J.row(rows.back()).transpose()));
    return lambda;
  }

  const VecX& C_;
  const std::vector<Entry>& dCdq_;
  int columns_;
};

std::string name_of(int constraint) { return "C" + subscript(constraint + 1); }

/// "C₁, C₃ … C₇" of ascending numbers.
std::string names_of(const std::vector<int>& rows) {
  std::string names;
  for (std::size_t first = 0; first < rows.size();) {
    std::size_t last = first;
    while (last + 1 < rows.size() && rows[last + 1] == rows[last] + 1) ++last;
    if (last < first + 2) last = first;
    names += (names.empty() ? "" : ", ") + name_of(rows[first]);
    if (last > first) names += " … " + name_of(rows[last]);
    first = last + 1;
  }
  return names;
}

/// Records that C_k is a combination of other constraints with the factors λ, λ_k = 1.
void note_combination(int k, const VecX& lambda, Redundancy& found) {
  std::vector<int> others;
  std::vector<Expr> factors;
  std::vector<std::string> names;
  for (int j = 0; j < static_cast<int>(lambda.size()); ++j) {
    if (j == k || lambda[j].is_zero()) continue;
    others.push_back(j);
    names.push_back(name_of(j));
    factors.push_back(simplify(-lambda[j]));
  }
  found.combination.push_back(lambda);
  found.follows.push_back(name_of(k) + " follows from " + names_of(others));
  found.proofs.push_back(name_of(k) + " = " + dae::combination_text(factors, names));
}

/// Redundancy of the gradients at generic coordinates.
struct Generic {
  std::vector<int> independent, deferred;  ///< deferred: dependent rows whose factors contain coordinates
};

Generic generic_redundancy(const VecX& C, const Dependence& dependence, Redundancy& found) {
  Generic result;
  const auto m = static_cast<int>(C.size());
  for (int i = 0; i < m; ++i) result.independent.push_back(i);
  if (!dependence.depend(result.independent)) return result;
  result.independent.clear();
  for (int i = 0; i < m; ++i) {
    std::vector<int> rows = result.independent;
    rows.push_back(i);
    if (!dependence.depend(rows)) {
      result.independent = rows;
      continue;
    }
    rows = dependence.least(rows);
    const auto lambda = dependence.combination(rows);
    if (!lambda) {
      result.deferred.push_back(i);
      continue;
    }
    const Expr rest = simplify(lambda->dot(C));
    const std::vector<int> others(rows.begin(), rows.end() - 1);
    if (!generic::is_zero(rest))
      throw Error(text("constraint C[", i + 1, "] = ", to_text(C[i]), " contradicts ", names_of(others),
                       ": together they say 0 = ", to_text(rest)));
    note_combination(i, *lambda, found);
  }
  return result;
}

std::vector<Expr> pick(const VecX& v, const std::vector<int>& numbers) {
  std::vector<Expr> out;
  for (int i : numbers) out.push_back(v[i]);
  return out;
}

/// Constraints that share coordinates, directly or through other constraints.
struct Group {
  std::vector<int> constraints, coordinates;
};
std::vector<Group> coupled(const std::vector<int>& rows, const std::vector<Entry>& dCdq) {
  std::vector<Group> groups;
  for (int i : rows) {
    Group own{{i}, {}};
    for (const Entry& e : dCdq)
      if (e.row == i) own.coordinates.push_back(e.column);
    for (std::size_t g = groups.size(); g-- > 0;) {
      const std::vector<int>& theirs = groups[g].coordinates;
      if (std::none_of(own.coordinates.begin(), own.coordinates.end(),
                       [&](int j) { return std::find(theirs.begin(), theirs.end(), j) != theirs.end(); }))
        continue;
      own.constraints.insert(own.constraints.end(), groups[g].constraints.begin(),
                             groups[g].constraints.end());
      own.coordinates.insert(own.coordinates.end(), theirs.begin(), theirs.end());
      groups.erase(groups.begin() + static_cast<std::ptrdiff_t>(g));
    }
    for (auto* list : {&own.constraints, &own.coordinates}) {
      std::sort(list->begin(), list->end());
      list->erase(std::unique(list->begin(), list->end()), list->end());
    }
    groups.push_back(std::move(own));
  }
  return groups;
}

/// Removes up to `count` constraints from the group that are combinations of the remaining ones, beginning
/// with the last.
void take_combinations(const VecX& C, Group& group, int count, Redundancy& found) {
  for (std::size_t at = group.constraints.size(); at-- > 0 && count > 0;) {
    std::vector<int> others = group.constraints;
    const int k = others[at];
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(at));
    const auto factors = dae::cofactors(C[k], pick(C, others));
    if (!factors) continue;
    VecX lambda = VecX::Zero(C.size());
    lambda[k] = Expr(1);
    for (std::size_t j = 0; j < others.size(); ++j) lambda[others[j]] = -(*factors)[j];
    note_combination(k, lambda, found);
    group.constraints = std::move(others);
    --count;
  }
}

dae::ConstraintPositions positions(const VecX& C, const VecX& q, const Group& group) {
  const std::vector<Expr> part = pick(C, group.constraints);
  dae::ParameterValues values;
  for (Expr leaf : leaves(part))
    if (const Symbol& s = symbol_of(leaf); s.kind == Kind::parameter && s.value) values[leaf] = *s.value;
  return {part, pick(q, group.coordinates), values};
}

/// Determines the redundancy of a group at positions that satisfy its constraints.
void redundancy_of(const VecX& C, const VecX& q, Group group, const std::vector<int>& deferred,
                   Redundancy& found) {
  using Verdict = dae::ConstraintRank::Verdict;
  dae::ConstraintRank rank = positions(C, q, group).anywhere();
  if (rank.verdict == Verdict::implied) {
    const std::size_t count = group.constraints.size();
    take_combinations(C, group, static_cast<int>(count) - rank.rank, found);
    const int left = static_cast<int>(group.constraints.size());
    if (left > rank.rank && group.constraints.size() < count)
      rank = positions(C, q, group).near(rank.position);
  }
  if (rank.verdict != Verdict::implied || static_cast<int>(group.constraints.size()) == rank.rank) {
    for (int i : group.constraints)
      if (rank.verdict != Verdict::implied &&
          std::find(deferred.begin(), deferred.end(), i) != deferred.end())
        throw Error(text("constraint C[", i + 1, "] = ", to_text(C[i]),
                         " is redundant or contradicts others of ", names_of(group.constraints),
                         ": its gradient depends on theirs, with factors that contain coordinates, ",
                         rank.verdict == Verdict::no_position
                             ? "and no position that satisfies all was found"
                             : "and at the positions found it follows from none",
                         ". Remove it from C"));
    found.kept.insert(found.kept.end(), group.constraints.begin(), group.constraints.end());
    return;
  }
  std::vector<int> kept;
  for (int i : rank.kept) kept.push_back(group.constraints[i]);
  for (int k : group.constraints)
    if (std::find(kept.begin(), kept.end(), k) == kept.end()) found.rest.push_back(k);
  found.sizes.merge(rank.sizes);
  found.units.merge(rank.units);
  found.ranks += text("; gradients of ", names_of(group.constraints), ": rank ", rank.rank, " of ",
                      group.constraints.size(), " where they hold");
  found.kept.insert(found.kept.end(), kept.begin(), kept.end());
}

}  // namespace

Redundancy redundancy(const VecX& C, const VecX& q, const std::vector<Entry>& dCdq) {
  Redundancy found;
  const Generic generic = generic_redundancy(C, Dependence(C, q, dCdq), found);
  std::vector<int> rows = generic.independent;
  rows.insert(rows.end(), generic.deferred.begin(), generic.deferred.end());
  std::sort(rows.begin(), rows.end());
  for (Group& group : coupled(rows, dCdq)) redundancy_of(C, q, std::move(group), generic.deferred, found);
  std::sort(found.kept.begin(), found.kept.end());
  return found;
}

}  // namespace pendula::mech
