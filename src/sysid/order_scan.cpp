#include <algorithm>
#include <cmath>

#include <Eigen/QR>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "sysid/structured.hpp"
#include "sysid/validation.hpp"

namespace pendula::sysid {
namespace {

/// The factor of the largest regressor with y as last column, and Σ (y - ȳ)².
struct Factored {
  Mat R;
  Index rows = 0;
  double variation = 0;
};

Factored factored(const IdData& d, const Orders& largest) {
  const Regressor regressor(d, 0, largest, Start::drop);
  if (regressor.rows() < 2)
    throw Error(text("order_scan: the largest model needs ", largest.memory(),
                     " earlier samples; the data has ", d.samples()));
  const TriangularFactor factor = triangular_factor(regressor);
  const Vec y = regressor.targets();
  return {factor.R(), factor.rows(), (y.array() - y.mean()).matrix().squaredNorm()};
}

/// Columns of the largest regressor that the model (na, nb, nk) uses.
std::vector<Index> columns_of(int na, int nb, int nk, const Orders& largest) {
  std::vector<Index> out;
  for (int k = 0; k < na; ++k) out.push_back(k);
  Index first = largest.na;
  for (const int width : largest.nb) {
    for (int k = 0; k < nb; ++k) out.push_back(first + nk - largest.nk[0] + k);
    first += width;
  }
  return out;
}

const char* const names[] = {"fpe", "aic", "bic", "fit"};

double value_of(const ScanEntry& s, const std::string& criterion) {
  if (criterion == "fpe") return s.estimation.fpe;
  if (criterion == "aic") return s.estimation.aic;
  if (criterion == "bic") return s.estimation.bic;
  return -s.validation_fit;
}

void check(const Range& r, const char* name, int least) {
  if (r.from < least || r.to < r.from)
    throw Error(text(name, " = {", r.from, ", ", r.to, "} is no range; give {from, to} with ", least,
                     " ≤ from ≤ to"));
  if (r.to > 200) throw Error(text(name, " = ", r.to, " is too large for a scan"));
}

}  // namespace

OrderScan order_scan(const IdData& e, const IdData* v, Range na, Range nb, Range nk,
                     const std::string& criterion) {
  check(na, "na", 0), check(nb, "nb", e.inputs() ? 1 : 0), check(nk, "nk", 0);
  if (e.outputs() != 1) throw Error("order_scan is for one output");
  if (v && (v->outputs() != 1 || v->inputs() != e.inputs()))
    throw Error("estimation and validation data differ in their signals");
  Orders largest;
  largest.na = na.to;
  const auto inputs = static_cast<std::size_t>(e.inputs());
  largest.nb.assign(inputs, nk.to - nk.from + nb.to), largest.nk.assign(inputs, nk.from),
      largest.nf.assign(inputs, 0);
  if (inputs == 0) nb = nk = {0, 0};
  const Factored fe = factored(e, largest), fv = v ? factored(*v, largest) : Factored{};
  OrderScan scan;
  scan.criterion = criterion, scan.rows = fe.rows, scan.validation_rows = fv.rows;
  const Index D = fe.R.cols() - 1;
  for (int a = na.from; a <= na.to; ++a)
    for (int b = nb.from; b <= nb.to; ++b)
      for (int k = nk.from; k <= nk.to; ++k) {
        poll_interrupt();
        const std::vector<Index> columns = columns_of(a, b, k, largest);
        if (columns.empty()) continue;
        const Mat part = fe.R(Eigen::all, columns);
        const Eigen::ColPivHouseholderQR<Mat> qr(part);
        const Vec theta = qr.solve(fe.R.col(D));
        ScanEntry entry{
            a, b, k, criteria((fe.R.col(D) - part * theta).squaredNorm(), fe.rows, qr.rank(), fe.variation),
            0, 0};
        if (v) {
          const double sse = (fv.R.col(D) - fv.R(Eigen::all, columns) * theta).squaredNorm();
          entry.validation_loss = sse / static_cast<double>(fv.rows);
          entry.validation_fit = 100 * (1 - std::sqrt(sse / fv.variation));
        }
        scan.entries.push_back(entry);
      }
  if (scan.entries.empty()) throw Error("order_scan: no model has a parameter");
  std::stable_sort(scan.entries.begin(), scan.entries.end(), [&](const auto& x, const auto& y) {
    return value_of(x, criterion) < value_of(y, criterion);
  });
  for (const char* name : names) {
    if (!v && std::string(name) == "fit") continue;
    const auto best =
        std::min_element(scan.entries.begin(), scan.entries.end(),
                         [&](const auto& x, const auto& y) { return value_of(x, name) < value_of(y, name); });
    scan.best[name] = static_cast<std::size_t>(best - scan.entries.begin());
  }
  return scan;
}

std::string describe(const OrderScan& s) {
  const bool validated = s.validation_rows > 0;
  std::string out = text("order scan: ", s.entries.size(), " ARX models on the same ", s.rows, " rows",
                         validated ? text(", validated on ", s.validation_rows, " rows") : "", "\n");
  Table table(std::vector<bool>(9, true));
  std::vector<std::string> heading{"na", "nb", "nk", "d", "loss", "FPE", "AIC", "BIC"};
  if (validated) heading.push_back("validation fit %");
  table.row(heading);
  for (std::size_t i = 0; i < std::min<std::size_t>(10, s.entries.size()); ++i) {
    const ScanEntry& e = s.entries[i];
    std::vector<std::string> row{std::to_string(e.na),          std::to_string(e.nb),
                                 std::to_string(e.nk),          std::to_string(e.estimation.parameters),
                                 rounded(e.estimation.loss, 6), rounded(e.estimation.fpe, 6),
                                 rounded(e.estimation.aic, 6),  rounded(e.estimation.bic, 6)};
    if (validated) row.push_back(rounded(e.validation_fit, 6));
    table.row(row);
  }
  out += table.str(2);
  if (s.entries.size() > 10)
    out += text("  … ", s.entries.size() - 10, " more; sorted by ", s.criterion, "\n");
  for (const auto& [name, i] : s.best) {
    const ScanEntry& e = s.entries[i];
    out += text("  best by ", name == "fit" ? "validation fit" : name, ": na = ", e.na, ", nb = ", e.nb,
                ", nk = ", e.nk, "\n");
  }
  out.pop_back();
  return out;
}

}  // namespace pendula::sysid
