#include "expr/graph/evaluator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/operation.hpp"
#include "expr/graph/solve.hpp"

namespace pendula {
namespace {

constexpr double unit_roundoff = eps / 2;

/// The effect of an error of operand i: by the slope, or by differences if the error is not small relative to
/// the operand (also from 0, if that is nearer, since a root has no value beyond).
double passed_on(Op op, int i, const double (&operand)[3], double error) {
  constexpr double small = 1e-6;  // the slope is then right to about as much
  if (error == 0) return 0;
  if (error <= small * std::fabs(operand[i]))
    if (const double slope = apply_slope(op, i, operand[0], operand[1], operand[2]); std::isfinite(slope))
      // the slope of a branch that is not taken may be infinite
      return slope == 0 ? 0 : std::fabs(slope) * error;
  const double value = apply(op, operand[0], operand[1], operand[2]);
  double largest = 0;
  for (double side : {-error, error, -std::copysign(std::min(error, std::fabs(operand[i])), operand[i])}) {
    double moved[3] = {operand[0], operand[1], operand[2]};
    moved[i] += side;
    if (const double there = apply(op, moved[0], moved[1], moved[2]); std::isfinite(there))
      largest = std::max(largest, std::fabs(there - value));
  }
  return largest;
}

/// The error of an operation from those of its operands and its own rounding. Sums, differences and quotients
/// are rounded correctly; C library functions err by a unit in the last place.
double operation_error(Op op, double value, const double (&operand)[3], const double (&error)[3]) {
  const OpInfo& row = info(op);
  if (row.style == Style::cond || op == Op::sign) return 0;
  double sum = 0;
  for (int i = 0; i < row.arity; ++i) sum += passed_on(op, i, operand, error[i]);
  const bool exact = op == Op::neg || op == Op::abs || op == Op::min || op == Op::max || op == Op::ifelse;
  return exact ? sum : sum + (row.style == Style::infix ? 1 : 2) * unit_roundoff * std::fabs(value);
}

}  // namespace

Evaluator::Evaluator(std::span<const Expr> outputs, std::span<const Expr> leaves) : leaves_(leaves.size()) {
  for (std::size_t k = 0; k < leaves.size(); ++k) place_.try_emplace(leaves[k], static_cast<Place>(k));
  std::vector<Expr> operations;
  for (Expr node : topological(outputs)) {
    if (place_.count(node)) continue;
    if (node.is_constant() || node.is_symbol()) {
      place_[node] = static_cast<Place>(leaves_ + constants_.size());
      constants_.push_back(evaluate({&node, 1}, {})[0]);
    } else {
      operations.push_back(node);
    }
  }
  const std::size_t first = leaves_ + constants_.size();
  for (Expr node : operations) {
    if (node.op() == Op::call)
      throw Error(text("'", call_of(node).name,
                       "' is an unspecified function: it has no value; substitute it with subs"));
    Step step{node.op(), {0, 0, 0}, node};
    const auto operands = node.operands();
    for (std::size_t i = 0; i < std::min<std::size_t>(3, operands.size()); ++i)
      step.operand[i] = place_.at(operands[i]);
    place_[node] = static_cast<Place>(first + steps_.size());
    steps_.push_back(step);
  }
  for (Expr output : outputs) outputs_.push_back(place_.at(output));
}

std::vector<double> Evaluator::operator()(std::span<const double> leaves) const {
  std::vector<double> values(leaves.begin(), leaves.end());
  values.insert(values.end(), constants_.begin(), constants_.end());
  values.reserve(values.size() + steps_.size());
  Solutions solutions;
  for (const Step& step : steps_)
    values.push_back(step.op == Op::solve ? component(step, values, solutions)
                                          : apply(step.op, values[step.operand[0]], values[step.operand[1]],
                                                  values[step.operand[2]]));
  std::vector<double> result;
  result.reserve(outputs_.size());
  for (Place place : outputs_) result.push_back(values[place]);
  return result;
}

std::vector<double> Evaluator::rounding_errors(std::span<const double> leaves) const {
  std::vector<double> values(leaves.begin(), leaves.end());
  values.insert(values.end(), constants_.begin(), constants_.end());
  values.reserve(values.size() + steps_.size());
  std::vector<double> errors;
  errors.reserve(values.size() + steps_.size());
  for (double value : values) errors.push_back(unit_roundoff * std::fabs(value));
  for (std::size_t k = leaves_; k < values.size(); ++k)  // constants that are integers are exact
    if (values[k] == std::rint(values[k])) errors[k] = 0;
  Solutions solutions, solution_errors;
  for (const Step& step : steps_) {
    if (step.op == Op::solve) {
      values.push_back(component(step, values, solutions));
      errors.push_back(error_of_component(step, values, errors, solution_errors));
      continue;
    }
    const double operand[3] = {values[step.operand[0]], values[step.operand[1]], values[step.operand[2]]};
    const double error[3] = {errors[step.operand[0]], errors[step.operand[1]], errors[step.operand[2]]};
    values.push_back(apply(step.op, operand[0], operand[1], operand[2]));
    errors.push_back(operation_error(step.op, values.back(), operand, error));
  }
  std::vector<double> result;
  result.reserve(outputs_.size());
  for (Place place : outputs_) result.push_back(errors[place]);
  return result;
}

double Evaluator::component(const Step& step, const std::vector<double>& values, Solutions& solutions) const {
  const Expr head = head_of(step.node);
  auto found = solutions.find(head);
  if (found == solutions.end())
    found = solutions.emplace(head, solution_value(head, [&](Expr e) { return values[place_.at(e)]; })).first;
  return found->second[component_of(step.node)];
}

/// Elimination is as accurate as with an error of n roundings in every entry: the largest change of the
/// component by a few random errors of this size.
double Evaluator::error_of_component(const Step& step, const std::vector<double>& values,
                                     const std::vector<double>& errors, Solutions& solution_errors) const {
  constexpr int draws = 4;  // a choice: each one is another solution of the system
  const Expr head = head_of(step.node);
  auto found = solution_errors.find(head);
  if (found == solution_errors.end()) {
    const double n = system_of(head).size;
    const auto solution = solution_value(head, [&](Expr e) { return values[place_.at(e)]; });
    std::vector<double> largest(solution.size(), 0);
    std::minstd_rand random(1);
    std::uniform_real_distribution<double> part(-1, 1);
    for (int k = 0; k < draws; ++k) {
      const auto moved = solution_value(head, [&](Expr e) {
        const Place at = place_.at(e);
        return values[at] + part(random) * (errors[at] + n * unit_roundoff * std::fabs(values[at]));
      });
      for (std::size_t i = 0; i < solution.size(); ++i)
        largest[i] = std::max(largest[i], n * std::fabs(moved[i] - solution[i]));
    }
    found = solution_errors.emplace(head, std::move(largest)).first;
  }
  return found->second[component_of(step.node)];
}

}  // namespace pendula
