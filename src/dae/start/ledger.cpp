// Values of expressions at a start, also in symbols of related models, and the printed ledger.
#include "dae/start/start_system.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/truncated_text.hpp"
#include "dae/start/start_derivatives.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

const char* word(Origin origin) {
  switch (origin) {
    case Origin::fixed:
      return "fixed";
    case Origin::redundant:
      return "fixed (redundant, consistent)";
    case Origin::chosen:
      return "free, chosen near the guess";
    case Origin::computed:
      return "computed";
    case Origin::moved:
      return "moved (nearest)";
  }
  return "";
}

}  // namespace

namespace {

/// Name, value, unit, origin of the value, and the description of the symbol; empty columns are omitted.
std::string values_text(const std::vector<LedgerRow>& rows) {
  const bool units =
      std::any_of(rows.begin(), rows.end(), [](const auto& r) { return !unit_text(r.leaf).empty(); });
  Table table(units ? std::vector<bool>{false, true, false, false, false}
                    : std::vector<bool>{false, true, false, false});
  for (const LedgerRow& row : rows) {
    std::vector<std::string> cells{to_text(row.leaf), rounded(row.value)};
    if (units) cells.push_back(unit_text(row.leaf));
    cells.push_back(word(row.origin));
    cells.push_back(symbol_of(row.leaf).order == 0 ? symbol_of(row.leaf).label : "");
    table.row(cells);
  }
  return table.str(2);
}

bool is_derivative_of_unknown(const Model& model, Expr leaf) {
  const Symbol& s = symbol_of(leaf);
  return s.order > 0 && std::any_of(model.variables.begin(), model.variables.end(),
                                    [&](const Variable& v) { return v.leaf == s.base; });
}

/// Inputs that are known as functions; for the others there is one value and no derivative.
Substitution inputs_in_time(const StartRequest& request) {
  Substitution inputs = request.inputs;
  for (Expr numeric : request.numeric_inputs) inputs.erase(numeric);
  return inputs;
}

}  // namespace

double ConsistentState::operator()(Expr e) const {
  const Expr own = resolve(*model, e);
  auto all = values;
  std::vector<Expr> derivatives;
  for (Expr leaf : leaves({&own, 1}))
    if (!values.count(leaf) && is_derivative_of_unknown(*model, leaf)) derivatives.push_back(leaf);
  const bool known = derivatives.empty() ||
                     add_derivatives(piece ? *piece : *model, derivatives, inputs_in_time(request), all);
  for (Expr leaf : leaves({&own, 1})) {
    const Symbol& s = symbol_of(leaf);
    if (all.count(leaf) || s.kind == Kind::constant) continue;
    if (s.value && s.kind == Kind::parameter) continue;
    if (!known)
      throw Error(
          text("the derivative '", to_text(leaf), "' does not follow from the equations at the start"));
    std::vector<std::string> names;
    for (const auto& row : rows) names.push_back(to_text(row.leaf));
    throw Error(
        text("the start has no value for '", to_text(leaf), "'.", did_you_mean(to_text(leaf), names)));
  }
  for (Expr leaf : leaves({&own, 1}))
    if (!all.count(leaf) && symbol_of(leaf).value)
      all[leaf] = pendula::evaluate({&*symbol_of(leaf).value, 1}, {})[0];
  return pendula::evaluate({&own, 1}, all)[0];
}

std::optional<double> ConsistentState::value_for(const Model& other, Expr leaf) const {
  const auto known = [&](Expr e) -> std::optional<double> {
    const auto it = values.find(e);
    return it == values.end() ? std::nullopt : std::optional(it->second);
  };
  if (const auto here = known(leaf)) return here;
  if (const auto here = known(resolve(*model, leaf))) return here;
  for (const Model* form = &other; form; form = form->parent.get())
    for (const auto& [old, meaning] : form->relations)  // symbols renamed by the form: v for q′
      if (meaning == leaf)
        if (const auto here = known(resolve(*model, old))) return here;
  return {};
}

double size_of_terms(Expr e, const std::unordered_map<Expr, double>& point) {
  const std::vector<Expr> inside = leaves({&e, 1});
  double size = 0;
  const std::vector<double> slopes = pendula::evaluate(gradient(e, inside), point);
  for (std::size_t k = 0; k < inside.size(); ++k)
    if (const auto at = point.find(inside[k]); at != point.end()) size += std::fabs(slopes[k] * at->second);
  return size;
}

std::string ConsistentState::lost_digits_text() const {
  if (!lost) return "";
  const Expr worst = lost->leaves.front();
  if (lost->is_double_root)
    return text("a double root: the Jacobian is singular here, and the equations determine ",
                grouped_names(lost->leaves), " to about half of the digits only (", to_text(worst), " to ",
                rounded(lost->error, 1), ")");
  return text("rounding errors of the equations leave ", to_text(worst), " = ", rounded(values.at(worst), 3),
              " uncertain by about ", rounded(lost->error, 1));
}

std::string ConsistentState::ledger() const {
  const auto beside_terms = [&](const auto& c) {  // rounding leaves 10⁸ of terms of size 10²⁴
    return std::fabs(c.second) /
           std::max(1.0, std::fabs(c.second) < typed_accuracy ? 1 : size_of_terms(c.first.residual, values));
  };
  const bool consistent = std::all_of(constraints.begin(), constraints.end(),
                                      [&](const auto& c) { return beside_terms(c) < typed_accuracy; });
  std::string out = text(consistent ? "consistent" : "inconsistent", " start at t = ", rounded(t),
                         free_is_bound ? ": at most " : ": ", free,
                         free == 1 ? " free initial value" : " free initial values", "\n");
  out += values_text(rows);
  if (free_is_bound)
    out +=
        "the equations lose rank here, and second derivatives do not tell how many of these values are free\n";
  if (lost) out += lost_digits_text() + "\n";
  if (!moved.empty()) {
    out += "moved onto the constraints\n";
    Table moves;
    for (const Moved& m : moved)
      moves.row({to_text(m.leaf), text("from ", rounded(m.from), " to ", rounded(m.to))});
    out += moves.str(2);
  }
  const auto other = branches();
  if (!other.empty()) out += "other roots\n";
  for (const Branch& b : other)
    out += text("  ", b.formula.empty() ? to_text(b.leaf) : b.formula, ": here ", rounded(b.here), "; ",
                rounded(b.there), " with guess = { ", key_text(b.leaf), " = ", rounded(b.there, 4), " }\n");
  if (const std::string meeting = crossing(); !meeting.empty()) out += meeting + "\n";
  for (const SingularityCondition& n : model->singularity_conditions)
    out +=
        text("valid while ", truncated_text(n.factor), " ≠ 0 (here ", rounded((*this)(n.factor), 4), ")\n");
  if (constraints.empty()) return out;
  out += "constraints\n";
  Table residuals({false, true, false});
  constexpr double rounding = 1e-12;  // digits of smaller residuals say nothing: 4500 ε of the terms
  for (const auto& entry : constraints) {
    const auto& [c, r] = entry;
    residuals.row({c.label,
                   std::fabs(r) < rounding          ? "≤ 1e-12"
                   : beside_terms(entry) < rounding ? "≤ 1e-12 of its terms"
                                                    : rounded(r, 2),
                   "0 = " + truncated_text(c.residual)});
  }
  return out + residuals.str(2);
}

std::string ConsistentState::unchosen_roots_text() const {
  if (!model->form.empty()) return "";
  const std::vector<Expr> states = model->states();
  std::string result;
  for (const Branch& b : branches()) {
    const auto says = [&](const auto& given) { return resolve(*model, given.first) == b.leaf; };
    if (std::find(states.begin(), states.end(), b.leaf) != states.end() ||
        std::any_of(request.guess.begin(), request.guess.end(), says))
      continue;
    result += text("  begins with one of several roots, ", b.formula.empty() ? to_text(b.leaf) : b.formula,
                   ": here ", rounded(b.here), "; ", rounded(b.there),
                   " by start = sys:init{ fix = { … }, guess = { ", key_text(b.leaf), " = ",
                   rounded(b.there, 4), " } }\n");
  }
  return result;
}

}  // namespace pendula::dae
