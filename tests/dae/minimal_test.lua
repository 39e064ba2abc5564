-- Form "minimal" of quadratic constraints: the root of the start, told in trace(), and a run that stops where
-- it ends.
local x, y = vars "x y"
local g = param("g", 9.81)
local function has(text, part)
  if not text:find(part, 1, true) then error(text .. "\n  does not contain\n" .. part, 2) end
  expect(text:find(part, 1, true) ~= nil):is_true()
end
local pendulum = lagrange { q = {x, y}, T = (x.dot^2 + y.dot^2)/2, V = g*y,
  C = { x^2 + y^2 - param("L", 1)^2 } }
local function start(xs, ys, rate) return pendulum:init { fix = { x = xs, [x.dot] = rate },
  guess = { y = ys } } end

test("without a start the root is open", function()
  expect(function() pendulum:reduce "minimal" end):fails
    "the constraint C  0 = x² + y² - L² is quadratic in x, y, and which root holds depends on where the solution is. Name a start: reduce(\"minimal\", { at = sys:init{ fix = … } })"
end)

test("the pendulum swings as in form project; the branch is that of the start", function()
  local project = pendulum:reduce "project"
  for _, ys in ipairs { -0.8, 0.8 } do
    local at = start(0.6, ys, 0.4)
    local low = pendulum:reduce("minimal", { at = at })
    has(tostring(low:trace()), "C = 0 is quadratic in y:  y = " .. (ys < 0 and "-" or "")
      .. "√(L² - x²),  the root of the start (y = "
      .. ys .. "),  valid while L² - x² > 0")
    has(tostring(low), "valid where   √(L² - x²) ≠ 0")
    expect(low:index()):equals(0)
    expect(low:dof()):equals(2)
    local to = ys < 0 and 3 or 0.2
    local a = low:integrate { start = at, to = to, rtol = 1e-10, atol = 1e-10 }
    local b = project:integrate { start = at, to = to, rtol = 1e-10, atol = 1e-10 }
    expect(a.status):equals "finished"
    for _, e in ipairs { x, y, x.dot, y.dot, pendulum.multipliers[1] } do
      expect(a:final(e)):near(b:final(e), 1e-7) end
  end
end)

test("where the other coordinate is larger, it is the one that stays", function()
  local low = pendulum:reduce("minimal", { at = pendulum:init { fix = { y = -0.1, [y.dot] = 0 },
    guess = { x = -1 } } })
  has(tostring(low:trace()), "C = 0 is quadratic in x:  x = -√(L² - y²)")
end)

test("a swing beyond the horizontal stops there and names the forms that go on", function()
  local at = start(0.6, -0.8, 4)
  local low = pendulum:reduce("minimal", { at = at })
  local project = pendulum:reduce "project"
  local up = project:integrate { start = at, to = 1, rtol = 1e-11, atol = 1e-11,
    events = { { when = y, action = "stop" } } }
  local horizontal = up.t[#up.t]
  for _, run in ipairs { { rtol = 1e-5 }, { rtol = 1e-9 }, { rtol = 1e-7, method = "radau" },
    { rtol = 1e-7, method = "bdf" },
    { rtol = 1e-8, times = { 0, 0.1, 0.2, 0.3, 0.4 } }, { dt = 0.01, method = rk.gauss(2) },
      { dt = 0.01, method = rk.rk4 }, { dt = 0.002, method = bdf(3) } } do
    run.start, run.to = at, 2
    local sol = low:integrate(run)
    has(sol.status, "√(L² - x²) ")
    has(sol.status, "the two roots of C for y meet, of which form \"minimal\" took one")
    has(sol.status, "reduce \"dummy\" and reduce \"project\" divide by no expression and pass this point")
    expect(tonumber(sol.status:match "stopped at t = ([%d.]+)")):near(horizontal, run.dt and 2*run.dt or 1e-4)
    local last = sol.t[#sol.t]
    expect(last <= horizontal + 1e-4):is_true()
    expect(sol:final(x)):near(up(x, math.min(last, horizontal)), 1e-4)
  end
end)

test("starts of the other root, and of neither, are refused", function()
  local low = pendulum:reduce("minimal", { at = start(0.6, -0.8, 0) })
  expect(function() low:integrate { start = start(0.6, 0.8, 0), to = 1 } end):fails
    "the start has y = 0.8, but form \"minimal\" was made where y = -√(L² - x²) = -0.8; make the form at this start"
  expect(function() low:init { fix = { x = 0.6, y = 0.8, [x.dot] = 0 } } end):fails "conflict: y = 0.8"
end)

test("a start where the roots meet", function()
  local z = var "z"
  local sys = dae { der(x) ~ z, der(y) ~ 1, 0 ~ y^2 - sin(x) }
  expect(function() sys:reduce("minimal", { at = sys:init { fix = { y = 0 }, guess = { x = 0 } } }) end):fails
    "at this start both roots of the constraint (3)  0 = y² - sin(x) coincide for each of y, so it can be solved for none of them there"
end)

test("a cubic constraint is refused by name", function()
  local z = var "z"
  local sys = dae { der(x) ~ y*z, der(y) ~ -x*z, 0 ~ x^3 + y^3 - 1 }
  expect(function() sys:reduce("minimal", { at = sys:init { fix = { x = 0.5 },
    guess = { y = 0.9 } } }) end):fails
    "is linear or quadratic in none of x, y, so no coordinate can be written explicitly"
end)

test("first order, and a coefficient that is no number", function()
  local u, v, lam = vars "u v lam"
  local a = param("a", 4)
  -- an ellipse
  local sys = dae { der(x) ~ u, der(y) ~ v, der(u) ~ -2*lam*x*a, der(v) ~ -2*lam*y - g, 0 ~ a*x^2 + y^2 - 1 }
  local at = sys:init { fix = { x = 0.2, u = 0.3 }, guess = { y = -0.9 } }
  local low = sys:reduce("minimal", { at = at })
  local sol = low:integrate { start = at, to = 2, rtol = 1e-10, atol = 1e-10 }
  local other = sys:reduce():integrate { start = at, to = 2, rtol = 1e-10, atol = 1e-10 }
  expect(sol.status):equals "finished"
  expect(sol:final(x)):near(other:final(x), 1e-7)
  expect(sol:final(lam)):near(other:final(lam), 1e-6)
end)

test("two links: one root inside the other", function()
  local q = var("q", 4)
  local two = lagrange { q = q, T = q.dot.T*q.dot/2, V = g*(q[2] + q[4]),
    C = { (q[1]^2 + q[2]^2 - 1)/2, ((q[3] - q[1])^2 + (q[4] - q[2])^2 - 1)/2 } }
  local at = two:init { fix = { [q[1]] = 0.1, [q[3]] = 0.3, [q[1].dot] = 0, [q[3].dot] = 0 },
    guess = { [q] = { 0.1, -1, 0.3, -2 } } }
  local sol = two:reduce("minimal", { at = at }):integrate { start = at, to = 1, rtol = 1e-10, atol = 1e-10 }
  local other = two:reduce():integrate { start = at, to = 1, rtol = 1e-10, atol = 1e-10 }
  for i = 1, 4 do expect(sol:final(q[i])):near(other:final(q[i]), 1e-7) end
end)
