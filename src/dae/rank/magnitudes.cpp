#include "dae/rank/magnitudes.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "dae/rank/least_absolute.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/derivative.hpp"

namespace pendula::dae {
using Index = Eigen::Index;

struct SizeEquations::Parts {
  /// log |e| = constant + Σ coefficient · log s_j; empty where the size is unknown (a factor 0).
  struct Form {
    std::map<Index, double> slope;
    std::size_t constant = 0;  ///< its index in Constants
  };

  /// Logarithms that depend on the values of leaves: each is that of a value, or a + factor b of two earlier
  /// ones. Number 0 is 0.
  class Constants {
   public:
    std::vector<double> value{0};

    std::size_t fixed(double logarithm) { return push(logarithm); }
    std::size_t of_leaf(std::size_t leaf, double logarithm) {
      leaves_.push_back({leaf, value.size()});
      return push(logarithm);
    }
    std::size_t sum(std::size_t a, double factor, std::size_t b) {
      sums_.push_back({value.size(), a, b, factor});
      return push(value[a] + factor * value[b]);
    }

    void evaluate(std::span<const double> values) {
      for (const auto& [leaf, at] : leaves_) value[at] = std::log(std::fabs(values[leaf]));
      for (const Sum& s : sums_) value[s.at] = value[s.a] + s.factor * value[s.b];
    }

   private:
    struct Sum {
      std::size_t at, a, b;
      double factor;
    };
    std::size_t push(double logarithm) {
      value.push_back(logarithm);
      return value.size() - 1;
    }
    std::vector<std::pair<std::size_t, std::size_t>> leaves_;  ///< leaf, index
    std::vector<Sum> sums_;
  };

  /// The terms of a sum, and which of them count.
  struct Terms {
    std::vector<std::size_t> constant;
    std::vector<int> alike;  ///< the number of the set of terms in the same unknowns; empty if none is small
    std::vector<char> counts;
  };

  Constants constants;
  std::vector<Form> equations;          ///< each should be 0
  std::vector<std::vector<Form>> rows;  ///< their terms
  std::vector<Terms> sums;
  std::vector<char> has_size;  ///< by leaf
  std::vector<int> orders;     ///< of the unknowns, as derivatives
  LeastAbsolute least;
  Index unknowns = 0, own_sizes = 0;  ///< columns: the unknowns, then sums with a size of their own
};

namespace {

using Form = SizeEquations::Parts::Form;
using Terms = SizeEquations::Parts::Terms;
using Size = std::optional<Form>;

constexpr double small_beside = 23;  // log 10¹⁰

bool has_small_terms(const std::vector<std::size_t>& constants, const std::vector<double>& value) {
  double least = INFINITY, most = -INFINITY;
  for (std::size_t c : constants) {
    least = std::min(least, value[c]);
    most = std::max(most, value[c]);
  }
  return most - least >= small_beside;
}

/// Excludes terms that are 10¹⁰ times smaller than another one in the same unknowns: cos(π/2) = 6e-17 in a
/// sum with sin x contains no information about sizes.
std::vector<char> not_negligible(const Terms& terms, const std::vector<double>& value) {
  std::vector<char> counts(terms.constant.size(), 1);
  std::vector<double> largest(counts.size(), -INFINITY);
  for (std::size_t k = 0; k < counts.size(); ++k)
    largest[terms.alike[k]] = std::max(largest[terms.alike[k]], value[terms.constant[k]]);
  for (std::size_t k = 0; k < counts.size(); ++k)
    counts[k] = !(value[terms.constant[k]] < largest[terms.alike[k]] - small_beside);
  return counts;
}

bool has_size(double value) { return value != 0 && std::isfinite(value); }

/// Assembles the parts of SizeEquations.
class Builder {
 public:
  Builder(const std::vector<Expr>& unknowns, std::span<const Expr> leaves, std::span<const double> values,
          SizeEquations::Parts& parts)
      : values_(values), parts_(parts) {
    for (std::size_t j = 0; j < unknowns.size(); ++j) column_[unknowns[j]] = static_cast<Index>(j);
    for (std::size_t k = 0; k < leaves.size(); ++k) leaf_[leaves[k]] = k;
  }

  void visit(const std::vector<Expr>& rows, std::size_t equations_among_them) {
    for (Expr e : topological(rows)) size_[e] = size(e);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      terms_of(rows[i], parts_.rows.emplace_back());
      const std::vector<Form>& terms = parts_.rows.back();
      if (i < equations_among_them && terms.size() > 1) balance(terms, sum_of(terms));
    }
  }

 private:
  Size number(double value) {
    if (!has_size(value)) return {};
    return Form{{}, parts_.constants.fixed(std::log(std::fabs(value)))};
  }

  void add(Form& to, double factor, const Form& other) {
    for (const auto& [j, c] : other.slope) to.slope[j] += factor * c;
    to.constant = parts_.constants.sum(to.constant, factor, other.constant);
  }

  void terms_of(Expr e, std::vector<Form>& out) {
    std::vector<Expr> open{e};
    // a sum that shares subexpressions may have any number of terms
    constexpr std::size_t most_terms = 20000;
    while (!open.empty() && out.size() < most_terms) {
      const Expr next = open.back();
      open.pop_back();
      if (next.op() == Op::add || next.op() == Op::sub) {
        open.push_back(next.operand(1));
        open.push_back(next.operand(0));
      } else if (next.op() == Op::neg) {
        open.push_back(next.operand(0));
      } else if (const Size& s = size_.at(next)) {
        out.push_back(*s);
      }
    }
    drop_negligible(out);
  }

  void drop_negligible(std::vector<Form>& list) {
    if (list.size() < 2) return;
    Terms& terms = parts_.sums.emplace_back();
    for (const Form& term : list) terms.constant.push_back(term.constant);
    if (!has_small_terms(terms.constant, parts_.constants.value)) return;
    std::map<std::map<Index, double>, int> sets;
    for (const Form& term : list)
      terms.alike.push_back(sets.try_emplace(term.slope, static_cast<int>(sets.size())).first->second);
    terms.counts = not_negligible(terms, parts_.constants.value);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < list.size(); ++k) {
      if (!terms.counts[k]) continue;
      if (kept != k) list[kept] = std::move(list[k]);
      ++kept;
    }
    list.resize(kept);
  }

  Form mean(const std::vector<Form>& terms) {
    Form m;
    for (const Form& term : terms) add(m, 1.0 / static_cast<double>(terms.size()), term);
    return m;
  }

  /// The size of a sum: the mean of its terms, or an unknown of its own where the mean would couple very many
  /// unknowns in the equation of every term (11 s for forces between 60 particles, 180 sums of 60 terms).
  Form sum_of(const std::vector<Form>& terms) {
    constexpr std::size_t most_terms = 64, most_unknowns = 24;  // 24²/2 products of slopes for each term
    if (terms.size() <= most_terms) {
      Form m = mean(terms);
      if (m.slope.size() <= most_unknowns) return m;
    }
    return Form{{{parts_.unknowns + parts_.own_sizes++, 1}}, 0};
  }

  /// Equations: the terms of a sum are as large as the sum.
  void balance(const std::vector<Form>& terms, const Form& sum) {
    if (terms.size() < 2) return;
    for (const Form& term : terms) {
      Form e = term;
      add(e, -1, sum);
      parts_.equations.push_back(std::move(e));
    }
  }

  Size sum(Expr e) {
    std::vector<Form> terms;
    terms_of(e, terms);
    if (terms.empty()) return {};
    Form m = sum_of(terms);
    balance(terms, m);
    return m;
  }

  Size leaf(Expr e) {
    if (const auto j = column_.find(e); j != column_.end()) return Form{{{j->second, 1}}, 0};
    if (const auto k = leaf_.find(e); k != leaf_.end()) {
      const double value = values_[k->second];
      if (!has_size(value)) return {};
      return Form{{}, parts_.constants.of_leaf(k->second, std::log(std::fabs(value)))};
    }
    if (symbol_of(e).value) return number(pendula::evaluate({&e, 1}, {})[0]);
    return {};
  }

  Size of(Expr e) { return is_sum(e) ? sum(e) : size_.at(e); }
  static bool is_sum(Expr e) { return e.op() == Op::add || e.op() == Op::sub; }

  Size size(Expr e) {
    switch (e.op()) {
      case Op::constant:
        return number(constant_value(e));
      case Op::symbol:
        return leaf(e);
      case Op::add:
      case Op::sub:
        return {};  // handled by of() where it is a factor or an argument
      case Op::neg:
      case Op::abs:
        return of(e.operand(0));
      case Op::mul:
      case Op::div: {
        Size a = of(e.operand(0)), b = of(e.operand(1));
        if (!a || !b) return {};
        add(*a, e.op() == Op::mul ? 1 : -1, *b);
        return a;
      }
      case Op::pow:
      case Op::sqrt: {
        const Size a = of(e.operand(0));
        if (!a) return {};
        if (e.op() == Op::pow && !e.operand(1).is_constant()) return Form{};
        Form result;
        add(result, e.op() == Op::sqrt ? 0.5 : constant_value(e.operand(1)), *a);
        return result;
      }
      case Op::min:
      case Op::max:
        return of(e.operand(0));
      case Op::ifelse:
        return of(e.operand(1));
      case Op::call:
      case Op::solve:
        return {};
      default:
        break;
    }
    if (info(e.op()).arity == 1)  // arguments of transcendental functions have no unit
      if (Size a = of(e.operand(0)); a && !a->slope.empty()) parts_.equations.push_back(*a);
    return Form{};
  }

  std::span<const double> values_;
  SizeEquations::Parts& parts_;
  std::unordered_map<Expr, Index> column_;
  std::unordered_map<Expr, std::size_t> leaf_;
  std::unordered_map<Expr, Size> size_;
};

/// Do the same terms count with these values?
bool still_counts(const Terms& terms, const std::vector<double>& value) {
  if (!has_small_terms(terms.constant, value))
    return std::find(terms.counts.begin(), terms.counts.end(), 0) == terms.counts.end();
  return !terms.alike.empty() && not_negligible(terms, value) == terms.counts;
}

/// The largest term of a row.
double row_unit(const std::vector<Form>& terms, const std::vector<double>& constants, const Vec& log_unit) {
  double largest = -INFINITY;
  for (const Form& term : terms) {
    double value = constants[term.constant];
    for (const auto& [j, c] : term.slope) value += c * log_unit[j];
    largest = std::max(largest, value);
  }
  return std::isfinite(largest) ? std::exp(largest) : 1;
}

/// In a long chain small contradictions add up to meaningless sizes. In units of nanoseconds a derivative of
/// order 5 is 10⁴⁵ times its unknown, and right: each of its orders may be as large as the range of unknowns.
bool is_credible(const Vec& log_unit, const std::vector<int>& orders) {
  constexpr double widest = 80;
  const int lowest = *std::min_element(orders.begin(), orders.end());
  double least = INFINITY, most = -INFINITY;
  for (Index j = 0; j < log_unit.size(); ++j) {
    if (orders[j] > lowest) continue;
    least = std::min(least, log_unit[j]);
    most = std::max(most, log_unit[j]);
  }
  if (!(most - least <= widest)) return false;
  for (Index j = 0; j < log_unit.size(); ++j) {
    const double slack = (orders[j] - lowest) * std::max(widest / 4, most - least);
    if (log_unit[j] < std::min(least, most - widest) - slack ||
        log_unit[j] > std::max(most, least + widest) + slack)
      return false;
  }
  return true;
}

}  // namespace

SizeEquations::SizeEquations(const std::vector<Expr>& rows, std::size_t equations,
                             const std::vector<Expr>& unknowns, std::span<const Expr> leaves,
                             std::span<const double> values)
    : parts_(std::make_unique<Parts>()) {
  parts_->unknowns = static_cast<Index>(unknowns.size());
  Builder(unknowns, leaves, values, *parts_).visit(rows, equations);
  for (double value : values) parts_->has_size.push_back(has_size(value));
  for (Expr leaf : unknowns) {
    const auto derivative = stands_for(leaf);  // x_ddot of a form is as large as x″
    parts_->orders.push_back(symbol_of(leaf).order + (derivative ? symbol_of(*derivative).order : 0));
  }
  for (const Form& e : parts_->equations) parts_->least.add(e.slope);
  parts_->least.finish(parts_->unknowns + parts_->own_sizes);
}

SizeEquations::~SizeEquations() = default;

std::optional<Magnitudes> SizeEquations::operator()(std::span<const double> values, const Anchors& anchors) {
  constexpr double anchored = 1e-10;  // weight that decides only what the equations leave open
  Parts& p = *parts_;
  for (std::size_t k = 0; k < values.size(); ++k)
    if (has_size(values[k]) != static_cast<bool>(p.has_size[k])) return {};
  p.constants.evaluate(values);
  for (const Terms& terms : p.sums)
    if (!still_counts(terms, p.constants.value)) return {};
  std::vector<LeastAbsolute::Single> singles;
  for (const auto& [j, value] : anchors)
    if (has_size(value)) singles.push_back({j, std::log(std::fabs(value)), anchored});
  const Index n = p.unknowns;
  std::vector<double> right_sides;
  for (const Form& e : p.equations) right_sides.push_back(-p.constants.value[e.constant]);
  Vec log_unit = p.least(right_sides, singles);
  if (n > 0 && !is_credible(log_unit.head(n), p.orders)) {
    constexpr double pull = 0.1;  // weight of "this unit is 1" beside an equation's 1
    for (Index j = 0; j < n; ++j) singles.push_back({j, 0, pull});
    log_unit = p.least(right_sides, singles);
  }
  constexpr double largest = 690;  // e⁶⁹⁰ is 1e299: keeps units finite and nonzero
  Magnitudes result{log_unit.head(n).cwiseMin(largest).cwiseMax(-largest).array().exp(),
                    Vec(static_cast<Index>(p.rows.size()))};
  for (std::size_t i = 0; i < p.rows.size(); ++i)
    result.rows[i] = row_unit(p.rows[i], p.constants.value, log_unit);
  return result;
}

Magnitudes magnitudes(const std::vector<Expr>& rows, std::size_t equations, const std::vector<Expr>& unknowns,
                      const std::unordered_map<Expr, double>& known,
                      const std::vector<std::pair<Expr, double>>& anchors) {
  std::vector<Expr> leaves;
  std::vector<double> values;
  for (const auto& [leaf, value] : known) {
    leaves.push_back(leaf);
    values.push_back(value);
  }
  SizeEquations::Anchors places;
  for (const auto& [leaf, value] : anchors)
    if (const auto at = std::find(unknowns.begin(), unknowns.end(), leaf); at != unknowns.end())
      places.emplace_back(at - unknowns.begin(), value);
  return *SizeEquations(rows, equations, unknowns, leaves, values)(values, places);
}

}  // namespace pendula::dae
