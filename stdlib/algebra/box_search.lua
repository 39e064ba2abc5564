-- Roots of a system in a box, in numbers: damped Newton iterations from many points of it. The natural
-- monotonicity test makes the steps independent of the units of equations and unknowns (Deuflhard, Newton
-- Methods for Nonlinear Problems, Springer 2004, §3.3).

local equation = include "algebra/equation"

local most_steps, least_damping = 60, 1e-4
local converged = 1e-13                                    -- length of a step, in widths of the box
local same = 1e-7                                          -- results closer than this are one

-- r(u) and its Jacobian; a point is { u₁, …, uₙ } in widths of the box from its lower corner.
local function system(equations, unknowns, box)
  local r, J = vec(equations), jacobian(vec(equations), vec(unknowns))
  local s = { n = #unknowns }
  function s.values(u)
    local point = {}
    for i, x in ipairs(unknowns) do point[x] = box[i][1] + u[i]*(box[i][2] - box[i][1]) end
    return point
  end
  function s.residual(u) return evaluate(r, s.values(u)) end
  function s.jacobian(u) return evaluate(J, s.values(u)) end
  -- -J⁻¹ r in widths; nothing where J is singular or a number is not finite.
  function s.step(jacobian, residual)
    local good, d = pcall(solve, jacobian, residual)
    if not good then return nil end
    local step, length = {}, 0
    for i = 1, s.n do
      step[i] = -d[i]/(box[i][2] - box[i][1])
      length = length + step[i]^2
    end
    if length ~= length or length == math.huge then return nil end
    return step, math.sqrt(length)
  end
  return s
end

local function moved(u, by, step)
  local to = {}
  for i = 1, #u do to[i] = u[i] + by*step[i] end
  return to
end

-- The root that damped Newton iterations reach from u, or nothing.
local function root_from(s, u)
  local damping = 1
  for _ = 1, most_steps do
    local good, residual, slope = pcall(function() return s.residual(u), s.jacobian(u) end)
    if not good then return nil end
    local step, length = s.step(slope, residual)
    if not step then return nil end
    if length <= converged then return moved(u, 1, step) end
    local to, next_length
    repeat
      to = moved(u, damping, step)
      local defined, there = pcall(s.residual, to)
      local simplified = defined and { s.step(slope, there) } or {}
      next_length = simplified[2]
      local shorter = next_length and next_length <= (1 - damping/2)*length
      if not shorter then damping = damping/2 end
    until shorter or damping < least_damping
    if damping < least_damping then return length <= 100*converged and u or nil end
    u, damping = to, math.min(1, 2*damping)
  end
end

-- Points of the unit cube that fill it evenly: an additive recurrence with the powers of 1/φ, φⁿ⁺¹ = φ + 1
-- (Roberts, The Unreasonable Effectiveness of Quasirandom Sequences, 2018).
local function starts(n, number)
  local phi = 2
  for _ = 1, 40 do phi = (1 + phi)^(1/(n + 1)) end
  local list = {}
  for k = 1, number do
    list[k] = {}
    for i = 1, n do list[k][i] = (0.5 + k/phi^i) % 1 end
  end
  return list
end

local function distance(a, b)
  local largest = 0
  for i = 1, #a do largest = math.max(largest, math.abs(a[i] - b[i])) end
  return largest
end

local function inside(u)
  for i = 1, #u do if u[i] < -same or u[i] > 1 + same then return false end end
  return true
end

-- The range of every unknown, in their order.
local function box_of(within, unknowns)
  local box, named = {}, {}
  for x, range in pairs(within) do
    named[tostring(x)] = range
    if type(range) ~= "table" or type(range[1]) ~= "number" or type(range[2]) ~= "number"
      or not (range[1] < range[2]) then
      equation.refuse(("within: expected { lower, upper } for %s"):format(tostring(x)))
    end
  end
  local missing = {}
  for i, x in ipairs(unknowns) do
    box[i] = named[x.name] or named[tostring(x)]
    if not box[i] then missing[#missing + 1] = x.name .. " = { …, … }" end
    named[x.name], named[tostring(x)] = nil, nil
  end
  if #missing > 0 then
    equation.refuse("within: a search needs the range of " .. table.concat(missing, ", "))
  end
  local unknown = next(named)
  if unknown then equation.refuse(("within: the model has no unknown '%s'"):format(unknown)) end
  return box
end

--- The roots in the box within = { [x] or name = { lower, upper } } as { [x] = number }, in ascending order
--- of the first unknown; .note says how they were found, .none that there is none.
local function roots_in_box(equations, unknowns, within)
  local box = box_of(within, unknowns)
  for _, e in ipairs(equations) do
    for _, p in ipairs(symbols_in(e)) do
      if not equation.contains(unknowns, p) then
        equation.refuse(("a search needs numbers, and %s has no value: params = { %s = … }")
          :format(tostring(p), tostring(p)))
      end
    end
  end
  local s, found = system(equations, unknowns, box), {}
  local number = math.min(100*#unknowns, 500)
  for _, start in ipairs(starts(#unknowns, number)) do
    local u = root_from(s, start)
    local known = not (u and inside(u))
    for _, other in ipairs(found) do known = known or distance(u, other) < same end
    if not known then found[#found + 1] = u end
  end
  table.sort(found, function(a, b)
    for i = 1, #a do if math.abs(a[i] - b[i]) > same then return a[i] < b[i] end end
    return false
  end)
  for k, u in ipairs(found) do found[k] = s.values(u) end
  found.conditions, found.none = {}, "no equilibrium was found in the box, from " .. number .. " starts"
  found.note = ("found by Newton's method from %d points of the box; there may be more"):format(number)
  return found
end

return { roots_in_box = roots_in_box }
