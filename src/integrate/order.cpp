#include "integrate/order.hpp"

#include <algorithm>

#include "base/interrupt.hpp"

namespace pendula::integrate {
namespace {

/// A sum whose rounding is judged by the sum of the absolute values of its terms.
class Sum {
 public:
  explicit Sum(const Coefficients& rk) : value_(0, rk.bits), size_(0, rk.bits), unit_(rk.unit) {}
  void add(const Real& term) { value_ += term, size_ += abs(term); }
  void add(const Real& term, const Real& size) { value_ += term, size_ += size; }
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

/// All rooted trees by increasing order, each with φ(τ), A φ(τ), their sizes and γ(τ).
/// φ(τ)ᵢ = ∏ over children υ of τ of (A φ(υ))ᵢ, γ(τ) = |τ| ∏ γ(υ)  (§II.2).
class Trees {
 public:
  explicit Trees(const Coefficients& rk) : rk_(rk) {}

  bool order_holds(int order, const RealVector& b) {
    while (static_cast<int>(first_.size()) <= order) grow();
    for (std::size_t i = first_[order - 1]; i < first_[order]; ++i)
      if (!condition(trees_[i], b)) return false;
    return true;
  }

 private:
  struct Tree {
    RealVector phi, size;     ///< φ and ∏ Σ|a||φ|, the scale of its rounding
    RealVector stage, scale;  ///< A φ and its scale: what a parent multiplies
    long gamma = 1;           ///< at most |τ|!
  };

  bool condition(const Tree& tree, const RealVector& b) const {
    Sum sum(rk_);
    for (int i = 0; i < rk_.stages(); ++i) sum.add(Real(b[i] * tree.phi[i]), Real(abs(b[i]) * tree.size[i]));
    return sum.equals(Real(Real(1, rk_.bits) / tree.gamma));
  }

  /// Appends the trees of the next order: multisets of smaller trees with order - 1 nodes in all.
  void grow() {
    if (first_.empty()) first_ = {0};
    const int order = static_cast<int>(first_.size());
    const std::size_t known = trees_.size();
    Tree root;
    root.phi = root.size = RealVector(rk_.stages(), Real(1, rk_.bits));
    root.gamma = order;
    hang(root, order - 1, known);
    first_.push_back(trees_.size());
  }

  /// Hangs subtrees with `nodes` nodes in all below the partial tree, each of number at most `last`.
  void hang(const Tree& partial, int nodes, std::size_t last) {
    if (nodes == 0) return finish(partial);
    for (std::size_t child = std::min(last, first_[nodes]); child-- > 0;) {
      Tree next = partial;
      for (int i = 0; i < rk_.stages(); ++i) {
        next.phi[i] *= trees_[child].stage[i];
        next.size[i] *= trees_[child].scale[i];
      }
      next.gamma *= trees_[child].gamma;
      hang(next, nodes - order_of(child), child + 1);
    }
  }

  int order_of(std::size_t tree) const {
    return static_cast<int>(std::upper_bound(first_.begin(), first_.end(), tree) - first_.begin());
  }

  void finish(Tree tree) {
    poll_interrupt();
    tree.stage = tree.scale = RealVector(rk_.stages(), Real(0, rk_.bits));
    for (int i = 0; i < rk_.stages(); ++i) {
      for (int j = 0; j < rk_.stages(); ++j) {
        tree.stage[i] += rk_.A(i, j) * tree.phi[j];
        tree.scale[i] += abs(rk_.A(i, j)) * tree.size[j];
      }
    }
    trees_.push_back(std::move(tree));
  }

  const Coefficients& rk_;
  std::vector<Tree> trees_;
  std::vector<std::size_t> first_;  ///< trees of order n are numbers first_[n-1] … first_[n] - 1
};

}  // namespace

int algebraic_order(const Coefficients& rk, const RealVector& b) {
  const int s = rk.stages();
  const auto c = powers(rk, 2 * s);
  const int p =
      largest(2 * s, [&](int q) { return quadrature(rk, b, c, q); });  // 2s is the most a quadrature can do
  const int eta = largest(s, [&](int q) { return collocation(rk, c, q); });
  const int zeta = largest(s, [&](int q) { return adjoint(rk, b, c, q); });
  const int proven = std::min({p, eta + zeta + 1, 2 * eta + 2});
  if (proven == p) return p;
  Trees trees(rk);
  int order = proven;
  while (order < std::min(p, largest_tree_order) && trees.order_holds(order + 1, b)) ++order;
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
