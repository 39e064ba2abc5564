// Responses in time, exact at the sampling points: the state is carried from one to the next by e^{AΔt}.
#pragma once

#include <functional>

#include "lti/curve_facts.hpp"
#include "lti/system.hpp"

namespace pendula::lti {

struct Response {
  std::string kind;  ///< "step", "impulse", "initial", "lsim"
  SystemPtr system;
  Vec t;
  std::vector<Mat> y, x;                       ///< by input (one for "initial" and "lsim"): rows belong to t
  std::vector<std::vector<CurveFacts>> facts;  ///< [input][output], for "step" only; empty if unstable
  bool settles = false;                        ///< all poles decay
};

/// Where responses are worth looking at: 0 … T in `steps` equal steps; T from the slowest mode, the step from
/// the fastest oscillation; in discrete time multiples of Ts.
Vec response_times(const System& g, std::optional<double> to = {});

/// The input j = 1 from t = 0 on, the others 0; zero initial state. Times may begin later. Throws Error on
/// negative times (and those below: what happens at t = 0)
Response step(const System& g, const Vec& t);
/// The input j = δ(t): x(0⁺) = B eⱼ; a direct feedthrough adds D δ(t), which is left out. In
/// discrete time u₀ = 1/Ts·Ts = 1.
Response impulse(const System& g, const Vec& t);
Response initial(const System& g, const Vec& x0, const Vec& t);

/// Inputs known at the times only: between them straight lines, or constant (hold). One row of u per time.
Response simulate(const System& g, const Mat& u, const Vec& t, const Vec& x0, bool hold);
/// Inputs known everywhere: between two times u is the polynomial through five Gauss nodes, on pieces no
/// longer than 1/‖A‖ or a thousandth of the step; its response is exact, also of stiff systems.
Response simulate(const System& g, const std::function<Vec(double)>& u, const Vec& t, const Vec& x0);

std::string describe(const Response& r);

}  // namespace pendula::lti
