-- save, load, explain.
local file = os.tmpname() .. ".lua"
local function again(value)
  save(file, value)
  return load(file)
end

test("every reference problem and its forms come back the same", function()
  for _, name in ipairs { "exam_3d", "pendulum", "sphere_chain", "cstr", "nilpotent", "slider_crank",
    "car_axis",
    "transistor_amplifier", "hires", "mattsson_linear", "two_pendula", "akzo" } do
    local sys = problems[name]()
    local back = again(sys)
    expect(tostring(back)):equals(tostring(sys))
    expect(back:code()):equals(sys:code())
  end
end)

test("a form keeps its lineage, its gains and its parameter values", function()
  local sys = problems.pendulum()
  local at = problems.pendulum:start()
  for _, low in ipairs { sys:reduce(), sys:reduce "acc", sys:reduce "ggl", sys:reduce "dummy",
    sys:reduce "ode",
    sys:reduce("baumgarte", { alpha = 3, beta = "7/2" }), sys:first_order(), sys:implicit(),
      sys:semi_explicit():reduce(),
    sys:reduce "acc":with { L = 2 } } do
    local back = again(low)
    expect(tostring(back)):equals(tostring(low))
    expect(back.form):equals(low.form)
    expect(tostring(back:trace())):equals(tostring(low:trace()))
  end
  local back = again(sys:reduce())
  -- a start serves relatives
  local sol = back:integrate { start = at, to = 0.1, dt = 0.01, method = rk.rk4 }
  expect(sol.status):equals "finished"
end)

test("expressions, matrices and numbers can be saved too; other values are refused", function()
  local x = var "x_saved"
  expect(again(sin(x)^2/3)):equals(sin(x)^2/3)
  expect(again(mat { { x, 1 }, { 0, rational "1/3" } })):equals(mat { { x, 1 }, { 0, rational "1/3" } })
  expect(again(0.1)):equals(0.1)
  expect(function() save(file, print) end):fails "a function cannot be saved"
  expect(function() save(file, { run = { print } }) end):fails "run[1]: a function cannot be saved"
  expect(function() save(problems.pendulum(), file) end):fails "expected a file name first"
  expect(function() save("/no/such/place/model.lua", x) end):fails "cannot write"
  expect(function() load "/no/such/place/model.lua" end):fails "there is no file"
  expect(load "return 1 + 1"()):equals(2)
  expect(select(2, load "return +")):equals(select(2, load("return +")))
end)

test("a model whose inputs are variables cannot be written", function()
  local x, w = vars "x_s w_s"
  local sys = dae.semi_explicit { x = x, u = w, f = w - x }
  expect(function() sys:code() end):fails 'declare it with input "w_s"'
end)

test("explain knows models, forms, starts, solutions, tableaus and error texts", function()
  local x, y, z = vars "x_e y_e z_e"
  local sys = problems.pendulum()
  local at = problems.pendulum:start()
  explain(sys)
  for _, form in ipairs { "acc", "ggl", "baumgarte", "project", "dummy", "ode" } do
    explain(sys:reduce(form)) end
  explain(at)
  explain(sys:reduce():integrate { start = at, to = 0.1, dt = 0.01, method = rk.rk4 })
  explain(rk.rk4)
  explain(sys:structure())
  explain "sin"
  for _, call in ipairs { function() sys:init {} end, function() sys:init { fix = { x = 9 } } end,
    function() sys:integrate { start = at, to = 1, dt = 0.1, method = rk.rk4 } end,
    function() sys:reduce "minimal" end, function()
      dae { der(x) ~ z, der(y) ~ -z, 0 ~ sin(x) + y^5 + cos(x*y) }:reduce "minimal" end } do
    local _, message = pcall(call)
    explain(message)
  end
  expect(function() explain "no such thing at all" end):fails "this text is no error"
  expect(function() explain() end):fails "expected a value"
end)



test("a solution as a table with commas", function()
  local name = os.tmpname()
  local q = var("q_csv", 2)
  local sol = dae { der(q) ~ -q }:integrate { start = { [q] = { 1, 2 } }, to = 1, dt = 0.5, method = rk.rk4 }
  sol:csv(name)
  local lines = {}
  for line in io.lines(name) do lines[#lines + 1] = line end
  expect(#lines):equals(4)
  expect(select(2, lines[1]:gsub(",", ""))):equals(2)
  local t, a, b = lines[4]:match "^(.-),(.-),(.-)$"
  expect(tonumber(t)):equals(1)
  expect(tonumber(a)):equals(sol(q[1], 1))
  expect(tonumber(b)):equals(sol(q[2], 1))
  sol:csv(name, { q[1] + q[2], q })
  for line in io.lines(name) do lines = line end
  expect(select(2, lines:gsub(",", ""))):equals(3)
  expect(function() sol:csv() end):fails "expected a file name"
  expect(function() sol:csv "/no/such/place/run.csv" end):fails "cannot write"
  os.remove(name)
end)
os.remove(file)

test("tables of models, starts, data and systems come back", function()
  local x, v = vars "x_saved v_saved"
  local k = param("k_saved", 2)
  local m = dae { der(x) ~ v, der(v) ~ -k*x }
  local at = m:init { fix = { [x] = 1, [v] = 0.1 } }
  local all = { m = m, heavy = m:with { k_saved = 3 }, at = at,
    data = iddata { y = { 1, 2, 0/0 }, u = { 1, 2, 3 },
    Ts = 0.1 }, G = tf({ 1 }, { 1, 2 }), e = x^2 + sin(v), n = 1/3, s = 'a "b"\n\\c', list = { 1, { 2 } },
      b = true,
    ["two words"] = 2 }
  local back = again(all)
  expect(back.e):equals(all.e)
  expect(back.n):equals(1/3)
  expect(back.s):equals(all.s)
  expect(back.list[2][1]):equals(2)
  expect(back["two words"]):equals(2)
  expect(back.b):equals(true)
  expect(back.at(v)):equals(0.1)
  expect(back.data.missing):equals(1)
  expect(tostring(back.G:poles())):equals(tostring(all.G:poles()))
  expect(back.heavy:integrate { start = back.at, to = 1 }(k)[1]):equals(3)
  local ring = {}
  ring.ring = ring
  expect(function() save(file, ring) end):fails "contains itself"
  local sol = m:integrate { start = at, to = 1 }
  local kept = again(sol)
  expect(kept.values[tostring(x)][#kept.t]):equals(sol:final(x))
  expect(kept.status):equals "finished"
  expect(kept.model:integrate { start = kept.state, to = 2 }(x, 2)):near(sol:continue { to = 2 }(x, 2), 1e-6)
  expect(function() save(file, { a = { s = plot({ 0, 1 }) } }) end):fails "a.s: a figure cannot be saved"
end)

test("files that are cut or altered are refused", function()
  save(file, { a = 1, b = { "x", 2 } })
  local text = io.open(file):read "a"
  for cut = 1, #text - 2, 3 do
    local out = io.open(file, "w")
    out:write((text:sub(1, cut)))
    out:close()
    expect(function() return load(file) end):fails "load: "
  end
  for _, other in ipairs { "return os.exit()", "return { a = io.open('x') }", "while true do end return 1",
    "return (function() return 1 end)()" } do
    local out = io.open(file, "w")
    out:write(other)
    out:close()
    expect(function() return load(file) end):fails "load: "
  end
end)
