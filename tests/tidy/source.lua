-- Files of the repository and their text: as it stands, and with comments, strings, directives blanked out.
local source = {}
source.root = (arg[0]:match "^(.*)/[^/]*$" or ".") .. "/.."

--- Names of the files below the folders that match one of the shell patterns, sorted.
function source.files(folders, ...)
  local names = {}
  for _, name in ipairs { ... } do names[#names + 1] = "-name '" .. name .. "'" end
  local list = {}
  local find = "cd '%s' && find %s -type f '(' %s ')' 2>/dev/null"
  for file in io.popen(find:format(source.root, folders, table.concat(names, " -o "))):lines() do
    list[#list + 1] = file
  end
  table.sort(list)
  return list
end

function source.read(file)
  local handle = io.open(source.root .. "/" .. file, "rb")
  if not handle then return nil end
  local text = handle:read "a"
  handle:close()
  return text
end

function source.lines(text)                                  -- for number, line in source.lines(text)
  local number, following = 0, (text:sub(-1) == "\n" and text or text .. "\n"):gmatch "(.-)\n"
  return function()
    local line = following()
    number = number + 1
    if line then return number, line end
  end
end

-- Where the comment, string or directive that begins at `at` ends; nil if none begins there. `begins`: the
-- characters at which one can begin.
local skip = {}
local begins = { cpp = "[\"'/#]", lua = "[\"'%-%[]" }

local function end_of_string(text, at, quote)
  local stop, ends = at, "[\\\n" .. quote .. "]"
  repeat
    stop = text:find(ends, stop + 1) or #text
    local found = text:byte(stop)
    if found == 92 then stop = stop + 1 end                    -- a backslash, and what it protects
  until found ~= 92 or stop >= #text
  return stop
end

function skip.cpp(text, at)
  local first, before = text:sub(at, at), text:sub(at - 1, at - 1)
  if first == "/" then
    if text:find("^//", at) then return (text:find("\n", at, true) or #text + 1) - 1 end
    return text:find("^/%*", at) and select(2, text:find("*/", at + 2, true))
  elseif first == "#" then
    if not text:sub(math.max(at - 40, 1), at - 1):find "^[ \t]*$"
      and not text:sub(math.max(at - 40, 1), at - 1):find "\n[ \t]*$" then return nil end
    local stop = at
    repeat stop = (text:find("\n", stop + 1, true) or #text + 1) until text:sub(stop - 1, stop - 1) ~= "\\"
    return stop - 1
  elseif first == "'" then
    return not before:find "[%w_]" and end_of_string(text, at, first) or nil        -- 10'000 is one number
  end
  if before == "R" and not text:sub(at - 2, at - 2):find "[%w_]" then
    local delimiter = text:match('^"([^(\n]*)%(', at)
    return select(2, text:find(")" .. delimiter .. '"', at, true))
  end
  return end_of_string(text, at, first)
end

function skip.lua(text, at)
  local level = text:match("^%-%-%[(=*)%[", at) or text:match("^%[(=*)%[", at)
  if level then return select(2, text:find("]" .. level .. "]", at, true)) end
  if text:find("^%-%-", at) then return (text:find("\n", at, true) or #text + 1) - 1 end
  local quote = text:match("^[\"']", at)
  return quote and end_of_string(text, at, quote)
end

--- The text with everything skipped blanked out; lines stay where they are. language: "cpp" or "lua".
function source.code(text, language)
  local out, from = {}, 1                                      -- written out up to `from`
  local at = text:find(begins[language])
  while at do
    local stop = skip[language](text, at)
    if stop then
      out[#out + 1] = text:sub(from, at - 1)
      out[#out + 1] = text:sub(at, stop):gsub("[^\n]", " ")
      from = stop + 1
    end
    at = text:find(begins[language], (stop or at) + 1)
  end
  out[#out + 1] = text:sub(from)
  return table.concat(out)
end

--- What the text before an opening brace opens: the name of a function, or nil (a scope, a type, data).
function source.function_opened_by(head)
  head = head:gsub("template%s*%b<>", " "):gsub("operator%s*[^%w%s]+%s*%(", "operator(")
  if head:find "%]%s*%b()[^()]*$" or head:find "=%s*%[[^%]]*%]%s*$" then return "lambda" end
  local before, name = head:match "^([^(]-)([%w_:~]+)%s*%("
  if not name or before:find "=" then return nil end
  for word in before:gmatch "%a+" do
    if word == "class" or word == "struct" or word == "union" or word == "enum" then return nil end
  end
  return name
end

return source
