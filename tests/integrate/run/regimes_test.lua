-- Piecewise models whose regimes differ in index: contact and ideal diodes written as 0 ~ min(a, b).
local families = dofile "tests/families.lua"
local x, y, v, w, la, mu, u, i, th, om = vars "x y v w la mu u i th om"
local g = 10
local methods = { "auto", "dopri5", "radau", "bdf" }

local function regimes(sol)
  local list = {}
  for _, use in ipairs(sol:switches()) do list[#list + 1] = use.t end
  return list
end

local ball = dae { der(x) ~ v, der(v) ~ -g + la, 0 ~ min(x, la) }

test("the index and the free values of every regime are listed", function()
  local text = tostring(ball:structure())
  expect(text):matches "index 3, 0 free initial values where x < la; index 1, 2 free .* where la < x"
end)

test("a ball falls onto the floor and stays there", function()
  for _, method in ipairs(methods) do
    local sol = ball:integrate { start = { x = 0.8, v = 0 }, to = 1, method = method, rtol = 1e-8,
      atol = 1e-10 }
    expect(method .. sol.status):equals(method .. "finished")
    expect(regimes(sol)):near({ 0, 0.4 }, 1e-6)
    expect(sol(x, 0.3)):near(0.35, 1e-6)
    expect({ sol(x, 0.7), sol(v, 0.7), sol(la, 0.7), sol(la, 0.2) }):near({ 0, 0, g, 0 }, 1e-9)
  end
end)

test("a law of restitution, and rest after infinitely many bounces", function()
  for _, e in ipairs { 0.5, 0.8 } do
    local sol = ball:integrate { start = { x = 0.8, v = 0 }, to = 5,
      events = { { when = x, direction = -1, reset = { [v] = -e*v } } } }
    expect(sol.status):equals "finished"
    local switches = regimes(sol)
    expect(switches[#switches]):near(0.4*(1 + e)/(1 - e), 1e-5)
    for k = 1, 5 do expect(sol.events[k].t):near(0.4*(1 + 2*e*(1 - e^(k - 1))/(1 - e)), 1e-6) end
    expect({ sol(x, 5), sol(v, 5), sol(la, 5) }):near({ 0, 0, g }, 1e-9)
  end
end)

test("units change nothing", function()
  for _, size in ipairs { 1e-6, 1e-3, 1e3, 1e6 } do
    local m = dae { der(x) ~ v, der(v) ~ -g*size + la, 0 ~ min(x, la) }
    local sol = m:integrate { start = { x = 0.8*size, v = 0 }, to = 1, atol = 1e-12*size }
    expect(sol.status):equals "finished"
    expect(regimes(sol)):near({ 0, 0.4 }, 1e-6)
    expect(sol(la, 0.7)/size):near(g, 1e-6)
  end
end)

test("an impact on a wall from which the solution leaves again at once", function()
  -- a pendulum: plastic impact at sin θ = -1/5, then gravity takes it back; energy on the way out from rest
  local wall = dae { der(th) ~ om, der(om) ~ -g*sin(th) + la*cos(th), 0 ~ min(sin(th) + 0.2, la) }
  local sol = wall:integrate { start = { th = 1, om = 0 }, to = 3, rtol = 1e-9, atol = 1e-11 }
  expect(sol.status):equals "finished"
  local hit = sol.t[1]
  for _, at in ipairs(sol.t) do if sol(sin(th), at) < -0.2 + 1e-9 then hit = at break end end
  expect(sol(om^2/2 - g*cos(th), hit + 0.2)):near(-g*math.cos(math.asin(0.2)), 1e-6)
  for _, at in ipairs { 1, 2, 3 } do expect(sol(la, at)):near(0, 1e-9) end
end)

test("a state of a run in the air is a start in the air", function()
  local sol = ball:integrate { start = { x = 0.8, v = 0 }, to = 0.2 }
  local on = sol:continue { to = 1 }
  expect(on(x, 0.3)):near(0.35, 1e-6)
  expect({ on(x, 1), on(la, 1) }):near({ 0, g }, 1e-9)
end)

test("friction with the force of the contact", function()
  -- falls for 0.2 s; the impact takes 0.5·2 from its speed of 3, then friction 5 does
  local slide = dae { der(x) ~ v, der(y) ~ w, der(v) ~ -0.5*la*sign(v), der(w) ~ -g + la, 0 ~ min(y, la) }
  local sol = slide:integrate { start = { x = 0, y = 0.2, v = 3, w = 0 }, to = 2, rtol = 1e-9, atol = 1e-11 }
  expect(sol.status):equals "finished"
  expect({ sol(x, 2), sol(v, 0.4), sol(v, 2) }):near({ 1, 1, 0 }, 1e-8)
end)

test("lift-off where the force that presses ends", function()
  local m = dae { der(x) ~ v, der(v) ~ la + 3*(t - 1), 0 ~ min(x, la) }
  local sol = m:integrate { start = { x = 0, v = 0 }, to = 2, rtol = 1e-8 }
  expect(sol.status):equals "finished"
  expect(regimes(sol)):near({ 0, 1 }, 1e-7)
  expect(sol(la, 0.5)):near(1.5, 1e-8)
  expect(sol(x, 2)):near(0.5, 1e-6)
end)

test("plastic impacts keep momentum", function()
  local m = dae { der(x) ~ v, der(y) ~ w, 2*der(v) ~ -la, der(w) ~ la, 0 ~ min(y - x, la) }
  local sol = m:integrate { start = { x = 0, y = 1, v = 3, w = 0 }, to = 2 }
  expect(sol.status):equals "finished"
  expect(regimes(sol)):near({ 0, 1/3 }, 1e-9)
  expect({ sol(v, 2), sol(w, 2), sol(x, 2) }):near({ 2, 2, 1 + 2*(2 - 1/3) }, 1e-8)
end)

test("capacitors that are connected keep their charge, coils their flux", function()
  local a, b, k = vars "a b k"
  local m = dae { der(a) ~ -k, 2*der(b) ~ k, 0 ~ ifelse(lt(t, 1), k, a - b) }
  local sol = m:integrate { start = { a = 3, b = 0 }, to = 2 }
  expect({ sol(a, 0.5), sol(a, 2), sol(b, 2) }):near({ 3, 1, 1 }, 1e-9)
  -- two coils, in series from t = 1 on: L₁ i₁ + L₂ i₂ is kept, then decays with R/L
  local coils = dae { 2*der(a) ~ k - a, 3*der(b) ~ -k - b, 0 ~ ifelse(lt(t, 1), k, a - b) }
  local run = coils:integrate { start = { a = 1, b = 1 }, to = 1.5, rtol = 1e-9, atol = 1e-12 }
  local a1, b1 = math.exp(-1/2), math.exp(-1/3)
  local after = (2*a1 + 3*b1)/5
  expect(run.status):equals "finished"
  expect({ run(a, 1.5), run(b, 1.5) }):near({ after*math.exp(-0.2), after*math.exp(-0.2) }, 1e-7)
end)

test("a constraint that begins at a time", function()
  local late = dae { der(x) ~ y, 0 ~ ifelse(lt(t, 1), y - 1, x - 1 - sin(t - 1)) }
  local sol = late:integrate { start = { x = 0 }, to = 2, rtol = 1e-8 }
  expect(sol.status):equals "finished"
  expect(sol(x, 2)):near(1 + math.sin(1), 1e-8)
  expect(sol(y, 1.5)):near(math.cos(0.5), 1e-7)
end)

test("an ideal diode bridge", function()
  local p, a, b, j = vars "p a b j"
  local d = var("d", 4)
  local E = 10*sin(100*t)
  local bridge = dae { 1e-3*der(p) ~ d[1] + d[2] - p/100, a - b ~ E - j, j ~ d[1] - d[3], -j ~ d[2] - d[4],
    0 ~ min(d[1], p - a), 0 ~ min(d[2], p - b), 0 ~ min(d[3], a), 0 ~ min(d[4], b) }
  local sol = bridge:integrate { start = { p = 0 }, to = 0.1, rtol = 1e-9, atol = 1e-11 }
  expect(sol.status):equals "finished"
  -- the same by hand: the source charges through 1 Ω while |E| > p
  local by_hand = dae { 1e-3*der(p) ~ max(0, abs(E) - p) - p/100 }:integrate { start = { p = 0 }, to = 0.1,
    rtol = 1e-11, atol = 1e-13 }
  for _, at in ipairs { 0.01, 0.03, 0.05, 0.0777, 0.1 } do expect(sol(p, at)):near(by_hand(p, at), 1e-7) end
end)

test("a rectifier without resistance: the voltage follows the source, then the load", function()
  local m = dae { 1e-3*der(u) ~ i - u/1000, v ~ sin(100*t) - u, 0 ~ min(i, -v) }
  local sol = m:integrate { start = { u = 0 }, to = 0.07, rtol = 1e-9, atol = 1e-12 }
  expect(sol.status):equals "finished"
  local off = (math.pi/2 + math.atan(0.01))/100       -- C u' + u/R = 0 with u = sin(100 t)
  expect(regimes(sol)):near({ 0, off }, 1e-8)
  expect(sol(u, 0.01)):near(math.sin(1), 1e-9)
  expect(sol(u, 0.06)):near(math.sin(100*off)*math.exp(-(0.06 - off)), 1e-7)
end)

test("a rocking block: every impact takes the same share of its speed", function()
  -- half width B, half height H, moment of inertia J, smooth floor: ω⁺/ω⁻ = (J - B²)/(J + B²)
  local B, H, J = 1, 2, 5/3
  local left, right = y - H*cos(th) - B*sin(th), y - H*cos(th) + B*sin(th)
  local block = dae { der(y) ~ w, der(th) ~ om, der(w) ~ -g + la + mu,
    J*der(om) ~ la*(H*sin(th) - B*cos(th)) + mu*(H*sin(th) + B*cos(th)),
    0 ~ min(left, la), 0 ~ min(right, mu) }
  local a = 0.1
  local sol = block:integrate { start = { y = H*math.cos(a) + B*math.sin(a), th = a, w = 0, om = 0 }, to = 1,
    rtol = 1e-9, atol = 1e-11 }
  expect(sol.status):equals "finished"
  local at = regimes(sol)
  for k = 2, 4 do
    expect(sol(om, at[k] + 1e-9)/sol(om, at[k] - 1e-9)):near((J - B^2)/(J + B^2), 1e-4)
  end
  expect({ sol(th, 1), sol(om, 1), sol(y, 1), sol(la, 1), sol(mu, 1) }):near({ 0, 0, H, g/2, g/2 }, 1e-6)
end)

test("a ball in a box", function()
  local l = var("l", 4)
  local box = dae { der(x) ~ v, der(y) ~ w, der(v) ~ l[1] - l[2], der(w) ~ -g + l[3] - l[4],
    0 ~ min(x, l[1]), 0 ~ min(1 - x, l[2]), 0 ~ min(y, l[3]), 0 ~ min(1 - y, l[4]) }
  local start = { x = 0.5, y = 0.5, v = 1, w = 0 }
  local sol = box:integrate { start = start, to = 2 }
  expect(sol.status):equals "finished"
  expect({ sol(x, 2), sol(y, 2), sol(l[3], 2), sol(l[2], 2) }):near({ 1, 0, g, 0 }, 1e-7)
  local walls = {}
  for wall, speed in pairs { [x] = v, [1 - x] = v, [y] = w, [1 - y] = w } do
    walls[#walls + 1] = { when = wall, direction = -1, reset = { [speed] = -speed/2 } }
  end
  sol = box:integrate { start = start, to = 2.3, events = walls }
  expect(sol.status):equals "finished"
  -- right at 0.5, left at 2.5; the floor bears it from 3 √0.1 on
  expect({ sol(x, 2.3), sol(y, 2.3), sol(l[3], 2) }):near({ 0.1, 0, g }, 1e-6)
  expect(sol(y, 0.5)):near(math.sqrt(10)/2*(0.5 - math.sqrt(0.1)) - 5*(0.5 - math.sqrt(0.1))^2, 1e-6)
end)

test("saved times, events that stop, another start", function()
  local sol = ball:integrate { start = { x = 0.8, v = 0 }, to = 1, times = { 0.1, 0.4, 0.9 } }
  expect(sol(x)):near({ 0.75, 0, 0 }, 1e-6)
  sol = ball:integrate { start = { x = 0.8, v = 0 }, to = 1,
    events = { { when = x - 0.35, action = "stop" } } }
  expect(sol.status):equals "event"
  expect(sol.t[#sol.t]):near(0.3, 1e-6)
  sol = ball:integrate { start = { x = 0, v = 2 }, to = 1 }
  expect(regimes(sol)):near({ 0, 0.4 }, 1e-6)
end)

test("a start respects the regime", function()
  expect(ball:init { fix = { x = 0, v = 0 } } (la)):near(g, 1e-12)
  expect(ball:init { fix = { x = 0, v = 1 } } (la)):near(0, 1e-12)
  expect(function() ball:init { fix = { x = 0, v = -1 } } end):fails "no region of this piecewise model"
  expect(function() ball:init { fix = { x = -1, v = 0 } } end):fails "where x < la"
end)

test("a start at rest finds friction that sticks, and friction that does not suffice", function()
  local function block(F) return dae { der(x) ~ v, 2*der(v) ~ F - 3*sign(v) } end
  for _, case in ipairs { { 2, 0 }, { -2, 0 }, { 0, 0 }, { 5, 1 }, { -7, -2 }, { 3, 0 } } do
    local at = block(case[1]):init { fix = { x = 0, v = 0 } }
    expect(at(v.dot)):near(case[2], 1e-12)
  end
  expect(block(2):init { fix = { x = 0, v = 1 } } (v.dot)):near(-0.5, 1e-12)
  -- two blocks with friction between them, pulled: they stick to each other while 2 F/3 < 1
  local function pair(F) return dae { der(v) ~ F - sign(v - w), 2*der(w) ~ sign(v - w) } end
  local at = pair(1.2):init { fix = { v = 1, w = 1 } }
  expect({ at(v.dot), at(w.dot) }):near({ 0.4, 0.4 }, 1e-12)
  at = pair(2):init { fix = { v = 1, w = 1 } }
  expect({ at(v.dot), at(w.dot) }):near({ 1, 0.5 }, 1e-12)
end)

-- The woodpecker toy, in the states of Eich-Soellner & Führer, Numerical Methods in Multibody Dynamics, 1998:
-- a sleeve that tilts and jams on its pole, and a bird on a spring. z: height, p: angle of the
-- sleeve, b: of the bird; mode is 1
-- where the sleeve is jammed, by the forces la at its edge and mu along the pole.
test("a woodpecker toy: a reset carries it into the other regime, whose index is another one", function()
  local z, p, b, vz, vp, vb, mode = vars "z p b vz vp vb mode"
  local mS, JS, mB, JB, c, g = 3e-4, 5e-9, 4.5e-3, 7e-7, 5.6e-3, 9.81
  local r0, rS, hS, lS, lG, hB, lB = 2.5e-3, 3.1e-3, 5.8e-3, 1e-2, 1.5e-2, 2e-2, 2.01e-2
  local bird, limit, beak = JB + mB*lG^2, (rS - r0)/hS, (lS + lG - lB - r0)/hB
  local function motion(edge, pole)
    return { der(z) ~ vz, der(p) ~ vp, der(b) ~ vb,
      (mS + mB)*der(vz) + mB*lS*der(vp) + mB*lG*der(vb) ~ -(mS + mB)*g - pole,
      mB*lS*der(vz) + (JS + mB*lS^2)*der(vp) + mB*lS*lG*der(vb) ~ c*(b - p) - mB*lS*g - hS*edge - rS*pole,
      mB*lG*der(vz) + mB*lS*lG*der(vp) + (JB + mB*lG^2)*der(vb) ~ c*(p - b) - mB*lG*g }
  end
  local kept = vb + (mB*lG*vz + mB*lS*lG*vp)/bird           -- the bird keeps its angular momentum
  local peck = { when = b - beak, direction = 1, reset = { [vb] = -vb } }
  local free = lt(mode, 0.5)
  local toy = dae { motion(la, mu), der(mode) ~ 0, 0 ~ ifelse(free, la, vp), 0 ~ ifelse(free, mu, vz) }
  local jam = { [vz] = 0, [vp] = 0, [vb] = kept, [mode] = 1 }
  local start = { z = 0, p = -limit, b = -5*limit, vz = 0, vp = 0, vb = 0 }
  local whole = { mode = 1 }
  for name, value in pairs(start) do whole[name] = value end
  local sol = toy:integrate { start = whole, to = 0.3, rtol = 1e-9, atol = 1e-12, events = { peck,
    { when = la, reset = { [mode] = 0 } },
    { when = p - limit - 10*ifelse(free, 0, 1), direction = 1, reset = jam },
    { when = p + limit + 10*ifelse(free, 0, 1), direction = -1, reset = jam } } }
  expect(sol.status):equals "finished"
  local at = {}
  for _, s in ipairs(sol:switches()) do at[#at + 1] = s.t end

  -- the same by hand: two models in turn
  local jammed = dae { motion(la, mu), 0 ~ vp, 0 ~ vz }:reduce()
  local loose = dae(motion(0, 0))
  local now, time, wanted = start, 0, { 0 }
  while time < 0.3 do
    local is_jammed = #wanted % 2 == 1
    local run = (is_jammed and jammed or loose):integrate { start = now, from = time, to = 0.3, rtol = 1e-10,
      atol = 1e-13, events = is_jammed and { peck, { when = la, action = "stop" } }
        or { peck, { when = p - limit, direction = 1, action = "stop" },
          { when = p + limit, direction = -1, action = "stop" } } }
    time, now = run.t[#run.t], {}
    for name, leaf in pairs { z = z, p = p, b = b, vz = vz, vp = vp, vb = vb } do
      now[name] = run(leaf, time)
    end
    if run.status == "finished" then break end
    if not is_jammed then now.vb, now.vz, now.vp = run(kept, time), 0, 0 end
    wanted[#wanted + 1] = time
  end
  expect(#at):equals(#wanted)
  expect(at):near(wanted, 1e-6)
  expect(sol(z, 0.3)):near(now.z, 1e-6)
  -- the first release in closed form: the bird swings about b₀, and la is linear in b
  local b0, omega = -limit - mB*lG*g/c, math.sqrt(c/bird)
  local function edge(angle)
    local rate = (c*(-limit - angle) - mB*lG*g)/bird
    return c*(angle + limit) - mB*lS*g + rS*((mS + mB)*g + mB*lG*rate) - mB*lS*lG*rate
  end
  local released = -edge(0)/(edge(1) - edge(0))
  expect(at[2]):near(math.acos((released - b0)/(-5*limit - b0))/omega, 1e-9)
end)

-- √y in the region y > 0 would end at y = 0, where its slope is infinite: roots are left as they are.
test("roots of what changes its sign, beside a contact that changes the index", function()
  local y, x, v, force = vars "y_root x_root v_root force"
  local flows = { -2 - sqrt(abs(y)), 0.5 - sign(y)*sqrt(abs(y)), -2 - abs(y) - sqrt(abs(y)),
    -2 - abs(y)^(1/3), -2 - sqrt(ifelse(gt(y, 0), y, -2*y)), -2 - sqrt(abs(y - t)), -2 - sqrt(max(y, 0)),
    -2 - sqrt(abs(y)) - abs(sqrt(abs(y)) - 0.5) }
  for _, flow in ipairs(flows) do
    local alone = dae { der(y) ~ flow } :integrate { start = { [y] = 1 }, to = 3, rtol = 1e-9 }
    local ball = dae { der(x) ~ v, der(v) ~ -9.81 + force, 0 ~ min(x, force), der(y) ~ flow }
    local sol = ball:integrate { start = { [x] = 1, [v] = 0, [y] = 1 }, to = 3, rtol = 1e-9 }
    expect(sol.status):equals "finished"
    expect(sol(y, 3)):near(alone(y, 3), 1e-5)
    expect(sol(x, 3)):near(0, 1e-9)
  end
  local ball = dae { der(x) ~ v, der(v) ~ -9.81 + force, 0 ~ min(x, force), der(y) ~ -sqrt(abs(y)) }
  local said = ball:integrate { start = { [x] = 1, [v] = 0, [y] = 1 }, to = 3 } :stats().not_unique
  expect(said):matches "√|y_root| has an infinite slope"
end)

local every_method = families.with("auto", "dopri5", "dop853")

local function tolerances(from, to, count)
  local list = {}
  for k = 0, count - 1 do list[#list + 1] = from*(to/from)^(k/(count - 1)) end
  return list
end

test("a diode opens where its current ends, known to the tolerance of the run", function()
  -- at the peak of the source: a = sin t until π/2, then 1
  for _, size in ipairs { 1, 1e3, 1e-3 } do
    local detector = dae { der(x) ~ i, 0 ~ min(i, x - size*sin(t)) }
    for _, method in ipairs(every_method) do
      for _, rtol in ipairs(tolerances(1e-3, 1e-9, size == 1 and 22 or 5)) do
        local sol = detector:integrate { start = { x = 0 }, to = 7, rtol = rtol, atol = 1e-3*rtol*size,
          method = method }
        local run = method .. " " .. rtol .. " "
        expect(run .. sol.status):equals(run .. "finished")
        expect({ sol(x, 1)/size, sol(x, 3)/size, sol:final(x)/size }):near({ math.sin(1), 1, 1 }, 50*rtol)
        expect(regimes(sol)[2]):near(math.pi/2, 20*math.sqrt(rtol))
      end
    end
  end
end)

test("a voltage doubler at many tolerances", function()
  local doubler = dae { der(x) ~ i - u, der(y) ~ u - y/5, 0 ~ min(i, x - 5*sin(5*t)),
    0 ~ min(u, y + 5*sin(5*t) - x) }
  local start = { x = 0, y = 0 }
  local exact = doubler:integrate { start = start, to = 4, rtol = 1e-11, atol = 1e-13, method = "radau" }
  expect(exact.status):equals "finished"
  for _, method in ipairs { "auto", "radau", "bdf", "rodas" } do
    for _, rtol in ipairs(tolerances(1e-4, 1e-8, 5)) do
      local sol = doubler:integrate { start = start, to = 4, rtol = rtol, method = method }
      expect(method .. rtol .. sol.status):equals(method .. rtol .. "finished")
      expect({ sol:final(x), sol:final(y) }):near({ exact:final(x), exact:final(y) }, 500*rtol)
    end
  end
end)

test("a string between two free bodies becomes taut", function()
  -- y falls from x by 1, then both go on with the mean of their speeds
  for _, size in ipairs { 1, 1e3, 1e-3 } do
    local string = dae { der(x) ~ v, der(v) ~ la, der(y) ~ w, der(w) ~ size - la, 0 ~ min(la, size + x - y) }
    for _, method in ipairs(every_method) do
      for _, rtol in ipairs { 1e-4, 1e-6, 1e-8 } do
        local sol = string:integrate { start = { x = 0, v = 0, y = 0, w = 0 }, to = 3, rtol = rtol,
          atol = 1e-3*rtol*size, method = method }
        local run = method .. " " .. rtol .. " "
        expect(run .. sol.status):equals(run .. "finished")
        expect(regimes(sol)[2]):near(math.sqrt(2), 50*rtol)
        local final = { sol:final(v)/size, sol:final(w)/size, sol:final(la)/size }
        expect(final):near({ 1.5, 1.5, 0.5 }, 100*rtol)
      end
    end
  end
end)

test("bodies leave where gap, its slope and its curvature vanish", function()
  -- a floor that lifts, until sin 3t = 1/2.7; a ball on a circle: no gap is negative beyond the tolerance
  local floor = dae { der(x) ~ v, der(v) ~ -1 + la, 0 ~ min(x - 0.3*sin(3*t), la) }
  local circle = dae { der(x) ~ v, der(y) ~ w, der(v) ~ 2*la*x, der(w) ~ -9.81 + 2*la*y,
    0 ~ min(la, x^2 + y^2 - 1) }
  for _, method in ipairs { "auto", "radau", "bdf", "rodas" } do
    for _, rtol in ipairs(tolerances(1e-3, 1e-8, 6)) do
      local run = method .. " " .. rtol .. " "
      local up = floor:integrate { start = { x = 0, v = 0.9 }, to = 6, rtol = rtol, method = method }
      expect(run .. up.status):equals(run .. "finished")
      local off = circle:integrate { start = { x = 0.1, y = 1.2, v = 0.5, w = 0 }, to = 1, rtol = rtol,
        method = method }
      expect(run .. off.status):equals(run .. "finished")
      for k = 0, 100 do
        expect(up(x - 0.3*sin(3*t), 0.06*k) > -100*rtol):equals(true)
        expect(off(x^2 + y^2 - 1, 0.01*k) > -100*rtol):equals(true)
      end
    end
  end
end)

test("no tolerance makes a solution where there is none", function()
  -- x would have to stop at 1 while x′ = 1: u ≥ 0 only drives it on
  local driven = dae { der(x) ~ 1 + u, 0 ~ min(u, 1 - x) }
  for _, rtol in ipairs { 1e-2, 1e-3, 1e-6, 1e-9 } do
    local sol = driven:integrate { start = { x = 0 }, to = 2, rtol = rtol }
    expect(sol.status):matches "stopped at t = 1: no regime of this piecewise model goes on"
  end
end)

test("drift() of a model with regimes says why it has no constraint", function()
  local x, v, f = vars "x_dr v_dr f_dr"
  local ball = dae { der(x) ~ v, der(v) ~ -9.81 + f, 0 ~ min(x, f) }
  local sol = ball:integrate { start = { [x] = 1, [v] = 0 }, to = 1 }
  expect(tostring(sol:drift())):matches "no constraint holds in every regime"
end)

-- Two capacitors are connected at t = 1. The charge is kept: Q = v + v³ and v + eᵛ.
test("impulses keep the charge of nonlinear capacitors", function()
  local a, b, i = vars "a_im b_im i_im"
  local function connected(factor, charge)
    local sol = dae { factor*der(a) ~ -i, der(b) ~ i, 0 ~ ifelse(lt(t, 1), i, a - b) }
      :integrate { start = { [a] = 1, [b] = 0 }, to = 2 }
    expect(sol.status):equals "finished"
    expect(sol:final(charge + b)):near(sol(charge + b, 0), 1e-9)
    return sol:final(a)
  end
  expect(connected(1 + 3*a^2, a + a^3)):near(0.770916997059, 1e-9)  -- the root of v³ + 2v = 2
  connected(1 + exp(a), a + exp(a))
end)

test("impulses whose factors change on their way are refused", function()
  local u, v, y, f = vars "u_im v_im y_im f_im"
  for _, friction in ipairs { -f*u, -f*u^2 } do
    local ball = dae { der(y) ~ v, der(u) ~ 1 + friction, der(v) ~ -10 + f, 0 ~ min(y, f) }
    local sol = ball:integrate { start = { [y] = 1, [u] = 0, [v] = 0 }, to = 2 }
    expect(sol.status):matches "the factor of f_im in the equations.*changes during the impulse"
    expect(sol.t[#sol.t]):near(math.sqrt(0.2), 1e-6)
  end
end)
