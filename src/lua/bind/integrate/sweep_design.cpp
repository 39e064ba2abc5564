// Properties of the design of a sweep, and access to its numbers by position.
#include "base/text.hpp"
#include "lua/bind/dae/dae.hpp"
#include "lua/bind/integrate/sweep_record.hpp"
#include "lua/bind/random/random.hpp"

namespace pendula::lua {
namespace {

const random::SampleSpace& space_of(Call& call) { return *call.object<SweepRecord>(1, "sweep").space; }

int design(Call& call) {
  const auto& d = space_of(call).design();
  if (d) return call.push(random::name_of(d->request().kind));
  return call.push_nil();
}

int dimensions(Call& call) {
  const auto& d = space_of(call).design();
  return call.push(d ? d->request().dimensions : 0);
}

int correlated(Call& call) {
  for (const random::Column& column : space_of(call).columns())
    if (column.joint) return call.push(true);
  return call.push(false);
}

int distributions(Call& call) {
  lua_newtable(call.L);
  for (const random::Column& column : space_of(call).columns()) {
    if (!column.distribution) continue;
    push_object(call.L, column.distribution, TypeName<random::Distribution>::value);
    lua_setfield(call.L, -2, column.name.c_str());
  }
  return 1;
}

int unit(Call& call) {
  const auto& d = space_of(call).design();
  const long run = call.integer(2, "run"), dimension = call.integer(3, "dimension");
  if (!d || run < 1 || run > d->runs() || dimension < 1 || dimension > d->request().dimensions)
    throw Error(text("run ", run, ", dimension ", dimension, " is not a coordinate of this sweep's design"));
  return call.push(d->unit(run - 1, static_cast<int>(dimension - 1)));
}

int design_model(Call& call) {
  return call.push(call.object<SweepRecord>(1, "sweep").sweep->request().model);
}

int random_at(Call& call) {
  return call.push(
      random::uniform_at({static_cast<std::uint64_t>(call.integer(1, "seed")), random::Use::bootstrap,
                          static_cast<std::uint64_t>(call.integer(2, "number")), 0}));
}

}  // namespace

extern const Module sweep_design_module = {
    "sweep",
    "",
    {
        {"sweep#design", design, "s.design -> string or nil",
         "How the distributions were drawn from; nil: lists.", "", ""},
        {"sweep#dimensions", dimensions, "s.dimensions -> integer", "How many numbers a run draws.", "", ""},
        {"sweep#correlated", correlated, "s.correlated -> boolean", "Some quantities vary together.", "", ""},
        {"sweep#distributions", distributions, "s.distributions -> table",
         "The distributions by the names of the varied parameters and initial values.", "", ""},
        {"sweep#model", design_model, "s.model -> model", "The model.", "", ""},
        {"sweep:unit", unit, "s:unit(run, dimension) -> number",
         "The number between 0 and 1 that the value of a run was made from.", R"(
             x, k = var "x", param "k"
             s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = normal(1, 0.1) }, runs = 64 })
             u = s:unit(1, 1)
             0 < u and u < 1)",
         "true"},
        {"random_at", random_at, "random_at(seed, number) -> number",
         R"(Number `number` of sequence `seed`, between 0 and 1: the same wherever and whenever it is asked for.)",
         "print(random_at(1, 5) == random_at(1, 5))", "true"},
    }};

}  // namespace pendula::lua
