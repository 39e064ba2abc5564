#include "base/decompositions.hpp"

namespace Eigen {

PENDULA_FACTORISATIONS(template)

}  // namespace Eigen
