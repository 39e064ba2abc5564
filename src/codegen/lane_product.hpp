// Products of a small matrix with many vectors, eight rows at once: what passes between the lanes of two
// programs (machine.hpp), such as the stages of a method and its eigenvalues.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace pendula::codegen {

/// Eight numbers per k: lanes 0 … 3 at low + stride·k, lanes 4 … 7 at high + stride·k. For eight lanes high
/// is low + 4.
struct Halves {
  double *low, *high;
  std::size_t stride;
};

/// Σⱼ columns[8j …] · from[j][stride·k] for k < size. The columns are aligned.
struct LaneTerms {
  const double* columns;
  const double* const* from;
  std::size_t count, stride, size;
};

struct LaneProduct {
  void (*assign)(const LaneTerms& terms, Halves to);
  /// to += the product; sum and largest of the squares of what was added times scale[k].
  void (*add)(const LaneTerms& terms, const double* scale, Halves to, double& sum, double& largest);
};

/// For programs of so many lanes, 4 or 8; requires Machine::available(lanes).
LaneProduct lane_product(int lanes);

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
