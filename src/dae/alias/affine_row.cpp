#include "dae/alias/affine_row.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/limits/stack.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/node_map.hpp"

namespace pendula::dae {

UnknownNumbers::UnknownNumbers(const Model& model) {
  for (const Variable& v : model.variables) stride_ = std::max(stride_, v.order + 2);
  for (const Variable& v : model.variables)
    for (int k = 0; k < stride_; ++k) {
      const Expr leaf = derivative_leaf(v.leaf, k);
      numbers_.emplace(leaf, static_cast<int>(leaves_.size()));
      leaves_.push_back(leaf);
    }
}

std::optional<int> UnknownNumbers::of(Expr leaf) const {
  const auto it = numbers_.find(leaf);
  return it == numbers_.end() ? std::optional<int>() : it->second;
}

Expr scaled(Expr a, Expr b) {
  check_stack();
  if (a.is_one()) return b;
  if (b.is_one()) return a;
  if (a == Expr(-1)) return -b;
  if (b == Expr(-1)) return -a;
  if (a.op() == Op::neg) return -scaled(a.operand(0), b);
  if (b.op() == Op::neg) return -scaled(a, b.operand(0));
  if (b.op() == Op::div && b.operand(1) == a) return b.operand(0);
  if (a.op() == Op::div && a.operand(1) == b) return a.operand(0);
  if (a.op() == Op::div && a.operand(0).is_one()) return b / a.operand(1);
  if (b.op() == Op::div && b.operand(0).is_one()) return a / b.operand(1);
  return a * b;
}

Expr divided(Expr a, Expr b) {
  if (b.is_one()) return a;
  if (b == Expr(-1)) return -a;
  if (a == b) return 1;
  if (a.op() == Op::neg) return -divided(a.operand(0), b);
  if (a.is_constant() && !b.is_constant() && constant_value(a) < 0) return -divided(-a, b);
  if (a.op() == Op::mul && a.operand(0) == b) return a.operand(1);
  if (a.op() == Op::mul && a.operand(1) == b) return a.operand(0);
  return a / b;
}

static auto place_of(const std::vector<AffineRow::Term>& terms, int unknown) {
  return std::lower_bound(terms.begin(), terms.end(), unknown,
                          [](const AffineRow::Term& t, int u) { return t.unknown < u; });
}

const AffineRow::Term* AffineRow::find(int unknown) const {
  const auto at = place_of(terms, unknown);
  return at != terms.end() && at->unknown == unknown ? &*at : nullptr;
}

bool AffineRow::has_inside(int unknown) const {
  return std::binary_search(inside.begin(), inside.end(), unknown);
}

/// Is a sum of products 0 although it does not fold to 0? Decided at random values of its symbols.
static bool vanishes(Expr sum) {
  if (sum.is_constant()) return sum.is_zero() || std::abs(constant_value(sum)) == 0;
  if (sum.op() != Op::add && sum.op() != Op::sub) return false;
  std::unordered_map<Expr, double> values;
  for (Expr leaf : leaves({&sum, 1}))
    if (symbol_of(leaf).kind != Kind::constant)
      values[leaf] = 1 + static_cast<double>(name_hash(leaf) % 999983) / 999983;
  const Expr both[] = {sum.operand(0), sum.operand(1)};
  const std::vector<double> v = evaluate(both, values);
  const double total = sum.op() == Op::add ? v[0] + v[1] : v[0] - v[1];
  constexpr double rounding = 1e-13;  // 450 ε, at a point where no two leaves are alike
  return std::abs(total) <= rounding * (std::abs(v[0]) + std::abs(v[1]));
}

void AffineRow::add(int unknown, Expr factor) {
  const auto at = terms.begin() + (place_of(terms, unknown) - terms.begin());
  if (at == terms.end() || at->unknown != unknown) {
    if (!factor.is_zero()) terms.insert(at, {unknown, factor});
    return;
  }
  at->coefficient += factor;
  if (vanishes(at->coefficient)) terms.erase(at);
}

void AffineRow::add(const AffineRow& other, Expr factor) {
  for (const Term& t : other.terms) add(t.unknown, scaled(factor, t.coefficient));
  rest += scaled(factor, other.rest);
  for (int unknown : other.inside) put_inside(unknown);
}

void AffineRow::put_inside(int unknown) {
  const auto at = std::lower_bound(inside.begin(), inside.end(), unknown);
  if (at == inside.end() || *at != unknown) inside.insert(at, unknown);
}

void AffineRow::take_inside(int unknown) {
  const auto at = std::lower_bound(inside.begin(), inside.end(), unknown);
  if (at != inside.end() && *at == unknown) inside.erase(at);
}

namespace {

/// Knows which nodes contain unknowns and splits residuals into sums.
class RowReader {
 public:
  RowReader(std::span<const Expr> residuals, const UnknownNumbers& numbers) : numbers_(numbers) {
    for (Expr node : topological(residuals)) {
      char& here = unknown_[node];
      here = numbers_.of(node).has_value();
      if (node.is_symbol() || node.is_constant()) continue;
      for (Expr x : node.operands())
        if (unknown_[x]) unknown_[node] = 1;
    }
  }

  AffineRow read(Expr residual) {
    AffineRow row;
    std::vector<Part> todo{{residual, Expr(1)}};  // depth first: long sums nest to the left
    while (!todo.empty()) {
      const Part part = todo.back();
      todo.pop_back();
      if (!take_apart(part, todo)) keep(part, row);
    }
    return row;
  }

 private:
  struct Part {
    Expr e, factor;
  };

  bool known(Expr e) { return !unknown_[e]; }

  bool take_apart(const Part& part, std::vector<Part>& todo) {
    const auto& [e, factor] = part;
    if (known(e) || e.is_symbol()) return false;
    switch (e.op()) {
      case Op::neg:
        todo.push_back({e.operand(0), -factor});
        return true;
      case Op::add:
      case Op::sub:
        todo.push_back({e.operand(1), e.op() == Op::add ? factor : -factor});
        todo.push_back({e.operand(0), factor});
        return true;
      case Op::mul:
        for (int i : {0, 1})
          if (known(e.operand(i))) {
            todo.push_back({e.operand(1 - i), scaled(factor, e.operand(i))});
            return true;
          }
        return false;
      case Op::div:
        if (!known(e.operand(1))) return false;
        todo.push_back({e.operand(0), divided(factor, e.operand(1))});
        return true;
      default:
        return false;
    }
  }

  void keep(const Part& part, AffineRow& row) {
    if (const auto unknown = numbers_.of(part.e)) return row.add(*unknown, part.factor);
    row.rest += scaled(part.factor, part.e);
    if (known(part.e)) return;
    for (Expr leaf : leaves({&part.e, 1}))
      if (const auto unknown = numbers_.of(leaf)) row.put_inside(*unknown);
  }

  const UnknownNumbers& numbers_;
  NodeMap<char> unknown_;
};

}  // namespace

std::vector<AffineRow> affine_rows(const Model& model, const UnknownNumbers& numbers) {
  RowReader reader(model.residuals, numbers);
  std::vector<AffineRow> rows;
  rows.reserve(model.residuals.size());
  for (Expr residual : model.residuals) rows.push_back(reader.read(residual));
  return rows;
}

AffineRow affine_row(Expr residual, const UnknownNumbers& numbers) {
  return RowReader({&residual, 1}, numbers).read(residual);
}

}  // namespace pendula::dae
