-- Index 1, z that equations are not linear in: what it costs in explicit stages, and how exact it is.
local x, v, z, T = vars "x v z T"
local stages = { tsit5 = 7, dop853 = 12, verner87 = 13, verner98 = 16 }

-- z + z² = s is z = (√(1 + 4 s) - 1)/2: the same model with and without z.
local function root(s) return (sqrt(1 + 4*s) - 1)/2 end
local function drive(z) return { der(x) ~ v, der(v) ~ -x - z*v/5 + sin(t/2) } end
local s = 1 + x^2 + v^2
local implicit = drive(z)
implicit[#implicit + 1] = 0 ~ z + z^2 - s
local with_z, without = dae(implicit), dae(drive(root(s)))
local start = { x = 1, v = 0 }
local full = with_z:init { fix = start, guess = { z = 1 } }

test("z is as good as its formula, at every tolerance", function()
  local exact = without:integrate { start = start, to = 20, rtol = 1e-13, atol = 1e-13, method = "radau" }
  for method in pairs(stages) do
    for _, rtol in ipairs { 1e-4, 1e-7, 1e-10, 1e-13 } do
      local run = { start = full, to = 20, rtol = rtol, atol = rtol, method = method }
      local sol = with_z:integrate(run)
      run.start = start
      local same = without:integrate(run)
      local error, formula = math.abs(sol:final(x) - exact:final(x)), math.abs(same:final(x) - exact:final(x))
      expect(error <= 3*formula + 1e-12):is_true()
      local at = sol:final(z)
      expect(at + at^2):near(1 + sol:final(x)^2 + sol:final(v)^2, 1e-13)      -- mesh points, to rounding
    end
  end
end)

test("a stage takes few evaluations: none that only confirms the last", function()
  for method, count in pairs(stages) do
    local stats = with_z:integrate({ start = full, to = 20, rtol = 1e-6, method = method }):stats()
    local tried = count*(stats.steps + stats.rejected)
    expect(stats.evaluations <= 2.6*tried):is_true()
    expect(stats.evaluations >= tried*(count - 1)/count):is_true()
  end
end)

-- Of a current of 10⁻⁶ beside a voltage that changes by 10⁵ in a unit of time.
test("a small z counts by its own size", function()
  local i, u, w = vars "i u w"
  local Is, UT = 1e-12, 0.05
  local circuit = dae { der(u) ~ 1e5*cos(1e5*t)/2 - 1e3*u, der(w) ~ 1e6*i - w,
    0 ~ i - Is*(exp((u - 1e4*i)/UT) - 1) }
  local at = circuit:init { fix = { u = 0.5, w = 0 }, guess = { i = 1e-8 } }
  for _, method in ipairs { "tsit5", "verner87" } do
    local sol = circuit:integrate { start = at, to = 5e-5, rtol = 1e-6, atol = 1e-9, method = method }
    for _, time in ipairs { 1e-5, 2e-5, 3e-5, 4e-5, 5e-5 } do
      local now = sol(i, time)
      expect(now / (Is*(math.exp((sol(u, time) - 1e4*now)/UT) - 1))):near(1, 1e-9)
    end
  end
end)

test("small models whose stages would iterate are integrated by implicit methods", function()
  local c, r = var "c", var "r"
  local reactor = dae { der(c) ~ (1 - c)/10 - r, der(T) ~ (1 - T)/10 + r/2 - (T - 0.8)/20,
    0 ~ r - c*exp(-2/T)/(2 + 2*r) }
  for _, case in ipairs { { 1e-3, "rodas5p" }, { 1e-6, "radau" }, { 1e-10, "radau" } } do
    local sol = reactor:integrate { start = { c = 0.5, T = 1 }, to = 200, rtol = case[1] }
    expect(sol:stats().method):equals(case[2])
  end
  -- linear in z, or many states beside it: explicit stages are cheap
  local linear = drive(z)
  linear[#linear + 1] = 0 ~ z*(1 + x^2) - s
  expect(dae(linear):integrate({ start = start, to = 20 }):stats().method):equals "verner87"
  local q, p = var("q", 20), var("p", 20)
  local many, at = { 0 ~ z + z^3 - q[20] }, {}
  for k = 1, 20 do
    many[#many + 1] = der(q[k]) ~ p[k]
    many[#many + 1] = der(p[k]) ~ (k < 20 and q[k + 1] or z) - 2*q[k] + (k > 1 and q[k - 1] or 0)
    at["q" .. k], at["p" .. k] = math.sin(k), 0
  end
  expect(dae(many):integrate({ start = at, to = 10 }):stats().method):equals "verner87"
end)

-- |∂F/∂z| = 2 √(x² + d²) has a minimum inside a step: 0 for d = 0 alone.
test("branches that come near each other are told from those that meet", function()
  for _, method in ipairs { "auto", "tsit5", "verner87", "radau" } do
    for _, d in ipairs { 0, 1e-3, 0.01, 0.1, 0.5 } do
      for _, x0 in ipairs { -1, -1.37 } do
        local sol = dae { der(x) ~ 1, 0 ~ z^2 - x^2 - d^2 }:integrate { to = 2, rtol = 1e-7, method = method,
          start = { x = x0, z = (x0^2 + d^2)^0.5 } }
        expect((sol.status:gsub("^stopped.*", "stopped"))):equals(d == 0 and "stopped" or "finished")
        if d > 0 then expect(sol:final(z)):near(((2 + x0)^2 + d^2)^0.5, 1e-6) end
      end
    end
  end
end)
