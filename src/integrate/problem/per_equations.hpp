// What follows from the equations of a problem, remembered for its copies and for the runs of one model.
#pragma once

#include <algorithm>
#include <memory>
#include <utility>

#include "base/lru_cache.hpp"
#include "integrate/problem/problem.hpp"

namespace pendula::integrate {

template <class Value>
class PerEquations {
 public:
  /// What `make()` has returned for these equations. Valid until the next call.
  template <class Make>
  const Value& of(const Problem& problem, const Make& make) {
    const auto equations = problem.shared_model();
    if (const Value* found = known_.find(equations)) return *found;
    return known_.insert(equations, make(), each + equations->F.size());
  }

 private:
  static constexpr std::size_t size = 200'000,
                               each = 1000;  // in equations; beside them, an entry counts as more
  LruCache<std::shared_ptr<const dae::FirstOrder>, Value> known_{size};
};

/// F has numeric inputs or contains t.
inline bool contains_time(const Problem& problem) {
  if (!problem.model().u.empty()) return true;
  static PerEquations<char> known;
  return known.of(problem, [&] {
    const std::vector<Expr> all = leaves(problem.model().F);
    return static_cast<char>(std::find(all.begin(), all.end(), time_symbol()) != all.end());
  }) != 0;
}

}  // namespace pendula::integrate
