// The numerical aliases used everywhere: dense column vectors and matrices of
// double, and how they are multiplied.
#pragma once

#include <Eigen/Core>

#include "base/arithmetic.hpp"

namespace pendula {

using Vec = Eigen::VectorXd;
using Mat = Eigen::MatrixXd;

}  // namespace pendula
