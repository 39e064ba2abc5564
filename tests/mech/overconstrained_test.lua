-- Overconstrained mechanisms of the textbooks: more constraints than the motion leaves, by lagrange alone.
-- Each against the same motion in one coordinate or two.
local taken = dofile "tests/part_of.lua"(3)
local forms = { "acc", "baumgarte", "project", "ode" }
local pi = math.pi

local function check(sys, start, to, watched, wanted, more)
  expect(sys:index()):equals(3)
  expect(sys:dof()):equals(2)
  expect(tostring(sys)):matches "z of least norm"
  for _, form in ipairs(more or forms) do
    if taken() then
      local sol = sys:reduce(form):integrate { start = start, to = to, rtol = 1e-9, atol = 1e-11 }
      expect(form .. " " .. sol.status):equals(form .. " finished")
      expect(sol(watched, to)):near(wanted, 1e-7)
    end
  end
end

-- The end of a motion in one angle, L² J(a) a′²/2 kinetic energy.
local function one_angle(T, V, a, first, speed, to)
  return lagrange { q = { a }, T = T, V = V }
    :integrate { start = { [a] = first, [a.dot] = speed }, to = to, rtol = 1e-11, atol = 1e-13 }(a, to)
end

-- Rz(ψ) Ry(θ) Rx(φ), by columns, and a point of a body.
local function rotation(f, th, ps)
  local cf, sf, ct, st, cp, sp = cos(f), sin(f), cos(th), sin(th), cos(ps), sin(ps)
  return { { cp*ct, cp*st*sf - sp*cf, cp*st*cf + sp*sf }, { sp*ct, sp*st*sf + cp*cf, sp*st*cf - cp*sf },
    { -st, ct*sf, ct*cf } }
end
local function point(r, R, p)
  local out = {}
  for i = 1, 3 do out[i] = r[i] + R[i][1]*p[1] + R[i][2]*p[2] + R[i][3]*p[3] end
  return out
end
local function body(q, k)
  return { q[6*k - 5], q[6*k - 4], q[6*k - 3] }, rotation(q[6*k - 2], q[6*k - 1], q[6*k])
end

test("a parallelogram with a third and a fourth crank, in angles", function()
  for _, L in ipairs { 1, 10, 1e-3 } do
    for cranks = 3, 4 do
      local q, D = var("angle", cranks + 1), 2*L
      local b = q[cranks + 1]
      local C, V, T, guess = {}, 0, D^2*b.dot^2/3 + L^2*q[1].dot^2/2, { [b] = 0 }
      for k = 1, cranks do
        if k > 1 then
          C[#C + 1] = L*cos(q[1]) + (k - 1)*D*cos(b) - (k - 1)*D - L*cos(q[k])
          C[#C + 1] = L*sin(q[1]) + (k - 1)*D*sin(b) - L*sin(q[k])
        end
        V, T, guess[q[k]] = V + 9.81*L*sin(q[k])/2, T + L^2*q[k].dot^2/6, 1
      end
      local sys, a, to = lagrange { q = q, T = T, V = V, C = C }, var "alpha", 0.3*math.sqrt(L)
      local wanted = one_angle((cranks/3 + 1)*L^2*a.dot^2/2, cranks*9.81*L*sin(a)/2, a, 1, 0, to)
      guess[q[1]] = nil
      check(sys, sys:init { fix = { [q[1]] = 1, [q[1].dot] = 0 }, guess = guess }, to, q[1], wanted)
    end
  end
end)

test("the same in coordinates of the pins", function()
  for _, L in ipairs { 1, 10, 1e-3 } do
    local p, D, C, guess = var("pin", 6), 2*L, {}, {}
    for k = 1, 3 do
      C[k] = (p[2*k - 1] - (k - 1)*D)^2 + p[2*k]^2 - L^2
      guess[p[2*k - 1]], guess[p[2*k]] = (k - 1)*D + L*math.cos(1), L*math.sin(1)
    end
    for k = 1, 2 do C[3 + k] = (p[2*k + 1] - p[2*k - 1])^2 + (p[2*k + 2] - p[2*k])^2 - D^2 end
    for i = 1, 2 do C[5 + i] = p[i] + p[4 + i] - 2*p[2 + i] end
    local sys = lagrange { q = p, T = dot(p.dot, p.dot)/2, V = 9.81*(p[2] + p[4] + p[6]), C = C }
    expect(tostring(sys)):matches "C₅ = C₄ %+ "
    local a, to = var "alpha", 0.3*math.sqrt(L)
    local wanted = one_angle(3*L^2*a.dot^2/2, 3*9.81*L*sin(a), a, 1, 0, to)
    guess[p[2]] = nil
    local start = sys:init { fix = { [p[2]] = L*math.sin(1), [p[2].dot] = 0 }, guess = guess }
    check(sys, start, to, asin(p[2]/L), wanted)
  end
end)

-- Sarrus 1853: two chains of two bars in planes at right angles lift a plate straight up.
test("Sarrus' linkage", function()
  local q, l, J = var("sarrus", 10), 1.5, 0.2
  local r, R = body(q, 1)
  local C, T = {}, 0
  for k = 1, 2 do
    local a, b = q[5 + 2*k], q[6 + 2*k]
    local reach, height = l + l*cos(a) + l*cos(b), l*sin(a) + l*sin(b)
    local hinge = k == 1 and { l, 0, 0 } or { 0, l, 0 }
    local here, there = point(r, R, hinge), k == 1 and { reach, 0, height } or { 0, reach, height }
    for i = 1, 3 do C[#C + 1] = here[i] - there[i] end
    C[#C + 1], C[#C + 2] = R[k][3 - k], R[3][3 - k]         -- the axis of the hinge
  end
  for i = 1, 10 do T = T + (i <= 3 and 1 or J)*q[i].dot^2/2 end
  local sys = lagrange { q = q, T = T, V = 9.81*q[3], C = C }
  local start = sys:init { fix = { [q[7]] = 1, [q[7].dot] = 0 },
    guess = { [q[3]] = 2*l*math.sin(1), [q[8]] = pi - 1, [q[9]] = 1, [q[10]] = pi - 1 } }
  local a = var "alpha"
  check(sys, start, 0.3, q[7],
    one_angle((2*l^2*cos(a)^2 + 2*J)*a.dot^2, 9.81*2*l*sin(a), a, 1, 0, 0.3))
end)

-- Denavit–Hartenberg matrices of links (length, twist) and joint angles.
local function link(length, twist, angle)
  local c, s, ca, sa = cos(twist), sin(twist), cos(angle), sin(angle)
  return mat{ { ca, -sa*c, sa*s, length*ca }, { sa, ca*c, -ca*s, length*sa }, { 0, s, c, 0 }, { 0, 0, 0, 1 } }
end
local function closure(A)                                  -- A = 1
  return { A(1, 4), A(2, 4), A(3, 4), A(1, 2), A(1, 3), A(2, 3) }
end
local function in_two_angles(T, V, C, a, b, first, second, to)
  local two = lagrange { q = { a, b }, T = T, V = V, C = { C } }
  local start = two:init { fix = { [a] = first, [a.dot] = 0 }, guess = { [b] = second } }
  return two:reduce():integrate { start = start, to = to, rtol = 1e-11, atol = 1e-13 }(a, to)
end

-- Bennett 1903: sin α/a = sin β/b, and tan(θ₁/2) tan(θ₂/2) = sin((β + α)/2)/sin((β - α)/2).
test("Bennett's linkage", function()
  local al, be = 0.6, 1.1
  local short, long = 1, math.sin(be)/math.sin(al)
  local th, a, b = var("th", 4), var "alpha", var "beta"
  local A = link(short, al, th[1])*link(long, be, th[2])*link(short, al, th[3])*link(long, be, th[4])
  local sys = lagrange { q = th, T = dot(th.dot, th.dot)/2, V = 9.81*sin(th[1]), C = closure(A) }
  local K = math.sin((be + al)/2)/math.sin((be - al)/2)
  local second = 2*math.atan(K/math.tan(0.5))
  local start = sys:init { fix = { [th[1]] = 1, [th[1].dot] = 0 },
    guess = { [th[2]] = second, [th[3]] = -1, [th[4]] = -second } }
  check(sys, start, 0.4, th[1], in_two_angles(a.dot^2 + b.dot^2, 9.81*sin(a),
    sin(a/2)*sin(b/2) - K*cos(a/2)*cos(b/2), a, b, 1, second, 0.4))
end)

-- Bricard 1927, three-fold symmetric: cos θ cos φ + cos θ + cos φ = 0 (Chen, You & Tarnai 2005).
test("Bricard's linkage", function()
  local th, a, b = var("th", 6), var "alpha", var "beta"
  local twist = function(k) return k % 2 == 1 and pi/2 or -pi/2 end
  local A = link(1, twist(1), th[1])*link(1, twist(2), th[2])*link(1, twist(3), th[3])
  local B = link(1, twist(4), th[4])*link(1, twist(5), th[5])*link(1, twist(6), th[6])
  local R, p = {}, {}                                      -- the inverse of B: Rᵀ, -Rᵀ p
  for i = 1, 3 do
    R[i], p[i] = {}, 0
    for k = 1, 3 do R[i][k], p[i] = B(k, i), p[i] - B(k, i)*B(k, 4) end
  end
  local C = { A(1, 4) - p[1], A(2, 4) - p[2], A(3, 4) - p[3],
    A(1, 2) - R[1][2], A(1, 3) - R[1][3], A(2, 3) - R[2][3] }
  local sys = lagrange { q = th, T = dot(th.dot, th.dot)/2, V = 9.81*sin(th[1]), C = C }
  local first = 1.9
  local second = math.acos(-math.cos(first)/(1 + math.cos(first)))
  local guess = { [th[3]] = first, [th[5]] = first }
  for k = 2, 6, 2 do guess[th[k]] = second end
  local start = sys:init { fix = { [th[1]] = first, [th[1].dot] = 0 }, guess = guess }
  check(sys, start, 0.4, th[1], in_two_angles(1.5*(a.dot^2 + b.dot^2), 9.81*sin(a),
    cos(a)*cos(b) + cos(a) + cos(b), a, b, first, second, 0.4))
end)

test("a door on three hinges", function()
  for _, l in ipairs { 1, 10 } do
    local q, J = var("door", 6), 0.1*l^2
    local r, R = body(q, 1)
    local C, T = {}, 0
    for k = 0, 2 do
      local p = point(r, R, { -l/2, 0, (k - 1)*l })
      for i = 1, 3 do C[#C + 1] = p[i] - (i == 3 and k*l or 0) end
    end
    for i = 1, 6 do T = T + (i <= 3 and 1 or J)*q[i].dot^2/2 end
    local sys = lagrange { q = q, T = T, V = 3*q[1], C = C }
    expect(tostring(sys)):matches "C₇ = %-C₁ %+ 2 C₄"
    local start = sys:init { fix = { [q[6]] = 1, [q[6].dot] = 0.3 },
      guess = { [q[1]] = l/2*math.cos(1), [q[2]] = l/2*math.sin(1), [q[3]] = l } }
    local a = var "alpha"
    check(sys, start, 0.5, q[6], one_angle((l^2/4 + J)*a.dot^2/2, 1.5*l*cos(a), a, 1, 0.3, 0.5))
  end
end)

test("a table on four legs", function()
  local q = var("table", 6)
  local r, R = body(q, 1)
  local C, T = {}, 0
  for k, corner in ipairs { { 1, 1 }, { 1, -1 }, { -1, -1 }, { -1, 1 } } do
    C[k] = point(r, R, { corner[1], 0.6*corner[2], -1 })[3]
  end
  for i = 1, 6 do T = T + (i <= 3 and 1 or 0.1)*q[i].dot^2/2 end
  local sys = lagrange { q = q, T = T, V = 9.81*q[3], C = C }
  expect(tostring(sys)):matches "C₄ = C₁ %- C₂ %+ C₃"
  expect(sys:dof()):equals(6)
  local start = sys:init { fix = { [q[1]] = 0, [q[2]] = 0, [q[6]] = 0.3, [q[1].dot] = 0, [q[2].dot] = 0.1,
    [q[6].dot] = 0.2 },
    guess = { [q[3]] = 1 } }
  for k = 1, 4 do expect(start(sys.multipliers[k])):near(-9.81/4, 1e-9) end
end)

-- A plane four-bar linkage of free bodies in space: 20 constraints in 18 coordinates, 17 of them independent.
test("a closed chain in space that moves in a plane", function()
  local q, length, ground, C = var("chain", 18), { 1, 2.2, 1.7 }, 2, {}
  local function join(p1, R1, p2, R2)                      -- one point, one axis z
    for i = 1, 3 do C[#C + 1] = p1[i] - p2[i] end
    for x = 1, 2 do C[#C + 1] = R1[1][x]*R2[1][3] + R1[2][x]*R2[2][3] + R1[3][x]*R2[3][3] end
  end
  local function tip(k, side)
    local r, R = body(q, k)
    return point(r, R, { side*length[k]/2, 0, 0 }), R
  end
  local base = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }
  join({ 0, 0, 0 }, base, tip(1, -1))
  local p, R = tip(1, 1)
  join(p, R, tip(2, -1))
  p, R = tip(2, 1)
  join(p, R, tip(3, 1))
  join({ ground, 0, 0 }, base, tip(3, -1))
  local a = var("bar", 3)                                  -- the same in a plane
  local tips = { length[1]*vec{ cos(a[1]), sin(a[1]) }, length[2]*vec{ cos(a[2]), sin(a[2]) },
    length[3]*vec{ cos(a[3]), sin(a[3]) } }
  local centres = { tips[1]/2, tips[1] + tips[2]/2, vec{ ground, 0 } + tips[3]/2 }
  local T, V, plane_T, plane_V = 0, 0, 0, 0
  for k = 1, 3 do
    for i = 1, 6 do T = T + (i <= 3 and 1 or 0.1)*q[6*k - 6 + i].dot^2/2 end
    local v = jacobian(centres[k], a)*a.dot
    V, plane_V = V + 9.81*q[6*k - 4], plane_V + 9.81*centres[k][2]
    plane_T = plane_T + dot(v, v)/2 + 0.05*a[k].dot^2
  end
  local loop = tips[1] + tips[2] - tips[3] - vec{ ground, 0 }
  local plane = lagrange { q = a, T = plane_T, V = plane_V, C = { loop[1], loop[2] } }
  local there = plane:init { fix = { [a[1]] = 1, [a[1].dot] = 0 }, guess = { [a[2]] = 0.3, [a[3]] = 1.4 } }
  local wanted = plane:reduce():integrate { start = there, to = 0.2, rtol = 1e-11, atol = 1e-13 }(a[1], 0.2)
  local sys, guess = lagrange { q = q, T = T, V = V, C = C }, {}
  for k = 1, 3 do
    guess[q[6*k - 5]], guess[q[6*k - 4]] = there(centres[k][1]), there(centres[k][2])
    if k > 1 then guess[q[6*k]] = there(a[k]) end
  end
  check(sys, sys:init { fix = { [q[6]] = 1, [q[6].dot] = 0 }, guess = guess }, 0.2, q[6], wanted)
end)
