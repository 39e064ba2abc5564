-- Whether constraints become dependent does not depend on units: an angle moves a point that is 10⁹ nm away.
local units = { 1e6, 1000, 1, 1e-3, 1e-6, 1e-9 }  -- of length, in metres

--- The joints of ground, crank, coupler and rocker. tip: x and y of an end of a bar.
local function closed(tip, unit)
  local C = {}
  local function joint(x1, y1, x2, y2) C[#C + 1], C[#C + 2] = x1 - x2, y1 - y2 end
  local ax, ay = tip(1, -1)
  joint(ax, ay, 0, 0)
  local bx, by = tip(1, 1)
  joint(bx, by, tip(2, -1))
  local cx, cy = tip(2, 1)
  joint(cx, cy, tip(3, 1))
  local dx, dy = tip(3, -1)
  joint(dx, dy, 2/unit, 0)
  return C
end

-- Absolute coordinates: centre and angle of crank, coupler and rocker; the ground has length 2.
local function four_bar(unit, rocker)
  local length, q = { 1/unit, 2/unit, rocker/unit }, var("q", 9)
  local T = 0
  for i, l in ipairs(length) do
    local x, y, turn = q[3*i - 2].dot, q[3*i - 1].dot, q[3*i].dot
    T = T + x^2 + y^2 + l^2*turn^2/12
  end
  local function tip(i, side)
    local arm = side*length[i]/2
    return q[3*i - 2] + arm*cos(q[3*i]), q[3*i - 1] + arm*sin(q[3*i])
  end
  local sys = lagrange { q = q, T = T, V = 0*q[1], C = closed(tip, unit) }
  local start = sys:init { fix = { [q[3]] = 1, [q[3].dot] = 1 }, guess = {
    [q[1]] = 0.3/unit, [q[2]] = 0.4/unit, [q[4]] = 1.5/unit, [q[5]] = 0.8/unit, [q[6]] = 0.1,
    [q[7]] = (2 + 0.3*rocker)/unit, [q[8]] = 0.4*rocker/unit, [q[9]] = 0.9 } }
  return sys, start, q[3]
end

test("a linkage that folds flat stops there in every unit", function()
  for _, unit in ipairs(units) do
    local sys, start = four_bar(unit, 1)
    for _, form in ipairs { "acc", "project" } do
      for _, method in ipairs { "auto", "radau" } do
        local sol = sys:reduce(form):integrate { start = start, to = 10, rtol = 1e-7, method = method }
        expect(sol.status):matches "^stopped at t = 2.14159: the constraints C₁, C₃, C₅, C₇ are dependent"
      end
    end
  end
end)

test("a linkage that is never flat turns for ever in every unit", function()
  local metres
  for _, unit in ipairs { 1, table.unpack(units) } do
    local sys, start, crank = four_bar(unit, 1.6)
    local sol = sys:reduce():integrate { start = start, to = 20, rtol = 1e-8 }
    expect(sol.status):equals "finished"
    metres = metres or sol:final(crank)
    expect(sol:final(crank)):near(metres, 1e-5)
  end
end)

-- The same with accelerations divided by masses: forces are along the gradients but for a factor of each
-- equation.
local function written_out(unit, rocker)
  local length, m = { 1/unit, 2/unit, rocker/unit }, { 1, 5, 0.2 }
  local x, y, a, z = var("x", 3), var("y", 3), var("a", 3), var("z", 8)
  local function tip(i, side)
    local arm = side*length[i]/2
    return x[i] + arm*cos(a[i]), y[i] + arm*sin(a[i])
  end
  local C, work = closed(tip, unit), 0
  for k, c in ipairs(C) do work = work + z[k]*c end
  local equations = {}
  local function moves(q, inertia) equations[#equations + 1] = der(q, 2) ~ -diff(work, q)/inertia end
  for i = 1, 3 do
    moves(x[i], m[i])
    moves(y[i], m[i])
    moves(a[i], m[i]*length[i]^2/12)
  end
  for _, c in ipairs(C) do equations[#equations + 1] = c ~ 0 end
  local sys = dae(equations)
  local start = sys:init { fix = { [a[1]] = 1, [a[1].dot] = 1 }, guess = {
    [x[1]] = 0.3/unit, [y[1]] = 0.4/unit, [x[2]] = 1.5/unit, [y[2]] = 0.8/unit, [a[2]] = 0.1,
    [x[3]] = (2 + 0.3*rocker)/unit, [y[3]] = 0.4*rocker/unit, [a[3]] = 0.9 } }
  return sys, start
end

test("so does one whose equations are divided by masses", function()
  for _, unit in ipairs { 1000, 1, 1e-3, 1e-6, 1e-9 } do
    local sys, start = written_out(unit, 1)
    for k = 1, 3 do
      local sol = sys:reduce():integrate { start = start, to = 5, rtol = 1e-7*(1 + k/10) }
      expect(sol.status):matches "^stopped at t = 2.141%d+: the constraints"
    end
    local free, at = written_out(unit, 1.6)
    expect(free:reduce():integrate { start = at, to = 5, rtol = 1e-7 }.status):equals "finished"
  end
end)

-- With the crank at π the gradient of C₁ is (0, -1, 0), beside (±r/unit, -1, 0) before and behind.
test("a slider-crank passes its dead centres in every unit", function()
  local metres
  for _, unit in ipairs { 1, table.unpack(units) } do
    local q, r, l = var("q", 3), 0.3/unit, 0.8/unit
    local crank, slider, rod = q[1], q[2], q[3]
    local sys = lagrange { q = q, V = 0*crank,
      T = 0.025/unit^2*crank.dot^2 + slider.dot^2 + 0.05/unit^2*rod.dot^2,
      C = { r*cos(crank) + l*cos(rod) - slider, r*sin(crank) + l*sin(rod) } }
    local start = sys:init { fix = { [crank] = 0.4, [crank.dot] = 3 },
      guess = { [slider] = 1/unit, [rod] = -0.1 } }
    for _, method in ipairs { "auto", "radau", "bdf" } do
      local sol = sys:reduce():integrate { start = start, to = 4, rtol = 1e-8, method = method }
      expect(sol.status):equals "finished"
      metres = metres or sol:final(slider)
      expect(sol:final(slider)*unit):near(metres, 1e-5)
    end
  end
end)

-- Three masses on springs and a rod. In kilometres, hours and tonnes a spring outweighs a mass by 10¹⁰ at a
-- random point: singular values below 10⁻⁹ of the largest are no rounding errors there.
test("form array of masses on springs in kilometres and hours", function()
  local function chain(L, T, M)
    local q, k, m, g, l = var("q", 6), 500*T^2/M, 0.2/M, 9.81*T^2/L, 0.3/L
    local kinetic, V, px, py = 0, 0, 0, 0
    for i = 1, 3 do
      local x, y = q[2*i - 1], q[2*i]
      V = V + m*g*y + (i < 3 and k/2*(sqrt((x - px)^2 + (y - py)^2) - l)^2 or 0)
      kinetic = kinetic + m/2*(x.dot^2 + y.dot^2)
      px, py = x, y
    end
    local rod = (q[5] - q[3])^2 + (q[6] - q[4])^2 - l^2
    local sys = lagrange { q = q, T = kinetic, V = V, C = { rod } }
    local fix = { [q[1]] = l, [q[2]] = 0, [q[3]] = 2*l, [q[4]] = 0.01/L, [q[5]] = 0.85/L }
    for i = 1, 5 do fix[q[i].dot] = 0 end
    return sys, sys:init { fix = fix, guess = { [q[6]] = 0.2/L } }, q
  end
  local metres, start, q = chain(1, 1, 1)
  local reference = metres:reduce():integrate { start = start, to = 0.8, rtol = 1e-10 }
  local sys, begin = chain(1000, 3600, 1000)
  local sol = sys:reduce "array":integrate { start = begin, to = 0.8/3600, rtol = 1e-8 }
  expect(sol.status):equals "finished"
  for i = 1, 6 do expect(sol:final(q[i])*1000):near(reference:final(q[i]), 1e-6) end
end)
