-- Markdown: headings, paragraphs, lists, tables, quotations, code, emphasis, links, formulas between
-- dollars. HTML in it is text, except <a id="name">, which makes an anchor.
local text, mathml, code = document.text, document.mathml, document.code
local M = {}

-- ── within a line ──────────────────────────────────────────────────────────────────────────────────────────

local inline

local function delimited(line, at, mark, name)
  local first, last = line:find(mark, at + #mark, true)
  if not first or line:sub(at + #mark, at + #mark):find "%s" or first == at + #mark then return nil end
  return last, function(options)
    return ("<%s>%s</%s>"):format(name, inline(line:sub(at + #mark, first - 1), options), name)
  end
end

local function code_span(line, at)
  local ticks = line:match("^`+", at)
  local first, last = line:find(ticks, at + #ticks, true)
  if not first then return nil end
  local inside = line:sub(at + #ticks, first - 1)
  if #ticks > 1 then inside = inside:gsub("^ (.-) $", "%1") end
  return last, function() return "<code>" .. text.escaped(inside) .. "</code>" end
end

local function link(line, at)
  local label, target, last = line:match("^(%b[])(%b())()", at)
  if not label then return nil end
  return last - 1, function(options)
    local place = target:sub(2, -2):gsub('%s+".*"$', "")
    if options.link then place = options.link(place) end
    if not place then return inline(label:sub(2, -2), options) end
    return ('<a href="%s">%s</a>'):format(text.safe_link(place), inline(label:sub(2, -2), options))
  end
end

-- $x$: not a price, so the dollars touch the formula and no digit follows.
local function formula(line, at)
  local inside, last = line:match("^%$%$(.-)%$%$()", at)
  if inside and inside:find "%S" then return last - 1, function() return mathml.formula(inside, true) end end
  inside, last = line:match("^%$([^%s$][^$]*)%$()", at)
  if not inside or inside:find "%s$" or line:find("^%d", last) then return nil end
  return last - 1, function() return mathml.formula(inside) end
end

local function anchor(line, at)
  local id, last = line:match('^<a%s+id="([%w_-]+)"%s*></a>()', at)
  if not id then id, last = line:match('^<a%s+name="([%w_-]+)"%s*></a>()', at) end
  if not id then return nil end
  return last - 1, function() return ('<a id="%s"></a>'):format(id) end
end

local function bare_link(line, at)
  local target = line:match("^<(https?://[^%s<>]+)>", at)
  if not target then return nil end
  return at + #target + 1, function()
    return ('<a href="%s">%s</a>'):format(text.safe_link(target), text.escaped(target))
  end
end

local function emphasis(line, at)
  if line:sub(at, at + 1) == "**" then return delimited(line, at, "**", "strong") end
  return delimited(line, at, "*", "em")
end

local function underscored(line, at)
  if line:find("^[%w_]", at - 1) and at > 1 then return nil end
  local last, html = delimited(line, at, "_", "em")
  if last and line:find("^%w", last + 1) then return nil end
  return last, html
end

local function escape(line, at)
  local mark = line:match("^\\(%p)", at)
  if mark then return at + 1, function() return text.escaped(mark) end end
end

local readers = { ["`"] = { code_span }, ["["] = { link }, ["$"] = { formula }, ["<"] = { anchor, bare_link },
  ["*"] = { emphasis }, ["_"] = { underscored }, ["\\"] = { escape } }

function inline(line, options)
  local out, at = {}, 1
  while at <= #line do
    local special = line:find("[`%[%$<%*_\\]", at)
    out[#out + 1] = text.escaped(line:sub(at, (special or 0) - 1))
    if not special then break end
    local last, html
    for _, reader in ipairs(readers[line:sub(special, special)]) do
      if not last then last, html = reader(line, special) end
    end
    out[#out + 1] = last and html(options) or text.escaped(line:sub(special, special))
    at = (last or special) + 1
  end
  return table.concat(out)
end

function M.inline(line, options) return inline(text.valid(line), options or {}) end

-- ── blocks ─────────────────────────────────────────────────────────────────────────────────────────────────

-- The anchor of a heading: "Words and more" -> "words-and-more".
function M.anchor(title)
  local plain = title:gsub("`", ""):gsub("%[(.-)%]%b()", "%1"):gsub("%*", "")
  return (plain:lower():gsub("[^%w%-_ \128-\255]", ""):gsub(" ", "-"))
end

local function heading(lines, i, out, options)
  local marks, title = lines[i]:match "^(#+)%s+(.-)%s*#*$"
  if not marks or #marks > 6 then return nil end
  local level = #marks + (options.deeper or 0)
  if options.heading then options.heading(level, title, M.anchor(title)) end
  out[#out + 1] = ('<h%d id="%s">%s</h%d>'):format(math.min(level, 6), text.escaped(M.anchor(title)),
    inline(title, options), math.min(level, 6))
  return i + 1
end

local function fenced(lines, i, out, options)
  local mark, language = lines[i]:match "^%s*(```+)%s*(%S*)"
  if not mark then return nil end
  local body = {}
  i = i + 1
  while lines[i] and not lines[i]:find("^%s*" .. mark) do
    body[#body + 1] = lines[i]
    i = i + 1
  end
  local source = table.concat(body, "\n")
  local html = options.code and options.code(language, source)
  if not html and language == "math" then html = mathml.formula(source, true) end
  local inside = language == "lua" and code.highlighted(source) or text.escaped(source)
  out[#out + 1] = html or '<pre class="code" tabindex="0"><code>' .. inside .. "</code></pre>"
  return i + 1
end

local function rule(lines, i, out)
  if not lines[i]:find "^%s*%-%-%-+%s*$" and not lines[i]:find "^%s*%*%*%*+%s*$" then return nil end
  out[#out + 1] = "<hr>"
  return i + 1
end

-- Cells between bars; a bar in code or behind a backslash is none.
local function cells_of(line)
  line = line:gsub("^%s*|", ""):gsub("|%s*$", "")
  local cells, cell, in_code = {}, "", false
  for c in line:gmatch "\\?." do
    if c == "`" then in_code = not in_code end
    if c == "|" and not in_code then
      cells[#cells + 1], cell = cell, ""
    else
      cell = cell .. (c == "\\|" and "|" or c)
    end
  end
  cells[#cells + 1] = cell
  return cells
end

local function table_row(cells, name, options)
  local out = {}
  for _, cell in ipairs(cells) do
    cell = cell:match "^%s*(.-)%s*$"
    local tag = cell == "" and "td" or name            -- an empty title says nothing about its column
    out[#out + 1] = ("<%s>%s</%s>"):format(tag, inline(cell, options), tag)
  end
  return "<tr>" .. table.concat(out) .. "</tr>"
end

local function bars(lines, i, out, options)
  local below = lines[i + 1]
  if not lines[i]:find("|", 1, true) or not below or not below:find "^%s*|?[%s:|-]*%-%-%-[%s:|-]*$" then
    return nil
  end
  out[#out + 1] = '<div class="wide" tabindex="0"><table><thead>'
    .. table_row(cells_of(lines[i]), "th", options)
    .. "</thead><tbody>"
  i = i + 2
  while lines[i] and lines[i]:find("|", 1, true) do
    out[#out + 1] = table_row(cells_of(lines[i]), "td", options)
    i = i + 1
  end
  out[#out + 1] = "</tbody></table></div>"
  return i
end

local blocks

local function quotation(lines, i, out, options)
  if not lines[i]:find "^%s*>" then return nil end
  local inside = {}
  while lines[i] and lines[i]:find "^%s*>" do
    inside[#inside + 1] = lines[i]:gsub("^%s*> ?", "")
    i = i + 1
  end
  out[#out + 1] = "<blockquote>" .. blocks(inside, options) .. "</blockquote>"
  return i
end

local function item_mark(line)
  local indent, mark = line:match "^(%s*)([-*+])%s+%S"
  if mark then return #indent, #line:match "^%s*[-*+]%s+", "ul" end
  indent, mark = line:match "^(%s*)(%d+)[.)]%s+%S"
  if mark then return #indent, #line:match "^%s*%d+[.)]%s+", "ol" end
end

-- An item is its first line and what is indented below it; its text is set as blocks of their own.
local function list(lines, i, out, options)
  local indent, _, name = item_mark(lines[i])
  if not indent then return nil end
  out[#out + 1] = "<" .. name .. ">"
  while lines[i] do
    local depth, width, kind = item_mark(lines[i])
    if depth ~= indent or kind ~= name then break end
    local inside = { lines[i]:sub(width + 1) }
    i = i + 1
    while lines[i] do
      local own = #lines[i]:match "^%s*"
      local blank = not lines[i]:find "%S"
      local follows = lines[i + 1] and #lines[i + 1]:match "^%s*" > indent and lines[i + 1]:find "%S"
      if blank and not follows then break end
      if not blank and own <= indent then break end
      inside[#inside + 1] = lines[i]:sub(math.min(own, width) + 1)
      i = i + 1
    end
    local html = blocks(inside, options):gsub("^<p>(.-)</p>", "%1", 1)
    out[#out + 1] = "<li>" .. html .. "</li>"
    local after = i
    while lines[after] and not lines[after]:find "%S" do after = after + 1 end
    if lines[after] and item_mark(lines[after]) == indent then i = after end
  end
  out[#out + 1] = "</" .. name .. ">"
  return i
end

local function displayed(lines, i, out)
  if not lines[i]:find "^%s*%$%$%s*$" then return nil end
  local inside = {}
  i = i + 1
  while lines[i] and not lines[i]:find "^%s*%$%$%s*$" do
    inside[#inside + 1] = lines[i]
    i = i + 1
  end
  out[#out + 1] = mathml.formula(table.concat(inside, "\n"), true)
  return i + 1
end

-- Lines that are indented by four blanks stand as they are.
local function indented(lines, i, out)
  if not lines[i]:find "^    %s*%S" then return nil end
  local inside, last = {}, i
  while lines[i] and (lines[i]:find "^    " or not lines[i]:find "%S") do
    inside[#inside + 1] = lines[i]:sub(5)
    if lines[i]:find "%S" then last = i end
    i = i + 1
  end
  out[#out + 1] = '<pre class="code" tabindex="0"><code>'
    .. text.escaped(table.concat(inside, "\n", 1, #inside - (i - 1 - last))) .. "</code></pre>"
  return last + 1
end

local kinds = { heading, fenced, displayed, rule, bars, quotation, list, indented }

local function paragraph(lines, i, out, options)
  local words = {}
  while lines[i] and lines[i]:find "%S" do
    if #words > 0 and (lines[i]:find "^#+%s" or lines[i]:find "^%s*```" or item_mark(lines[i])) then break end
    words[#words + 1] = lines[i]:match "^%s*(.-)%s*$"
    i = i + 1
  end
  out[#out + 1] = "<p>" .. inline(table.concat(words, "\n"), options) .. "</p>"
  return i
end

function blocks(lines, options)
  local out, i = {}, 1
  while lines[i] do
    local after
    if not lines[i]:find "%S" then after = i + 1 end
    for _, kind in ipairs(kinds) do after = after or kind(lines, i, out, options) end
    i = after or paragraph(lines, i, out, options)
  end
  return table.concat(out, "\n")
end

-- HTML of a text. options: link(target) -> target, or nil for words without a link; code(language, source) ->
-- HTML or nil; heading(level, title, id); deeper = levels that are added to headings.
function M.html(source, options)
  local lines = {}
  for line in (text.valid(source) .. "\n"):gmatch "(.-)\n" do lines[#lines + 1] = line end
  return blocks(lines, options or {})
end

return M
