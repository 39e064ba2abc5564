// The numerical aliases used everywhere: dense column vectors and matrices of double.
#pragma once

#include <Eigen/Core>

namespace pendula {

using Vec = Eigen::VectorXd;
using Mat = Eigen::MatrixXd;

}  // namespace pendula
