-- Heat conduction in a rod of n cells: cold at the left, insulated at the right. A list of parts in a loop.
local h = components.thermal

local function rod(n)
  local cells, walls, list = {}, {}, {}
  for k = 1, n do
    cells[k] = h.capacity{ C = 1/n, T0 = 1 }
    walls[k] = h.conductor{ G = k == 1 and 2*n or n }
    local ends = { ("wall[%d].b"):format(k), ("cell[%d].port"):format(k) }
    if k < n then ends[3] = ("wall[%d].a"):format(k + 1) end
    list[#list + 1] = connect(table.unpack(ends))
  end
  return model { cell = cells, wall = walls, cold = h.temperature{ T = 0 }, connect("cold.port", "wall[1].a"),
    list }
end

-- u_t = u_xx, u(0) = 0, u_x(1) = 0, u = 1 at the start: u(1, t) = Σ 4/π (-1)^k/(2k+1) exp(-((2k+1)π/2)² t)
local function exact(time)
  local sum = 0
  for k = 0, 30 do
    local w = (2*k + 1)*math.pi/2
    sum = sum + 4/math.pi*(-1)^k/(2*k + 1)*math.exp(-w^2*time)
  end
  return sum
end

for _, n in ipairs { 10, 20, 40, 80 } do
  local m = rod(n)
  local sol = m:integrate{ to = 0.5, rtol = 1e-8 }
  local T = sol(m.cell[n].T, 0.5)
  print(("%3d cells: T at the end = %.6f, error %.1e"):format(n, T, math.abs(T - exact(0.5))))
end
print(("series:    %.6f"):format(exact(0.5)))
