#include "dae/structure/variable_levels.hpp"

#include <algorithm>

namespace pendula::dae {

std::vector<int> variable_levels(const Signature& sigma, const Offsets& offsets) {
  const std::size_t count = offsets.d.size();
  std::vector<std::size_t> solved_for(count);  // variable solved for, per equation
  std::vector<std::vector<std::size_t>> used_in(count);
  std::vector<int> levels(count);
  std::vector<std::size_t> changed;
  for (std::size_t j = 0; j < count; ++j) {
    const int row = offsets.equation_of[j];
    solved_for[row] = j;
    levels[j] = offsets.c[row];
    changed.push_back(j);
  }
  for (std::size_t i = 0; i < sigma.size(); ++i)
    for (const SignatureEntry& entry : sigma[i]) used_in[entry.variable].push_back(i);
  while (!changed.empty()) {
    const std::size_t j = changed.back();
    changed.pop_back();
    for (const std::size_t i : used_in[j]) {
      const auto entry =
          std::lower_bound(sigma[i].begin(), sigma[i].end(), static_cast<int>(j),
                           [](const SignatureEntry& e, int variable) { return e.variable < variable; });
      const int level = levels[j] - (offsets.d[j] - offsets.c[i] - entry->order);
      if (level <= levels[solved_for[i]]) continue;
      levels[solved_for[i]] = level;
      changed.push_back(solved_for[i]);
    }
  }
  return levels;
}

}  // namespace pendula::dae
