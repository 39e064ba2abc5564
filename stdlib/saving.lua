-- Values as text that stdlib/saved.lua reads back: a list of `local name = value` and one `return value`. The
-- one writer of such text: save, stores of sweeps and answers of the grader are written by it.

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

local plain = { number = number_text, string = string_text, boolean = tostring }

local function numbers_text(values)
  local parts = {}
  for i = 1, #values do parts[i] = number_text(values[i]) end
  return "{" .. table.concat(parts, ", ") .. "}"
end

-- The rows of a matrix; entries that are expressions as their code.
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

local function row_text(column) return rows_text(column.T):sub(2, -2) end

local function numbers_of(column)
  local list = {}
  for i = 1, column.rows*column.cols do list[i] = column[i] end
  return list
end

local function fields_text(fields)
  local parts = {}
  for _, field in ipairs(fields) do
    if field[2] then parts[#parts + 1] = field[1] .. " = " .. field[2] end
  end
  return "{ " .. table.concat(parts, ", ") .. " }"
end

-- by: the function that complains. opaque(writer, place, contents): what stands for a value that cannot be
-- written;
-- without it that is an error. model: the name of the model of all starts, if they have one.
local writer = {}
writer.__index = writer

local function new_writer(options)
  local self = { lines = {}, names = {}, count = 0, inside = {}, place = "", by = "save" }
  for key, value in pairs(options or {}) do self[key] = value end
  return setmetatable(self, writer)
end

function writer:fail(why)
  fail(("%s: %s%s"):format(self.by, self.place ~= "" and self.place .. ": " or "", why))
end

-- The name of a local of the text that holds the value; the same value is written once.
function writer:local_name(value, line)
  local kind = object_type(value)
  for known, name in pairs(self.names) do  -- the same object may come as another Lua value
    if object_type(known) == kind and known == value then return name end
  end
  self.count = self.count + 1
  local name = "value" .. self.count
  self.names[value] = name
  self.lines[#self.lines + 1] = line(name)
  return name
end

-- The text of something at a place inside the value, for messages.
function writer:at(key, value)
  local outer = self.place
  self.place = type(key) == "number" and ("%s[%d]"):format(outer, key) or outer == "" and key
    or outer .. "." .. key
  local text = self:text(value)
  self.place = outer
  return text
end

-- ── kinds of values ────────────────────────────────────────────────────────────────────────────────────────

local kinds = {}

local function code(_, value) return value:code() end
for _, kind in ipairs { "expr", "equation", "func" } do kinds[kind] = code end

-- Exact entries stay exact; of numbers every digit is kept.
function kinds.matrix(self, value)
  if self.lists and value.cols == 1 and type(value[1]) == "number" then
    return numbers_text(numbers_of(value))
  end
  return value:code()
end

-- A model's own text has locals for its symbols; what it returns gets a name.
function kinds.model(self, value)
  return self:local_name(value, function(name)
    return (value:code():gsub("\nreturn ", "\nlocal " .. name .. " = ", 1):gsub("%s+$", ""))
  end)
end

-- What was fixed, guessed and given, so that the search for the start gives the same one.
function kinds.start(self, value)
  if self.model then
    local parts = {}
    for i, field in ipairs { "fix", "guess", "inputs", "params" } do
      parts[i] = field .. " = " .. self:at(field, value[field])
    end
    return ("%s:init{ from = %s, %s }"):format(self.model, number_text(value.t),
      table.concat(parts, ", "))
  end
  local fix, model = {}, value.model
  for _, list in ipairs { model.differential, model.algebraic } do
    for i = 1, #list do
      fix[#fix + 1] = ("[%s] = %s"):format(list[i]:code(), number_text(value(list[i]) + 0.0))
    end
  end
  return ("%s:init { fix = { %s }, from = %s }"):format(kinds.model(self, model), table.concat(fix, ", "),
    number_text(value(t) + 0.0))
end

function kinds.iddata(self, value)
  if self.opaque then
    return self:opaque(self.place, rows_text(value.y) .. rows_text(value.u) .. tostring(value.Ts))
  end
  if value.experiments > 1 then self:fail "data of several experiments cannot be saved" end
  local function names(list)
    local parts = {}
    for i, name in ipairs(list) do parts[i] = string_text(name) end
    return "{" .. table.concat(parts, ", ") .. "}"
  end
  return ("iddata " .. fields_text { { "y", rows_text(value.y) },
    { "u", #value.u_names > 0 and rows_text(value.u) },
    { "Ts", number_text(value.Ts) }, { "y_names", names(value.y_names) },
    { "u_names", #value.u_names > 0 and names(value.u_names) } })
end

-- A transfer function stays one.
function kinds.lti(_, value)
  local sampling = value.Ts and value.Ts ~= 0 and ", " .. number_text(value.Ts) or ""
  local good, num = pcall(function() return value.form ~= "ss" and value.num end)
  if good and num then
    local den = value.den
    return ("tf(%s, %s%s)"):format(num.rows == 1 and num.T:code() or num:code(),
      den.rows == 1 and den.T:code() or den:code(), sampling)
  end
  local system = value.form == "ss" and value or value:ss()
  return ("ss(%s, %s, %s, %s%s)"):format(system.A:code(), system.B:code(), system.C:code(), system.D:code(),
    sampling)
end

function kinds.complex(self, z) return ("complex(%s, %s)"):format(self:text(z.re), self:text(z.im)) end
function kinds.roots(self, list)
  local parts = {}
  for i = 1, #list do parts[i] = self:text(list[i]) end
  return "{" .. table.concat(parts, ", ") .. "}"
end

function kinds.distribution(_, value) return tostring(value) end
function kinds.density(_, value) return tostring(value.distribution) end
function kinds.joint_distribution(self, value)
  return self:local_name(value, function(name)
    return ("local %s = normal(%s, %s)"):format(name, numbers_text(numbers_of(value.mean)),
      rows_text(value.cov))
  end)
end
function kinds.joint_component(self, value)
  return ("%s[%d]"):format(kinds.joint_distribution(self, value.joint), value.number)
end

-- A method of the library by its name, another one by its coefficients.
local function library_name(method)
  local name = method.name or ""
  local kind = object_type(method)
  if kind == "multistep" then return name end
  local library, base, arguments = kind == "rosenbrock" and rosenbrock or rk, name:match "^([%w_]+)(.*)$"
  local good, known = pcall(function()
    local entry = library[base]
    if arguments == "" then return entry end
    local numbers = {}
    for word in arguments:gmatch "[^(),%s]+" do
      numbers[#numbers + 1] = tonumber(word) or word:gsub('"', "")
    end
    return entry(table.unpack(numbers))
  end)
  if good and object_type(known) == kind and tostring(known) == tostring(method) then
    return (kind == "rosenbrock" and "rosenbrock." or "rk.") .. name
  end
end

local function method(self, value)
  local known = library_name(value)
  if known then return known end
  if object_type(value) ~= "tableau" then
    if not self.opaque then self:fail "a Rosenbrock method that is not in the library cannot be saved" end
    return self:opaque(self.place, tostring(value) .. value.A:code() .. value.b:code())
  end
  return "tableau " .. fields_text { { "A", rows_text(value.A) }, { "b", row_text(value.b) },
    { "c", row_text(value.c) }, { "bhat", value.bhat and row_text(value.bhat) },
    { "bhat2", value.bhat2 and row_text(value.bhat2) },
    { "error_scale", value.error_scale ~= 1 and self:at("error_scale", value.error_scale) },
    { "name", value.name and string_text(value.name) } }
end
kinds.tableau, kinds.rosenbrock, kinds.multistep = method, method, method

-- ── solutions, figures, other results ──────────────────────────────────────────────────────────────────────

-- An input as an expression where its function gives one, else as samples over the time of the solution.
local function input_text(self, f, sol)
  local good, value = pcall(f, t)
  if good and (type(value) == "number" or object_type(value) == "expr") then return self:text(value) end
  local times, values = linspace(sol.t[1], sol.t[#sol.t], 2001), {}
  for i = 1, #times do values[i] = f(times[i]) end
  if type(values[1]) ~= "number" then self:fail "an input that is a column cannot be saved" end
  return fields_text { { "t", numbers_text(times) }, { "u", numbers_text(values) } }
end

-- What integrate was asked for, without functions: what events call is not kept.
local function options_text(self, sol)
  local fields, options = {}, sol.options or {}
  for _, key in ipairs { "to", "rtol", "atol", "method", "dt", "from", "times", "params", "direct" } do
    if options[key] ~= nil then fields[#fields + 1] = { key, self:at(key, options[key]) } end
  end
  fields[#fields + 1] = { "start", self:at("start", options.start or sol:state(sol.t[1])) }
  if options.inputs then
    local inputs = {}
    for key, value in pairs(options.inputs) do
      local name = type(key) == "string" and string_text(key) or key:code()
      inputs[#inputs + 1] = ("[%s] = %s"):format(name,
        type(value) == "function" and input_text(self, value, sol) or self:at("inputs", value))
    end
    table.sort(inputs)
    fields[#fields + 1] = { "inputs", "{ " .. table.concat(inputs, ", ") .. " }" }
  end
  local events = {}
  for i, event in ipairs(options.events or {}) do
    local kept = {}
    for key, value in pairs(event) do
      if type(value) ~= "function" then kept[key] = value end
    end
    if event.call then kept.reset = {} end
    events[i] = self:at(i, kept)
  end
  if #events > 0 then fields[#fields + 1] = { "events", "{ " .. table.concat(events, ", ") .. " }" } end
  if options.to == nil then fields[#fields + 1] = { "to", number_text(sol.t[#sol.t]) } end
  return fields_text(fields)
end

local part_text

-- The table of parts: numbers in full, lists, then names in order.
local function parts_text(parts)
  local items, names = {}, {}
  for i = 1, #parts do items[i] = part_text(parts[i]) end
  for name in pairs(parts) do
    if type(name) == "string" then names[#names + 1] = name end
  end
  table.sort(names)
  for _, name in ipairs(names) do items[#items + 1] = name .. " = " .. part_text(parts[name]) end
  return #items == 0 and "{}" or "{ " .. table.concat(items, ", ") .. " }"
end

function kinds.figure(_, value) return "figure " .. parts_text(value:parts()) end
function kinds.surface(_, value)
  return ("surface(%s, %s, %s)"):format(rows_text(value.x), rows_text(value.y), rows_text(value.z))
end
function part_text(value)
  local kind = object_type(value)
  if kind == "matrix" then return value.cols == 1 and numbers_text(value) or rows_text(value) end
  if kind then return kinds[kind](nil, value) end
  return type(value) == "table" and parts_text(value) or plain[type(value)](value)
end

-- Its model, what integrate was asked for, the saved points, and polynomials between them.
function kinds.solution(self, value)
  local model, options = kinds.model(self, value.model), options_text(self, value)
  return self:local_name(value, function(name)
    return ("local %s = solution_of_parts(%s, %s, %s)"):format(name, model, options,
      parts_text(value:parts()))
  end)
end

-- The call that made a result, where all its arguments can be written.
local function call_text(self, value)
  local call = asked[value]
  if not call then return nil end
  local place, arguments = self.place, {}
  local good, why = pcall(function()
    for i = 1, call.n do
      local options = type(call[i]) == "table" and call[i]
      if call.name == "sweep" and options and (options.store or options.on) then
        self:fail 'this sweep is kept in a store; load reads it: load "runs.db"'
      end
      arguments[i] = call[i] == nil and "nil" or self:at(i, call[i])
    end
  end)
  self.place = place
  if not good then return nil, why end
  return self:local_name(value, function(name)
    return ("local %s = %s(%s)"):format(name, call.name, table.concat(arguments, ", "))
  end)
end

-- The fields of any other result, as a plain table: what it says is kept, its methods are not.
local function record(self, value, kind)
  local fields = { { "type", string_text(kind) } }
  for _, name in ipairs(members(kind)) do
    if named(kind .. "#" .. name) ~= nil then
      local good, text = pcall(function() return self:at(name, value[name]) end)
      if good then fields[#fields + 1] = { name, text } end
    end
  end
  if #fields == 1 then
    self:fail(("%s cannot be saved"):format((kind:find "^[aeiou]" and "an " or "a ") .. kind))
  end
  fields[#fields + 1] = { "text", string_text(tostring(value)) }
  return fields_text(fields)
end

-- ── plain values ───────────────────────────────────────────────────────────────────────────────────────────

-- A plain table: its list, then its names in order.
function writer:table(value)
  if self.inside[value] then self:fail "a table that contains itself cannot be saved" end
  self.inside[value] = true
  local parts, named_parts, place = {}, {}, self.place
  for i = 1, rawlen(value) do parts[i] = self:at(i, rawget(value, i)) end
  for key, item in next, value do
    local text
    if type(key) == "string" then text = string_text(key)
    elseif object_type(key) == "expr" then text = key:code()
    elseif not (math.type(key) == "integer" and key >= 1 and key <= #parts) then
      self:fail(("the key %s is neither a name nor a position"):format(tostring(key)))
    end
    if text then named_parts[#named_parts + 1] = { text, self:at(tostring(key), item) } end
  end
  table.sort(named_parts, function(a, b) return a[1] < b[1] end)
  for _, part in ipairs(named_parts) do
    if part[2] ~= "nil" then parts[#parts + 1] = ("[%s] = %s"):format(part[1], part[2]) end
  end
  self.place, self.inside[value] = place, nil
  return #parts == 0 and "{}" or "{ " .. table.concat(parts, ", ") .. " }"
end

function writer:text(value)
  value = as_model(value)
  local kind = object_type(value)
  if kind then
    if kinds[kind] then return kinds[kind](self, value) end
    if self.opaque then self:fail(("a %s cannot be written"):format(kind)) end
    local call, why = call_text(self, value)
    if call then return call end
    if kind == "sweep" then fail(tostring(why or "save: this sweep was not made by a call of sweep")) end
    return record(self, value, kind)
  end
  if plain[type(value)] then return plain[type(value)](value) end
  local call = asked[value] and call_text(self, value)
  if call then return call end
  local meta = getmetatable(value)
  local is_data = meta == nil or type(meta) == "table" and meta.__name == "list" -- prints otherwise
  if type(value) == "table" and (is_data or self.opaque) then return self:table(value) end
  if type(value) == "function" and self.opaque then return self:callback(value) end
  self:fail(("a %s cannot be saved"):format(type(value)))
end

local saving = { new_writer = new_writer, number_text = number_text }

-- The text of a file with this value.
function saving.text(value)
  value = as_model(value)
  if object_type(value) == "model" then return value:code() end
  local self = new_writer()
  local text = self:text(value)
  self.lines[#self.lines + 1] = "return " .. text
  return table.concat(self.lines, "\n") .. "\n"
end


return saving
