// Why constraints drift (Hairer & Wanner, Solving ODEs II, 2nd ed., §VII.2; docs/derivations.md#drift).
//
// A model reduced by differentiation imposes C⁽ᵈ⁾ = 0 instead of C = 0, so that exactly
//
//     C(t) = Σ_{k<d} C⁽ᵏ⁾(0) tᵏ/k!        (d = 2, mechanisms: the straight line C(0) + t C′(0))
//
// Form "baumgarte" imposes C″ + 2α C′ + β² C = 0 (C′ + αC = 0; (d/dt + α)ᵏ C = 0): what is off at the start
// decays. The difference between the solution and the law is due to the integrator.
#pragma once

#include <string>
#include <vector>

#include "dae/model/model.hpp"
#include "integrate/solution/solution.hpp"

namespace pendula::integrate {

/// A constraint and what the law of the model's form says about it.
struct Invariant {
  std::string label;        ///< "C₁"
  std::vector<Expr> chain;  ///< C, C′, …, C⁽ᵈ⁻¹⁾ in leaves of the solution's problem
  dae::DriftLaw law =
      dae::DriftLaw::polynomial;  ///< none: C = 0 is imposed (or nothing is known), chain is {C}
  std::vector<Expr> decay;        ///< α and β
};

enum class Verdict { kept, inconsistent_start, numerical, both };
std::string verdict_name(Verdict verdict);

struct DriftRow {
  std::string label;
  std::vector<double> start;  ///< C⁽ᵏ⁾ at the first saved time
  double scale = 0;           ///< the size of the terms of C: what counts as zero is relative to it
  double predicted = 0;       ///< the law's value at the last saved time
  double predicted_max = 0;
  double remainder = 0;  ///< max |C(t) - law|: numerical
  double largest = 0;    ///< max |C(t)|
  dae::DriftLaw law = dae::DriftLaw::polynomial;
  Verdict verdict = Verdict::kept;
};

struct Drift {
  double from = 0, to = 0;
  std::vector<DriftRow> rows;
  bool has_regimes = false;     ///< the constraints are others in each
  std::string verdict() const;  ///< over all constraints
  std::string str() const;      ///< the table and the verdicts in words
};

/// An initial value counts as consistent below 10⁻⁹, a numerical remainder as visible above 10⁻⁶, both
/// relative to the size of the terms of the constraint.
Drift drift(const Solution& solution, const std::vector<Invariant>& invariants);

}  // namespace pendula::integrate
