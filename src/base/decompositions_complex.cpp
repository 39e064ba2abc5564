#include "base/decompositions.hpp"

namespace Eigen {

PENDULA_COMPLEX_SPECTRA(template)

template class JacobiSVD<MatrixXcd>;

}  // namespace Eigen
