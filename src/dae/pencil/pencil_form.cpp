// E, A, B and f of a model, and the reason why a model has none.
#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_set>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/limits/stack.hpp"
#include "base/text.hpp"
#include "dae/pencil/pencil.hpp"
#include "dae/rank/rank.hpp"
#include "expr/generic/generic.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "expr/rewrite/vanishing_parts.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

std::optional<mpq_class> rational(Expr e) {
  if (!e.is_constant()) return {};
  if (const mpq_class* q = exact_value(e)) return *q;
  return mpq_class(constant_value(e));  // a double is a rational as well
}

/// The terms of a sum in its original order.
void terms_of(Expr e, std::vector<Expr>& terms) {
  check_stack();
  if (e.op() == Op::add || e.op() == Op::sub) {
    terms_of(e.operand(0), terms);
    terms_of(e.operand(1), terms);
  } else if (e.op() == Op::neg) {
    terms_of(e.operand(0), terms);
  } else {
    terms.push_back(e);
  }
}

class Extraction {
 public:
  /// explained: if there is no linear form, report the reason in words.
  Extraction(const Model& model, const ParameterValues& values, bool explained)
      : m_(model), explained_(explained) {
    form_.values = model.values;
    for (const auto& [p, v] : values) form_.values[p] = v;
    for (const auto& [p, v] : form_.values) {
      const auto q = rational(v);
      put_in_[p] = q ? Expr(*q) : v;
      rounded_ = rounded_ || !exact_value(v);
    }
    int highest = 1;
    for (const Variable& v : model.variables) highest = std::max(highest, v.order);
    for (int k = 0; k < highest; ++k)
      for (const Variable& v : model.variables)
        if (k == 0 || k < v.order) form_.x.push_back(derivative_leaf(v.leaf, k));
    for (std::size_t j = 0; j < form_.x.size(); ++j) column_[form_.x[j]] = static_cast<int>(j);
  }

  /// Returns why there is no linear form, or "".
  std::string run() {
    const int n = static_cast<int>(form_.x.size());
    std::vector<std::pair<int, int>> ties;
    for (int j = 0; j < n; ++j)
      if (const auto next = column_.find(derivative_leaf(form_.x[j])); next != column_.end())
        ties.push_back({j, next->second});
    const int first = static_cast<int>(ties.size()), rows = first + static_cast<int>(m_.residuals.size());
    form_.E = form_.A = RationalMatrix(rows, n);
    form_.f = VecX::Zero(rows);
    for (int i = 0; i < first; ++i) {
      form_.E(i, ties[i].first) = 1;
      form_.A(i, ties[i].second) = 1;
      form_.origin.push_back({});
      form_.label.push_back("");
    }
    for (std::size_t i = 0; i < m_.residuals.size(); ++i) {
      poll_interrupt();
      form_.origin.push_back(m_.origin[i]);
      form_.label.push_back(m_.label(i));
      if (std::string reason = row(first + static_cast<int>(i), i); !reason.empty()) return reason;
    }
    form_.B = RationalMatrix(rows, static_cast<int>(form_.u.size()));
    for (const auto& [i, j, q] : inputs_) form_.B(i, j) = q;
    return "";
  }

  LinearForm take() { return std::move(form_); }

 private:
  std::string row(int i, std::size_t residual) {
    const Expr r = m_.residuals[residual];
    const std::vector<Expr> all = leaves({&r, 1});
    const std::vector<Expr> slopes = gradient(r, all);
    Substitution zero;
    for (std::size_t k = 0; k < all.size(); ++k) {
      const Symbol& s = symbol_of(all[k]);
      const bool unknown = s.kind == Kind::variable && !is_input(s.base);
      if (!unknown && !is_input(s.base)) continue;
      const Expr c = constant_of(slopes[k]);
      const auto q = rational(c);
      if (!q && unknown) return explain(residual, all[k], slopes[k], c);
      if (!q) continue;  // u², √2 u: part of f
      zero[all[k]] = 0;
      if (!unknown) {
        if (*q != 0) inputs_.push_back({i, input_column(all[k]), -*q});
      } else if (const auto j = column_.find(all[k]); j != column_.end()) {
        form_.A(i, j->second) = -*q;
      } else {
        form_.E(i, column_.at(derivative_leaf(s.base, s.order - 1))) = *q;
      }
      if (*q != 0 && unknown) note_used(slopes[k]);
    }
    try {
      form_.f[i] = simplify(-substitute(r, zero));
    } catch (const Error&) {  // 0/0 in x²/x, although it is linear
      form_.f[i] = simplify(-substitute(simplify(r), zero));
    }
    return "";
  }

  bool is_input(Expr base) const {
    return std::find(m_.inputs.begin(), m_.inputs.end(), base) != m_.inputs.end();
  }

  /// A slope in its simplest form if that may be a constant. Long ones that no two points tell apart count as
  /// not constant: simplifying equations of contact takes seconds, and no pencil is then asked for.
  Expr constant_of(Expr slope) const {
    constexpr std::size_t longest = 500;  // nodes
    if (slope.is_constant()) return slope;
    if (rounded_) slope = substitute(slope, vanishing_parts({&slope, 1}, form_.values));
    const Expr c = substitute(slope, put_in_);
    if (c.is_constant() || (!explained_ && differs_between_points(c))) return c;
    return !explained_ && topological({&c, 1}).size() > longest ? c : simplify(c);
  }

  /// Does c differ between two points? Simplifying the derivative of deeply nested functions would cost
  /// their depth squared.
  static bool differs_between_points(Expr c) {
    if (!generic::decided_by_residues({&c, 1})) return differs_visibly(c);
    const auto at = [&](std::uint64_t seed) {
      return generic::residues_at({&c, 1}, seed, generic::Pieces::drawn);
    };
    const auto here = at(1), there = at(2);
    return !here.empty() && !there.empty() && here[0].value != there[0].value;
  }

  /// In double precision, far above rounding.
  static bool differs_visibly(Expr c) {
    constexpr double visible = 1e-3;
    constexpr int points = 8;  // some lie outside the domain of a root
    std::optional<double> first;
    for (int k = 0; k < points; ++k) {
      const double value = pendula::evaluate(std::span(&c, 1), random_point({&c, 1}, k)).front();
      if (!std::isfinite(value)) continue;
      if (first && std::fabs(value - *first) > visible * std::max(std::fabs(value), std::fabs(*first)))
        return true;
      first = value;
    }
    return false;
  }

  int input_column(Expr leaf) {
    const auto at = static_cast<int>(std::find(form_.u.begin(), form_.u.end(), leaf) - form_.u.begin());
    if (at == static_cast<int>(form_.u.size())) form_.u.push_back(leaf);
    return at;
  }

  void note_used(Expr slope) {
    for (Expr p : leaves({&slope, 1}))
      if (symbol_of(p).kind == Kind::parameter &&
          std::find(form_.used.begin(), form_.used.end(), p) == form_.used.end())
        form_.used.push_back(p);
  }

  std::string explain(std::size_t residual, Expr leaf, Expr slope, Expr c) const {
    if (!explained_) return "not linear";
    const std::string where = text("equation ", m_.label(residual), " '", m_.equation_text(residual), "'");
    Expr culprit = m_.residuals[residual];
    std::vector<Expr> terms;
    terms_of(culprit, terms);
    for (Expr term : terms)
      if (!constant_of(partial(term, leaf)).is_constant()) {
        culprit = term;
        break;
      }
    for (Expr s : leaves({&c, 1})) {
      const Symbol& symbol = symbol_of(s);
      if (symbol.kind == Kind::parameter)
        return text("the parameter '", symbol.name, "' in the term ", to_text(culprit), " of ", where,
                    " has no value; give it one with sys:with{ ", symbol.name,
                    " = 1 }, or take sys:characteristic(), det(sE - A) in symbols");
      if (symbol.kind == Kind::variable && !is_input(symbol.base))
        return text(where, " is not linear: the term ", to_text(culprit), " is not a constant times ",
                    to_text(leaf), "; sys:linearize(at) makes a linear model at a point");
      if (symbol.kind != Kind::constant)
        return text("the coefficient ", to_text(slope), " of ", to_text(leaf), " in ", where,
                    " is not constant: it depends on ", to_text(s));
    }
    return text("the coefficient ", to_text(c), " of ", to_text(leaf), " in ", where,
                " is not a rational number, and the pencil is exact: write a decimal or a fraction for it");
  }

  struct InputEntry {
    int row, column;
    mpq_class value;
  };
  const Model& m_;
  bool explained_;
  bool rounded_ = false;  ///< some value is not an exact rational: a² - 2 for a = √2 counts as 0
  LinearForm form_;
  Substitution put_in_;
  std::unordered_map<Expr, int> column_;
  std::vector<InputEntry> inputs_;
};

}  // namespace

VecX LinearForm::forcing() const {
  VecX g = f;
  if (!u.empty()) g += product(B, column(u));
  return g;
}

std::optional<LinearForm> linear_form(const Model& model, std::string* reason, const ParameterValues& values,
                                      int most) {
  std::string why;
  std::size_t unknowns = 0;
  for (const Variable& v : model.variables) unknowns += static_cast<std::size_t>(std::max(v.order, 1));
  if (static_cast<int>(std::max(unknowns, model.residuals.size())) > most)
    why = text("the model has ", unknowns,
               " states and algebraic variables; exact arithmetic is offered up to ", most);
  if (why.empty()) {
    Extraction extraction(model, values, reason != nullptr);
    try {
      why = extraction.run();
    } catch (const Error& e) {  // 1/0 after substitution of parameter values
      why = e.what();
    }
    if (why.empty()) return extraction.take();
  }
  if (reason) *reason = why;
  return {};
}

}  // namespace pendula::dae
