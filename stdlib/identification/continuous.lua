-- Models in continuous time from samples: process models of few constants, and transfer functions. The input
-- is
-- constant between samples; the search runs over constants of size 1, from several starts.
local common = include "identification/common"

local estimated = { __name = "continuous model" }

local function shown(r)
  local lines = { ("%s, estimated from %d samples: %s"):format(r.kind, r.rows, r.formula) }
  for k, name in ipairs(r.names) do
    lines[#lines + 1] = ("  %-4s %14.9g ± %.4g"):format(name, r.theta[k], r.std[k])
  end
  lines[#lines + 1] = ("  loss V = %.8g, noise variance %.8g"):format(r.loss, r.sigma2)
  lines[#lines + 1] = ("  fit on the estimation data: %.6g %% (simulation, %s)"):format(r.fit,
    r.ic == "estimate" and "initial state estimated" or "from rest")
  lines[#lines + 1] = ("  search: %s, the best of %d starts"):format(r.verdict, r.starts)
  for _, name in ipairs(r.active) do
    lines[#lines + 1] = ("  warning: %s lies at the end of its range"):format(name)
  end
  table.move(r.remarks, 1, #r.remarks, #lines + 1, lines)
  return table.concat(lines, "\n")
end
estimated.__tostring = shown

estimated.__index = {
  latex = report_latex,
  plot = function(r, d, options)
    if object_type(d) ~= "iddata" then fail "r:plot(d) needs the data to compare with" end
    local filled, y, model, mean = d:fill(), {}, {}, 0
    local errors = named "continuous_errors" (r.num, r.den, r.delay, filled, r.ic)
    for t = 1, d.y.rows do
      y[t], model[t] = d.y(t, 1), filled.y(t, 1) - errors[t]
      mean = mean + filled.y(t, 1) / d.y.rows
    end
    local sse, variation = 0, 0
    for t = 1, d.y.rows do
      if y[t] == y[t] then sse, variation = sse + errors[t]^2, variation + (y[t] - mean)^2 end
    end
    local base = { labels = { "measured", "simulated" }, xlabel = "t [s]", ylabel = d.y_names[1],
      style = "line", title = ("simulation, fit %.4g %%"):format(100 * (1 - math.sqrt(sse / variation))) }
    for key, value in pairs(options or {}) do base[key] = value end
    return named "plot" (d.t, y, d.t, model, base)
  end,
  G = function(r) return r.system end,
}

local function tf_text(num, den, delay)
  local function polynomial(c)
    local out = {}
    for k, v in ipairs(c) do
      local power = #c - k
      local size = ("%.6g"):format(math.abs(v))
      if power > 0 then
        size = (size == "1" and "" or size .. " ") .. (power == 1 and "s" or "s^" .. power)
      end
      out[#out + 1] = (v < 0 and (#out > 0 and " - " or "-") or (#out > 0 and " + " or "")) .. size
    end
    return table.concat(out)
  end
  return ("(%s)/(%s)%s"):format(polynomial(num), polynomial(den),
    delay > 0 and (" e^(-%.6g s)"):format(delay) or "")
end

-- The record as one signal each; centred sizes make the search independent of units.
local function prepare(by, d)
  common.one_record(by, d)
  if #d.y_names > 1 or #d.u_names > 1 then
    fail(by .. " is for one input and one output; choose: d:select{ y = 1, u = 1 }")
  end
  local sizes, first = { y = 0, u = 0, n = 0, constant = true }, d.u(1, 1)
  for t = 1, d.y.rows do
    local y, u = d.y(t, 1), d.u(t, 1)
    if u ~= u then fail(by .. ": the input must be known at every sample: d:fill()") end
    if y == y then sizes.y, sizes.n = sizes.y + y * y, sizes.n + 1 end
    sizes.u, sizes.constant = sizes.u + u * u, sizes.constant and u == first
  end
  if sizes.u == 0 then fail(("%s: the input %s is zero"):format(by, d.u_names[1])) end
  if sizes.y == 0 then fail(("%s: the output %s is zero"):format(by, d.y_names[1])) end
  sizes.y, sizes.u = math.sqrt(sizes.y / sizes.n), math.sqrt(sizes.u / d.y.rows)
  return sizes
end

local function require_information(by, d, sizes, parameters, poles, ic)
  local free = parameters + (ic == "estimate" and poles or 0)
  if sizes.n <= free then
    fail(("%s: %d samples are too few for %d unknowns (%d parameters%s)"):format(by, sizes.n, free,
      parameters, ic == "estimate" and (", %d initial values; ic = \"zero\": none"):format(poles) or ""))
  end
  if ic == "estimate" and sizes.constant then
    fail(("%s: the input %s does not vary, and with an unknown initial state such data carry no information; "
      .. "ic = \"zero\" if "
      .. "the data begin at rest"):format(by, d.u_names[1]))
  end
end

local function ic_of(by, options)
  local ic = options.ic or "estimate"
  if ic ~= "estimate" and ic ~= "zero" then fail(by .. ": ic is \"estimate\" or \"zero\"") end
  return ic
end

-- The best minimum from a list of starts. model(p) -> num, den, delay.
local function search(d, ic, model, starts, lower, upper)
  local continuous_errors = named "continuous_errors"
  local best, tried = nil, 0
  local function residuals(p)
    local num, den, delay = model(p)
    return continuous_errors(num, den, delay, d, ic)
  end
  for _, start in ipairs(starts) do
    local ok, r = pcall(named "nlsq", residuals, start, { lower = lower, upper = upper, iterations = 60 })
    if ok then
      tried = tried + 1
      if not best or r.sse < best.sse then best = r end
    end
  end
  if not best then
    fail "the search found no start at which the model is finite; give other data or a simpler model"
  end
  return best, tried
end

local function finish(r, d, ic, kind, names, values, deviations, build)
  local num, den, delay = build(values)
  local y, mean, count = 0, 0, 0
  for t = 1, d.y.rows do local v = d.y(t, 1) if v == v then mean, count = mean + v, count + 1 end end
  mean = mean / count
  for t = 1, d.y.rows do local v = d.y(t, 1) if v == v then y = y + (v - mean)^2 end end
  local out = setmetatable({ kind = kind, names = names, theta = values, std = deviations.std,
    cov = deviations.cov,
    num = num, den = den, delay = delay, build = build, rows = count, ic = ic, loss = r.sse / count,
      sigma2 = r.sigma2,
    fit = 100 * (1 - math.sqrt(r.sse / y)), verdict = r.verdict, starts = deviations.starts, active = {},
    remarks = common.output_error_remarks(d) }, estimated)
  for _, k in ipairs(r.active) do out.active[#out.active + 1] = names[k] end
  out.formula = tf_text(num, den, delay)
  out.system = named "tf" (num, den)
  if delay > 0 then out.system = named "delayed" (out.system, delay) end
  return out
end

-- ── process models ──

local function read_type(kind)
  local order, letters = tostring(kind):match "^P([0-3])([DZIU]*)$"
  if not order then
    fail(("process_model: '%s' is not a type; write \"P1D\": the number of poles, D for a delay, Z for "
      .. "a zero, "
      .. "I for an "
      .. "integrator, U for a complex pair"):format(tostring(kind)))
  end
  local has = {}
  for letter in letters:gmatch "." do has[letter] = true end
  order = math.tointeger(tonumber(order))
  if has.U and order < 2 then fail "process_model: a complex pair (U) needs at least two poles" end
  if order == 0 and has.Z and not has.I then fail "process_model: a zero needs a pole" end
  return order, has
end

-- Constants, in the order K, (Tw, ζ or T1, T2, T3), Tz, L; times as logarithms during the search.
local function process_parameters(order, has)
  local names = { "K" }
  local function add(name) names[#names + 1] = name end
  if has.U then add "Tw" add "zeta" if order == 3 then add "T3" end
  else for k = 1, order do add("T" .. k) end end
  if has.Z then add "Tz" end
  if has.D then add "L" end
  return names
end

local function times(a, b)
  local out = {}
  for i = 1, #a + #b - 1 do out[i] = 0 end
  for i = 1, #a do for j = 1, #b do out[i + j - 1] = out[i + j - 1] + a[i] * b[j] end end
  return out
end

local function process_system(names, has)
  return function(v)
    local value = {}
    for k, name in ipairs(names) do value[name] = v[k] end
    local den = { 1 }
    if has.U then den = { value.Tw^2, 2 * value.zeta * value.Tw, 1 } end
    for k = 1, 3 do if value["T" .. k] then den = times(den, { value["T" .. k], 1 }) end end
    if has.I then den = times(den, { 1, 0 }) end
    local num = has.Z and { value.K * value.Tz, value.K } or { value.K }
    return num, den, value.L or 0
  end
end

local function process_model(d, kind, options)
  local order, has = read_type(kind)
  local sizes, ic = prepare("process_model", d), ic_of("process_model", options)
  local names, build = process_parameters(order, has), nil
  build = process_system(names, has)
  require_information("process_model", d, sizes, #names, order + (has.I and 1 or 0), ic)
  local span = d.Ts * d.y.rows
  if options.max_delay and not (options.max_delay >= 0) then
    fail "process_model: max_delay is a number of seconds ≥ 0"
  end
  local longest = options.max_delay or 0.3 * span
  local unit = sizes.y / sizes.u / (has.I and span / 10 or 1)
  local function positive(name) return name:match "^T[w123]" or name == "zeta" end
  local function unpacked(p)
    local v = {}
    for k, name in ipairs(names) do
      v[k] = positive(name) and math.exp(p[k]) or name == "K" and p[k] * unit or p[k] * span / 10
    end
    return v
  end
  local starts, lower, upper = {}, {}, {}
  for _, T in ipairs { 1 / 300, 1 / 60, 1 / 12 } do
    for _, sign in ipairs { 1, -1 } do
      for _, L in ipairs(has.D and { 0.3, 0.02 } or { 0 }) do
        local start = {}
        for k, name in ipairs(names) do
          local spread = name == "T2" and 0.3 or name == "T3" and 0.1 or 1
          start[k] = name == "K" and sign or name == "zeta" and math.log(0.7) or name == "L"
            and 10 * L * longest / span
            or name == "Tz" and 0.1 or math.log(span * T * spread)
        end
        starts[#starts + 1] = start
      end
    end
  end
  for k, name in ipairs(names) do
    lower[k] = name == "L" and 0 or name == "zeta" and math.log(1e-3) or positive(name)
      and math.log(d.Ts * 1e-3)
      or -math.huge
    upper[k] = name == "L" and 10 * longest / span or positive(name) and math.log(span * 1e3) or math.huge
  end
  local r, tried = search(d, ic, function(p)
    local list = {}
    for k = 1, #names do list[k] = p[k] end
    return build(unpacked(list))
  end, starts, lower, upper)
  local p = {}
  for k = 1, #names do p[k] = r.theta[k] end
  local values, std, cov, slope = unpacked(p), {}, {}, {}
  for k, name in ipairs(names) do
    slope[k] = positive(name) and values[k] or name == "K" and unit or span / 10       -- ∂value/∂p
    std[k] = math.abs(slope[k]) * r.std[k]
  end
  for i = 1, #names do
    cov[i] = {}
    for j = 1, #names do cov[i][j] = slope[i] * slope[j] * r.cov(i, j) end
  end
  return finish(r, d, ic, "process model " .. kind, names, values,
    { std = std, cov = cov, starts = tried }, build)
end

-- ── transfer functions ──

-- An OE model of the same order, made continuous; not every one has such a form.
local function discrete_start(d, np, nk, add)
  pcall(function()
    local G = named "d2c" (named "oe" (d:fill(), { nb = np, nf = np, nk = nk }):tf())
    local num, den = {}, {}
    for k = 1, #G.num do num[k] = evaluate(G.num[k]) + 0.0 end
    for k = 1, #G.den do den[k] = evaluate(G.den[k]) + 0.0 end
    add(num, den)
  end)
end

-- Coefficients in the time unit of the data, so that they are of size 1: s = σ/T.
local function tfest(d, options)
  local np = options.np
  if math.type(np) ~= "integer" or np < 1 or np > 10 then
    fail "tfest: np, the number of poles, is from 1 to 10"
  end
  local nz = options.nz or np - 1
  if math.type(nz) ~= "integer" or nz < 0 or nz > np then
    fail "tfest: nz, the number of zeros, is from 0 to np"
  end
  local delay = options.delay or 0
  if type(delay) ~= "number" or delay < 0 then fail "tfest: delay is a number of seconds ≥ 0" end
  if delay > 0 and nz == np and math.abs(delay / d.Ts - math.floor(delay / d.Ts + 0.5)) > 1e-9 then
    fail "tfest: with as many zeros as poles the delay is a multiple of Ts"
  end
  local sizes, ic = prepare("tfest", d), ic_of("tfest", options)
  require_information("tfest", d, sizes, np + nz + 1, np, ic)
  local starts, T = {}, 1
  local function add(num, den)                                    -- as found in s, den[1] ≠ 0
    local start = {}
    for k = 1, nz + 1 do start[k] = (num[#num - (nz + 1) + k] or 0) / den[1] end
    for k = 1, np do start[nz + 1 + k] = den[k + 1] / den[1] end
    starts[#starts + 1] = start
  end
  discrete_start(d, np, math.max(1, math.floor(delay / d.Ts + 0.5)), add)
  local span, gain = d.Ts * d.y.rows, sizes.y / sizes.u
  for _, share in ipairs { 1 / 200, 1 / 40, 1 / 10 } do              -- poles around 1/T, of distinct sizes
    for _, sign in ipairs { 1, -1 } do
      local den = { 1 }
      for k = 1, np do den = times(den, { 1, 1 / (span * share * 2^(1 - k)) }) end
      local num = {}
      for k = 1, nz + 1 do num[k] = k == nz + 1 and sign * gain * den[np + 1] or 0 end
      add(num, den)
    end
  end
  T = span / 40
  local names = {}
  for k = nz, 0, -1 do names[#names + 1] = "b" .. k end
  for k = np - 1, 0, -1 do names[#names + 1] = "a" .. k end
  -- size of each coefficient in these units
  local unit = {}
  for k = 1, nz + 1 do unit[k] = gain * T^-(np - (nz + 1 - k)) end
  for k = 1, np do unit[nz + 1 + k] = T^-k end
  local function build(v)
    local num, den = {}, { 1 }
    for k = 1, nz + 1 do num[k] = v[k] end
    for k = 1, np do den[k + 1] = v[nz + 1 + k] end
    return num, den, delay
  end
  local function unpacked(p)
    local v = {}
    for k = 1, #names do v[k] = p[k] * unit[k] end
    return v
  end
  for _, start in ipairs(starts) do for k = 1, #names do start[k] = start[k] / unit[k] end end
  local r, tried = search(d, ic, function(p) return build(unpacked(p)) end, starts)
  local values, std, cov = unpacked(r.theta), {}, {}
  for i = 1, #names do
    std[i], cov[i] = math.abs(unit[i]) * r.std[i], {}
    for j = 1, #names do cov[i][j] = unit[i] * unit[j] * r.cov(i, j) end
  end
  return finish(r, d, ic, ("transfer function with %s, %s"):format(counted(np, "pole"), counted(nz, "zero")),
    names, values,
    { std = std, cov = cov, starts = tried }, build)
end

return { process_model = process_model, tfest = tfest }
