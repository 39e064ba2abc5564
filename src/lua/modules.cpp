// The list of binding modules: one extern line and one entry each. The order is the order of help().
#include "lua/state.hpp"

namespace pendula::lua {

extern const Module dae_module;
extern const Module mech_module;

const std::vector<const Module*>& modules() {
  static const std::vector<const Module*> list = {
      &mech_module,
      &dae_module,
  };
  return list;
}

}  // namespace pendula::lua
