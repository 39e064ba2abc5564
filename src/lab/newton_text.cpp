// The table of a Newton run.
#include "lab/newton_lab.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/error.hpp"
#include "base/text.hpp"
#include "lab/printed.hpp"

namespace pendula::lab {
namespace {

using Eigen::Index;
constexpr int widest = 4;                      ///< number of unknowns shown side by side
constexpr int first_rows = 10, last_rows = 8;  ///< what a screen holds

/// 15 significant digits of the largest value of a column, with the same number of decimals in all rows;
/// decimals below the rounding error are left blank.
std::vector<std::string> column_text(const NewtonRun& run, Index j) {
  double largest = 0;
  for (const Vec& v : run.x)
    if (std::isfinite(v[j])) largest = std::max(largest, std::fabs(v[j]));
  std::vector<std::string> cells;
  const int before = largest >= 1 ? static_cast<int>(std::floor(std::log10(largest))) + 1 : 0;
  for (std::size_t k = 0; k < run.x.size(); ++k) {
    const double v = run.x[k][j], blur = run.blur[k][j];
    constexpr int most_before = 8;  // digits before the point; longer numbers have an exponent
    if (before > most_before) {
      cells.push_back(printed("%.*e", 14, v));
      continue;
    }
    const int decimals = 15 - before;
    const double digits = blur > 0 ? std::floor(-std::log10(blur)) : decimals;
    const int kept = static_cast<int>(std::clamp<double>(std::isfinite(digits) ? digits : 1, 1, decimals));
    cells.push_back(printed("%.*f", kept, v) + std::string(static_cast<std::size_t>(decimals - kept), ' '));
  }
  return cells;
}

class Columns {
 public:
  Columns(const NewtonSettings& settings, const NewtonRun& run) : settings_(settings), run_(run) {}

  std::string residual(std::size_t k) const {
    if (!std::isfinite(run_.norm[k])) return "not finite";
    if (run_.norm[k] <= run_.noise[k]) return "≈ 0";
    constexpr double three_digits = 1e3;  // above the noise
    return printed("%.*e", run_.norm[k] > three_digits * run_.noise[k] ? 2 : 0, run_.norm[k]);
  }
  std::string ratio(std::size_t k, int p) const {
    const double value = run_.observed.ratio(k, p);
    return value > 0 ? rounded(value, 4) : "";
  }
  std::string order(std::size_t k) const {
    const double value = run_.observed.order_at(k);
    return value > 0 ? printed("%.*f", 2, value) : "";
  }
  bool errors() const { return !run_.observed.error.empty(); }
  bool steps() const { return settings_.line_search; }
  std::string alpha(std::size_t k) const { return k == 0 ? "" : rounded(run_.alpha[k - 1], 4); }

 private:
  const NewtonSettings& settings_;
  const NewtonRun& run_;
};

std::string table_text(const NumericFunction& r, const NewtonSettings& settings, const NewtonRun& run) {
  const Index shown = std::min<Index>(r.n(), widest);
  std::vector<std::vector<std::string>> iterates;
  std::vector<std::string> head = {"k"};
  for (Index j = 0; j < shown; ++j) {
    iterates.push_back(column_text(run, j));
    head.push_back(r.unknowns[j]);
  }
  const Columns columns(settings, run);
  head.push_back("‖r‖");
  if (columns.steps()) head.push_back("α");
  if (columns.errors()) head.insert(head.end(), {"‖e₊‖/‖e‖", "‖e₊‖/‖e‖²", "order"});
  Table table(std::vector<bool>(head.size(), true));
  table.row(head);
  const std::size_t n = run.x.size();
  for (std::size_t k = 0; k < n; ++k) {
    if (n > first_rows + last_rows + 1 && k == first_rows) {
      table.row({"…"});
      k = n - last_rows;
    }
    std::vector<std::string> row = {std::to_string(k)};
    for (const auto& cells : iterates) row.push_back(cells[k]);
    row.push_back(columns.residual(k));
    if (columns.steps()) row.push_back(columns.alpha(k));
    if (columns.errors()) row.insert(row.end(), {columns.ratio(k, 1), columns.ratio(k, 2), columns.order(k)});
    table.row(row);
  }
  std::string out = table.str(2);
  if (shown < r.n())
    out += text("  (", r.n(), " unknowns; the first ", shown, " are shown, k.iterates has all)\n");
  return out;
}

std::string heading(const NewtonSettings& settings, const NewtonRun& run) {
  const char* const kinds[] = {"exact Jacobian", "finite-difference Jacobian", "Jacobian frozen at the start",
                               "given Jacobian"};
  return text("Newton's method, ", kinds[static_cast<int>(settings.jacobian)], ", ",
              settings.line_search ? "line search" : text("α = ", rounded(settings.alpha, 6)),
              ", tol = ", rounded(settings.tol, 4), ": ", run.iterations(),
              run.iterations() == 1 ? " iteration, " : " iterations, ", ending_name(run.ending), "\n");
}

}  // namespace

std::string newton_text(const NumericFunction& r, const NewtonSettings& settings, const NewtonRun& run) {
  return heading(settings, run) + table_text(r, settings, run) + wrapped(run.verdict);
}

}  // namespace pendula::lab
