// Everything that is printed about a model; nothing in dae depends on this folder.
//
// describe.hpp: print(model), header, numbered equations, unknowns, parameters. structure_report (here) and
// structure_text.cpp: structure(), the structural analysis with the evidence for and against it, parameter
// cases and singular points. lua_source.hpp: the Lua text that rebuilds a model, for save() and load. Text
// that is part of an answer (traces, error messages, ledgers) lives with the code that finds it.
#pragma once

#include <optional>

#include "dae/analysis/analysis.hpp"
#include "dae/analysis/determinant_factors.hpp"
#include "dae/start/start.hpp"

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
  DeterminantFactors validity;           ///< where the structural answer holds
  int structural_index = 0, structural_dof = 0;
  std::optional<int> index, dof;  ///< true ones, where they are known
  bool index_is_bound = false;    ///< too large for a referee: at most this
  bool is_unconfirmed = false;    ///< of the structure alone: no values that satisfy the equations were found
  std::string evidence;           ///< how the true index was found, or why there is none
  std::vector<std::string> notes;  ///< other branches of the solutions, other parameter values, conditions
};

/// Analyses a model of any shape; `at`, if given, is a point where the system Jacobian is evaluated.
StructureReport structure(const ModelPtr& model, const ConsistentStatePtr& at = nullptr);

/// Σ with offsets and transversal, blocks, indices, verdict. At most 12 equations are written out.
std::string describe(const StructureReport& structure);

}  // namespace pendula::dae
