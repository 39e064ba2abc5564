// Explains why data do not determine the parameters of a model.
#include <cmath>

#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "sysid/data/excitation.hpp"
#include "sysid/model/model.hpp"

namespace pendula::sysid {
namespace {

const char* excitation_words(int order) {
  return order == 0 ? "is zero" : order == 1 ? "does not vary" : "contains too few frequencies";
}

bool touches(const PolyModel& m, char letter) {
  for (Index i = 0; i < m.identifiability.null_space.rows(); ++i)
    if (m.names[i][0] == letter && m.identifiability.null_space.row(i).cwiseAbs().maxCoeff() > 0) return true;
  return false;
}

/// Mean and standard deviation of the available samples.
std::pair<double, double> mean_and_deviation(const Eigen::Ref<const Vec>& x) {
  double n = 0, mean = 0, square = 0;
  for (const double v : x)
    if (std::isfinite(v)) {
      n += 1;
      square += (v - mean) * (v - mean) * (n - 1) / n;
      mean += (v - mean) / n;
    }
  return {mean, n > 1 ? std::sqrt(square / (n - 1)) : 0};
}

}  // namespace

std::vector<std::string> offsets_in(const IdData& d, Index output) {
  const auto [mean, deviation] = mean_and_deviation(d.y.col(output));
  constexpr Index least_samples = 20;  // a choice: fewer say little about a mean
  // three deviations: a signal that comes near 0 needs no offset, nor does one that begins at 0
  // (a step response)
  double nearest = std::abs(mean);
  for (const double v : d.y.col(output))
    if (std::isfinite(v)) nearest = std::min(nearest, std::copysign(1, mean) * v);
  if (!(std::abs(mean) > 3 * deviation && nearest > deviation) || deviation == 0 ||
      d.samples() < least_samples)
    return {};
  return {text(d.y_names[output], " has the mean ", rounded(mean, 4), " and deviates from it by ",
               rounded(deviation, 3), "; the model has no term for an offset: d:detrend() removes it")};
}

std::vector<std::string> why_not_identifiable(const IdData& d, const PolyModel& m, Index rows) {
  std::vector<std::string> out;
  const auto need = static_cast<Index>(m.names.size());
  if (rows < need)
    out.push_back(text("there ", rows == 1 ? "is 1 row" : text("are ", rows, " rows"), " for ", need,
                       " parameters: at least ", need, " rows are needed; take more samples",
                       m.left_out > 0 ? " or fill the missing ones: d:fill()" : ""));
  bool poor = false;
  for (Index k = 0; rows >= need && k < d.inputs(); ++k) {
    const int nb = m.orders.nb[k];
    if (nb == 0) continue;
    const int order = excitation_order(d, k, nb + 1);
    if (order >= nb) continue;
    poor = true;
    out.push_back(text("the input ", d.u_names[k], " ", excitation_words(order),
                       ": it is persistently exciting of order ", order, ", nb = ", nb, " needs order ", nb,
                       "; excite with prbs(…) or multisine(…), or lower nb"));
  }
  if (rows >= need && !poor) {
    if (touches(m, 'a') && touches(m, 'b'))
      out.push_back(
          m.exact ? "past outputs and inputs depend on each other: the data follow a model of lower order "
                    "exactly, so that common factors of A and B are free; lower na and nb by one"
                  : "past outputs and inputs depend on each other: u is computed from y by a feedback of low "
                    "order; add an external reference to the loop, or a delay or more terms to the feedback");
    else if (touches(m, 'a'))
      out.push_back(
          "the past outputs are linearly dependent (a constant or zero output?); lower na, or take an input "
          "that excites the system more");
    else
      out.push_back("the inputs depend on each other; excite them independently");
  }
  if (m.left_out > 0)
    out.push_back(text(counted(m.left_out, "row"), m.left_out == 1 ? " is" : " are",
                       " left out because of missing samples"));
  return out;
}

}  // namespace pendula::sysid
