#include "dae/rank/tracked_elimination.hpp"

#include <algorithm>
#include <vector>

namespace pendula::dae {

TrackedRow TrackedElimination::add(TrackedRow row) {
  // The pivot of a row is its last column, so that subtraction only adds earlier columns.
  for (auto it = row.entries.rbegin(); it != row.entries.rend();) {
    const int column = it->first;
    const auto pivot = pivots_.find(column);
    if (pivot == pivots_.end()) {
      ++it;
      continue;
    }
    const mpq_class factor = it->second / pivot->second.entries.at(column);
    for (const auto& [j, value] : pivot->second.entries)
      if (mpq_class& here = row.entries[j]; (here -= factor * value) == 0) row.entries.erase(j);
    for (const auto& [i, value] : pivot->second.combination)
      if (mpq_class& here = row.combination[i]; (here -= factor * value) == 0) row.combination.erase(i);
    it = std::make_reverse_iterator(row.entries.lower_bound(column));
  }
  if (!row.entries.empty()) pivots_[row.entries.rbegin()->first] = row;
  return row;
}

void make_coprime(std::map<int, mpq_class>& combination) {
  mpz_class numerators = 0, denominators = 1;
  for (const auto& [i, value] : combination) {
    numerators = gcd(numerators, value.get_num());
    denominators = lcm(denominators, value.get_den());
  }
  if (numerators == 0) return;
  const mpq_class scale = mpq_class(denominators) / mpq_class(numerators);
  for (auto& [i, value] : combination) value *= scale;
}

std::string combination_text(const std::map<int, mpq_class>& combination,
                             const std::function<std::string(int)>& label) {
  std::vector<std::pair<int, mpq_class>> terms(combination.begin(), combination.end());
  // Positive terms first: (3) - (1) - (2).
  std::stable_sort(terms.begin(), terms.end(),
                   [](const auto& a, const auto& b) { return (a.second > 0) > (b.second > 0); });
  std::string out;
  for (const auto& [i, value] : terms) {
    const mpq_class size = abs(value);
    const std::string sign = value < 0 ? "-" : "+";
    out += out.empty() ? (value < 0 ? "-" : "") : " " + sign + " ";
    out += (size == 1 ? "" : size.get_str() + " ") + label(i);
  }
  return out;
}

}  // namespace pendula::dae
