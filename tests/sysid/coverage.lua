-- Do 95 % bounds cover the truth in 95 % of the cases? Every estimator that states deviations, on simulated
-- records. ./dev intervals [runs] [name]; coverage_test.lua is the short version.
local coverage = { cases = {} }
local z = 1.959964

-- estimate() -> estimates, standard deviations, truths (lists)
local function case(name, quick, estimate)
  coverage.cases[#coverage.cases + 1] = { name = name, quick = quick, estimate = estimate }
end

-- w = B/F u, b from delay 1
local function filtered(b, f, u)
  local w = {}
  for t = 1, #u do
    local sum = 0
    for k = 1, #b do sum = sum + b[k] * (u[t - k] or 0) end
    for k = 1, #f do sum = sum - f[k] * (w[t - k] or 0) end
    w[t] = sum
  end
  return w
end

-- C/A e of white e; all lists without the leading 1
local function coloured(N, c, a, noise)
  local e, v = randn(N), {}
  for t = 1, N do
    local sum = e[t]
    for k = 1, #c do sum = sum + c[k] * (t > k and e[t - k] or 0) end
    v[t] = noise * sum
  end
  local w = {}
  for t = 1, N do
    local sum = v[t]
    for k = 1, #a do sum = sum - a[k] * (w[t - k] or 0) end
    w[t] = sum
  end
  return w
end

local function white(N)
  local r, u = randn(N), {}
  for t = 1, N do u[t] = r[t] end
  return u
end

local function plus(a, b)
  local sum = {}
  for t = 1, #a do sum[t] = a[t] + b[t] end
  return sum
end

-- y = B/F u + C/D e
local function record(N, b, f, c, d, noise)
  local u = white(N)
  return iddata { y = plus(filtered(b, f, u), coloured(N, c, d, noise)), u = u }
end

local function both(m, truth) return m.theta, m.std, truth end
local a, b, truth = { -1.2, 0.5 }, { 1, 0.5 }, { -1.2, 0.5, 1, 0.5 }

case("arx", 40, function() return both(arx(record(300, b, a, {}, a, 0.5), { na = 2, nb = 2 }), truth) end)
case("arx in a closed loop", 40, function()
  local e, r, y, u = randn(300), randn(300), {}, {}
  for t = 1, 300 do
    y[t] = 0.9 * (y[t - 1] or 0) + 0.5 * (u[t - 1] or 0) + 0.5 * e[t]
    u[t] = r[t] - 0.8 * y[t]
  end
  return both(arx(iddata { y = y, u = u }, { na = 1, nb = 1 }), { -0.9, 0.5 })
end)
case("fir", 40, function() return both(fir(record(200, b, {}, {}, {}, 0.5), { nb = 2 }), b) end)
case("armax", 30, function()
  return both(armax(record(400, b, a, { 0.6 }, a, 0.5), { na = 2, nb = 2, nc = 1 }),
    { -1.2, 0.5, 1, 0.5, 0.6 })
end)
case("armax with a tenth of the samples missing", 3, function()
  local d, y, q = record(400, { 1 }, { -0.7 }, { 0.5 }, { -0.7 }, 0.5), {}, rand(400)
  local all = d.y
  for t = 1, 400 do y[t] = q[t] < 0.1 and 0/0 or all(t, 1) end
  return both(armax(iddata { y = y, u = d.u }, { na = 1, nb = 1, nc = 1 }), { -0.7, 1, 0.5 })
end)
case("oe", 30, function()
  return both(oe(record(400, b, a, {}, {}, 0.5), { nb = 2, nf = 2 }), { 1, 0.5, -1.2, 0.5 })
end)
case("bj", 20, function()
  local m = bj(record(400, b, a, { 0.4 }, { -0.7 }, 0.5), { nb = 2, nf = 2, nc = 1, nd = 1 })
  return both(m, { 1, 0.5, 0.4, -0.7, -1.2, 0.5 })
end)
case("pem of all polynomials", 10, function()
  local u = white(400)
  local d = iddata { u = u, y = filtered({ 1, 0.5 }, { -1, 0.26 }, u) }     -- A = 1 - 0.5 q⁻¹, F = A
  local y, e = d.y, coloured(400, { 0.4 }, { -0.5 }, 0.5)
  local list = {}
  for t = 1, 400 do list[t] = y(t, 1) + e[t] end
  return both(pem(iddata { u = u, y = list }, { na = 0, nb = 2, nf = 2, nc = 1, nd = 1 }),
    { 1, 0.5, 0.4, -0.5, -1, 0.26 })
end)
case("iv4", 20, function()
  return both(iv4(record(600, b, a, { 0.6 }, a, 0.5), { na = 2, nb = 2 }), truth)
end)
case("rarx", 10, function()
  local r = rarx(record(300, { 1 }, { -0.7 }, {}, { -0.7 }, 0.5), { na = 1, nb = 1 })
  return r.theta[300], r.std[300], { -0.7, 1 }
end)
case("rarmax", 10, function()
  local r = rarmax(record(1000, { 1 }, { -0.7 }, { 0.4 }, { -0.7 }, 0.5), { na = 1, nb = 1, nc = 1 })
  return r.theta[1000], r.std[1000], { -0.7, 1, 0.4 }
end)

-- Gain of B/F at w.
local function gain(num, den, w)
  local function size(p, from)
    local re, im = from == 0 and 1 or 0, 0
    for k, v in ipairs(p) do re, im = re + v * math.cos(w * k), im - v * math.sin(w * k) end
    return math.sqrt(re^2 + im^2)
  end
  return size(num, 1) / size(den, 0)
end
local w = { 0.1, 0.5, 1.5 }
local gains = { gain(b, a, 0.1), gain(b, a, 0.5), gain(b, a, 1.5) }

case("uncertain: gain of oe", 10, function()
  local r = uncertain(oe(record(400, b, a, {}, {}, 0.5), { nb = 2, nf = 2 })):bode(w)
  return r.mag, r.mag_std, gains
end)
case("uncertain: step of oe", 8, function()
  local r = uncertain(oe(record(400, b, a, {}, {}, 0.5), { nb = 2, nf = 2 })):step(10)
  local ones = {}
  for t = 1, 11 do ones[t] = 1 end
  local step = filtered(b, a, ones)
  return { r.y[3], r.y[5], r.y[11] }, { r.std[3], r.std[5], r.std[11] }, { step[3], step[5], step[11] }
end)
case("uncertain: poles of oe", 8, function()
  local r = uncertain(oe(record(400, b, a, {}, {}, 0.3), { nb = 2, nf = 2 })):poles()
  return { r.re[1], math.abs(r.im[1]) }, { r.std_re[1], r.std_im[1] }, { 0.6, math.sqrt(0.14) }
end)
case("uncertain: gain of a state-space model, pem of n4sid", 4, function()
  local d = record(300, b, a, { 0.3 }, a, 0.5)
  local r = uncertain(pem(d, n4sid(d, 2))):bode(w)
  return r.mag, r.mag_std, gains
end)
case("spa", 8, function()
  local r = spa(record(1000, b, { -0.3 }, {}, {}, 0.5), { window = 30, w = w })
  return r.mag, r.std, { gain(b, { -0.3 }, 0.1), gain(b, { -0.3 }, 0.5), gain(b, { -0.3 }, 1.5) }
end)

local impulse = filtered(b, a, { 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0 })
local taps = { impulse[2], impulse[3], impulse[4], impulse[5], impulse[8], impulse[11] }
local function chosen(list) return { list[2], list[3], list[4], list[5], list[8], list[11] } end

case("impulse_estimate", 8, function()
  local r = impulse_estimate(record(400, b, a, {}, a, 0.5), { lags = 25 })
  return chosen(r.g), chosen(r.std), taps
end)

-- What is Bayesian covers on the average over its prior: impulse responses from the TC kernel itself.
local function from_prior(kind)
  local n, g, xi = 20, {}, randn(21)
  local value = 0
  for k = n, 1, -1 do                     -- min(λ^i, λ^j): increments of a walk that runs backwards
    value = value + math.sqrt(0.8^k - 0.8^(k + 1)) * xi[k]
    g[k] = value
  end
  local m = fir(record(200, g, {}, {}, {}, 0.3), { nb = n, kernel = kind })
  return both(m, g)
end
case("fir with kernel TC, responses from the prior", 8, function() return from_prior "TC" end)
case("fir with kernel DC, responses from the prior", 6, function() return from_prior "DC" end)

local function held(u)
  for t = 1, #u do u[t] = (t // 17) % 2 + 0.3 * ((t // 5) % 2) end
  return u
end
local function noisy(clean, noise)
  local y, e = {}, randn(#clean)
  for t = 1, #clean do y[t] = clean[t] + noise * e[t] end
  return y
end
local hold = held(white(150))
local first = held_response({ 3 }, { 5, 1 }, 1.3, hold, 1)
local second = held_response({ 2, 1 }, { 3, 2, 1 }, 0, hold, 0.7)
case("process model", 4, function()
  local d = iddata { y = noisy(first, 0.1), u = hold }
  return both(process_model(d, "P1D", { ic = "zero" }), { 3, 5, 1.3 })
end)
case("tfest", 4, function()
  local m = tfest(iddata { y = noisy(second, 0.1), u = hold, Ts = 0.7 }, { np = 2, nz = 1, ic = "zero" })
  return both(m, { 2/3, 1/3, 2/3, 1/3 })    -- (2 s + 1)/(3 s² + 2 s + 1) with the denominator monic
end)

local x, k, m, c = var "x", param("k", 0.3), param("m", 1), param("c", 0.4)
local decay = dae { der(x) ~ -k * x }
case("grey box: decay with an unknown start", 6, function()
  local e, y = randn(40), {}
  for i = 0, 39 do y[i + 1] = 2 * math.exp(-0.5 * i * 0.1) + 0.05 * e[i + 1] end
  local d = iddata { y = y, Ts = 0.1 }
  local r = fit(decay, { params = { k, x }, data = d, y = x, guess = { k = 0.4, x = 1.5 } })
  return both(r, { 0.5, 2 })
end)
local q, v = vars "q v"
local swing = dae { der(q) ~ v, m * der(v) ~ -c * v - 4 * q }
case("grey box: damped oscillation", 4, function()
  local e, y = randn(80), {}
  local delta = 0.25 / (2 * 1.2)
  local omega = math.sqrt(4 / 1.2 - delta^2)
  for i = 0, 79 do
    local t = 0.1 * i
    y[i + 1] = math.exp(-delta * t) * (math.cos(omega * t) + delta / omega * math.sin(omega * t))
      + 0.05 * e[i + 1]
  end
  local d = iddata { y = y, Ts = 0.1 }
  local r = fit(swing, { params = { m, c }, data = d, y = q, start = { q = 1, v = 0 } })
  return both(r, { 1.2, 0.25 })
end)

-- The future is the truth of a forecast.
case("forecast of arx", 8, function()
  local d = record(305, b, a, {}, a, 0.5)
  local past, y, u = d:slice(1, 300), d.y, d.u
  local future = { u(301, 1), u(302, 1), u(303, 1), u(304, 1), u(305, 1) }
  local r = arx(past, { na = 2, nb = 2 }):forecast(past, 5, { u = future })
  return { r.y[1], r.y[3], r.y[5] }, { r.std[1], r.std[3], r.std[5] }, { y(301, 1), y(303, 1), y(305, 1) }
end)
case("forecast of n4sid", 8, function()
  local d = record(305, b, a, { 0.3 }, a, 0.5)
  local past, y, u = d:slice(1, 300), d.y, d.u
  local future = { u(301, 1), u(302, 1), u(303, 1), u(304, 1), u(305, 1) }
  local r = n4sid(past, 2):forecast(past, 5, { u = future })
  return { r.y[1], r.y[3], r.y[5] }, { r.std[1], r.std[3], r.std[5] }, { y(301, 1), y(303, 1), y(305, 1) }
end)
case("hammerstein", 4, function()
  local u, v = white(300), {}
  for t = 1, 300 do v[t] = u[t] + 0.3 * u[t]^2 end
  local d = iddata { u = u, y = noisy(filtered({ 1 }, { -0.5 }, v), 0.2) }
  local basis = { function(s) return s end, function(s) return s^2 end }
  local r = hammerstein(d, { nb = 1, nf = 1, input = basis })
  return { r.theta[1], r.theta[2], r.theta[3] }, r.std, { 1, -0.5, 0.3 }
end)

-- Share of the truths inside.
function coverage.share(one, runs, start)
  seed(start or 20)
  local inside, count = 0, 0
  for _ = 1, runs do
    local estimates, std, truths = one.estimate()
    for i, value in ipairs(truths) do
      count = count + 1
      if math.abs(estimates[i] - value) < z * std[i] then inside = inside + 1 end
    end
  end
  return inside / count
end

-- 93 … 97 % in 2000 runs; with fewer, as many deviations more as chance allows.
function coverage.slack(runs) return math.max(0.02, 3.3 * math.sqrt(0.95 * 0.05 / runs)) end

function coverage.campaign(runs, name)
  local wrong = 0
  for _, one in ipairs(coverage.cases) do
    if not name or one.name:find(name, 1, true) then
      local from = os.clock()
      local share = coverage.share(one, runs)
      local good = math.abs(share - 0.95) <= coverage.slack(runs)
      if not good then wrong = wrong + 1 end
      print(("%5.1f %%  %s%s  (%.0f s)"):format(100 * share, one.name, good and "" or "  outside",
        os.clock() - from))
    end
  end
  print(("%d runs each, %d outside %.1f … %.1f %%"):format(runs, wrong, 95 - 100 * coverage.slack(runs),
    95 + 100 * coverage.slack(runs)))
  return wrong
end

if arg and arg[0] and arg[0]:find "coverage%.lua$" then
  os.exit(coverage.campaign(math.tointeger(arg[1]) or 2000, arg[2]) == 0)
end
return coverage
