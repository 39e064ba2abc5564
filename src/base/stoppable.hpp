// Long computations that have no place where they could be asked to stop: Eigen's factorisations.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

namespace pendula {

/// The matrices that `work` returns. With more than some 0.2 s of floating-point `operations`, `work` runs in a
/// child process that Ctrl-C ends; where there can be none (--safe), and with less, it runs here.
///
/// requires  what `work` changes besides is not needed: it changes it in the child
/// throws    what `work` throws, if Error, Failure or std::bad_alloc; Interrupted
std::vector<Eigen::MatrixXd> stoppable(double operations,
                                       const std::function<std::vector<Eigen::MatrixXd>()>& work);

}  // namespace pendula
