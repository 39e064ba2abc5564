-- tests/tidy.lua — the style that matters is a test: who may include whom, how long things get, what is left behind.
-- One line per finding, 'file:line: message'; exit status 1 when there is one. By hand: lua5.4 tests/tidy.lua
local root = (arg[0]:match "^(.*)/[^/]*$" or ".") .. "/.."

-- DESIGN.md §1. A layer may include whatever its arrows reach. `shell` stops at its arrows: it sees the core through lua.
local arrows = {
  base = "", expr = "base", dae = "expr", mech = "dae", codegen = "expr", method = "expr", integrate = "method dae codegen",
  lab = "integrate", lti = "dae",
  sysid = "lti integrate", plot = "base", shell = "base lua",
  lua = "expr dae mech codegen lab lti sysid plot",
}
local prints = { plot = true, lua = true, shell = true }           -- the other layers never write to the terminal
local interactive = {}                                             -- scripts that can have no .out: ["scripts/x.lua"] = "why"
local most_lines, many_lines, most_function_lines = 600, 450, 70

local written = { [""] = true }                                    -- endings of what we write; data and figures are free
for ending in ("cpp hpp def lua py sh md txt json 1 in cmake"):gmatch "%w+" do written[ending] = true end

local findings = 0
local function report(file, line, message)
  findings = findings + 1
  print(("%s:%d: %s"):format(file, line, message))
end

---------------------------------------------------------------------------------------------------- files

local function files(folders, ...)
  local names = {}
  for _, name in ipairs { ... } do names[#names + 1] = "-name '" .. name .. "'" end
  local list = {}
  local find = "cd '%s' && find %s -type f '(' %s ')' 2>/dev/null"
  for file in io.popen(find:format(root, folders, table.concat(names, " -o "))):lines() do list[#list + 1] = file end
  table.sort(list)
  return list
end

local function read(file)
  local handle = io.open(root .. "/" .. file, "rb")
  if not handle then return nil end
  local text = handle:read "a"
  handle:close()
  return text
end

local function lines(text)                                         -- for number, line in lines(text)
  local number, following = 0, (text:sub(-1) == "\n" and text or text .. "\n"):gmatch "(.-)\n"
  return function()
    local line = following()
    number = number + 1
    if line then return number, line end
  end
end

---------------------------------------------------------------------------------------------------- source without text

-- Where the comment, string or directive that begins at `at` ends; nil if none begins there.
local skip = {}

function skip.cpp(text, at)
  local before = text:sub(at - 1, at - 1)
  local delimiter = text:match('^R"([^(\n]*)%(', at)
  if delimiter and not before:find "[%w_]" then return select(2, text:find(")" .. delimiter .. '"', at, true)) end
  if text:find("^//", at) then return (text:find("\n", at, true) or #text + 1) - 1 end
  if text:find("^/%*", at) then return select(2, text:find("*/", at + 2, true)) end
  if text:find("^[ \t]*#", at) and (at == 1 or before == "\n") then
    local stop = at
    repeat stop = (text:find("\n", stop + 1, true) or #text + 1) until text:sub(stop - 1, stop - 1) ~= "\\"
    return stop - 1
  end
  local quote = text:match("^[\"']", at)
  if not quote or (quote == "'" and before:find "[%w_]") then return nil end     -- 10'000 is one number
  local stop = at + 1
  while text:sub(stop, stop) ~= quote and stop < #text do stop = stop + (text:sub(stop, stop) == "\\" and 2 or 1) end
  return stop
end

function skip.lua(text, at)
  local level = text:match("^%-%-%[(=*)%[", at) or text:match("^%[(=*)%[", at)
  if level then return select(2, text:find("]" .. level .. "]", at, true)) end
  if text:find("^%-%-", at) then return (text:find("\n", at, true) or #text + 1) - 1 end
  local quote = text:match("^[\"']", at)
  if not quote then return nil end
  local stop = at + 1
  while text:sub(stop, stop) ~= quote and stop < #text do stop = stop + (text:sub(stop, stop) == "\\" and 2 or 1) end
  return stop
end

-- The text with everything skipped blanked out; lines stay where they are.
local function code(text, language)
  local out, at = {}, 1
  while at <= #text do
    local stop = skip[language](text, at)
    if stop then
      out[#out + 1] = text:sub(at, stop):gsub("[^\n]", " ")
    else
      stop = select(2, text:find("^[%w_]+", at)) or at
      if text:find('^R"', at) then stop = at end
      out[#out + 1] = text:sub(at, stop)
    end
    at = stop + 1
  end
  return table.concat(out)
end

---------------------------------------------------------------------------------------------------- lengths

local function check_function_length(file, name, first, last)
  local length = last - first + 1
  if length > most_function_lines then
    report(file, first, ("%s has %d lines; the ceiling is %d"):format(name, length, most_function_lines))
  end
end

-- What the text before an opening brace opens: the name of a function, or nil (a scope, a type, data).
local function function_opened_by(head)
  head = head:gsub("template%s*%b<>", " "):gsub("operator%s*[^%w%s]+%s*%(", "operator(")
  if head:find "%]%s*%b()[^()]*$" or head:find "=%s*%[[^%]]*%]%s*$" then return "lambda" end
  local before, name = head:match "^([^(]-)([%w_:~]+)%s*%("
  if not name or before:find "=" then return nil end
  for word in before:gmatch "%a+" do
    if word == "class" or word == "struct" or word == "union" or word == "enum" then return nil end
  end
  return name
end

local function check_cpp_functions(file, text)
  local line, head, first = 1, "", 1
  local depth, open = 0, nil                                       -- open: the function we are in and where it began
  for _, access in ipairs { "public", "protected", "private" } do text = text:gsub(access .. "%s*:%f[^:]", ";") end
  for piece in text:gmatch "[^{};\n]*[{};\n]?" do
    local last = piece:sub(-1)
    if not head:find "%S" then first = line end
    head = head .. piece
    if last == "{" then
      depth = depth + 1
      local name = not open and function_opened_by(head:sub(1, -2))
      if name then open = { name = name, depth = depth, first = first } end
    elseif last == "}" then
      if open and open.depth == depth then
        check_function_length(file, open.name, open.first, line)
        open = nil
      end
      depth = depth - 1
    elseif last == "\n" then
      line = line + 1
    end
    if last:find "[{};]" then head = "" end
  end
end

local function check_lua_functions(file, text)
  local stack = {}
  for number, line in lines(text) do
    for word in line:gmatch "%f[%w_][%a_][%w_]*" do
      if word == "function" or word == "do" or word == "if" or word == "repeat" then
        stack[#stack + 1] = { word = word, first = number }
      elseif word == "end" or word == "until" then
        local opened = table.remove(stack)
        if not opened then return report(file, number, "'" .. word .. "' closes nothing") end
        if opened.word == "function" then check_function_length(file, "function", opened.first, number) end
      end
    end
  end
end

---------------------------------------------------------------------------------------------------- rules

local function reach(layer, into)
  into[layer] = true
  for to in arrows[layer]:gmatch "%w+" do
    if layer == "shell" then into[to] = true elseif not into[to] then reach(to, into) end
  end
  return into
end

local function check_layer(file, text, bare)
  local layer = file:match "^src/(%w+)/"
  if not layer or not arrows[layer] then return report(file, 1, "belongs to no layer of DESIGN.md") end
  local may = reach(layer, {})
  for number, line in lines(text) do
    local to = line:match '^%s*#%s*include%s+"([%w_]+)/'
    if to and not may[to] then report(file, number, layer .. " may not know " .. to) end
    if line:find '^%s*#%s*include%s+"%.%.?/' then report(file, number, "includes are written from src") end
  end
  if prints[layer] then return end
  for number, line in lines(bare) do
    local call = line:match "%f[%w_]f?printf%s*%(" or line:match "%f[%w_]f?puts%s*%(" or line:match "std::c[oe][ur][tr]%f[%W]"
    if call then report(file, number, "a numerical layer does not print: " .. call) end
  end
end

local function check_text(file, text)
  local count = 0
  for number, line in lines(text) do
    count = number
    if line:find "\t" then report(file, number, "tab") end
    if line:find "[ \r]$" then report(file, number, "blanks at the end of the line") end
  end
  if #text > 0 and text:sub(-1) ~= "\n" then report(file, count, "no newline at the end of the file") end
  if file:find "%.md$" then return end
  if count > most_lines then report(file, count, ("%d lines; the ceiling is %d"):format(count, most_lines)) end
  if count > many_lines and count <= most_lines then
    print(("%s:%d: note: more than %d lines, does it hold one idea?"):format(file, count, many_lines))
  end
end

-- The anchors of a Markdown file: <a id="name">, and headings as GitHub links them.
local function anchors(text)
  local known = {}
  for id in text:gmatch '<a%s+[idname]+="([^"]+)"' do known[id] = true end
  for _, line in lines(text) do
    local title = line:match "^#+%s+(.-)%s*$"
    if title then known[title:lower():gsub("[%c!-,./:-@%[-^`{-~]", ""):gsub(" ", "-")] = true end
  end
  return known
end

local function check_citations(sources)
  local text = read "docs/derivations.md"
  local known = text and anchors(text) or {}
  for file, source in pairs(sources) do
    for number, line in lines(source) do
      for anchor in line:gmatch "docs/derivations%.md#([^%s%)%]},;\"']+)" do
        anchor = anchor:gsub("[.:]+$", "")
        if not known[anchor] then report(file, number, "docs/derivations.md has no anchor #" .. anchor) end
      end
    end
  end
end

local function check_headers_used(sources)
  local included = {}
  for file, text in pairs(sources) do
    for _, line in lines(text) do
      local to = line:match '^%s*#%s*include%s+"([^"]+)"'
      if to then included["src/" .. to] = true end
    end
  end
  for file in pairs(sources) do
    if file:find "^src/.*%.[hd][pe][pf]$" and not included[file] then report(file, 1, "nothing includes this file") end
  end
end

-- Two C++ types of one Lua name would be cast into each other.
local function check_type_names(sources)
  local where, names = {}, {}
  for file in pairs(sources) do names[#names + 1] = file end
  table.sort(names)
  for _, file in ipairs(names) do
    if file:find "^src/lua/" then
      for number, line in lines(sources[file]) do
        local name = line:match '^%s*static constexpr const char%* value = "([^"]+)"'
        if name and where[name] then report(file, number, ("the type name '%s' is taken by %s"):format(name, where[name])) end
        if name then where[name] = file end
      end
    end
  end
end

---------------------------------------------------------------------------------------------------- all of them

local sources = {}
for _, file in ipairs(files("src tests bench", "*.cpp", "*.hpp", "*.def")) do
  local text = read(file)
  local bare = code(text, "cpp")
  sources[file] = text
  if file:find "^src/" then
    check_layer(file, text, bare)
    check_cpp_functions(file, bare)
  end
  if file:find "%.hpp$" and not text:find "#pragma once" then report(file, 1, "no #pragma once") end
end
for _, file in ipairs(files("stdlib tests", "*.lua")) do check_lua_functions(file, code(read(file), "lua")) end
for _, file in ipairs(files("src stdlib scripts tests bench docs cmake dev .ci *.md CMake*", "*")) do
  if written[file:match "%.(%w+)$" or ""] then check_text(file, read(file)) end
end
for _, file in ipairs(files("scripts", "*.lua")) do
  if not interactive[file] and not read(file:gsub("lua$", "out")) then
    report(file, 1, "no expected output beside it: SNAP_UPDATE=1 tests/scripts.sh " .. file)
  end
end
check_citations(sources)
check_headers_used(sources)
check_type_names(sources)

if findings > 0 then print(findings .. " findings") end
os.exit(findings == 0)
