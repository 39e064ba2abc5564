-- Predictors as expressions: H ŷ = G u + (H - 1) y for every class, linear or not, and fits of any predictor.
local a1, b0, b1, c1, d1, f1 = params "a1 b0 b1 c1 d1 f1"
local y, u, yhat, e = func "y", func "u", func "yhat", func "e"

test("the predictor of every class", function()
  local arx_ = idpoly { A = { 1, a1 }, B = { b0 } }:predictor()
  expect(arx_.expression):equals(b0 * u(t) - a1 * y(t - 1))
  expect(arx_.linear):is_true()
  expect(#arx_.regressor):equals(2)
  local armax_ = idpoly { A = { 1, a1 }, B = { 0, b1 }, C = { 1, c1 } }:predictor()
  expect(armax_.linear):equals(false)
  expect(armax_.expression):equals(b1 * u(t - 1) - c1 * yhat(t - 1) + (c1 - a1) * y(t - 1))
  local oe_ = idpoly { B = { 0, b1 }, F = { 1, f1 } }:predictor()
  expect(oe_.expression):equals(b1 * u(t - 1) - f1 * yhat(t - 1))
  expect(idpoly { B = { b0, b1 } }:predictor().linear):is_true()
  expect(idpoly { A = { 1, a1 } }.kind):equals "AR"
  expect(idpoly { B = { b0 }, F = { 1, f1 }, D = { 1, d1 } }.kind):equals "BJ"
  expect(function() local _ = oe_.regressor end):fails "not linear"
end)

test("numbers: the same predictions as by hand, and as the estimated model", function()
  local d = iddata { y = { 1, 2, 3, 1 }, u = { 1, -1, 1, 2 } }
  local m = idpoly { A = { 1, -0.5 }, B = { 0, 2 }, C = { 1, 0.3 } }
  local hat, past = {}, { y = 0, u = 0, e = 0 }
  local p = m:predict(d)
  for i = 1, 4 do
    hat[i] = 0.5 * past.y + 2 * past.u + 0.3 * past.e
    past = { y = d.y[i], u = d.u[i], e = d.y[i] - hat[i] }
    expect(p[i]):near(hat[i], 1e-15)
  end
  expect(m:simulate(d)):near({ 0, 2, -1, 1.5 }, 1e-15)
  expect(function() idpoly { A = { 1, a1 }, B = { b0 } }:predict(d) end):fails "contains the parameters"
  expect(function() idpoly { A = { 2, 1 } } end):fails "A must begin with 1"
  expect(function() idpoly { B = { { 1 }, { 1 } } }:simulate(d) end):fails "the model has 2 inputs"
end)

test("symbolic predictors evaluate as the filters do", function()
  -- two roads: the expression through its recursion, and the polynomial filters of idpoly:predict
  local r = (function(s) return function() s = (1103515245 * s + 12345) % 2147483648
    return s / 1073741824 - 1 end end)(21)
  local us, ys = {}, {}
  for i = 1, 80 do us[i], ys[i] = r(), r() end
  local d = iddata { y = ys, u = us }
  local numbers = { a1 = -0.6, b0 = 1.5, b1 = 0.5, c1 = 0.3, d1 = -0.4, f1 = 0.2 }
  local shape = { A = { 1, a1 }, B = { b0, b1 }, C = { 1, c1 }, D = { 1, d1 }, F = { 1, f1 } }
  local values = { A = { 1, -0.6 }, B = { 1.5, 0.5 }, C = { 1, 0.3 }, D = { 1, -0.4 }, F = { 1, 0.2 } }
  local p = idpoly(shape):predictor()
  local hat = idpoly(values):predict(d)
  local at = {}
  for i = 1, 80 do
    local e_ = subs(p.expression, { a1 = numbers.a1, b0 = numbers.b0, b1 = numbers.b1, c1 = numbers.c1,
      d1 = numbers.d1, f1 = numbers.f1 })
    local map = {}
    for lag = 0, 3 do
      map[y(t - lag)] = i - lag >= 1 and ys[i - lag] or 0
      map[u(t - lag)] = i - lag >= 1 and us[i - lag] or 0
      if lag > 0 then map[yhat(t - lag)] = at[i - lag] or 0 end
    end
    at[i] = evaluate(subs(e_, map))
    expect(at[i]):near(hat[i], 1e-12)
  end
end)

test("fits of any predictor", function()
  local r = (function(s) return function() s = (1103515245 * s + 12345) % 2147483648
    return s / 1073741824 - 1 end end)(5)
  local us, ys, ws = {}, {}, {}
  for i = 1, 300 do
    us[i] = r()
    ys[i] = 0.5 * math.sin(ys[i-1] or 0) + 0.8 * (us[i-1] or 0)^2
    ws[i] = 0.7 * (ws[i-1] or 0) + (us[i-1] or 0)
  end
  local al, be = params "al=0.1 be=1"
  local f = predictor(al * sin(y(t-1)) + be * u(t-1)^2):fit(iddata { y = ys, u = us })
  expect(f.theta):near({ 0.5, 0.8 }, 1e-12)
  local g = predictor(al * sin(y(t-1)) + exp(be) * u(t-1)^2):fit(iddata { y = ys, u = us },
    { start = { be = 0 } })
  expect(g.theta):near({ 0.5, math.log(0.8) }, 1e-10)
  local o = predictor(-f1 * yhat(t-1) + b1 * u(t-1)):fit(iddata { y = ws, u = us },
    { ic = "zero", start = { 0.1, 0.1 } })
  expect(o.theta):near({ 1, -0.7 }, 1e-10)                 -- in the order of declaration: b1, f1
  -- an ARMA process through its innovations
  local es, xs = {}, {}
  for i = 1, 1500 do
    es[i] = r()
    xs[i] = 0.6 * (xs[i-1] or 0) + es[i] + 0.4 * (es[i-1] or 0)
  end
  local d = iddata { y = xs }
  local mine = predictor(-a1 * y(t-1) + c1 * e(t-1)):fit(d, { ic = "zero", start = { a1 = 0, c1 = 0 } })
  local theirs = armax(d, { na = 1, nc = 1, ic = "zero" })
  expect(mine.theta):near(theirs.theta, 1e-7)
  expect(mine.std):near(theirs.std, 1e-6)
end)

test("what is no predictor", function()
  expect(function() predictor(a1 * y(t)) end):fails "y(t) is not known at time t - 1"
  expect(function() predictor(a1 * u(t + 1)) end):fails "future"
  expect(function() predictor(a1 * y(t / 2)) end):fails "whole number"
  expect(function() predictor(a1 * y(a1)) end):fails "t - k"
  expect(function() predictor(var "q" * u(t)) end):fails "neither among the parameters"
  expect(function() predictor(b0 * u(t)):fit(iddata { y = { 1, 2 } }) end):fails "no inputs"
end)

-- A row whose prediction is not real for the parameters of an iterate counts as one: leaving it out would
-- make the sum of squares smaller.
test("predictors that are not real for all parameters are fitted to all rows", function()
  local us, ys = {}, { 0.5 }
  for k = 1, 40 do us[k] = math.sin(0.9*k)^2 end
  for k = 2, 40 do ys[k] = 0.6^ys[k-1] + 0.3*us[k-1] end
  local power = predictor(a1^y(t-1) + b1*u(t-1))
  for _, start in ipairs { { 0.5, 0.1 }, { 0.05, 2 }, { 3, -1 }, { 1e-3, 10 } } do
    local fit = power:fit(iddata { y = ys, u = us }, { start = start })
    expect(fit.theta):near({ 0.6, 0.3 }, 1e-8)
    expect(#fit.residuals):equals(39)
  end
  expect(function() power:fit(iddata { y = ys, u = us }, { start = { -1, 0 } }) end)
    :fails "not finite at the start, first at sample 2; give start = { … }"
  local late = predictor(a1^y(t-1) + b1*u(t-10))
  expect(function() late:fit(iddata { y = { 0, 1 }, u = { 1, 0 } }) end)
    :fails "no row is left: the predictor needs 10 earlier samples and the data has 2"
  expect(function() power:fit(iddata { y = { 0/0, 0/0, 0/0 }, u = { 1, 0, 1 } }) end)
    :fails "3 missing values: y at samples 1, 2, 3"
end)
