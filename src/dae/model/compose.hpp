// One model made of others and of further equations: dae{ plant, F ~ -10*x - x.dot }.
#pragma once

#include <vector>

#include "dae/model/make_model.hpp"

namespace pendula::dae {

/// The equations of `parts` and `blocks` together. An equation whose left side is an input (or a column of
/// inputs) says what this input is: it is put in where the input occurs, and the input keeps its meaning for
/// solutions and starts (ModelAttributes::relations).
///
/// throws Error: a part is a reduced form; two values for one parameter; two equations for one input; inputs
/// that depend on each other in a circle; what make_model() refuses.
ModelPtr compose(const std::vector<ModelPtr>& parts, std::vector<Block> blocks, ModelOptions options);

}  // namespace pendula::dae
