-- When are two answers the same? As they stand, after simplification, or as functions at random points.

local points, models = include "grade/points", include "grade/models"
local compare = {}
local samples = 32                -- random points at which two expressions are compared

-- Within `tolerance` of the larger one, or within the rounding of numbers as large as `scale`; a reference of
-- exactly 0 has the size 1.
local function close(answer, wanted, tolerance, scale)
  if answer == wanted then return true end
  local larger = math.max(math.abs(answer), math.abs(wanted))
  if larger ~= larger or larger == math.huge then return false end   -- ∞ is within ∞ of everything
  local difference = math.abs(answer - wanted)
  return difference <= tolerance*(wanted == 0 and 1 or larger) or difference <= 1e-12*(scale or 0)
end

local function names_in(list) return (leaves_of(list)) end

-- A point inside `range`, or one of symbols of both signs and several sizes; is it all positive?
local function random_point(names, random, range, k)
  local at, positive = {}, true
  for _, name in ipairs(names) do
    local limits = range and range[name] or { 0.2, 1.8 }
    at[name] = random(limits[1], limits[2])
    if not range then
      if k % 4 == 3 then at[name] = 5*at[name] end
      if k % 2 == 0 and random(-1, 1) < 0 then at[name], positive = -at[name], false end
    end
  end
  return at, positive
end

-- An answer with branches could be right near the random points only: points of every size.
local function same_far_away(a, b, all, task)
  local random = points.generator(30011)
  if task.range or not (points.branches(a.e) or points.branches(b.e)) then return true end
  for exponent = -8, 8 do
    for _ = 1, 4 do
      local at = {}
      for _, name in ipairs(all) do
        at[name] = (random(-1, 1) < 0 and -1 or 1)*10.0^exponent*random(0.2, 1.8)
      end
      local x, y = a.value(at), b.value(at)
      local finite = math.abs(x) < math.huge and math.abs(y) < math.huge
      if finite and not close(x, y, task.tolerance or 1e-6) then return false end
    end
  end
  return true
end

-- Equal as functions of their symbols, which are the same when their names are? Where some symbol is
-- negative, one of them may have no value, as √l √g where √(l g) has one.
local function same_function(a, b, task)
  local all, random = points.union(a.names, b.names), points.generator(20011)
  local compared, sizes = {}, {}
  for k = 1, samples do
    local at, positive = random_point(all, random, task.range, k)
    local x, y = a.value(at), b.value(at)
    if x == x and y == y then
      compared[#compared + 1], sizes[#sizes + 1] = { x, y }, math.abs(y)
    elseif x ~= x and y == y and (positive or task.range) then
      return false
    end
  end
  if #compared < 3 then return false end
  table.sort(sizes)
  local typical, tolerance = sizes[(#sizes + 1)//2], task.tolerance or 1e-9
  for _, pair in ipairs(compared) do
    local near = math.abs(pair[1] - pair[2]) <= tolerance*typical and typical < math.huge
    if not near and not close(pair[1], pair[2], tolerance) then return false end
  end
  return same_far_away(a, b, all, task)
end

-- An expression as a function of values by name; renamed: its names in those of the other one.
local function function_of(e, renamed)
  local names = {}
  for i, name in ipairs(names_in { e }) do names[i] = renamed and renamed[name] or name end
  return { e = e, names = names, value = function(at)
    if not renamed then return points.value_at(e, at) end
    local own = {}
    for _, name in ipairs(names_in { e }) do own[name] = at[renamed[name] or name] end
    return points.value_at(e, own)
  end }
end

local function same_expression(a, b, task)
  if a == b then return "right" end
  local good, difference = pcall(function() return simplify(a - b) end)
  if good and difference == 0 then return "equivalent" end
  if same_function(function_of(a), function_of(b), task) then return "equivalent" end
  if not task.any_names then return false end
  for _, names in ipairs(points.renamings(names_in { a }, names_in { b }, true)) do
    if same_function(function_of(a, names), function_of(b), task) then return "equivalent" end
  end
  return false
end

local function is_number(value)
  if type(value) == "number" then return value end
  if object_type(value) == "expr" and #names_in { value } == 0 then return evaluate(value) end
end

local same

local function worse(a, b) return (a == "equivalent" or b == "equivalent") and "equivalent" or "right" end

-- A matrix as a list, row after row; a list as it is.
local function entries(list)
  if object_type(list) ~= "matrix" then return list end
  local out = {}
  for i = 1, list.rows do
    for j = 1, list.cols do out[#out + 1] = list(i, j) end
  end
  return out
end

-- The same task, with the size of the largest number of a list: what is rounding there.
local function scaled(list, task)
  local scale = 0
  local function look(value)
    local size = is_number(value)
    if size and math.abs(size) < math.huge then scale = math.max(scale, math.abs(size)) end
  end
  for _, value in ipairs(list) do
    if object_type(value) == "complex" then
      look(value.re)
      look(value.im)
    else
      look(value)
    end
  end
  return setmetatable({ scale = scale }, { __index = task })
end

local function all_equations(list)
  for i = 1, #list do
    if object_type(list[i]) ~= "equation" then return false end
  end
  return #list > 0
end

-- Lists entry by entry, or in any order; equations in any order are a system.
local function same_list(a, b, task)
  if #a ~= #b then return false end
  if task.any_order then
    if all_equations(a) and all_equations(b) and models.same_equations(a, b, task) then
      return "equivalent"
    end
    task = scaled(b, task)
  end
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

local function same_matrix(a, b, task)
  if a.rows ~= b.rows or a.cols ~= b.cols then return false end
  local list = entries(b)
  return same_list(entries(a), list, setmetatable({ any_order = false }, { __index = scaled(list, task) }))
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
  for order in points.permutations(n) do
    if fits(order) then return "equivalent" end
  end
  return false
end

local function same_equation(a, b, task)
  local verdict = same(a.lhs, b.lhs, task) and same(a.rhs, b.rhs, task)
  if verdict then return verdict end
  return models.same_equations({ a }, { b }, task)
end

-- The transfer function without common factors.
local function lowest(g)
  local good, minimal = pcall(minreal, g)
  return (good and minimal or g):tf()
end

-- Coefficients from the highest power on, in units of the frequency at which the first and the last term of
-- the denominator are as large: what is large and small among them is comparable then.
local function balanced(list, degree, frequency)
  local out = {}
  for k = 1, #list do out[k] = is_number(list[k])/frequency^(degree - #list + k) end
  return out
end

local function same_coefficients(a, b, tolerance)
  local scale = 0
  for i = 1, #b do scale = math.max(scale, math.abs(b[i])) end
  for i = 1, #b do
    if not (math.abs(a[i] - b[i]) <= tolerance*scale) then return false end
  end
  return #a == #b
end

-- The same response, whatever the realisation.
local function same_response(a, b, task)
  local x, y = lowest(a), lowest(b)
  if #x.num ~= #y.num or #x.den ~= #y.den then return false end
  for _, list in ipairs { x.num, x.den, y.num, y.den } do
    for i = 1, #list do
      if not is_number(list[i]) then
        return same(x.num*y.den[1], y.num*x.den[1], task) and same(x.den*y.den[1], y.den*x.den[1], task)
      end
    end
  end
  local degree, frequency, leading = #y.den - 1, 1, is_number(y.den[1])
  for k = 1, degree do
    local ratio = math.abs(is_number(y.den[k + 1])/leading)
    if ratio > 0 then frequency = ratio^(1/k) end
  end
  local function lists(g)
    local first = is_number(g.den[1])
    return balanced(g.num/first, degree, frequency), balanced(g.den/first, degree, frequency)
  end
  local num, den = lists(x)
  local wanted_num, wanted_den = lists(y)
  local tolerance = task.tolerance or 1e-6
  return same_coefficients(num, wanted_num, tolerance) and same_coefficients(den, wanted_den, tolerance)
end

local function same_lti(a, b, task)
  if a.Ts ~= b.Ts then return false end
  local good, num = pcall(function() return a.num, b.num end)
  if good and num and same(a.num, b.num, task) and same(a.den, b.den, task) then return "right" end
  return same_response(a, b, task) and "equivalent"
end

-- Complex numbers within the tolerance of their modulus.
local function same_complex(a, b, task)
  local x, y, u, v = is_number(a.re), is_number(a.im), is_number(b.re), is_number(b.im)
  if not (x and y and u and v) then
    local re, im = same(a.re, b.re, task), same(a.im, b.im, task)
    return re and im and worse(re, im)
  end
  if x == u and y == v then return "right" end
  local size = math.max(math.sqrt(u*u + v*v), 1e-6*(task.scale or 0))
  local distance = math.sqrt((x - u)^2 + (y - v)^2)
  return distance <= (task.tolerance or 1e-6)*(size > 0 and size or 1) and "equivalent"
end

local kinds = { matrix = same_matrix, tableau = same_tableau, model = models.same, equation = same_equation,
  complex = same_complex,
  lti = same_lti }

-- "right", "equivalent" or false. `wanted` is the reference.
function same(answer, wanted, task)
  if type(answer) == "string" and is_number(wanted) then          -- "1/3", as tableaus have it
    local good, value = pcall(rational, answer)
    if good then answer = value end
  end
  local x, y = is_number(answer), is_number(wanted)
  if x and y then
    if math.type(x) == "integer" and x == y then return "right" end
    return close(x, y, task.tolerance or 1e-6, task.scale) and (answer == wanted and "right" or "equivalent")
  end
  local kind, other = object_type(answer), object_type(wanted)
  if (kind == "expr" or type(answer) == "number") and (other == "expr" or type(wanted) == "number") then
    return same_expression(answer, wanted, task)
  end
  if kind and kind == other then return kinds[kind] and kinds[kind](answer, wanted, task) end
  if kind == "matrix" and answer.cols == 1 and type(wanted) == "table" then
    return same_list(entries(answer), wanted, task)
  end
  if other == "matrix" and type(answer) == "table" then        -- rows as tables, or a column
    local good, matrix = pcall(type(answer[1]) == "table" and mat or vec, answer)
    return good and same_matrix(matrix, wanted, task) and "equivalent"
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
