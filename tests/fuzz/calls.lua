-- Random calls: every function and method of the vocabulary with random values of all types. What must not
-- happen: a crash, a hang, "internal error", an error without a text.
--   pendula tests/fuzz/calls.lua seed calls
local of_lua = { ["nil"] = true, boolean = true, number = true, string = true, table = true,
  ["function"] = true, thread = true }
local seed, calls = tonumber(arg[1] or 1), tonumber(arg[2] or 2000)
math.randomseed(seed)
local random = math.random
local function pick(list) return list[random(#list)] end

-- ── what can be called ──
local functions = {}
local never = { edit = 1, cd = 1,
  help = 1, apropos = 1, examples = 1, view = 1, dofile = 1, test = 1, expect = 1,
  load = 1,
  save = 1,
  manual = 1, explain = 1 }
for name, value in pairs(pendula) do
  if type(value) == "function" and not never[name] then functions[#functions + 1] = { name, value } end
  if type(value) == "table" then
    for member, f in pairs(value) do
      if type(f) == "function" then functions[#functions + 1] = { name .. "." .. member, f } end
    end
  end
end
table.sort(functions, function(a, b) return a[1] < b[1] end)

local words = {}                  -- names of methods and fields, from the help pages
for line in io.lines(arg[3] or "/dev/null") do words[#words + 1] = line end
table.sort(words)

-- ── values ──
local x, y, z, k, u = var "x", var "y", var("z", 2), param("k", 2), input "u"
local ode = dae { der(x) ~ -k*x + y, der(y) ~ -x }
local index2 = dae { der(x) ~ y, 0 ~ x - sin(t) }
local pool = {}
local function add(value) pool[#pool + 1] = value end
for _, value in ipairs { 0, 1, -1, 2, 3, 0.5, -2.5, 1e-9, 1e9, 1e300, -1e300, 0/0, 1/0, 5e-324, 1 << 40, "",
  "x", "1/3",
  "x'", "radau", "no such thing", true, false, {}, { 1 }, { 1, 2, 3 }, { { 1, 2 }, { 3, 4 } }, { { 0 } },
    { x, y },
  { x = 1, y = 0 }, { start = { x = 1, y = 0 }, to = 1 }, { 0, 1, 0, 1 }, { {} }, { x, 1, "1/2" } } do
  add(value)
end
for _, value in ipairs { x, y, k, u, z, t, x*y, sin(x)/y, x^2 + 1, sqrt(x), abs(x), ifelse(lt(x, 0), x, y),
  x.dot, pi,
  rational(1, 3), vec { 1, 2 }, mat { { 1, 2 }, { 3, 4 } }, mat { { x, 1 }, { 0, y } }, zeros(2, 2), x ~ y,
    lt(x, y),
  ode, index2, index2:reduce(), tf({ 1 }, { 1, 2, 1 }), ss({ { -1 } }, { { 1 } }, { { 1 } }, { { 0 } }),
  tf({ 1 }, { 1, -0.5 }, 0.1), rk.rk4, rk.radau(2), bdf(2), plot({ 1, 2, 3 }), func("h", 1), vec {} } do
  add(value)
end
add(ode:integrate { start = { x = 1, y = 0 }, to = 1 })
local records = { y = {}, u = {} }
for i = 1, 40 do records.y[i], records.u[i] = math.sin(i^1.3), math.cos(i^1.7) end
add(iddata { y = records.y, u = records.u, Ts = 1 })
add(arx(pool[#pool], { na = 1, nb = 1, nk = 1 }))
add(function(...) return ... end)
add(function(a) return 2*a end)
local cyclic = {}
cyclic[1] = cyclic
add(cyclic)
local fixed = #pool

local keys = { "start", "to", "times", "method", "rtol", "atol", "dt", "fix", "guess", "inputs", "params",
  "events",
  "na", "nb", "nk", "order", "R", "r", "x", "A", "B", "C", "D", "b", "c", "T", "V", "q", "exact", "methods",
    "xlim" }
local function value(depth)
  local kind = random(8)
  if kind == 1 and depth < 2 then
    local list = {}
    for i = 1, random(0, 3) do list[i] = value(depth + 1) end
    return list
  end
  if kind == 2 and depth < 2 then
    local list = {}
    for _ = 1, random(0, 4) do list[pick(keys)] = value(depth + 1) end
    return list
  end
  return pool[random(#pool)]
end

-- ── calls ──
local made, failed = 0, 0
local accepted = {}               -- calls; changed in one argument they get farther than random ones
local function attempt(name, f, ...)
  made = made + 1
  local results = table.pack(pcall(f, ...))
  if results[1] and select("#", ...) > 0 then
    accepted[#accepted < 400 and #accepted + 1 or random(400)] = { name, f, table.pack(...) }
  end
  if not results[1] then
    failed = failed + 1
    local text = tostring(results[2])
    if text:find("internal error", 1, true) or text == "" then
      print(("seed %d, call %d, %s: %s"):format(seed, made, name, text))
      os.exit(1)
    end
  end
  for i = 2, math.min(results.n, 3) do
    local result = results[i]
    if not of_lua[type(result)] then
      local good, text = pcall(tostring, result)
      if not good and tostring(text):find("internal error", 1, true) then
        print(("seed %d, call %d, tostring of %s: %s"):format(seed, made, name, text))
        os.exit(1)
      end
      if #pool < fixed + 60 then add(result) else pool[fixed + random(60)] = result end
    end
  end
end

local operators = {
  function(a, b) return a + b end, function(a, b) return a - b end, function(a, b) return a*b end,
  function(a, b) return a/b end, function(a, b) return a^b end, function(a) return -a end,
    function(a) return #a end,
  function(a, b) return a ~ b end, function(a, b) return a[b] end, function(a, b) return a(b) end,
  function(a, b) return a == b end, function(a, b) return a < b end, function(a, b) return a .. b end,
}
while made < calls do
  local arguments = {}
  for i = 1, random(0, 3) do arguments[i] = value(0) end
  local kind = random(14)
  if kind > 10 and #accepted > 0 then
    local call = pick(accepted)
    local changed = table.move(call[3], 1, call[3].n, 1, {})
    changed[random(call[3].n + 1)] = value(0)
    attempt(call[1], call[2], table.unpack(changed, 1, call[3].n + 1))
  elseif kind <= 5 or #words == 0 then
    local f = pick(functions)
    attempt(f[1], f[2], table.unpack(arguments))
  elseif kind <= 9 then
    local word = pick(words)
    attempt(":" .. word, function(object, ...) return object[word](object, ...) end, pick(pool),
      table.unpack(arguments))
  else
    local a, b = value(0), value(0)
    attempt("an operator", pick(operators), a, b)
  end
end
print(("%d calls, %d refused"):format(made, failed))
