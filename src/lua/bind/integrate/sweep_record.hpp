// The object of the Lua type "sweep".
#pragma once

#include "integrate/sweep/sweep.hpp"
#include "lua/core/call.hpp"
#include "random/sample_space.hpp"

namespace pendula::lua {

struct SweepRecord {
  std::shared_ptr<const integrate::Sweep> sweep;
  std::shared_ptr<const random::SampleSpace> space;
  std::shared_ptr<const store::RunStore> store;  ///< or null: in memory
};
template <>
struct TypeName<SweepRecord> {
  static constexpr const char* value = "sweep";
};

}  // namespace pendula::lua
