-- States that fall below their tolerance and grow again (src/integrate/solution/regrowth.hpp): every method
-- follows them there, or the run says that an error decides what follows.

local methods = { "auto", "radau", "gauss", "bdf", "rodas", "rodas5p", "dopri5", "tsit5", "dop853",
  "verner87" }
local object = { rodas5p = rosenbrock.rodas5p }

local function run(sys, method, options)
  options.method = object[method] or method ~= "auto" and method or nil
  return sys:integrate(options)
end

--- Tolerances by which the last value of a state differs from the true one. Relative errors of a state that
--- keeps rtol alone add up over its steps.
local function off(sol, state, value, rtol) return math.abs(sol:final(state)/value - 1)/rtol end

test("a growth rate that changes its sign: x' = (t - T) x is 1 again at 2 T, whatever it was in between", function()
  local x = var "x"
  for _, T in ipairs { 8, 12, 20 } do
    local sys = dae { der(x) ~ (t - T)*x }
    for _, method in ipairs(methods) do
      for _, rtol in ipairs { 1e-4, 1e-7 } do
        local sol = run(sys, method, { start = { [x] = 1 }, to = 2*T, rtol = rtol })
        expect(sol.status):equals "finished"
        local bound = method == "bdf" and 3000 or 1000
        expect(off(sol, x, 1, rtol) < bound):is_true()
      end
    end
  end
end)

test("what falls below the smallest numbers cannot be followed, and the run says so", function()
  local x = var "x"
  local sol = dae { der(x) ~ (t - 40)*x }:integrate { start = { [x] = 1 }, to = 80 }    -- e^-800
  expect(tostring(sol)):matches "smaller than the smallest numbers"
end)

test("an epidemic with seasons: the infected are followed between the outbreaks", function()
  local S, I = vars "S I"
  local contact = 60*(1 + 0.2*cos(2*math.pi*t))
  local sys = dae { der(S) ~ 0.02*(1 - S) - contact*S*I, der(I) ~ contact*S*I - 13*I }
  -- the same in ln I, by another method
  local u, v = vars "u v"
  local logs = dae { der(u) ~ 0.02*(1 - u) - contact*u*exp(v), der(v) ~ contact*u - 13 }
  local truth = logs:integrate { start = { [u] = 0.3, [v] = math.log(1e-3) }, to = 30, rtol = 1e-11,
    method = "dop853" }
  for _, method in ipairs(methods) do
    for _, rtol in ipairs { 1e-3, 1e-5, 1e-7 } do
      local sol = run(sys, method, { start = { [S] = 0.3, [I] = 1e-3 }, to = 30, rtol = rtol })
      expect(sol.status):equals "finished"
      expect(off(sol, I, math.exp(truth:final(v)), rtol) < 1000):is_true()
    end
  end
end)

test("two classes of the infected vanish together only, also where one of them begins at 0", function()
  local S, E, I = vars "S E I"
  local contact = ifelse(gt(sin(2*math.pi*t), 0), 700, 200)
  local sys = dae { der(S) ~ 0.1*(1 - S) - contact*S*I, der(E) ~ contact*S*I - 40*E, der(I) ~ 40*E - 100*I }
  for _, at_first in ipairs { 1e-3, 0 } do            -- between two outbreaks I falls to 10⁻¹⁷
    local start = { [S] = 0.5, [E] = 1e-3, [I] = at_first }
    local truth = sys:integrate { start = start, to = 12, rtol = 1e-11, atol = 1e-26, method = "dop853" }
    for _, method in ipairs(methods) do
      local sol = run(sys, method, { start = start, to = 12, rtol = 1e-6 })
      expect(sol.status):equals "finished"
      expect(off(sol, I, truth:final(I), 1e-6) < 1000):is_true()
      expect(tostring(sol:stats())):matches "E, I were smaller than the tolerance"
    end
  end
end)

test("with an atol of the caller, or functions of the caller, the run goes on and says so", function()
  local x = var "x"
  local sys = dae { der(x) ~ (t - 12)*x }
  local sol = sys:integrate { start = { [x] = 1 }, to = 24, atol = 1e-9 }
  expect(tostring(sol)):matches "x was smaller than the tolerance at t = .*an error there decides what follows"
  local calls = 0
  sol = sys:integrate { start = { [x] = 1 }, to = 24, method = "dopri5",
    events = { { when = t - 23.5, call = function() calls = calls + 1 end } } }
  expect(calls):equals(1)
  expect(tostring(sol)):matches "take atol = { %[x%] = 1e%-290 }"
end)

test("what decays, and jumps by events, is no growth; oscillations that die out are none", function()
  local x, v = vars "x v"
  local doses = dae { der(x) ~ -50*x }:integrate { start = { [x] = 1 }, to = 10,
    events = { { when = sin(math.pi*t), reset = { [x] = x + 1 } } } }
  expect(tostring(doses:stats()):find "grew again" == nil):is_true()
  for _, k in ipairs { 1, 1e4, 1e8 } do
    local sol = dae { der(x) ~ v, der(v) ~ -k*x - sqrt(k)*v/5 }:integrate { start = { [x] = 1, [v] = 0 },
      to = 600/math.sqrt(k), rtol = 1e-4 }
    expect(tostring(sol:stats()):find "grew again" == nil):is_true()
  end
  local fast = dae { der(x) ~ -1e6*x, der(v) ~ -v + x }:integrate { start = { [x] = 1, [v] = 1 }, to = 5 }
  expect(tostring(fast:stats()):find "grew again" == nil):is_true()
  expect(fast:stats().steps < 200):is_true()
end)

-- 3e-8: 30 tolerances
test("sweeps follow them, too", function()
  local x, T = var "x", param "T"
  local list = {}
  for k = 1, 12 do list[k] = 6 + k end
  local runs = sweep(dae { der(x) ~ (t - T)*x }, { start = { [x] = 1 }, to = 24, params = { [T] = list } })
  for k = 1, #list do
    local exact = math.exp(24^2/2 - 24*list[k])
    expect(math.abs(runs[k]:final(x) - exact) <= 1e-3*exact + 3e-8):is_true()
  end
end)

test("Dahlquist's knee: no step leads through 0 to the branch that repels", function()
  local x = var "x"
  local knee = dae { der(x) ~ ((1 - t)*x - x^2)/1e-6 }
  for _, method in ipairs(methods) do
    if not ({ dopri5 = 1, tsit5 = 1, dop853 = 1, verner87 = 1 })[method] then         -- a million steps
      for _, rtol in ipairs { 1e-2, 1e-3, 1e-4, 1e-6 } do
        local sol = run(knee, method, { start = { [x] = 1 }, to = 2, rtol = rtol })
        expect(sol.status):equals "finished"
        expect(sol:final(x)):near(0, 1e-5)
      end
    end
  end
end)

test("through algebraic unknowns, in other units", function()
  local S, I, f, g = vars "S I f g"
  for _, unit in ipairs { { 1, 1 }, { 1e-6, 1e-3 }, { 1e6, 1e6 } } do
    local U, T = unit[1], unit[2]
    local contact = 60/U*(1 + 0.2*cos(2*math.pi*t/T))
    local sys = dae { T*der(S) ~ 0.02*(U - S) - f, T*der(I) ~ f - 13*I, f ~ g*S, g ~ contact*I }
    local sol = sys:integrate { start = { [S] = 0.3*U, [I] = 1e-3*U }, to = 30*T, rtol = 1e-5 }
    expect(sol:final(I)/U):near(2.41915e-4, 1e-8)               -- by ln I, as above
  end
end)

--- Prey and predators in patches, the prey wandering between neighbours: they can vanish in all patches only.
local function patches(n)
  local x, y = var("x", n), var("y", n)
  local equations, start = {}, { [x] = {}, [y] = {} }
  for i = 1, n do
    local wandering = 0.01*(x[i % n + 1] - 2*x[i] + x[(i - 2) % n + 1])
    equations[2*i - 1] = der(x[i]) ~ x[i]*(1 - x[i]/10) - x[i]*y[i]/(1 + x[i]) + wandering
    equations[2*i] = der(y[i]) ~ 0.5*x[i]*y[i]/(1 + x[i]) - 0.1*y[i]
    start[x][i], start[y][i] = 5 + 0.1*i, 1
  end
  return dae(equations), start, x, y
end

test("large sets of states that vanish together only: prey in patches", function()
  for _, n in ipairs { 3, 10, 30 } do                  -- they fall to 10⁻²⁴
    local sys, start, x, y = patches(n)
    local truth = sys:integrate { start = start, to = 300, rtol = 1e-10, atol = 1e-200 }
    for _, method in ipairs { "auto", "radau", "dopri5" } do
      for _, rtol in ipairs { 1e-3, 1e-6 } do
        local sol = run(sys, method, { start = start, to = 300, rtol = rtol })
        expect(sol.status):equals "finished"
        expect(off(sol, y[n], truth:final(y[n]), rtol) < 100):is_true()
        expect(tostring(sol:stats())):matches "were smaller than the tolerance at t = .* and grew again"
      end
    end
  end
end)

test("the towns of an epidemic on a graph, with three classes each, and its remedy", function()
  local n = 8
  local S, E, I = var("S", n), var("E", n), var("I", n)
  local contact, equations = 1 + 0.3*cos(2*math.pi*t), {}
  local start = { [S] = {}, [E] = {}, [I] = {} }
  for i = 1, n do
    local force = 299*contact*I[i]
    for j = 1, n do force = force + contact*I[j] end
    equations[#equations + 1] = der(S[i]) ~ 0.1*(1 - S[i]) - force*S[i]
    equations[#equations + 1] = der(E[i]) ~ force*S[i] - 40*E[i]
    equations[#equations + 1] = der(I[i]) ~ 40*E[i] - 100*I[i]
    start[S][i], start[E][i], start[I][i] = 0.5 + 0.05*i, 0, i == 1 and 1e-3 or 0
  end
  local sys = dae(equations)
  local truth = sys:integrate { start = start, to = 40, rtol = 1e-10, atol = 1e-30, method = "dop853" }
  for _, method in ipairs { "auto", "radau", "bdf" } do
    local sol = run(sys, method, { start = start, to = 40, rtol = 1e-4 })
    expect(off(sol, I[n], truth:final(I[n]), 1e-4) < 100):is_true()
  end
  local told = sys:integrate { start = start, to = 40, rtol = 1e-4, atol = 1e-5 }
  expect(tostring(told)):matches "and 13 other states were smaller than the tolerance"
  expect(tostring(told)):matches "take atol = 1e%-290"
end)

test("sets that a product leaves open, and sums that vanish for other reasons", function()
  local a, b, c, d = vars "a b c d"
  -- {a, b} or {a, c}: a needs b c = 0; b is fed, c is not
  local sys = dae { der(a) ~ (t - 12)*a + b*c, der(b) ~ 1 - b, der(c) ~ (t - 12)*c, der(d) ~ a - d }
  for _, method in ipairs { "auto", "radau" } do
    local sol = run(sys, method, { start = { a = 1, b = 1, c = 0, d = 0 }, to = 24, rtol = 1e-6 })
    expect(off(sol, a, 1, 1e-6) < 1000):is_true()
  end
end)
