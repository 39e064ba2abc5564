-- Data: what is read, cut, detrended, resampled; and what is said about odd data.
local nan = 0/0
local function file(content)
  local name = os.tmpname()
  local f = io.open(name, "w")
  f:write(content)
  f:close()
  return name
end
local function read(content, options)
  local name = file(content)
  local good, d = pcall(iddata.read, name, options)
  os.remove(name)
  if not good then error((d:gsub(name:gsub("%W", "%%%0"), "FILE")), 0) end
  return d
end

test("tables of every dialect", function()
  for _, content in ipairs { "u,y\n1,2\n3,4\n", "u;y\n1;2\n3;4\n", "u\ty\r\n1\t2\r\n3\t4\r\n",
    "# note\nu y\n 1 2\n 3 4\n",
                             "\xEF\xBB\xBF\"u\",\"y\"\n1,2\n3,4", "u;y\n1,0;2,0\n3,0;4,0\n" } do
    local d = read(content)
    expect(d.y):near({ 2, 4 }, 0)
    expect(d.u):near({ 1, 3 }, 0)
  end
  expect(read("1 2\n3 4\n", { y = 2, u = 1 }).y):near({ 2, 4 }, 0)
  expect(read("t,u,y\n0,1,2\n0.5,1,2\n1,1,2\n").Ts):near(0.5, 0)
end)

test("missing values are counted, filled, left out", function()
  local d = read("u,y\n1,2\n,4\n5,NaN\n7,8\n")
  expect(d.missing):equals(2)
  expect(tostring(d):find("2 missing values: y at sample 3; u at sample 2", 1, true) ~= nil):is_true()
  expect(d:fill().u):near({ 1, 3, 5, 7 }, 0)
  expect(d:fill("previous").y):near({ 2, 4, 4, 8 }, 0)
  local m = fir(d, { nb = 1, nk = 0 })
  expect(m.rows):equals(2)
  expect(fir(iddata { y = { 1, nan, 3, 4 }, u = { 1, 2, 3, 4 } }, { nb = 1, nk = 0 }).theta):near({ 1 },
    1e-15)
  expect(function() m:predict(d) end):fails "d:fill()"
end)

test("odd files are refused with line and column", function()
  expect(function() read "u,y\n1,two\n" end):fails "FILE:2: 'two' in column y is not a number"
  expect(function() read "u,y\n1,2,3\n" end):fails "FILE:2: 3 values, but the header names 2"
  expect(function() read "" end):fails "holds no data"
  expect(function() read "u,y\n" end):fails "header line but no data"
  expect(function() read("a,b\n1,2\n") end):fails "which columns are outputs?"
  expect(function() read("a,b\n1,2\n", { y = "c" }) end):fails "has no column 'c'"
  expect(function() read("t,y\n0,2\n1,2\n5,3\n") end):fails "not equidistant"
  expect(function() iddata.read "/no/such/file.csv" end):fails "cannot open"
  expect(function() iddata.read "/" end):fails "cannot"
  expect(function() read("\0\1\2") end):fails "not a text file"
  expect(function() iddata.read "/etc/passwd.mat" end):fails "MATLAB"
end)

test("bad data", function()
  expect(function() iddata { y = { 1, 2, 3 }, u = { 1, 2 } } end):fails "y has 3 samples but u has 2"
  expect(function() iddata { u = { 1 } } end):fails "y is missing"
  expect(function() iddata { y = {} } end):fails "empty"
  expect(function() iddata { y = { 1, nil, 3 } } end):fails "entry 2 of y is nil"
  expect(function() iddata { y = { 1, "x" } } end):fails "entry 2 of y"
  expect(function() iddata { y = { 1, 1/0 } } end):fails "infinite at sample 2"
  expect(function() iddata { y = { 1 }, Ts = 0 } end):fails "Ts must be positive"
  expect(function() iddata { y = { 1 }, v = 2 } end):fails "unknown option 'v'"
  local d = iddata { y = { 1, 2, 3, 4 }, u = { 1, 0, 1, 0 } }
  expect(function() d:slice(0, 2) end):fails "samples 0 to 2 are out of range"
  expect(function() d:slice(3, 9) end):fails "samples 1 to 4"
  expect(function() d:split(1) end):fails "between 0 and 1"
  expect(function() d:detrend "quadratic" end):fails "unknown trend"
  expect(function() d:resample(-1) end):fails "positive"
  local tiny = iddata { y = { 1, 2, 3 }, Ts = 5e-324 }         -- found by fuzzing: the ratio is infinite
  expect(function() tiny:resample(0.5) end):fails "1e8 times"
  expect(function() arx(d, { na = -1, nb = 1 }) end):fails "na must not be negative"
  expect(function() arx(d, { na = 1.5 }) end):fails "whole number"
  expect(function() arx(d, {}) end):fails "all orders are zero"
  expect(function() arx(d, { na = 1, nb = { 1, 2 } }) end):fails "nb has 2 entries, but the data has 1 input"
  expect(function() arx(d, { na = 4, nb = 1 }) end):fails "no row is left"
  expect(function() arx(d, { na = 1, ic = "none" }) end):fails "unknown ic 'none'"
  expect(function() arx(iddata { y = { 1, 2, 3 } }, { na = 1, nb = 1 }) end):fails "no input"
  expect(function() arx(iddata { y = { nan, nan, nan }, u = { 1, 2, 3 } },
    { na = 1, nb = 1 }) end):fails "no row is complete"
end)

test("slice, split, detrend, merge", function()
  local d = iddata { y = { 1, 2, 4, 8 }, u = { 3, 3, 5, 5 }, Ts = 0.5 }
  expect(d:slice(2, 3).y):near({ 2, 4 }, 0)
  local e, v = d:split(0.5)
  expect(e.N + v.N):equals(4)
  expect(v.y):near({ 4, 8 }, 0)
  expect(d:detrend().u):near({ -1, -1, 1, 1 }, 0)
  expect(d:detrend().offsets.y):near(3.75, 0)
  expect(iddata { y = { 1, 3, 5, 7 } }:detrend("linear").y):near({ 0, 0, 0, 0 }, 4e-15)
  expect(d:detrend { y = 1 }.y):near({ 0, 1, 3, 7 }, 0)
  expect(d.y):near({ 1, 2, 4, 8 }, 0)                      -- nothing mutates
  local two = merge(e, v)
  expect(two.experiments):equals(2)
  expect(arx(two, { na = 1 }).rows):equals(2)              -- one row per experiment of two samples
  expect(two:slice(2, 4).experiments):equals(2)
end)

test("resample keeps what is below the new Nyquist frequency", function()
  local y = {}
  for i = 0, 999 do y[i + 1] = math.sin(0.05 * i) + 2 end
  local d = iddata { y = y, Ts = 1 }
  local r = d:resample(4)
  expect(r.N):equals(250)
  -- ripple of the Hamming window
  for i = 30, 220, 10 do expect(r.y[i]):near(math.sin(0.2 * (i - 1)) + 2, 5e-3) end
  for i = 0, 999 do y[i + 1] = math.sin(2.5 * i) end       -- above π/4: must vanish instead of folding
  r = iddata { y = y, Ts = 1 }:resample(4)
  for i = 30, 220, 10 do expect(r.y[i]):near(0, 5e-3) end
  expect(iddata { y = { 0, 2, 4 } }:resample(0.5, { method = "linear" }).y):near({ 0, 1, 2, 3, 4 }, 0)
  expect(iddata { y = { 0, 2, 4 } }:resample(0.5, { method = "hold" }).y):near({ 0, 0, 2, 2, 4 }, 0)
end)

test("written files read back as they were", function()
  local d = merge(iddata { y = { 1, 2, 0/0 }, u = { 4, 5, 6 }, Ts = 0.1 },
    iddata { y = { 7, 8, 9 }, u = { 1, 1/3, math.pi }, Ts = 0.1 })
  for _, ending in ipairs { ".csv", ".mat" } do
    local name = os.tmpname() .. ending
    d:save(name)
    local back = iddata.read(name)
    os.remove(name)
    expect(back.u):equals(d.u)
    expect(back.Ts):near(0.1, 1e-15)
    expect(back.experiments):equals(2)
    expect(back.missing):equals(1)
    expect(back.y[4]):equals(7)
  end
  local both = iddata { y = { { 1, 2 }, { 3, 4 }, { 5, 6 } }, u = { { 1, 2 }, { 3, 4 }, { 5, 7 } }, Ts = 2 }
  local name = os.tmpname() .. ".mat"
  both:save(name)
  expect(iddata.read(name).y):equals(both.y)
  expect(iddata.read(name, { y = "y2", u = "u1" }).y[3]):equals(6)
  os.remove(name)
  expect(function() both:csv "/no/such/folder/x.csv" end):fails "cannot write"
  expect(function() both:save "/no/such/folder/x.mat" end):fails "cannot write"
end)

test("signals are chosen by name or number", function()
  local d = iddata { y = { { 1, 2 }, { 3, 4 }, { 5, 6 } }, u = { { 1, 2 }, { 3, 4 }, { 5, 7 } },
    yname = { "a", "b" } }
  expect(d:select { y = "b", u = { 2 } }.y):equals(vec { 2, 4, 6 })
  expect(d:select { u = {} }.u.cols):equals(0)
  expect(d:select { y = { "b", "a" } }.y_names[1]):equals "b"
  expect(function() d:select { y = "c" } end):fails "there is no output 'c'"
  expect(function() d:select { y = {} } end):fails "at least one output"
  expect(d:detrend():select { y = "b" }.offsets.y):near(4, 1e-15)
  expect(d:resample { Ts = 2, method = "hold" }.N):equals(2)
  expect(d:detrend(0).y):equals(d:detrend "mean".y)
end)

test("columns answer to every spelling of their name", function()
  local th = var "theta"
  local q = var("q", 2)
  local file = os.tmpname()
  dae { der(th, 2) ~ -th }:integrate { start = { [th] = 1, [th.dot] = 0 }, to = 1,
    times = linspace(0, 1, 5) }:csv(file)
  for _, name in ipairs { "theta'", "theta′", "θ′", "theta_dot", "theta.dot", "θ.dot" } do
    expect(#iddata.read(file, { y = name }).y):equals(5)
    expect(iddata.read(file, { y = name }).y[1]):equals(0)
  end
  expect(iddata.read(file, { y = "theta" }).y[1]):equals(1)
  expect(function() iddata.read(file, { y = "thetas" }) end):fails "no column 'thetas'"
  dae { der(q) ~ -q }:integrate { start = { [q] = { 1, 2 } }, to = 1, times = linspace(0, 1, 3) }:csv(file)
  for _, name in ipairs { "q2", "q₂", "q_2", "q[2]" } do
    expect(iddata.read(file, { y = name }).y[1]):equals(2)
  end
  os.remove(file)
end)
