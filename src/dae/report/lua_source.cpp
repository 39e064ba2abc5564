#include "dae/report/lua_source.hpp"

#include <algorithm>
#include <cctype>
#include <optional>
#include <set>
#include <tuple>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/alias/eliminate.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/forms.hpp"
#include "dae/reduce/reduce.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

/// Names that a saved model uses itself, and reserved words of Lua.
bool reserved(const std::string& name) {
  static const std::set<std::string> words = {
      "and",   "break", "do",    "else",  "elseif", "end",      "false",    "for",    "function", "goto",
      "if",    "in",    "local", "nil",   "not",    "or",       "repeat",   "return", "then",     "true",
      "until", "while", "dae",   "der",   "var",    "vars",     "param",    "params", "input",    "vec",
      "mat",   "func",  "t",     "pi",    "e",      "rational", "linear",   "lt",     "le",       "gt",
      "ge",    "all",   "any",   "solve", "subs",   "diff",     "lagrange", "with",   "sqrt",     "ifelse"};
  if (words.count(name)) return true;
  for (Op op = first_op; op < end_op; op = next(op))
    if (name == info(op).name) return true;
  if (name.find_first_of(".[") != name.npos) return true;  // a path
  return name.empty() || !(std::isalpha(static_cast<unsigned char>(name[0])) || name[0] == '_');
}

void replace_all(std::string& s, const std::string& from, const std::string& to) {
  for (std::size_t k = 0; (k = s.find(from, k)) != std::string::npos; k += to.size())
    s.replace(k, from.size(), to);
}

/// The symbols of a chunk: declared once, then called by their names.
class Names {
 public:
  void add(std::span<const Expr> leaves) {
    for (Expr leaf : leaves) add(symbol_of(leaf).base);
  }

  std::string declarations() const {
    std::string out;
    for (const auto& [name, code] : names_) out += "local " + name + " = " + code + "\n";
    return out;
  }

  std::string code(Expr e) const {
    if (const mpq_class* exact = e.is_constant() ? exact_value(e) : nullptr; exact && exact->get_den() == 1)
      return exact->get_str();
    std::string text = to_code(e);
    for (const auto& [name, declared] : names_) replace_all(text, declared, name);
    return text;
  }

  /// The name of a whole column, with its order of derivative.
  std::string code(const VecX& v) const {
    if (v.size() == 1) return code(v[0]);
    if (const auto name = whole_column(v)) return *name;
    std::vector<std::string> list;
    for (Expr e : v) list.push_back(code(e));
    return "vec{ " + join(list, ", ") + " }";
  }

 private:
  std::optional<std::string> whole_column(const VecX& v) const {
    if (!v[0].is_symbol() || symbol_of(v[0]).vector.empty()) return {};
    const Symbol& s = symbol_of(v[0]);
    std::vector<Expr> whole = vector_components(s.vector);
    if (s.order > 0)
      for (Expr& leaf : whole) leaf = derivative_leaf(leaf, s.order);
    const bool named =
        std::any_of(names_.begin(), names_.end(), [&](const auto& n) { return n.first == s.vector; });
    if (!named || static_cast<Eigen::Index>(whole.size()) != v.size() || column(whole) != v) return {};
    return s.order == 0   ? s.vector
           : s.order == 1 ? "der(" + s.vector + ")"
                          : text("der(", s.vector, ", ", s.order, ")");
  }

  void add(Expr base) {
    constexpr std::size_t most_locals = 150;  // Lua has 200
    const Symbol& s = symbol_of(base);
    if (s.kind == Kind::time || s.kind == Kind::constant || !seen_.insert(base.id()).second) return;
    std::string name = s.vector.empty() ? s.name : s.vector, declared = to_code(base);
    if (!s.vector.empty()) declared = declared.substr(0, declared.rfind('['));
    const bool known =
        std::any_of(names_.begin(), names_.end(), [&](const auto& n) { return n.second == declared; });
    const bool taken =
        std::any_of(names_.begin(), names_.end(), [&](const auto& n) { return n.first == name; });
    if (!known && !taken && !reserved(name) && names_.size() < most_locals)
      names_.emplace_back(name, declared);
  }

  std::vector<std::pair<std::string, std::string>> names_;  ///< x, var("x")
  std::set<std::uint32_t> seen_;
};

bool same_equations(const Model& a, const Model& b) {
  const auto same = [](const Block& x, const Block& y) { return x.lhs == y.lhs && x.rhs == y.rhs; };
  return a.blocks.size() == b.blocks.size() &&
         std::equal(a.blocks.begin(), a.blocks.end(), b.blocks.begin(), same) &&
         a.invariants.size() == b.invariants.size() && a.projections.size() == b.projections.size() &&
         a.form == b.form;
}

/// The gains of form "baumgarte", read from its derivation: "…,  α = 3, β = 4".
ReduceOptions gains_of(const Model& m, std::string& call) {
  ReduceOptions options;
  std::vector<std::string> words;
  for (const std::string& line : m.trace)
    for (const auto& [sign, name, gain] :
         {std::tuple{"α = ", "alpha", &options.alpha}, std::tuple{"β = ", "beta", &options.beta}}) {
      const std::size_t at = line.find(sign);
      if (at == std::string::npos || *gain || !line.starts_with("baumgarte: ")) continue;
      const std::size_t begin = at + std::string_view(sign).size();
      const std::string number = line.substr(begin, line.find(',', begin) - begin);
      *gain = parse_number(number);
      words.push_back(text(name, " = \"", number, "\""));
    }
  call = ":reduce(\"baumgarte\", { " + join(words, ", ") + " })";
  return options;
}

/// The call that makes the model from its parent, or an ancestor: ":reduce \"acc\"".
struct Step {
  ModelPtr from;
  std::string call;
};

std::optional<Step> last_step(const ModelPtr& model) {
  const auto try_call = [&](const ModelPtr& from, const std::string& call, auto make) -> std::optional<Step> {
    try {
      if (same_equations(*make(from), *model)) return Step{from, call};
    } catch (const UserFacing&) {
    }
    return {};
  };
  const bool chosen = std::any_of(model->trace.begin(), model->trace.end(),
                                  [](const std::string& line) { return line.starts_with("reduce() "); });
  std::vector<ModelPtr> ancestors;
  for (ModelPtr from = model->parent; from; from = from->parent) ancestors.insert(ancestors.begin(), from);
  for (const ModelPtr& from : ancestors) {
    const std::string& form = model->form;
    if (chosen)
      if (auto s = try_call(from, ":reduce()", [](const ModelPtr& m) { return reduce(m, ""); })) return s;
    if (!form.empty()) {
      if (auto s =
              try_call(from, ":reduce \"" + form + "\"", [&](const ModelPtr& m) { return reduce(m, form); }))
        return s;
      std::string call;
      if (form == "baumgarte")
        if (auto s = try_call(from, "",
                              [&](const ModelPtr& m) { return reduce(m, form, gains_of(*model, call)); }))
          return Step{s->from, call};
      continue;
    }
    if (auto s = try_call(from, ":eliminate()", [](const ModelPtr& m) { return eliminate(m); })) return s;
    if (auto s = try_call(from, ":first_order()", to_first_order)) return s;
    if (auto s = try_call(from, ":semi_explicit()", to_semi_explicit)) return s;
    if (auto s = try_call(from, ":implicit()", to_implicit)) return s;
  }
  return {};
}

class Writer {
 public:
  explicit Writer(const ModelPtr& model) : model_(model) {
    ModelPtr at = model;
    for (std::optional<Step> step; at->parent && (step = last_step(at)); at = step->from)
      calls_ = step->call + calls_;
    source_ = at;
    lost_ = at->parent != nullptr;
  }

  std::string text() {
    for (const Variable& v : source_->variables) names_.add({&v.leaf, 1});
    names_.add(source_->inputs);
    names_.add(source_->parameters);
    names_.add(model_->parameters);
    const std::string made = source_->mechanics && !lost_ ? mechanics() : equations();
    std::string title = model_->name.empty() ? "A model of Pendula." : model_->name;
    replace_all(title, "\n", " ");
    replace_all(title, "\r", " ");
    std::string out = "-- " + title + "\n";
    if (lost_) out += "-- These are the equations of a derived model; where they came from is not kept.\n";
    return out + names_.declarations() + "return " + made + calls_ + values() + "\n";
  }

 private:
  std::string name_option() const {
    if (source_->name.empty()) return "";
    std::string quoted = source_->name;
    replace_all(quoted, "\\", "\\\\");
    replace_all(quoted, "\"", "\\\"");
    replace_all(quoted, "\n", "\\n");
    replace_all(quoted, "\r", "\\r");
    return "  name = \"" + quoted + "\",\n";
  }

  std::string equations() {
    for (Expr u : source_->inputs)
      if (symbol_of(u).kind != Kind::input)
        throw Error(pendula::text("the input '", to_text(u),
                                  "' was declared as a variable; declare it with input \"", symbol_of(u).name,
                                  "\" to save the model"));
    std::string out = "dae {\n";
    for (const Block& b : source_->blocks)
      out += "  " + names_.code(b.lhs) + " ~ " + names_.code(b.rhs) + ",\n";
    return out + name_option() + start_options() + event_option() + "}";
  }

  std::string table(const std::vector<std::pair<Expr, Expr>>& values) const {
    std::vector<std::string> list;
    for (const auto& [leaf, value] : values)
      list.push_back("[" + names_.code(leaf) + "] = " + names_.code(value));
    return "{ " + join(list, ", ") + " }";
  }

  std::string start_options() const {
    const Model& m = *source_;
    return (m.start_values.empty() ? "" : "  start = " + table(m.start_values) + ",\n") +
           (m.start_guesses.empty() ? "" : "  guess = " + table(m.start_guesses) + ",\n");
  }

  std::string event_option() const {
    std::string out;
    for (const Transition& event : source_->events) {
      out += "    { when = " + names_.code(event.when) +
             pendula::text(", direction = ", static_cast<int>(event.direction));
      if (event.stop) out += ", action = \"stop\"";
      if (!event.reset.empty()) out += ", reset = " + table(event.reset);
      out += " },\n";
    }
    return out.empty() ? "" : "  events = {\n" + out + "  },\n";
  }

  std::string mechanics() {
    const Mechanics& m = *source_->mechanics;
    std::string out = "lagrange {\n  q = " + names_.code(m.q) + ",\n  T = " + names_.code(m.T) +
                      ",\n  V = " + names_.code(m.V) + ",\n";
    if (m.C.size()) {
      std::vector<std::string> list;
      for (Expr c : m.C) list.push_back(names_.code(c));
      out += "  C = { " + join(list, ",\n    ") + " },\n";
    }
    if (m.Q.size() && std::any_of(m.Q.begin(), m.Q.end(), [](Expr e) { return !e.is_zero(); }))
      out += "  Q = " + names_.code(m.Q) + ",\n";
    return out + name_option() + "}";
  }

  /// with{ … }: the values that differ from the defaults of their symbols.
  std::string values() const {
    std::vector<std::string> list;
    for (Expr p : model_->parameters) {
      const auto it = model_->values.find(p);
      const Symbol& s = symbol_of(p);
      if (it == model_->values.end() || (s.value && *s.value == it->second)) continue;
      const bool path = s.name.find_first_of(".[") != s.name.npos;
      list.push_back((path ? "[\"" + s.name + "\"]" : s.name) + " = " + names_.code(it->second));
    }
    return list.empty() ? "" : ":with { " + join(list, ", ") + " }";
  }

  ModelPtr model_, source_;
  std::string calls_;
  bool lost_ = false;
  Names names_;
};

}  // namespace

std::string code(const ModelPtr& model) { return Writer(model).text(); }

}  // namespace pendula::dae
