#include "method/irk_formula.hpp"

#include <doctest/doctest.h>

#include <cmath>

namespace pendula::irk_formula_test {

using pendula::integrate::radau_formula;

TEST_CASE(
    "polynomials of lower degree near the stages: exact up to their degree, through the last stage, calmer beyond") {
  for (int s : {3, 5, 7}) {
    const auto formula = radau_formula(s);
    double calmer = INFINITY;
    for (int q = s; q >= 1; --q) {
      CAPTURE(s);
      CAPTURE(q);
      std::vector<double> l(static_cast<std::size_t>(s) + 1);
      for (double theta : {0.3, 1.0, 1.7, 3.0}) {
        formula->closest(theta, q, l.data());
        for (int degree = 0; degree <= q; ++degree) {
          double sum = 0, size = 0;
          for (std::size_t j = 0; j < l.size(); ++j) {
            const double term = l[j] * std::pow(formula->nodes[j], degree);
            sum += term;
            size += std::fabs(term);
          }
          CHECK(std::fabs(sum - std::pow(theta, degree)) <= 1e-11 * (1 + size));
        }
        if (theta == 1)
          for (int j = 0; j <= s; ++j) CHECK(std::fabs(l[j] - (j == s ? 1 : 0)) <= 1e-13);
      }
      double sum = 0;  // at θ = 3
      for (double weight : l) sum += std::fabs(weight);
      CHECK(sum < calmer);
      calmer = sum;
    }
  }
}

}  // namespace pendula::irk_formula_test
