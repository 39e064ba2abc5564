// Shared by the bindings of linear systems.
//
// The folder reads what tf, ss, zpk, feedback … are given and hands it to src/lti, one file for each of its
// subjects: lti_construct.cpp and lti_read.cpp make systems, lti_connect.cpp and lti_delay.cpp combine
// them, lti_linearize.cpp takes them from models, lti_analysis.cpp, lti_response.cpp and lti_design.cpp ask
// them; complex.cpp: complex numbers.
#pragma once

#include <functional>
#include <optional>

#include "lti/delay.hpp"
#include "lua/bind/expr/expr.hpp"
#include "lua/core/values.hpp"

namespace pendula::lua {

template <>
struct TypeName<lti::System> {
  static constexpr const char* value = "lti";
};

template <>
struct TypeName<lti::DelaySystem> {
  static constexpr const char* value = "delay system";
};
template <>
struct TypeName<lti::Response> {
  static constexpr const char* value = "response";
};
template <>
struct TypeName<lti::FrequencyResponse> {
  static constexpr const char* value = "frequency response";
};
/// When a response is asked for: nothing, an end time, a list of times, { to = 10 } or { times = … }; `until`
/// makes the times up to an end, or as far as it sees fit.
Vec read_times(Call& call, int i, const std::function<Vec(std::optional<double>)>& until);
/// An operation ('*', '/', '+', '-', 'f' for feedback, 'c' for c2d) of which one
/// operand has delays (lti_delay.cpp).
int delayed_operator(Call& call, char operation);

/// A complex number with exact or approximate parts.
struct ComplexNumber {
  Expr re, im;
};
template <>
struct TypeName<ComplexNumber> {
  static constexpr const char* value = "complex";
};

/// Poles or zeros: a list that prints.
struct Roots {
  std::string what;  ///< "poles", "zeros", "modes"
  std::vector<dae::Mode> list;
  std::vector<Expr> symbolic;  ///< instead of the list, for systems with parameters without value
};
template <>
struct TypeName<Roots> {
  static constexpr const char* value = "roots";
};

/// The system a method is called on.
inline const lti::System& system_of(Call& call) { return call.object<lti::System>(1, "G"); }
/// A linear system; a number, an expression or a matrix is a gain.
lti::System read_system(Call& call, int i, const char* name);
int push_system(Call& call, lti::System g);
/// The matrix in doubles where an entry is known as a double only.
int push_entries(lua_State* L, const MatX& m);
/// A Lua number where e has a value (whole numbers as integers), so that == and
/// string.format know it; else the expression.
int push_number_or_expression(lua_State* L, Expr e);
/// The same as push_entries; one entry is a number or an expression.
int push_entries_or_one(lua_State* L, const MatX& m);
/// complex(re, im), { re, im }, or a number.
ComplexNumber read_complex(lua_State* L, int index, const std::string& what);
/// A number or expression where the imaginary part is zero.
int push_complex(lua_State* L, const ComplexNumber& z);
/// "-1 + 2 i"
std::string complex_text(const ComplexNumber& z);
int push_roots(Call& call, Roots roots);
/// A list of strings, or a column of symbols by their names.
std::vector<std::string> read_names(lua_State* L, int index, const std::string& what);
int push_names(lua_State* L, const std::vector<std::string>& names);
/// A column with one entry per state, or a table by the names of states (missing ones are 0).
VecX read_state(lua_State* L, int index, const std::string& what, const lti::System& g);

}  // namespace pendula::lua
