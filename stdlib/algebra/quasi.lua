-- Sums of c xⁿ exp(λ x) cos(b x) and c xⁿ exp(λ x) sin(b x): what Laplace transforms and integrals in
-- closed form have in common.

-- Constant and slope of e in x; nil if e is not linear.
local function linear(e, x)
  local good, c = pcall(coefficients, e, x)
  if not good or #c > 2 then return nil end
  return c[1], c[2] or 0
end

-- Products of sines and cosines as sums: { c, b, phase } stands for c cos(b x + phase).
local function times_cosine(waves, b, phase)
  if not waves then return { { 1, b, phase } } end
  local list = {}
  for _, w in ipairs(waves) do
    list[#list + 1] = { w[1]/2, simplify(w[2] + b), simplify(w[3] + phase) }
    list[#list + 1] = { w[1]/2, simplify(w[2] - b), simplify(w[3] - phase) }
  end
  return list
end

-- sinh and cosh as exponentials.
local function in_exponentials(e, x)
  local values = {}
  for _, f in ipairs(include "algebra/roots".functions_of(e, x, {})) do
    local op, a = operation(f)
    if op == "sinh" then values[f] = (exp(a) - exp(-a))/2 end
    if op == "cosh" then values[f] = (exp(a) + exp(-a))/2 end
  end
  return next(values) and subs(e, values) or e
end

-- e as a list of { c =, n =, lambda =, b =, kind = "cos" or "sin" }.
local function decompose(e, x)
  local list = {}
  for _, term in ipairs(terms(expand(in_exponentials(e, x)), x)) do
    local c, n, lambda, waves = term[1], 0, 0, nil
    for k = 2, #term do
      local base, exponent = term[k][1], term[k][2]
      local op, argument = operation(base)
      if base == x then
        n = exponent
      elseif op == "exp" then
        local constant, slope = linear(argument, x)
        if not constant then return nil, base^exponent end
        c, lambda = c*exp(constant*exponent), lambda + slope*exponent
      elseif (op == "sin" or op == "cos") and math.type(exponent) == "integer" and exponent > 0 then
        local phase, b = linear(argument, x)
        if not phase then return nil, base^exponent end
        for _ = 1, exponent do
          -- sin(α) = cos(α - π/2)
          waves = times_cosine(waves, b, op == "sin" and phase - pi/2 or phase)
        end
      else
        return nil, base^exponent
      end
    end
    if math.type(n) ~= "integer" or n < 0 then return nil, x^n end
    lambda = simplify(lambda)
    for _, w in ipairs(waves or { { 1, 0, 0 } }) do
      local cosine, sine = simplify(c*w[1]*cos(w[3])), simplify(-c*w[1]*sin(w[3]))
      if w[2] == 0 then sine = 0 end
      if cosine ~= 0 then list[#list + 1] = { c = cosine, n = n, lambda = lambda, b = w[2], kind = "cos" } end
      if sine ~= 0 then list[#list + 1] = { c = sine, n = n, lambda = lambda, b = w[2], kind = "sin" } end
    end
  end
  return list
end

return { decompose = decompose }
