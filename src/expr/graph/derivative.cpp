#include "expr/graph/derivative.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/lru_cache.hpp"
#include "expr/graph/node_map.hpp"
#include "expr/graph/power_product.hpp"
#include "expr/graph/solve.hpp"

namespace pendula {
namespace {

bool moves_with_time(const Symbol& s) { return s.kind == Kind::variable || s.kind == Kind::input; }

bool has_roots(const std::vector<Expr>& nodes) { return std::any_of(nodes.begin(), nodes.end(), is_root); }

/// A choice between two constants, as in the derivatives of min and max.
bool is_choice(Expr e) {
  return e.op() == Op::ifelse && e.operand(1).is_constant() && e.operand(2).is_constant();
}

/// Products of the chain rule. An operand that is not selected contributes 0 even if the other factor is
/// infinite: √max(0, x) has the derivative 0 for x < 0, not ∞·0.
struct Times {
  bool roots;  ///< which may cancel
  Expr operator()(Expr a, Expr b) const {
    if (is_choice(a)) return chosen(a, b);
    if (is_choice(b)) return chosen(b, a);
    return roots ? cancelled_product(a, b) : a * b;
  }

 private:
  static Expr chosen(Expr choice, Expr factor) {
    return ifelse(choice.operand(0), choice.operand(1) * factor, choice.operand(2) * factor);
  }
};

/// A choice with a zero branch, or a sum with such choices.
bool has_choice(Expr e) {
  if (e.op() == Op::ifelse) return e.operand(1).is_zero() || e.operand(2).is_zero();
  if (e.op() != Op::add) return false;
  const auto parts = e.operands();
  return std::any_of(parts.begin(), parts.end(), [](Expr part) { return part.op() == Op::ifelse; });
}

/// weight·factor with the choice outermost: a branch that is not selected contributes 0, even if its
/// derivative is infinite or NaN. `depth`: sums of long chains of choices are left unchanged.
Expr scaled(Expr weight, Expr factor, const Times& times, int depth = 0) {
  constexpr int deepest = 20;  // a choice: each level copies the choices of the weight
  if (weight.is_symbol() || weight.is_constant() || depth > deepest) return times(weight, factor);
  const auto inner = [&](Expr part) {
    return part.is_zero() ? part : scaled(part, factor, times, depth + 1);
  };
  if (!has_choice(weight)) return times(weight, factor);
  if (weight.op() == Op::ifelse)
    return ifelse(weight.operand(0), inner(weight.operand(1)), inner(weight.operand(2)));
  const auto parts = weight.operands();
  // creating nodes may move the memory of the graph
  const std::vector<Expr> list(parts.begin(), parts.end());
  Expr sum = 0;
  for (Expr part : list) sum += inner(part);
  return sum;
}

/// Forward sweep: d e where `seed` gives the derivative of a leaf.
template <class Seed>
Expr tangent(Expr e, const Seed& seed) {
  static NodeMap<Expr> d;
  d.clear();
  std::unordered_map<Expr, VecX> solved;  // of every linear system, by its head
  const std::vector<Expr> order = topological({&e, 1});
  const Times times{has_roots(order)};
  for (Expr node : order) {
    poll_interrupt();
    Expr sum = 0;
    if (node.is_symbol()) {
      sum = seed(node);
    } else if (node.op() == Op::solve) {
      if (component_of(node) == 0)
        solved[node] = solution_tangent(node, [](Expr operand) { return d[operand]; });
      sum = solved[head_of(node)][component_of(node)];
    } else if (node.op() == Op::ifelse) {  // not 1·dp + 0·dq: dq may be infinite where p is selected
      const Expr dp = d[node.operand(1)], dq = d[node.operand(2)];
      if (!dp.is_zero() || !dq.is_zero()) sum = ifelse(node.operand(0), dp, dq);
    } else {
      const auto operands = node.operands();
      for (std::size_t i = 0; i < operands.size(); ++i) {
        const Expr di = d[operands[i]];
        if (di.is_zero()) continue;
        const Expr slope = local_derivative(node, static_cast<int>(i));
        sum += has_choice(di) ? scaled(di, slope, times) : times(slope, di);
      }
    }
    d[node] = sum;
  }
  return d[e];
}

/// Reverse sweep: calls found(leaf, adjoint) for every leaf among `wanted` on which e depends. Nodes without
/// such leaves are skipped.
template <class Wanted, class Found>
void reverse_sweep(Expr e, const Wanted& wanted, const Found& found) {
  static NodeMap<Expr> adjoint;
  static NodeMap<char> active;
  adjoint.clear();
  active.clear();
  const std::vector<Expr> order = topological({&e, 1});
  const Times times{has_roots(order)};
  for (Expr node : order) {
    const auto operands = node.operands();
    active[node] = node.is_symbol() ? wanted(node)
                                    : std::any_of(operands.begin(), operands.end(),
                                                  [](Expr operand) { return active[operand] != 0; });
  }
  std::unordered_map<Expr, VecX> of_system;  // the adjoints of all components, by the head
  const auto add = [](Expr operand, Expr term) { adjoint[operand] += term; };
  adjoint[e] = 1;
  for (auto it = order.rbegin(); it != order.rend(); ++it) {
    poll_interrupt();
    const Expr node = *it, weight = adjoint[node];
    if (!active[node]) continue;
    if (node.op() == Op::solve) {
      const Expr head = head_of(node);
      VecX& weights = of_system.try_emplace(head, VecX::Zero(system_of(head).size)).first->second;
      weights[component_of(node)] = weight;
      if (node == head)
        solution_adjoint(
            head, weights, [](Expr o) { return active[o] != 0; }, add);
      continue;
    }
    if (weight.is_zero()) continue;
    if (node.is_symbol()) {
      found(node, weight);
      continue;
    }
    if (node.op() == Op::ifelse) {
      const Expr condition = node.operand(0), p = node.operand(1), q = node.operand(2);
      if (active[p]) add(p, ifelse(condition, weight, 0));
      if (active[q]) add(q, ifelse(condition, 0, weight));
      continue;
    }
    const auto operands = node.operands();
    for (std::size_t i = 0; i < operands.size(); ++i)
      if (active[operands[i]])
        add(operands[i], scaled(weight, local_derivative(node, static_cast<int>(i)), times));
  }
}

double value_of(Expr node, const NodeMap<double>& values) {
  const auto operands = node.operands();
  const auto at = [&](std::size_t i) {
    return i < operands.size() ? const_cast<NodeMap<double>&>(values)[operands[i]] : 0.0;
  };
  return apply(node.op(), at(0), at(1), at(2));
}

/// Computes `values` for all nodes below the outputs in topological order; `visit` is called for each node
/// after its value.
template <class Visit>
void evaluate_nodes(std::span<const Expr> outputs, const std::unordered_map<Expr, double>& leaf_values,
                    NodeMap<double>& values, const Visit& visit) {
  std::unordered_map<Expr, std::vector<double>> solved;
  for (Expr node : topological(outputs)) {
    const bool leaf = node.is_symbol() || node.op() == Op::call;
    if (const auto given = leaf ? leaf_values.find(node) : leaf_values.end(); given != leaf_values.end()) {
      values[node] = given->second;
    } else if (node.is_constant()) {
      values[node] = constant_value(node);
    } else if (node.is_symbol()) {
      const Symbol& s = symbol_of(node);
      if (s.kind != Kind::constant)
        throw Error(text("no value for '", s.name, std::string(s.order, '\''), "'"));
      values[node] = constant_value(*s.value);
    } else if (node.op() == Op::call) {
      throw Error(text("'", call_of(node).name,
                       "' is an unspecified function: it has no value; substitute it with subs"));
    } else if (node.op() == Op::solve) {
      if (component_of(node) == 0)
        solved[node] = solution_value(node, [&](Expr operand) { return values[operand]; });
      values[node] = solved[head_of(node)][component_of(node)];
    } else {
      values[node] = value_of(node, values);
    }
    visit(node);
  }
}

}  // namespace

Expr partial(Expr e, Expr leaf) {
  return tangent(e, [&](Expr node) { return node == leaf ? Expr(1) : Expr(0); });
}

std::vector<Expr> gradient(Expr e, std::span<const Expr> leaves) {
  std::unordered_map<Expr, std::size_t> position;
  for (std::size_t j = 0; j < leaves.size(); ++j) position.emplace(leaves[j], j);
  std::vector<Expr> g(leaves.size());
  reverse_sweep(
      e, [&](Expr leaf) { return position.count(leaf) > 0; },
      [&](Expr leaf, Expr adjoint) { g[position.at(leaf)] = adjoint; });
  for (std::size_t j = 0; j < leaves.size(); ++j) g[j] = g[position.at(leaves[j])];  // a leaf listed twice
  return g;
}

MatX jacobian(std::span<const Expr> f, std::span<const Expr> x) {
  MatX j(static_cast<Eigen::Index>(f.size()), static_cast<Eigen::Index>(x.size()));
  for (std::size_t i = 0; i < f.size(); ++i) {
    const auto row = gradient(f[i], x);
    for (std::size_t k = 0; k < x.size(); ++k) j(i, k) = row[k];
  }
  return j;
}

static std::vector<Entry> differentiated(std::span<const Expr> f, std::span<const Expr> x) {
  std::unordered_map<Expr, int> column;
  for (std::size_t j = 0; j < x.size(); ++j) column.emplace(x[j], static_cast<int>(j));
  std::vector<Entry> found;
  for (std::size_t i = 0; i < f.size(); ++i) {
    poll_interrupt();
    const std::size_t first = found.size();
    reverse_sweep(
        f[i], [&](Expr leaf) { return column.count(leaf) > 0; },
        [&](Expr leaf, Expr adjoint) {
          found.push_back({static_cast<int>(i), column.at(leaf), adjoint});
        });
    std::sort(found.begin() + static_cast<std::ptrdiff_t>(first), found.end(),
              [](const Entry& a, const Entry& b) { return a.column < b.column; });
  }
  return found;
}

/// The last Jacobians are cached, since every call of init and integrate needs the same ones.
std::vector<Entry> sparse_jacobian(std::span<const Expr> f, std::span<const Expr> x) {
  constexpr std::size_t few = 10,
                        most = 500'000;  // entries of 12 bytes: fewer are quickly made again; in all 6 MB
  static LruCache<std::vector<std::uint32_t>, std::vector<Entry>, WordsHash, Refers::by_touch> known(most);
  if (f.size() < few) return differentiated(f, x);
  std::vector<std::uint32_t> key{static_cast<std::uint32_t>(f.size())};
  for (const auto list : {f, x})
    for (Expr e : list) key.push_back(e.id());
  if (const auto* entries = known.find(key)) {
    for (const Entry& e : *entries) touch(e.value);
    return *entries;
  }
  std::vector<Entry> entries = differentiated(f, x);
  const std::size_t size = f.size() + x.size() + entries.size();
  return size > most ? entries : known.insert(key, std::move(entries), size);
}

Expr total_derivative(Expr e, int order) {
  for (int k = 0; k < order; ++k)
    e = tangent(e, [](Expr leaf) {
      const Symbol& s = symbol_of(leaf);
      if (s.kind == Kind::time) return Expr(1);
      return moves_with_time(s) ? derivative_leaf(leaf) : Expr(0);
    });
  return e;
}

std::vector<Expr> substitute(std::span<const Expr> outputs, const Substitution& replacements) {
  static NodeMap<Expr> image;
  image.clear();
  std::unordered_map<Expr, VecX> solved;
  const auto of = [](Expr operand) { return image[operand]; };
  for (Expr node : topological(outputs)) {
    poll_interrupt();
    if (node.op() == Op::solve && component_of(node) == 0) solved[node] = mapped_solution(node, of);
    if (const auto it = replacements.find(node); it != replacements.end()) {
      image[node] = it->second;
    } else if (node.op() == Op::call) {
      FunctionCall moved = call_of(node);
      for (Expr& argument : moved.arguments) argument = image[argument];
      image[node] = call(moved);
    } else if (node.op() == Op::solve) {
      image[node] = solved[head_of(node)][component_of(node)];
    } else if (const auto x = node.operands(); x.empty()) {
      image[node] = node;
    } else {
      const Expr a = image[x[0]], b = x.size() > 1 ? image[x[1]] : Expr(0),
                 c = x.size() > 2 ? image[x[2]] : Expr(0);
      const bool same = a == x[0] && (x.size() < 2 || b == x[1]) && (x.size() < 3 || c == x[2]);
      image[node] = same ? node : make(node.op(), a, b, c);
    }
  }
  std::vector<Expr> result;
  result.reserve(outputs.size());
  for (Expr output : outputs) result.push_back(image[output]);
  return result;
}

Expr substitute(Expr e, const Substitution& replacements) {
  return substitute(std::span(&e, 1), replacements)[0];
}

std::vector<double> evaluate(std::span<const Expr> outputs,
                             const std::unordered_map<Expr, double>& leaf_values) {
  static NodeMap<double> values;
  values.clear();
  evaluate_nodes(outputs, leaf_values, values, [](Expr) {});
  std::vector<double> result;
  for (Expr output : outputs) result.push_back(values[output]);
  return result;
}

std::optional<Expr> first_undefined(Expr e, const std::unordered_map<Expr, double>& leaf_values) {
  static NodeMap<double> values;
  values.clear();
  std::optional<Expr> culprit;
  evaluate_nodes({&e, 1}, leaf_values, values, [&](Expr node) {
    // operands come first, so theirs are finite
    if (!culprit && !std::isfinite(values[node])) culprit = node;
  });
  return culprit;
}

}  // namespace pendula
