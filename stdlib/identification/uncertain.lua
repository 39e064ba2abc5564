-- What the covariance of a fit means for poles, frequency and step responses: var f(θ) ≈ ∇f cov ∇fᵀ, the
-- gradient by
-- central differences of a tenth of the standard deviations.
local common = include "identification/common"

local uncertain = { __name = "uncertain system" }

local function numbers(column)
  local list = {}
  for k = 1, #column do list[k] = column[k] + 0.0 end
  return list
end

-- θ, covariance, and the linear system at θ, of an estimated model or of anything with theta, cov and build.
local function source(m, build)
  if object_type(m) == "idmodel" then
    if type(m.cov) == "table" then fail "uncertain: take one output of the model" end
    local std = m.std
    for k = 1, #std do
      if not (std[k] + 0.0 < math.huge) then
        fail("uncertain: the data do not determine all parameters (print the model: not identifiable), so that there is "
          .. "no covariance; lower the orders, or leave inputs out that depend on others")
      end
    end
    local single = m.kind ~= "state space" and #m.y_names == 1
    return numbers(m.theta), m.cov, function(theta)
      local changed = m:with_theta(theta)
      return single and changed:tf() or changed:ss()
    end
  end
  local known = object_type(m) == "fit_result" or type(m) == "table" and m.theta and m.cov
  if not known then
    fail "uncertain: expected an estimated model, or a fit and a function from parameters to a system"
  end
  if build then return numbers(m.theta), m.cov, build end
  if type(m) == "table" and m.build then
    return numbers(m.theta), m.cov, function(theta)
      local num, den, delay = m.build(theta)
      local G = named "tf" (num, den)
      return delay > 0 and named "delayed" (G, delay) or G
    end
  end
  fail("uncertain: give a function from the parameters to a system, "
    .. "uncertain(r, function(p) return tf({p[1]}, {p[2], 1}) end)")
end

local function entry(cov, i, j) return type(cov) == "table" and cov[i][j] or cov(i, j) end

-- Covariances of the numbers value(θ) (a list), one matrix entry function per pair asked for.
local function propagated(u, value, share)
  local slopes = {}
  for i = 1, #u.theta do
    local h = (share or 0.1) * math.sqrt(math.max(0, entry(u.cov, i, i)))
    if h == 0 or h == math.huge or h ~= h then slopes[i] = false
    else
      local ahead, behind = { table.unpack(u.theta) }, { table.unpack(u.theta) }
      ahead[i], behind[i] = ahead[i] + h, behind[i] - h
      local a, b = value(u.build(ahead)), value(u.build(behind))
      slopes[i] = {}
      for k = 1, #a do slopes[i][k] = (a[k] - b[k]) / (2 * h) end
    end
  end
  return function(k, l)
    local sum = 0
    for i = 1, #u.theta do
      for j = 1, #u.theta do
        if slopes[i] and slopes[j] then sum = sum + slopes[i][k] * slopes[j][l] * entry(u.cov, i, j) end
      end
    end
    return sum
  end
end

local function siso(G)
  if #G.inputs ~= 1 or #G.outputs ~= 1 then
    fail "uncertain: choose one channel: uncertain(mod, { output = i, input = j })"
  end
  return G
end

local function bands(name, text, draw)
  local t = { __name = name, __tostring = text, __index = { plot = draw, latex = report_latex } }
  return t
end

local function with(options, base)
  for key, value in pairs(options or {}) do base[key] = value end
  return base
end

local bode_band = bands("uncertain frequency response", function(r)
  local worst, at = 0, r.w[1]
  for k = 1, #r.w do
    local share = r.mag[k] > 0 and r.mag_std[k] / r.mag[k] or 0
    if share > worst then worst, at = share, r.w[k] end
  end
  return ("gain and phase at %d frequencies with standard deviations; the gain is known to %.3g %% at worst "
    .. "(ω = %.4g)")
    :format(#r.w, 100 * worst, at)
end, function(r, options)
  local z, x = r.z, {}
  local db, low, high, plow, phigh = {}, {}, {}, {}, {}
  for k = 1, #r.w do
    local function decibels(v) return 20 * math.log(math.max(v, 1e-3 * r.mag[k], 1e-300), 10) end
    x[k], db[k] = r.w[k], decibels(r.mag[k])
    low[k], high[k] = decibels(r.mag[k] - z * r.mag_std[k]), decibels(r.mag[k] + z * r.mag_std[k])
    plow[k], phigh[k] = r.phase[k] - z * r.phase_std[k], r.phase[k] + z * r.phase_std[k]
  end
  local label = ("%g %%"):format(100 * r.level)
  local below = figure { by = "bode", xlog = true, xlabel = "ω [rad/s]", ylabel = "phase [°]", legend = false,
    ystep = common.phase_step(r.phase),
    series = { { x = x, y = phigh, lower = plow, style = "fill" }, { x = x, y = r.phase } } }
  return figure(with(options, { by = "bode", xlog = true, title = "Bode diagram with its uncertainty",
    ylabel = "gain [dB]",
    below = { below },
    series = { { x = x, y = high, lower = low, labels = { label }, style = "fill" },
      { x = x, y = db, labels = { "G" } } } }))
end)

local step_band = bands("uncertain step response", function(r)
  local last = #r.t
  return ("step response at %d times; at the end %.6g ± %.3g"):format(last, r.y[last], r.std[last])
end, function(r, options)
  local low, high = {}, {}
  for k = 1, #r.t do low[k], high[k] = r.y[k] - r.z * r.std[k], r.y[k] + r.z * r.std[k] end
  return figure(with(options, { by = "plot", title = "Step response with its uncertainty", xlabel = "t [s]",
    series = { { x = r.t, y = high, lower = low, labels = { ("%g %%"):format(100 * r.level) },
      style = "fill" },
               { x = r.t, y = r.y, labels = { "y" }, style = r.discrete and "steps" or "line" } } }))
end)

-- The ellipse (x - m)ᵀ S⁻¹ (x - m) = radius².
local function ellipse(re, im, S, radius)
  local x, y = {}, {}
  local a, b, c = S[1], S[2], S[3]                     -- var re, cov, var im: Cholesky factor
  local l11 = math.sqrt(math.max(a, 0))
  local l21 = l11 > 0 and b / l11 or 0
  local l22 = math.sqrt(math.max(c - l21^2, 0))
  for k = 0, 48 do
    local p, q = math.cos(k * math.pi / 24), math.sin(k * math.pi / 24)
    x[k + 1], y[k + 1] = re + radius * l11 * p, im + radius * (l21 * p + l22 * q)
  end
  return x, y
end

local pole_band = bands("uncertain poles", function(r)
  local lines = {}
  for k = 1, #r.re do
    lines[k] = r.im[k] == 0 and ("%.6g ± %.3g"):format(r.re[k], r.std_re[k])
      or ("%.6g %s %.6g i ± (%.3g, %.3g)"):format(r.re[k], r.im[k] < 0 and "-" or "+", math.abs(r.im[k]),
        r.std_re[k],
        r.std_im[k])
  end
  return table.concat(lines, "\n")
end, function(r, options)
  local series = { { x = r.re, y = r.im, labels = { "poles" }, style = "points", marker = "cross" } }
  local radius = math.sqrt(-2 * math.log(1 - r.level))
  for k = 1, #r.re do
    if r.std_re[k] > 0 or r.std_im[k] > 0 then
      local x, y = ellipse(r.re[k], r.im[k], r.covariances[k], radius)
      series[#series + 1] = { x = x, y = y, colour = "orange",
        labels = { #series == 1 and ("%g %%"):format(100 * r.level) or "" } }
    end
  end
  if r.discrete then
    local x, y = {}, {}
    for k = 0, 90 do x[k + 1], y[k + 1] = math.cos(k * math.pi / 45), math.sin(k * math.pi / 45) end
    series[#series + 1] = { x = x, y = y, labels = { "unit circle" }, style = "dots" }
  end
  return figure(with(options, { by = "pzmap", series = series, title = "Poles with their uncertainty",
    xlabel = r.discrete and "Re z" or "Re s", ylabel = r.discrete and "Im z" or "Im s", equal = true }))
end)

local nyquist_band = bands("uncertain Nyquist curve", function(r)
  return ("Nyquist curve at %d frequencies with %g %% ellipses"):format(#r.w, 100 * r.level)
end, function(r, options)
  local series = { { x = r.re, y = r.im, labels = { "G(iω)" } } }
  local radius, each = math.sqrt(-2 * math.log(1 - r.level)), math.max(1, #r.w // 24)
  for k = 1, #r.w, each do
    local x, y = ellipse(r.re[k], r.im[k], r.covariances[k], radius)
    series[#series + 1] = { x = x, y = y, labels = { k == 1 and ("%g %%"):format(100 * r.level) or "" },
      colour = "orange" }
  end
  series[#series + 1] = { x = { -1 }, y = { 0 }, labels = { "-1" }, style = "points", marker = "plus" }
  return figure(with(options, { by = "nyquist", series = series, title = "Nyquist curve with its uncertainty",
    xlabel = "Re G", ylabel = "Im G", equal = true }))
end)

local function response(u, G, w)
  local f = siso(G):freqresp(w)
  local re, im = {}, {}
  for k = 1, f.re.rows do re[k], im[k] = f.re(k, 1), f.im(k, 1) end
  return re, im, f
end

local function frequencies(u, w)
  if w then return common.list("uncertain", w) end
  local f, list = siso(u.system):freqresp(), {}
  for k = 1, f.w.rows, math.max(1, f.w.rows // 100) do list[#list + 1] = f.w[k] end
  return list
end

local function complex_response(u, w)
  local list = frequencies(u, w)
  local re, im, f = response(u, u.system, list)
  local covariance = propagated(u, function(G)
    local a, b = response(u, G, list)
    local out = {}
    for k = 1, #a do out[k], out[#a + k] = a[k], b[k] end
    return out
  end)
  return list, re, im, f, function(k)
    return { covariance(k, k), covariance(k, #re + k), covariance(#re + k, #re + k) }
  end
end

local methods = { latex = report_latex }

function methods.bode(u, w)
  local list, re, im, f, cov = complex_response(u, w)
  local r = setmetatable({ w = list, mag = {}, mag_std = {}, phase = {}, phase_std = {}, level = u.level,
    z = u.z }, bode_band)
  for k = 1, #list do
    local S, size = cov(k), math.sqrt(re[k]^2 + im[k]^2)
    r.mag[k], r.phase[k] = size, f.phase(k, 1)
    local c, s = re[k] / size, im[k] / size                       -- along and across G
    r.mag_std[k] = math.sqrt(math.max(0, c * c * S[1] + 2 * c * s * S[2] + s * s * S[3]))
    r.phase_std[k] = math.sqrt(math.max(0,
      s * s * S[1] - 2 * c * s * S[2] + c * c * S[3])) / size * 180 / math.pi
  end
  return r
end

function methods.nyquist(u, w)
  local list, re, im, _, cov = complex_response(u, w)
  local r = setmetatable({ w = list, re = re, im = im, covariances = {}, level = u.level }, nyquist_band)
  for k = 1, #list do r.covariances[k] = cov(k) end
  return r
end

function methods.step(u, to)
  local first = siso(u.system):step(to)
  local t, y = numbers(first.t), {}
  for k = 1, first.y.rows do y[k] = first.y(k, 1) end
  local covariance = propagated(u, function(G)
    local s, out = G:step(t), {}
    for k = 1, s.y.rows do out[k] = s.y(k, 1) end
    return out
  end)
  local r = setmetatable({ t = t, y = y, std = {}, level = u.level, z = u.z, discrete = u.system.Ts ~= 0 },
    step_band)
  for k = 1, #t do r.std[k] = math.sqrt(math.max(0, covariance(k, k))) end
  return r
end

local function sorted_poles(G, near)
  local p = G:poles()
  local list = {}
  for k = 1, #p do list[k] = { evaluate(p.re[k]) + 0.0, evaluate(p.im[k]) + 0.0 } end
  if not near then return list end
  local out, used = {}, {}
  for k, z in ipairs(near) do
    local best, least
    for j, v in ipairs(list) do
      local distance = (v[1] - z[1])^2 + (v[2] - z[2])^2
      if not used[j] and (not least or distance < least) then best, least = j, distance end
    end
    used[best], out[k] = true, list[best]
  end
  return out
end

function methods.poles(u)
  local first = sorted_poles(u.system)
  local n = #first
  local covariance = propagated(u, function(G)
    local out = {}
    for k, z in ipairs(sorted_poles(G, first)) do out[k], out[n + k] = z[1], z[2] end
    return out
  end, 1e-4)  -- a pair that is nearly real must not become real on the way
  local r = setmetatable({ re = {}, im = {}, std_re = {}, std_im = {}, covariances = {}, level = u.level,
    discrete = u.system.Ts ~= 0 }, pole_band)
  for k, z in ipairs(first) do
    r.re[k], r.im[k] = z[1], z[2]
    r.covariances[k] = { covariance(k, k), covariance(k, n + k), covariance(n + k, n + k) }
    r.std_re[k], r.std_im[k] = math.sqrt(math.max(0, r.covariances[k][1])),
      math.sqrt(math.max(0, r.covariances[k][3]))
  end
  return r
end

function uncertain.__tostring(u)
  return ("uncertain system of %d parameter%s, bands of %g %%\n%s"):format(#u.theta,
    #u.theta == 1 and "" or "s", 100 * u.level,
    tostring(u.system))
end
uncertain.__index = methods

local rows = { option("level", "number", "probability of the bands", "0.95"),
  option("input", "integer or string", "which input, by number or name", "1"),
  option("output", "integer or string", "which output", "1") }

local function make(m, build, options)
  if type(build) == "table" then build, options = nil, build end
  options = check_options("uncertain", options, rows)
  local level = options.level or 0.95
  if type(level) ~= "number" or not (level > 0 and level < 1) then
    fail "uncertain: level is between 0 and 1, such as 0.95"
  end
  local theta, cov, from = source(m, build)
  local function channel(p)
    local G = from(p)
    if #G.inputs > 1 or #G.outputs > 1 then return G:channel(options.output or 1, options.input or 1) end
    return G
  end
  return setmetatable({ theta = theta, cov = cov, build = channel, system = channel(theta), level = level,
    z = common.normal_quantile(level) }, uncertain)
end

local prediction = { __name = "forecast" }
function prediction.__tostring(r)
  local lines = {}
  for i, name in ipairs(r.names) do
    lines[i] = ("forecast of %s, %d steps; the last %.6g ± %.3g"):format(name, #r.t, r.y(#r.t, i),
      r.std(#r.t, i))
  end
  return table.concat(lines, "\n")
end

local function forecast_panel(r, i, options)
  local x, y, low, high, past, before = {}, {}, {}, {}, {}, {}
  for k = 1, #r.t do
    x[k], y[k] = r.t[k], r.y(k, i)
    low[k], high[k] = y[k] - r.z * r.std(k, i), y[k] + r.z * r.std(k, i)
  end
  local N = r.data.y.rows
  for t = math.max(1, N - 4 * #r.t), N do
    past[#past + 1], before[#before + 1] = r.data.t[t], r.data.y(t, i)
  end
  return figure(with(options, { by = "plot", title = "Forecast", xlabel = "t [s]", ylabel = r.names[i],
    series = { { x = x, y = high, lower = low, labels = { ("%g %%"):format(100 * r.level) }, style = "fill" },
               { x = past, y = before, labels = { "measured" } },
                 { x = x, y = y, labels = { "forecast" } } } }))
end

prediction.__index = { latex = report_latex, plot = function(r, options)
  return include "identification/panels".by_output("r:plot", r.names, options,
    function(i, rest) return forecast_panel(r, i, rest) end)
end }

local function forecast(m, d, steps, options)
  local y, std = m:forecasts(d, steps, { u = options.u })
  local level, t = options.level or 0.95, {}
  local last = d.t[d.y.rows]
  for k = 1, y.rows do t[k] = last + k * d.Ts end
  return setmetatable({ t = t, y = y, std = std, data = d, names = d.y_names, level = level,
    z = common.normal_quantile(level) }, prediction)
end

return { uncertain = make, forecast = forecast }
