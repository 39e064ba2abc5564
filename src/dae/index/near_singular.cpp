#include "dae/index/near_singular.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/index/array_index.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/rank/magnitudes.hpp"
#include "dae/rank/rank.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {

std::string answer_text(int index, int dof) {
  return text("index ", index, ", ", dof, dof == 1 ? " free initial value" : " free initial values");
}

namespace {

constexpr double rounding = 64 * 2.2e-16;  // of the result of some dozens of operations, relative

/// Is v the rounding error of a difference? The difference of two close doubles is a small multiple of their
/// last bit: 100·1.1 - 110 = 2⁻⁴⁶. Other results use all bits; one in 2⁴³ of them looks like this by chance.
bool is_difference_of_roundings(double v) {
  constexpr int bits = 10;
  int exponent;
  const double leading = std::ldexp(std::frexp(v, &exponent), bits);
  return v != 0 && leading == std::round(leading);
}

/// Constants of the size of rounding errors relative to the other constants of the equation, or 1: 0.1 + 0.2
/// - 0.3. Typed decimals are exact and excluded.
std::vector<Expr> rounding_sized(Expr residual) {
  constexpr double small_beside =
      1e-6;  // 2¹⁰ times the last bit of numbers up to 10⁷ times the largest remaining one
  std::vector<Expr> small;
  double largest = 1;
  for (Expr node : topological({&residual, 1}))
    if (node.is_constant()) largest = std::max(largest, std::fabs(constant_value(node)));
  for (Expr node : topological({&residual, 1})) {
    if (!node.is_constant() || exact_value(node)) continue;
    const double share = std::fabs(constant_value(node)) / largest;
    if (share <= rounding || (share <= small_beside && is_difference_of_roundings(constant_value(node))))
      small.push_back(node);
  }
  return small;
}

/// An equation with 0 in the place of constants; nothing if it has no value then, as 1/c.
std::optional<Expr> with_zeros(Expr residual, const std::vector<Expr>& constants) {
  Substitution zero;
  for (Expr c : constants) zero[c] = Expr(0);
  try {
    return substitute(residual, zero);
  } catch (const Error&) {
    return {};
  }
}

/// Sizes of unknowns determined without the smallest constants. In nanometres, 10⁻¹⁸ is an area.
class SizesWithout {
 public:
  /// given: with the constants, beside which t may occur that does not elsewhere.
  SizesWithout(const std::vector<Expr>& residuals, const std::vector<Expr>& given)
      : values_(random_point(residuals, 0)) {
    for (const auto& [leaf, value] : random_point(given, 0))
      if (symbol_of(leaf).kind != Kind::variable) values_.emplace(leaf, value);
    std::vector<Expr> unknowns;
    for (Expr leaf : leaves(residuals))  // not in the order of the map, which depends on the session
      if (symbol_of(leaf).kind == Kind::variable) unknowns.push_back(leaf);
    const Magnitudes m = magnitudes(residuals, residuals.size(), unknowns, {}, {});
    rows_ = m.rows;
    for (std::size_t j = 0; j < unknowns.size(); ++j) values_[unknowns[j]] *= m.unknowns[j];
  }

  /// Does a constant change a residual by more than a rounding error of its largest term? True if an
  /// unknown has no known size, because all its factors are small constants, like an acceleration
  /// multiplied by a small mass.
  bool is_seen(Expr before, Expr after, Eigen::Index row) const {
    const std::vector<Expr> inside = leaves({&before, 1});
    if (std::any_of(inside.begin(), inside.end(), [&](Expr leaf) {
          return symbol_of(leaf).kind == Kind::variable && !values_.count(leaf);
        }))
      return true;
    const std::vector<double> r = evaluate(std::vector{before, after}, values_);
    return std::fabs(r[0] - r[1]) > rounding * rows_[row];
  }

 private:
  std::unordered_map<Expr, double> values_;
  Vec rows_;
};

}  // namespace

std::optional<std::string> note_on_rounding(const Model& m, const std::string& here,
                                            const std::function<std::string(const Model&)>& answer_in) {
  Model other = m;
  other.residuals = residuals_at_values(m);
  const std::vector<Expr> given = other.residuals;
  std::vector<std::vector<Expr>> small;
  const auto put_zeros = [&](std::size_t i) {
    const auto e = with_zeros(given[i], small[i]);
    if (!e) small[i].clear();
    other.residuals[i] = e.value_or(given[i]);
  };
  for (std::size_t i = 0; i < given.size(); ++i) {
    small.push_back(rounding_sized(given[i]));
    put_zeros(i);
  }
  if (other.residuals == given) return {};

  std::vector<std::string> words;
  const SizesWithout sizes(other.residuals, given);
  for (std::size_t i = 0; i < given.size(); ++i) {
    const auto is_seen = [&](Expr c) {
      if (is_difference_of_roundings(constant_value(c))) return false;
      const auto after = with_zeros(given[i], {c});
      return !after || sizes.is_seen(given[i], *after, static_cast<Eigen::Index>(i));
    };
    small[i].erase(std::remove_if(small[i].begin(), small[i].end(), is_seen), small[i].end());
    put_zeros(i);
    for (Expr c : small[i]) words.push_back(text(rounded(constant_value(c), 3), " in ", m.label(i)));
  }
  if (words.empty()) return {};
  const std::string there = answer_in(other);
  if (here == there) return {};
  return text("near-singular: ", join(words, ", "),
              words.size() == 1 ? " has the size of a rounding error" : " have the size of rounding errors",
              "; as given: ", here, ", with 0 in ", words.size() == 1 ? "its" : "their", " place: ", there);
}

/// Has the system Jacobian full rank at some point, with pivots above rounding? Points of several sizes are
/// tried: at a temperature of 1, exp(-3000/T) is 0.
static bool has_clear_rank(const Model& m, const Analysis& a) {
  std::vector<Expr> slopes;
  for (const Entry& e : a.jacobian) slopes.push_back(e.value);
  slopes = at_values(slopes, m.values);
  const auto n = static_cast<Eigen::Index>(m.variables.size());
  int attempt = 0;
  for (double size : {1.0, 1e-3, 30.0, 1e3, 1e-6, 1e6}) {
    auto point = random_point(slopes, attempt++);
    for (auto& [leaf, value] : point) value *= size;
    const auto values = pendula::evaluate(slopes, point);
    Mat J = Mat::Zero(n, n);
    for (std::size_t k = 0; k < values.size(); ++k) J(a.jacobian[k].row, a.jacobian[k].column) = values[k];
    if (J.allFinite() && rank_with_gap(balance(J)(J)).rank == n) return true;
  }
  return false;
}

std::optional<std::string> note_on_pivots(const Model& m, const Analysis& a, const std::string& here) {
  constexpr std::size_t affordable = 12;  // unknowns
  if (m.variables.size() > affordable || !a.regular || has_clear_rank(m, a)) return {};
  ArrayOptions numeric;
  numeric.conditions = false;
  numeric.numeric = true;
  const ArrayResult array = derivative_array(m, numeric);
  const std::string there =
      array.verdict == ArrayVerdict::determined ? answer_text(*array.index, *array.dof) : array.text;
  if (here == there) return {};
  return text(
      "near-singular: the pivots of the system Jacobian differ by more than 10⁸ and the smallest is "
      "lost in rounding; as given: ",
      here, ", counted as 0: ", there);
}

}  // namespace pendula::dae
