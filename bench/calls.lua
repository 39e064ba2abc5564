-- The price of a call: a model built and integrated for the first time, again with another start, other
-- parameters and tolerances, and by sys:prepare; ms, and the part of the second call that is not steps.
--     pendula bench/calls.lua [words of a name]
-- Times are the least of several series, taken in turn; on a loaded machine they vary by a half.
local wanted = table.concat(arg, " ")
local x, y, z, v = vars "x y z v"
local k = param("k", 1)
local el, ro = components.electrical, components.rotational

local function oscillator(options)
  return function()
    local sys = dae { der(x) ~ v, der(v) ~ -k*x }
    return sys, function(c, run)
      local all = { start = { [x] = c, [v] = 0 }, params = { [k] = c }, to = 0.1, rtol = 1e-4*c }
      if not run then for name, value in pairs(options) do all[name] = value end end
      return all
    end, options
  end
end

local function plain(sys, start, more)
  return sys, function(c, run)
    local all = { start = start(c), params = { [k] = c }, to = 0.1, rtol = 1e-4*c }
    if not run then for name, value in pairs(more or {}) do all[name] = value end end
    return all
  end, more or {}
end

local function pendulum(form)
  return function()
    local q, p, u, w, la = vars "q p u w la"
    local sys = dae { der(q) ~ u, der(p) ~ w, der(u) ~ -la*q, der(w) ~ -la*p - k, 0 ~ q^2 + p^2 - 1 }
    return plain(sys:reduce(form), function(c)
      return { [q] = math.sin(c/10), [p] = -math.cos(c/10), [u] = 0, [w] = 0 }
    end)
  end
end

local function double_pendulum(form)
  return function()
    local a, b = var("a", 2), var("b", 2)
    local sys = lagrange { q = { a, b }, T = a.dot.T*a.dot/2 + b.dot.T*b.dot/2, V = k*(a[2] + b[2]),
      C = { a.T*a - 1, (b - a).T*(b - a) - 1 } }
    return plain(sys:reduce(form), function(c)
      return { [a] = { math.sin(c/5), -math.cos(c/5) },
        [b] = { math.sin(c/5) + math.sin(c/3), -math.cos(c/5) - math.cos(c/3) }, [a.dot] = { 0, 0 },
        [b.dot] = { 0, 0 } }
    end)
  end
end

local function samples()
  local list = { t = {}, u = {} }
  for i = 0, 40 do list.t[i + 1], list.u[i + 1] = i/100, math.sin(i) end
  list.hold = "linear"
  return list
end

local kinds = {
  { "oscillator", oscillator {} },
  { "oscillator, dopri5", oscillator { method = "dopri5" } },
  { "oscillator, radau", oscillator { method = "radau" } },
  { "oscillator, bdf", oscillator { method = "bdf" } },
  { "oscillator, rodas", oscillator { method = "rodas" } },
  { "oscillator, sensitivities", oscillator { sensitivities = { k } } },
  { "oscillator, event", oscillator { events = { { when = x - 1.001, action = "stop" } } } },
  { "bouncing ball", function()
    return plain(dae { der(x) ~ v, der(v) ~ -k }, function(c) return { [x] = c*1e-3, [v] = 0 } end,
      { events = { { when = x, direction = -1, reset = { [v] = -0.9*v } } } })
  end },
  { "index 1, x and z", function()
    return plain(dae { der(x) ~ -k*x + z, 0 ~ z + z^3 - x }, function(c) return { [x] = c } end)
  end },
  { "index 1, radau", function()
    return plain(dae { der(x) ~ -k*x + z, 0 ~ z + z^3 - x }, function(c) return { [x] = c } end,
      { method = "radau" })
  end },
  { "border max(x, 1)", function()
    return plain(dae { der(x) ~ -k*max(x, 1) }, function(c) return { [x] = c } end)
  end },
  { "border with a parameter", function()
    return plain(dae { der(x) ~ v, der(v) ~ -x - max(x - k, 0) }, function(c) return { [x] = c, [v] = 1 } end)
  end },
  { "relay, sign(x - k)", function()
    return plain(dae { der(x) ~ v, der(v) ~ -sign(x - k) - v }, function(c)
      return { [x] = c + 0.02, [v] = -1 }
    end)
  end },
  { "input, expression", function()
    local u = input "u"
    return plain(dae { der(x) ~ v, der(v) ~ -k*x + u }, function(c) return { [x] = c, [v] = 0 } end,
      { inputs = { [u] = sin(3*t) } })
  end },
  { "input, function", function()
    local u = input "u"
    return plain(dae { der(x) ~ v, der(v) ~ -k*x + u }, function(c) return { [x] = c, [v] = 0 } end,
      { inputs = { [u] = function(s) return math.sin(3*s) end } })
  end },
  { "input, samples", function()
    local u = input "u"
    return plain(dae { der(x) ~ v, der(v) ~ -k*x + u }, function(c) return { [x] = c, [v] = 0 } end,
      { inputs = { [u] = samples() } })
  end },
  { "pendulum, acc", pendulum "acc" }, { "pendulum, project", pendulum "project" },
  { "pendulum, ggl", pendulum "ggl" }, { "pendulum, dummy", pendulum "dummy" },
  { "pendulum, array", pendulum "array" },
  { "double pendulum, project", double_pendulum "project" },
  { "double pendulum, ggl", double_pendulum "ggl" },
  { "double pendulum, dummy", double_pendulum "dummy" },
  { "circuit of parts", function()
    local m = model { V = el.source { v = 1 }, R = el.resistor { R = k }, L = el.inductor { L = 0.1 },
      C = el.capacitor { C = 0.01 }, g = el.ground {}, connect("V.p", "R.p"), connect("R.n", "L.p"),
      connect("L.n", "C.p"), connect("C.n", "V.n", "g.p") }
    return plain(m, function(c) return { [m.C.v] = c, [m.L.i] = 0 } end)
  end },
  { "diode circuit of parts", function()
    local m = model { V = el.source { v = sin(10*t) }, R = el.resistor { R = k }, D = el.diode {},
      C = el.capacitor { C = 0.01 }, g = el.ground {}, connect("V.p", "R.p"), connect("R.n", "D.p"),
      connect("D.n", "C.p"), connect("C.n", "V.n", "g.p") }
    return plain(m, function(c) return { [m.C.v] = c } end)
  end },
}

--- Milliseconds of processor time of one call.
local function time(f, count)
  local begin = os.clock()
  for i = 1, count do f(1 + (i % 97)/97 + math.random()*1e-3) end
  return (os.clock() - begin)*1e3/count
end

local function measured(make)
  local begin = os.clock()
  local sys, options, fixed = make()
  sys:integrate(options(1.5))
  local first = (os.clock() - begin)*1e3
  local run = sys:prepare(fixed)
  local second, prepared, steps, share = math.huge, math.huge, 0, 0
  for _ = 1, 6 do
    local inside, count = 0, 60
    local t = time(function(c)
      local stats = sys:integrate(options(c)):stats()
      inside, steps = inside + stats.time*1e3/count, stats.steps
    end, count)
    if t < second then second, share = t, 1 - inside/t end
    prepared = math.min(prepared, time(function(c) run(options(c, true)) end, count))
  end
  return first, second, prepared, steps, share
end

print(("%-28s %8s %8s %8s %6s  %s"):format("", "first", "second", "prepared", "steps", "not run"))
for _, kind in ipairs(kinds) do
  if kind[1]:find(wanted, 1, true) then
    local good, first, second, prepared, steps, share = pcall(measured, kind[2])
    print(good and ("%-28s %8.2f %8.3f %8.3f %6d %5.0f %%"):format(kind[1], first, second, prepared, steps,
      100*share) or ("%-28s %s"):format(kind[1], first))
  end
end
