// Values of expressions in which large terms cancel: e^A of close eigenvalues is 1000 e⁻¹ - 1000 e^(-1.001),
// and divided differences of higher order lose nearly all digits of a double.
#pragma once

#include <optional>
#include <unordered_map>

#include "expr/graph/graph.hpp"

namespace pendula {

/// The value in 320 bits, rounded, where a sum or a logarithm in it loses more than two digits in
/// double arithmetic; nothing where none does, where a leaf has no value, or where an operation is not
/// one of + - · / ^ √ exp ln sin cos sinh cosh. Values given for leaves are taken as exact. What is
/// below 10⁻⁶⁰ of its terms is 0.
std::optional<double> value_without_cancellation(Expr e, const std::unordered_map<Expr, double>& leaf_values);

}  // namespace pendula
