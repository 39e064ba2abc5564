#include "dae/model/model_key.hpp"

namespace pendula::dae {

std::size_t ModelKeyHash::operator()(const ModelKey& key) const {
  std::vector<std::uint32_t> words;
  for (Expr r : key.residuals) words.push_back(r.id());
  for (const Variable& v : key.variables) words.push_back(v.leaf.id());
  for (const auto& [parameter, value] : key.values) words.push_back(value.id());
  return WordsHash()(words);
}

ModelKey key_of(const Model& m) {
  ModelKey key{m.residuals, m.origin, m.variables, {}, {}, m.form, {}};
  if (m.mechanics) key.mechanical_constraints = m.mechanics->C.size();
  for (Expr p : m.parameters)
    if (const auto it = m.values.find(p); it != m.values.end()) key.values.emplace_back(p, it->second);
  for (const Constraint& c : m.invariants) key.invariants.emplace_back(c.residual, c.label);
  return key;
}

}  // namespace pendula::dae
