-- What the default takes on small models, beside the methods it could have taken.

local x, y, z = vars "x y z"

local function distance(sol, exact, names)
  local worst = 1e-16
  for _, name in ipairs(names) do worst = math.max(worst, math.abs(sol:final(name) - exact:final(name))) end
  return worst
end

test("few digits of what is not stiff: the pair of order 8 is closer and makes fewer steps", function()
  local models = {
    { dae { der(x) ~ 2*(x - x*y), der(y) ~ x*y - y }, { x = 1, y = 3 } },
    { dae { der(x) ~ y, der(y) ~ x^3/6 - x + 2*sin(2.78535*t) }, { x = 0, y = 0 } },
    { dae { der(x) ~ y, der(y) ~ 2*(1 - x^2)*y - x }, { x = 2, y = 0 } },
    { dae { der(x) ~ 1 + x^2*y - 4*x, der(y) ~ 3*x - x^2*y }, { x = 1.5, y = 3 } },
    { dae { der(x) ~ y, der(y) ~ -0.2*y + x - x^3 + 0.3*cos(t) }, { x = 1, y = 0 } },
  }
  for _, rtol in ipairs { 1e-2, 1e-3, 3e-4 } do
    local digits, steps = 0, 0
    for _, case in ipairs(models) do
      local model, start = case[1], case[2]
      local function run(method, tolerance)
        return model:integrate { start = start, to = 20, rtol = tolerance, atol = tolerance, method = method }
      end
      local exact, sol, fifth = run("verner98", 1e-12), run(nil, rtol), run("tsit5", rtol)
      expect(sol:stats().method):equals "verner87"
      local off = distance(sol, exact, { "x", "y" })
      expect(off < 100*rtol):is_true()
      digits = digits + math.log(distance(fifth, exact, { "x", "y" })/off, 10)
      steps = steps + math.log(fifth:stats().steps/sol:stats().steps)
    end
    expect(digits/#models > 0.25):is_true()
    expect(steps/#models > math.log(1.25)):is_true()
  end
end)

test("stiffness that comes later is noticed at every tolerance", function()
  -- an explosion: x is used up, y rises from 1 to 1.6 and the rate with it to e⁷
  local rate = x*exp(20*(1 - 1/y))
  local model = dae { der(x) ~ -rate, der(y) ~ 0.6*rate }
  for _, rtol in ipairs { 1e-2, 3e-3, 1e-3, 1e-4 } do
    local sol = model:integrate { start = { x = 1, y = 1 }, to = 5, rtol = rtol, atol = rtol }
    expect(sol:stats().method):matches "^verner87, then rodas5p"
    expect(sol:stats().steps < 130):is_true()                   -- 3518 where no change was made
    expect(sol:final(y)):near(1.6, 10*rtol)
  end
end)

test("small stiff models and few digits: one matrix a step, whether or not t occurs", function()
  local function case(equations, start, to, names) return { dae(equations), start, to, names } end
  local models = {
    case({ der(x) ~ -1e3*(x - sin(t)) + cos(t) }, { x = 1 }, 10, { "x" }),
    case({ der(x) ~ -1e5*(x - sin(t)) + cos(t) }, { x = 1 }, 10, { "x" }),
    case({ der(x) ~ -1e3*(x - y^2) - y^2, der(y) ~ x - y - y^2 }, { x = 1, y = 1 }, 5, { "x", "y" }),
    case({ der(x) ~ y, der(y) ~ 1e3*(1 - x^2)*y - x + sin(t) }, { x = 2, y = 0 }, 100, { "x" }),
    case({ der(x) ~ -500*(x - z), 0 ~ z + z^3 - sin(t)*x - y, der(y) ~ -y*(1 - z) + 0.2 },
      { x = 1, y = 1 }, 10, { "x", "y", "z" }),
  }
  for _, rtol in ipairs { 1e-3, 1e-4, 3e-5 } do
    local work = 0
    for _, c in ipairs(models) do
      local model, start, to, names = c[1], c[2], c[3], c[4]
      local function run(method, tolerance)
        return model:integrate { start = start, to = to, rtol = tolerance, atol = tolerance, method = method }
      end
      local sol, exact, radau = run(nil, rtol), run("radau", 1e-11), run("radau", rtol)
      expect(sol:stats().method):equals "rodas5p"
      expect(distance(sol, exact, names) < 10*rtol):is_true()
      -- stages of the one are real, of the other half as many pairs
      work = work + math.log(sol:stats().evaluations/radau:stats().evaluations)
    end
    expect(work/#models < math.log(rtol > 5e-5 and 1.2 or 1.6)):is_true()
  end
  for _, c in ipairs(models) do
    expect(c[1]:integrate { start = c[2], to = c[3], rtol = 1e-6 }:stats().method):equals "radau"
  end
end)

test("modes that swing and die out: stiff at few digits, too, where their remains are errors of the steps", function()
  -- λ = -10 ± 100i; of y and z nothing is left behind t = 2
  local u, v, w = vars "u v w"
  local model = dae { der(x) ~ -10*x + 100*y, der(y) ~ -100*x - 10*y, der(z) ~ -4*z, der(u) ~ -u,
    der(v) ~ -v/2, der(w) ~ -w/10 }
  local start = { x = 1, y = 1, z = 1, u = 1, v = 1, w = 1 }
  for _, rtol in ipairs { 1e-3, 1e-4, 1e-5 } do
    local sol = model:integrate { start = start, to = 20, rtol = rtol, atol = rtol }
    expect(sol:stats().method):matches "^verner87, then "
    expect(sol:stats().steps < 130):is_true()                     -- 397, 406, 170 unnoticed
    expect(sol:final(w)):near(math.exp(-2), 10*rtol)
    expect(sol:final(v)):near(math.exp(-10), 10*rtol)
  end
  -- an oscillation that lasts stays explicit, beside a slow state that is much larger
  local beside = dae { der(x) ~ 100*y, der(y) ~ -100*x, der(z) ~ 1000 }
  for _, rtol in ipairs { 1e-3, 1e-5, 1e-8 } do
    local sol = beside:integrate { start = { x = 1, y = 0, z = 0 }, to = 10, rtol = rtol, atol = rtol }
    expect(sol:stats().method):matches "^verner87$"
    expect(sol:final(x)):near(math.cos(1000), 300*rtol)
  end
end)

test("a step of each method counts as it costs: van der Pol with μ = 5 is explicit, with μ = 1000 implicit",
  function()
  local function run(mu, rtol, method)
    return dae { der(x) ~ y, der(y) ~ mu*(1 - x^2)*y - x }:integrate { start = { x = 2, y = 0 }, to = 5*mu,
      rtol = rtol, atol = rtol, method = method }
  end
  for _, rtol in ipairs { 1e-6, 1e-8, 1e-10 } do
    local sol, exact = run(5, rtol), run(5, 1e-12, "radau")
    expect(sol:stats().jacobians):equals(0)
    expect(distance(sol, exact, { "x", "y" }) < 300*rtol):is_true()
    expect(run(1000, rtol):stats().method):matches "^radau"
  end
end)

test("radau behind jumps: errors of starting values are not multiplied by the next step", function()
  -- van der Pol: 741, 398 and 401 steps while every step began with the whole polynomial of the last
  local mu = 1000
  local relaxation = dae { der(x) ~ y, der(y) ~ mu*(1 - x^2)*y - x }
  local function run(rtol)
    return relaxation:integrate { start = { x = 2, y = 0 }, to = 5000, rtol = rtol, atol = rtol,
      method = "radau" }
  end
  local exact = run(1e-10)
  for _, rtol in ipairs { 3e-3, 1e-3, 1e-4 } do
    local sol = run(rtol)
    expect(sol:stats().steps < 340):is_true()
    expect(math.abs(sol:final(x) - exact:final(x)) < 30*rtol):is_true()
  end
  -- D6 of STIFF DETEST: a product of a species that is small and one that hardly moves; 76 steps, 73 rejected
  local p, q = -x + 1e8*z*(1 - x), -10*y + 3e7*z*(1 - y)
  local reaction = dae { der(x) ~ p, der(y) ~ q, der(z) ~ -p - q }
  local function react(rtol)
    return reaction:integrate { start = { x = 1, y = 0, z = 0 }, to = 1, rtol = rtol, atol = 1e-3*rtol,
      method = "radau" }
  end
  local sol, close = react(1e-6), react(1e-11)
  expect(sol:stats().steps + sol:stats().rejected < 75):is_true()
  expect(distance(sol, close, { "x", "y", "z" }) < 1e-6):is_true()
end)

test("few steps that stability limits are left to an implicit method as well: a flame that burns at rest", function()
  local flame = dae { der(x) ~ x^2 - x^3 }
  for _, rtol in ipairs { 1e-3, 1e-4, 3e-5 } do
    local sol = flame:integrate { start = { x = 0.01 }, to = 400, rtol = rtol, atol = rtol }
    expect(sol:stats().steps < 45):is_true()                      -- 60 of verner87 alone
    expect(sol:final(x)):near(1, rtol)
    -- 1/x + log(1/x - 1) falls as fast as t rises
    local near = sol(x, 95)
    expect(1/near + math.log(1/near - 1)):near(100 + math.log(99) - 95, 1e3*rtol)
  end
end)
