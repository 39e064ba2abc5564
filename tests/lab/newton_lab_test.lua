-- The Newton laboratory: what converges, how fast, and whether the reason given is the true one.
local x, y, z = vars "x y z"
local exam = { x*y - 2, x^4/4 + y^3/3 - 1 }

test("the exam's equations: quadratic, and the table of fields", function()
  local k = newton { r = exam, x = {x, y}, start = {-1, -1}, alpha = 1, tol = 1e-12 }
  expect(k.converged):is_true()
  expect(k.iterates[1]):near({-1, -1}, 0)
  expect(#k.iterates):equals(k.iterations + 1)
  expect(#k.residuals):equals(#k.iterates)
  expect(k.residuals[1]):near(math.sqrt(1 + (1/4 - 1/3 - 1)^2), 1e-15)
  -- The first step by hand: J = [-1 -1; -1 1], r = (-1, -13/12): Δx = (-25/24, 1/24).
  expect(k.iterates[2]):near({-1 - 25/24, -1 + 1/24}, 1e-15)
  -- y = 2/x in the second equation: a second road to the root.
  local s = newton { r = x^4/4 + 8/(3*x^3) - 1, start = {-1.6} }
  expect(k.x):near({ s.x, 2/s.x }, 1e-14)
  expect(k.order):near(2, 0.15)
  expect(k.verdict:find "quadratically" ~= nil):is_true()
end)

test("quadratic contraction has the constant ½|r″/r′|", function()
  local k = newton { r = x^2 - 2, start = {2} }
  expect(k.rate):near(1 / (2*math.sqrt(2)), 1e-3)           -- e₊ = e²/(2x), x → √2
  expect(k.order):near(2, 0.05)              -- the first pairs still feel e³
  expect(k.predicted_rate):near(0, 1e-15)
end)

test("damping converges linearly with 1 - α", function()
  for _, alpha in ipairs { 0.3, 0.5, 0.9 } do
    local k = newton { r = exam, x = {x, y}, start = {-1, -1}, alpha = alpha }
    expect(k.converged):is_true()
    expect(k.rate):near(1 - alpha, 1e-3)
    expect(k.predicted_rate):near(1 - alpha, 1e-12)
    expect(k.order):near(1, 0.01)
    expect(k.verdict:find("α = " .. alpha .. " < 1", 1, true) ~= nil):is_true()
  end
end)

test("a frozen or given Jacobian converges at the spectral radius of I - M⁻¹J", function()
  local k = newton { r = x^2 - 2, start = {1.6}, jacobian = "frozen" }
  expect(k.predicted_rate):near(1 - math.sqrt(2)/1.6, 1e-12)
  expect(k.rate):near(k.predicted_rate, 1e-3)
  expect(k.verdict:find "frozen" ~= nil):is_true()
  local given = newton { r = {x^2 - 2, y - x}, x = {x, y}, start = {1, 1}, jacobian = {{4, 0}, {-1, 1}} }
  expect(given.predicted_rate):near(1 - math.sqrt(2)/2, 1e-12)
  expect(given.rate):near(1 - math.sqrt(2)/2, 1e-3)
  local exact = newton { r = exam, x = {x, y}, start = {-1, -1}, jacobian = jacobian(vec(exam), {x, y}) }
  expect(exact.x):near(newton { r = exam, x = {x, y}, start = {-1, -1} }.x, 0)
  local coarse = newton { r = x^2 - 2, start = {2}, jacobian = "finite difference", h = 0.1 }
  local slope = ((math.sqrt(2)*1.1)^2 - 2) / (0.1*math.sqrt(2))
  expect(coarse.rate):near(1 - 2*math.sqrt(2)/slope, 1e-3)
  expect(newton { r = x^2 - 2, start = {2}, jacobian = "finite difference" }.order):near(2, 0.1)
end)

test("a root of multiplicity m converges with 1 - 1/m and is called singular", function()
  for m, q in pairs { [2] = 1/2, [3] = 2/3, [4] = 3/4 } do
    local k = newton { r = (x - 1)^m, start = {2} }
    expect(k.rate):near(q, 1e-3)
    expect(k.verdict:find("m = " .. m, 1, true) ~= nil):is_true()
  end
  local k = newton { r = {x^2 + y^2 - 2, x + y - 2}, start = {3, 0} }  -- a line that touches a circle
  expect(k.rate):near(0.5, 1e-3)
  expect(k.null_vector):near({1, -1}, 1e-6)
  expect(k.verdict:find("(x, y) ∝ (1, -1)", 1, true) ~= nil):is_true()
end)

test("order 3 where the second derivative vanishes; one step where r is linear", function()
  expect(newton { r = sin(x), start = {0.5} }.order):near(3, 0.05)
  local k = newton { r = {2*x + y - 1, x - y}, start = {5, 0.5} }
  expect(k.iterations):equals(1)
  expect(k.verdict:find "one step" ~= nil):is_true()
end)

test("absent convergence is explained", function()
  local cycle = newton { r = x^3 - 2*x + 2, start = {0} }
  expect(cycle.status):equals "cycle"
  expect(cycle.verdict:find "period 2: %(0%) → %(1%)" ~= nil):is_true()
  expect(newton { r = atan(x), start = {2} }.status):equals "diverged"
  expect(newton { r = atan(x), start = {2}, alpha = "line search" }.x):near(0, 1e-12)
  local singular = newton { r = {x*y, x + y - 1}, start = {0.5, 0.5} }
  expect(singular.status):equals "singular Jacobian"
  expect(singular.null_vector):near({1, -1}, 1e-12)
  expect(singular.verdict:find("(x, y) ∝ (1, -1)", 1, true) ~= nil):is_true()
  local outside = newton { r = log(x), start = {3} }
  expect(outside.status):equals "undefined"
  expect(outside.verdict:find("'log(x)' has no finite value at x = -0.295837", 1, true) ~= nil):is_true()
  expect(newton { r = log(x), start = {3}, alpha = "line search" }.x):near(1, 1e-12)
  expect(newton { r = exp(-x), start = {0} }.status):equals "no root"
  expect(newton { r = exp(-x), start = {0} }.converged):equals(false)
  local minimum = newton { r = x^2 + 1, start = {0.5}, alpha = "line search" }
  expect(minimum.status):equals "line search stalled"
  expect(minimum.verdict:find "minimum of ‖r‖ that is not a root" ~= nil):is_true()
  local slow = newton { r = x^2 - 2, start = {1}, alpha = 0.1, max = 20 }
  expect(slow.verdict:find "raise max" ~= nil):is_true()
  expect(newton { r = x^2 - 2, start = {1}, alpha = 0.1, max = 400 }.converged):is_true()
end)

test("badly scaled unknowns do not make a regular root singular", function()
  local k = newton { r = {1e8*x^2 - 2e8, 1e-9*y - 1e-9*x^2}, start = {1, 1}, tol = 1e-6 }
  expect(k.x):near({math.sqrt(2), 2}, 1e-9)
  expect(k.verdict:find "quadratically" ~= nil):is_true()
end)

test("r, x and start in every form", function()
  local root = newton { r = x^2 - 2, start = {1} }.x
  expect(newton { r = { x^2 ~ 2 }, start = {1} }.x):near(root, 0)
  expect(newton { r = x^2 ~ 2, x = x, start = 1 }.x):near(root, 0)
  expect(newton { r = x^2 - 2, x = "x", start = { x = 1 } }.x):near(root, 0)
  expect(newton { r = x^2 - 2, start = { [x] = 1 } }.x):near(root, 0)
  local a = param("a", 2)
  expect(newton { r = x^2 - a, start = {1} }.x):near(root, 0)
  expect(newton { r = x^2 - a, start = {1}, params = { a = 9 } }.x):near(3, 1e-15)
  local q = var("q", 2)
  expect(newton { r = { q[1] - 1, q[1]*q[2] - 4 }, x = q, start = {2, 2} }.x):near({1, 4}, 1e-14)
  expect(newton { r = vec{ x - 1, x*y - 4 }, x = {x, y}, start = vec{2, 2} }.x):near({1, 4}, 1e-14)
end)

test("Lua functions are traced, or called with numbers", function()
  local k = newton { r = function(a, b) return a*b - 2, a^4/4 + b^3/3 - 1 end, start = {-1, -1} }
  expect(k.x):near(newton { r = exam, x = {x, y}, start = {-1, -1} }.x, 0)
  local column = newton { r = function(v) return vec{ v[1]*v[2] - 2, v[1] - v[2] } end, start = {1, 1} }
  expect(column.x):near({math.sqrt(2), math.sqrt(2)}, 1e-15)
  local numbers = newton { r = function(v) if v > 0 then
    return v^2 - 2 end return -1 end, start = {1}, jacobian = "finite difference" }
  expect(numbers.x):near(math.sqrt(2), 1e-12)
  expect(fn(function(a, b) return a*b, a + b end)(2, 3)):near({6, 5}, 0)
  expect(fn({x, y}, function(a, b) return a/b end)(1, 2)):near(0.5, 0)
end)

test("basins of z³ = 1", function()
  local k = newton { r = { x^3 - 3*x*y^2 - 1, 3*x^2*y - y^3 }, x = {x, y}, start = {1, 1} }
  local b = k:basins { x = {-1.5, 1.5}, [y] = {-1.5, 1.5}, n = 24 }
  expect(#b.roots):equals(3)
  expect(b.roots[1]):near({-0.5, -math.sqrt(3)/2}, 1e-6)
  expect(b.roots[2]):near({-0.5, math.sqrt(3)/2}, 1e-6)
  expect(b.roots[3]):near({1, 0}, 1e-6)
  local count = {0, 0, 0}
  for j = 1, 24 do for i = 1, 24 do
    local n = b.root(j, i)
    if n > 0 then count[n // 1 | 0] = count[n // 1 | 0] + 1 end
    -- Conjugate starts lead to conjugate roots: the picture is symmetric about the axis y = 0.
    local mirrored = b.root(25 - j, i)
    expect(mirrored):equals(n == 1 and 2.0 or n == 2 and 1.0 or n)
  end end
  expect(count[1]):equals(count[2])
  expect(count[3] > 150):is_true()
  expect(tostring(plot(b)):find "3 series" ~= nil):is_true()
  expect(function() newton { r = x^2 - 2, start = {1} }:basins() end):fails "two unknowns"
  expect(function() k:basins { x = {1, -1} } end):fails "low < high"
  expect(function() k:basins { n = 1 } end):fails "between 2 and 2000"
end)

test("errors say what to write instead", function()
  local nan = 0/0
  local function fails(options, message) expect(function() newton(options) end):fails(message) end
  fails({}, "the equations are missing; give r = { … }")
  fails({ r = x^2 - 2 }, "the start is missing")
  fails({ r = x^2 - 2, start = {1, 2} }, "start has 2 numbers for 1 unknown (x)")
  fails({ r = {x, y, x + y}, start = {1, 2} }, "r has 3 equations for 2 unknowns (x, y)")
  fails({ r = {x, y, x + y}, start = {1, 2} }, "gauss_newton{ R = … }")
  fails({ r = x - y, x = {x}, start = {1} }, "'y' is not among the unknowns x and has no value")
  fails({ r = { x^2 == 2 }, x = {x}, start = {1} },
    "entry 1 of r must be an expression or an equation, not a boolean: write ~")
  fails({ r = "abc", start = {1} }, "'abc' is not a number")
  fails({ r = {}, start = {1} }, "r is empty")
  fails({ r = x^2 - 2, start = {nan} }, "start[1], the start of 'x', is nan")
  fails({ r = x^2 - 2, start = { x = 1/0 } }, "'x' is inf")
  fails({ r = x^2 - 2, start = { y = 1 } }, "unknown symbol 'y'")
  fails({ r = {x - 1, y - 1}, start = { y = 1 } }, "start has no value for 'x'")
  fails({ r = x^2 - 2, start = {1}, x = {x, x} }, "x lists 'x' twice")
  fails({ r = x^2 - 2, start = {1}, alpha = 0 }, "alpha = 0 never moves")
  fails({ r = x^2 - 2, start = {1}, alpha = 1.5 }, "0 < alpha ≤ 1")
  fails({ r = x^2 - 2, start = {1}, alpha = nan }, "0 < alpha ≤ 1")
  fails({ r = x^2 - 2, start = {1}, alpha = "search" }, "unknown alpha 'search'")
  fails({ r = x^2 - 2, start = {1}, tol = 0 }, "tol = 0; it must be a positive number")
  fails({ r = x^2 - 2, start = {1}, tol = nan }, "positive number")
  fails({ r = x^2 - 2, start = {1}, max = 0 }, "max = 0")
  fails({ r = x^2 - 2, start = {1}, jacobian = "exat" }, "Did you mean 'exact'?")
  fails({ r = x^2 - 2, start = {1}, jacobian = {{1, 2}} }, "jacobian is 1×2; for 1 unknown it must be 1×1")
  fails({ r = x^2 - 2, start = {1}, h = 2 }, "h is the relative step")
  fails({ r = x^2 - 2, start = {1}, params = { x = 1 } }, "it is an unknown")
  fails({ r = x^2 - 2, start = {1}, speed = 1 }, "unknown option 'speed'")
  fails({ r = function(v) if v > 0 then return v end end, start = {1} }, "jacobian = \"finite difference\"")
  fails({ r = function() end, start = {1} }, "returned nothing")
  expect(function() newton(3) end):fails "expected a table"
  expect(function() fn(function(v) return v > 0 end) end):fails "ifelse, not if"
end)

test("the printed table has no rounding noise", function()
  local text = tostring(newton { r = exam, x = {x, y}, start = {-1, -1} })
  expect(text:find("≈ 0", 1, true) ~= nil):is_true()
  expect(text:find "e%-1[5-9]" == nil):is_true()
  expect(text:find("-1.60237526295667  -1.24814707655287", 1, true) ~= nil):is_true()
end)
