#include "integrate/solve/linear_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>

#include <klu.h>

#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "codegen/program/program_cache.hpp"
#include "integrate/solve/column_scale.hpp"

namespace pendula::integrate {
namespace {

// Factorisations after which code is generated (bench/linear.cpp): as many as would have saved the cost of
// the code, so that the total is at most twice the optimum. Up to 60 unknowns that cost is a millisecond or
// less and the code is cached, so it is generated at once. Above, pivots and code of Newton iterations, real
// and complex, cost 9 ms (80 unknowns, three diagonals) … 60 ms (400 unknowns, or grids), and save 5 … 20 µs
// per factorisation with its solutions.
constexpr int dense_always = 60;
long factorisations_before_code(int n) {
  return n <= dense_always ? 12 : std::min(static_cast<long>(n) * n / 4, 1500L);
}

/// The number of operations up to which code beats vectorised dense elimination, α n³ + β n² (in units of
/// 0.25 ns, the time of one operation of code).
std::size_t largest_useful_code(int n, bool complex) {
  constexpr std::size_t most = 80'000;  // larger code does not fit into the caches
  constexpr int tiny = 10;
  if (n <= tiny) return most;
  const double cube = static_cast<double>(n) * n * n, square = static_cast<double>(n) * n;
  const double dense = complex ? 1.3 * cube + 8 * square : 0.52 * cube + 5.4 * square;
  return std::min(most, static_cast<std::size_t>(dense));
}

bool is_full(int n, const std::vector<Position>& positions, double share, int most) {
  if (n > most || static_cast<double>(positions.size()) < share * n * n) return false;
  std::vector<char> seen(static_cast<std::size_t>(n) * static_cast<std::size_t>(n), 0);
  for (const Position& p : positions) seen[p.row * n + p.column] = 1;
  return static_cast<double>(std::count(seen.begin(), seen.end(), 1)) >= share * n * n;
}

template <class Scalar>
constexpr bool is_complex = std::is_same_v<Scalar, std::complex<double>>;

double size_of_entry(double a) { return std::fabs(a); }
double size_of_entry(std::complex<double> a) { return std::fabs(a.real()) + std::fabs(a.imag()); }

// CAUTION: the operators of std::complex check every product for infinities; these do not.
double times(double a, double b) { return a * b; }
std::complex<double> times(std::complex<double> a, std::complex<double> b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}
double inverse(double a) { return 1 / a; }
std::complex<double> inverse(std::complex<double> a) {
  const double square = a.real() * a.real() + a.imag() * a.imag();
  return {a.real() / square, -a.imag() / square};
}

/// row[j] -= factor · other[j]
void subtract_row(double* row, double factor, const double* other, int count) {
  for (int j = 0; j < count; ++j) row[j] -= factor * other[j];
}
void subtract_row(std::complex<double>* row, std::complex<double> factor, const std::complex<double>* other,
                  int count) {
  const double re = factor.real(), im = factor.imag();
  auto* to = reinterpret_cast<double*>(row);
  const auto* from = reinterpret_cast<const double*>(other);
  for (int j = 0; j < 2 * count; j += 2) {
    to[j] -= re * from[j] - im * from[j + 1];
    to[j + 1] -= re * from[j + 1] + im * from[j];
  }
}

/// Counts the factorisations of one pattern over all runs: fits and sweeps solve the same system repeatedly.
using Use = PatternUse;
std::shared_ptr<Use> use_of(int n, const std::vector<Position>& positions, bool complex) {
  codegen::Key key{static_cast<std::uint32_t>(n), complex};
  for (const Position& p : positions) {
    key.push_back(static_cast<std::uint32_t>(p.row));
    key.push_back(static_cast<std::uint32_t>(p.column));
  }
  static std::mutex mutex;
  static codegen::ProgramCache<Use> uses;
  const std::lock_guard lock(mutex);
  if (auto known = uses.find(key)) return known;
  auto made = std::make_shared<Use>();
  uses.add(key, made, 1);
  return made;
}

// KLU's functions for real and complex matrices under common names.
klu_numeric* klu_start(double* ax, int* ap, int* ai, klu_symbolic* s, klu_common* c) {
  return klu_factor(ap, ai, ax, s, c);
}
klu_numeric* klu_start(std::complex<double>* ax, int* ap, int* ai, klu_symbolic* s, klu_common* c) {
  return klu_z_factor(ap, ai, reinterpret_cast<double*>(ax), s, c);
}
bool klu_again(double* ax, int* ap, int* ai, klu_symbolic* s, klu_numeric* f, klu_common* c) {
  return klu_refactor(ap, ai, ax, s, f, c) && klu_rgrowth(ap, ai, ax, s, f, c);
}
bool klu_again(std::complex<double>* ax, int* ap, int* ai, klu_symbolic* s, klu_numeric* f, klu_common* c) {
  auto* a = reinterpret_cast<double*>(ax);
  return klu_z_refactor(ap, ai, a, s, f, c) && klu_z_rgrowth(ap, ai, a, s, f, c);
}
bool klu_condition(klu_symbolic* s, klu_numeric* f, klu_common* c, double) { return klu_rcond(s, f, c); }
bool klu_condition(klu_symbolic* s, klu_numeric* f, klu_common* c, std::complex<double>) {
  return klu_z_rcond(s, f, c);
}
void klu_end(klu_numeric** f, klu_common* c, double) { klu_free_numeric(f, c); }
void klu_end(klu_numeric** f, klu_common* c, std::complex<double>) { klu_z_free_numeric(f, c); }
void klu_apply(klu_symbolic* s, klu_numeric* f, int n, double* b, klu_common* c) {
  klu_solve(s, f, n, 1, b, c);
}
void klu_apply(klu_symbolic* s, klu_numeric* f, int n, std::complex<double>* b, klu_common* c) {
  klu_z_solve(s, f, n, 1, reinterpret_cast<double*>(b), c);
}

}  // namespace

/// Compressed columns and the objects of KLU.
template <class Scalar>
struct LinearSolver<Scalar>::Sparse {
  std::vector<int> column_start, row;
  std::vector<int> target;  ///< of every position: the index to which its value is added
  std::vector<Scalar> values;
  klu_common common{};
  klu_symbolic* symbolic = nullptr;
  klu_numeric* numeric = nullptr;

  Sparse(int n, const std::vector<Position>& positions) {
    std::vector<std::size_t> order(positions.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      const Position &p = positions[a], &q = positions[b];
      return p.column != q.column ? p.column < q.column : p.row < q.row;
    });
    column_start.assign(static_cast<std::size_t>(n) + 1, 0);
    target.resize(positions.size());
    Position last{-1, -1};
    for (std::size_t k : order) {
      const Position p = positions[k];
      if (p.row != last.row || p.column != last.column) {
        row.push_back(p.row);
        ++column_start[p.column + 1];
        last = p;
      }
      target[k] = static_cast<int>(row.size()) - 1;
    }
    std::partial_sum(column_start.begin(), column_start.end(), column_start.begin());
    values.resize(row.size());
    klu_defaults(&common);
    symbolic = klu_analyze(n, column_start.data(), row.data(), &common);
  }
  Sparse(const Sparse&) = delete;
  Sparse& operator=(const Sparse&) = delete;
  ~Sparse() {
    if (numeric) klu_end(&numeric, &common, Scalar());
    if (symbolic) klu_free_symbolic(&symbolic, &common);
  }

  bool fresh(int* ap, int* ai) {
    if (numeric) klu_end(&numeric, &common, Scalar());
    numeric = klu_start(values.data(), ap, ai, symbolic, &common);
    return numeric && common.status == KLU_OK && klu_condition(symbolic, numeric, &common, Scalar()) &&
           common.rcond > 0;
  }

  bool factorise(const std::vector<Position>& positions, const Scalar* given) {
    if (!symbolic) return false;  // structurally singular
    std::fill(values.begin(), values.end(), Scalar(0));
    for (std::size_t k = 0; k < positions.size(); ++k) values[target[k]] += given[k];
    for (const Scalar& v : values)
      if (!std::isfinite(size_of_entry(v))) return false;
    int *ap = column_start.data(), *ai = row.data();
    constexpr double harmless_growth = 1e-6;  // KLU's reciprocal pivot growth: six digits lost
    if (numeric && klu_again(values.data(), ap, ai, symbolic, numeric, &common) && common.status == KLU_OK &&
        common.rgrowth > harmless_growth)
      return true;
    return fresh(ap, ai);
  }
};

/// -1 for an odd permutation.
static int parity(const int* order, int n) {
  std::vector<char> seen(static_cast<std::size_t>(n), 0);
  int sign = 1;
  for (int i = 0; i < n; ++i)
    for (int k = i, length = 0; !seen[k]; k = order[k], ++length) {
      seen[k] = 1;
      if (length > 0) sign = -sign;
    }
  return sign;
}

template <class Scalar>
int LinearSolver<Scalar>::determinant(double& log) const {
  log = 0;
  if constexpr (is_complex<Scalar>) {
    return 0;
  } else {
    if (use_straight_) return 0;
    const auto in_units = [&](int sign) {
      for (double c : column_scale_) log -= std::log(c);
      return sign;
    };
    if (band_) {
      const int sign = band_->determinant(log);
      return in_units(sign);
    }
    int sign = 1;
    const auto take = [&](double pivot) {
      if (pivot < 0) sign = -sign;
      log += std::log(std::fabs(pivot));
    };
    if (!sparse_) {
      for (int k = 0; k < n_; ++k) {
        take(1 / lu_[k * n_ + k]);
        if (pivot_[k] != k) sign = -sign;
      }
      return in_units(sign);
    }
    if (!sparse_->numeric) return 0;
    const auto* diagonal = static_cast<const double*>(sparse_->numeric->Udiag);
    const auto* scale = static_cast<const double*>(sparse_->numeric->Rs);
    for (int k = 0; k < n_; ++k) {
      take(diagonal[k]);
      if (scale) log += std::log(scale[k]);
    }
    return sign * parity(sparse_->numeric->Pnum, n_) * parity(sparse_->symbolic->Q, n_);
  }
}

template <class Scalar>
LinearSolver<Scalar>::LinearSolver() = default;
template <class Scalar>
LinearSolver<Scalar>::~LinearSolver() = default;
template <class Scalar>
LinearSolver<Scalar>::LinearSolver(LinearSolver&&) noexcept = default;
template <class Scalar>
LinearSolver<Scalar>& LinearSolver<Scalar>::operator=(LinearSolver&&) noexcept = default;

template <class Scalar>
void LinearSolver<Scalar>::analyse(int n, const std::vector<Position>& positions,
                                   Factorisation factorisation) {
  n_ = n;
  straight_limit_ = factorisation == Factorisation::chosen     ? straight_limit
                    : factorisation == Factorisation::straight ? n
                                                               : 0;
  positions_ = positions;
  std::vector<codegen::StraightLU::Position> known;
  for (const Position& p : positions_) known.push_back({p.row, p.column});
  straight_.clear();
  use_ = nullptr;
  if (n <= straight_limit_) {
    straight_ = codegen::StraightLU::remembered(n, known, is_complex<Scalar>);
    use_ = factorisation == Factorisation::straight ? std::make_shared<PatternUse>()
                                                    : use_of(n, positions_, is_complex<Scalar>);
  }
  count_ = plans_ = 0;
  next_plan_ = 0;
  first_plan_ = factorisation == Factorisation::straight ? 0 : factorisations_before_code(n);
  use_straight_ = false;
  const bool dense = n <= dense_limit || is_full(n, positions_, full, full_limit);
  sparse_ = nullptr;
  band_ = nullptr;
  if (factorisation == Factorisation::band || (factorisation == Factorisation::chosen && !dense)) {
    if (auto order = BandOrder::find(n, positions_))
      band_ = std::make_unique<BandLU<Scalar>>(positions_, std::move(order));
    if (band_) return;
  }
  if (factorisation == Factorisation::sparse || (factorisation != Factorisation::dense && !dense)) {
    sparse_ = std::make_unique<Sparse>(n, positions_);
    return;
  }
  const auto size = static_cast<std::size_t>(n);
  lu_.assign(size * size, Scalar(0));
  row_scale_.assign(size, 1);
  pivot_.assign(size, 0);
}

/// Existing code is used from the first matrix on; it is generated once the pattern has
/// been factorised often.
template <class Scalar>
bool LinearSolver<Scalar>::factorise_straight(const Scalar* values) {
  constexpr int most_plans = 4;
  const auto* numbers = reinterpret_cast<const double*>(values);
  if (!use_) return false;
  const long count = ++use_->count;
  for (auto plan = straight_.begin(); plan != straight_.end(); ++plan) {
    if (!plan->factorise(numbers)) continue;
    std::rotate(straight_.begin(), plan, plan + 1);
    return true;
  }
  ++count_;
  const bool wanted =
      plans_ == 0 ? count >= std::max(first_plan_, use_->next_plan.load()) : count_ >= next_plan_;
  if (!wanted || plans_ == most_plans) return false;
  return plan(values) && straight_.front().factorise(numbers);
}

template <class Scalar>
bool LinearSolver<Scalar>::plan(const Scalar* values) {
  std::vector<codegen::StraightLU::Position> positions;
  for (const Position& p : positions_) positions.push_back({p.row, p.column});
  auto plan = codegen::StraightLU::plan(n_, positions, reinterpret_cast<const double*>(values),
                                        is_complex<Scalar>, largest_useful_code(n_, is_complex<Scalar>));
  next_plan_ = std::max(2 * count_, factorisations_before_code(n_));
  ++plans_;
  if (!plan && use_) use_->next_plan = 10 * use_->count + 1000;  // too long; not tried again soon
  if (!plan) return false;
  straight_.insert(straight_.begin(), std::move(*plan));
  if (straight_.size() > codegen::StraightLU::most_remembered) straight_.pop_back();
  return true;
}

template <class Scalar>
void LinearSolver<Scalar>::prepare(const Scalar* values) {
  if (straight_.empty() && n_ <= dense_always) plan(values);
}

template <class Scalar>
bool LinearSolver<Scalar>::factorise(const Scalar* values) {
  column_scale_.clear();
  use_straight_ = factorise_straight(values);
  if (use_straight_) return true;
  if (sparse_) return sparse_->factorise(positions_, values);
  return factorise_by_rows(values) || factorise_by_columns(values);
}

template <class Scalar>
bool LinearSolver<Scalar>::factorise_by_rows(const Scalar* values) {
  return band_ ? band_->factorise(values) : factorise_dense(values);
}

/// Further attempts with scaled columns. A pivot that is lost relative to its row may be due to the unit of
/// an unknown, as for multipliers of constraints between lengths in nanometres, or to products of units.
template <class Scalar>
bool LinearSolver<Scalar>::factorise_by_columns(const Scalar* values) {
  std::vector<double> sizes(positions_.size());
  std::transform(values, values + sizes.size(), sizes.begin(), [](Scalar v) { return size_of_entry(v); });
  for (const auto scale : {&pendula::integrate::column_scale, &balanced_column_scale}) {
    std::vector<double> column = scale(n_, positions_, sizes);
    if (column.empty()) continue;
    std::vector<Scalar> scaled(values, values + positions_.size());
    for (std::size_t k = 0; k < scaled.size(); ++k) scaled[k] *= column[positions_[k].column];
    if (!factorise_by_rows(scaled.data())) continue;
    column_scale_ = std::move(column);
    return true;
  }
  return false;
}

/// P A = L U by rows with scaled pivoting. A pivot at the rounding level of its row means "singular".
template <class Scalar>
bool LinearSolver<Scalar>::factorise_dense(const Scalar* values) {
  const int n = n_;
  Scalar* a = lu_.data();
  weakest_ = 1;
  std::fill(lu_.begin(), lu_.end(), Scalar(0));
  for (const Position& p : positions_) a[p.row * n + p.column] += *values++;
  for (int i = 0; i < n; ++i) {
    double largest = 0;
    for (int j = 0; j < n; ++j) {
      const double size = size_of_entry(a[i * n + j]);
      if (!(size <= std::numeric_limits<double>::max())) return false;
      largest = std::max(largest, size);
    }
    if (largest == 0) return false;
    row_scale_[i] = 1 / largest;
  }
  for (int k = 0; k < n; ++k) {
    int best = k;
    double best_size = 0;
    for (int i = k; i < n; ++i) {
      const double size = size_of_entry(a[i * n + k]) * row_scale_[i];
      if (size > best_size) {
        best_size = size;
        best = i;
      }
    }
    weakest_ = std::min(weakest_, best_size);
    if (best_size <= n * eps * eps) return false;
    pivot_[k] = best;
    if (best != k) {
      std::swap_ranges(a + k * n, a + k * n + n, a + best * n);
      std::swap(row_scale_[k], row_scale_[best]);
    }
    const Scalar reciprocal = inverse(a[k * n + k]);
    a[k * n + k] = reciprocal;  // the diagonal stores 1/uₖₖ
    for (int i = k + 1; i < n; ++i) {
      Scalar& factor = a[i * n + k];
      if (factor == Scalar(0)) continue;
      factor = times(factor, reciprocal);
      subtract_row(a + i * n + k + 1, factor, a + k * n + k + 1, n - k - 1);
    }
  }
  return true;
}

template <class Scalar>
void LinearSolver<Scalar>::solve(Scalar* b) {
  if (use_straight_) return straight_.front().solve(reinterpret_cast<double*>(b));
  if (sparse_) return klu_apply(sparse_->symbolic, sparse_->numeric, n_, b, &sparse_->common);
  if (band_)
    band_->solve(b);
  else
    solve_dense(b);
  for (std::size_t j = 0; j < column_scale_.size(); ++j) b[j] *= column_scale_[j];
}

template <class Scalar>
void LinearSolver<Scalar>::solve_dense(Scalar* b) const {
  const int n = n_;
  const Scalar* a = lu_.data();
  for (int k = 0; k < n; ++k) std::swap(b[k], b[pivot_[k]]);
  for (int i = 1; i < n; ++i) {
    Scalar sum = b[i];
    for (int j = 0; j < i; ++j) sum -= times(a[i * n + j], b[j]);
    b[i] = sum;
  }
  for (int i = n - 1; i >= 0; --i) {
    Scalar sum = b[i];
    for (int j = i + 1; j < n; ++j) sum -= times(a[i * n + j], b[j]);
    b[i] = times(sum, a[i * n + i]);
  }
}

template <class Scalar>
double LinearSolver<Scalar>::weakest_pivot() const {
  if (use_straight_) return straight_.front().weakest_pivot();
  if (band_) return band_->weakest_pivot();
  return sparse_ ? sparse_->common.rcond : weakest_;
}

template class LinearSolver<double>;
template class LinearSolver<std::complex<double>>;

}  // namespace pendula::integrate
