-- Are two systems of equations the same? They are when the same points (t, x, x′, …, z) satisfy both. Rows in
-- another order, scaled, combined or solved for something are the same system, and so are models that differ
-- in notation only: in names, in velocities that are variables or derivatives, in sign and scale of
-- multipliers.

local points = include "grade/points"
local models = {}
local close = 1e-7                -- of a row, relative to what symbols that change by their size do to it

local function base_of(name) return (name:gsub("'", "")) end

local function rows_of(equations)
  local rows = {}
  for _, equation in ipairs(equations) do
    local difference = equation.lhs - equation.rhs
    if object_type(difference) == "matrix" then
      for i = 1, #difference do rows[#rows + 1] = difference[i] end
    else
      rows[#rows + 1] = difference
    end
  end
  return rows
end

local function names_of(rows)
  local list = {}
  for _, name in ipairs((leaves_of(rows))) do list[#list + 1] = base_of(name) end
  return points.union(list)
end

-- ── descriptions: rows; unknown: names of what is looked for; free: unknowns that nothing but their use
-- defines; known: names of parameters and inputs, values: of parameters ──

local function set_of(list)
  local set = {}
  for _, name in ipairs(list) do set[name] = true end
  return set
end

-- Multipliers: unknowns in equations with derivatives only. What an algebraic equation contains, it defines.
local function multipliers(rows, unknown)
  local differentiated, defined = {}, {}
  for _, row in ipairs(rows) do
    local names = leaves_of { row }
    local differential = table.concat(names, " "):find "'"
    for _, name in ipairs(names) do
      if name:find "'" then differentiated[base_of(name)] = true end
      if not differential then defined[name] = true end
    end
  end
  local free = {}
  for _, name in ipairs(unknown) do free[name] = not (differentiated[name] or defined[name]) or nil end
  return free
end

local function described(model)
  local values, known = {}, {}
  for _, part in ipairs { model.parameters, model.inputs } do
    for i = 1, #part do known[#known + 1] = part[i].name end
  end
  for symbol, value in pairs(model.values) do values[symbol.name] = value end
  local rows, is_known, unknown = rows_of(model.equations), set_of(known), {}
  for _, name in ipairs(names_of(rows)) do
    if name ~= "t" and not is_known[name] then unknown[#unknown + 1] = name end
  end
  return { rows = rows, unknown = unknown, free = multipliers(rows, unknown), known = points.union(known),
    values = values }
end

-- The derivative and the unknown of a row that says no more than c (a′ - b) = 0.
local function definition(row, unknown)
  local derivative, other
  local names, leaves = leaves_of { row }
  for k, name in ipairs(names) do
    if unknown[base_of(name)] then
      if name:find "'" then
        if derivative then return end
        derivative = leaves[k]
      else
        if other then return end
        other = leaves[k]
      end
    end
  end
  if derivative and other and simplify(subs(row, { [other] = derivative })) == 0 then
    return other, derivative
  end
end

-- The same system with x′ in place of every unknown that an equation defines as x′.
local function without_velocities(system)
  local rows, unknown = system.rows, set_of(system.unknown)
  local function step()
    for i, row in ipairs(rows) do
      local other, derivative = definition(row, unknown)
      if other then
        local rest = {}
        for j, e in ipairs(rows) do
          if j ~= i then rest[#rest + 1] = simplify(subs(e, { [other] = derivative })) end
        end
        rows, unknown[other.name] = rest, nil
        return true
      end
    end
  end
  repeat until not step()
  local left = {}
  for _, name in ipairs(system.unknown) do left[#left + 1] = unknown[name] and name or nil end
  return { rows = rows, unknown = left, free = system.free, known = system.known, values = system.values }
end

-- ── points ─────────────────────────────────────────────────────────────────────────────────────────────────

-- How much a row changes when its symbols change by their own size.
local function size_of(row, at)
  local names, leaves = leaves_of { row }
  local total = 0
  if #leaves == 0 then return 1 end
  local slopes = gradient(row, leaves)
  for k, name in ipairs(names) do
    local slope = math.abs(points.value_at(slopes[k], at))
    if slope == slope then total = total + slope*math.max(1, math.abs(at[name])) end
  end
  return total
end

local function satisfied(rows, at)
  for _, row in ipairs(rows) do
    if not (math.abs(points.value_at(row, at)) <= close*size_of(row, at)) then return false end
  end
  return true
end

-- Solves rows = 0 for the named symbols, near `at`, by Gauss–Newton; completes `at`.
local function complete(rows, wanted, at)
  local names, leaves = leaves_of(rows)
  local unknowns, start, place, values, touched = {}, {}, {}, {}, {}
  for k, name in ipairs(names) do
    if wanted(name) then
      unknowns[#unknowns + 1], start[#start + 1], place[#place + 1] = leaves[k], at[name], name
    else
      values[leaves[k]] = at[name]
    end
  end
  for _, row in ipairs(rows) do
    local size = size_of(row, at)
    for _, name in ipairs((leaves_of { row })) do
      if wanted(name) and size > 0 and size < math.huge then
        touched[#touched + 1] = subs(row, values)/size
        break
      end
    end
  end
  if #touched == 0 then return end
  local good, found = pcall(gauss_newton, { R = touched, x = unknowns, start = start, tol = 1e-12 })
  if not good then return end
  for i, name in ipairs(place) do at[name] = found.x[i] end
end

-- A point with random values of all symbols.
local function random_point(rows, fixed, random, size)
  local at = {}
  for name, value in pairs(fixed) do at[name] = value end
  for _, name in ipairs((leaves_of(rows))) do at[name] = at[name] or size*random(-1.5, 1.5) end
  return at
end

-- Points that satisfy the rows: three, and where there are branches as many of every size.
local function points_on(rows, fixed, seed)
  local random, found, sizes = points.generator(seed), {}, { 1 }
  for _, row in ipairs(rows) do
    if points.branches(row) then sizes = { 1, 0.01, 100, 1e4 } end
  end
  for _, size in ipairs(sizes) do
    local before = #found
    for attempt = 1, 24 do
      local at = random_point(rows, fixed, random, size)
      if attempt > 8 then                          -- roots and logarithms have values for positive symbols
        for name, value in pairs(at) do at[name] = fixed[name] or math.abs(value) end
      end
      complete(rows, function(name) return not fixed[name] end, at)
      if satisfied(rows, at) then found[#found + 1] = at end
      if #found == before + 3 then break end
    end
  end
  return found
end

-- Are there, at each of these points, whose names are translated first, multipliers that satisfy the system?
local function holds(system, list, names, fixed)
  local random = points.generator(401)
  for _, at in ipairs(list) do
    local there = {}
    for name, value in pairs(fixed) do there[name] = value end
    for name, value in pairs(at) do
      local base = base_of(name)
      there[(names[base] or base) .. name:sub(#base + 1)] = value
    end
    for name in pairs(system.free) do there[name] = random(0.5, 1.5) end
    for _, name in ipairs((leaves_of(system.rows))) do there[name] = there[name] or random(-1.5, 1.5) end
    if next(system.free) then complete(system.rows, function(name) return system.free[name] end, there) end
    if not satisfied(system.rows, there) then return false end
  end
  return #list > 0
end

-- ── comparison ─────────────────────────────────────────────────────────────────────────────────────────────

-- The names that only the first list has.
local function without(list, others)
  local set, rest = set_of(others), {}
  for _, name in ipairs(list) do rest[#rest + 1] = not set[name] and name or nil end
  return rest
end

-- Parameters that only one model has are paired with those that only the other has. Where their numbers
-- differ, and in equations, whose names are given, they keep their values, or random ones: they may cancel.
local function paired_knowns(a, b)
  local only_a, only_b = without(a.known, b.known), without(b.known, a.known)
  if #only_a == #only_b and not a.by_name then return a.known, b.known end
  local shared = without(a.known, only_a)
  return shared, shared
end

local function fixed_values(a, b, of_a, of_b)
  local random, shared, of = points.generator(77), {}, { {}, {} }
  for _, name in ipairs(points.union(of_a, of_b)) do shared[name] = random(0.5, 1.5) end
  for k, system in ipairs { a, b } do
    local chosen = set_of(k == 1 and of_a or of_b)
    for _, name in ipairs(system.known) do
      of[k][name] = chosen[name] and shared[name] or system.values[name] or random(0.5, 1.5)
    end
    of[k].t = 0.7
  end
  return of[1], of[2]
end

local function inverse(names)
  local back = {}
  for name, other in pairs(names) do back[other] = name end
  return back
end

local function same_points(a, b, any_names)
  if #a.unknown ~= #b.unknown or #a.rows ~= #b.rows then return false end
  local of_a, of_b = paired_knowns(a, b)
  local fixed_a, fixed_b = fixed_values(a, b, of_a, of_b)
  local on_a, on_b = points_on(a.rows, fixed_a, 101), points_on(b.rows, fixed_b, 211)
  for _, of_unknowns in ipairs(points.renamings(a.unknown, b.unknown, any_names)) do
    for _, names in ipairs(points.renamings(of_a, of_b, any_names)) do
      for name, other in pairs(of_unknowns) do names[name] = other end
      if holds(b, on_a, names, fixed_b) and holds(a, on_b, inverse(names), fixed_a) then return true end
    end
  end
  return false
end

function models.same(a, b, task)
  if a:code() == b:code() then return "right" end
  local one, other = described(a), described(b)
  return (same_points(one, other, task.any_names)
    or same_points(without_velocities(one), without_velocities(other), task.any_names)) and "equivalent"
end

-- Equations that are satisfied by the same values of their symbols; those that only one side has may cancel.
function models.same_equations(a, b, task)
  local rows, other_rows = rows_of(a), rows_of(b)
  local names, others = names_of(rows), names_of(other_rows)
  local function system(own, all, foreign)
    local alone = task.any_names and {} or without(all, foreign)
    return { rows = own, unknown = without(all, alone), free = {}, known = alone, values = {},
      by_name = true }
  end
  local one, other = system(rows, names, others), system(other_rows, others, names)
  return same_points(one, other, task.any_names) and "equivalent"
end

return models
