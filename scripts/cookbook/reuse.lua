-- A model in a file of its own, used with other parameters and as a part of a larger one.
file = io.open("motor.lua", "w")
file:write [[
local w, i = vars "w i"
local u, load = input "u", input "load"
local J, L, R, k = param("J", 0.01), param("L", 0.5), param("R", 1), param("k", 0.1)
return dae { J*der(w) ~ k*i - load, L*der(i) ~ u - R*i - k*w }
]]
file:close()

motor = require "motor"
print(motor)
w, u, load_torque = var "w", input "u", input "load"
for _, J in ipairs { 0.01, 0.02 } do
  sol = motor:with { J = J }:integrate { start = { w = 0, i = 0 }, to = 5, inputs = { u = 1, load = 0 } }
  print(("J = %.2f: w(1) = %.3f, w(5) = %.3f"):format(J, sol(w, 1), sol(w, 5)))
end
controlled = dae { motor, u ~ 20*(1 - w), load_torque ~ 0 }
sol = controlled:integrate { start = { w = 0, i = 0 }, to = 5 }
print(("with a controller: w(5) = %.3f"):format(sol(w, 5)))
