-- Partial fractions over ℚ, by undetermined coefficients.

-- Quotient and remainder of polynomials in x with coefficients as lists, lowest first.
local function divided(a, b)
  local rest, quotient = {}, {}
  for i = 1, #a do rest[i] = a[i] end
  for i = #a - #b + 1, 1, -1 do
    local q = simplify(rest[i + #b - 1]/b[#b])
    quotient[i] = q
    for k = 1, #b do rest[i + k - 1] = simplify(rest[i + k - 1] - q*b[k]) end
  end
  for i = #rest, #b, -1 do rest[i] = nil end
  return quotient, rest
end

local function polynomial(c, x)
  local sum = 0
  for i = 1, #c do sum = sum + c[i]*x^(i - 1) end
  return sum
end

-- The polynomial part and a list of { numerator coefficients, factor, power } of e.
local function parts(e, x)
  local numerator, denominator = fraction(e)
  local n, d = coefficients(numerator, x), coefficients(denominator, x)
  local whole, rest = {}, n
  if #n >= #d then whole, rest = divided(n, d) end
  if #d == 1 then
    for i = 1, #n do whole[i] = n[i]/d[1] end
    return whole, {}
  end
  local list, columns = {}, {}
  for _, each in ipairs(factors(denominator)) do
    local base, multiplicity = each[1], each[2]
    local degree = #coefficients(base, x) - 1
    if degree > 0 then
      for power = 1, multiplicity do
        for k = 0, degree - 1 do columns[#columns + 1] = { base = base, power = power, k = k } end
        list[#list + 1] = { base = base, power = power, degree = degree }
      end
    end
  end
  local size = #d - 1
  local A, b = {}, {}
  for i = 1, size do A[i], b[i] = {}, rest[i] or 0 end
  for j, column in ipairs(columns) do
    local c = coefficients(together(denominator*x^column.k/column.base^column.power), x)
    for i = 1, size do A[i][j] = c[i] or 0 end
  end
  local solution = solve(mat(A), vec(b))
  local j = 0
  for _, part in ipairs(list) do
    part.numerator = {}
    for k = 1, part.degree do
      j = j + 1
      part.numerator[k] = size == 1 and solution or solution[j]
    end
  end
  return whole, list
end

local function apart(e, x)
  local whole, list = parts(e, x)
  local sum = polynomial(whole, x)
  for _, part in ipairs(list) do
    local numerator = simplify(polynomial(part.numerator, x))
    if numerator ~= 0 then sum = sum + simplify(numerator/part.base^part.power) end
  end
  return sum
end

return { apart = apart, parts = parts, polynomial = polynomial }
