// validate, order_scan, compare. Reads arguments, calls src/sysid/model/validation.
#include "sysid/fit/order_scan.hpp"
#include "sysid/model/validation.hpp"

#include <algorithm>
#include <cstdio>

#include "base/text.hpp"
#include "lua/bind/sysid/sysid.hpp"
#include "lua/core/interrupts.hpp"
#include "lua/core/objects.hpp"
#include "lua/screen/terminal.hpp"

namespace pendula::lua {

using Eigen::Index;
using sysid::IdData;
using sysid::IdModel;
using sysid::OrderScan;
using sysid::Validation;

struct Comparison {
  std::vector<sysid::ComparisonRow> rows;
  std::string text;
  std::vector<std::shared_ptr<const IdModel>> models;
  std::shared_ptr<const IdData> data;
};
/// One validation per output.
struct Validations {
  std::vector<std::shared_ptr<const Validation>> list;
};
template <>
struct TypeName<Validations> {
  static constexpr const char* value = "validations";
};
template <>
struct TypeName<Validation> {
  static constexpr const char* value = "validation";
};
template <>
struct TypeName<OrderScan> {
  static constexpr const char* value = "order_scan_result";
};
template <>
struct TypeName<Comparison> {
  static constexpr const char* value = "comparison";
};

namespace {

// ── validation ──

int validate(Call& call) {
  const IdModel& m = call.object<IdModel>(1, "idmodel");
  const IdData& d = call.object<IdData>(2, "data");
  const Options o = call.options(3);
  std::optional<Index> lags;
  if (o.has("lags")) lags = o.integer("lags", 25);
  if (lags && (*lags < 1 || *lags > 10000))
    throw Error(text("lags must lie between 1 and 10000, got ", *lags));
  if (d.outputs() != static_cast<Index>(m.outputs.size()))
    throw Error(text("the model has ", m.outputs.size(), " outputs, the data ", d.outputs()));
  Validations all;
  for (std::size_t i = 0; i < m.outputs.size(); ++i)
    all.list.push_back(
        std::make_shared<const Validation>(sysid::validate(m, static_cast<Index>(i), d, lags)));
  if (all.list.size() == 1) return call.push(all.list[0]);
  return call.push(std::make_shared<const Validations>(std::move(all)));
}

const Validation& checked(Call& call) { return call.object<Validation>(1, "validation"); }
int white(Call& call) { return call.push(checked(call).white); }
int independent(Call& call) { return call.push(checked(call).independent); }
int autocorrelation(Call& call) { return push_matrix(call.L, Mat(checked(call).autocorrelation)); }
int crosscorrelation(Call& call) { return push_matrix(call.L, checked(call).cross); }
int bound(Call& call) { return call.push(checked(call).bound); }
int cross_bound(Call& call) { return push_value(call.L, Mat(checked(call).cross_bound)); }
int validation_residuals(Call& call) { return push_matrix(call.L, Mat(checked(call).residuals)); }
int validation_fit(Call& call) { return call.push(checked(call).fit); }
int validation_simulation(Call& call) { return call.push(checked(call).simulation_fit); }
int ljung_box(Call& call) {
  const Validation& v = checked(call);
  lua_createtable(call.L, 0, 3);
  for (const auto& [key, value] : {std::pair{"Q", v.Q}, std::pair{"dof", v.dof}, std::pair{"p", v.p}}) {
    lua_pushnumber(call.L, value);
    lua_setfield(call.L, -2, key);
  }
  return 1;
}
int validation_text(Call& call) { return call.push(sysid::describe(checked(call))); }

// ── validation of several outputs ──

const std::vector<std::shared_ptr<const Validation>>& all_of(Call& call) {
  return call.object<Validations>(1, "validations").list;
}
int validations_entry(Call& call) {
  const auto& list = all_of(call);
  for (std::size_t i = 0; i < list.size(); ++i)
    if (lua_isinteger(call.L, 2)
            ? lua_tointeger(call.L, 2) == static_cast<lua_Integer>(i + 1)
            : lua_type(call.L, 2) == LUA_TSTRING && list[i]->y_name == lua_tostring(call.L, 2))
      return call.push(list[i]);
  return call.push_nil();
}
int validations_length(Call& call) { return call.push(static_cast<long>(all_of(call).size())); }
template <bool Validation::*test>
int every(Call& call) {
  const auto& list = all_of(call);
  return call.push(std::all_of(list.begin(), list.end(), [](const auto& v) { return (*v).*test; }));
}
int validations_names(Call& call) {
  std::vector<std::string> names;
  for (const auto& v : all_of(call)) names.push_back(v->y_name);
  return push_words(call.L, names);
}
int validations_text(Call& call) {
  std::vector<std::string> parts;
  for (const auto& v : all_of(call)) parts.push_back(sysid::describe(*v));
  return call.push(join(parts, "\n"));
}

// ── order scan ──

sysid::Range range_option(Call& call, const Options& o, const char* key, sysid::Range fallback) {
  if (!o.has(key)) return fallback;
  const std::vector<int> v = to_whole_numbers(call.L, o.push(key), key);
  lua_settop(call.L, call.count());
  if (v.size() == 1) return {v[0], v[0]};
  if (v.size() == 2) return {v[0], v[1]};
  throw Error(text(key, ": expected a number or a range {from, to}, got ", v.size(), " numbers"));
}

int order_scan(Call& call) {
  refuse_after_part();
  const IdData& e = call.object<IdData>(1, "estimation data");
  const bool has_validation = call.is<IdData>(2);
  const bool has_place =
      has_validation || (lua_isnil(call.L, 2) && call.has(3));  // order_scan(e, nil, { … })
  const Options o = call.options(has_place ? 3 : 2);
  const IdData* v = has_validation ? &call.object<IdData>(2, "validation data") : nullptr;
  std::string criterion = o.string("criterion", v ? "fit" : "aic");
  if (criterion == "mdl") criterion = "bic";
  if (criterion == "validation") criterion = "fit";
  const std::vector<std::string> known{"fpe", "aic", "bic", "fit"};
  if (std::find(known.begin(), known.end(), criterion) == known.end())
    throw Error(text("unknown criterion '", criterion, "'.", did_you_mean(criterion, known),
                     " (fpe, aic, bic, fit)"));
  if (criterion == "fit" && !v)
    throw Error("criterion \"fit\" needs validation data: order_scan(e, v, { … })");
  const long workers = o.integer("workers", integrate::available_workers());
  if (workers < 1 || workers > 1024)
    throw Error(text("workers = ", workers, "; the number of processes must lie between 1 and 1024"));
  const auto scan = std::make_shared<const OrderScan>(
      sysid::order_scan(e, v, range_option(call, o, "na", {1, 10}), range_option(call, o, "nb", {1, 10}),
                        range_option(call, o, "nk", {1, 5}), criterion, {static_cast<int>(workers), 0, {}}));
  if (scan->left > 0) {
    const int level = level_of_prompt(call.L);
    if (level == 0) throw Interrupted();
    keep_part(call.L, level);
    std::fprintf(stderr, "\ninterrupted; the models that are done are the result\n");
  }
  return call.push(scan);
}

const OrderScan& scanned(Call& call) { return call.object<OrderScan>(1, "order_scan_result"); }

void set_integer(lua_State* L, const char* key, lua_Integer value) {
  lua_pushinteger(L, value);
  lua_setfield(L, -2, key);
}
void set_number(lua_State* L, const char* key, double value) {
  lua_pushnumber(L, value);
  lua_setfield(L, -2, key);
}

int push_orders(lua_State* L, const sysid::ScanEntry& s) {
  lua_createtable(L, 0, 3);
  set_integer(L, "na", s.na);
  if (s.nb > 0) {
    set_integer(L, "nb", s.nb);
    set_integer(L, "nk", s.nk);
  }
  return 1;
}

int best(Call& call) { return push_orders(call.L, scanned(call).entries[0]); }
template <const char* const& name>
int best_by(Call& call) {
  const OrderScan& s = scanned(call);
  const auto found = s.best.find(name);
  if (found == s.best.end()) throw Error("this scan has no validation data");
  return push_orders(call.L, s.entries[found->second]);
}
const char* const by_fpe = "fpe";
const char* const by_aic = "aic";
const char* const by_bic = "bic";
const char* const by_fit = "fit";

int scan_entry(Call& call) {
  const OrderScan& s = scanned(call);
  if (!lua_isinteger(call.L, 2)) return call.push_nil();
  const long i = call.integer(2, "index");
  if (i < 1 || i > static_cast<long>(s.entries.size()))
    throw Error(text("there are ", s.entries.size(), " models; number ", i, " does not exist"));
  const sysid::ScanEntry& e = s.entries[i - 1];
  push_orders(call.L, e);
  set_number(call.L, "loss", e.estimation.loss);
  set_number(call.L, "fpe", e.estimation.fpe);
  set_integer(call.L, "parameters", e.estimation.parameters);
  set_number(call.L, "aic", e.estimation.aic);
  set_number(call.L, "bic", e.estimation.bic);
  if (s.validation_rows > 0) {
    set_number(call.L, "validation_loss", e.validation_loss);
    set_number(call.L, "fit", e.validation_fit);
  }
  return 1;
}
int scan_length(Call& call) { return call.push(static_cast<long>(scanned(call).entries.size())); }
int scan_rows(Call& call) { return call.push(static_cast<long>(scanned(call).rows)); }
int scan_text(Call& call) { return call.push(sysid::describe(scanned(call))); }

// ── comparison ──

int compare(Call& call) {
  Comparison c;
  c.data = call.shared<IdData>(1, "data");
  std::vector<std::pair<std::string, std::shared_ptr<const IdModel>>> models;
  lua_State* L = call.L;
  if (lua_istable(L, 2)) {
    lua_pushnil(L);
    while (lua_next(L, 2) != 0) {
      const auto* held = object_at(L, lua_gettop(L), TypeName<IdModel>::value);
      if (!held || !*held)
        throw Error(text("compare(d, { name = model, … }): expected models, got ", describe(L, -1)));
      auto model = std::static_pointer_cast<const IdModel>(*held);
      models.emplace_back(lua_type(L, -2) == LUA_TSTRING
                              ? lua_tostring(L, -2)
                              : text(lua_tointeger(L, -2), " ", model->outputs[0].kind),
                          model);
      lua_pop(L, 1);
    }
    std::sort(models.begin(), models.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  } else {
    for (int i = 2; i <= call.count(); ++i) {
      auto model = call.shared<IdModel>(i, "model");
      models.emplace_back(text(i - 1, " ", model->outputs[0].kind), model);
    }
  }
  if (models.empty()) throw Error("compare(d, m1, m2, …) needs models");
  std::vector<std::pair<std::string, const IdModel*>> list;
  for (const auto& [name, model] : models) {
    list.emplace_back(name, model.get());
    c.models.push_back(model);
  }
  c.rows = sysid::compare(list, *c.data);
  c.text = sysid::describe(c.rows, *c.data);
  return call.push(std::make_shared<const Comparison>(std::move(c)));
}

const Comparison& compared(Call& call) { return call.object<Comparison>(1, "comparison"); }
int comparison_models(Call& call) {
  const Comparison& c = compared(call);
  lua_createtable(call.L, static_cast<int>(c.models.size()), 0);
  for (std::size_t i = 0; i < c.models.size(); ++i) {
    call.push(c.models[i]);
    lua_rawseti(call.L, -2, static_cast<lua_Integer>(i + 1));
  }
  return 1;
}
int comparison_data(Call& call) { return call.push(compared(call).data); }
int comparison_length(Call& call) { return call.push(static_cast<long>(compared(call).rows.size())); }

int comparison_entry(Call& call) {
  const Comparison& c = call.object<Comparison>(1, "comparison");
  for (std::size_t i = 0; i < c.rows.size(); ++i) {
    const bool wanted = lua_isinteger(call.L, 2)
                            ? lua_tointeger(call.L, 2) == static_cast<lua_Integer>(i + 1)
                            : lua_type(call.L, 2) == LUA_TSTRING && c.rows[i].name == lua_tostring(call.L, 2);
    if (!wanted) continue;
    lua_createtable(call.L, 0, 6);
    call.push(c.rows[i].name);
    lua_setfield(call.L, -2, "name");
    push_value(call.L, Mat(c.rows[i].predictions));
    lua_setfield(call.L, -2, "prediction");
    push_value(call.L, Mat(c.rows[i].simulations));
    lua_setfield(call.L, -2, "simulation");
    set_number(call.L, "fpe", c.rows[i].fpe);
    set_number(call.L, "aic", c.rows[i].aic);
    set_integer(call.L, "parameters", c.rows[i].parameters);
    return 1;
  }
  return call.push_nil();
}
int comparison_text(Call& call) { return call.push(call.object<Comparison>(1, "comparison").text); }

const OptionTable validate_options = {
    {"lags", "integer", "25", "how far correlations reach, in samples"},
};
const OptionTable scan_options = {
    {"na", "integer or list", "{1, 10}", "{ least, most }: the order of A"},
    {"nb", "integer or list", "{1, 10}", "the same of B"},
    {"nk", "integer or list", "{1, 5}", "the same of the delay, in samples"},
    {"criterion", "string", "", "the criterion of the choice: fit on the validation data, else AIC",
     "fit|fpe|aic|bic"},
    {"workers", "integer", "", "worker processes; 1: none. Without it one for each processor"},
};

}  // namespace

extern const Module validation_module = {
    "identification",
    "",
    {
        {"idmodel:validate", validate, "mod:validate(d [, { lags = 25 }]) -> validation",
         R"(Residual tests at 99 % (whiteness and independence): autocorrelation and Ljung–Box (are they white?), correlation with past
            inputs (does the input explain more?), and the fit in prediction and simulation. plot() draws
            them. Several outputs: v[1], v.name, v.white of all.)",
         R"(
            u, y = {}, {}
            for t = 1, 40 do u[t] = (-1)^(t*t//3); y[t] = 0.5*(y[t-1] or 0) + (u[t-1] or 0) end
            d = iddata{ y = y, u = u }
            print(arx(d, { na = 1, nb = 1 }):validate(d).white))",
         "true", &validate_options},
        {"validation#white", white, "v.white -> boolean", "Ljung–Box p ≥ 1 %.", "", ""},
        {"validation#independent", independent, "v.independent -> boolean",
         "No correlation with past inputs beyond chance.", "", ""},
        {"validation#autocorrelation", autocorrelation, "v.autocorrelation -> column",
         "Of the residuals, lags 1, 2 and so on.", "", ""},
        {"validation#crosscorrelation", crosscorrelation, "v.crosscorrelation -> matrix",
         "Of ε(t) and u(t-k), k = -lags … lags, one column per input.", "", ""},
        {"validation#bound", bound, "v.bound -> number", "The 99 % bound of the autocorrelations.", "", ""},
        {"validation#cross_bound", cross_bound, "v.cross_bound -> number",
         "The 99 % bound of the cross-correlations, per input.", "", ""},
        {"validation#residuals", validation_residuals, "v.residuals -> column", "The one-step errors.", "",
         ""},
        {"validation#fit", validation_fit, "v.fit -> number", "One-step fit in %.", "", ""},
        {"validation#simulation_fit", validation_simulation, "v.simulation_fit -> number",
         "Simulation fit in %.", "", ""},
        {"validation#ljung_box", ljung_box, "v.ljung_box -> { Q =, dof =, p = }", "The portmanteau test.", "",
         ""},
        {"validation:__tostring", validation_text, "print(v)", "The tests in words.", "", ""},
        {"validations:__index", validations_entry, "v[i] -> validation",
         "The validation of output i, or of the output of that name.",
         "u, y = {}, {{}, {}}\n"
         "for t = 1, 40 do u[t] = (-1)^(t*t//3) for i = 1, 2 do y[i][t] = i/3*(y[i][t-1] or 0) + (u[t-1] or 0) end end\n"
         "v = arx(iddata{ y = y, u = u }, { na = {{1, 0}, {0, 1}}, nb = 1 }):validate(iddata{ y = y, u = u })\n"
         "return v[2].white, v.y1.independent",
         "true true"},
        {"validations:__len", validations_length, "#v", "The number of outputs.", "", ""},
        {"validations#white", every<&Validation::white>, "v.white -> boolean",
         "The residuals of all outputs are white.", "", ""},
        {"validations#independent", every<&Validation::independent>, "v.independent -> boolean",
         "No correlation with past inputs beyond chance, at any output.", "", ""},
        {"validations#y_names", validations_names, "v.y_names -> list", "The names of the outputs.", "", ""},
        {"validations:__tostring", validations_text, "print(v)", "The tests of every output in words.", "",
         ""},
        {"order_scan", order_scan,
         R"(order_scan(e [, v], { na = {1, 10}, nb = {1, 10}, nk = {1, 5}, criterion =, workers = }) ->
            order_scan_result)",
         R"(All ARX models in the ranges, estimated on e and validated on v, all on the same rows.
            criterion: "fit" (on v), "fpe", "aic", "bic".)",
         "u, y = {}, {}\n"
         "for t = 1, 60 do u[t] = (-1)^(t*t//3); y[t] = 0.5*(y[t-1] or 0) + (u[t-2] or 0) + ((7*t) % 5)/50 "
         "end\n"
         "s = order_scan(iddata{ y = y, u = u }:detrend(), { na = {1, 2}, nb = 1, nk = {1, 3}, criterion = "
         "\"bic\" })\n"
         "s.best.na, s.best.nb, s.best.nk",
         "1 1 2", &scan_options},
        {"order_scan_result#best", best, "s.best -> { na =, nb =, nk = }",
         "The best orders, as arx takes them.", "", ""},
        {"order_scan_result#fpe", best_by<by_fpe>, "s.fpe -> orders", "The best by final prediction error.",
         "", ""},
        {"order_scan_result#aic", best_by<by_aic>, "s.aic -> orders", "The best by Akaike's criterion.", "",
         ""},
        {"order_scan_result#bic", best_by<by_bic>, "s.bic -> orders", "The best by the Bayesian criterion.",
         "", ""},
        {"order_scan_result#fit", best_by<by_fit>, "s.fit -> orders",
         "The best by fit on the validation data.", "", ""},
        {"order_scan_result#rows", scan_rows, "s.rows -> integer", "The rows that all models share.", "", ""},
        {"order_scan_result:__index", scan_entry, "s[i] -> table",
         "Model i, best first: na, nb, nk, parameters, loss, fpe, aic, bic, fit.", R"(
             u, y = {}, {}
             for i = 1, 60 do u[i] = (-1)^(i*i//3); y[i] = 0.5*(y[i-1] or 0) + (u[i-1] or 0) + ((7*i) % 5)/50 end
             d = iddata{ y = y, u = u }
             s = order_scan(d, d, { na = {1, 2}, nb = {1, 2}, nk = {1, 1} })
             s[1].fit > 90)",
         "true"},
        {"order_scan_result:__len", scan_length, "#s", "The number of models.", "", ""},
        {"order_scan_result:__tostring", scan_text, "print(s)",
         "The ten best models, and the best by every criterion.", "", ""},
        {"compare", compare, "compare(d, m1, m2, …) or compare(d, { name = m1, … }) -> comparison",
         "Prediction and simulation fit of several models on the same samples.",
         R"(
            u, y = {}, {}
            for t = 1, 40 do u[t] = (-1)^(t*t//3); y[t] = 0.5*(y[t-1] or 0) + (u[t-1] or 0) end
            d = iddata{ y = y, u = u }
            c = compare(d, arx(d, { na = 1, nb = 1 }), fir(d, { nb = 2 }))
            c[1].simulation > c[2].simulation)",
         "true"},
        {"comparison:__index", comparison_entry, "c[i] -> table",
         R"(Row i, or the row of a name: prediction, simulation (columns where there are several outputs), fpe,
            aic.)",
         R"(
             d = iddata{ y = {0, 2, 1, 4, 2, 3}, u = {1, 0.5, 2, 1, 0, 1}, Ts = 1 }
             c = compare(d, { arx = arx(d, { na = 1, nb = 1 }), fir = fir(d, { nb = 1 }) })
             c.arx.prediction > c.fir.prediction, c[1].aic < c[2].aic)",
         "true false"},
        {"comparison#models", comparison_models, "c.models -> list", "The models, in the order of the rows.",
         "", ""},
        {"comparison#data", comparison_data, "c.data -> iddata", "The data they were compared on.", "", ""},
        {"comparison:__len", comparison_length, "#c", "The number of models.", "", ""},
        {"comparison:__tostring", comparison_text, "print(c)", "The table.", "", ""},
    }};

}  // namespace pendula::lua
