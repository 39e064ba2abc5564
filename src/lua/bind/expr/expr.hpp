// Shared by the binding files of the expression vocabulary: values of any shape and their arithmetic.
//
// A Lua float stays a double as long as it meets doubles only; whatever meets a symbol
// becomes an exact constant. In a product of an exact matrix of constants and a matrix of
// doubles the doubles win: data is never interned.
#pragma once

#include <string>
#include <variant>

#include "lua/core/values.hpp"

namespace pendula::lua {

/// A scalar (exact, or a Lua float) or a matrix (exact, or doubles).
using Value = std::variant<Expr, double, MatX, Mat>;

Value to_value(lua_State* L, int index, const std::string& what);
int push(lua_State* L, const Value& value);
bool is_matrix(const Value& v);

/// "3×1 column", "2×3 matrix"
std::string shape(const MatX& m);
std::string shape(const Mat& m);
std::string shape(const Value& v);

/// Shapes must fit; the errors say both shapes and what to write instead.
Value sum(const Value& a, const Value& b);
Value difference(const Value& a, const Value& b);
Value product(const Value& a, const Value& b);
Value quotient(const Value& a, const Value& b);
Value power(const Value& a, const Value& b);
MatX multiply(const MatX& a, const MatX& b);

/// An operation of ops.def on scalars, or entry by entry on matrices of one shape (scalars are repeated).
/// Operands that are all doubles give doubles; a result that is not a number is an error.
Value apply_entrywise(Op op, const std::vector<Value>& operands);

/// A Lua boolean is the condition 1 or 0.
Value to_condition(lua_State* L, int index, const std::string& what);

/// Refuses matrices of more than 10⁷ entries and negative sizes.
void check_size(long rows, long cols);

/// The text that print shows.
std::string shown(const MatX& m);
std::string shown(const Mat& m);

}  // namespace pendula::lua
