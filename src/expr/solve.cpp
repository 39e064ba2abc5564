#include "expr/solve.hpp"

#include <cmath>
#include <deque>
#include <unordered_map>

#include "base/error.hpp"
#include "expr/linalg.hpp"

namespace pendula {
namespace {

std::size_t hash_of(std::span<const Expr> list) {
  std::uint64_t h = list.size();
  for (Expr e : list) {
    h = (h ^ e.id()) * 0x9e3779b97f4a7c15ull;
    h ^= h >> 29;
  }
  return h;
}

/// All systems so far, each once, and all matrices so far, each once together with its transpose.
struct Systems {
  std::deque<LinearSystem> list;
  std::deque<std::vector<Expr>> matrices;  // row by row
  std::unordered_multimap<std::size_t, std::uint32_t> system_table, matrix_table;

  std::uint32_t intern(std::vector<Expr> operands, int n) {
    const std::size_t h = hash_of(operands);
    const auto [first, last] = system_table.equal_range(h);
    for (auto it = first; it != last; ++it)
      if (list[it->second].operands == operands) return it->second;
    LinearSystem s;
    s.size = n;
    place_matrix(s, std::span(operands).first(static_cast<std::size_t>(n) * n));
    s.operands = std::move(operands);
    list.push_back(std::move(s));
    const auto index = static_cast<std::uint32_t>(list.size() - 1);
    system_table.emplace(h, index);
    return index;
  }

 private:
  std::optional<std::uint32_t> find(std::span<const Expr> matrix) const {
    const auto [first, last] = matrix_table.equal_range(hash_of(matrix));
    for (auto it = first; it != last; ++it)
      if (std::equal(matrix.begin(), matrix.end(), matrices[it->second].begin(), matrices[it->second].end()))
        return it->second;
    return {};
  }

  void place_matrix(LinearSystem& s, std::span<const Expr> matrix) {
    if (const auto known = find(matrix)) {
      s.matrix = *known;
      return;
    }
    std::vector<Expr> turned;
    for (int i = 0; i < s.size; ++i)
      for (int j = 0; j < s.size; ++j) turned.push_back(matrix[static_cast<std::size_t>(j * s.size + i)]);
    if (const auto known = find(turned)) {
      s.matrix = *known, s.transposed = true;
      return;
    }
    matrices.emplace_back(matrix.begin(), matrix.end());
    s.matrix = static_cast<std::uint32_t>(matrices.size() - 1);
    matrix_table.emplace(hash_of(matrix), s.matrix);
  }
};

Systems& systems() {
  static Systems s;
  return s;
}

/// A system on its way to a node: takes out unknowns that need no elimination.
class Peeling {
 public:
  Peeling(const MatX& A, const VecX& b) : A_(A), b_(b), x_(b.size()) {
    for (Eigen::Index i = 0; i < b.size(); ++i) rows_.push_back(i), columns_.push_back(i);
  }

  VecX solution() {
    while (lone_in_row() || lone_in_column()) {
    }
    solve_rest();
    for (auto it = later_.rbegin(); it != later_.rend(); ++it) {
      Expr right = b_[it->row];
      for (Eigen::Index j : it->others)
        if (!A_(it->row, j).is_zero()) right -= A_(it->row, j) * x_[j];
      x_[it->column] = right / A_(it->row, it->column);
    }
    return x_;
  }

 private:
  struct Later {
    Eigen::Index row, column;
    std::vector<Eigen::Index> others;
  };

  [[noreturn]] static void singular(const char* what, Eigen::Index i) {
    throw Error(
        text("a linear system cannot be solved: ", what, " ", i + 1, " of its matrix contains only zeros"));
  }

  /// a x_j = b: x_j is known, and moves to the right side of the other rows.
  bool lone_in_row() {
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      const Eigen::Index i = rows_[r];
      Eigen::Index only = -1;
      int count = 0;
      for (Eigen::Index j : columns_)
        if (!A_(i, j).is_zero()) only = j, ++count;
      if (count == 0) singular("row", i);
      if (count > 1) continue;
      x_[only] = b_[i] / A_(i, only);
      remove(i, only);
      for (Eigen::Index k : rows_)
        if (!A_(k, only).is_zero()) b_[k] -= A_(k, only) * x_[only];
      return true;
    }
    return false;
  }

  /// x_j occurs in row i only: the others are solved without it, x_j afterwards.
  bool lone_in_column() {
    for (std::size_t c = 0; c < columns_.size(); ++c) {
      const Eigen::Index j = columns_[c];
      Eigen::Index only = -1;
      int count = 0;
      for (Eigen::Index i : rows_)
        if (!A_(i, j).is_zero()) only = i, ++count;
      if (count == 0) singular("column", j);
      if (count > 1) continue;
      remove(only, j);
      later_.push_back({only, j, columns_});
      return true;
    }
    return false;
  }

  void remove(Eigen::Index row, Eigen::Index column) {
    std::erase(rows_, row);
    std::erase(columns_, column);
  }

  void solve_rest() {
    const auto n = static_cast<int>(rows_.size());
    if (n == 0) return;
    MatX A(n, n);
    VecX b(n);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) A(i, j) = A_(rows_[i], columns_[j]);
      b[i] = b_[rows_[i]];
    }
    const bool numbers = linalg::is_rational(A) && linalg::is_rational(b);
    const VecX x = numbers ? VecX(linalg::solve(A, MatX(b)).col(0)) : nodes(A, b);
    for (int j = 0; j < n; ++j) x_[columns_[j]] = x[j];
  }

  static VecX nodes(const MatX& A, const VecX& b) {
    const bool zero = std::all_of(b.begin(), b.end(), [](Expr e) { return e.is_zero(); });
    if (zero) return VecX::Zero(b.size());
    const auto n = static_cast<int>(b.size());
    std::vector<Expr> operands;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) operands.push_back(A(i, j));
    operands.insert(operands.end(), b.begin(), b.end());
    const std::uint32_t system = systems().intern(std::move(operands), n);
    const Expr head = solve_node(system, 0, {});
    VecX x(n);
    for (int i = 0; i < n; ++i) x[i] = component(head, i);
    return x;
  }

  const MatX& A_;
  VecX b_, x_;
  std::vector<Eigen::Index> rows_, columns_;
  std::vector<Later> later_;
};

}  // namespace

VecX linear_solution(const MatX& A, const VecX& b) {
  PENDULA_ASSERT(A.rows() == A.cols() && A.rows() == b.size(), "a linear system that is not square");
  return Peeling(A, b).solution();
}

std::span<const Expr> solve_operands(std::uint32_t system) { return systems().list[system].operands; }

const LinearSystem& system_of(Expr e) { return systems().list[solve_index(e).system]; }
int component_of(Expr e) { return static_cast<int>(solve_index(e).component); }
Expr head_of(Expr e) { return component_of(e) == 0 ? e : e.operand(0); }

Expr component(Expr head, int i) {
  const SolveIndex index = solve_index(head);
  PENDULA_ASSERT(index.component == 0 && i < systems().list[index.system].size, "not a component");
  return i == 0 ? head : solve_node(index.system, static_cast<std::uint32_t>(i), head);
}

VecX mapped_solution(Expr head, const std::function<Expr(Expr)>& image) {
  const LinearSystem& s = system_of(head);
  MatX A(s.size, s.size);
  VecX b(s.size), x(s.size);
  bool same = true;
  for (int i = 0; i < s.size; ++i) {
    for (int j = 0; j < s.size; ++j) A(i, j) = image(s.a(i, j)), same = same && A(i, j) == s.a(i, j);
    b[i] = image(s.b(i)), same = same && b[i] == s.b(i);
  }
  if (!same) return linear_solution(A, b);
  for (int i = 0; i < s.size; ++i) x[i] = component(head, i);
  return x;
}

static MatX matrix_of(const LinearSystem& s) {
  MatX A(s.size, s.size);
  for (int i = 0; i < s.size; ++i)
    for (int j = 0; j < s.size; ++j) A(i, j) = s.a(i, j);
  return A;
}

VecX solution_tangent(Expr head, const std::function<Expr(Expr)>& d) {
  const LinearSystem& s = system_of(head);
  VecX right(s.size);
  bool moves = false;
  for (int i = 0; i < s.size; ++i) {
    right[i] = d(s.b(i));
    for (int j = 0; j < s.size; ++j)
      if (const Expr slope = d(s.a(i, j)); !slope.is_zero()) right[i] -= slope * component(head, j);
    moves = moves || !right[i].is_zero();
  }
  return moves ? linear_solution(matrix_of(s), right) : VecX(VecX::Zero(s.size));
}

void solution_adjoint(Expr head, const VecX& adjoints, const std::function<bool(Expr)>& active,
                      const std::function<void(Expr, Expr)>& add) {
  if (std::all_of(adjoints.begin(), adjoints.end(), [](Expr e) { return e.is_zero(); })) return;
  const LinearSystem& s = system_of(head);
  const VecX lambda = linear_solution(matrix_of(s).transpose(), adjoints);
  for (int i = 0; i < s.size; ++i) {
    if (lambda[i].is_zero()) continue;
    if (active(s.b(i))) add(s.b(i), lambda[i]);
    for (int j = 0; j < s.size; ++j)
      if (active(s.a(i, j))) add(s.a(i, j), -(lambda[i] * component(head, j)));
  }
}

std::vector<double> solution_value(Expr head, const std::function<double(Expr)>& value) {
  const LinearSystem& s = system_of(head);
  const auto n = static_cast<std::size_t>(s.size);
  std::vector<double> numbers, pivot(n);
  for (Expr operand : s.operands) numbers.push_back(value(operand));
  lu_factor(numbers.data(), pivot.data(), s.size);
  lu_solve(numbers.data(), pivot.data(), numbers.data() + n * n, s.size, false);
  return {numbers.end() - s.size, numbers.end()};
}

// ── numbers
// ──────────────────────────────────────────────────────────────────────────────────────────────────────

void lu_factor(double* a, double* pivot, int n) {
  for (int k = 0; k < n; ++k) {
    int best = k;
    for (int i = k + 1; i < n; ++i)
      if (std::fabs(a[i * n + k]) > std::fabs(a[best * n + k])) best = i;
    pivot[k] = best;
    if (best != k)
      for (int j = 0; j < n; ++j) std::swap(a[k * n + j], a[best * n + j]);
    const double inverse = 1 / a[k * n + k];
    for (int i = k + 1; i < n; ++i) {
      const double factor = a[i * n + k] *= inverse;
      if (factor != 0)
        for (int j = k + 1; j < n; ++j) a[i * n + j] -= factor * a[k * n + j];
    }
  }
}

void lu_solve(const double* lu, const double* pivot, double* b, int n, bool transposed) {
  if (!transposed) {
    for (int k = 0; k < n; ++k) std::swap(b[k], b[static_cast<int>(pivot[k])]);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < i; ++j) b[i] -= lu[i * n + j] * b[j];
    for (int i = n - 1; i >= 0; --i) {
      for (int j = i + 1; j < n; ++j) b[i] -= lu[i * n + j] * b[j];
      b[i] /= lu[i * n + i];
    }
    return;
  }
  for (int i = 0; i < n; ++i) {  // Uᵀ y = b, Lᵀ (P x) = y
    for (int j = 0; j < i; ++j) b[i] -= lu[j * n + i] * b[j];
    b[i] /= lu[i * n + i];
  }
  for (int i = n - 1; i >= 0; --i)
    for (int j = i + 1; j < n; ++j) b[i] -= lu[j * n + i] * b[j];
  for (int k = n - 1; k >= 0; --k) std::swap(b[k], b[static_cast<int>(pivot[k])]);
}

}  // namespace pendula
