#include "base/decompositions_shared.hpp"

namespace Eigen {

PENDULA_COMPLEX_SPECTRA(template)

template class JacobiSVD<MatrixXcd>;

}  // namespace Eigen
