-- Equilibria of a model in symbols or numbers, with their linearisation and stability.

local algebra = include "algebra/solve"
local equation = include "algebra/equation"

local model_parts = include "algebra/model_parts"
local text = include "algebra/solution_text"
local entries = model_parts.entries

local function parts(sys)
  local p, unsolved = model_parts.semi_explicit(sys)
  if not p then
    fail("equilibria: the model is not solved for " .. tostring(unsolved)
      .. "; write it as der(x) ~ f, or reduce it first")
  end
  return p
end

-- A = f_x - f_z g_z⁻¹ g_x; nothing where the algebraic equations do not determine z.
local function linearisation(p)
  local A = jacobian(vec(p.f), vec(p.x))
  if #p.z == 0 then return A end
  local Gz = jacobian(vec(p.g), vec(p.z))
  if #p.g ~= #p.z or rank(Gz) < #p.z then return nil end   -- index above 1
  return A - jacobian(vec(p.f), vec(p.z))*solve(Gz, jacobian(vec(p.g), vec(p.x)))
end

-- What has to be positive for all roots of sⁿ + c₁ sⁿ⁻¹ + … to lie in the left half-plane: the
-- coefficients up to degree 2, with c₁ c₂ - c₃ in degree 3, else the Hurwitz determinants.
local function hurwitz(c)
  local n, list = #c - 1, {}
  if n <= 3 then
    for k = 1, n do list[k] = c[k + 1] end
    if n == 3 then list[#list + 1] = c[2]*c[3] - c[4] end
  else
    for size = 1, n do
      local rows = {}
      for i = 1, size do
        rows[i] = {}
        for j = 1, size do
          local k = 2*i - j
          rows[i][j] = k >= 0 and k <= n and c[k + 1] or 0
        end
      end
      list[size] = size == 1 and rows[1][1] or det(mat(rows))
    end
  end
  for k = 1, #list do list[k] = factor(list[k]) end
  return list
end

-- Real parts below this share of the largest eigenvalue are zero: rounding of size ε moves a simple
-- eigenvalue of a matrix with a condition of eigenvectors up to 10⁴ by no more.
local rounding = 1e-12

local function judge_by_eigenvalues(A)
  local eigenvalues = eig(evaluate(A))
  local worst, zero, largest = -math.huge, 0, 0
  for i = 1, #eigenvalues.re do
    largest = math.max(largest, math.abs(eigenvalues.re[i]), math.abs(eigenvalues.im[i]))
  end
  for i = 1, #eigenvalues.re do
    local re = eigenvalues.re[i]
    if math.abs(re) <= rounding*largest then zero, re = zero + 1, 0 end
    worst = math.max(worst, re)
  end
  if worst > 0 then return false, "unstable", eigenvalues end
  if zero > 0 then
    return nil, "not decided by the linearisation (an eigenvalue on the imaginary axis)", eigenvalues
  end
  return true, "asymptotically stable", eigenvalues
end

-- With an eigenvalue on the imaginary axis: unstable where a coefficient of the characteristic polynomial is
-- negative (Stodola), else not decided.
local function judge_on_the_axis(c)
  local where = {}
  for k = 2, #c do
    if equation.sign_of(c[k]) == nil then where[#where + 1] = equation.negative(c[k]) end
  end
  local undecided = "not decided by the linearisation (an eigenvalue on the imaginary axis)"
  if #where == 0 then return undecided end
  return ("unstable where %s; else %s"):format(table.concat(where, " or "), undecided)
end

-- "s² + (d/m) s + k/m".
local function polynomial_text(c)
  local n, text = #c - 1, ""
  for k = 0, n do
    local e, power = c[k + 1], n - k == 0 and "" or tostring((param "s")^(n - k))
    if e ~= 0 then
      local shown = tostring(e)
      local op = operation(e)
      local minus = shown:sub(1, 1) == "-" and (power == "" or op ~= "add" and op ~= "sub")
      if minus then shown = shown:sub(2) end
      if power ~= "" and shown == "1" then shown = "" end
      if power ~= "" and shown ~= "" then
        shown = (shown:find "[/+-]" and "(" .. shown .. ")" or shown) .. " "
      end
      text = text .. (text == "" and (minus and "-" or "") or minus and " - " or " + ") .. shown .. power
    end
  end
  return text
end

-- The factors of det(s I - A), each as 1, c₁, … of sⁿ + c₁ sⁿ⁻¹ + …
local function characteristic_factors(A)
  local c, s, sum = entries(charpoly(A)), param "pendula_s", 0
  for k = 1, #c do sum = sum + c[k]*s^(#c - k) end
  local list = {}
  for _, each in ipairs(factors((fraction(together(sum))))) do
    local ascending, monic = coefficients(each[1], s), {}
    local highest = ascending[#ascending]
    for k = #ascending, 1, -1 do monic[#monic + 1] = simplify(together(ascending[k]/highest)) end
    if #monic > 1 then list[#list + 1] = monic end
  end
  return list
end

local function reason(e, c)
  if equation.is_number(e) then return "(the factor " .. polynomial_text(c) .. ")" end
  return ("(%s < 0)"):format(tostring(e))
end

-- Every factor has to have its roots in the left half-plane.
local function judge(A)
  if #symbols_in(A) == 0 then return judge_by_eigenvalues(A) end
  local all, zero = {}, false
  for _, c in ipairs(characteristic_factors(A)) do
    for _, e in ipairs(hurwitz(c)) do
      local sign = equation.sign_of(e)
      if sign == -1 then return false, "unstable " .. reason(e, c) end
      zero = zero or sign == 0
      if not sign then equation.add_condition(all, equation.positive(e)) end
    end
  end
  if zero then return nil, judge_on_the_axis(entries(charpoly(A))) end
  if #all == 0 then return true, "asymptotically stable" end
  return nil, "asymptotically stable where " .. table.concat(all, ", ")
end

local function point_text(point, names)
  local list = {}
  for _, x in ipairs(names) do
    local v = rawget(point, x)
    list[#list + 1] = tostring(x) .. (v == nil and " free" or " = " .. tostring(v))
  end
  return table.concat(list, ",  ")
end

local function indented(matrix, label)
  local lines, first = {}, true
  for line in tostring(matrix):gmatch "[^\n]+" do
    lines[#lines + 1] = "     " .. (first and label or (" "):rep(#label)) .. line
    first = false
  end
  return table.concat(lines, "\n")
end

local function point_lines(point, names, label)
  local lines = { label .. point_text(point, names) }
  if point.A then
    lines[2] = indented(#point.A == 1 and point.A(1, 1) or point.A, "A = ")
    lines[3] = point.eigenvalues and indented(point.eigenvalues, "")
      or "     det(s I - A) = " .. polynomial_text(entries(charpoly(point.A)))
  end
  lines[#lines + 1] = "     " .. point.verdict          -- without A it says why
  return table.concat(lines, "\n")
end

local function list_text(list)
  if #list == 0 then return list.none end
  local lines = {}
  for k, point in ipairs(list) do lines[k] = point_lines(point, list.unknowns, ("(%d)  "):format(k)) end
  if list.period then lines[#lines + 1] = "angles " .. list.period end
  if #list.conditions > 0 then lines[#lines + 1] = "where " .. table.concat(list.conditions, ", ") end
  return table.concat(lines, "\n")
end

local function values_of(sys, options)
  local values = {}
  if options.params == true then
    for _, p in ipairs(entries(sys.parameters)) do
      local good, v = pcall(function() return p.value end)
      if good and v ~= nil then values[p] = v end
    end
  else
    for p, v in pairs(options.params or {}) do values[type(p) == "string" and param(p) or p] = v end
  end
  for u, v in pairs(options.inputs or {}) do values[type(u) == "string" and input(u) or u] = v end
  return values
end

local function equilibria(sys, options)
  if object_type(sys) ~= "model" then fail "equilibria: expected a model: equilibria(dae{ … })" end
  options = options or {}
  local p = parts(sys)
  local values = values_of(sys, options)
  local unknowns, equations = {}, {}
  for _, x in ipairs(p.x) do unknowns[#unknowns + 1] = x end
  for _, z in ipairs(p.z) do unknowns[#unknowns + 1] = z end
  local function put(e) return next(values) and subs(e, values) or e end
  for _, f in ipairs(p.f) do equations[#equations + 1] = put(f) end
  for _, g in ipairs(p.g) do equations[#equations + 1] = put(g) end
  local found = algebra.solve_equations(equations, unknowns, "equilibria")
  local slope = linearisation(p)
  if slope then slope = put(slope) end
  local list = { unknowns = unknowns, conditions = found.conditions, period = found.period,
    none = tostring(found):gsub("^no solution\n.*", "no equilibrium") }
  for k, s in ipairs(found) do
    local point = {}
    for _, x in ipairs(unknowns) do point[x] = rawget(s, x) end
    local A, stable, eigenvalues = nil, nil, nil
    local verdict = 'not linearised: the index is above 1; reduce first, equilibria(sys:reduce "minimal")'
    if slope then
      local at = simplify(next(point) and subs(slope, point) or slope)
      A = object_type(at) == "matrix" and at or mat { { at } }
      stable, verdict, eigenvalues = judge(A)
    end
    local extra = { A = A, stable = stable, verdict = verdict, eigenvalues = eigenvalues }
    list[k] = setmetatable(point, { __name = "equilibrium",
      __tostring = function(p) return point_lines(p, unknowns, "") end, __index = function(_, key)
      if extra[key] ~= nil then return extra[key] end
      if type(key) == "string" then for x, v in pairs(point) do if x.name == key then return v end end end
    end })
  end
  return setmetatable(list, { __tostring = list_text, __name = "equilibria",
    __index = { latex = text.latex_of_solutions } })
end

return { equilibria = equilibria }
