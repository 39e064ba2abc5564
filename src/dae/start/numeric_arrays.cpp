#include "dae/start/numeric_arrays.hpp"

#include <algorithm>
#include <iterator>

#include "dae/model/model_key.hpp"

namespace pendula::dae {

NumericArrays::NumericArrays(const Model& model)
    : array_(model.residuals, model.variables), held_(model.states()) {}

NumericArrays::Level& NumericArrays::level(int k) {
  while (std::ssize(levels_) <= k) {
    if (!levels_.empty()) array_.extend();
    std::vector<Expr> columns = held_;
    for (Expr leaf : array_.columns())
      if (std::find(held_.begin(), held_.end(), leaf) == held_.end()) columns.push_back(leaf);
    levels_.push_back({array_.rows(), std::move(columns), nullptr});
  }
  return levels_.at(k);
}

const NumericArray& NumericArrays::of_order(int k) {
  Level& here = level(k);
  if (!here.numeric)
    here.numeric = std::make_unique<NumericArray>(here.rows, here.columns, NumericArray::Units::always);
  return *here.numeric;
}

std::size_t NumericArrays::nodes(int k) { return topological(level(k).rows).size(); }

std::shared_ptr<NumericArrays> numeric_arrays(const Model& model) {
  constexpr std::size_t models = 4;  // kept; a start and its continuations ask for one model in turn
  static ModelCache<std::shared_ptr<NumericArrays>> known(models);
  const ModelKey key = key_of(model);
  if (const auto* kept = known.find(key)) return *kept;
  return known.insert(key, std::make_shared<NumericArrays>(model));
}

}  // namespace pendula::dae
