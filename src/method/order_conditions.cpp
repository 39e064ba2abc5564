#include "method/order_conditions.hpp"

#include <cmath>

#include "base/error.hpp"
#include "base/interrupt.hpp"

namespace pendula::integrate {

std::optional<ExactCoefficients> exact_coefficients(const Tableau& rk) {
  ExactCoefficients exact;
  exact.stages = rk.stages();
  std::vector<Surd> all;
  const auto read = [&](std::span<const Expr> list, std::vector<Surd>& values) {
    for (Expr e : list) {
      const auto value = exact_surd(e);
      if (!value) return false;
      values.push_back(*value);
      all.push_back(*value);
    }
    return true;
  };
  const MatX by_rows = rk.data().A.transpose();
  if (!read(entries(by_rows), exact.A) || !read(entries(rk.data().b), exact.b)) return {};
  if (!read(entries(*rk.data().c), exact.c)) return {};
  if (rk.data().bhat) {
    std::vector<Surd> bhat;
    if (!read(entries(*rk.data().bhat), bhat)) return {};
    exact.bhat = std::move(bhat);
  }
  if (!one_field(all)) return {};
  return exact;
}

namespace {

/// φ(τ) of the first trees, exactly.
class ExactWeights {
 public:
  explicit ExactWeights(const ExactCoefficients& rk) : rk_(rk) {}

  Surd weight(std::size_t tree, const std::vector<Surd>& b, std::span<const RootedTree> trees) {
    while (stage_.size() <= tree) append(trees[stage_.size()]);
    Surd sum;
    for (int i = 0; i < rk_.stages; ++i) sum += b[i] * phi_[tree][i];
    return sum;
  }

 private:
  void append(const RootedTree& tree) {
    poll_interrupt();
    std::vector<Surd> phi(static_cast<std::size_t>(rk_.stages), Surd(1)), stage(phi.size());
    for (int child : tree.children)
      for (std::size_t i = 0; i < phi.size(); ++i) phi[i] *= stage_[child][i];
    for (int i = 0; i < rk_.stages; ++i)
      for (int j = 0; j < rk_.stages; ++j)
        if (!rk_.a(i, j).is_zero()) stage[i] += rk_.a(i, j) * phi[j];
    phi_.push_back(std::move(phi));
    stage_.push_back(std::move(stage));
  }

  const ExactCoefficients& rk_;
  std::vector<std::vector<Surd>> phi_, stage_;
};

}  // namespace

std::vector<OrderCondition> order_conditions(const Tableau& rk, int order, bool embedded) {
  if (order < 1 || order > largest_tree_order)
    throw Error(text("the order must be between 1 and ", largest_tree_order, ", got ", order));
  if (embedded && !rk.bhat()) throw Error(text(rk.name(), " has no embedded method"));
  const Coefficients& c = rk.coefficients();
  const RealVector& b = embedded ? c.bhat : c.b;
  const auto trees = rooted_trees(order);
  constexpr int exact_orders = 8;  // at higher orders the fractions of long tableaus are unreadable
  const auto exact = order <= exact_orders ? exact_coefficients(rk) : std::nullopt;
  std::optional<ExactWeights> weights;
  if (exact) weights.emplace(*exact);
  ElementaryWeights numeric(c);
  std::vector<OrderCondition> list;
  for (std::size_t tree = 0; tree < trees.size(); ++tree) {
    OrderCondition condition;
    condition.tree = static_cast<int>(tree);
    condition.order = trees[tree].order;
    condition.name = tree_name(condition.tree);
    condition.formula = elementary_weight(condition.tree);
    condition.target = mpq_class(1, trees[tree].gamma);
    const Real target(condition.target, c.bits);
    const Real value = numeric.weight(condition.tree, b);
    condition.value = nearest_double(value);
    condition.met = numeric.equals(condition.tree, b, target);
    condition.residual = condition.met ? 0 : nearest_double(Real(value - target));
    if (exact) {
      condition.exact_value = weights->weight(tree, embedded ? *exact->bhat : exact->b, trees);
      condition.exact_residual = *condition.exact_value - Surd(condition.target);
      condition.met = condition.exact_residual->is_zero();
      condition.residual = condition.exact_residual->value();
    }
    list.push_back(std::move(condition));
  }
  return list;
}

double principal_error_norm(const Tableau& rk) {
  const int order = rk.order() + 1;
  if (order > largest_tree_order) return std::nan("");
  const Coefficients& c = rk.coefficients();
  ElementaryWeights weights(c);
  const auto trees = rooted_trees(order);
  const TreeRange range = trees_of_order(order);
  double sum = 0;
  for (int tree = range.first; tree < range.last; ++tree) {
    const RootedTree& t = trees[tree];
    const Real residual(weights.weight(tree, c.b) - Real(1, c.bits) / t.gamma);
    const double share = nearest_double(residual) / static_cast<double>(t.symmetry);
    sum += share * share;
  }
  return std::sqrt(sum);
}

}  // namespace pendula::integrate
