#include "dae/singular/large_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "dae/analysis/determinant_factors.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/model_key.hpp"
#include "dae/model/parameter_values.hpp"
#include "dae/rank/rank.hpp"
#include "dae/regularise/regularise.hpp"
#include "dae/structure/differentiation.hpp"

namespace pendula::dae {
namespace {

constexpr std::size_t small_part =
    4;  // equations of a block up to which the determinant is computed (determinant_factors.hpp)

// Relative difference of two values at random points between 0.5 and 1.5. Rounding makes 10⁻¹³ of it in
// hundreds of operations; different expressions come as close with a probability of 10⁻⁹.
constexpr double equal_below = 1e-9;

using Row = std::map<int, Expr>;

std::vector<Entry> entries_of(const std::vector<Row>& rows) {
  std::vector<Entry> list;
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (const auto& [j, value] : rows[i]) list.push_back({static_cast<int>(i), j, value});
  return list;
}

bool all_constant(const std::vector<Entry>& list) {
  return std::all_of(list.begin(), list.end(), [](const Entry& e) { return e.value.is_constant(); });
}

/// Gradients after elimination of rows like q′ = v: rows with one or two constant entries, whose first
/// unknown is replaced by the other one.
class Gradients {
 public:
  Gradients(std::vector<Row> rows, std::vector<std::string> names)
      : rows_(std::move(rows)), names_(std::move(names)) {
    for (bool again = true; again;) {
      again = false;
      users_.clear();
      for (std::size_t i = 0; i < rows_.size(); ++i)
        for (const auto& [j, value] : rows_[i]) users_[j].push_back(i);
      for (std::size_t i = 0; i < rows_.size(); ++i) again = used_up(i) || again;
    }
  }

  /// columns: their numbers in the original rows.
  LargeBlock::Matrix matrix(std::vector<std::string>& names, std::vector<int>& columns) const {
    std::map<int, int> column;
    std::vector<Row> kept;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (removed_.count(i)) continue;
      names.push_back(names_[i]);
      kept.emplace_back();
      for (const auto& [j, value] : rows_[i])
        kept.back()[column.emplace(j, static_cast<int>(column.size())).first->second] = value;
    }
    columns.resize(column.size());
    for (const auto& [j, place] : column) columns[place] = j;
    return {static_cast<int>(kept.size()), static_cast<int>(column.size()), entries_of(kept)};
  }

 private:
  bool used_up(std::size_t i) {
    const Row row = rows_[i];
    if (removed_.count(i) || row.empty() || row.size() > 2) return false;
    for (const auto& [j, value] : row)
      if (!value.is_constant() || value.is_zero()) return false;
    const auto [j, pivot] = *row.begin();
    for (std::size_t k : users_[j]) {
      if (k == i || removed_.count(k)) continue;
      const auto at = rows_[k].find(j);
      if (at == rows_[k].end()) continue;
      const Expr factor = at->second / pivot;
      rows_[k].erase(at);
      for (const auto& [l, value] : row) {
        if (l == j) continue;
        const auto [to, is_new] = rows_[k].emplace(l, -factor * value);
        if (is_new)
          users_[l].push_back(k);
        else
          to->second = to->second - factor * value;
        if (to->second.is_zero()) rows_[k].erase(to);
      }
    }
    rows_[i].clear();
    removed_[i] = true;
    return true;
  }

  std::vector<Row> rows_;
  std::vector<std::string> names_;
  std::map<int, std::vector<std::size_t>> users_;
  std::map<std::size_t, bool> removed_;
};

/// J = [M F; G 0]: G the differentiated rows, F the columns that do not occur in G.
class Saddle {
 public:
  Saddle(const std::vector<Row>& all, const std::vector<char>& is_gradient, const ParameterValues& values)
      : all_(all), is_gradient_(is_gradient), values_(values) {}

  /// Is J singular only where rows of G are dependent? Sufficient: M constant and diagonal, F = D Gᵀ R with
  /// constant diagonal D and R (compared at two points), D⁻¹ M of one sign.
  bool gradients_decide() {
    for (std::size_t i = 0; i < all_.size(); ++i)
      if (is_gradient_[i])
        for (const auto& [j, value] : all_[i]) moved_[j] = 1;
    return read_dynamics() && read_constraints() && columns_match() && factors_exist() &&
           masses_are_positive();
  }
  /// The entry of M in this column after scaling of the rows so that forces act along
  /// gradients. Requires gradients_decide().
  Expr inertia(int column) const {
    const int row = place_.at(column);
    return Expr(mass_.at(row) / factor_.at(row));
  }

 private:
  bool read_dynamics() {
    for (std::size_t i = 0; i < all_.size(); ++i) {
      if (is_gradient_[i]) continue;
      int own = -1;
      for (const auto& [j, value] : all_[i]) {
        if (!moved_.count(j)) {
          F_[j].emplace_back(static_cast<int>(i), value);
          continue;
        }
        const std::vector<Expr> put = at_values({&value, 1}, values_);
        if (own >= 0 || !put[0].is_constant()) return false;
        own = j;
        mass_[i] = constant_value(put[0]);
      }
      if (own < 0 || place_.count(own)) return false;
      place_[own] = static_cast<int>(i);
    }
    return true;
  }

  bool read_constraints() {
    for (std::size_t i = 0; i < all_.size(); ++i) {
      if (!is_gradient_[i]) continue;
      std::map<int, Expr> as_column;
      for (const auto& [j, value] : all_[i]) {
        if (!place_.count(j)) return false;
        as_column[place_[j]] = value;
      }
      std::vector<int> support;
      std::vector<Expr> values;
      for (const auto& [k, value] : as_column) {
        support.push_back(k);
        values.push_back(value);
      }
      rows_[support].push_back(values);
      ++constraints_;
    }
    return F_.size() == constraints_;
  }

  bool columns_match() {
    std::vector<Expr> everything;
    for (const Row& row : all_)
      for (const auto& [j, value] : row) everything.push_back(value);
    std::unordered_map<Expr, double> numbers[2];
    for (int k = 0; k < 2; ++k) {
      const std::vector<double> at = pendula::evaluate(everything, random_point(everything, k));
      for (std::size_t i = 0; i < everything.size(); ++i) numbers[k][everything[i]] = at[i];
    }
    for (const auto& [j, column] : F_) {
      std::vector<int> support;
      for (const auto& [i, value] : column) support.push_back(i);
      const auto found = rows_.find(support);
      if (found == rows_.end()) return false;
      std::vector<double> ratios;
      const auto constant_ratios = [&, &entries = column](const std::vector<Expr>& row) {
        ratios.clear();
        for (std::size_t s = 0; s < row.size(); ++s) {
          const auto at = [&](int k) { return numbers[k].at(entries[s].second) / numbers[k].at(row[s]); };
          const double r = at(0);
          if (!std::isfinite(r) || r == 0 || std::fabs(at(1) - r) > equal_below * std::fabs(r)) return false;
          ratios.push_back(r);
        }
        return true;
      };
      auto& rows = found->second;
      const auto match = std::find_if(rows.begin(), rows.end(), constant_ratios);
      if (match == rows.end()) return false;
      rows.erase(match);
      for (std::size_t s = 0; s < support.size(); ++s) ratios_.push_back({support[s], j, ratios[s]});
    }
    return true;
  }

  /// Finds F_iλ/G_λj = d_i ρ_λ, one factor per row and one per multiplier, by a search from rows to their
  /// multipliers and back.
  bool factors_exist() {
    std::map<int, std::vector<const Ratio*>> of_row, of_multiplier;
    for (const Ratio& r : ratios_) {
      of_row[r.row].push_back(&r);
      of_multiplier[r.multiplier].push_back(&r);
    }
    std::map<int, double> rho;
    for (const auto& [first, list] : of_row) {
      if (!factor_.emplace(first, mass_.at(first) < 0 ? -1 : 1).second) continue;
      std::vector<int> rows{first};
      while (!rows.empty()) {
        const int row = rows.back();
        rows.pop_back();
        for (const Ratio* r : of_row[row]) {
          if (!rho.emplace(r->multiplier, r->value / factor_[row]).second) continue;
          for (const Ratio* other : of_multiplier[r->multiplier])
            if (factor_.emplace(other->row, other->value / rho[r->multiplier]).second)
              rows.push_back(other->row);
        }
      }
    }
    return std::all_of(ratios_.begin(), ratios_.end(), [&](const Ratio& r) {
      return std::fabs(factor_.at(r.row) * rho.at(r.multiplier) - r.value) <=
             equal_below * std::fabs(r.value);
    });
  }

  /// Is D⁻¹ M positive? d was given the sign of the mass where a search began.
  bool masses_are_positive() {
    return std::all_of(mass_.begin(), mass_.end(), [&](const auto& own) {
      // for rows without forces
      const auto factor = factor_.emplace(own.first, own.second < 0 ? -1 : 1).first;
      return own.second / factor->second > 0;
    });
  }

  struct Ratio {
    int row, multiplier;
    double value;
  };
  const std::vector<Row>& all_;
  const std::vector<char>& is_gradient_;
  const ParameterValues& values_;
  std::map<int, char> moved_;
  std::map<int, int> place_;      ///< row with the diagonal entry of each column
  std::map<int, double> mass_;    ///< by row
  std::map<int, double> factor_;  ///< d, by row
  std::vector<Ratio> ratios_;
  std::map<int, std::vector<std::pair<int, Expr>>> F_;
  std::map<std::vector<int>, std::vector<std::vector<Expr>>> rows_;  ///< of G, by their nonzero columns
  std::size_t constraints_ = 0;
};

/// Rows q′ = v substituted into the others, so that J consists of the columns of M, F and G.
struct Kinematics {
  std::vector<Row> rows;
  std::vector<char> is_gradient;
};
Kinematics without_kinematics(std::vector<Row> rows, const std::vector<char>& differentiated) {
  Kinematics result;
  std::map<int, std::vector<std::size_t>> users;
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (const auto& [j, value] : rows[i]) users[j].push_back(i);
  std::vector<char> gone(rows.size(), 0);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!differentiated[i] || rows[i].size() != 2) continue;
    const auto [j, a] = *rows[i].begin();
    const auto [l, b] = *rows[i].rbegin();
    if (!a.is_constant() || !b.is_constant()) continue;
    for (std::size_t k : users[j]) {
      if (k == i || gone[k] || !rows[k].count(j)) continue;
      const Expr f = -rows[k][j] * b / a;
      rows[k].erase(j);
      if (rows[k].count(l)) return {};
      rows[k][l] = f;
      users[l].push_back(k);
    }
    gone[i] = 1;
  }
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (!gone[i]) {
      result.rows.push_back(rows[i]);
      result.is_gradient.push_back(differentiated[i]);
    }
  return result;
}

/// Is C a distance: |∇C|² = a + b C with a ≠ 0 and the same b at all points tried? Then its gradient vanishes
/// nowhere on C = 0.
bool is_distance(Expr C, const std::vector<Entry>& gradient, const ParameterValues& values) {
  Expr square = 0;
  for (const Entry& e : gradient) square = square + e.value * e.value;
  const std::vector<Expr> both = at_values(std::vector<Expr>{C, square}, values);
  double c[4], s[4];
  for (int k = 0; k < 4; ++k) {
    const std::vector<double> at = pendula::evaluate(both, random_point(both, k));
    c[k] = at[0];
    s[k] = at[1];
  }
  const double b = (s[1] - s[0]) / (c[1] - c[0]), a = s[0] - b * c[0];
  for (int k = 2; k < 4; ++k)
    if (!(std::fabs(s[k] - a - b * c[k]) <= equal_below * (std::fabs(s[k]) + std::fabs(a)))) return false;
  return std::fabs(a) > equal_below * (std::fabs(s[0]) + std::fabs(b * c[0]));
}

/// The entry of M for the coordinate of this acceleration.
Expr inertia(const Mechanics& mechanics, Expr acceleration) {
  const Expr coordinate = symbol_of(acceleration).base;
  for (const Entry& e : mechanics.M)
    if (e.row == e.column && mechanics.q[e.row] == coordinate) return e.value;
  return 0;
}

std::vector<LargeBlock> found_in(const ModelPtr& source) {
  std::vector<LargeBlock> list;
  if (source->residuals.size() != source->variables.size()) return list;
  const Analysis a = analyse(*source);
  if (!a.regular) return list;
  std::vector<std::vector<const Entry*>> of_row(source->residuals.size());
  for (const Entry& e : a.jacobian) of_row[e.row].push_back(&e);
  for (const Part& part : blocks_of(*source, a).square) {
    if (part.rows.size() <= small_part) continue;
    std::map<int, int> local;
    for (int j : part.columns) local.emplace(j, static_cast<int>(local.size()));
    std::vector<Row> all, constraints;
    std::vector<char> differentiated;
    std::vector<std::string> names;
    std::map<std::string, Expr> residual;  // of a constraint
    LargeBlock block;
    for (int i : part.rows) {
      const auto row = static_cast<std::size_t>(i);
      all.emplace_back();
      for (const Entry* e : of_row[row])
        if (const auto j = local.find(e->column); j != local.end()) all.back()[j->second] = e->value;
      differentiated.push_back(a.offsets.c[row] > 0);
      block.equations.push_back(source->label(row));
      if (a.offsets.c[row] == 0) continue;
      constraints.push_back(all.back());
      names.push_back(constraint_label(*source, row, 0));
      residual[names.back()] = source->residuals[row];
    }
    const int n = static_cast<int>(part.rows.size());
    block.all = {n, n, entries_of(all)};
    if (all_constant(block.all.entries)) continue;
    for (int j : part.columns) {
      const auto k = static_cast<std::size_t>(j);
      block.determined.push_back(derivative_leaf(source->variables[k].leaf, a.offsets.d[k]));
    }
    const Kinematics rest = without_kinematics(all, differentiated);
    Saddle saddle(rest.rows, rest.is_gradient, source->values);
    const bool by_pattern = !source->mechanics && !rest.rows.empty() && saddle.gradients_decide();
    const bool decided = source->mechanics || by_pattern;
    if (!constraints.empty()) {
      std::vector<int> columns;
      block.gradients =
          Gradients(std::move(constraints), std::move(names)).matrix(block.constraints, columns);
      for (int j : columns) {
        block.moved.push_back(block.determined[j]);
        if (decided)
          block.inertia.push_back(by_pattern ? saddle.inertia(j)
                                             : inertia(*source->mechanics, block.moved.back()));
      }
    }
    if (all_constant(block.gradients.entries)) {
      block.gradients = {};
      block.constraints.clear();
      block.moved.clear();
      block.inertia.clear();
    }
    if (block.gradients.rows == 1 && decided &&
        is_distance(residual.at(block.constraints[0]), block.gradients.entries, source->values))
      continue;
    if (block.gradients.rows == 0 || !decided) block.jacobian = block.all;
    list.push_back(std::move(block));
  }
  return list;
}

}  // namespace

std::vector<LargeBlock> large_blocks(const ModelPtr& model) {
  static ModelCache<std::vector<LargeBlock>> known(cached_models);
  const ModelPtr written = original(model);
  const auto key = key_of(*written);
  const auto* found = known.find(key);
  std::vector<LargeBlock> list = found ? *found : known.insert(key, found_in(regular_form(written)));
  if (model->relations.empty()) return list;
  for (LargeBlock& block : list) {
    block.inertia = substitute(block.inertia, model->relations);
    for (LargeBlock::Matrix* m : {&block.gradients, &block.jacobian, &block.all}) {
      std::vector<Expr> values;
      for (const Entry& e : m->entries) values.push_back(e.value);
      values = substitute(values, model->relations);
      for (std::size_t k = 0; k < values.size(); ++k) m->entries[k].value = values[k];
    }
  }
  return list;
}

}  // namespace pendula::dae
