-- json(value): results for other programs.

local encode

local function number_text(value)
  if value ~= value or value == math.huge or value == -math.huge then return "null" end
  return math.type(value) == "integer" and tostring(value) or ("%.17g"):format(value)
end

local escapes = { ['"'] = '\\"', ["\\"] = "\\\\", ["\n"] = "\\n", ["\r"] = "\\r", ["\t"] = "\\t" }

local function string_text(value)
  return '"' .. value:gsub('[%c"\\]', function(c)
    return escapes[c] or ("\\u%04x"):format(c:byte())
  end) .. '"'
end

local function list_text(values)
  local parts = {}
  for i, value in ipairs(values) do parts[i] = encode(value) end
  return "[" .. table.concat(parts, ", ") .. "]"
end

-- Pairs { name, value } in their order.
local function object_text(items)
  local parts = {}
  for i, item in ipairs(items) do parts[i] = string_text(item[1]) .. ": " .. encode(item[2]) end
  return "{" .. table.concat(parts, ", ") .. "}"
end

local function entries_of(column)
  local list = {}
  for i = 1, column.rows*column.cols do list[i] = column[i] end
  return list
end

local function matrix_value(matrix)
  if matrix.cols == 1 then return entries_of(matrix) end
  local rows = {}
  for i = 1, matrix.rows do
    rows[i] = {}
    for j = 1, matrix.cols do rows[i][j] = matrix(i, j) end
  end
  return rows
end

local function names_of(column)
  local names = {}
  for i = 1, #column do names[i] = tostring(column[i]) end
  return names
end

-- A name and a list of values for every state and algebraic variable.
local function values_along(sol)
  local items = {}
  for _, list in ipairs { sol.model.differential, sol.model.algebraic } do
    for i = 1, #list do items[#items + 1] = { tostring(list[i]), sol(list[i]) } end
  end
  return items
end

local function values_at(start)
  local items = {}
  for _, list in ipairs { start.model.differential, start.model.algebraic } do
    for i = 1, #list do items[#items + 1] = { tostring(list[i]), start(list[i]) } end
  end
  return items
end

local ordered = {}  -- marks a list of pairs that becomes an object
local function object(items) return setmetatable(items, ordered) end

local writers = {
  matrix = matrix_value,
  expr = function(e) return tonumber(e) or tostring(e) end,
  solution = function(sol)
    return object { { "type", "solution" }, { "status", sol.status }, { "t", sol.t },
      { "values", object(values_along(sol)) } }
  end,
  start = function(at)
    return object { { "type", "start" }, { "t", at(t) }, { "values", object(values_at(at)) } }
  end,
  model = function(sys)
    local equations = {}
    for i, equation in ipairs(sys.equations) do equations[i] = tostring(equation) end
    return object { { "type", "model" }, { "name", sys.name }, { "kind", sys.kind }, { "form", sys.form },
      { "equations", equations }, { "differential", names_of(sys.differential) },
      { "algebraic", names_of(sys.algebraic) }, { "parameters", names_of(sys.parameters) },
      { "inputs", names_of(sys.inputs) } }
  end,
}

local simple = { number = true, string = true, boolean = true }

-- The fields of any other value that are numbers, texts, lists or matrices, by the rows of its type.
local function fields_of(value, kind)
  local items = { { "type", kind } }
  for _, name in ipairs(members(kind)) do
    if named(kind .. "#" .. name) ~= nil then
      local good, field = pcall(function() return value[name] end)
      local is_plain = good and (simple[type(field)] or object_type(field) == "matrix"
        or type(field) == "table" and getmetatable(field) == nil)
      if is_plain then items[#items + 1] = { name, field } end
    end
  end
  items[#items + 1] = { "text", tostring(value) }
  return object(items)
end

local function table_text(value)
  local keys = {}
  for key in pairs(value) do
    if math.type(key) ~= "integer" then keys[#keys + 1] = key end
  end
  if #keys == 0 then return list_text(value) end
  table.sort(keys, function(a, b) return tostring(a) < tostring(b) end)
  local items = {}
  for i, item in ipairs(value) do items[i] = { tostring(i), item } end
  for _, key in ipairs(keys) do items[#items + 1] = { tostring(key), value[key] } end
  return object_text(items)
end

local deepest, depth = 40, 0

function encode(value)
  local kind = object_type(value)
  if kind then
    local write = writers[kind]
    return encode(write and write(value) or fields_of(value, kind))
  end
  if type(value) == "number" then return number_text(value) end
  if type(value) == "string" then return string_text(value) end
  if type(value) == "boolean" then return tostring(value) end
  if type(value) ~= "table" then fail(("json: a %s has no text"):format(type(value))) end
  depth = depth + 1
  if depth > deepest then
    depth = 0
    fail("json: tables are nested more than 40 deep")
  end
  local text = getmetatable(value) == ordered and object_text(value) or table_text(value)
  depth = depth - 1
  return text
end

doc { name = "json", module = "files", sig = "json(value [, file]) -> string",
  text = "A value as JSON for other programs: numbers, texts and tables as they are, matrices by rows, exact "
    .. "values as "
    .. "numbers, formulas as texts; a solution with its times and variables, a start, a model, and the "
      .. "fields of any "
    .. "other result. nan and infinite numbers become null. With the name of a file it is written there.",
  example = 'return json{ a = {1, 2.5}, b = "x", c = mat{{1, 2}, {3, 4}} }',
  gives = '{"a": [1, 2.5], "b": "x", "c": [[1, 2], [3, 4]]}',
  function(value, file)
    depth = 0
    local text = encode(as_model(value))
    if file == nil then return text end
    if type(file) ~= "string" then fail 'json: expected a file name second, as in json(sol, "run.json")' end
    write_file(file, text .. "\n", "json")
    return text
  end }
