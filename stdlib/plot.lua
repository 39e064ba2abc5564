-- plot, plot3, semilogy, semilogx, loglog, spy: what a user hands over becomes the table that figure{…} reads
-- (src/lua/bind/plot/plot.cpp). Columns are lists of numbers or numeric matrices; a matrix of several
-- columns is
-- several curves.

local unpack = table.unpack

-- ── reading arguments ──────────────────────────────────────────────────────────────────────────────────────

-- Options of single curves: one value for all, or a list with one for each.
local per_curve = { "style", "colour", "color", "dash", "width", "marker" }
local options_2d = { "title", "xlabel", "ylabel", "labels", "legend", "xlim", "ylim", "style", "equal",
    "size", "notes",
                     "colour", "color", "dash", "width", "marker", "grid", "hlines", "vlines", "texts",
                       "xlog", "ylog",
                     "xstep", "ystep" }
local options_3d = { "title", "xlabel", "ylabel", "zlabel", "labels", "legend", "xlim", "ylim", "zlim",
    "style", "equal",
                     "size", "notes", "view", "surfaces", "colour", "color", "width" }

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
      fail(("%s: unknown option '%s'.%s (options: %s)"):format(by, key, did_you_mean(key, known),
        table.concat(known, ", ")))
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
      fail(("%s: a list of expressions has no key '%s'; options are a table of their own"):format(by,
        tostring(key)))
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

-- ── labels ─────────────────────────────────────────────────────────────────────────────────────────────────

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

-- The same expression of several solutions is told apart by the number of the solution.
local function add_suffixes(series)
  for _, each in ipairs(series) do
    if each.suffix then
      for k, label in ipairs(each.labels) do each.labels[k] = label_text(label) .. each.suffix end
      each.suffix = nil
    end
  end
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
    fail(("%s: option 'labels' has %d labels for %d curve%s"):format(by, #given, at - 1,
      at == 2 and "" or "s"))
  end
end

-- ── series ─────────────────────────────────────────────────────────────────────────────────────────────────

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

-- A line follows the solution between its points; marks, strokes and steps stand at the points that were
-- saved.
local follows = { line = true, ["line+points"] = true }

local function style_of(options, index)
  local style = options.style
  if type(style) == "table" then style = style[index] or style[#style] end
  return style
end

-- A list of solutions, or one.
local function solutions_in(value)
  if is_solution(value) then return { value } end
  if type(value) ~= "table" or not is_solution(value[1]) then return nil end
  for i, each in ipairs(value) do
    if not is_solution(each) then fail(("plot: entry %d of the list of solutions is not a solution"):format(
      i)) end
  end
  return value
end

local function sheet_of(options, more)
  local sheet = { xlim = options.xlim, ylim = options.ylim, xlog = options.xlog, ylog = options.ylog,
    size = options.size }
  for key, value in pairs(more or {}) do sheet[key] = value end
  return sheet
end

-- Expressions over time along a solution; `suffix` tells solutions apart.
local function add_along_solution(by, series, solution, what, options, suffix)
  local list = type(what) == "table" and check_holes(by, what) or { what }
  local style = style_of(options, #series + 1)
  if style and not follows[style] then
    for _, expression in ipairs(list) do
      local names = labels_of(expression, {})
      series[#series + 1] = { x = solution.t, y = solution(expression), labels = names, count = #names,
        suffix = suffix }
    end
    return
  end
  local columns, breaks, saved = solution:curve(list, sheet_of(options))
  local at = 1
  for _, expression in ipairs(list) do
    local group = #series + 1
    for _, name in ipairs(labels_of(expression, {})) do
      at = at + 1
      series[#series + 1] = { x = columns[1], y = columns[at], labels = { name }, count = 1,
        breaks = breaks, marked = saved,
                              group = group, suffix = suffix, style = "line" }
    end
  end
end

-- y against x along a solution; returns the labels of the axes.
local function add_against(by, series, solution, x, y, options, suffix)
  local names = labels_of(y, labels_of(x, {}))
  if #names ~= 2 or type(x) == "table" or type(y) == "table" then
    fail(("%s: %s(sol, x, y) draws one expression against another one; over time write %s(sol, { x, y })"):format(
      by, by, by))
  end
  local style = style_of(options, #series + 1)
  local each = { labels = { suffix and names[2] }, count = 1, style = "line", suffix = suffix }
  if style and not follows[style] then
    each.x, each.y = solution(x), solution(y)
  else
    local columns, breaks, saved = solution:curve({ x, y }, sheet_of(options, { coordinates = 2 }))
    each.x, each.y, each.breaks, each.marked = columns[1], columns[2], breaks, saved
  end
  series[#series + 1] = each
  return names
end

-- The pairs of plot(y), plot(x, y, …), plot(sol, expressions, …) and the triple plot(sol, x, y).
local function read_series(by, arguments, options)
  local series, axes, bare = {}, nil, false
  local n = arguments.n
  if n == 0 then fail(by .. ": nothing to draw: write " .. by .. "(x, y)") end
  if n == 1 and solutions_in(arguments[1]) then
    fail(("%s: what is to be drawn of this solution? write %s(sol, { x, y })"):format(by, by))
  end
  if n == 1 then
    bare = true
    add_pair(by, series, nil, check_column(by, "y", arguments[1]))
    return series, axes, bare
  end
  local runs = solutions_in(arguments[1])
  local function suffix(run) return #runs > 1 and (" (%d)"):format(run) or nil end
  if n == 3 and runs and not solutions_in(arguments[3]) then
    for k, run in ipairs(runs) do axes = add_against(by, series, run, arguments[2], arguments[3], options,
      suffix(k)) end
    return series, axes, bare
  end
  if n % 2 == 1 then
    fail(("%s: arguments come in pairs x, y, but there are %d; options are written { title = … }"):format(
      by, n))
  end
  for i = 1, n, 2 do
    local x, y = arguments[i], arguments[i + 1]
    runs = solutions_in(x)
    if runs then
      axes = axes or { named "t" }
      for k, run in ipairs(runs) do add_along_solution(by, series, run, y, options, suffix(k)) end
    else
      add_pair(by, series, check_column(by, "x", x), check_column(by, "y", y))
    end
  end
  return series, axes, bare
end

-- Few points are marked, so that one sees where they are.
local function default_style(series)
  return rows_of(series.y) <= 30 and "line+points" or "line"
end

local function set_looks(by, series, options)
  for i, each in ipairs(series) do
    local index = each.group or i
    each.style = style_of(options, index) or each.style or (each.y and default_style(each)) or "line"
    for _, key in ipairs(per_curve) do
      local value = options[key]
      if type(value) == "table" then value = value[index] end
      if key ~= "style" and value ~= nil then each[key == "color" and "colour" or key] = value end
    end
    if each.style ~= "line+points" then each.marked = nil end
    each.group, each.count = nil, nil
  end
end

local function copy_options(description, options)
  local dropped = { labels = true }
  for _, key in ipairs(per_curve) do dropped[key] = true end
  for key, value in pairs(options) do
    if not dropped[key] then description[key] = value end
  end
  return description
end

-- ── 2-D ────────────────────────────────────────────────────────────────────────────────────────────────────

local function plot_with(by, axes, ...)
  if select("#", ...) == 1 then  -- figures, tableaus, tables of errors know how to draw themselves
    local only = ...
    local kind = object_type(only)
    if kind == "figure" then return only end
    if kind and kind ~= "matrix" and named(kind .. ":plot") then return only:plot() end
  end
  local arguments, options = split_options(by, options_2d, ...)
  for key, value in pairs(axes) do
    if options[key] == nil then options[key] = value end
  end
  local series, names, bare = read_series(by, arguments, options)
  add_suffixes(series)
  spread_labels(by, series, options)
  set_looks(by, series, options)
  local description = copy_options({ by = by, series = series, xwhole = bare or nil }, options)
  if names and description.xlabel == nil then description.xlabel = names[1] end
  if names and description.ylabel == nil then description.ylabel = names[2] end
  return figure(description)
end

doc { name = "plot", module = "plot", title = "Looking at things",
    sig = "plot(x, y [, x2, y2 …] [, options]) -> figure",
  text = "A figure of curves: plot(y), plot(x, y), plot(x, {y1, y2}); plot(sol, {x, y}) for any expressions "
    .. "along a solution, plot(sol, x, y) for y against x, plot({sol1, sol2}, x) for several solutions. "
    .. "Options: title, xlabel, ylabel, labels = {…}, legend (true, false or a place such as \"top left\"), "
    .. "xlim, ylim, xlog, ylog, xstep, ystep, grid, hlines and vlines = { 0, {1, \"limit\"} }, texts = {{x, "
    .. "y, \"words\"}}, equal = true, size = {width, height}, notes; and for all curves or as a list one "
    .. "for each: style (line, points, line+points, dots, impulses, steps, cells, fill), colour, dash "
    .. "(solid, dashed, dotted, dashdot), width, marker (circle, ring, square, box, triangle, diamond, "
    .. "plus, cross). A line along a solution follows it between the saved points and breaks where it "
    .. "jumps. At the prompt the figure is drawn when it is the value of the line; in a script by :show() "
    .. "and :save \"file.svg\".",
  example = "plot({0, 1, 2}, {0, 1, 4}, { title = \"Squares\", xlabel = \"n\" })",
    gives = "figure 'Squares': 1 series, 3 points",
  function(...) return plot_with("plot", {}, ...) end }

doc { name = "semilogy", module = "plot", sig = "semilogy(x, y [, options]) -> figure",
  text = "plot with a logarithmic y axis. What is not positive is left out and counted in a note.",
  example = "semilogy({1, 0.1, 1e-3, 1e-7})", gives = "figure: 1 series, 4 points",
  function(...) return plot_with("semilogy", { ylog = true }, ...) end }

doc { name = "semilogx", module = "plot", sig = "semilogx(x, y [, options]) -> figure",
  text = "plot with a logarithmic x axis.", example = "semilogx({1, 10, 100}, {1, 2, 3})", gives = "figure: "
    .. "1 series, 3 points",
  function(...) return plot_with("semilogx", { xlog = true }, ...) end }

doc { name = "loglog", module = "plot", sig = "loglog(x, y [, options]) -> figure",
  text = "plot with two logarithmic axes: the slope of a straight line is the power, such as the order of a "
    .. "method.",
  example = "loglog({0.1, 0.05}, {1e-4, 6.25e-6})", gives = "figure: 1 series, 2 points",
  function(...) return plot_with("loglog", { xlog = true, ylog = true }, ...) end }

-- ── 3-D ────────────────────────────────────────────────────────────────────────────────────────────────────

local function is_point(value) return object_type(value) == "matrix" and size(value) == 3 end

-- { p1, p2 } are two points, { x, y, z } with three scalars is one.
local function points_of(by, what)
  if is_point(what) then return { what } end
  if type(what) ~= "table" then
    fail(by .. ": expected a point with three components, such as p or { x, y, z }") end
  check_holes(by, what)
  if #what == 3 and not is_point(what[1]) then return { what } end
  for i = 1, #what do
    if not is_point(what[i]) and not (type(what[i]) == "table" and #what[i] == 3) then
      fail(("%s: entry %d of the list is not a point with three components"):format(by, i))
    end
  end
  return what
end

local function add_trajectories(by, series, solution, what, options)
  local axes = nil
  local points = points_of(by, what)
  for _, point in ipairs(points) do
    local parts = type(point) == "table" and point or { point[1], point[2], point[3] }
    local each = { count = 1 }
    local style = style_of(options, #series + 1)
    if style and not follows[style] then
      each.x, each.y, each.z = solution(parts[1]), solution(parts[2]), solution(parts[3])
    else
      local sheet = { coordinates = 3, xlim = options.xlim, ylim = options.ylim, zlim = options.zlim,
        size = options.size }
      local columns, breaks, saved = solution:curve({ parts[1], parts[2], parts[3] }, sheet)
      each.x, each.y, each.z = columns[1], columns[2], columns[3]
      each.breaks, each.marked = breaks, saved
    end
    if #points == 1 then axes = labels_of(parts[3], labels_of(parts[2], labels_of(parts[1], {})))
    else each.labels = { type(point) == "table" and ("point %d"):format(#series + 1) or point } end
    series[#series + 1] = each
  end
  return axes
end

local function read_space(by, arguments, options)
  local series, axes, along = {}, nil, false
  local n = arguments.n
  if n == 1 and is_solution(arguments[1]) then
    fail(by .. ": what is to be drawn of this solution? write plot3(sol, p) with a point p")
  elseif n == 1 then
    series[1] = { points = check_column(by, "the matrix of points", arguments[1]), count = 1 }
  elseif is_solution(arguments[1]) then
    along = true
    if n % 2 == 1 then
      fail(by .. ": arguments come in pairs sol, point; options are written { title = … }")
    end
    for i = 1, n, 2 do
      if not is_solution(arguments[i]) then fail(("%s: argument %d must be a solution"):format(by, i)) end
      axes = add_trajectories(by, series, arguments[i], arguments[i + 1], options)
    end
    if n > 2 then axes = nil end
  elseif n % 3 == 0 then
    for i = 1, n, 3 do
      local x, y, z = arguments[i], arguments[i + 1], arguments[i + 2]
      series[#series + 1] = { x = check_column(by, "x", x), y = check_column(by, "y", y),
        z = check_column(by, "z", z),
                              count = 1 }
    end
  elseif n > 0 then
    fail(("%s: expected x, y, z or sol, p, but there are %d arguments; options are written { title = … }"):format(
      by, n))
  end
  return series, axes or { "x", "y", "z" }, along
end

doc { name = "plot3", module = "plot", sig = "plot3(x, y, z [, options]) -> figure",
  text = "Curves in space: plot3(x, y, z), plot3(sol, p) or plot3(sol, {p1, p2}) for points p along a "
    .. "solution, plot3(m) for an n×3 matrix. Options as in plot, and zlabel, zlim, view = {tilt, turn} in "
    .. "degrees, and surfaces = { sphere(1) }: nets one can see through. With surfaces or a solution one "
    .. "unit is equally long on all axes (equal = false: fill the frame).",
  example = "plot3({0, 1, 2}, {0, 1, 0}, {1, 2, 3}, { surfaces = { sphere(1) } })",
  gives = "3-D figure: 1 series, 3 points, 1 surface",
  function(...)
    local arguments, options = split_options("plot3", options_3d, ...)
    local series, axes, along = read_space("plot3", arguments, options)
    spread_labels("plot3", series, options)
    for _, each in ipairs(series) do each.style = each.style or "line" end
    set_looks("plot3", series, options)
    local description = copy_options({ by = "plot3", series = series, three_d = true }, options)
    if description.equal == nil then description.equal = along or options.surfaces ~= nil end
    for i, key in ipairs { "xlabel", "ylabel", "zlabel" } do
      if description[key] == nil then description[key] = axes[i] end
    end
    return figure(description)
  end }

-- ── pages ──────────────────────────────────────────────────────────────────────────────────────────────────

doc { name = "band", module = "plot", sig = "band(x, low, high [, options]) -> figure",
  text = "The area between two curves, such as a confidence band. Options as in plot; plot more into it "
    .. "with overlay.",
  example = "band({0, 1, 2}, {0, 0, 1}, {1, 2, 2})", gives = "figure: 1 series, 3 points",
  function(x, low, high, options)
    local _, checked = split_options("band", options_2d, {}, options or {})
    local series = { { x = check_column("band", "x", x), y = check_column("band", "high", high),
                       lower = check_column("band", "low", low), style = "fill", count = 1 } }
    spread_labels("band", series, checked)
    checked.style = nil
    set_looks("band", series, checked)
    return figure(copy_options({ by = "band", series = series }, checked))
  end }

doc { name = "overlay", module = "plot", sig = "overlay(figure, figure, …) -> figure",
  text = "The curves of several 2-D figures in one: titles, axes and everything else are those of the first.",
  example = "overlay(band({0, 1}, {0, 1}, {1, 2}), plot({0, 1}, {0.5, 1.5}))",
    gives = "figure: 2 series, 4 points",
  function(first, ...)
    for i, each in ipairs { first, ... } do
      if object_type(each) ~= "figure" then fail(("overlay: argument %d is not a figure"):format(i)) end
    end
    for _, each in ipairs { ... } do first = first:with(each) end
    return first
  end }

doc { name = "layout", module = "plot", sig = "layout({rows, columns}, figure, figure, …) -> figure",
  text = "Several 2-D figures on one page, row by row; in a terminal one under the other.",
  example = "layout({1, 2}, plot({0, 1}), plot({1, 0}))", gives = "figure: 1 series, 2 points, 2 panels",
  function(shape, ...)
    local panels = { ... }
    local rows, columns = unpack(type(shape) == "table" and shape or {})
    if math.type(rows) ~= "integer" or math.type(columns) ~= "integer" or rows < 1 or columns < 1 then
      fail "layout: the first argument says the number of rows and columns: layout({2, 1}, fig1, fig2)"
    end
    if #panels == 0 or #panels > rows * columns then
      fail(("layout: %d figures do not fit into %d × %d places"):format(#panels, rows, columns))
    end
    for i, each in ipairs(panels) do
      if object_type(each) ~= "figure" then fail(("layout: argument %d is not a figure"):format(i + 1)) end
    end
    return panels[1]:page(columns, { unpack(panels, 2) })
  end }

-- ── patterns ───────────────────────────────────────────────────────────────────────────────────────────────

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
  if object_type(matrix) ~= "matrix" then
    fail(by .. ": expected a matrix, got " .. (object_type(matrix) or type(matrix))) end
  return matrix.rows, matrix.cols, function(i, j) return matrix(i, j) end
end

doc { name = "spy", module = "plot", sig = "spy(matrix [, options]) -> figure",
  text = "The pattern of a matrix: a cell for every entry that is not zero.",
  example = "spy({{1, 0}, {2, 3}}).notes[1]", gives = "3 of 4 entries are not zero",
  function(matrix, options)
    local _, checked = split_options("spy", { "title", "xlabel", "ylabel", "size", "notes" }, {},
      options or {})
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
