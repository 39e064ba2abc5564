-- Ways to write C++ that we do not want, functions nobody calls, and names that collide.
local source, findings = require "source", require "findings"
local report, lines = findings.report, source.lines
local statements = {}

-- An expression statement with a comma outside all brackets, `a = 1, b = 2;`. Declarations begin with two
-- words.
local function is_comma_statement(statement)
  statement = statement:gsub("%b{}", "{}"):gsub("%b()", "()"):gsub("%b[]", "[]")
  statement = statement:gsub("^[^()]*%)%s*", "")                                    -- … ++k) of a for
  statement = statement:gsub("^%s*else%s", " "):gsub("^%s*[%w_]+%s*%(%)%s+", " ")   -- else …, if () …
  statement = statement:gsub("<[%w_, ]*>%(", "(")                                   -- f<a, b>(…)
  if not statement:find "," then return false end
  return statement:find "^%s*[%w_.:%[%]()>*-]+%s*[-+*/|&]?=[^=]"
    or statement:find "^%s*return%f[%W].*%f[=]=%f[^=].*,"
    or statement:find "^%s*[%w_.:>-]+%(%)%s*,"
end

function statements.check_commas(file, bare)
  local line = 1
  for statement, last in (bare .. "}"):gmatch "([^;{}]*)([;{}])" do  -- an end for tables without one
    if last == ";" and statement:find "," and is_comma_statement(statement) then
      local blank = select(2, statement:match("^%s*"):gsub("\n", ""))
      report(file, line + blank, "statements joined by commas")
    end
    line = line + select(2, statement:gsub("\n", ""))
  end
end

-- A subscript that is a cast of a number and nothing else. An enum has to be cast, to int, and so has one
-- factor of a product of large numbers.
function statements.check_casts(file, bare)
  for at, line in lines(bare) do
    local to = line:match "%[%s*static_cast<([%w_:]+)>%b()%s*%]"
    if to and to ~= "int" then report(file, at, ("a cast to %s in a subscript"):format(to)) end
  end
end

-- The last line of a literal that was cut for its width, with hardly anything left in it.
function statements.check_torn_strings(file, text)
  local before = ""
  for at, line in lines(text) do
    local rest = line:match '^%s*"([^"]*)"[,;)}%s]*$'
    local goes_on = before:find '[^"]"$' and not before:find '\\n"$' and not before:find "//"
    if rest and goes_on and #rest <= 24 and not rest:find "^\\n" then
      report(file, at, "the torn-off end of a string literal")
    end
    before = line
  end
end

------------------------------------------------------------------------------------------- unused functions

-- Statements outside of function bodies: what a file declares (;) and defines ({), as names followed by "(".
local function declared_names(bare, found)
  local depth, inside, head = 0, nil, ""                     -- inside: depth of the function body we are in
  for _, access in ipairs { "public", "protected", "private" } do
    bare = bare:gsub(access .. "%s*:%f[^:]", ";")
  end
  for piece, last in bare:gmatch "([^{};]*)([{};])" do
    head = head .. piece
    if last == "{" then
      depth = depth + 1
      local name = not inside and source.function_opened_by(head)
      if name then
        inside = depth
        found(name:match "[%w_~]+$", true)
      end
    elseif last == ";" and not inside then
      local before, name = head:gsub("%b<>", ""):match "^([^(=]-)([%w_~]+)%s*%("
      if name and before:find "%w" then found(name, false) end
    elseif last == "}" then
      if inside == depth then inside = nil end
      depth = depth - 1
    end
    head = ""
  end
end

--- Functions that a header of src declares and nobody, tests included, ever names again.
function statements.check_unused(bares, texts)
  local places, defined, uses = {}, {}, {}
  for file, bare in pairs(bares) do
    local header = file:find "^src/.*%.hpp$"
    declared_names(bare, function(name)
      defined[name] = (defined[name] or 0) + 1
      if header then places[name] = file end
    end)
    for word in bare:gmatch "[%a_][%w_]*" do uses[word] = (uses[word] or 0) + 1 end
    local text = texts[file]:gsub("\\\n", " ")       -- directives are blanked out, but name functions too
    for directive in text:gmatch "\n[ \t]*#[ \t]*define([^\n]*)" do
      for word in directive:gmatch "[%a_][%w_]*" do uses[word] = (uses[word] or 0) + 1 end
    end
  end
  for name, file in pairs(places) do
    local class = name:find "^%u" or name:find "~" or name == "operator"
    if not class and (uses[name] or 0) <= defined[name] then
      report(file, 1, name .. "() is declared and never used")
    end
  end
end

--- Two C++ types of one Lua name would be cast into each other.
function statements.check_type_names(sources)
  local where, names = {}, {}
  for file in pairs(sources) do names[#names + 1] = file end
  table.sort(names)
  for _, file in ipairs(names) do
    if file:find "^src/lua/" then
      for number, line in lines(sources[file]) do
        local name = line:match '^%s*static constexpr const char%* value = "([^"]+)"'
        if name and where[name] then
          report(file, number, ("the type name '%s' is taken by %s"):format(name, where[name]))
        end
        if name then where[name] = file end
      end
    end
  end
end

return statements
