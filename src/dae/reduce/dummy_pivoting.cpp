// Which derivatives become dummies: independent columns of the constraint Jacobian, stage by stage.
//
// The rows of a stage fall into components that share no column. A small one is decomposed by QR with column
// pivoting; a large one by sparse elimination, row after row of least length, with the largest entry of the
// row as pivot: its columns are the choice.
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <unordered_set>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/model/model_key.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/points/array_points.hpp"
#include "dae/rank/rank.hpp"
#include "dae/rank/rank_with_gap.hpp"
#include "dae/reduce/reduced_forms.hpp"
#include "expr/graph/declaration.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;
using Sparse = Eigen::SparseMatrix<double>;
using Row = std::vector<std::pair<Index, double>>;  ///< column, value

constexpr std::size_t dense_up_to = 40;  // rows of a component

/// Rows that share columns, and these columns, ascending.
struct Component {
  std::vector<Row> rows;
  std::vector<Index> columns;
};

std::vector<Component> components(const std::vector<Row>& rows) {
  std::vector<std::size_t> leader(rows.size());
  std::iota(leader.begin(), leader.end(), 0);
  const auto find = [&](std::size_t i) {
    while (leader[i] != i) i = leader[i] = leader[leader[i]];
    return i;
  };
  std::map<Index, std::size_t> first;
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (const auto& [j, v] : rows[i]) {
      const auto [it, made] = first.emplace(j, i);
      if (!made) leader[find(i)] = find(it->second);
    }
  std::map<std::size_t, Component> parts;
  for (std::size_t i = 0; i < rows.size(); ++i) parts[find(i)].rows.push_back(rows[i]);
  std::vector<Component> list;
  for (auto& [who, part] : parts) {
    std::set<Index> columns;
    for (const Row& row : part.rows)
      for (const auto& [j, v] : row) columns.insert(j);
    part.columns.assign(columns.begin(), columns.end());
    list.push_back(std::move(part));
  }
  return list;
}

/// The rows restricted to these columns (ascending), which are renumbered.
Sparse matrix(const std::vector<Row>& rows, const std::vector<Index>& columns) {
  std::vector<Eigen::Triplet<double>> list;
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (const auto& [j, v] : rows[i]) {
      const auto at = std::lower_bound(columns.begin(), columns.end(), j);
      if (at != columns.end() && *at == j)
        list.emplace_back(static_cast<int>(i), static_cast<int>(at - columns.begin()), v);
    }
  Sparse A(static_cast<Index>(rows.size()), static_cast<Index>(columns.size()));
  A.setFromTriplets(list.begin(), list.end());
  return A;
}

/// σ_min: exactly for small matrices, else by inverse iteration with A Aᵀ (a few digits).
double least_singular_value(const Sparse& A) {
  if (A.rows() == 0) return 1;
  if (A.cols() < A.rows()) return 0;
  if (A.rows() <= static_cast<Index>(dense_up_to)) {
    const Vec s = Eigen::JacobiSVD<Mat>(Mat(A)).singularValues();
    return s[A.rows() - 1];
  }
  const Eigen::SimplicialLLT<Sparse> factors(Sparse(A * A.transpose()));
  if (factors.info() != Eigen::Success) return 0;
  Vec x(A.rows());
  for (Index i = 0; i < x.size(); ++i) x[i] = 1 + 0.5 * std::sin(static_cast<double>(i));
  double growth = 0;
  for (int k = 0; k < 8; ++k) {
    x /= x.norm();
    x = factors.solve(x);
    growth = x.norm();
  }
  return std::isfinite(growth) && growth > 0 ? 1 / std::sqrt(growth) : 0;
}

/// Columns in which the rows are regular; fewer than rows if these are dependent.
std::vector<Index> independent_columns(const Component& part) {
  constexpr double rounding = 1e-12;  // of the first pivot: 4500 ε
  if (part.columns.empty()) return {};
  if (part.rows.size() <= dense_up_to) {
    const Mat G = matrix(part.rows, part.columns);
    Eigen::ColPivHouseholderQR<Mat> qr(G);
    if (qr.rank() < G.rows())  // x″ behind x′ = v has no unit of its own, and takes that of x′
      if (const Eigen::ColPivHouseholderQR<Mat> other(balance(G)(G)); other.rank() > qr.rank()) qr = other;
    std::vector<Index> chosen;
    for (Index k = 0; k < std::min<Index>(qr.rank(), G.rows()); ++k)
      chosen.push_back(part.columns[qr.colsPermutation().indices()[k]]);
    return chosen;
  }
  std::vector<std::map<Index, double>> rows;
  std::map<Index, std::set<std::size_t>> users;
  std::set<std::pair<std::size_t, std::size_t>> queue;  // length, row
  for (const Row& row : part.rows) {
    for (const auto& [j, v] : row) users[j].insert(rows.size());
    queue.insert({row.size(), rows.size()});
    rows.emplace_back(row.begin(), row.end());
  }
  std::vector<Index> chosen;
  while (!queue.empty()) {
    poll_interrupt();
    const std::size_t p = queue.begin()->second;
    queue.erase(queue.begin());
    const auto& pivot = rows[p];
    const auto largest = std::max_element(pivot.begin(), pivot.end(), [](const auto& a, const auto& b) {
      return std::fabs(a.second) < std::fabs(b.second);
    });
    if (largest == pivot.end() || std::fabs(largest->second) <= rounding) continue;
    const auto [column, strength] = *largest;
    chosen.push_back(column);
    for (const auto& [j, v] : pivot) users[j].erase(p);
    for (std::size_t i : users[column]) {
      queue.erase({rows[i].size(), i});
      const double factor = rows[i].at(column) / strength;
      rows[i].erase(column);
      for (const auto& [j, v] : pivot) {
        if (j == column) continue;
        double& entry = rows[i][j];
        entry -= factor * v;
        if (std::fabs(entry) <= rounding * std::fabs(factor * v)) {
          rows[i].erase(j);
          users[j].erase(i);
        } else
          users[j].insert(i);
      }
      queue.insert({rows[i].size(), i});
    }
    users[column].clear();
  }
  return chosen;
}

/// The minimum over the components of σ_min of the chosen columns relative to that of all columns.
double quality_of(const std::vector<Component>& parts, const std::vector<char>& is_chosen) {
  double worst = 1;
  for (const Component& part : parts) {
    std::vector<Index> own;
    for (Index j : part.columns)
      if (is_chosen[j]) own.push_back(j);
    if (own.size() != part.rows.size()) return 0;
    const double possible = least_singular_value(matrix(part.rows, part.columns));
    if (!(possible > 0)) return 0;
    worst = std::min(worst, least_singular_value(matrix(part.rows, own)) / possible);
  }
  return worst;
}

/// The sizes of the variables and of their derivatives up to those orders, from the equations and one time
/// that relates all of them: alone, b′ = v has no size where v is in no other equation, beside a′ = w of 10⁶.
std::unordered_map<Expr, double> sizes_with_one_time(const Model& model, std::span<const int> orders) {
  std::vector<Expr> rows = residuals_at_values(model);
  for (std::size_t j = 0; j < model.variables.size(); ++j)
    for (int k = 1; k <= orders[j]; ++k) {
      const Expr leaf = model.variables[j].leaf;
      rows.push_back(derivative_leaf(leaf, k - 1) + derivative_leaf(leaf, k) * time_symbol());
    }
  std::unordered_set<Expr> unknown{time_symbol()};
  for (std::size_t j = 0; j < model.variables.size(); ++j)
    for (int k = 0; k <= orders[j]; ++k) unknown.insert(derivative_leaf(model.variables[j].leaf, k));
  std::vector<Expr> columns;
  for (Expr leaf : leaves(rows))
    if (unknown.count(leaf) > 0) columns.push_back(leaf);
  const NumericArray equations(std::move(rows), columns);
  std::unordered_map<Expr, double> size;
  for (std::size_t j = 0; j < columns.size(); ++j) size[equations.columns()[j]] = equations.unit()[j];
  return size;
}

}  // namespace

DummyPivoting::DummyPivoting(const ModelPtr& source) : model_(source), analysis_(require_regular(*source)) {
  for (const Entry& e : analysis_.jacobian)
    if (analysis_.offsets.c[e.row] > 0) {
      entries_.push_back(e);
      slopes.push_back(e.value);
    }
  const auto size = sizes_with_one_time(*source, analysis_.offsets.d);
  unit_ = Vec::Ones(static_cast<Index>(source->variables.size()));
  // The size of the highest derivative, for which an equation is solved.
  for (std::size_t j = 0; j < source->variables.size(); ++j)
    for (int order = analysis_.offsets.d[j]; order >= 0; --order)
      if (const auto it = size.find(derivative_leaf(source->variables[j].leaf, order)); it != size.end()) {
        unit_[j] = it->second;
        break;
      }
}

std::shared_ptr<const DummyPivoting> shared_pivoting(const ModelPtr& source) {
  static PerModel<std::shared_ptr<const DummyPivoting>> known;
  return known.of(source, [&] { return std::make_shared<const DummyPivoting>(source); });
}

std::unordered_map<Expr, double> DummyPivoting::generic_point(bool in_units_near_1) const {
  const auto units = in_units_near_1 ? NumericArray::Units::always : NumericArray::Units::far_from_one;
  const NumericArray equations(DerivativeArray(residuals_at_values(*model_), model_->variables), units);
  std::unordered_map<Expr, double> unit;
  for (std::size_t j = 0; j < equations.columns().size(); ++j)
    unit[equations.columns()[j]] = equations.unit()[j];
  auto point = random_point(slopes, 0);
  for (auto& [leaf, value] : point) {
    if (!leaf.is_symbol()) continue;
    if (const auto it = unit.find(symbol_of(leaf).base); it != unit.end()) value *= it->second;
    if (const auto own = model_->values.find(leaf); own != model_->values.end())
      value = pendula::evaluate({&own->second, 1}, {})[0];
  }
  return point;
}

/// The rows in units of the variables, scaled to a largest entry of 1; empty if a number is not finite.
std::vector<DummyPivoting::Row> DummyPivoting::rows(std::span<const double> numbers) const {
  std::vector<Row> list(model_->variables.size());
  for (std::size_t k = 0; k < entries_.size(); ++k) {
    if (!std::isfinite(numbers[k])) return {};
    if (numbers[k] != 0)
      list[entries_[k].row].emplace_back(entries_[k].column, numbers[k] * unit_[entries_[k].column]);
  }
  for (Row& row : list) {
    double largest = 0;
    for (const auto& [j, v] : row) largest = std::max(largest, std::fabs(v));
    for (auto& [j, v] : row) v /= largest;
  }
  return list;
}

/// The rows that are differentiated at least `stage` times, restricted to these columns.
std::vector<DummyPivoting::Row> DummyPivoting::of_stage(const std::vector<Row>& all, int stage,
                                                        const std::vector<char>& columns) const {
  std::vector<Row> list;
  for (std::size_t i = 0; i < analysis_.offsets.c.size(); ++i) {
    if (analysis_.offsets.c[i] < stage) continue;
    list.emplace_back();
    for (const auto& entry : all[i])
      if (columns[entry.first]) list.back().push_back(entry);
  }
  return list;
}

Expr DummyPivoting::dummy(Index column, int stage) const {
  const auto j = static_cast<std::size_t>(column);
  return derivative_leaf(model_->variables[j].leaf, analysis_.offsets.d[j] - stage + 1);
}

DummySelection DummyPivoting::best(std::span<const double> numbers) const {
  const auto all = rows(numbers);
  if (all.empty()) throw Failure("form \"dummy\": the constraint Jacobian is not finite at this point");
  DummySelection selection;
  selection.quality = 1;
  std::vector<char> columns(all.size(), 1);
  for (int stage = 1;; ++stage) {
    const auto here = of_stage(all, stage, columns);
    if (here.empty()) break;
    const auto parts = components(here);
    std::vector<char> chosen(all.size(), 0);
    std::size_t rank = 0;
    for (const Component& part : parts)
      for (Index j : independent_columns(part)) {
        chosen[j] = 1;
        ++rank;
      }
    if (rank < here.size())
      throw Failure(text("form \"dummy\": the constraint Jacobian has rank ", rank, " of ", here.size(),
                         " at this point: the constraints are singular there"));
    selection.quality = std::min(selection.quality, quality_of(parts, chosen));
    for (std::size_t j = 0; j < chosen.size(); ++j)
      if (chosen[j]) selection.dummies.push_back(dummy(static_cast<Index>(j), stage));
    columns = std::move(chosen);
  }
  std::sort(selection.dummies.begin(), selection.dummies.end(), [](Expr a, Expr b) {
    const Symbol &s = symbol_of(a), &t = symbol_of(b);
    return s.base != t.base ? declaration_of(a) < declaration_of(b) : s.order < t.order;
  });
  return selection;
}

double DummyPivoting::quality(const DummySelection& selection, std::span<const double> numbers) const {
  const auto all = rows(numbers);
  if (all.empty()) return 0;
  const std::unordered_set<Expr> dummies(selection.dummies.begin(), selection.dummies.end());
  double quality = 1;
  std::vector<char> columns(all.size(), 1);
  for (int stage = 1;; ++stage) {
    const auto here = of_stage(all, stage, columns);
    if (here.empty()) return quality;
    std::vector<char> chosen(all.size(), 0);
    std::size_t count = 0;
    for (std::size_t j = 0; j < chosen.size(); ++j)
      if (columns[j] && analysis_.offsets.d[j] >= stage - 1 &&
          dummies.count(dummy(static_cast<Index>(j), stage))) {
        chosen[j] = 1;
        ++count;
      }
    if (count != here.size()) throw Error("the selection of dummy derivatives is of another model");
    quality = std::min(quality, quality_of(components(here), chosen));
    columns = std::move(chosen);
  }
}

}  // namespace pendula::dae
