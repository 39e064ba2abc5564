-- Frequency responses straight from data, without a model: smoothed spectra (Ljung, 2nd ed., §6.4). With the
-- covariances R(τ) of the record and Hann's lag window w(τ) of width M,
--
--   Φ(ω) = Σ w(τ) R(τ) e^{-iωτ},   Ĝ = Φ_yu/Φ_u,   Φ_v = Φ_y - |Φ_yu|²/Φ_u,   κ² = |Φ_yu|²/(Φ_y Φ_u),
--   var Ĝ ≈ (1/N) Σ w² · Φ_v/Φ_u,   half of it in the direction of Ĝ.

local function centred(m, column)
  local list, sum = {}, 0
  for k = 1, m.rows do
    local v = m(k, column) + 0.0
    if v ~= v then fail "spa: samples are missing; fill them first: d:fill()" end
    list[k], sum = v, sum + v
  end
  for k = 1, #list do list[k] = list[k] - sum / #list end
  return list
end

-- (1/N) Σ a(t + τ) b(t) for τ = -M … M
local function covariance(a, b, M)
  local N, R = #a, {}
  for lag = -M, M do
    local sum = 0
    for t = math.max(1, 1 - lag), math.min(N, N - lag) do sum = sum + a[t + lag] * b[t] end
    R[lag] = sum / N
  end
  return R
end

-- Real and imaginary part of Σ w(τ) R(τ) e^{-iωτ} at ω in radians per sample.
local function transform(R, window, M, omega)
  local re, im = 0, 0
  for lag = -M, M do
    local v = window[lag] * R[lag]
    re, im = re + v * math.cos(omega * lag), im - v * math.sin(omega * lag)
  end
  return re, im
end

local spectral_estimate = { __name = "spectral estimate" }

function spectral_estimate.__tostring(r)
  local least, at = math.huge, 0
  for k, c in ipairs(r.coherence) do if c < least then least, at = c, r.w[k] end end
  return ("frequency response from %s to %s by smoothed spectra: %d samples, lag window of %d, "
    .. "%d frequencies up to %.4g rad/s\n  coherence at least %.3g (at ω = %.4g)"):format(r.input, r.output,
    r.samples,
    r.window, #r.w, r.w[#r.w], least, at)
end

spectral_estimate.__index = {
  plot = function(r, options)
    local db, low, high, degrees = {}, {}, {}, {}
    for k = 1, #r.w do
      local function decibels(v) return 20 * math.log(math.max(v, 1e-6 * r.mag[k]), 10) end
      db[k], low[k], high[k] = decibels(r.mag[k]), decibels(r.mag[k] - 2 * r.std[k]),
        decibels(r.mag[k] + 2 * r.std[k])
      degrees[k] = r.phase[k]
    end
    local below = figure { by = "plot", series = { { x = r.w, y = degrees, labels = { "phase" } } },
                           xlog = true, xlabel = "ω [rad/s]", ylabel = "phase [°]", legend = false }
    local base = { by = "plot", xlog = true, title = "Spectral estimate", ylabel = "gain [dB]",
                   below = { below }, series = { { x = r.w, y = db, labels = { r.output .. "/" .. r.input } },
                              { x = r.w, y = low, labels = { "± 2 σ" }, style = "dots" },
                              { x = r.w, y = high, labels = { "" }, style = "dots" } } }
    for key, value in pairs(options or {}) do base[key] = value end
    return figure(base)
  end,
}

local function read_options(options, N)
  options = options or {}
  if type(options) ~= "table" then
    fail "spa: options are a table { window = M, w = { … }, input = 1, output = 1 }"
  end
  for key in pairs(options) do
    if key ~= "window" and key ~= "w" and key ~= "input" and key ~= "output" then
      fail(("spa: unknown option '%s' (options: window, w, input, output)"):format(tostring(key)))
    end
  end
  local M = options.window or math.min(30, N // 10)
  if math.type(M) ~= "integer" or M < 2 or M >= N then
    fail(("spa: window, the width of the lag window, is a whole number from 2 to %d"):format(N - 1))
  end
  return M, options.input or 1, options.output or 1, options.w
end

local function spectral_analysis(d, options)
  if object_type(d) ~= "iddata" then fail "spa: expected data, iddata{ y = …, u = …, Ts = … }" end
  local N = d.y.rows
  if #d.u_names == 0 then fail "spa: the data has no input; periodogram(y) gives the spectrum of a signal" end
  local M, i, o, given = read_options(options, N)
  if not d.u_names[i] then fail(("spa: there is no input %s"):format(tostring(i))) end
  if not d.y_names[o] then fail(("spa: there is no output %s"):format(tostring(o))) end
  local y, u = centred(d.y, o), centred(d.u, i)
  local Ry, Ru, Ryu = covariance(y, y, M), covariance(u, u, M), covariance(y, u, M)
  if Ru[0] == 0 then fail(("spa: the input %s does not vary"):format(d.u_names[i])) end
  local window, squares = {}, 0
  for lag = -M, M do
    window[lag] = 0.5 * (1 + math.cos(math.pi * lag / (M + 1)))
    squares = squares + window[lag]^2
  end
  local r = setmetatable({ w = {}, re = {}, im = {}, mag = {}, phase = {}, std = {}, noise = {},
    coherence = {}, samples = N, window = M, input = d.u_names[i], output = d.y_names[o] }, spectral_estimate)
  local count, turn = given and #given or 128, 0
  for k = 1, count do
    local omega = given and given[k] * d.Ts or math.pi * k / count
    local Py, Pu = transform(Ry, window, M, omega), transform(Ru, window, M, omega)
    local re, im = transform(Ryu, window, M, omega)
    Pu, Py = math.max(Pu, 1e-12 * Ru[0]), math.max(Py, 1e-12 * Ry[0])
    local cross = re^2 + im^2
    r.w[k], r.re[k], r.im[k] = omega / d.Ts, re / Pu, im / Pu
    r.mag[k] = math.sqrt(cross) / Pu
    local angle = math.atan(im, re) * 180 / math.pi
    if k > 1 then turn = math.floor((r.phase[k - 1] - angle) / 360 + 0.5) * 360 end
    r.phase[k] = angle + turn
    r.noise[k] = math.max(0, Py - cross / Pu)
    r.coherence[k] = math.min(1, cross / (Py * Pu))
    r.std[k] = math.sqrt(0.5 * squares / N * r.noise[k] / Pu)
  end
  return r
end

doc { name = "spa", module = "identification",
  sig = "spa(d [, { window = M, w = frequencies, input = 1, output = 1 }]) -> spectral estimate",
  text = "The frequency response from the smoothed spectra of the data (Blackman and Tukey, Hann window of "
    .. "M lags): lists .w .mag .phase .re .im, .std of the gain, .noise (the spectrum of the disturbance) "
    .. "and .coherence; :plot() with ±2σ. A wider window shows sharper peaks and more noise.",
  example = "u = prbs(127)\ny = {}\nfor t = 1, 127 do y[t] = 2*u[t] end\n"
    .. "r = spa(iddata{ y = y, u = u })\nreturn math.abs(r.mag[64] - 2) < 1e-6, r.coherence[64] > 0.999",
  gives = "true true", spectral_analysis }
