-- The doctest of the documentation: runs every example and compares what it prints. Loaded by
-- check_documentation (src/lua/core/documentation.hpp), not at start-up.

local function tidy(text) return (text:gsub("[ \t]+\n", "\n"):gsub("%s+$", "")) end

-- What an example prints, its last value included; or nil and the error.
local function output_of(code)
  local lines = {}
  local function write(...)
    local parts = table.pack(...)
    for i = 1, parts.n do parts[i] = tostring(parts[i]) end
    lines[#lines + 1] = table.concat(parts, " ")
  end
  local env = setmetatable({ print = write }, { __index = _G })
  local stdlib_print = print
  print = write  -- help() and its like print from stdlib code
  local results = table.pack(pcall(function()
    local chunk, problem = compiled_example(code, env)
    if not chunk then error(problem, 0) end
    return chunk()
  end))
  print = stdlib_print
  if not results[1] then return nil, tostring(results[2]) end
  if results.n > 1 then
    local good, problem = pcall(write, table.unpack(results, 2, results.n))
    if not good then return nil, tostring(problem) end
  end
  return table.concat(lines, "\n")
end

local values = {}                                    -- of the specimens, by type

-- The specimen of a type, which is made once, in its environment; or nil and what is wrong.
local function made(type)
  local own = values[type]
  if own then return own end
  own = setmetatable({}, { __index = _G })
  values[type] = own
  local good, problem = pcall(load(specimens[type][2], "=example", "t", own))
  if good then return own end
  return nil, "the specimen fails: " .. problem
end

local function read_of_specimen(type, shows)
  local own, problem = made(type)
  if not own then return problem end
  local good
  good, problem = pcall(load("return tostring((" .. shows .. "))", "=example", "t", own))
  if not good then return shows .. " fails: " .. tostring(problem) end
end

-- Every type says what one does with it next, and that works.
local function check_next(complaints)
  local next_steps = include "help/next"
  for type in pairs(specimens) do
    if not next_steps[type] then table.insert(complaints, type .. ": is missing in stdlib/help/next.lua") end
    for _, step in ipairs(next_steps[type] or {}) do
      local problem = not step:find "…" and read_of_specimen(type, step:gsub("^print", ""))
      if problem then complaints[#complaints + 1] = type .. ": " .. problem end
    end
  end
end

local function complaint(entry)
  if entry.sig == "" or entry.text == "" then return "signature and text must not be empty" end
  if not entry.text:find "[.!?:)]$" then return "the text must end with a full stop" end
  if entry.text:find "^%l%l+[ ,;.]" and not entry.is_concept then
    return "the text must begin with a capital"
  end
  if entry.example == "" then
    return entry.separator == "#" and "the type needs a specimen (stdlib/help/specimens.lua)"
      or "a function needs an example"
  end
  if entry.by_specimen then return read_of_specimen(entry.owner, entry.by_specimen) end
  local printed, problem = output_of(entry.example)
  if not printed then return "the example fails: " .. problem end
  if entry.gives ~= "" and tidy(printed) ~= tidy(entry.gives) then
    return "the example prints\n" .. tidy(printed) .. "\nbut the documentation says\n" .. tidy(entry.gives)
  end
end

-- A list of "name: complaint".
return function()
  local complaints = {}
  for _, entry in ipairs(entries()) do
    local text = complaint(entry)
    if text then complaints[#complaints + 1] = entry.name .. ": " .. text end
  end
  check_next(complaints)
  return complaints
end
