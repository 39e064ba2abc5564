-- Form "project": the constraints are kept to rounding by any method, and the solution converges at the
-- method's order.

local p = var("p", 3)
local m, g, L = params "m=1 g=9.81 L=1"
local ball = lagrange { q = p, T = m/2*p.dot.T*p.dot, V = m*g*p[3], C = { (p.T*p - L^2)/2 } }
local start = ball:init { fix = { [p] = {1, 0, 0}, [p.dot] = {0, 1, 0} } }
-- the 3-D pendulum at t = 2
local reference = { 0.579251157202, 0.588246716733, -0.564299474688, 0.426250340232, 2.159236710359,
  2.688412760251 }

local function run(form, method, dt)
  return ball:reduce(form):integrate { start = start, to = 2, method = method, dt = dt }
end

local function error_of(sol)
  local x, worst = sol(vstack(p, p.dot), 2), 0
  for i = 1, 6 do worst = math.max(worst, math.abs(x[i] - reference[i])) end
  return worst
end

test("projected: |C| and |C′| stay at rounding, with a poor explicit method too", function()
  local sol = run("project", rk.heun, 0.05)
  local C, v = sol((p.T*p - L^2)/2), sol(p.T*p.dot)
  for i = 1, #sol.t do
    expect(math.abs(C[i]) < 1e-13):equals(true)   -- a few ulp of terms of size 1
    expect(math.abs(v[i]) < 1e-13):equals(true)
  end
end)

test("projection does not lower the order: rk4 gains a factor 16 by halving the step", function()
  local coarse, fine = error_of(run("project", rk.rk4, 0.02)), error_of(run("project", rk.rk4, 0.01))
  expect(math.log(coarse/fine, 2) > 3.8):equals(true)
end)

test("reduce() without a name is the projected form; all forms agree with the reference", function()
  expect(ball:reduce().form):equals("project")
  for _, form in ipairs { "acc", "ode", "project" } do
    expect(error_of(run(form, rk.gauss(3), 0.01)) < 1e-11):equals(true)
  end
end)

test("multipliers and energy along a projected solution", function()
  local sol = run("project", rk.gauss(2), 0.01)
  local a = run("acc", rk.gauss(2), 0.01)
  -- two forms, each of order 4 at dt = 0.01
  expect(sol(ball.multipliers, 1)):near(a(ball.multipliers, 1), 1e-6)
  expect(sol(ball.energy, 2)):near(sol(ball.energy, 0), 1e-6)
end)
