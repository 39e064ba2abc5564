-- plot3: curves in space.

local arguments, curves, options = plotting.arguments, plotting.series, plotting.options

local function is_point(value) return object_type(value) == "matrix" and arguments.size(value) == 3 end

-- { p1, p2 } are two points, { x, y, z } with three scalars is one.
local function points_of(by, what)
  if is_point(what) then return { what } end
  if type(what) ~= "table" then
    fail(by .. ": expected a point with three components, such as p or { x, y, z }") end
  arguments.check_holes(by, what)
  if #what == 3 and not is_point(what[1]) then return { what } end
  for i = 1, #what do
    if not is_point(what[i]) and not (type(what[i]) == "table" and #what[i] == 3) then
      fail(("%s: entry %d of the list is not a point with three components"):format(by, i))
    end
  end
  return what
end

local function add_trajectories(by, series, solution, what, chosen)
  local axes = nil
  local points = points_of(by, what)
  for _, point in ipairs(points) do
    local parts = type(point) == "table" and point or { point[1], point[2], point[3] }
    local each = { count = 1 }
    local style = curves.style_of(chosen, #series + 1)
    if style and not curves.follows[style] then
      each.x, each.y, each.z = solution(parts[1]), solution(parts[2]), solution(parts[3])
    else
      local sheet = { coordinates = 3, xlim = chosen.xlim, ylim = chosen.ylim, zlim = chosen.zlim,
        size = chosen.size }
      local columns, breaks, saved = curves.curve_of(by, solution,
        { parts[1], parts[2], parts[3] }, sheet)
      each.x, each.y, each.z = columns[1], columns[2], columns[3]
      each.breaks, each.marked = breaks, saved
    end
    if #points == 1 then axes = arguments.labels_of(parts[3],
      arguments.labels_of(parts[2], arguments.labels_of(parts[1], {})))
    else each.labels = { type(point) == "table" and ("point %d"):format(#series + 1) or point } end
    series[#series + 1] = each
  end
  return axes
end

local function read_space(by, given, chosen)
  local series, axes, along = {}, nil, false
  local n = given.n
  if n == 1 and arguments.is_solution(given[1]) then
    fail(by .. ": expected a point to draw of this solution: plot3(sol, p)")
  elseif n == 1 then
    series[1] = { points = curves.check_column(by, "the matrix of points", given[1]), count = 1 }
  elseif arguments.is_solution(given[1]) then
    along = true
    if n % 2 == 1 then
      fail(by .. ": arguments come in pairs sol, point; options are written { title = … }")
    end
    for i = 1, n, 2 do
      if not arguments.is_solution(given[i]) then
        fail(("%s: argument %d must be a solution"):format(by, i))
      end
      axes = add_trajectories(by, series, given[i], given[i + 1], chosen)
    end
    if n > 2 then axes = nil end
  elseif n % 3 == 0 then
    for i = 1, n, 3 do
      local x, y, z = given[i], given[i + 1], given[i + 2]
      series[#series + 1] = { x = curves.check_column(by, "x", x), y = curves.check_column(by, "y", y),
        z = curves.check_column(by, "z", z),
                              count = 1 }
    end
  elseif n > 0 then
    fail(("%s: expected x, y, z or sol, p, but there are %d arguments; options are { title = … }"):format(
      by, n))
  end
  return series, axes or { "x", "y", "z" }, along
end

doc { name = "plot3", module = "plot", sig = "plot3(x, y, z [, options]) -> figure",
  text = "Curves in space: plot3(x, y, z), plot3(sol, p) or plot3(sol, {p1, p2}) for points p along a "
    .. "solution, plot3(m) for an n×3 matrix. Options as in plot, and zlabel, zlim, view = {tilt, turn} in "
    .. "degrees, and surfaces = { sphere(1) }: transparent nets. With surfaces or a solution one "
    .. "unit is equally long on all axes (equal = false: fill the frame).",
  example = "plot3({0, 1, 2}, {0, 1, 0}, {1, 2, 3}, { surfaces = { sphere(1) } })",
  gives = "3-D figure: 1 series, 3 points, 1 surface",
  options = options.space,
  function(...)
    local given, chosen = arguments.split_options("plot3", options.space, ...)
    local series, axes, along = read_space("plot3", given, chosen)
    arguments.spread_labels("plot3", series, chosen)
    for _, each in ipairs(series) do each.style = each.style or "line" end
    curves.set_looks("plot3", series, chosen)
    local description = curves.copy_options({ by = "plot3", series = series, three_d = true }, chosen)
    if description.equal == nil then description.equal = along or chosen.surfaces ~= nil end
    for i, key in ipairs { "xlabel", "ylabel", "zlabel" } do
      if description[key] == nil then description[key] = axes[i] end
    end
    return figure(description)
  end }
