// One-step predictors as expressions: ŷ(t) in terms of y(t-k), u(t-k), ŷ(t-k) and parameters.
//
// Signals are unspecified functions applied to t - k: y = func "y", u = func "u"; yhat(t-k) is an earlier
// prediction and e(t-k) = y(t-k) - yhat(t-k) an innovation. Every other function is an input.
#pragma once

#include <string>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "expr/graph/matrix.hpp"
#include "sysid/fit/least_squares.hpp"
#include "sysid/fit/regressor.hpp"
#include "sysid/model/model.hpp"
#include "sysid/noise/likelihood.hpp"

namespace pendula::sysid {

struct SignalTerm {
  enum class Kind { output, prediction, input } kind;
  std::string name;
  Index lag;
  Expr node;
};

struct Predictor {
  Expr expression;
  std::vector<Expr> parameters;
  std::vector<SignalTerm> terms;
  bool recursive = false;  ///< earlier predictions enter
  bool linear = false;     ///< ŷ(t) = offset + φ(t)ᵀθ with φ and offset free of θ
  VecX regressor;          ///< φ(t), if linear
  Expr offset;
  Index memory() const;  ///< the largest lag
};
/// parameters: empty for all parameter symbols in the expression. throws Error on arguments other than t - k
/// with k ≥ 0, y(t) itself, and symbols without a meaning.
Predictor predictor(Expr expression, std::vector<Expr> parameters);
std::string describe(const Predictor& p);

/// A, B, C, D, F with symbolic entries; leading zeros of B are its delay.
struct SymbolicPolynomials {
  VecX A, C, D;
  std::vector<VecX> B, F;
  bool numeric() const;
  Polynomials values() const;  ///< requires numeric()
  std::string class_name() const;
};
/// From H ŷ = G u + (H - 1) y with G_i = B_i/(A F_i), H = C/(A D) (Ljung §3.2, §4.2), multiplied by A D F, F = Π
/// F_i:
///   C F ŷ = Σ D B_i (F/F_i) u_i + F (C - A D) y.
Predictor predictor(const SymbolicPolynomials& p, const std::vector<std::string>& inputs);
/// The equation above in words, before its coefficients are written out.
std::string derivation(const SymbolicPolynomials& p);
std::string describe(const SymbolicPolynomials& p, const std::vector<std::string>& inputs);

/// Parameters of any predictor by least squares: one linear problem if the predictor is linear in θ, else
/// Gauss–Newton with damping, the gradient carried through the recursion: dŷ = ∂f/∂θ + Σ ∂f/∂ŷ(t-k) dŷ(t-k).
struct PredictorFit {
  Predictor predictor;
  std::vector<std::string> names;
  LeastSquares ls;
  Vec theta, std;
  Mat covariance;
  Criteria quality;
  bool exact = false;
  int iterations = 0;
  std::vector<std::string> unidentifiable;
  Vec predictions, residuals;  ///< at the rows used
  Index first = 0;             ///< rows left out at the start of each experiment
  std::string noise;           ///< maximum likelihood: the density in words
  double log_likelihood = 0;
};
/// With a density (not uniform): maximum likelihood; requires a linear predictor.
PredictorFit fit(const Predictor& p, const IdData& d, Start start, const Vec& theta0,
                 const Density* density = nullptr);
/// y - offset = Φθ of a linear predictor. throws Error if it is not linear.
Regression regression(const Predictor& p, const IdData& d, Start start);
std::string describe(const PredictorFit& f);

}  // namespace pendula::sysid
