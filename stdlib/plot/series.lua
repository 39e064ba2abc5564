-- Columns and expressions along solutions as the series that figure{} reads
-- (src/lua/bind/plot/figure_reader.cpp).

local arguments = plotting.arguments
local is_solution, check_holes, labels_of = arguments.is_solution, arguments.check_holes, arguments.labels_of
local is_list_of_columns = arguments.is_list_of_columns
local M = {}

-- Options of single curves: one value for all, or a list with one for each.
local per_curve = { "style", "colour", "color", "dash", "width", "marker" }

-- ── series ─────────────────────────────────────────────────────────────────────────────────────────────────

function M.rows_of(column)
  if type(column) == "table" then return #column end
  return column.cols == 1 and column.rows or math.max(column.rows, column.cols)
end

local function count_of(column)
  if type(column) == "table" then return type(column[1]) == "table" and #column[1] or 1 end
  return column.rows == 1 and 1 or column.cols
end

function M.check_column(by, what, value)
  local kind = object_type(value) or type(value)
  if kind == "table" or kind == "matrix" then return value end
  if kind == "number" then return { value } end
  if kind == "expr" then
    local e = tostring(value)
    fail(("%s: %s is the expression %s; its graph is %s(%s, { -1, 1 }), along a solution write %s(sol, %s)")
      :format(by, what, e, by, e, by, e))
  end
  local remedy = ""
  if kind == "function" then
    remedy = (": its graph is %s(f, { 0, 1 })"):format(by)
  elseif named(kind .. ":step") and named(kind .. ":bode") then
    remedy = ": its step response is plot(G:step()), its frequency response plot(G:bode())"
  end
  local noun = kind == "lti" and "linear system" or kind
  fail(("%s: %s must be a list of numbers or a column, not %s %s%s"):format(by, what,
    noun:find "^[aeiou]" and "an" or "a", noun, remedy))
end

-- {y1, y2} are two curves, but a list of n rows beside n values of x is a matrix.
local function curves_in(y, n)
  if not is_list_of_columns(y) or (type(y[1]) == "table" and #y == n and #y[1] ~= n) then return { y } end
  return y
end

local function add_pair(by, series, x, y)
  for i, each in ipairs(curves_in(y, x and M.rows_of(x))) do
    each = M.check_column(by, "curve " .. i, each)
    series[#series + 1] = { x = x, y = each, count = count_of(each) }
  end
end

-- A line follows the solution between its points; marks, strokes and steps stand at the points that were
-- saved.
M.follows = { line = true, ["line+points"] = true }

function M.style_of(options, index)
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
  for key, value in pairs(more or {}) do sheet[key] = value or nil end
  return sheet
end

-- sol:curve, whose errors carry the name of the function that the user called.
function M.curve_of(by, solution, list, sheet)
  local found = table.pack(pcall(solution.curve, solution, list, sheet))
  if found[1] then return table.unpack(found, 2, found.n) end
  if type(found[2]) ~= "string" then error(found[2], 0) end  -- an interrupt
  fail(by .. ": " .. found[2]:gsub("^.-curve: ", "", 1))
end

-- Every curve with the limits of its own axis.
local function add_on_two_axes(by, series, solution, list, options, suffix)
  local on_right = {}
  for _, number in ipairs(type(options.right) == "table" and options.right or { options.right }) do
    on_right[number] = true
  end
  for _, expression in ipairs(list) do
    local group, parts = #series + 1, { expression }
    if object_type(expression) == "matrix" then
      for i = 1, arguments.size(expression) do parts[i] = expression[i] end
    end
    for _, part in ipairs(parts) do
      local limits = on_right[#series + 1] and options.y2lim
      if not on_right[#series + 1] then limits = options.ylim end
      local columns, breaks, saved = M.curve_of(by, solution, { part },
        sheet_of(options, { ylim = limits or false }))
      series[#series + 1] = { x = columns[1], y = columns[2], labels = labels_of(part, {}), count = 1,
        breaks = breaks, marked = saved, group = group, suffix = suffix, style = "line" }
    end
  end
end

-- Expressions over time along a solution; `suffix` tells solutions apart.
local function add_along_solution(by, series, solution, what, options, suffix)
  local list = type(what) == "table" and check_holes(by, what) or { what }
  local style = M.style_of(options, #series + 1)
  if style and not M.follows[style] then
    for _, expression in ipairs(list) do
      local names = labels_of(expression, {})
      series[#series + 1] = { x = solution.t, y = solution(expression), labels = names, count = #names,
        suffix = suffix }
    end
    return
  end
  if options.right then return add_on_two_axes(by, series, solution, list, options, suffix) end
  local columns, breaks, saved = M.curve_of(by, solution, list, sheet_of(options))
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
    fail(("%s: %s(sol, x, y) draws one expression against another; over time write %s(sol, { x, y })"):format(
      by, by, by))
  end
  local style = M.style_of(options, #series + 1)
  local each = { labels = { suffix and names[2] }, count = 1, style = "line", suffix = suffix }
  if style and not M.follows[style] then
    each.x, each.y = solution(x), solution(y)
  else
    local columns, breaks, saved = M.curve_of(by, solution, { x, y },
      sheet_of(options, { coordinates = 2 }))
    each.x, each.y, each.breaks, each.marked = columns[1], columns[2], breaks, saved
  end
  series[#series + 1] = each
  return names
end

-- What plot(sol) draws: the variables of the model without their derivatives, the algebraic ones where there
-- are
-- no others.
local function variables_of(by, solution)
  local model, list, most = solution.model, {}, 12
  for _, column in ipairs { model.differential, model.algebraic } do
    for i = 1, #list == 0 and #column or 0 do
      if select(2, undifferentiated(column[i])) == 0 then list[#list + 1] = column[i] end
    end
  end
  if #list > most then
    fail(("%s: the solution has %d variables; choose: %s(sol, { %s, %s })"):format(by, #list, by,
      tostring(list[1]), tostring(list[2])))
  end
  return list
end

-- "r--" of other programs.
local function refuse_style(by, last, n, after_solution)
  local is_style = type(last) == "string" and n > 1 and last:find "^[rgbcmykw]?[-:.%+ox*^sd]*$"
  if is_style and (n % 2 == 1 or not after_solution) and (last:find "[-:.+*]" or not after_solution) then
    fail(('%s: "%s" is no style here: write { colour = "red", dash = "dashed", marker = "circle" }')
      :format(by, last))
  end
end

-- The pairs of plot(y), plot(x, y, …), plot(sol, expressions, …) and the triple plot(sol, x, y).
function M.read_series(by, arguments, options)
  local series, axes, bare = {}, nil, false
  local n = arguments.n
  if n == 0 then fail(by .. ": nothing to draw: write " .. by .. "(x, y)") end
  if n == 1 and solutions_in(arguments[1]) then
    arguments[2], n = variables_of(by, solutions_in(arguments[1])[1]), 2
  end
  if n == 1 then
    bare = true
    add_pair(by, series, nil, M.check_column(by, "y", arguments[1]))
    return series, axes, bare
  end
  local runs = solutions_in(arguments[1])
  refuse_style(by, arguments[n], n, runs ~= nil)
  local total, number = 0, 0
  for i = 1, n, 2 do total = total + #(solutions_in(arguments[i]) or {}) end
  local function suffix()
    number = number + 1
    return total > 1 and (" (%d)"):format(number) or nil
  end
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
      add_pair(by, series, M.check_column(by, "x", x), M.check_column(by, "y", y))
    end
  end
  return series, axes, bare
end

-- Few points are marked, so that one sees where they are.
local function default_style(series)
  return M.rows_of(series.y) <= 30 and "line+points" or "line"
end

function M.set_looks(by, series, options)
  for i, each in ipairs(series) do
    local index = each.group or i
    each.style = M.style_of(options, index) or each.style or (each.y and default_style(each)) or "line"
    for _, key in ipairs(per_curve) do
      local value = options[key]
      if type(value) == "table" then value = value[index] end
      if key ~= "style" and value ~= nil then each[key == "color" and "colour" or key] = value end
    end
    if each.style ~= "line+points" then each.marked = nil end
    each.group, each.count = nil, nil
  end
end

function M.copy_options(description, options)
  local dropped = { labels = true }
  for _, key in ipairs(per_curve) do dropped[key] = true end
  for key, value in pairs(options) do
    if not dropped[key] then description[key] = value end
  end
  return description
end

return M
