-- Furuta pendulum: a lagrange model with a connector for the motor of its arm. Furuta, Yamakita & Kobayashi,
-- 1992.
local e, r = components.electrical, components.rotational
local th, al = vars "th al"                                -- arm, pendulum (0: upright)
local m, l, R, J, g = 0.1, 0.2, 0.15, 1e-3, 9.81
local arm = lagrange { q = { th, al },
  T = J*th.dot^2/2 + m/2*((R*th.dot - l*cos(al)*al.dot)^2 + l^2*sin(al)^2*(th.dot^2 + al.dot^2)),
  V = m*g*l*cos(al) }:ports { shaft = { r.flange, phi = th } }

local plant = model { P = arm, M = r.dc_motor{ R = 2, L = 1e-3, k = 0.05 }, V = e.signal_source{},
  gnd = e.ground{},
  connect("M.flange", "P.shaft"), connect("V.p", "M.p"), connect("V.n", "M.n", "gnd.p"),
    V_in = components.signals.gain{},
  connect("V_in.u", input "u"), connect("V_in.y", "V.v") }
print(("index %d, %d free initial values"):format(plant:index(), plant:dof()))

local start = { ["P.th"] = 0, ["P.al"] = 0, ["P.th'"] = 0, ["P.al'"] = 0, ["M.i"] = 0 }
local G = plant:linearize(plant:init{ fix = start, inputs = { u = 0 } })
print("poles about the upright position:", G:poles())

local free = plant:integrate{ start = { ["P.th"] = 0, ["P.al"] = 0.1, ["P.th'"] = 0, ["P.al'"] = 0,
  ["M.i"] = 0 },
  to = 3, inputs = { u = 0 }, rtol = 1e-8 }
print(("falls: largest angle %.3f rad"):format(math.max(table.unpack((function()
  local list = {}
  for k = 0, 300 do list[#list + 1] = free(plant.P.al, k/100) end
  return list
end)()))))
