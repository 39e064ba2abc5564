// lane_product.hpp for one kind of register: Eight has broadcast, load(low, high), store, fma, max, sum and
// largest.
#pragma once

#include <algorithm>

#include "codegen/lane_product.hpp"

namespace pendula::codegen {

/// Of `block` consecutive k: the columns are read once for all of them.
template <class Eight, std::size_t block>
std::array<Eight, block> lane_sums(const LaneTerms& q, std::size_t k) {
  std::array<Eight, block> sums;
  sums.fill(Eight::broadcast(0));
  for (std::size_t j = 0; j < q.count; ++j) {
    const Eight column = Eight::load(q.columns + 8 * j, q.columns + 8 * j + 4);
    const double* from = q.from[j] + q.stride * k;
    for (std::size_t b = 0; b < block; ++b)
      sums[b] = Eight::fma(column, Eight::broadcast(from[q.stride * b]), sums[b]);
  }
  return sums;
}

/// use(k, sums) for all k.
template <class Eight, class Use>
void for_all_sums(const LaneTerms& q, const Use& use) {
  constexpr std::size_t block = 4;
  std::size_t k = 0;
  for (; k + block <= q.size; k += block) {
    const auto sums = lane_sums<Eight, block>(q, k);
    for (std::size_t b = 0; b < block; ++b) use(k + b, sums[b]);
  }
  for (; k < q.size; ++k) use(k, lane_sums<Eight, 1>(q, k)[0]);
}

template <class Eight>
void assign_lanes(const LaneTerms& q, Halves to) {
  for_all_sums<Eight>(
      q, [&](std::size_t k, Eight sum) { sum.store(to.low + to.stride * k, to.high + to.stride * k); });
}

template <class Eight>
void add_lanes(const LaneTerms& q, const double* scale, Halves to, double& sum, double& largest) {
  Eight squares = Eight::broadcast(0), most = squares;
  for_all_sums<Eight>(q, [&](std::size_t k, Eight change) {
    double *low = to.low + to.stride * k, *high = to.high + to.stride * k;
    const Eight factor = Eight::broadcast(scale[k]), zero = Eight::broadcast(0);
    Eight::fma(change, Eight::broadcast(1), Eight::load(low, high)).store(low, high);
    const Eight scaled = Eight::fma(change, factor, zero);
    squares = Eight::fma(scaled, scaled, squares);
    most = Eight::max(Eight::fma(scaled, scaled, zero), most);
  });
  sum = squares.sum(), largest = most.largest();
}

}  // namespace pendula::codegen
