-- Capacitors behind diodes, over many periods: current flows in pulses of 3 … 20 % of a period, and a step of
-- high order spans the time between them. No pulse may be lost between two stages, at any tolerance. The
-- reference is bdf, whose steps are short, confirmed by rodas.
local long = rosenbrock.rodas5p
local c, d, e, i = vars "c d e i"
local period, load = 1/60, 1000
local function shockley(v) return 1e-12*(exp(v/0.026) - 1) end
local source = 15*sin(2*pi*t/period)

local circuits = {
  half_wave = function(C)
    return dae { C*der(c) ~ shockley(d) - c/load, d ~ source - c - shockley(d) }, { c = 0 }
  end,
  full_wave = function(C)
    return dae { C*der(c) ~ shockley(d) + shockley(e) - c/load, d ~ source - c - 2*shockley(d),
      e ~ -source - c - 2*shockley(e) }, { c = 0 }
  end,
  choke = function(C)                                    -- with a freewheel diode, 1 µS beside each
    local forward, free = shockley(d) + 1e-6*d, shockley(-e) - 1e-6*e
    return dae { 5e-3*der(i) ~ e - c, C*der(c) ~ i - c/load, d ~ source - e - forward, forward + free ~ i },
      { c = 0, i = 0 }
  end,
}

-- Circuit, time constant of C and load and length of the run in periods.
local cases = {
  { "half_wave", 5.4, 2 }, { "half_wave", 5.9, 25 }, { "half_wave", 8.3, 9 }, { "half_wave", 9.8, 4 },
  { "half_wave", 17.5, 8 }, { "half_wave", 24.4, 9 }, { "half_wave", 31.2, 12 },
  { "full_wave", 25, 20 }, { "full_wave", 21, 14 }, { "choke", 4.7, 25 }, { "choke", 7.9, 5 },
  { "choke", 9.9, 9 }, { "choke", 15.2, 14 } }

local function volts(model, start, to, rtol, method)
  local sol = model:integrate { start = start, to = to, rtol = rtol, atol = 1e-2*rtol, method = method }
  expect(sol.status):equals "finished"
  return sol(c, to)
end

for _, case in ipairs(cases) do
  local name, constant, periods = table.unpack(case)
  test(("no pulse of a %s rectifier is lost, RC = %g, %g periods"):format(name, constant, periods), function()
    local model, fixed = circuits[name](constant*period/load)
    local start, to = model:init { fix = fixed }, (periods + 0.3)*period
    local exact = volts(model, start, to, 1e-8, "bdf")
    expect(volts(model, start, to, 1e-7, "rodas")):near(exact, 1e-5*exact)
    for _, method in ipairs { "auto", "radau", "gauss", long } do
      for k = 0, 6, periods > 10 and 2 or 1 do
        local rtol = 10^(-3.2 - k/2)
        expect(volts(model, start, to, rtol, method)):near(exact, 100*rtol*exact)
      end
    end
  end)
end

test("nor as it stands, with the capacitor in two halves: index 2", function()
  local first, second, flow = vars "first second flow"
  for _, units in ipairs { { 1, 1 }, { 1e3, 1e-6 } } do
    local volt, sec = units[1], units[2]
    for k, constant in ipairs { 2, 8, 20 } do
      local C, current = constant*period/load, volt*shockley(d/volt)
      local supply = 15*volt*sin(2*pi*t/(period*sec))
      local model = dae { 0.3*C*sec*der(first) ~ current - flow - first/load, 0.7*C*sec*der(second) ~ flow,
        first ~ second, d ~ supply - first - current }
      local one = dae { C*sec*der(first) ~ current - first/load, d ~ supply - first - current }
      local to = 12*period*sec
      local exact = one:integrate { start = { first = 0 }, to = to, rtol = 1e-9, atol = 1e-10*volt,
        method = "bdf" }
      local start = model:init { fix = { first = 0 } }
      for i, method in ipairs { "auto", "radau", "bdf" } do
        for digits = 3, 6 do
          local rtol = 10^(-digits + 0.1*i - 0.1*k)
          local sol = model:integrate { start = start, to = to, rtol = rtol, method = method, direct = true }
          expect(sol.status):equals "finished"
          for j = 1, 8 do expect(sol(first, j*to/8)):near(exact(first, j*to/8), 100*rtol*15*volt) end
        end
      end
    end
  end
end)
