-- The roots of a polynomial with given coefficients in closed form: radicals up to degree 4 and for powers,
-- cosines for cubics with three real roots (casus irreducibilis). Other polynomials with numbers as
-- coefficients get numbers. c[k + 1] belongs to xᵏ; what is found is put into a list of roots:
--   list[i]                a real root;  list.complex[i]  a pair re ± i im
--   list.text, list.when   how a root is written where that is shorter, and where it is one
--   list.definitions       the abbreviations in those texts
--   list.conditions        what has to hold for all of them
-- Cardano, Viète and Ferrari: see Abramowitz & Stegun, Handbook of Mathematical Functions, §3.8.

local equation = include "algebra/equation"
local is_number, value = equation.is_number, equation.value

local polynomial = {}

function polynomial.new_list()
  return { conditions = {}, complex = {}, text = {}, when = {}, definitions = {}, times = {}, about = {} }
end

function polynomial.add(list, root, text, when)
  root = simplify(root)
  if equation.contains(list, root) then return end
  list[#list + 1] = root
  list.text[#list], list.when[#list] = text, when
end

local function add_pair(list, re, im)
  re, im = simplify(re), simplify(im)
  if is_number(im) and value(im) < 0 then im = simplify(-im) end
  for _, pair in ipairs(list.complex) do if pair.re == re and pair.im == im then return end end
  list.complex[#list.complex + 1] = { re = re, im = im }
end

-- a/b, exact where both are whole numbers of Lua.
local function ratio(a, b)
  if math.type(a) == "integer" and math.type(b) == "integer" then return rational(a .. "/" .. b) end
  return a/b
end

local function unit_fraction(n) return rational("1/" .. n) end

-- The real nth root for odd n, of any sign.
local function odd_root(e, n)
  local known = equation.sign_of(e)
  if known == 0 then return 0 end
  if known == 1 then return e^unit_fraction(n) end
  if known == -1 then return -(-e)^unit_fraction(n) end
  return sign(e)*abs(e)^unit_fraction(n)
end

local function quadratic(c, list)
  local discriminant = simplify(c[2]*c[2] - 4*c[1]*c[3])
  local sign = equation.sign_of(discriminant)
  if sign == -1 then
    return add_pair(list, ratio(-c[2], 2*c[3]), sqrt(-discriminant)/(2*c[3]))
  end
  local real = equation.not_negative(discriminant)
  if real and sign ~= 0 then equation.add_condition(list.conditions, real .. " (real)") end
  local root = simplify(sqrt(factor(discriminant)))
  polynomial.add(list, ratio(-c[2] + root, 2*c[3]))
  polynomial.add(list, ratio(-c[2] - root, 2*c[3]))
end

-- xⁿ = v for a number or expression v.
function polynomial.pure_power(n, v, list)
  local sign = equation.sign_of(v)
  if sign == 0 then return polynomial.add(list, 0) end
  if n % 2 == 1 then
    polynomial.add(list, odd_root(v, n))
  elseif sign ~= -1 then
    local root, real = v^unit_fraction(n), not sign and equation.not_negative(v) or nil
    polynomial.add(list, root, nil, real)
    polynomial.add(list, -root, nil, real)
  end
  if not sign then return end
  local size = abs(v)^unit_fraction(n)
  for k = 0, n//2 do                                       -- the angles between 0 and π
    local angle = sign == 1 and rational(("%d/%d"):format(2*k, n))*pi
      or rational(("%d/%d"):format(2*k + 1, n))*pi
    local along = value(angle)/math.pi
    if along > 1e-9 and along < 1 - 1e-9 then add_pair(list, size*cos(angle), size*sin(angle)) end
  end
end

-- xⁿ = re ± i im.
local function complex_power(n, re, im, list)
  local size = simplify(sqrt(re*re + im*im))
  if n == 2 then
    local x, y = sqrt(ratio(size + re, 2)), sqrt(ratio(size - re, 2))
    add_pair(list, x, y)
    add_pair(list, -x, y)
    return
  end
  for k = 0, n - 1 do
    local angle = (acos(ratio(re, size)) + 2*k*pi)/n
    add_pair(list, size^unit_fraction(n)*cos(angle), size^unit_fraction(n)*sin(angle))
  end
end

-- Abbreviations are parameters named pendula_… until they are written.
local function abbreviation(name) return param("pendula_" .. name) end

-- The texts with the names of the abbreviations, which must not be those of symbols in the coefficients.
local greek = { phi = "φ" }
local function write_abbreviations(list, c)
  local taken = {}
  for _, e in ipairs(c) do for _, s in ipairs(symbols_in(e)) do taken[s.name] = true end end
  local function written(text)
    return (text:gsub("pendula_(%a+)", function(name)
      return (greek[name] or name) .. (taken[name] and "₀" or "")
    end))
  end
  for _, texts in ipairs { list.text, list.when, list.definitions } do
    for k, text in pairs(texts) do texts[k] = written(text) end
  end
end

-- The shift, and p and q of the depressed cubic t³ + p t + q, x = t - shift.
local function depressed_cubic(c)
  local d, b, a = ratio(c[1], c[4]), ratio(c[2], c[4]), ratio(c[3], c[4])
  return simplify(ratio(a, 3)), simplify(b - ratio(a*a, 3)),
    simplify(ratio(2*a*a*a, 27) - ratio(a*b, 3) + d)
end

local function cubic_in_numbers(c, list)
  local shift, p, q = depressed_cubic(c)
  local D = simplify(ratio(q*q, 4) + ratio(p*p*p, 27))
  if value(D) >= 0 then
    local root = simplify(sqrt(D))
    local u, v = odd_root(simplify(root - ratio(q, 2)), 3), odd_root(simplify(-root - ratio(q, 2)), 3)
    polynomial.add(list, u + v - shift)
    list.about[#list] = true
    add_pair(list, -(u + v)/2 - shift, sqrt(3)*(u - v)/2)
    return
  end
  local size, angle = 2*sqrt(ratio(-p, 3)), acos(simplify(ratio(3*q, 2*p)*sqrt(ratio(-3, p))))
  for k = 0, 2 do
    polynomial.add(list, size*cos(simplify((angle - 2*k*pi)/3)) - shift)
    list.about[#list] = true
  end
end

local function discriminant(p, q) return ratio(p*p*p, 27) + ratio(q*q, 4) end
local function first_angle(p, q) return ratio(3*q, 2*p)*sqrt(ratio(-3, p)) end

-- p, q, D and φ as symbols for texts, with what they stand for; a coefficient that is a symbol or number
-- keeps its own name.
local function abbreviations(c, list)
  local shift, p, q = depressed_cubic(c)
  local function short(name, e)
    if is_number(e) or equation.is_symbol(e) then return e end
    local s = abbreviation(name)
    list.definitions[#list.definitions + 1] = tostring(s) .. " = " .. tostring(factor(e))
    return s
  end
  local P, Q = short("p", p), short("q", q)
  local D, angle = abbreviation "D", abbreviation "phi"
  table.insert(list.definitions, ("%s = %s"):format(tostring(D), tostring(discriminant(P, Q))))
  table.insert(list.definitions, ("%s = acos(%s)"):format(tostring(angle), tostring(first_angle(P, Q))))
  return shift, { p = p, q = q, D = simplify(discriminant(p, q)), angle = acos(first_angle(p, q)) },
    { p = P, q = Q, D = D, angle = angle }
end

local function minus(shift) return shift == 0 and "" or " - " .. tostring(shift) end

local function cubic_in_symbols(c, list)
  local shift, full, short = abbreviations(c, list)
  local D, half = tostring(short.D), tostring(ratio(short.q, 2))
  local root = sqrt(full.D)
  polynomial.add(list, odd_root(root - ratio(full.q, 2), 3) - odd_root(root + ratio(full.q, 2), 3) - shift,
    ("∛(√%s - %s) - ∛(√%s + %s)%s"):format(D, half, D, half, minus(shift)), D .. " ≥ 0")
  for k = 0, 2 do
    local turn = k == 0 and tostring(short.angle) .. "/3" or tostring((short.angle - 2*k*pi)/3)
    polynomial.add(list, 2*sqrt(ratio(-full.p, 3))*cos((full.angle - 2*k*pi)/3) - shift,
      ("2 %s cos(%s)%s"):format(tostring(sqrt(ratio(-short.p, 3))), turn, minus(shift)), D .. " < 0")
  end
  polynomial.add(list, odd_root(ratio(full.q, 2), 3) - shift, ("∛(%s)%s (double)"):format(half, minus(shift)),
    D .. " = 0")
end

-- p, q, r of y⁴ + p y² + q y + r with x = y - shift.
local function depressed_quartic(c)
  local e, d, b, a = ratio(c[1], c[5]), ratio(c[2], c[5]), ratio(c[3], c[5]), ratio(c[4], c[5])
  return simplify(ratio(a, 4)), simplify(b - ratio(3*a*a, 8)), simplify(ratio(a*a*a, 8) - ratio(a*b, 2) + d),
    simplify(e - ratio(a*d, 4) + ratio(a*a*b, 16) - ratio(3*a*a*a*a, 256))
end

-- Ferrari: with 2 m > 0 from m³ + p m² + (p²/4 - r) m - q²/8 = 0 the quartic is
-- (y² + p/2 + m)² = 2 m (y - q/(4 m))².
local function resolvent(p, q, r)
  return { simplify(ratio(-q*q, 8)), simplify(ratio(p*p, 4) - r), p, 1 }
end

-- What stands under the root of y = (±√(2 m) ± √…)/2.
local function under_root(sign, m, p, q) return simplify(-2*p - 2*m - sign*2*q/sqrt(2*m)) end

-- True if the resolvent has a rational root.
local function quartic_in_numbers(c, list)
  local shift, p, q, r = depressed_quartic(c)
  local m, sum = abbreviation "m", 0
  for k, each in ipairs(resolvent(p, q, r)) do sum = sum + each*m^(k - 1) end
  for _, each in ipairs(factors(sum)) do
    local f = coefficients(each[1], m)
    if #f == 2 and value(f[1])*value(f[2]) < 0 then
      local found = ratio(-f[1], f[2])
      for sign = 1, -1, -2 do
        local inside = under_root(sign, found, p, q)
        local centre = sign*sqrt(2*found)/2 - shift
        if value(inside) >= 0 then
          for plus = 1, -1, -2 do
            polynomial.add(list, centre + plus*sqrt(inside)/2)
            list.about[#list] = true
          end
        else
          add_pair(list, centre, sqrt(-inside)/2)
        end
      end
      return true
    end
  end
end

local function quartic_in_symbols(c, list)
  local shift, p, q, r = depressed_quartic(c)
  local short = {}
  for k, e in ipairs { p, q, r } do
    local name = ("pqr"):sub(k, k)
    if is_number(e) or equation.is_symbol(e) then
      short[k] = e
    else
      short[k] = abbreviation(name)
      table.insert(list.definitions, ("%s = %s"):format(tostring(short[k]), tostring(factor(e))))
    end
  end
  local inner = polynomial.new_list()
  local cubic_shift, full, names = abbreviations(resolvent(p, q, r), inner)
  local m, D = abbreviation "m", sqrt(full.D)
  local largest = ifelse(ge(full.D, 0), odd_root(D - ratio(full.q, 2), 3) - odd_root(D + ratio(full.q, 2), 3),
    2*sqrt(ratio(-full.p, 3))*cos(full.angle/3)) - cubic_shift
  for sign = 1, -1, -2 do
    local inside = tostring(under_root(sign, m, short[1], short[2]))
    for plus = 1, -1, -2 do
      polynomial.add(list, sign*sqrt(2*largest)/2 + plus*sqrt(under_root(sign, largest, p, q))/2 - shift,
        ("%s√(2 %s)/2 %s √(%s)/2%s"):format(sign == 1 and "" or "-", tostring(m), plus == 1 and "+" or "-",
          inside,
          minus(shift)), inside .. " ≥ 0")
    end
  end
  local sum = 0
  for k, each in ipairs(resolvent(short[1], short[2], short[3])) do sum = sum + each*m^(k - 1) end
  table.insert(list.definitions, ("%s the largest root of %s = 0"):format(tostring(m), tostring(sum)))
end

-- The eigenvalues of the companion matrix.
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

-- The coefficients in y = x + shift of a polynomial in x, with the shift that leaves no yⁿ⁻¹.
local function shifted(c)
  local n, y, sum = #c - 1, abbreviation "y", 0
  local shift = ratio(c[n], n*c[n + 1])
  for k = 1, n + 1 do sum = sum + c[k]*(y - shift)^(k - 1) end
  return coefficients(expand(sum), y), shift
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

local function in_powers(c, step, list)
  local inner, squares = {}, polynomial.new_list()
  for i = 1, #c, step do inner[#inner + 1] = c[i] end
  polynomial.roots(inner, squares)
  for _, condition in ipairs(squares.conditions) do equation.add_condition(list.conditions, condition) end
  for _, v in ipairs(squares) do polynomial.pure_power(step, v, list) end
  for _, pair in ipairs(squares.complex) do complex_power(step, pair.re, pair.im, list) end
  list.approximate = list.approximate or squares.approximate
end

-- Adds the roots of Σ c[k + 1] xᵏ, n ≥ 1, to a list; nothing but false where there is no closed form.
function polynomial.roots(c, list)
  local n, numbers = #c - 1, true
  if tostring(c[n + 1]):sub(1, 1) == "-" then
    local opposite = {}
    for i = 1, #c do opposite[i] = simplify(-c[i]) end
    c = opposite
  end
  for i = 1, #c do numbers = numbers and is_number(c[i]) end
  if n == 1 then return polynomial.add(list, -c[1]/c[2]) end
  local step = common_step(c)
  if step == n then return polynomial.pure_power(n, simplify(-c[1]/c[n + 1]), list) end
  if n == 2 then return quadratic(c, list) end
  if c[n] ~= 0 then
    local moved, shift = shifted(c)
    if common_step(moved) > 1 then
      local centred = polynomial.new_list()
      if polynomial.roots(moved, centred) == false then return false end
      for i = 1, #centred do polynomial.add(list, centred[i] - shift, nil, centred.when[i]) end
      for _, pair in ipairs(centred.complex) do add_pair(list, pair.re - shift, pair.im) end
      for _, condition in ipairs(centred.conditions) do equation.add_condition(list.conditions, condition) end
      list.approximate = list.approximate or centred.approximate
      return
    end
  end
  if numbers then
    if step > 1 then return in_powers(c, step, list) end
    if n == 3 then return cubic_in_numbers(c, list) end
    if n == 4 and quartic_in_numbers(c, list) then return end
    return numeric_roots(c, list)
  end
  if step > 1 and n//step <= 2 then return in_powers(c, step, list) end
  if n > 4 then return false end
  (n == 3 and cubic_in_symbols or quartic_in_symbols)(c, list)
  write_abbreviations(list, c)
end

return polynomial
