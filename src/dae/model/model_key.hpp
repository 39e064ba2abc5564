// Answers about a model that cost much are cached: models are values, and print, index, dof, init, reduce and
// integrate ask the same questions.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/lru_cache.hpp"
#include "dae/model/model.hpp"

namespace pendula::dae {

/// All that an answer about the equations of a model depends on. Equal expressions have equal ids, so that
/// comparing keys costs no more than comparing integers.
struct ModelKey {
  std::vector<Expr> residuals;
  std::vector<std::pair<int, int>> origin;  ///< block and row of each residual
  std::vector<Variable> variables;
  std::vector<std::pair<Expr, Expr>> values;             ///< parameters that have one, in their order
  std::vector<std::pair<Expr, std::string>> invariants;  ///< residual and label
  std::string form;
  std::optional<Eigen::Index> mechanical_constraints;  ///< of a Lagrangian
  friend bool operator==(const ModelKey&, const ModelKey&) = default;
};
struct ModelKeyHash {
  std::size_t operator()(const ModelKey& key) const;
};
ModelKey key_of(const Model& model);

template <class Answer>
using ModelCache = LruCache<ModelKey, Answer, ModelKeyHash>;
constexpr std::size_t cached_models = 64;

/// An answer for each of the models in use, found by the object: a call asks less than with a ModelKey, and
/// answers of models with equal equations but other attributes stay apart. Answer: cheap to copy.
template <class Answer>
class PerModel {
 public:
  template <class Make>
  Answer of(const ModelPtr& model, Make make) {
    if (const Answer* found = known_.find(model)) return *found;
    return known_.insert(model, make(), size_of(*model));
  }
  static std::size_t size_of(const Model& model) { return 1000 + model.residuals.size(); }
  static constexpr std::size_t capacity = 200'000;  ///< the sum of size_of

 private:
  LruCache<ModelPtr, Answer> known_{capacity};
};

}  // namespace pendula::dae
