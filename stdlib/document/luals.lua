-- The vocabulary as a definition file for the Lua language server (LuaCATS annotations), made of the rows
-- of the documentation: with it editors complete names and forms, show help, and notice what does not
-- exist.

-- ── types ──────────────────────────────────────────────────────────────────────────────────────────────────

-- Words of signatures that are no names of types. Whoever takes a column takes a list.
local words = {
  number = "number", scalar = "expr|number", integer = "integer", boolean = "boolean", string = "string",
  text = "string", strings = "string[]", list = "table", table = "table", row = "matrix", column = "matrix",
  vector = "matrix", expression = "expr|number", symbol = "expr", ["function"] = "function", value = "any",
  seconds = "number", G = "lti", ["nil"] = "nil", ["list of strings"] = "string[]",
  ["list of columns"] = "matrix[]", ["list of numbers"] = "number[]",
}

local function class_name(type_name) return (type_name:gsub("[^%w_]", "_")) end

-- "column or nil" -> "matrix|nil"; what says nothing about types is any.
local function type_of(phrase, known)
  local parts = {}
  for part in (phrase:gsub(", or ", " or ") .. " or "):gmatch "%s*(.-)%s* or " do
    local name = words[part] or (known[part] and class_name(part))
    if not name then return "any" end
    parts[#parts + 1] = name
  end
  return table.concat(parts, "|")
end

-- ── signatures ─────────────────────────────────────────────────────────────────────────────────────────────

-- Cuts at commas outside of brackets and quotes.
local function split(list)
  local parts, depth, from, quote = {}, 0, 1, nil
  for at, c in list:gmatch "()([%[%](){}\",])" do
    if c == '"' then quote = not quote
    elseif quote then depth = depth
    elseif c:find "[%[({]" then depth = depth + 1
    elseif c:find "[%])}]" then depth = depth - 1
    elseif c == "," and depth == 0 then
      parts[#parts + 1] = list:sub(from, at - 1)
      from = at + 1
    end
  end
  if list:sub(from):find "%S" then parts[#parts + 1] = list:sub(from) end
  return parts
end

local reserved = {}
for word in ([[and break do else elseif end false for function goto if in local nil not or repeat return then
    true until while]]):gmatch "%a+" do
  reserved[word] = true
end

-- One parameter as written: its name, and whether it may be left out.
local function parameter(word, number, optional)
  word = word:match "^%s*(.-)%s*$"
  if word == "…" or word == "..." then return { name = "...", optional = false } end
  local name = word:match "^([%a_][%w_]*)"
  if word:find "^[{]" then name = "options" elseif word:find '^"' then name = "name" end
  -- one of several ways to call it
  optional = optional or word:find '^[{"]' ~= nil or word:find " or " ~= nil
  name = name or "argument" .. number
  if reserved[name] then name = name .. "_" end
  return { name = name, optional = optional, written = word }
end

-- The text between the parentheses as a list of parameters; "x [, n]" has an optional n.
local function parameters(inside)
  local list, seen = {}, {}
  local optional = false
  local plain = inside:gsub("%s*%[%s*,", ", \1"):gsub("^%s*%[", "\1"):gsub("%]", "")
  for i, word in ipairs(split(plain)) do
    if word:find "\1" then optional = true end
    local one = parameter(word:gsub("\1", ""), i, optional)
    if seen[one.name] then one.name = one.name .. i end
    seen[one.name] = true
    list[#list + 1] = one
    if one.name == "..." then break end
  end
  return list
end

-- A signature: its parameters and what it returns. A call without parentheses, figure{ … }, takes one table.
local function signature(sig)
  sig = sig:gsub("%s+·.*$", "")
  local call, result = sig:match "^(.-)%s*%->%s*(.*)$"
  call = call or sig
  local inside = call:match "%((.*)%)"
  if inside then return parameters(inside), result end
  if call:find "{" then return { { name = "options", written = call:match "{.*" } }, result end
  if call:find '"' then return { { name = "name", written = '"' } }, result end
  return {}, result
end

-- ── writing ────────────────────────────────────────────────────────────────────────────────────────────────

local out

local function line(...) out[#out + 1] = table.concat { ... } end

local function comment(entry)
  for text_line in entry.text:gmatch "[^\n]+" do line("---", text_line) end
  if entry.example ~= "" then
    line "---```lua"
    for example in entry.example:gmatch "[^\n]+" do line("---", example) end
    line "---```"
  end
end

local choosing = { form = true, method = true, kind = true, name = true, property = true, norm = true }

-- The words in quotes that a text lists, for a parameter that chooses among them.
local function choices(entry, name)
  if not choosing[name] then return nil end
  local list, seen = {}, {}
  for word in entry.text:gmatch '"([%w_ -]+)"' do
    if not seen[word] then
      seen[word] = true
      list[#list + 1] = '"' .. word .. '"'
    end
  end
  return #list >= 2 and table.concat(list, "|") .. "|string" or nil
end

local function options_class(entry) return (entry.name:gsub("[^%w_]", "_")) .. "_options" end

local option_types = { number = "number", integer = "integer", boolean = "boolean", string = "string",
  list = "table", table = "table", expression = "expr|number", ["function"] = "function" }

-- "boolean or string" -> "boolean|string"; what is not known is any.
local function option_type(option)
  if option.values:find "^[^@]" and option.type ~= "boolean" then
    return '"' .. option.values:gsub("|", '"|"') .. '"|any'
  end
  local parts = {}
  for part in (option.type .. " or "):gmatch "(.-) or " do
    if not option_types[part] then return "any" end
    parts[#parts + 1] = option_types[part]
  end
  return table.concat(parts, "|")
end

-- The options of a function as a class of their own, so that editors complete their names.
local function write_options(entry)
  local rows = {}
  for _, option in ipairs(entry.options or {}) do
    if option.name:find "^[%a_][%w_]*$" then rows[#rows + 1] = option end
  end
  if #rows == 0 then return false end
  line("---@class ", options_class(entry))
  for _, option in ipairs(rows) do
    line("---@field ", option.name, "? ", option_type(option), " ", (option.text:gsub("%s+", " ")))
  end
  line ""
  return true
end

local function parameter_type(entry, one)
  if one.name == "options" and entry.has_options_class then return options_class(entry) end
  if one.name == "options" and one.written and one.written:find "^{" then return "table" end
  if one.written and one.written:find '^"' then return choices(entry, "name") or "string" end
  return choices(entry, one.name) or "any"
end

local function write_function(entry, name, known)
  entry.has_options_class = write_options(entry)
  comment(entry)
  local list, result = signature(entry.sig)
  local names = {}
  for _, one in ipairs(list) do
    local optional = one.optional and one.name ~= "..." and "?" or ""
    line("---@param ", one.name, optional, " ", parameter_type(entry, one))
    names[#names + 1] = one.name
  end
  if result and result ~= "" then
    for _, part in ipairs(split((result:gsub(", or ", " or ")))) do
      line("---@return ", type_of(part:match "^%s*(.-)%s*$", known))
    end
  end
  line("function ", name, "(", table.concat(names, ", "), ") end")
  line ""
end

-- The type of a value: one of ours, or Lua's.
local function value_type(value)
  local kind = object_type(value)
  return kind and class_name(kind) or math.type(value) or type(value)
end

local operators = { __add = "add", __sub = "sub", __mul = "mul", __div = "div", __pow = "pow", __unm = "unm",
  __concat = "concat", __len = "len", __call = "call", __bnot = "bnot", __bxor = "bxor" }
local unary = { unm = true, len = true, bnot = true }
local closed = { expr = true, matrix = true, complex = true, lti = true }  -- arithmetic stays in the type

-- The entries that are names of the language; pages about words are none.
local function documented_names()
  local list = {}
  for _, entry in ipairs(entries()) do
    if not entry.is_concept then list[#list + 1] = entry end
  end
  return list
end

local function operator_result(type_name, operator)
  if operator == "len" then return "integer" end
  if operator == "concat" then return "string" end
  if operator == "bxor" then return "equation" end
  return closed[type_name] and type_name or "any"
end

local function write_class(type_name, known)
  line("---@class ", class_name(type_name))
  local methods = {}
  for _, entry in ipairs(documented_names()) do
    if entry.owner == type_name and entry.separator == "#" then
      local result = entry.sig:match "%->%s*(.-)%s*$"
      line("---@field ", entry.member, " ", result and type_of(result, known) or "any", " ",
        (entry.text:gsub("%s+", " ")))
    elseif entry.owner == type_name and entry.separator == ":" then
      local operator = operators[entry.member]
      if operator == "call" then
        line "---@overload fun(...): any"
      elseif operator then
        line("---@operator ", operator, unary[operator] and "" or "(any)", ": ",
          operator_result(type_name, operator))
      elseif entry.member:sub(1, 2) ~= "__" then
        methods[#methods + 1] = entry
      end
    end
  end
  local local_name = class_name(type_name)
  line("local ", local_name, " = {}")
  line ""
  for _, entry in ipairs(methods) do write_function(entry, local_name .. ":" .. entry.member, known) end
end

-- Libraries (rk, dae) and whether they can be called.
local function libraries()
  local list, callable = {}, {}
  for _, entry in ipairs(documented_names()) do
    if entry.separator == "." and not list[entry.owner] then
      list[entry.owner] = true
      list[#list + 1] = entry.owner
    end
  end
  for _, entry in ipairs(documented_names()) do
    if entry.separator == "" and list[entry.name] then callable[entry.name] = entry end
  end
  return list, callable
end

local function write_libraries(known)
  local list, callable = libraries()
  for _, name in ipairs(list) do
    if callable[name] then comment(callable[name]) end
    line("---@class ", name, "_library")
    if callable[name] then
      local _, result = signature(callable[name].sig)
      line("---@overload fun(...): ", result and type_of(result, known) or "any")
    end
    line(name, " = {}")
    line ""
  end
  return callable
end

local function write_entry(entry, known)
  local value = entry.value
  if type(value) == "function" or entry.sig:find "%(" and not entry.is_value then
    return write_function(entry, entry.name, known)
  end
  comment(entry)
  line("---@type ", value_type(value))
  line(entry.name, " = nil")
  line ""
end

return function()
  out = { "---@meta pendula",
    "-- The vocabulary of Pendula for the Lua language server. Made by: pendula manual "
    .. "--luals", "-- luacheck: ignore", "" }
  local known = {}
  for _, type_name in ipairs(types()) do known[type_name] = true end
  for _, type_name in ipairs(types()) do write_class(type_name, known) end
  local callable = write_libraries(known)
  for _, entry in ipairs(documented_names()) do
    local is_entry = entry.separator == "." or (entry.separator == "" and not callable[entry.name])
    if is_entry then write_entry(entry, known) end
  end
  return table.concat(out, "\n") .. "\n"
end
