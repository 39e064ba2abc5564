-- Many fits of one model against what linear regression knows exactly: x is constant, y its measurements,
-- so that SSE(x) = SSE + N (x - mean)².
x, a, b = var "x", param("a", 1), param("b", 2)

local y = { 3.1, 2.7, 3.4, 2.9, 3.3, 2.2, 3.0, 3.6, 2.8, 3.05 }
local N, mean, sse = #y, 0, 0
for _, v in ipairs(y) do mean = mean + v/N end
for _, v in ipairs(y) do sse = sse + (v - mean)^2 end
local constant = fit(dae{ der(x) ~ 0*x }, { params = { x }, data = iddata{ y = y, Ts = 1 }, y = x })

test("refit: held at a value, the loss is that of the residuals about it", function()
  local held = constant:refit{ fixed = { x = 2 } }
  expect(held.loss):near((sse + N*(mean - 2)^2)/N, 1e-12)
  expect(#held.theta):equals(0)
  expect(constant:refit{ guess = { x = 100 } }.theta[1]):near(mean, 1e-9)
  expect(constant:refit{ y = map(vec(y), function(v) return 2*v end) }.theta[1]):near(2*mean, 1e-9)
  expect(function() constant:refit{ fixed = { a = 1 } } end):fails "a"
  expect(function() constant:refit{ y = { 1, 2 } } end):fails "10×1"
  expect(function() constant:refit{ fix = { x = 1 } } end):fails "fixed"
end)

test("profile: the interval of a linear model in closed form", function()
  for confidence, z in pairs { [0.95] = 1.959963984540054, [0.6826894921370859] = 1 } do
    local p = constant:profile(x, { confidence = confidence, points = 81 })
    local half = math.sqrt(sse/N*(math.exp(z^2/N) - 1))      -- N ln(1 + N(x - mean)²/SSE) = z²
    -- z(x) is nearly straight between the points: its curvature over a cell of 1/40 half-width
    expect(p.low):near(mean - half, 1e-3*half)
    expect(p.high):near(mean + half, 1e-3*half)
  end
end)

test("profile: what is not identifiable has no ends, a range that is too narrow neither", function()
  local d = {}
  for i = 0, 8 do d[i + 1] = math.exp(-0.5*i) + 0.01*(-1)^i end
  local both = fit(dae{ der(x) ~ -(a + b)*x }, { params = { a, b }, data = iddata{ y = d, Ts = 1 }, y = x,
    start = { x = 1 } })
  local p = both:profile(a)
  expect(p.low):is_nil()
  expect(p.high):is_nil()
  expect(tostring(p)):matches "not identifiable"
  local narrow = constant:profile(x, { range = { mean - 1e-3, mean + 1e-3 } })
  expect(narrow.low):is_nil()
  expect(function() constant:profile() end):fails "which parameter"
  expect(function() constant:profile(a) end):fails "not estimated"
  expect(function() constant:profile(x, { points = 2 }) end):fails "at least 5"
  expect(function() constant:profile(x, { pionts = 21 }) end):fails "points"
end)

test("bootstrap: the deviation of a mean", function()
  local runs = 600
  local s = constant:bootstrap{ runs = runs, seed = 3 }
  local exact = math.sqrt(sse/(N - 1)/N)
  expect(s.std[1]/exact):near(1, 3/math.sqrt(2*runs))        -- three deviations of a deviation
  expect(s.std[1]):equals(constant:bootstrap{ runs = runs, seed = 3, workers = 1 }.std[1])
  expect(s.low[1] < mean and mean < s.high[1]):is_true()
  expect(function() constant:bootstrap{ runs = 2.5 } end):fails "whole number"
end)

test("cross-validation: leaving one out of a mean costs N/(N - 1)", function()
  local c = constant:cross_validate{ folds = N }
  expect(c.rmse):near(math.sqrt(sse/N)*N/(N - 1), 1e-9)
  expect(#c.folds):equals(N)
  expect(function() constant:cross_validate{ folds = 11 } end):fails "10 samples"
end)

test("starts: the better of two minima is found, and said", function()
  local w = param("w", 1)
  local s = {}
  for i = 0, 80 do s[i + 1] = math.sin(3*0.1*i) end
  local wave = dae{ der(x) ~ w*cos(w*t) }
  local first = fit(wave, { params = { w }, data = iddata{ y = s, Ts = 0.1 }, y = x, start = { x = 0 },
    guess = { w = 12 } })
  expect(first(w)):near(11.755, 1e-3)
  local found = first:starts{ runs = 12, lower = { w = 1 }, upper = { w = 16 } }
  expect(found.best(w)):near(3, 1e-6)
  local best = 0  -- exact fits differ by rounding, and are one minimum
  for _, one in ipairs(found.minima) do best = best + (math.abs(one.theta[1] - 3) < 1e-3 and 1 or 0) end
  expect(best):equals(1)
  expect(#found.minima > 1):is_true()
  expect(tostring(found)):matches "better than the fit so far"
  expect(function() first:starts{ lower = { q = 1 }, upper = { q = 2 } } end):fails "q was not estimated"
  expect(first:starts{ runs = 3, lower = { [w] = 2.9 }, upper = { [w] = 3.1 } }.best(w)):near(3, 1e-6)
  expect(function() first:bootstrap(100) end):fails "{ runs = "
end)
