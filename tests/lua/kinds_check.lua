-- Every kind of result, by its specimen in help: it and its fields print without addresses, its JSON is JSON,
-- and a file of it reads back, whole or with an error that says so. Runs in the environment of the stdlib;
-- returns the complaints.

local complaints = {}
local function complain(kind, text, ...) complaints[#complaints + 1] = kind .. ": " .. text:format(...) end

-- ── JSON (RFC 8259) ──

local read_value

local function skip(text, at) return text:find("[^ \n\t\r]", at) or #text + 1 end

local function read_string(text, at)
  local i = at + 1
  while true do
    local stop = text:find('["\\%c]', i) or error "a string without its end"
    local c = text:sub(stop, stop)
    if c == '"' then return stop + 1 end
    if c ~= "\\" then error "a control character in a string" end
    if not text:find('^["\\/bfnrtu]', stop + 1) then error "an escape that is none" end
    i = stop + 2
  end
end

local function read_items(text, at, close, read_item)
  at = skip(text, at + 1)
  if text:sub(at, at) == close then return at + 1 end
  while true do
    at = skip(text, read_item(at))
    local c = text:sub(at, at)
    if c == close then return at + 1 end
    if c ~= "," then error(("'%s' where , or %s is expected"):format(c, close)) end
    at = skip(text, at + 1)
  end
end

function read_value(text, at)
  local c = text:sub(at, at)
  if c == '"' then return read_string(text, at) end
  if c == "[" then return read_items(text, at, "]", function(i) return read_value(text, i) end) end
  if c == "{" then
    return read_items(text, at, "}", function(i)
      i = skip(text, read_string(text, i))
      if text:sub(i, i) ~= ":" then error "a name without a value" end
      return read_value(text, skip(text, i + 1))
    end)
  end
  local _, stop = text:find("^-?%d+%.?%d*[eE]?[-+]?%d*", at)
  for _, word in ipairs { "true", "false", "null" } do
    if text:sub(at, at + #word - 1) == word then stop = at + #word - 1 end
  end
  return (stop or error(("'%s' begins no value"):format(c))) + 1
end

local function check_json(kind, value)
  local good, text = pcall(function() return value:json() end)
  if not good then return complain(kind, "json: %s", text) end
  local parsed, problem = pcall(function()
    if skip(text, read_value(text, skip(text, 1))) <= #text then error "something behind the value" end
  end)
  if not parsed then complain(kind, "its JSON is none: %s in %s", problem, text:sub(1, 60)) end
end

-- ── what is printed ──

local function check_text(kind, what, value)
  local good, text = pcall(shown, value)
  if not good then return complain(kind, "%s does not print: %s", what, text) end
  if text:find "0x%x%x%x%x" then
    complain(kind, "%s prints an address: %s", what, text:match "[^\n]*0x%x+")
  end
  if text == "<" .. kind .. ">" then complain(kind, "%s prints nothing of itself", what) end
end

-- ── files ──

local function written(file, text)
  local out = assert(io.open(file, "wb"))
  out:write(text)
  out:close()
end

-- A message for the user: not of a place inside the library, not an internal error.
local function is_clear(message)
  return type(message) == "string" and not message:find "internal error" and not message:find "stdlib/"
    and not message:find "attempt to"
end

local function check_file(kind, value)
  local file = os.tmpname() .. ".lua"
  local saved, why = pcall(save, file, value)
  if not saved then
    if not is_clear(why) then complain(kind, "save: %s", why) end
    return os.remove(file)
  end
  local source = assert(io.open(file, "rb")):read "a"
  local good, back = pcall(load, file)
  if not good then complain(kind, "does not load: %s", back)
  else
    local same = object_type(back) == object_type(value)
    local record = type(back) == "table" and back.type == kind
    local list = type(back) == "table" and kind == "roots"
    local plain = kind == "density" or kind == "joint_component"  -- they come back as what they belong to
    if not same and not record and not list and not plain then
      complain(kind, "comes back as %s", object_type(back) or type(back))
    end
    -- A start comes back by its values, not by what was fixed.
    local alike = kind == "start" or not same or shown(back) == shown(value)
    if not alike then complain(kind, "prints otherwise when it comes back") end
  end
  for _, share in ipairs { 0, 0.2, 0.5, 0.9 } do
    written(file, source:sub(1, math.floor(share*#source)))
    local read, message = pcall(load, file)
    if not read and not is_clear(message) then complain(kind, "cut at %g: %s", share, message) end
    if read and share > 0 and share < 0.9 then complain(kind, "cut at %g it loads", share) end
  end
  for k = 1, 12 do  -- one byte is another one
    local at = 1 + (k*7919*#source//12) % #source
    written(file, source:sub(1, at - 1) .. ("x(0}\"\0"):sub(k % 6 + 1, k % 6 + 1) .. source:sub(at + 1))
    local read, message = pcall(load, file)
    if not read and not is_clear(message) then complain(kind, "altered at %d: %s", at, message) end
  end
  os.remove(file)
end

-- ── every kind ──

local specimens = include "help/specimens"
local count = 0
for kind, specimen in pairs(specimens) do
  local env = setmetatable({}, { __index = _G })
  local good, problem = pcall(load(specimen[2], "=specimen", "t", env))
  local value = env[specimen[1]]
  if not good or value == nil then
    complain(kind, "its specimen fails: %s", tostring(problem))
  elseif object_type(value) then
    count = count + 1
    check_text(kind, "it", value)
    for _, name in ipairs(members(kind)) do
      if named(kind .. "#" .. name) ~= nil then
        local read, field = pcall(function() return value[name] end)
        if read then check_text(kind, "." .. name, field) end
      end
    end
    check_json(kind, value)
    check_file(kind, value)
  end
end
if count < 60 then complain("all", "only %d kinds", count) end
table.sort(complaints)
return table.concat(complaints, "\n")
