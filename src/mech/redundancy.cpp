#include "mech/redundancy.hpp"

#include <algorithm>
#include <optional>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/rank/rank.hpp"
#include "dae/regularise/null_vectors.hpp"
#include "expr/graph/generic.hpp"
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

  /// Without those that the dependence of the last one on the others does not need.
  std::vector<int> least(std::vector<int> rows) const {
    for (std::size_t k = rows.size() - 1; k-- > 0;) {
      std::vector<int> fewer = rows;
      fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(k));
      if (depend(fewer)) rows = std::move(fewer);
    }
    return rows;
  }

  /// λ with λᵀ ∂C/∂q = 0 of dependent rows, 1 at the last; nothing where it contains coordinates.
  std::optional<VecX> combination(const std::vector<int>& rows) const {
    std::vector<Expr> factors{Expr(1)};
    if (rows.size() > 1) {
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
  const VecX& C_;
  const std::vector<Entry>& dCdq_;
  int columns_;
};

std::string names_of(const std::vector<int>& rows) {
  std::vector<std::string> names;
  for (int i : rows) names.push_back("C" + subscript(i + 1));
  return join(names, ", ");
}

}  // namespace

Redundancy redundancy(const VecX& C, const VecX& q, const std::vector<Entry>& dCdq) {
  const Dependence dependence(C, q, dCdq);
  Redundancy found;
  const auto m = static_cast<int>(C.size());
  for (int i = 0; i < m; ++i) found.kept.push_back(i);
  if (!dependence.depend(found.kept)) return found;
  found.kept.clear();
  for (int i = 0; i < m; ++i) {
    std::vector<int> rows = found.kept;
    rows.push_back(i);
    if (!dependence.depend(rows)) {
      found.kept = rows;
      continue;
    }
    rows = dependence.least(rows);
    const std::string name = text("constraint C[", i + 1, "] = ", to_text(C[i]));
    const std::vector<int> others(rows.begin(), rows.end() - 1);
    const auto lambda = dependence.combination(rows);
    if (!lambda)
      throw Error(
          text(name, " is redundant or contradicts ", names_of(others),
               ": its gradient depends on theirs, with factors that contain coordinates, so the multipliers "
               "would not be determined. Remove it from C"));
    const Expr rest = simplify(lambda->dot(C));
    if (!generic::is_zero(rest))
      throw Error(text(name, " contradicts ", names_of(others), ": together they say 0 = ", to_text(rest)));
    found.combination.push_back(*lambda);
    found.words.push_back(text("C", subscript(i + 1), " follows from ", names_of(others)));
  }
  return found;
}

}  // namespace pendula::mech
