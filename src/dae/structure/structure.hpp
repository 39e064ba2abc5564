// structure(): the structural analysis as a report that says how far it may be believed.
#pragma once

#include <optional>

#include "dae/singular/validity.hpp"
#include "dae/start/start.hpp"
#include "dae/structure/analysis.hpp"

namespace pendula::dae {

enum class Verdict {
  valid,                 ///< the system Jacobian is regular at almost every point
  singular_here,         ///< regular in general, singular at the given point
  identically_singular,  ///< singular everywhere: the structural answer is wrong
  structurally_singular  ///< no transversal: some part is over-determined, another under-determined
};
const char* verdict_name(Verdict verdict);

struct StructureReport {
  ModelPtr model;
  Analysis analysis;
  Blocks blocks;  ///< of the system Jacobian; of the incidence where there is none
  Verdict verdict = Verdict::valid;
  std::optional<double> gap;  ///< σ_n / σ_1 of the scaled system Jacobian at the point; 0 if singular there
  std::vector<std::string> null_vector;  ///< unknowns in its null vector, where it is singular there
  Validity validity;                     ///< where the structural answer holds
  int structural_index = 0, structural_dof = 0;
  std::optional<int> index, dof;   ///< true ones, where they are known
  bool index_is_bound = false;     ///< too large for a referee: at most this
  std::string by;                  ///< how the true index was found, or why there is none
  std::vector<std::string> notes;  ///< other branches of the solutions, other parameter values, conditions
};

/// Analyses a model of any shape; `at`, if given, is a point where the system Jacobian is looked at
/// numerically.
StructureReport structure(const ModelPtr& model, const StartPtr& at = nullptr);

/// Σ with offsets and transversal, blocks, indices, verdict. At most 12 equations are written out.
std::string describe(const StructureReport& structure);

}  // namespace pendula::dae
