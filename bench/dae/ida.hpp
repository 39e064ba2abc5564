// The peer: IDA of SUNDIALS on the same equations, with our compiled residual and
// exact Jacobian as its callbacks.
#pragma once

#include "integrate/problem/problem.hpp"

namespace pendula::bench {

struct IdaOptions {
  double to = 1, rtol = 1e-6, atol = 1e-6;
  bool sparse = false;             ///< KLU instead of the dense solver
  bool suppress_algebraic = true;  ///< leave z out of the error test
  double newton_coefficient = 0;   ///< 0: IDA's default (0.33)
  bool flush_denormals = false;
};

struct IdaResult {
  Vec y;  ///< x, z at `to`; empty if IDA gave up
  double seconds = 0;
  long steps = 0, residuals = 0, jacobians = 0;
  std::string trouble;
};

/// One run from a consistent start; the time is that of IDASolve alone.
IdaResult run_ida(integrate::Problem& problem, const integrate::Point& start, const IdaOptions& options);

}  // namespace pendula::bench
