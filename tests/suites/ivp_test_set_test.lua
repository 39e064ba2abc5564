-- Problems of Mazzia & Magherini, Test Set for Initial Value Problem Solvers, release 2.4 (Bari), against
-- the end values published there; others of that set are in stdlib/problems, in
-- tests/integrate/run/bench_digits_test.lua and in tests/integrate/event/pieces_at_borders_test.lua.
local methods = { "auto", "radau", "bdf", "gauss" }

--- Largest error at the end in units of rtol, relative to the larger of |value| and its size: one for all, or
--- { symbol = size }.
local function tolerances_off(sol, reference, rtol, size)
  local worst = 0
  for symbol, value in pairs(reference) do
    local scale = math.max(math.abs(value), size[symbol] or 0)
    worst = math.max(worst, math.abs(sol:final(symbol) - value)/scale/rtol)
  end
  return worst
end

-- ── NAND gate: C(y) y′ = f(t, y), 14 unknowns; three MOS transistors after Shichman and Hodges ──

--- A periodic trapezoid from 0 to 5 with edges of 5 units, until t = 80.
local function pulse(delay, high, period)
  local sum = 0
  for first = delay, 79, period do
    for _, corner in ipairs { { 0, 1 }, { 5, -1 }, { 5 + high, -1 }, { 10 + high, 1 } } do
      sum = sum + corner[2]*max(t - first - corner[1], 0)
    end
  end
  return sum
end

local function nand_gate()
  local y, VDD, VBB = var("y", 14), 5, -2.5
  local CG, C9, V1, V2 = 0.6e-4, 0.5e-4, pulse(5, 5, 20), pulse(15, 15, 40)
  -- the current of one direction; VT0, gamma, phi are those of the load (depletion) or of a switch
  local function current(of, beta, vds, vg, vb)
    local u = vg - of[1] - of[2]*(sqrt(of[3] - vb) - sqrt(of[3]))
    return beta*(1 + vds/50)*ifelse(le(u, 0), 0, ifelse(le(u, vds), u^2, vds*(2*u - vds)))
  end
  local load, switch = { -2.43, 0.2, 1.28, 5.35e-4, 5.35e-4 }, { 0.2, 0.035, 1.01, 1.748e-3, 1.748e-4 }
  -- from drain to source; gate, bulk at the source and bulk at the drain are nodes
  local function drain(of, d, s, gate, bs, bd)
    return ifelse(gt(d - s, 0), -current(of, of[4], d - s, gate - s, bs),
      current(of, of[5], s - d, gate - d, bd))
  end
  -- a junction takes C(v) v′ and its leakage
  local function junction(v)
    return ifelse(le(v, 0), 2.4e-5/sqrt(1 - v/0.87), 2.4e-5*(1 + v/1.74))*der(v)
      + ifelse(le(v, 0), 1e-14*(exp(v/25.85) - 1), 0)
  end
  local i1 = drain(load, y[2], y[1], y[5], y[3] - y[5], y[4] - VDD)
  local i2 = drain(switch, y[7], y[6], V1, y[8] - y[10], y[9] - y[5])
  local i3 = drain(switch, y[12], y[11], V2, y[13], y[14] - y[10])
  local b3, b4, b8 = junction(y[3] - y[5]), junction(y[4] - VDD), junction(y[8] - y[10])
  local b9, b13, b14 = junction(y[9] - y[5]), junction(y[13]), junction(y[14] - y[10])
  local sys = dae {
    CG*der(y[1] - y[5]) ~ (y[5] - y[1])/4 - i1, CG*der(y[2] - y[5]) ~ (VDD - y[2])/4 + i1,
    b3 ~ (VBB - y[3])/10, b4 ~ (VBB - y[4])/10,
    CG*der(2*y[5] - y[1] - y[2]) + C9*der(y[5]) - b3 - b9 ~ (y[1] - y[5])/4 + (y[7] - y[5])/4,
    CG*der(y[6] - V1) ~ (y[10] - y[6])/4 - i2, CG*der(y[7] - V1) ~ (y[5] - y[7])/4 + i2,
    b8 ~ (VBB - y[8])/10, b9 ~ (VBB - y[9])/10,
    C9*der(y[10]) - b8 - b14 ~ (y[6] - y[10])/4 + (y[12] - y[10])/4,
    CG*der(y[11] - V2) ~ -y[11]/4 - i3, CG*der(y[12] - V2) ~ (y[10] - y[12])/4 + i3,
    b13 ~ (VBB - y[13])/10, b14 ~ (VBB - y[14])/10 }
  local at_80 = { 4.971088699385777, 4.999752103929311, -2.499998781491227, -2.499999999999975,
    4.970837023296724, -0.2091214032073855, 4.970593243278363, -2.500077409198803, -2.499998781491227,
    -0.2090289583878100, -0.2399999999966269e-3, -0.2091214032073855, -2.499999999999991, -2.500077409198803 }
  local reference = {}
  for i, value in ipairs(at_80) do reference[y[i]] = value end
  local start = { 5, 5, VBB, VBB, 5, 3.62385, 5, VBB, VBB, 3.62385, 0, 3.62385, VBB, VBB }
  return sys, { [y] = start }, reference, y
end

test("NAND gate, whose voltages meet where currents of transistors turn", function()
  local sys, start, reference, y = nand_gate()
  expect(sys:index()):equals(0)
  expect(sys:dof()):equals(14)
  for _, method in ipairs(methods) do
    for _, rtol in ipairs { 1e-4, 1e-7, 1e-8, 1e-10 } do
      local sol = sys:integrate { start = start, to = 80, rtol = rtol, atol = rtol/10, method = method }
      expect(sol.status):equals "finished"
      expect(tolerances_off(sol, reference, rtol, { [y[11]] = 0.01 }) < 100):is_true()
    end
  end
end)

-- ── slider crank whose rod is flexible, index 3: Simeon, Math. Modelling of Systems 2, 1996 ──

--- Two shapes of bending (sines) and a quadratic element along the rod; the crank turns at 150 rad/s.
local function flexible_crank()
  local p, q, v, w, la = var("p", 3), var("q", 4), var("v", 3), var("w", 4), var("la", 3)
  local m2, m3, l1, l2, j1, j2 = 0.151104, 0.075552, 0.15, 0.3, 0.002727, 0.0045339259
  local rho, d, PI = 7870, 0.008, 3.1415927
  local volume, k = d^2*l2, 0.2e12*d^2/l2
  local M = rho*volume*mat{ { 1/2, 0, 0, 0 }, { 0, 1/2, 0, 0 }, { 0, 0, 8, 1 }, { 0, 0, 1, 2 } }
  local bend = PI^4*(d/l2)^2
  local K = k*mat{ { bend/24, 0, 0, 0 }, { 0, bend*2/3, 0, 0 }, { 0, 0, 16/3, -8/3 }, { 0, 0, -8/3, 7/3 } }
  local b13, b14, b24 = -16/PI^3, 8/PI^3 - 1/PI, 1/(2*PI)
  local B = rho*volume*mat{ { 0, 0, b13, b14 }, { 0, 0, 0, b24 }, { -b13, 0, 0, 0 }, { -b14, -b24, 0, 0 } }
  local c1, c2 = rho*volume*vec{ 0, 0, 2/3, 1/6 }, rho*volume*vec{ 2/PI, 0, 0, 0 }
  local c12, c21 = rho*volume*l2*vec{ 0, 0, 1/3, 1/6 }, rho*volume*l2*vec{ 1/PI, -1/(2*PI), 0, 0 }
  local s, c = sin(p[1] - p[2]), cos(p[1] - p[2])
  local joint = { l1*sin(p[1]) + (l2 + q[4])*sin(p[2]), p[3] - l1*cos(p[1]) - (l2 + q[4])*cos(p[2]),
    p[1] - 150*t }
  local function pull(unknown) return dot(la, vec(map(joint, function(e) return diff(e, unknown) end))) end
  local mixed = l1*l2*m2*c/2 + l1*(s*dot(c2, q) + c*dot(c1, q))
  local to_crank, to_rod = l1*(c*c2 - s*c1), c21 + B.T*q
  local sys = dae { der(p) ~ v, der(q) ~ w,
    (j1 + m2*l1^2)*der(v[1]) + mixed*der(v[2]) + dot(to_crank, der(w)) + pull(p[1])
      ~ v[2]^2*(l1*(c*dot(c2, q) - s*dot(c1, q)) - l1*l2*m2*s/2) - 2*l1*v[2]*(c*dot(c1, w) + s*dot(c2, w)),
    mixed*der(v[1]) + (j2 + dot(q, M*q) + 2*dot(c12, q))*der(v[2]) + dot(to_rod, der(w)) + pull(p[2])
      ~ v[1]^2*(l1*(s*dot(c1, q) - c*dot(c2, q)) + l1*l2*m2*s/2) - 2*v[2]*(dot(c12, w) + dot(w, M*q))
        - dot(w, B*w),
    m3*der(v[3]) + pull(p[3]) ~ 0,
    to_crank*der(v[1]) + to_rod*der(v[2]) + M*der(w) + vec { pull(q[1]), pull(q[2]), pull(q[3]), pull(q[4]) }
      ~ v[2]^2*(M*q + c12) + l1*v[1]^2*(c*c1 + s*c2) + 2*v[2]*(B*w) - K*q,
    0 ~ vec(joint) }
  local at_end = { [p[2]] = -0.3311734988256260, [p[3]] = 0.1697373328427860, [q[1]] = 0.1893192899613509e-3,
    [q[2]] = 0.2375751249879174e-4, [q[3]] = -0.5323896770569702e-5, [q[4]] = -0.8363313279112129e-5,
    [v[2]] = 60.25346755138369, [v[3]] = -8.753116326670527, [w[1]] = -0.3005541400289738e-1,
    [w[2]] = -0.5500431812571696e-2, [la[1]] = -62.32935833287916, [la[2]] = -163.7920993367306,
    [la[3]] = 25.29857947066878 }
  local start = { [q] = { 0, 0, 0.103339863e-4, 0.169327969e-4 },
    [w] = { 0.444896105, 0.463434311e-2, -0.178591076e-5, -0.268938672e-5 } }
  local size = { [w[1]] = 0.5, [w[2]] = 0.5, [q[2]] = 2e-4 }
  return sys, start, { [p[1]] = 0, [p[2]] = 0, [p[3]] = 0.45 }, at_end, size
end

test("slider crank with a flexible rod, in every form", function()
  local sys, fix, guess, reference, size = flexible_crank()
  expect(sys:index()):equals(3)
  expect(sys:dof()):equals(8)
  local at = sys:init { fix = fix, guess = guess }
  for _, form in ipairs { "", "acc", "ggl", "baumgarte", "dummy", "array" } do
    local low = form == "" and sys:reduce() or sys:reduce(form, form == "dummy" and { at = at } or nil)
    expect(low:dof()):equals(8)
    for _, rtol in ipairs { 1e-5, 1e-8 } do
      local sol = low:integrate { start = at, to = 0.1, rtol = rtol, method = "radau",
        direct = form == "ggl" or nil }
      expect(sol.status):equals "finished"
      expect(tolerances_off(sol, reference, rtol, size) < 100):is_true()
    end
  end
end)

-- ── wheelset on a straight track, index 2 and 3: Simeon, Führer & Rentrop, Surv. Math. Ind. 1, 1991 ──

local x, y, z, theta, phi, vx, vy, vz, vt, vp, beta = vars "x y z theta phi vx vy vz vt vp beta"
local st, ct, sp, cp = sin(theta), cos(theta), sin(phi), cos(phi)

--- The contact of one conical wheel with its round rail; e = 1 on the left, -1 on the right.
local function contact(e, psi, xi)
  local slope, ss, cs = math.tan(0.0262), sin(psi), cos(psi)
  local r, dr = 0.1 + slope*(0.1506 - e*xi), -e*slope
  local d = e*(x + xi*ct*cp + r*(ct*sp*cs - st*ss)) - 0.1506 - math.sin(0.0262)*0.06
  local height = sqrt(0.06^2 - d^2)
  local rail, drail = height - 0.1 - math.cos(0.0262)*0.06, -e*d/height
  local plane = atan(((dr*cp - sp*cs)*ct + ss*st)/(-e*(dr*sp + cs*cp)))
  return { e = e, xi = xi, r = r, ss = ss, cs = cs, sd = sin(plane), cd = cos(plane),
    size = 0.5/(r*math.sqrt(1 + slope^2)) + 0.5*0.06^2/height^3/(1 + drail^2)^1.5,
    normal = { drail, -1, 0, drail*(r*(-ct*ss - cs*sp*st) - cp*st*xi),
      -cs*r*sp - cp*xi + drail*(cp*cs*ct*r - ct*sp*xi) },
    gap = rail - y - xi*sp + r*cp*cs,
    parallel = { drail*(dr*sp + cp*cs) + dr*ct*cp - ct*sp*cs + st*ss, dr*st*cp - st*sp*cs - ct*ss } }
end

--- Creep after Jaschinski: the force on a wheel and its moments about θ, φ and the axle.
local function creep(s, force)
  local e, xi, r, ss, cs, cd, sd, spin = s.e, s.xi, s.r, s.ss, s.cs, s.cd, s.sd, 300 + beta
  local si, co, G = sin(theta/cd), cos(theta/cd), 7.92e10
  local c = (3*abs(force)*0.72*1.3537956/(2*3.1415926*s.size*G*math.sqrt(0.7115218)))^(1/3)
  local drop = xi*sp - r*cp*cs
  local k1 = -spin*r*(si*cs + co*sp*ss) - vt*(r*(si*sp*cs + co*ss) + xi*si*cp) - vp*co*drop
  local k2 = spin*r*cp*ss + vp*(xi*cp + r*sp*cs)
  local k3 = -spin*r*(co*cs - si*sp*ss) - vt*(xi*co*cp + r*(co*sp*cs - si*ss)) + vp*si*drop
  local rolling = sqrt((k1 - vx)^2 + (k2 - vy)^2 + (k3 - vz - 30)^2)/2
  k1, k2, k3 = k1 + vx, k2 + vy, k3 + vz + 30
  local most, moment = 0.12*force, (-e*sd*spin + cd*vt)/rolling
  local along = -most*tanh(G*c^2*4.72772197*(si*k1 + co*k3)/rolling/most)
  local across = -most*tanh(G*c^2*4.27526987*(co*cd*k1 + e*sd*k2 - si*cd*k3)/rolling/most
    + G*c^3*1.97203505*moment/most)
  local beyond = along^2 + across^2
  local share = ifelse(gt(beyond, most^2), abs(most)/sqrt(beyond), 1)
  along, across = along*share, across*share
  local f1, f2, f3 = si*along + co*cd*across, e*sd*across, co*along - si*cd*across
  return { f1, f2, f3, -(xi*st + r*ss*ct*cp)*f1 - r*ss*sp*f2 + (-xi*ct + r*ss*st*cp)*f3,
    -(xi*ct*sp - r*cs*ct*cp)*f1 + (xi*cp + r*cs*sp)*f2 + (xi*st*sp - r*cs*st*cp)*f3,
    -r*(cs*st + ss*ct*sp)*f1 + r*ss*cp*f2 - r*(cs*ct - ss*st*sp)*f3 }
end

local function wheelset(index)
  local pr, xr, pl, xl, la = var "psir", var "xir", var "psil", var "xil", var("la", 2)
  local L, R = contact(1, pl, xl), contact(-1, pr, xr)
  local function pull(i) return 1e4*(L.normal[i]*la[1] + R.normal[i]*la[2]) end
  local det = -L.sd*R.cd - R.sd*L.cd
  local fl = creep(L, (R.cd*pull(1) - R.sd*pull(2))/det)
  local fr = creep(R, (-L.cd*pull(1) - L.sd*pull(2))/det)
  local function all(i) return fl[i] + fr[i] + (i < 6 and pull(i) or 0) end
  local m, i1, i2, spin, turn = 16.08, 0.0605, 0.366, 300 + beta, 2*0.19^2*6400*theta
  local v = { vx, vy, vz, vt, vp }
  local function kept(s)
    if index == 3 then return s.gap end
    local sum = 0
    for i = 1, 5 do sum = sum + s.normal[i]*v[i] end
    return sum
  end
  local sys = dae { der(x) ~ vx, der(y) ~ vy, der(z) ~ vz, der(theta) ~ vt, der(phi) ~ vp,
    m*der(vx) ~ all(1) - 2*6400*x, m*der(vy) ~ all(2) - m*9.81, m*der(vz) ~ all(3) - 2*6400*z,
    i2*cp*der(vt) ~ i2*vt*vp*sp - i1*spin*vp - (i1 - i2)*vt*sp*vp + all(4) - cp*turn,
    i2*der(vp) ~ i1*spin*vt*cp + (i1 - i2)*vt^2*sp*cp + all(5),
    i1*(sp*der(vt) + der(beta)) ~ -i1*vt*vp*cp + all(6) - sp*turn,
    0 ~ kept(L), 0 ~ kept(R), 0 ~ vec(L.parallel), 0 ~ vec(R.parallel) }
  local guess = { [x] = 0.14941e-2, [y] = 0.40089e-6, [z] = 0.11241e-5, [theta] = -0.28573e-3,
    [phi] = 0.26459e-3, [pr] = -7.4e-6, [xr] = -0.15214, [pl] = 7.56e-6, [xl] = 0.14906,
    [la] = { -8.3593e-3, -7.4144e-3 } }
  for _, speed in ipairs { vx, vy, vz, vt, vp, beta } do guess[speed] = 0 end
  return sys, guess, { [x] = 0.86355386965811e-2, [z] = -0.93635784016818e-4, [theta] = -0.13642299804033e-1,
    [phi] = 0.15292895005422e-2, [vx] = -0.76985374142666e-1, [vt] = -0.23904837703692,
    [beta] = -0.24421377661131, [xr] = -0.15949425684022, [xl] = 0.14173214964613,
    [la[1]] = -0.10124044903201e-1, [la[2]] = -0.56285630573753e-2 }
end

test("wheelset on a straight track, whose published values have 9 digits", function()
  for _, index in ipairs { 2, 3 } do
    local sys, guess, reference = wheelset(index)
    local fix, free = {}, { x, z, theta, vx, vz, vt, beta }
    if index == 2 then free = { x, y, z, theta, phi, vx, vz, vt, beta } end
    for _, unknown in ipairs(free) do fix[unknown] = guess[unknown] end
    local at = sys:init { fix = fix, guess = guess }
    expect(sys:index(at)):equals(index)
    expect(sys:dof(at)):equals(#free)
    local sol = sys:reduce():integrate { start = at, to = 10, rtol = 1e-5, method = "radau" }
    expect(sol.status):equals "finished"
    expect(tolerances_off(sol, reference, 1e-5, { [vx] = 0.2, [z] = 1e-3 }) < 100):is_true()
  end
end)
