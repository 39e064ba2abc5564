-- Conditions of events that a jump carries across their roots: at borders, jumps of inputs, changes of
-- regime.
local families = dofile "tests/families.lua"
local x, z, v, N = vars "x z v N"
local u = input "u"
local methods = families.with("auto", "dopri5", "verner98")

-- The event happens once, at this time, in the directions 0, 1 and 2, never in the direction -1.
local function once(name, model, options, when, at)
  for _, method in ipairs(methods) do
    for _, direction in ipairs { 0, 1, -1, 2 } do
      local count = 0
      local function run(event)
        event.when, event.direction = when, direction
        local request = { to = 2, method = method, events = { event } }
        for key, value in pairs(options) do request[key] = value end
        return model:integrate(request)
      end
      run { call = function() count = count + 1 end }
      local stopped = run { action = "stop" }
      local label = ("%s %s %d "):format(name, method, direction)
      expect(label .. count .. " " .. stopped.status)
        :equals(label .. (direction == -1 and "0 finished" or "1 event"))
      expect(stopped.t[#stopped.t]):near(direction == -1 and 2 or at, 1e-6)
    end
  end
end

test("at borders of the equations", function()
  local start = { start = { x = 0 } }
  once("factor", dae { der(x) ~ 1 }, start, sign(x - 1)*(x + 1), 1)
  once("z of x", dae { der(x) ~ 1, z ~ ifelse(gt(x, 1), 2, -1) }, start, z - 0.5, 1)
  once("z of t", dae { der(x) ~ z, z ~ ifelse(gt(t, 1), 2, -1) }, start, z - 0.5, 1)
  once("slope", dae { der(x) ~ ifelse(gt(t, 1), 2, -1) }, start, x.dot - 0.5, 1)
  local rubbing = dae { der(x) ~ v, der(v) ~ z, z ~ -4 - 2*sign(v) }
  once("friction", rubbing, { start = { x = 0, v = 3 } }, z + 5, 0.5)
end)

test("where inputs jump", function()
  local inputs = {
    samples = { t = { 0, 1, 2 }, u = { -1, 2, 2 }, hold = "zero" },
    value = function(s) return s < 1 and -1 or 2 end,
    expression = ifelse(lt(t, 1), -1, 2),
  }
  for name, given in pairs(inputs) do
    local options = { start = { x = 0 }, inputs = { [u] = given } }
    once(name, dae { der(x) ~ 1, z ~ u }, options, z - 0.5, 1)
    once(name, dae { der(x) ~ u }, options, x.dot - 0.5, 1)
  end
end)

test("where a body comes to a stop: its force jumps from 0 to its weight", function()
  local ball = dae { der(x) ~ v, der(v) ~ N - 9.81, 0 ~ min(x, N) }
  once("force", ball, { start = ball:init { fix = { x = 1, v = 0 } } }, N - 5, math.sqrt(2/9.81))
end)

test("a reset by such an event is done, and the run goes on", function()
  for _, method in ipairs(methods) do
    local sol = dae { der(x) ~ 1, z ~ ifelse(gt(x, 1), 2, -1) }:integrate { start = { x = 0 }, to = 4,
      method = method, events = { { when = z - 0.5, direction = 1, reset = { [x] = 0.5 } } } }
    expect(method .. " " .. sol.status):equals(method .. " finished")
    expect(#sol.events):equals(7)               -- at 1, 1.5 … 4
    expect(sol(x, 3.75)):near(0.75, 1e-8)
  end
end)

-- Two bodies side by side on springs, the second on ground with dry friction: where its velocity turns, the
-- force between them jumps below 0, and they part.
test("bodies that touch part where friction turns", function()
  local X, V, P = var("X", 2), var("V", 2), var "P"
  for order = 1, 2 do
    local list = { der(X[1]) ~ V[1], der(X[2]) ~ V[2], der(V[1]) ~ -X[1] - P,
      der(V[2]) ~ -2*X[2] - sign(V[2]) + P, 0 ~ min(X[2] - X[1], P) }
    if order == 2 then list = { list[5], list[3], list[4], list[1], list[2] } end
    local sys = dae(list)
    -- together: 2 X″ = -3 X - sign V, P = (X + sign V)/2, which is below 0 behind V = 0, as X = 0.83 there
    local start = sys:init { fix = { [X[1]] = 0.5, [V[1]] = 1, [X[2]] = 0.5, [V[2]] = 1 },
      guess = { [P] = 1 } }
    expect(start(P)):near(0.75, 1e-8)
    local w = math.sqrt(1.5)
    local turn = math.atan(1/w/(0.5 + 1/3))/w
    local top = math.sqrt((0.5 + 1/3)^2 + 1/1.5) - 1/3
    for _, method in ipairs(methods) do
      if method ~= "gauss" then
        local sol = sys:integrate { start = start, to = turn + 1, method = method, rtol = 1e-8 }
        expect(method .. " " .. sol.status):equals(method .. " finished")
        -- apart: X₁ = top cos s, X₂ = 1/2 + (top - 1/2) cos √2 s
        expect(sol(X[1], turn + 1)):near(top*math.cos(1), 1e-5)
        expect(sol(X[2], turn + 1)):near(0.5 + (top - 0.5)*math.cos(math.sqrt(2)), 1e-5)
        expect(sol(P, turn + 0.5)):near(0, 1e-9)
      end
    end
  end
end)
