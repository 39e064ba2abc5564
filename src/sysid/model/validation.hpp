// Does a model explain data? Residual tests and comparisons.
#pragma once

#include <optional>

#include "sysid/model/id_model.hpp"

namespace pendula::sysid {

/// P(X > x) for X ~ χ² with `dof` degrees of freedom (Abramowitz & Stegun 6.5.29, 6.5.31, 26.4.2).
double chi_square_tail(double x, double dof);

/// Residual tests of one output at 99 % (Ljung, 2nd ed., §16.6). Auto: r_e(k), bound 2.576/√N. Cross:
/// correlation of ε(t) with u(t-k), bound 2.576 √(P/N) with P = Σ r_e(k) r_u(k). Ljung–Box: Q = N(N+2) Σ
/// r_k²/(N-k) against χ² with lags - (na + nc + nd) degrees of freedom (Biometrika 65, 1978).
struct Validation {
  std::string y_name, fit_label;
  std::vector<std::string> u_names;
  Index rows = 0, lags = 0;
  Vec autocorrelation;  ///< lags 1 … lags
  double bound = 0;
  Mat cross;  ///< (2 lags + 1) × inputs, from -lags to lags
  Vec cross_bound;
  double Q = 0, dof = 0, p = 0;
  int outside = 0;                 ///< of the autocorrelations
  std::vector<int> cross_outside;  ///< per input, lags ≥ 0
  int allowed = 0;                 ///< number outside that chance explains at 99 %
  bool state_space = false;
  std::vector<int> later_outside;  ///< per input, lags < 0
  bool feedback = false;           ///< more of them than chance explains
  std::vector<bool> direct;        ///< per input: the model has a term without delay
  bool white = false, independent = false;
  double fit = 0, simulation_fit = 0;
  Vec residuals;
};
/// lags: nothing means 25, or a quarter of the residuals if these are fewer.
Validation validate(const IdModel& m, Index output, const IdData& d, std::optional<Index> lags = {});
std::string describe(const Validation& v);
/// "u: 3 of 25 correlations outside ±0.1": of residuals and later inputs.
std::string later_inputs_text(const Validation& v);

/// "u: χ² = 83 on 25 degrees of freedom": of residuals of a long ARX model and what is new in later inputs,
/// where chance explains it in less than 0.1 % of the cases: y may be fed back to u. Nothing ("") otherwise,
/// and where a record is too short or has gaps. Cost: one ARX fit.
std::string feedback_in(const IdData& d, Index output);
/// The same as a warning that ends in what it means for an estimate.
std::string feedback_warning(const IdData& d, Index output, const std::string& consequence);

// ── comparison ──

struct ComparisonRow {
  std::string name;
  Index parameters = 0;
  double prediction = 0, simulation = 0, loss = 0, fpe = 0, aic = 0;  ///< of several outputs: means
  Vec predictions, simulations;                                       ///< by output
};
/// One-step and simulation fit of every model on the same samples, initial states estimated.
std::vector<ComparisonRow> compare(const std::vector<std::pair<std::string, const IdModel*>>& models,
                                   const IdData& d);
std::string describe(const std::vector<ComparisonRow>& rows, const IdData& d);

}  // namespace pendula::sysid
