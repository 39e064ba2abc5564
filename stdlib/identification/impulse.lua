-- Impulse responses with bounds, and the delay of an input.
local common = include "identification/common"

local estimate = { __name = "impulse estimate" }

function estimate.__tostring(r)
  local first
  for k, lag in ipairs(r.lags) do
    if not first and lag >= 0 and math.abs(r.g[k]) > r.bound[k] then first = lag end
  end
  local text = ("impulse response from %s to %s by %s: lags %d … %d, %s"):format(r.input, r.output, r.method,
    r.lags[1], r.lags[#r.lags], first and ("beyond the 99 %% bound first at lag %d"):format(first)
      or "nowhere beyond the 99 % bound")
  return table.concat({ text, table.unpack(r.remarks or {}) }, "\n")
end

estimate.__index = { latex = report_latex, plot = function(r, options)
  local low = {}
  for k, b in ipairs(r.bound) do low[k] = -b end
  local base = { by = "plot", title = "Impulse response", xlabel = "lag",
    ylabel = r.output .. " from " .. r.input,
    series = { { x = r.lags, y = r.bound, lower = low, labels = { "99 % if there is none" }, style = "fill" },
               { x = r.lags, y = r.g, labels = { r.method }, style = "impulses",
                 marker = "circle" } } }
  for key, value in pairs(options or {}) do base[key] = value end
  return figure(base)
end }

local z99 = common.normal_quantile(0.99)

local function check_lags(by, lags, N, fallback)
  lags = lags or fallback
  if math.type(lags) ~= "integer" or lags < 1 or lags > N // 3 then
    fail(("%s: lags is a whole number from 1 to %d"):format(by, N // 3))
  end
  return lags
end

-- The coefficients of A(q) of an AR model of a list, {1, a1, …}.
local function autoregression(x, order)
  local A = named "arx" (named "iddata" { y = x }, { na = order }).A
  local list = {}
  for k = 1, order + 1 do list[k] = evaluate(A[k]) + 0.0 end
  return list
end

local function filtered(a, x)
  local out = {}
  for t = 1, #x do
    local sum = 0
    for k = 1, math.min(#a, t) do sum = sum + a[k] * x[t - k + 1] end
    out[t] = sum
  end
  return out
end

-- A FIR model on data filtered by the noise model of a long ARX, so that what is left is white.
local function impulse_estimate(d, options)
  common.one_record("impulse_estimate", d)
  local y, u, i, o = common.signals("impulse_estimate", d, options, 12)
  local lags = check_lags("impulse_estimate", options.lags, #y, math.max(1, math.min(40, #y // 5)))
  local order = options.whiten or math.min(10, #y // 20)
  if math.type(order) ~= "integer" or order < 0 or order > #y // 10 then
    fail(("impulse_estimate: whiten, the order of the ARX model of the noise, is a whole number from 0 to %d"):format(
      #y // 10))
  end
  local kernel = options.kernel ~= "none" and options.kernel or nil
  if order > 0 then
    local A = named "arx" (named "iddata" { y = y, u = u }, { na = order, nb = order, nk = 0 }).A
    local a = {}
    for k = 1, order + 1 do a[k] = evaluate(A[k]) + 0.0 end
    y, u = filtered(a, y), filtered(a, u)
  end
  local m = named "fir" (named "iddata" { y = y, u = u, Ts = d.Ts },
    { nb = lags + 1, nk = 0, kernel = kernel })
  local r = setmetatable({ lags = {}, g = {}, std = {}, bound = {}, input = d.u_names[i],
    output = d.y_names[o],
    method = kernel and "regularised FIR (" .. kernel .. ")" or "FIR" }, estimate)
  for k = 0, lags do
    r.lags[k + 1], r.g[k + 1], r.std[k + 1] = k, m.theta[k + 1], m.std[k + 1]
    r.bound[k + 1] = z99 * r.std[k + 1]
  end
  return r
end

-- Correlation analysis: u made white by an AR model of it, then g(k) = R_yu(k)/R_u(0).
local function correlation_analysis(d, options)
  common.one_record("cra", d)
  local y, u, i, o = common.signals("cra", d, options, 12)
  local N = #y
  local lags = check_lags("cra", options.lags, N, math.max(1, math.min(20, N // 5)))
  local order = options.whiten or math.min(10, N // 20)
  if math.type(order) ~= "integer" or order < 0 or order > N // 10 then
    fail(("cra: whiten, the order of the AR model of the input, is a whole number from 0 to %d"):format(N // 10))
  end
  if order > 0 then
    local a = autoregression(u, order)
    y, u = filtered(a, y), filtered(a, u)
  end
  local function covariance(a, b, lag)
    local sum = 0
    for t = math.max(1, 1 + lag), math.min(N, N + lag) do sum = sum + a[t] * b[t - lag] end
    return sum / N
  end
  local Ru, Ry = covariance(u, u, 0), covariance(y, y, 0)
  local r = setmetatable({ lags = {}, g = {}, std = {}, bound = {}, input = d.u_names[i],
    output = d.y_names[o],
    method = "correlation analysis", remarks = common.feedback_remark({}, d, o,
      "the response may then be that of the loop; arx or armax take the noise into account") }, estimate)
  for lag = -(lags // 4), lags do
    local n = #r.lags + 1
    r.lags[n], r.g[n] = lag, covariance(y, u, lag) / Ru
    r.std[n] = math.sqrt(Ry / (N * Ru))                  -- of a white u that has nothing to do with y
    r.bound[n] = z99 * r.std[n]
  end
  return r
end

local delays = { __tostring = function(r)
  local lines, order = { ("delay of %d sample%s"):format(r.nk, r.nk == 1 and "" or "s") }, {}
  for nk in pairs(r.losses) do order[#order + 1] = nk end
  table.sort(order)
  for _, nk in ipairs(order) do lines[#lines + 1] = ("  nk = %2d  loss %.6g"):format(nk, r.losses[nk]) end
  return table.concat(lines, "\n")
end }

-- The delay nk of the ARX model that explains most, all delays on the same rows.
local function delay_estimate(d, options)
  common.one_record("delay_estimate", d)
  local range = options.range or { 0, math.min(20, d.y.rows // 10) }
  common.signals("delay_estimate", d, options, 12)
  local one = d:select { y = options.output or 1, u = options.input or 1 }
  local s = named "order_scan" (one, nil, { na = options.na or 2, nb = options.nb or 2, nk = range,
    criterion = "aic" })
  -- A model with too short a delay holds the right one as well. Of delays that explain the data equally
  -- well, N ln(V/V₁) below the 99 % quantile of χ²(1), the longest is meant. Losses of exact data are
  -- rounding errors.
  local losses, nk, variance = {}, s[1].nk, 0
  local y = common.centred("delay_estimate", one.y, 1)
  for t = 1, #y do variance = variance + y[t]^2 / #y end
  local limit = math.max(s[1].loss, 1e-20 * variance) * math.exp(6.634896601 / s.rows)
  for k = 1, #s do
    losses[s[k].nk] = s[k].loss
    if s[k].loss <= limit then nk = math.max(nk, s[k].nk) end
  end
  local next_best = s[2] and s[2].loss / s[1].loss or math.huge
  return nk, setmetatable({ losses = losses, ratio = next_best, nk = nk }, delays)
end

return { impulse_estimate = impulse_estimate, cra = correlation_analysis, delay_estimate = delay_estimate }
