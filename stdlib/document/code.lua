-- Lua source in documents: coloured, and cut into the statements of its outermost level.
local text = document.text
local M = {}

local classes = { keyword = "k", string = "s", number = "n", unfinished = "c" }

-- HTML of a piece of source. Comments are what stands between the tokens.
function M.highlighted(source)
  source = text.valid(source)
  local out, at = {}, 1
  local function gap(upto)
    local between = source:sub(at, upto)
    local blanks, comment, rest = between:match "^(%s*)(.-)(%s*)$"
    out[#out + 1] = blanks
    if comment ~= "" then out[#out + 1] = '<span class="c">' .. text.escaped(comment) .. "</span>" end
    out[#out + 1] = rest
  end
  for _, token in ipairs(lua_tokens(source)) do
    gap(token.first - 1)
    local word, class = text.escaped(source:sub(token.first, token.last)), classes[token.kind]
    out[#out + 1] = class and ('<span class="%s">%s</span>'):format(class, word) or word
    at = token.last + 1
  end
  gap(#source)
  return table.concat(out)
end

-- ── statements ─────────────────────────────────────────────────────────────────────────────────────────────

local opens = { ["function"] = 1, ["if"] = 1, ["for"] = 1, ["while"] = 1, ["repeat"] = 1, ["do"] = 1,
  ["end"] = -1, ["until"] = -1, ["("] = 1, ["["] = 1, ["{"] = 1, [")"] = -1, ["]"] = -1, ["}"] = -1 }
local starts = {}
for word in ("break do for function goto if local repeat return while ::"):gmatch "%S+" do
  starts[word] = true
end
for word in ("# not nil true false"):gmatch "%S+" do starts[word] = true end       -- an expression at the end
local ends = {}
for word in ("end nil true false ... ) ] }"):gmatch "%S+" do ends[word] = true end

-- Does a statement begin at a token behind `last`? Two words of which the first ends an expression and the
-- second begins one or a statement are never one statement (Lua 5.4 Reference Manual §3.3).
local function begins(last, word, kind)
  if not last then return true end
  if last.word == ";" then return word ~= ";" end
  local ended = last.kind == "name" or last.kind == "number" or last.kind == "string" or ends[last.word]
    or last.word == "break" or last.label
  local starting = kind == "name" or kind == "number" or starts[word] or (last.label and word == "(")
  return ended and starting or false
end

-- { first, last }, the bytes of each statement of the outermost level.
function M.statements(source)
  local depth, loops, last, list, labels = 0, {}, nil, {}, 0
  for _, token in ipairs(lua_tokens(source)) do
    local word = source:sub(token.first, token.last)
    local kind = token.kind
    if kind == "string" or kind == "number" then word = "" end
    if depth == 0 and begins(last, word, kind) then list[#list + 1] = { first = token.first } end
    if #list > 0 then list[#list].last = token.last end
    local step = kind ~= "string" and opens[word] or 0
    if word == "for" or word == "while" then loops[depth + 1] = true end
    if word == "do" and loops[depth] then step, loops[depth] = 0, nil end
    depth = math.max(depth + step, 0)
    if word == "::" then labels = labels + 1 end
    last = { word = word, kind = kind, label = word == "::" and labels % 2 == 0 }
  end
  return list
end

-- The source with a call in front of every statement, on the same line, or nil where that would not be the
-- same program: `call` gets the number of the statement.
function M.marked(source, call, statements)
  if source:find "%f[%w_]_ENV%f[^%w_]" then return nil end
  local parts, at = {}, 1
  for i, statement in ipairs(statements) do
    parts[#parts + 1] = source:sub(at, statement.first - 1)
    parts[#parts + 1] = ("%s(%d) "):format(call, i)
    at = statement.first
  end
  parts[#parts + 1] = source:sub(at)
  return table.concat(parts)
end

return M
