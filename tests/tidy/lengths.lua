-- Ceilings: lines of a function, lines and data members of a class, lines of a file, width of a line.
local source, findings = require "source", require "findings"
local report, lines = findings.report, source.lines
local lengths = {}

local most_lines, many_lines, most_function_lines = 600, 450, 70
local most_class_lines, most_members, most_width = 250, 25, 110

local function check_function_length(file, name, first, last)
  local length = last - first + 1
  if length > most_function_lines then
    report(file, first, ("%s has %d lines; the ceiling is %d"):format(name, length, most_function_lines))
  end
end

function lengths.check_cpp_functions(file, bare)
  local line, head, first = 1, "", 1
  local depth, open = 0, nil                               -- open: the function we are in and where it began
  for _, access in ipairs { "public", "protected", "private" } do
    bare = bare:gsub(access .. "%s*:%f[^:]", ";")
  end
  for piece in bare:gmatch "[^{};\n]*[{};\n]?" do
    local last = piece:sub(-1)
    if not head:find "%S" then first = line end
    head = head .. piece
    if last == "{" then
      depth = depth + 1
      local name = not open and source.function_opened_by(head:sub(1, -2))
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

function lengths.check_lua_functions(file, text)
  local stack = {}
  for number, line in lines(source.code(text, "lua")) do
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

local no_member = " using typedef friend static enum struct class template union "

-- How many data members the body of a class declares.
local function data_members(body)
  body = body:gsub("%b{}", "{}"):gsub("%b()", "()"):gsub("%b<>", "<>")
  for _, access in ipairs { "public", "protected", "private" } do
    body = body:gsub(access .. "%s*:%f[^:]", ";")
  end
  body = body:gsub("{}%s*\n", "{};\n")
  local count = 0
  for statement in body:gmatch "[^;]+" do
    local declaration = statement:gsub("^%s+", ""):gsub("=.*$", "=")
    local word = declaration:match "^[%a_]+"
    local is_member = word and not no_member:find(" " .. word .. " ", 1, true)
      and not declaration:find "%(%)" and declaration:find "%s[%w_*&]"
    if is_member then
      count = count + 1
      for _ in statement:gsub("%b[]", ""):gmatch "," do count = count + 1 end
    end
  end
  return count
end

function lengths.check_classes(file, bare)
  for word, name, at in bare:gmatch "%f[%w_](%l+)%s+([%w_:]+)[^;{}()=]*(){" do
    if word == "class" or word == "struct" then
      local body = bare:match("^%b{}", at)
      local before = select(2, bare:sub(1, at):gsub("\n", ""))
      local length = select(2, body:gsub("\n", "")) + 1
      local members = data_members(body:sub(2, -2))
      if length > most_class_lines then
        report(file, before + 1,
          ("%s has %d lines; the ceiling of a class is %d"):format(name, length, most_class_lines))
      end
      if members > most_members then
        report(file, before + 1,
          ("%s has %d data members; the ceiling is %d"):format(name, members, most_members))
      end
    end
  end
end

-- Tables of Markdown are rows, and a message in quotes is not torn: the code around it is what counts.
local function is_wide(line)
  if #line <= most_width or utf8.len(line) <= most_width or line:find "^|" then return false end
  local longest = 0
  for literal in line:gsub("\\.", "  "):gmatch '"[^"]*"' do longest = math.max(longest, utf8.len(literal)) end
  return utf8.len(line) - longest > most_width / 2
end

--- Tabs, blanks at the end, the last newline, the length of a file, the width of Lua, Markdown and comments.
function lengths.check_text(file, text)
  local count = 0
  local narrow, cpp = file:find "%.lua$" or file:find "%.md$", file:find "%.[ch]pp$"
  for number, line in lines(text) do
    count = number
    if line:find "\t" then report(file, number, "tab") end
    if line:find "[ \r]$" then report(file, number, "blanks at the end of the line") end
    local comment = cpp and line:find "^%s*//" and #line > most_width and utf8.len(line) > most_width
    if comment or (narrow and is_wide(line)) then
      report(file, number, ("a line of more than %d characters"):format(most_width))
    end
  end
  if #text > 0 and text:sub(-1) ~= "\n" then report(file, count, "no newline at the end of the file") end
  if file:find "%.md$" then return end
  local most = file:find "^src/" and many_lines or most_lines
  if count > most then
    report(file, count, ("%d lines; the ceiling is %d"):format(count, most))
  elseif count > many_lines then
    print(("%s:%d: note: more than %d lines, does it hold one idea?"):format(file, count, many_lines))
  end
end

return lengths
