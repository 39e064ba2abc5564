-- Values as text that load reads back (stdlib/saved.lua): a list of `local name = value` and one `return
-- value`.
-- Loaded when save is first called.

local by_code = { expr = true, matrix = true, equation = true }

-- A number as text that reads back as the same one.
local function number_text(value)
  if value ~= value then return "0/0" end
  if value == math.huge or value == -math.huge then return value > 0 and "1e999" or "-1e999" end
  local text = ("%.17g"):format(value)
  return math.type(value) == "float" and not text:find "[.e]" and text .. ".0" or text
end

local function string_text(value)
  return '"' .. value:gsub('[%c"\\]', function(c)
    return c == '"' and '\\"' or c == "\\" and "\\\\" or ("\\%03d"):format(c:byte())
  end) .. '"'
end

local function rows_text(matrix)
  local rows = {}
  for i = 1, matrix.rows do
    local cells = {}
    for j = 1, matrix.cols do
      local entry = matrix(i, j)
      cells[j] = type(entry) == "number" and number_text(entry) or entry:code()
    end
    rows[i] = "{" .. table.concat(cells, ", ") .. "}"
  end
  return "{" .. table.concat(rows, ", ") .. "}"
end

local writer = {}
writer.__index = writer

function writer:fail(why) fail(("save: %s%s"):format(self.place ~= "" and self.place .. ": " or "", why)) end

-- The name of a local of the file that holds the value; the same value is written once.
function writer:named_value(value, lines)
  local known = self.names[value]
  if known then return known end
  self.count = self.count + 1
  local name = "value" .. self.count
  self.names[value] = name
  self.lines[#self.lines + 1] = lines(name)
  return name
end

-- A model's own text has locals for its symbols; what it returns gets a name.
function writer:model(value)
  return self:named_value(value, function(name)
    return (value:code():gsub("\nreturn ", "\nlocal " .. name .. " = ", 1):gsub("%s+$", ""))
  end)
end

function writer:start(value)
  local model = value.model
  local name = self:model(model)
  local fix = {}
  for _, list in ipairs { model.differential, model.algebraic } do
    for i = 1, #list do
      fix[#fix + 1] = ("[%s] = %s"):format(list[i]:code(), number_text(value(list[i]) + 0.0))
    end
  end
  return ("%s:init { fix = { %s }, from = %s }"):format(name, table.concat(fix, ", "),
    number_text(value(t) + 0.0))
end

function writer:iddata(value)
  if value.experiments > 1 then self:fail "data of several experiments cannot be saved" end
  local inputs = #value.u_names > 0 and ", u = " .. rows_text(value.u) or ""
  return ("iddata { y = %s%s, Ts = %s }"):format(rows_text(value.y), inputs, number_text(value.Ts))
end

function writer:lti(value)
  local Ts = value.Ts and value.Ts ~= 0 and ", " .. number_text(value.Ts) or ""
  local system = value.form == "ss" and value or value:ss()
  return ("ss(%s, %s, %s, %s%s)"):format(rows_text(system.A), rows_text(system.B), rows_text(system.C),
    rows_text(system.D), Ts)
end

local function numbers_of(column)
  local list = {}
  for i = 1, column.rows*column.cols do list[i] = column[i] end
  return list
end

-- A solution as what it says: its model, the saved times and values, and the start at its end. What lies
-- between
-- the saved times is not kept.
function writer:solution(value)
  local values, model = {}, value.model
  for _, list in ipairs { model.differential, model.algebraic } do
    for i = 1, #list do values[tostring(list[i])] = numbers_of(value(list[i])) end
  end
  local good, state = pcall(value.state, value)  -- with inputs of unknown form there is none
  return self:table { model = model, t = numbers_of(value.t), values = values, status = value.status,
    state = good and state or nil }
end

-- A plain table: its list, then its names in order.
function writer:table(value)
  if self.inside[value] then self:fail "a table that contains itself cannot be saved" end
  self.inside[value] = true
  local parts, keys, place = {}, {}, self.place
  for i, item in ipairs(value) do
    self.place = ("%s[%d]"):format(place, i)
    parts[i] = self:text(item)
  end
  for key in pairs(value) do
    if type(key) ~= "string" and not (math.type(key) == "integer" and key >= 1 and key <= #value) then
      self:fail(("the key %s is neither a name nor a position"):format(tostring(key)))
    end
    if type(key) == "string" then keys[#keys + 1] = key end
  end
  table.sort(keys)
  for _, key in ipairs(keys) do
    self.place = place == "" and key or place .. "." .. key
    parts[#parts + 1] = ("[%s] = %s"):format(string_text(key), self:text(value[key]))
  end
  self.place, self.inside[value] = place, nil
  return #parts == 0 and "{}" or "{ " .. table.concat(parts, ", ") .. " }"
end

local remedies = { figure = 'fig:save "figure.svg" writes it',
  fit_result = "r.model is a model that can be saved" }

function writer:text(value)
  local kind = object_type(value)
  if kind == "model" or kind == "start" or kind == "iddata" or kind == "lti" or kind == "solution" then
    return self[kind](self, value)
  end
  if by_code[kind] then return value:code() end
  if kind then
    local article = kind:find "^[aeiou]" and "an " or "a "
    self:fail(article .. kind .. " cannot be saved"
      .. (remedies[kind] and "; " .. remedies[kind]
        or ": models, expressions, matrices, equations, starts, data, "
        .. "linear systems, numbers, texts and tables of these can"))
  end
  if type(value) == "number" then return number_text(value) end
  if type(value) == "string" then return string_text(value) end
  if type(value) == "boolean" then return tostring(value) end
  if type(value) == "table" and getmetatable(value) == nil then return self:table(value) end
  self:fail(("a %s cannot be saved"):format(type(value)))
end

-- The text of a file with this value.
return function(value)
  if object_type(value) == "model" then return value:code() end
  local self = setmetatable({ lines = {}, names = {}, count = 0, inside = {}, place = "" }, writer)
  local text = self:text(value)
  self.lines[#self.lines + 1] = "return " .. text
  return table.concat(self.lines, "\n") .. "\n"
end
