// Were the data taken in closed loop? Residuals of a long ARX model are the innovations whatever the loop; in open loop
// they know nothing of later inputs (Ljung, 2nd ed., §13.4).
#include "base/error.hpp"
#include "base/text.hpp"
#include "sysid/model/validation.hpp"

namespace pendula::sysid {

std::string later_inputs_text(const Validation& v) {
  std::vector<std::string> counts;
  for (std::size_t i = 0; i < v.u_names.size(); ++i)
    counts.push_back(text(v.u_names[i], ": ", v.later_outside[i], " of ", v.lags, " correlations outside ±",
                          rounded(v.cross_bound[static_cast<Index>(i)], 3)));
  return join(counts, ", ");
}

std::string feedback_in(const IdData& d, Index output) {
  constexpr int order = 10;
  const IdData one = channel(d, output, false);
  const Index inputs = one.inputs(), parameters = order * (1 + inputs);
  if (inputs == 0 || one.experiments() > 1 || one.samples() < 10 * parameters) return "";
  if (!one.y.allFinite() || !one.u.allFinite()) return "";
  Orders orders;
  orders.na = order;
  orders.nb.assign(static_cast<std::size_t>(inputs), order);
  orders.nk.assign(static_cast<std::size_t>(inputs), 1);
  orders.nf.assign(static_cast<std::size_t>(inputs), 0);
  try {
    IdModel m;
    m.inputs = inputs;
    m.outputs = {arx(one, 0, orders, InitialCondition::drop)};
    const Validation v = validate(m, 0, one);
    // residuals that past inputs explain speak of a model that is too small, not of feedback
    return v.feedback && v.white && v.independent ? later_inputs_text(v) : "";
  } catch (const UserFacing&) {
    return "";  // data that no such model can be estimated from say nothing
  }
}

std::string feedback_warning(const IdData& d, Index output, const std::string& consequence) {
  const std::string seen = feedback_in(d, output);
  if (seen.empty()) return "";
  return text("the data may have been taken in closed loop (", seen,
              " of residuals and later inputs): ", consequence);
}

}  // namespace pendula::sysid
