-- What jumps exactly at the end of a run, or at a time that is asked for: values are those behind the jump.
local families = dofile "tests/families.lua"
local x, y, v, z, la, t = var "x", var "y", var "v", var "z", var "la", pendula.t
local r, k, q = input "r", param("k", 1), param("q", 2)
local methods = families.with("auto", "dopri5")

test("a regime that ends at `to` hands over to the next one", function()
  local pinned = dae { der(x) ~ 1 + z, 0 ~ ifelse(lt(t, 1), z, x - 3) }   -- index 1, from t = 1 on 2
  for _, method in ipairs(methods) do
    local before = pinned:integrate { start = { x = 0 }, to = 1 - 1e-9, method = method }
    expect(before(x, 1 - 1e-9)):near(1, 1e-7)
    expect(#before:switches()):equals(1)
    for _, to in ipairs { 1, 1 + 1e-9, 1.5 } do
      local sol = pinned:integrate { start = { x = 0 }, to = to, method = method }
      expect(sol.status):equals "finished"
      expect(sol:final(x)):near(3, 1e-12)
      expect(sol:final(z)):near(-1, 1e-12)
      expect(#sol:switches()):equals(2)
    end
  end
end)

test("a plastic impact at `to`, with and without an event, in every unit", function()
  for _, unit in ipairs { 1, 1e-3, 1e3, 1e-9 } do
    local g = 9.81*unit
    local ball = dae { der(y) ~ v, der(v) ~ -g + la, 0 ~ min(y, la) }
    for _, method in ipairs { "auto", "radau", "bdf" } do
      local sol = ball:integrate { start = { y = g/2, v = 0 }, to = 1, method = method, rtol = 1e-8,
        atol = 1e-11*unit }
      expect(sol.status):equals "finished"
      if math.abs(sol:final(y)) < 1e-13*unit then  -- errors may bring it there a little later
        expect(sol:final(v)/g):near(0, 1e-12)
        expect(sol:final(la)/g):near(1, 1e-12)
      else
        expect(#sol:switches()):equals(1)
      end
    end
  end
  local g, times = 9.81, { 0, 0.5, 1, 1.2 }
  local ball = dae { der(y) ~ v, der(v) ~ -g + la, 0 ~ min(y, la) }
  for _, method in ipairs { "auto", "radau" } do  -- exact for parabolas
    local sol = ball:integrate { start = { y = g/2, v = 0 }, to = 1.2, times = times, method = method }
    expect(sol(v)/g):near(vec { 0, -0.5, 0, 0 }, 1e-5)
    local bounced = ball:integrate { start = { y = g/2, v = 0 }, times = times, method = method,
      events = { { when = y, direction = -1, reset = { [v] = -0.5*v } } } }
    expect(bounced(v)/g):near(vec { 0, -0.5, 0.5, 0.3 }, 1e-5)
  end
end)

test("branches that jump at a time that is asked for, or at the end", function()
  for _, condition in ipairs { lt(t, 1), lt(x, 1), le(x, 1) } do
    local m = dae { der(x) ~ 1, der(y) ~ z, 0 ~ z - ifelse(condition, 0, 1) }
    for _, method in ipairs(methods) do
      local at = m:integrate { start = { x = 0, y = 0 }, times = { 0, 0.5, 1, 2 }, method = method }
      expect(at(z)):near(vec { 0, 0, 1, 1 }, 1e-12)
      expect(at(y)):near(vec { 0, 0, 0, 1 }, 1e-7)
      local whole = m:integrate { start = { x = 0, y = 0 }, to = 2, method = method }
      expect(whole(z, 1 - 1e-7)):equals(0)
      expect(whole(z, 1)):equals(1)
      expect(whole(y.dot, 1)):near(1, 1e-12)
      expect(m:integrate { start = { x = 0, y = 0 }, to = 1, method = method }:final(z)):equals(1)
    end
  end
end)

test("inputs that jump: every saved point satisfies the equations", function()
  local m = dae { der(x) ~ -k*x + r, 0 ~ z - x - q*r }
  local n, u, exact, state = 20, {}, {}, 0
  for i = 1, n + 1 do
    u[i] = i % 3 + 1
    exact[i] = state + 2*u[i]
    state = math.exp(-0.1)*state + (1 - math.exp(-0.1))*u[i]
  end
  local times, hold = linspace(0, 2, n + 1), { t = linspace(0, 2, n + 1), u = u, hold = "zero" }
  local function stairs(at) return u[math.floor(10*at + 1e-9) + 1] end
  for _, law in ipairs { hold, stairs } do
    for _, sensitivities in ipairs { {}, { k, q } } do
      for _, method in ipairs(methods) do
        local sol = m:integrate { start = { x = 0 }, times = times, inputs = { [r] = law }, method = method,
          sensitivities = #sensitivities > 0 and sensitivities or nil, rtol = 1e-8 }
        expect(sol(z)):near(vec(exact), 1e-5)
      end
    end
  end
  local fixed = m:integrate { start = { x = 0 }, times = times, inputs = { [r] = hold }, dt = 0.1,
    method = rk.gauss(3) }
  expect(fixed(z)):near(vec(exact), 1e-9)
  local found = fit(m, { params = { k, q }, data = iddata { y = exact, u = u, Ts = 0.1 }, y = z,
    start = { x = 0 }, guess = { k = 0.5, q = 0.5 } })
  expect(found.theta):near(vec { 1, 2 }, 1e-6)
end)

test("where nothing goes on behind `to`, the run is finished with the values before", function()
  local m = dae { der(x) ~ 1, 0 ~ ifelse(lt(t, 1), z - 1, z^2 + 1) }
  local sol = m:integrate { start = { x = 0, z = 1 }, to = 1 }
  expect(sol.status):equals "finished"
  expect(sol:final(z)):equals(1)
end)

-- Balls of one mass hand their velocities over: as many leave on one side as have come on the other.
test("Newton's cradle: balls that touch at rest are hit in turn", function()
  for _, n in ipairs { 2, 3, 5 } do
    local X, V, laws, blows, x0 = var("X", n), var("V", n), {}, {}, {}
    for i = 1, n do
      laws[2*i - 1], laws[2*i] = der(X[i]) ~ V[i], der(V[i]) ~ -X[i]
      if i < n then
        blows[i] = { when = X[i + 1] - X[i], direction = -1,
          reset = { [V[i]] = V[i + 1], [V[i + 1]] = V[i] } }
      end
    end
    for _, method in ipairs { "auto", "dopri5", "radau", "bdf" } do
      for _, unit in ipairs { 1, 1e-3, 1e3 } do
        for i = 1, n do x0[i] = i == 1 and -unit or 0 end
        local sol = dae(laws):integrate { start = { [X] = x0, [V] = zeros(n, 1) }, to = 9, events = blows,
          method = method, rtol = 1e-8 }
        expect(sol.status):equals "finished"
        expect(#sol.events):equals(3*(n - 1))
        for _, at in ipairs { 1, 2, 3, 4, 5, 6, 7, 8, 9 } do
          local right = math.floor((at + math.pi/2)/math.pi) % 2 == 1
          for i = 1, n do
            local swings = right and i == n or not right and i == 1
            expect(sol(X[i], at)/unit):near(swings and -math.cos(at) or 0, 2e-6)
          end
        end
      end
    end
  end
end)

test("two balls onto one, and blows that are not elastic", function()
  local X, V, laws = var("X", 3), var("V", 3), {}
  for i = 1, 3 do laws[2*i - 1], laws[2*i] = der(X[i]) ~ V[i], der(V[i]) ~ 0 end
  for _, e in ipairs { 1, 0.8, 0.5, 0.3 } do
    local blows = {}
    for i = 1, 2 do
      local mean, half = (V[i] + V[i + 1])/2, e*(V[i] - V[i + 1])/2
      blows[i] = { when = X[i + 1] - X[i], direction = -1,
        reset = { [V[i]] = mean - half, [V[i + 1]] = mean + half } }
    end
    for _, start in ipairs { { -1, 0, 0 }, { -1, -1, 0 } } do
      local speeds = { 1, start[2] == -1 and 1 or 0, 0 }
      local sol = dae(laws):integrate { start = { [X] = start, [V] = speeds }, to = 3, events = blows }
      local total, last = 0, -math.huge
      for i = 1, 3 do
        total = total + sol:final(V[i])
        expect(sol:final(X[i]) >= last - 1e-7):equals(true)    -- none passes through another
        last = sol:final(X[i])
      end
      expect(total):near(speeds[1] + speeds[2], 1e-9)
    end
  end
end)
