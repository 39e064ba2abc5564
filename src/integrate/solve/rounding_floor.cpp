#include "integrate/solve/rounding_floor.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "integrate/solve/tolerances.hpp"

namespace pendula::integrate {

RoundingFloor::RoundingFloor(std::vector<int> index, int states) : index_(std::move(index)) {
  for (std::size_t k = 0; k < index_.size(); ++k) {
    raisable_.push_back(k >= static_cast<std::size_t>(states));
    has_algebraic_ = has_algebraic_ || raisable_[k];
    has_multipliers_ = has_multipliers_ || (raisable_[k] && index_[k] > 1);
  }
}

/// The effect on the unknowns of errors ε (|∂F_i/∂t t| + Σ |∂F_i/∂y_j y_j|), with three random sign patterns.
void RoundingFloor::measure(const Matrix& A, const double* y, const double* xdot) {
  const std::size_t size = index_.size();
  std::vector<double> terms = A.time_terms, right(size);
  for (std::size_t k = 0; k < A.entries.size(); ++k) {
    const auto [row, column] = A.positions[k];
    terms[row] += std::fabs(A.entries[k] * (A.in_mass[k] ? xdot : y)[column]);
  }
  open_.assign(size, 0.0);
  std::uint32_t random = 1;
  for (int pattern = 0; pattern < 3; ++pattern) {
    for (std::size_t k = 0; k < size; ++k) {
      random = random * 1664525u + 1013904223u;
      right[k] = random >> 31 ? eps * terms[k] : -eps * terms[k];
    }
    A.solve(right.data());
    for (std::size_t k = 0; k < size; ++k) open_[k] = std::max(open_[k], std::fabs(right[k]));
  }
}

RoundingFloor::Answer RoundingFloor::judge(const Matrix& A, const double* y, const double* xdot,
                                           const std::vector<double>& scale, double dt, double length,
                                           double stages, const Tolerances& tolerances) {
  constexpr double acceptable = 0.3;  // of the tolerances
  measure(A, y, xdot);
  ErrorSum all, plain;
  double largest = 0;
  for (std::size_t k = 0; k < open_.size(); ++k) {
    const double share = open_[k] / scale[k];
    all.add(share);
    if (raisable_[k]) continue;
    plain.add(share);
    if (share > largest) {
      largest = share;
      worst = static_cast<int>(k);
    }
  }
  const int n = static_cast<int>(open_.size());
  floor = all.norm(n);
  trouble = 0;
  if (!(length <= stages * floor)) return Answer::no;
  if (length <= acceptable) return Answer::accepted;
  if (stages * plain.norm(n) > acceptable) {
    trouble = open_[*worst];
    return Answer::no;
  }
  bool raised = false;  // else the next attempt is this one again
  least_.resize(open_.size(), 0.0);
  for (std::size_t k = 0; k < open_.size(); ++k) {
    double least = raisable_[k] ? stages / acceptable * open_[k] : 0;
    least /= tolerances.relaxation(static_cast<int>(k), index_[k], dt);
    if (!(least > least_[k])) continue;
    least_[k] = least;
    raised = true;
  }
  return raised && std::isfinite(floor) ? Answer::raised : Answer::no;
}

double RoundingFloor::least(int k, double dt, const Tolerances& tolerances) const {
  return least_.empty() ? 0 : least_[k] * tolerances.relaxation(k, index_[k], dt);
}

std::string raised_text() {
  return "Rounding errors in the equations, divided by the steps, are all that is left of algebraic "
         "unknowns: the solution is singular here, or the tolerances ask for more digits than there are";
}

std::string rounding_text(const RoundingFloor& rounding, const std::string& name) {
  return text("Rounding errors in the equations change ", name, " by ", rounded(rounding.trouble, 1),
              " and more: the tolerances ask for more digits than there are");
}

}  // namespace pendula::integrate
