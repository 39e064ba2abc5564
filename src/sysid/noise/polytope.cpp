#include "sysid/noise/polytope.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>

#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "expr/graph/graph.hpp"
#include "sysid/noise/linear_program.hpp"

namespace pendula::sysid {
namespace {

constexpr double relaxation = 1e-10;     // of the bounds: 1000 times tolerance()
constexpr Index most_vertices = 200000;  // 100 MB at d = 16, mostly their neighbours
constexpr double same_vertex = 1e-8;  // of the largest coordinates: 100 relaxations, as vertices move by more

/// A fixed hash of integers (Steele, Lea & Flood, OOPSLA 2014, SplitMix64).
std::uint64_t scramble(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15U;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9U;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBU;
  return x ^ (x >> 31);
}
double fraction(std::uint64_t x) { return static_cast<double>(scramble(x) >> 11) * 0x1p-53; }

/// A simple polytope: vertex v lies on active[v][0..d-1], and dropping active[v][i] leads to neighbour[v][i].
class DoubleDescription {
 public:
  DoubleDescription(const FeasibleSet& s, const std::vector<Index>& basis) : d_(s.Phi.cols()) {
    transform(s, basis);
    start(basis);
  }

  /// Adds constraints until none is violated; false if the set is empty.
  bool run() {
    std::vector<Candidate> candidates = first_candidates();
    while (!candidates.empty()) {
      poll_interrupt();
      const auto worst =
          std::max_element(candidates.begin(), candidates.end(),
                           [](const auto& a, const auto& b) { return a.violation < b.violation; });
      const Index constraint = worst->constraint;
      *worst = candidates.back();
      candidates.pop_back();
      if (!cut(constraint)) return false;
      refresh(candidates);
    }
    return true;
  }

  std::vector<std::vector<Index>> active_sets() const {
    std::vector<std::vector<Index>> out;
    for (std::size_t v = 0; v < alive_.size(); ++v)
      if (alive_[v]) out.push_back(active_[v]);
    return out;
  }

 private:
  struct Candidate {
    Index constraint, witness;
    double violation;
  };

  /// Constraint 2r + 1: g ξ ≤ upper_r; 2r: -g ξ ≤ -lower_r, in coordinates ξ = Φ_basis θ, g scaled to norm 1.
  void transform(const FeasibleSet& s, const std::vector<Index>& basis) {
    Mat B(d_, d_);
    for (Index i = 0; i < d_; ++i) B.row(i) = s.Phi.row(basis[i]);
    Mat rows = Mat(B.transpose()).partialPivLu().solve(Mat(s.Phi.transpose()));  // d×N
    for (Index i = 0; i < d_; ++i) rows.col(basis[i]) = Vec::Unit(d_, i);
    g_.resize(d_, 2 * s.Phi.rows());
    h_.resize(2 * s.Phi.rows());
    size_.resize(2 * s.Phi.rows());
    for (Index r = 0; r < s.Phi.rows(); ++r) {
      const double norm = rows.col(r).norm(), scale = norm > 0 ? 1 / norm : 1;
      g_.col(2 * r + 1) = rows.col(r) * scale;
      g_.col(2 * r) = -rows.col(r) * scale;
      const double size = std::max({std::abs(s.lower[r]), std::abs(s.upper[r]), s.upper[r] - s.lower[r]});
      size_[2 * r] = size_[2 * r + 1] = scale * size;
      const auto key = static_cast<std::uint64_t>(2 * r);
      h_[2 * r + 1] = scale * (s.upper[r] + relaxation * size * (1 + fraction(key + 1)));
      h_[2 * r] = scale * (-s.lower[r] + relaxation * size * (1 + fraction(key)));
    }
  }

  /// The 2^d vertices of the box given by the basis rows.
  void start(const std::vector<Index>& basis) {
    const Index corners = Index{1} << d_;
    x_.resize(d_, std::max<Index>(4 * corners, 1024));
    for (Index v = 0; v < corners; ++v) {
      std::vector<Index> on, to;
      for (Index i = 0; i < d_; ++i) {
        const bool up = (v >> i) & 1;
        const Index c = 2 * basis[i] + up;
        on.push_back(c), to.push_back(v ^ (Index{1} << i));
        x_(i, v) = g_(i, c) > 0 ? h_[c] / g_(i, c) : -h_[c] / -g_(i, c);
      }
      add(on, to);
    }
  }

  Index add(std::vector<Index> on, std::vector<Index> to) {
    active_.push_back(std::move(on));
    neighbour_.push_back(std::move(to));
    alive_.push_back(true);
    return count_++;
  }

  std::vector<Candidate> first_candidates() {
    std::vector<Candidate> out;
    const Index corners = count_;
    for (Index c = 0; c < h_.size(); ++c) {
      Index v = 0;
      for (Index i = 0; i < d_; ++i) {  // the most distant vertex
        const double low = x_(i, 0), high = x_(i, corners - 1);
        if (g_(i, c) * (high - low) > 0) v |= Index{1} << i;
      }
      const double violation = g_.col(c).dot(x_.col(v)) - h_[c];
      if (violation > tolerance(c)) out.push_back({c, v, violation});
    }
    return out;
  }

  /// 450 ε of the bound.
  double tolerance(Index c) const { return 1e-13 * std::max(least_size, size_[c]); }

  /// Candidates whose witness was removed search for another one; candidates without witness are redundant.
  void refresh(std::vector<Candidate>& candidates) {
    std::erase_if(candidates, [&](Candidate& c) {
      if (alive_[c.witness]) return false;
      if (find_witness(c, first_new_, count_)) return false;
      return !find_witness(c, 0, first_new_);
    });
    // each compaction is paid for by as many removals as it moves vertices; a few thousand cost nothing
    if (removed_count_ > count_ / 2 && count_ > 4096) compact(candidates);
  }

  bool find_witness(Candidate& c, Index from, Index to) {
    const double bound = h_[c.constraint] + tolerance(c.constraint);
    double best = bound;
    const double* const g = g_.data() + c.constraint * d_;
    for (Index block = from; block < to; block += 256) {
      for (Index v = block; v < std::min(to, block + 256); ++v) {
        const double* const x = x_.data() + v * d_;
        double value = 0;
        for (Index i = 0; i < d_; ++i) value += g[i] * x[i];
        if (value > best && alive_[v]) {
          best = value;
          c.witness = v;
        }
      }
      if (best > bound) break;
    }
    c.violation = best - h_[c.constraint];
    return best > bound;
  }

  /// Removes the vertices that violate the constraint and adds the new ones on it; false if all violate it.
  bool cut(Index c) {
    const Index before = count_;
    Vec s = (x_.leftCols(count_).transpose() * g_.col(c)).array() - h_[c];
    bool left = false;
    for (Index v = 0; v < before; ++v) left = left || (alive_[v] && s[v] <= 0);
    if (!left) return false;
    first_new_ = before;
    half_edges_.clear();
    for (Index v = 0; v < before; ++v) {
      if (!alive_[v] || s[v] <= 0) continue;
      for (Index i = 0; i < d_; ++i) {
        const Index w = neighbour_[v][i];
        if (s[w] <= 0) new_vertex(c, v, i, w, s[w] / (s[w] - s[v]));
      }
    }
    for (Index v = 0; v < before; ++v)
      if (alive_[v] && s[v] > 0) {
        alive_[v] = false;
        ++removed_count_;
      }
    return true;
  }

  /// Adds the vertex on the edge from the kept w to the removed v that drops the i-th constraint of v.
  void new_vertex(Index c, Index v, Index i, Index w, double part) {
    if (count_ - removed_count_ > most_vertices)
      throw Failure(text("the set has more than ", most_vertices, " vertices; use fewer parameters"));
    if (count_ == x_.cols()) x_.conservativeResize(Eigen::NoChange, 2 * count_);
    std::vector<Index> on = active_[v], to(static_cast<std::size_t>(d_), -1);
    on[i] = c;
    to[i] = w;
    x_.col(count_) = x_.col(w) + part * (x_.col(v) - x_.col(w));
    const Index id = add(on, to);
    auto& back = neighbour_[w];
    *std::find(back.begin(), back.end(), v) = id;
    std::uint64_t key = 0;
    for (const Index k : on) key += scramble(static_cast<std::uint64_t>(k));
    for (Index k = 0; k < d_; ++k) {
      if (k == i) continue;
      join_along_edge(key - scramble(static_cast<std::uint64_t>(on[k])), id, k);
    }
  }

  /// Joins two new vertices along the edge on which both drop one constraint and share the other d - 1. `key`
  /// is a hash of the shared set; the sets themselves are compared.
  void join_along_edge(std::uint64_t key, Index id, Index k) {
    const auto [first, last] = half_edges_.equal_range(key);
    for (auto at = first; at != last; ++at) {
      const auto [other, j] = at->second;
      if (!same_edge(id, k, other, j)) continue;
      neighbour_[id][k] = other;
      neighbour_[other][j] = id;
      return;
    }
    half_edges_.emplace(key, std::pair(id, k));
  }

  /// Do the vertices a and b lie on the same constraints, except a's k-th and b's j-th?
  bool same_edge(Index a, Index k, Index b, Index j) const {
    const std::vector<Index>&on_a = active_[a], &on_b = active_[b];
    for (Index i = 0; i < d_; ++i) {
      if (i == k) continue;
      const auto at = std::find(on_b.begin(), on_b.end(), on_a[i]);
      if (at == on_b.end() || at - on_b.begin() == j) return false;
    }
    return true;
  }

  void compact(std::vector<Candidate>& candidates) {
    std::vector<Index> moved(static_cast<std::size_t>(count_), -1);
    Index n = 0;
    for (Index v = 0; v < count_; ++v) {
      const auto from = static_cast<std::size_t>(v), to = static_cast<std::size_t>(n);
      if (!alive_[from]) continue;
      if (n != v) {
        x_.col(n) = x_.col(v);
        active_[to] = std::move(active_[from]);
        neighbour_[to] = std::move(neighbour_[from]);
      }
      moved[from] = n++;
    }
    const auto size = static_cast<std::size_t>(n);
    active_.resize(size);
    neighbour_.resize(size);
    alive_.assign(size, true);
    for (auto& list : neighbour_)
      for (Index& w : list) w = moved[w];
    for (Candidate& c : candidates) c.witness = moved[c.witness];
    count_ = n;
    removed_count_ = 0;
    first_new_ = n;
  }

  Index d_, count_ = 0, removed_count_ = 0, first_new_ = 0;
  Mat g_, x_;     ///< constraints, vertices: one per column
  Vec h_, size_;  ///< bounds, and the size of the numbers from which they were computed
  std::vector<std::vector<Index>> active_, neighbour_;
  std::vector<bool> alive_;
  std::unordered_multimap<std::uint64_t, std::pair<Index, Index>> half_edges_;
};

/// The vertex on the active rows, computed with the given bounds.
Vec solved(const FeasibleSet& s, const std::vector<Index>& active) {
  const Index d = s.Phi.cols();
  Mat B(d, d);
  Vec rhs(d);
  for (Index i = 0; i < d; ++i) {
    const Index c = active[i];
    B.row(i) = s.Phi.row(c / 2);
    rhs[i] = c % 2 ? s.upper[c / 2] : s.lower[c / 2];
  }
  return B.partialPivLu().solve(rhs);
}

std::vector<mpq_class> solved(const ExactStrips& s, const std::vector<Index>& active) {
  const std::size_t d = active.size();
  std::vector<std::vector<mpq_class>> m;
  for (const Index c : active) {
    m.push_back(s.Phi[c / 2]);
    m.back().push_back((c % 2 ? s.upper : s.lower)[c / 2]);
  }
  for (std::size_t k = 0; k < d; ++k) {
    std::size_t p = k;
    while (p < d && m[p][k] == 0) ++p;
    if (p == d) return {};
    std::swap(m[p], m[k]);
    for (std::size_t j = d + 1; j-- > k;) m[k][j] /= m[k][k];
    for (std::size_t i = 0; i < d; ++i) {
      if (i == k || m[i][k] == 0) continue;
      const mpq_class factor = m[i][k];
      for (std::size_t j = k; j <= d; ++j) m[i][j] -= factor * m[k][j];
    }
  }
  std::vector<mpq_class> x;
  for (const auto& row : m) x.push_back(row[d]);
  return x;
}

bool satisfied(const ExactStrips& s, const std::vector<mpq_class>& x) {
  for (std::size_t r = 0; r < s.Phi.size(); ++r) {
    mpq_class sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += s.Phi[r][i] * x[i];
    if (sum < s.lower[r] || sum > s.upper[r]) return false;
  }
  return true;
}

void unite(std::vector<Index>& into, const std::vector<Index>& more) {
  into.insert(into.end(), more.begin(), more.end());
  std::sort(into.begin(), into.end());
  into.erase(std::unique(into.begin(), into.end()), into.end());
}

/// Sorts the vertices and merges coinciding ones.
void collect(Polytope& p, const FeasibleSet& s, std::vector<std::vector<Index>> sets) {
  std::vector<std::pair<Vec, std::vector<Index>>> all;
  for (auto& set : sets) {
    std::sort(set.begin(), set.end());
    all.emplace_back(solved(s, set), set);
  }
  Vec size = Vec::Zero(s.Phi.cols());
  for (const auto& [x, set] : all) size = size.cwiseMax(x.cwiseAbs());
  const auto near = [&](const Vec& a, const Vec& b) {
    return ((a - b).cwiseAbs().array() <= same_vertex * size.array()).all();
  };
  const auto less = [&](const auto& a, const auto& b) {
    for (Index i = 0; i < a.first.size(); ++i)
      if (std::abs(a.first[i] - b.first[i]) > same_vertex * size[i]) return a.first[i] < b.first[i];
    return a.second < b.second;
  };
  std::sort(all.begin(), all.end(), less);
  std::vector<Vec> kept;
  for (const auto& [x, set] : all) {
    if (!kept.empty() && near(kept.back(), x)) {
      unite(p.active.back(), set);
      continue;
    }
    kept.push_back(x);
    p.active.push_back(set);
  }
  p.vertices.resize(static_cast<Index>(kept.size()), s.Phi.cols());
  for (std::size_t i = 0; i < kept.size(); ++i) p.vertices.row(static_cast<Index>(i)) = kept[i].transpose();
}

/// The same for a set in other units.
void collect_scaled(Polytope& p, const FeasibleSet& s, std::vector<std::vector<Index>> sets,
                    const Vec& unit) {
  collect(p, s, std::move(sets));
  p.vertices = (p.vertices * unit.cwiseInverse().asDiagonal()).eval();
}

void collect_exact(Polytope& p, const ExactStrips& s, const std::vector<std::vector<Index>>& sets) {
  std::vector<std::pair<std::vector<mpq_class>, std::vector<Index>>> all;
  for (const auto& set : sets) {
    std::vector<mpq_class> x = solved(s, set);
    if (!x.empty() && satisfied(s, x)) all.emplace_back(std::move(x), set);
  }
  std::sort(all.begin(), all.end());
  for (const auto& [x, set] : all) {
    if (p.exact.empty() || p.exact.back() != x) {
      p.exact.push_back(x);
      p.active.emplace_back();
    }
    unite(p.active.back(), set);
  }
  p.vertices.resize(static_cast<Index>(p.exact.size()),
                    s.Phi.empty() ? 0 : static_cast<Index>(s.Phi[0].size()));
  for (Index i = 0; i < p.vertices.rows(); ++i)
    for (Index j = 0; j < p.vertices.cols(); ++j) p.vertices(i, j) = p.exact[i][j].get_d();
}

/// Sorts the vertices of a polygon counter-clockwise, beginning with the first.
void turn(Polytope& p) {
  if (p.vertices.cols() != 2 || p.vertices.rows() < 3) return;
  const Eigen::RowVectorXd middle = p.vertices.colwise().mean();
  std::vector<Index> order(static_cast<std::size_t>(p.vertices.rows()));
  const auto angle = [&](Index i) {
    const double pi = std::acos(-1.0);
    const auto at = [&](Index k) {
      return std::atan2(p.vertices(k, 1) - middle[1], p.vertices(k, 0) - middle[0]);
    };
    const double a = at(i) - at(0);
    return i == 0 ? -1 : a < 0 ? a + 2 * pi : a;
  };
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<Index>(i);
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return angle(a) < angle(b); });
  const Polytope old = p;
  for (std::size_t i = 0; i < order.size(); ++i) {
    p.vertices.row(static_cast<Index>(i)) = old.vertices.row(order[i]);
    p.active[i] = old.active[order[i]];
    if (!p.exact.empty()) p.exact[i] = old.exact[order[i]];
  }
}

}  // namespace

std::optional<ExactStrips> exact_strips(const Mat& Phi, const Vec& y, double low, double high) {
  const auto from = simplest_rational(low), to = simplest_rational(high);
  // a choice: rational elimination for each vertex, whose number grows like rows^(d/2)
  constexpr Index most_rows = 500, most_parameters = 6;
  if (Phi.rows() > most_rows || Phi.cols() > most_parameters || !from || !to) return {};
  ExactStrips out;
  for (Index r = 0; r < Phi.rows(); ++r) {
    std::vector<mpq_class> row;
    for (Index j = 0; j <= Phi.cols(); ++j) {
      const auto q = simplest_rational(j < Phi.cols() ? Phi(r, j) : y[r]);
      if (!q) return {};
      row.push_back(*q);
    }
    out.lower.push_back(row.back() - *to);
    out.upper.push_back(row.back() - *from);
    row.pop_back();
    out.Phi.push_back(std::move(row));
  }
  return out;
}

Polytope polytope(const FeasibleSet& given, const std::optional<ExactStrips>& exact) {
  const Index d = given.Phi.cols();
  Polytope p;
  // units in which the columns of Φ have norm 1: rank and structure do not depend on the units of the data
  const Vec unit = given.Phi.colwise().norm().unaryExpr([](double v) { return v > 0 ? v : 1; });
  const FeasibleSet s{given.Phi * unit.cwiseInverse().asDiagonal(), given.lower, given.upper};
  for (Index r = 0; r < s.Phi.rows(); ++r)
    if (s.lower[r] > s.upper[r] || (s.Phi.row(r).isZero(0) && (s.lower[r] > 0 || s.upper[r] < 0))) return p;
  const Eigen::ColPivHouseholderQR<Mat> qr(s.Phi.transpose());
  if (qr.rank() < d) throw Error("the set is unbounded: the regressor has deficient rank");
  // the search begins with a box of 2ᵈ vertices: 65536
  if (d > 16) throw Failure("vertices of a set with more than 16 parameters are too many; use mod.box");
  std::vector<Index> basis;
  for (Index i = 0; i < d; ++i) basis.push_back(qr.colsPermutation().indices()[i]);
  DoubleDescription description(s, basis);
  if (!description.run()) return p;
  const std::vector<std::vector<Index>> sets = description.active_sets();
  constexpr Index most_rational_tests = 200000;  // vertices × rows, each a sum of rational products
  if (exact && static_cast<Index>(sets.size()) * s.Phi.rows() <= most_rational_tests)
    collect_exact(p, *exact, sets);
  else
    collect_scaled(p, s, sets, unit);
  turn(p);
  return p;
}

}  // namespace pendula::sysid
