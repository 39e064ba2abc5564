// A sweep on SIMD lanes: whether it can be, and how.
#pragma once

#include "integrate/sweep/ensemble.hpp"
#include "integrate/sweep/sweep.hpp"

namespace pendula::integrate {

/// Common data of the runs of a sweep on lanes.
class LaneSweep {
 public:
  /// arguments: the leaves whose values are stored per point. Nothing where the runs must be made one after
  /// another; `why` says the reason then, and the method otherwise.
  static std::shared_ptr<const LaneSweep> make(const SweepRequest& request,
                                               const std::vector<Expr>& arguments, std::string& why);
  int lanes() const { return code_->lanes(); }
  const std::string& method() const { return method_; }

  /// Takes sets from the queue until none is left, or `most` were taken; a set that needs a run of its own
  /// is `apart` afterwards. slots: head() numbers, then the arguments at the end and at each of the times.
  /// Throws Interrupted.
  void drain(SharedSlots& slots, TaskQueue& queue, const std::vector<double>& times, int most,
             const std::function<void(int)>& progress) const;

 private:
  class Client;
  bool map_arguments(const Problem& problem, const std::vector<Expr>& arguments);
  void map_sets(const Problem& problem);

  const SweepRequest* request_ = nullptr;  ///< of the sweep that owns this
  std::shared_ptr<const CompiledLaneStep> code_;
  EnsemblePlan plan_;
  std::string method_;
  ProblemPtr problem_;                   ///< of the first set
  std::vector<double> parameters_;       ///< of the first set, p
  std::vector<std::pair<Expr, int>> p_;  ///< where parameters are in p
  std::vector<Expr> x_;                  ///< the states
  std::shared_ptr<const dae::FirstOrder> form_;
  bool plain_start_ = false;  ///< x is what the start fixes
  enum class Source { time, x, xdot, p };
  std::vector<std::pair<Source, int>> stored_;  ///< of every argument
};

}  // namespace pendula::integrate
