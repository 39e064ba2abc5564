// Forward sensitivities: how the solution changes with parameters and initial values.
//
// With S = ∂x/∂p, Z = ∂z/∂p the model F(t, x, x′, z, p) = 0 is completed by its variational equations
//
//     F_x S + F_x′ S′ + F_z Z + F_p = 0,    S(0) = ∂x(0)/∂p,
//
// exact derivatives of the equations, integrated together with them and under the same error control
// (simultaneous corrector; Feehery, Tolsma & Barton, Appl. Numer. Math. 25, 1997). The iteration matrix is
// block triangular, its diagonal blocks are those of the model itself.
//
//   Simulation request = …;  request.sensitivities = {m, L, x};    // parameters; a state means its start
//   TrajectoryPtr run = simulate(model, request);
//   Mat dy = run->sensitivity(std::span(&y, 1), m);                // dy/dm, one row per saved time
//   Vec at = run->sensitivity(std::span(&y, 1), m, 2.5);
#pragma once

#include "dae/model/first_order.hpp"
#include "dae/start/start.hpp"
#include "integrate/problem/problem.hpp"

namespace pendula::integrate {

/// The model with k copies of its variational equations behind it.
struct Variational {
  dae::FirstOrder form;  ///< x = (x, S₁ … S_k), z = (z, Z₁ … Z_k)
  std::vector<Expr> with_respect_to;
  int n = 0, m = 0;  ///< of the model alone

  Expr S(int i, int j) const { return form.x[n + j * n + i]; }
  Expr S_dot(int i, int j) const { return form.xdot[n + j * n + i]; }
  Expr Z(int i, int j) const { return form.z[m + j * m + i]; }
  /// de/dp_j for an expression in the leaves of the model's form.
  Expr derivative(Expr e, int j) const;
};

/// with_respect_to: parameters of the form, or states of it (their initial values).
/// Throws Error naming what is neither.
Variational variational(const dae::FirstOrder& form, const std::vector<Expr>& with_respect_to);

/// ∂x(0)/∂p_j, n × k: the unit vectors for initial values and 0 for parameters, moved onto the tangent of the
/// conditions 0 = c(t, x, p) that a start must satisfy. `held`: the states that keep their value when a
/// parameter changes (those that were fixed). values: of all leaves at the start.
Mat initial_sensitivity(const Variational& model, const std::vector<Expr>& conditions,
                        const std::vector<char>& held, const std::unordered_map<Expr, double>& values);

}  // namespace pendula::integrate
