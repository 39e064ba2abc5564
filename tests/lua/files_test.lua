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
  expect(function() explain "no such thing at all" end):fails "this text is not an error"
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
  expect(kept:final(x)):equals(sol:final(x))
  expect(kept.status):equals "finished"
  expect(kept:continue { to = 2 }(x, 2)):near(sol:continue { to = 2 }(x, 2), 1e-6)
  expect(function() save(file, { a = { s = print } }) end):fails "a.s: a function cannot be saved"
end)

local x, v = vars "x_kept v_kept"
local r = input "r_kept"
local ball = dae { der(x) ~ v, der(v) ~ -9.81 }
local jumps = ball:integrate { start = { [x] = 1, [v] = 0 }, to = 3,
  events = { { when = x, direction = -1, reset = { [v] = -0.9*v } } } }

local function near_everywhere(a, b, e, tolerance)
  for i = 0, 400 do
    local at = a.t[1] + (a.t[#a.t] - a.t[1])*i/400
    expect(b(e, at)):near(a(e, at), tolerance)
  end
end

test("a saved solution knows what lies between its points", function()
  local back = again(jumps)
  near_everywhere(jumps, back, x, 1e-8)
  near_everywhere(jumps, back, v.dot, 1e-8)
  expect(#back.events):equals(#jumps.events)
  expect(back.events[2].after):equals(jumps.events[2].after)
  expect(tostring(back)):equals(tostring(jumps))
  expect(tostring(back:stats())):equals(tostring(jumps:stats()))
  expect(#back:curve { x }[1] > 100):equals(true)
  local lag = dae { der(x) ~ r - x }
  local few = lag:integrate { start = { [x] = 0 }, to = 50, inputs = { [r] = sin(t) }, times = { 0, 50 } }
  near_everywhere(few, again(few), x, 1e-8)
  near_everywhere(few, again(few), r, 1e-12)
  local step = lag:integrate { start = { [x] = 0 }, to = 5,
    inputs = { [r] = function(time) if time < 1 then return 0 end return 1 end } }
  near_everywhere(step, again(step), x, 1e-8)
  expect(again(step)(r, 2)):equals(1)
  local fixed = lag:integrate { start = { [x] = 1 }, to = 1, dt = 0.1, method = rk.gauss(2),
    inputs = { [r] = 0 } }
  near_everywhere(fixed, again(fixed), x, 1e-9)
  local stopped = dae { der(x) ~ x^2 }:integrate { start = { [x] = 1 }, to = 2 }
  expect(again(stopped).status):equals(stopped.status)
end)

test("a saved solution says what the run said about its errors", function()
  local x = var "x"
  local growing = dae { der(x) ~ t*x }:integrate {
    start = { x = 1 }, to = 24, rtol = 1e-3, method = "dop853" }
  local knee = dae { der(x) ~ ((1 - t)*x - x^2)/1e-6 + 1e-20 }:integrate {
    start = { x = 1 }, to = 2, rtol = 1e-3, method = "bdf" }
  local root = dae { der(x) ~ sqrt(x) }:integrate { start = { x = 0 }, to = 1 }
  local small = dae { der(x) ~ (t - 12)*x }:integrate { start = { x = 1 }, to = 24, atol = 1e-9 }
  for words, sol in pairs { ["add up to"] = growing, ["an error there decides"] = small,
    ["neighbours depart"] = knee, ["not unique"] = root } do
    expect(tostring(sol)):matches(words)
    local back = again(sol)
    expect(tostring(back)):equals(tostring(sol))
    expect(back:stats().errors):near(sol:stats().errors, 1e-12)
  end
end)

test("solutions of constrained models keep their drift", function()
  local sys = problems.pendulum()
  for _, form in ipairs { "ggl", "acc", "project" } do
    local sol = sys:reduce(form):integrate { start = problems.pendulum:start(), to = 0.5 }
    expect(tostring(again(sol):drift())):equals(tostring(sol:drift()))
  end
end)

test("figures come back as they are drawn", function()
  for _, fig in ipairs { plot(jumps, x), plot(jumps, { x, v }, { right = { 2 } }),
    layout({ 2, 1 }, plot(jumps, x), plot(jumps, v)),
    phase(dae { der(x) ~ v, der(v) ~ -sin(x) }, x, v, { xlim = { -4, 4 }, ylim = { -3, 3 } }),
    heatmap({ 0, 1, 2 }, { 0, 1, 2 }, function(a, b) return a*b end), semilogy({ 1, 10 }, { 1, 2 }),
    band({ 0, 1 }, { 0, 1 }, { 1, 2 }), plot3 { surfaces = { sphere(1) } }, rk.rk4:plot(),
    plot({ 1, 0/0, 3 }, { title = 'a "b"', hlines = { 1, { 2, "limit" } }, texts = { { 1, 1, "hi" } },
      theme = "dark", legend = "top left", dash = "dotted" }) } do
    local back = again(fig)
    expect(back:text()):equals(fig:text())
    expect(table.concat(back.notes, "; ")):equals(table.concat(fig.notes, "; "))
  end
end)

test("methods, distributions, transfer functions and results of fits", function()
  for _, value in ipairs { rk.gauss(3), rk.dopri5, rosenbrock.rodas4, bdf(2),
    tableau { A = { { 0, 0 }, { 1, 0 } },
    b = { "1/2", "1/2" }, name = "mine" }, normal(1, 2), tf({ 1 }, { 1, 2 }), tf({ 1 }, { 1, 2 }, 0.1),
    complex(1, 2) } do
    expect(tostring(again(value))):equals(tostring(value))
  end
  local model = arx(iddata { y = { 1, 0.6, 0.4, 0.3 }, u = { 1, 2, 1, 2 }, Ts = 1 },
    { na = 1, nb = 1, nk = 1 })
  local kept = again(model)
  expect(kept.theta):equals(model.theta)
  expect(tostring(kept)):equals(tostring(model))
end)

test("a saved pair of methods takes the same steps", function()
  local lag = dae { der(x) ~ 1 - x }
  local heun = tableau { A = { {}, { 1 } }, b = { "1/2", "1/2" }, bhat = { 1, 0 }, error_scale = 4 }
  local function steps(method)
    return lag:integrate { start = { [x] = 0 }, to = 1, method = method }:stats().steps
  end
  for _, method in ipairs { heun, rk.verner87, rk.dop853, rk.dopri5 } do
    expect(steps(again(method))):equals(steps(method))
  end
  expect(again(heun).error_scale):equals(4)
  expect(tostring(again(rk.dop853).bhat2)):equals(tostring(rk.dop853.bhat2))
end)

test("every kind of file that is cut off is refused, with its line", function()
  for _, value in ipairs { jumps, plot { 0, 1 }, ball, tf({ 1 }, { 1, 2 }),
    { at = ball:init { fix = { [x] = 1, [v] = 2 } } } } do
    save(file, value)
    local text = io.open(file):read "a"
    for part = 1, 9 do
      local out = io.open(file, "w")
      out:write((text:sub(1, #text*part//10)))
      out:close()
      expect(function() return load(file) end):fails(file .. ":")
    end
  end
  save(file, jumps)
  local text = io.open(file):read "a"
  for from, to in pairs { ['"finished"'] = '"flying"', ["points = {{"] = "points = {{1.0, ",
    ["solution_of_parts"] = "os.exit",
    ["pieces = {{0.0"] = "pieces = {{1e9", ["der%("] = "dre(" } do
    local out = io.open(file, "w")
    out:write((text:gsub(from, to, 1)))
    out:close()
    expect(function() return load(file) end):fails(file .. ":")
  end
end)

test("a session is one file, a MATLAB file takes columns", function()
  rawset(_G, "kept_number", 12)
  rawset(_G, "kept_run", jumps)
  local session = os.tmpname() .. ".pend"
  save(session)
  rawset(_G, "kept_number", nil)
  load(session)
  expect(rawget(_G, "kept_number")):equals(12)
  expect(rawget(_G, "kept_run")(x, 1)):near(jumps(x, 1), 1e-9)
  rawset(_G, "kept_number", nil)
  rawset(_G, "kept_run", nil)
  local mat_file = os.tmpname() .. ".mat"
  save(mat_file, jumps)
  expect(iddata.read(mat_file, { y = "x_kept", Ts = 1 }).y[3]):near(jumps(x)[3], 1e-15)
  save(mat_file, { ["x'"] = { 1, 2 }, ["motor.w"] = { 3, 4 } })
  expect(iddata.read(mat_file, { y = "x_dot", u = "motor_w", Ts = 1 }).u[2]):equals(4)
  expect(function() save(mat_file, "text") end):fails "a .mat file takes"
  expect(function() save(file) end):fails "expected a value second"
  os.remove(session)
  os.remove(mat_file)
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

os.remove(file)

test("estimates and other results come back with their methods", function()
  local x, k = var "x_fit", param("k_fit", 1)
  local u, y = {}, {}
  for i = 1, 60 do u[i] = (-1)^(i*i//3); y[i] = 0.5*(y[i-1] or 0) + (u[i-1] or 0) + ((7*i) % 5)/90 end
  local d = iddata { y = y, u = u, Ts = 0.5 }
  local samples = iddata { y = { 2.02, 1.49, 1.09, 0.83, 0.59, 0.46 }, Ts = 1 }
  local decay = dae { der(x) ~ -k*x }
  local all = {
    arx = arx(d, { na = 1, nb = 1 }), oe = oe(d, { nb = 1, nf = 1 }), n4sid = n4sid(d, 2),
    fit = fit(decay, { params = { k }, data = samples, y = x, start = { x_fit = 2 } }),
    spa = spa(d, { window = 8 }), newton = newton { r = x^2 - 2, start = { 1 } },
    sweep = sweep(decay, { start = { x_fit = 1 }, to = 1, params = { k_fit = { 1, 2, 3 } } }),
  }
  local back = again(all)
  for name, value in pairs(all) do expect(tostring(back[name])):equals(tostring(value)) end
  expect(back.arx:fit(d)):equals(all.arx:fit(d))
  expect(tostring(back.oe:tf())):equals(tostring(all.oe:tf()))
  expect(back.fit:profile(k, { points = 5 }).low):near(all.fit:profile(k, { points = 5 }).low, 1e-9)
  expect(back.sweep:final(x)[3]):equals(all.sweep:final(x)[3])
  expect(tostring(back.spa:plot())):equals(tostring(all.spa:plot()))
  expect(back.newton.x):equals(all.newton.x)
  expect(tostring(again(back.fit))):equals(tostring(all.fit))                -- and once more
  local options = { na = 1, nb = 1 }                    -- what was asked, not what became of it
  local m = arx(d, options)
  options.na = 3
  expect(tostring(again(m))):equals(tostring(m))
  local f = function(e) return e end
  expect(again(newton { r = function(z) return { z[1]^2 - 2 } end, start = { 1 } }).type):equals "newton"
  expect(function() save(file, f) end):fails "a function cannot be saved"
end)

test("a saved file that was cut or altered is refused with its line", function()
  local x, k = var "x_cut", param("k_cut", 1)
  local decay = dae { der(x) ~ -k*x }
  local d = iddata { y = { 2.02, 1.49, 1.09, 0.83, 0.59, 0.46 }, Ts = 1 }
  local sol = decay:integrate { start = { x_cut = 1 }, to = 1 }
  local estimate = fit(decay, { params = { k }, data = d, y = x, start = { x_cut = 2 } })
  local kinds = { sol, plot(sol, x), d, decay, estimate,
    arx(d, { na = 1 }), tf({ 1 }, { 1, 2 }), rk.rk4, mat { { x, 1 }, { 2, 3 } }, { a = 1, b = { "two" } },
    sweep(decay, { start = { x_cut = 1 }, to = 1, params = { k_cut = { 1, 2 } } }) }
  for i, value in ipairs(kinds) do
    save(file, value)
    local text = io.open(file):read "a"
    for j = 1, 12 do
      local out = io.open(file, "w")
      out:write(text:sub(1, #text*j//13))
      out:close()
      local good, why = pcall(load, file)
      if good or not tostring(why):find "load: [^\n]*:%d+: " then
        error(("kind %d cut at %d of 13: %s"):format(i, j, tostring(why)), 0)
      end
    end
    for _, change in ipairs { "os.exit()  return", "return = ", "return io.open " } do
      local out = io.open(file, "w")
      out:write((text:gsub("return", change, 1)))
      out:close()
      expect(function() load(file) end):fails "load: "
    end
  end
  local out = io.open(file, "w")
  out:write 'local m = dae { der(var "x") ~ 1 }\nreturn sweep(m, { to = 1, runs = 2, store = "evil.db" })\n'
  out:close()
  expect(function() load(file) end):fails "2: 'store' and 'on' are not part of a saved value"
end)

test("a solution is written at equal times, and read back", function()
  local x, k = var "x", param("k", 2)
  local sol = dae{ der(x) ~ -k*x }:integrate { start = { x = 1 }, to = 1 }
  local name = os.tmpname() .. ".csv"
  sol:csv(name, { times = linspace(0, 1, 11) })
  local d = iddata.read(name, { y = "x" })
  expect(d.N):equals(11)
  expect(d.y[11]):near(sol(x, 1), 1e-12)
  sol:csv(name, { x^2 }, { times = { 0, 0.5, 1 } })
  expect(iddata.read(name, { y = "x²" }).y[2]):near(sol(x, 0.5)^2, 1e-12)
  expect(function() sol:csv(name, { x }, { time = 1 }) end):fails "times"
  sol:csv(name)
  expect(function() iddata.read(name, { y = "x" }) end):fails "times = linspace"
  os.remove(name)
end)

test("a MATLAB file is loaded by names", function()
  local x, name = var "x", os.tmpname() .. ".mat"
  local sol = dae{ der(x, 2) ~ -x }:integrate { start = { x = 1, [x.dot] = 0 }, to = 1 }
  save(name, sol)
  local back = load(name)
  expect(back.t.rows):equals(#sol.t)
  expect(back.x_dot[#sol.t]):near(sol:final(x.dot), 1e-14)
  save(name, { a = 2.5, B = mat{{1, 2}, {3, 4}} })
  back = load(name)
  expect(back.a):equals(2.5)
  expect(back.B(2, 1)):equals(3.0)
  save(name, iddata{ y = { 1, 2, 3 }, u = { 0, 1, 0 }, Ts = 0.5 })
  expect(iddata(load(name)).Ts):equals(0.5)
  expect(function() load "nothing.mat" end):fails "there is no such file"
  os.remove(name)
end)
