-- Every kind of figure once, light and dark: ./dev gallery writes them to docs/gallery.
local folder = arg and arg[1] or "docs/gallery"
local x, v, w, y, z = vars "x v w y z"
local size = { 480, 320 }

local function page(name, make)
  for _, theme in ipairs { "light", "dark" } do
    local function options(more)
      local all = { theme = theme, size = size }
      for key, value in pairs(more or {}) do all[key] = value end
      return all
    end
    make(options):save(("%s/%s-%s.svg"):format(folder, name, theme))
  end
end

local ball = dae { der(x) ~ v, der(v) ~ -9.81 }
local hops = ball:integrate { start = { x = 1, v = 0 }, to = 3,
  events = { { when = x, direction = -1, reset = { [v] = -0.8*v } } } }
page("bouncing_ball", function(o)
  return plot(hops, x, o { title = "Bouncing ball", ylabel = "height [m]" })
end)
page("twin_axes", function(o)
  return plot(hops, { x, v }, o { title = "Two axes", right = { 2 }, ylabel = "x [m]", y2label = "v [m/s]" })
end)

local swing = dae { der(x) ~ v, der(v) ~ -sin(x) - 0.2*v }
page("phase_portrait", function(o)
  return phase(swing, x, v, o { xlim = { -7, 7 }, ylim = { -4, 4 }, title = "Damped pendulum",
    start = { { -6, 3.5 }, { 2, 3 }, { 6, -3.5 } } })
end)

local relax = dae { der(x) ~ v, der(v) ~ 50*(1 - x^2)*v - x }
local stiff = relax:integrate { start = { x = 2, v = 0 }, to = 200, method = "radau" }
page("relaxation", function(o) return plot(stiff, x, o { title = "Van der Pol, μ = 50" }) end)

local q = var("q", 2)
local m, l, g = param("m", 1), param("l", 1), param("g", 9.81)
local p1 = vec(l*sin(q[1]), -l*cos(q[1]))
local p2 = vec(p1[1] + l*sin(q[2]), p1[2] - l*cos(q[2]))
local double = lagrange { q = q, T = m*(norm(der(p1))^2 + norm(der(p2))^2)/2, V = m*g*(p1[2] + p2[2]) }
local chaos = double:integrate { start = { q = { 2, 2.5 }, [q.dot] = { 0, 0 } }, to = 10, rtol = 1e-9 }
page("double_pendulum", function(o)
  return plot(chaos, p2[1], p2[2], o { title = "Path of the second mass", equal = true, xlabel = "x",
    ylabel = "y" })
end)

local duffing = dae { der(x) ~ v, der(v) ~ x - x^3 - 0.3*v + 0.5*cos(w), der(w) ~ 1.2 }
local long = duffing:integrate { start = { x = 0.1, v = 0, w = 0 }, to = 2000 }
page("poincare", function(o)
  return poincare(long, sin(w/2), x, v, o { title = "Duffing, once a period" })
end)

local r = {}
seed(1)
for i = 1, 2000 do r[i] = randn() end
page("histogram", function(o) return histogram(r, o { title = "2000 normal numbers", xlabel = "value" }) end)
local grid = linspace(-2, 2, 25)
local function hill(a, b) return math.exp(-a*a - b*b) + 0.7*math.exp(-(a - 1)^2 - (b - 1)^2) end
page("heat_map", function(o) return heatmap(grid, grid, hill, o { title = "Two hills" }) end)
page("contour", function(o)
  return contour({ -2, 2 }, { -2, 2 }, hill, o { title = "Lines of equal height" })
end)
page("lorenz", function(o)
  local lorenz = dae { der(x) ~ 10*(y - x), der(y) ~ x*(28 - z) - y, der(z) ~ x*y - "8/3"*z }
  local run = lorenz:integrate { start = { x = 1, y = 1, z = 1 }, to = 20 }
  return plot3(run, { x, y, z }, o { title = "Lorenz", equal = true })
end)
local ball_surface = surface(function(a, b)
  return math.cos(a)*math.sin(b), math.sin(a)*math.sin(b), math.cos(b)
end, { 0, 2*math.pi }, { 0, math.pi }, 12)
page("sphere", function(o)
  return plot3(o { surfaces = { ball_surface }, equal = true, title = "Sphere" })
end)
page("log_axes", function(o)
  return loglog({ 1e-3, 1e-2, 1e-1, 1 }, mat { { 1e-6, 1e-9 }, { 1e-4, 1e-6 }, { 1e-2, 1e-3 }, { 1, 1 } },
    o { labels = { "order 2", "order 3" }, xlabel = "step", ylabel = "error", title = "Convergence",
      style = "line+points" })
end)
page("band", function(o)
  local t, low, high, mid = linspace(0, 6, 61), {}, {}, {}
  for i = 1, #t do
    mid[i] = math.exp(-t[i]/3)*math.cos(3*t[i])
    low[i], high[i] = mid[i] - 0.1 - t[i]/30, mid[i] + 0.1 + t[i]/30
  end
  return overlay(band(t, low, high, o { title = "Band", labels = { "± 2σ" } }),
    plot(t, mid, o { labels = { "mean" } }))
end)
page("panels", function(o) return layout({ 2, 1 }, plot(hops, x, o()), plot(hops, v, o())) end)
local resonance = tf({ 1 }, { 1, 0.4, 1 })
for name, fig in pairs { stability = rk.rk4:plot(), bode = resonance:bode():plot(),
  nyquist = resonance:nyquist() } do
  page(name, function(o)
    local parts = fig:parts()
    parts.theme = o().theme
    for i, panel in ipairs(parts.below or {}) do
      local inner = panel:parts()
      inner.theme = parts.theme
      parts.below[i] = figure(inner)
    end
    return figure(parts)
  end)
end

-- The contact sheet: every picture on one page.
local names = {}
for _, file in ipairs(ls(folder)) do names[#names + 1] = file:match "^(.*)%-light%.svg$" end
local lines = { "# Gallery", "", "Made by `./dev gallery` from [gallery.lua](gallery.lua).", "" }
for _, name in ipairs(names) do
  local dark = io.open(("%s/%s-dark.svg"):format(folder, name))
  if dark then dark:close() end
  lines[#lines + 1] = ("![%s](%s-light.svg)"):format(name:gsub("_", " "), name)
    .. (dark and (" ![%s, dark](%s-dark.svg)"):format(name:gsub("_", " "), name) or "")
  lines[#lines + 1] = ""
end
local sheet <close> = assert(io.open(folder .. "/README.md", "w"))
sheet:write(table.concat(lines, "\n", 1, #lines - 1), "\n")
