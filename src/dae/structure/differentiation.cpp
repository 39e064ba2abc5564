#include "dae/structure/differentiation.hpp"

#include <algorithm>
#include <unordered_set>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/derivation_markup.hpp"
#include "dae/model/equation_lines.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/solved_rows.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/graph/taylor.hpp"
#include "expr/print/primes.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "expr/rewrite/tidied.hpp"

namespace pendula::dae {

Substitution kinematics(const Model& m) {
  const auto z = m.algebraic(), top = m.top_derivatives();
  std::unordered_set<Expr> unknown(z.begin(), z.end());
  unknown.insert(top.begin(), top.end());
  Substitution known;
  for (const Solved& row : solved_rows(m)) {
    if (varies(row.slope)) continue;  // t x′ = f does not determine x′ at t = 0
    if (!depends_on_any(row.f, unknown)) known[row.derivative] = row.f;
  }
  return known;
}

std::string constraint_label(const Model& m, std::size_t residual, int k) {
  const auto [block, row] = m.origin[residual];
  if (m.mechanics && row < m.mechanics->C.size() && block == static_cast<int>(m.blocks.size()) - 1) {
    const VecX& C = m.mechanics->C;  // the rows are those C that do not follow from others
    const auto at = std::find(C.begin(), C.end(), m.blocks[block].rhs[row]);
    const auto place = at == C.end() ? row : static_cast<int>(at - C.begin());
    return (C.size() == 1 ? "C" : "C" + subscript(place + 1)) + primes(k);
  }
  return m.label(residual) + primes(k);
}

namespace {

/// One reduction in progress: differentiates blocks, records constraints and derivation.
class Differentiation {
 public:
  Differentiation(const Model& model, const Offsets& o) : m_(model), o_(o), known_(kinematics(model)) {
    for (Expr leaf : m_.top_derivatives()) top_.insert(leaf);
    keep_in_one_row();
    series_ = TaylorSeries(known_);
    std::size_t first = 0;
    for (std::size_t b = 0; b < m_.blocks.size(); ++b) {
      const auto rows = static_cast<std::size_t>(m_.blocks[b].lhs.size());
      reduce_block(b, first, rows);
      first += rows;
    }
    if (explained_ > most_explained)
      result.trace.push_back(text("… and ", explained_ - most_explained, " more equations in the same way"));
  }

  Differentiated result;

 private:
  /// Excludes x_j′ = f from substitution if x_j′ occurs in another row that has to be differentiated: such a
  /// row and x_j′ = f are two conditions on x_j′ (x′ = x - y, x′ = x), and both are differentiated.
  void keep_in_one_row() {
    std::unordered_map<Expr, std::size_t> defined_by;
    for (const Solved& row : solved_rows(m_)) defined_by[row.derivative] = row.residual;
    for (std::size_t i = 0; i < m_.residuals.size(); ++i) {
      if (o_.c[i] == 0) continue;
      for (Expr leaf : leaves({&m_.residuals[i], 1}))
        if (const auto it = known_.find(leaf); it != known_.end() && defined_by.at(leaf) != i)
          known_.erase(it);
    }
  }

  bool substituted(std::size_t i) const {
    for (Expr leaf : leaves({&m_.residuals[i], 1}))
      if (known_.count(leaf)) return top_.count(leaf) > 0;
    return false;
  }

  int times(std::size_t i) const { return substituted(i) ? 0 : o_.c[i]; }

  void reduce_block(std::size_t b, std::size_t first, std::size_t rows) {
    int most = 0;
    bool uniform = true;
    for (std::size_t r = 0; r < rows; ++r) {
      most = std::max(most, times(first + r));
      uniform = uniform && times(first + r) == times(first);
    }
    if (most == 0) return result.blocks.push_back(m_.blocks[b]);
    const auto number = [&](std::size_t r) {  // label of a row that is described on its own
      return rows == 1 || !uniform ? m_.label(first + r) : text("(", b + 1, ")");
    };
    VecX residual = column(std::span(m_.residuals).subspan(first, rows));
    for (Eigen::Index r = 0; r < residual.size(); ++r)  // 0 = C reads better than 0 = -C
      if (m_.blocks[b].lhs[r].is_zero()) residual[r] = m_.blocks[b].rhs[r];
    const bool whole = uniform && is_shown_whole(residual);
    // rows with the same treatment share their lines
    std::vector<std::vector<std::string>> lines_of_rows(whole ? 1 : rows);
    const auto add_line = [&](std::size_t r, const std::string& before, const std::string& after) {
      lines_of_rows[r].push_back(
          before + (whole ? formula("0 = ", ref(residual)) : formula("0 = ", ref(residual[r]))) + after);
    };
    for (std::size_t r = 0; r < lines_of_rows.size(); ++r)
      if (const int n = times(first + r); n > 0)
        add_line(r, (whole ? number(r) : m_.label(first + r)) + "  ",
                 text("   is differentiated ", n == 1   ? "once"
                                               : n == 2 ? "twice"
                                                        : text(n, " times")));
    if (explained_ < most_explained) explain(residual, lines_of_rows);
    const VecX given = residual;
    for (int k = 0; k < most; ++k) {
      for (std::size_t r = 0; r < rows; ++r) {
        if (k >= times(first + r)) continue;
        Expr& e = residual[r];
        result.constraints.push_back(
            {e, static_cast<int>(b), static_cast<int>(r), k, constraint_label(m_, first + r, k)});
        e = next_derivative(given[r], e, k + 1);
      }
      for (std::size_t r = 0; r < lines_of_rows.size(); ++r)
        if (k < times(first + r))
          add_line(
              r,
              text("     ",
                   k == 0 ? formula("d/dt") : formula("d", superscript(k + 1), "/dt", superscript(k + 1)),
                   ":  "),
              "");
    }
    if (++explained_ <= most_explained)
      for (const auto& lines : lines_of_rows)
        result.trace.insert(result.trace.end(), lines.begin(), lines.end());
    Block block{m_.blocks[b].lhs, m_.blocks[b].rhs, "", m_.blocks[b].rewritten};
    const bool by_row = !uniform || (rows == 1 && !block.rewritten.empty());
    if (!by_row) {
      block.note = differentiated(number(0), most);
      block.rewritten.clear();
    }
    if (by_row) block.rewritten.resize(rows);
    for (std::size_t r = 0; r < rows; ++r) {
      if (times(first + r) == 0) continue;
      block.lhs[r] = 0;
      block.rhs[r] = residual[r];
      if (by_row) block.rewritten[r] = differentiated(number(r), times(first + r));
    }
    result.blocks.push_back(std::move(block));
  }

  /// The derivative of order k, from the one before it or by Taylor arithmetic.
  Expr next_derivative(Expr given, Expr before, int k) {
    return prefers_series(given, before, k) ? series_.derivative(given, k)
                                            : tidied(substitute(total_derivative(before), known_));
  }

  /// Scalar equations are described row by row; a column that reads as a vector, or a long one, as a whole.
  static bool is_shown_whole(const VecX& residual) {
    constexpr Eigen::Index most_apart = 8;  // rows of an equation that are described one by one
    return residual.size() == 1 || residual.size() > most_apart ||
           rows_per_line(VecX::Zero(residual.size()), residual) > 1;
  }

  /// Explains that the equation contains none of the unknowns to be determined.
  void explain(const VecX& residual, std::vector<std::vector<std::string>>& lines) const {
    const auto z = m_.algebraic();
    const std::unordered_set<Expr> algebraic(z.begin(), z.end());
    for (Expr leaf : leaves(entries(residual)))
      if (top_.count(leaf) || algebraic.count(leaf)) return;
    constexpr std::size_t readable = 12;  // names: one line
    const auto top = m_.top_derivatives();
    if (top.size() > readable) return;
    const std::string unknowns = grouped_names(top);
    for (auto& list : lines)
      if (!list.empty())
        list.push_back(
            shown_from(Detail::full, text("     because it contains ", z.empty() ? "none of " : "neither ",
                                          unknowns, z.empty() ? "" : text(" nor ", grouped_names(z)),
                                          ", which the equations have to determine:")));
  }

  static std::string differentiated(const std::string& what, int times) {
    return what + " differentiated" + (times == 1 ? "" : times == 2 ? " twice" : text(" ", times, " times"));
  }

  const Model& m_;
  const Offsets& o_;
  static constexpr int most_explained = 60;  // equations; more descriptions would not help
  Substitution known_;
  TaylorSeries series_;  ///< along the rows of known_
  std::unordered_set<Expr> top_;
  int explained_ = 0;
};

}  // namespace

Differentiated differentiate(const Model& model, const Offsets& offsets) {
  return Differentiation(model, offsets).result;
}

}  // namespace pendula::dae
