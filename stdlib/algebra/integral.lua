-- Integrals in closed form: sums of xⁿ exp(λ x) cos(b x), and rational functions.

local quasi = include "algebra/quasi"
local fractions = include "algebra/partial_fractions"

-- ∫ c xⁿ exp(λ x) cos(b x): exp(λ x) Σ xᵏ (pₖ cos(b x) + qₖ sin(b x)), from the highest power down.
local function of_wave(part, x)
  local lambda, b, size = part.lambda, part.b, simplify(part.lambda^2 + part.b^2)
  if size == 0 then return part.c*x^(part.n + 1)/(part.n + 1) end
  local p, q, above_p, above_q = 0, 0, 0, 0
  for k = part.n, 0, -1 do
    local at_top = k == part.n
    local A = (at_top and part.kind == "cos" and part.c or 0) - (k + 1)*above_p
    local B = (at_top and part.kind == "sin" and part.c or 0) - (k + 1)*above_q
    above_p, above_q = simplify((lambda*A - b*B)/size), simplify((b*A + lambda*B)/size)
    p, q = p + above_p*x^k, q + above_q*x^k
  end
  local waves = b == 0 and p or p*cos(b*x) + q*sin(b*x)
  return lambda == 0 and waves or waves*exp(lambda*x)
end

-- A bare expression cannot say under which condition it holds: that goes to the error stream.
local function warn(text, ...) io.stderr:write("warning: integral: ", text:format(...), "\n") end

local function is_positive(e) return tostring(simplify(abs(e))) == tostring(e) end

local function of_fraction(part, x)
  local c = coefficients(part.base, x)
  if part.degree == 1 then
    local a = simplify(part.numerator[1]/c[2])
    if part.power == 1 then return a*log(abs(part.base)) end
    return -a/((part.power - 1)*part.base^(part.power - 1))
  end
  if part.degree ~= 2 or part.power ~= 1 then return nil end
  local c1, c0 = part.numerator[2] or 0, part.numerator[1]
  local first = simplify(c1/(2*c[3]))                       -- of the derivative 2 c₂ x + c₁
  local rest = simplify(c0 - first*c[2])
  local inside = simplify(4*c[3]*c[1] - c[2]^2)
  local number = #symbols_in(inside) == 0 and evaluate(inside)
  local sum = first == 0 and 0 or first*log(abs(part.base))
  if rest == 0 then return sum end
  local slope = 2*c[3]*x + c[2]
  if number and number < 0 then
    local w = simplify(sqrt(-inside))
    return sum + simplify(rest/w)*log(abs((slope - w)/(slope + w)))
  end
  if not number and not is_positive(inside) then warn("holds where %s > 0", tostring(inside)) end
  local w = simplify(sqrt(inside))
  return sum + simplify(2*rest/w)*atan(simplify(slope/w))
end

local function rational(e, x)
  local good, whole, list = pcall(fractions.parts, e, x)
  if not good then return nil end
  local sum = 0
  for i = 1, #whole do sum = sum + whole[i]*x^i/i end
  for _, part in ipairs(list) do
    local piece = of_fraction(part, x)
    if not piece then return nil end
    sum = sum + piece
  end
  return sum, list
end

local function antiderivative(e, x)
  local list, culprit = quasi.decompose(e, x)
  if list then
    local sum = 0
    for _, part in ipairs(list) do sum = sum + of_wave(part, x) end
    return simplify(sum)
  end
  local sum, fractions_of_e = rational(e, x)
  if sum then return simplify(sum), fractions_of_e end
  fail(("integral: no closed form is known for a term with %s; integrate numerically with one more state, "
    .. "der(J) ~ e")
    :format(tostring(culprit)))
end

-- Where a fraction is infinite: zeros of a polynomial of degree 1 or 2, the real ones if that can be told.
local function poles(part, x)
  local c = coefficients(part.base, x)
  if #c == 2 then return { simplify(-c[1]/c[2]) } end
  local inside = simplify(c[2]^2 - 4*c[3]*c[1])
  if #symbols_in(inside) == 0 and evaluate(inside) < 0 or is_positive(simplify(-inside)) then return {} end
  local w = sqrt(inside)
  return { simplify((-c[2] - w)/(2*c[3])), simplify((-c[2] + w)/(2*c[3])) }
end

-- The difference of an antiderivative means nothing across a pole, and no pole of a fraction is integrable.
local function check_poles(list, x, a, b)
  local function number(e) return type(e) == "number" and e or #symbols_in(e) == 0 and evaluate(e) end
  for _, part in ipairs(list) do
    for _, pole in ipairs(poles(part, x)) do
      local p, low, high = number(pole), number(a), number(b)
      if not (p and low and high) then
        warn("holds where %s = %s is not between %s and %s", tostring(x), tostring(pole), tostring(a),
          tostring(b))
      elseif math.min(low, high) <= p and p <= math.max(low, high) then
        fail(("integral: the integrand is infinite at %s = %s: there is no integral from %s to %s"):format(
          tostring(x), tostring(pole), tostring(a), tostring(b)))
      end
    end
  end
end

local function integral(e, x, a, b)
  if x == nil then fail "integral: give the variable: integral(x^2, x), or integral(x^2, x, 0, 1)" end
  if object_type(e) == "matrix" then return map(e, function(each) return integral(each, x, a, b) end) end
  local F, list = antiderivative(e, x)
  if a == nil then return F end
  if b == nil then fail "integral: give both borders: integral(x^2, x, 0, 1)" end
  check_poles(list or {}, x, a, b)
  local value = simplify(subs(F, { [x] = b }) - subs(F, { [x] = a }))
  local good, fraction = pcall(together, value)                 -- (k sin(k) + cos(k) - 1)/k²
  return good and utf8.len(tostring(fraction)) < utf8.len(tostring(value)) and fraction or value
end

return { integral = integral }
