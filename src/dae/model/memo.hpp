// Answers that cost much and depend on the equations only are kept: models are values, and the same question
// is asked by print, index, dof, init, reduce and integrate.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// The last answers by key. Not for threads, as the graph of expressions.
template <class Answer, std::size_t capacity = 64>
class Remembered {
 public:
  using Key = std::vector<std::uint32_t>;

  const Answer* find(const Key& key) const {
    const auto it = kept_.find(key);
    return it == kept_.end() ? nullptr : &it->second;
  }
  const Answer& keep(Key key, Answer answer) {
    if (kept_.size() >= capacity) kept_.clear();
    return kept_.insert_or_assign(std::move(key), std::move(answer)).first->second;
  }

 private:
  std::map<Key, Answer> kept_;
};

/// What an answer about a model's equations depends on: residuals, their places, unknowns, parameter values,
/// what is imposed besides. Equal expressions have equal ids.
std::vector<std::uint32_t> key_of(const Model& model);

}  // namespace pendula::dae
