#include "codegen/linear/straight_lu.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>

#include "codegen/linear/pivots.hpp"
#include "codegen/machine/machine.hpp"
#include "codegen/program/program_cache.hpp"
#include "codegen/program/writer.hpp"

namespace pendula::codegen {
namespace {

/// A number of the elimination, real or complex: one or two values of the program.
struct Number {
  Slot re = 0, im = 0;
};

/// Emits real operations for real or complex numbers; structural zeros cost nothing.
class Arithmetic {
 public:
  Arithmetic(Writer& writer, bool complex) : w_(writer), complex_(complex), zero_(writer.constant(0)) {}

  Number plus(Number a, Number b) { return {sum(a.re, b.re), complex_ ? sum(a.im, b.im) : zero_}; }
  Number times(Number a, Number b) {
    if (!complex_) return {product(a.re, b.re), zero_};
    const Slot re = difference(product(a.re, b.re), product(a.im, b.im));
    return {re, sum(product(a.re, b.im), product(a.im, b.re))};
  }
  /// c - a b, one product at a time, so that each may become a fused multiply-subtract.
  Number minus(Number c, Number a, Number b) {
    const Slot re = difference(c.re, product(a.re, b.re));
    if (!complex_) return {re, zero_};
    const Slot im = difference(c.im, product(a.re, b.im));
    return {sum(re, product(a.im, b.im)), difference(im, product(a.im, b.re))};
  }
  Number inverse(Number a) {
    if (a.im == zero_) return {w_.put(Op::div, w_.constant(1), a.re), zero_};
    const Slot square = sum(product(a.re, a.re), product(a.im, a.im));
    const Slot scale = w_.put(Op::div, w_.constant(1), square);
    return {product(a.re, scale), w_.put(Op::neg, product(a.im, scale))};
  }
  /// |re| + |im|
  Slot size(Number a) { return sum(absolute(a.re), absolute(a.im)); }
  Number zero() const { return {zero_, zero_}; }
  void store(std::vector<Slot>& list, Number a) const {
    list.push_back(a.re);
    if (complex_) list.push_back(a.im);
  }
  Number load(std::span<const Slot> list, std::size_t k) const {
    return complex_ ? Number{list[2 * k], list[2 * k + 1]} : Number{list[k], zero_};
  }

 private:
  Slot product(Slot a, Slot b) { return a == zero_ || b == zero_ ? zero_ : w_.put(Op::mul, a, b); }
  Slot sum(Slot a, Slot b) { return a == zero_ ? b : b == zero_ ? a : w_.put(Op::add, a, b); }
  Slot difference(Slot a, Slot b) {
    if (b == zero_) return a;
    return a == zero_ ? w_.put(Op::neg, b) : w_.put(Op::sub, a, b);
  }
  Slot absolute(Slot a) { return a == zero_ ? zero_ : w_.put(Op::abs, a); }
  Writer& w_;
  bool complex_;
  Slot zero_;
};

using Row = std::map<int, Number>;

/// A = L D U: for every row its multipliers in L, its part of U, and the reciprocal of its pivot. U is
/// divided by the pivots, so that in a solution each unknown depends on one operation instead of two.
struct Factors {
  std::vector<Number> multipliers, upper;
  std::vector<Slot> row_size;  ///< of A, in the order of the pivots: its largest entry
  Slot growth = 0;             ///< ≤ 1 if the factors are accurate; not finite if they are not
};

/// the largest multiplier accepted, for rows scaled to largest entries of 1; loses up to four digits
constexpr double largest_multiplier = 1e4;

/// The growth relative to the matrix being factorised instead of the one for which the pivots were chosen:
/// a row of γ/h changes its size by ten orders of magnitude in a run, and plans are shared by models of
/// the same pattern.
Slot write_growth(Writer& writer, Arithmetic& w, const Elimination& order, const Factors& factors) {
  std::vector<Slot> shares;
  std::size_t next = 0;
  for (std::size_t i = 0; i < order.row.size(); ++i) {
    if (order.lower[i].empty()) continue;
    std::vector<Slot> lengths;
    for (int k : order.lower[i])
      lengths.push_back(writer.put(Op::mul, w.size(factors.multipliers[next++]), factors.row_size[k]));
    const Slot allowed = writer.put(Op::mul, writer.constant(largest_multiplier), factors.row_size[i]);
    shares.push_back(writer.put(Op::div, writer.sum(lengths), allowed));
  }
  std::vector<Slot> all;
  for (Number u : factors.upper) all.push_back(w.size(u));
  shares.push_back(writer.put(Op::mul, writer.constant(0), writer.sum(all)));  // 0 · inf and 0 · NaN are NaN
  return writer.sum(shares);
}

/// Row by row (order "ikj"), so that the current row stays in registers.
Factors write_factors(Writer& writer, Arithmetic& w, const Elimination& order,
                      const std::vector<StraightLU::Position>& positions, std::span<const Slot> values) {
  const std::size_t size = order.row.size();
  std::vector<int> row_number(size), column_number(size);
  for (std::size_t k = 0; k < size; ++k) {
    row_number[order.row[k]] = static_cast<int>(k);
    column_number[order.column[k]] = static_cast<int>(k);
  }
  std::vector<Row> rows(size);
  for (std::size_t p = 0; p < positions.size(); ++p) {
    Row& row = rows[row_number[positions[p].row]];
    const int column = column_number[positions[p].column];
    Number& entry = row.try_emplace(column, w.zero()).first->second;
    entry = w.plus(entry, w.load(values, p));
  }
  Factors result;
  for (const Row& row : rows) {
    std::vector<Slot> sizes;
    for (const auto& [column, entry] : row) sizes.push_back(w.size(entry));
    result.row_size.push_back(writer.largest(sizes));
  }
  std::vector<Number> reciprocal(size);
  for (std::size_t i = 0; i < size; ++i) {
    for (int k : order.lower[i]) {
      const auto kk = static_cast<std::size_t>(k);
      const Number factor = rows[i][k] = w.times(rows[i][k], reciprocal[kk]);
      result.multipliers.push_back(factor);
      for (int j : order.upper[kk]) {
        Number& entry = rows[i].try_emplace(j, w.zero()).first->second;  // zero: fill
        entry = w.minus(entry, factor, rows[kk][j]);
      }
    }
    reciprocal[i] = w.inverse(rows[i][i]);
    for (int j : order.upper[i]) result.upper.push_back(w.times(rows[i][j], reciprocal[i]));
    result.upper.push_back(reciprocal[i]);
  }
  result.growth = write_growth(writer, w, order, result);
  return result;
}

std::vector<Slot> stored(const Arithmetic& w, const Factors& factors) {
  std::vector<Slot> results;
  for (Number m : factors.multipliers) w.store(results, m);
  for (Number u : factors.upper) w.store(results, u);
  return results;
}

std::vector<Slot> all_inputs(const Writer& w, std::size_t count) {
  std::vector<Slot> inputs;
  for (std::size_t k = 0; k < count; ++k) inputs.push_back(w.input(k));
  return inputs;
}

/// Outputs: the growth, the sizes of the rows, then for every row its multipliers, its upper part and the
/// reciprocal of its pivot.
Program factor_program(const Elimination& order, const std::vector<StraightLU::Position>& positions,
                       bool complex) {
  Writer writer(positions.size() * (complex ? 2 : 1));
  Arithmetic w(writer, complex);
  const auto values = all_inputs(writer, positions.size() * (complex ? 2 : 1));
  const Factors factors = write_factors(writer, w, order, positions, values);
  std::vector<Slot> results{factors.growth};
  results.insert(results.end(), factors.row_size.begin(), factors.row_size.end());
  const std::vector<Slot> numbers = stored(w, factors);
  results.insert(results.end(), numbers.begin(), numbers.end());
  return writer.finish(std::move(results));
}

/// x with A x = b, from the factors of factor_program.
std::vector<Slot> write_solution(Writer& writer, const Elimination& order, bool complex,
                                 std::size_t multipliers, std::span<const Slot> factors,
                                 std::span<const Slot> b) {
  const std::size_t size = order.row.size();
  Arithmetic w(writer, complex);
  std::vector<Number> y(size), x(size);
  std::size_t next = 0;
  for (std::size_t i = 0; i < size; ++i) {
    y[i] = w.load(b, static_cast<std::size_t>(order.row[i]));
    for (int k : order.lower[i]) y[i] = w.minus(y[i], w.load(factors, next++), y[k]);
  }
  std::vector<std::size_t> first(size + 1, multipliers);
  for (std::size_t i = 0; i < size; ++i) first[i + 1] = first[i] + order.upper[i].size() + 1;
  for (std::size_t i = size; i-- > 0;) {
    std::size_t at = first[i];
    y[i] = w.times(y[i], w.load(factors, at + order.upper[i].size()));
    for (int j : order.upper[i]) y[i] = w.minus(y[i], w.load(factors, at++), y[j]);
    x[order.column[i]] = y[i];
  }
  std::vector<Slot> results;
  for (Number v : x) w.store(results, v);
  return results;
}

/// Inputs: the factors of factor_program, then b.
Program solve_program(const Elimination& order, bool complex, std::size_t multipliers, std::size_t factors) {
  const std::size_t width = complex ? 2 : 1;
  Writer writer((factors + order.row.size()) * width);
  const auto inputs = all_inputs(writer, (factors + order.row.size()) * width);
  const std::span<const Slot> all(inputs);
  return writer.finish(write_solution(writer, order, complex, multipliers, all.first(factors * width),
                                      all.subspan(factors * width)));
}

/// The key of a plan, apart from numbers: the size and the positions.
Key key_of(int n, const std::vector<StraightLU::Position>& positions, bool complex) {
  Key key{static_cast<std::uint32_t>(n), complex};
  for (const auto& p : positions) {
    key.push_back(static_cast<std::uint32_t>(p.row));
    key.push_back(static_cast<std::uint32_t>(p.column));
  }
  return key;
}

struct Plans {
  std::mutex mutex;
  ProgramCache<const std::vector<StraightLU>> latest;  ///< by pattern, newest first
};
Plans& plans() {
  static Plans plans;
  return plans;
}

}  // namespace

struct StraightLU::Code {
  Elimination order;
  std::vector<Position> positions;
  std::unique_ptr<const Machine> factor, solve;
  std::size_t instructions = 0;
};

std::vector<StraightLU> StraightLU::remembered(int n, const std::vector<Position>& positions, bool complex) {
  const std::lock_guard lock(plans().mutex);
  const auto list = plans().latest.find(key_of(n, positions, complex));
  if (!list) return {};
  return *list;
}

/// Inserts a plan before the others of its pattern.
void StraightLU::remember(const StraightLU& plan) {
  const Key key = key_of(plan.n_, plan.code_->positions, plan.width_ == 2);
  std::vector<StraightLU> list{plan};
  const std::lock_guard lock(plans().mutex);
  if (const auto before = plans().latest.find(key)) list.insert(list.end(), before->begin(), before->end());
  if (list.size() > most_remembered) list.pop_back();
  const std::size_t size = list.size() * plan.instructions();
  plans().latest.add(key, std::make_shared<const std::vector<StraightLU>>(std::move(list)), size);
}

std::optional<StraightLU> StraightLU::plan(int n, const std::vector<Position>& positions,
                                           const double* values, bool complex, std::size_t longest) {
  if (!Machine::available() || n == 0) return {};
  const auto size = static_cast<std::size_t>(n);
  std::vector<std::complex<double>> dense(size * size);
  std::vector<char> entry(size * size, 0);
  for (std::size_t p = 0; p < positions.size(); ++p) {
    const std::size_t at =
        static_cast<std::size_t>(positions[p].row) * size + static_cast<std::size_t>(positions[p].column);
    dense[at] += complex ? std::complex<double>(values[2 * p], values[2 * p + 1]) : values[p];
    entry[at] = 1;
  }
  auto order = choose_pivots(n, std::move(dense), std::move(entry));
  if (!order) return {};
  StraightLU lu;
  lu.n_ = n;
  lu.width_ = complex ? 2 : 1;
  std::size_t updates = 0;
  for (std::size_t i = 0; i < size; ++i) {
    lu.multipliers_ += order->lower[i].size();
    lu.factors_ += order->lower[i].size() + order->upper[i].size() + 1;
    for (int k : order->lower[i]) updates += order->upper[k].size();
  }
  if (updates * (complex ? 8 : 2) > longest) return {};
  const Program factor = factor_program(*order, positions, complex);
  const Program solve = solve_program(*order, complex, lu.multipliers_, lu.factors_);
  const std::size_t instructions = factor.instructions.size() + solve.instructions.size();
  lu.code_ = std::make_shared<const Code>(Code{std::move(*order), positions,
                                               Machine::compile(factor, 1, Rounding::fused),
                                               Machine::compile(solve, 1, Rounding::fused), instructions});
  if (!lu.code_->factor || !lu.code_->solve) return {};
  const auto width = static_cast<std::size_t>(lu.width_);
  lu.numbers_.assign(1 + size + (lu.factors_ + size) * width, 0);
  lu.work_.assign(std::max(lu.code_->factor->workspace_size(), lu.code_->solve->workspace_size()), 0);
  remember(lu);
  return lu;
}

std::vector<Slot> StraightLU::write_factors(Writer& writer, std::span<const Slot> values, bool complex,
                                            Slot& growth) const {
  Arithmetic w(writer, complex);
  const Factors factors = codegen::write_factors(writer, w, code_->order, code_->positions, values);
  growth = factors.growth;
  return stored(w, factors);
}

std::vector<Slot> StraightLU::write_solution(Writer& writer, std::span<const Slot> factors,
                                             std::span<const Slot> b, bool complex) const {
  return codegen::write_solution(writer, code_->order, complex, multipliers_, factors, b);
}

double StraightLU::weakest_pivot() const {
  double largest = 0;
  const double* at = factors() + multipliers_ * static_cast<std::size_t>(width_);
  for (std::size_t i = 0; i < static_cast<std::size_t>(n_); ++i) {
    at += code_->order.upper[i].size() * static_cast<std::size_t>(width_);
    const double reciprocal = std::fabs(at[0]) + (width_ == 2 ? std::fabs(at[1]) : 0);
    largest = std::max(largest, reciprocal * numbers_[1 + i]);
    at += width_;
  }
  return 1 / largest;
}

std::size_t StraightLU::instructions() const { return code_->instructions; }

bool StraightLU::factorise(const double* values) {
  code_->factor->run(values, numbers_.data(), work_.data());
  return numbers_[0] <= 1;
}

void StraightLU::solve(double* b) {
  const auto count = static_cast<std::size_t>(n_ * width_);
  std::copy_n(b, count, factors() + factors_ * static_cast<std::size_t>(width_));
  code_->solve->run(factors(), b, work_.data());
}

}  // namespace pendula::codegen
