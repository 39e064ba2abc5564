// Cost of an integration, in counts.
#pragma once

#include <optional>
#include <vector>

namespace pendula::integrate {

/// States that were smaller than their tolerance and have grown again (solution/regrowth.hpp).
struct Regrowth {
  enum class Effect {
    unknown,        ///< an error within atol has decided what they became
    followed,       ///< the run was repeated with steps that keep rtol alone for them
    below_numbers,  ///< as unknown, and no atol helps: they were smaller than the smallest numbers
  };
  double t = 0;  ///< when they were least
  std::vector<int> states;
  Effect effect = Effect::unknown;
  double atol = 0;  ///< of the first of them; followed: the one they have now
};

/// What becomes of states that have grown again from below their tolerances (solution/regrowth.hpp).
struct SmallStates {
  /// Of every state; empty: none. The run ends where all states of such a set are (Ending::regrowth), to be
  /// repeated with another atol.
  std::vector<char> repeatable;
  std::optional<Regrowth> followed;  ///< by the repeated run
};

struct Stats {
  long steps = 0;
  long rejected = 0;     ///< steps that were tried and repeated with a smaller one
  long evaluations = 0;  ///< of F or f, one per stage
  long jacobians = 0;    ///< of F, one per point
  long factorisations = 0;
  long newton_iterations = 0;
  double errors = 0;  ///< of the steps, as they are estimated, in tolerances: the sum
  /// The run says so where `errors` is larger; sol:check() confirms up to as many tolerances.
  static constexpr double many_errors = 100;
  std::optional<double> rest;  ///< when the solution almost stood still before it moved
  std::optional<Regrowth> regrowth;
};

}  // namespace pendula::integrate
