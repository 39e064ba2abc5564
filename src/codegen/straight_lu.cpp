#include "codegen/straight_lu.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>

#include "codegen/memory.hpp"
#include "codegen/pivots.hpp"

namespace pendula::codegen {
namespace {

/// A number of the elimination: one value of the program, or two.
struct Number {
  Slot re = 0, im = 0;
};

/// Writes a program of real operations, on real or complex numbers.
class Writer {
 public:
  Writer(bool complex, std::size_t inputs) : complex_(complex) {
    program.inputs = inputs;
    program.constants = {1.0};
    count_ = program.first_instruction();
  }
  Program program;

  Number input(std::size_t position) const {
    const auto p = static_cast<Slot>(position);
    return complex_ ? Number{2 * p, 2 * p + 1} : Number{p, p};
  }
  Number plus(Number a, Number b) { return each(Op::add, a, b); }
  Number minus(Number a, Number b) { return each(Op::sub, a, b); }
  Number times(Number a, Number b) {
    if (!complex_) return real(put(Op::mul, a.re, b.re));
    const Slot rr = put(Op::mul, a.re, b.re), ii = put(Op::mul, a.im, b.im);
    const Slot re = put(Op::sub, rr, ii);
    const Slot ri = put(Op::mul, a.re, b.im), ir = put(Op::mul, a.im, b.re);
    return {re, put(Op::add, ri, ir)};
  }
  Number negative(Number a) {
    const Slot re = put(Op::neg, a.re);
    return {re, complex_ ? put(Op::neg, a.im) : re};
  }
  Number inverse(Number a) {
    if (!complex_) return real(put(Op::div, one(), a.re));
    const Slot rr = put(Op::mul, a.re, a.re), ii = put(Op::mul, a.im, a.im);
    const Slot square = put(Op::add, rr, ii);
    const Slot scale = put(Op::div, one(), square);
    const Slot re = put(Op::mul, a.re, scale), im = put(Op::mul, a.im, scale);
    return {re, put(Op::neg, im)};
  }
  void result(Number a) {
    program.results.push_back(a.re);
    if (complex_) program.results.push_back(a.im);
  }

 private:
  static Number real(Slot value) { return {value, value}; }
  Slot one() const { return static_cast<Slot>(program.inputs); }
  Number each(Op op, Number a, Number b) {
    const Slot re = put(op, a.re, b.re);
    return {re, complex_ ? put(op, a.im, b.im) : re};
  }
  Slot put(Op op, Slot a, Slot b = 0) {
    program.instructions.push_back({.op = op, .operand = {a, b, 0}});
    return count_++;
  }
  bool complex_;
  Slot count_;
};

using Row = std::map<int, Number>;

/// Row after row (the order "ikj"), so that the row at work stays in registers. Results: the multipliers of
/// every row, then its upper part and the reciprocal of its pivot.
Program factor_program(const Elimination& order, int n, const std::vector<StraightLU::Position>& positions,
                       bool complex) {
  Writer w(complex, positions.size() * (complex ? 2 : 1));
  const auto size = static_cast<std::size_t>(n);
  std::vector<int> row_number(size), column_number(size);
  for (std::size_t k = 0; k < size; ++k) {
    row_number[static_cast<std::size_t>(order.row[k])] = static_cast<int>(k);
    column_number[static_cast<std::size_t>(order.column[k])] = static_cast<int>(k);
  }
  std::vector<Row> rows(size);
  for (std::size_t p = 0; p < positions.size(); ++p) {
    Row& row = rows[static_cast<std::size_t>(row_number[static_cast<std::size_t>(positions[p].row)])];
    const int column = column_number[static_cast<std::size_t>(positions[p].column)];
    const auto [entry, made] = row.try_emplace(column, w.input(p));
    if (!made) entry->second = w.plus(entry->second, w.input(p));
  }
  std::vector<Number> reciprocal(size), multipliers, upper;
  for (std::size_t i = 0; i < size; ++i) {
    for (int k : order.lower[i]) {
      const auto kk = static_cast<std::size_t>(k);
      const Number factor = rows[i][k] = w.times(rows[i][k], reciprocal[kk]);
      multipliers.push_back(factor);
      for (int j : order.upper[kk]) {
        const Number product = w.times(factor, rows[kk][j]);
        const auto old = rows[i].find(j);
        if (old != rows[i].end())
          old->second = w.minus(old->second, product);
        else
          rows[i][j] = w.negative(product);  // fill
      }
    }
    reciprocal[i] = w.inverse(rows[i][static_cast<int>(i)]);
    for (int j : order.upper[i]) upper.push_back(rows[i][j]);
    upper.push_back(reciprocal[i]);
  }
  for (Number m : multipliers) w.result(m);
  for (Number u : upper) w.result(u);
  return std::move(w.program);
}

/// Inputs: the results of factor_program, then b.
Program solve_program(const Elimination& order, int n, bool complex, std::size_t multipliers,
                      std::size_t factors) {
  const auto size = static_cast<std::size_t>(n);
  Writer w(complex, (factors + size) * (complex ? 2 : 1));
  std::vector<Number> y(size), x(size);
  std::size_t next = 0;
  for (std::size_t i = 0; i < size; ++i) {
    y[i] = w.input(factors + static_cast<std::size_t>(order.row[i]));
    for (int k : order.lower[i])
      y[i] = w.minus(y[i], w.times(w.input(next++), y[static_cast<std::size_t>(k)]));
  }
  std::vector<std::size_t> first(size + 1, multipliers);
  for (std::size_t i = 0; i < size; ++i) first[i + 1] = first[i] + order.upper[i].size() + 1;
  for (std::size_t i = size; i-- > 0;) {
    std::size_t at = first[i];
    for (int j : order.upper[i]) y[i] = w.minus(y[i], w.times(w.input(at++), y[static_cast<std::size_t>(j)]));
    y[i] = w.times(y[i], w.input(at));
    x[static_cast<std::size_t>(order.column[i])] = y[i];
  }
  for (Number v : x) w.result(v);
  return std::move(w.program);
}

/// What the code depends on: sizes, positions and pivots.
std::vector<std::uint32_t> key_of(const Elimination& order, int n,
                                  const std::vector<StraightLU::Position>& positions, bool complex) {
  std::vector<std::uint32_t> key{static_cast<std::uint32_t>(n), complex};
  for (int k : order.row) key.push_back(static_cast<std::uint32_t>(k));
  for (int k : order.column) key.push_back(static_cast<std::uint32_t>(k));
  for (const auto& p : positions)
    key.push_back(static_cast<std::uint32_t>(p.row)), key.push_back(static_cast<std::uint32_t>(p.column));
  return key;
}

}  // namespace

struct StraightLU::Code {
  std::unique_ptr<const Machine> factor, solve;
  std::size_t instructions = 0;
};

std::optional<StraightLU> StraightLU::plan(int n, const std::vector<Position>& positions,
                                           const double* values, bool complex, std::size_t longest) {
  return make(n, positions, values, complex, longest);
}

std::optional<StraightLU> StraightLU::remembered(int n, const std::vector<Position>& positions,
                                                 const double* values, bool complex) {
  return make(n, positions, values, complex, 0);
}

std::optional<StraightLU> StraightLU::make(int n, const std::vector<Position>& positions,
                                           const double* values, bool complex, std::size_t longest) {
  static Memory<const Code> memory;
  static std::mutex mutex;
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
  const auto order = choose_pivots(n, std::move(dense), std::move(entry));
  if (!order) return {};
  StraightLU lu;
  lu.n_ = n, lu.width_ = complex ? 2 : 1;
  std::size_t updates = 0;
  for (std::size_t i = 0; i < size; ++i) {
    lu.multipliers_ += order->lower[i].size();
    lu.factors_ += order->lower[i].size() + order->upper[i].size() + 1;
    for (int k : order->lower[i]) {
      updates += order->upper[static_cast<std::size_t>(k)].size();
      // Rows are scaled in the mind only: |l| is compared with what scaled rows would allow.
      lu.limits_.push_back(1e4 * order->row_scale[static_cast<std::size_t>(k)] / order->row_scale[i]);
    }
  }
  std::size_t at = lu.multipliers_;
  for (std::size_t i = 0; i < size; ++i, ++at)
    lu.pivots_.push_back({at += order->upper[i].size(), order->row_scale[i]});
  const std::vector<std::uint32_t> key = key_of(*order, n, positions, complex);
  {
    const std::lock_guard lock(mutex);
    lu.code_ = memory.find(key);
    if (!lu.code_) {
      if (updates * (complex ? 8 : 2) + 1 > longest) return {};
      const Program factor = factor_program(*order, n, positions, complex);
      const Program solve = solve_program(*order, n, complex, lu.multipliers_, lu.factors_);
      const std::size_t instructions = factor.instructions.size() + solve.instructions.size();
      lu.code_ =
          std::make_shared<const Code>(Code{Machine::compile(factor), Machine::compile(solve), instructions});
      if (!lu.code_->factor || !lu.code_->solve) return {};
      memory.add(key, lu.code_, instructions);
    }
  }
  const auto width = static_cast<std::size_t>(lu.width_);
  lu.numbers_.assign((lu.factors_ + size) * width, 0);
  lu.work_.assign(std::max(lu.code_->factor->workspace_size(), lu.code_->solve->workspace_size()), 0);
  return lu;
}

double StraightLU::weakest_pivot() const {
  double largest = 0;
  for (const Pivot& p : pivots_) {
    const double* r = numbers_.data() + p.at * static_cast<std::size_t>(width_);
    largest = std::max(largest, (std::fabs(r[0]) + (width_ == 2 ? std::fabs(r[1]) : 0)) / p.scale);
  }
  return 1 / largest;
}

std::size_t StraightLU::instructions() const { return code_->instructions; }

bool StraightLU::factorise(const double* values) {
  code_->factor->run(values, numbers_.data(), work_.data());
  const double* l = numbers_.data();
  bool fine = true;
  if (width_ == 1) {
    for (std::size_t k = 0; k < multipliers_; ++k) fine = fine && std::fabs(l[k]) <= limits_[k];
  } else {
    for (std::size_t k = 0; k < multipliers_; ++k)
      fine = fine && std::fabs(l[2 * k]) + std::fabs(l[2 * k + 1]) <= limits_[k];
  }
  double check = 0;  // 0 · inf and 0 · NaN are NaN
  const std::size_t end = factors_ * static_cast<std::size_t>(width_);
  for (std::size_t k = multipliers_ * static_cast<std::size_t>(width_); k < end; ++k)
    check += numbers_[k] * 0;
  return fine && check == 0;
}

void StraightLU::solve(double* b) {
  const std::size_t count = static_cast<std::size_t>(n_ * width_);
  std::copy_n(b, count,
              numbers_.begin() + static_cast<std::ptrdiff_t>(factors_ * static_cast<std::size_t>(width_)));
  code_->solve->run(numbers_.data(), b, work_.data());
}

}  // namespace pendula::codegen
