-- A model as textbooks write it: x′ = f(x, z, u), 0 = g(x, z, u), or F(x′, x, z, u) = 0.

local function entries(column)
  local list = {}
  for i = 1, #column do list[i] = column[i] end
  return list
end

-- Left and right sides of all equations, row by row.
local function rows(model)
  local left, right = {}, {}
  for _, equation in ipairs(model.equations) do
    local l, r = equation.lhs, equation.rhs
    if object_type(l) == "matrix" then
      for i = 1, #l do left[#left + 1], right[#right + 1] = l[i], r[i] end
    else
      left[#left + 1], right[#right + 1] = l, r
    end
  end
  return left, right
end

-- { model, x, z, f, g }, or nothing where the equations are not solved for x′.
local function semi_explicit(sys)
  local low = sys:semi_explicit()
  local x, z, f, g = entries(low.differential), entries(low.algebraic), {}, {}
  local left, right = rows(low)
  local place = {}
  for i, state in ipairs(x) do place[der(state)] = i end
  for i = 1, #left do
    local k = place[left[i]]
    if k then f[k] = right[i] else g[#g + 1] = left[i] == 0 and right[i] or right[i] - left[i] end
  end
  for i, state in ipairs(x) do
    if f[i] == nil then return nil, der(state) end
  end
  return { model = low, x = x, z = z, f = f, g = g }
end

-- { model, x, z, F } with F = right - left of every row.
local function implicit(sys)
  local low = sys:first_order()
  local left, right = rows(low)
  local F = {}
  for i = 1, #left do F[i] = simplify(left[i] == 0 and right[i] or left[i] - right[i]) end
  return { model = low, x = entries(low.differential), z = entries(low.algebraic), F = F }
end

return { semi_explicit = semi_explicit, implicit = implicit, entries = entries }
