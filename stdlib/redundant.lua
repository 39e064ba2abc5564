-- Overconstrained mechanisms: constraints that depend on each other wherever the mechanism can move.

local failing = 1e-3                            -- of the terms of a constraint that the others should imply
local negligible = 1e-7                         -- of a row of ∂C/∂q; positions are known to 1e-8 and better

local function product(a, b)
  local sum = 0
  for j = 1, #a do sum = sum + a[j] * b[j] end
  return sum
end

local function remove(row, unit)
  local share = product(row, unit)
  for j = 1, #row do row[j] = row[j] - share * unit[j] end
end

-- Gram-Schmidt, the longest remainder first: numbers of independent rows, and an orthonormal basis of all.
local function independent_rows(rows)
  local rest, chosen, basis = {}, {}, {}
  for i, row in ipairs(rows) do
    local size = math.sqrt(product(row, row))
    rest[i] = {}
    for j, v in ipairs(row) do rest[i][j] = size > 0 and v / size or 0 end
  end
  while true do
    local best, longest = nil, negligible
    for i, row in ipairs(rest) do
      local length = math.sqrt(product(row, row))
      if length > longest * (1 + 1e-9) then best, longest = i, length end
    end
    if not best then break end
    local unit = {}
    for j, v in ipairs(rest[best]) do unit[j] = v / longest end
    chosen[#chosen + 1], basis[#basis + 1] = best, unit
    for _ = 1, 2 do for _, row in ipairs(rest) do remove(row, unit) end end
  end
  table.sort(chosen)
  return chosen, basis
end

-- A position near the given values (keys: coordinates or names), and the gradients of the constraints there
-- as lists of numbers.
local function position(sys, near, params)
  local C, q, start = {}, {}, {}
  for i = 1, #sys.C do C[i] = sys.C[i] end
  for j = 1, #sys.q do
    q[j] = sys.q[j]
    start[j] = near[q[j]] or near[q[j].name] or 0
  end
  local values = sys.values
  for key, value in pairs(params or {}) do values[key] = value end
  local run = gauss_newton { R = C, x = q, start = start, params = values, method = "levenberg-marquardt" }
  if run.loss > 1e-16 * (1 + dot(vec(start), vec(start))) then
    fail "independent: no position near these values satisfies the constraints; give other values in guess"
  end
  local rows, at = {}, {}
  for i = 1, #C do
    rows[i] = {}
    for j = 1, #q do rows[i][j] = #q == 1 and #C == 1 and run.J or run.J(i, j) end
  end
  for j = 1, #q do at[q[j]] = #q == 1 and run.x or run.x[j] end
  return at, rows
end

-- Values further along a motion that the constraints allow to first order; nil where there is none.
local function moved(sys, at, basis)
  local q, best, longest = sys.q, nil, negligible
  for k = 1, #q do
    local row = {}
    for j = 1, #q do row[j] = j == k and 1 or 0 end
    for _ = 1, 2 do for _, unit in ipairs(basis) do remove(row, unit) end end
    local length = math.sqrt(product(row, row))
    if length > longest then best, longest = row, length end
  end
  if not best then return nil end
  local near = {}
  for j = 1, #q do near[q[j]] = at[q[j]] + 0.05 * best[j] / longest * (1 + math.abs(at[q[j]])) end
  return near
end

local function pick(list, numbers)
  local out = {}
  for _, k in ipairs(numbers) do out[#out + 1] = list[k] end
  return out
end

local function others(count, numbers)
  local taken, out = {}, {}
  for _, k in ipairs(numbers) do taken[k] = true end
  for k = 1, count do if not taken[k] then out[#out + 1] = k end end
  return out
end

-- How large the terms of constraint k are at a position, from its gradient there; of all, where they are 0.
local function sizes(sys, at, rows)
  local list, largest = {}, 0
  for k, row in ipairs(rows) do
    list[k] = 0
    for j = 1, #row do list[k] = list[k] + math.abs(row[j] * at[sys.q[j]]) end
    largest = math.max(largest, list[k])
  end
  for k, size in ipairs(list) do if size == 0 then list[k] = largest > 0 and largest or 1 end end
  return list
end

local function independent_at(sys, request)
  local near = {}
  for _, list in ipairs { request.guess or {}, request.fix or {} } do
    for key, value in pairs(list) do near[key] = value end
  end
  local at, rows = position(sys, near, request.params)
  local chosen, basis = independent_rows(rows)
  local count = #sys.C
  if #chosen == count then
    fail(("independent: the gradients of the %d constraints are independent at this position; the model can "
      .. "be used as it is"):format(count))
  end
  local further = moved(sys, at, basis)
  if not further then
    fail(("independent: the gradients of the constraints have rank %d of %d, and nothing can move at this "
      .. "position"):format(#chosen, count))
  end
  local _, there = position(sys, further, request.params)
  local beside = #independent_rows(there)
  if beside ~= #chosen then
    fail(("independent: the gradients of the constraints have rank %d at this position and %d beside it: it "
      .. "is singular, and no constraint is redundant; give another one"):format(#chosen, beside))
  end
  return chosen, sizes(sys, at, rows)
end

doc { name = "model:independent", module = "mech",
  sig = "sys:independent{ fix =, guess =, params = } -> model",
  text = [[The same motion by independent constraints, for a mechanism by lagrange whose constraints depend
    on each other wherever it can move (Bricard's linkage, a parallelogram with a third crank): index,
    degrees of freedom and all forms of reduce are right for it. Forces of dependent constraints are not
    unique; z are those of least norm, z = ∂C/∂q (∂C/∂q)ᵣᵀ y with the rows r that are independent. The other
    constraints hold by themselves; `excess` is by how much they fail: 0 at every start. A run ends where that
    is a thousandth of their terms: behind a position in which the chosen constraints depend on each other.]],
  example = [[
    a = var("a", 4)                     -- three cranks and their coupler, in angles
    C = { cos(a[1]) + 2*cos(a[4]) - 2 - cos(a[2]), sin(a[1]) + 2*sin(a[4]) - sin(a[2]),
          cos(a[1]) + 4*cos(a[4]) - 4 - cos(a[3]), sin(a[1]) + 4*sin(a[4]) - sin(a[3]) }
    linkage = lagrange{ q = a, T = dot(a.dot, a.dot)/2, V = 9.81*sin(a[1]), C = C }
    free = linkage:independent{ fix = { a1 = 1 }, guess = { a2 = 1, a3 = 1, a4 = 0 } }
    return free:index(), free:dof() ]],
  gives = "3 2", options = {
    option("fix", "table", "coordinates that are given there: { a1 = 1 }", "", "@variables"),
    option("guess", "table", "where the search for the others begins", "", "@variables"),
    option("params", "table", "values of parameters: { m = 2 }", "", "@parameters") }, options_at = 2,
  function(sys, request)
    if object_type(sys) ~= "model" or not pcall(function() return sys.C[1] end) then
      fail "independent: expected a model made by lagrange{ …, C = { … } }"
    end
    local chosen, size = independent_at(sys, request or {})
    local G, z, C = sys.dCdq, sys.multipliers, sys.C
    local rest, rows = others(#C, chosen), {}
    for _, k in ipairs(chosen) do rows[#rows + 1] = G[k] end
    local kept = #rows == 1 and rows[1] or vstack(table.unpack(rows))
    local y, excess = var("independent", #chosen), var("excess", #rest)
    local equations, at_start, ends = { sys.M * sys.q.ddot + G.T * z ~ sys.rhs }, {}, {}
    for _, e in ipairs(pick(C, chosen)) do equations[#equations + 1] = 0 ~ e end
    for k, e in ipairs(pick(C, rest)) do
      local own = #rest == 1 and excess or excess[k]
      equations[#equations + 1] = own ~ e
      at_start[own] = 0
      -- behind a position where the chosen ones depend on each other, they allow what the others do not
      ends[k] = { when = abs(own) - failing * size[rest[k]], direction = 1, action = "stop" }
    end
    equations[#equations + 1] = z ~ G * (kept.T * y)
    local note = ("gradients of the constraints: rank %d of %d"):format(#chosen, #C)
    local model = dae { equations, start = at_start, notes = { note }, events = ends }
    return next(sys.values) and model:with(sys.values) or model
  end }
