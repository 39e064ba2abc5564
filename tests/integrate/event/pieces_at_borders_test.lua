-- Pieces of equations where their border is: functions whose domain ends there, or does not, and pieces that
-- have no value on it.
local families = dofile "tests/families.lua"
local methods = families.with("auto", "dopri5")

--- y′ = f(x) from x = -1 up and from x = 3 down, by every method; up, down: ∫ f.
local function crossed(name, f, x, y, up, down)
  test(name, function()
    local up_and_down = { { from = -1, speed = 1, integral = up }, { from = 3, speed = -1, integral = down } }
    for _, way in ipairs(up_and_down) do
      for _, method in ipairs(methods) do
        local sol = dae { der(x) ~ way.speed, der(y) ~ f }:integrate { to = 4, rtol = 1e-7, atol = 1e-9,
          method = method, start = { [x] = way.from, [y] = 0 } }
        expect(sol.status):equals "finished"
        expect(sol(y, 4)):near(way.integral, 2e-5)
      end
    end
  end)
end

local x, y = vars "x y"
local r = param "r"
-- Si(2) = 1.6054129768026948 (Abramowitz & Stegun, table 5.1)
crossed("sin(s)/s behind s = 0", ifelse(gt(x, 1), sin(x - 1)/(x - 1), 1), x, y,
  2 + 1.6054129768026948, 1.6054129768026948 + 2)
crossed("s²/(2s) behind s = 0", ifelse(le(x, 1), 0, (x - 1)^2/(2*(x - 1))), x, y, 1, 1)
crossed("two pieces that vanish together",
  ifelse(gt(x, 1), (x - 1)*max(x - 1, 0)/((x - 1) + max(x - 1, 0)), 0), x, y, 1, 1)
crossed("s log s", ifelse(gt(x, 1), (x - 1)*log(x - 1), 0), x, y, 2*math.log(2) - 1, 2*math.log(2) - 1)
-- a jump beside a root that is defined all around it, and one beside a root that ends on it
crossed("a jump beside √(9 - (x - 1)²)", ifelse(lt(x, 1), 1, 2 + sqrt(9 - (x - 1)^2)), x, y,
  2 + 4 + math.sqrt(5) + 4.5*math.asin(2/3), 2 + 4 + math.sqrt(5) + 4.5*math.asin(2/3))
crossed("a jump beside √(x - 1)", ifelse(lt(x, 1), 1, 2 + sqrt(x - 1)), x, y,
  2 + 4 + 2/3*2^1.5, 2 + 4 + 2/3*2^1.5)

crossed("arccos between its ends", ifelse(lt(abs(x - 1), 1), acos(x - 1), 0), x, y, math.pi, math.pi)

test("a root that vanishes with the border on one solution only", function()
  local s, w = vars "s w"
  local sys = dae { der(s) ~ r, der(w) ~ r, der(y) ~ ifelse(lt(s, 0), 1, 2 + sqrt(w)) }
  for _, way in ipairs { 1, -1 } do
    for _, method in ipairs(methods) do
      local sol = sys:integrate { params = { [r] = way }, start = { [s] = -way, [w] = -way, [y] = 0 }, to = 2,
        rtol = 1e-7, atol = 1e-9, method = method }
      expect(sol.status):equals "finished"
      expect(sol(y, 2)):near(1 + 2 + 2/3, 2e-5)
    end
  end
end)

test("a piece that is not defined behind its border ends the run there", function()
  local sys = dae { der(x) ~ 1, der(y) ~ ifelse(lt(x, 0), 1, sqrt(x - 1)) }
  for _, method in ipairs(methods) do
    local sol = sys:integrate { start = { [x] = -1, [y] = 0 }, to = 3, method = method }
    expect(sol.status):matches "stopped at t = 1: .*not defined"
  end
end)

--- Water tube system, index 2, 49 unknowns, 18 pipes that are laminar below a Reynolds number of 2300 and
--- turbulent above, where friction jumps: Mazzia & Magherini, Test Set for Initial Value Problem Solvers.
local function water_tube()
  local pipes = { { 1, 2 }, { 2, 3 }, { 2, 6 }, { 3, 4 }, { 3, 5 }, { 4, 5 }, { 5, 10 }, { 6, 5 }, { 7, 4 },
    { 7, 8 }, { 8, 5 }, { 8, 10 }, { 9, 8 }, { 11, 9 }, { 11, 12 }, { 12, 7 }, { 12, 8 }, { 13, 11 } }
  local nu, g, rho, critical, length, roughness, d, b = 1.31e-6, 9.8, 1e3, 2.3e3, 1e3, 2e-4, 1, 200
  local phi, lambda, p = var("phi", 18), var("lambda", 18), var("p", 13)
  local area, hour, net, equations = pi*d^2/4, t/3600, {}, {}
  for node = 1, 13 do net[node] = 0 end
  local rain = 1 - cos(exp(-hour) - 1)
  net[1], net[13], net[10] = rain/200, rain/80, -hour^2*(3*hour^2 - 92*hour + 720)/1e6
  local still = {}
  for i, pipe in ipairs(pipes) do
    local from, to = pipe[1], pipe[2]
    local reynolds = abs(phi[i]*d/(nu*area))
    local loss = ifelse(gt(reynolds, critical), lambda[i]*rho*length*phi[i]^2/(area^2*d),
      32*nu*rho*length*phi[i]/(area*d^2))
    equations[#equations + 1] = rho*length/area*der(phi[i]) ~ p[from] - p[to] - loss
    equations[#equations + 1] = 0 ~ 1/sqrt(lambda[i]) - 1.74
      + 2*log(2*roughness/d + 18.7/(max(reynolds, critical)*sqrt(lambda[i])))/log(10)
    net[from], net[to], still[i] = net[from] - phi[i], net[to] + phi[i], 0
  end
  for node = 1, 13 do
    local stores = node == 5 or node == 8
    equations[#equations + 1] = stores and b/(rho*g)*der(p[node]) ~ net[node] or 0 ~ net[node]
  end
  return dae(equations), { [phi] = still, [p[5]] = 109800, [p[8]] = 109800 }, phi, p
end

test("pipes whose flow becomes turbulent, by every method", function()
  local sys, start, phi, p = water_tube()
  expect(sys:index()):equals(2)
  local run = sys:reduce()
  for _, method in ipairs(families.with("auto", "dopri5")) do
    local sol = run:integrate { start = start, to = 61200, rtol = 1e-7, method = method }
    expect(sol.status):equals "finished"
    expect(sol:final(phi[1])):near(0.2298488296477430e-2, 2e-6)
    expect(sol:final(phi[4])):near(0.1589620100314825e-3, 2e-6)
    expect(sol:final(phi[18])):near(0.5746220741193575e-2, 2e-6)
    expect(sol:final(p[5])):near(0.1111268591478108e6, 1e-2)
    expect(sol:final(p[13])):near(0.1111298338971779e6, 1e-2)
  end
end)

-- at first loops of pipes have no flow but that of rounding errors, which crosses 0 in one after the other
test("pipes without a flow, whose borders are crossed by rounding, at many tolerances", function()
  local sys, start, phi = water_tube()
  local largest = 0.5746220741193575e-2
  for _, case in ipairs { { "radau", -4.1 }, { "radau", -4.2 }, { "radau", -5 }, { "rodas", -3 },
    { "rodas", -3.1 }, { "rodas", -4 } } do
    local rtol = 10^case[2]
    local sol = sys:reduce():integrate { start = start, to = 61200, rtol = rtol, method = case[1] }
    expect(sol.status):equals "finished"
    expect(sol:final(phi[1])):near(0.2298488296477430e-2, 100*rtol*largest)
    expect(sol:final(phi[11])):near(0.9416978549524347e-3, 100*rtol*largest)
    expect(sol:final(phi[18])):near(largest, 100*rtol*largest)
  end
  for _, case in ipairs { { "dummy", "radau" }, { "dummy", "gauss" }, { "minimal", "bdf" } } do
    local sol = sys:reduce(case[1]):integrate { start = start, to = 61200, rtol = 1e-4, method = case[2] }
    expect(sol.status):equals "finished"
    expect(sol:final(phi[11])):near(0.9416978549524347e-3, 1e-2*largest)
  end
end)

--- Charge pump, index 2: a transistor whose charges are pieces with a common border, on which they are 0/0.
--- The same test set; in ns, its current in C/ns.
local function charge_pump()
  local vt0, gamma, phi, cox, capd, caps = 0.2, 0.035, 1.01, 4e-12, 0.4e-12, 1.6e-12
  local Y1, YS, Y3, YD, Y5, U1, U2, U3, I = vars "Y1 YS Y3 YD Y5 U1 U2 U3 I"
  local function ramp(from) return 2*(max(t - from, 0) - max(t - from - 10, 0)) end
  local drive = ramp(50) - ramp(110)
  local higher, lower = max(U1 - U2, U1 - U3), min(U1 - U2, U1 - U3)
  local body = sqrt(phi - (higher - U1))
  local flat, threshold = vt0 - gamma*sqrt(phi) - phi, vt0 + gamma*(body - sqrt(phi))
  local a, b = higher - threshold, max(lower - threshold, 0)
  local h = a + b - a*b/(a + b)
  local gate = ifelse(le(U1, flat), cox*(U1 - flat), ifelse(le(higher, threshold),
    cox*gamma*(sqrt(gamma^2/4 + U1 - flat) - gamma/2), cox*(2*h/3 + gamma*body)))
  local side = ifelse(le(U1, flat), 0, ifelse(le(higher, threshold), 0, -cox*h/3))
  local sys = dae { der(Y1) ~ -I, der(YS) + der(Y3) ~ 0, der(YD) + der(Y5) ~ 0, 0 ~ U1 - drive, 0 ~ Y1 - gate,
    0 ~ YS - caps*U2, 0 ~ Y3 - side, 0 ~ YD - capd*U3, 0 ~ Y5 - side }
  return sys, { Y1 = Y1, YS = YS, Y3 = Y3, YD = YD, Y5 = Y5, U1 = U1, U2 = U2, U3 = U3, I = I }
end

test("a charge pump, whose pieces are 0/0 where they begin", function()
  local sys, u = charge_pump()
  expect(sys:index()):equals(2)
  local run, first = sys:reduce(), nil
  local charge, volt = 1e-20, 1e-8
  for _, method in ipairs { "radau", "auto", "rodas", "dopri5" } do
    local sol = run:integrate { start = { [u.YS] = 0, [u.YD] = 0 }, to = 118, method = method, rtol = 1e-7,
      atol = { [u.Y1] = charge, [u.YS] = charge, [u.Y3] = charge, [u.YD] = charge, [u.Y5] = charge,
        [u.U1] = volt, [u.U2] = volt, [u.U3] = volt } }
    expect(sol.status):equals "finished"
    first = first or sol
    for _, unknown in ipairs { u.U2, u.U3, u.Y1 } do
      for _, at in ipairs { 50.2, 55, 100, 118 } do
        local value = first(unknown, at)
        expect(sol(unknown, at)):near(value, 1e-4*math.abs(value) + (unknown == u.Y1 and 0 or 1e-5))
      end
    end
  end
end)
