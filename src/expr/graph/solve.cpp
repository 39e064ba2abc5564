#include "expr/graph/solve.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <unordered_map>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/graph/rational.hpp"

namespace pendula {
namespace {

using Places = std::vector<std::pair<int, int>>;

/// Known properties of A.
struct Symmetry {
  bool definite = false;
  int leading = 0;
};
Symmetry symmetry_of(const LinearSystem& s) { return {s.definite, s.leading}; }

/// A matrix as a list of numbers: row, column and value of every entry, by rows.
using Key = std::vector<std::uint32_t>;

std::size_t hash_of(const Key& key) {
  std::uint64_t h = key.size();
  for (std::uint32_t word : key) {
    h = (h ^ word) * 0x9e3779b97f4a7c15ull;
    h ^= h >> 29;
  }
  return h;
}

Key key_of(std::vector<Entry> entries, bool turned) {
  if (turned)
    for (Entry& e : entries) std::swap(e.row, e.column);
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return std::pair(a.row, a.column) < std::pair(b.row, b.column);
  });
  Key key;
  for (const Entry& e : entries) {
    key.push_back(static_cast<std::uint32_t>(e.row));
    key.push_back(static_cast<std::uint32_t>(e.column));
    key.push_back(e.value.id());
  }
  return key;
}

/// Interns systems, and matrices together with their transposes.
struct Systems {
  std::deque<LinearSystem> list;
  std::deque<Key> matrices;
  std::deque<int> users;                             ///< of each matrix: number of systems
  std::deque<std::size_t> system_hash, matrix_hash;  ///< keys in these tables
  std::unordered_multimap<std::size_t, std::uint32_t> system_table, matrix_table;
  std::vector<std::uint32_t> free_systems, free_matrices;  ///< places of what was given back

  /// entries: sorted by rows.
  std::uint32_t intern(const std::vector<Entry>& entries, const VecX& b, Symmetry known) {
    const Key matrix = key_of(entries, false);
    LinearSystem s;
    s.size = static_cast<int>(b.size());
    for (const Entry& e : entries) {
      s.places.emplace_back(e.row, e.column);
      s.operands.push_back(e.value);
    }
    s.operands.insert(s.operands.end(), b.begin(), b.end());
    Key whole = matrix;
    for (Expr e : b) whole.push_back(e.id());
    const std::size_t h = hash_of(whole);
    const auto [first, last] = system_table.equal_range(h);
    for (auto it = first; it != last; ++it)
      if (list[it->second].places == s.places && list[it->second].operands == s.operands) return it->second;
    s.definite = known.definite;
    s.leading = known.leading;
    place_matrix(s, entries, matrix);
    ++users[s.matrix];
    const std::uint32_t index = place_in(list, free_systems);
    list[index] = std::move(s);
    system_table.emplace(h, index);
    system_hash.resize(list.size());
    system_hash[index] = h;
    return index;
  }

  void give_back(std::uint32_t index) {
    const std::uint32_t matrix = list[index].matrix;
    remove(system_table, system_hash[index], index);
    list[index] = {};
    free_systems.push_back(index);
    if (--users[matrix] > 0) return;
    remove(matrix_table, matrix_hash[matrix], matrix);
    matrices[matrix] = {};
    free_matrices.push_back(matrix);
  }

 private:
  /// A free place, or a new one at the end.
  template <class T>
  static std::uint32_t place_in(std::deque<T>& list, std::vector<std::uint32_t>& free) {
    if (free.empty()) {
      list.emplace_back();
      return static_cast<std::uint32_t>(list.size() - 1);
    }
    const std::uint32_t place = free.back();
    free.pop_back();
    return place;
  }

  static void remove(std::unordered_multimap<std::size_t, std::uint32_t>& table, std::size_t hash,
                     std::uint32_t number) {
    const auto [first, last] = table.equal_range(hash);
    table.erase(std::find_if(first, last, [&](const auto& entry) { return entry.second == number; }));
  }

  std::optional<std::uint32_t> find(const Key& matrix) const {
    const auto [first, last] = matrix_table.equal_range(hash_of(matrix));
    for (auto it = first; it != last; ++it)
      if (matrices[it->second] == matrix) return it->second;
    return {};
  }

  void place_matrix(LinearSystem& s, const std::vector<Entry>& entries, const Key& matrix) {
    if (const auto known = find(matrix)) {
      s.matrix = *known;
      return;
    }
    if (const auto known = find(key_of(entries, true))) {
      s.matrix = *known;
      s.transposed = true;
      return;
    }
    s.matrix = place_in(matrices, free_matrices);
    matrices[s.matrix] = matrix;
    users.resize(matrices.size());
    matrix_hash.resize(matrices.size());
    users[s.matrix] = 0;
    matrix_hash[s.matrix] = hash_of(matrix);
    matrix_table.emplace(matrix_hash[s.matrix], s.matrix);
  }
};

Systems& systems() {
  static Systems s;
  return s;
}

/// Simplifies a system before it becomes a node: removes unknowns that need no elimination.
class SystemReduction {
 public:
  /// most_exact: unknowns up to which what is left of a system of numbers is solved in fractions.
  SystemReduction(const std::vector<Entry>& A, const VecX& b, Symmetry known,
                  int most_exact = std::numeric_limits<int>::max())
      : b_(b),
        x_(b.size()),
        rows_(static_cast<std::size_t>(b.size())),
        columns_(rows_.size()),
        known_(known),
        most_exact_(most_exact) {
    for (const Entry& e : A)
      if (!e.value.is_zero()) {
        row(e.row)[e.column] = e.value;
        column(e.column).insert(e.row);
      }
    for (int i = 0; i < static_cast<int>(b.size()); ++i) {
      left_rows_.insert(i);
      left_columns_.insert(i);
      note_row(i);
      note_column(i);
    }
  }

  VecX solution() {
    while (!lone_rows_.empty() || !lone_columns_.empty())
      lone_rows_.empty() ? take_column(*lone_columns_.begin()) : take_row(*lone_rows_.begin());
    solve_rest();
    for (auto it = later_.rbegin(); it != later_.rend(); ++it) {
      Expr right = b_[it->row];
      for (const auto& [j, value] : it->others) right -= value * x_[j];
      x_[it->column] = right / it->pivot;
    }
    return x_;
  }

 private:
  struct Later {
    int row, column;
    Expr pivot;
    std::map<int, Expr> others;
  };

  std::map<int, Expr>& row(int i) { return rows_[i]; }
  std::set<int>& column(int j) { return columns_[j]; }

  [[noreturn]] static void singular(const char* what, int i) {
    throw Error(
        text("a linear system cannot be solved: ", what, " ", i + 1, " of its matrix contains only zeros"));
  }
  [[noreturn]] static void singular(const MatX& A) {
    std::vector<mpq_class> scale;
    const auto n = static_cast<int>(A.cols());
    std::string dependent;
    const VecX v = *rational::null_vector(rational::eliminate(rational::integer_rows(A, scale), n), n);
    for (Expr e : v) dependent += text(dependent.empty() ? "" : ", ", exact_value(e)->get_str());
    throw Error(text("the matrix is singular: A v = 0 for v = (", dependent, ")"));
  }
  void note_row(int i) {
    if (row(i).empty()) singular("row", i);
    if (row(i).size() == 1) lone_rows_.insert(i);
  }
  void note_column(int j) {
    if (column(j).empty()) singular("column", j);
    if (column(j).size() == 1) lone_columns_.insert(j);
  }

  /// A row a x_j = b determines x_j, which moves to the right side of the other rows.
  void take_row(int i) {
    const auto [j, pivot] = *row(i).begin();
    x_[j] = b_[i] / pivot;
    remove(i, j);
    column(j).erase(i);
    for (int k : column(j)) {
      b_[k] -= row(k).at(j) * x_[j];
      row(k).erase(j);
      note_row(k);
    }
  }

  /// If x_j occurs in row i only, the other rows are solved without it, x_j afterwards.
  void take_column(int j) {
    const int i = *column(j).begin();
    Later later{i, j, row(i).at(j), row(i)};
    later.others.erase(j);
    remove(i, j);
    for (const auto& [k, value] : later.others) {
      column(k).erase(i);
      note_column(k);
    }
    later_.push_back(std::move(later));
  }

  void remove(int i, int j) {
    left_rows_.erase(i);
    left_columns_.erase(j);
    lone_rows_.erase(i);
    lone_columns_.erase(j);
  }

  void solve_rest() {
    const auto n = static_cast<Eigen::Index>(left_rows_.size());
    if (n == 0) return;
    std::map<int, int> number;
    for (int j : left_columns_) number.emplace(j, static_cast<int>(number.size()));
    std::vector<Entry> A;
    VecX b(n);
    Eigen::Index r = 0;
    for (int i : left_rows_) {
      for (const auto& [j, value] : row(i)) A.push_back({static_cast<int>(r), number.at(j), value});
      b[r++] = b_[i];
    }
    Symmetry known = known_;
    const bool is_principal = left_rows_ == left_columns_;  // principal submatrices of A are symmetric, too
    const auto beyond = left_columns_.lower_bound(known_.leading);
    known.leading = is_principal ? static_cast<int>(std::distance(left_columns_.begin(), beyond)) : 0;
    const VecX x = solved(A, b, known);
    for (const auto& [j, k] : number) x_[j] = x[k];
  }

  VecX solved(const std::vector<Entry>& A, const VecX& b, Symmetry known) const {
    if (std::all_of(b.begin(), b.end(), [](Expr e) { return e.is_zero(); })) return VecX::Zero(b.size());
    const auto exact = [](Expr e) { return exact_value(e) != nullptr; };
    const bool numbers = b.size() <= most_exact_ && std::all_of(b.begin(), b.end(), exact) &&
                         std::all_of(A.begin(), A.end(), [&](const Entry& e) { return exact(e.value); });
    if (numbers) {
      MatX dense = MatX::Zero(b.size(), b.size());
      for (const Entry& e : A) dense(e.row, e.column) = e.value;
      if (const auto x = rational::solve(dense, b)) return x->col(0);
      singular(dense);
    }
    const Expr head = solve_node(systems().intern(A, b, known), 0, {});
    VecX x(b.size());
    for (int i = 0; i < static_cast<int>(b.size()); ++i) x[i] = component(head, i);
    return x;
  }

  VecX b_, x_;
  std::vector<std::map<int, Expr>> rows_;
  std::vector<std::set<int>> columns_;  // rows that a column occurs in
  Symmetry known_;
  int most_exact_;
  std::set<int> left_rows_, left_columns_, lone_rows_, lone_columns_;
  std::vector<Later> later_;
};

std::vector<Entry> nonzeros(const MatX& A) {
  std::vector<Entry> list;
  for (Eigen::Index i = 0; i < A.rows(); ++i)
    for (Eigen::Index j = 0; j < A.cols(); ++j)
      if (!A(i, j).is_zero()) list.push_back({static_cast<int>(i), static_cast<int>(j), A(i, j)});
  return list;
}

std::vector<Entry> matrix_of(const LinearSystem& s, bool transposed = false) {
  std::vector<Entry> A;
  for (std::size_t k = 0; k < s.entries(); ++k) {
    const auto [i, j] = s.places[k];
    A.push_back(transposed ? Entry{j, i, s.operands[k]} : Entry{i, j, s.operands[k]});
  }
  return A;
}

}  // namespace

VecX linear_solution(const std::vector<Entry>& A, const VecX& b, bool definite) {
  return SystemReduction(A, b, {definite, 0}).solution();
}

VecX saddle_solution(const std::vector<Entry>& A, const VecX& b, int leading) {
  return SystemReduction(A, b, {false, leading}).solution();
}

VecX linear_solution(const MatX& A, const VecX& b) {
  PENDULA_ASSERT(A.rows() == A.cols() && A.rows() == b.size(), "a linear system that is not square");
  return linear_solution(nonzeros(A), b);
}

void give_back_system(std::uint32_t system) { systems().give_back(system); }

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
  std::vector<Entry> A = matrix_of(s);
  VecX b(s.size), x(s.size);
  bool same = true;
  for (Entry& e : A) {
    const Expr now = image(e.value);
    same = same && now == e.value;
    e.value = now;
  }
  for (int i = 0; i < s.size; ++i) {
    b[i] = image(s.b(i));
    same = same && b[i] == s.b(i);
  }
  if (!same) return SystemReduction(A, b, symmetry_of(s)).solution();
  for (int i = 0; i < s.size; ++i) x[i] = component(head, i);
  return x;
}

VecX solution_tangent(Expr head, const std::function<Expr(Expr)>& d) {
  const LinearSystem& s = system_of(head);
  VecX right(s.size);
  for (int i = 0; i < s.size; ++i) right[i] = d(s.b(i));
  for (const Entry& e : matrix_of(s))
    if (const Expr slope = d(e.value); !slope.is_zero()) right[e.row] -= slope * component(head, e.column);
  const bool moves = std::any_of(right.begin(), right.end(), [](Expr e) { return !e.is_zero(); });
  return moves ? SystemReduction(matrix_of(s), right, symmetry_of(s)).solution() : VecX(VecX::Zero(s.size));
}

void solution_adjoint(Expr head, const VecX& adjoints, const std::function<bool(Expr)>& active,
                      const std::function<void(Expr, Expr)>& add) {
  if (std::all_of(adjoints.begin(), adjoints.end(), [](Expr e) { return e.is_zero(); })) return;
  const LinearSystem& s = system_of(head);
  // a Jacobian asks for one adjoint after another, each of n³ fractions that grow with n
  constexpr int most_exact = 60;
  const VecX lambda = SystemReduction(matrix_of(s, true), adjoints, symmetry_of(s), most_exact).solution();
  for (int i = 0; i < s.size; ++i)
    if (!lambda[i].is_zero() && active(s.b(i))) add(s.b(i), lambda[i]);
  for (const Entry& e : matrix_of(s))
    if (!lambda[e.row].is_zero() && active(e.value))
      add(e.value, -(lambda[e.row] * component(head, e.column)));
}

std::vector<double> solution_value(Expr head, const std::function<double(Expr)>& value) {
  const LinearSystem& s = system_of(head);
  // unknowns: a dense matrix of 8 KB stays in the cache, a sparse one needs an order
  constexpr int dense = 32;
  std::vector<double> numbers;
  for (Expr operand : s.operands) numbers.push_back(value(operand));
  const auto n = static_cast<std::size_t>(s.size);
  if (s.size > dense) {
    const auto x = eliminate(s, numbers, [](double a) { return std::fabs(a); });
    return x.empty() ? std::vector<double>(n, NAN) : x;
  }
  std::vector<double> A(n * n, 0), pivot(n), x(numbers.end() - s.size, numbers.end());
  for (std::size_t k = 0; k < s.entries(); ++k)
    A[s.places[k].first * n + static_cast<std::size_t>(s.places[k].second)] = numbers[k];
  lu_factor(A.data(), pivot.data(), s.size);
  lu_solve(A.data(), pivot.data(), x.data(), s.size, false);
  return x;
}

// ── numbers ────────────────────────────────────────────────────────────────────────────────────────────────

/// to -= factor · from; the ranges must not overlap.
static void subtract(double* __restrict to, const double* __restrict from, double factor, int n) {
  for (int j = 0; j < n; ++j) to[j] -= factor * from[j];
}

void lu_factor(double* a, double* pivot, int n) {
  for (int k = 0; k < n; ++k) {
    int best = k;
    for (int i = k + 1; i < n; ++i)
      if (std::fabs(a[i * n + k]) > std::fabs(a[best * n + k])) best = i;
    pivot[k] = best;
    if (best != k)
      for (int j = 0; j < n; ++j) std::swap(a[k * n + j], a[best * n + j]);
    const double inverse = a[k * n + k] = 1 / a[k * n + k];
    for (int i = k + 1; i < n; ++i) {
      const double factor = a[i * n + k] *= inverse;
      if (factor != 0) subtract(a + i * n + k + 1, a + k * n + k + 1, factor, n - k - 1);
    }
  }
}

/// In every sum the unknown computed last comes last, so that the sum need not wait for it.
void lu_solve(const double* lu, const double* pivot, double* b, int n, bool transposed) {
  if (!transposed) {
    for (int k = 0; k < n; ++k) std::swap(b[k], b[static_cast<int>(pivot[k])]);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < i; ++j) b[i] -= lu[i * n + j] * b[j];
    for (int i = n - 1; i >= 0; --i) {
      for (int j = n - 1; j > i; --j) b[i] -= lu[i * n + j] * b[j];
      b[i] *= lu[i * n + i];
    }
    return;
  }
  for (int i = 0; i < n; ++i) {  // Uᵀ y = b, Lᵀ (P x) = y
    for (int j = 0; j < i; ++j) b[i] -= lu[j * n + i] * b[j];
    b[i] *= lu[i * n + i];
  }
  for (int i = n - 1; i >= 0; --i)
    for (int j = n - 1; j > i; --j) b[i] -= lu[j * n + i] * b[j];
  for (int k = n - 1; k >= 0; --k) std::swap(b[k], b[static_cast<int>(pivot[k])]);
}

}  // namespace pendula
