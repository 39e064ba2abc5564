-- Every polyline that a figure holds, of every kind of figure, is the dense output to half a pixel: seen on
-- the
-- sheet with its axes (logarithmic, second, in space), at the size that is asked for.

-- ── a sheet: from values to pixels ──

local function extent(low, high, column, log)
  for i = 1, column.rows do
    local c = column(i, 1)
    if log then c = c > 0 and math.log(c, 10) or 0/0 end
    if c == c and math.abs(c) < math.huge then low, high = math.min(low, c), math.max(high, c) end
  end
  return low, high
end

-- Functions that give the place of a value on the axes x, y, z; nan where it is not seen.
local function sheet_of(parts)
  local size = parts.size or { 800, 500 }
  local axes, spans = {}, {}
  for k, name in ipairs { "x", "y", "z" } do
    local low, high = math.huge, -math.huge
    local given, log = parts[name .. "lim"], parts[name .. "log"]
    for _, each in ipairs(parts.series) do
      if each[name] then low, high = extent(low, high, each[name], log) end
    end
    if given then low, high = given[1], given[2] end
    if given and log then low, high = math.log(low, 10), math.log(high, 10) end
    local pixels = name == "x" and size[1] or size[2]
    spans[k] = { low, high, pixels }
  end
  local equal = parts.equal and math.huge
  for k = 1, parts.equal and 3 or 0 do
    local span = spans[k][2] - spans[k][1]
    if span > 0 then equal = math.min(equal, spans[k][3]/span) end
  end
  for k, name in ipairs { "x", "y", "z" } do
    local low, high, pixels = table.unpack(spans[k])
    local log = parts[name .. "log"]
    axes[name] = function(value)
      if log then value = value > 0 and math.log(value, 10) or 0/0 end
      if value < low - 1e-9*(high - low) or value > high + 1e-9*(high - low) then return 0/0 end
      return (value - low)*(equal or pixels/(high - low))
    end
  end
  return axes
end

-- ── the distance of a point from a polyline ──

local function distance(p, a, b)
  local along, square, d = 0, 0, {}
  for k = 1, #p do
    d[k] = b[k] - a[k]
    along, square = along + (p[k] - a[k])*d[k], square + d[k]^2
  end
  local r = square > 0 and math.max(0, math.min(1, along/square)) or 0
  local sum = 0
  for k = 1, #p do sum = sum + (p[k] - a[k] - r*d[k])^2 end
  return math.sqrt(sum)
end

local function vertices(series, axes)
  local list, names = {}, series.z and { "x", "y", "z" } or { "x", "y" }
  for i = 1, series.x.rows do
    local p = {}
    for k, name in ipairs(names) do p[k] = axes[name](series[name](i, 1)) end
    list[i] = p
  end
  return list
end

local function is_seen(p)
  for k = 1, #p do
    if p[k] ~= p[k] then return false end
  end
  return true
end

-- The farthest point of the dense output from the drawn line, in pixels. truth: { sol, x, y [, z] }, x = nil:
-- time.
-- turn: what a second axis makes of the values.
local function farthest(series, axes, truth, turn)
  local sol, over_time = truth[1], truth[2] == nil
  local line, broken = vertices(series, axes), {}
  for i = 1, series.breaks and #series.breaks or 0 do broken[series.breaks[i]] = true end
  local count = over_time and 2501 or 601
  local times = linspace(sol.t[1], sol.t[#sol.t], count)
  local columns = { over_time and times or sol(truth[2], times), sol(truth[3], times),
    truth[4] and sol(truth[4], times) }
  local worst, j = 0, 2
  for i = 1, count do
    local values = {}
    for k, column in ipairs(columns) do values[k] = column[i] end
    if turn then values[2] = turn(values[2]) end
    local p = {}
    for k, name in ipairs { "x", "y", "z" } do p[k] = values[k] and axes[name](values[k]) end
    if is_seen(p) then
      while over_time and j < #line and series.x(j, 1) < times[i] do j = j + 1 end
      local first, last = over_time and math.max(2, j - 3) or 2, over_time and math.min(#line, j + 3) or #line
      local best = math.huge
      for s = first, last do
        local a, b = line[s - 1], line[s]
        if not broken[s] and is_seen(a) and is_seen(b) then best = math.min(best, distance(p, a, b)) end
      end
      -- beyond the last vertex that is seen the line is clipped by the frame
      if best < math.huge then worst = math.max(worst, best) end
    end
  end
  return worst
end

-- Every vertex over time is a value of the dense output.
local function vertices_are_true(series, axes, truth, turn)
  local sol = truth[1]
  for i = 1, series.x.rows do
    local time = series.x(i, 1)
    local value = sol(truth[3], time)
    if turn then value = turn(value) end
    local off = math.abs(axes.y(series.y(i, 1)) - axes.y(value))
    local near_break = false  -- at a jump one time has two values
    for k = 1, series.breaks and #series.breaks or 0 do
      near_break = near_break or math.abs(i - series.breaks[k]) <= 1
    end
    if off > 0.5 and not near_break then return false end
  end
  return true
end

-- Every curve of the figure against its truth, in the order of its series.
local function expect_true(fig, truths)
  local parts = fig:parts()
  local axes = sheet_of(parts)
  local turn
  if parts.right then
    local low, high, low2, high2 = parts.ylim[1], parts.ylim[2], parts.right[1], parts.right[2]
    turn = function(value) return low + (value - low2)*(high - low)/(high2 - low2) end
  end
  for k, truth in ipairs(truths) do
    local series = parts.series[truth.number or k]
    local off = farthest(series, axes, truth, truth.right and turn)
    if off >= 0.5 then
      error(("curve %d of %s is %.2f pixels off"):format(k, tostring(fig), off), 0)
    end
    if truth[2] == nil then
      expect(vertices_are_true(series, axes, truth, truth.right and turn)):equals(true)
    end
  end
  expect(#truths > 0):equals(true)
end

-- ── what is drawn ──

local h, v = vars "h v"
local function ball()
  return dae{ der(h) ~ v, der(v) ~ -9.81 }:integrate{ start = { h = 1, v = 0 }, to = 3,
    events = { { when = h, direction = -1, reset = { [v] = -0.8*v } } } }
end

local a, b = vars "a b"
local function double_pendulum()
  local T = der(a)^2 + der(b)^2/2 + der(a)*der(b)*cos(a - b)
  local V = -2*9.81*cos(a) - 9.81*cos(b)
  return lagrange{ q = { a, b }, T = T, V = V }:integrate{ to = 8,
    start = { a = 2, b = 1, [a.dot] = 0, [b.dot] = 0 } }
end

local y, z = vars "y z"
local function relaxation()  -- some 20 steps for a slow part and a fall
  return dae{ der(y) ~ z, der(z) ~ ((1 - y^2)*z - y)/1e-3 }:integrate{ start = { y = 2, z = 0 }, to = 0.83,
    method = "radau", rtol = 0.1, atol = 0.1 }
end

local p1 = vec(sin(a), -cos(a))
local p2 = vec(sin(a) + sin(b), -cos(a) - cos(b))
local examples = {
  { "the ball", ball, h, v },
  { "the double pendulum", double_pendulum, a, b, p2[1], p2[2] },
  { "the relaxation oscillation", relaxation, y, z },
}

for _, example in ipairs(examples) do
  local name, make, e1, e2 = table.unpack(example)
  local sol = make()
  local g1, g2 = example[5] or e1, example[6] or e2

  test(name .. ": plot, over time and in the plane, large and zoomed in", function()
    expect_true(plot(sol), { { sol, nil, e1 }, { sol, nil, e2 } })
    expect_true(plot(sol, { e1, e2^2 }), { { sol, nil, e1 }, { sol, nil, e2^2 } })
    expect_true(plot(sol, g1, g2), { { sol, g1, g2 } })
    expect_true(plot(sol, e1, { size = { 2400, 1500 } }), { { sol, nil, e1 } })
    expect_true(plot(sol, e1, { xlim = { 0.3, 0.45 } }), { { sol, nil, e1 } })
    expect_true(plot({ sol, sol }, e2), { { sol, nil, e2 }, { sol, nil, e2 } })
  end)

  test(name .. ": two axes, panels, overlays", function()
    expect_true(plot(sol, { e1, e2 }, { right = { 2 }, xlim = { 0.2, 0.3 } }),
      { { sol, nil, e1 }, { sol, nil, e2, right = true } })
    expect_true(plot(sol, { e1, e2 }, { right = { 2 } }),
      { { sol, nil, e1 }, { sol, nil, e2, right = true } })
    local page = layout({ 2, 1 }, plot(sol, e1), plot(sol, e2))
    expect_true(page, { { sol, nil, e1 } })
    expect_true(page:parts().below[1], { { sol, nil, e2 } })
    expect_true(overlay(plot(sol, e1), plot(sol, e1 + 1)), { { sol, nil, e1 }, { sol, nil, e1 + 1 } })
  end)

  test(name .. ": logarithmic axes", function()
    expect_true(semilogy(sol, 3.5 + e1), { { sol, nil, 3.5 + e1 } })
    expect_true(semilogy(sol, e1^2 + 1e-4), { { sol, nil, e1^2 + 1e-4 } })
    expect_true(semilogx(sol, e1, { xlim = { 1e-3, 1 } }), { { sol, nil, e1 } })
    expect_true(loglog(sol, e1^2 + e2^2 + 1e-3, { xlim = { 1e-3, 1 } }), { { sol, nil, e1^2 + e2^2 + 1e-3 } })
  end)

  test(name .. ": in space", function()
    expect_true(plot3(sol, { g1, g2, t }), { { sol, g1, g2, t } })
    expect_true(plot3(sol, { g1, g2, g1*g2 }, { equal = false }), { { sol, g1, g2, g1*g2 } })
  end)
end

test("trajectories of a phase portrait", function()
  local x, w = vars "x w"
  local vdp = dae{ der(x) ~ w, der(w) ~ 5*(1 - x^2)*w - x }
  local fig = phase(vdp, x, w, { xlim = { -3, 3 }, ylim = { -9, 9 }, start = { { 0.1, 0 } }, to = 20, n = 4 })
  local sol = vdp:integrate{ start = { x = 0.1, w = 0 }, to = 20, rtol = 1e-8, atol = 1e-8 }
  expect_true(fig, { { sol, x, w, number = 4 } })
end)

test("solutions with multipliers, continued and loaded ones", function()
  local x, u = vars "x u"
  local pendulum = lagrange{ q = { x, u }, T = (der(x)^2 + der(u)^2)/2, V = 9.81*u,
    C = { (x^2 + u^2 - 1)/2 } }
  local sol = pendulum:reduce():integrate{ to = 4, start = { x = 1, u = 0, [x.dot] = 0, [u.dot] = 0 } }
  local force = pendulum.multipliers[1]
  expect_true(plot(sol, { x, force }), { { sol, nil, x }, { sol, nil, force } })
  local more = sol:continue{ to = 6 }
  expect_true(plot(more, x), { { more, nil, x } })
  local file = os.tmpname() .. ".lua"
  save(file, sol)
  local back = load(file)
  os.remove(file)
  expect_true(plot(back, x, u), { { sol, x, u } })
end)
