// Models and starts in Lua, for other bindings.
//
// The folder reads what dae{…}, lagrange{…}, init and reduce are given and hands it to src/dae and src/mech;
// it contains no mathematics. model_input.cpp: equations and options of models; dae.cpp: questions to a
// model; forms.cpp: reduce, trace; start.cpp, start_read.cpp: init and its options; structure.cpp,
// pencil.cpp, units.cpp, mech.cpp: the reports of these names; transitions.hpp: events.
#pragma once

#include "dae/start/start.hpp"
#include "lua/core/values.hpp"

namespace pendula::lua {

template <>
struct TypeName<dae::Model> {
  static constexpr const char* value = "model";
};
template <>
struct TypeName<dae::ConsistentState> {
  static constexpr const char* value = "start";
};

/// A list of consistency conditions as a value that prints.
struct Constraints {
  std::vector<dae::Constraint> list;
  bool complete = true;  ///< as many as there are conditions
  dae::ModelPtr model;   ///< whose equations they came from
};
template <>
struct TypeName<Constraints> {
  static constexpr const char* value = "constraints";
};

/// The model a method is called on.
inline dae::ModelPtr model_ptr(Call& call) { return call.shared<dae::Model>(1, "model"); }

/// The option as a column; empty where it is absent.
VecX option_column(Call& call, const Options& options, const char* key);

/// Every leaf of the model and of its lineage that a user may name.
std::vector<Expr> known_leaves(const dae::Model& model);

/// { [p] = {1, 0, 0}, x = 1 } as leaf values.
dae::LeafValues read_leaf_values(lua_State* L, int index, const std::string& what, const dae::Model& model);

/// The options fix, guess, inputs, params, from.
dae::StartRequest read_start_request(lua_State* L, const Options& options, const dae::Model& model);

/// What parts of the model say about its start holds where the request says nothing about the same leaf.
void add_declared(dae::StartRequest& request, const dae::Model& model);

/// The parameters whose values at the start are not those of the start's model: they were given to init.
dae::ParameterValues parameter_overrides(const dae::ConsistentState& at);

/// A start of a relative, in the leaves of this model. Throws Error where a state has no value. The last
/// results are cached for loops that begin at one start again and again.
dae::ConsistentStatePtr translated(const dae::ConsistentStatePtr& at, const dae::ModelPtr& model);

/// The same; but if this model is a form "array" whose rows do not determine the unknowns at the start, the
/// model of the result is the form with the rows that do.
dae::ConsistentStatePtr translated_choosing(const dae::ConsistentStatePtr& at, const dae::ModelPtr& model);

/// Throws Error where the start belongs to a form "array" with other rows, for callers that need this one.
void require_rows(const dae::ConsistentState& at, const dae::ModelPtr& model);

/// init in form "array": by the equations of the model, since rows that were chosen at another point may be
/// regular at the start and wrong. The model of the result is a form whose rows determine it.
dae::ConsistentStatePtr start_of_rows(const dae::StartRequest& request, const dae::ModelPtr& model);

/// The option `start` of integrate and its relatives: a result of init (of this model or a relative), or a
/// table of conditions that init completes (options inputs, params, from are read too). A table that
/// contradicts only the invariants of a reduced form is accepted with a warning on stderr: its drift is what
/// drift() explains. Throws Error when it is absent. The start of a form "array" may be that of a form with
/// other rows, as by translated_choosing().
dae::ConsistentStatePtr read_start(lua_State* L, const Options& options, const dae::ModelPtr& model);

/// Pushes the option start; of a solution the start at its end. Returns its place on the stack.
int push_start(lua_State* L, const Options& options);

}  // namespace pendula::lua
