-- Systems of equations in closed form: linear ones at once; else factors, unknowns that occur linearly,
-- equations with one unknown, resultants.

local equation = include "algebra/equation"
local polynomial = include "algebra/polynomial_roots"
local one_unknown = include "algebra/roots"
local text = include "algebra/solution_text"
local is_number, value, depends = equation.is_number, equation.value, equation.depends

local deepest, most_solutions = 60, 64

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

local function has_unknowns(e, unknowns) return #equation.unknowns_in(e, unknowns) > 0 end

local function polynomial_in(e, x) return #one_unknown.functions_of(e, x, {}) == 0 end

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
  if #into > most_solutions then equation.refuse("more than " .. most_solutions .. " solutions") end
  return into
end

local search

-- An equation and an unknown that occurs linearly in it: with a number as coefficient if there is one,
-- else with parameters, else with unknowns.
local function linear_equation(equations, unknowns)
  local second
  for i, e in ipairs(equations) do
    for _, x in ipairs(equation.unknowns_in(e, unknowns)) do
      if polynomial_in(e, x) then
        local c = coefficients(e, x)
        if #c == 2 then
          if is_number(c[2]) then return i, x, c end
          local free = not has_unknowns(c[2], unknowns)
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
      if has_unknowns(each[1], unknowns) then parts[#parts + 1] = each[1] end
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
    local inside = equation.unknowns_in(e, unknowns)
    if #inside == 1 then
      local list, solutions = polynomial.new_list(), {}
      one_unknown.find(e, inside[1], list)
      -- Cardano, Ferrari: the root keeps its name and is told by its equation
      if #list.definitions > 0 then
        notes.roots[inside[1]] = e
        local others = {}
        for _, x in ipairs(unknowns) do if x ~= inside[1] then others[#others + 1] = x end end
        return search(without(equations, i), others, notes, depth + 1)
      end
      for _, condition in ipairs(list.conditions) do equation.add_condition(notes.conditions, condition) end
      if list.periods and next(list.periods) then
        notes.period = text.period(select(2, next(list.periods)))
      end
      notes.approximate = notes.approximate or list.approximate
      if #list.complex > 0 then notes.complex = true end
      for k = 1, #list do
        equation.add_condition(notes.conditions, list.when[k])
        local rest = substituted(without(equations, i), inside[1], list[k])
        append(solutions, completed(search(rest, unknowns, notes, depth + 1), inside[1], list[k]))
      end
      return solutions
    end
  end
end

-- An equation with an unknown inside one function, √(h₁ - h₂) = q/k: solved for it, the others as parameters.
local function by_inversion(equations, unknowns, notes, depth)
  for i, e in ipairs(equations) do
    for _, x in ipairs(equation.unknowns_in(e, unknowns)) do
      local list = polynomial.new_list()
      local one = #one_unknown.functions_of(e, x, {}) == 1 and pcall(one_unknown.find, e, x, list)
      if one and #list == 1 and #list.complex == 0 and not (list.periods and next(list.periods)) then
        for _, condition in ipairs(list.conditions) do
          local inner = false
          for _, y in ipairs(unknowns) do inner = inner or condition:find(tostring(y), 1, true) end
          if not inner then equation.add_condition(notes.conditions, condition) end
        end
        local rest = substituted(without(equations, i), x, list[1])
        return completed(search(rest, unknowns, notes, depth + 1), x, list[1])
      end
    end
  end
end

-- One equation with several unknowns left: quadratic in one of them, which the others are parameters of.
local function by_quadratic(equations, unknowns, notes, depth)
  if #equations > 1 then return end
  for _, x in ipairs(equation.unknowns_in(equations[1], unknowns)) do
    if polynomial_in(equations[1], x) and #coefficients(equations[1], x) == 3 then
      local list, solutions = polynomial.new_list(), {}
      one_unknown.find(equations[1], x, list)
      for _, condition in ipairs(list.conditions) do equation.add_condition(notes.conditions, condition) end
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
  equation.refuse(("no closed form is known for %s = 0; newton{ r = { … }, start = { … } } solves the "
    .. "system in "
    .. "numbers"):format(tostring(equations[1])))
end

-- Equations that are linear in all unknowns, as many as these: by Cramer's rule, where det ≠ 0.
local function by_linear_algebra(equations, unknowns, notes)
  local inside = {}
  for _, x in ipairs(unknowns) do
    for _, e in ipairs(equations) do
      if depends(e, x) then inside[#inside + 1] = x break end
    end
  end
  if #inside ~= #equations or #inside < 2 then return end
  local matrix = jacobian(vec(equations), vec(inside))
  if #equation.unknowns_in(matrix, inside) > 0 then return end
  local determinant = simplify(det(matrix))
  if determinant == 0 then return end
  local zero = {}
  for _, x in ipairs(inside) do zero[x] = 0 end
  local found, solution = solve(matrix, -subs(vec(equations), zero)), {}
  for i, x in ipairs(inside) do solution[x] = simplify(found[i]) end
  if not is_number(determinant) then
    equation.add_condition(notes.conditions, equation.nonzero(determinant))
  end
  return { solution }
end

function search(equations, unknowns, notes, depth)
  if depth > deepest then
    equation.refuse "the elimination takes too many steps; solve a part of the equations first"
  end
  if #equations == 0 then return { {} } end
  local done = by_linear_algebra(equations, unknowns, notes) or by_factors(equations, unknowns, notes, depth)
  if done then return done end
  local i, x, c = linear_equation(equations, unknowns)
  if i and not has_unknowns(c[2], unknowns) then
    if not is_number(c[2]) then equation.add_condition(notes.conditions, equation.nonzero(c[2])) end
    local by = simplify(-c[1]/c[2])
    return completed(search(substituted(without(equations, i), x, by), unknowns, notes, depth + 1), x, by)
  end
  done = by_one_unknown(equations, unknowns, notes, depth)
  if done then return done end
  if not i then
    return by_inversion(equations, unknowns, notes, depth)
      or by_quadratic(equations, unknowns, notes, depth) or by_resultant(equations, unknowns, notes, depth)
  end
  local by, rest = simplify(-c[1]/c[2]), without(equations, i)
  local solutions = completed(search(substituted(rest, x, by), unknowns, notes, depth + 1), x, by)
  table.insert(rest, c[1])
  table.insert(rest, c[2])
  return append(solutions, search(rest, unknowns, notes, depth + 1))
end

-- Arbitrary values of the symbols; of one that is the root of an equation a root for these values, or nothing
-- where it has none.
local function test_point(symbols, roots, scale)
  local point = {}
  for k, s in ipairs(symbols) do if not roots[s] then point[s] = scale*(0.3 + 0.37*k) end end
  for x, e in pairs(roots) do
    local list = polynomial.new_list()
    for k, s in ipairs(symbols_in(e)) do
      if s ~= x and not point[s] then point[s] = scale*(0.3 + 0.37*k) end
    end
    local good = pcall(function() one_unknown.find(subs(e, point), x, list) end)
    if not good or #list == 0 then return end
    point[x] = evaluate(list[1])
  end
  return point
end

-- Whether a solution satisfies the equations: exactly, or in numbers at arbitrary values of the parameters,
-- of
-- both signs where a root or a logarithm needs one of them.
local function satisfies(residuals, solution, roots)
  for _, e in ipairs(residuals) do
    local good, left = pcall(function() return next(solution) and simplify(subs(e, solution)) or e end)
    if not good then return false end                      -- a denominator vanishes
    for _, scale in ipairs(left == 0 and {} or #symbols_in(left) == 0 and { 1 } or { 1, -1 }) do
      local point = test_point(symbols_in(left), roots, scale)
      local finite, number = pcall(function()
        return point and (next(point) and evaluate(left, point) or value(left)) or 0
      end)
      if finite and number == number then
        if math.abs(number) > 1e-8 then return false end
        break
      end
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

local function all_solutions(equations, unknowns, asked)
  equation.asked_by(asked or "solve_equations")
  local residuals = equation.residuals_of(equations)
  local list = equation.unknowns_of(unknowns, residuals)
  local numerators = {}
  for _, e in ipairs(residuals) do
    local numerator = equation.numerator(e)
    if numerator ~= 0 then numerators[#numerators + 1] = numerator end
  end
  local notes = { conditions = {}, roots = {} }
  local found = { unknowns = list, conditions = notes.conditions, roots = notes.roots }
  for _, s in ipairs(search(numerators, list, notes, 1)) do
    local known = not satisfies(residuals, s, notes.roots)
    for _, other in ipairs(found) do known = known or same(s, other, list) end
    if not known then
      found[#found + 1] = setmetatable(s, solution_type)
      for _, v in pairs(s) do                       -- 1/(2 a) with a free
        local _, denominator = fraction(v)
        if #equation.unknowns_in(denominator, list) > 0 then
          equation.add_condition(notes.conditions, equation.nonzero(denominator))
        end
      end
    end
  end
  found.period, found.complex, found.approximate = notes.period, notes.complex, notes.approximate
  return setmetatable(found, { __tostring = text.of_solutions, __name = "solutions",
    __index = { latex = text.latex_of_solutions } })
end

local function roots(e, x, asked)
  equation.asked_by(asked or "roots")
  local residual = equation.residual_of(e)
  local unknown = equation.unknowns_of(x, { residual })
  if #unknown ~= 1 then equation.refuse "roots are those of one unknown: roots(x^2 - 2, x)" end
  local list = polynomial.new_list()
  one_unknown.find(residual, unknown[1], list)
  return setmetatable(text.in_order(list), {
    __tostring = function(r) return text.of_roots(r, unknown[1]) end, __name = "roots",
    __index = { latex = function(r) return text.latex_of_roots(r, unknown[1]) end } })
end

-- solve(equation, x) gives roots, solve({ … }, { … }) solutions; the others say what they give.
local function solve_equations(equations, unknowns, asked)
  local kind = object_type(equations)
  local one = kind == "equation" and object_type(equations.lhs) ~= "matrix" or kind == "expr"
  if asked == "solve" and one and (unknowns == nil or object_type(unknowns) == "expr") then
    return roots(equations, unknowns, asked)
  end
  return all_solutions(equations, unknowns, asked)
end

return { roots = roots, solve_equations = solve_equations }
