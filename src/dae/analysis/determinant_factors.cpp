#include "dae/analysis/determinant_factors.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "base/error.hpp"
#include "base/limits/stack.hpp"
#include "base/text.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/points/consistent_point_rank.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/polynomial/rational_form.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {
namespace {

constexpr std::size_t largest_block = 4;  // up to this size determinants are formed symbolically
constexpr std::size_t most_conditions = 6;
constexpr std::size_t searched = 20;   // unknowns of a model up to which consistent points are searched
constexpr double longest_factor = 60;  // operations of a factor

/// Sign of e for all values of its symbols: ±2 strictly, ±1 or zero, 0 unknown.
class Signs {
 public:
  int of(Expr e) {
    if (e.is_constant()) {
      const double v = constant_value(e);
      return v > 0 ? 2 : v < 0 ? -2 : 0;
    }
    const auto it = known_.find(e);
    if (it != known_.end()) return it->second;
    check_stack();
    return known_[e] = decide(e);
  }

 private:
  int decide(Expr e) {
    if (e.is_symbol()) return symbol_of(e).kind == Kind::constant ? 2 : 0;  // π
    switch (e.op()) {
      case Op::exp:
      case Op::cosh:
        return 2;
      case Op::sqrt:
      case Op::abs:
        return 1;
      case Op::neg:
        return -of(e.operand(0));
      case Op::add:
        return sum(of(e.operand(0)), of(e.operand(1)), e);
      case Op::sub:
        return sum(of(e.operand(0)), -of(e.operand(1)), e);
      case Op::mul:
        return product(of(e.operand(0)), of(e.operand(1)));
      case Op::div:
        return product(of(e.operand(0)), of(e.operand(1)));
      case Op::pow:
        return power(e);
      default:
        return 0;
    }
  }
  /// The sign of the sum e of terms with signs a and b.
  int sum(int a, int b, Expr e) {
    if (a != 0 && b != 0 && (a > 0) == (b > 0)) return std::abs(a) > std::abs(b) ? a : b;
    for (const auto& [sign, number, other] :
         {std::tuple(a, e.operand(0), e.operand(1)), std::tuple(b, e.operand(1), e.operand(0))}) {
      if (!number.is_constant()) continue;
      const double left = std::fabs(constant_value(number)) - bound(other);  // 2 + cos(x)
      if (left >= 0) return left > 0 ? sign : sign / 2;
    }
    return 0;
  }
  /// An upper bound of |e| by the ranges of sine and similar functions.
  double bound(Expr e) {
    if (e.is_constant()) return std::fabs(constant_value(e));
    if (e.is_symbol()) return std::numeric_limits<double>::infinity();
    const auto it = bounds_.find(e);
    if (it != bounds_.end()) return it->second;
    check_stack();
    return bounds_[e] = decide_bound(e);
  }
  double decide_bound(Expr e) {
    switch (e.op()) {
      case Op::sin:
      case Op::cos:
      case Op::tanh:
        return 1;
      case Op::neg:
      case Op::abs:
        return bound(e.operand(0));
      case Op::add:
      case Op::sub:
        return bound(e.operand(0)) + bound(e.operand(1));
      case Op::mul:
        return bound(e.operand(0)) * bound(e.operand(1));
      default:
        return std::numeric_limits<double>::infinity();
    }
  }
  static int product(int a, int b) {
    const int size = std::min(std::abs(a), std::abs(b));
    return (a > 0) == (b > 0) ? size : -size;
  }
  int power(Expr e) {
    const int base = of(e.operand(0));
    if (base == 2) return 2;
    const mpq_class* q = exact_value(e.operand(1));
    if (q && q->get_den() == 1 && q->get_num() % 2 == 0) return std::abs(base) == 2 ? 2 : 1;
    return q && q->get_den() == 1 ? base : 0;
  }

  std::unordered_map<Expr, int> known_;
  std::unordered_map<Expr, double> bounds_;
};

/// Splits e into factors; e vanishes only where one of them does.
void split(Expr e, std::vector<Expr>& factors, Signs& signs) {
  check_stack();
  if (std::abs(signs.of(e)) == 2) return;
  if (!e.is_symbol()) switch (e.op()) {
      case Op::neg:
      case Op::sqrt:
      case Op::abs:
        return split(e.operand(0), factors, signs);
      case Op::mul:
        split(e.operand(0), factors, signs);
        return split(e.operand(1), factors, signs);
      case Op::div:  // where a denominator vanishes the equations are undefined
        return split(e.operand(0), factors, signs);
      case Op::pow:
        if (const mpq_class* q = exact_value(e.operand(1))) {
          if (*q > 0) split(e.operand(0), factors, signs);
          return;
        }
        break;
      default:
        break;
    }
  if (std::find(factors.begin(), factors.end(), e) == factors.end()) factors.push_back(e);
}

/// How many terms e has, multiplied out.
double terms_of_expansion(Expr e) {
  check_stack();
  if (e.is_constant() || e.is_symbol()) return 1;
  const auto terms = [&](int i) { return terms_of_expansion(e.operand(i)); };
  switch (e.op()) {
    case Op::neg:
      return terms(0);
    case Op::add:
    case Op::sub:
      return terms(0) + terms(1);
    case Op::mul:
      return terms(0) * terms(1);
    case Op::pow:
      return e.operand(1).is_constant() ? std::pow(terms(0), std::max(1.0, constant_value(e.operand(1)))) : 1;
    default:
      return 1;
  }
}

/// Is e never 0, as it is written or multiplied out? The determinant of a network of conductances is (a +
/// g)(b + g) - g², a sum of products of conductances in which g² cancels (Kirchhoff's matrix tree theorem).
bool never_vanishes(Expr e, Signs& signs) {
  constexpr double most = 500;  // terms
  if (std::abs(signs.of(e)) == 2) return true;
  return is_short(e) && terms_of_expansion(e) <= most && std::abs(signs.of(expand(e))) == 2;
}

/// e without a common rational factor, and with a sign that avoids a leading minus. Multiplication by a
/// symbol makes simplify() extract the common factor of a sum.
Expr upright(Expr e) {
  const Expr unit = symbol(Kind::slot, "unit");
  std::vector<Expr> parts;
  Signs signs;
  split(simplify(unit * e), parts, signs);
  std::erase(parts, unit);
  const auto contains_unit = [&](Expr part) {  // the product was multiplied out
    const std::vector<Expr> inside = leaves({&part, 1});
    return std::find(inside.begin(), inside.end(), unit) != inside.end();
  };
  const Expr s = parts.size() == 1 && !contains_unit(parts[0]) ? simplify(parts[0]) : simplify(e);
  if (!to_text(s).starts_with("-")) return s;
  const Expr other = simplify(-s);
  return to_text(other).starts_with("-") ? s : other;
}

}  // namespace

int sign_of(Expr e) { return Signs().of(e); }

std::vector<Expr> vanishing_factors(Expr e) {
  Signs signs;
  std::vector<Expr> found, list;
  split(simplify(e), found, signs);
  for (Expr f : found) {
    f = upright(f);
    if (f.is_constant() || never_vanishes(f, signs)) continue;
    if (std::find(list.begin(), list.end(), f) == list.end()) list.push_back(f);
  }
  return list;
}

namespace {

class Factors {
 public:
  Factors(const Model& m, const Analysis& a, const Blocks& blocks) {
    std::vector<std::vector<const Entry*>> row(m.residuals.size());
    for (const Entry& e : a.jacobian) row[e.row].push_back(&e);
    for (const Part& part : blocks.square) {
      if (list.size() > most_conditions) break;
      add(part, row);
      parts.resize(list.size(), &part);
    }
    if (list.size() > most_conditions) {
      list.clear();
      complete = false;
    }
  }
  std::vector<Expr> list;
  std::vector<const Part*> parts;  ///< where each was first found
  bool complete = true;

 private:
  void add(const Part& part, const std::vector<std::vector<const Entry*>>& row) {
    const auto n = static_cast<Eigen::Index>(part.rows.size());
    if (n == 1) {
      for (const Entry* e : row[part.rows[0]])
        if (e->column == part.columns[0]) add_factors(e->value);
      return;
    }
    bool constant = true;
    MatX J = part.rows.size() <= largest_block ? MatX(MatX::Zero(n, n)) : MatX();
    for (std::size_t i = 0; i < part.rows.size(); ++i)
      for (const Entry* e : row[part.rows[i]]) {
        const auto at = std::lower_bound(part.columns.begin(), part.columns.end(), e->column);
        if (at == part.columns.end() || *at != e->column) continue;
        constant = constant && e->value.is_constant();
        if (J.size()) J(static_cast<Eigen::Index>(i), at - part.columns.begin()) = e->value;
      }
    if (constant) return;
    if (!J.size())
      complete = false;
    else
      add_factors(linalg::determinant(J));
  }

  void add_factors(Expr determinant) {
    if (std::abs(signs_.of(determinant)) == 2) return;
    if (!is_short(determinant, 20 * longest_factor)) {
      complete = false;
      return;
    }
    std::vector<Expr> found;
    split(simplify(determinant), found, signs_);
    for (Expr f : found) {
      f = upright(f);
      if (f.is_constant() || never_vanishes(f, signs_)) continue;
      if (!is_short(f, longest_factor))
        complete = false;
      else if (std::find(list.begin(), list.end(), f) == list.end())
        list.push_back(f);
    }
  }

  Signs signs_;
};

DeterminantFactor::Kind kind_of(Expr factor) {
  const auto nodes = topological({&factor, 1});
  if (std::any_of(nodes.begin(), nodes.end(), [](Expr e) { return !e.is_constant() && e.op() == Op::call; }))
    return DeterminantFactor::Kind::functions;
  return varies(factor) ? DeterminantFactor::Kind::state : DeterminantFactor::Kind::parameters;
}

bool has_variable(Expr e) {
  for (Expr leaf : leaves({&e, 1}))
    if (symbol_of(leaf).kind == Kind::variable) return true;
  return false;
}

}  // namespace

DeterminantFactors determinant_factors(const Model& m, const Analysis& a, const Blocks& blocks) {
  Factors factors(m, a, blocks);
  DeterminantFactors v;
  v.complete = factors.complete;
  for (std::size_t k = 0; k < factors.list.size(); ++k)
    v.conditions.push_back(
        {factors.list[k], kind_of(factors.list[k]), factors.parts[k]->rows, factors.parts[k]->columns, {}});
  std::stable_sort(v.conditions.begin(), v.conditions.end(),
                   [](const DeterminantFactor& x, const DeterminantFactor& y) { return x.kind < y.kind; });
  if (m.variables.size() > searched || a.jacobian_status == JacobianStatus::on_solutions) return v;
  std::vector<Expr> variables;
  for (const Variable& x : m.variables) variables.push_back(x.leaf);
  const ConsistentPointRank points(residuals_at_values(m), variables, a.offsets, a.jacobian);
  const Substitution values(m.values.begin(), m.values.end());
  for (DeterminantFactor& c : v.conditions)
    if (c.kind == DeterminantFactor::Kind::state && points.applies() && has_variable(c.factor))
      c.reached = points.reaches(substitute(c.factor, values));
  return v;
}

Blocks blocks_of(const Model& m, const Analysis& a) {
  Pattern pattern(m.residuals.size());
  for (const Entry& e : a.jacobian) pattern[e.row].push_back(e.column);
  return dulmage_mendelsohn(pattern, static_cast<int>(m.variables.size()));
}

std::string conditions_text(const DeterminantFactors& v, std::optional<DeterminantFactor::Kind> kind) {
  std::vector<std::string> words;
  for (const DeterminantFactor& c : v.conditions)
    if (!kind || c.kind == *kind) words.push_back(to_text(c.factor) + " ≠ 0");
  return join(words, ", ");
}

namespace {

/// The roots in p of c p + d or c p² + d, with c free of p: -d/c, ±√(-d/c). Empty for other forms, or if they
/// are not real.
std::vector<Expr> roots_in(Expr p, Expr factor) {
  const auto at_zero = [&](Expr e) { return simplify(substitute(e, {{p, Expr(0)}})); };
  const auto contains = [&](Expr e) { return !simplify(partial(e, p)).is_zero(); };
  const Expr slope = simplify(partial(factor, p));
  if (slope.is_zero()) return {};
  if (!contains(slope)) return {simplify(-at_zero(factor) / slope)};
  const Expr c = simplify(partial(slope, p) / Expr(2));
  if (contains(c) || !at_zero(slope).is_zero()) return {};
  const Expr square = simplify(-at_zero(factor) / c);
  if (square.is_constant() && constant_value(square) < 0) return {};
  const Expr root = simplify(sqrt(square));
  return {root, simplify(-root)};
}

}  // namespace

std::vector<std::pair<Expr, Expr>> exceptional_values(Expr factor) {
  std::vector<std::pair<Expr, Expr>> found;
  for (const auto& [part, power] : numerator_factors(factor)) {
    const auto inside = leaves({&part, 1});
    if (!std::all_of(inside.begin(), inside.end(),
                     [](Expr p) { return symbol_of(p).kind == Kind::parameter; }))
      continue;
    std::vector<std::pair<Expr, std::vector<Expr>>> of;
    for (Expr p : inside)
      if (auto roots = roots_in(p, part); !roots.empty()) of.emplace_back(p, std::move(roots));
    // prefers a = b to b = a, and a = 1/b to b = ±√(1/a)
    const auto best = std::min_element(of.begin(), of.end(), [](const auto& x, const auto& y) {
      return std::pair(x.second.size(), topological(x.second).size()) <
             std::pair(y.second.size(), topological(y.second).size());
    });
    if (best == of.end()) continue;
    for (Expr root : best->second) found.emplace_back(best->first, root);
  }
  return found;
}

}  // namespace pendula::dae
