-- Tableaus with symbols in them: their order conditions, and what is left free when these are solved.

local algebra = include "algebra/solve"

-- ── rooted trees ───────────────────────────────────────────────────────────────────────────────────────────

-- All trees of order 1 … p: { order, gamma, children = { numbers } }, children of falling number.
local function trees(p)
  local list, first = { { order = 1, gamma = 1, children = {} } }, { 1, 2 }
  for order = 2, p do
    local function choose(rest, largest, children)
      if rest == 0 then
        local gamma, own = order, {}
        for i, child in ipairs(children) do gamma, own[i] = gamma*list[child].gamma, child end
        list[#list + 1] = { order = order, gamma = gamma, children = own }
        return
      end
      for child = math.min(largest, first[math.min(rest, order - 1) + 1] - 1), 1, -1 do
        if list[child].order <= rest then
          children[#children + 1] = child
          choose(rest - list[child].order, child, children)
          children[#children] = nil
        end
      end
    end
    choose(order - 1, #list, {})
    first[order + 1] = #list + 1
  end
  return list
end

-- "Σ bᵢ cᵢ aᵢⱼ cⱼ": sums over all indices.
local letters = { "ᵢ", "ⱼ", "ₖ", "ₗ", "ₘ", "ₙ" }
local powers = { "", "²", "³", "⁴", "⁵", "⁶" }

local function sum_text(list, number)
  local used = 1
  local function below(tree, index)
    local leaves, text = 0, ""
    for _, child in ipairs(list[tree].children) do
      if list[child].order == 1 then
        leaves = leaves + 1
      else
        used = used + 1
        local own = used
        text = text .. " a" .. letters[index] .. letters[own] .. below(child, own)
      end
    end
    return (leaves > 0 and " c" .. letters[index] .. powers[leaves] or "") .. text
  end
  return "Σ bᵢ" .. below(number, 1)
end

-- A number as an expression, so that it can be a side of an equation.
local function expr_of(e) return type(e) == "number" and e + 0*param "pendula_zero" or e end

-- φ(τ)ᵢ for all stages, symbolically.
local function stage_weights(tab, list, number, known)
  if known[number] then return known[number] end
  local phi = {}
  for i = 1, tab.stages do phi[i] = 1 end
  for _, child in ipairs(list[number].children) do
    local inner = stage_weights(tab, list, child, known)
    for i = 1, tab.stages do
      local sum = 0
      for j = 1, tab.stages do sum = sum + tab.A(i, j)*inner[j] end
      phi[i] = phi[i]*(list[child].order == 1 and tab.c[i] or sum)
    end
  end
  known[number] = phi
  return phi
end

local function conditions(tab, p)
  if math.type(p) ~= "integer" or p < 1 or p > 6 then fail "order_conditions: the order must be 1 … 6" end
  local list, known, result = trees(p), {}, {}
  if tab then
    for i = 1, tab.stages do
      local sum = 0
      for j = 1, tab.stages do sum = sum + tab.A(i, j) end
      local difference = simplify(tab.c[i] - sum)
      if difference ~= 0 then
        result[#result + 1] = { order = 0, text = "cᵢ = Σ aᵢⱼ", value = sum,
          equation = expr_of(tab.c[i]) ~ sum }
      end
    end
  end
  for number, tree in ipairs(list) do
    local condition = { order = tree.order, gamma = tree.gamma, text = sum_text(list, number) }
    if tab then
      local phi, sum = stage_weights(tab, list, number, known), 0
      for i = 1, tab.stages do sum = sum + tab.b[i]*phi[i] end
      condition.value = simplify(sum)
      condition.equation = expr_of(condition.value) ~ rational("1/" .. tree.gamma)
      if #symbols_in(condition.value) == 0 then
        condition.met = simplify(condition.value - rational("1/" .. tree.gamma)) == 0
      end
    end
    result[#result + 1] = condition
  end
  return setmetatable(result, { __name = "order_conditions",
    __index = { latex = report_latex },
    __tostring = function(all)
    local lines, widest = {}, 0
    for _, c in ipairs(all) do widest = math.max(widest, utf8.len(c.text)) end
    for _, c in ipairs(all) do
      local target = c.order == 0 and "" or " = " .. (c.gamma == 1 and "1" or "1/" .. c.gamma)
      local line = ("%-8s %s%s"):format(c.order == 0 and "nodes" or "order " .. c.order, c.text, target)
      if c.value ~= nil then
        line = line .. (" "):rep(widest - utf8.len(c.text) + 6 - #target) .. "  "
          .. (c.met and "holds" or c.met == false and "missed: " .. tostring(c.value) or tostring(c.equation))
      end
      lines[#lines + 1] = line
    end
    return table.concat(lines, "\n")
  end })
end

-- ── tableaus with symbols ──────────────────────────────────────────────────────────────────────────────────

local methods = {}

function methods.order_conditions(tab, p) return conditions(tab, p) end

-- The symbols in the order in which conditions are solved for them: b, then the last coefficients of A.
local function unknowns_of(tab)
  local list, seen = {}, {}
  local function add(e)
    for _, s in ipairs(symbols_in(e)) do
      if not seen[s] then
        seen[s] = true
        list[#list + 1] = s
      end
    end
  end
  for i = 1, tab.stages do add(tab.b[i]) end
  for i = tab.stages, 1, -1 do for j = tab.stages, 1, -1 do add(tab.A(i, j)) end end
  for i = 1, tab.stages do add(tab.c[i]) end
  return list
end

-- The order conditions up to p, solved as far as they go; symbols that remain are free.
function methods.solve(tab, p, unknowns)
  local equations = {}
  for _, c in ipairs(conditions(tab, p)) do equations[#equations + 1] = c.equation end
  return algebra.solve_equations(equations, unknowns or unknowns_of(tab))
end

local function replaced(tab, values)
  local function put(e)
    return next(values) and simplify(subs(e, values)) or e
  end
  local data = { A = {}, b = {}, c = {}, name = tab.name }
  for i = 1, tab.stages do
    data.A[i], data.b[i], data.c[i] = {}, put(tab.b[i]), put(tab.c[i])
    for j = 1, tab.stages do data.A[i][j] = put(tab.A(i, j)) end
  end
  return tableau(data)
end

-- The tableau with values, a number or an expression for each symbol: a method to integrate with once all are
-- numbers.
function methods.subs(tab, values)
  local clean = {}
  for key, v in pairs(values) do
    if object_type(key) == "expr" then clean[key] = v else clean[param(key)] = v end
  end
  return replaced(tab, clean)
end

-- R(z) = det(I - z A + z 1 bᵀ)/det(I - z A).
function methods.stability_function(tab, z)
  z = z or param "z"
  local above, below = {}, {}
  for i = 1, tab.stages do
    above[i], below[i] = {}, {}
    for j = 1, tab.stages do
      local one = i == j and 1 or 0
      below[i][j] = one - z*tab.A(i, j)
      above[i][j] = below[i][j] + z*tab.b[j]
    end
  end
  local function determinant(rows) return #rows == 1 and rows[1][1] or det(mat(rows)) end
  local denominator = simplify(determinant(below))
  if #symbols_in(denominator) > 0 then                     -- P by powers of z, Q(0) = 1
    local P, Q = fraction(determinant(above)/denominator)
    local scale, numerator = coefficients(Q, z)[1], 0
    for k, c in ipairs(coefficients(P, z)) do numerator = numerator + simplify(c/scale)*z^(k - 1) end
    return numerator/simplify(factor(Q)/scale)
  end
  local sum = 0                                            -- explicit: a polynomial, by powers of z
  for k, c in ipairs(coefficients(determinant(above), z)) do sum = sum + simplify(c/denominator)*z^(k - 1) end
  return sum
end

local function cells(tab, show)
  local rows = {}
  for i = 1, tab.stages do
    rows[i] = { show(tab.c[i]) }
    for j = 1, tab.stages do rows[i][j + 1] = show(tab.A(i, j)) end
  end
  rows[#rows + 1] = { "" }
  for j = 1, tab.stages do rows[#rows][j + 1] = show(tab.b[j]) end
  return rows
end

local function drawn(tab)
  local rows, widths, lines = cells(tab, tostring), {}, {}
  for _, row in ipairs(rows) do
    for j, cell in ipairs(row) do widths[j] = math.max(widths[j] or 0, utf8.len(cell)) end
  end
  for i, row in ipairs(rows) do
    for j, cell in ipairs(row) do row[j] = cell .. (" "):rep(widths[j] - utf8.len(cell)) end
    if i == #rows then
      local total = 0
      for j = 2, #widths do total = total + widths[j] + (j > 2 and 2 or 0) end
      lines[#lines + 1] = ("─"):rep(widths[1] + 1) .. "┼" .. ("─"):rep(total + 1)
    end
    lines[#lines + 1] = (row[1] .. " │ " .. table.concat(row, "  ", 2)):gsub("%s+$", "")
  end
  return ("%s: %d stage%s with symbols\n\n%s"):format(tab.name, tab.stages, tab.stages == 1 and "" or "s",
    table.concat(lines, "\n"))
end

function methods.latex(tab)
  local rows = cells(tab, function(e) return latex(e) end)
  for i, row in ipairs(rows) do rows[i] = table.concat(row, " & ") end
  rows[#rows] = "\\hline\n" .. rows[#rows]
  local text = table.concat(rows, " \\\\\n")
  return "\\begin{array}{c|" .. ("c"):rep(tab.stages) .. "}\n" .. text .. "\n\\end{array}"
end

local function symbolic_tableau(data)
  if type(data) ~= "table" or type(data.A) ~= "table" or type(data.b) ~= "table" then
    fail "symbolic_tableau: expected symbolic_tableau{ A = {{0, 0}, {a, 0}}, b = {1 - b, b}, c = {0, a} }"
  end
  local s = #data.b
  local A, b, c = {}, {}, {}
  local function read(e)
    if type(e) == "string" then return rational(e) end
    if e and type(e) ~= "number" and tostring(der(e)) ~= "0" then
      fail(("tableau: the coefficient %s depends on time; coefficients are numbers and parameters: "
        .. 'a = param "a"'):format(tostring(e)))
    end
    return e or 0
  end
  for i = 1, s do
    A[i] = {}
    for j = 1, s do
      A[i][j] = read(object_type(data.A) == "matrix" and data.A(i, j) or (data.A[i] or {})[j])
    end
    b[i] = read(data.b[i])
  end
  for i = 1, s do
    local sum = 0
    for j = 1, s do sum = sum + A[i][j] end
    c[i] = data.c and read(data.c[i]) or sum
  end
  local tab = { A = mat(A), b = vec(b), c = vec(c), stages = s, name = data.name or "tableau" }
  local function member(_, key)
    if methods[key] then return methods[key] end
    local names = {}
    for name in pairs(methods) do names[#names + 1] = ":" .. name end
    table.sort(names)
    fail(("a tableau with symbols has no '%s'; it has %s. Give the symbols values first: tab:subs { … }")
      :format(tostring(key), table.concat(names, ", ")))
  end
  return setmetatable(tab, { __index = member, __tostring = drawn, __name = "symbolic tableau" })
end

return { symbolic_tableau = symbolic_tableau,
  order_conditions = function(p, tab)
    if tab ~= nil and object_type(tab) == nil and type(tab) == "table" then return conditions(tab, p) end
    return conditions(tab, p)
  end }
