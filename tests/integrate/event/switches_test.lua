-- Switches and corners that are smooth, but narrow beside a step: a capacitor that is charged through an
-- element of every such shape from a sine of 60 Hz, in two systems of units. No pulse is lost, and no error
-- is larger than 100 tolerances. The reference is radau in short steps at 1e-10.
local part_of = dofile "tests/part_of.lua"
local c = vars "c"

local shapes = {
  root = function(v) return (v + sqrt(v^2 + 1))/2 end,
  half_root = function(v) return 1 + v/sqrt(1 + v^2) end,
  tanh = function(v) return 1 + tanh(v) end,
  logistic = function(v) return 2/(1 + exp(-v)) end,
  softplus = function(v) return log(1 + exp(v)) end,
  log_cosh = function(v) return (v + log(cosh(v)))/2 end,
  tanh_ramp = function(v) return v*(1 + tanh(v))/2 end,
  atan_ramp = function(v) return v*(1/2 + atan(v)/pi) + 1/pi end,
}
-- Of v = (source - c)/width: amplitude of the source and width, time constant of the load, gain of what
-- flows: per width where the shape rises without end.
local cases = {
  { 15.2, 0.061, 0.11, 9 }, { 3.7, 0.012, 0.31, 22 }, { 19, 0.09, 0.04, 31 }, { 8.4, 0.06, 0.21, 14 },
}
local is_ramp = { root = true, softplus = true, log_cosh = true, tanh_ramp = true, atan_ramp = true }
local is_taken = part_of(3)

for name, shape in pairs(shapes) do
  test("a capacitor behind a " .. name .. " loses no pulse", function()
    for k, case in ipairs(cases) do
      local amplitude, width, constant, gain = table.unpack(case)
      for _, units in ipairs { { 1, 1 }, { 1e3, 1e-6 } } do
        local volt, second = units[1], units[2]
        local v = (amplitude*volt*sin(120*pi*t/second) - c)/(width*volt)
        local flow = is_ramp[name] and width*gain or amplitude*gain/10
        local model = dae { constant*second*der(c) ~ flow*volt*shape(v) - c }
        local to = 0.16*second
        local function run(rtol, method, dtmax)
          local sol = model:integrate { start = { c = 0 }, to = to, rtol = rtol, atol = rtol*volt/100,
            method = method, dtmax = dtmax }
          expect(sol.status):equals "finished"
          return sol
        end
        local exact
        for i, method in ipairs { "auto", "radau", "bdf", "gauss", "rodas5p", "dopri5", "tsit5" } do
          if is_taken() then
            exact = exact or run(1e-10, "radau", to/600)
            local rtol = 10^(-2.6 - 0.7*((i + 2*k) % 6))
            local sol = run(rtol, method)
            for j = 1, 16 do
              expect(sol(c, j*to/16)):near(exact(c, j*to/16), 100*rtol*amplitude*volt)
            end
          end
        end
      end
    end
  end)
end

test("a branch that is held fixed has no pole where the equations have none", function()
  -- v/(1 + |v|) = v/(1 - v) on the side of v < 0
  for _, case in ipairs(cases) do
    local amplitude, width, constant, gain = table.unpack(case)
    local v = (amplitude*sin(120*pi*t) - c)/(6*width)
    local model = dae { constant*der(c) ~ amplitude*gain/10*(1 + v/(1 + abs(v))) - c }
    local exact = model:integrate { start = { c = 0 }, to = 0.15, rtol = 1e-10, method = "radau",
      dtmax = 3e-4 }
    for i, method in ipairs { "auto", "rodas5p", "dopri5", "tsit5" } do
      for k = 0, 3 do
        local rtol = 10^(-2.6 - 0.6*k - 0.1*i)
        local sol = model:integrate { start = { c = 0 }, to = 0.15, rtol = rtol, method = method }
        expect(sol.status):equals "finished"
        for j = 1, 16 do expect(sol(c, j*0.15/16)):near(exact(c, j*0.15/16), 100*rtol*amplitude) end
      end
    end
  end
end)

test("a sweep in lanes loses no pulse either", function()
  local width = param("width", 0.09)
  local v = (19*sin(120*pi*t) - c)/width
  local model = dae { 0.04*der(c) ~ 31*width*log(1 + exp(v)) - c }
  local widths = { 0.06, 0.08, 0.1, 0.15, 0.2, 0.4 }
  local all = sweep(model, { params = { width = widths }, start = { c = 0 }, to = 0.15, rtol = 1e-4,
    method = "dopri5" })
  local ends = all:final(c)
  for k, w in ipairs(widths) do
    local exact = model:integrate { params = { width = w }, start = { c = 0 }, to = 0.15, rtol = 1e-10,
      method = "radau", dtmax = 3e-4 }
    expect(ends[k]):near(exact(c, 0.15), 100*1e-4*19)
  end
end)

test("stats name the switches that were located", function()
  local model = dae { 0.04*der(c) ~ 3*log(1 + exp((19*sin(120*pi*t) - c)/0.09)) - c }
  local sol = model:integrate { start = { c = 0 }, to = 0.1, rtol = 1e-4 }
  expect(sol:stats().borders):matches "smooth switch, located %d+ times"
end)
