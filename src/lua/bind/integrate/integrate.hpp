// Tableaus and solutions in Lua, for other bindings.
//
// The folder reads the options of integrate, sweep, newton and gauss_newton and shows their results:
// integrate.cpp, integrate_options.hpp: runs; solution.cpp, solution_parts.cpp, run_records.cpp,
// event_list.hpp: what a solution answers; sweep*.cpp, shards.cpp, parallel.cpp: many runs; tableau.cpp,
// methods.cpp, stability.cpp: methods; newton.cpp, gauss_newton.cpp, iterates.hpp: the laboratory of src/lab.
#pragma once

#include "integrate/simulation/simulate.hpp"
#include "lua/core/call.hpp"

namespace pendula::lua {

template <>
struct TypeName<integrate::Tableau> {
  static constexpr const char* value = "tableau";
};
template <>
struct TypeName<integrate::Trajectory> {
  static constexpr const char* value = "solution";
};

/// At the prompt a run that did not reach its end says so, and so does what is asked about its last point.
void report_early_end(Call& call, const char* what, const integrate::Solution& run);

/// Keeps the options (argument 2) of the solution on top of the stack: sol.options.
void remember_options(lua_State* L);

}  // namespace pendula::lua
