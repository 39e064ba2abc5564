-- phase: trajectories, directions and nullclines of two states; poincare: where a solution crosses a section.

local arguments, curves, options = plotting.arguments, plotting.series, plotting.options

-- ── the right sides ────────────────────────────────────────────────────────────────────────────────────────

-- x′ and y′ as Lua functions of numbers.
local function velocity(model, x, y, at)
  if model.kind ~= "ODE" then
    fail(('phase: the model is of kind "%s"; a phase portrait needs x′ = f(x), as sys:reduce "ode" or '
      .. '"minimal" makes such a model'):format(model.kind))
  end
  local values = {}
  for i = 1, #model.parameters do
    local p = model.parameters[i]
    values[p] = at(p)
  end
  local ode = include "algebra/model_parts".semi_explicit(model)
  local function right_side(derivative)
    for i, state in ipairs(ode.x) do
      if der(state) == derivative then return ode.f[i] end
    end
  end
  local known, names = {}, {}
  for _, state in ipairs(ode.x) do known[state] = true end
  for i = 1, #model.differential do names[i] = tostring(model.differential[i]) end
  local inner, found = { x, right_side(y) or y }, {}  -- θ′ has become the state ω
  for k, state in ipairs(inner) do
    if not known[state] then
      fail(("phase: %s is not a state of the model (its states: %s)"):format(tostring(k == 1 and x or y),
        table.concat(names, ", ")))
    end
  end
  for k, state in ipairs(inner) do found[k] = fn(inner, subs(right_side(der(state)), values)) end
  return found[1], found[2]
end

-- ── pieces of the picture ──────────────────────────────────────────────────────────────────────────────────

local function between(range, k, n) return range[1] + (range[2] - range[1])*(k - 0.5)/n end

-- Strokes with two barbs, all equally long on the sheet, one for each point of a grid.
local function arrows(f, g, xlim, ylim, n)
  local px, py, breaks = {}, {}, {}
  local width, height = xlim[2] - xlim[1], ylim[2] - ylim[1]
  local length = 0.55/n
  local function stroke(points)
    if #px > 0 then breaks[#breaks + 1] = #px + 1 end
    for _, p in ipairs(points) do px[#px + 1], py[#py + 1] = p[1], p[2] end
  end
  for i = 1, n do
    for j = 1, n do
      local x, y = between(xlim, j, n), between(ylim, i, n)
      local u, v = f(x, y)/width, g(x, y)/height
      local speed = math.sqrt(u*u + v*v)
      if speed > 0 and speed < math.huge then
        u, v = u/speed*length, v/speed*length
        local function place(along, across)
          return { x + (along*u - across*v)*width, y + (along*v + across*u)*height }
        end
        stroke { place(-0.5, 0), place(0.5, 0) }
        stroke { place(0.15, 0.22), place(0.5, 0), place(0.15, -0.22) }
      end
    end
  end
  return { x = px, y = py, breaks = breaks, style = "line", colour = "#9AA5B1", width = 1 }
end

local function nullcline(f, xlim, ylim, label, colour)
  local n = 81
  local x, y, z = {}, {}, {}
  for k = 1, n do x[k], y[k] = between(xlim, k, n), between(ylim, k, n) end
  for i = 1, n do
    z[i] = {}
    for j = 1, n do z[i][j] = f(x[j], y[i]) end
  end
  local px, py, breaks = plotting.grid.level_line(x, y, z, 0)
  if #px == 0 then return nil end
  return { x = px, y = py, breaks = breaks, style = "line", colour = colour, dash = "dashed",
    labels = { label } }
end

local function trajectory(model, x, y, start, chosen, label)
  local values = { [x] = start[1], [y] = start[2] }
  local sol = model:integrate { start = values, to = chosen.to or 20, rtol = 1e-6, atol = 1e-8,
    params = chosen.params }
  local columns, breaks = sol:curve({ x, y }, { coordinates = 2, xlim = chosen.xlim, ylim = chosen.ylim })
  return { x = columns[1], y = columns[2], breaks = breaks, style = "line", colour = "#0072B2",
    labels = label and { label } or nil }
end

-- ── phase ──────────────────────────────────────────────────────────────────────────────────────────────────

local phase_options = options.joined(options.named { "title", "xlabel", "ylabel", "size", "notes", "equal",
  "legend",
  "theme", "grid" }, {
  option("xlim", "list", "{ low, high } of the first state; required"),
  option("ylim", "list", "{ low, high } of the second state; required"),
  option("start", "list", "where trajectories begin: { { x, y }, … }"),
  option("to", "number", "the end of the trajectories, in s", "20"),
  option("params", "table", "values of parameters: { m = 2 }", "", "@parameters"),
  option("n", "integer", "arrows in each direction", "20"),
  option("nullclines", "boolean", "the lines on which a derivative vanishes", "true") })

local function range_option(chosen, name)
  local range = chosen[name]
  local low, high = table.unpack(type(range) == "table" and range or {})
  if type(low) ~= "number" or type(high) ~= "number" or not (low < high) then
    fail(("phase: %s = { low, high } is missing"):format(name))
  end
  return { tonumber(range[1]), tonumber(range[2]) }
end

local function arrows_option(n)
  if n >= 1 and n <= 1000 then return n end
  fail(("phase: n = %s; it must be a whole number of arrows from 1 to 1000"):format(n))
end

doc { name = "phase", module = "plot", sig = "phase(sys, x, y, { xlim =, ylim =, start =, … }) -> figure",
  text = "The phase portrait of a model with two states: the field of directions, the nullclines x′ = 0 and "
    .. "y′ = 0, "
    .. "and trajectories from the starts that are given.",
  example = [[
    x, v = vars "x v"
    osc = dae{ der(x) ~ v, der(v) ~ -x }
    return phase(osc, x, v, { xlim = {-2, 2}, ylim = {-2, 2}, start = { {1, 0} }, n = 10 }).labels[2] ]],
  gives = "x′ = 0", options = phase_options,
  function(model, x, y, given)
    model = as_model(model)
    if object_type(model) ~= "model" then
      fail "phase: expected a model: phase(sys, x, y, { xlim =, ylim = })"
    end
    local chosen = check_options("phase", given, phase_options)
    if #model.differential ~= 2 then
      local count = #model.differential
      fail(("phase: the model has %d state%s; a phase portrait shows two, plot(sol, x, y) any pair along a "
        .. "solution"):format(count, count == 1 and "" or "s"))
    end
    local xlim, ylim = range_option(chosen, "xlim"), range_option(chosen, "ylim")
    local middle = { [x] = between(xlim, 1, 1), [y] = between(ylim, 1, 1) }
    local f, g = velocity(model, x, y, model:init { fix = middle, params = chosen.params })
    local series = { arrows(f, g, xlim, ylim, arrows_option(chosen.n or 20)) }
    if chosen.nullclines ~= false then
      series[#series + 1] = nullcline(f, xlim, ylim, tostring(der(x)) .. " = 0", "#D55E00")
      series[#series + 1] = nullcline(g, xlim, ylim, tostring(der(y)) .. " = 0", "#009E73")
    end
    for k, start in ipairs(chosen.start or {}) do
      if type(start) ~= "table" or #start ~= 2 then fail(("phase: start %d must be { x, y }"):format(k)) end
      series[#series + 1] = trajectory(model, x, y, start, chosen, k == 1 and "trajectory")
    end
    local description = curves.copy_options({ by = "phase", series = series, xlabel = x, ylabel = y }, chosen)
    for _, key in ipairs { "start", "to", "params", "n", "nullclines" } do description[key] = nil end
    description.xlim, description.ylim = xlim, ylim
    return figure(description)
  end }

-- ── Poincaré sections ──────────────────────────────────────────────────────────────────────────────────────

-- The time in (a, b) at which g vanishes, by the Illinois method (Dowell and Jarratt, BIT 11, 1971).
local function root(g, a, b, ga, gb)
  for _ = 1, 60 do
    local c = (a*gb - b*ga)/(gb - ga)
    local gc = g(c)
    if gc == 0 or math.abs(b - a) <= 1e-13*math.max(math.abs(a), math.abs(b)) then return c end
    if gc*gb < 0 then a, ga = b, gb else ga = ga/2 end
    b, gb = c, gc
  end
  return b
end

-- Times at which g passes zero, upwards (1), downwards (-1) or both (0).
local function crossings(sol, expression, direction)
  local pieces, saved = 8, sol.t        -- values per step, so that two crossings within one are seen
  local times = {}
  for i = 1, #saved - 1 do
    for k = 0, pieces - 1 do times[#times + 1] = saved[i] + (saved[i + 1] - saved[i])*k/pieces end
  end
  times[#times + 1] = saved[#saved]
  local values, found = sol(expression, times), {}
  for i = 1, #times - 1 do
    local a, b = values[i], values[i + 1]
    if a*b < 0 and (direction == 0 or (b > a) == (direction > 0)) then
      found[#found + 1] = root(function(time) return sol(expression, time) end, times[i], times[i + 1], a, b)
    end
  end
  return found
end

local poincare_options = options.joined(options.flat, {
  option("direction", "integer", "crossings upwards (1), downwards (-1) or both (0)", "1") })

doc { name = "poincare", module = "plot", sig = "poincare(sol, section, x, y [, options]) -> figure",
  text = "The points (x, y) of a solution at the times when the expression `section` passes zero (upwards, "
    .. "unless "
    .. "direction says otherwise), found on the dense output. For a periodic force sin(w*t) is the section.",
  example = [[
    x, v = vars "x v"
    sol = dae{ der(x) ~ v, der(v) ~ -x }:integrate{ start = { x = 1, v = 0 }, to = 20 }
    return poincare(sol, v, x, v, { direction = 0 })]], gives = "figure: 1 series, 6 points",
  options = poincare_options,
  function(sol, section, x, y, given)
    if not arguments.is_solution(sol) then
      fail "poincare: expected a solution: poincare(sol, section, x, y)"
    end
    local chosen = check_options("poincare", given, poincare_options)
    local times = crossings(sol, section, chosen.direction or 1)
    if #times == 0 then
      fail(("poincare: %s does not pass zero in that direction along this solution"):format(
        tostring(section)))
    end
    local style = chosen.style or #times > 100 and "dots" or "points"
    local series = { { x = sol(x, times), y = sol(y, times), style = style, count = 1 } }
    if type(series[1].x) == "number" then series[1].x, series[1].y = { series[1].x }, { series[1].y } end
    chosen.style = nil
    arguments.spread_labels("poincare", series, chosen)
    curves.set_looks("poincare", series, chosen)
    local description = curves.copy_options({ by = "poincare", series = series, xlabel = x, ylabel = y },
      chosen)
    description.direction = nil
    return figure(description)
  end }
