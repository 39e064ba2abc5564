// Models with ifelse, abs, min and max: the index in each of their regions.
#pragma once

#include <string>
#include <vector>

#include "dae/model/model.hpp"

namespace pendula::dae {

/// A region of a piecewise model, and the equations that hold there.
struct Region {
  std::string where;          ///< "x < 0, z ≥ 0"
  Model model;                ///< residuals without the pieces
  std::vector<Expr> margins;  ///< not negative in the region; may contain other pieces
};

/// All combinations of at most three conditions; empty if there are none, or more.
std::vector<Region> regions(const Model& model);

}  // namespace pendula::dae
