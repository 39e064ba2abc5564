// Runs on lanes check poles where they are asked for values: a divisor whose sign has changed since the
// start may have passed a pole, and a run of its own finds out (event/monitor/domain_monitor.hpp).
#pragma once

#include <unordered_map>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "dae/model/first_order.hpp"

namespace pendula::integrate {

class PoleSigns {
 public:
  explicit PoleSigns(const dae::FirstOrder& form);
  bool empty() const { return out_.empty(); }
  /// x: n, p: as many as the form has.
  void start(int run, double t, const double* x, const double* p);
  void update(int run, double t, const double* x, const double* p);
  /// Forgets the run; true where a divisor has changed its sign, or was 0 or no number.
  bool changed(int run);

 private:
  const std::vector<double>& evaluate(double t, const double* x, const double* p);
  struct Run {
    std::vector<char> positive;
    bool changed = false;
  };
  std::size_t n_, p_;
  codegen::Kernel kernel_;  ///< the divisors, of t, x, p
  std::vector<double> in_, out_;
  std::unordered_map<int, Run> runs_;
};

}  // namespace pendula::integrate
