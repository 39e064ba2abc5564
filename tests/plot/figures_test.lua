-- Phase portraits, sections, histograms, maps, contours, twin axes, themes and animations.

local x, v = vars "x v"
local mu = param("mu", 1)
local oscillator = dae { der(x) ~ v, der(v) ~ -x - 0.2*v }
local sol = oscillator:integrate { start = { x = 1, v = 0 }, to = 20, rtol = 1e-9, atol = 1e-9 }

test("phase portraits", function()
  local vdp = dae { der(x) ~ v, der(v) ~ mu*(1 - x^2)*v - x }
  local fig = phase(vdp, x, v, { xlim = { -3, 3 }, ylim = { -4, 4 }, start = { { 0.1, 0 }, { 2, 2 } },
    n = 6 })
  expect(fig.labels[2]):equals "x′ = 0"
  expect(#fig.labels):equals(5)
  local th = var "theta"
  local pendulum = phase(dae { der(th, 2) ~ -sin(th) }, th, th.dot, { xlim = { -4, 4 }, ylim = { -3, 3 } })
  expect(pendulum.labels[3]):equals "θ″ = 0"
  expect(function() phase(vdp, x, v, { ylim = { -4, 4 } }) end):fails "xlim = { low, high } is missing"
  expect(function() phase(vdp, x, v, { xlims = { -4, 4 } }) end):fails "Did you mean 'xlim'?"
  local w = var "w"
  expect(function()
    phase(dae { der(x) ~ v, der(v) ~ w, der(w) ~ -x }, x, v, { xlim = { 0, 1 }, ylim = { 0, 1 } })
  end):fails "3 states"
end)

test("a Poincaré section finds every crossing", function()
  local fig = poincare(sol, v, x, v, { direction = 0 })
  expect(tostring(fig)):equals "figure: 1 series, 6 points"  -- every half turn of 2π/√(1 - 0.01) within 20 s
  expect(tostring(poincare(sol, v, x, v))):equals "figure: 1 series, 3 points"
  expect(function() poincare(sol, x - 5, x, v) end):fails "does not pass zero"
end)

test("histograms count", function()
  expect(tostring(histogram({ 1, 2, 2, 3, 3, 3 }, { bins = { 0.5, 1.5, 2.5, 3.5 } }))):equals
    "figure: 1 series, 12 points"
  expect(function() histogram({}) end):fails "no finite number"
  expect(function() histogram({ 1 }, { bins = { 2, 1 } }) end):fails "must increase"
  expect(function() histogram({ 1 }, { binns = 2 }) end):fails "Did you mean 'bins'?"
  expect(tostring(histogram(vec(1, 1, 1)))):equals "figure: 1 series, 40 points"
end)

test("heat maps and contours", function()
  local function f(a, b) return a^2 + b^2 end
  expect(tostring(heatmap({ -1, 1 }, { -1, 1 }, f, { n = 8 }))):equals "figure: 1 series, 64 points"
  expect(tostring(heatmap({ 0, 1, 2 }, { 0, 1 }, { { 1, 2, 3 }, { 4, 5, 6 } })))
    :equals "figure: 1 series, 6 points"
  expect(function() heatmap({ 0, 1, 2 }, { 0, 1 }, { { 1, 2 } }) end):fails "the matrix is 1×2"
  local fig = contour({ -2, 2 }, { -2, 2 }, f, { levels = { 1, 2 } })
  expect(#fig.labels):equals(2)
  expect(function() contour({ -2, 2 }, { -2, 2 }, f, { levels = { 100 } }) end):fails "none of the levels"
  local a, b = vars "a b"
  expect(#contour({ -2, 2 }, { -2, 2 }, fn({ a, b }, a*b), { levels = { 0 } }).labels):equals(1)
end)

test("a second axis", function()
  local text = plot(sol, { x, v }, { right = { 2 } }):text(80)
  expect(text:find("├ 0.5", 1, true) ~= nil):equals(true)
  expect(function() plot(sol, { x, v }, { right = { 3 } }) end):fails "the curve 3 of 2 curves"
  expect(function() plot(sol, { x, v }, { right = { 1, 2 } }) end):fails "one curve at least"
  expect(function() plot(sol, { x, v }, { right = { 2 }, y2lim = { 1, 0 } }) end):fails "y2lim"
end)

test("themes", function()
  expect(function() plot({ 0, 1 }, { theme = "black" }) end):fails 'must be "light" or "dark", not "black"'
  expect(tostring(plot({ 0, 1 }, { theme = "dark" }))):equals "figure: 1 series, 2 points"
end)

test("animations", function()
  local th = var "theta"
  local swing = dae { der(th, 2) ~ -9.81*sin(th) }:integrate { start = { [th] = 1, [th.dot] = 0 }, to = 2 }
  local film = animate(swing, { vec(sin(th), -cos(th)) }, { title = "a < b", seconds = 1, fps = 10 })
  local svg = film:svg()
  expect(svg:find("a &lt; b", 1, true) ~= nil):equals(true)
  local _, points = svg:match('attributeName="points".-values="(.-)"'):gsub(";", ";")
  expect(points):equals(10)                        -- 11 pictures
  -- the bob hangs where the dense output says
  local xs = {}
  for word in svg:match('attributeName="cx".-values="(.-)"'):gmatch "[^;]+" do
    xs[#xs + 1] = tonumber(word)
  end
  local scale = (xs[11] - xs[1])/(swing(sin(th), 2) - swing(sin(th), 0))
  expect((xs[6] - xs[1])/scale):near(swing(sin(th), 1) - swing(sin(th), 0), 1e-3)
  local name = os.tmpname() .. ".html"
  film:save(name)
  expect(io.open(name):read "a":find("setCurrentTime", 1, true) ~= nil):equals(true)
  os.remove(name)
  expect(function() film:save "a.mp4" end):fails ".svg, .html or .gif"
  expect(function() animate(swing, { th }) end):fails "must be a point"
  expect(function() animate(swing, { vec(th, 0) }, { fsp = 3 }) end):fails "Did you mean 'fps'?"
end)

test("regions of stability are shaded on their side of the boundary", function()
  local function styles(fig)
    local list = {}
    for i, each in ipairs(fig:parts().series) do list[i] = each.style end
    return table.concat(list, " ")
  end
  expect(styles(rk.rk4:plot())):equals "line fill"
  expect(styles(rk.dopri5:plot())):equals "line line line fill fill fill"  -- with its islands
  expect(styles(rk.radau(3):plot())):equals "line fill fill"
  expect(styles(bdf(2):plot())):equals "line"
  local shade = rk.implicit_euler:plot():parts().series[2]
  for i = 1, shade.x.rows do  -- above the circle |z - 1| = 1
    local x = shade.x(i, 1)
    local circle = math.abs(x - 1) <= 1 and math.sqrt(1 - (x - 1)^2) or 0
    expect(shade.lower(i, 1)):near(circle, 2e-2)
  end
  local half = rk.gauss(2):plot():parts()
  expect(half.series[2].x(1, 1)):equals(half.xlim[1])
  expect(half.series[2].x(2, 1)):equals(0.0)
end)

test("Nyquist curves on the real axis have a frame, lines of orders the colours of their points",
  function()
    local flat = nyquist(tf({ 5 }, { 5 })):parts()
    expect(flat.ylim[1]):equals(-0.5)
    expect(#flat.series):equals(3)
    expect(flat.series[1].style):equals "points"
    expect(#nyquist(tf({ 1 }, { 1, 1 })):parts().series):equals(4)
    local study = converge(oscillator, { start = { x = 1, v = 0 }, to = 1, dt = { 0.1, 0.05, 0.025 },
      methods = { rk.rk4, rk.heun } })
    local series = study:plot():parts().series
    for m = 1, 2 do expect(series[2*m - 1].colour):equals(series[2*m].colour) end
    expect(series[1].colour ~= series[3].colour):equals(true)
    expect(series[2].dash):equals "dashed"
  end)
