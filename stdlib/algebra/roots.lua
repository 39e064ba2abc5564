-- The solutions of one equation for one unknown: polynomials by their factors over ℚ; functions of the
-- unknown by their inverses, after a substitution where several occur.

local equation = include "algebra/equation"
local polynomial = include "algebra/polynomial_roots"
local inverses = include "algebra/inverses"
local is_number, value, depends = equation.is_number, equation.value, equation.depends

local deepest = 60
local algebraic = { add = true, sub = true, mul = true, div = true, neg = true }

-- The parts of e that contain x and are no polynomials in it.
local function functions_of(e, x, found)
  local op, a, b = operation(e)
  if op == "" then return found end
  local whole_power = op == "pow" and math.type(b) == "integer"
  if algebraic[op] or whole_power then
    functions_of(a, x, found)
    if b ~= nil and not whole_power then functions_of(b, x, found) end
  elseif depends(e, x) and not equation.contains(found, e) then
    found[#found + 1] = e
  end
  return found
end

local function no_closed_form(e, x)
  local shown = tostring(e):gsub("pendula_k", "k"):gsub("pendula_function", "f")
  equation.refuse(("no closed form of the solutions of %s = 0 for %s is known; newton{ r = { … }, start = "
    .. "{ … } } "
    .. "finds them in numbers"):format(shown, tostring(x)))
end

local function polynomial_roots(e, x, times, list)
  local c = coefficients(e, x)
  if #c < 2 then return end
  if not is_number(c[#c]) then equation.add_condition(list.conditions, equation.nonzero(c[#c])) end
  local first = #list + 1
  if polynomial.roots(c, list) == false then
    equation.refuse(("%s = 0 has degree %d in %s; above degree 4 there is no closed form; give values to its "
      .. "symbols: roots(subs(e, { %s = 1 }), %s)")
      :format(tostring(e), #c - 1, tostring(x), tostring(symbols_in(c[1])[1] or "a"), tostring(x)))
  end
  for i = first, #list do list.times[i] = times end
end

local find

-- Roots of an inner equation for a stand-in, whose values u are handed on.
local function for_each_value(reduced, stand_in, list, act)
  local inner = polynomial.new_list()
  find(reduced, stand_in, inner)
  for _, condition in ipairs(inner.conditions) do equation.add_condition(list.conditions, condition) end
  list.approximate = list.approximate or inner.approximate
  for i = 1, #inner do act(inner[i]) end
  return inner
end

-- The angle between -period/2 (excluded) and period/2.
local function within_period(angle, period)
  local turns = math.ceil(value(angle)/value(period) - 0.5 - 1e-12)
  return simplify(angle - turns*period)
end

-- Adds the solutions of argument = v + k·period; list.period holds what is added to the root with k = 0.
local function add_argument(argument, v, period, x, list, depth)
  if not period then return find(argument - v, x, list, depth) end
  local k = param "pendula_k"
  local first = #list + 1
  local shifted = polynomial.new_list()
  find(argument - v - k*period, x, shifted, depth)
  for _, condition in ipairs(shifted.conditions) do
    if not condition:find "pendula_k" then equation.add_condition(list.conditions, condition) end
  end
  list.periods = list.periods or {}
  for i = 1, #shifted do
    local root = shifted[i]
    local at_zero = simplify(subs(root, { [k] = 0 }))
    local slope = simplify(diff(root, k))
    if is_number(slope) and value(slope) < 0 then slope = -slope end       -- k runs over all whole numbers
    if is_number(slope) and is_number(at_zero) then at_zero = within_period(at_zero, slope) end
    polynomial.add(list, at_zero)
    for i = 1, #list < first and #list or 0 do   -- of another family: the next one
      local known = list[i] == at_zero and list.periods[i]
      if known and is_number(slope) and simplify(known - slope) ~= 0 then
        polynomial.add(list, simplify(at_zero + slope))
      end
    end
    if #list >= first then
      list.periods[#list] = not depends(slope, k) and slope or nil
      if depends(slope, k) then list.text[#list] = tostring(root):gsub("pendula_k", "k") end
    end
    first = #list + 1
  end
end

local function invert(e, f, x, list, depth)
  local stand_in = param "pendula_function"
  local reduced = subs(e, { [f] = stand_in })
  if depends(reduced, x) then return false end
  local op, argument, second = operation(f)
  local known = true
  for_each_value(reduced, stand_in, list, function(v)
    local found = inverses.of(op, argument, second, v, x)
    if not found then known = false return end
    for _, condition in ipairs(found.conditions) do equation.add_condition(list.conditions, condition) end
    for _, each in ipairs(found) do add_argument(found.argument, each, found.period, x, list, depth + 1) end
  end)
  return known
end

-- Whether a root satisfies e = 0, in numbers; true where symbols leave that open.
local function holds(e, x, root)
  local good, left = pcall(function() return simplify(subs(e, { [x] = root })) end)
  if not good then return false end
  if left == 0 then return true end
  if not is_number(left) then return true end
  local finite, number = pcall(value, left)
  return finite and number == number and math.abs(number) < 1e-8
end

-- The roots of a substituted equation that are roots of e; with symbols in them, where the root that was
-- eliminated is not negative.
local function add_checked(e, substitution, x, list, depth)
  local found = polynomial.new_list()
  find(substitution.checked, x, found, depth + 1)
  for _, condition in ipairs(found.conditions) do equation.add_condition(list.conditions, condition) end
  for i = 1, #found do
    if holds(e, x, found[i]) then
      local when = found.when[i]
      if substitution.root and not is_number(found[i]) then
        when = equation.not_negative(simplify(subs(substitution.root, { [x] = found[i] })))
      end
      polynomial.add(list, found[i], found.text[i], when)
      if found.periods then
        list.periods = list.periods or {}
        list.periods[#list] = found.periods[i]
      end
    end
  end
end

local function by_substitution(e, inside, x, list, depth)
  for _, substitution in ipairs(inverses.substitutions) do
    local found = substitution(e, inside, x)
    if found and not (found.reduced and depends(found.reduced, x)) then
      if found.checked then
        add_checked(e, found, x, list, depth)
      elseif found.families then
        for _, each in ipairs(found.families) do
          if depends(each[1], x) then add_argument(each[1], each[2], 2*pi, x, list, depth + 1) end
        end
      else
        for_each_value(found.reduced, found.symbol, list, function(v)
          local back = found.back(v)
          if back then
            equation.add_condition(list.conditions, back.condition)
            add_argument(back.argument, back.value, back.period, x, list, depth + 1)
          end
        end)
        for _, extra in ipairs(found.extra or {}) do
          if simplify(subs(e, { [extra.argument] = extra.value })) == 0 then
            add_argument(extra.argument, extra.value, extra.period, x, list, depth + 1)
          end
        end
      end
      return true
    end
  end
end

-- Adds the roots of e to a list.
function find(e, x, list, depth)
  depth = depth or 1
  if depth > deepest then equation.refuse "the equation is nested too deeply" end
  local good, numerator, denominator = pcall(fraction, e)
  if not good and depth == 1 then equation.numerator(e) end
  if not good then no_closed_form(e, x) end                     -- too long, or too many roots of numbers
  if numerator == 0 then
    equation.refuse(("the equation holds for every %s"):format(tostring(x)))
  end
  local parts = {}
  for _, each in ipairs(factors(numerator)) do
    if depends(each[1], x) then parts[#parts + 1] = each end
  end
  local before = #list
  for k = #parts, 1, -1 do
    local base = parts[k][1]
    local inside = functions_of(base, x, {})
    if #inside == 0 then
      polynomial_roots(base, x, parts[k][2], list)
    elseif not (#inside == 1 and invert(base, inside[1], x, list, depth))
      and not by_substitution(base, inside, x, list, depth) then
      local simple = simplify(base)
      if simple == base then no_closed_form(base, x) end
      find(simple, x, list, depth + 1)
    end
  end
  if depends(denominator, x) then
    for i = #list, before + 1, -1 do
      if simplify(subs(denominator, { [x] = list[i] })) == 0 then
        for _, kept in ipairs { list, list.text, list.when, list.times, list.about } do
          for k = i, #list do kept[k] = kept[k + 1] end
        end
      end
    end
  end
end

return { find = find, functions_of = functions_of, no_closed_form = no_closed_form }
