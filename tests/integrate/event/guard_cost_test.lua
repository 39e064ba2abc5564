-- What it costs to look for singularities of a mechanism along its solution, and for what nearly happens.

test("guards that turn far above zero cost no evaluation", function()
  local problem = problems.squeezer
  local low, start = problem.model:reduce(), problem:start()
  for _, rtol in ipairs { 1e-3, 1e-4, 1e-6, 1e-8 } do
    local stats = low:integrate { start = start, to = problem.to, rtol = rtol, atol = rtol,
      method = "verner87" }:stats()
    expect(stats.evaluations <= 13*(stats.steps + stats.rejected)):is_true()    -- 13 stages
  end
end)

-- sin t, which turns at 1 within a long step: an event is 0.3 … 0.003 below that, and as much above.
test("an event that a condition reaches within a step is found however little it goes beyond", function()
  local x, v = var "x", var "v"
  local model = dae { der(x) ~ v, der(v) ~ -x }
  for _, method in ipairs { "verner87", "dop853", "dopri5", "tsit5", "radau", "bdf", "rodas" } do
    for _, beyond in ipairs { 0.3, 0.1, 0.03, 0.01, 0.003, -0.003, -0.03, -0.3 } do
      for _, factor in ipairs { 1, 1e6 } do
        local count = 0
        local function add() count = count + 1 end
        model:integrate { start = { x = 0, v = 1 }, to = 18, rtol = 1e-4, atol = 1e-5, method = method,
          events = { { when = factor*(x - (1 - beyond)), call = add } } }
        local wanted = beyond > 0 and 6 or 0
        expect(("%s %g %d"):format(method, beyond, count)):equals(("%s %g %d"):format(method, beyond, wanted))
      end
    end
  end
end)

-- Each look at such a border repeated a part of the step: ten times the evaluations of the steps alone.
test("a border that an unknown stays away from costs less than a step", function()
  local x, v, z = vars "x v z"
  for _, smooth in ipairs { true, false } do
    local function stats(method, rtol, rate)
      local model = dae { der(x) ~ rate, der(v) ~ -x - z/10,
        0 ~ z + (smooth and z^3/3 or sinh(z)/2) - sin(x) - 3/10*v }
      local start = model:init { fix = { [x] = 1, [v] = 0 }, guess = { [z] = 0.7 } }
      return model:integrate { start = start, to = 60, method = method, rtol = rtol, atol = rtol }:stats()
    end
    for _, method in ipairs { "dop853", "verner87", "dopri5", "radau", "rodas", "bdf" } do
      for _, rtol in ipairs { 1e-4, 1e-7 } do
        local plain, border = stats(method, rtol, v), stats(method, rtol, ifelse(lt(z, 5), v, v + 1))
        expect(border.steps):equals(plain.steps)
        local look = (border.evaluations - plain.evaluations)/border.steps
        expect(look <= (smooth and 8 or 24)):is_true()
      end
    end
  end
end)

-- Fast at first, so that steps creep: a solution may stay on a border for that, but not at a moment.
test("a border of time alone costs no evaluation", function()
  local x = var "x"
  local model = dae { der(x) ~ -x + 1e5*sin(1e6*t)*exp(-1e4*t) + ifelse(lt(t, 5), 2, 0) }
  local sol = model:integrate { start = { x = 3 }, to = 10, rtol = 1e-6, atol = 1e-6, method = "dop853" }
  local stats = sol:stats()
  expect(stats.evaluations <= 13*(stats.steps + stats.rejected)):is_true()    -- 12 stages
  expect(sol(x, 5)):near(2 + (3 - 2 + 0.1)*math.exp(-5), 2e-5)
end)

test("divisors are watched in the branches in force: one that vanishes in another branch, and in this one", function()
  local x, z = vars "x z"
  for _, method in ipairs { "auto", "radau", "bdf", "dopri5", "rodas" } do
    for _, rtol in ipairs { 1e-3, 1e-5, 1e-8 } do
      local function run(before, after)
        return dae { der(x) ~ z, 0 ~ z^2 - ifelse(lt(t, 1), before, after) }:integrate {
          start = { x = 0, z = 2 }, to = 3, method = method, rtol = rtol }
      end
      local other = run((t - 2)^2, 1)
      expect(other.status):equals "finished"
      expect(other(x, 3)):near(3.5, 1e-2*rtol^0.5)
      expect(run(4, (t - 2)^2).status):matches "stopped at t = 2: z = 0 there"
    end
  end
end)

-- The slope of a circle as a rail has it, in the place of a corner 1 + v².
test("equations with the root of a difference of squares run", function()
  local x, y = vars "x y"
  local slope = (0.98 - x)/sqrt(0.0036 - (x - 0.98)^2)
  local sol = dae { der(x) ~ -x/100, der(y) ~ 1/(1 + slope^2)^1.5 }:integrate {
    start = { x = 1, y = 0 }, to = 1, rtol = 1e-8 }
  expect(sol.status):equals "finished"
  local function f(s) return (1 - ((math.exp(-s/100) - 0.98)/0.06)^2)^1.5 end
  local sum = 0
  for k = 0, 99 do sum = sum + (f(k/100) + 4*f((k + 0.5)/100) + f((k + 1)/100))/600 end
  expect(sol(y, 1)):near(sum, 1e-8)
end)

-- Every iteration of a search on the solution is a step of the method: before, 13 to 20 of them a root.
test("a root takes a few partial steps", function()
  local x, v, w, u = vars "x v w u"
  local model = dae { der(x) ~ v, der(v) ~ -x, der(w) ~ u, der(u) ~ -7.3*w }
  local function run(method, rtol, events)
    return model:integrate { start = { x = 1, v = 0, w = 0.5, u = 1 }, to = 30, method = method, rtol = rtol,
      events = events }
  end
  for method, stages in pairs { dop853 = 12, dopri5 = 6, tsit5 = 6, verner87 = 13 } do
    for _, rtol in ipairs { 1e-4, 1e-6, 1e-8 } do
      local sol = run(method, rtol, { { when = x - 0.3 }, { when = x + w - 0.4 } })
      expect(#sol.events):equals(24)
      local more = sol:stats().evaluations - run(method, rtol):stats().evaluations
      expect(more/24/stages < 9):is_true()
      for _, event in ipairs(sol.events) do                     -- to rounding, of verner87 10⁻¹³
        local at = event.which == 1 and x - 0.3 or x + w - 0.4
        expect(sol(at, event.t)):near(0, 1e-12)
      end
    end
  end
end)

-- The condition is flat in the middle of the step, where its error was estimated, and steep at the sample.
test("a coarse sample beside a root of a narrow dip is not believed", function()
  local w, u = vars "w u"
  local model = dae { der(w) ~ u, der(u) ~ -7.452461043*w }
  local rotated = dae { der(w) ~ u, der(u) ~ -7.452461043*w, der(var "x") ~ var "v", der(var "v") ~ -var "x" }
  local start = { w = -0.0829966867184, u = 2.7205008983 }
  local events = { { when = 0.42043309 - exp(-290.2888907*(u + 1.25261323)^2) } }
  local exact = model:integrate { start = start, to = 12, method = "dop853", rtol = 1e-11, events = events }
  start.x, start.v = -0.284162314004, 0.958776188326
  local sol = rotated:integrate { start = start, to = 12, method = "dop853", rtol = 7.4458469469271e-06,
    events = events }
  expect(#sol.events):equals(#exact.events)
end)
