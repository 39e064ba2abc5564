-- A run stops where its equations cannot be solved any more, says what vanished, and is right up to there.

local function has(text, part)
  if not text:find(part, 1, true) then error(text .. "\n  does not contain\n" .. part, 2) end
  expect(text:find(part, 1, true) ~= nil):is_true()
end

local function pendulum(form)
  local p = problems.pendulum_velocity
  local at = p:start()
  return p(), p():reduce(form, { at = form == "minimal" and at or nil }), at
end

test("form minimal of the pendulum stops where the coordinate it divided by is zero", function()
  local sys, low, at = pendulum "minimal"
  local x, y, u, v = vars "x y u v"
  has(tostring(low), "valid where   x ≠ 0")
  has(tostring(low:trace()), "valid where x ≠ 0")
  expect(low.domain[1]):equals(x)
  local here = low:init { fix = { x = 0.6, y = -0.8, v = 0.3 } }
  has(here:ledger(), "valid while x ≠ 0 (here 0.6)")
  local other = sys:reduce "project":integrate { start = at, to = 1, rtol = 1e-10, atol = 1e-10 }
  local down = 0.5919595                                   -- x(down) = 0: quarter of the period, from 90°
  for _, method in ipairs { "auto", "radau", "dop853" } do
    local sol = low:integrate { start = at, to = 10, rtol = 1e-9, atol = 1e-9,
      method = method ~= "auto" and method or nil }
    has(sol.status, "stopped at t = 0.59196: x = 0 there, and (5) cannot be solved for u, as form \"minimal\" did")
    has(sol.status, "reduce \"dummy\" and reduce \"project\" divide by no expression and pass this point")
    expect(sol.t[#sol.t]):near(down, 1e-5)            -- it comes nearer until steps are 1e-6 of the interval
    for _, when in ipairs { 0.2, 0.4, 0.55, 0.59 } do
      expect(sol(x, when)):near(other(x, when), 1e-7)
      expect(sol(v, when)):near(other(v, when), 1e-6)
    end
  end
  local fixed = low:integrate { start = at, to = 10, dt = 0.01, method = rk.gauss(3) }
  has(fixed.status, "stopped at t = 0.592: x = 0 there")
  expect(fixed.t[#fixed.t]):near(0.59, 1e-12)
  expect(fixed:final(x)):near(other(x, 0.59), 1e-7)
  local multistep = low:integrate { start = at, to = 10, dt = 0.001, method = bdf(4) }
  has(multistep.status, "stopped at t = 0.592: x = 0 there")
end)

test("where nothing vanishes the same form goes to the end", function()
  local sys, low = pendulum "minimal"
  local x, y, u, v = vars "x y u v"
  -- thrown upwards, on the right of the centre for 0.3 s
  local fix = { [x] = 0.6, [y] = 0.8, [v] = 3 }
  local at = sys:init { fix = fix }
  local low = sys:reduce("minimal", { at = at })
  local sol = low:integrate { start = at, to = 0.1, rtol = 1e-9, atol = 1e-9 }
  local other = sys:reduce "project":integrate { start = at, to = 0.1, rtol = 1e-9, atol = 1e-9 }
  expect(sol.status):equals "finished"
  expect(sol:final(y)):near(other:final(y), 1e-7)
end)

test("a start where a form divides by zero is refused", function()
  local sys, low = pendulum "minimal"
  local x, y, v = vars "x y v"
  expect(function() low:init { fix = { [x] = 0, [y] = -1, [v] = 0 } } end):fails
    "x = 0 at the start, and (5) cannot be solved for u, as form \"minimal\" did"
end)

test("equations that lose their unknown stop every form, with the exact time", function()
  local x, y = vars "x y"
  local runs = { { rtol = 1e-10, atol = 1e-10 }, { method = "radau", rtol = 1e-8, atol = 1e-8 },
    { method = rk.rk4, dt = 0.03 },
    { method = rk.gauss(2), dt = 0.03 }, { method = bdf(2), dt = 0.01 } }
  local function stops(sys, start, to, text, exact)
    for _, form in ipairs { "", "ode" } do
      for _, run in ipairs(runs) do
        run.start, run.to = start, to
        local sol = (form == "" and sys or sys:reduce(form)):integrate(run)
        has(sol.status, "stopped at t = ")
        has(sol.status, text)
        expect(sol.t[#sol.t] < to):is_true()
        if exact and not run.dt then expect(sol:final(x)):near(exact(sol.t[#sol.t]), 1e-4) end
      end
    end
  end
  -- x = √(1 - 2t)
  stops(dae { x*der(x) ~ -1 }, { x = 1 }, 1, "(1) no longer determines x′")
  stops(dae { (t - 1)*der(x) ~ 2*x }, { x = 1 }, 2, "t - 1 = 0 there, and (1) no longer determines x′",
    function(s) return (s - 1)^2 end)
end)

test("a mass matrix that becomes singular", function()
  local x, y = vars "x y"                                  -- det = x - y², x′ = -1/(…): reached at t < 1
  local sys = dae { der(x) + y*der(y) ~ -1, y*der(x) + x*der(y) ~ 0 }
  local sol = sys:reduce "ode":integrate { start = { x = 1, y = 0.5 }, to = 3, rtol = 1e-8, atol = 1e-8 }
  has(sol.status, "= 0 there, and (1), (2) no longer determine x′, y′")
end)

test("an algebraic variable at a fold: z² = x", function()
  local x, z = vars "x z"                                  -- x = 1 - t, z = √(1 - t)
  local sys = dae { der(x) ~ -1, 0 ~ z^2 - x }
  for _, run in ipairs { { rtol = 1e-8, atol = 1e-8 }, { method = "radau" },
    { method = rk.radau(2), dt = 0.03 } } do
    run.start, run.to = sys:init { fix = { x = 1 }, guess = { z = 1 } }, 2
    local sol = sys:integrate(run)
    has(sol.status, "stopped at t = ")
    has(sol.status, "z")
    expect(sol:final(z)):near(math.sqrt(math.max(0, 1 - sol.t[#sol.t])), 1e-3)
  end
end)

test("a sweep lists the runs that stop", function()
  local x, a = var "x", param("a", 1)
  local s = sweep(dae { x*der(x) ~ -a }, { start = { x = 1 }, to = 1, params = { a = { 0.2, 0.3, 0.9 } },
    rtol = 1e-7 })
  expect(#s.failures):equals(1)                            -- x = √(1 - 2 a t) ends at t = 1/(2a)
  expect(s:final(x)[1]):near(math.sqrt(0.6), 1e-5)
end)

test("z³ = y: the inverse function stops where it has a vertical slope", function()
  local y, z = vars "y z"                                  -- y = 1 - t, z = ∛(1 - t)
  local sys = dae { der(y) ~ -1, 0 ~ z^3 - y }
  local at = sys:init { fix = { y = 1 }, guess = { z = 1 } }
  for _, method in ipairs { "auto", "radau" } do
    local sol = sys:integrate { start = at, to = 3, method = method ~= "auto" and method or nil }
    has(sol.status, "(2) no longer determines z")
    expect(sol.t[#sol.t]):near(1, 1e-4)
    expect(sol(z, 0.9)):near(0.1^(1/3), 1e-5)
  end
end)

test("an explicit method follows the branch of z to the fold and no further", function()
  local x, z = vars "x_f z_f"
  local sys = dae { der(x) ~ -1, 0 ~ z^3 - z - x }
  local at = sys:init { fix = { x_f = 1 }, guess = { z_f = 1.3 } }
  local fold = 1 + 2/(3*math.sqrt(3))  -- 3 z² = 1
  for _, method in ipairs { "auto", "dopri5", "verner98", "tsit5" } do
    local sol = sys:integrate { start = at, to = 3, method = method }
    has(sol.status, "no longer determines z_f")
    expect(sol.t[#sol.t]):near(fold, 1e-6)
    local before = sol(z, 1.2)  -- the root of z³ - z = -1/5 on the upper branch
    expect(before^3 - before):near(-0.2, 1e-6)
    expect(before > 0.58):is_true()
  end
end)

test("every method names the fold it stops at, near or far", function()
  local function note(sys, fix, guess, to, rtol, method, part)
    local sol = sys:integrate { start = sys:init { fix = fix, guess = guess }, to = to, rtol = rtol,
      atol = rtol, method = method }
    if not sol.status:find(part, 1, true) then error(method .. ", " .. rtol .. ": " .. sol.status, 2) end
    expect(sol.status:find(part, 1, true) ~= nil):is_true()
    return sol.t[#sol.t]
  end
  local x, z = vars "x z"
  local parabola = dae { der(x) ~ -z, 0 ~ z^2 - x }                             -- z = 1 - t/2, fold at t = 2
  for _, method in ipairs { "dopri5", "verner98", "tsit5", "dop853", "radau", "bdf", "rodas" } do
    for _, rtol in ipairs { 1e-4, 1e-6, 1e-9 } do
      expect(note(parabola, { x = 1 }, { z = 1 }, 5, rtol, method, "no longer determines z")):near(2, 0.05)
    end
  end
end)

test("an impasse is no place to creep along or to jump over: x′² + x² = 1 has x′ = 0 at t = π/2", function()
  local x = var "x"
  local sys = dae { der(x)^2 + x^2 ~ 1 }
  -- dopri5 crept on for 10⁷ steps, radau went on at x′ < 0
  for _, method in ipairs { "dopri5", "verner98", "radau", "bdf" } do
    for _, rtol in ipairs { 1e-4, 1e-6, 1e-9 } do
      local at = sys:init { fix = { x = 0 }, guess = { [x.dot] = 1 } }
      local sol = sys:integrate { start = at, to = 3, rtol = rtol, atol = rtol, method = method }
      expect(sol.status:find("no longer determines x′", 1, true) ~= nil):is_true()
      expect(sol.t[#sol.t]):near(math.pi/2, 0.01)
      expect(sol:stats().steps < 5000):is_true()
      expect(sol:final(x)):near(1, 1e-3)
    end
  end
end)
