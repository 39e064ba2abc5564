-- What solving equations has in common: residuals, where symbols occur, conditions on them, refusals.

local equation = {}

-- The function the user typed, for errors: "solve", "roots", "equilibria".
local asked = "solve"
function equation.asked_by(name) asked = name end
function equation.refuse(text) fail(asked .. ": " .. text) end

function equation.contains(list, x)
  for i = 1, #list do if list[i] == x then return true end end
  return false
end

function equation.is_symbol(x)
  return object_type(x) == "expr" and operation(x) == "" and #symbols_in(x) == 1
end

function equation.depends(e, x) return equation.contains(symbols_in(e), x) end

-- Those of the unknowns that occur in e.
function equation.unknowns_in(e, unknowns)
  local inside, list = symbols_in(e), {}
  for _, x in ipairs(unknowns) do if equation.contains(inside, x) then list[#list + 1] = x end end
  return list
end

function equation.is_number(e) return type(e) == "number" or #symbols_in(e) == 0 end
function equation.value(e) return type(e) == "number" and e or evaluate(e) end

-- left - right, or the expression that is 0.
function equation.residual_of(e)
  local kind = object_type(e)
  if kind == "equation" then return e.lhs - e.rhs end
  if kind == "expr" or type(e) == "number" then return e end
  equation.refuse(("expected an equation or an expression that is 0, %s, got a %s")
    :format(asked == "roots" and "roots(x^2 - 2, x)" or "solve(x^2 ~ 2, x)", kind or type(e)))
end

-- The residuals of a list of equations, the rows of vector equations one by one.
function equation.residuals_of(equations)
  local kind = object_type(equations)
  if kind == "equation" or kind == "expr" then equations = { equations } end
  if type(equations) ~= "table" and kind ~= "matrix" then
    equation.refuse("expected equations: solve({ x + y ~ 3, x*y ~ 2 }, { x, y })")
  end
  local list = {}
  for i = 1, #equations do
    local e = equations[i]
    if object_type(e) == "equation" and object_type(e.lhs) == "matrix" then
      for k = 1, #e.lhs do list[#list + 1] = e.lhs[k] - e.rhs[k] end
    else
      list[#list + 1] = equation.residual_of(e)
    end
  end
  return list
end

-- The unknowns asked for; without any, the only symbol, or the only variable among parameters.
function equation.unknowns_of(unknowns, residuals)
  if object_type(unknowns) == "expr" then unknowns = { unknowns } end
  if unknowns ~= nil and type(unknowns) ~= "table" and object_type(unknowns) ~= "matrix" then
    equation.refuse("the unknowns are symbols: solve(x^2 ~ 2, x), solve({ x + y ~ 3, x*y ~ 2 }, { x, y })")
  end
  local list = {}
  if unknowns then
    for i = 1, #unknowns do
      if not equation.is_symbol(unknowns[i]) then
        equation.refuse(("unknown %d is %s, not a symbol: solve(x^2 ~ 2, x)"):format(i,
          tostring(unknowns[i])))
      end
      list[i] = unknowns[i]
    end
    return list
  end
  for _, e in ipairs(residuals) do
    for _, s in ipairs(symbols_in(e)) do
      if not equation.contains(list, s) then list[#list + 1] = s end
    end
  end
  local variables = {}
  for _, s in ipairs(list) do if s.kind ~= "parameter" then variables[#variables + 1] = s end end
  if #variables == 1 then return variables end
  if #list == 1 then return list end
  equation.refuse("the unknowns are missing: solve(x^2 ~ 2, x), solve({ x + y ~ 3, x*y ~ 2 }, { x, y })")
end

-- The first number in e that is no exact one, such as math.pi; nothing where all are exact.
local function inexact_number(e)
  local parts = { operation(e) }
  if #parts == 1 then return equation.is_number(e) and not pcall(fraction, e) and e or nil end
  for k = 2, #parts do
    local found = inexact_number(parts[k])
    if found then return found end
  end
end

-- The numerator of e as a polynomial, and its denominator; exact numbers are needed for that.
function equation.numerator(e)
  local good, numerator, denominator = pcall(fraction, e)
  if good then return numerator, denominator end
  local number = inexact_number(e)
  if number then
    equation.refuse(("%s is not an exact number; closed forms need pi, sqrt(2) or a fraction in its place; "
      .. "newton{ r = { … }, start = { … } } solves the equations in numbers"):format(tostring(number)))
  end
  equation.refuse(("%s = 0 is too long for a closed form; newton{ r = { … }, start = { … } } solves the "
    .. "equations in numbers"):format(tostring(e)))
end

-- ── conditions ─────────────────────────────────────────────────────────────

function equation.add_condition(conditions, text)
  if text and not equation.contains(conditions, text) then conditions[#conditions + 1] = text end
end

local function summands(e, list)
  local op, a, b = operation(e)
  if op ~= "add" then list[#list + 1] = e return list end
  return summands(b, summands(a, list))
end

-- Whether a term is a root, an even power or a positive factor of such.
local function not_below_zero(e)
  local op, a, b = operation(e)
  if op == "sqrt" or op == "abs" then return true end
  if op == "pow" and math.type(b) == "integer" and b % 2 == 0 then return true end
  return (op == "mul" or op == "div") and not_below_zero(a) and not_below_zero(b)
    or equation.is_number(e) and equation.value(e) >= 0
end

-- 1, -1 or 0 where the sign of e is known, from numbers and parameters that are declared positive, 1 also
-- for sums of what is not negative and something positive.
function equation.sign_of(e)
  if equation.is_number(e) then
    local v = equation.value(e)
    return v > 0 and 1 or v < 0 and -1 or 0
  end
  local plain, size = simplify(e), simplify(abs(e))
  if size == plain then return 1 end
  if size == simplify(-plain) then return -1 end
  local positive = false
  for _, term in ipairs(summands(plain, {})) do
    if equation.is_number(term) and equation.value(term) > 0 then
      positive = true
    elseif not not_below_zero(term) then
      return nil
    end
  end
  if positive then return 1 end
end

-- "e ≠ 0" without factors that are numbers or known to be positive; nothing where that is certain.
function equation.nonzero(e)
  local product = 1
  for _, each in ipairs(factors(e)) do
    if not equation.sign_of(each[1]) then product = product*each[1] end
  end
  if product ~= 1 then return tostring(product) .. " ≠ 0" end
end

-- The factors of e whose sign is not known, multiplied, and the sign of the others.
local function undecided(e)
  local product, rest, sign = 1, 1, 1
  local numerator, denominator = fraction(e)
  for _, part in ipairs { numerator, denominator } do
    for _, each in ipairs(factors(part)) do
      rest = part == numerator and rest*each[1]^each[2] or rest/each[1]^each[2]
      if each[2] % 2 ~= 0 then
        local known = equation.sign_of(each[1])
        if known then sign = sign*known else product = product*each[1] end
      end
    end
  end
  local number = simplify(together(e/rest))
  if not equation.is_number(number) then return e, 1 end
  return product, sign*equation.sign_of(number)
end

local function compared(product, sign, above, below)
  local e = factor(product)
  if tostring(e):sub(1, 1) == "-" and not tostring(e):find " [+-] " then e, sign = simplify(-e), -sign end
  local symbols = symbols_in(e)
  local good, c = pcall(coefficients, e, symbols[1])
  if #symbols == 1 and good and #c == 2 and c[2] == 1 and equation.is_number(c[1]) and c[1] ~= 0 then
    -- K < 6 and not K - 6 < 0
    return tostring(symbols[1]) .. (sign > 0 and above or below):gsub("0", tostring(simplify(-c[1])))
  end
  local turned = sign < 0 and simplify(-e)                    -- b² - 4 a c ≥ 0 and not 4 a c - b² ≤ 0
  local said = tostring(turned or "-")
  if not said:find "^-" and not said:find "^%d+ -" then e, sign = turned, 1 end
  return tostring(e) .. (sign > 0 and above or below)
end

-- "e ≥ 0", "e > 0" and "e < 0" without factors whose sign is known; nothing where that is certain.
function equation.not_negative(e)
  local product, sign = undecided(e)
  if not equation.is_number(product) then return compared(product, sign, " ≥ 0", " ≤ 0") end
end
function equation.positive(e)
  local product, sign = undecided(e)
  if not equation.is_number(product) then return compared(product, sign, " > 0", " < 0") end
end
function equation.negative(e) return equation.positive(-e) end

return equation
