#include "lua/bind/integrate/sweep_store.hpp"

#include <algorithm>

#include "expr/print/print.hpp"
#include "lua/core/library.hpp"
#include "lua/core/values.hpp"
#include "store/sha256.hpp"

namespace pendula::lua {

std::string fingerprint_of(const std::string& model, const std::string& options, const std::string& hidden,
                           const std::string& contents) {
  std::string all = "pendula " PENDULA_VERSION;
  for (const std::string* part : {&model, &options, &hidden, &contents}) all += std::string(1, '\0') + *part;
  return store::sha256(all);
}

SweepText read_sweep_text(Call& call) {
  lua_State* L = call.L;
  include_embedded(L, "sweep_text");
  lua_pushvalue(L, 1);
  lua_pushvalue(L, 2);
  protected_call(L, 2, 4);
  std::string parts[4];
  for (int i = 0; i < 4; ++i) {
    std::size_t size = 0;
    const char* bytes = lua_tolstring(L, i - 4, &size);
    parts[i].assign(bytes, size);
  }
  lua_pop(L, 4);
  return {parts[0], parts[1], parts[2], fingerprint_of(parts[0], parts[1], parts[2], parts[3])};
}

store::Description describe_store(const integrate::Sweep& sweep, const random::SampleSpace& space,
                                  const SweepText& text) {
  store::Description d;
  d.fingerprint = text.fingerprint;
  d.program = "pendula " PENDULA_VERSION;
  d.model = text.model;
  d.options = text.options;
  d.hidden = text.hidden;
  d.runs = sweep.runs();
  d.times = sweep.times();
  const auto& model = *sweep.request().model;
  std::vector<Expr> unknowns = model.states();
  const auto algebraic = model.algebraic();
  unknowns.insert(unknowns.end(), algebraic.begin(), algebraic.end());
  for (Expr leaf : sweep.kept_leaves()) {
    d.leaves.push_back(leaf_name(leaf));
    d.shown.push_back(std::find(unknowns.begin(), unknowns.end(), leaf) != unknowns.end());
  }
  for (const random::Column& column : space.columns()) {
    const bool initial = std::any_of(unknowns.begin(), unknowns.end(),
                                     [&](Expr leaf) { return leaf_name(leaf) == column.name; });
    d.varied.push_back(initial ? column.name + "(0)" : column.name);
  }
  return d;
}

}  // namespace pendula::lua
