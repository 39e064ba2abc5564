-- Feedback around models, and observers of models: sys:close, estimator, ekf.

local function is_model(v) return object_type(v) == "model" end

-- ── closed loops ──

local function input_names(sys)
  local names = {}
  for k = 1, #sys.inputs do names[k] = tostring(sys.inputs[k]) end
  return names
end

-- The input leaf (or column of leaves) that a key of the table means.
local function input_of(sys, key)
  if type(key) ~= "string" then return key end
  local list = {}
  for k = 1, #sys.inputs do
    local u = sys.inputs[k]
    if tostring(u) == key then return u end
    if tostring(u):match "^(.-)[₀-₉%d]+$" == key then list[#list + 1] = u end
  end
  if #list > 0 then return named "vec" (list) end
  local names = input_names(sys)
  fail(("close: the model has no input '%s'.%s (inputs: %s)"):format(key, did_you_mean(key, names),
    #names > 0 and table.concat(names, ", ") or "none"))
end

-- dae{ sys, u ~ law, … }; positional entries are estimators, models and equations that belong to the loop.
local function close(sys, laws)
  if type(laws) ~= "table" or object_type(laws) then fail "close: write sys:close{ u = -K*(x - x0) }" end
  local parts, count = { sys }, 0
  for _, entry in ipairs(laws) do
    if type(entry) == "table" and entry.equations and not object_type(entry) then
      for _, equation in ipairs(entry.equations) do parts[#parts + 1] = equation end
    else
      parts[#parts + 1] = entry
    end
  end
  local keys = {}
  for key in pairs(laws) do if math.type(key) ~= "integer" then keys[#keys + 1] = key end end
  table.sort(keys, function(a, b) return tostring(a) < tostring(b) end)
  for _, key in ipairs(keys) do
    local law, u = laws[key], input_of(sys, key)
    if object_type(law) == "matrix" and law.rows * law.cols == 1 then law = law(1, 1) end
    parts[#parts + 1] = u ~ law
    count = count + 1
  end
  if count == 0 then fail("close: give a law for an input: " .. table.concat(input_names(sys), ", ")) end
  return named "dae" (parts)
end

-- ── estimators ──

-- L as a matrix: a list is a column, or a row where there is one state.
local function gain_matrix(L, n, p)
  if object_type(L) == "matrix" then return L end
  if type(L) ~= "table" then return named "mat" { { L } } end
  if type(L[1]) == "table" then return named "mat" (L) end
  return n == 1 and p > 1 and named "mat" { L } or named "vec" (L)
end

local function linear_estimator(G, L)
  local g = G:ss()
  local n, m, p = #g.A, #G.inputs, #G.outputs
  L = gain_matrix(L, n, p)
  if L.rows ~= n or L.cols ~= p then
    fail(("estimator: L must be %d×%d, got %d×%d"):format(n, p, L.rows, L.cols))
  end
  local zeros, hstack, vstack, eye = named "zeros", named "hstack", named "vstack", named "eye"
  return named "ss" { A = g.A - L * g.C, B = hstack(g.B - L * g.D, L), C = vstack(g.C, eye(n)),
    D = vstack(hstack(g.D, zeros(p, p)), zeros(n, m + p)), Ts = G.Ts ~= 0 and G.Ts or nil }
end

-- x′ = f, 0 = g of a model of index 1, with the names of its variables.
local function explicit(by, sys)
  local ok, e = pcall(sys.semi_explicit, sys)
  if not ok or e:index() > 1 then
    fail(by .. ": the model must have index 1 at most; reduce it first, sys:reduce \"minimal\"")
  end
  return e
end

-- Symbols of the model → symbols of the copy; der(θ) → ω̂ where θ′ = ω.
local function copies(e, suffix)
  local map, x, z = {}, {}, {}
  for k = 1, #e.differential do
    x[k] = named "var" (tostring(e.differential[k]) .. suffix)
    map[e.differential[k]] = x[k]
  end
  for k = 1, #e.algebraic do
    z[k] = named "var" (tostring(e.algebraic[k]) .. suffix)
    map[e.algebraic[k]] = z[k]
  end
  for k, equation in ipairs(e.equations) do
    local target = k <= #x and map[equation.rhs]
    if target then map[equation.lhs] = target end
  end
  return map, x, z
end

local function column_of(y)
  if y == nil then fail "estimator: y is missing: estimator(sys, L, { y = the measured expression })" end
  if type(y) == "table" and not object_type(y) then return named "vec" (y) end
  return object_type(y) == "matrix" and y or named "vec" { y }
end

local observer = { __tostring = function(est)
  local lines = { ("observer of %s, for sys:close{ u = …, est }"):format(tostring(est.x)) }
  for k, equation in ipairs(est.equations) do lines[k + 1] = "  " .. tostring(equation) end
  return table.concat(lines, "\n")
end }

-- x̂′ = f(x̂, ẑ, u) + L (y - h(x̂, ẑ, u)), 0 = g(x̂, ẑ, u); y = h of the plant itself.
local function model_estimator(sys, L, options)
  local e = explicit("estimator", sys)
  local h, subs = column_of(options and options.y), named "subs"
  local map, x, z = copies(e, "_hat")
  local n, p = #x, h.rows
  local gain = gain_matrix(L, n, p)
  if gain.rows ~= n or gain.cols ~= p then
    fail(("estimator: L must be %d×%d (states × outputs), got %d×%d"):format(n, p, gain.rows, gain.cols))
  end
  local correction = gain * (h - subs(h, map))
  if object_type(correction) ~= "matrix" then correction = named "vec" { correction } end
  local equations = {}
  for k, equation in ipairs(e.equations) do
    local right = subs(equation.rhs, map)
    if k <= n then equations[k] = named "der" (x[k]) ~ right + correction[k]
    else equations[k] = 0 ~ right - subs(equation.lhs, map) end
  end
  return setmetatable({ equations = equations, x = named "vec" (x), z = #z > 0 and named "vec" (z) or nil },
    observer)
end

local function estimator(plant, L, options)
  plant = as_model(plant)
  if object_type(plant) == "lti" then return linear_estimator(plant, L) end
  if not is_model(plant) then fail "estimator: expected a model or a linear system" end
  return model_estimator(plant, L, options)
end

-- ── the extended Kalman filter ──

local M = {}                                                            -- matrices as lists of rows
function M.times(a, b)
  local out = {}
  for i = 1, #a do
    out[i] = {}
    for j = 1, #b[1] do
      local sum = 0
      for k = 1, #b do sum = sum + a[i][k] * b[k][j] end
      out[i][j] = sum
    end
  end
  return out
end
function M.transposed(a)
  local out = {}
  for j = 1, #a[1] do out[j] = {} for i = 1, #a do out[j][i] = a[i][j] end end
  return out
end
function M.plus(a, b, factor)
  local out = {}
  for i = 1, #a do out[i] = {} for j = 1, #a[1] do out[i][j] = a[i][j] + (factor or 1) * b[i][j] end end
  return out
end
-- Gauss with pivoting; a⁻¹ b, ln |det a|
function M.solve(a, b)
  local n, m, log_det = #a, #b[1], 0
  local rows = {}
  for i = 1, n do
    rows[i] = { table.unpack(a[i]) }
    for j = 1, m do rows[i][n + j] = b[i][j] end
  end
  for k = 1, n do
    local pivot = k
    for i = k + 1, n do if math.abs(rows[i][k]) > math.abs(rows[pivot][k]) then pivot = i end end
    if rows[pivot][k] == 0 then fail "ekf: a covariance is singular; give R > 0" end
    rows[k], rows[pivot] = rows[pivot], rows[k]
    log_det = log_det + math.log(math.abs(rows[k][k]))
    for j = n + m, k, -1 do rows[k][j] = rows[k][j] / rows[k][k] end
    for i = 1, n do
      local f = rows[i][k]
      if i ~= k and f ~= 0 then for j = k, n + m do rows[i][j] = rows[i][j] - f * rows[k][j] end end
    end
  end
  local out = {}
  for i = 1, n do out[i] = { table.unpack(rows[i], n + 1) } end
  return out, log_det
end

-- A number (times the identity), a list of variances, or a matrix.
local function covariance(by, value, n)
  local out = {}
  for i = 1, n do
    out[i] = {}
    for j = 1, n do
      if object_type(value) == "matrix" or type(value) == "table" and type(value[1]) == "table" then
        local entry = object_type(value) == "matrix" and value(i, j) or value[i] and value[i][j]
        if type(entry) ~= "number" then fail(("%s must be a %d×%d matrix of numbers"):format(by, n, n)) end
        out[i][j] = entry + 0.0
      elseif type(value) == "table" then
        if #value ~= n then fail(("%s has %d variances for %d"):format(by, #value, n)) end
        out[i][j] = i == j and value[i] + 0.0 or 0.0
      elseif type(value) == "number" then out[i][j] = i == j and value + 0.0 or 0.0
      else fail(by .. " must be a number, a list of variances or a matrix") end
    end
  end
  for i = 1, n do
    if not (out[i][i] >= 0) then fail(("%s: variance %d is %g"):format(by, i, out[i][i])) end
    for j = 1, i do
      local apart = math.abs(out[i][j] - out[j][i])
      if apart > 1e-10*(out[i][i] + out[j][j]) then fail(by .. " must be symmetric") end
    end
  end
  return out
end

local filtered = { __name = "filtered states" }
function filtered.__tostring(r)
  local lines = { ("extended Kalman filter over %d samples, ln L = %.7g"):format(#r.t, r.log_likelihood) }
  for k, name in ipairs(r.names) do
    lines[#lines + 1] = ("  %-8s %12.6g ± %.3g at the end"):format(name, r.x[#r.t][k], r.std[#r.t][k])
  end
  return table.concat(lines, "\n")
end
filtered.__index = { latex = report_latex, plot = function(r, options)
  local arguments = {}
  for k in ipairs(r.names) do
    local column = {}
    for t = 1, #r.t do column[t] = r.x[t][k] end
    arguments[#arguments + 1], arguments[#arguments + 2] = r.t, column
  end
  local base = { title = "filtered states", xlabel = "t [s]", labels = r.names, style = "line" }
  for key, value in pairs(options or {}) do base[key] = value end
  arguments[#arguments + 1] = base
  return named "plot" (table.unpack(arguments))
end }

local function read_ekf(sys, options)
  sys = as_model(sys)
  if not is_model(sys) then fail "ekf: expected a model" end
  for _, key in ipairs { "data", "y", "Q", "R", "start" } do
    if options[key] == nil then
      fail(("ekf: %s is missing; write ekf(sys, { data = d, y = x, Q = …, R = …, start = { x = 1 } })")
        :format(key))
    end
  end
  local d = options.data
  if object_type(d) ~= "iddata" then fail "ekf: data must be iddata" end
  local e, h = explicit("ekf", sys), column_of(options.y)
  if h.rows ~= #d.y_names then
    fail(("ekf: y names %d expressions, but the data has %d outputs"):format(h.rows, #d.y_names))
  end
  if #e.inputs ~= #d.u_names then
    fail(("ekf: the model has %d inputs, but the data %d"):format(#e.inputs, #d.u_names))
  end
  return d, e, h
end

-- One sample: from x at `from` over Ts. Values of y at both ends, Φ = ∂x(t + Ts)/∂x, ∂y/∂x at both ends.
local function propagate(e, h, x, d, k, options)
  local start, inputs, states = {}, {}, {}
  for i = 1, #e.differential do start[e.differential[i]], states[i] = x[i], e.differential[i] end
  for j = 1, #e.inputs do
    inputs[e.inputs[j]] = d.u(k, j)
    if d.u(k, j) ~= d.u(k, j) then
      fail(("ekf: the input %s is missing at sample %d"):format(d.u_names[j], k))
    end
  end
  local from = (k - 1) * d.Ts
  local sol = e:integrate { start = start, from = from, to = from + d.Ts, inputs = inputs,
    sensitivities = states,
    rtol = options.rtol or 1e-8, atol = (options.rtol or 1e-8) * 1e-2, method = options.method,
      times = { from, from + d.Ts } }
  if #sol.t < 2 then
    fail(("ekf: the model cannot be integrated over sample %d: %s"):format(k, tostring(sol.status)))
  end
  local n, p = #states, h.rows
  local r = { x = {}, Phi = {}, before = { y = {}, H = {} }, after = { y = {}, S = {} } }
  for i = 1, n do
    r.x[i], r.Phi[i] = sol(states[i], from + d.Ts), {}
    for j = 1, n do r.Phi[i][j] = sol:sensitivity(states[i], states[j], from + d.Ts) end
  end
  for i = 1, p do
    r.before.y[i], r.after.y[i] = sol(h[i], from), sol(h[i], from + d.Ts)
    r.before.H[i], r.after.S[i] = {}, {}
    for j = 1, n do
      r.before.H[i][j] = sol:sensitivity(h[i], states[j], from)
      r.after.S[i][j] = sol:sensitivity(h[i], states[j], from + d.Ts)
    end
  end
  return r
end

-- The measured rows of y at sample k: innovations, their rows of H and of R.
local function measured(d, k, y, H, R)
  local e, rows, noise, there = {}, {}, {}, {}
  for i = 1, #y do
    local v = d.y(k, i)
    if v == v then
      there[#there + 1] = i
      e[#e + 1], rows[#rows + 1] = { v - y[i] }, H[i]
    end
  end
  for a, i in ipairs(there) do
    noise[a] = {}
    for b, j in ipairs(there) do noise[a][b] = R[i][j] end
  end
  return e, rows, noise
end

local function ekf(sys, options)
  local d, e, h = read_ekf(sys, options)
  local n = #e.differential
  local Q, R = covariance("ekf: Q", options.Q, n), covariance("ekf: R", options.R, h.rows)
  local P = covariance("ekf: P0", options.P0 or 0, n)
  local at = object_type(options.start) and options.start or e:init { fix = options.start,
    inputs = (function() local u = {} for j = 1, #e.inputs do u[e.inputs[j]] = d.u(1, j) end return u end)() }
  local x, names = {}, {}
  for i = 1, n do x[i], names[i] = evaluate(at(e.differential[i])) + 0.0, tostring(e.differential[i]) end
  local r = setmetatable({ t = {}, x = {}, std = {}, innovations = {}, names = names, log_likelihood = 0 },
    filtered)
  local first = propagate(e, h, x, d, 1, options)
  local y, H = first.before.y, first.before.H
  for k = 1, d.y.rows do
    local error, rows, noise = measured(d, k, y, H, R)
    r.t[k], r.innovations[k] = (k - 1) * d.Ts, error
    if #error > 0 then
      local PHt = M.times(P, M.transposed(rows))
      local S = M.plus(M.times(rows, PHt), noise)
      local K = M.transposed((M.solve(S, M.transposed(PHt))))
      local weighted, log_det = M.solve(S, error)
      local step, squares = M.times(K, error), 0
      for i = 1, n do x[i] = x[i] + step[i][1] end
      for i = 1, #error do squares = squares + error[i][1] * weighted[i][1] end
      P = M.plus(P, M.times(K, M.transposed(PHt)), -1)
      r.log_likelihood = r.log_likelihood - 0.5 * (squares + log_det + #error * math.log(2 * math.pi))
    end
    r.x[k], r.std[k] = { table.unpack(x) }, {}
    for i = 1, n do r.std[k][i] = math.sqrt(math.max(0, P[i][i])) end
    if k < d.y.rows then
      local next = propagate(e, h, x, d, k, options)
      -- y depends on x(t + Ts) as its derivative by x(t) times Φ⁻¹ says, algebraic variables included
      x, y = next.x, next.after.y
      H = M.transposed((M.solve(M.transposed(next.Phi), M.transposed(next.after.S))))
      P = M.plus(M.times(M.times(next.Phi, P), M.transposed(next.Phi)), Q)
      for i = 1, n do for j = 1, i do
        P[i][j] = 0.5 * (P[i][j] + P[j][i])
        P[j][i] = P[i][j]
      end end
    end
  end
  return r
end

-- ── the Kalman filter of a linear system ──

local function plot_states(r, options)
  local x, std, panels = r.x, r.std, {}
  local t = {}
  for k = 1, x.rows do t[k] = r.t[k] end
  for i, name in ipairs(r.names) do
    local middle, low, high = {}, {}, {}
    for k = 1, x.rows do
      local m, s = x(k, i), std(k, i)
      middle[k], low[k], high[k] = m, m - 2*s, m + 2*s
    end
    panels[i] = { by = "r:plot", ylabel = name, legend = false, series = {
      { x = t, y = high, lower = low, style = "fill" }, { x = t, y = middle, labels = { name } } } }
  end
  panels[#panels].xlabel = "t [s]"
  panels[1].title = "states, ± 2 σ"
  local below = {}
  for i = 2, #panels do below[i - 1] = figure(panels[i]) end
  panels[1].below = below
  for key, value in pairs(options or {}) do panels[1][key] = value end
  return figure(panels[1])
end

return { close = close, estimator = estimator, ekf = ekf, plot_states = plot_states }
