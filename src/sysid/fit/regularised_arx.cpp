#include "sysid/fit/regularised_arx.hpp"

#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "sysid/regression/structured.hpp"

namespace pendula::sysid {

PolyModel regularised_arx(const IdData& d, Index output, const Orders& orders, InitialCondition start,
                          Kernel kernel) {
  // supplies names, rows, and error messages for uninformative data
  PolyModel m = arx(d, output, orders, start);
  const Regressor regressor(d, output, m.orders, start);
  const TriangularFactor factor = triangular_factor(regressor);
  std::vector<Index> sizes;
  std::vector<std::string> labels;
  for (const Regressor::Group& g : regressor.groups()) {
    sizes.push_back(g.count);
    labels.push_back(m.names[g.first]);
  }
  const RegularisedFit fit = regularised(factor.R(), factor.rows(), sizes, kernel);
  m.theta = fit.theta;
  m.covariance = fit.covariance;
  m.std = fit.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  m.p = polynomials_of(m.theta, m.orders);
  m.exact = false;
  m.identifiability.directions.clear();
  m.identifiability.advice.clear();
  const auto N = static_cast<double>(factor.rows());
  const double variation = m.quality.fit < 100 ? m.quality.sse / std::pow(1 - m.quality.fit / 100, 2)
                                               : factor.R().col(factor.R().cols() - 1).squaredNorm();
  m.quality = criteria(fit.sse, factor.rows(), static_cast<Index>(std::lround(fit.effective)), variation);
  m.quality.sigma2 = fit.sigma2;
  m.quality.aic = N * std::log(m.quality.loss) + 2 * fit.effective;
  m.quality.bic = N * std::log(m.quality.loss) + fit.effective * std::log(N);
  std::vector<std::string> groups;
  for (Index k = 0; k < static_cast<Index>(fit.groups.size()); ++k)
    groups.push_back(
        text(labels[k], " …: decay ", rounded(fit.groups[k].decay, 3),
             kernel == Kernel::dc ? text(", correlation ", rounded(fit.groups[k].correlation, 3)) : ""));
  m.weighting = text("regularised least squares (", kernel == Kernel::tc ? "TC" : "DC", " kernel; ",
                     join(groups, "; "), "; ", rounded(fit.effective, 3), " effective parameters)");
  m.log_likelihood = fit.log_likelihood;
  if (!d.u.hasNaN() && d.samples() > m.p.memory())
    m.simulation.percent = simulation_fit(m, d, start == InitialCondition::zero ? Seed::zero : Seed::data);
  return m;
}

}  // namespace pendula::sysid
