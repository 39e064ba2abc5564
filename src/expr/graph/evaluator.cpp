#include "expr/graph/evaluator.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/graph/solve.hpp"

namespace pendula {

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

double Evaluator::component(const Step& step, const std::vector<double>& values, Solutions& solutions) const {
  const Expr head = head_of(step.node);
  auto found = solutions.find(head);
  if (found == solutions.end())
    found = solutions.emplace(head, solution_value(head, [&](Expr e) { return values[place_.at(e)]; })).first;
  return found->second[component_of(step.node)];
}

}  // namespace pendula
