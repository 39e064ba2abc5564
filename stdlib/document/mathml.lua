-- Mathematics in HTML: LaTeX as our printers and people write it, as native MathML, which browsers set
-- without a script. What it does not know it shows as it stands; it never fails.
local text = document.text
local M = {}

local deepest = 100                                  -- braces within braces

local signs_of = document.mathml_signs
local greek, operators, identifiers, functions = signs_of.greek, signs_of.operators, signs_of.identifiers,
  signs_of.functions
local large, integrals, accents = signs_of.large, signs_of.integrals, signs_of.accents
local spaces, sized, alphabets, in_alphabet = signs_of.spaces, signs_of.sized, signs_of.alphabets,
  signs_of.in_alphabet

-- ── reading ────────────────────────────────────────────────────────────────────────────────────────────────

-- Tokens: "\name", "\{" …, single characters; blanks only where they end a command.
local function tokens_of(latex)
  local list = {}
  local at = 1
  while at <= #latex do
    local token = latex:match("^\\%a+", at) or latex:match("^\\.", at) or latex:match("^%d+%.?%d*", at)
      or latex:match("^'+", at) or latex:match("^[%z\1-\127\194-\244][\128-\191]*", at) or latex:sub(at, at)
    if not token:find "^%s" then list[#list + 1] = { token = token, first = at, last = at + #token - 1 } end
    at = at + #token
    local distance = token == "\\\\" and latex:match("^%[[%d.]+ex%]", at)         -- of rows, \\[1ex]
    if distance then at = at + #distance end
  end
  return list
end

local Reader = {}
Reader.__index = Reader

function Reader:peek() return self.tokens[self.at] and self.tokens[self.at].token end

function Reader:next()
  local token = self:peek()
  self.at = self.at + 1
  return token
end

-- What stands between braces, as it was written; for words and names.
function Reader:raw()
  if self:peek() ~= "{" then return self:next() or "" end
  local first, depth = self.tokens[self.at].last + 1, 0
  local last = #self.latex
  repeat
    local token = self.tokens[self.at]
    if not token then break end
    if token.token == "{" then depth = depth + 1 end
    if token.token == "}" then depth = depth - 1 end
    last = token.first - 1
    self.at = self.at + 1
  until depth == 0
  return self.latex:sub(first, last)
end

-- ── writing ────────────────────────────────────────────────────────────────────────────────────────────────

local function tag(name, inside, attributes)
  return "<" .. name .. (attributes and " " .. attributes or "") .. ">" .. inside .. "</" .. name .. ">"
end

local function mo(sign, attributes) return tag("mo", text.escaped(sign), attributes) end
local function mi(name, attributes) return tag("mi", text.escaped(name), attributes) end

local function row(nodes)
  if #nodes == 1 then return nodes[1] end
  return tag("mrow", table.concat(nodes))
end

local function words(latex)
  local plain = latex:gsub("\\([%%#_&$ {}])", "%1")
  return tag("mtext", (text.escaped(plain):gsub("^ ", "\u{A0}"):gsub(" $", "\u{A0}")))
end

-- One argument: a group in braces, or one atom; of a number without braces one digit, as in \frac12.
function Reader:argument()
  local number = self:peek()
  if number and number:find "^%d." then
    self.tokens[self.at] = { token = number:sub(2), first = self.tokens[self.at].first + 1,
      last = self.tokens[self.at].last }
    return tag("mn", number:sub(1, 1))
  end
  local node = self:atom()
  return node or "<mrow></mrow>"
end

function Reader:group(close)
  self.depth = self.depth + 1
  if self.depth > deepest then error("too deep", 0) end
  local nodes = self:nodes({ [close] = true })
  if self:peek() == close then self.at = self.at + 1 end
  self.depth = self.depth - 1
  return row(nodes)
end

local fences = { ["("] = "(", [")"] = ")", ["["] = "[", ["]"] = "]", ["|"] = "|", ["/"] = "/", ["<"] = "⟨",
  [">"] = "⟩", ["."] = "" }

function Reader:fence()
  local token = self:next() or "."
  return fences[token] or operators[token:sub(2)] or text.escaped(token)
end

local tall = { "<mfrac", "<mtable", "<msqrt", "<mroot", "<munder" }  -- what parentheses grow around

function Reader:left_right()
  local open = self:fence()
  self.depth = self.depth + 1
  if self.depth > deepest then error("too deep", 0) end
  local nodes = self:nodes { ["\\right"] = true }
  self.depth = self.depth - 1
  local close = ""
  if self:peek() == "\\right" then
    self.at = self.at + 1
    close = self:fence()
  end
  local inside = table.concat(nodes)
  local low = true
  for _, name in ipairs(tall) do low = low and not inside:find(name, 1, true) end
  local attributes = 'fence="true"' .. (low and ' stretchy="false"' or "")
  if open ~= "" then inside = mo(open, 'form="prefix" ' .. attributes) .. inside end
  if close ~= "" then inside = inside .. mo(close, 'form="postfix" ' .. attributes) end
  return tag("mrow", inside)
end

-- ── tables ─────────────────────────────────────────────────────────────────────────────────────────────────

local enclosed = { bmatrix = { "[", "]" }, smallmatrix = { "", "" }, pmatrix = { "(", ")" },
  vmatrix = { "|", "|" },
  Bmatrix = { "{", "}" },
  Vmatrix = { "‖", "‖" }, cases = { "{", "" } }
local aligned = { align = true, ["align*"] = true, aligned = true, eqnarray = true, split = true }
local rows_only = { equation = true, ["equation*"] = true, gather = true, ["gather*"] = true,
  gathered = true }

-- The cells of an environment up to its \end; what \tag and \hline said of each row.
function Reader:cells(name)
  local rows, cells, notes = {}, {}, { rules = {}, tags = {} }
  local closing = { ["&"] = true, ["\\\\"] = true, ["\\end"] = true }
  local ended = false
  while not ended do
    while self:peek() == "\\hline" do
      notes.rules[#rows + 1] = true
      self.at = self.at + 1
    end
    self.tag = nil
    cells[#cells + 1] = row(self:nodes(closing))
    notes.tags[#rows + 1] = notes.tags[#rows + 1] or self.tag
    local token = self:next()
    if token ~= "&" then
      if not (#cells == 1 and cells[1] == "<mrow></mrow>") then rows[#rows + 1] = cells end
      cells = {}
    end
    ended = token == nil or token == "\\end"
  end
  self:raw()                                         -- {name}
  self.tag = nil
  return rows, notes
end

-- "c|cc" -> alignments of the columns, and which have a line on their left.
local function columns_of(layout)
  local sides, lines, line = {}, {}, false
  for c in layout:gmatch "[lcr|]" do
    if c == "|" then
      line = true
    else
      sides[#sides + 1] = c == "l" and "left" or c == "r" and "right" or "center"
      lines[#sides], line = line, false
    end
  end
  return sides, lines
end

local function side_of(name, j, sides)
  if name == "cases" then return "left" end
  if aligned[name] then return j % 2 == 1 and "right" or "left" end
  return sides and sides[j] or "center"
end

function Reader:environment()
  local name = self:raw()
  self.depth = self.depth + 1
  if self.depth > deepest then error("too deep", 0) end
  local sides, lines
  if name == "array" then sides, lines = columns_of(self:raw()) end
  local rows, notes = self:cells(name)
  self.depth = self.depth - 1
  local out, tagged = {}, next(notes.tags) ~= nil
  for i, cells in ipairs(rows) do
    local list = {}
    for j, cell in ipairs(cells) do
      local side = side_of(name, j, sides)
      local classes = { side }
      if lines and lines[j] then classes[#classes + 1] = "line-left" end
      if notes.rules[i] then classes[#classes + 1] = "line-above" end
      list[#list + 1] = tag("mtd", cell, ('class="%s"'):format(table.concat(classes, " ")))
    end
    if tagged then
      local label = notes.tags[i]
      list[#list + 1] = tag("mtd", label and words("(" .. label .. ")") or "", 'class="tag"')
    end
    out[#out + 1] = tag("mtr", table.concat(list))
  end
  local display = aligned[name] or rows_only[name]
  local kind = aligned[name] and "aligned" or rows_only[name] and "gathered" or "grid"
  local grid = tag("mtable", table.concat(out), ('class="%s"%s'):format(kind,
    display and ' displaystyle="true"' or ""))
  local fence = enclosed[name]
  if not fence then return grid end
  local close = fence[2] ~= "" and mo(fence[2], 'form="postfix" fence="true"') or ""
  return tag("mrow", mo(fence[1], 'form="prefix" fence="true"') .. grid .. close)
end

-- ── atoms ──────────────────────────────────────────────────────────────────────────────────────────────────

local commands = {}

function commands.frac(r) return tag("mfrac", r:argument() .. r:argument()) end
commands.dfrac, commands.tfrac = commands.frac, commands.frac
function commands.binom(r)
  return tag("mrow", mo "(" .. tag("mfrac", r:argument() .. r:argument(), 'linethickness="0"') .. mo ")")
end
function commands.sqrt(r)
  if r:peek() ~= "[" then return tag("msqrt", r:argument()) end
  r.at = r.at + 1
  local index = r:group "]"
  return tag("mroot", r:argument() .. index)
end
function commands.left(r) return r:left_right() end
function commands.begin(r) return r:environment() end
function commands.text(r) return words(r:raw()) end
commands.textrm, commands.mbox, commands.textit = commands.text, commands.text, commands.text
function commands.mathrm(r) return mi(r:raw():gsub("\\_", "_"), 'mathvariant="normal"') end
commands.mathsf, commands.mathit = commands.mathrm, commands.mathrm
function commands.operatorname(r) return mi(r:raw(), 'mathvariant="normal"') end
function commands.tag(r)
  r.tag = r:raw()
  return ""
end
function commands.label(r)
  r:raw()
  return ""
end
for name, alphabet in pairs(alphabets) do
  commands[name] = function(r)
    local inside = r:raw():gsub("\\(%a+)%s*", greek)
    local bold = in_alphabet(text.valid(inside), alphabet)
    return tag(inside:find "^%d+$" and "mn" or "mi", text.escaped(bold))
  end
end

function Reader:command(name)
  if commands[name] then return commands[name](self) end
  if greek[name] then return mi(greek[name], name:find "^%u" and 'mathvariant="normal"' or nil) end
  if name == "top" then return mi("⊤") end
  if identifiers[name] then return mi(identifiers[name]) end
  if operators[name] then return mo(operators[name]) end
  if functions[name] then return mi(name) end
  if large[name] then
    local letters = large[name]:find "^%a"
    return letters and mo(large[name], 'movablelimits="true" form="prefix"') or mo(large[name])
  end
  if integrals[name] then return mo(integrals[name]) end
  if accents[name] then return tag("mover", self:argument() .. mo(accents[name]), 'accent="true"') end
  if name == "underline" then return tag("munder", self:argument() .. mo "_") end
  if spaces[name] then return ('<mspace width="%s"></mspace>'):format(spaces[name]) end
  if sized[name] then return "" end
  return tag("mtext", text.escaped("\\" .. name))
end

local signs = { ["-"] = "−", ["*"] = "∗" }

-- The next piece without its indices, or nil at the end.
function Reader:atom()
  local token = self:next()
  if not token then return nil end
  if token == "{" then return self:group "}" end
  if token:find "^\\" then return self:command(token:sub(2)), token:sub(2) end
  if token:find "^%d" then return tag("mn", token) end
  if token:find "^%a$" then return tag("mi", token) end
  if token:find "^'" then return mo(("′"):rep(#token)) end
  if #token > 1 then
    local code = utf8.len(token) == 1 and utf8.codepoint(token)
    if code and (code < 0x2190 or code > 0x2BFF) and code ~= 0x2032 then return mi(token) end
    return mo(token)
  end
  if token == "~" then return '<mspace width="0.33em"></mspace>' end
  if token == "/" then return mo("/", 'lspace="0" rspace="0"') end
  return mo(signs[token] or token, (token == "(" or token == ")" or token == "|") and 'stretchy="false"'
    or nil)
end

local thin = '<mspace width="0.17em"></mspace>'

-- Whether what follows a node is an operand: a sign there stands for itself, x = -y, a(-b).
local function awaits_operand(node)
  return node == nil or node:find "</mo>$" ~= nil and not node:find "[])|}]</mo>$"
end

-- The name of a function, with its scripts, behind the node before it and in front of `follower`.
local function applied(node, before, follower)
  if not awaits_operand(before) then node = thin .. node end
  local opens = follower == "(" or follower == "\\left" or follower == "[" or follower == "|"
  return node .. mo "\u{2061}" .. ((opens or not follower or not follower:find "[%w\\]") and "" or thin)
end

local primes = { "′", "″", "‴", "⁗" }

-- Sub- and superscripts behind an atom.
function Reader:scripts(base, name)
  local below, above
  while true do
    local token = self:peek()
    if token == "_" and not below then
      self.at = self.at + 1
      below = self:argument()
    elseif token == "^" and (not above or above.prime) then
      self.at = self.at + 1
      local raised = self:argument()
      above = { node = above and tag("mrow", above.node .. raised) or raised }
    elseif token and token:find "^'" and not above then
      self.at = self.at + 1
      above = { node = mo(primes[#token] or ("′"):rep(#token)), prime = true }
    else
      break
    end
  end
  above = above and above.node
  if not below and not above then return base end
  local limits = name and large[name]
  local under, over, both = "msub", "msup", "msubsup"
  if limits then under, over, both = "munder", "mover", "munderover" end
  if base == "" then base = "<mrow></mrow>" end
  if below and above then return tag(both, base .. below .. above) end
  return tag(below and under or over, base .. (below or above))
end

-- Atoms with their scripts until one of `closing` or the end.
function Reader:nodes(closing)
  local nodes = {}
  while true do
    local token = self:peek()
    if not token or closing[token] then return nodes end
    if token == "_" or token == "^" then
      nodes[#nodes + 1] = self:scripts("")
    elseif token == "}" or token == "&" or token == "\\\\" or token == "\\right" or token == "\\end" then
      self.at = self.at + 1                          -- closes what was never opened
      if token == "\\right" or token == "\\end" then self:raw() end
    else
      local leads = (token == "-" or token == "+") and awaits_operand(nodes[#nodes])
      local node, name = self:atom()
      if leads then node = node:gsub("^<mo>", '<mo form="prefix">') end
      node = self:scripts(node, name)
      if functions[name] or name == "operatorname" then node = applied(node, nodes[#nodes], self:peek()) end
      if node ~= "" then nodes[#nodes + 1] = node end
    end
  end
end

local displays = { [true] = 'display="block"', large = 'displaystyle="true"' }

-- The element math of a LaTeX formula: in a line; with `display` true on a line of its own; with "large" in a
-- line, but with fractions as large as on one of its own.
function M.formula(latex, display)
  latex = text.valid(latex)
  local good, nodes = pcall(function()
    local reader = setmetatable({ latex = latex, tokens = tokens_of(latex), at = 1, depth = 0 }, Reader)
    return reader:nodes({})
  end)
  if not good then return "<code>" .. text.escaped(latex) .. "</code>" end
  return tag("math", row(nodes), displays[display])
end

-- Names whose indices or primes alone are a formula, q$_{1}''$, belong into it.
local function with_names(line)
  return (line:gsub("(%a[%w]*)%$([_^'][^$]*)%$", function(name, indices)
    return "$" .. (#name > 1 and "\\mathrm{" .. name .. "}" or name) .. indices .. "$"
  end))
end

-- A line of words with formulas between dollars.
local function line_html(line)
  line = with_names(line)
  local html, at = {}, 1
  while true do
    local first, last, inside = line:find("%$(.-)%$", at)
    local plain = line:sub(at, (first or 0) - 1):gsub("\\quad%s*", "\u{2003}")
      :gsub("\\textquotesingle%s?", "'"):gsub("\\([%%#_&${}])", "%1")
    html[#html + 1] = text.escaped(plain)
    if not first then break end
    local formula, large = inside:gsub("^\\displaystyle%s*", "")
    html[#html + 1] = M.formula(formula, large > 0 and "large")
    at = last + 1
  end
  return '<p class="step">' .. table.concat(html) .. "</p>"
end

local function add_lines(latex, out)
  if not latex:find "%S" then return end
  latex = latex:gsub("\\\\%[1ex%]\n", "\\\\\n")              -- the distance below fractions in a line
  for line in (latex:gsub("\\\\%s*$", "") .. "\\\\\n"):gmatch "(.-)\\\\\n" do
    out[#out + 1] = line_html(line)
  end
end

-- A derivation: lines of words with formulas between dollars, and equations on lines of their own.
function M.lines(latex)
  local out, at = {}, 1
  while true do
    local first, last, inside = latex:find("\\begin{equation%*}%s*(.-)%s*\\end{equation%*}", at)
    add_lines(latex:sub(at, (first or 0) - 1), out)
    if not first then return table.concat(out, "\n") end
    local numbered = inside:find("\\tag{", 1, true)
    out[#out + 1] = M.formula(numbered and latex:sub(first, last) or inside, true)
    at = last + 1
  end
end

return M
