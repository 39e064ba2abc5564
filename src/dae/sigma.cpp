#include "dae/sigma.hpp"

#include <algorithm>
#include <limits>
#include <queue>

namespace pendula::dae {
namespace {

constexpr int none = -1;
constexpr int far = std::numeric_limits<int>::max() / 4;

/// Greatest-value transversal by successive shortest paths with potentials (Kuhn-Munkres on a sparse matrix).
class Transversal {
 public:
  Transversal(const Signature& sigma, int variables)
      : sigma_(sigma),
        variable_of(sigma.size(), none),
        equation_of(variables, none),
        row_(sigma.size(), 0),
        column_(variables, 0),
        distance_(variables, far),
        from_(variables, none) {
    for (std::size_t i = 0; i < sigma.size(); ++i) {
      for (const auto& entry : sigma[i]) row_[i] = std::max(row_[i], entry.order);
    }
    for (std::size_t i = 0; i < sigma.size(); ++i)
      if (!augment(static_cast<int>(i))) unmatched.push_back(static_cast<int>(i));
  }

 private:
  const Signature& sigma_;

 public:
  std::vector<int> variable_of, equation_of, unmatched;

 private:
  /// Reduced cost of an entry: never negative, 0 on the transversal.
  int cost(int i, const SignatureEntry& e) const { return row_[i] - e.order + column_[e.variable]; }

  bool augment(int start) {
    using Item = std::pair<int, int>;
    std::priority_queue<Item, std::vector<Item>, std::greater<>> queue;
    std::vector<int> touched, done;
    const auto relax = [&](int i, int base) {
      for (const auto& e : sigma_[i]) {
        const int d = base + cost(i, e);
        if (d >= distance_[e.variable]) continue;
        if (distance_[e.variable] == far) touched.push_back(e.variable);
        distance_[e.variable] = d;
        from_[e.variable] = i;
        queue.push({d, e.variable});
      }
    };
    relax(start, 0);
    int end = none;
    while (!queue.empty() && end == none) {
      const auto [d, j] = queue.top();
      queue.pop();
      if (d > distance_[j]) continue;
      if (equation_of[j] == none) {
        end = j;
      } else {
        done.push_back(j);
        relax(equation_of[j], d);
      }
    }
    if (end != none) {
      const int length = distance_[end];
      row_[start] -= length;
      for (int j : done) {
        column_[j] += length - distance_[j];
        row_[equation_of[j]] -= length - distance_[j];
      }
      for (int j = end; j != none;) {
        const int i = from_[j];
        equation_of[j] = i;
        std::swap(j, variable_of[i]);
      }
    }
    for (int j : touched) distance_[j] = far, from_[j] = none;
    return end != none;
  }

  std::vector<int> row_, column_, distance_, from_;
};

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
  const auto order_on_transversal = [&](int j) {
    for (const auto& e : sigma[t.equation_of[j]])
      if (e.variable == j) return e.order;
    return 0;
  };
  for (bool changed = true; changed;) {  // the smallest dual: Pryce (2001), algorithm 3.1, step 3
    changed = false;
    for (std::size_t i = 0; i < sigma.size(); ++i)
      for (const auto& e : sigma[i]) o.d[e.variable] = std::max(o.d[e.variable], e.order + o.c[i]);
    for (int j = 0; j < variables; ++j) {
      const int c = o.d[j] - order_on_transversal(j);
      int& here = o.c[t.equation_of[j]];
      if (c != here) here = c, changed = true;
    }
  }
  for (int d : o.d) o.value += d;
  for (int c : o.c) o.value -= c;
  return o;
}

}  // namespace pendula::dae
