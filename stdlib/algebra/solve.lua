-- Equations in closed form. The roots of one equation come from its factors over ℚ; systems from
-- factors, elimination of unknowns that occur linearly, and resultants.

local deepest, most_solutions = 60, 64

local function contains(list, x)
  for i = 1, #list do if list[i] == x then return true end end
  return false
end

local function depends(e, x) return contains(symbols_in(e), x) end

local function depends_on_any(e, unknowns)
  for _, s in ipairs(symbols_in(e)) do if contains(unknowns, s) then return true end end
  return false
end

local function residual_of(equation)
  local kind = object_type(equation)
  if kind == "equation" then return equation.lhs - equation.rhs end
  if kind == "expr" or type(equation) == "number" then return equation end
  fail("roots and solve expect an equation, x^2 ~ 2, or an expression that is 0, got "
    .. (kind or type(equation)))
end

local function is_number(e) return type(e) == "number" or #symbols_in(e) == 0 end
local function value(e) return type(e) == "number" and e or evaluate(e) end

-- ── one unknown ────────────────────────────────────────────────────────────

-- Collects roots, each once, and what has to hold for them.
local function new_roots() return { conditions = {}, complex = {} } end

local function add_root(list, root)
  root = simplify(root)
  if not contains(list, root) then list[#list + 1] = root end
end

local function add_condition(list, text)
  for _, known in ipairs(list.conditions) do if known == text then return end end
  list.conditions[#list.conditions + 1] = text
end

-- What must not vanish, without numbers and signs.
local function nonzero(e)
  local product = 1
  for _, each in ipairs(factors(e)) do product = product*each[1] end
  return tostring(product) .. " ≠ 0"
end

local find_roots

local function quadratic(c, list)
  local discriminant = simplify(c[2]^2 - 4*c[1]*c[3])
  if is_number(discriminant) and is_number(c[3]) then
    if value(discriminant) < 0 then
      list.complex[#list.complex + 1] = { re = simplify(-c[2]/(2*c[3])),
        im = simplify(sqrt(-discriminant)/(2*abs(c[3]))) }
      return
    end
  elseif not is_number(discriminant) then
    add_condition(list, tostring(factor(discriminant)) .. " ≥ 0 (real)")
  end
  local root = simplify(sqrt(factor(discriminant)))
  add_root(list, (-c[2] + root)/(2*c[3]))
  add_root(list, (-c[2] - root)/(2*c[3]))
end

-- xⁿ = v.
local function pure_power(n, v, x, list)
  if n % 2 == 1 then
    if is_number(v) and value(v) < 0 then return add_root(list, -(-v)^rational("1/" .. n)) end
    return add_root(list, v^rational("1/" .. n))
  end
  if is_number(v) then
    if value(v) < 0 then
      list.none = ("%s = %s has no real solution"):format(tostring(x^n), tostring(v))
      if n == 2 then list.complex[#list.complex + 1] = { re = 0, im = simplify(sqrt(-v)) } end
      return
    end
  else
    add_condition(list, tostring(v) .. " ≥ 0 (real)")
  end
  local root = v^rational("1/" .. n)
  add_root(list, root)
  add_root(list, -root)
end

-- The greatest k such that only powers of xᵏ occur.
local function common_step(c)
  local step = 0
  for i = 2, #c do
    if c[i] ~= 0 then
      local a, b = step, i - 1
      while b ~= 0 do a, b = b, a % b end
      step = a
    end
  end
  return step
end

local function numeric_roots(c, list)
  local n = #c - 1
  local companion = {}
  for i = 1, n do
    companion[i] = {}
    for j = 1, n do companion[i][j] = i == j + 1 and 1.0 or 0.0 end
    companion[i][n] = -value(c[i])/value(c[n + 1])
  end
  local eigenvalues = eig(evaluate(mat(companion)))
  list.approximate = true
  local re, im = eigenvalues.re, eigenvalues.im
  for i = 1, n do
    local size = math.max(1, math.abs(re[i]))
    if math.abs(im[i]) < 1e-9*size then
      list[#list + 1] = re[i] + 0.0
    elseif im[i] > 0 then
      list.complex[#list.complex + 1] = { re = re[i], im = im[i] }
    end
  end
end

local function polynomial_roots(e, x, list)
  local c = coefficients(e, x)
  local n = #c - 1
  if n < 1 then return end
  if not is_number(c[n + 1]) then add_condition(list, nonzero(c[n + 1])) end
  if n == 1 then return add_root(list, -c[1]/c[2]) end
  local step = common_step(c)
  if step == n then return pure_power(n, simplify(-c[1]/c[n + 1]), x, list) end
  if step > 1 then
    local power, reduced = param "pendula_power", 0
    for i = 1, #c, step do reduced = reduced + c[i]*power^((i - 1)//step) end
    local squares = new_roots()
    find_roots(reduced, power, squares)
    for _, condition in ipairs(squares.conditions) do add_condition(list, condition) end
    for _, v in ipairs(squares) do pure_power(step, v, x, list) end
    return
  end
  if n == 2 then return quadratic(c, list) end
  for i = 1, #c do
    if not is_number(c[i]) then
      fail(("roots: %s = 0 has degree %d in %s, and its factors have no roots in closed form; give values to "
        .. "its symbols: roots(subs(e, { %s = 1 }), %s)")
        :format(tostring(e), n, tostring(x), tostring(symbols_in(c[i])[1]), tostring(x)))
    end
  end
  numeric_roots(c, list)
end

-- f(argument) = v: the arguments.
local inverse = {
  sin = function(v) return { asin(v), pi - asin(v) }, "+ 2 k π" end,
  cos = function(v) return { acos(v), -acos(v) }, "+ 2 k π" end,
  tan = function(v) return { atan(v) }, "+ k π" end,
  exp = function(v) return { log(v) } end,
  log = function(v) return { exp(v) } end,
  sinh = function(v) return { asinh(v) } end,
  cosh = function(v) return { acosh(v), -acosh(v) } end,
  tanh = function(v) return { atanh(v) } end,
  asin = function(v) return { sin(v) } end,
  acos = function(v) return { cos(v) } end,
  atan = function(v) return { tan(v) } end,
  sqrt = function(v) return { v^2 } end,
  abs = function(v) return { v, -v } end,
}
-- Where a value is none of the function.
local outside = {
  sin = function(v) return math.abs(v) > 1 end, cos = function(v) return math.abs(v) > 1 end,
  exp = function(v) return v <= 0 end, cosh = function(v) return v < 1 end,
    tanh = function(v) return math.abs(v) >= 1 end,
  sqrt = function(v) return v < 0 end, abs = function(v) return v < 0 end,
}

local algebraic = { add = true, sub = true, mul = true, div = true, neg = true }

-- The parts of e that contain x and are no polynomials in it: { [text] = expression }.
local function functions_of(e, x, found)
  local op, a, b = operation(e)
  if op == "" then return found end
  local whole_power = op == "pow" and math.type(b) == "integer"
  if algebraic[op] or whole_power then
    functions_of(a, x, found)
    if b ~= nil and not whole_power then functions_of(b, x, found) end
  elseif depends(e, x) and not contains(found, e) then
    found[#found + 1] = e
  end
  return found
end

local function invert(e, f, x, list)
  local stand_in = param "pendula_function"
  local reduced = subs(e, { [f] = stand_in })
  if depends(reduced, x) then return false end
  local op, argument, second = operation(f)
  local values = new_roots()
  find_roots(reduced, stand_in, values)
  for _, condition in ipairs(values.conditions) do add_condition(list, condition) end
  for _, v in ipairs(values) do
    local arguments, period
    if outside[op] and is_number(v) and outside[op](value(v)) then goto next_value end
    if op == "pow" and not depends(second, x) then
      arguments = { v^(1/second) }
    elseif op == "pow" and not depends(argument, x) then
      argument, arguments = second, { log(v)/log(argument) }
    elseif inverse[op] then
      arguments, period = inverse[op](v)
    else
      return false
    end
    do
      if period then list.period = period end
      if outside[op] and not is_number(v) then
        add_condition(list, ("%s = %s"):format(tostring(f), tostring(v)))
      end
      for _, a in ipairs(arguments) do find_roots(argument - a, x, list) end
    end
    ::next_value::
  end
  return true
end

-- Adds the roots of e to a list. Fails where there is no closed form.
function find_roots(e, x, list, depth)
  depth = depth or 1
  if depth > deepest then fail("roots: the equation is nested too deeply") end
  local numerator, denominator = fraction(e)
  if numerator == 0 then fail(("roots: the equation holds for every %s"):format(tostring(x))) end
  for _, each in ipairs(factors(numerator)) do
    local base = each[1]
    if depends(base, x) then
      local inside = functions_of(base, x, {})
      if #inside == 0 then
        polynomial_roots(base, x, list)
      elseif #inside > 1 or not invert(base, inside[1], x, list) then
        fail(("roots: no closed form of the solutions of %s = 0 for %s; newton{ r = { … }, start = { … } } "
          .. "finds them in numbers")
          :format(tostring(base), tostring(x)))
      end
    end
  end
  if depends(denominator, x) then
    for i = #list, 1, -1 do
      if simplify(subs(denominator, { [x] = list[i] })) == 0 then table.remove(list, i) end
    end
  end
end

local function root_lines(list, x)
  local lines, sign = {}, list.approximate and " ≈ " or " = "
  for i = 1, #list do
    local shown = type(list[i]) == "number" and list.approximate and ("%.10g"):format(list[i])
      or tostring(list[i])
    lines[#lines + 1] = tostring(x) .. sign .. shown .. (list.period and " " .. list.period or "")
  end
  for _, pair in ipairs(list.complex) do
    local im = pair.im
    local shown = type(im) == "number" and math.type(im) == "float" and ("%.10g"):format(im) or tostring(im)
    lines[#lines + 1] = ("%s%s%s ± %s i  (no real solutions)"):format(tostring(x), sign,
      type(pair.re) == "number" and ("%.10g"):format(pair.re) or tostring(pair.re), im == 1 and "" or shown)
  end
  if #lines == 0 then lines[1] = list.none or "no solution" end
  if #list.conditions > 0 then lines[#lines + 1] = "where " .. table.concat(list.conditions, ", ") end
  return table.concat(lines, "\n"):gsub("±  i", "± i")
end

local function roots_of(e, x)
  if object_type(x) ~= "expr" or operation(x) ~= "" then
    fail("roots: the second argument is the symbol to solve for: roots(x^2 - 2, x)")
  end
  local list = new_roots()
  find_roots(residual_of(e), x, list)
  local numbers = true
  for i = 1, #list do numbers = numbers and is_number(list[i]) end
  if numbers then table.sort(list, function(a, b) return value(a) < value(b) end) end
  return setmetatable(list, { __tostring = function(r) return (root_lines(r, x)) end, __name = "roots" })
end

-- ── systems  ────────────────────────────────────────────────────────────

local function substituted(equations, x, by)
  local rest = {}
  for _, e in ipairs(equations) do
    local numerator = fraction(subs(e, { [x] = by }))
    if numerator ~= 0 then rest[#rest + 1] = numerator end
  end
  return rest
end

local function without(list, i)
  local rest = {}
  for k = 1, #list do if k ~= i then rest[#rest + 1] = list[k] end end
  return rest
end

local function unknowns_in(e, unknowns)
  local inside, list = symbols_in(e), {}
  for _, x in ipairs(unknowns) do if contains(inside, x) then list[#list + 1] = x end end
  return list
end

local function polynomial_in(e, x) return #functions_of(e, x, {}) == 0 end

-- Values of x put into the solutions of the other unknowns: x = f(others).
local function completed(solutions, x, by)
  for _, s in ipairs(solutions) do
    local values = {}
    for y, v in pairs(s) do values[y] = v end
    s[x] = simplify(next(values) and subs(by, values) or by)
  end
  return solutions
end

local function append(into, more)
  for _, each in ipairs(more) do into[#into + 1] = each end
  if #into > most_solutions then fail("solve: more than " .. most_solutions .. " solutions") end
  return into
end

local search

-- An equation and an unknown that occurs linearly in it: with a number as coefficient if there is one,
-- else with parameters, else with unknowns.
local function linear_equation(equations, unknowns)
  local second
  for i, e in ipairs(equations) do
    for _, x in ipairs(unknowns_in(e, unknowns)) do
      if polynomial_in(e, x) then
        local c = coefficients(e, x)
        if #c == 2 then
          if is_number(c[2]) then return i, x, c end
          local free = not depends_on_any(c[2], unknowns)
          if not second or (free and not second.free) then second = { i, x, c, free = free } end
        end
      end
    end
  end
  if second then return table.unpack(second) end
end

local function by_factors(equations, unknowns, notes, depth)
  for i, e in ipairs(equations) do
    local parts = {}
    for _, each in ipairs(factors(e)) do
      if depends_on_any(each[1], unknowns) then parts[#parts + 1] = each[1] end
    end
    if #parts == 0 then return {} end                    -- a number or parameters ≠ 0
    if #parts > 1 or parts[1] ~= e then
      local solutions = {}
      for _, part in ipairs(parts) do
        local others = without(equations, i)
        table.insert(others, 1, part)
        append(solutions, search(others, unknowns, notes, depth + 1))
      end
      return solutions
    end
  end
end

local function by_one_unknown(equations, unknowns, notes, depth)
  for i, e in ipairs(equations) do
    local inside = unknowns_in(e, unknowns)
    if #inside == 1 then
      local list, solutions = new_roots(), {}
      find_roots(e, inside[1], list)
      for _, condition in ipairs(list.conditions) do add_condition(notes, condition) end
      notes.period = notes.period or list.period
      notes.approximate = notes.approximate or list.approximate
      if #list.complex > 0 or list.none then notes.complex = true end
      for k = 1, #list do
        local rest = substituted(without(equations, i), inside[1], list[k])
        append(solutions, completed(search(rest, unknowns, notes, depth + 1), inside[1], list[k]))
      end
      return solutions
    end
  end
end

-- One equation with several unknowns left: quadratic in one of them, which the others are parameters of.
local function by_quadratic(equations, unknowns, notes, depth)
  if #equations > 1 then return end
  for _, x in ipairs(unknowns_in(equations[1], unknowns)) do
    if polynomial_in(equations[1], x) and #coefficients(equations[1], x) == 3 then
      local list, solutions = new_roots(), {}
      find_roots(equations[1], x, list)
      for _, condition in ipairs(list.conditions) do add_condition(notes, condition) end
      for k = 1, #list do append(solutions, completed(search({}, unknowns, notes, depth + 1), x, list[k])) end
      return solutions
    end
  end
end

-- The determinant that vanishes where two polynomials in x have a common root.
local function resultant(a, b, x)
  local p, q = coefficients(a, x), coefficients(b, x)
  local m, n, rows = #p - 1, #q - 1, {}
  for i = 1, m + n do
    rows[i] = {}
    for j = 1, m + n do rows[i][j] = 0 end
  end
  for i = 1, n do for k = 0, m do rows[i][i + k] = p[m + 1 - k] end end
  for i = 1, m do for k = 0, n do rows[n + i][i + k] = q[n + 1 - k] end end
  return fraction(det(mat(rows)))
end

local function by_resultant(equations, unknowns, notes, depth)
  for _, x in ipairs(unknowns) do
    local with = {}
    for i, e in ipairs(equations) do
      if depends(e, x) then
        if not polynomial_in(e, x) then goto next_unknown end
        with[#with + 1] = i
      end
    end
    if #with >= 2 then
      local eliminated = resultant(equations[with[1]], equations[with[2]], x)
      if eliminated ~= 0 then
        local rest = without(equations, with[2])
        rest[#rest + 1] = eliminated
        return search(rest, unknowns, notes, depth + 1)
      end
    end
    ::next_unknown::
  end
  local first = equations[1]
  fail(("solve: no closed form is known for %s = 0; newton{ r = { … }, start = { … } } solves the system in "
    .. "numbers")
    :format(tostring(first)))
end

function search(equations, unknowns, notes, depth)
  if depth > deepest then fail("solve: the elimination does not end; solve a part of the equations first") end
  if #equations == 0 then return { {} } end
  local done = by_factors(equations, unknowns, notes, depth)
  if done then return done end
  local i, x, c = linear_equation(equations, unknowns)
  if i and not depends_on_any(c[2], unknowns) then
    if not is_number(c[2]) then add_condition(notes, nonzero(c[2])) end
    local by = simplify(-c[1]/c[2])
    return completed(search(substituted(without(equations, i), x, by), unknowns, notes, depth + 1), x, by)
  end
  done = by_one_unknown(equations, unknowns, notes, depth)
  if done then return done end
  if not i then
    return by_quadratic(equations, unknowns, notes, depth) or by_resultant(equations, unknowns, notes, depth)
  end
  local by, rest = simplify(-c[1]/c[2]), without(equations, i)
  local solutions = completed(search(substituted(rest, x, by), unknowns, notes, depth + 1), x, by)
  table.insert(rest, c[1])
  table.insert(rest, c[2])
  return append(solutions, search(rest, unknowns, notes, depth + 1))
end

-- Whether a solution satisfies the equations: exactly, or in numbers at arbitrary values of the
-- parameters.
local function satisfies(residuals, solution)
  for _, e in ipairs(residuals) do
    local good, left = pcall(function() return next(solution) and simplify(subs(e, solution)) or e end)
    if not good then return false end                      -- a denominator vanishes
    if left ~= 0 then
      local point, size = {}, 0
      for k, s in ipairs(symbols_in(left)) do point[s] = 0.3 + 0.37*k end
      local number = next(point) and evaluate(left, point) or value(left)
      if number == number and math.abs(number) > 1e-8 then return false end
    end
  end
  return true
end

local function same(a, b, unknowns)
  for _, x in ipairs(unknowns) do if a[x] ~= b[x] then return false end end
  return true
end

local solution_type = {
  __index = function(s, key)
    if type(key) == "string" then
      for x, v in pairs(s) do if x.name == key then return v end end
    end
  end,
}

local function solution_lines(list)
  local lines = {}
  for _, s in ipairs(list) do
    local parts = {}
    for _, x in ipairs(list.unknowns) do
      local v = rawget(s, x)
      parts[#parts + 1] = tostring(x) .. (v == nil and " free" or (list.approximate and " ≈ " or " = ")
        .. tostring(v))
    end
    lines[#lines + 1] = table.concat(parts, ",  ")
  end
  if #lines == 0 then lines[1] = list.complex and "no real solution" or "no solution" end
  if list.period then lines[#lines + 1] = "angles " .. list.period end
  if #list.conditions > 0 then lines[#lines + 1] = "where " .. table.concat(list.conditions, ", ") end
  return table.concat(lines, "\n")
end

local function all_solutions(equations, unknowns)
  if object_type(equations) == "equation" or object_type(equations) == "expr" then
    equations = { equations }
  end
  if object_type(unknowns) == "expr" then unknowns = { unknowns } end
  local residuals, list = {}, {}
  for i = 1, #unknowns do list[i] = unknowns[i] end
  for i = 1, #equations do
    local e = equations[i]
    if object_type(e) == "equation" and object_type(e.lhs) == "matrix" then
      for k = 1, #e.lhs do residuals[#residuals + 1] = e.lhs[k] - e.rhs[k] end
    else
      residuals[#residuals + 1] = residual_of(e)
    end
  end
  local numerators = {}
  for _, e in ipairs(residuals) do
    local numerator = fraction(e)
    if numerator ~= 0 then numerators[#numerators + 1] = numerator end
  end
  local notes = { conditions = {} }
  local found = { unknowns = list, conditions = notes.conditions }
  for _, s in ipairs(search(numerators, list, notes, 1)) do
    local known = not satisfies(residuals, s)
    for _, other in ipairs(found) do known = known or same(s, other, list) end
    if not known then found[#found + 1] = setmetatable(s, solution_type) end
  end
  found.period, found.complex, found.approximate = notes.period, notes.complex, notes.approximate
  return setmetatable(found, { __tostring = solution_lines, __name = "solutions" })
end

return { roots = roots_of, solve_equations = all_solutions }
