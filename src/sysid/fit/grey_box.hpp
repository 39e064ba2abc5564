// Parameters and initial values of a differential-algebraic model from data: min Σ (y_k - h(x(t_k, θ)))² by
// damped Gauss–Newton steps with exact sensitivities, integrated together with the model (Bard, Nonlinear
// Parameter Estimation, 1974, §8).
#pragma once

#include <functional>
#include <optional>

#include "integrate/simulation/simulate.hpp"
#include "sysid/fit/bounded_search.hpp"
#include "sysid/model/model.hpp"
#include "sysid/regression/least_squares.hpp"

namespace pendula::sysid {

struct GreyBoxRequest {
  dae::ModelPtr model;           ///< of any index: what has index 2 or more is reduced first
  std::vector<Expr> parameters;  ///< to be estimated; a state stands for its initial value
  Vec guess;
  std::vector<Expr> outputs;  ///< expressions of the model, one per output of the data
  IdData data;                ///< sample k at from + (k - 1) Ts; missing outputs are left out
  dae::StartRequest start;    ///< fixes and guesses; solved anew for every θ
  std::vector<std::pair<Expr, Index>> inputs;  ///< input leaf, column of u
  bool hold = true;                            ///< inputs constant between samples; else linear
  integrate::Method method;                    ///< adaptive
  double dt = 0;                               ///< > 0: fixed steps of Gauss-3; not for models with events
  double rtol = 1e-8, atol = 1e-10;
  int iterations = 100;
  double from = 0;
  Bounds bounds;                              ///< on the parameters, in their order; empty: none
  std::vector<std::optional<Index>> owner{};  ///< per parameter: its experiment, none for all; fit() fills it
};

/// Fixed steps would step across its borders and events.
bool is_piecewise(const dae::Model& model);

/// Where the search for the initial value of a state begins: the first measurement of it (of its derivative:
/// the slope of the first two), else 0.
double first_value(const GreyBoxRequest& request, Expr state, Index experiment = 0);

struct GreyBoxFit {
  GreyBoxRequest request;
  dae::ModelPtr fitted;  ///< the user's model with the estimates
  std::vector<std::string> names, output_names;
  Vec theta, std;
  Mat covariance;
  LeastSquares ls;
  Mat simulated;  ///< N×ny
  Vec residuals;  ///< of the samples that are there, output by output
  Criteria quality;
  std::vector<double> fit;     ///< per output, simulation
  std::vector<double> losses;  ///< SSE after each iteration, the start first
  std::vector<std::string> unidentifiable;
  std::vector<Index> active;  ///< parameters that rest on a bound
  bool exact = false, converged = false;
  bool grown = false;  ///< a lower minimum than from the guess at once: over growing parts of the record
  std::string ending;  ///< of a search that did not converge, in words
  std::string method, form;  ///< of the integration; the reduced form, or ""
};
/// Initial values that the start leaves open are estimated too, after the parameters. Without any parameter
/// the model is simulated and compared. Where the minimum leaves more than a quarter of the variation of y,
/// the search is repeated over growing parts of the record. throws Error for names that are no parameters,
/// sizes, a start that cannot be made; Failure when the model cannot be integrated at the first guess. Cost:
/// one integration with sensitivities per step. Several experiments share the parameters; initial values
/// belong to each (the start holds for all).
GreyBoxFit fit(const GreyBoxRequest& request);

/// One parameter of a request keeps a value and is no longer sought.
void hold(GreyBoxRequest& request, Index parameter, double value);
std::string describe(const GreyBoxFit& f);

}  // namespace pendula::sysid
