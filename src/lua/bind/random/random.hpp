// Random numbers and distributions between Lua and C++.
//
// The folder reads distributions, designs and seeds and hands them to src/random. random.cpp: numbers;
// distributions.cpp: normal{…}, uniform{…} … as values; samples.cpp: statistics of samples. A stream of
// numbers is determined by seed and position, so that a script gives the same numbers in every run.
#pragma once

#include "lua/core/values.hpp"
#include "random/distribution.hpp"
#include "random/philox.hpp"

namespace pendula::lua {

template <>
struct TypeName<random::Distribution> {
  static constexpr const char* value = "distribution";
};
template <>
struct TypeName<random::JointNormal> {
  static constexpr const char* value = "joint_distribution";
};

/// One of several numbers that vary together.
struct JointComponent {
  random::JointNormalPtr joint;
  int number;
};
template <>
struct TypeName<JointComponent> {
  static constexpr const char* value = "joint_component";
};

/// The distribution at `index`, also of a density of noise that has one; null for anything else.
random::DistributionPtr distribution_at(lua_State* L, int index);

/// The series of numbers that rand and randn go through.
struct ScriptNumbers {
  std::uint64_t seed = 1, next = 0;
  std::uint32_t series = 0;
};
/// Those of this state.
ScriptNumbers& script_numbers(lua_State* L);
/// Uniform in (0, 1): the next one.
double next_uniform(ScriptNumbers& numbers);

}  // namespace pendula::lua
