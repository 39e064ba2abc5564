-- Control around models: closed loops, observers, the extended Kalman filter. Read when first asked for.

local parts = {}
local function late(name)
  return function(...)
    parts.loops = parts.loops or include "control/loops"
    return parts.loops[name](...)
  end
end

doc { name = "model:close", module = "lti design",
  sig = "sys:close{ u = law, …, [estimator, equations …] } -> model",
  text = [[The model with a law for its inputs, expressions of its variables:
    sys:close{ u = -K*(x - x0) }. DAEs of any index; estimators and equations of a controller stand beside
    the laws. The same as dae{ sys, u ~ law }.]],
  example = "x, u = var \"x\", input \"u\"\nloop = dae{ der(x) ~ x + u }:close{ u = -3*x }\n"
    .. "print(loop.equations[1], #loop.inputs)",
  gives = "x′ = -2 x 0", late "close" }

doc { name = "estimator", module = "lti design",
  sig = "estimator(sys, L, { y = h }) or estimator(G, L) -> estimator",
  text = [[An observer. Of a model: x̂′ = f(x̂, u) + L (y - h(x̂)) as equations for sys:close, with .x, the
    estimated states in the order of sys:linearize(at).states: est = estimator(sys, L, { y = x }), then
    sys:close{ u = -K*est.x, est }. Of a linear system: the observer as a system with the inputs u, y and the
    outputs ŷ, x̂. L: the transpose of place(G.A.T, G.C.T, poles), or lqe.]],
  example = "x, u = var \"x\", input \"u\"\nsys = dae{ der(x) ~ x + u }\n"
    .. "est = estimator(sys, 5, { y = x })\nprint(#sys:close{ u = -3*est.x[1], est }.equations)",
  gives = "2",
  options = { option("y", "expression or list", "the measured expressions of the model's variables") },
  options_at = 3, late "estimator" }

doc { name = "ekf", module = "lti design",
  sig = "ekf(sys, { data =, y =, Q =, R =, start =, P0 = 0, rtol = 1e-8, method = }) -> filtered states",
  text = [[The extended Kalman filter of a model (ODE or DAE of index 1) over samples: the state and its
    derivative by the last one come from the integrator and its sensitivities, algebraic variables included.
    Q: covariance that a sample adds to the states, R: of the measurements (numbers, variances or matrices);
    inputs are held; missing samples are bridged. .x .std (a list per sample) .t .names .innovations
    .log_likelihood; :plot().]],
  example = "x = var \"x\"\nr = ekf(dae{ der(x) ~ 0*x }, { data = iddata{ y = {1, 3}, Ts = 1 }, y = x, "
    .. "Q = 0, R = 1,\n  start = { x = 0 }, P0 = 1e9 })\nreturn math.abs(r.x[2][1] - 2) < 1e-6",
  gives = "true", options = {
    option("data", "iddata", "the samples"),
    option("y", "expression or list", "the measured expressions of the model's variables"),
    option("Q", "number or matrix", "covariance that a sample adds to the states"),
    option("R", "number or matrix", "covariance of the measurements"),
    option("start", "table", "the states at the first sample: { x = 1 }", "", "@variables"),
    option("P0", "number or matrix", "their covariance", "0"),
    option("rtol", "number", "relative tolerance of the integration", "1e-8"),
    option("method", "string or tableau", "of the integration", "", "@methods") },
  options_at = 2, late "ekf" }

doc { name = "kalman_result:plot", module = "lti design", sig = "r:plot([options]) -> figure",
  text = "The states with ± 2 standard deviations, a panel for each; options as in plot, for the first panel.",
  options = (include "plot/options").frame, options_at = 2,
  example = "r = kalman_filter(ss({{1}}, {0}, {1}, {0}, 1), 0, 1, { y = {1, 3, 2}, P0 = 9 })\nr:plot()",
  gives = "figure 'states, ± 2 σ': 2 series, 6 points", late "plot_states" }
