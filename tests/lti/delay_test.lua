-- Systems with delays: exact in frequency and time, in products, sums and loops.
local s = tf "s"

local function nearly(a, b, tol)
  expect(math.abs(a - b) <= (tol or 1e-12) * math.max(1, math.abs(b))):is_true()
end

test("a delay turns the phase by ω T and leaves the gain, on the right sheet", function()
  local G, R = exp(-0.5 * s) * (s + 2) / (s^2 + s + 1), tf({1, 2}, {1, 1, 1})
  for _, w in ipairs { 0.01, 1, 10, 100 } do
    local a, b = G:freqresp { w }, R:freqresp { w }
    nearly(a.mag(1, 1), b.mag(1, 1))
    nearly(a.phase(1, 1), b.phase(1, 1) - w * 0.5 * 180 / math.pi, 1e-9)
  end
  expect(G:dcgain()):equals(2)
  expect(G.delays[1]):equals(0.5)
end)

test("an expression in s is the same as systems", function()
  local z = var "s"
  local a, b = tf(exp(-2 * z) / (z + 1) + 1 / z, z), exp(-2 * s) / (s + 1) + 1 / s
  for _, w in ipairs { 0.3, 3 } do
    nearly(a:freqresp { w }.re(1, 1), b:freqresp { w }.re(1, 1))
    nearly(a:freqresp { w }.re(1, 1), (math.cos(2 * w) - w * math.sin(2 * w)) / (1 + w * w))
  end
end)

test("responses in time, shifted and in a loop", function()
  local G = exp(-1.5 * s) * 3 / (2 * s + 1)
  local r = G:step { 0, 1, 1.5, 2, 4, 20 }
  for k = 1, 6 do nearly(r.y(k, 1), math.max(0, 3 * (1 - math.exp(-(r.t[k] - 1.5) / 2))), 1e-11) end
  -- K e^{-Ts}/s in a loop, by hand: y = K (t - T) on [T, 2T], then minus K² (t - 2T)²/2, …
  local K, T = 0.8, 1
  local y = feedback(K * exp(-T * s) / s):step { 0, 0.5, 1.5, 2.5, 3.5 }.y
  local function exact(t)
    local sum, sign = 0, 1
    for n = 1, 10 do
      if t < n * T then break end
      local term = (K * (t - n * T))^n
      for i = 2, n do term = term / i end
      sum, sign = sum + sign * term, -sign
    end
    return sum
  end
  for k, t in ipairs { 0, 0.5, 1.5, 2.5, 3.5 } do nearly(y(k, 1), exact(t), 1e-11) end
end)

test("inputs: functions and samples", function()
  local G = exp(-0.7 * s) / (s + 1)
  local times = linspace(0, 5, 51)
  local r = G:lsim(function(at) return math.sin(at) end, times)
  local t = times[51] - 0.7
  nearly(r.y(51, 1), (math.exp(-t) + math.sin(t) - math.cos(t)) / 2, 1e-10)
  local ramp = {}
  for k = 1, 51 do ramp[k] = times[k] end
  nearly(G:lsim(ramp, times).y(51, 1), t - 1 + math.exp(-t), 1e-11)
end)

test("margins by the argument of 1 + G", function()
  local m = margin(exp(-s) / s)
  nearly(m.gain, math.pi / 2, 1e-9)
  nearly(m.phase, 90 - 180 / math.pi, 1e-9)
  expect(m.stable):is_true()
  expect(margin(1.6 * exp(-s) / s).stable):is_false()
  expect(margin(2 * exp(-0.4 * s) / (s - 1)).stable):is_true()      -- unstable alone, stable in the loop
  expect(margin(2 * exp(-1.4 * s) / (s - 1)).stable):is_false()
end)

test("other forms: Padé, samples", function()
  local G = exp(-0.5 * s) / (s + 1)
  local P = pade(G, 4)
  for _, w in ipairs { 0.1, 1, 4 } do nearly(P:freqresp { w }.re(1, 1), G:freqresp { w }.re(1, 1), 1e-6) end
  local L = feedback(2 * exp(-0.4 * s) / (s + 1))
  nearly(pade(L, 8):step { 0, 5 }.y(2, 1), L:step { 0, 5 }.y(2, 1), 1e-5)
  for _, T in ipairs { 2, 2.5, 0.25 } do
    local D, C = delayed(tf({1}, {1, 1}), T):c2d(1), delayed(tf({1}, {1, 1}), T)
    local a, b = D:step { 0, 1, 2, 3, 4, 5 }.y, C:step { 0, 1, 2, 3, 4, 5 }.y
    for k = 1, 6 do nearly(a(k, 1), b(k, 1), 1e-11) end
  end
end)

test("what has no delay form says so", function()
  expect(function() delayed(tf({1}, {1, 1}), 2.5):c2d(1e-300) end):fails "at most 1000 are stored as states"
  expect(function() exp(2 * s) end):fails "is not causal"
  expect(function() exp(s^2) end):fails "e^{-T s} only"
  expect(function() minreal(exp(-s) / (s + 1)) end):fails "pade(G, n)"
  expect(function() return 1 / (exp(-s) / (s + 1)) end):fails "is not causal"
  expect(function() return delayed(tf({1}, {1, 1}, 0.1), 1) end):fails "1/z^d"
end)

test("responses of systems with delays take what others take", function()
  local s = tf "s"
  local G = exp(-s/2)*tf({1}, {1, 1})
  for _, H in ipairs { G, feedback(G) } do
    local r = H:step { to = 4 }
    expect(r.t[#r.t]):equals(4.0)
    expect(H:step { times = { 0, 1, 4 } }.y[3]):near(H:step(r.t).y[#r.t], 1e-10)
    expect(H:step { 0, 1, 4 }.y.rows):equals(3)
    expect(function() H:step { upto = 4 } end):fails "upto"
  end
end)

test("a negative delay is refused in the words of the user", function()
  local s = tf "s"
  local done, why = pcall(function() return exp(0.4*s)/(s + 1) end)
  expect(done):equals(false)
  expect(why:find("exp: exp(0.4 s) is not causal", 1, true) ~= nil and not why:find "__"):is_true()
end)
