-- Time scales from nanoseconds to years: the numbers of an exact matrix may be large.

local function four(u)
  return ss({ { -3.5*u, 0.3*u, 0.1*u, 0.2*u }, { 0.2*u, -3.1*u, 0.5*u, 0.4*u },
    { 0.7*u, 0.1*u, -2.9*u, 0.3*u }, { 0.11*u, 0.3*u, 0.2*u, -3*u } },
    { { u }, { 2*u }, { 3*u }, { u } }, { { 1, 0, 0, 0 } }, { { 0 } })
end

test("poles, zeros, norms in every unit of time", function()
  local one = four(1)
  local poles, zeros, norm = one:poles(), one:zeros(), one:norm(2)
  for _, u in ipairs { 1e-12, 1e-5, 1e3, 1e8, 1e12, 1.2345e8 } do
    local G = four(u)
    local p, z = G:poles(), G:zeros()
    for k = 1, 4 do
      expect(p.re[k] / u):near(poles.re[k] + 0.0, 1e-11)
      expect(p.im[k] / u):near(poles.im[k] + 0.0, 1e-11)
    end
    for k = 1, 3 do expect(z.re[k] / u):near(zeros.re[k] + 0.0, 1e-10) end
    expect(G:norm(2) / math.sqrt(u)):near(norm + 0.0, 1e-10)
    expect(G:is_stable()):is_true()
  end
end)

test("sampling in every unit of time, of states and of fractions", function()
  for _, method in ipairs { "zoh", "foh", "tustin", "euler", "backward", "impulse", "matched" } do
    local want
    for _, u in ipairs { 1, 1e-9, 1e7, 1e9 } do
      for _, G in ipairs { four(u), four(u):tf() } do
        if method ~= "matched" or G.tf then
          local got = c2d(G, 0.2 / u, method):freqresp{ 1.5 * u }.mag(1, 1)
          want = want or got
          expect(got):near(want, 1e-8)
        end
      end
    end
  end
  local back = d2c(c2d(four(1e9):tf(), 2e-10, "tustin"), "tustin")
  expect(back:freqresp{ 1e9 }.mag(1, 1)):near(four(1):freqresp{ 1 }.mag(1, 1), 1e-8)
end)

test("the zeros of exact polynomials with large coefficients", function()
  for _, u in ipairs { 1, 10^9, 10^15 } do
    local r = tf({ 1 }, { 1, 10 * u, 35 * u^2, 50 * u^3, 24.5 * u^4 }):poles()
    local one = tf({ 1 }, { 1, 10, 35, 50, 24.5 }):poles()
    for k = 1, 4 do
      expect(r.re[k] / u):near(one.re[k] + 0.0, 1e-11)
      expect(r.im[k] / u):near(one.im[k] + 0.0, 1e-11)
    end
  end
end)

-- ((s + 0.4)/(s + 0.7)) u²/((s + 0.1 u)² + u²) with the time unit 1/u, as fraction and in phase variables
local function resonance(u)
  local G = tf({ 1, 0.4 * u }, { 1, 0.7 * u }) * tf({ 1.01 * u^2 }, { 1, 0.2 * u, 1.01 * u^2 })
  return G, G:ss()
end

test("phase variables in every unit of time", function()
  local one = resonance(1)
  local mag, peak = one:freqresp{ 0.5, 1, 2 }.mag, one:norm "inf"
  local K = acker(one:ss().A, one:ss().B, { -1, -2, -3 })
  for _, u in ipairs { 1e-12, 1.3e-8, 1e-3, 1e5, 1.7e9, 1e12 } do
    local f, s = resonance(u)
    for _, G in ipairs { f, s } do
      local r = G:freqresp{ 0.5 * u, u, 2 * u }
      for k = 1, 3 do expect(r.mag(k, 1)):near(mag(k, 1), 1e-10) end
      local p = G:poles()
      expect(p.re[1] / u):near(-0.7, 1e-10)
      expect(p.re[2] / u):near(-0.1, 1e-10)
      expect(p.im[3] / u):near(1, 1e-10)
      expect(G:zeros().re[1] / u):near(-0.4, 1e-10)
      expect((G:norm "inf")):near(peak + 0.0, 1e-9)
      expect(minreal(G).order):equals(3)
      expect(G:controllability().rank):equals(3)
      local _, hankel = balreal(G)
      local _, want = balreal(one)
      for k = 1, 3 do expect(hankel[k]):near(want[k] + 0.0, 1e-9) end
    end
    local gain, wanted = nil, { -u, -2 * u, -3 * u }
    for _, design in ipairs { place, acker } do
      gain = design(s.A, s.B, wanted)
      for k = 1, 3 do expect(gain(1, k) / u^(4 - k)):near(K(1, k) + 0.0, 1e-8) end
    end
  end
end)

test("zeros do not depend on the units of states, inputs and outputs", function()
  local G = ss({ { -1, 1.5, 0 }, { 0.25, -2, 1 }, { 1, 0, -3 } }, { { 1, 0 }, { 0, 1 }, { 1, 1 } },
    { { 1, 0, 1 }, { 0, 1, 0.5 } }, { { 0, 0 }, { 0, 0 } })
  local x, u, y = diag{ 1e7, 0.3, 1e-9 }, diag{ 1e-6, 1e5 }, diag{ 1e9, 1e-4 }
  local H = ss(inv(x) * G.A * x, inv(x) * G.B * u, y * G.C * x, G.D)
  expect(H:zeros().re[1]):near(G:zeros().re[1] + 0.0, 1e-10)
  expect(#H:zeros().re):equals(#G:zeros().re)
end)

test("poles and zeros cancel relative to their size", function()
  expect(minreal(tf({ 1, 0.8e-12 }, { 1, 1.5e-12, 0.5e-24 })).order):equals(2)
  expect(minreal(zpk({ -2.1e-13 }, { -2.1e-13, -0.9e-12 }, 1)).order):equals(1)
end)

test("measured numbers in fast units are worked on in doubles", function()
  seed(3)
  local n, r, A = 24, randn(600), {}
  for i = 1, n do
    A[i] = {}
    for j = 1, n do A[i][j] = 1e9 * (r[(i - 1) * n + j] / 7 - (i == j and 1.5 or 0)) end
  end
  local G = ss(A, { mat(A):block(1, n, 1, 1) }, { mat(A):block(1, 1, 1, n) }, { { 0 } })
  expect(minreal(G).order):equals(n)                     -- exact work on such fractions takes minutes
  expect(c2d(G, 1e-10).order):equals(n)
  local many = append(G, G, G)                           -- entries of A⁷¹ B overflow
  expect(many:controllability().rank):equals(3 * n)
  expect(function() return many:controllability().matrix end):fails "overflow"
  expect(G:is_stable()):is_true()
end)

test("responses begin at t = 0 whatever the first time", function()
  local G, F = tf({ 1 }, { 1, 1 }), tf({ 1 }, { 1, -0.5 }, 0.1)
  expect(G:step({ 1, 2 }).y(1, 1)):near(1 - math.exp(-1), 1e-14)
  expect(G:impulse({ 1, 2 }).y(2, 1)):near(math.exp(-2), 1e-14)
  expect(G:ss():initial({ 3 }, { 1, 2 }).y(1, 1)):near(3 * math.exp(-1), 1e-14)
  expect(F:step({ 0.2, 0.3 }).y(2, 1)):near(1.75, 1e-14)
  expect(#F:step({ 0.2, 0.3 }).t):equals(2)
  expect(function() G:step({ -1, 2 }) end):fails "begins at t = 0"
  expect(function() F:step({ 0.15, 0.25 }) end):fails "multiples of Ts = 0.1"
end)

test("acker of measured numbers in fast units", function()
  seed(3)
  for n = 3, 5 do
    local r, A, B = randn(50), {}, {}
    for i = 1, n do
      A[i], B[i] = {}, 1e9 * r[40 + i]
      for j = 1, n do A[i][j] = 1e9 * r[(i - 1) * n + j] end
    end
    local wanted = {}
    for i = 1, n do wanted[i] = -1e9 * i end
    local K = acker(A, B, wanted)
    local p = eig(mat(A) - vec(B) * K).re
    for i = 1, n do expect(p[i] / 1e9):near(i - n - 1, 1e-5) end
  end
end)
