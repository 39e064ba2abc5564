-- Every function of linear systems and identification refuses an option that it does not know, by name.
local u, y = {}, {}
for t = 1, 120 do
  u[t] = (-1)^(t * t // 3); y[t] = 0.5 * (y[t-1] or 0) + (u[t-1] or 0) + 0.1 * math.sin(t^3)
end
local d = iddata { y = y, u = u }
local G, D = tf({1}, {1, 2}), c2d(tf({1}, {1, 2}), 0.1)
local m, s = arx(d, { na = 1, nb = 1 }), n4sid(d, { order = 1 })
local x, k = var "x", param("k", 1)
local sys = dae { der(x) ~ -k * x }
local r = fit(sys, { params = { k }, data = iddata { y = { 2, 1.2, 0.7, 0.5 } }, y = x, start = { x = 2 } })
local at = sys:init { fix = { x = 1 } }

local calls = {
  arx = function() arx(d, { na = 1, nb = 1, surplus = 1 }) end,
  fir = function() fir(d, { nb = 1, surplus = 1 }) end,
  armax = function() armax(d, { na = 1, nb = 1, nc = 1, surplus = 1 }) end,
  oe = function() oe(d, { nb = 1, nf = 1, surplus = 1 }) end,
  bj = function() bj(d, { nb = 1, nf = 1, nc = 1, nd = 1, surplus = 1 }) end,
  pem = function() pem(d, { na = 1, nb = 1, surplus = 1 }) end,
  refine = function() pem(d, s, { surplus = 1 }) end,
  iv4 = function() iv4(d, { na = 1, nb = 1, surplus = 1 }) end,
  n4sid = function() n4sid(d, { order = 1, surplus = 1 }) end,
  regressor = function() regressor(d, { na = 1, nb = 1, surplus = 1 }) end,
  order_scan = function() order_scan(d, { na = 1, nb = 1, surplus = 1 }) end,
  scan_nil = function() order_scan(d, nil, { na = 1, surplus = 1 }) end,
  predict = function() m:predict(d, { surplus = 1 }) end,
  simulate = function() m:simulate(d, { surplus = 1 }) end,
  residuals = function() m:residuals(d, { surplus = 1 }) end,
  fit_of = function() m:fit(d, { surplus = 1 }) end,
  rmse = function() m:rmse(d, { surplus = 1 }) end,
  validate = function() m:validate(d, { surplus = 1 }) end,
  forecast = function() m:forecast(d, 1, { u = { 1 }, surplus = 1 }) end,
  forecasts = function() m:forecasts(d, 1, { u = { 1 }, surplus = 1 }) end,
  iddata = function() iddata { y = y, u = u, surplus = 1 } end,
  fit = function() fit(sys, { params = { k }, data = iddata { y = y }, y = x, surplus = 1 }) end,
  lsq = function() lsq({ { 1 }, { 2 } }, { 1, 2 }, { surplus = 1 }) end,
  nlsq = function() nlsq(function(p) return p end, { 1 }, { surplus = 1 }) end,
  spa = function() spa(d, { surplus = 1 }) end,
  etfe = function() etfe(d, { surplus = 1 }) end,
  welch = function() welch(y, { surplus = 1 }) end,
  coherence = function() coherence(d, { surplus = 1 }) end,
  impulse_estimate = function() impulse_estimate(d, { surplus = 1 }) end,
  cra = function() cra(d, { surplus = 1 }) end,
  delay_estimate = function() delay_estimate(d, { surplus = 1 }) end,
  rarx = function() rarx(d, { na = 1, nb = 1, surplus = 1 }) end,
  rarmax = function() rarmax(d, { na = 1, nb = 1, surplus = 1 }) end,
  process_model = function() process_model(d, "P1", { surplus = 1 }) end,
  tfest = function() tfest(d, { np = 1, surplus = 1 }) end,
  hammerstein = function() hammerstein(d, { nb = 1, surplus = 1 }) end,
  uncertain = function() uncertain(m, { surplus = 1 }) end,
  ekf = function() ekf(sys, { surplus = 1 }) end,
  estimator = function() estimator(sys, 1, { y = x, surplus = 1 }) end,
  kalman_filter = function() kalman_filter(D, 1, 1, { y = y, surplus = 1 }) end,
  ss = function() ss { A = {{1}}, B = {{1}}, C = {{1}}, surplus = 1 } end,
  c2d = function() c2d(G, 0.1, "tustin", { surplus = 1 }) end,
  lsim = function() lsim(G, y, linspace(0, 1, 120), nil, { surplus = 1 }) end,
  step = function() G:step { to = 1, surplus = 1 } end,
  impulse = function() G:impulse { to = 1, surplus = 1 } end,
  linearize = function() sys:linearize(at, { surplus = 1 }) end,
  data_plot = function() d:plot { surplus = 1 } end,
  model_plot = function() m:plot(d, { surplus = 1 }) end,
  comparison_plot = function() compare(d, m):plot { surplus = 1 } end,
  validation_plot = function() m:validate(d):plot("auto", { surplus = 1 }) end,
  fit_plot = function() r:plot { surplus = 1 } end,
  bode_plot = function() G:bode():plot { surplus = 1 } end,
  step_plot = function() G:step():plot { surplus = 1 } end,
  nyquist = function() nyquist(G, nil, { surplus = 1 }) end,
  pzmap = function() pzmap(G, { surplus = 1 }) end,
  rlocus = function() rlocus(G, nil, { surplus = 1 }) end,
  spa_plot = function() spa(d):plot { surplus = 1 } end,
  uncertain_plot = function() uncertain(m):bode():plot { surplus = 1 } end,
  read = function() iddata.read("scripts/data/hairdryer.csv", { y = 1, u = 2, surplus = 1 }) end,
  idpoly = function() idpoly { A = {1, 0.5}, B = {1}, surplus = 1 } end,
  idpoly_predict = function() idpoly { A = {1, 0.5}, B = {1} }:predict(d, { surplus = 1 }) end,
  prbs = function() prbs(15, { surplus = 1 }) end,
  multisine = function() multisine(64, { surplus = 1 }) end,
  chirp = function() chirp(64, { from = 0.1, to = 0.2, surplus = 1 }) end,
  square = function() square(64, { period = 8, surplus = 1 }) end,
  sawtooth = function() sawtooth(64, { period = 8, surplus = 1 }) end,
  detrend = function() d:detrend { surplus = 1 } end,
  resample = function() d:resample(2, { surplus = 1 }) end,
  method_c2d = function() G:c2d(0.1, "tustin", { surplus = 1 }) end,
  method_lsim = function() G:lsim(y, linspace(0, 1, 120), nil, { surplus = 1 }) end,
  method_nyquist = function() G:nyquist(nil, { surplus = 1 }) end,
  method_pzmap = function() G:pzmap { surplus = 1 } end,
  profile = function() r:profile(k, { surplus = 1 }) end,
  estimate = function()
    local Y, U = func "y", func "u"
    predictor(k * Y(t - 1) + U(t - 1)):estimate(d, { surplus = 1 })
  end,
}

for name, call in pairs(calls) do
  test(name .. " refuses an option it does not know", function() expect(call):fails "surplus" end)
end

-- ── is every function here that has options? ───────────────────────────────────────────────────────────────

-- What another process of this program prints.
local function shown(lines)
  local path = os.tmpname()
  local f = io.open(path, "w")
  f:write(table.concat(lines, "\n"))
  f:close()
  local pipe = io.popen("/proc/$PPID/exe " .. path)
  local all = pipe:read "a"
  pipe:close()
  return all
end

-- The help of each name, by name.
local function pages(names)
  local lines, found = {}, {}
  for _, name in ipairs(names) do lines[#lines + 1] = ("print '\\1%s' help %q"):format(name, name) end
  for name, page in shown(lines):gmatch "\1(%S+)\n([^\1]*)" do found[name] = page end
  return found
end

test("every function and method with options is called above", function()
  local names, section, types = {}, "", {}
  for line in shown { "help()" }:gmatch "[^\n]+" do
    local head, rest = line:match "^(%S.-)%s%s+(.*)$"
    if line:find "^%S" then section = head or line else rest = line end
    if section:find "^Identification" or section:find "^Linear systems" or section:find "^Input signals" then
      for name in (rest or ""):gmatch "%S+" do names[#names + 1] = name end
    end
  end
  expect(#names > 80):is_true()
  for _, name in ipairs { "idmodel", "iddata", "lti", "validation", "order_scan_result", "comparison",
    "fit_result", "response", "predictor", "idpoly", "parameter_set" } do
    types[#types + 1] = name
  end
  local methods = {}
  for name, page in pairs(pages(types)) do
    local own = page:match("\n" .. name .. "\n(.*)$") or page     -- behind a function of that name
    for method in own:gmatch "\n  %w+:([%w_]+)%(" do methods[#methods + 1] = name .. ":" .. method end
  end
  expect(#methods > 60):is_true()
  table.move(methods, 1, #methods, #names + 1, names)
  local text, missing = io.open "tests/sysid/surplus_test.lua":read "a", {}
  for name, page in pairs(pages(names)) do
    local called = name:find ":" and name:match ":.*" or "[^%w_]" .. name:gsub("%.", "%%.")
    if page:find "\n  options\n" and not text:find(called .. "%s*[%({]") then missing[#missing + 1] = name end
  end
  table.sort(missing)
  expect(table.concat(missing, ", ")):equals ""
end)
