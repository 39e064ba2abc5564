// Regimes of a piecewise model: the equations that hold while no ifelse, abs, min or max changes its side.
//
// Where regimes differ in their index (contact, ideal diodes), a change of regime may take degrees of freedom
// away: x⁺ then obeys hidden constraints that x⁻ did not. The jump is the one that the model implies: with
// impulses Λ of the algebraic variables, all else finite,
//
//   ∂F/∂x′ (x⁺ - x⁻) + ∂F/∂z Λ = 0,   0 = G(x⁺)
//
// the plastic impact of a mechanism, the sum of charges of capacitors that are connected. A regime is
// consistent at a point where its inequalities hold from there on: each margin, as an impulse, as a value or
// by its first derivative that is not 0, is positive.
//
// see  docs/derivations.md#regimes
#pragma once

#include <map>
#include <optional>

#include "dae/model/piecewise.hpp"
#include "dae/start/start.hpp"

namespace pendula::dae {

struct Regime {
  std::uint64_t choice;
  Region region;
  ModelPtr model;  ///< the equations of the regime; nullptr: they are singular
  ModelPtr form;   ///< of index at most 1, for integration
  int index = 0;
  std::vector<Expr> conditions;  ///< 0 = G(t, x): what its states obey
};

/// A regime with consistent values in it.
struct RegimeStart {
  const Regime* regime;
  ConsistentStatePtr at;        ///< of regime->model
  bool jumps;                   ///< x⁺ ≠ x⁻
  std::vector<double> slack;    ///< of each margin: what rounding may take from one that stays 0
  std::vector<Expr> undecided;  ///< margins that are 0 with all derivatives that are known
  /// On the other sides, margins of those that an impulse went through: gaps.
  std::vector<Expr> impulse_margins;
};

/// Some regimes have another index, or fewer degrees of freedom, than the model as a whole; also where an
/// equation is 0 = min(…) or 0 = max(…). Models of more than 100 unknowns or 20 choices are not asked.
bool regimes_differ(const Model& model);

class Regimes {
 public:
  /// A model as it was written: no reduced form.
  explicit Regimes(ModelPtr model);

  std::size_t choices() const { return choices_.size(); }
  const Regime& regime(std::uint64_t choice);
  std::uint64_t active(const std::unordered_map<Expr, double>& values) const {
    return choices_.active(values);
  }
  /// Conditions of a regime that hold also where any one choice has its other side.
  std::vector<Expr> lasting_conditions(const Regime& regime);
  /// The choices that time, parameters and inputs decide.
  Choices::Decided decided(const StartRequest& request) const;

  /// How well a run knows its values: |error| ≤ rtol max(|value|, least) in each step. 0: they are exact.
  struct Tolerance {
    double rtol = 0;
    LeafValues least;
  };
  /// What counts as 0, of the terms: of a margin, of a condition.
  struct Accuracy {
    double border, close;
    bool exact;
  };

  /// The consistent regime with the fewest other sides than `near`, from states before (request.fix; z as
  /// guesses; request.sizes). without: a regime that is not to be taken. why: what was wrong with those that
  /// were tried. Where no regime is consistent with the values as they are, those within their tolerance of a
  /// border count as on it.
  std::optional<RegimeStart> enter(const StartRequest& request, std::uint64_t near,
                                   std::optional<std::uint64_t> without, std::string& why,
                                   const Tolerance& tolerance);

 private:
  std::optional<RegimeStart> enter_one(const StartRequest& request, std::uint64_t choice,
                                       const Accuracy& accuracy, std::string& why);
  std::optional<RegimeStart> enter_within(const StartRequest& request, std::uint64_t near,
                                          std::optional<std::uint64_t> without, const Accuracy& accuracy,
                                          std::string& why);

  ModelPtr model_;
  Choices choices_;
  std::map<std::uint64_t, Regime> known_;
};

/// The model in one region, with all unknowns of the piecewise one.
ModelPtr region_model(const ModelPtr& model, const Region& region);

/// Time, parameters, inputs and what a request knows of the leaves.
std::unordered_map<Expr, double> values_before(const Model& model, const StartRequest& request);

/// -1, 0, 1: the sign of an expression just after a start; 0: it stays 0, as far as
/// its derivatives are known.
int sign_after(Expr margin, const ConsistentState& start);
/// No margin is negative at a start and just after it.
bool stays_in(const Region& region, const ConsistentState& start);

}  // namespace pendula::dae
