-- Every function is called as its example calls it, with more arguments than its signature shows, with an
-- option that it does not know and with each of its options as a value of a wrong type. Runs in the
-- environment of the stdlib; returns the complaints.

local complaints = {}
local function complain(entry, text) complaints[#complaints + 1] = entry.name .. ": " .. text end

-- "sys:reduce([form [, { at = }]]) -> model" -> 2 of a function, one more behind a colon: which argument is a
-- table of options. nil: none of them.
local function place_of_options(entry)
  local inside = entry.sig:match "^[^({]*%((.*)%)" or entry.sig:match "^[%w_.:]+({.*})"
  if not inside then return end
  local place, depth = entry.separator == ":" and 2 or 1, 0
  for at, c in inside:gmatch "()([{},(])" do
    if c == "{" or c == "(" then depth = depth + 1 elseif c == "}" then depth = depth - 1
    elseif depth == 0 then place = place + 1 end
    if c == "{" and depth == 1 and inside:find("^%s*%[?%s*[%a_][%w_]* =", at + 1) then return place end
  end
  return inside:find "%f[%a]options%f[%A]" and place
end

-- The arguments with a table of options in its place, or nil where the call has something else there.
local function with_options(entry, arguments)
  local known = {}
  for _, option in ipairs(entry.options) do known[option.name] = true end
  local copy = table.move(arguments, 1, arguments.n, 1, { n = arguments.n })
  for i = arguments.n, 1, -1 do
    local key = type(arguments[i]) == "table" and not object_type(arguments[i]) and next(arguments[i])
    if known[key] then return copy, i end
    for name in pairs(type(key) == "number" and arguments[i] or {}) do
      if known[name] then return copy, i end
    end
  end
  local place = entry.sig:find "…, options" and arguments.n + 1 or place_of_options(entry)
  if place and place <= arguments.n and arguments[place] ~= nil then place = arguments.n + 1 end
  if place then copy.n = math.max(copy.n, place) end
  return copy, place
end

-- A value that is none of the type, or nil where the type says too little.
local function wrong_value(option)
  if option.name:find "^%d" then return nil end
  local words = option.values ~= "" and option.values:sub(1, 1) ~= "@"
  if words and option.type == "string" then return "nowhere" end
  return coroutine.create(print)
end

local function refuses(original, arguments, place, key, value)
  local options = {}
  for name, each in pairs(arguments[place] or {}) do options[name] = each end
  options[key] = value
  local copy = table.move(arguments, 1, arguments.n, 1, {})
  copy[place] = options
  local good, message = pcall(original, table.unpack(copy, 1, arguments.n))
  if good then return false, "accepts" end
  return tostring(message):find(key, 1, true) ~= nil, tostring(message)
end

-- Fifteen more than the example gives: no signature has as many without "…".
local function refuses_more(entry, original, arguments)
  local many = table.move(arguments, 1, arguments.n, 1, { n = arguments.n + 15 })
  for i = arguments.n + 1, many.n do many[i] = "one more" end
  if pcall(original, table.unpack(many, 1, many.n)) then complain(entry, "ignores further arguments") end
end

local function probe_options(entry, original, arguments)
  local copy, place = with_options(entry, arguments)
  if not place then return complain(entry, "which argument has the options?") end
  local good, message = refuses(original, copy, place, "no_such_option", 1)
  if not good then complain(entry, "no_such_option: " .. message) end
  for _, option in ipairs(entry.options) do
    local value = wrong_value(option)
    if value ~= nil then
      good, message = refuses(original, copy, place, option.name, value)
      if not good then complain(entry, option.name .. ": " .. message) end
    end
  end
end

local function probe(entry, original, arguments)
  if not entry.sig:find "…" and entry.name ~= "ipairs" then refuses_more(entry, original, arguments) end
  if entry.options then probe_options(entry, original, arguments) end
end

-- Runs the example with the function replaced by one that is called again and again.
local function check(entry)
  local original, called = entry.value, false
  local function probing(...)
    if not called then
      called = true
      probe(entry, original, table.pack(...))
    end
    return original(...)
  end
  local env = setmetatable({ print = function() end }, { __index = _G })
  local member = entry.separator ~= ""
  if member then install(entry.name, probing)
  else
    env[entry.name] = type(original) == "function" and probing
      or setmetatable({}, { __index = original, __call = function(_, ...) return probing(...) end })
  end
  local chunk = compiled_example(entry.example, env)
  local good, message = pcall(chunk)
  if member then install(entry.name, original) end
  if not good then complain(entry, "the example fails: " .. tostring(message)) end
  if not called and entry.options then complain(entry, "its example does not call it") end
end

-- Their tables have names of the user's own for keys.
local by_names = { evaluate = true, ["model:with"] = true, ["lti:with"] = true, ["newton:basins"] = true,
  ["chaos:__call"] = true, ["model:close"] = true, ["model:ports"] = true, model = true }
-- What the tables are handed to, where an example would be a program of its own.
local checked_elsewhere = { ["shards.make"] = true }

for _, entry in ipairs(entries()) do
  local called = not (entry.is_concept or entry.is_value or entry.separator == "#"
    or entry.member:find "^__" and not entry.options)
  if called and not (by_names[entry.name] or checked_elsewhere[entry.name]) then
    if entry.options or type(entry.value) == "function" then check(entry) end
    if not entry.options and place_of_options(entry) then
      complain(entry, "has no rows of options: " .. entry.sig)
    end
  end
end
return table.concat(complaints, "\n")
