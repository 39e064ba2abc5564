-- Laplace transforms of sums of tⁿ exp(λ t) cos(b t), and back by partial fractions.

local quasi = include "algebra/quasi"
local fractions = include "algebra/partial_fractions"

local function factorial(n) return n < 2 and 1 or n*factorial(n - 1) end

-- L{tⁿ f} = (-1)ⁿ F⁽ⁿ⁾.
local function transform_of(part, s)
  local shifted = s - part.lambda
  local F = part.b == 0 and 1/shifted or (part.kind == "cos" and shifted or part.b)/(shifted^2 + part.b^2)
  if part.b == 0 then return part.c*factorial(part.n)/shifted^(part.n + 1) end
  for _ = 1, part.n do F = -diff(F, s) end
  return part.c*F
end

-- Derivatives of unknowns: x⁽ᵏ⁾ -> sᵏ X - sᵏ⁻¹ x(0) - … - x⁽ᵏ⁻¹⁾(0).
local function transform_of_unknown(leaf, s)
  local base, order = undifferentiated(leaf)
  local name = base.name
  local X = s^order*param(name:upper() ~= name and name:upper() or name .. "_s")
  for k = 0, order - 1 do
    X = X - s^(order - 1 - k)*param(("d"):rep(k) .. name .. "0")
  end
  return X
end

local function laplace_transform(e, t, s)
  if object_type(e) == "equation" then
    return laplace_transform(e.lhs, t, s) ~ laplace_transform(e.rhs, t, s)
  end
  if s == nil then
    fail "laplace_transform: give the expression, t and s: laplace_transform(exp(-t), t, s)"
  end
  local sum, rest = 0, 0
  for _, term in ipairs(terms(expand(e), t)) do
    local whole = term[1]
    for k = 2, #term do whole = whole*term[k][1]^term[k][2] end
    local unknown
    for _, symbol in ipairs(symbols_in(whole)) do
      if symbol ~= t and symbol ~= s and der(symbol) ~= 0 then
        unknown = symbol
      end
    end
    if unknown then
      local slope = diff(whole, unknown)
      if simplify(whole - slope*unknown) ~= 0 or #term > 1 then
        fail(("laplace_transform: %s is not linear with constant coefficients"):format(tostring(whole)))
      end
      sum = sum + slope*transform_of_unknown(unknown, s)
    else
      rest = rest + whole
    end
  end
  local list, culprit = quasi.decompose(rest, t)
  if not list then
    fail(("laplace_transform: no transform of %s in closed form; powers of t, exp, sin and cos of linear "
      .. "arguments have one")
      :format(tostring(culprit)))
  end
  local F = 0
  for _, part in ipairs(list) do F = F + transform_of(part, s) end
  if F ~= 0 then F = factor(F) end
  return sum == 0 and F or simplify(sum + F)
end

-- A symbol for a sine or cosine, so that cos(2 t) stays what it is when sums are simplified.
local function hidden(wave, waves)
  local symbol = param("pendula_wave" .. #waves + 1)
  waves[#waves + 1] = { symbol, wave }
  return symbol
end

-- (c₀ + c₁ s)/((s - p)² + w²)^k; the waves in it are hidden.
local function inverse_of_pair(part, waves, s, t)
  local d, a = coefficients(part.base, s), part.numerator
  local scale = d[3]^part.power
  local p = simplify(-d[2]/(2*d[3]))
  local square = simplify(d[1]/d[3] - p^2)                -- w², or -w² where the roots are real
  local c1, c0 = a[2] or 0, a[1]
  local first, second = simplify(c1/scale), simplify((c0 + c1*p)/scale)
  local number = #symbols_in(square) == 0 and evaluate(square)
  local real = number and number < 0
  local w = simplify(sqrt(real and -square or square))
  local op, inside = operation(w)
  if op == "abs" then w = inside end                       -- every term is even in w
  local co, si = real and cosh(w*t) or cos(w*t), real and sinh(w*t) or sin(w*t)
  co, si = hidden(co, waves), hidden(si, waves)
  local f
  if part.power == 1 then
    f = first*co + simplify(second/w)*si
  elseif part.power == 2 and not real then
    f = simplify(first/(2*w))*t*si + simplify(second/(2*w^3))*(si - w*t*co)
  else
    fail(("inverse_laplace: poles of multiplicity %d at %s = 0 are not supported"):format(part.power,
      tostring(part.base)))
  end
  return f*exp(p*t)
end

local function inverse_laplace(F, s, t)
  local kind = object_type(F)
  if kind == "tf" or kind == "ss" or kind == "zpk" or (kind and kind ~= "expr" and kind ~= "matrix") then
    local good, expression = pcall(function() return F:tf()(s) end)
    if not good then fail "inverse_laplace: expected an expression in s or a transfer function" end
    F = expression
  end
  if t == nil then fail "inverse_laplace: give the transform, s and t: inverse_laplace(1/(s + 1), s, t)" end
  local rational_, whole, list = pcall(fractions.parts, F, s)
  if not rational_ then
    fail(("inverse_laplace: %s is not a fraction of polynomials in %s; a factor exp(-T %s) delays the "
      .. "function by T: transform without it"):format(tostring(F), tostring(s), tostring(s)))
  end
  for i = 1, #whole do
    if whole[i] ~= nil and whole[i] ~= 0 then
      fail(("inverse_laplace: the polynomial part %s means impulses at t = 0; the degree of the numerator "
        .. "must be below that of the denominator")
        :format(tostring(simplify(fractions.polynomial(whole, s)))))
    end
  end
  local sum, waves = 0, {}
  for _, part in ipairs(list) do
    if part.degree == 1 then
      local d = coefficients(part.base, s)
      local pole = simplify(-d[1]/d[2])
      local n = part.power - 1
      sum = sum + simplify(part.numerator[1]/(d[2]^(n + 1)*factorial(n)))*t^n*exp(pole*t)
    elseif part.degree == 2 then
      sum = sum + inverse_of_pair(part, waves, s, t)
    else
      fail(("inverse_laplace: the factor %s of the denominator has degree %d and no factors over the "
        .. "rational numbers")
        :format(tostring(part.base), part.degree))
    end
  end
  sum = simplify(sum)
  for _, each in ipairs(waves) do sum = subs(sum, { [each[1]] = each[2] }) end
  return sum
end

return { laplace_transform = laplace_transform, inverse_laplace = inverse_laplace }
