// Estimated models of data with one or several outputs.
#pragma once

#include "sysid/model/model.hpp"
#include "sysid/noise/likelihood.hpp"

namespace pendula::sysid {

struct StateSpaceModel;

/// One polynomial model per output; in a coupled model the other outputs are further inputs (delay at least
/// 1). A state-space model has the criteria of each output in `outputs` and no polynomials.
struct IdModel {
  std::vector<PolyModel> outputs;
  bool coupled = false;
  Index inputs = 0;
  std::shared_ptr<const StateSpaceModel> state_space;
};

/// The data as output i of a coupled model sees it: the other outputs appended to the inputs.
IdData channel(const IdData& d, Index output, bool coupled);

/// Orders per output; couplings[i][j]: how many past values of output j enter output i (coupled ARX).
IdModel arx(const IdData& d, const std::vector<Orders>& orders,
            const std::vector<std::vector<int>>& couplings, InitialCondition start);

/// The rows of the regressor of one output with the samples they explain. Throws Error if no row is usable.
Regression regression(const IdData& d, Index output, const Orders& orders, InitialCondition start);
/// ARX by weighted least squares; weights or covariance per sample of the data, or per row of the regressor.
/// The criteria are those of the unweighted errors.
PolyModel arx(const IdData& d, Index output, const Orders& orders, InitialCondition start,
              Weighting weighting);
/// ARX by maximum likelihood: the least-squares model with θ, covariance and criteria of this density.
PolyModel arx(const IdData& d, Index output, const Orders& orders, InitialCondition start,
              const Density& density);

/// The responses of all outputs; the simulation of a coupled model feeds simulated outputs to each other.
std::vector<Response> predict(const IdModel& m, const IdData& d, Index horizon, Seed seed);

/// The model with other parameters, outputs one after the other; of a state-space model the entries of A, B,
/// C, D (with feedthrough) and K (unless it is 0), column by column. Throws Error on a wrong size.
IdModel with_parameters(const IdModel& m, const Vec& theta);
/// θ in that order.
Vec all_parameters(const IdModel& m);

std::string describe(const IdModel& m);

}  // namespace pendula::sysid
