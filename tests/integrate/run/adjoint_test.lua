-- The discrete adjoint is the exact derivative of the computed numbers, and so are forward sensitivities by
-- the same fixed steps: two roads to the same value, to rounding. Central differences of the runs themselves
-- are a third, to 1e-8.
local x, y, z = vars "x y z"
local k, c = params "k=1/2 c=2"
local cases = {
  { "explicit ODE", dae { der(x) ~ y, der(y) ~ c*(1 - x^2)*y - k*x + sin(t) }, x*y + der(x)^2*c },
  { "index 1", dae { der(x) ~ -k*z, der(y) ~ z - y*c, 0 ~ z^3 + z - x*c - y }, x*y + z*k + der(y) },
  { "implicit", dae { der(x)*(1 + x^2) + der(y) ~ -k*x, der(y) - c*der(x)*y ~ cos(t) - y },
    x*y + der(x)^2*c },
}
local wanted = { k, c, x, y }

for _, case in ipairs(cases) do
  local name, model, cost = table.unpack(case)
  local function start(parameters) return model:init { fix = { x = 2, y = 0.3 },
    guess = { z = name == "index 1" and 1 or nil }, params = parameters } end
  test("adjoint, forward and differences agree: " .. name, function()
    for _, method in ipairs { rk.euler, rk.rk4, rk.dopri5, rk.gauss(2), rk.radau(3), rk.sdirk2, rk.trapezoid,
      rk.lobatto("IIIC", 3) } do
      local function run(more)
        more = more or {}
        more.start, more.to, more.dt, more.method = start(more.params), 1, 0.05, method
        return model:integrate(more)
      end
      local adjoint = run():gradient(cost, wanted)
      expect(adjoint):near(run { sensitivities = wanted }:gradient(cost), 1e-13)
      local h = 1e-6
      local slope = (run { params = { k = 0.5 + h } }(cost, 1) - run { params = { k = 0.5 - h } }(cost,
        1))/(2*h)
      expect(adjoint[1]):near(slope, 1e-8)
    end
  end)
  test("adjoint of chosen steps: " .. name, function()
    for _, method in ipairs { "auto", "dopri5", "radau", "gauss" } do
      local function run(more)
        more.start, more.to, more.method, more.rtol, more.atol = start(), 1, method, 1e-9, 1e-11
        return model:integrate(more)
      end
      expect(run {}:gradient(cost, wanted)):near(run { sensitivities = wanted }:gradient(cost), 1e-6)
    end
  end)
end

test("exact: J = x(2)² of x' = -kx has dJ/dk = -4 e⁻², dJ/dx₀ = 2 e⁻²", function()
  local sol = dae { der(x) ~ -k*x }:integrate { start = { x = 1 }, to = 2, rtol = 1e-11 }
  expect(sol:gradient(x^2, { k, x })):near({ -4*math.exp(-2), 2*math.exp(-2) }, 1e-9)
  expect(sol:gradient(x^2)):near({ -4*math.exp(-2) }, 1e-9)                       -- all parameters
  expect(sol:gradient(x^2, { "k" })):near({ -4*math.exp(-2) }, 1e-9)
end)

test("an integral cost is one more state; a hundred parameters cost one sweep", function()
  local n = 100
  local a, J, force = {}, var "J", 0
  for i = 1, n do
    a[i] = param("a" .. i, 1/i)
    force = force + a[i]*sin(i*t)
  end
  local sol = dae { der(x) ~ force, der(J) ~ x }:integrate { start = { x = 0, J = 0 }, to = 1, rtol = 1e-9 }
  local g = sol:gradient(J, a)                             -- J = Σ aᵢ (1/i - sin(i)/i²)
  for _, i in ipairs { 1, 7, 50 } do expect(g[i]):near(1/i - math.sin(i)/i^2, 1e-8) end
end)

test("reduced forms of the pendulum; the start moves with the length", function()
  local p = problems.pendulum
  local at = p:start()
  local px = var "x"
  for form, direct in pairs { project = false, acc = false, ggl = true } do
    local low = p():reduce(form)
    local function run(more)
      more.start, more.to, more.rtol, more.direct = at, 1, direct and 1e-7 or 1e-9, direct or nil
      return low:integrate(more)
    end
    expect(run {}:gradient(px, { "g", "L" })):near(run { sensitivities = { "g", "L" } }:gradient(px), 1e-5)
  end
end)

test("what the adjoint cannot follow is said", function()
  local decay = dae { der(x) ~ -k*x }
  local function run(more)
    more.start, more.to = { x = 1 }, 2
    return decay:integrate(more)
  end
  expect(function() run { method = "bdf" }:gradient(x, { k }) end):fails "needs a Runge–Kutta method"
  expect(function() run { events = { { when = x - 0.5, reset = { x = 1 } } } }:gradient(x,
    { k }) end):fails "reset at t = 1.38629"
  expect(function() run {}:gradient(x, { y }) end):fails "y"
  expect(function() run {}:gradient(vec { x, x }, { k }) end):fails "one number"
  expect(function() run { max_steps = 2, rtol = 1e-12 }:gradient(x,
    { k }) end):fails "has not reached its end"
  local switched = dae { der(x) ~ ifelse(lt(x, 0.5), -k, -c) }:integrate { start = { x = 1 }, to = 1 }
  expect(function() switched:gradient(x, { k }) end):fails "x′ jumps at t = 0.25"
  local kink = dae { der(x) ~ -k*abs(x) - 1 }                     -- x′ itself is continuous
  expect(kink:integrate { start = { x = 1 }, to = 3, rtol = 1e-9 }:gradient(x, { k })[1])
    :near(kink:integrate { start = { x = 1 }, to = 3, rtol = 1e-9, sensitivities = { k } }:gradient(x)[1],
      1e-7)
  local stopped = run { events = { { when = x - 0.5, action = "stop" } } }
  expect(stopped:gradient(x, { k })[1]):near(-math.log(2), 1e-6)   -- -t x at the fixed time t = 2 ln 2
end)
