// Expr graph -> program.
#include "codegen/program/program.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <optional>
#include <unordered_map>

#include "base/error.hpp"
#include "codegen/program/checked.hpp"
#include "codegen/program/symmetric.hpp"
#include "expr/graph/node_map.hpp"
#include "expr/graph/solve.hpp"
#include "expr/rewrite/scaled_exponentials.hpp"

namespace pendula::codegen {
namespace {

/// 2n of powers xⁿ that become products and a square root, 0 for others: |n| ≤ 16 and 2n is an integer. This
/// avoids a call of libm, and x² is rounded once.
long half_exponent(Expr node) {
  const mpq_class* n = node.op() == Op::pow ? exact_value(node.operand(1)) : nullptr;
  return n && n->get_den() <= 2 && abs(*n) <= 16 ? mpq_class(*n * 2).get_num().get_si() : 0;
}

/// The difference u in u², u⁻⁴, |u|, whose value is bitwise the same for -u. Not in cos u, which is computed
/// together with sin u.
std::optional<Expr> even_difference(Expr node) {
  const auto x = node.operands();
  const long twice = half_exponent(node);
  const bool even =
      node.op() == Op::abs || (node.op() == Op::mul && x[0] == x[1]) || (twice != 0 && twice % 4 == 0);
  return even && x[0].op() == Op::sub ? std::optional(x[0]) : std::nullopt;
}

class Lowering {
 public:
  Program program;

  Lowering(std::span<const Expr> outputs, std::span<const Expr> inputs, bool checked) : checked_(checked) {
    program.inputs = inputs.size();
    for (Expr input : inputs) values_[input] = count_++;
    const std::vector<Expr> order = topological(outputs);
    for (Expr node : order)
      if (!values_.has(node)) add_leaf(node);
    constant(1.0);  // for negative powers
    for (Expr node : order)
      if (node.op() == Op::solve && !zero_) {
        zero_ = constant(0.0);  // of sparse matrices
        if (checked_) smallest_ = constant(smallest_pivot);
      }
    find_mirrored(order);
    for (Expr node : order)
      if (!values_.has(node)) {
        const Slot value = lower(node);
        values_[node] = value;
      }
    for (Expr output : outputs) program.results.push_back(values_[output]);
    if (sound_) program.results.push_back(*sound_);
  }

 private:
  void add_leaf(Expr node) {
    if (node.is_constant()) {
      const Slot value = constant(constant_value(node));
      values_[node] = value;
    } else if (node.is_symbol()) {
      const Symbol& s = symbol_of(node);
      if (s.kind != Kind::constant)
        throw Error(text("'", s.name, std::string(s.order, '\''), "' has no value here"));
      const Slot value = constant(constant_value(*s.value));
      values_[node] = value;
    } else if (node.op() == Op::call) {
      throw Error(text("'", call_of(node).name,
                       "' is an unspecified function and has no values; substitute it with subs"));
    }
  }

  Slot constant(double value) {
    if (value == 1.0 && one_) return one_;
    program.constants.push_back(value);
    if (value == 1.0) one_ = count_;
    return count_++;
  }

  Slot emit(const Instruction& instruction) {
    program.instructions.push_back(instruction);
    return count_++;
  }
  Slot emit(Op op, Slot a, Slot b = 0, Slot c = 0) {
    if (mirrored_.empty()) return emit({.op = op, .operand = {a, b, c}});
    const auto [known, made] =
        emitted_.try_emplace(std::array<Slot, 4>{static_cast<Slot>(op), a, b, c}, count_);
    return made ? emit({.op = op, .operand = {a, b, c}}) : known->second;
  }

  /// Distances between bodies are written with xᵢ - xⱼ in the equation of one body and with xⱼ - xᵢ in
  /// that of the other. mirrored_ selects one of them for all squares, so that common subexpressions
  /// are computed once.
  void find_mirrored(const std::vector<Expr>& order) {
    std::map<std::pair<Slot, Slot>, Expr> first;
    for (Expr node : order) {
      const auto u = even_difference(node);
      if (!u) continue;
      const Slot a = u->operand(0).id(), b = u->operand(1).id();
      const Expr chosen = first.try_emplace(std::minmax(a, b), *u).first->second;
      if (chosen != *u) mirrored_[*u] = chosen;
    }
  }

  Slot lower_solution(Expr node) {
    if (const int k = component_of(node)) {
      const Expr head = head_of(node);
      const auto known = solutions_.find(head);
      if (known != solutions_.end()) return known->second[k];
      return emit(
          {.op = Op::solve, .part = Part::component, .operand = {values_[head], static_cast<Slot>(k), 0}});
    }
    const LinearSystem& s = system_of(node);
    if (s.definite) return lower_definite(node, s);
    if (checked_ && s.leading > 0)
      if (const SymmetricFactor* factor = saddle_factor(s))
        return (solutions_[node] = solve_saddle(*factor, entries_of(s), right_side(s), put_))[0];
    return lower_dense(s);
  }

  std::vector<SymmetricEntry> entries_of(const LinearSystem& s) {
    std::vector<SymmetricEntry> entries;
    for (std::size_t k = 0; k < s.entries(); ++k)
      entries.push_back({s.places[k].first, s.places[k].second, values_[s.operands[k]]});
    return entries;
  }

  /// The symmetric factorisation of [M Cᵀ; C D]; null if pivoting is preferable.
  const SymmetricFactor* saddle_factor(const LinearSystem& s) {
    const auto [at, made] = saddles_.try_emplace(s.matrix);
    if (made) at->second = factor_saddle(s.size, s.leading, entries_of(s), put_);
    if (!at->second) return nullptr;
    if (made) {
      const Slot sound = is_sound(*at->second, zero_, smallest_, put_);
      sound_ = sound_ ? emit(Op::mul, *sound_, sound) : sound;
    }
    return &*at->second;
  }

  std::vector<Slot> right_side(const LinearSystem& s) {
    std::vector<Slot> b;
    for (int i = 0; i < s.size; ++i) b.push_back(values_[s.b(i)]);
    return b;
  }

  Slot lower_definite(Expr head, const LinearSystem& s) {
    if (const auto band = band_of(s)) return lower_band(head, s, **band);
    const auto [factor, made] = symmetric_.try_emplace(s.matrix);
    if (made) factor->second = factor_symmetric(s.size, entries_of(s), put_);
    return (solutions_[head] = solve_symmetric(factor->second, right_side(s), put_))[0];
  }

  /// The order of unknowns for which the matrix has few diagonals, if there is one.
  const std::optional<BandOrder>* band_of(const LinearSystem& s) {
    const auto [at, made] = bands_.try_emplace(s.matrix);
    if (made) at->second = band_order(s.size, s.places);
    return at->second ? &at->second : nullptr;
  }

  Slot lower_band(Expr head, const LinearSystem& s, const BandOrder& band) {
    const auto n = static_cast<std::size_t>(s.size);
    const auto [factor, made] = factors_.try_emplace(s.matrix, 0);
    if (made) {
      const auto first = static_cast<Slot>(program.extra.size());
      program.extra.resize(first + n * static_cast<std::size_t>(band.width + 1), zero_);
      for (std::size_t k = 0; k < s.entries(); ++k) {
        const auto i = static_cast<std::size_t>(band.step[s.places[k].first]),
                   j = static_cast<std::size_t>(band.step[s.places[k].second]);
        program.extra[first + (std::max(i, j) - std::min(i, j)) * n + std::max(i, j)] =
            values_[s.operands[k]];
      }
      factor->second = emit(
          {.op = Op::solve, .part = Part::factor, .size = s.size, .band = band.width, .first_extra = first});
    }
    const auto first = static_cast<Slot>(program.extra.size());
    program.extra.resize(first + n);
    for (std::size_t i = 0; i < n; ++i)
      program.extra[first + static_cast<std::size_t>(band.step[i])] = values_[s.b(static_cast<int>(i))];
    const Slot solve = emit({.op = Op::solve,
                             .part = Part::solve,
                             .operand = {factor->second, 0, 0},
                             .size = s.size,
                             .band = band.width,
                             .first_extra = first});
    std::vector<Slot> components(n, solve);
    for (Slot k = 1; k < n; ++k)
      components[k] = emit({.op = Op::solve, .part = Part::component, .operand = {solve, k, 0}});
    std::vector<Slot>& x = solutions_[head];
    for (std::size_t i = 0; i < n; ++i) x.push_back(components[band.step[i]]);
    return x[0];
  }

  Slot lower_dense(const LinearSystem& s) {
    const auto [factor, made] = factors_.try_emplace(s.matrix, 0);
    if (made) {
      const Slot first = begin_matrix(s);
      factor->second = emit({.op = Op::solve, .part = Part::factor, .size = s.size, .first_extra = first});
    }
    const auto first = static_cast<Slot>(program.extra.size());
    for (int i = 0; i < s.size; ++i) program.extra.push_back(values_[s.b(i)]);
    return emit({.op = Op::solve,
                 .part = Part::solve,
                 .transposed = s.transposed,
                 .operand = {factor->second, 0, 0},
                 .size = s.size,
                 .first_extra = first});
  }

  /// Stores the matrix row by row with zeros, when the first system with this matrix occurs.
  Slot begin_matrix(const LinearSystem& s) {
    const auto first = static_cast<Slot>(program.extra.size());
    const auto n = static_cast<std::size_t>(s.size);
    program.extra.resize(program.extra.size() + n * n, zero_);
    for (std::size_t k = 0; k < s.entries(); ++k) {
      auto [i, j] = s.places[k];
      if (s.transposed) std::swap(i, j);
      program.extra[first + static_cast<std::size_t>(i) * n + static_cast<std::size_t>(j)] =
          values_[s.operands[k]];
    }
    return first;
  }

  Slot lower(Expr node) {
    if (node.op() == Op::solve) return lower_solution(node);
    const auto x = node.operands();
    Slot a = values_[x[0]];
    if (!mirrored_.empty() && even_difference(node)) {
      if (const auto other = mirrored_.find(x[0]); other != mirrored_.end()) a = values_[other->second];
      if (node.op() == Op::mul) return emit(Op::mul, a, a);
    }
    if (const long twice = half_exponent(node)) return half_power(a, twice);
    if (node.op() == Op::sqrt) return root(a);
    return emit(node.op(), a, x.size() > 1 ? values_[x[1]] : 0, x.size() > 2 ? values_[x[2]] : 0);
  }

  Slot root(Slot base) {
    const auto [known, made] = roots_.try_emplace(base, 0);
    if (made) known->second = emit(Op::sqrt, base);
    return known->second;
  }

  Slot half_power(Slot base, long twice) {
    if (twice % 2 == 0) return power(base, twice / 2);
    const long whole = std::labs(twice) / 2;
    Slot positive = root(base);
    if (whole > 0) {
      const Slot products = power(base, whole);
      positive = emit(Op::mul, positive, products);
    }
    return twice > 0 ? positive : emit(Op::div, one_, positive);
  }

  Slot power(Slot base, long n) {
    if (n < 0) {
      const Slot positive = power(base, -n);
      return emit(Op::div, one_, positive);
    }
    if (n == 1) return base;
    const Slot half = power(base, n / 2), square = emit(Op::mul, half, half);
    return n % 2 ? emit(Op::mul, square, base) : square;
  }

  const Emit put_ = [this](Op op, Slot a, Slot b) { return op == Op::constant ? one_ : emit(op, a, b); };
  NodeMap<Slot> values_;
  std::unordered_map<Expr, Expr> mirrored_;
  std::map<std::array<Slot, 4>, Slot> emitted_;  // operation and operands, by mirrored differences
  std::unordered_map<Slot, Slot> roots_;
  std::unordered_map<std::uint32_t, Slot> factors_;  // by the number of the matrix
  std::unordered_map<std::uint32_t, SymmetricFactor> symmetric_;
  std::unordered_map<std::uint32_t, std::optional<SymmetricFactor>> saddles_;
  std::unordered_map<std::uint32_t, std::optional<BandOrder>> bands_;
  std::unordered_map<Expr, std::vector<Slot>> solutions_;  // by head; not for dense systems
  bool checked_;                                           // lower_checked()
  std::optional<Slot> sound_;                              // whether all saddle-point systems are
  Slot count_ = 0, one_ = 0, zero_ = 0, smallest_ = 0;
};

}  // namespace

Program lower(std::span<const Expr> outputs, std::span<const Expr> inputs) {
  return std::move(Lowering(with_scaled_exponentials(outputs), inputs, false).program);
}

Program lower_checked(std::span<const Expr> outputs, std::span<const Expr> inputs) {
  return std::move(Lowering(with_scaled_exponentials(outputs), inputs, true).program);
}

}  // namespace pendula::codegen
