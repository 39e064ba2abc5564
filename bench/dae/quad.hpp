// Reference values: collocation methods in quadruple precision on the equations of a model of index 0 or 1.
//
// Residuals, stages and sums have 33 digits. The corrections of Newton's iteration are solved for in doubles:
// what they lack, the next iteration adds.
#pragma once

#include <string>

#include "integrate/problem/problem.hpp"

namespace pendula::bench {

struct QuadOptions {
  double to = 1, tolerance = 1e-20;
  double size = 1e-3;  ///< |error of y| ≤ tolerance · (|y| + size)
  int stages = 7;
  bool gauss = false;          ///< Gauss, order 2s; else Radau IIA, order 2s - 1
  std::vector<double> breaks;  ///< where the equations are not smooth in t
};

struct QuadResult {
  std::vector<std::string> y;  ///< x and z at `to`, 25 digits
  long steps = 0;
};

/// Throws Failure where steps vanish.
QuadResult run_quad(integrate::Problem& problem, const integrate::Point& start, const QuadOptions& options);

}  // namespace pendula::bench
