-- The doctest of the documentation: runs every example and compares what it prints. Loaded by
-- check_documentation (src/lua/core/documentation.hpp), not at start-up.

-- Splits "statements; expression" so that the expression's value can be printed: tries every separator from
-- the end.
function compiled_example(code, env)
  local chunk = load("return " .. code, "=example", "t", env)
  if chunk then return chunk end
  for at = #code, 1, -1 do
    local c = code:sub(at, at)
    if c == "\n" or c == ";" then
      chunk = load(code:sub(1, at) .. " return " .. code:sub(at + 1), "=example", "t", env)
      if chunk then return chunk end
    end
  end
  return load(code, "=example", "t", env)
end

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

local function complaint(entry)
  if entry.sig == "" or entry.text == "" then return "signature and text must not be empty" end
  if not entry.text:find "[.!?:)]$" then return "the text must end with a full stop" end
  local is_function = (entry.separator == "" or entry.separator == ".") and not entry.is_value
  if entry.example == "" then return is_function and "a function needs an example" or nil end
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
  return complaints
end
