-- Sliding along borders that contain algebraic unknowns: relays that compare what a sensor shows, with the
-- sensor as equations of index 1. Where the relay is fast enough x follows its target to the tolerance.
local families = dofile "tests/families.lua"
local x, y, z, w = vars "x y z w"
local methods = families.with("auto", "verner87", "dopri5")

local function random_between(low, high) return low + (high - low)*math.random() end

--- Adds a run to a list if it has stopped, or is off by more than allowed.
local function note_if_wrong(wrong, name, sol, off, allowed)
  if sol.status ~= "finished" or not (off <= allowed) then
    wrong[#wrong + 1] = ("%s: %s, off by %.3g"):format(name, sol.status, off)
  end
end

--- A sensor of the deviation: its equations, in which z has the sign of `deviation`, and the border.
local sensors = {
  linear = function(deviation) return { 0 ~ z - random_between(0.3, 3)*deviation }, z end,
  cubic = function(deviation) return { 0 ~ z + random_between(0.1, 2)*z^3 - deviation }, z end,
  ["of two equations"] = function(deviation)
    return { 0 ~ z + 0.3*w - deviation, 0 ~ w - 0.4*z - 0.1*sin(z) }, z + w/2
  end,
  exponential = function(deviation) return { 0 ~ exp(z) - 1 - deviation/4 }, z end,
}

test("relays of random speed follow their targets", function()
  math.randomseed(20261130)
  local wrong = {}
  for _, name in ipairs { "linear", "cubic", "of two equations", "exponential" } do
    local sensor = sensors[name]
    for seed = 1, 4 do
      local amplitude, frequency = random_between(0.2, 0.6), random_between(0.5, 2)
      local target = amplitude*sin(frequency*t)
      local fast = amplitude*frequency*random_between(1.2, 3)
      local equations, border = sensor(x - target)
      equations[#equations + 1] = der(x) ~ ifelse(lt(border, 0), fast, -fast)
      equations[#equations + 1] = der(y) ~ x
      local sys = dae(equations)
      for _, method in ipairs(methods) do
        local sol = sys:integrate { start = { [x] = 0.3, [y] = 0 }, to = 6, rtol = 1e-6, atol = 1e-8,
          method = method, max_steps = 20000 }
        local worst = 0
        for i = 300, 600 do
          local at = i/100
          worst = math.max(worst, math.abs(sol(x, at) - amplitude*math.sin(frequency*at)))
        end
        note_if_wrong(wrong, name .. " " .. seed .. ", " .. method, sol, worst, 2e-5)
      end
    end
  end
  expect(table.concat(wrong, "\n")):equals ""
end)

test("a relay that becomes too slow lets go, and catches up", function()
  -- x′ = ∓1 against the target sin(t²/4): |t/2 cos(t²/4)| passes 1 at t = 2.36…
  local sys = dae { der(x) ~ ifelse(lt(z, 0), 1, -1), 0 ~ z + z^3/3 - (x - sin(t^2/4)) }
  local exact = dae { der(x) ~ ifelse(lt(x - sin(t^2/4), 0), 1, -1) }:integrate { start = { [x] = 0 }, to = 6,
    rtol = 1e-9, atol = 1e-9 }
  for _, method in ipairs(methods) do
    local sol = sys:integrate { start = { [x] = 0 }, to = 6, rtol = 1e-7, atol = 1e-7, method = method }
    expect(sol.status):equals "finished"
    for i = 1, 60 do expect(sol(x, i/10)):near(exact(x, i/10), 1e-5) end
  end
end)

test("in implicit equations, too", function()
  for _, method in ipairs { "auto", "radau", "bdf" } do
    local sys = dae { der(x) + der(x)^3/5 ~ ifelse(lt(z, 0), 2, -2), 0 ~ z + z^3/3 - (x - sin(t)/2) }
    local sol = sys:integrate { start = { [x] = 0.5 }, to = 6, rtol = 1e-7, atol = 1e-7, method = method }
    expect(sol.status):equals "finished"
    for i = 20, 60 do expect(sol(x, i/10)):near(math.sin(i/10)/2, 1e-5) end
  end
end)

test("targets that are samples or functions of Lua: by implicit methods, which auto takes then", function()
  local u = input "u"
  local ts, us = {}, {}
  for i = 0, 60 do ts[i + 1], us[i + 1] = i/10, math.sin(i/10)/2 end
  local sys = dae { der(x) ~ ifelse(lt(x - u, 0), 2, -2) }
  for _, method in ipairs { "auto", "radau", "rodas", "bdf" } do
    local by_samples = sys:integrate { start = { [x] = 1 }, to = 6, method = method,
      inputs = { [u] = { t = ts, u = us } }, rtol = 1e-6, atol = 1e-8 }
    local by_function = sys:integrate { start = { [x] = 1 }, to = 6, method = method,
      inputs = { [u] = function(time) return math.sin(time)/2 end }, rtol = 1e-6, atol = 1e-8 }
    expect(by_samples.status):equals "finished"
    expect(by_function.status):equals "finished"
    for i = 10, 60 do
      expect(by_samples(x, i/10)):near(us[i + 1], 1e-6)
      expect(by_function(x, i/10)):near(us[i + 1], 2e-6)
    end
  end
end)

test("random models: borders of z = h(x), a function that grows, are those of x", function()
  math.randomseed(30112026)
  local function u() return 2*math.random() - 1 end
  local wrong = {}
  for model = 1, 12 do
    local n = math.random(1, 3)
    local states, shown = var("x", n), var("z", n)
    local start, of_x, of_z = {}, {}, {}
    for i = 1, n do
      local s = u()/2 + u()*sin((1 + math.random())*t)
      for k = 1, n do s = s + u()*states[k] end
      local b, rest = u(), 2*u()*sin((1 + math.random())*t + u()) - states[i]*(0.2 + math.random())
      local function branches(border)
        return ifelse(lt(border, 0), sqrt(1.5 + sin(states[1])), b - states[i])
      end
      of_x[i] = der(states[i]) ~ branches(s) + rest
      of_z[i] = der(states[i]) ~ branches(shown[i]) + rest
      of_z[n + i] = 0 ~ shown[i] + (1 + math.random())*shown[i]^3 + 0.3*sin(shown[i]) - s
      start[i] = u()
    end
    local exact = dae(of_x):integrate { to = 8, start = { [states] = start }, method = "radau", rtol = 1e-10,
      atol = 1e-10 }
    local sys = dae(of_z)
    local from = sys:init { fix = { [states] = start } }
    for _, method in ipairs { "auto", "dop853", "dopri5", "radau", "rodas", "bdf" } do
      local sol = sys:integrate { to = 8, start = from, method = method, rtol = 1e-6, atol = 1e-6 }
      for i = 1, n do
        local off = math.abs(sol:final(states[i]) - exact:final(states[i]))
        note_if_wrong(wrong, model .. ", " .. method, sol, off, 1e-4)
      end
    end
  end
  expect(table.concat(wrong, "\n")):equals ""
end)

test("an explicit method that cannot slide says which one can", function()
  local u = input "u"
  local sol = dae { der(x) ~ ifelse(lt(x - u, 0), 2, -2) }:integrate { start = { [x] = 1 }, to = 6,
    method = "dopri5", inputs = { [u] = function(time) return math.sin(time)/2 end } }
  expect(sol.status):matches 'chattering: .*the slope of the input u is unknown. Take method = "radau"'
end)
