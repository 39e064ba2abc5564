// sys:units(): dimensions of all equations. Reads arguments, calls src/dae.
#include <utility>

#include "base/text.hpp"
#include "dae/model/truncated_text.hpp"
#include "dae/units/dimension.hpp"
#include "expr/print/print.hpp"
#include "lua/bind/dae/dae.hpp"

namespace pendula::lua {
namespace {

std::string with_unit(Expr e, const dae::Dimension& d) {
  return text(dae::truncated_text(e, 80), " [", dae::unit_text(d), "]");
}

int units(Call& call) {
  const auto& model = call.object<dae::Model>(1, "model");
  lua_newtable(call.L);
  lua_Integer n = 0;
  for (std::size_t i = 0; i < model.residuals.size(); ++i) {
    const auto [block, row] = model.origin[i];
    const dae::Block& b = model.blocks[block];
    const auto clash = dae::dimension_clash(b.lhs[row], b.rhs[row]);
    if (!clash) continue;
    std::string left = with_unit(clash->left, clash->left_dimension),
                right = with_unit(clash->right, clash->right_dimension);
    const bool sides = clash->left == b.lhs[row];
    if (!sides && right < left) std::swap(left, right);  // operands of a sum have no natural order
    const std::string line = text(model.label(i), b.note.empty() ? "" : " of " + b.note, ", ",
                                  model.equation_text(i), ": ", left, " against ", right);
    lua_pushlstring(call.L, line.data(), line.size());
    lua_rawseti(call.L, -2, ++n);
  }
  return 1;
}

}  // namespace

extern const Module units_module = {
    "units",
    "Units",
    {
        {"model:units", units, "sys:units() -> list of texts",
         R"(The equations in which units contradict each other, with the two sides and their units; an empty
            list where there are none. Symbols without a unit fit everything. model{ units = "check", … } makes
            it an error.)",
         R"(s, v = var("s", { unit = "m" }), var("v", { unit = "m/s" })
            return dae{ der(s) ~ 2*v, der(v) ~ -v + s }:units()[1])",
         "(2), v′ = s - v: s [m] against v [m/s]"},
    }};

}  // namespace pendula::lua
