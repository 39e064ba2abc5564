-- Exponential diodes and transistors: smooth solutions whose algebraic equations change by twelve decades
-- within a tolerance. Every implicit method finishes at every tolerance, in the first run of a session and
-- in the next, which begins with what the first has left, and agrees with a tighter run.
local families = dofile "tests/families.lua"
local Vt = 0.026
local function diode(v, Is) return Is*(exp(v/Vt) - 1) end
local circuits = {}
local function circuit(name, equations, start, to, watch)
  circuits[#circuits + 1] = { name = name, model = dae(equations), start = start, to = to, watch = watch }
end

local c, i = vars "c i"
circuit("diode and capacitor", { der(c) ~ i - c, 0 ~ 1e-12*exp((3*sin(3*t) - c - 0.1*i)/Vt) - i },
  { [c] = 0 }, 5, c)
circuit("the same by Shockley's law", { der(c) ~ i - c, 0 ~ diode(3*sin(3*t) - c - 0.1*i, 1e-12) - i },
  { [c] = 0 }, 5, c)
circuit("in mV and µA", { der(c) ~ i/10 - c, 0 ~ 1e-6*(exp((3000*sin(3*t) - c - 0.1*i)/26) - 1) - i },
  { [c] = 0 }, 5, c)

local v, a, b = vars "v a b"                                   -- between a and b a source of 5 V and 0.5 Ω
local source = (5*sin(2*math.pi*t) - (a - b))/0.5
circuit("bridge of four diodes", { 0.2*der(v) ~ diode(a - v, 1e-12) + diode(b - v, 1e-12) - v/10,
  0 ~ source - a/1e5 - diode(a - v, 1e-12) + diode(-a, 1e-12),
  0 ~ -source - b/1e5 - diode(b - v, 1e-12) + diode(-b, 1e-12) }, { [v] = 0 }, 1.5, v)

local x, o = vars "x o"
local pair = 2*2.52e-6*sinh(o/0.0453)                          -- two diodes, one each way
circuit("clipper", { der(x) ~ (3*sin(5*t) - x)*4, 0 ~ (x - o)/2.2 - pair - o/100 }, { [x] = 0 }, 2.5, o)
circuit("clipper with a capacitor", { 0.01*der(o) ~ (4.5*sin(8*t) - o)/2.2 - pair }, { [o] = 0 }, 1.5, o)

local u1, u2, p = vars "u1 u2 p"
local current = (3*sin(2*math.pi*t) - u1 - p)/0.2
circuit("voltage doubler", { 0.3*der(u1) ~ current,
  0 ~ current + diode(-p, 1e-12) - diode(p - u2, 1e-12),
  0.5*der(u2) ~ diode(p - u2, 1e-12) - u2/20 }, { [u1] = 0, [u2] = 0 }, 3, u2)

local vb, vc, ve, q = vars "vb vc ve q"                        -- Ebers & Moll, in V, mA, kΩ, µF, ms
local forward, reverse = diode(vb - ve, 1e-11), diode(vb - vc, 1e-11)
local base, collector = forward/100 + reverse, forward - 2*reverse
local input = (0.5*sin(20*t) - q - vb)/0.6
circuit("amplifier", { 5*der(q) ~ input,
  0 ~ input + (10 - vb)/47 - vb/10 - base,
  0 ~ (10 - vc)/2.2 - collector,
  0.5*der(ve) ~ base + collector - ve/0.56 }, { [q] = 0, [ve] = 0 }, 1, vc)

local il, free = vars "il free"
circuit("freewheel diode", { 0.5*der(il) ~ free - il,
  0 ~ diode(4*sin(2*math.pi*t) - free, 1e-9) + diode(-free, 1e-9) - il }, { [il] = 0 }, 2, il)

local m, w = vars "m w"
local series = diode(m - w, 1e-12)
circuit("two diodes in series", { der(w) ~ series - w, 0 ~ diode(3*sin(3*t) - m, 1e-12) - series - m/1e5 },
  { [w] = 0 }, 3, w)

local ladder = {}
for k = 0, 49 do ladder[#ladder + 1] = 10^(-2 - 4*k/49) end

-- Each step may err by one tolerance, and the errors of some hundred steps add up.
local most = 100
for _, one in ipairs(circuits) do
  local times = {}
  for k = 1, 20 do times[k] = one.to*k/20 end
  local exact = one.model:integrate { start = one.start, to = one.to, method = "radau", rtol = 1e-9 }
  local again = one.model:integrate { start = one.start, to = one.to, method = "rodas", rtol = 1e-8 }
  local values, size = {}, 0
  for k, time in ipairs(times) do
    values[k] = exact(one.watch, time)
    size = math.max(size, math.abs(values[k]))
  end
  test(one.name .. ": the reference", function()
    for k, time in ipairs(times) do expect(again(one.watch, time)):near(values[k], 1e-6*size) end
  end)
  for _, method in ipairs(families.implicit) do
    test(one.name .. ": " .. method, function()
      for _, rtol in ipairs(ladder) do
        for run = 1, 2 do
          local request = { start = one.start, to = one.to, method = method, rtol = rtol }
          local sol = one.model:integrate(request)
          local at = ("%g, run %d: "):format(rtol, run)
          if sol.status ~= "finished" then expect(at .. sol.status):equals "finished" end
          local error = 0
          for k, time in ipairs(times) do
            error = math.max(error, math.abs(sol(one.watch, time) - values[k])/(rtol*size))
          end
          if not (error <= most) then expect(at .. error .. " tolerances"):equals "few" end
        end
      end
    end)
  end
end
