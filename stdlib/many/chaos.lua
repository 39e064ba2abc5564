-- Polynomial chaos: a polynomial in what varies, orthonormal for its distributions, with few terms.
--
-- Columns are chosen one after another, each the one that the residual resembles most (orthogonal matching
-- pursuit), and made orthogonal to those before it. The leave-one-out error comes from the same vectors q:
-- 1/N Σ (rᵢ/(1 - hᵢ))² with hᵢ = Σ qᵢ²; the number of terms is where it is least.
local answers = include "many/answers"
local sensitivity = include "many/sensitivity"
local chaos = {}

-- Orthonormal polynomials of a distribution up to a degree by the discretised Stieltjes procedure:
-- coefficients a, b of p_{k+1} √b_{k+1} = (x - a_k) p_k - √b_k p_{k-1}. Nodes: middles of equal cells of s
-- with u = s³(10 - 15 s + 6 s²), which crowd at both ends, where the distribution may have tails.
local function recursion(distribution, degree)
  local x, w, n = {}, {}, 4000
  for i = 1, n do
    local s = (i - 0.5)/n
    x[i] = distribution:quantile(s^3*(10 - 15*s + 6*s^2))
    w[i] = 30*s^2*(1 - s)^2/n
  end
  local a, b, before, now = {}, {}, {}, {}
  for i = 1, n do before[i], now[i] = 0, 1 end
  local last = 1
  for k = 1, degree + 1 do
    local square, moment = 0, 0
    for i = 1, n do
      local v = w[i]*now[i]^2
      square, moment = square + v, moment + v*x[i]
    end
    a[k], b[k] = moment/square, square/last
    last = square
    for i = 1, n do
      local next = (x[i] - a[k])*now[i] - (k > 1 and b[k] or 0)*before[i]
      before[i], now[i] = now[i], next
    end
  end
  return a, b
end

-- Values of the orthonormal polynomials 0 … degree at x.
local function polynomials(rule, x, degree)
  local p = { [0] = 1 }
  local a, b = rule.a, rule.b
  for k = 1, degree do
    local next = (x - a[k])*p[k - 1] - (k > 1 and math.sqrt(b[k])*p[k - 2] or 0)
    p[k] = next/math.sqrt(b[k + 1])
  end
  return p
end

-- All exponents of d quantities with a sum up to degree.
local function exponents(d, degree)
  local list = {}
  local function extend(prefix, left)
    if #prefix == d then
      list[#list + 1] = prefix
      return
    end
    for k = 0, left do
      local longer = table.move(prefix, 1, #prefix, 1, {})
      longer[#longer + 1] = k
      extend(longer, left - k)
    end
  end
  extend({}, degree)
  return list
end

local most_terms = 3000

local function product(values, exponent)
  local v = 1
  for j, k in ipairs(exponent) do
    if k > 0 then v = v*values[j][k] end
  end
  return v
end

-- Columns of the basis at the runs that have a value.
local function basis(s, rules, list, degree, response)
  local names, rows = s.names, {}
  local params = {}
  for j, name in ipairs(names) do params[j] = s.params[name] end
  local y = {}
  for run = 1, #response do
    if response[run] == response[run] then
      local values = {}
      for j = 1, #names do values[j] = polynomials(rules[j], params[j][run], degree) end
      rows[#rows + 1], y[#y + 1] = values, response[run]
    end
  end
  local columns = {}
  for c, exponent in ipairs(list) do
    local column = {}
    for i, values in ipairs(rows) do column[i] = product(values, exponent) end
    columns[c] = column
  end
  return columns, y
end

local function dot_of(a, b)
  local sum = 0
  for i = 1, #a do sum = sum + a[i]*b[i] end
  return sum
end

-- The column that resembles the residual most, made orthogonal to the chosen ones; nil where none is left.
local function next_column(columns, used, residual, q)
  local best, most = nil, 0
  for c, column in ipairs(columns) do
    if not used[c] then
      local size = dot_of(column, column)
      local share = size > 0 and dot_of(column, residual)^2/size or 0
      if share > most then best, most = c, share end
    end
  end
  if not best then return end
  used[best] = true
  local v, parts = table.move(columns[best], 1, #residual, 1, {}), {}
  for k = 1, #q do
    parts[k] = 0
  end
  for _ = 1, 2 do                                      -- twice is enough
    for k = 1, #q do
      local part = dot_of(q[k], v)
      parts[k] = parts[k] + part
      for i = 1, #v do v[i] = v[i] - part*q[k][i] end
    end
  end
  local length = math.sqrt(dot_of(v, v))
  if not (length > 1e-10*math.sqrt(dot_of(columns[best], columns[best]))) then return best end
  for i = 1, #v do v[i] = v[i]/length end
  parts[#q + 1] = length
  return best, v, parts
end

local function fitted(columns, y)
  local n, used, q, R, chosen, g = #y, {}, {}, {}, {}, {}
  local residual, leverage = table.move(y, 1, n, 1, {}), {}
  local mean, total = 0, 0
  for i = 1, n do mean, leverage[i] = mean + y[i]/n, 0 end
  for i = 1, n do total = total + (y[i] - mean)^2/n end
  local best = { loo = math.huge }
  local limit = math.min(#columns, n - 1)
  for _ = 1, #columns do
    if #q >= limit then break end
    local c, v, parts = next_column(columns, used, residual, q)
    if not c then break end
    if v then
      q[#q + 1], R[#R + 1], chosen[#chosen + 1] = v, parts, c
      g[#g + 1] = dot_of(v, residual)
      local loo = 0
      for i = 1, n do
        residual[i] = residual[i] - g[#g]*v[i]
        leverage[i] = leverage[i] + v[i]^2
        loo = loo + (residual[i]/math.max(1 - leverage[i], 1e-12))^2/n
      end
      if loo < best.loo then best = { loo = loo, terms = #q } end
      if loo > 10*best.loo or loo <= 1e-28*(total + mean^2) then break end
    end
  end
  local coefficients = {}
  for k = best.terms, 1, -1 do                            -- R c = g, R by columns
    local sum = g[k]
    for l = k + 1, best.terms do sum = sum - R[l][k]*coefficients[l] end
    coefficients[k] = sum/R[k][k]
  end
  return best, chosen, coefficients, total
end

function chaos.chaos(s, e, options)
  options = options or {}
  local degree = options.degree or 3
  if math.type(degree) ~= "integer" or degree < 1 or degree > 30 then
    fail(("chaos: degree = %s; it must be a whole number from 1 to 30"):format(tostring(degree)))
  end
  if s.correlated then
    fail "chaos: quantities that vary together have no product basis; give independent ones"
  end
  local distributions, rules = s.distributions, {}
  for j, name in ipairs(s.names) do
    local d = distributions[name]
    if not d then fail(("chaos: %s is a list; chaos needs distributions"):format(name)) end
    local text = tostring(d)
    if text:find "^discrete" or text:find "^empirical" then
      fail(("chaos: %s = %s is not continuous"):format(name, text))
    end
    local a, b = recursion(d, degree)
    rules[j] = { a = a, b = b }
  end
  local list = exponents(#s.names, degree)
  if #list > most_terms then
    fail(("chaos: degree %d in %d quantities has %d terms; at most %d are tried"):format(degree, #s.names,
      #list,
      most_terms))
  end
  local columns, y = basis(s, rules, list, degree, answers.values(s, e, options.t))
  if #y < 3 then fail "chaos: fewer than three runs have a value; see s.failures" end
  local best, chosen, coefficients, total = fitted(columns, y)
  local mean, variance, terms = 0, 0, {}
  for k = 1, best.terms do
    local exponent = list[chosen[k]]
    local constant = true
    for _, power in ipairs(exponent) do constant = constant and power == 0 end
    if constant then mean = coefficients[k] else variance = variance + coefficients[k]^2 end
    terms[k] = { exponent = exponent, coefficient = coefficients[k], constant = constant }
  end
  local loo = total > 0 and best.loo/total or 0
  return record("chaos", { mean = mean, std = math.sqrt(variance), loo = loo, terms = best.terms,
    list = terms,
    rules = rules, names = s.names, degree = degree, variance = variance,
    text = ("polynomial of degree %d in %s: %d of %d terms from %d runs\n  mean %.8g, std %.6g, "
      .. "leave-one-out error "
      .. "%.3g of the variance"):format(degree, table.concat(s.names, ", "), best.terms, #list, #y, mean,
      math.sqrt(variance), loo) })
end

function chaos.indices(self)
  local c = contents("chaos", self)
  local first, total = {}, {}
  for j = 1, #c.names do first[j], total[j] = 0, 0 end
  for _, term in ipairs(c.list) do
    local involved = {}
    for j, power in ipairs(term.exponent) do
      if power > 0 then involved[#involved + 1] = j end
    end
    for _, j in ipairs(involved) do total[j] = total[j] + term.coefficient^2/c.variance end
    if #involved == 1 then first[involved[1]] = first[involved[1]] + term.coefficient^2/c.variance end
  end
  return record("sobol_indices", { names = c.names, first = first, total = total,
    text = sensitivity.text(c.names, first, total) })
end

function chaos.value(self, at)
  local c, values, sum = contents("chaos", self), {}, 0
  for j, name in ipairs(c.names) do
    if at[name] == nil then fail(("chaos: %s has no value; write c{ %s = … }"):format(name, name)) end
    values[j] = polynomials(c.rules[j], at[name], c.degree)
  end
  for _, term in ipairs(c.list) do sum = sum + term.coefficient*product(values, term.exponent) end
  return sum
end

return chaos
