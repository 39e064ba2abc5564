-- e^A, log A, √A and what is computed with them, for time constants over many decades.

local function near(a, b, digits) return math.abs(evaluate(a) - b) <= 10^-digits * math.abs(b) end

local function size(m)                               -- Frobenius norm
  if type(m) == "number" then return math.abs(m) end
  local sum = 0
  for i = 1, m.rows do for j = 1, m.cols do sum = sum + evaluate(m(i, j))^2 end end
  return math.sqrt(sum)
end

test("e^A of a badly scaled rotation has 14 digits", function()
  for _, scale in ipairs { 1, 1e4, 1e8, 1e12, 1e-12 } do
    local E = expm(mat{{0.0, 1 / scale}, {-scale, 0.0}})
    expect(near(E(1, 1), math.cos(1), 14)):is_true()
    expect(near(E(1, 2), math.sin(1) / scale, 14)):is_true()
    expect(near(E(2, 1), -math.sin(1) * scale, 14)):is_true()
  end
end)

test("Moler's example of a matrix that balancing mends", function()
  -- Ward's and Moler's matrix, eigenvalues -63, -6.2, -0.11; values in 50 digits
  local a, b, c = 2e10, 4e8 / 6, 200 / 3
  local E = expm(mat{{0, 1e-8, 0}, {-(a + b), -3, a}, {c, 0, -c}} * 1.0)
  local want = { { 0.446849468283175, 1.54044157383952e-09, 0.462811453558774 },
                 { -5743067.77947947, -0.0152830038686819, -4526542.71278401 },
                 { 0.447722977849494, 1.54270484519591e-09, 0.463480648837651 } }
  for i = 1, 3 do for j = 1, 3 do expect(near(E(i, j), want[i][j], 12)):is_true() end end
end)

test("time constants fifteen decades apart", function()
  for _, fast in ipairs { 1e3, 1e6, 1e9, 1e12 } do
    -- x₁′ = -x₁, x₂′ = fast (x₁ - x₂): x₂ = fast/(fast - 1) (e^{-t} - e^{-fast t})
    local E = expm(mat{{-1.0, 0}, {fast, -fast}})
    expect(near(E(1, 1), math.exp(-1), 13)):is_true()
    expect(near(E(2, 1), fast / (fast - 1) * math.exp(-1), 13)):is_true()
    -- the same seen from a rotated basis, where no entry is zero
    local c, s = 0.6, 0.8
    local R = mat{{c, s}, {-s, c}}
    local F = R * mat{{-1.0, 0}, {0, -1000.0}} * R.T
    local G = expm(F)
    expect(near(G(1, 1), c * c * math.exp(-1), 12)):is_true()
  end
end)

test("triangular matrices with large entries off the diagonal", function()
  for _, b in ipairs { 1e3, 1e9, 1e15 } do
    local E = expm(mat{{1.0, b}, {0, -1.0}})
    expect(near(E(1, 1), math.exp(1), 14)):is_true()
    expect(near(E(1, 2), b * math.sinh(1), 13)):is_true()
  end
end)

test("powers, inverses and roots agree with e^A", function()
  local A = mat{{-0.3, 1.2, 0.1}, {-2.0, 0.4, 0.7}, {0.2, -0.6, -1.1}}
  local E, half = expm(A), expm(A * 0.5)
  expect(size(half * half - E) < 1e-14 * size(E)):is_true()
  expect(size(sqrtm(E) - half) < 1e-13):is_true()
  expect(size(logm(E) - A) < 1e-13):is_true()
  expect(size(expm(A * -1.0) * E - expm(A * 0.0)) < 1e-13):is_true()
end)

test("logarithms and roots of badly scaled matrices", function()
  for _, scale in ipairs { 1e-9, 1e-3, 1, 1e6, 1e9 } do
    local A = mat{{-0.1, 1 / scale}, {-scale, -0.2}}
    local L = logm(expm(A))
    expect(near(L(1, 2), 1 / scale, 12)):is_true()
    expect(near(L(2, 1), -scale, 12)):is_true()
    local R = sqrtm(expm(A))
    expect(near(R(2, 1), expm(A * 0.5)(2, 1), 12)):is_true()
  end
  expect(function() return sqrtm{{-1.0, 0}, {0, 1}} end):fails "negative real axis"
  expect(function() return logm{{0.0, 0}, {0, 1}} end):fails "eigenvalue 0"
end)

test("the step of an RLC circuit of any size", function()
  for _, size in ipairs { 1e12, 1e6, 1, 1e-6, 1e-9, 1e-12 } do
    local L, C = 1e3 * size, size                    -- 1 nH and 1 pF at size = 1e-12
    local R = 0.5 * math.sqrt(L / C)
    local w, zeta = 1 / math.sqrt(L * C), R / 2 * math.sqrt(C / L)
    local wd = w * math.sqrt(1 - zeta^2)
    local t = { 0, 0.5 / w, 1 / w, 3 / w }
    local y = tf({1}, {L * C, R * C, 1}):step(t).y
    for k = 2, #t do
      local swing = math.cos(wd * t[k]) + zeta * w / wd * math.sin(wd * t[k])
      local want = 1 - math.exp(-zeta * w * t[k]) * swing
      expect(near(y(k, 1), want, 12)):is_true()
    end
    local H = c2d(tf({1}, {L * C, R * C, 1}):ss(), 1 / w)
    local T = H.A(1, 1) + H.A(2, 2)
    expect(near(T, 2 * math.exp(-zeta) * math.cos(wd / w), 12)):is_true()
    expect(near(d2c(H):charpoly()[3], w * w, 11)):is_true()
  end
end)

test("an input known everywhere drives a stiff system", function()
  local G = ss({{-1, 0}, {1e6, -1e6}}, {1, 0}, {0, 1})
  local r = lsim(G, function(t) return math.cos(t) end, { 0, 1, 2, 4 })
  local want = function(t) return (math.cos(t) + math.sin(t) - math.exp(-t)) / 2 end
  for k, t in ipairs { 1, 2, 4 } do expect(math.abs(r.y(k + 1, 1) - want(t)) < 3e-6):is_true() end
end)

test("entries beyond what double precision can follow are refused, at every size", function()
  for _, A in ipairs { mat{{1e308, 1e308}, {1e308, 1e308}}, mat{{1e200, 1}, {1, 1e200}},
    mat{{0, 1e200}, {-1e200, 0}}, mat{{2e300, 1e300}, {0, 2e300}} } do
    for _, scaled in ipairs { A, A/1.000001 } do
      local done, why = pcall(expm, scaled)
      expect(done):equals(false)
      local said = why:find "overflows double precision" or why:find "no finite real value"
      expect(said ~= nil):is_true()
    end
  end
  expect(expm(mat{{0, 1e300}, {0, 0}})):equals(mat{{1, 1e300}, {0, 1}})
end)

test("exact forms of close eigenvalues do not cancel when they are evaluated", function()
  -- values in 50 digits: the gap of the eigenvalues, e^A(1, 2), e^A(1, 3), y(1) of 1/((s + 1)(s + 1 + gap))
  local cases = {
    { 1/1000.0, 0.36769556274877158, 0.55126769497799089, 0.26416083524454159 },
    { 1e-5, 0.36787760178036777, 0.55181364360080087, 0.26424031464504344 },
    { 1e-7, 0.36787942277747088, 0.5518191065752508, 0.26424110962697583 },
  }
  for i, case in ipairs(cases) do
    local gap = 1/expand(({ 1000, 100000, 10000000 })[i])
    local E = evaluate(expm(mat{{-1, 1, 1}, {0, -1 - gap, 1}, {0, 0, -1 - 2*gap}}))
    expect(near(E(1, 2), case[2], 15)):is_true()
    expect(near(E(1, 3), case[3], 15)):is_true()
    local G = tf({1}, {1, 2 + gap, 1 + gap}):ss()
    local y = (G.C * G:solution({ 0, 0 }, { 1 }))[1]
    expect(near(evaluate(y, { t = 1 }), case[4], 15)):is_true()
    expect(near(evaluate(subs(y, { t = 1 })), case[4], 15)):is_true()
  end
end)

test("sums that cancel, in every scale", function()
  local x = var "x"
  for _, h in ipairs { 1e-3, 1e-6, 1e-9, 1e-12 } do
    expect(near(evaluate((exp(x) - 1)/x, { x = h }), 1 + h/2 + h^2/6 + h^3/24, 12)):is_true()
    expect(near(evaluate((1 - cos(x))/x^2, { x = h }), 0.5 - h^2/24, 12)):is_true()
    expect(near(evaluate(log(1 + x)/x, { x = h }), 1 - h/2 + h^2/3, 9)):is_true()
    expect(near(evaluate((sinh(x) - x)/x^3, { x = h }), 1/6 + h^2/120, 12)):is_true()
    expect(near(evaluate(sqrt(x^2 + 1) - x, { x = 1/h }), h/2 - h^3/8, 6)):is_true()
  end
  expect(evaluate(sqrt(x)^2 - x, { x = 2 })):equals(0.0)
  expect(evaluate(x - 3*x/3, { x = 0.1 })):equals(0.0)
end)
