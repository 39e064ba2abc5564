// The runs of a sweep as data: columns of numbers, one value per run, as lists or drawn from distributions.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "random/design.hpp"
#include "random/distribution.hpp"

namespace pendula::random {

/// One thing that varies. Exactly one of list, distribution and joint is set.
struct Column {
  std::string name;
  std::vector<double> list;
  DistributionPtr distribution;
  JointNormalPtr joint;
  int component = 0;
  bool drawn() const { return distribution || joint; }
};

/// Lists are paired or combined, distributions follow a design. A value is a function of
/// column and run: nothing is stored.
class SampleSpace {
 public:
  /// grid: all combinations of the lists, the last column fastest. design.dimensions is filled in from the
  /// columns: one per distribution, in their order; those of one joint distribution share theirs. Throws
  /// Error where nothing varies, lists do not fit together, and what Design throws.
  SampleSpace(std::vector<Column> columns, bool grid, std::optional<DesignRequest> design);

  const std::vector<Column>& columns() const { return columns_; }
  long runs() const { return runs_; }
  double value(std::size_t column, long run) const;
  /// Where in its list a column stands.
  std::size_t place(std::size_t column, long run) const;
  const std::optional<Design>& design() const { return design_; }

 private:
  void combine();
  void pair();
  void lay_out(DesignRequest request);
  std::vector<Column> columns_;
  std::vector<int> dimension_;  ///< of each column: its first in the design
  bool grid_;
  std::optional<Design> design_;
  long runs_ = 1;
};

}  // namespace pendula::random
