// Where the results of a sweep are read from: memory, or a store.
#pragma once

#include <functional>
#include <memory>

#include "integrate/sweep/workers.hpp"
#include "store/run_store.hpp"

namespace pendula::integrate {

class RunResults {
 public:
  enum class State { waiting, done, failed };
  virtual ~RunResults() = default;
  virtual State state(int run) const = 0;
  virtual std::string failure(int run) const = 0;
  /// Runs that failed, or were not made because of an interrupt.
  virtual std::vector<int> failures() const = 0;
  /// Of every run that is done, ascending: head, and the leaves at the end (place 0)
  /// or at saved time `place` - 1.
  using Visitor = std::function<void(int run, const double* head, const double* leaves)>;
  virtual void visit(std::size_t place, const Visitor& visitor) const = 0;
};

/// All runs, each in its slot. width: leaves per point.
std::shared_ptr<const RunResults> results_in(std::shared_ptr<const SharedSlots> slots, std::size_t width);
std::shared_ptr<const RunResults> results_in(std::shared_ptr<const store::RunStore> store);

}  // namespace pendula::integrate
