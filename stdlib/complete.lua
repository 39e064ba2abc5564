-- What may stand at the cursor inside a call: options, their values, names for help, variables of a model.
-- The prompt asks (src/shell/complete.cpp) with
--
--   { name = "newton" or "sys", method = "integrate" or "", object = what stands before the colon or the
--     first argument, argument = 1, in_table =, at_key =, key = the option whose value is meant,
--     tables = keys of the tables around, in_string =, word = what is typed so far }
--
-- and gets a list of words, empty where anything may stand.

-- Functions whose text argument is a name of the vocabulary.
local names_of = { help = true, examples = true, explain = true, apropos = true }

local function row_of(name)
  for _, row in ipairs(rows()) do
    if row.name == name then return row end
  end
  for _, row in ipairs(documented) do
    if row.name == name then return row end
  end
end

local function methods()
  local words = { "auto" }
  for _, row in ipairs(rows()) do
    local name = row.name:match "^=rk%.(.+)$"
    if name then words[#words + 1] = name end
  end
  for _, row in ipairs(documented) do
    local name = row.name:match "^rk%.(.+)$"
    if name and not rawget(row, "value") then words[#words + 1] = name end
  end
  for _, family in ipairs(method_families()) do
    if family.listed then words[#words + 1] = family.name end
  end
  return words
end

-- The names of symbols, columns by their own: { q1, q2 } is q.
local function names_in(columns)
  local words, seen = {}, {}
  for _, column in ipairs(columns) do
    for i = 1, #column do
      local name = tostring(column[i])
      if name:find "^[%a_][%w_]*$" and not seen[name] then
        seen[name] = true
        words[#words + 1] = name
      end
    end
  end
  return words
end

local function model_of(object)
  local kind = object_type(object)
  if kind == "model" then return object end
  if kind == "solution" or kind == "start" then return object.model end
end

-- Global variables of the session that hold expressions or columns, and names of the model's own variables.
local function expressions(object)
  local words, seen = {}, {}
  local model = model_of(object)
  local known = model
    and names_in { model.differential, model.algebraic, model.parameters, model.inputs } or {}
  for _, name in ipairs(known) do
    if rawget(_G, name) ~= nil then
      seen[name] = true
      words[#words + 1] = name
    end
  end
  for name, value in pairs(_G) do
    local kind = type(name) == "string" and not seen[name] and named(name) == nil and object_type(value)
    if kind == "expr" or kind == "matrix" then words[#words + 1] = name end
  end
  return words
end

local sources = {
  methods = methods,
  variables = function(object)
    local model = model_of(object)
    return model and names_in { model.differential, model.algebraic } or {}
  end,
  parameters = function(object)
    local model = model_of(object)
    return model and names_in { model.parameters } or {}
  end,
  inputs = function(object)
    local model = model_of(object)
    return model and names_in { model.inputs } or {}
  end,
}

local function split(values)
  local words = {}
  for word in values:gmatch "[^|]+" do words[#words + 1] = word end
  return words
end

local function values_of(option, object)
  local source = option.values:match "^@(.+)$"
  if source then return sources[source](object) end
  return split(option.values)
end

local function option_named(options, name)
  for _, option in ipairs(options or {}) do
    if option.name == name then return option end
  end
end

local function all_names()
  local words = {}
  local function add(row)
    local name = row.name:gsub("^=", "")
    if not name:find ":__" then
      words[#words + 1] = name
      local member = name:match "[:#](.+)$"
      if member then words[#words + 1] = member end
    end
  end
  for _, row in ipairs(rows()) do add(row) end
  for _, row in ipairs(documented) do add(row) end
  for _, page in ipairs(rawget(_ENV, "concepts") or include "concepts/init") do add(page) end
  return words
end

local function option_names(options)
  local words = {}
  for _, option in ipairs(options) do
    if not option.name:find "^%d" then words[#words + 1] = option.name end
  end
  return words
end

-- Inside a string only texts are offered, elsewhere values of options in quotes.
local function values_at(option, request)
  if option == nil then return {} end
  local words = values_of(option, request.object)
  if request.in_string then return words end
  if option.type == "boolean" then return { "true", "false" } end
  if option.values:sub(1, 1) == "@" and option.values ~= "@methods" then return {} end
  local quoted = {}
  for i, word in ipairs(words) do quoted[i] = '"' .. word .. '"' end
  return quoted
end

local function candidates(request)
  local kind = request.method ~= "" and object_type(request.object)
  local row = row_of(kind and (kind .. ":" .. request.method) or request.name)
  if request.method == "" and request.in_string and names_of[request.name] then return all_names() end
  local options = row and row.options
  local depth = #request.tables
  if not request.in_table then
    return values_at(option_named(options, tostring(request.argument)), request)
  end
  if depth == 1 and request.at_key and not request.in_string then
    local along = request.tables[1] == "" and object_type(request.object) == "solution"
    if along and request.argument == 2 then return expressions(request.object) end
    return options and option_names(options) or {}
  end
  if depth == 1 then return values_at(option_named(options, request.key), request) end
  -- start = { x, fix = { x: the symbols of the model
  local option = option_named(options, request.tables[2])
  if option and request.at_key and option.values:sub(1, 1) == "@" and not request.in_string then
    return values_of(option, request.object)
  end
  return {}
end

return function(request)
  local found, seen = {}, {}
  for _, word in ipairs(candidates(request)) do
    if word:sub(1, #request.word) == request.word and not seen[word] then
      seen[word] = true
      found[#found + 1] = word
    end
  end
  table.sort(found)
  return found
end
