-- Inverse functions with all their values and where these exist, and substitutions that leave one function.

local equation = include "algebra/equation"
local is_number, value, depends = equation.is_number, equation.value, equation.depends

local inverses = {}

local function above(v, least, text, strict)
  if not is_number(v) then
    if equation.sign_of(v - least) == 1 then return true end
    return true, tostring(v) .. text
  end
  return strict and value(v) > least or not strict and value(v) >= least - 1e-14
end

local function within(v, low, high, text)
  if not is_number(v) then return true, text:format(tostring(v)) end
  return value(v) >= low - 1e-14 and value(v) <= high + 1e-14
end

local function anything() return true end

-- f(argument) = v: the arguments, what may be added to them, and whether v is a value of f (true, and the
-- condition where symbols leave it open).
local table_of = {
  sin = { function(v) return { asin(v), pi - asin(v) } end, 2*pi,
    function(v) return within(v, -1, 1, "-1 ≤ %s ≤ 1") end },
  cos = { function(v) return { acos(v), -acos(v) } end, 2*pi,
    function(v) return within(v, -1, 1, "-1 ≤ %s ≤ 1") end },
  tan = { function(v) return { atan(v) } end, pi, anything },
  exp = { function(v) return { log(v) } end, nil, function(v) return above(v, 0, " > 0", true) end },
  log = { function(v) return { exp(v) } end, nil, anything },
  sinh = { function(v) return { asinh(v) } end, nil, anything },
  cosh = { function(v) return { acosh(v), -acosh(v) } end, nil, function(v) return above(v, 1, " ≥ 1") end },
  tanh = { function(v) return { atanh(v) } end, nil, function(v)
    if not is_number(v) then return true, ("-1 < %s < 1"):format(tostring(v)) end
    return math.abs(value(v)) < 1
  end },
  asinh = { function(v) return { sinh(v) } end, nil, anything },
  acosh = { function(v) return { cosh(v) } end, nil, function(v) return above(v, 0, " ≥ 0") end },
  atanh = { function(v) return { tanh(v) } end, nil, anything },
  asin = { function(v) return { sin(v) } end, nil,
    function(v) return within(v, -math.pi/2, math.pi/2, "-π/2 ≤ %s ≤ π/2") end },
  acos = { function(v) return { cos(v) } end, nil,
    function(v) return within(v, 0, math.pi, "0 ≤ %s ≤ π") end },
  atan = { function(v) return { tan(v) } end, nil, function(v)
    if not is_number(v) then return true, ("-π/2 < %s < π/2"):format(tostring(v)) end
    return math.abs(value(v)) < math.pi/2
  end },
  sqrt = { function(v) return { v^2 } end, nil, function(v) return above(v, 0, " ≥ 0") end },
  abs = { function(v) return { v, -v } end, nil, function(v) return above(v, 0, " ≥ 0") end },
}

-- log(v)/log(base), exact where v is a rational power of the base.
local function logarithm(v, base)
  if is_number(v) and is_number(base) then
    local quotient = value(log(v))/value(log(base))
    for n = 1, 12 do
      local k = math.floor(quotient*n + 0.5)
      if math.abs(quotient*n - k) < 1e-12 and simplify(base^k - v^n) == 0 then
        return rational(("%d/%d"):format(k, n))
      end
    end
  end
  return log(v)/log(base)
end

-- The arguments of the function op at which it is v: { …, argument =, period =, conditions = }.
function inverses.of(op, argument, second, v, x)
  local found = { argument = argument, conditions = {} }
  if op == "pow" and not depends(second, x) then                       -- argumentʳ = v
    local ok, condition = above(v, 0, " ≥ 0")
    if ok then found[1] = v^(1/second) end
    equation.add_condition(found.conditions, condition)
  elseif op == "pow" and not depends(argument, x) then                 -- baseᵘ = v
    local ok, condition = above(v, 0, " > 0", true)
    if ok then found[1] = logarithm(v, argument) end
    found.argument = second
    equation.add_condition(found.conditions, condition)
  elseif table_of[op] then
    local row = table_of[op]
    local ok, condition = row[3](v)
    if ok then for _, each in ipairs(row[1](v)) do found[#found + 1] = each end end
    found.period = row[2]
    equation.add_condition(found.conditions, condition)
  else
    return nil
  end
  return found
end

-- ── substitutions ──────────────────────────────────────────────────────────
-- Each: of e, the functions inside it and x to what remains to be solved, or nothing.

local symbol = param "pendula_substituted"

-- The u of which all given arguments are whole multiples, and these multiples; nothing if there is none.
local function common_unit(arguments)
  local first, ratios, denominator = arguments[1], {}, 1
  for i, a in ipairs(arguments) do
    local ratio = simplify(a/first)
    if not is_number(ratio) then return nil end
    local n = 1
    while math.type(simplify(ratio*denominator*n)) ~= "integer" do
      n = n + 1
      if n > 12 then return nil end
    end
    ratios[i], denominator = ratio, denominator*n
  end
  local multiples = {}
  for i, ratio in ipairs(ratios) do multiples[i] = simplify(ratio*denominator) end
  return simplify(first/denominator), multiples
end

-- cos(n u) and sin(n u) from c = cos(u) and s = sin(u), |n| ≤ 8: powers of c + i s.
local function multiple_angle(n, c, s)
  if math.abs(n) > 8 then return nil end
  local re, im = 1, 0
  for _ = 1, math.abs(n) do re, im = expand(re*c - im*s), expand(re*s + im*c) end
  return re, n < 0 and -im or im
end

-- Of a u and b u: the greater of the whole multiples of a common unit.
local function common_multiple(a, b)
  local _, multiples = common_unit { a, b }
  return multiples and math.max(math.abs(multiples[1]), math.abs(multiples[2])) or math.huge
end

-- The arguments without what they are at x = 0: of x + π/3 and 2 x these are x, 2 x and π/3, 0.
local function without_shifts(arguments, x)
  local rest, shifts = {}, {}
  for i, a in ipairs(arguments) do
    shifts[i] = subs(a, { [x] = 0 })
    rest[i] = simplify(a - shifts[i])
  end
  return rest, shifts
end

-- e as a polynomial in sin(u), cos(u), with the u of all angles; shifts by the addition theorems.
local function in_sine_and_cosine(e, inside, s, c, x)
  local arguments, values = {}, {}
  for i, f in ipairs(inside) do
    local op, a = operation(f)
    if op ~= "sin" and op ~= "cos" and op ~= "tan" then return nil end
    arguments[i] = a
  end
  local u, multiples = common_unit(arguments)
  local shifts = {}
  if not u then
    arguments, shifts = without_shifts(arguments, x)
    u, multiples = common_unit(arguments)
  end
  if not u then return nil end
  for i, f in ipairs(inside) do
    local cosine, sine = multiple_angle(multiples[i], c, s)
    if not cosine then return nil end
    if shifts[i] and shifts[i] ~= 0 then
      local cs, sn = cos(shifts[i]), sin(shifts[i])
      cosine, sine = cosine*cs - sine*sn, sine*cs + cosine*sn
    end
    local op = operation(f)
    values[f] = op == "sin" and sine or op == "cos" and cosine or sine/cosine
  end
  local good, polynomial = pcall(function() return (fraction(subs(e, values))) end)
  if good then return polynomial, u end                       -- roots of numbers may be too many for factors
end

-- sin A ± sin B = 0, cos A ± sin B = 0, … with shifts or high multiples: A = B + 2 k π or A = π - B + 2 k π.
local function two_waves(e, inside, x)
  if #inside ~= 2 then return nil end
  local angles, rest = {}, e
  for i, f in ipairs(inside) do
    local op, a = operation(f)
    local weight = simplify(diff(subs(e, { [f] = symbol }), symbol))
    local slope = simplify(diff(a, x))
    if op ~= "sin" and op ~= "cos" or not is_number(weight) or not is_number(slope) then return nil end
    angles[i] = { op == "cos" and a + pi/2 or a, weight, slope, a - slope*x }
    rest = subs(rest, { [f] = 0 })
  end
  local A, B = angles[1], angles[2]
  local ratio = simplify(A[2]/B[2])
  local plain = simplify(A[4]) == 0 and simplify(B[4]) == 0
  if simplify(rest) ~= 0 or ratio ~= 1 and ratio ~= -1 or plain and common_multiple(A[3], B[3]) <= 3 then
    return nil
  end
  local other = ratio == 1 and B[1] + pi or B[1]
  return { families = { { simplify(A[1] - other), 0 }, { simplify(A[1] + other), pi } } }
end

-- cos²(u) = 1 - sin²(u) or the reverse where the other occurs in even powers only; t = tan(u) where all terms
-- have the same degree in sin(u), cos(u); else t = tan(u/2).
local function angles(e, inside, x)
  local s, c, T = param "pendula_sin", param "pendula_cos", symbol
  local polynomial, u = in_sine_and_cosine(e, inside, s, c, x)
  if not polynomial or depends(polynomial, x) then return nil end
  for _, pair in ipairs { { c, s, sin }, { s, c, cos } } do
    local powers, even = coefficients(polynomial, pair[1]), true
    for k = 2, #powers, 2 do even = even and powers[k] == 0 end
    if even then
      local reduced = 0
      for k = 1, #powers, 2 do reduced = reduced + powers[k]*(1 - pair[2]^2)^((k - 1)//2) end
      return { checked = subs(expand(reduced), { [pair[2]] = pair[3](u) }) }
    end
  end
  local by_cosine, highest = coefficients(fraction(subs(polynomial, { [s] = T*c })), c), nil
  for k = 1, #by_cosine do
    if by_cosine[k] ~= 0 then highest = highest == nil and by_cosine[k] end
  end
  if highest then
    return { symbol = T, reduced = highest,
      back = function(v) return { argument = u, value = atan(v), period = pi } end }
  end
  local reduced = subs(polynomial, { [s] = 2*T/(1 + T^2), [c] = (1 - T^2)/(1 + T^2) })
  return { symbol = T, reduced = reduced,
    back = function(v) return { argument = u, value = 2*atan(v), period = 2*pi } end,
    extra = { { argument = u, value = pi, period = 2*pi } } }
end

-- w = exp(u) where all exponents are whole multiples of one u; powers of numbers by the logarithm of the
-- first.
local function exponentials(e, inside, x)
  local base, exponents = nil, {}
  for _, f in ipairs(inside) do
    local op, a = operation(f)
    if op == "pow" and not depends(a, x) and not (base and is_number(base) and is_number(a)
      and value(base) < value(a)) then
      base = a
    end
  end
  for i, f in ipairs(inside) do
    local op, a, b = operation(f)
    if op == "pow" and not depends(a, x) then
      exponents[i] = a == base and b*log(base) or b*logarithm(a, base)*log(base)
    elseif op == "exp" then
      exponents[i] = a
    else
      return nil
    end
  end
  local unit, multiples = common_unit(exponents)
  if not unit then return nil end
  local values = {}
  for i, f in ipairs(inside) do values[f] = symbol^multiples[i] end
  return { symbol = symbol, reduced = subs(e, values), back = function(v)
    local ok, condition = above(v, 0, " > 0", true)
    if ok then return { argument = unit, value = log(v), condition = condition } end
  end }
end

-- sinh, cosh and tanh beside other functions by exponentials.
local function hyperbolic(e, inside)
  local values, found = {}, false
  for _, f in ipairs(inside) do
    local op, a = operation(f)
    local up, down = exp(a), exp(-a)
    local by = op == "sinh" and (up - down)/2 or op == "cosh" and (up + down)/2
      or op == "tanh" and (up - down)/(up + down)
    if by then values[f], found = by, true end
  end
  if not found or #inside < 2 then return nil end
  return { checked = fraction(subs(e, values)) }
end

-- Σ cᵢ log(uᵢ) = v: ∏ uᵢ^cᵢ = exp(v), with whole numbers cᵢ.
local function logarithms(e, inside, x)
  local product, rest = 1, e
  for _, f in ipairs(inside) do
    local op, a = operation(f)
    if op ~= "log" then return nil end
    local slope = simplify(diff(subs(e, { [f] = symbol }), symbol))
    if math.type(slope) ~= "integer" then return nil end
    product, rest = product*a^slope, subs(rest, { [f] = 0 })
  end
  if depends(rest, x) then return nil end
  return { checked = product - exp(simplify(-rest)) }
end

-- A square root (or other root) is eliminated by its power: the resultant of e and wⁿ - u.
local function radicals(e, inside, x)
  local f = inside[1]
  local op, u, power = operation(f)
  local n
  if op == "sqrt" then n = 2
  elseif op == "pow" and not depends(power, x) and is_number(power) then
    for k = 2, 6 do if not n and simplify(power*k) == 1 then n = k end end
  end
  if not n then return nil end
  local c = coefficients(fraction(subs(e, { [f] = symbol })), symbol)
  if n == 2 then
    local even, odd = 0, 0                                  -- e = even + odd √u
    for k = 0, #c - 1 do
      if k % 2 == 0 then even = even + c[k + 1]*u^(k//2) else odd = odd + c[k + 1]*u^(k//2) end
    end
    return { checked = expand(even^2 - odd^2*u), root = -even/odd }
  end
  if #c == 2 then return { checked = expand((-c[1])^n - c[2]^n*u), root = -c[1]/c[2] } end
end

inverses.substitutions = { two_waves, angles, exponentials, hyperbolic, logarithms, radicals }

return inverses
