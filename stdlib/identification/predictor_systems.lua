-- The systems G and H behind a predictor: H ŷ = G u + (H - 1) y.

local longest = 60                                 -- lags that are looked for

-- The coefficients of f(t), f(t-1) … in an expression, by lag, and what is left of it.
local function coefficients_of(e, name)
  local f, S, list = func(name), var "pendula_signal", {}
  for lag = 0, longest do
    local put = subs(e, { [f(pendula.t - lag)] = S })
    if put ~= e then
      list[lag] = diff(put, S)
      for _, s in ipairs(symbols_in(list[lag])) do
        if s == pendula.t or s == S then
          fail(("tf: the prediction is not linear in %s(t%s)"):format(name, lag == 0 and "" or "-" .. lag))
        end
      end
      e = subs(put, { [S] = 0 })
    end
  end
  return list, e
end

-- Σ signs · lists as the coefficients of 1, q⁻¹ … q⁻ⁿ, with `first` added to that of 1.
local function polynomial(first, terms, n)
  local c = {}
  for lag = 0, n do
    c[lag + 1] = lag == 0 and first or 0
    for _, term in ipairs(terms) do c[lag + 1] = c[lag + 1] + term[1]*(term[2][lag] or 0) end
  end
  return c
end

-- ŷ = B u + A y + F ŷ + C (y - ŷ): G = B/(1 - F - A), H = (1 - F + C)/(1 - F - A).
local function systems(p, which, Ts)
  local rest, of, n = p.expression, {}, 0
  for _, name in ipairs { "u", "y", "yhat", "e" } do
    of[name], rest = coefficients_of(rest, name)
    for lag in pairs(of[name]) do n = math.max(n, lag) end
  end
  if simplify(rest) ~= 0 then
    fail(("tf: the prediction contains %s, which is no multiple of u, y, yhat or e up to t-%d"):format(
      tostring(rest), longest))
  end
  local den = polynomial(1, { { -1, of.yhat }, { -1, of.y } }, n)
  local noise = polynomial(1, { { -1, of.yhat }, { 1, of.e } }, n)
  if which == "noise" then return tf(noise, den, Ts) end
  if which ~= "plant" then
    fail(('tf: "plant" is from u to y, "noise" from e to y; got %s'):format(tostring(which)))
  end
  if not next(of.u) then fail 'tf: the prediction contains no u; p:tf "noise" is the system from e to y' end
  return tf(polynomial(0, { { 1, of.u } }, n), den, Ts)
end

return { systems = systems }
