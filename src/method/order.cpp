#include "method/order.hpp"

#include <algorithm>

#include "base/interrupt.hpp"

namespace pendula::integrate {
namespace {

/// A sum that counts as zero if it is small relative to the sum of the absolute values of its terms.
class Sum {
 public:
  explicit Sum(const Coefficients& rk) : value_(0, rk.bits), size_(0, rk.bits), unit_(rk.unit) {}
  void add(const Real& term) {
    value_ += term;
    size_ += abs(term);
  }
  void add(const Real& term, const Real& size) {
    value_ += term;
    size_ += size;
  }
  bool equals(const Real& expected) const {
    return abs(value_ - expected) <= unit_ * (size_ + abs(expected));
  }

 private:
  Real value_, size_;
  double unit_;
};

/// cᵢ^q for q = 0 … highest, powers[q][i].
std::vector<RealVector> powers(const Coefficients& rk, int highest) {
  std::vector<RealVector> result(1, RealVector(rk.stages(), Real(1, rk.bits)));
  for (int q = 1; q <= highest; ++q) {
    result.push_back(result.back());
    for (int i = 0; i < rk.stages(); ++i) result[q][i] *= rk.c[i];
  }
  return result;
}

bool quadrature(const Coefficients& rk, const RealVector& b, const std::vector<RealVector>& c, int q) {  // B
  Sum sum(rk);
  for (int i = 0; i < rk.stages(); ++i) sum.add(Real(b[i] * c[q - 1][i]));
  return sum.equals(Real(Real(1, rk.bits) / q));
}

bool collocation(const Coefficients& rk, const std::vector<RealVector>& c, int q) {  // C
  poll_interrupt();
  for (int i = 0; i < rk.stages(); ++i) {
    Sum sum(rk);
    for (int j = 0; j < rk.stages(); ++j) sum.add(Real(rk.A(i, j) * c[q - 1][j]));
    if (!sum.equals(Real(c[q][i] / q))) return false;
  }
  return true;
}

bool adjoint(const Coefficients& rk, const RealVector& b, const std::vector<RealVector>& c, int q) {  // D
  poll_interrupt();
  for (int j = 0; j < rk.stages(); ++j) {
    Sum sum(rk);
    for (int i = 0; i < rk.stages(); ++i) sum.add(Real(b[i] * c[q - 1][i] * rk.A(i, j)));
    sum.add(Real(-b[j] / q));
    if (!sum.equals(Real(-b[j] * c[q][j] / q))) return false;
  }
  return true;
}

/// The largest q ≤ limit up to which a family of conditions holds.
template <class Condition>
int largest(int limit, const Condition& holds) {
  int q = 0;
  while (q < limit && holds(q + 1)) ++q;
  return q;
}

}  // namespace

const ElementaryWeights::Entry& ElementaryWeights::entry(int tree) {
  const int s = rk_.stages();
  const RealVector ones(static_cast<std::size_t>(s), Real(1, rk_.bits));
  const RealVector zeros(static_cast<std::size_t>(s), Real(0, rk_.bits));
  int order = 1;
  while (trees_of_order(order).last <= tree) ++order;
  const auto trees = rooted_trees(order);
  while (static_cast<int>(entries_.size()) <= tree) {
    poll_interrupt();
    Entry next{ones, ones, zeros, zeros};
    for (int child : trees[entries_.size()].children) {
      for (int i = 0; i < s; ++i) {
        next.phi[i] *= entries_[child].stage[i];
        next.size[i] *= entries_[child].scale[i];
      }
    }
    for (int i = 0; i < s; ++i) {
      for (int j = 0; j < s; ++j) {
        if (rk_.A(i, j) == 0) continue;
        next.stage[i] += rk_.A(i, j) * next.phi[j];
        next.scale[i] += abs(rk_.A(i, j)) * next.size[j];
      }
    }
    entries_.push_back(std::move(next));
  }
  return entries_[tree];
}

const RealVector& ElementaryWeights::phi(int tree) { return entry(tree).phi; }

Real ElementaryWeights::weight(int tree, const RealVector& b) {
  const Entry& at = entry(tree);
  Real sum(0, rk_.bits);
  for (int i = 0; i < rk_.stages(); ++i) sum += b[i] * at.phi[i];
  return sum;
}

bool ElementaryWeights::equals(int tree, const RealVector& b, const Real& target) {
  const Entry& at = entry(tree);
  Sum sum(rk_);
  for (int i = 0; i < rk_.stages(); ++i) sum.add(Real(b[i] * at.phi[i]), Real(abs(b[i]) * at.size[i]));
  return sum.equals(target);
}

bool ElementaryWeights::order_holds(int order, const RealVector& b) {
  const auto trees = rooted_trees(order);
  const TreeRange range = trees_of_order(order);
  for (int tree = range.first; tree < range.last; ++tree)
    if (!equals(tree, b, Real(Real(1, rk_.bits) / trees[tree].gamma))) return false;
  return true;
}

int continuous_order(const Coefficients& rk, const std::vector<RealVector>& columns, int limit) {
  ElementaryWeights weights(rk);
  return largest(limit, [&](int order) {
    const auto trees = rooted_trees(order);
    const TreeRange range = trees_of_order(order);
    for (int tree = range.first; tree < range.last; ++tree) {
      for (std::size_t k = 1; k <= columns.size(); ++k) {
        Real target(0, rk.bits);
        if (static_cast<int>(k) == order) target = Real(1, rk.bits) / trees[tree].gamma;
        if (!weights.equals(tree, columns[k - 1], target)) return false;
      }
    }
    return true;
  });
}

SimplifyingAssumptions simplifying_assumptions(const Coefficients& rk, const RealVector& b) {
  const int s = rk.stages();
  const auto c = powers(rk, 2 * s);
  // 2s is the maximum for a quadrature formula
  return {largest(2 * s, [&](int q) { return quadrature(rk, b, c, q); }),
          largest(s, [&](int q) { return collocation(rk, c, q); }),
          largest(s, [&](int q) { return adjoint(rk, b, c, q); })};
}

int algebraic_order(const Coefficients& rk, const RealVector& b) {
  const auto [p, eta, zeta] = simplifying_assumptions(rk, b);
  const int proven = std::min({p, eta + zeta + 1, 2 * eta + 2});
  if (proven == p) return p;
  ElementaryWeights weights(rk);
  int order = proven;
  while (order < std::min(p, largest_tree_order) && weights.order_holds(order + 1, b)) ++order;
  return order;
}

int stage_order(const Coefficients& rk) {
  const auto c = powers(rk, 2 * rk.stages());
  return largest(rk.stages(), [&](int q) { return quadrature(rk, rk.b, c, q) && collocation(rk, c, q); });
}

bool satisfies_collocation(const Coefficients& rk) {
  for (int i = 0; i < rk.stages(); ++i)
    for (int j = 0; j < i; ++j)
      if (equal(rk.c[i], rk.c[j], rk)) return false;
  return stage_order(rk) == rk.stages();
}

bool equal(const Real& a, const Real& b, const Coefficients& rk) {
  return abs(a - b) <= rk.unit * (abs(a) + abs(b));
}

}  // namespace pendula::integrate
