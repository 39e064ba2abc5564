// Lua text that rebuilds a model, for save() and load.
#pragma once

#include <string>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// A chunk that returns the model, in a new session too: its symbols, then the calls that made it: dae{ … },
/// lagrange{ … }, the conversions and reduce "form" of its lineage, with{ … } for values that are not the
/// defaults. A derived model whose calls are not known (gains of "baumgarte" …) is written as the equations
/// it has; a comment says that its lineage is lost. Throws Error for models whose inputs were declared as
/// variables. Cost: every step of the lineage is made once more, to see that it gives the same equations.
std::string code(const ModelPtr& model);

}  // namespace pendula::dae
