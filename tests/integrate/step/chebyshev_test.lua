-- Runge-Kutta-Chebyshev: order, digits, grids, and when it is chosen.

local function grid(N)
  local u, equations, start = var("u", N*N), {}, {}
  local function at(i, j) return i >= 1 and i <= N and j >= 1 and j <= N and u[i + (j - 1)*N] or 0 end
  for j = 1, N do
    for i = 1, N do
      local k = i + (j - 1)*N
      local neighbours = at(i - 1, j) + at(i + 1, j) + at(i, j - 1) + at(i, j + 1)
      equations[k] = der(u[k]) ~ (N + 1)^2*(neighbours - 4*u[k])
      start[k] = math.sin(math.pi*i/(N + 1))*math.sin(math.pi*j/(N + 1))
    end
  end
  local rate = 8*(N + 1)^2*math.sin(math.pi/(2*(N + 1)))^2
  return dae(equations), { [u] = start }, u, rate
end

test("a mode of the heat equation decays as it should, in few evaluations", function()
  local N = 12
  local model, start, u, rate = grid(N)
  local middle = u[N//2 + N*(N//2)]
  for _, rtol in ipairs { 1e-3, 1e-5 } do
    local sol = model:integrate { start = start, to = 0.3, rtol = rtol, method = "rkc" }
    expect(sol.status):equals "finished"
    local exact = sol(middle, 0)*math.exp(-0.3*rate)
    expect(sol(middle, 0.3)):near(exact, 100*rtol*exact)
    expect(sol(middle, 0.15)):near(sol(middle, 0)*math.exp(-0.15*rate), 100*rtol)
    expect(sol:stats().jacobians):equals(0)
  end
  local few = model:integrate { start = start, to = 0.3, rtol = 1e-3, method = "rkc" }:stats()
  -- stability asks a method of six stages for 0.3·8·13²/4 · 6 = 600
  expect(few.evaluations < 500):is_true()
end)

test("order 2, also where t occurs and for algebraic variables", function()
  local x, z = vars "x z"
  local model = dae { der(x) ~ -50*(x - cos(t)) - z, 0 ~ z - sin(t) }
  local exact = model:integrate { start = { x = 1 }, to = 2, rtol = 1e-12, atol = 1e-12, method = "radau" }
  local errors = {}
  for k, rtol in ipairs { 1e-4, 1e-6, 1e-8 } do
    local sol = model:integrate { start = { x = 1 }, to = 2, rtol = rtol, atol = rtol, method = "rkc" }
    errors[k] = math.abs(sol(x, 2) - exact(x, 2))
    expect(errors[k] < 20*rtol^(2/3)):is_true()
  end
  expect(errors[3] < errors[1]/50):is_true()
end)

test("the default takes it for diffusion on a grid and few digits, and for nothing else", function()
  local model, start = grid(24)
  local function method(rtol) return model:integrate { start = start, to = 0.5, rtol = rtol }:stats() end
  expect(method(1e-4).method):equals "rkc"
  expect(method(1e-4).why):matches "diffusion"
  expect(method(1e-6).method):equals "dop853"
  local line, u0, u = {}, {}, var("u", 300)
  for i = 1, 300 do
    line[i] = der(u[i]) ~ 301^2*((i > 1 and u[i - 1] or 0) - 2*u[i] + (i < 300 and u[i + 1] or 0))
    u0[i] = 1
  end
  expect(dae(line):integrate { start = { [u] = u0 }, to = 1, rtol = 1e-4 }:stats().method):equals "rodas4"
end)

test("what it cannot treat, it refuses; events and sensitivities work", function()
  local x, y = vars "x y"
  local high = dae { der(x) ~ y, 0 ~ x - sin(t) }
  expect(function()
    high:integrate { start = { x = 0 }, to = 1, method = "rkc", direct = true }
  end):fails "rkc"
  local fall = dae { der(x) ~ -100*(x - 2 + t) }
  local sol = fall:integrate { start = { x = 2 }, to = 5, method = "rkc", rtol = 1e-6,
    events = { { when = x - 1, action = "stop" } } }
  expect(sol.status):equals "event"
  expect(sol(x, sol.t[#sol.t])):near(1, 1e-5)
end)
