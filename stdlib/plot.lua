-- plot, plot3, semilogy, semilogx, loglog, spy: what a user hands over becomes the table that figure{…} reads
-- (src/lua/bind/plot/plot.cpp). Columns are lists of numbers or numeric matrices; a matrix of several columns is several curves.

local unpack = table.unpack

-- ── reading arguments ───────────────────────────────────────────────────────────────────────────────────────────────

local options_2d = { "title", "xlabel", "ylabel", "labels", "legend", "xlim", "ylim", "style", "equal", "size", "notes" }
local options_3d = { "title", "xlabel", "ylabel", "zlabel", "labels", "legend", "xlim", "ylim", "zlim", "style", "equal",
                     "size", "notes", "view", "surfaces" }

-- { title = … }, and {} after complete data; plot(x, {}) is a mistake with an empty y.
local function is_options(value, count)
  return type(value) == "table" and value[1] == nil and (next(value) ~= nil or count > 2)
end

local function sorted_keys(t)
  local keys = {}
  for key in pairs(t) do keys[#keys + 1] = tostring(key) end
  table.sort(keys)
  return keys
end

-- The arguments without the table of options at their end; the options, checked.
local function split_options(by, known, ...)
  local arguments = table.pack(...)
  for i = 1, arguments.n do
    if arguments[i] == nil then fail(("%s: argument %d is nil"):format(by, i)) end
  end
  local options = {}
  if is_options(arguments[arguments.n], arguments.n) then
    options = arguments[arguments.n]
    arguments[arguments.n], arguments.n = nil, arguments.n - 1
  end
  local allowed = {}
  for _, name in ipairs(known) do allowed[name] = true end
  for _, key in ipairs(sorted_keys(options)) do
    if not allowed[key] then
      fail(("%s: unknown option '%s'.%s (options: %s)"):format(by, key, did_you_mean(key, known), table.concat(known, ", ")))
    end
  end
  return arguments, options
end

local function is_solution(value) return object_type(value) == "solution" end

-- A hole would make a shorter list: it is reported.
local function check_holes(by, list)
  local last = 0
  for key in pairs(list) do
    if math.type(key) ~= "integer" or key < 1 then
      fail(("%s: a list of expressions has no key '%s'; options are a table of their own"):format(by, tostring(key)))
    end
    last = math.max(last, key)
  end
  for i = 1, last do
    if list[i] == nil then fail(("%s: entry %d of the list is nil"):format(by, i)) end
  end
  return list
end

-- Columns inside a list, as in plot(x, {y1, y2}). Constants such as sqrt(2) are numbers, not columns.
local function is_list_of_columns(value)
  return type(value) == "table" and (type(value[1]) == "table" or object_type(value[1]) == "matrix")
end

-- ── labels ──────────────────────────────────────────────────────────────────────────────────────────────────────────

local function size(value) return value.rows * value.cols end

-- One label for each scalar in an expression or a column of them; figure{} finds the words for an expression.
local function labels_of(expression, into)
  if object_type(expression) ~= "matrix" then
    into[#into + 1] = object_type(expression) and expression or tostring(expression)
  else
    for i = 1, size(expression) do labels_of(expression[i], into) end
  end
  return into
end

-- options.labels = "x" or { "x", "y" } spread over the series in the order of their columns.
local function spread_labels(by, series, options)
  local given = options.labels
  if given == nil then return end
  if type(given) ~= "table" then given = { given } end
  local at = 1
  for _, each in ipairs(series) do
    each.labels = { unpack(given, at, at + each.count - 1) }
    at = at + each.count
  end
  if #given >= at then
    fail(("%s: option 'labels' has %d labels for %d curve%s"):format(by, #given, at - 1, at == 2 and "" or "s"))
  end
end

-- ── series ──────────────────────────────────────────────────────────────────────────────────────────────────────────

local function rows_of(column)
  if type(column) == "table" then return #column end
  return column.cols == 1 and column.rows or math.max(column.rows, column.cols)
end

local function count_of(column)
  if type(column) == "table" then return type(column[1]) == "table" and #column[1] or 1 end
  return column.rows == 1 and 1 or column.cols
end

local function check_column(by, what, value)
  local kind = object_type(value) or type(value)
  if kind == "table" or kind == "matrix" then return value end
  if kind == "number" then return { value } end
  if kind == "expr" then
    fail(("%s: %s is the expression %s; to draw it along a solution write %s(sol, %s)"):format(
      by, what, tostring(value), by, tostring(value)))
  end
  fail(("%s: %s must be a list of numbers or a column, not a %s"):format(by, what, kind))
end

-- {y1, y2} are two curves, but a list of n rows beside n values of x is a matrix.
local function curves_in(y, n)
  if not is_list_of_columns(y) or (type(y[1]) == "table" and #y == n and #y[1] ~= n) then return { y } end
  return y
end

local function add_pair(by, series, x, y)
  for i, each in ipairs(curves_in(y, x and rows_of(x))) do
    each = check_column(by, "curve " .. i, each)
    series[#series + 1] = { x = x, y = each, count = count_of(each) }
  end
end

local function add_along_solution(by, series, solution, what)
  for _, expression in ipairs(type(what) == "table" and check_holes(by, what) or { what }) do
    local names = labels_of(expression, {})
    series[#series + 1] = { x = solution.t, y = solution(expression), labels = names, count = #names }
  end
end

-- The pairs of plot(y), plot(x, y, …) and plot(sol, expressions, …).
local function read_series(by, arguments)
  local series, along_time, bare = {}, false, false
  local n = arguments.n
  if n == 0 then fail(by .. ": nothing to draw: write " .. by .. "(x, y)") end
  if n == 1 and is_solution(arguments[1]) then
    fail(("%s: what is to be drawn of this solution? write %s(sol, { x, y })"):format(by, by))
  end
  if n == 1 then
    bare = true
    add_pair(by, series, nil, check_column(by, "y", arguments[1]))
    return series, along_time, bare
  end
  if n % 2 == 1 then
    fail(("%s: arguments come in pairs x, y, but there are %d; options are written { title = … }"):format(by, n))
  end
  for i = 1, n, 2 do
    local x, y = arguments[i], arguments[i + 1]
    if is_solution(x) then
      along_time = true
      add_along_solution(by, series, x, y)
    else
      add_pair(by, series, check_column(by, "x", x), check_column(by, "y", y))
    end
  end
  return series, along_time, bare
end

-- Few points are marked, so that one sees where they are.
local function default_style(series)
  return rows_of(series.y) <= 30 and "line+points" or "line"
end

local function set_styles(by, series, options)
  local style = options.style
  for i, each in ipairs(series) do
    if type(style) == "table" then each.style = style[i] or style[#style]
    else each.style = style or (each.y and default_style(each)) or "line" end
  end
end

local function copy_options(description, options)
  for key, value in pairs(options) do
    if key ~= "labels" and key ~= "style" then description[key] = value end
  end
  return description
end

-- ── 2-D ─────────────────────────────────────────────────────────────────────────────────────────────────────────────

local function plot_with(by, axes, ...)
  if select("#", ...) == 1 then  -- figures, tableaus, tables of errors know how to draw themselves
    local only = ...
    local kind = object_type(only)
    if kind == "figure" then return only end
    if kind and kind ~= "matrix" and named(kind .. ":plot") then return only:plot() end
  end
  local arguments, options = split_options(by, options_2d, ...)
  local series, along_time, bare = read_series(by, arguments)
  spread_labels(by, series, options)
  set_styles(by, series, options)
  local description = copy_options({ by = by, series = series, xwhole = bare or nil }, options)
  for key, value in pairs(axes) do description[key] = value end
  if along_time and description.xlabel == nil then description.xlabel = named "t" end
  for _, each in ipairs(series) do each.count = nil end
  return figure(description)
end

doc { name = "plot", module = "plot", title = "Looking at things", sig = "plot(x, y [, x2, y2 …] [, options]) -> figure",
  text = "A figure of curves: plot(y), plot(x, y), plot(x, {y1, y2}), or plot(sol, {x, y}) for any expressions along a "
    .. "solution. Options: title, xlabel, ylabel, labels = {…}, legend, xlim, ylim, style (line, points, line+points, dots, "
    .. "impulses, steps, cells), equal = true, size = {width, height}, notes. At the prompt the figure is drawn when it is "
    .. "the value of the line; in a script by :show() and :save \"file.svg\".",
  example = "plot({0, 1, 2}, {0, 1, 4}, { title = \"Squares\", xlabel = \"n\" })", gives = "figure 'Squares': 1 series, 3 points",
  function(...) return plot_with("plot", {}, ...) end }

doc { name = "semilogy", module = "plot", sig = "semilogy(x, y [, options]) -> figure",
  text = "plot with a logarithmic y axis. What is not positive is left out and counted in a note.",
  example = "semilogy({1, 0.1, 1e-3, 1e-7})", gives = "figure: 1 series, 4 points",
  function(...) return plot_with("semilogy", { ylog = true }, ...) end }

doc { name = "semilogx", module = "plot", sig = "semilogx(x, y [, options]) -> figure",
  text = "plot with a logarithmic x axis.", example = "semilogx({1, 10, 100}, {1, 2, 3})", gives = "figure: 1 series, 3 points",
  function(...) return plot_with("semilogx", { xlog = true }, ...) end }

doc { name = "loglog", module = "plot", sig = "loglog(x, y [, options]) -> figure",
  text = "plot with two logarithmic axes: the slope of a straight line is the power, such as the order of a method.",
  example = "loglog({0.1, 0.05}, {1e-4, 6.25e-6})", gives = "figure: 1 series, 2 points",
  function(...) return plot_with("loglog", { xlog = true, ylog = true }, ...) end }

-- ── 3-D ─────────────────────────────────────────────────────────────────────────────────────────────────────────────

local function is_point(value) return object_type(value) == "matrix" and size(value) == 3 end

-- { p1, p2 } are two points, { x, y, z } with three scalars is one.
local function points_of(by, what)
  if is_point(what) then return { what } end
  if type(what) ~= "table" then fail(by .. ": expected a point with three components, such as p or { x, y, z }") end
  check_holes(by, what)
  if #what == 3 and not is_point(what[1]) then return { what } end
  for i = 1, #what do
    if not is_point(what[i]) and not (type(what[i]) == "table" and #what[i] == 3) then
      fail(("%s: entry %d of the list is not a point with three components"):format(by, i))
    end
  end
  return what
end

local function add_trajectories(by, series, solution, what)
  local axes = nil
  local points = points_of(by, what)
  for _, point in ipairs(points) do
    local parts = type(point) == "table" and point or { point[1], point[2], point[3] }
    local each = { x = solution(parts[1]), y = solution(parts[2]), z = solution(parts[3]), count = 1 }
    if #points == 1 then axes = labels_of(parts[3], labels_of(parts[2], labels_of(parts[1], {})))
    else each.labels = { type(point) == "table" and ("point %d"):format(#series + 1) or point } end
    series[#series + 1] = each
  end
  return axes
end

local function read_space(by, arguments)
  local series, axes, along = {}, nil, false
  local n = arguments.n
  if n == 1 and is_solution(arguments[1]) then
    fail(by .. ": what is to be drawn of this solution? write plot3(sol, p) with a point p")
  elseif n == 1 then
    series[1] = { points = check_column(by, "the matrix of points", arguments[1]), count = 1 }
  elseif is_solution(arguments[1]) then
    along = true
    if n % 2 == 1 then fail(by .. ": arguments come in pairs sol, point; options are written { title = … }") end
    for i = 1, n, 2 do
      if not is_solution(arguments[i]) then fail(("%s: argument %d must be a solution"):format(by, i)) end
      axes = add_trajectories(by, series, arguments[i], arguments[i + 1])
    end
    if n > 2 then axes = nil end
  elseif n % 3 == 0 then
    for i = 1, n, 3 do
      local x, y, z = arguments[i], arguments[i + 1], arguments[i + 2]
      series[#series + 1] = { x = check_column(by, "x", x), y = check_column(by, "y", y), z = check_column(by, "z", z),
                              count = 1 }
    end
  elseif n > 0 then
    fail(("%s: expected x, y, z or sol, p, but there are %d arguments; options are written { title = … }"):format(by, n))
  end
  return series, axes or { "x", "y", "z" }, along
end

doc { name = "plot3", module = "plot", sig = "plot3(x, y, z [, options]) -> figure",
  text = "Curves in space: plot3(x, y, z), plot3(sol, p) or plot3(sol, {p1, p2}) for points p along a solution, plot3(m) for "
    .. "an n×3 matrix. Options as in plot, and zlabel, zlim, view = {tilt, turn} in degrees, and surfaces = { sphere(1) }: "
    .. "nets one can see through. With surfaces or a solution one unit is equally long on all axes (equal = false: fill the "
    .. "frame).",
  example = "plot3({0, 1, 2}, {0, 1, 0}, {1, 2, 3}, { surfaces = { sphere(1) } })",
  gives = "3-D figure: 1 series, 3 points, 1 surface",
  function(...)
    local arguments, options = split_options("plot3", options_3d, ...)
    local series, axes, along = read_space("plot3", arguments)
    spread_labels("plot3", series, options)
    for i, each in ipairs(series) do
      local style = options.style
      if type(style) == "table" then style = style[i] or style[#style] end
      each.style, each.count = style or "line", nil
    end
    local description = copy_options({ by = "plot3", series = series, three_d = true }, options)
    if description.equal == nil then description.equal = along or options.surfaces ~= nil end
    for i, key in ipairs { "xlabel", "ylabel", "zlabel" } do
      if description[key] == nil then description[key] = axes[i] end
    end
    return figure(description)
  end }

-- ── patterns ────────────────────────────────────────────────────────────────────────────────────────────────────────

local function entries_of(by, matrix)
  if type(matrix) == "table" then
    local rows, cols = #matrix, type(matrix[1]) == "table" and #matrix[1] or 0
    for i = 1, rows do
      if type(matrix[i]) ~= "table" or #matrix[i] ~= cols then
        fail(by .. ": expected a matrix or a list of equally long rows")
      end
    end
    return rows, cols, function(i, j) return matrix[i][j] end
  end
  if object_type(matrix) ~= "matrix" then fail(by .. ": expected a matrix, got " .. (object_type(matrix) or type(matrix))) end
  return matrix.rows, matrix.cols, function(i, j) return matrix(i, j) end
end

doc { name = "spy", module = "plot", sig = "spy(matrix [, options]) -> figure",
  text = "The pattern of a matrix: a cell for every entry that is not zero.",
  example = "spy({{1, 0}, {2, 3}}).notes[1]", gives = "3 of 4 entries are not zero",
  function(matrix, options)
    local _, checked = split_options("spy", { "title", "xlabel", "ylabel", "size", "notes" }, {}, options or {})
    local rows, cols, entry = entries_of("spy", matrix)
    if rows == 0 or cols == 0 then fail "spy: the matrix is empty" end
    local x, y = {}, {}
    for i = 1, rows do
      for j = 1, cols do
        if entry(i, j) ~= 0 then x[#x + 1], y[#y + 1] = j, i end
      end
    end
    if #x == 0 then fail(("spy: all %d entries are zero"):format(rows * cols)) end
    local description = copy_options({
      by = "spy", series = { { x = x, y = y, style = "cells" } }, equal = true, xwhole = true, ywhole = true,
      yreversed = true, xlim = { 0.5, cols + 0.5 }, ylim = { 0.5, rows + 0.5 },
      notes = { ("%d of %d entries are not zero"):format(#x, rows * cols) } }, checked)
    return figure(description)
  end }
