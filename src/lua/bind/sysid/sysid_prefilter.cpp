// d:filter, d:delay. Reads arguments, calls src/sysid/model/prefilter.
#include "sysid/model/prefilter.hpp"

#include <limits>

#include "base/text.hpp"
#include "lua/bind/lti/lti.hpp"
#include "lua/bind/sysid/sysid.hpp"

namespace pendula::lua {

using Eigen::Index;
using sysid::IdData;

namespace {

const IdData& recorded(Call& call) { return call.object<IdData>(1, "iddata"); }
int push_prepared(Call& call, IdData d) { return call.push(std::make_shared<const IdData>(std::move(d))); }

/// num/den of a discrete system in powers of q⁻¹.
sysid::FilterSection section_of(const lti::System& given, double Ts) {
  if (!given.siso())
    throw Error(text("the filter must have one input and one output, but it has ", given.inputs, " and ",
                     given.outputs));
  const lti::System g = lti::to_tf(lti::with_numbers(given));
  if (g.continuous())
    throw Error(text("the filter is in continuous time: d:filter(c2d(F, ", rounded(Ts), ", \"tustin\"))"));
  if (const double own = lti::number(g.Ts); std::fabs(own - Ts) > 1e-9 * Ts)
    throw Error(text("the filter is sampled every ", rounded(own), " s, the data every ", rounded(Ts), " s"));
  const lti::Polynomial &num = g.tf[0].num, &den = g.tf[0].den;
  if (num.size() > den.size())
    throw Error("the filter needs future samples: its numerator has the higher degree");
  sysid::FilterSection f{Vec::Zero(static_cast<Index>(den.size())), Vec(static_cast<Index>(den.size()))};
  for (std::size_t k = 0; k < den.size(); ++k) f.den[den.size() - 1 - k] = lti::number(den[k]);
  for (std::size_t k = 0; k < num.size(); ++k) f.num[den.size() - 1 - k] = lti::number(num[k]);
  const double lead = f.den[0];
  f.num /= lead;
  f.den /= lead;
  return f;
}

int filter(Call& call) {
  const IdData& d = recorded(call);
  if (!call.has(2)) call.wrong(2, "filter", "a band { w = { low, high } } in rad/s or a system F");
  if (call.is<lti::System>(2) && call.count() > 2)
    throw Error(
        "d:filter(F) takes the filter alone; w and order belong to the other form, d:filter{ w = { low, high } }");
  if (call.is<lti::System>(2))
    return push_prepared(call, sysid::filtered(d, {section_of(read_system(call, 2, "filter"), d.Ts)}));
  const Options o = call.options(2);
  if (!o.has("w"))
    throw Error("w is missing: d:filter{ w = { low, high } } in rad/s, w = { 0, high } for a lowpass");
  const Vec w = to_data(call.L, o.push("w"), "w").reshaped();
  lua_settop(call.L, call.count());
  if (w.size() != 2)
    throw Error(text("w must be { low, high } in rad/s, got ", w.size(),
                     w.size() == 1 ? " number" : " numbers",
                     "; w = { 0, high } is a lowpass, { low, 1/0 } a highpass"));
  return push_prepared(
      call,
      sysid::filtered(d, sysid::butterworth(w[0], w[1], static_cast<int>(o.integer("order", 4)), d.Ts)));
}

/// One whole number for all signals, or one per signal.
std::vector<Index> delays(Call& call, const Options& o, const char* key, Index count) {
  std::vector<Index> out(static_cast<std::size_t>(count), 0);
  if (!o.has(key)) return out;
  const std::vector<int> list = to_whole_numbers(call.L, o.push(key), key);
  lua_settop(call.L, call.count());
  if (list.size() != 1 && static_cast<Index>(list.size()) != count)
    throw Error(text(key, " must be one delay, or ", count, ", one for each ",
                     *key == 'y' ? "output" : "input", ", got ", list.size()));
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = list[list.size() == 1 ? 0 : i];
    if (out[i] < 0)
      throw Error(text(key, " = ", out[i], ": delays are not negative; delay the other signals instead"));
  }
  return out;
}

int delay(Call& call) {
  const IdData& d = recorded(call);
  call.table(2, "delays");
  const Options o = call.options(2);
  return push_prepared(
      call, sysid::delayed(d, delays(call, o, "y", d.outputs()), delays(call, o, "u", d.inputs())));
}

const OptionTable filter_options = {
    {"w", "list", "", "{ low, high }: the frequencies that pass, in rad/s; { 0, high }: a lowpass"},
    {"order", "integer", "4", "order of the Butterworth filter at each end"},
};
const OptionTable delay_options = {
    {"y", "integer or list", "0", "samples by which the outputs come later"},
    {"u", "integer or list", "0", "samples by which the inputs come later"},
};

}  // namespace

extern const Module prefilter_module = {
    "identification",
    "",
    {
        {"iddata:filter", filter, "d:filter{ w = { low, high }, order = 4 } or d:filter(F) -> iddata",
         R"(All signals through one filter, from rest: a Butterworth filter for frequencies in rad/s, or a system F with
            the sampling time of the data. The model from u to y stays; the fit weighs its errors by the filter
            (prefiltering, focus). Remove offsets first: d:detrend().)",
         "print((\"%.6f\"):format(iddata{ y = { 1, 0, 0 }, Ts = 0.5 }:filter{ w = { 0, 2 }, order = 1 }.y(1, 1)))",
         "0.353296", &filter_options},
        {"iddata:delay", delay, "d:delay{ u = { 3, 0 }, y = } -> iddata",
         R"(Delays signals by whole samples, each by its own number, so that a model needs no states for known delays
            (nkshift; n4sid of inputs with different delays). The first samples, which have no values then, are left out. Data for
            validation are delayed alike.)",
         "print(iddata{ y = { 1, 2, 3 }, u = { 4, 5, 6 } }:delay{ u = 1 }.u.T)", "4  5", &delay_options},
    }};

}  // namespace pendula::lua
