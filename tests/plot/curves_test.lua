-- Pictures are true: the polyline that plot draws along a solution is the dense output to half a pixel.

local width, height = 800, 500

-- The largest distance in pixels of the dense output from the polyline, for curves over time or in a plane.
-- The points between two breaks are one line; over time, a point is compared with the line at its time.
local function farthest(sol, expressions, options)
  options = options or {}
  local columns, breaks = sol:curve(expressions, options)
  local n = columns[1].rows
  local plane = options.coordinates == 2
  local worst = 0
  for k = 2, #columns do
    local x, y = columns[1], columns[k]
    local function extent(c)
      local low, high = math.huge, -math.huge
      for i = 1, n do low, high = math.min(low, c(i, 1)), math.max(high, c(i, 1)) end
      return high - low
    end
    local sx, sy = width / extent(x), height / extent(y)
    local dense = plane and 801 or 4001
    local from, to = sol.t(1, 1), sol.t(sol.t.rows, 1)
    local at = {}
    for i = 1, dense do at[i] = from + (to - from) * (i - 1) / (dense - 1) end
    local px = plane and sol(expressions[1], at) or at
    local py = sol(expressions[plane and 2 or k - 1], at)
    local broken = {}
    for _, b in ipairs(breaks) do broken[b] = true end
    local j = 2
    for i = 1, dense do
      local u = (plane and px(i, 1) or px[i]) * sx
      local v = py(i, 1) * sy
      local best = math.huge
      while not plane and j < n and x(j, 1) < at[i] do j = j + 1 end
      for s = plane and 2 or math.max(2, j - 3), plane and n or math.min(n, j + 3) do
        if not broken[s] then
          local ax, ay, bx, by = x(s - 1, 1) * sx, y(s - 1, 1) * sy, x(s, 1) * sx, y(s, 1) * sy
          local dx, dy = bx - ax, by - ay
          local long = dx * dx + dy * dy
          local r = long > 0 and math.max(0, math.min(1, ((u - ax) * dx + (v - ay) * dy) / long)) or 0
          best = math.min(best, (ax + r * dx - u) ^ 2 + (ay + r * dy - v) ^ 2)
        end
      end
      best = math.sqrt(best)
      worst = math.max(worst, best)
    end
  end
  return worst, n
end

local function falls()
  local h, v = var "h", var "v"
  return dae{ der(h) ~ v, der(v) ~ -9.81 }:integrate{ start = { h = 1, v = 0 }, to = 3,
    events = { { when = h, direction = -1, reset = { [v] = -0.8*v } } } }, h, v
end

test("a bouncing ball is drawn as parabolas, its velocity as separate lines", function()
  local sol, h, v = falls()
  expect(farthest(sol, { h }) < 0.5):equals(true)
  expect(farthest(sol, { v }) < 0.5):equals(true)
  local _, none = sol:curve { h }
  local _, jumps = sol:curve { v }
  expect(#none == 0):equals(true)
  expect(#jumps == #sol.events):equals(true)
  expect(farthest(sol, { h, v }) < 0.5):equals(true)
end)

test("a bouncing ball in the phase plane breaks at its bounces", function()
  local sol, h, v = falls()
  local off, n = farthest(sol, { h, v }, { coordinates = 2 })
  expect(off < 0.5):equals(true)
  expect(n < 1000):equals(true)
end)

test("a double pendulum is smooth, over time and in the plane", function()
  local a, b = var "a", var "b"
  local T = der(a)^2 + der(b)^2/2 + der(a)*der(b)*cos(a - b)
  local V = -2*9.81*cos(a) - 9.81*cos(b)
  local sol = lagrange{ q = {a, b}, T = T, V = V }:integrate{ start = { a = 2, b = 1, [a.dot] = 0,
    [b.dot] = 0 }, to = 10 }
  expect(farthest(sol, { a, b }) < 0.5):equals(true)
  expect(farthest(sol, { sin(a) + sin(b), -cos(a) - cos(b) }, { coordinates = 2 }) < 0.5):equals(true)
end)

test("a stiff relaxation oscillation with few steps", function()
  local y, z = var "y", var "z"
  local model = dae{ der(y) ~ z, der(z) ~ ((1 - y^2)*z - y)/1e-3 }
  local sol = model:integrate{ start = { y = 2, z = 0 }, to = 2, method = "radau", rtol = 1e-3 }
  expect(farthest(sol, { y }) < 0.5):equals(true)
end)

test("zoomed in, the curve follows as well", function()
  local x = var "x"
  local sol = dae{ der(x, 2) ~ -x }:integrate{ start = { x = 1, [der(x)] = 0 }, to = 20 }
  local _, whole = farthest(sol, { x })
  local columns = sol:curve({ x }, { xlim = {3, 3.2}, ylim = {-1, -0.98} })
  expect(columns[1].rows > 2 * whole):equals(true)
end)

test("what is undefined somewhere is a gap and not an error", function()
  local x = var "x"
  local sol = dae{ der(x) ~ -1 }:integrate{ start = { x = 1 }, to = 2 }
  expect(#sol:curve { sqrt(x) } == 2):equals(true)
  expect(tostring(plot(sol, sqrt(x)))):matches "figure"
end)

test("y against x, several solutions, marks at the saved points", function()
  local sol, h, v = falls()
  local fig = plot(sol, h, v)
  expect(tostring(fig)):matches "1 series"
  expect(function() plot(sol, h, {h, v}) end):fails "one expression against another"
  expect(tostring(plot({ sol, sol }, h))):matches "2 series"
  expect(plot({ sol, sol }, h).labels[2]):equals "h (2)"
  expect(tostring(plot(sol, h, { style = "line+points" }))):matches "1 series"
  expect(tostring(plot(sol, h, { style = "points" }))):matches(("%d points"):format(sol.t.rows))
end)
