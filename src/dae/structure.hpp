// structure(): the structural analysis as a report that says how far it may be believed.
#pragma once

#include <optional>

#include "dae/analysis.hpp"
#include "dae/start.hpp"

namespace pendula::dae {

enum class Verdict {
  valid,                 ///< the system Jacobian is regular at almost every point
  singular_here,         ///< regular in general, singular at the given point
  identically_singular,  ///< singular everywhere: the structural answer is wrong
  structurally_singular  ///< no transversal: some part is over-determined, another under-determined
};
const char* verdict_name(Verdict verdict);

struct Structure {
  ModelPtr model;
  Analysis analysis;
  Blocks blocks;  ///< of the system Jacobian; of the incidence where there is none
  Verdict verdict = Verdict::valid;
  std::optional<double> gap;  ///< σ_n / σ_1 of the scaled system Jacobian at the point
  int structural_index = 0, structural_dof = 0;
  std::optional<int> index, dof;  ///< true ones, where they are known
};

/// Analyses a model of any shape; `at`, if given, is a point where the system Jacobian is looked at
/// numerically.
Structure structure(const ModelPtr& model, const StartPtr& at = nullptr);

/// Σ with offsets and transversal, blocks, indices, verdict. At most 12 equations are written out.
std::string describe(const Structure& structure);

}  // namespace pendula::dae
