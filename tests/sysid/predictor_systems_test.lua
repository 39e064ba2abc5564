-- From a predictor back to the systems that it predicts, and the iterates of its fit.
local y, u, yhat, e = func "y", func "u", func "yhat", func "e"
local a, b, c, f = params "a b c f"

test("a predictor and its systems: H ŷ = G u + (H - 1) y", function()
  local arx = predictor(-a*y(t - 1) + b*u(t - 2))
  expect(tostring(arx:tf())):matches "b\n"
  expect(arx:tf().den):equals(vec { 1, a, 0 })
  expect(arx:tf "noise".num):equals(vec { 1, 0, 0 })
  local oe = predictor(b*u(t - 1) - f*yhat(t - 1))
  expect(oe:tf().den):equals(vec { 1, f })
  expect(oe:tf "noise".num):equals(oe:tf "noise".den)            -- H = 1
  local armax = predictor(-a*y(t - 1) + b*u(t - 1) + c*e(t - 1))
  expect(armax:tf "noise".num):equals(vec { 1, c })
  expect(armax:tf "noise".den):equals(vec { 1, a })
  expect(armax:tf("plant", 0.1).Ts):near(0.1, 0)
end)

test("a polynomial model and its predictor have the same systems", function()
  local m = idpoly { A = { 1, "-1/2" }, B = { 0, 1, 3 }, C = { 1, "1/5" } }
  local p = m:predictor()
  for _, z in ipairs { 2, -3, 5.5 } do
    local G = (1/z + 3/z^2)/(1 - 0.5/z)
    local H = (1 + 0.2/z)/(1 - 0.5/z)
    expect(p:tf()(z)):near(G, 1e-12)
    expect(p:tf "noise"(z)):near(H, 1e-12)
  end
end)

test("what has no transfer function is named", function()
  expect(function() predictor(y(t - 1)^2 + b*u(t - 1)):tf() end):fails "not linear in y(t-1)"
  expect(function() predictor(a*y(t - 1)):tf() end):fails "contains no u"
  expect(function() predictor(a*y(t - 1) + 1):tf "noise" end):fails "no multiple of u, y, yhat or e"
  expect(function() predictor(a*y(t - 1)):tf "G" end):fails "from e to y"
end)

test("the iterates of a fit, the start first", function()
  local input, output = prbs(127), {}
  for k = 1, 127 do output[k] = 0.5*(output[k - 1] or 0) + (k > 1 and input[k - 1] or 0) end
  local fit = predictor(b*u(t - 1) - f*yhat(t - 1)):fit(iddata { y = output, u = input },
    { start = { 0.1, 0.1 } })
  expect(fit.iterates(1, 1)):near(0.1, 0)
  expect(fit.iterates(fit.iterates.rows, 2)):near(-0.5, 1e-9)
  expect(fit.losses[1] > 1):is_true()
  expect(fit.losses[#fit.losses] < 1e-20):is_true()
  expect(fit.iterates.rows):equals(#fit.losses)
end)
