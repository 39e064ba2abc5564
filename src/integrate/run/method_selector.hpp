// The method of an adaptive run: chosen at the start, changed where it turns out to be unsuitable.
#pragma once

#include <string>

#include "integrate/problem/active_subsystem.hpp"
#include "integrate/run/adaptive_state.hpp"

namespace pendula::integrate {

class MethodSelector {
 public:
  /// Requires that the state outlives it.
  MethodSelector(AdaptiveState& state, const Method& method);

  /// The method that was asked for or, for "auto", the one that suits the model and the tolerances.
  void start(const Point& point);
  /// The method in use, for the state's problem, which has changed. It has to begin at a point then.
  void renew();
  /// One step; where "auto" has chosen an explicit method that cannot go on, an implicit one may.
  void step();
  /// Explicit → implicit, when it pays: many more steps of this size would follow.
  void change_if_stiff();

 private:
  bool is_automatic() const { return !method_.family; }
  void use(const MethodFamily& family, const Point& point, const std::string& why);
  void change(const MethodFamily& family, double dt, const std::string& why);

  AdaptiveState& state_;
  Method method_;
  std::shared_ptr<const DependencyGraph> couplings_;  ///< of a large model
  const MethodFamily* family_ = nullptr;              ///< in use
  std::string name_;                                  ///< of all methods so far
};

}  // namespace pendula::integrate
