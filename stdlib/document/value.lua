-- Values in HTML: mathematics as MathML, tables as tables, everything else as the text that print shows.
local text, mathml = document.text, document.mathml
local M = {}

local most_lines, shown_lines = 40, 15               -- longer texts fold: so many lines stay in sight
local longest_formula = 60000                        -- bytes of LaTeX; beyond, the text is easier to read

-- ── text ───────────────────────────────────────────────────────────────────────────────────────────────────

local function lines_of(words)
  local lines = {}
  for line in (words .. "\n"):gmatch "(.-)\n" do lines[#lines + 1] = line end
  if lines[#lines] == "" then lines[#lines] = nil end
  return lines
end

local drawing = "\xE2[\x8E\x94-\x96\xA0-\xA3]"       -- tall brackets, lines and boxes, braille dots

-- Lines without columns and drawings may be broken where they are too long for the page.
local function is_prose(lines, first, last)
  for i = first, last do
    if lines[i]:find "%S   " or lines[i]:find(drawing) then return false end
  end
  return true
end

local function pre(lines, first, last)
  return ('<pre class="text%s" tabindex="0">'):format(is_prose(lines, first, last) and " prose" or "")
    .. text.escaped(table.concat(lines, "\n", first, last)) .. "</pre>"
end

-- Text as it is; of many lines the first, and the rest behind a fold.
function M.text_block(words)
  local lines = lines_of(words)
  if #lines <= most_lines then return pre(lines, 1, #lines) end
  return pre(lines, 1, shown_lines)
    .. ("<details><summary>%d more lines</summary>%s</details>"):format(#lines - shown_lines,
      pre(lines, shown_lines + 1, #lines))
end

-- ── tables ─────────────────────────────────────────────────────────────────────────────────────────────────

local function characters(line)
  local list = {}
  for _, code in utf8.codes(line) do
    if code < 0x300 or code > 0x36F then list[#list + 1] = utf8.char(code)
    elseif #list > 0 then list[#list] = list[#list] .. utf8.char(code) end
  end
  return list
end

-- The spans of characters that are columns of all rows: between them stand at least two blanks in every row.
local function columns_of(rows)
  local used, width = {}, 0
  for _, row in ipairs(rows) do
    width = math.max(width, #row)
    for j, c in ipairs(row) do used[j] = used[j] or c ~= " " end
  end
  local columns, first, gap = {}, nil, 0
  for j = 1, width + 2 do
    if used[j] then
      first = first or j
      gap = 0
    elseif first then
      gap = gap + 1
      if gap == 2 then
        columns[#columns + 1] = { first, j - 2 }
        first = nil
      end
    end
  end
  return columns
end

local function cell(row, column)
  return (table.concat(row, "", column[1], math.min(column[2], #row)):match "^%s*(.-)%s*$")
end

local function is_number(word) return word == "" or word:find "^[-−+]?[%d.]+[%deE+.%-−]*%%?$" ~= nil end

local function html_table(head, rows, columns)
  local out, right = {}, {}
  for j, column in ipairs(columns) do
    right[j] = true
    for _, row in ipairs(rows) do
      local word = #row >= column[1] and cell(row, column) or ""
      right[j] = right[j] and is_number(word:gsub("^≤ ", ""))
    end
  end
  local function add(row, name)
    out[#out + 1] = "<tr>"
    for j, column in ipairs(columns) do
      local word = #row >= column[1] and cell(row, column) or ""
      out[#out + 1] = ("<%s%s>%s</%s>"):format(name, right[j] and ' class="number"' or "", text.escaped(word),
        name)
    end
    out[#out + 1] = "</tr>"
  end
  out[#out + 1] = '<div class="wide" tabindex="0"><table>'
  if head then
    out[#out + 1] = "<thead>"
    add(head, "th")
    out[#out + 1] = "</thead>"
  end
  out[#out + 1] = "<tbody>"
  for _, row in ipairs(rows) do add(row, "td") end
  out[#out + 1] = "</tbody></table></div>"
  return table.concat(out)
end

local function is_rule(line) return line ~= nil and line:gsub("─", "") == "" and line ~= "" end

-- Rows i, i + 1 … as long as they keep the columns of the head apart.
local function rows_below(lines, i, head)
  local rows, columns = { head }, columns_of { head }
  while lines[i] and lines[i]:find "%S" and not is_rule(lines[i + 1]) do
    local row = characters(lines[i])
    rows[#rows + 1] = row
    local now = columns_of(rows)
    if #now < #columns and #columns > 1 then
      rows[#rows] = nil
      break
    end
    columns, i = now, i + 1
  end
  return table.move(rows, 2, #rows, 1, {}), columns_of(rows), i
end

-- A text with tables in it: a line of titles above a rule as wide as the table.
local function with_tables(words)
  local lines, out, plain = lines_of(text.valid(words)), {}, {}
  local i = 1
  local function flush()
    if #plain > 0 then out[#out + 1] = M.text_block(table.concat(plain, "\n")) end
    plain = {}
  end
  while lines[i] do
    local rows, columns, after
    if is_rule(lines[i + 1]) then
      rows, columns, after = rows_below(lines, i + 2, characters(lines[i]))
    end
    if rows and #columns > 1 and #rows > 0 then
      flush()
      out[#out + 1] = html_table(characters(lines[i]), rows, columns)
      i = after
    else
      plain[#plain + 1] = lines[i]
      i = i + 1
    end
  end
  flush()
  return table.concat(out, "\n")
end

local function has_table(words)
  for line in words:gmatch "[^\n]+" do
    if is_rule(line) then return true end
  end
  return false
end

-- ── mathematics ────────────────────────────────────────────────────────────────────────────────────────────

-- The LaTeX of a value, or nil where its text is the better one.
local function latex_of(value)
  local good, latex = pcall(function() return value:latex() end)
  if good and type(latex) == "string" and #latex <= longest_formula then return latex end
end

-- The line that says what it is, the formula, and what follows the formula in print.
local function headed(value, latex, rest)
  local head = tostring(value):match "^[^\n]*"
  return '<p class="caption">' .. text.escaped(head) .. "</p>" .. mathml.formula(latex, true) .. (rest or "")
end

local function pairs_table(lines)
  local out = {}
  for _, line in ipairs(lines) do
    local name, rest = line:match "^%s*(.-)%s%s+(.*)$"
    if not name then
      out[#out + 1] = '<tr><td colspan="2">' .. text.escaped(line) .. "</td></tr>"
    else
      out[#out + 1] = ("<tr><th>%s</th><td>%s</td></tr>"):format(text.escaped(name), text.escaped(rest))
    end
  end
  if #out == 0 then return "" end
  return '<table class="facts">' .. table.concat(out) .. "</table>"
end

-- A model: its class, its equations as mathematics, the lists of its variables.
local function model(value, latex)
  local before, after, equations = {}, {}, false
  for _, line in ipairs(lines_of(tostring(value))) do
    if line:find "^  %(%d" then
      equations = true
    elseif not equations then
      before[#before + 1] = text.escaped(line)
    elseif line:find "^  %S" then
      after[#after + 1] = line
    end
  end
  return '<p class="caption">' .. table.concat(before, "<br>") .. "</p>" .. mathml.formula(latex, true)
    .. pairs_table(after)
end

-- The text of a matrix of numbers, or nil where it holds expressions.
local function numeric(value)
  local words = tostring(value)
  for word in words:gsub("\n%(%d+×%d+ numbers%)$", ""):gmatch "%S+" do
    if not tonumber(word) and word ~= "nan" and word ~= "inf" and word ~= "-inf" and word ~= "…" then
      return nil
    end
  end
  return words
end

local function number_table(words)
  local rows = {}
  for _, line in ipairs(lines_of(words)) do rows[#rows + 1] = characters(line) end
  local columns = columns_of(rows)
  if #rows > most_lines or #columns == 0 or words:find("\n(", 1, true) then return M.text_block(words) end
  return html_table(nil, rows, columns)
end

local kinds = {}
function kinds.expr(_, latex) return mathml.formula(latex, "large"), "inline" end
kinds.equation = kinds.expr
function kinds.matrix(value, latex)
  local words = numeric(value)
  if words then return number_table(words), "block" end
  return mathml.formula(latex, "large"), "inline"
end
function kinds.model(value, latex) return model(value, latex), "block" end
function kinds.tableau(value, latex) return headed(value, latex), "block" end
kinds.lti = kinds.tableau
function kinds.predictor(value, latex)
  local rest = tostring(value):match "\n(.*)$"
  return mathml.formula(latex, true) .. (rest and M.text_block(rest) or ""), "block"
end
function kinds.trace(value, latex) return mathml.lines(latex), "block" end
-- Each condition with the equation it came from, which print says.
function kinds.constraints(value)
  local out = {}
  for i, line in ipairs(lines_of(tostring(value))) do
    local name, rest = line:match "^(.-):%s+(.*)$"
    if not name or i > #value then return nil end
    local from = rest:match "%s%s+(.*)$"
    out[i] = ("%s:\\quad $%s$%s"):format(name, value[i]:latex(), from and "\\quad " .. from or "")
  end
  return mathml.lines(table.concat(out, "\\\\\n")), "block"
end

-- A report: words with formulas, indented as print does.
function kinds.pencil(_, latex)
  latex = latex:gsub("\\noindent%s*", "")
    :gsub("\\hspace%*{(%d+)em}", function(n) return ("\\quad "):rep(n) end)
  return mathml.lines((latex:gsub("\n%s*\n", "\\\\\n"))), "block"
end
kinds.structure, kinds.roots = kinds.pencil, kinds.pencil
function kinds.matrix_form(_, latex) return mathml.formula(latex, true), "block" end

-- HTML of a value and how it stands: "inline", "block"; or nil where print's text is all there is to show.
function M.html(value)
  local kind = object_type(value)
  if kind and kinds[kind] then
    if kind == "matrix" and numeric(value) then return kinds.matrix(value) end
    local latex = latex_of(value)
    if latex then return kinds[kind](value, latex) end
  end
  if kind and kind ~= "expr" and kind ~= "matrix" then
    local words = shown(value)
    if has_table(words) then return with_tables(words), "block" end
  end
  return nil
end

return M
