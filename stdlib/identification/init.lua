-- Identification beyond polynomial models: spectra, impulse responses, recursive estimates, continuous time,
-- nonlinearities with given bases, uncertainty. The computations are read when they are first asked for.

local parts = {}
local function late(part, name)
  return function(...)
    parts[part] = parts[part] or include("identification/" .. part)
    return parts[part][name](...)
  end
end

-- The options of each, and which argument they are.
local input, output = option("input", "integer or string", "which input, by number or name", "1"),
  option("output", "integer or string", "which output", "1")
local segment = option("segment", "integer", "samples of the pieces that are averaged")
local level = option("level", "number", "probability of the bands", "0.95")
local ic = option("ic", "string", "the state before the first sample", '"estimate"', "zero|estimate")
local recursive = { option("na", "integer", "past outputs: coefficients of A(q)"),
  option("nb", "integer", "past inputs: coefficients of B(q)"),
  option("nk", "integer", "delay of the input, in samples", "1"),
  option("forgetting", "number", "weight of a sample for the next one, λ", "1"),
  option("drift", "number or list",
    "variance per sample of a random walk of the parameters, in units of the noise",
    "0"),
  option("theta0", "list", "parameters to begin with"),
  option("P0", "number", "their variance", "1e6") }

local rows_of = {
  spa = { 2, option("window", "integer", "lags that are weighted: more show sharper peaks and more noise"),
    option("w", "list", "frequencies, in rad/s"), input, output },
  etfe = { 2, option("smooth", "integer", "neighbours on both sides that are averaged", "0"), input, output },
  welch = { 2, segment, option("Ts", "number", "the sampling time, in s", "1") },
  coherence = { 2, segment, input, output },
  impulse_estimate = { 2, option("lags", "integer", "how long the response is, in samples"),
    option("kernel", "string", "regularised: smooth and decaying", '"none"', "TC|DC|none"),
    option("whiten", "integer", "order of the ARX model of the noise", "10"), input, output },
  cra = { 2, option("lags", "integer", "how long the response is, in samples", "20"),
    option("whiten", "integer", "order of the AR model of the input", "10"), input, output },
  delay_estimate = { 2, option("na", "integer", "past outputs of the models", "2"),
    option("nb", "integer", "past inputs of the models", "2"),
    option("range", "list", "the least and the largest delay, in samples", "{0, 20}"), input, output },
  rarx = { 2, table.unpack(recursive) },
  rarmax = { 2, option("nc", "integer", "coefficients of C(q)", "1"), table.unpack(recursive) },
  process_model = { 3, ic, option("max_delay", "number", "the longest delay that is tried, in s") },
  tfest = { 2, option("np", "integer", "poles"), option("nz", "integer", "zeros", "np - 1"),
    option("delay", "number", "in s", "0"), ic },
  hammerstein = { 2, option("nb", "integer", "coefficients of B(q)"),
    option("nf", "integer", "coefficients of F(q)", "0"),
    option("nk", "integer", "delay of the input, in samples", "1"),
    option("input", "list or function", "functions gᵢ of the input"),
    option("output", "list or function", "functions hⱼ of the linear output") },
  uncertain = { false, level, input, output },
  ["idmodel:forecast"] = { 4, option("u", "list or matrix", "future inputs, one row per step"), level },
}

local function row(name, sig, text, part, example, gives, internal)
  local rows = rows_of[name]
  doc { name = name, module = "identification", sig = sig, text = text, example = example, gives = gives,
    options = rows and table.move(rows, 2, #rows, 1, {}), options_at = rows and rows[1],
    late(part, internal or name) }
end

local swing = "u = prbs(127)\ny = {}\nfor t = 1, 127 do y[t] = 0.5*(y[t-1] or 0) + (t > 1 and u[t-1] or "
  .. "0) end\n"
  .. "d = iddata{ y = y, u = u }\n"

row("spa", "spa(d [, { window = M, w = frequencies, input = 1, output = 1 }]) -> spectral estimate",
  [[The frequency response from the smoothed spectra of the data (Blackman and Tukey, Hann window of M lags):
    lists .w .mag .phase .re .im, .std of the gain, .noise (the spectrum of the disturbance) and .coherence;
    :plot() with ±2σ. A wider window shows sharper peaks and more noise. In a closed
    loop the estimate lies between the plant and -1/controller (cra shows feedback): take arx or armax.]],
  "spectra",
  "u = prbs(127)\ny = {}\nfor t = 1, 127 do y[t] = 2*u[t] end\n"
    .. "r = spa(iddata{ y = y, u = u })\nreturn math.abs(r.mag[64] - 2) < 1e-6, r.coherence[64] > 0.999",
  "true true")
row("etfe", "etfe(d [, { smooth = 0, input = 1, output = 1 }]) -> spectral estimate",
  [[The empirical transfer function estimate Y(ω)/U(ω) at the Fourier frequencies, smoothed over `smooth`
    neighbours on both sides; unbiased for periodic inputs. Frequencies that the input does not contain are
    left out.]], "spectra",
  "u = prbs(127)\ny = {}\nfor t = 1, 127 do y[t] = 2*u[t] end\nreturn math.abs(etfe(iddata{ y = y, u = "
    .. "u }).mag[7] - 2) < 1e-9",
  "true")
row("welch", "welch(x [, { segment =, Ts = 1 }]) -> power density",
  [[The power density of a signal by Welch's averages (Hann window, half overlap): .f in Hz, .power per Hz,
    one-sided, so that its integral is the variance.]], "spectra",
  "r = welch({1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1}, { segment = 8 })\nreturn #r.f, "
    .. "r.power[5] > r.power[2]",
  "5 true")
row("coherence", "coherence(d [, { segment =, input = 1, output = 1 }]) -> coherence",
  [[κ² of input and output by Welch's averages, between 0 (nothing in common) and 1 (linear, without noise):
    .f .value, and .bound, which chance exceeds in 1 % of the frequencies.]], "spectra",
  "u = prbs(127)\ny = {}\nfor t = 1, 127 do y[t] = 2*u[t] end\nreturn coherence(iddata{ y = y, u = u "
    .. "}).value[9] > 0.999999", "true")
row("impulse_estimate",
  "impulse_estimate(d [, { lags =, kernel = \"none\", whiten = 10, input = 1, output = 1 }]) -> impulse "
    .. "estimate",
  [[The impulse response by a FIR model of data whose noise is made white by a long ARX model: .lags .g .std
    .bound (99 %); kernel = "TC" or "DC": regularised.]], "impulse",
  swing .. "r = impulse_estimate(d, { lags = 3, whiten = 0 })\nreturn math.abs(r.g[1]) < 0.1, "
    .. "math.abs(r.g[2] - 1) < 0.1", "true true")
row("cra", "cra(d [, { lags = 20, whiten = 10, input = 1, output = 1 }]) -> impulse estimate",
  [[Correlation analysis: the impulse response R_yu(k)/R_u(0) after the input was made white by an AR model,
    negative lags included (what stands out there is feedback), with the 99 % bound.]], "impulse",
  swing .. "r = cra(d, { lags = 4 })\nreturn r.lags[1], #r.g", "-1 6")
row("delay_estimate",
  "delay_estimate(d [, { na = 2, nb = 2, range = {0, 20}, input =, output = }]) -> nk, table",
  [[The delay in samples of the ARX model that explains most, all on the same rows; of delays that explain the
    data equally well (at 99 %) the longest. The second result prints the losses; .losses by delay and .ratio,
    the next best loss over the best.]], "impulse",
  swing .. "print((delay_estimate(d, { range = {0, 5}, na = 1, nb = 1 })))", "1")
row("rarx", "rarx(d, { na =, nb =, nk = 1, forgetting = 1, drift = 0, theta0 =, P0 = 1e6 }) -> recursive "
  .. "estimate",
  [[ARX parameters sample by sample: recursive least squares with exponential forgetting, or, with drift, the
    Kalman filter of parameters in a random walk with that variance per sample (in units of the noise).
    .theta and .std (a list per sample) .errors; :plot(). Missing samples leave the estimate as it is.]],
  "recursive", swing .. "r = rarx(d, { na = 1, nb = 1 })\nprint((\"%.4f\"):format(r.theta[127][1]))",
    "-0.5000")
row("rarmax", "rarmax(d, { na =, nb =, nc = 1, nk = 1, forgetting = 1, … }) -> recursive estimate",
  [[The same for ARMAX by recursive prediction errors, C kept stable (Ljung, 2nd ed., §11.4). With
    forgetting = 1 the first hundred samples count less: their gradients belong to a poor C.]], "recursive",
  swing .. "return #rarmax(d, { na = 1, nb = 1, nc = 1 }).names", "3")
row("process_model", "process_model(d, type [, { ic = \"estimate\", max_delay = }]) -> continuous model",
  [[K (1 + Tz s)/((1 + T1 s)(1 + T2 s) …) e^(-L s) from samples of a held input. type: "P" and the number of
    poles, then D (delay L), Z (zero), I (integrator), U (a complex pair, Tw and ζ): "P1D", "P2ZU".
    .theta .std .names .system .fit; :plot(d); uncertain(r).]], "continuous",
  "u, y = {}, {}\nfor t = 1, 40 do u[t] = (t // 7) % 2 end\ny = held_response({2}, {3, 1}, 0.5, u, 1)\n"
    .. "r = process_model(iddata{ y = y, u = u }, \"P1D\", { ic = \"zero\" })\n"
    .. "print((\"%.4f %.4f %.4f\"):format(r.theta[1], r.theta[2], r.theta[3]))", "2.0000 3.0000 0.5000")
row("tfest", "tfest(d, { np =, nz = np - 1, delay = 0, ic = \"estimate\" }) -> continuous model",
  [[A transfer function in continuous time, b(s)/a(s) e^(-delay s) with a monic, by output errors; begins at a
    discrete model and at poles over two decades.]], "continuous",
  "u, y = {}, {}\nfor t = 1, 60 do u[t] = (t // 7) % 2 end\ny = held_response({2}, {1, 1, 1}, 0, u, 0.5)\n"
    .. "r = tfest(iddata{ y = y, u = u, Ts = 0.5 }, { np = 2, nz = 0, ic = \"zero\" "
      .. "})\nprint((\"%.4f\"):format(r.theta[1]))",
  "2.0000")
row("hammerstein",
  "hammerstein(d, { nb =, nf = 0, nk = 1, input = { g1, … }, output = { h1, … } }) -> hammerstein wiener",
  [[A Hammerstein–Wiener model y = Σ dⱼ hⱼ(w), w = B/F Σ cᵢ gᵢ(u) with given functions of one number: .b .f .c
    .d (one coefficient of each basis is 1) .theta .std .fit; :simulate(d).]], "hammerstein",
  "u, y = {}, {}\nfor t = 1, 63 do u[t] = math.sin(t*t) end\n"
    .. "for t = 1, 63 do local v = u[t-1] or 0  y[t] = 0.5*(y[t-1] or 0) + v + 0.3*v^2 end\n"
    .. "r = hammerstein(iddata{ y = y, u = u }, { nb = 1, nf = 1, input = { function(x) return x end, "
    .. "function(x) return x^2 end } })\nprint((\"%.6f\"):format(r.c[2]/r.c[1]))", "0.300000")
row("uncertain", "uncertain(mod [, build] [, { level = 0.95, input =, output = }]) -> uncertain system",
  [[The uncertainty of a model from the covariance of its estimate: u:bode([w]), u:nyquist([w]),
    u:step([to]), u:poles(), each with standard deviations and :plot() with bands. mod: an estimated model,
    a process model, or a fit of parameters with a function from the parameters to a linear system.]],
  "uncertain",
  "r = fir(iddata{ y = {0, 2.1, 0.9, 4.1, 1.9}, u = {1, 0.5, 2, 1, 0} }, { nb = 1 })\n"
    .. "b = uncertain(r):bode{ 1 }\nreturn math.abs(b.mag_std[1] - r.std[1]) < 1e-9", "true")
row("idmodel:forecast", "mod:forecast(d, steps [, { u =, level = 0.95 }]) -> forecast",
  [[The forecast after the data, with its standard deviation and a picture: .t .y .std, :plot(). The future
    inputs are needed where the model has some.]], "uncertain",
  "d = iddata{ y = {8, 4, 2, 1} }\nprint(arx(d, { na = 1 }):forecast(d, 2).y.T)", "0.5  0.25", "forecast")
