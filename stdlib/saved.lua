-- Reads what save wrote. Such a file is data in the notation of Lua: a list of `local name = value` and one
-- `return value`. Values are built from numbers, strings, tables, operators and calls of the vocabulary
-- below.
-- There are no loops, functions or other statements, so that a file can describe a value and do nothing else.

local functions = {}              -- what may be called, besides the functions of expressions (sin, sqrt, …)
for word in ([[var vars param params input func vec mat rational dae lagrange der diff subs solve ifelse
  lt le gt ge all any normal lognormal uniform triangular beta exponential discrete empirical
  bdf tableau tf ss complex iddata solution_of_parts figure surface]]):gmatch "[%w_]+" do
  functions[word] = true
end
for word in pairs(remembered) do functions[word] = true end
local constants = { t = true, pi = true, e = true }
local methods = { init = true, reduce = true, first_order = true, eliminate = true, semi_explicit = true,
  implicit = true,
  with = true }
local fields = { T = true, dot = true, ddot = true }
local anything = setmetatable({}, { __index = function() return true end })
local library = { dae = { linear = true, semi_explicit = true }, rk = anything, rosenbrock = anything }

local function vocabulary()
  for _, row in ipairs(rows()) do
    if row.module == "functions" and row.name:find "^%a%w*$" then functions[row.name] = true end
  end
  vocabulary = function() end
end

-- ── tokens ─────────────────────────────────────────────────────────────────────────────────────────────────

local escapes = { n = "\n", r = "\r", t = "\t", ["\\"] = "\\", ['"'] = '"', ["'"] = "'", ["\n"] = "\n" }

local function string_token(reader, quote)
  local parts, at = {}, reader.at + 1
  while true do
    local stop = reader.text:find("[\\\n" .. quote .. "]", at)
    local char = stop and reader.text:sub(stop, stop)
    if not stop or char == "\n" then reader:fail "a string has no end" end
    parts[#parts + 1] = reader.text:sub(at, stop - 1)
    if char == quote then return table.concat(parts), stop + 1 end
    local digits = reader.text:match("^%d%d?%d?", stop + 1)
    local escape = digits and string.char(tonumber(digits) % 256)
      or escapes[reader.text:sub(stop + 1, stop + 1)]
    if not escape then reader:fail "a string has an escape that save does not write" end
    parts[#parts + 1] = escape
    at = stop + 1 + (digits and #digits or 1)
  end
end

local reader = {}
reader.__index = reader

function reader:fail(why)
  local _, lines = self.text:sub(1, self.at):gsub("\n", "\n")
  fail(("load: %s:%d: %s; load reads files that save wrote, dofile %q runs a script"):format(self.file, lines + 1,
    why,
    self.file))
end

-- Reads the next token into self.kind ("name", "number", "string", "symbol", "end") and self.value.
function reader:next()
  local text = self.text
  local at = self.stop
  while true do
    at = text:find("%S", at) or #text + 1
    if text:sub(at, at + 1) ~= "--" then break end
    at = text:find("\n", at, true) or #text + 1
  end
  self.at = at
  if at > #text then
    self.kind, self.value, self.stop = "end", "the end of the file", at
    return
  end
  local name = text:match("^[%a_][%w_]*", at)
  if name then
    self.kind, self.value, self.stop = "name", name, at + #name
    return
  end
  local number = text:match("^%d+%.?%d*[eE][+-]?%d+", at) or text:match("^%d+%.?%d*", at)
    or text:match("^%.%d+", at)
  if number then
    self.kind, self.value, self.stop = "number", tonumber(number), at + #number
    return
  end
  local char = text:sub(at, at)
  if char == '"' or char == "'" then
    self.kind = "string"
    self.value, self.stop = string_token(self, char)
    return
  end
  self.kind, self.value, self.stop = "symbol", char, at + 1
end

function reader:is(value) return self.value == value and (self.kind == "symbol" or self.kind == "name") end

function reader:accept(value)
  local found = self:is(value)
  if found then self:next() end
  return found
end

function reader:expect(value)
  if not self:accept(value) then
    self:fail(("expected '%s', got '%s'"):format(value, tostring(self.value)))
  end
end

-- ── values ─────────────────────────────────────────────────────────────────────────────────────────────────

local deepest = 180               -- brackets inside brackets

function reader:table()
  local list = {}
  self:expect "{"
  while not self:is "}" do
    if self:accept "[" then
      local key = self:value_of()
      self:expect "]"
      self:expect "="
      if key == nil or key ~= key then self:fail "a table has no value as a key" end
      list[key] = self:value_of()
    else
      local key = self.kind == "name" and self.text:match("^%s*=[^=]", self.stop) and self.value
      if key then
        self:next()
        self:expect "="
        list[key] = self:value_of()
      else
        list[#list + 1] = self:value_of()
      end
    end
    if not (self:accept "," or self:accept ";") then break end
  end
  self:expect "}"
  return list
end

function reader:arguments()
  if self.kind == "string" then
    local text = self.value
    self:next()
    return { text, n = 1 }
  end
  if self:is "{" then return { self:table(), n = 1 } end
  local list = { n = 0 }
  self:expect "("
  if not self:is ")" then
    repeat
      list.n = list.n + 1
      if self:is "nil" then self:next() else list[list.n] = self:value_of() end
    until not self:accept ","
  end
  self:expect ")"
  return list
end

function reader:is_call() return self.kind == "string" or self:is "(" or self:is "{" end

-- A name: a local of the file, a constant, or a call.
function reader:named()
  local name = self.value
  self:next()
  local known = self.locals[name]
  if known ~= nil then return known end
  if name == "true" then return true end
  if name == "false" then return false end
  if library[name] and self:accept "." then
    local member = self.value
    if not library[name][member] then
      self:fail(("'%s.%s' is not part of a saved value"):format(name, member))
    end
    self:next()
    local good, value = pcall(function() return named(name)[member] end)
    if not good then self:fail(("'%s' has no entry '%s'"):format(name, member)) end
    if object_type(value) then return value end
    if not self:is_call() then self:fail(("expected the arguments of %s.%s"):format(name, member)) end
    return self:call(value)
  end
  if constants[name] then return named(name) end
  if functions[name] and self:is_call() then return self:call(named(name)) end
  self:fail(("'%s' is not part of a saved value"):format(name))
end

-- What a function refuses is told with the line of the file.
function reader:call(f, ...)
  local at, arguments = self.at, self:arguments()
  for i = 1, arguments.n do                      -- a sweep that writes files or submits jobs
    local given = arguments[i]
    if type(given) == "table" and (given.store ~= nil or given.on ~= nil) then
      self.at = at
      self:fail "'store' and 'on' are not part of a saved value"
    end
  end
  if select("#", ...) > 0 then
    table.insert(arguments, 1, (...))
    arguments.n = arguments.n + 1
  end
  local good, value = pcall(f, table.unpack(arguments, 1, arguments.n))
  if not good then
    self.at = at
    self:fail(tostring(value))
  end
  return value
end

-- (function() local e = {} e[1] = … return … end)(): parts that occur several times, behind the first
-- bracket.
function reader:shared()
  local outer, parts = self.locals.e, {}
  for word in ("function ( ) local e = { }"):gmatch "%S+" do self:expect(word) end
  self.locals.e = parts
  while self:accept "e" do
    self:expect "["
    local index = self.value
    if index ~= #parts + 1 then self:fail "the shared parts are not in order" end
    self:next()
    self:expect "]"
    self:expect "="
    parts[index] = self:value_of()
  end
  self:expect "return"
  local value = self:value_of()
  for word in ("end ) ( )"):gmatch "%S+" do self:expect(word) end
  self.locals.e = outer
  return value
end

function reader:primary()
  if self.kind == "number" or self.kind == "string" then
    local value = self.value
    self:next()
    return value
  end
  if self:is "{" then return self:table() end
  if self:accept "(" then
    if self:is "function" then return self:shared() end
    local value = self:value_of()
    self:expect ")"
    return value
  end
  if self.kind ~= "name" then
    self:fail(("'%s' is not part of a saved value"):format(tostring(self.value)))
  end
  return self:named()
end

function reader:member(value, allowed)
  local name = self.value
  if self.kind ~= "name" or not allowed[name] or not object_type(value) then
    self:fail(("'%s' is not part of a saved value"):format(tostring(name)))
  end
  self:next()
  local good, member = pcall(function() return value[name] end)
  if not good then self:fail(("a value of type %s has no '%s'"):format(object_type(value), name)) end
  return member
end

function reader:suffixed()
  local value = self:primary()
  while true do
    if self:accept "[" then
      local index = self:value_of()
      self:expect "]"
      if not object_type(value) and value ~= self.locals.e then
        self:fail "only columns and matrices have entries"
      end
      value = value[index]
    elseif self:accept "." then
      value = self:member(value, fields)
    elseif self:accept ":" then
      value = self:call(self:member(value, methods), value)
    elseif self:is "(" and object_type(value) == "func" then
      value = self:call(value)
    else
      return value
    end
  end
end

local binary = {
  ["~"] = { 1, 2, function(a, b) return a ~ b end },
  ["+"] = { 3, 4, function(a, b) return a + b end },
  ["-"] = { 3, 4, function(a, b) return a - b end },
  ["*"] = { 5, 6, function(a, b) return a * b end },
  ["/"] = { 5, 6, function(a, b) return a / b end },
  ["^"] = { 10, 9, function(a, b) return a ^ b end },
}
local unary_priority = 8

-- Everything up to an operator that binds less than `least`.
function reader:value_of(least)
  self.depth = self.depth + 1
  if self.depth > deepest then self:fail(("brackets are nested more than %d deep"):format(deepest)) end
  local value
  if self:accept "-" then
    local good, result = pcall(function(operand) return -operand end, self:value_of(unary_priority))
    if not good then self:fail "the operand of '-' does not fit" end
    value = result
  else
    value = self:suffixed()
  end
  while true do
    local operator = self.kind == "symbol" and binary[self.value]
    if not operator or operator[1] < (least or 0) then break end
    local symbol = self.value
    self:next()
    local good, result = pcall(operator[3], value, self:value_of(operator[2]))
    if not good then self:fail(("the operands of '%s' do not fit"):format(symbol)) end
    value = result
  end
  self.depth = self.depth - 1
  return value
end

-- The value in the text of a file. locals: names that it may use besides its own.
return function(text, file, locals)
  vocabulary()
  local self = setmetatable({ text = text, file = file, stop = 1, at = 1, depth = 0, locals = locals or {} },
    reader)
  self:next()
  while self:accept "local" do
    if self.kind ~= "name" then self:fail "expected a name after 'local'" end
    local name = self.value
    self:next()
    self:expect "="
    self.locals[name] = self:value_of()
  end
  self:expect "return"
  local value = self:value_of()
  if self.kind ~= "end" then self:fail(("'%s' is not part of a saved value"):format(tostring(self.value))) end
  return value
end
