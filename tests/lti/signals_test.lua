-- Input signals and their spectra: definitions, exact counts, Parseval.

test("shift registers run through their whole period", function()
  for order = 2, 11 do
    local n = (1 << order) - 1
    local u = prbs(2*n, { order = order })
    local ones, repeats = 0, true
    for k = 1, n do
      if u[k] > 0 then ones = ones + 1 end
      repeats = repeats and u[k] == u[k + n]
    end
    expect(repeats):equals(true)
    expect(ones):equals((n + 1)//2)                     -- one more 1 than 0 (Golomb's balance)
    for lag = 1, math.min(n - 1, 40) do                 -- circular autocorrelation -1: maximum length
      local sum = 0
      for k = 1, n do sum = sum + u[k]*u[(k + lag - 1) % n + 1] end
      expect(sum):equals(-1)
    end
  end
  expect(excitation_order(prbs(62, { order = 5 }))):equals(31)
  local held = prbs(12, { hold = 3, low = 0, high = 5 })
  for k = 0, 3 do expect({ held[3*k + 1], held[3*k + 2] }):near({ held[3*k + 3], held[3*k + 3] }, 0) end
end)

test("every tabulated register up to 18 stages is primitive", function()
  for order = 12, 18 do
    local n = (1 << order) - 1
    local sum = 0
    local s = sum
    local u = prbs(n + order, { order = order })
    for k = 1, n do s = s + u[k] end
    -- 2^(order-1) ones, one zero less: the state visits everything
    expect(s):equals(1)
    for k = 1, order do expect(u[n + k]):equals(u[k]) end
  end
end)

test("a multisine has its lines and no others", function()
  local N, lines = 60, { 1, 4, 9 }
  local s = periodogram(multisine(N, { lines = lines, amplitudes = { 1, 2, 0.5 }, peak = 0 }))
  for k = 1, s.power.rows do
    local wanted = ({ [1] = 1, [4] = 4, [9] = 0.25 })[k - 1] or 0
    expect(s.power[k]):near(wanted*N/4, 1e-11)            -- a² N/4
  end
  expect(excitation_order(multisine(N, { lines = lines }))):equals(6)
  expect(crest_factor(multisine(256))):near(1.69, 0.02)
  expect(crest_factor(multisine(256, { phases = "zero" }))):near(math.sqrt(2*64), 1e-9)
  expect(crest_factor(multisine(64, { lines = { 1 } }))):near(math.sqrt(2), 1e-12)
end)

test("Parseval for every length", function()
  for _, N in ipairs { 1, 2, 3, 8, 31, 64, 97, 100, 360 } do
    local u, seed = {}, 7
    for k = 1, N do seed = seed*16807 % 2147483647 u[k] = seed/2147483647 - 0.5 end
    local s, sum = periodogram(u, 0.1), 0
    for k = 1, s.power.rows do
      local twice = k > 1 and not (N % 2 == 0 and k == s.power.rows)
      sum = sum + (twice and 2 or 1)*s.power[k]
    end
    expect(sum/N):near(s.mean_square, 1e-13)
    expect(s.f[s.f.rows]):near((N//2)/(N*0.1), 1e-15)
  end
  -- the definition, by hand, for a prime length
  local u = { 1, 2, 4, 0, -3, 1, 5 }
  local s = periodogram(u)
  local re, im = 0, 0
  for k = 1, 7 do
    re, im = re + u[k]*math.cos(2*math.pi*2*(k - 1)/7), im + u[k]*math.sin(2*math.pi*2*(k - 1)/7)
  end
  expect(s.power[3]):near((re*re + im*im)/7, 1e-13)
end)

test("a chirp runs from one frequency to the other", function()
  local N, Ts = 4000, 0.01
  for _, method in ipairs { "linear", "exponential" } do
    local u = chirp(N, { from = 1, to = 5, Ts = Ts, method = method })
    local crossings, last = 0, u[1]
    for k = 2, N do
      if (u[k] < 0) ~= (last < 0) then crossings = crossings + 1 end
      last = u[k]
    end
    local turns = method == "linear" and (1 + 5)/2*N*Ts or (5 - 1)/math.log(5)*N*Ts
    expect(crossings):near(2*turns, 1/(2*turns))          -- ± 1 crossing
  end
  expect(chirp(4, { from = 0.25, to = 0.25 })):near({ 1, 0, -1, 0 }, 0)
end)

test("square waves and sawteeth", function()
  expect(square(6, { period = 3, duty = 0.4, low = 0, high = 2 })):near({ 2, 2, 0, 2, 2, 0 }, 0)
  expect(sawtooth(8, { period = 4, low = 0, high = 4 })):near({ 0, 1, 2, 3, 0, 1, 2, 3 }, 0)
  expect(sawtooth(4, { period = 4, duty = 0.5 })):near({ -1, 0, 1, 0 }, 0)
end)

test("an estimated model is a linear system", function()
  local u, y = prbs(200), { 0 }
  for k = 2, 200 do y[k] = 0.8*y[k - 1] + 0.5*u[k - 1] end
  local G = arx(iddata{ y = y, u = u, Ts = 0.1 }, { na = 1, nb = 1, nk = 1 }):tf()
  expect(G:poles()):near({ 0.8 }, 1e-12)
  expect(G:dcgain()):near(2.5, 1e-11)
  expect(G.Ts):equals(0.1)
  expect(d2c(G):poles()):near({ math.log(0.8)/0.1 }, 1e-11)
  local H = arx(iddata{ y = y, u = u }, { na = 1, nb = 2, nk = 0 }):tf()
  expect(H.den.rows):equals(2)
end)

test("errors name what is wrong", function()
  local function fails(f, text) expect(f):fails(text) end
  fails(function() prbs(0) end, "the number of samples must be positive, got 0")
  fails(function() prbs(10, { order = 30 }) end,
    "the order of the register must lie between 2 and 24, got 30")
  fails(function() prbs(10, { order = 0 }) end, "between 2 and 24, got 0")
  fails(function() prbs(10, { seed = 0 }) end, "leaves the register empty")
  fails(function() prbs(10, { low = 1, high = 1 }) end, "low must be below high")
  fails(function() prbs(10, { hold = 0 }) end, "hold must be at least 1 sample")
  fails(function() prbs(10, { clock = 2 }) end, "unknown option 'clock'")
  fails(function() multisine(10, { lines = { 6 } }) end,
    "the line 6 does not exist: with 10 samples lines are 1 … 5")
  fails(function() multisine(10, { lines = { 1 }, amplitudes = { 1, 2 } }) end,
    "there are 2 amplitudes for 1 lines")
  fails(function() multisine(10, { phases = "best" }) end, "phases must be")
  fails(function() chirp(10, { from = 0, to = 2 }) end,
    "frequencies must lie between 0 and 1/(2 Ts) = 0.5 Hz, got 2")
  fails(function() chirp(10, { from = 0, to = 0.1, method = "exponential" }) end,
    "an exponential chirp needs positive frequencies")
  fails(function() square(10, { period = 1 }) end, "the period must be at least 2 samples")
  fails(function() periodogram({ 1, 0/0 }) end, "sample 2 is not a finite number")
  fails(function() periodogram({ 1, 2 }, 0) end, "the sampling time Ts must be positive")
  fails(function() crest_factor { 0, 0 } end, "the signal is zero")
  fails(function() excitation_order({ 1, 2, 3 }, 0) end, "limit must lie between 1 and 1000")
end)

test("solution: inputs that switch at given times, against the pieces by hand and a simulation", function()
  local G = ss({ { -1 } }, { { 1 } }, { { 1 } }, { { 0 } })
  local x = G:solution({ 0 }, { ifelse(lt(t, 1), 1, 0) })[1]
  expect(evaluate(x, { t = 0.4 })):near(1 - math.exp(-0.4), 1e-14)
  expect(evaluate(x, { t = 3 })):near((math.exp(1) - 1)*math.exp(-3), 1e-14)
  expect(G:solution({ 2 }, { ifelse(lt(t, 0), 7, 0) })[1]):equals(2*exp(-t))
  local A, b = { { 0, 1 }, { -4, -1 } }, { 0, 1 }
  local u = ifelse(all(gt(t, 0.5), le(t, 1.25)), 1 + t, ifelse(lt(t, 2), -1, sin(t)))
  local H = ss(A, b, eye(2), zeros(2, 1))
  local exact = H:solution({ 1, -1 }, { u })
  local p, v = vars "p v"
  local sol = dae { der(p) ~ v, der(v) ~ -4*p - v + u } :integrate { start = { p = 1, v = -1 }, to = 3,
    rtol = 1e-11, atol = 1e-12 }
  for _, time in ipairs { 0.25, 0.75, 1.5, 1.99, 3 } do
    expect(evaluate(exact, { t = time })):near(sol(vec { p, v }, time), 1e-8)
  end
  expect(function() G:solution({ 0 }, { ifelse(lt(t^2, 2), 1, 0) }) end):fails "use lsim(G, u, t)"
end)
