-- The text of a sweep: model and options in the notation of save, so that load and other machines can make it
-- again. The fingerprint of a store is a hash of it.

-- How the runs are shared out; what does not touch their results.
local elsewhere = { store = true, workers = true, limit = true, retry = true, open = true, shards = true,
  on = true, progress = true }

local writer = {}
writer.__index = writer

local function number_text(value)
  if value ~= value then return "nan" end
  if value == math.huge or value == -math.huge then return value > 0 and "1e999" or "-1e999" end
  local text = ("%.17g"):format(value)
  return math.type(value) == "float" and not text:find "[.e]" and text .. ".0" or text
end

local function list_text(values)
  local parts = {}
  for i = 1, #values do parts[i] = number_text(values[i]) end
  return "{" .. table.concat(parts, ", ") .. "}"
end

local function matrix_text(m)
  local numbers, rows = {}, {}
  for i = 1, m.rows do
    for j = 1, m.cols do
      numbers[j] = m(i, j)
      if type(numbers[j]) ~= "number" then return m:code() end
    end
    rows[i] = list_text(numbers)
  end
  return m.cols == 1 and "{" .. table.concat(rows, ", "):gsub("[{}]", "") .. "}"
    or "mat{" .. table.concat(rows, ", ") .. "}"
end

-- A value that cannot be written down: its place is remembered, its contents enter the fingerprint.
function writer:opaque(place, contents)
  self.hidden[#self.hidden + 1] = place
  self.contents[#self.contents + 1] = contents
  return "nil"
end

function writer:callback(f, place)
  if place:find "^inputs" then
    local good, value = pcall(f, t)
    local known = type(value) == "number" or object_type(value) == "expr"
    if good and known then return self:text(value, place) end
  end
  return self:opaque(place, function_bytes(f))
end

function writer:joint(joint)
  for number, known in ipairs(self.joints) do
    if known == joint then return "d" .. number end
  end
  local name = "d" .. #self.joints + 1
  self.joints[#self.joints + 1] = joint
  self.lines[#self.lines + 1] = ("local %s = normal(%s, %s)"):format(name, matrix_text(joint.mean),
    matrix_text(joint.cov))
  return name
end

local function method_text(method)
  local name = method.name
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
  local function same(field) return tostring(known[field]) == tostring(method[field]) end
  if good and same "A" and same "b" and same "c" and same "bhat" then
    return (kind == "rosenbrock" and "rosenbrock." or "rk.") .. name
  end
end

function writer:object(value, place)
  local kind = object_type(value)
  if kind == "expr" or kind == "equation" or kind == "func" then return value:code() end
  if kind == "matrix" then return matrix_text(value) end
  if kind == "distribution" then return tostring(value) end
  if kind == "density" then return tostring(value.distribution) end
  if kind == "joint_distribution" then return self:joint(value) end
  if kind == "joint_component" then return ("%s[%d]"):format(self:joint(value.joint), value.number) end
  if kind == "start" then
    local parts = {}
    for i, field in ipairs { "fix", "guess", "inputs", "params" } do
      parts[i] = field .. " = " .. self:text(value[field], place)
    end
    return ("sys:init{ from = %s, %s }"):format(number_text(value.t), table.concat(parts, ", "))
  end
  if kind == "tableau" or kind == "rosenbrock" or kind == "multistep" then
    return method_text(value)
      or self:opaque(place, tostring(value) .. matrix_text(value.A) .. matrix_text(value.b))
  end
  if kind == "iddata" then
    return self:opaque(place, matrix_text(value.y) .. matrix_text(value.u) .. tostring(value.Ts))
  end
  fail(("sweep: %s is a %s, which cannot be written into a store"):format(place, kind))
end

local function key_text(writer_, key)
  if type(key) == "string" and key:find "^[%a_][%w_]*$" then return key end
  return "[" .. (type(key) == "string" and ("%q"):format(key) or writer_:text(key, "a key")) .. "]"
end

function writer:table(value, place)
  local parts, named = {}, {}
  for i = 1, #value do parts[i] = self:text(value[i], ("%s[%d]"):format(place, i)) end
  for key, item in pairs(value) do
    if not (math.type(key) == "integer" and key >= 1 and key <= #value) then
      local name = key_text(self, key)
      local text = self:text(item, place == "" and tostring(key) or place .. "." .. tostring(key))
      if text ~= "nil" then named[#named + 1] = { name, text } end
    end
  end
  table.sort(named, function(a, b) return a[1] < b[1] end)
  for _, pair in ipairs(named) do parts[#parts + 1] = pair[1] .. " = " .. pair[2] end
  return "{ " .. table.concat(parts, ", ") .. " }"
end

function writer:text(value, place)
  local kind = type(value)
  if kind == "number" then return number_text(value) end
  if kind == "string" then return (("%q"):format(value):gsub("\\\n", "\\n")) end
  if kind == "boolean" then return tostring(value) end
  if kind == "function" then return self:callback(value, place) end
  if object_type(value) then return self:object(value, place) end
  if kind == "table" then return self:table(value, place) end
  fail(("sweep: %s is a %s, which cannot be written into a store"):format(place, kind))
end

-- Estimates of a fit among params become the components of a joint distribution, by name.
local function named_estimates(options)
  local params = options.params
  if params == nil then return end
  if object_type(params) then params = { params } end
  local plain = {}
  for key, value in pairs(params) do
    if math.type(key) ~= "integer" then plain[key] = value end
  end
  for _, estimate in ipairs(params) do
    local joint = normal(estimate.theta, estimate.cov)
    for i, name in ipairs(estimate.names) do
      local state = name:match "^(.*)%(0%)$"
      if state then
        local start = {}
        for key, value in pairs(options.start) do start[key] = value end
        start[state] = joint[i]
        options.start = start
      else
        plain[name] = joint[i]
      end
    end
  end
  options.params = plain
end

-- The text of the model, that of the options, and a list of the places that they leave out.
return function(sys, options)
  local kept = {}
  for key, value in pairs(options) do
    if not elsewhere[key] then kept[key] = value end
  end
  named_estimates(kept)
  local self = setmetatable({ lines = {}, joints = {}, hidden = {}, contents = {} }, writer)
  local text = self:table(kept, "")
  self.lines[#self.lines + 1] = "return " .. text .. "\n"
  local hidden = table.concat(self.hidden, ", ")
  return sys:code(), table.concat(self.lines, "\n"), hidden, table.concat(self.contents, "\0")
end
