-- LaTeX of results that have no text of their own in C++: what is written by print says, solutions,
-- distributions, numbers.

local report = include "latex_report"
local M = {}

-- ── what is not written by print says ──

-- 0.000012 as 1.2 \cdot 10^{-5}, six digits.
local function number(value) return report.number(("%.6g"):format(value)) end

-- A table of the states at eleven times, and what print says of the run.
local function solution(sol)
  local first, last, times = sol.t[1], sol.t[#sol.t], {}
  for k = 0, first < last and 10 or 0 do times[k + 1] = k == 10 and last or first + k*(last - first)/10 end
  local names, columns, left = { "$t$" }, { times }, 0
  for _, part in ipairs { sol.model.differential, sol.model.algebraic } do
    for i = 1, #part do
      if #columns < 8 then
        names[#names + 1], columns[#columns + 1] = "$" .. latex(part[i]) .. "$", sol(part[i], times)
      else
        left = left + 1
      end
    end
  end
  local rows = { table.concat(names, " & ") .. " \\\\ \\hline" }
  for i = 1, #times do
    local cells = {}
    for j, column in ipairs(columns) do cells[j] = "$" .. number(column[i]) .. "$" end
    rows[#rows + 1] = table.concat(cells, " & ") .. " \\\\"
  end
  local more = left > 0 and ("\n\\noindent and %d more variables\n"):format(left) or ""
  return report.fragment(tostring(sol):match "^[^\n]*") .. "\\begin{center}\\begin{tabular}{"
    .. ("r"):rep(#columns) .. "}\n" .. table.concat(rows, "\n") .. "\n\\end{tabular}\\end{center}" .. more
    .. "\n" .. report.fragment(tostring(sol:stats()))
end

-- N(0, 0.1²) and U(0, 1) as they stand in books, others by their names.
local function distribution(d)
  local name, values = tostring(d):match "^(%a+)%(([^()]*)%)$"
  if not name then return report.fragment(tostring(d)) end
  local list = {}
  for value in values:gmatch "[^,%s]+" do
    list[#list + 1] = tonumber(value) and report.number(value) or value
  end
  if name == "normal" and #list == 2 then
    local square = list[2]:find "^[%d.]+$" and list[2] .. "^2" or "\\left(" .. list[2] .. "\\right)^2"
    return "\\mathcal{N}\\left(" .. list[1] .. ", " .. square .. "\\right)"
  end
  if name == "uniform" and #list == 2 then
    return "\\mathcal{U}\\left(" .. table.concat(list, ", ") .. "\\right)"
  end
  return "\\mathrm{" .. name .. "}\\left(" .. table.concat(list, ", ") .. "\\right)"
end

local function complex(z)
  local function part(x) return math.type(x) == "float" and number(x) or latex(x) end
  local re, im = part(z.re), part(z.im)
  local minus = im:sub(1, 1) == "-"
  if minus then im = im:sub(2) end
  im = (im == "1" and "" or im .. " ") .. "i"
  if re == "0" then return (minus and "-" or "") .. im end
  return re .. (minus and " - " or " + ") .. im
end

-- A delay in front of a rational function is a factor; delays in loops are told in words.
local function delay_system(G)
  local factor = tostring(G):match "\ntimes (%S.*)$"
  if not factor then return report.fragment(tostring(G)) end
  return (G.rational:latex():gsub(" = ", function(sign) return sign .. report.formula(factor) .. " " end, 1))
end

local function refused(cure)
  return function(value) fail(("latex: a %s has no LaTeX text; %s"):format(object_type(value), cure)) end
end

local written = {
  solution = solution, distribution = distribution, complex = complex,
  ["delay system"] = delay_system,
  func = function(f) return latex(var(tostring(f):match "^[^:]+")) end,
  figure = refused 'save it, fig:save "x.pdf", and write \\includegraphics{x.pdf}',
  surface = refused 'draw it, plot3{ surfaces = { s } }:save "x.pdf", and write \\includegraphics{x.pdf}',
  fn = refused "take the expression that it was compiled from",
}

--- The LaTeX text of a value of this kind.
function M.fragment(kind, value)
  return written[kind] and written[kind](value) or report.fragment(tostring(value))
end

local texts = { solution = "A table of the states at eleven times, and the statistics of the run." }
local examples = {                                   -- of those that print does not write
  complex = { "return tf({1}, {1, 1, 2}):poles()[1]:latex()", "-\\frac{1}{2} - \\frac{\\sqrt{7}}{2} i" },
  distribution = { "return normal(0, 1):latex()", "\\mathcal{N}\\left(0, 1^2\\right)" },
  func = { 'return func("f"):latex()', "f" },
  ["delay system"] = { "return delayed(tf({1}, {1, 1}), 2):latex()", "G(s) = e^{-2 s} \\frac{1}{s + 1}" },
}
local refusals = { figure = "plot({1, 2}):latex()", surface = "surface(math.max, {0, 1}, {0, 1}, 3):latex()",
  fn = 'fn({ var "x" }, var "x"):latex()' }

--- Text and example of the row of a kind, where they differ from others, when help or a test reads it first.
function M.describe(row, kind)
  row.sig = specimens[kind][1] .. ":latex() -> string"
  row.text = texts[kind] or ("The printed form of a value of type %s in LaTeX: tables, matrices, sentences "
    .. "with their formulas. It needs amsmath."):format(kind)
  if examples[kind] then row.example, row.gives = table.unpack(examples[kind]) end
  if refusals[kind] then
    row.text = "There is no LaTeX text of it: an error that names the call to write instead."
    row.example = "expect(function() return " .. refusals[kind] .. ' end):fails "has no LaTeX text"'
  end
end

return M
