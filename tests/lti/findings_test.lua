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
  expect(tostring(charpoly { { 1e-300, 1 }, { 1, 1e300 } })):equals "(1, -1e+300, 0)"
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

test("what a design cannot use is refused in its own words", function()
  local G, S = tf({ 1 }, { 1, 1 }), ss({ { 0, 1 }, { 0, 0 } }, { 0, 1 }, { 1, 0 })
  expect(function() kalman(S, 1, 0) end):fails "every output needs a noise of its own"
  expect(function() lqr(S, 1, 0) end):fails "every input needs a weight"
  expect(function() kalman_filter(G, 1, 1, { y = { 1, 2 } }) end):fails "sample the system first"
  for _, w in ipairs { math.pi, 4, 1e9 } do
    expect(function() c2d(G, 1, "tustin", { prewarp = w }) end):fails "below π/Ts = 3.14159 rad/s"
  end
  expect(c2d(G, 1, "tustin", { prewarp = 3 }):is_stable()):is_true()
  expect(function() pade(-1, 2) end):fails "a time of at least 0"
  expect(function() pade(0/0, 2) end):fails "a time of at least 0"
  expect(#pade(0, 3).den):equals(1)
  expect(function() rlocus(G, { 1, "a" }) end):fails "gain 2 is no number"
end)

test("observers take a list for a column, and print their equations", function()
  local S = ss({ { 0, 1 }, { 0, 0 } }, { 0, 1 }, { 1, 0 })
  expect(estimator(S, { 3, 2 }).A):equals(estimator(S, vec { 3, 2 }).A)
  expect(function() estimator(S, { 1, 2, 3 }) end):fails "L must be 2×1, got 3×1"
  local x, v, u = var "x", var "v", input "u"
  local sys = dae { der(x) ~ v, der(v) ~ sin(x) + u }
  local est = estimator(sys, { 9, 20 }, { y = x })
  said(est, "observer of %(x_hat, v_hat%)")
  said(est, "x_hat′ = v_hat %+ 9 %(x %- x_hat%)")
  expect(#sys:close { u = -9*est.x[1] - 6*est.x[2], est }.equations):equals(4)
end)

test("the extended Kalman filter refuses covariances that are none", function()
  local x = var "x"
  local function run(Q, R, P0)
    return ekf(dae { der(x) ~ -x }, { data = iddata { y = { 1, 2 }, Ts = 0.1 }, y = x, Q = Q, R = R, P0 = P0,
      start = { x = 1 } })
  end
  expect(function() run(-1, 1) end):fails "ekf: Q: variance 1 is -1"
  expect(function() run(1, 1, { -2 }) end):fails "ekf: P0: variance 1 is -2"
  local y, z = var "y", var "z"
  expect(function()
    ekf(dae { der(y) ~ -z, der(z) ~ y }, { data = iddata { y = { 1, 2 }, Ts = 0.1 }, y = y,
      Q = { { 1, 2 }, { 3, 4 } }, R = 1, start = { y = 1, z = 0 } })
  end):fails "ekf: Q must be symmetric"
end)

test("channels that share a pole on the axis are semisimple; filters speak of what y sees", function()
  local one = tf({ 1 }, { 1, 0, 1 })
  expect(append(one, one):stability().verdict):equals "stable, not asymptotically"
  expect((one*one):stability().verdict):equals "unstable"
  local blind = ss({ { 1, 0 }, { 0, 2 } }, { 1, 1 }, { 1, 0 })
  for _, design in ipairs { kalman, lqe } do
    expect(function() design(blind, 1, 1) end):fails "y does not see a mode that does not decay: not observable"
  end
end)

test("systems without outputs, and poles too slow for a number", function()
  local silent = ss({ { -1 } }, { { 1 } }, {}, {})
  for _, design in ipairs { kalman, lqe } do
    expect(function() design(silent, 1, {}) end):fails "the system has no outputs to filter"
  end
  expect(silent:norm(1/0)):equals(0)
  local slow = ss({ { 5e-324 } }, { { 1 } }, { { 1 } }, { { 0 } })
  for _, name in ipairs { "step", "impulse" } do
    expect(function() slow[name](slow) end):fails "the slowest mode settles beyond the largest number"
  end
  expect(#slow:step(1).t > 1):equals(true)
end)

test("rise, overshoot and settling do not depend on the times that are asked for", function()
  local zeta, w = 0.1, 2
  local G = tf({ w^2 }, { 1, 2*zeta*w, w^2 })
  local overshoot = 100*math.exp(-zeta*math.pi/math.sqrt(1 - zeta^2))
  local whole = G:step()
  expect(whole.overshoot):near(overshoot, (math.pi/40)^2/2)   -- the highest of 40 samples of a period
  for _, times in ipairs { { 0, 1, 50 }, { 0.5 }, linspace(0, 3, 7) } do
    local r = G:step(times)
    expect(r.overshoot):near(whole.overshoot, 1e-12)
    expect(r.rise_time):near(whole.rise_time, 1e-12)
    expect(r.settling_time):near(whole.settling_time, 1e-12)
  end
  expect(G:step(linspace(0, 60, 60001)).overshoot):near(overshoot, (w*0.001/2)^2)
  local D = c2d(G, 0.1)
  expect(D:step(0.3).settling_time):near(D:step().settling_time, 1e-12)
end)
