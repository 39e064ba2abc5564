// reduce(form): the table of forms, and the choice if none is named.
#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/index/differentiation_index.hpp"
#include "dae/model/lineage.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "dae/regularise/regularise.hpp"

namespace pendula::dae {
namespace {

struct Form {
  const char* name;
  ModelPtr (*make)(const ModelPtr& model, const ReduceOptions& options);
};

const Form forms[] = {
    {"acc", [](const ModelPtr& m, const ReduceOptions&) { return reduce_acc(m); }},
    {"ggl", [](const ModelPtr& m, const ReduceOptions&) { return reduce_ggl(m); }},
    {"baumgarte", [](const ModelPtr& m, const ReduceOptions& o) { return reduce_baumgarte(m, o); }},
    {"project", [](const ModelPtr& m, const ReduceOptions&) { return reduce_project(m); }},
    {"dummy", [](const ModelPtr& m, const ReduceOptions& o) { return reduce_dummy(m, o); }},
    {"minimal", [](const ModelPtr& m, const ReduceOptions& o) { return reduce_minimal(m, o); }},
    {"ode", [](const ModelPtr& m, const ReduceOptions&) { return reduce_ode(m); }},
    {"array", [](const ModelPtr& m, const ReduceOptions& o) { return reduce_array(m, o); }},
};

/// The model with an additional line of its derivation.
ModelPtr with_line(const ModelPtr& model, const std::string& line) {
  auto copy = std::make_shared<Model>(*model);
  copy->trace.push_back(line);
  return copy;
}

/// Verifies that the form has as many free initial values as the model; otherwise it is not equivalent.
ModelPtr checked(const ModelPtr& done, const ModelPtr& model, const std::string& form) {
  const ModelPtr source = regular_form(original(model));
  if (done == model || done == source) return done;
  const Analysis before = analyse(*source), after = analyse(*done);
  if (before.regular && !after.regular)
    throw Failure(text("form \"", form, "\": the equations derived do not determine all unknowns (",
                       why_not_regular(*done, after), "), so the form does not apply; use reduce \"acc\""));
  if (before.regular && after.regular && before.dof != after.dof)
    throw Failure(text("form \"", form, "\": the equations derived have ", after.dof,
                       after.dof == 1 ? " free initial value" : " free initial values",
                       ", but the model has ", before.dof,
                       ": they are not equivalent to it, so the form does not apply; use reduce \"acc\""));
  return done;
}

/// The form for simulation; models that can be integrated directly are left unchanged.
ModelPtr best_by_structure(const ModelPtr& given) {
  const ModelPtr model = regular_form(given);
  const Analysis a = require_regular(*model);
  const ModelPtr low = reduce_acc(model);
  if (low == model && model != given && model->invariants.empty())
    return with_line(model, text("reduce() stopped there: the equivalent equations have index ", a.index,
                                 ", which every implicit method can integrate."));
  if (low == model && model->invariants.empty()) {
    auto same = std::make_shared<Model>(*model);
    same->parent = model;
    same->trace = {text("reduce() left the model as it is: its index is ", a.index,
                        ", which every implicit method can integrate",
                        a.index == 0 ? " (and every explicit one, if x′ is given)." : ".")};
    return same;
  }
  const ModelPtr done = reduce_project(model);
  const bool is_explicit = done->parent->form == "ode" || done->kind == ModelKind::ode;
  return with_line(
      done, text("reduce() chose form \"project\" over ",
                 is_explicit
                     ? "the explicit form \"ode\": x′ = f(t, x) suits explicit methods of high order, which "
                       "are the fastest for models that are not stiff"
                     : "form \"acc\": its equations are not linear in the "
                       "derivatives, so there is no explicit form",
                 "; the projection keeps the constraints, which would drift otherwise."));
}

/// The form best suited to simulation; "array" if the structure allows no other.
ModelPtr best(const ModelPtr& given, const ReduceOptions& options) {
  try {
    return best_by_structure(given);
  } catch (const Failure&) {
    try {
      return with_line(
          reduce_array(given, options),
          "reduce() chose form \"array\": the structural analysis of the model leads to no other form.");
    } catch (const Failure&) {  // the first failure explains more
    }
    throw;
  }
}

}  // namespace

std::vector<std::string> reduction_forms() {
  std::vector<std::string> names;
  for (const Form& form : forms) names.emplace_back(form.name);
  return names;
}

ModelPtr reduce(const ModelPtr& model, const std::string& form, const ReduceOptions& options) {
  if ((options.alpha || options.beta) && form != "baumgarte")
    throw Error(text("alpha and beta are gains of form \"baumgarte\"",
                     form.empty() ? "; name it: reduce(\"baumgarte\", { alpha = 10 })"
                                  : text("; form \"", form, "\" has none")));
  const auto made = [&]() -> ModelPtr {
    if (form.empty()) return best(model, options);
    for (const Form& f : forms)
      if (form == f.name) return checked(f.make(model, options), model, form);
    return nullptr;
  };
  try {
    if (const ModelPtr done = made()) return done;
  } catch (const Failure&) {
    differentiation_index(*original(model));  // gives a better reason if there is no index at all
    throw;
  }
  throw Error(text("unknown form '", form, "'.", did_you_mean(form, reduction_forms()),
                   " Forms: ", join(reduction_forms(), ", ")));
}

}  // namespace pendula::dae
