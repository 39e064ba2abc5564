// Several roots: the one that a start has taken, and how to request another one.
#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "dae/start/start_system.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

// of a model; starts tried from mirrored values, one each; other solutions that an answer names
constexpr std::size_t most_unknowns = 40, most_mirrors = 12, most_branches = 3;
constexpr double different = 1e-6;  // in units

/// Unknowns in which some equation is not linear.
std::vector<Index> nonlinear(const StartSystem& s) {
  std::vector<Index> list;
  for (std::size_t j = 0; j < s.unknowns.size(); ++j)
    for (std::size_t i = 0; i < s.first_fix; ++i)
      if (depends_on(s.rows[i], s.unknowns[j]) &&
          depends_on(partial(s.rows[i], s.unknowns[j]), s.unknowns[j])) {
        list.push_back(static_cast<Index>(j));
        break;
      }
  return list;
}

/// "y = ±√(L² - x²)" if an equation is quadratic in the leaf without a linear term, and its other
/// unknowns are fixed.
std::string quadratic(const StartSystem& s, Expr leaf) {
  for (std::size_t i = 0; i < s.first_fix; ++i) {
    if (!depends_on(s.rows[i], leaf)) continue;
    const Expr slope = partial(s.rows[i], leaf), a = simplify(partial(slope, leaf)) / Expr(2);
    if (a.is_zero() || depends_on(a, leaf)) continue;
    if (!simplify(substitute(slope, {{leaf, Expr(0)}})).is_zero()) continue;
    const Expr square = simplify(-substitute(s.rows[i], {{leaf, Expr(0)}}) / a);
    const auto inside = leaves({&square, 1});
    const bool given = std::all_of(inside.begin(), inside.end(), [&](Expr other) {
      if (!s.position(other)) return true;
      return std::any_of(s.request.fix.begin(), s.request.fix.end(),
                         [&](const auto& f) { return resolve(s.model, f.first) == other; });
    });
    if (given) return text(to_text(leaf), " = ±", to_text(sqrt(square)));
  }
  return "";
}

/// Does a guess of this value lead to this root?
bool leads_to(const ConsistentState& at, Expr leaf, double value) {
  StartRequest request = at.request;
  std::erase_if(request.guess, [&](const auto& g) { return resolve(*at.model, g.first) == leaf; });
  request.guess.push_back({leaf, value});
  try {
    return std::fabs((*init(at.model, request))(leaf)-value) <= different * (1 + std::fabs(value));
  } catch (const UserFacing&) {
    return false;
  }
}

/// The unknown that distinguishes two roots: the mirrored one if it differs visibly, otherwise the one
/// that differs most.
std::optional<Index> most_different(const StartSystem& s, const Vec& a, const Vec& b, Index mirrored) {
  const auto difference = [&](Index j) { return std::fabs(a[j] - b[j]) / (s.unit[j] + std::fabs(a[j])); };
  constexpr double visible = 1e-3;  // in the three digits that are shown
  if (difference(mirrored) > visible) return mirrored;
  Index best = 0;
  for (Index j = 1; j < a.size(); ++j)
    if (difference(j) > difference(best)) best = j;
  return difference(best) > visible ? std::optional(best) : std::nullopt;
}

}  // namespace

std::vector<Branch> ConsistentState::branches() const {
  std::vector<Branch> found;
  if (request.nearest || rows.empty() || rows.size() > most_unknowns) return found;
  if (std::any_of(rows.begin(), rows.end(), [](const LedgerRow& r) { return r.origin == Origin::chosen; }))
    return found;  // the roots form a continuum, of which the guess selects a point
  const StartSystem s(model, request);
  Vec w(static_cast<Index>(s.unknowns.size()));
  for (Index j = 0; j < w.size(); ++j) w[j] = values.at(s.unknowns[j]);
  std::vector<Vec> roots{w};
  std::size_t tried = 0;
  for (Index j : nonlinear(s)) {
    const LedgerRow& row = rows[j];
    if (row.origin != Origin::computed || found.size() == most_branches || tried++ == most_mirrors) continue;
    std::vector<double> from{-w[j], w[j] + 2 * s.unit[j], w[j] - 2 * s.unit[j]};
    for (std::size_t k = 0; k < from.size() && found.size() < most_branches; ++k) {
      Vec start = w;
      start[j] = from[k];
      const StartSolution other = gauss_newton(s, start);
      if (!other.solved) continue;
      const auto same = [&](const Vec& root) {
        return (other.w - root).cwiseQuotient(s.unit).cwiseAbs().maxCoeff() <=
               different * (1 + root.cwiseQuotient(s.unit).cwiseAbs().maxCoeff());
      };
      if (std::any_of(roots.begin(), roots.end(), same)) continue;
      const auto distinct = most_different(s, w, other.w, j);  // β may differ where γ was mirrored
      if (!distinct) continue;
      const Expr leaf = s.unknowns[*distinct];
      if (!leads_to(*this, leaf, other.w[*distinct])) continue;
      roots.push_back(other.w);
      found.push_back({leaf, w[*distinct], other.w[*distinct], quadratic(s, leaf)});
      if (!found.back().formula.empty()) break;
      const double apart = other.w[j] - w[j];  // a cubic has a third root between the two or beyond them
      from.insert(from.end(), {w[j] + apart / 2, w[j] + 2 * apart, w[j] - apart});
    }
  }
  return found;
}

}  // namespace pendula::dae
