#include "dae/report/parameter_cases.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/pencil/pencil_polynomial.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

/// "index 1, 1 free initial value", or "no index".
std::string answer_of(const std::optional<Model>& m) {
  try {
    return m ? answer_text(differentiation_index(*m)) : "no index";
  } catch (const UserFacing&) {
    return "no index";
  }
}

Model without_value(const Model& m, Expr p) {
  Model other = m;
  other.values.erase(p);
  return other;
}

/// e at this value of p; empty if it is undefined there, like 1/p at 0.
std::optional<Expr> at_value(Expr e, Expr p, Expr value) {
  try {
    return simplify(substitute(e, {{p, value}}));
  } catch (const UserFacing&) {
    return {};
  }
}

/// The model at a value of a parameter, which may contain other parameters; empty if an equation
/// is undefined there.
std::optional<Model> with_value(const Model& m, Expr p, Expr value) {
  Model there = without_value(m, p);
  for (Expr& residual : there.residuals) {
    const auto known = at_value(residual, p, value);
    if (!known) return {};
    residual = *known;
  }
  return there;
}

std::string place(Expr p, Expr value) { return text(to_text(p), " = ", to_text(value)); }

bool vanishes(Expr factor, const Model& m) {
  return at_values(std::vector<Expr>{factor}, m.values)[0].is_zero();
}

class Cases {
 public:
  explicit Cases(const Model& m) : model_(m), here_(answer_of(m)) {}

  std::vector<std::string> find(const std::vector<DeterminantFactor>& conditions) {
    std::vector<Expr> factors;
    for (const DeterminantFactor& c : conditions) factors.push_back(c.factor);
    add_leading_factors(model_, factors);
    for (Expr factor : factors) {
      const bool holds = vanishes(factor, model_);
      for (const auto& [p, value] : exceptional_values(factor))
        if (!holds)
          add_exceptional_value(p, value);
        else if (vanishes(p - value, model_))
          add_case(text(to_text(p), " ≠ ", to_text(value)), answer_of(without_value(model_, p)),
                   model_.values.count(p) > 0);
    }
    for (const Case& first : found_) add_pairs_of_values(first);
    return std::move(lines_);
  }

 private:
  /// A value of a parameter without default at which a factor vanishes.
  struct Case {
    Expr p, value;
    std::string answer;
    std::optional<Model> there;
  };

  static void add_leading_factors(const Model& m, std::vector<Expr>& factors) {
    try {
      const std::vector<Expr> coefficients = pencil_polynomial(m);
      if (coefficients.empty()) return;
      for (Expr f : vanishing_factors(coefficients.back()))
        if (std::find(factors.begin(), factors.end(), f) == factors.end()) factors.push_back(f);
    } catch (const UserFacing&) {  // not linear with constant coefficients
    }
  }

  void add_exceptional_value(Expr p, Expr value) {
    Case next{p, value, "", with_value(model_, p, value)};
    next.answer = answer_of(next.there);
    const bool open = !model_.values.count(p);
    add_case(place(p, value), next.answer, open);
    if (open && next.answer != "no index") found_.push_back(std::move(next));
  }

  /// The other coefficients of det(sE - A), one of which leads when the first factor vanishes.
  void add_pairs_of_values(const Case& first) {
    std::vector<Expr> factors;
    add_leading_factors(*first.there, factors);
    for (Expr factor : factors) {
      if (vanishes(factor, *first.there)) continue;
      for (const auto& [p, value] : exceptional_values(factor)) {
        const auto first_value = at_value(first.value, p, value);  // undefined for a = 1/b at b = 0
        if (model_.values.count(p) || !first_value) continue;
        const std::string answer = answer_of(with_value(*first.there, p, value));
        std::array both{place(first.p, *first_value), place(p, value)};
        std::sort(both.begin(), both.end());
        if (answer != first.answer) add_case(both[0] + " and " + both[1], answer, true);
      }
    }
  }

  void add_case(const std::string& where, const std::string& answer, bool always) {
    constexpr std::size_t most = 8;  // lines
    const std::string line = "for " + where + ": " + answer;
    const bool is_new = std::find(lines_.begin(), lines_.end(), line) == lines_.end();
    if (lines_.size() < most && is_new && (always || (answer != here_ && answer != "no index")))
      lines_.push_back(line);
  }

  const Model& model_;
  std::string here_;
  std::vector<Case> found_;
  std::vector<std::string> lines_;
};

}  // namespace

std::string answer_text(const IndexResult& t) {
  return text("index ", t.index_is_bound ? "at most " : "", t.index, ", ", t.dof,
              t.dof == 1 ? " free initial value" : " free initial values");
}

Model without_values(const Model& m) {
  Model other = m;
  other.values.clear();
  return other;
}

std::vector<std::string> parameter_cases(const Model& m, const std::vector<DeterminantFactor>& conditions) {
  if (m.variables.size() > most_unknowns_of_cases) return {};
  return Cases(m).find(conditions);
}

}  // namespace pendula::dae
