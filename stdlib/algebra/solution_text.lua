-- How solutions are written.

local equation = include "algebra/equation"

local text = {}

local function shown(v)
  if math.type(v) == "float" then return ("%.10g"):format(v) end
  return tostring(v)
end

-- A multiple k of a period.
local function multiple(period)
  local turns = simplify(period/pi)
  if not equation.is_number(turns) then return "k " .. tostring(period) end
  local below = 1
  while below < 1000 and math.type(simplify(turns*below)) ~= "integer" do below = below + 1 end
  local above = simplify(turns*below)
  local text = above == 1 and "k π" or tostring(above) .. " k π"
  return below == 1 and text or text .. "/" .. tostring(below)
end

function text.period(period) return "+ " .. multiple(period) end

local function with_period(root, period)
  if not period then return shown(root) end
  return root == 0 and multiple(period) or shown(root) .. " " .. text.period(period)
end

-- Numbers by size; others stay as they were found.
function text.in_order(list)
  for i = 1, #list do if not equation.is_number(list[i]) or list.text[i] then return list end end
  local order, places = {}, { "times", "about", "periods", "when" }
  for i = 1, #list do order[i] = { list[i] } for k, name in ipairs(places) do
    order[i][k + 1] = (list[name] or {})[i] or false end end
  table.sort(order, function(a, b) return equation.value(a[1]) < equation.value(b[1]) end)
  for i, entry in ipairs(order) do
    list[i] = entry[1]
    for k, name in ipairs(places) do if list[name] then list[name][i] = entry[k + 1] or nil end end
  end
  return list
end

local multiplicity = { [2] = "  (double)", [3] = "  (triple)" }

local function pair_text(pair)
  if type(pair.im) ~= "number" then
    local op, inside = operation(pair.im)
    if op == "abs" then pair = { re = pair.re, im = inside } end      -- ± says it
  end
  local im = pair.im == 1 and "i" or shown(pair.im) .. " i"
  if type(pair.im) ~= "number" and operation(pair.im) == "add" then im = "(" .. shown(pair.im) .. ") i" end
  return (pair.re == 0 and "± " or shown(pair.re) .. " ± ") .. im
end

function text.of_roots(list, x)
  local lines, sign = {}, tostring(x) .. (list.approximate and " ≈ " or " = ")
  for i = 1, #list do
    local line = sign .. (list.text[i] or with_period(list[i], list.periods and list.periods[i]))
    if list.about[i] then line = line .. (" ≈ %.10g"):format(evaluate(list[i])) end
    local times = list.times[i] or 1
    if times > 1 then line = line .. (multiplicity[times] or ("  (%d-fold)"):format(times)) end
    lines[i] = line .. (list.when[i] and "   where " .. list.when[i] or "")
  end
  local only_complex = #list == 0 and #list.complex > 0
  for _, pair in ipairs(list.complex) do
    lines[#lines + 1] = sign .. pair_text(pair) .. (only_complex and "  (no real solutions)" or "")
  end
  if #lines == 0 then lines[1] = "no solution" end
  for k, definition in ipairs(list.definitions) do
    lines[#lines + 1] = (k == 1 and "with " or "     ") .. definition
  end
  if #list.conditions > 0 then lines[#lines + 1] = "where " .. table.concat(list.conditions, ", ") end
  return table.concat(lines, "\n")
end

-- The variable that a model of first order has for θ′.
local function name_of(x) return (tostring(x):gsub("_dot$", "′")) end

-- "x = 2", "x free", "x with x³ + a x + b = 0".
function text.of_unknown(x, v, roots)
  if v == nil and roots and roots[x] then return name_of(x) .. " with " .. tostring(roots[x]) .. " = 0" end
  return name_of(x) .. (v == nil and " free" or (math.type(v) == "float" and " ≈ " or " = ") .. shown(v))
end
function text.latex_of_unknown(x, v, roots, equals)
  if v == nil and roots and roots[x] then return latex(roots[x]) .. equals .. "0" end
  return latex(x) .. (v == nil and "\\ \\text{free}" or equals .. latex(v))
end

function text.of_solutions(list)
  local lines = {}
  for _, s in ipairs(list) do
    local parts = {}
    for _, x in ipairs(list.unknowns) do
      parts[#parts + 1] = text.of_unknown(x, rawget(s, x), list.roots)
    end
    lines[#lines + 1] = table.concat(parts, ",  ")
  end
  if #lines == 0 then lines[1] = list.complex and "no real solution" or "no solution" end
  if list.period then lines[#lines + 1] = "angles " .. list.period end
  if #list.conditions > 0 then lines[#lines + 1] = "where " .. table.concat(list.conditions, ", ") end
  return table.concat(lines, "\n")
end

local signs = { ["≥"] = "\\ge ", ["≤"] = "\\le ", ["≠"] = "\\ne ", ["π"] = "\\pi ", ["φ"] = "\\varphi ",
  ["₀"] = "_{0}",
  ["²"] = "^{2}", ["³"] = "^{3}", ["⁴"] = "^{4}", ["⁵"] = "^{5}", ["⁶"] = "^{6}", ["₁"] = "_{1}",
    ["₂"] = "_{2}",
  ["₃"] = "_{3}", ["α"] = "\\alpha ", ["β"] = "\\beta ", ["γ"] = "\\gamma ", ["λ"] = "\\lambda ",
    ["μ"] = "\\mu ",
  ["ω"] = "\\omega ", ["θ"] = "\\theta ", ["ρ"] = "\\rho ", ["σ"] = "\\sigma ", ["τ"] = "\\tau " }

-- A condition or abbreviation, written for the terminal, in LaTeX.
local function condition_latex(line)
  local roots
  repeat
    line, roots = line:gsub("√(%b())", function(inside) return "\\sqrt{" .. inside:sub(2, -2) .. "}" end)
  until roots == 0
  line = line:gsub("√([%w]+)", "\\sqrt{%1}"):gsub("%((real)%)", "\\text{ (%1)}")
  line = line:gsub(" the largest root of ", " \\text{ the largest root of } ")
  return (line:gsub(utf8.charpattern, signs))
end

-- The roots in LaTeX, in full, with the conditions that need abbreviations.
function text.latex_of_roots(list, x)
  local rows, sign = {}, latex(x) .. (list.approximate and " &\\approx " or " &= ")
  local longest = 400
  local function in_latex(v, short)
    local full = math.type(v) == "float" and ("%.10g"):format(v) or latex(v)
    return short and #full > longest and condition_latex(short) or full
  end
  for i = 1, #list do
    local period = list.periods and list.periods[i]
    rows[#rows + 1] = "  " .. sign .. in_latex(list[i], list.text[i])
      .. (period and " + k\\," .. latex(period) or "")
      .. (list.when[i] and " && \\text{where } " .. condition_latex(list.when[i]) or "")
  end
  for _, pair in ipairs(list.complex) do
    rows[#rows + 1] = "  " .. sign .. (pair.re == 0 and "" or in_latex(pair.re)) .. " \\pm "
      .. (pair.im == 1 and "" or in_latex(pair.im) .. "\\,") .. "\\mathrm{i}"
  end
  for _, lines in ipairs { list.definitions, list.conditions } do
    for _, line in ipairs(lines) do
      rows[#rows + 1] = "  &\\text{" .. (lines == list.definitions and "with" or "where") .. " } "
        .. condition_latex(line)
    end
  end
  if #rows == 0 then rows[1] = "  &\\text{no solution}" end
  return "\\begin{align*}\n" .. table.concat(rows, " \\\\\n") .. "\n\\end{align*}"
end

function text.latex_of_solutions(list)
  local rows = {}
  for _, s in ipairs(list) do
    local parts = {}
    for _, x in ipairs(list.unknowns) do
      local v = rawget(s, x)
      if v ~= nil or list.roots[x] then
        parts[#parts + 1] = text.latex_of_unknown(x, v, list.roots, " &= ")
      end
    end
    rows[#rows + 1] = "  " .. table.concat(parts, ", & ")
  end
  if #rows == 0 then rows[1] = "  &\\text{no solution}" end
  return "\\begin{align*}\n" .. table.concat(rows, " \\\\\n") .. "\n\\end{align*}"
end

return text
