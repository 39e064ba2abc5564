#include "integrate/problem/active_subsystem.hpp"

#include <algorithm>
#include <unordered_map>

#include "dae/model/first_order.hpp"
#include "dae/structure/sigma.hpp"

namespace pendula::integrate {
namespace {

/// Groups (i, entry) pairs sorted by entry: the entries of i are those from start[i] to start[i + 1].
void group(int count, const std::vector<std::pair<int, int>>& pairs, std::vector<int>& start,
           std::vector<int>& entries) {
  start.assign(static_cast<std::size_t>(count) + 1, 0);
  for (const auto& pair : pairs) ++start[pair.first + 1];
  for (std::size_t k = 1; k < start.size(); ++k) start[k] += start[k - 1];
  std::vector<int> next(start.begin(), start.end() - 1);
  entries.resize(pairs.size());
  for (const auto& [i, entry] : pairs) entries[next[i]++] = entry;
}

std::span<const int> of(const std::vector<int>& start, const std::vector<int>& entries, int i) {
  const auto k = static_cast<std::size_t>(i);
  return std::span(entries).subspan(static_cast<std::size_t>(start[k]),
                                    static_cast<std::size_t>(start[k + 1] - start[k]));
}

/// Pairs every x′ᵢ and zⱼ with an equation; empty if that is not possible.
std::vector<int> paired(int n, int N, const dae::Signature& determines) {
  const dae::Offsets offsets = dae::offsets(determines, N);
  if (!offsets.unmatched.empty() || n > N) return {};
  std::vector<int> unknown_of(static_cast<std::size_t>(N), -1);
  for (int j = 0; j < N; ++j) unknown_of[offsets.equation_of[j]] = j;
  return unknown_of;
}

}  // namespace

std::shared_ptr<const DependencyGraph> DependencyGraph::of(const Problem& problem, int modes, int least) {
  const dae::FirstOrder& model = problem.model();
  const int n = problem.n(), N = n + problem.m();
  if (N < least || modes > 0 || !model.u.empty() || problem.projects() || problem.visible_n() != n)
    return nullptr;
  struct Role {
    int unknown;
    bool determined;  ///< by the equation in which it occurs
  };
  std::unordered_map<Expr, Role> roles;
  for (int i = 0; i < n; ++i) {
    roles[model.x[i]] = {i, false};
    roles[model.xdot[i]] = {i, true};
  }
  for (int j = n; j < N; ++j) roles[model.z[j - n]] = {j, true};
  auto result = std::make_shared<DependencyGraph>();
  std::vector<std::pair<int, int>> contains, users;
  dae::Signature determines(static_cast<std::size_t>(N));
  for (int row = 0; row < N; ++row) {
    bool free = true;
    std::vector<int> inside;
    std::vector<int>& own = inside;
    for (Expr leaf : leaves({&model.F[row], 1})) {
      free = free && leaf != time_symbol();
      const auto role = roles.find(leaf);
      if (role == roles.end()) continue;
      own.push_back(role->second.unknown);
      if (role->second.determined) determines[row].push_back({role->second.unknown, 0});
    }
    std::sort(own.begin(), own.end());
    own.erase(std::unique(own.begin(), own.end()), own.end());
    for (int unknown : own) {
      contains.emplace_back(row, unknown);
      users.emplace_back(unknown, row);
    }
    auto& list = determines[row];
    std::sort(list.begin(), list.end(), [](const auto& a, const auto& b) { return a.variable < b.variable; });
    result->free_.push_back(free);
  }
  result->unknown_of_ = paired(n, N, determines);
  if (result->unknown_of_.empty()) return nullptr;
  group(N, contains, result->row_start_, result->unknowns_);
  group(N, users, result->user_start_, result->users_);
  return result;
}

std::vector<int> DependencyGraph::order(Problem& problem, const Point& point, int& active) const {
  const int n = problem.n();
  std::vector<double> residual(unknown_of_.size());
  problem.set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
  problem.residual(residual.data());
  std::vector<char> seen(unknown_of_.size(), 0);
  std::vector<int> order;
  for (int row = 0; row < size(); ++row) {
    const auto k = static_cast<std::size_t>(row);
    bool rests = free_[k] && residual[k] == 0;
    for (int j : integrate::of(row_start_, unknowns_, row)) rests = rests && (j >= n || point.xdot[j] == 0);
    if (!rests) {
      seen[k] = 1;
      order.push_back(row);
    }
  }
  active = static_cast<int>(order.size());
  for (std::size_t k = 0; k < order.size(); ++k)
    for (int row : integrate::of(user_start_, users_, unknown_of_[order[k]]))
      if (!seen[row]) seen[row] = 1, order.push_back(row);
  return order;
}

namespace {

template <class T>
std::vector<T> picked(const std::vector<T>& from, const std::vector<int>& places) {
  std::vector<T> result;
  for (int k : places)
    if (static_cast<std::size_t>(k) < from.size()) result.push_back(from[k]);
  return result;
}

Vec picked(const Vec& from, const std::vector<int>& places) { return from(places); }

/// The chosen equations as a model in which the other unknowns are parameters.
ProblemPtr problem_of(const ProblemPtr& whole, const Point& rest, const std::vector<int>& rows,
                      const std::vector<int>& x, const std::vector<int>& z) {
  const dae::FirstOrder& all = whole->model();
  dae::FirstOrder some;
  some.x = picked(all.x, x);
  some.xdot = picked(all.xdot, x);
  some.z = picked(all.z, z);
  some.F = picked(all.F, rows);
  some.label = picked(all.label, rows);
  some.sides = picked(all.sides, rows);
  some.p = all.p;
  some.semi_explicit = all.semi_explicit && (all.z.empty() || !z.empty());
  if (all.is_ode()) some.f = picked(all.f, x);
  std::unordered_map<Expr, double> outside;
  for (std::size_t i = 0; i < all.x.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    outside[all.x[i]] = rest.x[k];
    outside[all.xdot[i]] = rest.xdot[k];
  }
  for (std::size_t i = 0; i < all.z.size(); ++i) outside[all.z[i]] = rest.z[i];
  for (const auto* inside : {&some.x, &some.xdot, &some.z})
    for (Expr leaf : *inside) outside.erase(leaf);
  std::vector<double> values(whole->values().end() - static_cast<std::ptrdiff_t>(all.p.size()),
                             whole->values().end());
  std::vector<Expr> equations = some.F;
  equations.insert(equations.end(), some.f.begin(), some.f.end());
  for (Expr leaf : leaves(equations))
    if (const auto found = outside.find(leaf); found != outside.end())
      some.p.push_back(leaf), values.push_back(found->second);
  auto problem = std::make_shared<Problem>(
      std::move(some), Vec(Eigen::Map<const Vec>(values.data(), static_cast<Eigen::Index>(values.size()))));
  problem->accelerate();
  return problem;
}

}  // namespace

Subsystem::Subsystem(const DependencyGraph& couplings, const ProblemPtr& all, const Point& rest,
                     const std::vector<int>& order, int count) {
  const int n = all->n(), N = couplings.size();
  count = std::min(count, static_cast<int>(order.size()));
  whole = 2 * count > N || count == 0;
  std::vector<char> inside(static_cast<std::size_t>(N), whole);  // by equation
  std::vector<int> rows(order.begin(), order.begin() + count), unknowns;
  for (int row : rows) {
    inside[row] = 1;
    unknowns.push_back(couplings.unknown_of_[row]);
  }
  if (whole)
    for (unknowns.clear(); static_cast<int>(unknowns.size()) < N;)
      unknowns.push_back(static_cast<int>(unknowns.size()));
  std::sort(rows.begin(), rows.end());
  std::sort(unknowns.begin(), unknowns.end());
  for (int j : unknowns) {
    const auto users = of(couplings.user_start_, couplings.users_, j);
    const bool at_interface = std::any_of(users.begin(), users.end(), [&](int row) { return !inside[row]; });
    if (at_interface)
      (j < n ? interface_x : interface_z).push_back(static_cast<int>(j < n ? x.size() : z.size()));
    if (j < n)
      x.push_back(j);
    else
      z.push_back(j - n);
  }
  problem = whole ? all : problem_of(all, rest, rows, x, z);
}

Point Subsystem::take(const Point& all) const {
  return {all.t, picked(all.x, x), picked(all.xdot, x), picked(all.z, z)};
}

void Subsystem::put(const Point& some, Point& all) const {
  all.t = some.t;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    all.x[x[k]] = some.x[i];
    all.xdot[x[k]] = some.xdot[i];
  }
  for (std::size_t k = 0; k < z.size(); ++k) all.z[z[k]] = some.z[k];
}

Vec Subsystem::take(const Vec& all, int n) const {
  Vec result(static_cast<Eigen::Index>(x.size() + z.size()));
  Eigen::Index k = 0;
  for (int i : x) result[k++] = all[i];
  for (int j : z) result[k++] = all[n + j];
  return result;
}

bool Subsystem::touched(const Point& now, const Point& rest) const {
  for (int k : interface_x)
    if (now.x[k] != rest.x[x[k]] || now.xdot[k] != 0) return true;
  for (int k : interface_z)
    if (now.z[k] != rest.z[z[k]]) return true;
  return false;
}

}  // namespace pendula::integrate
