-- A PI controller with a sample time of its own controls a continuous plant.
local s = components.signals
local loop = model { c = s.discrete_pi{ k = 2, Ti = 1, Ts = 0.1 }, plant = s.first_order{ T = 1 },
  connect("c.r", 1), connect("plant.y", "c.v"), connect("c.y", "plant.u") }
local sol = loop:integrate{ to = 3, rtol = 1e-9 }

-- the same by recursion: the plant is sampled exactly
local x, z, a = 0, 0, math.exp(-0.1)
for _ = 1, 20 do
  local u = 2*(1 - x) + z
  z = z + 2*0.1*(1 - x)
  x = a*x + (1 - a)*u
end
print(("y(2) = %.8f, by recursion %.8f"):format(sol(loop.plant.y, 2), x))
print(plot(sol, { loop.plant.y, loop.c.y }))
