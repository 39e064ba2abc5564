-- The examples of the documentation with some of their tokens exchanged: calls that are almost right. What
-- must not happen: a crash, a hang, "internal error", an error without a text or with words of C++.
--   pendula tests/fuzz/examples.lua seed runs examples.txt
-- examples.txt: what examples(name) prints. The code at work stands in last.lua of the working folder.
local seed, runs, source = tonumber(arg[1] or 1), tonumber(arg[2] or 500), arg[3]
math.randomseed(seed)
local random = math.random
local function pick(list) return list[random(#list)] end

-- ── examples as lists of tokens ──
local left_out = "%f[%w_](%a+)%f[^%w_]"
local never = { edit = 1, view = 1, manual = 1, test = 1, dofile = 1, os = 1, io = 1, expect = 1 }
local function tokens(code)
  local list, at = {}, 1
  while at <= #code do
    local token = code:match("^%s+", at) or code:match("^%-%-[^\n]*", at) or code:match('^"[^"\n]*"', at)
      or code:match("^'[^'\n]*'", at) or code:match("^[%a_][%w_]*", at)
      or code:match("^%d+%.?%d*[eE][-+]?%d+", at)
      or code:match("^%d+%.?%d*", at) or code:sub(at, at)
    list[#list + 1] = token
    at = at + #token
  end
  return list
end

local examples, words, strings, seen = {}, {}, {}, {}
local function take(code)
  if code == "" or seen[code] then return end
  seen[code] = true
  for word in code:gmatch(left_out) do if never[word] then return end end
  examples[#examples + 1] = tokens(code)
  for _, token in ipairs(examples[#examples]) do
    if not seen[token] then
      seen[token] = true
      if token:find "^[\"']" then strings[#strings + 1] = token end
      if token:find "^[%a_]" and #token > 1 then words[#words + 1] = token end
    end
  end
end
local block = {}
for line in io.lines(source) do
  local code = line:match "^> (.*)"
  if code then block[#block + 1] = code else
    take(table.concat(block, "\n"))
    block = {}
  end
end
take(table.concat(block, "\n"))
table.sort(words)
table.sort(strings)

-- ── mutations ──
local numbers = { "0", "1", "-1", "2", "3", "7", "0.5", "-2.5", "1e-9", "1e-300", "5e-324", "1e9", "1e300",
  "(0/0)", "(1/0)", "(-1/0)", "math.maxinteger", "math.mininteger", "40",
  "(1/3)" }
local values = { "nil", "true", "false", "{}", "{{}}", "{1, 2, 3}", "{x = 1}", "vec{}", "vec{1, 2}",
  "zeros(0, 3)", "mat{{1, 2}, {3, 4}}", "t", "var 'x'", "param('k', 2)", "input 'u'", "''",
  "function() end", "print",
  "function(...) return ... end", "rational(1, 3)", "complex(0, 1)", "setmetatable({}, {__index = error})" }
local operators = { "+", "-", "*", "/", "^", "~", "..", "//", "%", "==", "<" }

local function other(token, example)
  local kind = random(6)
  if kind == 1 then return pick(values) end
  if token:find "^%d" then
    if kind == 2 then return tostring(tonumber(token)*10) end
    if kind == 3 then return "-" .. token end
    return pick(numbers)
  end
  if token:find "^[\"']" then return kind < 4 and pick(strings) or '"' .. pick(words) .. '"' end
  if token:find "^[%a_]" then
    if kind < 5 then
      for _ = 1, 20 do
        local word = pick(example)
        if word:find "^[%a_]" then return word end
      end
    end
    return pick(words)
  end
  if token:find "^[-+*/^~%%<]$" then return pick(operators) end
  if token == "," then return kind < 4 and ", " .. pick(values) .. "," or "" end
  return token
end

local function mutated(example)
  local list = table.move(example, 1, #example, 1, {})
  for _ = 1, random(3) do
    local at = random(#list)
    if not list[at]:find "^%s" and not list[at]:find "^%-%-" then list[at] = other(list[at], example) end
  end
  return table.concat(list)
end

-- ── runs ──
-- Code that asks for 10⁸ periods, or for endless turns of a loop: its time and memory are not the program's.
local function endless(code)
  for header in code:gmatch "%f[%w]for%f[%W].-%f[%w]do%f[%W]" do
    if header:find "1/0" or header:find "integer" or header:find "e%d" then return true end
  end
  return code:find "%f[%w]to = 1e9" or code:find "%f[%w]to = math.maxinteger" or code:find "%f[%w]while%f[%W]"
    or code:find "%f[%w]repeat%f[%W]"
end

local function compile(code, environment)
  if endless(code) then return function() end end
  local chunk = load("return " .. code, "=fuzz", "t", environment)
  for at = #code, 1, -1 do
    if chunk then break end
    if code:find("^[\n;]", at) then
      chunk = load(code:sub(1, at) .. " return " .. code:sub(at + 1), "=fuzz", "t", environment)
    end
  end
  return chunk or load(code, "=fuzz", "t", environment)
end

local hidden = { print = function(...) for i = 1, select("#", ...) do tostring((select(i, ...))) end end }
for name in pairs(never) do hidden[name] = false end
local made, refused, unread, slowest = 0, 0, 0, { 0, "" }
local function fail(what, code)
  io.stderr:write(("seed %d, run %d: %s\n%s\n"):format(seed, made, what, code))
  os.exit(1)
end
local foreign = { "internal error", "std::", "basic_string", "Eigen", "%.cpp", "%.hpp", "vector::", "__cxx",
  "stdlib/" }
local function look(message, code)
  local text = tostring(message)
  if text == "" or text == "nil" then fail("an error without a text", code) end
  for _, word in ipairs(foreign) do
    if text:find(word) and not code:find(word) then fail(text, code) end
  end
end

while made < runs do
  local code = mutated(pick(examples))
  made = made + 1
  local chunk = compile(code, setmetatable({}, { __index = function(_, name)
    if hidden[name] ~= nil then return hidden[name] end
    return _G[name]
  end }))
  if not chunk then unread = unread + 1 else
    local file = io.open("last.lua", "w")
    file:write(code)
    file:close()
    local begin = os.clock()
    local results = table.pack(pcall(chunk))
    if not results[1] then
      refused = refused + 1
      look(results[2], code)
    end
    for i = 2, results.n do
      local good, text = pcall(tostring, results[i])
      if not good then look(text, code) end
    end
    local took = os.clock() - begin
    if took > slowest[1] then slowest = { took, code } end
  end
end
if slowest[1] > 20 then fail(("took %.1f s"):format(slowest[1]), slowest[2]) end
print(("%d runs, %d refused, %d not Lua, slowest %.2f s"):format(made, refused, unread, slowest[1]))
