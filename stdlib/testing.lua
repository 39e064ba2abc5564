-- test and expect. In a script a failing expectation is an error at the user's line; under `pendula test`
-- (src/lua/core/testing.cpp) failures are counted and listed, and the file goes on with its next test.

local run          -- under `pendula test`: { passed =, failed =, current = the test's record or nil }
local pending      -- the last expect() whose check has not been called yet
local abort = {}   -- raised to leave a test whose expectation failed

-- ── reporting ──────────────────────────────────────────────────────────────────────────────────────────────

local function one_line(text) return (text:gsub("%s*\n%s*", " ")) end

-- "file:12: message" -> "file:12: name: message"
local function with_name(name, message)
  local where, rest = message:match "^([^\n]-:%d+: )(.*)$"
  if not where then where, rest = "", message end
  return one_line(where .. (name and name .. ": " or "") .. rest)
end

local function failed(where, message)
  if not run then error(where .. message, 0) end
  local current = run.current
  if current and current.failed then error(abort, 0) end
  print(with_name(current and current.name, where .. message))
  if not current then
    run.failed = run.failed + 1
    return
  end
  current.failed = true
  error(abort, 0)
end

-- An expect(…) without a check would pass silently.
local function check_pending()
  local forgotten = pending
  pending = nil
  if forgotten then
    failed(forgotten.where,
      "expect(…) checks nothing by itself; add :near(b, tol), :equals(v), :fails \"text\" or :is_true()")
  end
end

local function passed()
  if run and not run.current then run.passed = run.passed + 1 end
end

-- ── comparing ──────────────────────────────────────────────────────────────────────────────────────────────

local function show(value, depth)
  if type(value) == "string" then return '"' .. value .. '"' end
  if type(value) == "table" and getmetatable(value) == nil then
    if (depth or 0) > 3 then return "{…}" end
    local parts = {}
    for i = 1, math.min(#value, 8) do parts[i] = show(value[i], (depth or 0) + 1) end
    if #value > 8 then parts[9] = "… (" .. #value .. " items)" end
    return "{" .. table.concat(parts, ", ") .. "}"
  end
  local good, text = pcall(tostring, value)
  if not good then return "a value that cannot be printed" end
  return #text <= 300 and text or text:sub(1, 300) .. "…"
end

-- Appends the numbers in a number, a list (of lists …), a matrix or a constant expression. Returns nil or a
-- complaint.
local function collect(value, out, depth)
  if type(value) == "number" then
    out[#out + 1] = value
  elseif depth > 20 then
    return "the list is nested too deeply"
  elseif type(value) == "table" then
    for i = 1, #value do
      local complaint = collect(value[i], out, depth + 1)
      if complaint then return complaint end
    end
  elseif object_type(value) == "matrix" then
    for i = 1, value.rows do
      for j = 1, value.cols do
        local complaint = collect(value(i, j), out, depth + 1)
        if complaint then return complaint end
      end
    end
  elseif object_type(value) == "roots" then
    for i = 1, #value do
      local complaint = collect(value[i], out, depth + 1)
      if complaint then return complaint end
    end
  elseif object_type(value) == "complex" then
    return collect(value.re, out, depth + 1) or collect(value.im, out, depth + 1)
  elseif type(value) == "userdata" and named "evaluate" then
    local good, result = pcall(named "evaluate", value)
    if not good then return show(value) .. " has no numeric value" end
    return collect(result, out, depth + 1)
  else
    return "near compares numbers, lists and matrices, not a " .. type(value)
  end
end

-- nil, or what differs.
local function near_complaint(actual, wanted, tol)
  local a, b = {}, {}
  local complaint = collect(actual, a, 0) or collect(wanted, b, 0)
  if complaint then return complaint end
  if #a ~= #b then return ("expected %d number%s, got %d"):format(#b, #b == 1 and "" or "s", #a) end
  local worst, worst_excess = nil, 0
  for i = 1, #a do
    local allowed = tol * math.max(1, math.abs(b[i]))
    local excess = math.abs(a[i] - b[i]) / allowed
    if a[i] ~= b[i] and not (excess <= 1) and (not worst or not (excess <= worst_excess)) then
      worst, worst_excess = i, excess
    end
  end
  if not worst then return nil end
  local which = #a > 1 and ("entry %d of %d: "):format(worst, #a) or ""
  return ("%sexpected %.12g within %.3g, got %.12g (off by %.3g)"):format(
    which, b[worst], tol * math.max(1, math.abs(b[worst])), a[worst], math.abs(a[worst] - b[worst]))
end

-- Expressions, and matrices of them, whose difference simplifies to 0.
local function same_value(a, b)
  local kind = object_type(a)
  if kind ~= object_type(b) or (kind ~= "expr" and kind ~= "matrix") then return false end
  local function vanishes(e) return e == 0 or tostring(e) == "0" end
  local good, difference = pcall(function() return named "simplify"(named "expand"(a - b)) end)
  if not good then return false end                                             -- of other shapes
  if kind == "expr" then return vanishes(difference) end
  for i = 1, difference.rows do
    for j = 1, difference.cols do
      if not vanishes(difference(i, j)) then return false end
    end
  end
  return true
end

local function same(a, b, depth)
  if a == b then return true end
  if depth > 50 then return false end
  if type(a) == "table" and type(b) == "table" then
    for key, value in pairs(a) do
      if not same(value, b[key], depth + 1) then return false end
    end
    for key in pairs(b) do
      if a[key] == nil then return false end
    end
    return true
  end
  if type(a) == "userdata" and type(b) == "userdata" then return same_value(a, b) end
  if type(a) == type(b) or (type(a) ~= "userdata" and type(b) ~= "userdata") then return false end
  -- A matrix beside a list, an expression beside a number: equal if all numbers are.
  local x, y = {}, {}
  if collect(a, x, 0) or collect(b, y, 0) or #x ~= #y then return false end
  for i = 1, #x do
    if x[i] ~= y[i] then return false end
  end
  return #x > 0
end

-- ── expect ─────────────────────────────────────────────────────────────────────────────────────────────────

local checks = {}

local function verdict(message)
  if message then failed(position(), message) else passed() end
end

function checks:near(wanted, tol)
  if tol == nil then tol = 1e-9 end
  if type(tol) ~= "number" or not (tol >= 0) then fail "expect(a):near(b, tol): tol must be a number ≥ 0" end
  verdict(near_complaint(self.held[1], wanted, tol))
end

function checks:equals(wanted)
  verdict(not same(self.held[1], wanted, 0) and "expected " .. show(wanted) .. ", got " .. show(self.held[1])
    or nil)
end

function checks:fails(text)
  if text ~= nil and type(text) ~= "string" then fail 'expect(f):fails "text": the text must be a string' end
  if type(self.held[1]) ~= "function" then
    fail "expect(f):fails needs a function to call: expect(function() … end):fails \"text\""
  end
  local good, err = pcall(self.held[1])
  if rawequal(err, abort) then error(abort, 0) end
  local message = type(err) == "string" and err or show(err)
  if good then
    verdict("expected an error" .. (text and " with '" .. text .. "'" or "") .. ", but the call succeeded")
  elseif text and not message:find(text, 1, true) then
    verdict("expected an error with '" .. text .. "', got '" .. message .. "'")
  else
    verdict(nil)
  end
end

function checks:matches(pattern)
  if type(pattern) ~= "string" then fail "expect(s):matches(pattern): the pattern must be a string" end
  local text = type(self.held[1]) == "string" and self.held[1] or tostring(self.held[1])
  verdict(not text:find(pattern) and "'" .. text .. "' does not match '" .. pattern .. "'" or nil)
end

function checks:is_true()
  verdict(self.held[1] ~= true and "expected true, got " .. show(self.held[1]) or nil)
end
function checks:is_false()
  verdict(self.held[1] ~= false and "expected false, got " .. show(self.held[1]) or nil)
end
function checks:is_nil()
  verdict(self.held[1] ~= nil and "expected nil, got " .. show(self.held[1]) or nil)
end

local check_names = {}
for name in pairs(checks) do check_names[#check_names + 1] = name end
table.sort(check_names)

local expectation = {
  __metatable = "expectation",
  __name = "expectation",
  __tostring = function() return "expect(…): add a check such as :equals(v)" end,
  __index = function(_, key)
    pending = nil
    if checks[key] then return checks[key] end
    fail("expect has no check '" .. tostring(key) .. "'." .. did_you_mean(tostring(key), check_names)
         .. " (checks: " .. table.concat(check_names, ", ") .. ")")
  end,
}

doc { name = "expect", module = "testing", title = "Tests", sig = "expect(value, …):check(…)",
  text = [[States the expected value of an expression, the first of several: :near(b, tol) means |a - b| ≤
    tol·max(1, |b|) for each number in numbers, lists and matrices; :equals(v) compares numbers, strings,
    lists, objects and expressions (equal if their difference simplifies to 0); :fails "text" calls the
    function and expects an error with that text; also :matches(pattern), :is_true(), :is_false(),
    :is_nil(). A failure is an error at its line; `pendula test` counts it and goes on.]],
  example = [[
    expect(0.1 + 0.2):near(0.3, 1e-12)
    expect({1, {2}}):equals({1, {2}})
    expect(function() error 'too long' end):fails 'long']],
  function(value)
    check_pending()
    pending = { where = position() }
    return setmetatable({ held = { value } }, expectation)  -- boxed: nil must not reach __index
  end }

-- ── test ───────────────────────────────────────────────────────────────────────────────────────────────────

-- The message of an error value with the user's line in front. Runs where the error was raised.
local function explain(err)
  if rawequal(err, abort) then return err end
  local text = type(err) == "string" and err or show(err)
  if type(err) ~= "string" or text:find "^stdlib/" then text = position() .. text end
  return text
end

local function run_counted(name, f)
  local outer, record = run.current, { name = name }
  run.current = record
  local good, err = xpcall(function()
    f()
    check_pending()
  end, explain)
  pending = nil
  run.current = outer
  if not good and not record.failed then print(with_name(name, tostring(err))) end
  if good and not record.failed then run.passed = run.passed + 1 else run.failed = run.failed + 1 end
end

doc { name = "test", module = "testing", sig = "test(name, f)",
  text = [[Runs f, a group of expectations. Under `pendula test` its first failure is listed with its line and
    the file goes on; elsewhere it is an error.]],
  example = 'test("sums", function() expect(1 + 1):equals(2) end)',
  function(name, f)
    if type(name) ~= "string" then fail "test(name, f): the name must be a string" end
    if type(f) ~= "function" then fail("test '" .. name .. "': the second argument must be a function") end
    check_pending()
    if run then return run_counted(name, f) end
    f()
    check_pending()
  end }

-- ── for src/lua/core/testing.cpp ───────────────────────────────────────────────────────────────────────────

function begin_tests()
  run = { passed = 0, failed = 0 }
  -- Leaving early would hide what has failed so far.
  rawget(_G, "os").exit = function() fail "os.exit would end the test run; return from the file instead" end
end

function script_failed(message)
  print(with_name(nil, message))
  run.failed = run.failed + 1
end

function end_tests()
  check_pending()
  return run.passed, run.failed
end
