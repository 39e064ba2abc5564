// print(model).
#pragma once

#include <string>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// Header, numbered equations as a textbook sets them, unknowns, parameters.
std::string describe(const Model& model);

}  // namespace pendula::dae
