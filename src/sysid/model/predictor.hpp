// One-step predictors as expressions: ŷ(t) in terms of y(t-k), u(t-k), ŷ(t-k) and parameters.
//
// Signals are unspecified functions applied to t - k: y = func "y", u = func "u"; yhat(t-k) is an earlier
// prediction and e(t-k) = y(t-k) - yhat(t-k) an innovation. Every other function is an input.
#pragma once

#include <string>
#include <vector>

#include "codegen/kernel/kernel.hpp"
#include "expr/graph/matrix.hpp"
#include "sysid/model/model.hpp"

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
/// parameters: empty for all parameter symbols in the expression. Throws Error on arguments other than t - k
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
/// From H ŷ = G u + (H - 1) y with G_i = B_i/(A F_i), H = C/(A D) (Ljung §3.2, §4.2),
/// multiplied by A D F, F = Π F_i:
///   C F ŷ = Σ D B_i (F/F_i) u_i + F (C - A D) y.
Predictor predictor(const SymbolicPolynomials& p, const std::vector<std::string>& inputs);
/// The equation above in words, before its coefficients are written out.
std::string derivation(const SymbolicPolynomials& p);
std::string describe(const SymbolicPolynomials& p, const std::vector<std::string>& inputs);

}  // namespace pendula::sysid
