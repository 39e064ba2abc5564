// Estimated models as linear systems. Reads arguments, calls src/sysid and src/lti.
#include "base/text.hpp"
#include "lua/bind/lti/lti.hpp"
#include "lua/bind/sysid/sysid.hpp"
#include "sysid/model/predictor.hpp"
#include "sysid/model/state_space.hpp"

namespace pendula::lua {

using Eigen::Index;
using sysid::IdModel;
using sysid::PolyModel;

namespace {

/// num/den in q⁻¹ as a fraction in z.
lti::Fraction fraction(const Vec& num, const Vec& den) {
  const auto polynomial = [](const Vec& c, Index size) {
    lti::Polynomial q;
    for (Index k = size - 1; k >= 0; --k) q.push_back(k < c.size() ? Expr(c[k]) : Expr(0));
    return q;
  };
  Index degree = num.size();
  while (degree > 0 && num[degree - 1] == 0) --degree;
  const Index size = std::max(degree, den.size());
  return {polynomial(num, size), polynomial(den, size)};
}

/// G: B/(A F) from u to y; with `noise` H: C/(A D) from e to y.
lti::System transfer(const IdModel& m, bool noise) {
  std::vector<lti::Fraction> list;
  const auto p = static_cast<Index>(m.outputs.size()), inputs = noise ? p : m.inputs;
  for (Index i = 0; i < p; ++i) {
    const sysid::Polynomials& row = m.outputs[i].p;
    for (Index j = 0; j < inputs; ++j) {
      const auto k = static_cast<std::size_t>(j);
      if (noise)
        list.push_back(i == j ? fraction(row.C, sysid::convolve(row.A, row.D))
                              : fraction(Vec::Zero(1), Vec::Ones(1)));
      else
        list.push_back(fraction(row.B[k], k < row.F.size() ? sysid::convolve(row.A, row.F[k]) : row.A));
    }
  }
  return lti::make_tf(std::move(list), static_cast<int>(p), static_cast<int>(inputs), Expr(m.outputs[0].Ts));
}

/// The same for models with states: state-space models, and outputs that are coupled.
lti::System states(const IdModel& m, bool noise) {
  const sysid::StateSpaceModel s = m.state_space ? *m.state_space : sysid::observer_form(m);
  const auto entries = [](const Mat& v) { return MatX(v.unaryExpr([](double x) { return Expr(x); })); };
  const Index p = s.C.rows();
  return lti::make_ss(entries(s.A), entries(noise ? s.K : s.B), entries(s.C),
                      entries(noise ? Mat(Mat::Identity(p, p)) : s.D), Expr(m.outputs[0].Ts));
}

lti::System as_system(Call& call) {
  const IdModel& m = idmodel_of(call);
  const std::string what = call.string(2, "what", "plant");
  if (what != "plant" && what != "noise")
    throw Error(text("unknown part '", what, "' (\"plant\": from u to y; \"noise\": from e to y)"));
  const bool noise = what == "noise";
  if (!noise && m.inputs == 0)
    throw Error(
        "a model without inputs has no transfer function from u to y; mod:tf(\"noise\") is that from e to y");
  lti::System g = m.state_space || m.coupled ? states(m, noise) : transfer(m, noise);
  for (const PolyModel& row : m.outputs) g.output_names.push_back(row.y_name);
  const std::vector<std::string>& u = m.outputs[0].u_names;
  if (!noise) {
    g.input_names.assign(u.begin(), u.begin() + m.inputs);
  } else {
    for (Index i = 1; i <= g.inputs; ++i)
      g.input_names.push_back(g.inputs == 1 ? "e" : "e" + subscript(static_cast<long>(i)));
  }
  return g;
}

int model_tf(Call& call) { return push_system(call, lti::to_tf(as_system(call))); }
int model_ss(Call& call) { return push_system(call, lti::to_ss(as_system(call))); }

/// The one-step predictor with the numerical estimates.
int model_predictor(Call& call) {
  const IdModel& m = idmodel_of(call);
  if (m.state_space || m.outputs.size() != 1)
    throw Error("the predictor is written out for polynomial models with one output; see mod:predict(d)");
  const PolyModel& row = m.outputs[0];
  const auto symbols = [](const Vec& v) { return VecX(v.unaryExpr([](double x) { return Expr(x); })); };
  sysid::SymbolicPolynomials p;
  p.A = symbols(row.p.A);
  p.C = symbols(row.p.C);
  p.D = symbols(row.p.D);
  for (const Vec& b : row.p.B) p.B.push_back(symbols(b));
  for (const Vec& f : row.p.F) p.F.push_back(symbols(f));
  return call.push(std::make_shared<const sysid::Predictor>(sysid::predictor(p, row.u_names)));
}

}  // namespace

extern const Module idmodel_systems_module = {
    "identification",
    "",
    {
        {"idmodel:tf", model_tf, R"(mod:tf(["plant" | "noise"]) -> G)",
         R"(The transfer functions B(q)/(A(q) F(q)) of an estimated model from u to y as a discrete linear
            system, or with "noise" C(q)/(A(q) D(q)) from e to y: G:poles(), G:bode(), G:step(), d2c(G).)",
         R"(
            d = iddata{ y = {1, .5, .25, .125}, u = {0, 1, 0, 0}, Ts = 1 }
            print(arx(d, { na = 1 }):tf "noise"))",
         R"(
            transfer function, sampling time 1
                 z
              ───────
              z - 1/2)"},
        {"idmodel:ss", model_ss, R"(mod:ss(["plant" | "noise"]) -> G)",
         "The same in state space; of n4sid its own matrices.", R"(
             d = iddata{ y = {0, 2, 1, 4, 2, 3}, u = {1, 0.5, 2, 1, 0, 1}, Ts = 1 }
             arx(d, { na = 1, nb = 1 }):ss().form)",
         "ss"},
        {"idmodel:predictor", model_predictor, "mod:predictor() -> predictor",
         "The one-step predictor ŷ(t) with the estimated numbers.", R"(
             d = iddata{ y = {0, 2, 1, 4, 2, 3}, u = {1, 0.5, 2, 1, 0, 1}, Ts = 1 }
             arx(d, { na = 1, nb = 1 }):predictor())",
         R"(
             ŷ(t) = 230 u(t - 1)/143 + 0.3496503497 y(t - 1)
               no parameters)"},
    }};

}  // namespace pendula::lua
