-- Water hammer: a pipe of n cells, each with inertia and elasticity, whose valve closes at once. Joukowsky,
-- 1898.
local h = components.hydraulic
local n = 50
-- wave speed 1/√(I C) per pipe length: 1 s each way
local I, C = 1e6/n, 1e-6/n
local cells, pipes, list = {}, {}, { connect("dam.port", "pipe[1].a") }
for k = 1, n do
  pipes[k], cells[k] = h.inertance{ I = I, q0 = 1e-3 }, h.accumulator{ C = C, p0 = 1e5 }
  local ends = { ("pipe[%d].b"):format(k), ("cell[%d].port"):format(k) }
  if k < n then ends[3] = ("pipe[%d].a"):format(k + 1) end
  list[#list + 1] = connect(table.unpack(ends))
end
local line = model { dam = h.ambient{ p = 1e5 }, pipe = pipes, cell = cells, list }
local sol = line:integrate{ to = 2, rtol = 1e-7, atol = 1e-9 }
print(("%d equations, %d after elimination"):format(#line:flat().equations, #line:dae().equations))
local mean = 0
for k = 0, 99 do mean = mean + (sol(line.cell[n].p, 0.3 + 0.4*k/100) - 1e5)/100 end
print(("pressure rise at the valve: %.0f Pa on average, q √(I/C) = %.0f by hand"):format(mean,
  1e-3*math.sqrt(1e6/1e-6)))
