// Shared by the binding files of identification.
//
// The folder reads data, orders and options and hands them to src/sysid. sysid_data.cpp, sysid_read.cpp,
// signals.cpp, sysid_prefilter.cpp: data; sysid_models.cpp, sysid_lsq.cpp, sysid_grey.cpp,
// sysid_predictor.cpp, sysid_search.cpp, sysid_likelihood.cpp: estimators; sysid_fields.cpp,
// sysid_predict.cpp, sysid_validation.cpp, sysid_systems.cpp: what an estimated model answers.
#pragma once

#include "lua/bind/expr/expr.hpp"
#include "lua/core/values.hpp"
#include "lua/read/iddata.hpp"
#include "sysid/fit/predictor_fit.hpp"
#include "sysid/model/id_model.hpp"
#include "sysid/model/model.hpp"
#include "sysid/regression/least_squares.hpp"

namespace pendula::lua {

template <>
struct TypeName<sysid::IdModel> {
  static constexpr const char* value = "idmodel";
};

template <>
struct TypeName<sysid::Density> {
  static constexpr const char* value = "density";
};
template <>
struct TypeName<sysid::Predictor> {
  static constexpr const char* value = "predictor";
};
template <>
struct TypeName<sysid::ParameterSet> {
  static constexpr const char* value = "parameter_set";
};

/// The model a method is called on.
inline const sysid::IdModel& idmodel_of(Call& call) { return call.object<sysid::IdModel>(1, "idmodel"); }
/// The option `noise`: a density.
std::shared_ptr<const sysid::Density> read_noise(Call& call, const Options& options);
/// Pushes the set of parameters that uniform noise leaves.
int push_parameter_set(Call& call, sysid::Regression r, const sysid::Density& uniform);

/// Data as doubles, NaN allowed: a list of numbers (column), a list of rows, a list of columns (each a list
/// or a matrix), or a matrix. `rows` > 0: what has that many columns instead is transposed.
Mat to_data(lua_State* L, int index, const std::string& what, Eigen::Index rows = 0);

/// Argument 2 of a simulation: data, or inputs alone (a list, a matrix), whose outputs are then 0: they may
/// be used with Seed::zero only. `inputs`, `outputs`, `Ts`: of the model.
struct SimulationData {
  sysid::IdData data;
  bool inputs_alone = false;
};
SimulationData simulation_data(Call& call, Eigen::Index inputs, Eigen::Index outputs, double Ts);

/// A string or a list of strings; numbers become their text.
std::vector<std::string> to_words(lua_State* L, int index, const std::string& what);
/// A whole number or a list of them.
std::vector<int> to_whole_numbers(lua_State* L, int index, const std::string& what);

/// na, nb, nc, nd, nf, nk of a call's table for one output; MIMO: row `output` of a matrix of orders.
sysid::Orders read_orders(Call& call, const Options& options, const sysid::IdData& d, Eigen::Index output);

/// What stands before the first sample: the option `ic`, or `init`, its name in earlier versions.
sysid::Seed read_seed(const Options& options, sysid::Seed fallback);

int push_words(lua_State* L, const std::vector<std::string>& words);
inline int push_row(lua_State* L, const Vec& v) { return push_matrix(L, Mat(v.transpose())); }

}  // namespace pendula::lua
