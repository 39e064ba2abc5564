-- Nonlinear least squares: minima known exactly, rates explained by the neglected term, what the data cannot
-- tell.
local a, b, c = vars "a b c"

-- y = a e^{-b t} at t = 0, 0.5 … 3.5
local times, exact, noise = {}, {}, { 0.02, -0.01, 0.03, -0.02, 0.01, -0.03, 0.015, -0.005 }
for i = 1, 8 do times[i], exact[i] = (i - 1)/2, 2*math.exp(-0.7*(i - 1)/2) end
local function residuals(size)
  local R = {}
  for i = 1, 8 do R[i] = a*exp(-b*times[i]) - (exact[i] + size*noise[i]) end
  return R
end

test("a linear problem takes one step and gives the textbook covariance", function()
  local g = gauss_newton { R = { a + b - 1, a + 2*b - 3, a + 3*b - 4 }, start = {7, -5} }
  expect(g.iterations):equals(1)
  expect(g.x):near({-1/3, 3/2}, 1e-14)
  expect(g.sigma2):near(1/6, 1e-13)                          -- ‖R‖² = 1/6, 3 - 2 = 1
  expect(g.covariance):near({{7/18, -1/6}, {-1/6, 1/12}}, 1e-13)  -- (JᵀJ)⁻¹ = [14 -6; -6 3]/6
  expect(g.std):near({math.sqrt(7/18), math.sqrt(1/12)}, 1e-13)
  expect(g.correlation(1, 2)):near(-1/6/math.sqrt(7/18/12), 1e-13)
  expect(g.loss):near(1/12, 1e-14)
  expect(g.rank):equals(2)
  expect(g.approximation):near(g.hessian, 0)
  expect(g.verdict:find "R is linear there" ~= nil):is_true()
end)

test("exact data: quadratic, and no invented standard deviation", function()
  local g = gauss_newton { R = residuals(0), x = {a, b}, start = {1, 0.3} }
  expect(g.x):near({2, 0.7}, 1e-14)
  expect(g.verdict:find "residuals vanish" ~= nil):is_true()
  expect(tostring(g):find "no noise to estimate" ~= nil):is_true()
  expect(tostring(g):find "±" == nil):is_true()
end)

test("with noise: stationary, hessian = JᵀJ + Σ Rᵢ∇²Rᵢ, rate of the neglected term", function()
  local R = residuals(10)
  local g = gauss_newton { R = R, x = {a, b}, start = {1, 0.3}, tol = 1e-13 }
  local at = { a = g.x[1], b = g.x[2] }
  local half = 0
  for i = 1, 8 do half = half + R[i]^2/2 end
  expect(evaluate(gradient(half, {a, b}), at)):near({0, 0}, 1e-12)
  expect(g.hessian):near(evaluate(hessian(half, {a, b}), at), 1e-12)
  expect(g.predicted_rate > 1e-3):is_true()
  expect(g.rate):near(g.predicted_rate, 0.1*g.predicted_rate)
  expect(g.verdict:find "neglected term" ~= nil):is_true()
  expect(#g.residuals):equals(#g.iterates)
  expect(g.iterates[1]):near({1, 0.3}, 0)
end)

test("large residuals: the rate is the spectral radius of (JᵀJ)⁻¹S, with and without damping", function()
  local g = gauss_newton { R = { exp(a) - 2, exp(2*a) - 4, exp(3*a) + 1 }, start = {1} }
  expect(g.rate):near(g.predicted_rate, 1e-3)
  expect(g.order):near(1, 0.01)
  -- R = (a² + 1, a): J = (2a, 1), JᵀJ = 1 and S = 2 at a = 0: full steps have the factor -2, α = ½ has 1 -
  -- 3/2.
  local full = gauss_newton { R = { a^2 + 1, a }, start = {0.1}, alpha = 1, max = 40 }
  expect(full.converged):equals(false)
  local half = gauss_newton { R = { a^2 + 1, a }, start = {0.1}, alpha = 0.5 }
  expect(half.predicted_rate):near(0.5, 1e-6)
  expect(half.rate):near(0.5, 1e-3)
  expect(half.x):near(0, 1e-9)
end)

test("Rosenbrock's valley: safeguarded, pure and Levenberg–Marquardt steps reach (1, 1)", function()
  local R = { 10*(b - a^2), 1 - a }
  local g = gauss_newton { R = R, x = {a, b}, start = {-1.2, 1} }
  expect(g.x):near({1, 1}, 1e-12)
  for k = 2, #g.residuals do expect(g.residuals[k] < g.residuals[k - 1]):is_true() end
  local pure = gauss_newton { R = R, x = {a, b}, start = {-1.2, 1}, alpha = 1 }
  expect(pure.iterates[2]):near({1, -3.84}, 1e-12)           -- the textbook's first full step
  expect(pure.iterations):equals(2)
  local lm = gauss_newton { R = R, x = {a, b}, start = {-1.2, 1}, method = "levenberg-marquardt" }
  expect(lm.x):near({1, 1}, 1e-9)
  expect(lm.lambdas[1] > 0):is_true()
end)

test("Levenberg–Marquardt helps where halving is not enough, and it is said", function()
  -- in a narrow curved valley
  local g = gauss_newton { R = { 300*(b - a^2), 1 - a }, x = {a, b}, start = {-1.2, 1.44}, max = 2000 }
  expect(g.x):near({1, 1}, 1e-9)
  expect(tostring(g):find "Levenberg–Marquardt steps" ~= nil):is_true()
end)

test("a rank-deficient J is named by the combination of unknowns", function()
  local R = {}
  for i = 1, 5 do R[i] = (a + b)*i - math.sqrt(i) end
  local g = gauss_newton { R = R, x = {a, b}, start = {1, 0.3} }
  expect(g.rank):equals(1)
  expect(g.converged):is_true()
  expect(g.undetermined):near({{1}, {-1}}, 1e-9)
  expect(g.covariance):equals(nil)
  expect(g.verdict:find("Only the combination a + b is.", 1, true) ~= nil):is_true()
  expect(g.x[1] - g.x[2]):near(0.7, 1e-12)                    -- the shortest step does not move along (1, -1)
  local scaled = gauss_newton { R = { 2*a - 3*b - 1, 4*a - 6*b - 5, 1 }, start = {0, 0} }
  expect(scaled.verdict:find("Only the combination a - 1.5 b is.", 1, true) ~= nil):is_true()
  local idle = gauss_newton { R = { a - 1, a - 2 }, x = {a, c}, start = {0, 0} }
  expect(idle.verdict:find("c does not change R here", 1, true) ~= nil):is_true()
  -- fewer residuals than unknowns: a rank report
  local few = gauss_newton { R = { a + b - 1 }, start = {0, 0} }
  expect(few.x):near({0.5, 0.5}, 1e-14)
  expect(few.rank):equals(1)
end)

test("Lua functions, equations and parameters", function()
  local g = gauss_newton { R = function(p) return p - 1, p - 2 end, start = {1} }
  expect(g.x):near(1.5, 1e-14)
  local numbers = gauss_newton { R = function(p) if p < 0 then
    return p, p end return p - 1, p - 2 end, start = {1} }
  expect(numbers.x):near(1.5, 1e-7)
  local m = param("m", 2)
  expect(gauss_newton { R = { a ~ m, a ~ 2*m }, x = a, start = {0}, params = { m = 4 } }.x):near(6, 1e-14)
end)

test("errors say what to write instead", function()
  local function fails(options, message) expect(function() gauss_newton(options) end):fails(message) end
  fails({ x = a, start = {1} }, "give R = { … }")
  fails({ R = { a - 1 } }, "the start is missing")
  fails({ R = { a - 1 }, start = {1, 2} }, "start has 2 numbers for 1 unknown (a)")
  fails({ R = { a == 1 }, start = {1} }, "write ~")
  fails({ R = { a - 1 }, start = {0/0} }, "is nan; it must be a finite number")
  fails({ R = { log(a) }, start = {-1} }, "R is not finite at the start; equation 1: 'log(a)'")
  fails({ R = { a - 1 }, start = {1}, tol = 0 }, "tol = 0")
  fails({ R = { a - 1 }, start = {1}, alpha = 2 }, "0 < alpha ≤ 1")
  fails({ R = { a - 1 }, start = {1}, method = "newton" }, "unknown method 'newton'")
  fails({ R = { a - 1 }, start = {1}, max = 0 }, "max = 0")
  fails({ R = { a - b }, x = {a}, start = {1} }, "'b' is not among the unknowns x")
end)
