// Products of a small matrix with many vectors, four or eight rows at once: what passes between the lanes of
// two programs for four lanes (machine.hpp), such as the stages of a method and its eigenvalues.
//
// AVX2 only: after 0.7 ms without them, registers of 512 bits need some 10 µs to be powered up, which is
// noticed in integrations of 30 µs (5 … 20 % more on bench/dae.lua).
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace pendula::codegen {

/// Σⱼ columns[8j …] · from[j][stride·k] for k < size: rows 0 … 3 and 4 … 7 of columns that are aligned.
struct LaneTerms {
  const double* columns;
  const double* const* from;
  std::size_t count, stride, size;
};

/// Rows 0 … 3 at low + stride·k, rows 4 … 7 at high + stride·k, or left out without a high.
struct LaneRows {
  double *low, *high;
  std::size_t stride;
};

/// to = the product. Both require Machine::available(4).
void assign_lane_product(const LaneTerms& terms, const LaneRows& to);
/// to += the product; sum and largest of the squares of what was added times scale[k].
void add_lane_product(const LaneTerms& terms, const double* scale, const LaneRows& to, double& sum,
                      double& largest);

/// Numbers in lanes, aligned.
class LaneArray {
 public:
  explicit LaneArray(std::size_t numbers = 0) : chunks_((numbers + 7) / 8) {}
  double* data() { return reinterpret_cast<double*>(chunks_.data()); }
  const double* data() const { return reinterpret_cast<const double*>(chunks_.data()); }

 private:
  struct alignas(64) Chunk {
    std::array<double, 8> number{};
  };
  std::vector<Chunk> chunks_;
};

}  // namespace pendula::codegen
