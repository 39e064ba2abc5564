-- Spectral analysis against the system that made the data.

local function record(N, noise)
  local seed, y, u, e = 3, {}, {}, 0
  local function random() seed = (seed * 16807) % 2147483647 return seed / 2147483647 - 0.5 end
  for t = 1, N do
    u[t] = random() > 0 and 1.0 or -1.0
    y[t] = 0.8 * (y[t - 1] or 0) + (u[t - 1] or 0) + noise * random()
  end
  return iddata{ y = y, u = u, Ts = 0.5 }
end

test("the estimate lies within its bounds of the true response", function()
  local d = record(4000, 0.5)
  local r = spa(d, { window = 60 })
  local outside = 0
  for k = 4, #r.w do
    local z = r.w[k] * 0.5
    local size = 1 / math.sqrt((1 - 0.8 * math.cos(z))^2 + (0.8 * math.sin(z))^2)
    if math.abs(r.mag[k] - size) > 3 * r.std[k] + 0.03 * size then outside = outside + 1 end
  end
  expect(outside < 7):is_true()
  expect(r.phase[#r.phase] < -150 and r.phase[#r.phase] > -210):is_true()
end)

test("noise lowers the coherence, and its spectrum is found", function()
  local clean, noisy = spa(record(2000, 0)), spa(record(2000, 4))
  expect(noisy.coherence[100] < 0.8 and clean.coherence[100] > noisy.coherence[100]):is_true()
  -- v = noise/(1 - 0.8 q⁻¹): at ω = π the variance 16/12 over 1.8²
  expect(noisy.noise[128] / (16 / 12 / 1.8^2)):near(1, 0.3)
end)

test("what cannot be analysed is said", function()
  local constant = iddata{ y = {1, 2, 3, 4}, u = {1, 1, 1, 1} }
  expect(function() spa(constant, { window = 2 }) end):fails "does not vary"
  expect(function() spa(record(50, 0), { windw = 2 }) end):fails "unknown option"
  expect(function() spa(record(50, 0), { window = 500 }) end):fails "from 2 to 49"
end)
