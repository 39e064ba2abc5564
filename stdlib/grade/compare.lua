-- When are two answers the same? As they stand, after simplification, or as functions at random points.

local compare = {}
local samples = 24                -- random points at which two expressions are compared

-- A sequence of its own (Park and Miller, 1988), so that a verdict does not depend on anything else.
local function generator(seed)
  local state = seed
  return function(low, high)
    state = state*48271 % 2147483647
    return low + (high - low)*state/2147483647
  end
end

local function close(a, b, tolerance)
  if a ~= a or b ~= b then return a ~= a and b ~= b end
  if a == b then return true end
  if math.max(math.abs(a), math.abs(b)) == math.huge then return false end   -- ∞ is within ∞ of everything
  return math.abs(a - b) <= tolerance*math.max(1, math.abs(a), math.abs(b))
end

-- The value of e where its symbols, by name, are those in `at`; nan where it has none.
local function value_at(e, at)
  if type(e) == "number" then return e end
  local inside = {}
  for _, name in ipairs(leaves_of { e }) do inside[name] = at[name] end
  local good, value = pcall(evaluate, e, inside)
  return good and type(value) == "number" and value or 0/0
end

local function names_in(list) return (leaves_of(list)) end

local function random_point(names, random, range)
  local at = {}
  for _, name in ipairs(names) do
    local limits = range and range[name] or { 0.2, 1.8 }
    at[name] = random(limits[1], limits[2])
  end
  return at
end

-- The names of several lists, each once, in order.
local function union(...)
  local set, list = {}, {}
  for _, names in ipairs { ... } do
    for _, name in ipairs(names) do
      if not set[name] then list[#list + 1] = name end
      set[name] = true
    end
  end
  table.sort(list)
  return list
end

-- An answer with branches could be right near the random points only: points of every size.
local function same_far_away(a, b, all, random, task)
  local function branches(e) return type(e) ~= "number" and e:code():find "ifelse" end
  if task.range or not (branches(a) or branches(b)) then return true end
  for exponent = -8, 8 do
    for _, sign in ipairs { 1, -1 } do
      local at = random_point(all, random)
      for _, name in ipairs(all) do at[name] = sign*10.0^exponent*at[name] end
      local x, y = value_at(a, at), value_at(b, at)
      local finite = math.abs(x) < math.huge and math.abs(y) < math.huge
      if finite and not close(x, y, task.tolerance or 1e-6) then return false end
    end
  end
  return true
end

-- Equal as functions of their symbols, which are the same when their names are?
local function same_function(a, b, task)
  local of_a, of_b = names_in { a }, names_in { b }
  local all, random, defined = union(of_a, of_b), generator(20011), 0
  for k = 1, samples do
    local at = random_point(all, random, task.range)
    if not task.range and k % 2 == 0 then
      for _, name in ipairs(all) do at[name] = -at[name] end
    end
    local x, y = value_at(a, at), value_at(b, at)
    if not close(x, y, task.tolerance or 1e-9) then return false end
    if x == x then defined = defined + 1 end
  end
  return defined >= 3 and same_far_away(a, b, all, random, task)
end

local function same_expression(a, b, task)
  if a == b then return "right" end
  local good, difference = pcall(function() return simplify(a - b) end)
  if good and difference == 0 then return "equivalent" end
  return same_function(a, b, task) and "equivalent"
end

local function is_number(value)
  if type(value) == "number" then return value end
  if object_type(value) == "expr" and #names_in { value } == 0 then return evaluate(value) end
end

local same

local function worse(a, b) return (a == "equivalent" or b == "equivalent") and "equivalent" or "right" end

local function same_matrix(a, b, task)
  if a.rows ~= b.rows or a.cols ~= b.cols then return false end
  local verdict = "right"
  for i = 1, a.rows do
    for j = 1, a.cols do
      local one = same(a(i, j), b(i, j), task)
      if not one then return false end
      verdict = worse(verdict, one)
    end
  end
  return verdict
end

-- Lists entry by entry, or in any order.
local function same_list(a, b, task)
  if #a ~= #b then return false end
  local verdict, used = "right", {}
  for i = 1, #a do
    local found
    for j = task.any_order and 1 or i, task.any_order and #b or i do
      found = not used[j] and same(a[i], b[j], task)
      if found then
        if i ~= j then found = "equivalent" end
        used[j] = true
        break
      end
    end
    if not found then return false end
    verdict = worse(verdict, found)
  end
  for key, value in next, b do
    if type(key) == "string" then
      local one = rawget(a, key) ~= nil and same(rawget(a, key), value, task)
      if not one then return false end
      verdict = worse(verdict, one)
    end
  end
  return verdict
end

-- The permutations of 1 … n, one after the other.
local function permutations(n)
  local function go(list, k)
    if k == n then coroutine.yield(list) end
    for i = k, n do
      list[k], list[i] = list[i], list[k]
      if k < n then go(list, k + 1) end
      if k < n then list[k], list[i] = list[i], list[k] end
      if k == n then break end
    end
  end
  local list = {}
  for i = 1, n do list[i] = i end
  return coroutine.wrap(function() go(list, 1) end)
end

-- Stages may be numbered in another order.
local function same_tableau(a, b, task)
  local n = a.stages
  if n ~= b.stages then return false end
  local function equal(x, y) return same(x, y, task) end
  local function fits(order)
    for i = 1, n do
      if not equal(a.b[i], b.b[order[i]]) or not equal(a.c[i], b.c[order[i]]) then return false end
    end
    for i = 1, n do
      for j = 1, n do
        if not equal(a.A(i, j), b.A(order[i], order[j])) then return false end
      end
    end
    return true
  end
  local identity = {}
  for i = 1, n do identity[i] = i end
  if fits(identity) then return "right" end
  if n > 6 then return false end
  for order in permutations(n) do
    if fits(order) then return "equivalent" end
  end
  return false
end

-- ── models: the same set of (t, x, x′, z) ──────────────────────────────────────────────────────────────────

local function residuals(model)
  local list = {}
  for _, equation in ipairs(model.equations) do
    local lhs, rhs = equation.lhs, equation.rhs
    for i = 1, #lhs do list[#list + 1] = lhs[i] - rhs[i] end
  end
  return list
end

local function renamed(name, names)
  local base, primes = name:match "^(.-)('*)$"
  return (names[base] or base) .. primes
end

-- Points on rows = 0, as values by name: by Gauss–Newton from random starts.
local function points_on(rows, fixed, seed)
  local names, leaves = leaves_of(rows)
  local random, found = generator(seed), {}
  for _ = 1, 8 do
    local at, unknowns, start, values, place = {}, {}, {}, {}, {}
    for k, name in ipairs(names) do
      at[name] = fixed[name] or random(-1.5, 1.5)
      if fixed[name] then
        values[leaves[k]] = at[name]
      else
        unknowns[#unknowns + 1], start[#start + 1], place[#place + 1] = leaves[k], at[name], name
      end
    end
    local inserted = {}
    for i, e in ipairs(rows) do inserted[i] = subs(e, values) end
    local good, k = pcall(gauss_newton, { R = inserted, x = unknowns, start = start, tol = 1e-12 })
    if good and k.converged then
      for i, name in ipairs(place) do at[name] = k.x[i] end
      local residual = 0
      for _, e in ipairs(rows) do residual = math.max(residual, math.abs(value_at(e, at))) end
      if residual < 1e-8 then found[#found + 1] = at end
    end
    if #found == 3 then break end
  end
  return found
end

-- Do the rows vanish at these points, whose names are translated first?
local function vanish(rows, points_of, names, fixed)
  local of_rows, random = names_in(rows), generator(401)
  for _, at in ipairs(points_of) do
    local there = {}
    for name, value in pairs(at) do there[renamed(name, names)] = value end
    for _, name in ipairs(of_rows) do there[name] = there[name] or fixed[name] or random(-1.5, 1.5) end
    for _, e in ipairs(rows) do
      if not (math.abs(value_at(e, there)) < 1e-6) then return false end
    end
  end
  return #points_of > 0
end

local function base_names(model)
  local names = {}
  for _, part in ipairs { model.differential, model.algebraic } do
    for i = 1, #part do names[#names + 1] = part[i].name:gsub("'", "") end
  end
  return union(names)
end

-- Renamings of the unknowns of one model into those of the other: of what both do not share.
local function renamings(a, b)
  local of_a, of_b, only_a, only_b, shared = base_names(a), base_names(b), {}, {}, {}
  for _, name in ipairs(of_b) do shared[name] = true end
  for _, name in ipairs(of_a) do
    if shared[name] then shared[name] = 2 else only_a[#only_a + 1] = name end
  end
  for _, name in ipairs(of_b) do
    if shared[name] ~= 2 then only_b[#only_b + 1] = name end
  end
  return coroutine.wrap(function()
    if #only_a ~= #only_b or #only_a > 6 then return end
    if #only_a == 0 then return coroutine.yield({}, {}) end
    for order in permutations(#only_a) do
      local there, back = {}, {}
      for i, name in ipairs(only_a) do
        there[name], back[only_b[order[i]]] = only_b[order[i]], name
      end
      coroutine.yield(there, back)
    end
  end)
end

local function same_model(a, b)
  if #a.differential ~= #b.differential or #a.algebraic ~= #b.algebraic then return false end
  if a:code() == b:code() then return "right" end
  local rows_a, rows_b = residuals(a), residuals(b)
  if #rows_a ~= #rows_b then return false end
  local fixed, random = {}, generator(77)
  for _, model in ipairs { a, b } do
    for _, part in ipairs { model.parameters, model.inputs } do
      for i = 1, #part do
        local name = part[i].name
        fixed[name] = fixed[name] or random(0.5, 1.5)
      end
    end
  end
  fixed.t = 0.7
  local on_a, on_b = points_on(rows_a, fixed, 101), points_on(rows_b, fixed, 211)
  for there, back in renamings(a, b) do
    if vanish(rows_b, on_a, there, fixed) and vanish(rows_a, on_b, back, fixed) then return "equivalent" end
  end
  return false
end

local function same_equation(a, b, task)
  local verdict = same(a.lhs, b.lhs, task) and same(a.rhs, b.rhs, task)
  if verdict then return verdict end
  local one, other = a.lhs - a.rhs, b.lhs - b.rhs
  return (same(one, other, task) or same(-one, other, task)) and "equivalent"
end

-- The transfer function without common factors.
local function lowest(g)
  local good, minimal = pcall(minreal, g)
  return (good and minimal or g):tf()
end

local kinds = { matrix = same_matrix, tableau = same_tableau, model = same_model, equation = same_equation,
  complex = function(a, b, task)
    local re, im = same(a.re, b.re, task), same(a.im, b.im, task)
    return re and im and worse(re, im)
  end,
  lti = function(a, b, task)
    if a.Ts ~= b.Ts then return false end
    local good, num = pcall(function() return a.num, b.num end)
    if good and num and same(a.num, b.num, task) and same(a.den, b.den, task) then return "right" end
    local x, y = lowest(a), lowest(b)                 -- the same response, whatever the realisation
    return #x.num == #y.num and same(x.num*y.den[1], y.num*x.den[1], task)
      and same(x.den*y.den[1], y.den*x.den[1], task) and "equivalent"
  end }

-- "right", "equivalent" or false. `wanted` is the reference.
function same(answer, wanted, task)
  local x, y = is_number(answer), is_number(wanted)
  if x and y then
    if math.type(x) == "integer" and x == y then return "right" end
    return close(x, y, task.tolerance or 1e-6) and (answer == wanted and "right" or "equivalent")
  end
  local kind, other = object_type(answer), object_type(wanted)
  if (kind == "expr" or type(answer) == "number") and (other == "expr" or type(wanted) == "number") then
    return same_expression(answer, wanted, task)
  end
  if kind and kind == other then return kinds[kind] and kinds[kind](answer, wanted, task) end
  local column = kind == "matrix" and answer.cols == 1 or other == "matrix" and wanted.cols == 1
  if column and (type(answer) == "table" or type(wanted) == "table") then
    return same_list(answer, wanted, task)
  end
  if type(answer) == "table" and type(wanted) == "table" then return same_list(answer, wanted, task) end
  if type(answer) == "string" and type(wanted) == "string" then
    if answer == wanted then return "right" end
    local function plain(text) return text:lower():gsub("%s+", " "):match "^%s*(.-)%s*$" end
    return plain(answer) == plain(wanted) and "equivalent"
  end
  return answer == wanted and "right"
end

compare.same = same
return compare
