#include "dae/points/derivative_array.hpp"

#include <algorithm>
#include <unordered_set>

#include "base/interrupt.hpp"

namespace pendula::dae {

DerivativeArray::DerivativeArray(std::vector<Expr> residuals, const std::vector<Variable>& variables)
    : equations_(residuals.size()), rows_(std::move(residuals)) {
  int highest = 1;
  for (const Variable& v : variables) highest = std::max(highest, v.order);
  for (int k = 0; k < highest; ++k)
    for (const Variable& v : variables)
      if (k < std::max(v.order, 1)) states_.push_back(derivative_leaf(v.leaf, k));
  for (const Variable& v : variables) first_.push_back(derivative_leaf(v.leaf, std::max(v.order, 1)));
}

void DerivativeArray::extend() {
  const std::size_t from = rows_.size() - equations_;
  for (std::size_t i = 0; i < equations_; ++i) {
    poll_interrupt();
    const Expr before = rows_[from + i];
    rows_.push_back(prefers_series(rows_[i], before, order_ + 1) ? series_.derivative(rows_[i], order_ + 1)
                                                                 : total_derivative(before));
  }
  ++order_;
  // The order of a new derivative exceeds that of x′ by the number of differentiations, or by one less if z′
  // did not occur in F.
  const std::vector<Expr> list = leaves(std::span(rows_).last(equations_));
  const std::unordered_set<Expr> present(list.begin(), list.end()), known(higher_.begin(), higher_.end());
  for (int beyond = std::max(order_ - 1, 1); beyond <= order_; ++beyond)
    for (Expr leaf : first_)
      if (const Expr next = derivative_leaf(leaf, beyond); present.count(next) && !known.count(next))
        higher_.push_back(next);
}

std::vector<Expr> DerivativeArray::columns() const {
  std::vector<Expr> all = states_;
  all.insert(all.end(), first_.begin(), first_.end());
  all.insert(all.end(), higher_.begin(), higher_.end());
  return all;
}

const std::vector<Entry>& DerivativeArray::jacobian() const {
  for (Entry e : sparse_jacobian(std::span(rows_).subspan(in_jacobian_), columns())) {
    e.row += static_cast<int>(in_jacobian_);
    jacobian_.push_back(e);
  }
  in_jacobian_ = rows_.size();
  return jacobian_;
}

}  // namespace pendula::dae
