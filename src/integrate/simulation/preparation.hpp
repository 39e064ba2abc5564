// The preparation of a run that does not depend on numbers, cached for the next run of the same equations.
#pragma once

#include <algorithm>
#include <optional>

#include "integrate/event/monitor/guards.hpp"
#include "integrate/event/surfaces.hpp"
#include "integrate/problem/sensitivity.hpp"
#include "integrate/simulation/simulate.hpp"

namespace pendula::integrate {

/// The part of a set-up that contains no numbers, so that the next run of the same
/// equations need not make it.
struct Preparation {
  dae::ModelPtr model;
  dae::FirstOrder form;  ///< with the inputs that are expressions
  std::vector<dae::Projection> stages;
  // of the latest parameters; the same for others where no side of a border depends on them
  Vec parameters;
  std::shared_ptr<const PiecewiseForm> piecewise;
  std::shared_ptr<const Variational> variational;
  std::shared_ptr<const Problem> problem;
  std::vector<char> varies;         ///< parameters with other numbers in another run
  std::vector<std::size_t> folded;  ///< parameters that are 0, 1 or -1 in the equations of the problem
  // what its equations need to be solvable; on first use
  std::optional<std::vector<Guard>> guards;
  std::vector<Guard> choices;
  std::vector<dae::LargeBlock> blocks;
  Windows origins;  ///< of what was added later

  bool serves(const Vec& values) const {
    const bool same = values.size() == parameters.size() && values == parameters;
    if (!problem || same) return problem != nullptr;
    if (piecewise && !piecewise->surfaces().empty()) return false;
    return std::all_of(folded.begin(), folded.end(), [&](std::size_t i) {
      const auto k = static_cast<Eigen::Index>(i);
      return values[k] == parameters[k];
    });
  }
};
using PreparationPtr = std::shared_ptr<Preparation>;

/// Of the model with these inputs, events and sensitivities; made where there is none yet, without a problem.
PreparationPtr prepared(const dae::ModelPtr& model, const Simulation& simulation);
/// The plan watches what the equations of the problem need to be solvable.
void watch_singularities(Plan& plan, const dae::ModelPtr& model, const Simulation& simulation,
                         const Problem& problem);
/// Problem, borders and sensitivities for these parameters.
void complete(Preparation& all, const Vec& parameters, const Simulation& simulation);

}  // namespace pendula::integrate
