#include "base/decompositions.hpp"

namespace Eigen {

PENDULA_SPECTRA(template)

}  // namespace Eigen
