// All ARX models of a range of orders, and the criteria to choose one by.
#pragma once

#include <map>

#include "integrate/sweep/workers.hpp"
#include "sysid/model/id_model.hpp"

namespace pendula::sysid {

struct Range {
  int from = 1, to = 1;
};
struct ScanEntry {
  int na, nb, nk;
  Criteria estimation;
  double validation_loss = 0, validation_fit = 0;
};
struct OrderScan {
  std::vector<ScanEntry> entries;  ///< best first by `criterion`
  std::string criterion;
  Index rows = 0, validation_rows = 0, outputs = 1;
  Range na, nb, nk;
  std::map<std::string, std::size_t> best;  ///< per criterion: index into entries
  std::vector<std::string> failures;        ///< models whose worker process died, with the reason
  std::size_t left = 0;                     ///< models not made: Ctrl-C
};
/// All ARX models na × nb × nk on the rows that the largest one can use; one factorisation of the largest
/// regressor, then a small one per model. Several inputs share nb and nk; several outputs share na, feed each
/// other, and are judged by det(EᵀE/N) and the mean fit. criterion: "fpe", "aic", "bic", "fit" (validation).
/// Where it pays, worker processes make the models; the result does not depend on them.
OrderScan order_scan(const IdData& e, const IdData* v, Range na, Range nb, Range nk,
                     const std::string& criterion, const integrate::WorkerOptions& options = {});
std::string describe(const OrderScan& s);

}  // namespace pendula::sysid
