// The list of binding modules: one extern line and one entry each. The order is the order of help().
#include "lua/state.hpp"

namespace pendula::lua {

const std::vector<const Module*>& modules() {
  static const std::vector<const Module*> list = {};
  return list;
}

}  // namespace pendula::lua
