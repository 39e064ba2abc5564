-- LaTeX of what is printed as a report: tables by their columns, matrices, sentences with their formulas.
-- The fragment needs amsmath and nothing else.

local M = {}

local signs = {
  ["·"] = "\\cdot ", ["×"] = "\\times ", ["≤"] = "\\leq ", ["≥"] = "\\geq ", ["≠"] = "\\neq ",
  ["≈"] = "\\approx ", ["±"] = "\\pm ", ["∞"] = "\\infty ", ["√"] = "\\surd ", ["∂"] = "\\partial ",
  ["∈"] = "\\in ", ["→"] = "\\to ", ["←"] = "\\leftarrow ", ["∝"] = "\\propto ", ["‖"] = "\\|",
  ["′"] = "'", ["″"] = "''", ["‴"] = "'''", ["ᵀ"] = "^{\\top}", ["⋆"] = "^{\\star}", ["−"] = "-",
  ["…"] = "\\ldots ", ["ℝ"] = "\\mathrm{R}", ["∫"] = "\\int ", ["Π"] = "\\Pi ", ["°"] = "^{\\circ}",
  ["∣"] = "|", ["⟂"] = "\\perp ", ["│"] = "|", ["─"] = "-", ["┼"] = "+", ["•"] = "\\bullet ",
  ["₊"] = "_{+}", ["₋"] = "_{-}", ["∠"] = "\\angle ", ["∇"] = "\\nabla ", ["½"] = "\\tfrac{1}{2}",
  ["⊗"] = "\\otimes ", ["∅"] = "\\emptyset ", ["⟨"] = "\\langle ", ["⟩"] = "\\rangle ",
  ["≪"] = "\\ll ", ["≫"] = "\\gg ", ["∑"] = "\\sum ", ["∏"] = "\\prod ", ["✓"] = "\\surd ",
  ["ŷ"] = "\\hat{y}", ["⇒"] = "\\Rightarrow ", ["⇔"] = "\\Leftrightarrow ", ["∀"] = "\\forall ",
  ["α"] = "\\alpha ", ["β"] = "\\beta ", ["γ"] = "\\gamma ", ["δ"] = "\\delta ",
  ["ε"] = "\\varepsilon ", ["ζ"] = "\\zeta ", ["η"] = "\\eta ", ["θ"] = "\\theta ", ["κ"] = "\\kappa ",
  ["λ"] = "\\lambda ", ["μ"] = "\\mu ", ["ν"] = "\\nu ", ["ξ"] = "\\xi ", ["π"] = "\\pi ",
  ["ρ"] = "\\rho ", ["σ"] = "\\sigma ", ["τ"] = "\\tau ", ["φ"] = "\\varphi ", ["χ"] = "\\chi ",
  ["ψ"] = "\\psi ", ["ω"] = "\\omega ", ["ι"] = "\\iota ", ["Γ"] = "\\Gamma ", ["Δ"] = "\\Delta ",
  ["Θ"] = "\\Theta ", ["Λ"] = "\\Lambda ", ["Ξ"] = "\\Xi ", ["Σ"] = "\\Sigma ", ["Φ"] = "\\Phi ",
  ["Ψ"] = "\\Psi ", ["Ω"] = "\\Omega ",
}
for i, group in ipairs { "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺⁽⁾ᵏⁿ", "₀₁₂₃₄₅₆₇₈₉₍₎ᵢⱼₖ" } do
  local plain, k = i == 1 and "0123456789-+()kn" or "0123456789()ijk", 0
  for _, code in utf8.codes(group) do
    k = k + 1
    signs[utf8.char(code)] = (i == 1 and "^{" or "_{") .. plain:sub(k, k) .. "}"
  end
end
local letters = { ["ü"] = '\\"u', ["ö"] = '\\"o', ["ä"] = '\\"a', ["é"] = "\\'e", ["–"] = "--", ["—"] = "---",
  ["“"] = "``", ["”"] = "''", ["’"] = "'", ["’"] = "'" }
local specials = { ["#"] = "\\#", ["$"] = "\\$", ["%"] = "\\%", ["&"] = "\\&", ["_"] = "\\_", ["{"] = "\\{",
  ["}"] = "\\}", ["~"] = "\\textasciitilde{}", ["^"] = "\\textasciicircum{}", ["\\"] = "\\textbackslash{}" }
local hat = utf8.char(0x302)

local function characters(line)
  local list = {}
  for _, code in utf8.codes(line) do
    local c = utf8.char(code)
    if c == hat and #list > 0 then list[#list] = list[#list] .. c else list[#list + 1] = c end
  end
  return list
end

-- The formula that a word without spaces is, neighbouring superscripts (subscripts) as one.
local function as_formula(list)
  local out = {}
  for _, c in ipairs(list) do
    local base = c:gsub(hat .. "$", "")
    local shown = signs[base] or specials[base] or letters[base] or (#base == 1 and base or "?")
    if base == "_" then shown = "\\_" end
    out[#out + 1] = base ~= c and "\\hat{" .. shown .. "}" or shown
  end
  local text = table.concat(out)
  for _, mark in ipairs { "%^", "_" } do
    local count = 1
    while count > 0 do text, count = text:gsub(mark .. "{([^{}]*)}" .. mark .. "{([^{}]*)}", function(a, b)
      return (mark == "_" and "_{" or "^{") .. a .. b .. "}" end) end
  end
  text = text:gsub("%f[%a\\](\\?)(%a%a+)", function(slash, word)
    return slash == "\\" and slash .. word or "\\mathrm{" .. word .. "}"
  end)
  return "$" .. text .. "$"
end

-- A word as text, or as a formula where it has signs that only formulas have.
local function word(list)
  local formula = false
  for _, c in ipairs(list) do formula = formula or signs[c] ~= nil or c:find(hat, 1, true) ~= nil end
  if formula then return as_formula(list) end
  local plain = table.concat(list)
  local head, below = plain:match "^(%a)_(%w+)$"
  if head then return "$" .. head .. "_{" .. below .. "}$" end
  if plain:match "^%-[%d.]+e?[-+%d]*$" then return "$" .. plain .. "$" end       -- a minus sign, not a hyphen
  local out = {}
  for i, c in ipairs(list) do out[i] = specials[c] or letters[c] or (#c == 1 and c or "?") end
  return table.concat(out)
end

local function inline(text)
  return (text:gsub("%S+", function(each) return word(characters(each)) end))
end

-- ── tables ──

-- The first and last places of the columns of these lines: what two blanks in every line part.
local function columns_of(rows)
  local width, blank = 0, {}
  for _, row in ipairs(rows) do width = math.max(width, #row) end
  for j = 1, width do
    blank[j] = true
    for _, row in ipairs(rows) do blank[j] = blank[j] and (row[j] or " ") == " " end
  end
  local columns, first = {}, nil
  for j = 1, width + 2 do
    local gap = blank[j] ~= false and (blank[j + 1] ~= false or j >= width)
    if not gap and not first and not blank[j] then first = j end
    if first and gap then columns[#columns + 1], first = { first, j - 1 }, nil end
  end
  return columns
end

local function cell(row, column)
  local text = table.concat(row, "", column[1], math.min(column[2], #row))
  return text:match "^%s*(.-)%s*$"
end

local function is_rule(line)
  return line:find("─", 1, true) ~= nil and line:gsub("─", ""):gsub("┼", ""):find "%S" == nil
end

local function tabular(lines)
  local rows = {}
  for i, line in ipairs(lines) do rows[i] = characters(line) end
  local columns = columns_of(rows)
  if #columns < 2 or #rows < 2 then return nil end
  local layout, out = {}, {}
  for k, column in ipairs(columns) do
    local numbers = 0
    for i = 2, #rows do if cell(rows[i], column):find "^[-±]?%d" then numbers = numbers + 1 end end
    layout[k] = 2*numbers >= #rows - 1 and "r" or "l"
  end
  for i, row in ipairs(rows) do
    local cells = {}
    for k, column in ipairs(columns) do cells[k] = inline(cell(row, column)) end
    out[i] = table.concat(cells, " & ")
  end
  return "\\begin{center}\\begin{tabular}{" .. table.concat(layout) .. "}\n" .. table.concat(out, " \\\\\n")
    .. "\n\\end{tabular}\\end{center}"
end

-- ── matrices ──

-- The words of a line inside a formula.
local function in_formula(text)
  local out = {}
  for each in text:gmatch "%S+" do out[#out + 1] = as_formula(characters(each)):sub(2, -2) end
  return table.concat(out, "\\ ")
end

-- The lines of matrices side by side: { text, entries, text, entries, …, text } of each, or nothing.
local function pieces_of(line)
  for _, sign in ipairs { "⎡", "⎢", "⎣" } do line = line:gsub(sign, "\1") end
  for _, sign in ipairs { "⎤", "⎥", "⎦" } do line = line:gsub(sign, "\2") end
  local list, at = {}, 1
  for before, inside, next_at in line:gmatch "([^\1\2]*)\1([^\1\2]*)\2()" do
    list[#list + 1], list[#list + 2], at = before, inside, next_at
  end
  list[#list + 1] = line:sub(at)
  return list
end

local function entries_of(inside)
  local row = {}
  for each in (inside .. "  "):gmatch "%s*(%S.-)%s%s+" do row[#row + 1] = in_formula(each) end
  return table.concat(row, " & ")
end

-- The lines from ⎡ to ⎣ as one displayed formula.
local function matrices(lines)
  local rows, count = {}, nil
  for i, line in ipairs(lines) do
    rows[i] = pieces_of(line)
    count = count or #rows[i]
    if #rows[i] ~= count or line:find "[\1\2]" then return nil end
  end
  local out = {}
  for k = 1, count do
    local parts = {}
    for i, row in ipairs(rows) do
      if k % 2 == 0 then parts[i] = entries_of(row[k])
      elseif row[k]:find "%S" then parts[#parts + 1] = in_formula(row[k]) end
    end
    local separator = k % 2 == 0 and " \\\\ " or " "
    local text = table.concat(parts, separator)
    out[k] = k % 2 == 0 and "\\begin{bmatrix} " .. text .. " \\end{bmatrix}" or text
  end
  return "\\begin{equation*}\n" .. table.concat(out, " ") .. "\n\\end{equation*}"
end

local function drawn_matrices(lines)
  local out, block = {}, {}
  for _, line in ipairs(lines) do
    block[#block + 1] = line
    if line:find("⎣", 1, true) then
      out[#out + 1] = matrices(block) or "\\noindent " .. inline(table.concat(block, " "))
      block = {}
    end
  end
  if #block > 0 then out[#out + 1] = "\\noindent " .. inline(table.concat(block, " ")) end
  return table.concat(out, "\n")
end

-- ── the whole report ──

local function kind_of(line)
  if not line:find "%S" then return "empty" end
  if line:find("⎡", 1, true) or line:find("⎢", 1, true) or line:find("⎣", 1, true) then return "matrix" end
  local gaps = select(2, line:gsub("%S   *%f[%S]", ""))
  if is_rule(line) then return "rule" end
  if gaps > 1 and not line:find "^%s*%S+ +=" then return "table" end
  return gaps == 0 and "text" or "pair"
end

-- What a sentence is that was broken where the screen ends.
local function joined(lines)
  local out = {}
  for _, line in ipairs(lines) do
    local long = #out > 0 and utf8.len(out[#out]) > 75
    if long and line:find "^%S" then out[#out] = out[#out] .. " " .. line else out[#out + 1] = line end
  end
  return out
end

local function sentences(lines)
  local out = {}
  for i, line in ipairs(joined(lines)) do
    local indent, rest = line:match "^( *)(.*)$"
    out[i] = (#indent > 0 and "\\hspace*{" .. #indent//2 .. "em}" or "") .. inline(rest)
  end
  return "\\noindent " .. table.concat(out, " \\\\\n") .. "\n"
end

local writers = { matrix = drawn_matrices, text = sentences,
  table = function(lines) return tabular(lines) or sentences(lines) end,
  pair = function(lines) return tabular(lines) or sentences(lines) end }

--- A printed report as a LaTeX fragment.
function M.fragment(report)
  local out, group, kind = { "\\noindent" }, {}, "text"
  local function finish()
    if #group > 0 then out[#out + 1] = writers[kind](group) end
    group = {}
  end
  for line in (report .. "\n"):gmatch "([^\n]*)\n" do
    local this = kind_of(line)
    if this == "rule" or kind == "table" and this == "pair" and #group < 2 then this = kind end
    if this ~= kind or this == "empty" then finish() end
    if this ~= "empty" then
      kind = this
      if not is_rule(line) then group[#group + 1] = line end
    end
  end
  finish()
  return table.concat(out, "\n")
end

return M
