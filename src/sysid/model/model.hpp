// Polynomial models A(q) y = Σ B_i(q)/F_i(q) u_i + C(q)/D(q) e and what was learnt about their parameters.
//
// Conventions as in Ljung, System Identification, 2nd ed., §4.2, and MATLAB: A, C, D, F are monic; B holds nk
// leading zeros, so that coefficient b_k multiplies u(t - k); θ = [a  b  c  d  f].
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sysid/regression/least_squares.hpp"
#include "sysid/regression/regressor.hpp"

namespace pendula::sysid {

struct Polynomials {
  Vec A = Vec::Ones(1), C = Vec::Ones(1), D = Vec::Ones(1);
  std::vector<Vec> B, F;  ///< one per input
  /// Number of samples the predictor ε = D/C (A y - Σ B/F u) remembers.
  Index memory() const;
  bool equation_error() const;  ///< C = D = F = 1: the predictor is linear in θ
};

/// How well a model explains data. Loss V = SSE/rows; FPE = V (1 + d/N)/(1 - d/N); AIC = N ln V + 2d;
/// BIC = N ln V + d ln N; fit = 100 (1 - ‖ε‖/‖y - ȳ‖) (Ljung §16.4).
struct Criteria {
  double sse = 0, loss = 0, sigma2 = 0, fpe = 0, aic = 0, bic = 0, fit = 0;
  Index rows = 0, parameters = 0;
};
Criteria criteria(double sse, Index rows, Index parameters, double y_variation);
/// 100 (1 - ‖e‖/‖y - ȳ‖); -inf when y does not vary.
double fit_percent(const Vec& y, const Vec& e);

/// Report of a nonlinear search on its result.
struct SearchReport {
  int iterations = 0;   ///< 0: one linear least-squares problem
  std::string method;   ///< with the iterations, and how it ended if it did not converge
  std::string verdict;  ///< slope, start, other starts, active bounds, in words
  bool settled = true;  ///< a minimum inside the region of stable predictors was reached
  double angle = 0;     ///< cosine between residual and tangent plane: 0 at a minimum
  std::vector<std::string> warnings;
};

struct SimulationFit {
  double percent = 0;  ///< NaN: there is none; -inf: the simulation diverges
  std::string start;   ///< in words: how that simulation begins
};

/// Identifiability from the data: the rank of the regression, the directions of θ without effect, in numbers
/// and in words, and what to do about it.
struct Identifiability {
  Index rank = 0;
  Mat null_space;
  std::vector<std::string> directions, advice;
};

struct PolyModel {
  std::string kind;  ///< "ARX", "FIR", "ARMAX", "OE", "BJ", "polynomial"
  Polynomials p;
  Orders orders;
  double Ts = 1;
  std::string y_name;
  std::vector<std::string> u_names;
  Index output = 0;  ///< column of y in the data

  bool estimated = false;
  std::vector<std::string> names;  ///< of θ
  Vec theta, std;
  Mat covariance;
  Criteria quality;
  SimulationFit simulation;
  Index samples = 0, left_out = 0;
  InitialCondition start = InitialCondition::drop;
  bool exact = false;
  Identifiability identifiability;
  SearchReport search;
  std::string weighting;  ///< of a weighted estimate, in words
  std::string noise;      ///< maximum likelihood: the density in words, with what was estimated of it
  double log_likelihood = 0;
  Vec initial_past;  ///< ic = "estimate" of ARX: y(0), y(-1), … where θ determines them
};

/// Spreads θ over the polynomials and back. Requires the orders' lengths.
Polynomials polynomials_of(const Vec& theta, const Orders& orders);
Vec parameters_of(const Polynomials& p, const Orders& orders);
std::vector<std::string> parameter_names(const Orders& orders, const std::vector<std::string>& u_names);

/// ARX and FIR by linear least squares. Fewer rows than parameters is a rank report.
/// Throws Error if no row is usable.
PolyModel arx(const IdData& d, Index output, const Orders& orders, InitialCondition start);

/// Sentences: which input excites too little, what the structure of the null space says (feedback, orders too
/// high for exact data), what is missing, and what to change.
std::vector<std::string> why_not_identifiable(const IdData& d, const PolyModel& m, Index rows);

/// "y has the mean 97 and deviates by 3 …": offsets that the model has no term for,
/// unless detrend was called.
std::vector<std::string> offsets_in(const IdData& d, Index output);

// ── using a model ──

/// How the samples before the first are treated: zero; taken from the measurement (the first memory() samples
/// seed the filters and are not compared); or estimated by least squares from the data.
enum class Seed { zero, data, estimate };
Seed seed_named(const std::string& name);

struct Response {
  Vec values;    ///< N×1; where the seed takes measured samples, those
  Vec errors;    ///< y - values at the compared rows
  Vec compared;  ///< y at those rows
  std::vector<Index> rows;
  double fit = 0;
};
/// "seeded with the first 4 samples", …
std::string seed_text(const PolyModel& m, Seed seed);
/// How a model simulates the data that it was estimated from: as its ic was.
Seed seed_of_estimation(const PolyModel& m);
/// ŷ(t | t - horizon): horizon 1 is the one-step prediction, 0 stands for simulation (only u is used).
/// throws Error where samples are missing or the data does not fit the model.
Response predict(const PolyModel& m, const IdData& d, Index horizon, Seed seed);

/// The fit of a simulation; -inf where it overflows.
double simulation_fit(const PolyModel& m, const IdData& d, Seed seed);

// ── filters ──

/// y = (num/den) x from rest; den monic after scaling. In place is allowed.
void filter(const Vec& num, const Vec& den, const double* x, Index n, double* y);
Vec filtered(const Vec& num, const Vec& den, const Vec& x);
/// 1/den applied to n samples of which only the first, `head`, are not zero; what has decayed is zero.
Vec ringing(const Vec& den, const Vec& head, Index n);
/// Relative to its largest value, what is left of such a response without effect: 200 of them make ε.
constexpr double negligible_tail = 1e-18;
Vec convolve(const Vec& a, const Vec& b);
/// Throws Error. At most 100000 steps ahead, a choice: predictions of stable models no longer change there.
void check_horizon(Index horizon);
/// All zeros of the monic polynomial 1 + p₁q⁻¹ + … inside the unit circle (Schur–Cohn recursion).
bool stable(const Vec& p);
/// C and every F are stable: predictions do not grow.
bool admissible(const Polynomials& p);
/// The polynomial with its zeros outside the unit circle at their mirror images 1/z̄.
Vec reflected(const Vec& p);

// ── text ──

/// "1 - 1.27374 q⁻¹ + 0.393546 q⁻²"
std::string polynomial_text(const Vec& p, int digits = 6);
std::string describe(const PolyModel& m);

}  // namespace pendula::sysid
