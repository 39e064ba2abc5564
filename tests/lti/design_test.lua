-- Control design against published values.

local function near(a, b, tol)
  return math.abs(evaluate(a) - b) <= (tol or 1e-10) * math.max(1, math.abs(b))
end
local function size(m)                               -- Frobenius norm
  if type(m) == "number" then return math.abs(m) end
  local sum = 0
  for i = 1, m.rows do for j = 1, m.cols do sum = sum + evaluate(m(i, j))^2 end end
  return math.sqrt(sum)
end
local function residual(A, B, Q, R, X)
  return size(A.T * X + X * A - X * B * inv(R) * B.T * X + Q) / size(X)
end

test("care: the first examples of the collection CAREX", function()
  -- Benner, Laub & Mehrmann, Chemnitz 1995: example 1 has X = [2 1; 1 2], closed-loop poles -1, -1
  local X, K, poles = care({{0, 1}, {0, 0}}, {0, 1}, {{1, 0}, {0, 2}}, 1)
  expect(near(X(1, 1), 2) and near(X(1, 2), 1) and near(X(2, 2), 2)):is_true()
  expect(near(K(1, 1), 1) and near(K(1, 2), 2)):is_true()
  -- example 2: X = [9 6; 6 4] (1 + √2), poles -√2, -0.5
  X, K, poles = care({{4, 3}, {-4.5, -3.5}}, {1, -1}, {{9, 6}, {6, 4}}, 1)
  local r = 1 + math.sqrt(2)
  expect(near(X(1, 1), 9 * r) and near(X(1, 2), 6 * r) and near(X(2, 2), 4 * r)):is_true()
  expect(near(poles.re[1], -math.sqrt(2)) and near(poles.re[2], -0.5)):is_true()
end)

test("care: CAREX 7, where entries differ by many decades", function()
  -- x₁₁ = (1 + √(1 + ε²))/ε², x₁₂ = 1/(2 + √(1 + ε²)), x₂₂ = (1 - ε² x₁₂²)/4
  for _, e in ipairs { 1, 1e-2, 1e-4, 1e-6 } do
    local X = care({{1, 0}, {0, -2}}, {e, 0}, {{1, 1}, {1, 1}}, 1)
    local root = math.sqrt(1 + e * e)
    expect(near(X(1, 1) * e * e, 1 + root, 1e-10)):is_true()
    expect(near(X(1, 2), 1 / (2 + root), 1e-9)):is_true()
    expect(near(X(2, 2), 0.25 * (1 - e * e / (2 + root)^2), 1e-9)):is_true()
  end
end)

test("care and dare solve their equations for random systems with several inputs", function()
  local seed = 7
  local function random() seed = (seed * 16807) % 2147483647 return seed / 2147483647 - 0.5 end
  for n = 1, 8 do
    local a, b, q = {}, {}, {}
    for i = 1, n do
      a[i], b[i], q[i] = {}, {}, {}
      for j = 1, n do a[i][j], q[i][j] = 3 * random(), i == j and 1.0 or 0.0 end
      for j = 1, 2 do b[i][j] = random() end
    end
    local A, B, Q, R = mat(a), mat(b), mat(q), mat{{2.0, 0.3}, {0.3, 1.0}}
    local X, K, poles = care(A, B, Q, R)
    expect(residual(A, B, Q, R, X) < 1e-11):is_true()
    for k = 1, n do expect(poles.re[k] < 0):is_true() end
    X, K, poles = dare(A, B, Q, R)
    local next = A.T * X * A - X - A.T * X * B * inv(R + B.T * X * B) * B.T * X * A + Q
    expect(size(next) / size(X) < 1e-11):is_true()
    for k = 1, n do expect(poles.re[k]^2 + poles.im[k]^2 < 1):is_true() end
  end
end)

test("dare: a singular A, and the scalar equation of the golden section", function()
  local X = dare({{0, 1}, {0, 0}}, {0, 1}, {{1, 0}, {0, 1}}, 1)      -- DAREX 2: X = diag(1, 2)
  expect(near(X(1, 1), 1) and near(X(2, 2), 2) and near(X(1, 2), 0)):is_true()
  local K, P = dlqr({{1}}, {{1}}, 1, 1)
  expect(near(P(1, 1), (1 + math.sqrt(5)) / 2)):is_true()
end)

test("units of the states and inputs do not matter", function()
  local A, B = mat{{0.0, 1}, {-2, -0.3}}, mat{{0.0}, {1}}
  local K0 = lqr(A, B, 1, 1)
  for _, u in ipairs { 1e-9, 1e-3, 1e3, 1e9 } do
    local T = mat{{1.0, 0}, {0, u}}
    local K = lqr(inv(T) * A * T, inv(T) * B, T.T * T, 1)
    expect(near(K(1, 1), evaluate(K0(1, 1)), 1e-9) and near(K(1, 2) / u, evaluate(K0(1, 2)), 1e-9)):is_true()
  end
end)

test("cross terms", function()
  -- the cost (x + u)² + u² is that of v = u + x/2 with other matrices: check by the equation
  local A, B, Q, R, N = mat{{-1.0}}, mat{{1.0}}, mat{{1.0}}, mat{{2.0}}, mat{{1.0}}
  local K, X = lqr(A, B, Q, R, N)
  local x = evaluate(X(1, 1))
  expect(math.abs(-2 * x - (x + 1)^2 / 2 + 1) < 1e-13):is_true()
end)

test("a regulator that cannot exist says why", function()
  expect(function() return lqr({{1, 0}, {0, -1}}, {0, 1}, 1, 1) end):fails "cannot be stabilised"
  expect(function() return lqr({{0, 0}, {0, -1}}, {0, 1}, 1, 1) end):fails "cannot be stabilised"
  expect(function() return lqr({{0, 1}, {-1, 0}}, {0, 1}, 0, 1) end):fails "does not weight"
  expect(function() return lqr({{0}}, {1}, 1, 0) end):fails "positive definite"
  expect(function() return lqr({{0}}, {1}, {{1, 0}, {0, 1}}, 1) end):fails "Q must be 1×1"
end)

test("place: single input, several inputs, complex and repeated poles", function()
  local K = place({{0, 1}, {0, 0}}, {0, 1}, {-1, -2})
  expect(near(K(1, 1), 2) and near(K(1, 2), 3)):is_true()
  -- Kautsky, Nichols & Van Dooren 1985, example 1 (chemical reactor): poles -0.2, -0.5, -5.0566, -8.6659
  local A = {{1.380, -0.2077, 6.715, -5.676}, {-0.5814, -4.290, 0, 0.6750}, {1.067, 4.273, -6.654, 5.893},
             {0.0480, 4.273, 1.343, -2.104}}
  local B = {{0, 0}, {5.679, 0}, {1.136, -3.146}, {1.136, 0}}
  local K, poles, condition = place(A, B, {-0.2, -0.5, -5.0566, -8.6659})
  for k, p in ipairs { -8.6659, -5.0566, -0.5, -0.2 } do expect(near(poles.re[k], p, 1e-8)):is_true() end
  expect(condition < 5):is_true()                              -- they report 3.4 … 4.6 for their methods
  local K, poles = place(A, B, { complex(-1, 2), complex(-1, -2), -3, -3 })
  expect(near(poles.re[3], -1, 1e-6) and near(poles.im[4], 2, 1e-6)):is_true()
  expect(function() return place({{0, 1}, {0, 0}}, {0, 1}, {-1, -1}) end):fails "repeat it at most"
  expect(function() return place({{0, 1}, {0, 0}}, {0, 1}, { -1, complex(-1, 1) }) end):fails "conjugate"
  expect(function() return place({{1, 0}, {0, 2}}, {0, 1}, {-1, -2}) end):fails "cannot be placed"
  expect(function() return place({{0, 1}, {0, 0}}, {0, 1}, {-1}) end):fails "expected 2 poles"
end)

test("acker is exact, and takes parameters and repeated poles", function()
  local k = param "k"
  expect(tostring(acker({{0, 1}, {-k, 0}}, {0, 1}, {-1, -1})) == "[1 - k  2]"):is_true()
  expect(function() return acker({{0, 1}, {0, 0}}, {{1, 0}, {0, 1}}, {-1, -2}) end):fails "one input"
  expect(function() return acker(tf({2}, {1}), {}) end):fails "no poles to place"
  expect(function() return acker(tf(1/(2*t)), {-1}) end):fails "no poles to place"
end)

test("Kalman filters", function()
  -- x′ = -x + w, y = x + v, Q = 3, R = 1: P = 1, L = 1
  local L, P, poles = lqe(ss({{-1}}, {1}, {1}), 3, 1)
  expect(near(L(1, 1), 1) and near(P(1, 1), 1) and near(poles.re[1], -2)):is_true()
  local E = kalman(ss({{0, 1}, {0, 0}}, {0, 1}, {1, 0}), {{0, 0}, {0, 1}}, 1)
  expect(#E.inputs == 2 and #E.outputs == 3 and E:is_stable()):is_true()
  -- random walk observed: Åström & Wittenmark, P = (1 + √5)/2 for Q = R = 1
  local L, P = lqe(ss({{1}}, {1}, {1}, {0}, 1), 1, 1)
  expect(near(P(1, 1), (1 + math.sqrt(5)) / 2) and near(L(1, 1), (math.sqrt(5) - 1) / 2)):is_true()
end)

test("integral action", function()
  local G = ss({{-1}}, {1}, {1})
  local K, X, poles = lqi(G, 1, 1)
  for k = 1, 2 do expect(poles.re[k] < 0):is_true() end
  expect(near(K(1, 2), -1)):is_true()
end)

test("balanced realisations and reduction", function()
  local G = tf({1, 10}, {1, 6, 11, 6})
  local B, hankel, T = balreal(G)
  local Wc, Wo = B:gram "c", B:gram "o"
  for k = 1, 3 do
    local sigma = evaluate(hankel[k])
    expect(near(Wc(k, k), sigma, 1e-10) and near(Wo(k, k), sigma, 1e-10)):is_true()
  end
  expect(near(B:dcgain(), 10 / 6, 1e-12)):is_true()
  for _, method in ipairs { "truncate", "dc" } do
    local H, _, bound = balred(G, 1, method)
    expect(#H.A == 1 and (parallel(G:ss(), -H):norm "inf") <= bound * (1 + 1e-9)):is_true()
  end
  expect(near(balred(G, 1, "dc"):dcgain(), 10 / 6, 1e-12)):is_true()
  expect(function() return balreal(tf({1}, {1, 0})) end):fails "asymptotically stable"
  expect(function() return balred(G, 5) end):fails "between 0 and 3"
end)

test("c2d matched keeps poles, zeros and the static gain", function()
  local H = c2d(tf({1, 2}, {1, 4, 3}):zpk(), 0.1, "matched")
  expect(near(H:dcgain(), 2 / 3, 1e-13)):is_true()
  expect(near(H:poles().re[1], math.exp(-0.3), 1e-13)):is_true()
  expect(near(H:zeros().re[1], math.exp(-0.2), 1e-13)):is_true()
  local I = c2d(tf({1}, {1, 0, 0}), 0.5, "matched")
  expect(near(I:zeros().re[1], -1, 1e-12)):is_true()
end)

test("Bode phases begin on the sheet of the integrators", function()
  expect(near(tf({1}, {1, 0, 0}):bode({1}).phase[1], -180)):is_true()
  expect(near(tf({1}, {1, 0, 0, 0}):bode({1}).phase[1], -270)):is_true()
  local phase = tf({10}, {1, 8, 0, 0}):bode({100}).phase[1]
  expect(near(phase, -180 - math.atan(100 / 8) * 180 / math.pi)):is_true()
  local wide = tf({10}, {1, 8, 0, 0}):bode({0.01, 0.02, 100})
  expect(near(wide.phase[3], -180 - math.atan(100 / 8) * 180 / math.pi)):is_true()
  expect(near(tf({-1}, {1, 1}):bode({1e-9}).phase[1], 180, 1e-6)):is_true()
  expect(near(tf({1}, {1, -1}):bode({1}).phase[1], -135)):is_true()
  expect(near(tf({-1, 1}, {1, 1}):bode({1e6}).phase[1], -180, 1e-5)):is_true()
end)

test("margins see the loop at ω = 0", function()
  local m = margin(tf({3, 6}, {1, 0, -1}))
  expect(near(m.gain, 1 / 6) and m.gain_at == 0):is_true()
end)

test("factors with irrational zeros print once", function()
  local text = tostring(tf({1}, {1, 1, 2}):zpk())
  expect(text:find("s² + s + 2", 1, true) ~= nil):is_true()
  expect(text:find(")²", 1, true) == nil):is_true()
end)

test("root loci end in the zeros", function()
  local f = rlocus(tf({1, 2}, {1, 1, 0}), { 0, 1, 1e9 })
  expect(f.title == "Root locus"):is_true()
  expect(function() return rlocus(tf({2}, {1})) end):fails "no poles"
end)

test("Padé approximants of a delay", function()
  for n = 1, 6 do
    local G = pade(0.5, n)
    local v = G(complex(0, 1))
    expect(near(v.re^2 + v.im^2, 1, 1e-12)):is_true()
    expect(math.abs(math.atan(evaluate(v.im), evaluate(v.re)) + 0.5) < 0.25^(2 * n)):is_true()
  end
  expect(function() return pade(1, 0) end):fails "from 1 to 10"
end)

test("Riccati equations at the borders of what has a solution", function()
  -- discrete time: inputs may cost nothing
  local X, K = dare({ { 2, -1 }, { 1, 0 } }, { 1, 0 }, { { 0, 0 }, { 0, 1 } }, 0)
  for i = 1, 2 do for j = 1, 2 do expect(X(i, j)):near(i == j and 1 or 0, 1e-10) end end
  expect(K(1, 1)):near(2, 1e-10)
  local _, L = dare({ { 1, 0.5 }, { 0, 1 } }, { { 1, 0 }, { 0, 1 } }, 1, { { 0, 0 }, { 0, 1 } })
  expect(L(1, 1)):near(1, 1e-8)                                      -- what costs nothing is used wholly
  expect(function() dare({ { 1 } }, { 1 }, 1, -1) end):fails "semidefinite"
  expect(function() dare({ { 0.5 } }, { 0 }, 1, 0) end):fails "R + BᵀXB is singular"
  expect(function() care({ { 1 } }, { 1 }, 1, 0) end):fails "positive definite"
  -- continuous time: unstable and with costs six decades apart, of any units
  for _, e in ipairs { 1e-6, 1, 1e6 } do
    local v = care({ { 3 * e } }, { 1 }, e, e)
    expect(v(1, 1)):near(3 * e^2 + e * math.sqrt(9 * e^2 + 1), 1e-12 * e * (6 * e + 1))
  end
end)

test("margins at the border are 0 dB and 0 degrees", function()
  for _, w in ipairs { 1e-6, 1, 7, 1e9 } do                      -- 2 w³/(s (s + w)²) reaches -1 at s = i w
    local text = tostring(margin(tf({2*w^3}, {1, 2*w, w^2, 0})))
    expect(text:find("1 (0 dB)", 1, true) ~= nil):is_true()
    expect(text:find "phase margin  0°" ~= nil):is_true()
  end
end)

test("minreal: a tolerance that is given holds for exact numbers, too", function()
  local G = tf({1, 1.0001}, {1, 3, 2})
  expect(#minreal(G):poles()):equals(2)
  local near = minreal(G, 1e-3)
  expect(#near:poles()):equals(1)
  expect(near:poles().re[1]):near(-2, 1e-9)
  expect(#minreal(G, 1e-6):poles()):equals(2)
  expect(#minreal(tf({1, 1}, {1, 3, 2}), 1e-9):poles()):equals(1)
  local a = param "a"
  expect(function() minreal(tf({1}, {1, a}), 1e-3) end):fails "tol compares numbers"
end)

test("regulators refuse rewards, filters inputs that are forgotten, zoh a prewarp", function()
  local A, B = { { 0, 1 }, { -2, -3 } }, { 0, 1 }
  expect(function() lqr(A, B, { { -1, 0 }, { 0, -1 } }, 1) end):fails "care(A, B, Q, R) solves"
  expect(function() dlqr(A, B, { { 1, 0 }, { 0, -1 } }, 1) end):fails "eigenvalue -1"
  expect(lqr(A, B, { { 1, 1 }, { 1, 1 } }, 1).cols):equals(2)          -- semidefinite
  local G = ss({ { 0.5 } }, { 1 }, { 1 }, { 0 }, 1)
  expect(function() kalman_filter(G, 1, 1, { y = { 1, 2 } }) end):fails "u = zeros(2, 1)"
  expect(kalman_filter(ss({ { 0.5 } }, { 0 }, { 1 }, { 0 }, 1), 1, 1, { y = { 1, 2 } }).x.rows):equals(2)
  expect(function() c2d(tf({ 1 }, { 1, 1 }), 0.1, "zoh", { prewarp = 3 }) end):fails [[for method "tustin"]]
  expect(function() return tf({ 1 }, { 1, 1 }).stable end):fails "G:is_stable()"
  expect(function() return delayed(tf({ 1 }, { 1, 1 }), 1):poles() end):fails "pade(G, 4)"
  expect(cond { { 1, 2 }, { 2, 4 } } > 1e15):is_true()
end)
