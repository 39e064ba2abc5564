-- Recursive estimation: θ(t) = θ(t-1) + K(t) ε(t) with forgetting, or as the Kalman filter of parameters that
-- wander
-- (Ljung, 2nd ed., ch. 11). rarx: ε linear in θ; rarmax: ψ is φ filtered by 1/C (recursive prediction
-- errors), C kept
-- inside the unit circle by not moving where it would leave it.
local common = include "identification/common"

local track = { __name = "recursive estimate" }

function track.__tostring(r)
  local lines = { ("%s, %d samples, %s"):format(r.kind, #r.theta, r.adaptation) }
  local last = r.theta[#r.theta]
  for k, name in ipairs(r.names) do
    lines[#lines + 1] = ("  %-4s %12.6g at the end ± %.3g"):format(name, last[k], r.std[#r.std][k])
  end
  table.move(r.remarks, 1, #r.remarks, #lines + 1, lines)
  return table.concat(lines, "\n")
end

track.__index = { latex = report_latex, plot = function(r, options)
  local times, arguments = {}, {}
  for t = 1, #r.theta do times[t] = (t - 1) * r.Ts end
  for k in ipairs(r.names) do
    local column = {}
    for t, row in ipairs(r.theta) do column[t] = row[k] end
    arguments[#arguments + 1], arguments[#arguments + 2] = times, column
  end
  local base = { title = "parameters over time", xlabel = "t [s]", labels = r.names, style = "line" }
  for key, value in pairs(options or {}) do base[key] = value end
  arguments[#arguments + 1] = base
  return named "plot" (table.unpack(arguments))
end }

local function whole(by, options, name, fallback)
  local v = options[name] or fallback
  if math.type(v) ~= "integer" or v < 0 then fail(("%s: %s is a whole number ≥ 0"):format(by, name)) end
  return v
end

local function setup(by, d, options, nc)
  common.one_record(by, d)
  if #d.y_names > 1 or #d.u_names > 1 then
    fail(by .. " is for one input and one output; choose: d:select{ y = 1, u = 1 }")
  end
  local o = { na = whole(by, options, "na", 0), nb = whole(by, options, "nb", 0),
    nk = whole(by, options, "nk", 1), nc = nc }
  o.d = o.na + o.nb + nc
  if o.d == 0 then fail(by .. ": give orders, na and nb") end
  o.lambda = options.forgetting or 1
  if type(o.lambda) ~= "number" or not (o.lambda > 0.5 and o.lambda <= 1) then
    fail(by .. ": forgetting is a number in (0.5, 1]: 0.98 remembers about 50 samples")
  end
  o.drift = options.drift or 0
  if type(o.drift) ~= "number" or o.drift < 0 then
    fail(by .. ": drift is the variance that θ gains per sample, ≥ 0")
  end
  if o.lambda < 1 and o.drift > 0 then fail(by .. ": give forgetting or drift, not both") end
  if options.P0 ~= nil and not (options.P0 > 0) then fail(by .. ": P0 is a variance > 0") end
  o.names = {}
  for k = 1, o.na do o.names[k] = "a" .. k end
  for k = 0, o.nb - 1 do o.names[#o.names + 1] = "b" .. (o.nk + k) end
  for k = 1, nc do o.names[#o.names + 1] = "c" .. k end
  return o
end

-- Without forgetting and with C in the model: λ(t) = 0.99 λ(t-1) + 0.01 from 0.95 on, since the gradients of
-- the first samples belong to a poor C and would count for ever (Söderström, Ljung & Gustavsson, Automatica
-- 14(3), 1978).
local function forgetting(o, t)
  return o.nc > 0 and o.lambda == 1 and o.drift == 0 and 1 - 0.05 * 0.99^t or o.lambda
end

-- K = P ψ/(λ + ψᵀPψ) of unit noise; P is updated in place.
local function gain(P, psi, o, lambda)
  local n, Ppsi, denominator = #psi, {}, lambda
  for i = 1, n do
    local sum = 0
    for j = 1, n do sum = sum + P[i][j] * psi[j] end
    Ppsi[i], denominator = sum, denominator + psi[i] * sum
  end
  local K = {}
  for i = 1, n do K[i] = Ppsi[i] / denominator end
  for i = 1, n do
    for j = 1, i do
      P[i][j] = (P[i][j] - K[i] * Ppsi[j]) / lambda + (i == j and o.drift or 0)
      P[j][i] = P[i][j]
    end
  end
  return K
end

local function run(by, d, options, nc)
  local o = setup(by, d, options, nc)
  local theta, P, N = {}, {}, d.y.rows
  local guess = options.theta0 and common.list(by, options.theta0)
  if guess and #guess ~= o.d then
    fail(("%s: theta0 has %d numbers for %d parameters"):format(by, #guess, o.d))
  end
  for i = 1, o.d do
    theta[i], P[i] = guess and guess[i] or 0, {}
    for j = 1, o.d do P[i][j] = i == j and (options.P0 or 1e6) or 0 end
  end
  local y, u, e, filtered = {}, {}, {}, {}
  for t = 1, N do y[t], u[t] = d.y(t, 1) + 0.0, d.u(t, 1) + 0.0 end
  local r = setmetatable({ kind = nc > 0 and "recursive ARMAX" or "recursive ARX", theta = {}, std = {},
    errors = {},
    names = o.names, Ts = d.Ts, remarks = common.offset_remarks(d),
    adaptation = o.drift > 0 and ("Kalman filter, drift %.3g"):format(o.drift)
      or ("forgetting %.4g"):format(o.lambda) },
    track)
  local variance, weight = 0, 0
  for t = 1, N do
    local phi, complete = {}, y[t] == y[t]
    for k = 1, o.na do phi[#phi + 1] = t > k and -y[t - k] or 0 end
    for k = o.nk, o.nk + o.nb - 1 do phi[#phi + 1] = t > k and u[t - k] or 0 end
    for k = 1, nc do phi[#phi + 1] = e[t - k] or 0 end
    local prediction = 0
    for i = 1, o.d do prediction = prediction + theta[i] * phi[i] end
    complete = complete and prediction == prediction
    local psi = {}
    for i = 1, o.d do                                            -- ψ = φ/C
      local value = phi[i]
      for k = 1, nc do
        value = value - theta[o.na + o.nb + k] * (filtered[t - k] and filtered[t - k][i] or 0)
      end
      psi[i] = value
    end
    if complete then
      local error = y[t] - prediction
      r.errors[t] = error
      local K = gain(P, psi, o, forgetting(o, t))
      for step = 0, 5 do                                         -- C stays stable: shorter steps
        local moved = {}
        for i = 1, o.d do moved[i] = theta[i] + 0.5^step * K[i] * error end
        if nc == 0 or common.stable({ table.unpack(moved, o.na + o.nb + 1) }) then
          theta = moved
          break
        end
      end
      local after = y[t]
      for i = 1, o.d do after = after - theta[i] * phi[i] end
      e[t], filtered[t] = after, psi
      if t > o.d then variance, weight = o.lambda * variance + error^2, o.lambda * weight + 1 end
    -- nothing is learnt from a missing sample; its prediction stands in for it
    else
      r.errors[t] = 0 / 0
      if y[t] ~= y[t] then y[t] = prediction == prediction and prediction or 0 end
      e[t] = 0
    end
    local row, deviations, s2 = {}, {}, weight > 0 and variance / weight or 0
    for i = 1, o.d do row[i], deviations[i] = theta[i], math.sqrt(math.max(0, s2 * P[i][i])) end
    r.theta[t], r.std[t] = row, deviations
  end
  return r
end

local function rarx(d, options)
  return run("rarx", d, options, 0)
end

local function rarmax(d, options)
  local nc = whole("rarmax", options, "nc", 1)
  return run("rarmax", d, options, nc)
end

return { rarx = rarx, rarmax = rarmax }
