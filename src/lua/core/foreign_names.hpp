// Names that users of MATLAB, Python, Julia, Maple and Modelica type first, with their counterparts here.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace pendula::lua {

/// The counterpart of a global `name` of another language, "" if nothing is known about it.
std::string remedy_for_name(std::string_view name);

/// The same for a field or a method `name` of a value of the type.
std::string remedy_for_member(std::string_view type, std::string_view name);

/// The same for an option of a function that knows the options `known`: "write rtol = 1e-6" for "RelTol".
std::string remedy_for_option(std::string_view name, const std::vector<std::string>& known);

/// The same for a method of integration: "dopri5" for "ode45"; "" if nothing is known about it.
std::string method_like(std::string_view name);

}  // namespace pendula::lua
