-- Linear systems: textbook answers, two roads to each number, and every error text.

local s = param "s"

local function rows(m)
  local list = {}
  for i = 1, m.rows do
    list[i] = {}
    for j = 1, m.cols do list[i][j] = evaluate(m(i, j)) end
  end
  return list
end

-- A seeded random system: the same numbers everywhere.
local seed = 1
local function random() seed = (seed * 16807) % 2147483647 return seed / 2147483647 end
local function random_matrix(n, m, scale)
  local a = {}
  for i = 1, n do
    a[i] = {}
    for j = 1, m do a[i][j] = math.floor((2 * random() - 1) * scale * 16) / 16 end
  end
  return a
end
local function random_stable(n, m, p)
  local A = random_matrix(n, n, 1)
  for i = 1, n do A[i][i] = A[i][i] - n end
  return ss(A, random_matrix(n, m, 1), random_matrix(p, n, 1), random_matrix(p, m, 1))
end

---------------------------------------------------------------------------------------------------- forms

test("state space to transfer function and back keeps the frequency response", function()
  for n = 1, 5 do
    local G = random_stable(n, 2, 2)
    local F, Z = G:tf(), G:zpk()
    local back = F:ss()
    for _, w in ipairs { 0.1, 1, 7 } do
      local z = complex(0, w)
      for _, H in ipairs { F, Z, back } do
        expect(H(z).re):near(G(z).re, 1e-10)
        expect(H(z).im):near(G(z).im, 1e-10)
      end
    end
    expect(back.order):equals(n)
  end
end)

test("G(s) = C (sI - A)⁻¹ B + D, formula (83), as the inverse says", function()
  local A, B, C, D = mat{{0, 1}, {-2, -3}}, vec{0, 1}, mat{{1, 5}}, 4
  local by_hand = simplify(C * inv(s*eye(2) - A) * B + D)
  local G = ss(A, B, C, D)
  for _, v in ipairs { 1, 2, 5 } do expect(G(v)):equals(subs(by_hand, { [s] = v })) end
  expect(tostring(G(s))):equals "(4 s² + 17 s + 9)/(s² + 3 s + 2)"
end)

test("the controllable canonical form of a fraction", function()
  local G = tf({1, 2}, {2, 6, 2}):ss()
  expect(G.A):equals(mat{{0, 1}, {-1, -3}})
  expect(G.B):equals(vec{0, 1})
  expect(G.C):equals(mat{{1, "1/2"}})
  expect(G.D(1, 1)):equals(0)
  expect(tf({2, 1}, {1, 3}):ss().D(1, 1)):equals(2)
end)

test("symbolic coefficients stay symbols", function()
  local m, d, k = params "m d k"
  local G = ss({{0, 1}, {-k/m, -d/m}}, {0, 1/m}, {1, 0})
  expect(tostring(G:tf())):equals "transfer function, continuous time\n         1/m\n  ──────────────────\n  s² + (d/m) s + k/m"
  expect(tostring(G:dcgain())):equals "1/k"
  expect(G:with{ m = 1, d = 2, k = 5 }:poles()):near({ complex(-1, -2), complex(-1, 2) }, 1e-15)
  expect(tostring(tf({1},
    {m, d, k}):stability())):equals "asymptotically stable if and only if m > 0, d > 0, k > 0 (Routh)"
end)

test("arithmetic: series, parallel, feedback, in both forms", function()
  local p = tf "s"
  local G = (p + 2)/(p^2 + 3*p + 1)
  expect(tostring(G)):equals(tostring(tf({1, 2}, {1, 3, 1})))
  local H = 5/(p + 4)
  for _, pair in ipairs { { G, H }, { G:ss(), H:ss() }, { G, H:ss() } } do
    local a, b = pair[1], pair[2]
    local ga, gb = G(3), H(3)
    expect((a*b)(3)):equals(ga*gb)
    expect((a + b)(3)):equals(ga + gb)
    expect((a - b)(3)):equals(ga - gb)
    expect((-a)(3)):equals(-ga)
    expect((2*a)(3)):equals(2*ga)
    expect((a*2)(3)):equals(2*ga)
    expect(feedback(a, b)(3)):equals(ga/(1 + ga*gb))
    expect(feedback(a, b, 1)(3)):equals(ga/(1 - ga*gb))
    expect(feedback(a)(3)):equals(ga/(1 + ga))
    expect(series(a, b)(3)):equals(ga*gb)
    expect(parallel(a, b)(3)):equals(ga + gb)
  end
  expect((G/H)(3)):equals(G(3)/H(3))
  expect((1/G)(3)):equals(1/G(3))
  expect((G^2)(3)):equals(G(3)^2)
  local k = param "k"
  expect(tostring((k*tf({1}, {1, 1}))(s))):equals "k/(s + 1)"
end)

test("feedback of several channels is (I + G H)⁻¹ G", function()
  local G, H = random_stable(3, 2, 2), random_stable(2, 2, 2)
  local closed = feedback(G, H)
  local g, h = G(1), H(1)
  expect(closed(1)):near(inv(eye(2) + g*h) * g, 1e-10)
  expect(closed.order):equals(5)
end)

test("matrices of transfer functions, minimal realisations and their zeros", function()
  local p = tf "s"
  local M = tf{ { 1/(p + 1), 2/(p + 2) }, { p/(p + 1), 3 } }
  expect(M:ss().order):equals(2)
  expect(M:poles()):near({ -2, -1 }, 0)
  expect(M:zeros()):near({ -6 }, 0)                 -- det = 3/(s+1) - 2 s/((s+1)(s+2)) = (s + 6)/((s+1)(s+2))
  expect(M:channel(2, 1)(2)):equals(rational("2/3"))
  -- det = 1/(s+1)² - 2/((s+1)(s+3)) = (1 - s)/((s+1)²(s+3)): a zero in the right half plane that no entry has
  local N = tf{ { 1/(p + 1), 2/(p + 3) }, { 1/(p + 1), 1/(p + 1) } }
  expect(N:zeros()):near({ 1 }, 0)
  expect(N:ss().order):equals(3)
  expect(tf({ { {1}, {2} } }, { { {1, 1}, {1, 2} } }).inputs):equals { "u₁", "u₂" }
end)

test("zeros by compression agree with zeros of the numerator", function()
  for n = 2, 6 do
    local G = random_stable(n, 1, 1)
    local num = G:tf().num
    expect(#G:zeros()):equals(num.rows - 1)
    local F = G:tf()
    expect(G:zeros()):near(F:zeros(), 1e-7)
  end
  -- decimals take the road with singular values
  local G = ss(evaluate(mat{{0, 1, 0}, {0, 0, 1}, {-6, -11, -6}} * sqrt(2)), {0, 0, 1}, {2, 1, 0})
  expect(G:zeros()):near({ -2*math.sqrt(2) }, 1e-12)
end)

test("zero, pole and gain", function()
  local G = zpk({ -1 }, { complex(-1, 2), complex(-1, -2), 0 }, 3)
  expect(G:tf().den):equals(vec{1, 2, 5, 0})
  expect(G:tf().num):equals(vec{3, 3})
  expect(G:tf():zpk().gain):equals(3)
  expect(G:poles()):near({ complex(-1, -2), complex(-1, 2), 0 }, 0)
  expect((G*zpk({}, {-4}, 2)).gain):equals(6)
end)

---------------------------------------------------------------------------------------------------- structure

test("controllability and the mode that no input reaches", function()
  -- two equal tanks side by side with one inlet each half: the difference is not reached (Kailath §2.3)
  local G = ss{ A = {{-1, 0}, {0, -1}}, B = { {1}, {1} }, C = { {1, 0} }, states = "h1 h2" }
  local c, o = G:controllability(), G:observability()
  expect(c.rank):equals(1)
  expect(c.full):equals(false)
  expect(c.stable):equals(true)
  expect(c.modes):near({ -1 }, 0)
  expect(tostring(c)):equals(
    "not controllable: the controllability matrix has rank 1 of 2\n"
    .. "  uncontrollable mode -1  no input reaches h1 - h2: (h1 - h2)′ = -1 (h1 - h2)\nstabilizable: these "
      .. "modes decay")
  expect(o.rank):equals(1)
  expect(tostring(o)):equals(
    "not observable: the observability matrix has rank 1 of 2\n"
    .. "  unobservable mode -1  the outputs do not depend on the direction (0, 1)\ndetectable: these "
      .. "modes decay")
  expect(G:minreal().order):equals(1)
  expect(ctrb(G)):equals(mat{{1, -1}, {1, -1}})
  expect(ss({{1, 0}, {0, 2}}, {0, 1}, {1, 1}):controllability().stable):equals(false)
end)

test("a minimal realisation has the same transfer function", function()
  local p = tf "s"
  local G = ((p + 1)/(p + 2)):ss() * ((p + 2)/((p + 1)*(p + 3))):ss()
  expect(G.order):equals(3)
  expect(G:minreal().order):equals(1)
  expect(G:minreal():tf().den):equals(vec{1, 3})
  expect(G:tf().notes[1]):equals "cancelled: (s² + 3 s + 2), not controllable or not observable"
  local D = ss(evaluate(G.A), evaluate(G.B), evaluate(G.C), evaluate(G.D))
  expect(D:minreal().order):equals(1)
  for _, small in ipairs { 1e-6, 1e-9 } do             -- a tolerance holds for exact entries, too
    local weak = ss({{-1, 0}, {0, -2}}, {{1}, {small}}, {{1, 1}}, {{0}})
    expect(weak:minreal().order):equals(2)
    expect(minreal(weak, 1e-3).order):equals(1)
    expect(minreal(weak, small/100).order):equals(2)
  end
  expect(minreal(zpk({-1.0000000001}, {-1, -2}, 1)):poles()):near({ -2 }, 1e-9)
end)

test("Cayley and Hamilton", function()
  for n = 1, 5 do
    local G = random_stable(n, 1, 1)
    local c, A, sum = G:charpoly(), G.A, zeros(n, n)
    for k = 1, n + 1 do sum = sum * A + c[k] * eye(n) end
    expect(sum):equals(zeros(n, n))
  end
end)

test("Gramians solve their equations and are integrals", function()
  for n = 1, 4 do
    local G = random_stable(n, 2, 2)
    local P, Q = G:gram "c", G:gram "o"
    expect(G.A*P + P*G.A.T + G.B*G.B.T):near(zeros(n, n), 1e-12)
    expect(G.A.T*Q + Q*G.A + G.C.T*G.C):near(zeros(n, n), 1e-12)
  end
  local A = random_matrix(12, 12, 0.2)
  for i = 1, 12 do A[i][i] = A[i][i] - 3 end
  A = mat(A)
  local X = lyap(A, eye(12))
  expect(A*X + X*A.T + eye(12)):near(zeros(12, 12), 1e-12)
  local Ad = random_matrix(12, 12, 0.2)
  local Y = dlyap(Ad, eye(12))
  expect(mat(Ad)*Y*mat(Ad).T - Y + eye(12)):near(zeros(12, 12), 1e-12)
  expect(ss({{-2}}, {3}, {1}):gram()(1, 1)):equals(rational("9/4"))   -- b²/2|a|
end)

test("norms", function()
  expect(tf({1}, {1, 1}):norm()):near(math.sqrt(0.5), 1e-14)
  -- resonance: 1/(2ζ√(1-ζ²)) at ω√(1-2ζ²)
  local peak, at = tf({1}, {1, 0.2, 1}):norm "inf"
  expect(peak):near(1/(0.2*math.sqrt(1 - 0.01)), 1e-8)
  expect(at):near(math.sqrt(1 - 0.02), 1e-4)
  local G = c2d(tf({1}, {1, 1}), 0.1)
  expect(G:norm "inf"):near(1, 1e-9)
  expect(function() tf({1, 1}, {1, 2}):norm() end):fails "the H2 norm is infinite: D is not zero"
  expect(function() tf({1}, {1, -1}):norm "inf" end):fails "unstable"
end)

test("verdicts on stability", function()
  expect(tf({1}, {1, 2, 1}):stability().verdict):equals "asymptotically stable"
  expect(tostring(tf({1},
    {1, 0, 4}):stability())):equals "stable, not asymptotically: simple poles on the imaginary axis: s = 2 i"
  expect(tostring(tf({1},
    {1, 0, 0}):stability())):equals "unstable: a repeated pole on the imaginary axis: s = 0"
  expect(ss(zeros(2, 2), eye(2)):stability().verdict):equals "stable, not asymptotically"       -- semisimple
  expect(tostring(tf({1}, {1, -1}):stability())):equals "unstable: in the right half plane: s = 1"
  expect(tf({1}, {1, -0.5}, 1):is_stable()):equals(true)
  expect(tostring(tf({1}, {1, -2}, 1):stability())):equals "unstable: outside the unit circle: z = 2"
end)

---------------------------------------------------------------------------------------------------- sampling

test("c2d and d2c undo each other", function()
  for n = 1, 4 do
    local G = random_stable(n, 1, 1)
    for _, method in ipairs { "zoh", "tustin" } do
      local back = c2d(G, 0.1, method):d2c(method)
      expect(back.A):near(G.A, 1e-10)
      expect(back.B):near(G.B, 1e-10)
      expect(back.C):near(G.C, 1e-10)
      expect(back.D):near(G.D, 1e-10)
    end
  end
end)

test("sampling a first-order lag, Åström & Wittenmark table 2.1", function()
  -- K/(s + a) becomes K/a (1 - e^{-ah})/(z - e^{-ah})
  local G = c2d(tf({3}, {1, 2}), 0.25)
  local q = math.exp(-0.5)
  expect(G.num):near({ 1.5*(1 - q) }, 1e-14)
  expect(G.den):near({ 1, -q }, 1e-14)
  -- 1/s²: h²(z+1)/(2(z-1)²), exact, with a symbol too
  expect(c2d(tf({1}, {1, 0, 0}), 2).num):equals(vec{2, 2})
  local h = param "h"
  expect(c2d(ss({{0, 1}, {0, 0}}, {0, 1}, {1, 0}), h).B):equals(vec{h^2/2, h})
  local a = param "a"
  expect(simplify(c2d(ss({{-a}}, {1}, {1}), h).A[1] - exp(-a*h))):equals(0)
end)

test("tustin, euler, backward, impulse and first-order hold by their formulas", function()
  local z, h = 3, 0.5
  local G = tf({1, 3}, {1, 2, 5})
  local function at(p) return G(p) end
  expect(c2d(G, h, "tustin")(z)):near(at(2/h*(z - 1)/(z + 1)), 1e-14)
  expect(c2d(G, h, "bilinear")(z)):near(at(2/h*(z - 1)/(z + 1)), 1e-14)
  expect(c2d(G, h, "euler")(z)):near(at((z - 1)/h), 1e-14)
  expect(c2d(G, h, "backward")(z)):near(at((z - 1)/(h*z)), 1e-14)
  -- the impulse response of 1/(s+1), sampled: h Σ e^{-kh} z^{-k}
  expect(c2d(tf({1}, {1, 1}), h, "impulse")(z)):near(h*z/(z - math.exp(-h)), 1e-14)
  -- first-order hold of 1/s: the trapezoidal rule h/2 (z+1)/(z-1)
  expect(c2d(tf({1}, {1, 0}), h, "foh")(z)):near(h/2*(z + 1)/(z - 1), 1e-14)
  -- prewarping makes the response exact at that frequency
  local w = 2
  local P = c2d(G, h, "tustin", { prewarp = w })
  local p, e = G(complex(0, w)), P(complex(math.cos(w*h), math.sin(w*h)))
  expect(e):near(p, 1e-13)
end)

test("systems that no continuous system gives", function()
  expect(function() d2c(tf({1}, {1, 0.5}, 1)) end):fails "eigenvalue -0.5 on the negative real axis"
  expect(function() d2c(tf({1}, {1, 0}, 1)) end):fails "the eigenvalue 0"
  expect(function() d2c(tf({1}, {1, 1}, 1), "tustin") end):fails "z = -1 is a pole"
end)

---------------------------------------------------------------------------------------------------- time

test("e^{At} three ways", function()
  local A = mat{{0, 1}, {-2, -2}}
  local Phi = ss(A, {0, 1}):transition()
  expect(simplify(diff(Phi, t) - A*Phi)):equals(zeros(2, 2))
  expect(subs(Phi, { [t] = 0 })):equals(eye(2))
  expect(evaluate(Phi, { t = 1.3 })):near(expm(evaluate(A)*1.3), 1e-13)
  local w = param "w"
  expect(tostring(ss({{0, 1}, {-w^2, 0}}, {0, 1}):transition()(1, 1))):equals "cos(w t)"
  local a, b = params "a b"
  local T = ss({{a, 1}, {0, b}}, {0, 1}):transition()
  expect(evaluate(T, { a = 1, b = 2, t = 0.5 })):near(expm(evaluate(mat{{1, 1}, {0, 2}})*0.5), 1e-13)
end)

test("solution() solves the equation", function()
  local A, B = mat{{0, 1}, {-2, -3}}, vec{0, 1}
  for _, u in ipairs { 1, t, sin(2*t), exp(-t), t*exp(-2*t)*cos(t) } do
    local x = ss(A, B):solution({ 1, -1 }, { u })
    for _, at in ipairs { 0.3, 1.7 } do
      expect(evaluate(diff(x, t) - A*x - B*u, { t = at })):near(zeros(2, 1), 1e-12)
    end
    expect(subs(x, { [t] = 0 })):equals(vec{1, -1})
  end
  local k, b, x0 = params "k b x0"
  expect(tostring(simplify(ss({{-k}}, {b}):solution({ x0 }, { 1 })[1]))):equals "(x₀ - b/k) exp(-k t) + b/k"
end)

test("responses are exact at their times: against the solution formula and an integrator", function()
  local G = ss({{0, 1}, {-2, -2}}, {0, 1}, {1, 0})
  local r, exact = G:step({ 0, 0.5, 1, 2 }), G:solution({ 0, 0 }, { 1 })
  for i, at in ipairs { 0, 0.5, 1, 2 } do expect(r.y(i, 1)):near(evaluate(exact[1], { t = at }), 1e-14) end
  local x = var("x", 2)
  local sol = dae{ der(x) ~ G.A*x + G.B*sin(3*t) }:integrate{ start = { [x] = { 1, 0 } }, to = 2,
    method = rk.gauss(4), dt = 0.02 }
  local l = lsim(G, sin(3*t), linspace(0, 2, 11), { 1, 0 })
  expect(l.y(11, 1)):near(sol(x[1], 2), 1e-11)
  expect(lsim(G, function(at) return math.sin(3*at) end, linspace(0, 2, 11), { 1, 0 }).y):near(l.y, 1e-13)
  -- straight lines between samples: exact for ramps
  expect(lsim(tf({1}, {1, 0}), { 0, 1, 2 }, { 0, 1, 2 }).y):near({ 0, 0.5, 2 }, 1e-14)
  expect(lsim(tf({1}, {1, 0}), { 0, 1, 2 }, { 0, 1, 2 }, nil, { between = "hold" }).y):near({ 0, 0, 1 },
    1e-14)
  expect(G:impulse({ 0, 1 }).y(2, 1)):near(math.exp(-1)*math.sin(1), 1e-14)
  expect(G:initial({ 1, 0 }, { 0, 1 }).y(2, 1)):near(math.exp(-1)*(math.cos(1) + math.sin(1)), 1e-14)
end)

test("what is read off a step response of second order", function()
  -- ζ = 1/2: overshoot 100 e^{-πζ/√(1-ζ²)}, at π/(ωₙ√(1-ζ²))
  local r = tf({4}, {1, 2, 4}):step(linspace(0, 10, 4001))
  expect(r.overshoot):near(100*math.exp(-math.pi/math.sqrt(3)), 1e-5)
  expect(r.peak_time):near(math.pi/math.sqrt(3), 2e-3)
  expect(r.final):near(1, 1e-15)
  local lag = tf({1}, {1, 1}):step(linspace(0, 10, 10001))
  expect(lag.rise_time):near(math.log(9), 1e-6)
  expect(lag.settling_time):near(math.log(50), 1e-6)
end)

test("discrete responses follow the recursion", function()
  local G = ss({{0.5}}, {1}, {2}, {1}, 0.1)
  expect(G:step(0.3).y):near({ 1, 3, 4, 4.5 }, 1e-15)
  expect(G:impulse(0.3).y):near({ 1, 2, 1, 0.5 }, 1e-15)
  expect(lsim(G, { 1, 0, 0, 0 }).y):near({ 1, 2, 1, 0.5 }, 1e-15)
end)

---------------------------------------------------------------------------------------------------- frequency

test("margins, Franklin, Powell & Emami-Naeini, Feedback Control, ch. 6", function()
  -- K/(s+1)³: the phase is -180° at √3, where |G| = K/8
  local m = margin(tf({4}, {1, 3, 3, 1}))
  expect(m.gain):near(2, 1e-10)
  expect(m.gain_at):near(math.sqrt(3), 1e-10)
  local w = math.sqrt(4^(2/3) - 1)
  expect(m.phase_at):near(w, 1e-10)
  expect(m.phase):near(180 - 3*math.deg(math.atan(w)), 1e-8)
  expect(m.stable):equals(true)
  expect(margin(tf({9}, {1, 3, 3, 1})).stable):equals(false)
  expect(margin(tf({1}, {1, 1})).gain):equals(math.huge)
end)

test("the phase runs on without jumps", function()
  local r = tf({1}, {1, 3, 3, 1}):bode({ 0.01, 0.1, 1, 2, 10, 1000 })
  for i = 1, 6 do expect(r.phase(i, 1)):near(-3*math.deg(math.atan(r.w[i])), 1e-9) end
  expect(r.db(3, 1)):near(-30*math.log(2, 10)*1.0, 1e-9)
end)

test("figures", function()
  local G = tf({4}, {1, 1.2, 4})
  expect(tostring(G:step():plot())):equals "figure 'Step response': 1 series, 301 points"
  expect(G:bode():plot().title):equals "Bode diagram"
  expect(nyquist(G).title):equals "Nyquist curve"
  expect(G:nyquist().labels[3]):equals "-1"
  expect(G:pzmap().labels[1]):equals "poles"
  expect(pzmap(c2d(G, 0.1)).labels[3]):equals "unit circle"
  expect(G:bode():plot():text(60):match "phase"):equals "phase"
end)

---------------------------------------------------------------------------------------------------- errors

test("sizes and forms that do not fit are named", function()
  local function fails(f, text) expect(f):fails(text) end
  fails(function() ss({{1, 2}}, {1}, {1}) end, "A must be square, but it is 1×2")
  fails(function() ss(eye(2), {1, 2, 3}, {1, 0}) end, "B must have as many rows as A: A is 2×2, B is 3×1")
  fails(function() ss(eye(2), {1, 2}, {1, 2, 3}) end, "C must have as many columns as A: A is 2×2, C is 3×1")
  fails(function() ss(eye(2), {1, 2}, {1, 0}, eye(2)) end, "D must be 1×1 (outputs × inputs), but it is 2×2")
  fails(function() ss{ B = 1 } end, "A is required")
  fails(function() ss{ A = {{1}}, b = 1 } end, "unknown option 'b'")
  fails(function() tf({1}, {0}) end, "the denominator is zero")
  fails(function() tf({1}, {}) end, "den")
  fails(function() tf({1}, {1, 1}, -1) end, "the sampling time must be positive")
  fails(function() tf({1, 0, 0}, {1, 1}):ss() end,
    "a transfer function that is not proper has no state space: the numerator s² has degree 2, the denominator s + 1 degree 1")
  fails(function() tf "z" end, "z needs a sampling time")
  fails(function() return tf({1}, {1, 1}).A end, "a transfer function has no A")
  fails(function() zpk({ complex(0, 1) }, {}, 1) end, "needs its conjugate")
  fails(function() return tf({1}, {1, 1}) + tf({1}, {1, 1}, 0.1) end,
    "the sampling times differ: the first system is continuous, the second has the sampling time 0.1; convert one with c2d(G, Ts) or d2c(G)")
  fails(function() feedback(tf({1}, {1}), tf({1}, {1}), 1) end, "algebraic loop")
  fails(function() feedback(ss({{-1}}, {1}, {1}, {1}), ss({{-1}}, {1}, {1}, {-1})) end, "algebraic loop")
  fails(function() feedback(tf({1}, {1, 1}), 1, 3) end, "sign must be -1")
  fails(function() return ss(eye(2), eye(2)) * tf({1}, {1, 1}) end,
    "the outputs of one system must be the inputs of the next")
  fails(function() return ss(eye(2), eye(2)) + tf({1}, {1, 1}) end,
    "systems in parallel need the same inputs and outputs")
  fails(function() tf({1}, {1, 0}):dcgain() end,
    "the static gain is infinite: there is a pole at s = 0 (an integrator)")
  fails(function() tf({1}, {1, 1})(-1) end, "s = -1 is a pole")
  fails(function() return 1/tf({0}, {1, 1}) end, "division by a system that is zero")
  fails(function() tf({1}, {1, 1}):with{ q = 1 } end, "with")
  fails(function() tf({param "kq"}, {1, 1}):step() end,
    "the parameter 'kq' has no value; give it one with G:with{ kq = 1 }")
  fails(function() c2d(tf({1}, {1, 1}), 0) end, "the sampling time must be positive")
  fails(function() c2d(tf({1}, {1, 1}), 1, "zho") end, "Did you mean 'zoh'?")
  fails(function() c2d(tf({1}, {1, 1}, 1), 1) end, "the system is discrete already, with the sampling time 1")
  fails(function() d2c(tf({1}, {1, 1})) end, "the system is continuous already")
  fails(function() tf({1}, {1, -1}):gram() end, "a Gramian needs an asymptotically stable system")
  fails(function() tf({1}, {1, 1}):step { 1, 1 } end, "times must increase")
  fails(function() tf({1}, {1, 1}):step(-1) end, "the end must be a positive time")
  fails(function() lsim(tf({1}, {1, 1}), { 1, 2 }, { 0, 1, 2 }) end,
    "u must have one row per time and one column per input, 3×1")
  fails(function() lsim(tf({1}, {1, 1}), function() return 0/0 end, { 0, 1 }) end, "is not a finite number")
  fails(function() ss({{-1}}, {1}):initial { 1, 2 } end, "x0 has 2 entries for 1 state")
  fails(function() ss{ A = {{-1}}, states = "h" }:initial { g = 1 } end, "there is no state 'g'")
  fails(function() ss({{-1}}, {1}):solution({ 1 }, { 1/t }) end,
    "is not a polynomial, exponential, sine or cosine of t; use lsim(G, u, t)")
  fails(function() ss({{-1}}, {1}):solution({ 1 }, { var "w1" }) end, "u must not depend on w₁")
  fails(function() margin(ss(eye(2), eye(2))) end, "margins are for one input and one output")
  fails(function() tf({1}, {1, 1}):bode { -1 } end, "frequencies are not negative")
  fails(function() lyap({{1, 0}, {0, -1}}, eye(2)) end, "the Lyapunov equation has no unique solution")
  fails(function() logm(evaluate(mat{{-1}})) end, "negative real axis")
  fails(function() return ss({{1}}, {1}):poles()[3] end, "there is no pole number 3: the system has 1")
  fails(function() return tf({1}, {1, 0, 1}):poles().values end, "some poles are complex")
  fails(function() tf({{1}}, {1, 1}) end, "num is a list of lists")
end)

test("degenerate systems are no trouble", function()
  expect(ss(3):dcgain()):equals(3)
  expect(tostring(ss(3):poles())):equals "no poles"
  expect(tf({2}, {1}):step(1).y(1, 1)):equals(2.0)
  expect((tf({1}, {1, 1}) - tf({1}, {1, 1}))(2)):equals(0)
  expect(tf({0}, {1, 1}):bode({ 1 }).mag(1, 1)):equals(0.0)
  expect(ss({{0}}, {0}, {0}):controllability().rank):equals(0)
end)

test("values are numbers, in == and in formats", function()
  expect(tf({1}, {1, 2}):dcgain() == 0.5):is_true()
  expect(tf({6}, {1, 2, 3}):dcgain() == 2):is_true()
  expect(("%.3f"):format(tf({1}, {1, 3}):dcgain())):equals "0.333"
  expect(c2d(tf({1}, {1, 1}), 0.1).Ts == 0.1):is_true()
  expect(tf({1}, {1, 1}).Ts == 0):is_true()
  local k = param "k"
  expect(tostring(tf({1}, {1, k}):dcgain())):equals "1/k"
end)
