-- Which pressure, temperature or position nothing fixes, where a model of parts cannot be solved: connected
-- parts in which it occurs in differences only.
local scopes = use "parts/scope"
local joints = use "parts/joints"
local P, data = scopes.P, scopes.data

-- Does an equation of this part change where all of these connectors are moved together?
local function notices_a_shift(scope, pins, across)
  for _, entry in ipairs(data(scope).equations) do
    local residual = entry[1].lhs - entry[1].rhs
    local shift, drift = 0, 0
    for _, pin in ipairs(pins) do
      for k = 1, #pin[across] do
        local x = object_type(pin[across]) == "matrix" and pin[across][k] or pin[across]
        shift, drift = shift + diff(residual, x), drift + diff(residual, x.dot)
      end
    end
    for _, change in ipairs { shift, drift } do
      for _, row in ipairs(object_type(change) == "matrix" and change or { change }) do
        if tostring(simplify(row)) ~= "0" then return true end
      end
    end
  end
  return false
end

local function islands(top, sets)
  local pins, island = joints.islands(top, sets, function(pin) return rawget(pin, P).kind.held_by end)
  local groups, list = {}, {}
  for _, pin in ipairs(pins) do
    local scope, root = rawget(pin, P).scope, island(pin)
    if #data(scope).parts == 0 then
      if not groups[root] then
        groups[root] = { order = {}, pins = {} }
        list[#list + 1] = groups[root]
      end
      local group = groups[root]
      if not group.pins[scope] then
        group.pins[scope] = {}
        group.order[#group.order + 1] = scope
      end
      table.insert(group.pins[scope], pin)
    end
  end
  return list
end

-- "nothing fixes p (hydraulic port) of P, R: …", or nil.
return function(top, sets)
  for _, group in ipairs(islands(top, sets)) do
    local kind = rawget(group.pins[group.order[1]][1], P).kind
    for _, v in ipairs(kind.across) do
      local held, names = false, {}
      for k, scope in ipairs(group.order) do
        held = held or notices_a_shift(scope, group.pins[scope], v.name)
        if k <= 8 then names[k] = data(scope).path elseif k == 9 then names[k] = "…" end
      end
      if not held then
        return ("nothing fixes %s (%s) of %s: it occurs in differences only; connect one of them to %s"):format(
          v.name, kind.name, table.concat(names, ", "), kind.held_by)
      end
    end
  end
end
