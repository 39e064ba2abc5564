#include "dae/structure/sigma.hpp"

#include <algorithm>
#include <deque>
#include <limits>
#include <queue>

#include "base/interrupt.hpp"

namespace pendula::dae {
namespace {

constexpr int unassigned = -1;
constexpr int far = std::numeric_limits<int>::max() / 4;  // sums of three do not overflow

/// Greatest-value transversal by the primal-dual method (Kuhn-Munkres on a sparse matrix, all free
/// equations together). A shortest-path sweep from the free equations makes edges to free variables tight;
/// then disjoint paths of tight edges are augmented, as many as are found. Orders are small, so that few
/// sweeps are needed.
class Transversal {
 public:
  Transversal(const Signature& sigma, int variables)
      : sigma_(sigma),
        variable_of(sigma.size(), unassigned),
        equation_of(variables, unassigned),
        row_(sigma.size(), 0),
        column_(variables, 0),
        distance_(variables, far),
        next_(sigma.size(), 0),
        visited_(variables, 0) {
    for (std::size_t i = 0; i < sigma.size(); ++i)
      for (const auto& entry : sigma[i]) row_[i] = std::max(row_[i], entry.order);
    do {
      while (augment_tight()) poll_interrupt();
    } while (make_tight());
    for (std::size_t i = 0; i < sigma.size(); ++i)
      if (variable_of[i] == unassigned) unmatched.push_back(static_cast<int>(i));
  }

 private:
  const Signature& sigma_;

 public:
  std::vector<int> variable_of, equation_of, unmatched;

 private:
  /// Reduced cost of an entry: never negative, 0 on the transversal.
  int cost(int i, const SignatureEntry& e) const { return row_[i] - e.order + column_[e.variable]; }

  /// Disjoint augmenting paths over entries of cost 0, depth first from every free equation; false if none.
  bool augment_tight() {
    std::fill(visited_.begin(), visited_.end(), 0);
    std::fill(next_.begin(), next_.end(), 0);
    bool any = false;
    for (int i = 0; i < static_cast<int>(sigma_.size()); ++i)
      if (variable_of[i] == unassigned && augment(i)) any = true;
    return any;
  }

  bool augment(int start) {
    std::vector<int> path{start};
    while (!path.empty()) {
      const int i = path.back();
      if (next_[i] == sigma_[i].size()) {
        path.pop_back();
        continue;
      }
      const auto& e = sigma_[i][next_[i]++];
      if (visited_[e.variable] || cost(i, e) != 0) continue;
      visited_[e.variable] = 1;
      if (equation_of[e.variable] != unassigned) {
        path.push_back(equation_of[e.variable]);
        continue;
      }
      // each equation on the path takes the variable released by the next one
      for (int j = e.variable; !path.empty(); path.pop_back()) {
        equation_of[j] = path.back();
        std::swap(j, variable_of[path.back()]);
      }
      return true;
    }
    return false;
  }

  /// Computes distances from all free equations to the nearest free variable and updates the duals so that
  /// the shortest paths become tight; false if no free variable is reachable.
  bool make_tight() {
    using Item = std::pair<int, int>;
    std::priority_queue<Item, std::vector<Item>, std::greater<>> queue;
    std::fill(distance_.begin(), distance_.end(), far);
    const auto relax = [&](int i, int base) {
      for (const auto& e : sigma_[i]) {
        const int d = base + cost(i, e);
        if (d >= distance_[e.variable]) continue;
        distance_[e.variable] = d;
        queue.push({d, e.variable});
      }
    };
    for (int i = 0; i < static_cast<int>(sigma_.size()); ++i)
      if (variable_of[i] == unassigned) relax(i, 0);
    int length = far;
    while (!queue.empty()) {
      const auto [d, j] = queue.top();
      queue.pop();
      if (d > distance_[j]) continue;
      if (equation_of[j] == unassigned) {
        length = d;
        break;
      }
      relax(equation_of[j], d);
    }
    if (length == far) return false;
    for (int i = 0; i < static_cast<int>(sigma_.size()); ++i)
      if (variable_of[i] == unassigned) row_[i] -= length;
    for (int j = 0; j < static_cast<int>(equation_of.size()); ++j)
      if (distance_[j] < length) {
        column_[j] += length - distance_[j];
        row_[equation_of[j]] -= length - distance_[j];
      }
    return true;
  }

  std::vector<int> row_, column_, distance_;
  std::vector<std::size_t> next_;
  std::vector<char> visited_;
};

/// The smallest dual solution (Pryce 2001, algorithm 3.1, step 3), with a queue of equations whose
/// offset has grown.
void smallest_offsets(const Signature& sigma, const std::vector<int>& equation_of, Offsets& o) {
  std::vector<int> order_on_transversal(equation_of.size(), 0);
  for (std::size_t j = 0; j < equation_of.size(); ++j)
    for (const auto& e : sigma[equation_of[j]])
      if (e.variable == static_cast<int>(j)) order_on_transversal[j] = e.order;
  std::deque<int> grown;
  std::vector<char> waiting(sigma.size(), 1);
  for (int i = 0; i < static_cast<int>(sigma.size()); ++i) grown.push_back(i);
  while (!grown.empty()) {
    const int i = grown.front();
    grown.pop_front();
    waiting[i] = 0;
    for (const auto& e : sigma[i]) {
      const int j = e.variable;
      if (e.order + o.c[i] <= o.d[j]) continue;
      o.d[j] = e.order + o.c[i];
      const int k = equation_of[j], c = o.d[j] - order_on_transversal[j];
      if (c <= o.c[k]) continue;
      o.c[k] = c;
      if (!waiting[k]) {
        waiting[k] = 1;
        grown.push_back(k);
      }
    }
  }
}

}  // namespace

int Offsets::index() const {
  const int most = c.empty() ? 0 : *std::max_element(c.begin(), c.end());
  return most + (std::find(d.begin(), d.end(), 0) != d.end() ? 1 : 0);
}

Offsets offsets(const Signature& sigma, int variables) {
  const Transversal t(sigma, variables);
  Offsets o;
  o.equation_of = t.equation_of;
  o.unmatched = t.unmatched;
  o.c.assign(sigma.size(), 0);
  o.d.assign(variables, 0);
  if (!o.unmatched.empty()) return o;
  smallest_offsets(sigma, t.equation_of, o);
  for (int d : o.d) o.value += d;
  for (int c : o.c) o.value -= c;
  return o;
}

LowerIndexRows lower_index_rows(const Offsets& o, const std::vector<int>& orders) {
  LowerIndexRows lower;
  if (o.index() == 0) return lower;
  const int most = *std::max_element(o.c.begin(), o.c.end());
  const int stage = std::find(o.d.begin(), o.d.end(), 0) != o.d.end() ? 1 : 0;
  for (std::size_t i = 0; i < o.c.size(); ++i)
    if (o.c[i] < most) lower.rows.push_back(static_cast<int>(i));
  for (std::size_t j = 0; j < o.d.size(); ++j)
    if (o.d[j] + stage != std::max(1, orders[j])) lower.other_columns.push_back(static_cast<int>(j));
  lower.asked = static_cast<int>(o.d.size() - lower.other_columns.size());
  return lower;
}

}  // namespace pendula::dae
