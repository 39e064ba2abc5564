-- Filippov's solutions: a run goes on along a border to which both sides lead, and leaves it where one side
-- no longer does.
local families = dofile "tests/families.lua"
local x, y, v, w, z, la = vars "x y v w z la"
local methods = families.with("auto", "dopri5", "dop853")
local within = { bdf = 1e-6 }

local function runs(model, start, to, check, options)
  for _, method in ipairs(methods) do
    local request = { start = start, to = to, method = method, rtol = 1e-9, atol = 1e-11 }
    for key, value in pairs(options or {}) do request[key] = value end
    local sol = model:integrate(request)
    expect(method .. " " .. sol.status):equals(method .. " finished")
    check(sol, within[method] or 1e-8)
  end
end

-- First of this file: the pivots that a session remembers for a pattern are these.
test("behind another model of the same pattern, whose rows are 10¹³ long near its pole", function()
  local pole = dae { max(x, -x)*z ~ 1, der(x) ~ 1 }
  for _, to in ipairs { 1, 2 } do pole:integrate { start = { x = -1 }, to = to, method = "bdf" } end
  for _, method in ipairs { "radau", "bdf", "rodas" } do
    local sol = dae { der(x) ~ z, 0 ~ z - ifelse(lt(x, 1), 1, -2) }
      :integrate { start = { x = 0 }, to = 3, rtol = 1e-9, atol = 1e-11, method = method }
    expect(method .. " " .. sol.status):equals(method .. " finished")
    expect(sol(z, 2)):equals(0)
  end
end)

test("both sides lead to the border for good", function()
  runs(dae { der(x) ~ 0.3 - sign(x) }, { x = 1 }, 3, function(sol, tol)
    expect(sol(x, 1)):near(0.3, tol)
    for _, at in ipairs { 1.5, 2.2, 3 } do expect(sol(x, at)):near(0, 1e-12) end
    expect(sol:stats().borders):equals(
      "border x = 0: jump or kink, located 1 time, from t = 1.42857 on the solution slides along it")
  end)
  runs(dae { der(x) ~ 3 - 1e4*sign(x - 1e3) }, { x = 1.5e3 }, 1,
    function(sol, tol) expect(sol(x, 1)):near(1e3, tol) end)
end)

test("a force that grows sets a body moving, and it comes to rest again", function()
  -- v' = 2 sin t - sign v: rest until sin t = 1/2, then v = 2 (cos t₁ - cos t) - (t - t₁) until v = 0
  local t1 = math.pi/6
  local function speed(s) return 2*(math.cos(t1) - math.cos(s)) - (s - t1) end
  local low, high = 2, 4
  for _ = 1, 60 do
    local middle = (low + high)/2
    if speed(middle) > 0 then low = middle else high = middle end
  end
  -- there the force is -2 |sin| or less than 1 in size: rest or motion backwards
  runs(dae { der(v) ~ 2*sin(t) - sign(v) }, { v = 0 }, 3.2, function(sol, tol)
    expect(sol(v, 0.5)):near(0, 1e-12)
    for _, at in ipairs { 0.6, 1.7, 3 } do expect(sol(v, at)):near(speed(at), 10*tol) end
    if low < 3.2 then expect(sol(v, 3.2)):near(0, 1e-9) end
  end)
end)

test("Filippov's combination in two dimensions", function()
  -- above (1, -1), below (0, 2): μ = 1/3 and x' = 2/3 on y = 0
  local field = dae { der(x) ~ ifelse(gt(y, 0), 1, 0), der(y) ~ ifelse(gt(y, 0), -1, 2) }
  runs(field, { x = 0, y = 1 }, 4, function(sol, tol)
    expect(sol(x, 4)):near(3, tol)
    expect(sol(x.dot, 2)):near(2/3, 1e-9)
  end)
  -- above (1, -1), below (x - 2, 1): it leaves where nothing keeps it, at no point: x → 1/2 + …
  local bend = dae { der(x) ~ ifelse(gt(y, 0), 1, -1), der(y) ~ ifelse(gt(y, 0), x - 1, 1) }
  -- on y = 0: μ = (x - 1)/(x - 2), x' = 1 - 2μ = -x/(x - 2) … x = 1 is where the upper side takes over
  local into, f = 0.5, function(a) return 2*math.log(a) - a end   -- ∫(2 - x)/x dx
  local leave = f(1) - f(into)
  runs(bend, { x = into, y = 0 }, leave + 1, function(sol, tol)
    expect(sol(x, leave)):near(1, 10*tol)
    expect(sol(y, 0.7*leave)):near(0, 1e-12)
    expect(sol(x, leave + 1)):near(2, 10*tol)
    expect(sol(y, leave + 1)):near(0.5, 10*tol)
  end)
end)

test("borders that are crossed infinitely often on the way to their intersection", function()
  runs(dae { der(x) ~ -sign(x) + 2*sign(y), der(y) ~ -2*sign(x) - sign(y) }, { x = 1, y = 0.3 }, 3,
    function(sol)
      expect(sol(x, 3)):near(0, 1e-9)
      expect(sol(y, 3)):near(0, 1e-9)
    end)
end)

test("two bodies stick and slip by themselves, and to each other", function()
  runs(dae { der(v) ~ 0.5*sin(t) - sign(v), der(w) ~ 3 - sign(w) }, { v = 0.2, w = -2 }, 3,
    function(sol, tol)
      expect(sol(v, 3)):near(0, 1e-10)
      expect(sol(w, 3)):near(2*2.5, tol)
    end)
  -- masses 1 and 2 with friction 1 between them, a force of 1.2 on both together: they move as one
  local pair = dae { der(v) ~ 1.2 - sign(v - w), 2*der(w) ~ sign(v - w) }
  runs(pair, { v = 1, w = 0 }, 3, function(sol, tol)
    -- relative speed 1 + (0.2 - 0.5) t: 0 at t = 10/3
    expect(sol(v - w, 3)):near(0.1, tol)
  end)
  runs(pair, { v = 1, w = 0 }, 5, function(sol, tol)
    local t1 = 10/3
    expect(sol(v - w, 5)):near(0, 1e-9)
    expect(sol(w, 5)):near(t1/2 + 0.4*(5 - t1), 10*tol)
  end)
end)

--- Stick and slip on a belt of speed b, friction (1 - c |v - b|): every slip is
-- y = e^{ct/2}(A cos ωt + B sin ωt).
local function belt_period(b, c)
  local om, A = math.sqrt(1 - c^2/4), c*b
  local B = (b - c*A/2)/om
  local function position(s) return math.exp(c*s/2)*(A*math.cos(om*s) + B*math.sin(om*s)) end
  local function velocity(s)
    return math.exp(c*s/2)*((c*A/2 + om*B)*math.cos(om*s) + (c*B/2 - om*A)*math.sin(om*s))
  end
  local low, high = math.pi, 2*math.pi
  for _ = 1, 60 do
    local middle = (low + high)/2
    if velocity(middle) < b then low = middle else high = middle end
  end
  return low + (A - position(low))/b, low
end

test("stick and slip on a belt", function()
  for _, case in ipairs { { 0.2, 0.3 }, { 0.5, 0.1 }, { 0.05, 0.5 } } do
    local b, c = case[1], case[2]
    local period, slip = belt_period(b, c)
    local belt = dae { der(x) ~ v, der(v) ~ -x - (1 - c*abs(v - b))*sign(v - b) }
    local sol = belt:integrate { start = { x = 1 - b, v = b }, to = 1 + 3.5*period, rtol = 1e-10,
      atol = 1e-12 }
    expect(sol.status):equals "finished"
    for k = 0, 3 do expect(sol(x, 1 + k*period)):near(1, 1e-7) end
    expect(sol(v, 1 + period + slip + 0.01*(period - slip))):near(b, 1e-9)
    expect(sol:stats().borders):matches "slides along it 4 times"
  end
end)

test("friction whose normal force is an unknown of the model", function()
  runs(dae { der(v) ~ 0.5 - v - z*sign(v), 0 ~ z - 1 }, { v = -1 }, 5,
    function(sol) expect(sol(v, 5)):near(0, 1e-12) end)
  runs(dae { der(x) ~ z, 0 ~ z - ifelse(lt(x, 1), 1, -2) }, { x = 0 }, 3, function(sol, tol)
    expect(sol(x, 3)):near(1, tol)
    expect(sol(z, 2)):near(0, 1e-9)
  end)
  -- a body on a floor that bears it: N = 10, friction 5, a force of 2
  local floor = dae { der(x) ~ v, der(y) ~ w, der(v) ~ 2 - 0.5*la*sign(v), der(w) ~ la - 10, 0 ~ y }
  for _, form in ipairs { "acc", "project", "dummy", "minimal" } do
    local low = floor:reduce(form)
    local sol = low:integrate { start = { x = 0, v = 3 }, to = 3, rtol = 1e-9, atol = 1e-11 }
    expect(form .. " " .. sol.status):equals(form .. " finished")
    expect(sol(x, 3)):near(1.5, 1e-8)
    expect(sol(v, 2)):near(0, 1e-9)
  end
end)

test("sensitivities go along", function()
  local p = param("p", 0.3)
  local sol = dae { der(x) ~ p - sign(x), der(y) ~ x }:integrate { start = { x = 1, y = 0 }, to = 3,
    rtol = 1e-9, atol = 1e-11, sensitivities = { p } }
  -- x = 1 - (1 - p) t until t₁ = 1/(1 - p), then 0; y(3) = t₁/2
  expect(sol:sensitivity(x, p, 3)):near(0, 1e-8)
  expect(sol:sensitivity(y, p, 3)):near(1/(2*0.7^2), 1e-6)
end)

test("saved times and events along a border", function()
  local sol = dae { der(x) ~ 0.3 - sign(x), der(y) ~ 1 }:integrate { start = { x = 1, y = 0 }, to = 3,
    times = { 1, 1.5, 2.5, 3 },
    events = { { when = y - 2 }, { when = y - 2.5, reset = { [x] = 0.35 } } } }
  expect(sol.status):equals "finished"
  expect(sol(x)):near({ 0.3, 0, 0.35, 0 }, 1e-6)
  expect(#sol.events):equals(2)
end)

test("a body with dry friction on a relay comes to rest", function()
  -- both borders, of x and of v, are crossed infinitely often on the way
  local relay = dae { der(x) ~ v, der(v) ~ -sign(x) - 0.5*sign(v) }
  local sol = relay:integrate { start = { x = 1, v = 0 }, to = 20 }
  expect(sol.status):equals "finished"
  expect(sol:final(x)):near(0, 1e-6)
  -- swings of 8/3, each shorter than the last by √3
  local at = tonumber(sol:stats().borders:match "x = 0: .- from t = (%S+) on")
  expect(at):near(8/3/(1 - 1/math.sqrt(3)), 1e-4)
end)

--- A capacitor that is charged through a switch, τ c′ = I (1 + sign(s - c)) - c, s = amplitude sin(120 π t).
--- It rises, slides along s, and falls behind s, in phases whose solutions are known: the values at `times`.
local function charged(amplitude, current, tau, times)
  local w, t0, c0, phase = 120*math.pi, 0, 0, "up"
  local function source(at) return amplitude*math.sin(w*at), amplitude*w*math.cos(w*at) end
  local function value(at)
    if phase == "slide" then return (source(at)) end
    local rest = phase == "up" and 2*current or 0
    return rest + (c0 - rest)*math.exp(-(at - t0)/tau)
  end
  local function lasts(at)  -- the phase does as long as this is not negative
    local s, slope = source(at)
    if phase == "up" then return s - value(at) end
    if phase == "down" then return value(at) - s end
    return math.min(slope + s/tau, (2*current - s)/tau - slope)
  end
  local function next_phase(at)
    local s, slope = source(at)
    local up, down = (2*current - s)/tau - slope, slope + s/tau
    if phase == "slide" then return down < up and "down" or "up" end
    return up < 0 and "up" or down < 0 and "down" or "slide"
  end
  phase = next_phase(0)
  local values, h, to = {}, times[#times]/20000, times[#times]
  for i = 1, 20000 do
    local at = i*h
    for _ = 1, 3 do
      if lasts(at) >= 0 then break end
      local low, high = math.max(t0, at - h), at
      for _ = 1, 60 do
        local middle = (low + high)/2
        if lasts(middle) < 0 then high = middle else low = middle end
      end
      local there, following = value(high), next_phase(high)
      t0, c0, phase = high, there, following
    end
    while times[#values + 1] and times[#values + 1] <= at + 1e-9*to do
      values[#values + 1] = value(times[#values + 1])
    end
  end
  return values
end

test("what leaves a border along its tangent does not slide on", function()
  math.randomseed(1)
  local random, c = math.random, var "c"
  local times = {}
  for k = 1, 40 do times[k] = 0.003*k end
  for _ = 1, 20 do
    local volt, second = 10^random(-3, 3), 10^random(-6, 3)
    local amplitude, tau = 1 + 20*random(), 1.5*20^random()/60
    local current = amplitude*(1 + 5*random())
    local model = dae { tau*second*der(c) ~
      current*volt*(1 + sign(amplitude*volt*sin(120*pi*t/second) - c)) - c }
    local exact = charged(amplitude, current, tau, times)
    for _, method in ipairs { "auto", "dopri5", "tsit5", "dop853", "radau", "bdf", "rodas5p" } do
      for _ = 1, 3 do
        local rtol = 10^(-2.5 - 6*random())
        local sol = model:integrate { start = { c = 0 }, to = 0.12*second, rtol = rtol, method = method }
        expect(sol.status):equals "finished"
        for k, at in ipairs(times) do
          expect(sol(c, at*second)):near(exact[k]*volt, (100*rtol + 1e-8)*amplitude*volt)
        end
      end
    end
  end
end)
