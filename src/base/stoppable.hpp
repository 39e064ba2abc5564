// Long computations that have no place where they could be asked to stop: Eigen's factorisations.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "base/error.hpp"

namespace pendula {

/// The child process has gone before it gave its answer.
class ChildEnded : public Failure {
 public:
  using Failure::Failure;
};

/// The matrices that `work` returns. With more than some 0.2 s of floating-point `operations`, `work` runs in
/// a child process that Ctrl-C ends; where there can be none (--safe), and with less, it runs here.
///
/// requires  what `work` changes besides is not needed: it changes it in the child
/// throws    what `work` throws, if Error, Failure or std::bad_alloc; ChildEnded; Interrupted
std::vector<Eigen::MatrixXd> stoppable(double operations,
                                       const std::function<std::vector<Eigen::MatrixXd>()>& work);

}  // namespace pendula
