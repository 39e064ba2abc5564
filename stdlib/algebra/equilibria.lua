-- Equilibria of a model in symbols or numbers, with their linearisation and stability.

local algebra = include "algebra/solve"
local equation = include "algebra/equation"
local text = include "algebra/solution_text"

local model_parts = include "algebra/model_parts"
local entries = model_parts.entries

-- Equations in x, z at rest, and what the initial values must keep besides (C = 0 after reduce "acc").
local function parts(sys)
  local p = model_parts.semi_explicit(sys) or model_parts.implicit(sys)
  local still, rest = {}, {}
  for _, x in ipairs(p.x) do still[der(x)] = 0 end
  if p.F then
    for i, e in ipairs(p.F) do rest[i] = subs(e, still) end
  else
    for _, list in ipairs { p.f, p.g } do for _, e in ipairs(list) do rest[#rest + 1] = e end end
  end
  local conditions, known = p.model:constraints(), {}
  for _, e in ipairs(rest) do known[simplify(e)] = true end
  for i = 1, #conditions do
    local e = simplify(subs(conditions[i].rhs, still))
    if e ~= 0 and not known[e] and not known[simplify(-e)] then rest[#rest + 1] = e end
  end
  p.rest = rest
  return p
end

-- det(s E - A) of F(x′, x, z) = 0 linearised at a point, with E = ∂F/∂x′: s times ∂F/∂x′ beside ∂F/∂(x, z).
-- Directions that the conditions on the initial values forbid are the modes at 0 beyond `free` of them.
local function pencil(p, free, point, put)
  local s, F = param "pendula_s", p.F
  local unknowns, rates = {}, {}
  for i, x in ipairs(p.x) do unknowns[i], rates[i] = x, der(x) end
  for _, z in ipairs(p.z) do unknowns[#unknowns + 1] = z end
  if not F then
    F = {}
    for i, f in ipairs(p.f) do F[i] = rates[i] - f end
    for _, g in ipairs(p.g) do F[#F + 1] = -g end
  end
  if #F ~= #unknowns or #F > 12 then return nil end
  local still = {}
  for _, rate in ipairs(rates) do still[rate] = 0 end
  local matrix, slopes = jacobian(vec(F), vec(unknowns)), jacobian(vec(F), vec(rates))
  local rows_ = {}
  for i = 1, #F do
    rows_[i] = {}
    for j = 1, #F do rows_[i][j] = matrix(i, j) + (j <= #rates and s*slopes(i, j) or 0) end
  end
  local at = subs(put(subs(mat(rows_), still)), point)
  local numerator = fraction(together(det(simplify(at))))
  local ascending = coefficients(numerator, s)
  local from = 1
  while #ascending - from > free and ascending[from] == 0 do from = from + 1 end
  local monic = {}
  for k = #ascending, from, -1 do
    monic[#monic + 1] = simplify(together(ascending[k]/ascending[#ascending]))
  end
  return monic
end

-- A = f_x - f_z g_z⁻¹ g_x; nothing where the algebraic equations do not determine z, or where the initial
-- values
-- must keep more than g = 0.
local function linearisation(p)
  if p.F or #p.rest > #p.x + #p.z then return nil end
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

local function judge_by_eigenvalues(eigenvalues)
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

-- With an eigenvalue on the imaginary axis: unstable where a coefficient of a factor of the characteristic
-- polynomial is negative (Stodola), else not decided.
local function judge_on_the_axis(factors_)
  local where = {}
  for _, c in ipairs(factors_) do
    for k = 2, #c do
      if equation.sign_of(c[k]) == nil then equation.add_condition(where, equation.negative(c[k])) end
    end
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
        local outside = shown:gsub("%b()", "")
        shown = (outside:find "[/+-]" and "(" .. shown .. ")" or shown) .. " "
      end
      text = text .. (text == "" and (minus and "-" or "") or minus and " - " or " + ") .. shown .. power
    end
  end
  return text
end

-- The factors of a polynomial, each as 1, c₁, … of sⁿ + c₁ sⁿ⁻¹ + …
local function characteristic_factors(c)
  local s, sum = param "pendula_s", 0
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
  if #c == 2 then return ("(the eigenvalue %s is positive)"):format(tostring(simplify(-c[2]))) end
  return ("(the factor %s: %s < 0)"):format(polynomial_text(c), tostring(e))
end

-- The matrix with this characteristic polynomial.
local function companion(c)
  local rows_, n = {}, #c - 1
  for i = 1, n do
    rows_[i] = {}
    for j = 1, n do rows_[i][j] = i == 1 and -c[j + 1] or j == i - 1 and 1 or 0 end
  end
  return mat(rows_)
end

-- Every factor of the characteristic polynomial, that of A or another, has to have its roots in the left
-- half-plane.
local function judge(A, polynomial)
  local c_all = polynomial or entries(charpoly(A))
  if #symbols_in(vec(c_all)) == 0 then return judge_by_eigenvalues(eig(evaluate(A or companion(c_all)))) end
  local all, zero, list = {}, false, characteristic_factors(c_all)
  for _, c in ipairs(list) do
    for _, e in ipairs(hurwitz(c)) do
      local sign = equation.sign_of(e)
      if sign == -1 then return false, "unstable " .. reason(e, c) end
      zero = zero or sign == 0
      if not sign then equation.add_condition(all, equation.positive(e)) end
    end
  end
  if zero then return nil, judge_on_the_axis(list) end
  if #all == 0 then return true, "asymptotically stable" end
  return nil, "asymptotically stable where " .. table.concat(all, ", ")
end

local function point_text(point, names)
  local list = {}
  for _, x in ipairs(names) do list[#list + 1] = text.of_unknown(x, rawget(point, x), point.roots) end
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

-- The matrix as it is printed: in decimals if every entry has a short one, or is none but a decimal.
local function shown_matrix(A)
  local numbers = #symbols_in(A) == 0
  for i = 1, numbers and A.rows or 0 do
    for j = 1, A.cols do
      local e = A(i, j)
      numbers = numbers and (tonumber(tostring(e)) or #("%.15g"):format(evaluate(e)) <= 8) and true
    end
  end
  if #A == 1 then return numbers and ("%.10g"):format(evaluate(A)) or A(1, 1) end
  if not numbers then return A end
  local lines, last = {}, A.rows
  for line in tostring(evaluate(A)):gmatch "[^\n]+" do
    local k = #lines + 1
    lines[k] = (k == 1 and "⎡" or k == last and "⎣" or "⎢") .. line
      .. (k == 1 and "⎤" or k == last and "⎦" or "⎥")
  end
  return table.concat(lines, "\n")
end

local function point_lines(point, names, label)
  local lines = { label .. point_text(point, names) }
  if point.A then lines[2] = indented(shown_matrix(point.A), "A = ") end
  if point.modes then
    lines[#lines + 1] = point.eigenvalues and indented(point.eigenvalues, "") or "     " .. point.modes
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
  lines[#lines + 1] = list.note
  return table.concat(lines, "\n")
end

-- The point, the matrix of its linearisation with eigenvalues or characteristic polynomial, and the verdict.
local function point_latex(point, names)
  local values, lines = {}, {}
  for k, x in ipairs(names) do
    values[k] = text.latex_of_unknown(x, rawget(point, x), point.roots, " = ")
  end
  lines[1] = table.concat(values, ",\\quad ")
  if point.A then
    lines[1] = lines[1] .. ": \\qquad A = " .. latex(#point.A == 1 and point.A(1, 1) or point.A)
  end
  local formula = "\\begin{equation*}\n" .. lines[1] .. "\n\\end{equation*}\n"
  local modes = point.eigenvalues and tostring(point.eigenvalues) or point.modes
  return formula .. include "latex_report".fragment((modes and modes .. "\n" or "") .. point.verdict)
end

local function list_latex(list)
  local parts = {}
  for k, point in ipairs(list) do parts[k] = point_latex(point, list.unknowns) end
  if #list == 0 then parts[1] = include "latex_report".fragment(list.none) end
  local notes = {}
  if list.period then notes[1] = "angles " .. list.period end
  notes[#notes + 1] = list.note
  if #list.conditions > 0 then notes[#notes + 1] = "where " .. table.concat(list.conditions, ", ") end
  if #notes > 0 then parts[#parts + 1] = include "latex_report".fragment(table.concat(notes, "\n")) end
  return table.concat(parts, "\n")
end

local function values_of(sys, options)
  local values = {}
  if options.params == true or options.within then
    for _, p in ipairs(entries(sys.parameters)) do
      local good, v = pcall(function() return p.value end)
      if good and v ~= nil then values[p] = v end
    end
  end
  if options.params ~= true then
    for p, v in pairs(options.params or {}) do values[type(p) == "string" and param(p) or p] = v end
  end
  for u, v in pairs(options.inputs or {}) do values[type(u) == "string" and input(u) or u] = v end
  return values
end

-- The linearisation at a point: its matrix, or det(s E - A) where the index is above 1 or the initial
-- values are not free, with the verdict.
local function linearised(p, slope, point, put)
  local good, at = pcall(function()
    if slope then return simplify(next(point) and subs(slope, point) or slope) end
    return pencil(p, p.model:dof(), point, put)
  end)
  if not good or not at then
    return { verdict = good and "not linearised: too many equations for a determinant in symbols"
      or "not linearised: this form is singular here; equilibria(sys) of the model before reduce is "
        .. "linearised" }
  end
  local A = slope and (object_type(at) == "matrix" and at or mat { { at } }) or nil
  local polynomial = A and entries(charpoly(A)) or at
  if #polynomial == 1 then return { verdict = "no motion is left: the equations determine every value" } end
  local stable, verdict, eigenvalues = judge(A, polynomial)
  return { A = A, stable = stable, verdict = verdict, eigenvalues = eigenvalues,
    modes = ("det(s %s - A) = "):format(A and "I" or "E") .. polynomial_text(polynomial) }
end

-- The points { [x] = value } where all equations hold, with what is said about all of them.
local function points(equations, unknowns, within)
  if within then
    equation.asked_by "equilibria"
    return include "algebra/box_search".roots_in_box(equations, unknowns, within)
  end
  local good, found = pcall(algebra.solve_equations, equations, unknowns, "equilibria")
  if not good then
    local ranges = {}
    for i, x in ipairs(unknowns) do ranges[i] = x.name .. " = { …, … }" end
    local why = tostring(found):gsub("^.-equilibria: ", ""):gsub("; newton{.*", "")
    equation.refuse(("%s; equilibria(sys, { within = { %s } }) searches a box in numbers")
      :format(why, table.concat(ranges, ", ")))
  end
  found.none = tostring(found):gsub("^no solution\n.*", "no equilibrium")
  return found
end

local function equilibria(sys, options)
  sys = as_model(sys)
  if object_type(sys) ~= "model" then fail "equilibria: expected a model: equilibria(dae{ … })" end
  options = options or {}
  local p = parts(sys)
  local values = values_of(sys, options)
  local unknowns, equations = {}, {}
  for _, x in ipairs(p.x) do unknowns[#unknowns + 1] = x end
  for _, z in ipairs(p.z) do unknowns[#unknowns + 1] = z end
  local function put(e) return next(values) and subs(e, values) or e end
  for _, e in ipairs(p.rest) do equations[#equations + 1] = put(e) end
  local found = points(equations, unknowns, options.within)
  local slope = linearisation(p)
  if slope then slope = put(slope) end
  local list = { unknowns = unknowns, conditions = found.conditions, period = found.period,
    none = found.none, note = found.note }
  for k, s in ipairs(found) do
    local point = {}
    for _, x in ipairs(unknowns) do point[x] = rawget(s, x) end
    local extra = linearised(p, slope, point, put)
    extra.roots = found.roots
    if found.note and extra.A then
      local A = evaluate(extra.A)
      extra.A = type(A) == "number" and mat { { A } } or A
    end
    function extra.latex() return point_latex(point, unknowns) end
    list[k] = setmetatable(point, { __name = "equilibrium",
      __tostring = function(p) return point_lines(p, unknowns, "") end, __index = function(_, key)
      if extra[key] ~= nil then return extra[key] end
      if type(key) == "string" then for x, v in pairs(point) do if x.name == key then return v end end end
    end })
  end
  return setmetatable(list, { __tostring = list_text, __name = "equilibria",
    __index = { latex = list_latex } })
end

return { equilibria = equilibria }
