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
    ["✗"] = "\\times ",
  ["ŷ"] = "\\hat{y}", ["⇒"] = "\\Rightarrow ", ["⇔"] = "\\Leftrightarrow ", ["∀"] = "\\forall ",
  ["α"] = "\\alpha ", ["β"] = "\\beta ", ["γ"] = "\\gamma ", ["δ"] = "\\delta ",
  ["ε"] = "\\varepsilon ", ["ζ"] = "\\zeta ", ["η"] = "\\eta ", ["θ"] = "\\theta ", ["κ"] = "\\kappa ",
  ["λ"] = "\\lambda ", ["μ"] = "\\mu ", ["ν"] = "\\nu ", ["ξ"] = "\\xi ", ["π"] = "\\pi ",
  ["ρ"] = "\\rho ", ["σ"] = "\\sigma ", ["τ"] = "\\tau ", ["φ"] = "\\varphi ", ["χ"] = "\\chi ",
  ["ψ"] = "\\psi ", ["ω"] = "\\omega ", ["ι"] = "\\iota ", ["Γ"] = "\\Gamma ", ["Δ"] = "\\Delta ",
  ["Θ"] = "\\Theta ", ["Λ"] = "\\Lambda ", ["Ξ"] = "\\Xi ", ["Σ"] = "\\Sigma ", ["Φ"] = "\\Phi ",
  ["Ψ"] = "\\Psi ", ["Ω"] = "\\Omega ",
}
for i, group in ipairs { "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺⁽⁾ᵏⁿ", "₀₁₂₃₄₅₆₇₈₉₍₎ᵢⱼₖₐₑₕₗₘₙₒₚₛₜₓ" } do
  local plain, k = i == 1 and "0123456789-+()kn" or "0123456789()ijkaehlmnopstx", 0
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

-- AAc of order conditions is a product.
local function is_product(letters_) return letters_:find "^A+c?$" ~= nil end

local functions = {}
for name in ("sin cos tan exp log ln sinh cosh tanh min max det"):gmatch "%a+" do functions[name] = true end

-- The formula that a word without spaces is, neighbouring superscripts (subscripts) as one.
local function as_formula(list)
  local out = {}
  for _, c in ipairs(list) do
    local base = c:gsub(hat .. "$", "")
    local shown = signs[base] or specials[base] or letters[base] or (#base == 1 and base or "?")
    out[#out + 1] = base ~= c and "\\hat{" .. shown .. "}" or shown
  end
  local text = table.concat(out)
  for _, mark in ipairs { "%^", "_" } do
    local count = 1
    while count > 0 do text, count = text:gsub(mark .. "{([^{}]*)}" .. mark .. "{([^{}]*)}", function(a, b)
      return (mark == "_" and "_{" or "^{") .. a .. b .. "}" end) end
  end
  text = text:gsub("\\textasciicircum{}(%b())", function(power) return "^{" .. power:sub(2, -2) .. "}" end)
    :gsub("\\textasciicircum{}(%w)", "^%1"):gsub("\\_\\{(.-)\\}", "_{%1}")
  text = text:gsub("(%d)e([-+]?%d+)", function(digit, power)
    return ("%s \\cdot 10^{%d}"):format(digit, tonumber(power))
  end)
  text = text:gsub("(%a)\\_(%w+'*)", "%1_{%2}"):gsub("\\surd (%d+)", "\\sqrt{%1}"):gsub("\\surd (%a)",
    "\\sqrt{%1}")
  text = text:gsub("()%f[%a\\](\\?)(%a%a+)", function(at, slash, word)
    local is_index = #word == 2 and text:sub(at - 2, at - 1) == "_{"                -- a_{ij}
    if slash == "\\" or is_index or is_product(word) then return slash .. word end
    return functions[word] and "\\" .. word .. " " or "\\mathrm{" .. word .. "}"
  end)
  return "$" .. text .. "$"
end

--- A printed formula of one line, for math mode.
function M.formula(text) return as_formula(characters(text)):sub(2, -2) end

--- A printed number as a formula: 1.2e-05 is 1.2 \cdot 10^{-5}.
function M.number(text) return text == "inf" and "\\infty" or M.formula(text) end

-- A word as text, or as a formula where it has signs that only formulas have.
local function word(list)
  local formula = false
  for _, c in ipairs(list) do formula = formula or signs[c] ~= nil or c:find(hat, 1, true) ~= nil end
  if formula then return as_formula(list) end
  local plain = table.concat(list)
  local before, symbol, rest = plain:match "^([%(%[]?)(%a_%w+)([%)%],;:.]*)$"
  if not symbol then before, symbol, rest = plain:match "^([%(%[]?)(%a_%b{})([%)%],;:.]*)$" end
  if symbol then return before .. as_formula(characters(symbol)) .. rest end
  local value, after = plain:match "^(%-?[%d.]+e?[-+%d]*)([,;:.]?)$"
  if value and value:find "^%-?%d" and value:find "[-e]" then                  -- a minus sign, not a hyphen
    return as_formula(characters(value)) .. after
  end
  local out = {}
  for i, c in ipairs(list) do out[i] = specials[c] or letters[c] or (#c == 1 and c or "?") end
  return table.concat(out)
end

local operators = {}
for sign in ("= + - < > ≤ ≥ ≠ ≈ ± · × → ← ⇒ ∈ …"):gmatch "%S+" do operators[sign] = true end

-- Whether a word can be a piece of a formula: a number, letters and functions, signs.
local function is_term(piece)
  if operators[piece] or piece:find "^[%(%[]*$" then return false end
  for letters_ in piece:gsub("_%w+", ""):gmatch "%a%a+" do
    if not functions[letters_] and not is_product(letters_) then return false end
  end
  return not piece:find "[%%\"']"
end

local function depth_of(piece)
  return select(2, piece:gsub("[%(%[]", "")) - select(2, piece:gsub("[%)%]]", ""))
end

-- The last of the words from `first` that are one formula with an operator in it (x = a y(t - 1), 0.2 ± 0.1),
-- or nothing.
local function end_of_formula(words, first)
  local depth, last, has_operator = 0, first, false
  while true do
    depth = depth + depth_of(words[last])
    local ends = depth <= 0 and words[last]:find "[,;:.]$"
    local following, after = words[last + 1], words[last + 2]
    if not ends and following and operators[following] and after and is_term(after) then
      last, has_operator = last + 2, true
    elseif not ends and following and is_term(following)
      and (depth > 0 or not following:find "^[-%d.]") then
      last = last + 1
    else
      local opened = depth == 1 and words[first]:find "^%("             -- (α = 1, or smaller)
      return has_operator and (depth <= 0 or opened) and last or nil
    end
  end
end

local function formula(words, first, last)
  local text = table.concat(words, " ", first, last)
  local after = text:match "[,;:.]*$"
  text = text:sub(1, #text - #after)
  local before = depth_of(text) > 0 and "(" or ""
  if depth_of(text) < 0 then text, after = text:sub(1, -2), text:sub(-1) .. after end
  return before .. as_formula(characters(text:sub(1 + #before))) .. after
end

-- A sentence, with the formulas in it as formulas.
local function inline(text)
  local out = {}
  for segment in (text .. "  "):gmatch "(%S.-)%s%s+" do
    local words, i = {}, 1
    for each in segment:gmatch "%S+" do words[#words + 1] = each end
    while words[i] do
      local last = is_term(words[i]) and end_of_formula(words, i)
      out[#out + 1] = last and formula(words, i, last) or word(characters(words[i]))
      i = (last or i) + 1
    end
  end
  return table.concat(out, " ")
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
  local formula_ = M.formula(text:match "^%s*(.-)%s*$")
  return (formula_:gsub("(\\mathrm{[^}]*}) (\\mathrm)", "%1\\ %2"))
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
  return table.concat(row, " & "), #row
end

-- amsmath's matrices have ten columns at most, an array as many as it says.
local function matrix(body, columns)
  if columns <= 10 then return "\\begin{bmatrix} " .. body .. " \\end{bmatrix}" end
  return "\\left[\\begin{array}{" .. ("c"):rep(columns) .. "} " .. body .. " \\end{array}\\right]"
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
    local parts, columns = {}, 0
    for i, row in ipairs(rows) do
      if k % 2 == 0 then
        parts[i], columns = entries_of(row[k])
      elseif row[k]:find "%S" then parts[#parts + 1] = in_formula(row[k]) end
    end
    local separator = k % 2 == 0 and " \\\\ " or " "
    local text = table.concat(parts, separator)
    out[k] = k % 2 == 0 and matrix(text, columns) or text
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
  if line:find "\1" then return "fraction" end
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

-- "M = [ a,  b;  c,  d ]" as a formula with a matrix.
local function in_one_line(line)
  local before, inside = line:match "^(.-)%[ (.*) %]$"
  if not before or not (inside:find(",  ", 1, true) or inside:find(";  ", 1, true)) then
    return inline(line)
  end
  local rows = {}
  for row in (inside .. ";  "):gmatch "(.-);  " do
    local cells = {}
    for each in (row .. ",  "):gmatch "(.-),  " do cells[#cells + 1] = in_formula(each) end
    rows[#rows + 1] = table.concat(cells, " & ")
  end
  return "$" .. in_formula(before) .. "\\begin{bmatrix} " .. table.concat(rows, " \\\\ ")
    .. " \\end{bmatrix}$"
end

local function sentences(lines)
  local out = {}
  for i, line in ipairs(joined(lines)) do
    local indent, rest = line:match "^( *)(.*)$"
    out[i] = (#indent > 0 and "\\hspace*{" .. #indent//2 .. "em}" or "") .. in_one_line(rest)
  end
  return "\\noindent " .. table.concat(out, " \\\\\n") .. "\n"
end

-- Fractions over three lines in one: a bar alone in its line, with a numerator above and a denominator below.
local function fractions_in_line(report)
  return (("\n" .. report):gsub("\n +(%S[^\n]*)\n +(─[─]*)\n +(%S[^\n]*)", function(above, bar, below)
    if bar:gsub("─", "") ~= "" or above:find "  " or below:find "  " then return end
    return "\n\1" .. above .. "\1" .. below
  end):sub(2))
end

local function displayed(line)
  local above, below = line:match "\1(.-)\1(.*)"
  return "\\begin{equation*}\n\\frac{" .. in_formula(above) .. "}{" .. in_formula(below)
    .. "}\n\\end{equation*}"
end

local writers = { matrix = drawn_matrices, text = sentences,
  fraction = function(lines)
    for i, line in ipairs(lines) do lines[i] = displayed(line) end
    return table.concat(lines, "\n")
  end,
  table = function(lines) return tabular(lines) or sentences(lines) end,
  pair = function(lines) return tabular(lines) or sentences(lines) end }

--- A sum in LaTeX cut before + and - outside of braces and parentheses where a line becomes too long.
function M.broken(text)
  local lines, line, depth, width = {}, "", 0, 0
  for piece, sign in (text .. " + "):gmatch "(.-)( [-+] )" do
    line = line .. piece
    depth = depth + select(2, piece:gsub("[{(]", "")) - select(2, piece:gsub("[})]", ""))
    width = width + #piece:gsub("\\frac{(.-)}{(%w*)}", "%1"):gsub("\\%a+", ""):gsub("[{}_]", "")
    if depth == 0 and width > 45 then
      lines[#lines + 1], line, width = line, "", 0
    end
    line = line .. sign
  end
  if line:find "%S.*%S" then lines[#lines + 1] = line:sub(1, -4) end
  for i, each in ipairs(lines) do lines[i] = each:match "^%s*(.-)%s*$" end
  return table.concat(lines, " \\\\\n  &\\quad ")
end

--- A printed report as a LaTeX fragment.
function M.fragment(report)
  local out, group, kind = { "\\noindent" }, {}, "text"
  report = fractions_in_line(report)
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
