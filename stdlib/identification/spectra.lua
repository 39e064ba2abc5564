-- Frequency responses straight from data, without a model (Ljung, 2nd ed., ch. 6). spa, smoothed spectra,
-- with the
-- covariances R(τ) of the record and Hann's lag window w(τ) of width M,
--
--   Φ(ω) = Σ w(τ) R(τ) e^{-iωτ},   Ĝ = Φ_yu/Φ_u,   Φ_v = Φ_y - |Φ_yu|²/Φ_u,   κ² = |Φ_yu|²/(Φ_y Φ_u),
--   var Ĝ ≈ (1/N) Σ w² · Φ_v/Φ_u,   half of it in the direction of Ĝ.

local common = include "identification/common"

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

local function lines_of(r)
  if not r.coherence then
    return ("frequency response from %s to %s by Fourier transforms: %d samples, %d frequencies up to "
      .. "%.4g rad/s")
      :format(r.input, r.output, r.samples, #r.w, r.w[#r.w])
  end
  local least, at = math.huge, 0
  for k, c in ipairs(r.coherence) do if c < least then least, at = c, r.w[k] end end
  return ("frequency response from %s to %s by smoothed spectra: %d samples, lag window of %d, "
    .. "%d frequencies up to %.4g rad/s\n  coherence at least %.3g (at ω = %.4g)"):format(r.input, r.output,
    r.samples,
    r.window, #r.w, r.w[#r.w], least, at)
end

function spectral_estimate.__tostring(r)
  return table.concat({ lines_of(r), table.unpack(r.remarks) }, "\n")
end

local function remarks_of(d, output)
  return common.feedback_remark({}, d, output,
    "the estimate may then lie between the plant and -1/controller; arx or armax take the noise into account")
end

-- Gain with ± 2 σ as a band where a deviation is known, and the phase below.
local function picture(r, options)
  local db, low, high, degrees, series = {}, {}, {}, {}, {}
  local phase_low, phase_high, phases = {}, {}, {}
  for k = 1, #r.w do
    local function decibels(v) return 20 * math.log(math.max(v, 1e-6 * r.mag[k]), 10) end
    db[k], degrees[k] = decibels(r.mag[k]), r.phase[k]
    if r.std then
      low[k], high[k] = decibels(r.mag[k] - 2 * r.std[k]), decibels(r.mag[k] + 2 * r.std[k])
      -- along and across G the deviation is the same; beyond half a turn nothing is known
      local turn = r.mag[k] > 0 and math.min(180, 2 * r.std[k] / r.mag[k] * 180 / math.pi) or 180
      phase_low[k], phase_high[k] = r.phase[k] - turn, r.phase[k] + turn
    end
  end
  if r.std then
    series[1] = { x = r.w, y = high, lower = low, labels = { "± 2 σ" }, style = "fill" }
    phases[1] = { x = r.w, y = phase_high, lower = phase_low, style = "fill" }
  end
  series[#series + 1] = { x = r.w, y = db, labels = { r.output .. "/" .. r.input } }
  phases[#phases + 1] = { x = r.w, y = degrees, labels = { "phase" } }
  local below = figure { by = "plot", series = phases, xlog = true,
    xlabel = "ω [rad/s]", ylabel = "phase [°]", legend = false, ystep = common.phase_step(degrees) }
  local base = { by = "plot", xlog = true, title = r.title, ylabel = "gain [dB]", below = { below },
    series = series }
  for key, value in pairs(options or {}) do base[key] = value end
  return figure(base)
end
spectral_estimate.__index = { plot = picture, latex = report_latex }

local function read_options(options, N)
  local M = options.window or math.min(30, N // 10)
  if math.type(M) ~= "integer" or M < 2 or M >= N then
    fail(("spa: window, the width of the lag window, is a whole number from 2 to %d"):format(N - 1))
  end
  return M
end

local function spectral_analysis(d, options)
  common.one_record("spa", d)
  local N = d.y.rows
  local y, u, i, o = common.signals("spa", d, options, 20)
  local M = read_options(options, N)
  local given = options and options.w and common.list("spa", options.w)
  for _, w in ipairs(given or {}) do
    if not (w >= 0 and w <= math.pi / d.Ts * (1 + 1e-9)) then
      fail(("spa: w = %.6g; samples contain only frequencies from 0 to π/Ts = %.6g rad/s"):format(w, math.pi / d.Ts))
    end
  end
  local Ry, Ru, Ryu = covariance(y, y, M), covariance(u, u, M), covariance(y, u, M)
  local window, squares = {}, 0
  for lag = -M, M do
    window[lag] = 0.5 * (1 + math.cos(math.pi * lag / (M + 1)))
    squares = squares + window[lag]^2
  end
  local r = setmetatable({ w = {}, re = {}, im = {}, mag = {}, phase = {}, std = {}, noise = {},
    coherence = {}, title = "Spectral estimate", samples = N, window = M, remarks = remarks_of(d, o),
      input = d.u_names[i],
      output = d.y_names[o] }, spectral_estimate)
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

-- ── Fourier transforms ──

-- ETFE: Y(ω)/U(ω) at the Fourier frequencies, smoothed over 2 h + 1 neighbours with the weights |U|² (Hann
-- window):
-- unbiased where u is periodic, else noisy; frequencies at which u has less than 10⁻⁴ of its largest power
-- are left out.
local function etfe(d, options)
  common.one_record("etfe", d)
  local h = options.smooth or 0
  if math.type(h) ~= "integer" or h < 0 then fail "etfe: smooth is a whole number of neighbours ≥ 0" end
  local y, u, i, o = common.signals("etfe", d, options, 4)
  local N = #y
  local yr, yi = common.dft(y)
  local ur, ui = common.dft(u)
  local half, largest = N // 2, 0
  for k = 2, half + 1 do largest = math.max(largest, ur[k]^2 + ui[k]^2) end
  local r = setmetatable({ w = {}, re = {}, im = {}, mag = {}, phase = {}, samples = N,
    title = "Empirical transfer function", remarks = remarks_of(d, o),
    input = d.u_names[i], output = d.y_names[o] }, spectral_estimate)
  local turn = 0
  for k = 2, half + 1 do
    local re, im, power = 0, 0, 0
    for m = math.max(2, k - h), math.min(half + 1, k + h) do
      local weight = 0.5 * (1 + math.cos(math.pi * (m - k) / (h + 1)))
      re = re + weight * (yr[m] * ur[m] + yi[m] * ui[m])
      im = im + weight * (yi[m] * ur[m] - yr[m] * ui[m])
      power = power + weight * (ur[m]^2 + ui[m]^2)
    end
    if power > 1e-4 * largest then
      local n = #r.w + 1
      r.w[n], r.re[n], r.im[n] = 2 * math.pi * (k - 1) / (N * d.Ts), re / power, im / power
      r.mag[n] = math.sqrt(re^2 + im^2) / power
      local angle = math.atan(im, re) * 180 / math.pi
      if n > 1 then turn = math.floor((r.phase[n - 1] - angle) / 360 + 0.5) * 360 end
      r.phase[n] = angle + turn
    end
  end
  return r
end

-- Welch's averages over segments that overlap by half, Hann window, means removed (Welch, IEEE Trans. Audio
-- Electroacoust. 15(2), 1967); one-sided densities per Hz.
local function averages(by, y, u, Ts, options)
  local N = #y
  if N < 4 then fail(("%s: %d samples are too few; at least 4 are needed"):format(by, N)) end
  local length = options.segment or math.min(N, math.max(8, math.min(256, N // 4)))
  if math.type(length) ~= "integer" or length < 4 or length > N then
    fail(("%s: segment is a whole number of samples from 4 to %d"):format(by, N))
  end
  local window, squares = {}, 0
  for t = 1, length do
    window[t] = 0.5 * (1 - math.cos(2 * math.pi * (t - 1) / length))
    squares = squares + window[t]^2
  end
  local half, count = length // 2, 0
  local Py, Pu, Cr, Ci = {}, {}, {}, {}
  for k = 1, half + 1 do Py[k], Pu[k], Cr[k], Ci[k] = 0, 0, 0, 0 end
  local function part(x, from)
    local out, mean = {}, 0
    for t = 1, length do mean = mean + x[from + t] / length end
    for t = 1, length do out[t] = window[t] * (x[from + t] - mean) end
    return common.dft(out)
  end
  for from = 0, N - length, math.max(1, length - length // 2) do
    local yr, yi = part(y, from)
    local ur, ui = yr, yi
    if u then ur, ui = part(u, from) end
    for k = 1, half + 1 do
      Py[k], Pu[k] = Py[k] + yr[k]^2 + yi[k]^2, Pu[k] + ur[k]^2 + ui[k]^2
      Cr[k], Ci[k] = Cr[k] + yr[k] * ur[k] + yi[k] * ui[k], Ci[k] + yi[k] * ur[k] - yr[k] * ui[k]
    end
    count = count + 1
  end
  local f, scale = {}, Ts / (count * squares)
  for k = 1, half + 1 do
    f[k] = (k - 1) / (length * Ts)
    local sides = (k == 1 or (length % 2 == 0 and k == half + 1)) and 1 or 2
    Py[k], Pu[k], Cr[k], Ci[k] = sides * scale * Py[k], sides * scale * Pu[k], sides * scale * Cr[k],
      sides * scale * Ci[k]
  end
  return { f = f, Py = Py, Pu = Pu, Cr = Cr, Ci = Ci, segments = count, segment = length }
end

local density = { __name = "power density" }
function density.__tostring(r)
  return ("power density by Welch's averages: %d segments of %d samples, %d frequencies up to %.4g Hz")
    :format(r.segments, r.segment, #r.f, r.f[#r.f])
end
density.__index = { latex = report_latex, plot = function(r, options)
  local base = { title = "Power density", xlabel = "f [Hz]", ylabel = "power/Hz", style = "line" }
  for key, value in pairs(options or {}) do base[key] = value end
  return named "semilogy" (r.f, r.power, base)
end }

local function welch(x, options)
  if object_type(x) == "iddata" then
    fail "welch: choose a signal and say its sampling time: welch(d.y, { Ts = d.Ts })"
  end
  local Ts = options.Ts or 1
  if not (type(Ts) == "number" and Ts > 0) then fail "welch: Ts is a positive number" end
  local a = averages("welch", common.list("welch", x), nil, Ts, options)
  return setmetatable({ f = a.f, power = a.Py, segments = a.segments, segment = a.segment }, density)
end

local coherence_estimate = { __name = "coherence" }
function coherence_estimate.__tostring(r)
  return ("coherence of %s and %s: %d segments of %d samples; above %.3g by chance in 1 %% of the "
    .. "frequencies")
    :format(r.input, r.output, r.segments, r.segment, r.bound)
end
coherence_estimate.__index = { latex = report_latex, plot = function(r, options)
  local base = { by = "plot", title = "Coherence", xlabel = "f [Hz]", ylabel = "κ²", ylim = { 0, 1 },
    series = { { x = r.f, y = r.value, labels = { r.output .. ", " .. r.input } },
      { x = { r.f[1], r.f[#r.f] }, y = { r.bound, r.bound }, labels = { "99 % by chance" },
        dash = "dashed" } } }
  for key, value in pairs(options or {}) do base[key] = value end
  return figure(base)
end }

local function coherence(d, options)
  common.one_record("coherence", d)
  local y, u, i, o = common.signals("coherence", d, options, 8)
  local a = averages("coherence", y, u, d.Ts, options)
  if a.segments < 2 then fail "coherence: one segment always has coherence 1; give a shorter segment" end
  local r = setmetatable({ f = a.f, value = {}, segments = a.segments, segment = a.segment,
    input = d.u_names[i],
    output = d.y_names[o] }, coherence_estimate)
  for k = 1, #a.f do
    local power = a.Py[k] * a.Pu[k]
    r.value[k] = power > 0 and math.min(1, (a.Cr[k]^2 + a.Ci[k]^2) / power) or 0
  end
  -- P(κ² > c) = (1 - c)^(n-1) for n independent segments; halves that overlap count 9/11 (Welch 1967)
  local n = math.max(2, a.segments * 9 / 11)
  r.bound = 1 - 0.01^(1 / (n - 1))
  return r
end

return { spa = spectral_analysis, etfe = etfe, welch = welch, coherence = coherence }
