-- Hammerstein–Wiener models with given bases: y = Σ dⱼ hⱼ(w) + e, w = B/F v, v = Σ cᵢ gᵢ(u) (Ljung, 2nd ed.,
-- §5.1).
-- One coefficient of each basis is 1: the scale between it and B is free.
local common = include "identification/common"

local estimated = { __name = "hammerstein wiener" }

function estimated.__tostring(r)
  local lines = { ("Hammerstein–Wiener model, estimated from %d samples"):format(r.rows) }
  for k, name in ipairs(r.names) do
    lines[#lines + 1] = ("  %-4s %14.9g ± %.4g"):format(name, r.theta[k], r.std[k])
  end
  for _, name in ipairs(r.ones) do lines[#lines + 1] = ("  %-4s = 1"):format(name) end
  lines[#lines + 1] = ("  loss V = %.8g, fit on the estimation data: %.6g %% (simulation, from rest)")
    :format(r.loss, r.fit)
  lines[#lines + 1] = "  search: " .. r.verdict
  local open = {}
  for k, name in ipairs(r.names) do if not (r.std[k] < math.huge) then open[#open + 1] = name end end
  if #open > 0 then
    lines[#lines + 1] = ("  warning: the data do not tell %s apart: functions of a basis depend on each other, or the "
      .. "input does not excite them; give fewer"):format(table.concat(open, ", "))
  end
  table.move(r.remarks, 1, #r.remarks, #lines + 1, lines)
  return table.concat(lines, "\n")
end

local function rational(b, f, nk, v)
  local w = {}
  for t = 1, #v do
    local sum = 0
    for k = 1, #b do sum = sum + b[k] * (v[t - nk - k + 1] or 0) end
    for k = 1, #f do sum = sum - f[k] * (w[t - k] or 0) end
    w[t] = sum
  end
  return w
end

local function combined(c, columns)
  local out = {}
  for t = 1, #columns[1] do
    local sum = 0
    for i, column in ipairs(columns) do sum = sum + c[i] * column[t] end
    out[t] = sum
  end
  return out
end

-- θ = [b, f, c without the one that is 1, d without …]
local function pieces(p, o)
  local at = 0
  local function take(n)
    local list = {}
    for k = 1, n do list[k] = p[at + k] end
    at = at + n
    return list
  end
  local function with_one(n, one)
    local list = take(n - 1)
    table.insert(list, one, 1)
    return list
  end
  local b, f = take(o.nb), take(o.nf)
  return b, f, with_one(#o.input, o.c_one), o.output and with_one(#o.output, o.d_one)
end

local function simulate(p, o, columns)
  local b, f, c, dd = pieces(p, o)
  if not common.stable(f) then return nil end
  local w = rational(b, f, o.nk, combined(c, columns))
  if not o.output then return w end
  local y = {}
  for t = 1, #w do
    local sum = 0
    for j, h in ipairs(o.output) do sum = sum + dd[j] * h(w[t]) end
    y[t] = sum
  end
  return y
end

local function check_basis(name, basis)
  if type(basis) ~= "table" or #basis == 0 then
    fail(("hammerstein: %s is a list of functions of one number"):format(name))
  end
  for _, g in ipairs(basis) do
    if type(g) ~= "function" and object_type(g) == nil then
      fail(("hammerstein: %s is a list of functions of one number"):format(name))
    end
  end
  return basis
end

local function basis_columns(basis, u)
  local columns = {}
  for i, g in ipairs(basis) do
    columns[i] = {}
    for t = 1, #u do
      local v = g(u[t])
      if type(v) ~= "number" or v ~= v then
        fail(("hammerstein: function %d gives no number at u = %.6g"):format(i, u[t]))
      end
      columns[i][t] = v + 0.0
    end
  end
  return columns
end

-- Linear steps: OE on the basis functions as inputs; the largest channel gives B and F, the others their
-- share.
local function start_values(d, o, columns)
  local inputs = {}
  for i, column in ipairs(columns) do inputs[i] = column end
  local n, nb, nk, nf = #inputs, {}, {}, {}
  for i = 1, n do nb[i], nk[i], nf[i] = o.nb, o.nk, 0 end
  local m = named "arx" (named "iddata" { y = d.y, u = inputs, Ts = d.Ts }, { na = o.nf, nb = nb, nk = nk })
  local B = n == 1 and { m.B } or m.B
  local size, best = {}, 1
  for i = 1, n do
    local sum, scale = 0, 0
    for k = 1, B[i].cols do sum = sum + math.abs(evaluate(B[i][k])) end
    for t = 1, #columns[i] do scale = scale + columns[i][t]^2 end
    size[i] = sum * math.sqrt(scale)
    if size[i] > size[best] then best = i end
  end
  o.c_one = best
  local p, b = {}, {}
  for k = 1, o.nb do b[k] = evaluate(B[best][o.nk + k]) + 0.0 p[k] = b[k] end
  for k = 1, o.nf do p[o.nb + k] = evaluate(m.A[k + 1]) + 0.0 end
  local dot = 0
  for k = 1, o.nb do dot = dot + b[k]^2 end
  for i = 1, n do
    if i ~= best then
      local share = 0
      for k = 1, o.nb do share = share + b[k] * evaluate(B[i][o.nk + k]) end
      p[#p + 1] = dot > 0 and share / dot or 0
    end
  end
  local f = { table.unpack(p, o.nb + 1, o.nb + o.nf) }
  for _ = 1, 200 do
    if common.stable(f) then break end
    for k = 1, #f do f[k] = f[k] * 0.95^k end
  end
  for k = 1, #f do p[o.nb + k] = f[k] end
  o.d_one = 1
  for j = 2, o.output and #o.output or 0 do p[#p + 1] = 0 end
  return p
end

local function hammerstein(d, options)
  common.one_record("hammerstein", d)
  if #d.y_names > 1 or #d.u_names > 1 then fail "hammerstein is for one input and one output" end
  local o = { nb = options.nb, nf = options.nf or 0, nk = options.nk or 1 }
  for _, key in ipairs { "nb", "nf", "nk" } do
    if math.type(o[key]) ~= "integer" or o[key] < (key == "nb" and 1 or 0) then
      fail(("hammerstein: %s is a whole number"):format(key))
    end
  end
  o.input = options.input and check_basis("input", options.input) or { function(x) return x end }
  o.output = options.output and check_basis("output", options.output)
  local u, y = {}, {}
  for t = 1, d.y.rows do
    u[t], y[t] = d.u(t, 1) + 0.0, d.y(t, 1) + 0.0
    if u[t] ~= u[t] or y[t] ~= y[t] then
      fail "hammerstein: samples are missing; fill them first: d:fill()"
    end
  end
  common.informative("hammerstein", d, u, 1, o.nb + o.nf + #o.input + (o.output and #o.output or 0) + 1)
  local columns = basis_columns(o.input, u)
  local start = start_values(d, o, columns)
  local r = named "nlsq" (function(p)
    local model = simulate(p, o, columns)
    local e = {}
    for t = 1, #y do e[t] = model and y[t] - model[t] or 0 / 0 end
    return e
  end, start)
  local names, ones = {}, {}
  for k = 0, o.nb - 1 do names[#names + 1] = "b" .. (o.nk + k) end
  for k = 1, o.nf do names[#names + 1] = "f" .. k end
  local function coefficients(letter, n, one)
    for i = 1, n do
      if i == one then ones[#ones + 1] = letter .. i else names[#names + 1] = letter .. i end
    end
  end
  coefficients("c", #o.input, o.c_one)
  if o.output then coefficients("d", #o.output, o.d_one) end
  local mean, variation = 0, 0
  for t = 1, #y do mean = mean + y[t] / #y end
  for t = 1, #y do variation = variation + (y[t] - mean)^2 end
  local b, f, c, dd = pieces(r.theta, o)
  local out = setmetatable({ names = names, ones = ones, theta = r.theta, std = r.std, cov = r.cov, b = b,
    f = f, c = c,
    d = dd, loss = r.sse / #y, sigma2 = r.sigma2, rows = #y, fit = 100 * (1 - math.sqrt(r.sse / variation)),
    verdict = r.verdict, converged = r.converged, remarks = common.output_error_remarks(d) }, estimated)
  out.linear = named "tf" (named "vstack" (b), named "vstack" { 1, table.unpack(f) }, d.Ts)
  out.options = o
  return out
end

estimated.__index = {
  latex = report_latex,
  simulate = function(r, d)
    common.data("r:simulate", d)
    local u = {}
    for t = 1, d.u.rows do u[t] = d.u(t, 1) + 0.0 end
    return named "vstack" (simulate(r.theta, r.options, basis_columns(r.options.input, u)))
  end,
}

return { hammerstein = hammerstein }
