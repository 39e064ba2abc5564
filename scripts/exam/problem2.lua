--- # Exam problem 2: system identification
--- Maximum likelihood with uniform noise, predictors, weighted least squares, and what one equation says
--- about two parameters. Corrections to the printed solution are said in comments.
--
--   ./dev run scripts/exam/problem2.lua              the numbers, and the figure with: … problem2.lua show

print "2(a)  y(t) + a1 y(t-1) = b0 u(t) + e(t), e uniform on [-1, 1], started from rest"
d = iddata {
  u = { 1, -1, 2, 0, -2, 1, 3, -1 },
  y = { 1.2, -.1, 1.9, .4, -2.1, -.2, 2.6, .5 },
}
a1, b0 = params "a1 b0"
model = idpoly { A = { 1, a1 }, B = { b0 } }
print(model:derivation())
print [[
e(t) = y(t) - ŷ(t) has density f = 1/2 on [-1, 1] and 0 outside; the samples are independent (exam (75)),
so that
  max over θ of Π f(y(t) - φ(t)ᵀθ)  =  (1/2)^N if |y(t) - φ(t)ᵀθ| ≤ 1 for every t, else 0.]]
-- exam (20) writes e = ŷ - y; only a symmetric density forgives the sign. The product over t = 0..N has N + 1
-- factors.
orders = { na = 1, nb = 1, nk = 0, ic = "zero" }
set = arx(d, { na = 1, nb = 1, nk = 0, ic = "zero", noise = uniform(-1, 1) })
print(set)
inside, outside = { -0.4, 0.9 }, { 0.5, 0.9 }
print("θ = (-0.4, 0.9) explains all samples: " .. tostring(set:contains(inside)))
good, sample = set:contains(outside)
print("θ = (0.5, 0.9) explains all samples: " .. tostring(good)
  .. ", the first it does not explain is sample " .. sample)
expect(set.volume):equals(rational("240209/693120"))

print "\nThe same data with |e| ≤ 0.3: no θ explains them, every θ has likelihood 0"
print(arx(d, { na = 1, nb = 1, nk = 0, ic = "zero", noise = uniform(-0.3, 0.3) }))
print "\nAs many samples as one likes do not make the estimate unique when u = 0"
silent = iddata { u = { 0, 0, 0, 0 }, y = { 0.5, -0.3, 0.8, -0.9 } }
print(arx(silent, { na = 1, nb = 1, nk = 0, ic = "zero", noise = uniform(-1, 1) }))

print "\n2(b)  Gaussian noise: the predictor, and what the input does"
print(model:predictor())
fit = arx(d, orders)
print(fit)
print "The input is the second column of Φ. It decides whether ΦᵀΦ is regular, and the covariance σ²(ΦᵀΦ)⁻¹:"
seed = 1
function random()                                  -- uniform on [-1, 1], the same numbers on every machine
  seed = (1103515245 * seed + 12345) % 2147483648
  return seed / 1073741824 - 1
end
function gauss()                                   -- a sum of twelve: normal enough, variance 1
  local sum = 0
  for _ = 1, 12 do sum = sum + random() end
  return sum / 2
end
function respond(u, sigma)                         -- a1 = -0.7, b0 = 1
  local y = {}
  for t = 1, #u do y[t] = 0.7 * (y[t-1] or 0) + u[t] + sigma * gauss() end
  return iddata { u = u, y = y }
end
for _, case in ipairs { "zero", "constant", "white" } do
  local u = {}
  for t = 1, 200 do u[t] = case == "white" and random() or case == "constant" and 1 or 0 end
  local m = arx(respond(u, 0.1), orders)
  print(("  %-8s  rank %d, std of a1 %.4f, std of b0 %s"):format(case, m.rank, m.std[1],
    m.std[2] < math.huge and ("%.4f"):format(m.std[2]) or "none: " .. m.unidentifiable[1]))
  if m.advice[1] then print("            " .. m.advice[1]) end
end

print "\n2(c)  min ½‖Aθ - y‖² weighted with Σ⁻¹"
print [[
1. The data are y = Aθ + e with e normal, centred, of covariance Σ, and nothing else; A is known exactly.
2. θ̂ = (AᵀΣ⁻¹A)⁻¹AᵀΣ⁻¹y is linear in the random y, so cov θ̂ = (AᵀΣ⁻¹A)⁻¹ (exam (78)): here by formula and by
   experiment.
3. Σ⁻¹ weighs the errors: what is noisy or correlated counts less. Σ should be the covariance of e.]]
A = { { 1, 0 }, { 1, 1 }, { 1, 2 }, { 1, 3 }, { 1, 4 } }
S = mat { { 1, .9, 0, 0, 0 }, { .9, 1, 0, 0, 0 }, { 0, 0, 1, 0, 0 }, { 0, 0, 0, 4, 0 }, { 0, 0, 0, 0, 9 } }
truth = vec { 2, -1 }
-- S = L Lᵀ by hand, so that e = L w has covariance S
L = mat { { 1, 0, 0, 0, 0 }, { .9, math.sqrt(1 - .81), 0, 0, 0 }, { 0, 0, 1, 0, 0 }, { 0, 0, 0, 2, 0 },
  { 0, 0, 0, 0, 3 } }
function experiment(options, runs)                 -- the covariance of `runs` estimates
  local sum, squares = { 0, 0 }, { 0, 0, 0 }
  for _ = 1, runs do
    local y = mat(A) * truth + L * vec { gauss(), gauss(), gauss(), gauss(), gauss() }
    local th = lsq(A, y, options).theta
    local p, q = th[1] - 2, th[2] + 1
    squares = { squares[1] + p * p, squares[2] + p * q, squares[3] + q * q }
  end
  return { squares[1] / runs, squares[2] / runs, squares[3] / runs }
end
optimal = lsq(A, mat(A) * truth, { covariance = S, names = { "θ1", "θ2" } })
weighted, plain = experiment({ covariance = S }, 4000), experiment({}, 4000)
C = optimal.covariance
print(("  by formula (78)        var θ1 %.3f   cov %.3f   var θ2 %.3f"):format(C(1, 1), C(1, 2), C(2, 2)))
print(("  4000 experiments       var θ1 %.2f    cov %.2f    var θ2 %.2f"):format(table.unpack(weighted)))
print(("  unweighted, the same   var θ1 %.2f    cov %.2f    var θ2 %.2f"):format(table.unpack(plain)))
-- The variance of an estimated variance is 2 v²/n: 4 σ of 4000 experiments is 9 %.
expect(weighted[1] / C(1, 1)):near(1, 0.09)
expect(weighted[3] / C(2, 2)):near(1, 0.09)
expect(plain[1] > 1.5 * C(1, 1)):is_true()

print "\n2(d)  ŷ(t) = a y(t-1) + b u(t-1), data y = (0, 1), u = (1, 0)"
y, u = func "y", func "u"
a, b = params "a b"
p = predictor(a * y(t-1) + b * u(t-1))
print(p)
two = iddata { y = { 0, 1 }, u = { 1, 0 } }
print(p:fit(two))
Phi = mat { { 0, 1 } }                             -- row t = 1: y(0), u(0)
print("Row t = 1 is [y(0)  u(0)] θ = y(1):  Φ =", Phi, "and ΦᵀΦ ="); print(Phi.T*Phi)
print "is singular, so (ΦᵀΦ)⁻¹Φᵀy does not exist. One equation, y(1) = a·0 + b·1: b = 1, a is free, the estimate of"
print "minimum norm is (0, 1)."
expect(det(Phi.T*Phi)):equals(0)
-- exam (34) puts y(0), u(0) into the row of t = 0 and gets (a, b) = (1, 0): row t must hold y(t-1), u(t-1).
printed = idpoly { A = { 1, -1 }, B = { 0, 0 } }
print(("the printed solution (a, b) = (1, 0) predicts ŷ(1) = %g"):format(printed:predict(two)[2])
  .. ", but y(1) = 1: it is refuted")
expect(p:fit(two).theta):near({ 0, 1 }, 1e-15)
expect(printed:predict(two)[2]):equals(0)

if arg and arg[1] == "show" then set:plot():show() end
