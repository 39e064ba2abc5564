#include "base/decompositions_shared.hpp"

namespace Eigen::internal {

PENDULA_KERNELS(template, double)
PENDULA_KERNELS(template, std::complex<double>)

}  // namespace Eigen::internal

namespace Eigen {

PENDULA_REAL_SPECTRA(template)

}  // namespace Eigen
