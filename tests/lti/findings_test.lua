-- Findings on linear systems that have no place among the tests of their subject.

local function said(value, what) expect(tostring(value)):matches(what) end

test("no rounding errors among the coefficients of sampled systems", function()
  for _, den in ipairs { { 1, 3, 2 }, { 1, 6, 11, 6 }, { 1, 2, 5, 3 }, { 1, 0.2, 1 } } do
    for _, u in ipairs { 1, 1e-6, 1e9 } do
      local scaled = {}
      for k, c in ipairs(den) do scaled[k] = c*u^(k - 1) end
      local G = tf({ u^(#den - 1) }, scaled)
      local H = c2d(G, 0.1/u, "impulse")
      expect(H:zeros().re[1] == 0 or H:zeros().re[2] == 0):is_true()         -- Σ r z/(z - e^{pT})
      expect(#d2c(c2d(G, 0.1/u)).num):equals(1)                              -- no zero, as before
      expect(c2d(G, 0.1/u, "impulse"):freqresp{ u }.mag(1, 1)):near(
        c2d(G:ss(), 0.1/u, "impulse"):freqresp{ u }.mag(1, 1), 1e-12)
    end
  end
  -- coefficients that are small, but no rounding errors, stay
  expect(#d2c(c2d(tf({ 1e-9, 1 }, { 1, 3, 2 }), 0.1)).num):equals(2)
  expect(#tf({ 1e-20, 1 }, { 1, 3, 2 }):ss():tf().num):equals(2)
end)

test("exact numbers: stability is decided exactly", function()
  local function verdict(den, Ts) return tf({ 1 }, den, Ts):stability().verdict end
  local marginal, asymptotic = "stable, not asymptotically", "asymptotically stable"
  for _, e in ipairs { 1e-9, 1e-12, 1e-15, 1e-30 } do
    expect(verdict { 1, e, 1 }):equals(asymptotic)
    expect(verdict { 1, -e, 1 }):equals "unstable"
    expect(verdict { 1, e }):equals(asymptotic)
    expect(verdict { 1, -e }):equals "unstable"
    expect(ss({ { -1, 1 }, { 0, -e } }, { 0, 1 }, { 1, 0 }):is_stable()):is_true()
    expect(tf({ 1 }, { 1, e, 2, e, 1 }):stability().verdict):equals(marginal)     -- (s² + 1)(s² + e s + 1)
  end
  expect(verdict { 1, 0, 1 }):equals(marginal)
  expect(verdict { 1, 0.1, 1, 0.1 }):equals(marginal)              -- (s + 0.1)(s² + 1)
  expect(verdict { 1, 0, 0.3 }):equals(marginal)
  expect(verdict { 1, 0, 2, 0, 1 }):equals "unstable"              -- (s² + 1)²
  expect(verdict { 1, 0, 5, 0, 4 }):equals(marginal)
  expect(verdict { 1, 0, 0, 0, 4 }):equals "unstable"       -- s⁴ = -4, symmetric to the axis
  expect(verdict { 1, 0, -1 }):equals "unstable"
  expect(verdict { 1, 1, 3, 3, 2, 2 }):equals(marginal)            -- (s + 1)(s² + 1)(s² + 2)
  expect(verdict({ 1, 0, 1 }, 1)):equals(marginal)
  expect(verdict({ 1, 1 }, 1)):equals(marginal)                    -- z = -1
  expect(verdict({ 1, 2, 1 }, 1)):equals "unstable"                -- z = -1 twice
  expect(verdict({ 1, -1.6, 1 }, 1)):equals(marginal)              -- 0.8 ± 0.6 i
  expect(verdict({ 1, -1.6, "0.999999999999" }, 1)):equals(asymptotic)
  expect(verdict({ 1, -1.6, "1.000000000001" }, 1)):equals "unstable"
  expect(zpk({}, { complex(0, 1), complex(0, -1), -1 }, 1):stability().verdict):equals(marginal)
  local twice = { { 0, 1, 0, 0 }, { -1, 0, 0, 0 }, { 0, 0, 0, 1 }, { 0, 0, -1, 0 } }
  twice = ss(twice, { { 0 }, { 1 }, { 0 }, { 1 } }, { { 1, 0, 1, 0 } }, { { 0 } })  -- ±i twice
  expect(twice:stability().verdict):equals(marginal)
end)

test("numbers known to rounding: stability says so", function()
  said(c2d(tf({ 1 }, { 1, 0, 1 }), 0.1):stability(), "on the unit circle, to rounding: z = 0.995")
  said(ss({ { 0, math.sqrt(2) }, { -math.sqrt(3), 0 } }, { 0, 1 }, { 1, 0 }):stability(),
    "on the imaginary axis, to rounding: s = 1.565")
  expect(tostring(tf({ 1 }, { 1, 0, 1 }):stability()):find "rounding"):is_nil()
end)

test("exact poles on the axis are printed there", function()
  expect(tostring(tf({ 1 }, { 1, 0.1, 1, 0.1 }):poles())):equals "poles: -0.1, ±i"
  expect(tostring(tf({ 1 }, { 1, 3, 4, 12 }):poles())):equals "poles: -3, ±2 i"
end)

-- A random matrix of numbers of nine digits and four behind the point, rationals all of them.
local function measured(n, unit)
  seed(1)
  local r, A = randn(n*n), {}
  for i = 1, n do
    A[i] = {}
    for j = 1, n do A[i][j] = unit*r[(i - 1)*n + j] end
  end
  return A
end

test("matrices of measured numbers are worked on in doubles, at once", function()
  local clock = os.clock()
  local A = measured(20, 1e9)
  local trace, p, list = 0, charpoly(A), eig(A)
  for k = 1, 20 do trace = trace + A[k][k] end
  expect(p[2]/-trace):near(1, 1e-14)
  expect(p[21]/det(evaluate(mat(A)))):near(1, 1e-10)
  local sum = 0
  for k = 1, 20 do sum = sum + list.re[k] end
  expect(sum/trace):near(1, 1e-11)
  expect(#charpoly(measured(30, 1e3))):equals(31)
  expect(expm(measured(20, 1))(1, 1)):near(expm(evaluate(mat(measured(20, 1))))(1, 1), 1e-9)
  expect(os.clock() - clock < 5):is_true()                         -- a minute and more before
  local x = var "x"
  expect(evaluate(charpoly({ { 0.5, 1/3 }, { 1/7, 0.25 } }, x), { x = 0 })):near(0.125 - 1/21, 1e-15)
  expect(tostring(charpoly { { 1, 2 }, { 3, "1/4" } })):equals "(1, -5/4, -23/4)"
end)

test("coefficients and determinants beyond double precision are refused", function()
  expect(function() charpoly(measured(40, 1e9)) end):fails "overflows double precision"
  expect(function() det(measured(60, 1e9)) end):fails "overflows double precision"
end)

test("a method that is a function elsewhere: what is said does not mislead", function()
  local response = bode(tf({ 1 }, { 1, 1 }))
  expect(function() return response:margin() end):fails 'margin(…) is a function: help "margin"'
end)

test("the Kalman filter over samples has a printed form and a picture", function()
  local G = ss({ { 1, 1 }, { 0, 1 } }, { 0, 0 }, { 1, 0 }, { 0 }, 0.5)
  local r = kalman_filter(G, 0.01, 1, { y = { 1, 3, 0/0, 7, 9 }, P0 = 100 })
  said(r, "Kalman filter over 5 samples of 2 states, 1 value of y missing: log%-likelihood")
  said(r, "x₂ = 2%.0")
  said(r:plot(), "2 panels")
  expect(r.t[5]):equals(2.0)
  expect(#r.gains):equals(5)
  r = kalman_filter(G, 0.01, 1, { y = { 1, 3 }, P0 = 1, smooth = true })
  said(r, "Kalman smoother over 2 samples")
end)
