-- Values over a plane: heatmap (cells with colours) and contour (lines of equal value).

local arguments, curves, options = plotting.arguments, plotting.series, plotting.options

local M = {}

-- z[i][j] at (x[j], y[i]) of a function f(x, y), an expression in two symbols, or a matrix of numbers.
local function values_of(by, x, y, f)
  local kind = object_type(f)
  local z = {}
  if kind == "matrix" or type(f) == "table" then
    local rows = kind and f.rows or #f
    local columns = kind and f.cols or type(f[1]) == "table" and #f[1] or 0
    if rows ~= #y or columns ~= #x then
      fail(("%s: the matrix is %d×%d, but there are %d values of y and %d of x"):format(by, rows, columns, #y,
        #x))
    end
    for i = 1, #y do
      z[i] = {}
      for j = 1, #x do z[i][j] = kind and f(i, j) or f[i][j] end
    end
    return z
  end
  if type(f) ~= "function" then
    fail(("%s: expected a function f(x, y) or a matrix with one row per value of y, got %s; an expression "
      .. "e in x "
      .. "and y is drawn as fn({x, y}, e)"):format(by, kind or type(f)))
  end
  for i = 1, #y do
    z[i] = {}
    for j = 1, #x do
      local value = f(x[j], y[i])
      z[i][j] = tonumber(value) or fail(("%s: f(%g, %g) is no number"):format(by, x[j], y[i]))
    end
  end
  return z
end

local function cells(by, n)
  if math.type(n) == "integer" and n >= 2 and n <= 10000 then return n end
  fail(("%s: n = %s; it must be a whole number of cells from 2 to 10000"):format(by, tostring(n)))
end

-- { low, high } becomes n numbers, a list or column stays.
local function axis_of(by, name, values, n, f)
  if values == nil then fail(("%s: %s is missing: { from, to } or a list of numbers"):format(by, name)) end
  local count = type(values) == "table" and #values or object_type(values) == "matrix"
    and values.rows*values.cols
    or fail(("%s: %s must be { from, to } or a list of numbers"):format(by, name))
  local list = {}
  if count == 2 and (type(f) == "function" or object_type(f) == "fn") then
    for i = 1, n do list[i] = values[1] + (values[2] - values[1])*(i - 1)/(n - 1) end
    return list
  end
  for i = 1, count do list[i] = values[i] end
  if count < 2 then fail(("%s: %s needs two values at least"):format(by, name)) end
  return list
end

local function callable(f)
  if object_type(f) == "fn" then return function(x, y) return f(x, y) end end
  return f
end

-- The axes as lists, and z[i][j] at (x[j], y[i]).
local function sampled(by, x, y, f, n)
  n = cells(by, n)
  x, y = axis_of(by, "x", x, n, f), axis_of(by, "y", y, n, f)
  return x, y, values_of(by, x, y, callable(f))
end

local map_options = options.joined(options.named { "title", "xlabel", "ylabel", "xlim", "ylim", "size",
  "notes",
  "equal", "theme" }, { option("n", "integer", "cells in each direction where a range is given", "60"),
  option("label", "string", "the quantity that the colours show") })

doc { name = "heatmap", module = "plot", sig = "heatmap(x, y, z [, options]) -> figure",
  text = "The values z of a function f(x, y), or of a matrix with one row per y, as colours over the plane. "
    .. "x and y "
    .. "are lists, or ranges { from, to }.",
  example = "heatmap({0, 1}, {0, 1}, function(x, y) return x*y end, { n = 10 })",
  gives = "figure: 1 series, 100 points", options = map_options,
  function(x, y, f, given)
    local chosen = check_options("heatmap", given, map_options)
    local z
    x, y, z = sampled("heatmap", x, y, f, chosen.n or 60)
    local px, py, values = {}, {}, {}
    for i = 1, #y do
      for j = 1, #x do px[#px + 1], py[#py + 1], values[#values + 1] = x[j], y[i], z[i][j] end
    end
    local dx, dy = (x[#x] - x[1])/(#x - 1), (y[#y] - y[1])/(#y - 1)
    local description = curves.copy_options({ by = "heatmap", value_label = chosen.label,
      series = { { x = px, y = py, value = values, style = "cells", cell = { math.abs(dx), math.abs(dy) } } },
      xlim = { x[1] - dx/2, x[#x] + dx/2 }, ylim = { y[1] - dy/2, y[#y] + dy/2 } }, chosen)
    description.n, description.label = nil, nil
    return figure(description)
  end }

-- Where the line z = level crosses the cell with the corners (j, i) … (j+1, i+1): pairs of points (marching
-- squares; Lorensen and Cline, Computer Graphics 21(4), 1987, in the plane).
local function crossings(x, y, z, i, j, level)
  local corners = { { j, i }, { j + 1, i }, { j + 1, i + 1 }, { j, i + 1 } }
  local points = {}
  for k = 1, 4 do
    local a, b = corners[k], corners[k % 4 + 1]
    local za, zb = z[a[2]][a[1]] - level, z[b[2]][b[1]] - level
    if (za < 0) ~= (zb < 0) then
      local share = za/(za - zb)
      points[#points + 1] = { x[a[1]] + share*(x[b[1]] - x[a[1]]), y[a[2]] + share*(y[b[2]] - y[a[2]]) }
    end
  end
  return points
end

-- Strokes that share an end become one line.
local function chained(strokes)
  local function key(point) return ("%.12g %.12g"):format(point[1], point[2]) end
  local at = {}                      -- the strokes that end at a point
  for _, stroke in ipairs(strokes) do
    for k = 1, 2 do
      local name = key(stroke[k])
      at[name] = at[name] or {}
      table.insert(at[name], stroke)
    end
  end
  local function extended(line, point)
    while true do
      local following
      for _, stroke in ipairs(at[key(point)]) do
        if not stroke.used then following = stroke end
      end
      if not following then return end
      following.used = true
      point = key(following[1]) == key(point) and following[2] or following[1]
      line[#line + 1] = point
    end
  end
  local lines = {}
  for _, stroke in ipairs(strokes) do
    if not stroke.used then
      stroke.used = true
      local back, line = { stroke[1] }, {}
      extended(back, stroke[1])
      for k = #back, 1, -1 do line[#line + 1] = back[k] end
      line[#line + 1] = stroke[2]
      extended(line, stroke[2])
      lines[#lines + 1] = line
    end
  end
  return lines
end

-- The line of one level: columns x and y, and the rows before which it is interrupted.
function M.level_line(x, y, z, level)
  local strokes = {}
  for i = 1, #y - 1 do
    for j = 1, #x - 1 do
      local points = crossings(x, y, z, i, j, level)
      for k = 1, #points - 1, 2 do strokes[#strokes + 1] = { points[k], points[k + 1] } end
    end
  end
  local px, py, breaks = {}, {}, {}
  for _, line in ipairs(chained(strokes)) do
    if #px > 0 then breaks[#breaks + 1] = #px + 1 end
    for _, point in ipairs(line) do px[#px + 1], py[#py + 1] = point[1], point[2] end
  end
  return px, py, breaks
end

-- About n round numbers between low and high.
local function round_levels(low, high, n)
  local raw = (high - low)/n
  local power = 10^math.floor(math.log(raw, 10))
  local step = power
  for _, factor in ipairs { 1, 2, 5, 10 } do
    if factor*power <= raw*1.001 then step = factor*power end
  end
  local levels = {}
  for k = math.ceil(low/step), math.floor(high/step) do levels[#levels + 1] = k*step end
  return levels
end

-- From dark blue to yellow as in heatmap; on a dark page none is darker than can be seen.
local shades = { light = { "#440154", "#3B528B", "#21918C", "#5EC962", "#D8C219" },
  dark = { "#9B7FC9", "#6F8FD6", "#2FB5AC", "#5EC962", "#FDE725" } }

-- The colour at a share from 0 to 1 of the way along a list of colours.
local function colour_at(colours, share)
  local place = 1 + share*(#colours - 1)
  local k = math.min(math.floor(place), #colours - 1)
  local mixed = "#"
  for at = 2, 6, 2 do
    local from, to = tonumber(colours[k]:sub(at, at + 1), 16), tonumber(colours[k + 1]:sub(at, at + 1), 16)
    mixed = mixed .. ("%02X"):format(math.floor(from + (place - k)*(to - from) + 0.5))
  end
  return mixed
end

local contour_options = options.joined(options.flat, { option("levels", "number or list",
  "values of the lines, or about how many", "10"),
    option("n", "integer", "cells in each direction", "80") })

doc { name = "contour", module = "plot", sig = "contour(x, y, z [, options]) -> figure",
  text = "Lines of equal value of a function f(x, y), or of a matrix with one row per y.",
  example = "contour({-1, 1}, {-1, 1}, function(x, y) return x^2 + y^2 end, { levels = {0.5, 1} }).labels[1]",
  gives = "0.5", options = contour_options,
  function(x, y, f, given)
    local chosen = check_options("contour", given, contour_options)
    local z
    x, y, z = sampled("contour", x, y, f, chosen.n or 80)
    local low, high = math.huge, -math.huge
    for i = 1, #y do
      for j = 1, #x do low, high = math.min(low, z[i][j]), math.max(high, z[i][j]) end
    end
    local levels = chosen.levels or 10
    if type(levels) ~= "table" then levels = round_levels(low, high, levels) end
    local series, colours = {}, shades[chosen.theme] or shades.light
    for k, level in ipairs(levels) do
      local px, py, breaks = M.level_line(x, y, z, level)
      if #px > 0 then
        local colour = colour_at(colours, (k - 1)/math.max(1, #levels - 1))
        series[#series + 1] = { x = px, y = py, breaks = breaks, style = "line",
          labels = { ("%.6g"):format(level) },
          colour = colour, dash = "solid", count = 1 }
      end
    end
    if #series == 0 then
      fail(("contour: none of the levels lies between %.6g and %.6g, the values of f"):format(low, high))
    end
    curves.set_looks("contour", series, chosen)
    local description = curves.copy_options({ by = "contour", series = series, xlim = { x[1], x[#x] },
      ylim = { y[1], y[#y] } }, chosen)
    if description.legend == nil then description.legend = #series <= 12 and "right" or false end
    description.n, description.levels = nil, nil
    return figure(description)
  end }

plotting.grid = M
