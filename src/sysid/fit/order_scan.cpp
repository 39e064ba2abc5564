#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "sysid/fit/order_scan.hpp"
#include "sysid/regression/structured.hpp"

namespace pendula::sysid {
namespace {

/// The factor of the largest regressor with the outputs as last columns, and Σ (y - ȳ)² of each.
struct Factored {
  Mat R;
  Index rows = 0;
  Vec variation;
};

/// The largest model: own past, inputs, then the past of the other outputs.
Orders largest_orders(const IdData& e, const Range& na, const Range& nb, const Range& nk) {
  Orders o;
  o.na = na.to;
  const auto inputs = static_cast<std::size_t>(e.inputs());
  o.nb.assign(inputs, nk.to - nk.from + nb.to);
  o.nk.assign(inputs, nk.from);
  for (Index j = 1; j < e.outputs(); ++j) {
    o.nb.push_back(na.to);
    o.nk.push_back(1);
  }
  o.nf.assign(o.nb.size(), 0);
  return o;
}

Factored factored(const IdData& d, const Orders& largest) {
  if (d.outputs() > 1 && missing(d) > 0)
    throw Error(text(missing_text(d), "; a scan of several outputs needs every sample: d:fill()"));
  const IdData all = channel(d, 0, d.outputs() > 1);
  const Regressor regressor(all, 0, largest, InitialCondition::drop);
  if (regressor.rows() < 2)
    throw Error(
        text("the largest model needs ", largest.memory(), " earlier samples; the data has ", d.samples()));
  const TriangularFactor factor = triangular_factor(regressor, &d.y);
  Mat y(regressor.rows(), d.outputs());
  Index i = 0;
  for (const RowRange& r : regressor.ranges())
    for (Index t = r.first; t < r.last; ++t) y.row(i++) = d.y.row(t);
  return {factor.R(), factor.rows(), (y.rowwise() - y.colwise().mean()).colwise().squaredNorm().transpose()};
}

/// Columns of the largest regressor that the model (na, nb, nk) uses.
std::vector<Index> columns_of(int na, int nb, int nk, const Orders& largest, std::size_t inputs) {
  std::vector<Index> out;
  for (int k = 0; k < na; ++k) out.push_back(k);
  Index first = largest.na;
  for (std::size_t i = 0; i < largest.nb.size(); ++i) {
    if (i < inputs)
      for (int k = 0; k < nb; ++k) out.push_back(first + nk - largest.nk[0] + k);
    else
      for (int k = 0; k < na; ++k) out.push_back(first + k);
    first += largest.nb[i];
  }
  return out;
}

/// Is the remainder of y rounding? Such models are compared by their size alone.
/// 450 ε: ARX models of data without noise leave at most 2.5e-15 of y (orders 1 to 3, 200 and 5000 samples).
bool exact(const Mat& errors, const Mat& y) { return errors.norm() <= 1e-13 * y.norm(); }

/// The result for one model. For several outputs the loss is det(EᵀE/N), and d counts the parameters of
/// all (Ljung §16.4).
ScanEntry entry_of(int na, int nb, int nk, const std::vector<Index>& columns, const Factored& fe,
                   const Factored& fv) {
  const Index p = fe.variation.size();
  const auto N = static_cast<double>(fe.rows);
  const Mat part = fe.R(Eigen::all, columns);
  const Eigen::ColPivHouseholderQR<Mat> qr(part);
  const Mat theta = qr.solve(Mat(fe.R.rightCols(p)));
  Mat errors = fe.R.rightCols(p) - part * theta;
  if (exact(errors, fe.R.rightCols(p))) errors.setZero();
  const double loss = p == 1 ? errors.squaredNorm() / N : determinant_by_lu(errors.transpose() * errors / N);
  ScanEntry out{na, nb, nk, criteria(N * loss, fe.rows, p * qr.rank(), p == 1 ? fe.variation[0] : 1), 0, 0};
  if (fv.rows == 0) return out;
  Mat missed = fv.R.rightCols(p) - Mat(fv.R(Eigen::all, columns)) * theta;
  if (exact(missed, fv.R.rightCols(p))) missed.setZero();
  const auto M = static_cast<double>(fv.rows);
  out.validation_loss =
      p == 1 ? missed.squaredNorm() / M : determinant_by_lu(missed.transpose() * missed / M);
  for (Index j = 0; j < p; ++j)
    out.validation_fit +=
        100 * (1 - std::sqrt(missed.col(j).squaredNorm() / fv.variation[j])) / static_cast<double>(p);
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
    throw Error(text(name, " = {", r.from, ", ", r.to, "} is not a range; give {from, to} with ", least,
                     " ≤ from ≤ to"));
  constexpr int most = 200;  // one factorisation serves all models: its columns are the sum of the orders
  if (r.to > most) throw Error(text(name, " = ", r.to, " is too large for a scan: at most ", most));
}

/// A model of the scan with its columns of the largest regressor.
struct Candidate {
  int na, nb, nk;
  std::vector<Index> columns;
};

std::vector<Candidate> candidates(const Range& na, const Range& nb, const Range& nk, const Orders& largest,
                                  std::size_t inputs) {
  std::vector<Candidate> out;
  for (int a = na.from; a <= na.to; ++a)
    for (int b = nb.from; b <= nb.to; ++b)
      for (int k = nk.from; k <= nk.to; ++k) {
        std::vector<Index> columns = columns_of(a, b, k, largest, inputs);
        if (!columns.empty()) out.push_back({a, b, k, std::move(columns)});
      }
  if (out.empty()) throw Error("no model has a parameter");
  return out;
}

/// Fills entries, failures and left.
void make_models(OrderScan& scan, const std::vector<Candidate>& models, const Factored& fe,
                 const Factored& fv, const integrate::WorkerOptions& options) {
  static_assert(std::is_trivially_copyable_v<ScanEntry>);
  std::vector<int> all(models.size());
  std::iota(all.begin(), all.end(), 0);
  integrate::SharedSlots slots(std::move(all), (sizeof(ScanEntry) + 7) / 8);
  integrate::run_tasks_here_first(slots, options, [&](int i, double* numbers) {
    const Candidate& m = *(models.begin() + i);
    const ScanEntry entry = entry_of(m.na, m.nb, m.nk, m.columns, fe, fv);
    std::memcpy(numbers, &entry, sizeof entry);
  });
  for (int i = 0; i < slots.tasks(); ++i) {
    const Candidate& m = *(models.begin() + i);
    if (slots.state(i) == integrate::SharedSlots::State::done) {
      std::memcpy(static_cast<void*>(&scan.entries.emplace_back()), slots.numbers(i), sizeof(ScanEntry));
    } else if (slots.state(i) == integrate::SharedSlots::State::failed) {
      scan.failures.push_back(text("na = ", m.na, ", nb = ", m.nb, ", nk = ", m.nk, ": ", slots.failure(i)));
    } else {
      ++scan.left;
    }
  }
}

}  // namespace

OrderScan order_scan(const IdData& e, const IdData* v, Range na, Range nb, Range nk,
                     const std::string& criterion, const integrate::WorkerOptions& options) {
  check(na, "na", 0);
  check(nb, "nb", e.inputs() ? 1 : 0);
  check(nk, "nk", 0);
  if (v && (v->outputs() != e.outputs() || v->inputs() != e.inputs()))
    throw Error("estimation and validation data differ in their signals");
  const auto inputs = static_cast<std::size_t>(e.inputs());
  const Orders largest = largest_orders(e, na, nb, nk);
  if (inputs == 0) nb = nk = {0, 0};
  const Factored fe = factored(e, largest), fv = v ? factored(*v, largest) : Factored{};
  OrderScan scan;
  scan.na = na;
  scan.nb = nb;
  scan.nk = nk;
  scan.criterion = criterion;
  scan.rows = fe.rows;
  scan.validation_rows = fv.rows;
  scan.outputs = e.outputs();
  make_models(scan, candidates(na, nb, nk, largest, inputs), fe, fv, options);
  if (scan.entries.empty() && scan.left > 0) throw Interrupted();
  if (scan.entries.empty())
    throw Error(text("no model could be estimated; the first error: ", scan.failures.front()));
  const auto better = [](const std::string& name) {
    return [name](const ScanEntry& x, const ScanEntry& y) {
      const double a = value_of(x, name), b = value_of(y, name);
      return a != b ? a < b : x.estimation.parameters < y.estimation.parameters;
    };
  };
  std::stable_sort(scan.entries.begin(), scan.entries.end(), better(criterion));
  for (const char* name : names) {
    if (!v && std::string(name) == "fit") continue;
    const auto best = std::min_element(scan.entries.begin(), scan.entries.end(), better(name));
    scan.best[name] = static_cast<std::size_t>(best - scan.entries.begin());
  }
  return scan;
}

namespace {

/// " (na = 10, nk = 1: at the end of the range)", if a wider range may contain a better model.
std::string on_the_edge(const OrderScan& s, const ScanEntry& e) {
  std::vector<std::string> words;
  const auto add = [&](const char* name, const Range& r, int value, int least) {
    if (r.from < r.to && (value == r.to || (value == r.from && value > least)))
      words.push_back(text(name, " = ", value));
  };
  add("na", s.na, e.na, 0);
  add("nb", s.nb, e.nb, 1);
  add("nk", s.nk, e.nk, 0);
  return words.empty() ? "" : text(" (", join(words, ", "), ": at the end of the range)");
}

}  // namespace

std::string describe(const OrderScan& s) {
  const auto number = [](double v) {
    return v == 0 || v == -INFINITY ? std::string("exact")
           : std::isfinite(v)       ? rounded(v, 6)
                                    : std::string("–");
  };
  const bool validated = s.validation_rows > 0;
  std::string out = text(
      "order scan: ", s.entries.size(),
      s.outputs > 1 ? text(" coupled ARX models of ", s.outputs, " outputs") : std::string(" ARX models"),
      " on the same ", s.rows, " rows", validated ? text(", validated on ", s.validation_rows, " rows") : "",
      "\n");
  Table table(std::vector<bool>(9, true));
  std::vector<std::string> heading{"na",  "nb",  "nk", "d", s.outputs > 1 ? "det V" : "loss",
                                   "FPE", "AIC", "BIC"};
  if (validated) heading.push_back("validation fit %");
  table.row(heading);
  constexpr std::size_t shown = 10;  // rows that a screen holds beside the text around them
  for (std::size_t i = 0; i < std::min(shown, s.entries.size()); ++i) {
    const ScanEntry& e = s.entries[i];
    std::vector<std::string> row{std::to_string(e.na),      std::to_string(e.nb),
                                 std::to_string(e.nk),      std::to_string(e.estimation.parameters),
                                 number(e.estimation.loss), number(e.estimation.fpe),
                                 number(e.estimation.aic),  number(e.estimation.bic)};
    if (validated) row.push_back(rounded(e.validation_fit, 6));
    table.row(row);
  }
  out += table.str(2);
  if (s.entries.size() > shown)
    out += text("  … ", s.entries.size() - shown, " more; sorted by ", s.criterion, "\n");
  for (const auto& [name, i] : s.best) {
    const ScanEntry& e = s.entries[i];
    out += text("  best by ", name == "fit" ? "validation fit" : name, ": na = ", e.na, ", nb = ", e.nb,
                ", nk = ", e.nk, on_the_edge(s, e), "\n");
  }
  if (s.left > 0)
    out += text("  interrupted: ", s.left, s.left == 1 ? " model was" : " models were", " not made\n");
  for (const std::string& failure : s.failures) out += text("  failed: ", failure, "\n");
  out.pop_back();
  return out;
}

}  // namespace pendula::sysid
