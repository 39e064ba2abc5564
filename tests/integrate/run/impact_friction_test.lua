-- Dry friction in proportion to a normal force: impacts, and normal forces that vanish.
local x, y, vx, vy, N = vars "x y vx vy N"
local methods = { "auto", "radau", "dopri5", "bdf" }

-- A body that falls from the height h in units L, S and meets the ground at √(2 g h).
local function fall(mu, L, S)
  return dae { der(x) ~ vx, der(y) ~ vy, S^2*der(vx) ~ -mu*N*sign(vx), S^2*der(vy) ~ -9.81*L + N,
    0 ~ min(y, N) }
end

test("an impact takes μ times its impulse from a body that slides, and stops one that is slow", function()
  for _, units in ipairs { { 1, 1 }, { 1e-6, 1e-4 }, { 1e3, 1e2 } } do
    local L, S = units[1], units[2]
    local speed, time = math.sqrt(2*9.81*0.5), math.sqrt(2*0.5/9.81)
    for _, case in ipairs { { 0.3, 4 }, { 0.3, -2 }, { 0.8, 2 }, { 0.5, 0 } } do
      local mu, v = case[1], case[2]
      local sys = fall(mu, L, S)
      local start = sys:init { fix = { x = 0, y = 0.5*L, vx = v*L/S, vy = 0 } }
      local side = v < 0 and -1 or 1
      local after = math.max(0, math.abs(v) - mu*speed)
      local slid = math.min(0.4, after/(mu*9.81))        -- until it rests, or the end
      for _, method in ipairs(methods) do
        local sol = sys:integrate { start = start, to = (time + 0.4)*S, method = method }
        expect(method .. " " .. sol.status):equals(method .. " finished")
        expect(sol(vx, (time + 1e-9)*S)*S/L):near(side*after, 1e-6)
        expect(sol(x, (time + 0.4)*S)/L):near(v*time + side*(after*slid - mu*9.81*slid^2/2), 1e-5)
        expect(sol(y, (time + 0.4)*S)/L):near(0, 1e-9)
      end
    end
  end
end)

-- What pushes on with the impulse is stronger than this friction, so that v does not stay where its sign
-- turns,
-- though the whole impulse could be held there.
test("impacts through which a body does not stay at rest are refused", function()
  for _, case in ipairs { { 2.2, -0.4*N*sign(vx) - 0.3*N*sign(vx - 1) }, { 4, -2*N - N*sign(vx) } } do
    local sys = dae { der(x) ~ vx, der(y) ~ vy, der(vx) ~ case[2], der(vy) ~ N - 9.81, 0 ~ min(y, N) }
    local start = sys:init { fix = { x = 0, vx = case[1], y = 0.2, vy = 0 } }
    local sol = sys:integrate { start = start, to = 0.3 }
    expect(sol.status):matches "the factor of N in the equations.*changes during the impulse"
    expect(sol.t[#sol.t]):near(math.sqrt(0.4/9.81), 1e-6)
  end
end)

test("a body at rest slides before the normal force has vanished, in a step that goes beyond", function()
  -- N = 1 - t: |F| = 1/2 = μ N at t = 1/2, then v′ = 1/2 - (1 - t)
  for _, sys in ipairs { dae { der(x) ~ vx, der(vx) ~ 1/2 - (1 - t)*sign(vx) },
    dae { der(x) ~ vx, der(vx) ~ 1/2 - N*sign(vx), N ~ 1 - t } } do
    local force = #sys.algebraic > 0 and N or 1 - t
    for _, method in ipairs { "auto", "radau", "dopri5", "bdf", "rodas", "verner98" } do
      local sol = sys:integrate { start = { x = 0, vx = 0 }, to = 4, method = method,
        events = { { when = force, direction = -1, action = "stop" } } }
      expect(method .. " " .. sol.status):equals(method .. " event")
      expect(sol.t[#sol.t]):near(1, 1e-9)
      expect(sol(vx, 1)):near(1/8, 1e-5)
    end
  end
end)

-- Random bodies on a table that is shaken, beside Moreau's time stepping.
local function shaken(seed)
  math.randomseed(seed)
  local r = math.random
  return { m = 0.5 + 2*r(), a = 12*r(), w = 0.5 + 3*r(), k = 6*r(), b = 19*r(), shake = 0.5 + 3*r(),
    mu = 0.1 + 0.7*r(), vx = 3*r() - 1.5, y = r() < 0.4 and r() or 0 }
end

local function stepped(M, to, h)
  local px, py, ux, uy = 0, M.y, M.vx, 0
  for step = 1, math.floor(to/h + 0.5) do
    local now = (step - 0.5)*h
    local qx, qy = px + h/2*ux, py + h/2*uy
    ux = ux + h*(M.a*math.sin(M.w*now) - M.k*qx)/M.m
    uy = uy + h*(M.b*math.sin(M.shake*now) - 9.81)
    if qy <= 0 then
      local impulse = math.max(0, -M.m*uy)
      uy = uy + impulse/M.m
      ux = ux + math.max(-M.mu*impulse, math.min(M.mu*impulse, -M.m*ux))/M.m
    end
    px, py = qx + h/2*ux, qy + h/2*uy
  end
  return px, py
end

test("random bodies on a shaken table", function()
  for seed = 1, 25 do
    local M = shaken(seed)
    local coarse, _ = stepped(M, 4, 8e-4)
    local fine, height = stepped(M, 4, 4e-4)
    local sys = dae { der(x) ~ vx, der(y) ~ vy, M.m*der(vx) ~ M.a*sin(M.w*t) - M.k*x - M.mu*N*sign(vx),
      M.m*der(vy) ~ M.m*(M.b*sin(M.shake*t) - 9.81) + N, 0 ~ min(y, N) }
    local start = sys:init { fix = { x = 0, y = M.y, vx = M.vx, vy = 0 } }
    for _, method in ipairs { "auto", "radau" } do
      local sol = sys:integrate { start = start, to = 4, method = method }
      expect(("%d %s %s"):format(seed, method, sol.status)):equals(("%d %s finished"):format(seed, method))
      expect(math.abs(sol(x, 4) - fine) <= 6*math.abs(fine - coarse) + 5e-3):equals(true)
      expect(math.abs(sol(y, 4) - height) <= 2e-2):equals(true)
    end
  end
end)
