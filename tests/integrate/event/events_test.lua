-- Events on constrained models, at awkward places, and dense output between the steps of every adaptive
-- method.
local families = dofile "tests/families.lua"
local x, y, v, w, z = vars "x y v w z"
local names = {}                                           -- those for tight tolerances
for _, method in ipairs(methods()) do
  if (method.order or 5) >= (method.explicit and 5 or 4) then names[#names + 1] = method.name end
end

-- The pendulum by its angle hits the wall at θ = -1/2: θ′²/2 = g (cos θ - cos 1), and bounces with θ′ → -0.8
-- θ′.
local g = 9.81
local th = var "theta"
local by_angle = dae { der(th, 2) ~ -g*sin(th) }
local speed = math.sqrt(2*g*(math.cos(0.5) - math.cos(1)))

test("a pendulum hits a wall", function()
  for _, method in ipairs(names) do
    if method ~= "rodas" or by_angle.kind ~= "fully implicit" then
      local sol = by_angle:integrate { start = { theta = 1, [th.dot] = 0 }, to = 3, method = method,
        rtol = 1e-9,
        events = { { when = th + 0.5, direction = -1, reset = { [th.dot] = -0.8*th.dot } } } }
      expect(sol.status):equals "finished"
      expect(sol.events[1].values.theta):near(-0.5, 1e-12)
      expect(sol(th.dot, sol.events[1].t)):near(0.8*speed, 1e-6)
      -- after the first bounce the energy is that of 0.8 θ′ at the wall, and so is the speed at the next one
      local top = math.acos(math.cos(0.5) - (0.8*speed)^2/(2*g))
      local highest = 0
      for _, t in ipairs(linspace(sol.events[1].t, sol.events[2].t, 400)) do
        highest = math.max(highest, sol(th, t)) end
      expect(highest):near(top, 1e-4)                              -- the best of 400 times: 1e-5 from the top
      expect(math.abs(sol.events[2].values["theta′"] or sol(th.dot, sol.events[2].t)/0.8)):near(0.8*speed,
        1e-6)
    end
  end
end)

test("the same in Cartesian coordinates: the constraints hold after the bounce, the times agree", function()
  local m = dae { der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - g, 0 ~ x^2 + y^2 - 1 }
  local angle = by_angle:integrate { start = { theta = 1, [th.dot] = 0 }, to = 3, rtol = 1e-11,
    events = { { when = th + 0.5, direction = -1, reset = { [th.dot] = -0.8*th.dot } } } }
  local low = m:reduce()
  local at = m:init { fix = { [x] = math.sin(1), [x.dot] = 0 }, guess = { [y] = -0.5 } }
  -- x′ is reset, y′ follows from x x′ + y y′ = 0
  for _, reset in ipairs { { [x.dot] = -0.8*x.dot }, { [x.dot] = -0.8*x.dot, [y.dot] = -0.8*y.dot } } do
    local sol = low:integrate { start = at, to = 3, rtol = 1e-10,
      events = { { when = x + math.sin(0.5), direction = -1, reset = reset } } }
    expect(sol.status):equals "finished"
    expect(#sol.events):equals(#angle.events)
    for i = 1, #sol.events do expect(sol.events[i].t):near(angle.events[i].t, 1e-6) end
    for _, t in ipairs { 0.5, 1, 2, 3 } do
      expect(sol(x, t)):near(math.sin(angle(th, t)), 1e-6)
      expect(sol(x^2 + y^2, t)):near(1, 1e-9)
      expect(math.abs(sol(x*x.dot + y*y.dot, t)) < 1e-8):is_true()
    end
  end
end)

test("a reset that no start satisfies is said", function()
  local low = dae { der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - g, 0 ~ x^2 + y^2 - 1 }:reduce()
  local at = low:init { fix = { [x] = 0.8, [x.dot] = 0 }, guess = { [y] = -0.5 } }
  local sol = low:integrate { start = at, to = 3, events = { { when = t - 1, reset = { [x] = 2 } } } }
  expect(sol.status):matches "^stopped at t = 1: the values after the reset contradict a constraint"
  expect(sol(x, 0.5) < 0.8):is_true()
end)

test("an algebraic variable follows a reset", function()
  local sol = dae { der(x) ~ -z, 0 ~ z - x^3 }:integrate { start = { x = 1 }, to = 2,
    events = { { when = t - 1, reset = { [x] = 2 } } } }
  expect(sol.events[1].after.z):near(8, 1e-12)
  expect(sol(z, 1)):near(8, 1e-12)
  expect(sol(z, 1 - 1e-9)):near(3^-1.5, 1e-6)                       -- x = 1/√(1 + 2t)
end)

test("a root at the start is no event; the direction is seen; no root, no event", function()
  local circle = dae { der(x) ~ y, der(y) ~ -x }
  local function count(event)
    return #circle:integrate { start = { x = 0, y = 1 }, to = 10, rtol = 1e-8, events = { event } }.events
  end
  expect(count { when = x }):equals(3)                             -- π, 2π, 3π and not 0
  expect(count { when = x, direction = 1 }):equals(1)
  expect(count { when = x, direction = -1 }):equals(2)
  expect(count { when = x, direction = "rising" }):equals(1)
  expect(count { when = x - 2 }):equals(0)
  expect(count { when = lt(x, 0.5) }):equals(4)
  expect(count { when = x ~ 0.5 }):equals(4)
  expect(count { when = der(x) }):equals(3)
  expect(count { when = (x - 1)^2 + 1e-6 }):equals(0)
end)

test("events far apart in one step: twenty roots of a fast function of time, one step of the method",
  function()
  local sol = dae { der(x) ~ 1 }:integrate { start = { x = 0 }, to = 1,
    events = { { when = cos(20*math.pi*t) } } }
  expect(#sol.events):equals(20)
  for i, event in ipairs(sol.events) do expect(event.t):near((i - 0.5)/20, 1e-13) end
end)

test("callbacks: stop, new values, errors, not a number", function()
  local decay = dae { der(x) ~ -x }
  local function run(call) return decay:integrate { start = { x = 1 }, to = 2,
    events = { { when = x - 0.5, call = call } } } end
  expect(run(function() return "stop" end).status):equals "event"
  expect(run(function() return true end).status):equals "event"
  local again = run(function(sol) return { [x] = 2*sol:final(x) } end)
  expect(#again.events):equals(2)
  expect(again:final(x)):near(4*math.exp(-2), 1e-6)
  expect(function() run(function() error("mine", 0) end) end):fails "mine"
  expect(function() run(function() return { [x] = 0/0 } end) end):fails "not a number"
  expect(function() run(function() return { [y] = 1 } end) end):fails "y"
  expect(function() run(function() return 5 end) end):fails "must return nothing"
  local inside
  run(function(sol) inside = sol(x, 0.3) end)                      -- dense output of the run so far
  expect(inside):near(math.exp(-0.3), 1e-6)
end)

test("inputs that fail: the error is theirs, the session goes on", function()
  local u = input "u"
  local model = dae { der(x) ~ u }
  local function run(f) return model:integrate { start = { x = 1 }, to = 1, inputs = { u = f } } end
  expect(function() run(function(at) if at > 0.5 then error("mine", 0) end return 1 end) end):fails "mine"
  expect(function() run(function(at) if at > 0.5 then
    return 0/0 end return 1 end) end):fails "must give a finite number at t = 0."
  expect(function() run(function() return "a" end) end):fails "'a' is not a number"
  -- A jump nobody told of is found.
  expect(run(function(at) if at > 0.5 then return 2 end return 1 end):final(x)):near(2.5, 1e-9)
end)

-- The continuous extension is as good as the mesh: an error of order tol between the steps as well.
test("dense output of adaptive methods", function()
  local model = dae { der(x) ~ y, der(y) ~ -x }
  for _, method in ipairs(names) do
    local before
    for _, tol in ipairs { 1e-5, 1e-8 } do
      local sol = model:integrate { start = { x = 0, y = 1 }, to = 6, method = method, rtol = tol,
        atol = tol }
      local worst = 0
      for i = 1, 600 do worst = math.max(worst, math.abs(sol(x, i/100) - math.sin(i/100))) end
      expect(worst <= 60*tol):is_true()
      local there = model:integrate { start = { x = 0, y = 1 }, to = 6, method = method, rtol = tol,
        atol = tol, times = { 1.234, 5.6 } }
      expect(there(x)):near(sol(x, { 1.234, 5.6 }), 1e-14)         -- asked for beforehand or afterwards
      expect(#there.t):equals(2)
    end
  end
end)

test("bounces that accumulate are named, not the border of |v| between them", function()
  local y, v = vars "y v"
  local ball = dae { der(y) ~ v, der(v) ~ -9.81 - v*abs(v)/10 }
  local sol = ball:integrate { start = { y = 1, v = 0 }, to = 20,
    events = { { when = y, direction = -1, reset = { v = -0.8*v } } } }
  expect(sol.status):matches "the events y = 0 accumulate: infinitely many in finite time"
end)

test("a condition on an algebraic unknown that holds for a short time only", function()
  local z, v, w = var "z", var "v", var "w"
  for _, method in ipairs(families.with("auto", "dopri5", "dop853", "tsit5")) do
    for _, rtol in ipairs { 1e-3, 1e-5, 1e-7 } do
      local how = { method = method, rtol = rtol, to = 3, start = { x = 0 } }
      how.events = { { when = z - 0.01, direction = -1 }, { when = z - 0.01, direction = 1 } }
      local sol = dae { der(x) ~ 1, 0 ~ z - (x - 1)^2 }:integrate(how)
      expect(#sol.events):equals(2)
      expect(sol.events[1].t):near(0.9, 1e-12)
      expect(sol.events[2].t):near(1.1, 1e-12)
      how.events, how.start = nil, { x = 0, w = 0 }                       -- a border of the equations
      local sol = dae { der(x) ~ 1, der(w) ~ ifelse(lt(z, 0.01), 1, 0), 0 ~ z - (x - 1)^2 }:integrate(how)
      expect(sol(w, 3)):near(0.2, 1e-12)
      how.events, how.start, how.to = { { when = der(v) - 0.98 } }, { x = 1, v = 0 }, 30
      local sol = dae { der(x) ~ v, der(v) ~ -x }:integrate(how)          -- a derivative: twice a period
      if rtol < 1e-4 then expect(#sol.events):equals(10) end
    end
  end
end)

test("parameters of events and of functions for inputs have values, sensitivities and sweeps", function()
  local g_, e, A, u = param "g_event", param "e_event", param "A_event", input "u_event"
  local fall = dae { der(y) ~ v, der(v) ~ -g_ }
  local bounce = { { when = y, direction = -1, reset = { v = -e*v } } }
  local function height(t, gravity, restitution, from)                -- closed form, parabola by parabola
    local fallen, speed = math.sqrt(2*from/gravity), math.sqrt(2*gravity*from)
    if t < fallen then return from - gravity*t^2/2 end
    t = t - fallen
    while true do
      speed = restitution*speed
      if t < 2*speed/gravity then return speed*t - gravity*t^2/2 end
      t = t - 2*speed/gravity
    end
  end
  local sol = fall:integrate { start = { y = 5, v = 0 }, to = 3, rtol = 1e-11, events = bounce,
    params = { g_event = 9.81, e_event = 0.8 }, sensitivities = { g_, e, y } }
  local h = 1e-5                                            -- central differences: h² ~ 1e-10 of the value
  for _, t in ipairs { 0.5, 2.1, 2.9 } do
    expect(sol(y, t)):near(height(t, 9.81, 0.8, 5), 1e-8)
    for p, difference in pairs {
      [g_] = (height(t, 9.81 + h, 0.8, 5) - height(t, 9.81 - h, 0.8, 5))/(2*h),
      [e] = (height(t, 9.81, 0.8 + h, 5) - height(t, 9.81, 0.8 - h, 5))/(2*h),
      [y] = (height(t, 9.81, 0.8, 5 + h) - height(t, 9.81, 0.8, 5 - h))/(2*h) } do
      expect(sol:sensitivity(y, p, t)):near(difference, 1e-7)
    end
  end
  local runs = sweep(fall, { start = { y = 5, v = 0 }, to = 2, events = bounce,
    params = { e_event = { 0.5, 0.8 }, g_event = 9.81 } })
  expect(runs:final(y)[2]):near(height(2, 9.81, 0.8, 5), 1e-5)
  local driven = dae { der(x) ~ u }:integrate { start = { x = 0 }, to = 1, rtol = 1e-10,
    params = { A_event = 2 }, inputs = { u_event = function(t) return A*cos(t) end }, sensitivities = { A } }
  expect(driven:sensitivity(x, A, 1)):near(math.sin(1), 1e-9)
  expect(function()
    fall:integrate { start = { y = 5, v = 0 }, to = 2, params = { e_evnt = 2, g_event = 9 }, events = bounce }
  end):fails "Did you mean 'e_event'?"
end)

test("any and all of conditions are events where they begin or end", function()
  local x, v = vars "x v"
  local function times(when, direction)
    local sol = dae { der(x) ~ -x }:integrate { start = { x = 1 }, to = 5, rtol = 1e-10, atol = 1e-10,
      events = { { when = when, direction = direction, call = function() end } } }
    local list = {}
    for k, event in ipairs(sol.events) do list[k] = event.t end
    return list
  end
  local function at(...) return map({ ... }, function(value) return -math.log(value) end) end
  expect(times(any(lt(x, 0.2), gt(x, 2)))):near(at(0.2), 1e-8)
  expect(times(all(gt(x, 0.1), lt(x, 0.2)))):near(at(0.2, 0.1), 1e-8)
  expect(times(all(gt(x, 0.1), lt(x, 0.2)), -1)):near(at(0.2), 1e-8)  -- becomes true, as lt(x, 0.2)
  expect(times(any(all(ge(x, 0.1), le(x, 0.2)), lt(x, 0.05)))):near(at(0.2, 0.1, 0.05), 1e-8)
  expect(times(lt(x, 0.2), -1)):near(at(0.2), 1e-8)
  expect(function() times(any(x - 0.1, lt(x, 0.2))) end)
    :fails "x - 0.1 in any is no condition: write lt(a, b)"
  expect(function() times(any(lt(x, 1), all(x, true))) end):fails "in all is no condition"
end)

-- Steps are looked at in quarters: those of the first one are binary fractions here.
test("a root that lies exactly where a step is looked at", function()
  local x, y = vars "x y"
  local sys = dae { der(x) ~ 1, y ~ 2*x }
  for _, T in ipairs { 1, 2^-20, 2^20 } do
    for k = 1, 7 do
      local r = k*T/16
      for _, method in ipairs { "auto", "dopri5", "radau", "bdf", "rodas" } do
        local roots = { falling = r - x, cubic = (x/T - k/16)^3, time = t - r, algebraic = y - 2*r }
        for name, when in pairs(roots) do
          local sol = sys:integrate { start = { x = 0 }, to = 2*T, dt0 = T/2, method = method,
            events = { { when = when, action = "stop" } } }
          expect(name .. method .. sol.status):equals(name .. method .. "event")
          expect(sol.t[#sol.t]/T):near(k/16, name == "cubic" and 1e-5 or 1e-12)
        end
        local touched = sys:integrate { start = { x = 0 }, to = 2*T, dt0 = T/2, method = method,
          events = { { when = (x - r)^2, action = "stop" } } }
        expect(touched.status):equals "finished"
      end
    end
  end
end)

-- Steps of a fifth of the interval and more; two roots around c, where the condition is between them.
test("a dip of a condition inside a step is found wherever it is, however flat", function()
  local x = var "x"
  for _, degree in ipairs { 2, 4, 6, 8 } do
    for k = 1, 60 do
      local c, depth = (k*0.61803398875) % 1, 10^(-1 - 6*((k*0.41421356237) % 1))
      local reach, roots = depth^(1/degree), 0
      for _, root in ipairs { c - reach, c + reach } do
        if root > 0 and root < 1 then roots = roots + 1 end
      end
      local sol = dae { der(x) ~ 1 }:integrate { start = { x = 0 }, to = 1, rtol = 1e-4,
        method = ({ "radau", "dop853", "gauss", "rodas" })[k % 4 + 1],
        events = { { when = ((x - c)^degree - depth)*(1 + x^2), call = function() end } } }
      expect(#sol.events):equals(roots)
    end
  end
end)

-- Where the solution is smooth its steps are long, and the condition comes to 0 and back inside one.
test("conditions that dip below zero between the ends and the middle of a step", function()
  local x = var "x"
  for k = 1, 12 do
    local c, width = 1 + 0.6173*k, 0.25/k^0.5
    local dip = ((x - c)/width)^2
    for _, when in ipairs { 1 - 1.1/(1 + dip), 1 - 1.1*exp(-dip) } do
      for _, method in ipairs { "auto", "dopri5", "radau", "bdf" } do
        local count = 0
        dae { der(x) ~ 1 + 0.3*sin(x) }:integrate { start = { x = 0 }, to = 12, method = method,
          events = { { when = when, call = function() count = count + 1 end } } }
        expect(method .. " " .. count):equals(method .. " 2")
      end
    end
  end
end)

test("the list of events prints a row for each, and stays data that can be saved", function()
  local y, v = vars "y v"
  local fall = dae { der(y) ~ v, der(v) ~ -2 }
  local function events(to)
    return fall:integrate { start = { y = 1, v = 0 }, to = to,                    -- y = 1 - t² up to t = 1
      events = { { when = v + 5 }, { when = y, direction = -1, reset = { [v] = 1 } } } }.events
  end
  local lines = {}
  for line in tostring(events(1.5)):gmatch "[^\n]+" do lines[#lines + 1] = line end
  expect(#lines):equals(2)
  expect(lines[1]):matches "^ *t  which  action  when$"
  expect(lines[2]):matches "^ *1 +2  reset   y = 0$"
  expect(tostring(events(0.5))):equals "no events"
  local file = os.tmpname() .. ".lua"
  save(file, { all = events(1.5) })
  expect(load(file).all[1].which):equals(2)
  os.remove(file)
end)
