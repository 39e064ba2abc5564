-- Blocks of more than four equations: a run stops where constraints become dependent, or equations lose their unknowns.
local function has(text, part)
  if not text:find(part, 1, true) then error(text .. "\n  does not contain\n" .. part, 2) end
  expect(text:find(part, 1, true) ~= nil):is_true()
end

-- A four-bar linkage of three bars in Cartesian coordinates: cranks of length 1 and L3 on a base of 2, a coupler of 2.
local function four_bar(L3, theta)
  local q = var("q", 9)
  local x1, y1, a1, x2, y2, a2, x3, y3, a3 = q[1], q[2], q[3], q[4], q[5], q[6], q[7], q[8], q[9]
  local T = 0
  for i = 1, 7, 3 do T = T + (q[i].dot^2 + q[i + 1].dot^2)/2 + q[i + 2].dot^2/24 end
  local sys = lagrange { q = q, T = T, V = 0, C = {
    x1 - cos(a1)/2, y1 - sin(a1)/2,
    x1 + cos(a1)/2 - (x2 - cos(a2)), y1 + sin(a1)/2 - (y2 - sin(a2)),
    x2 + cos(a2) - (x3 + L3/2*cos(a3)), y2 + sin(a2) - (y3 + L3/2*sin(a3)),
    x3 - L3/2*cos(a3) - 2, y3 - L3/2*sin(a3) } }
  local c, s = math.cos(theta), math.sin(theta)
  local at = sys:init { fix = { [a1] = theta, [a1.dot] = 1 },
    guess = { [q] = { c/2, s/2, theta, c + 1, s, 0, 2 + c/2, s/2, theta } } }
  return sys, at, a1
end

-- A parallelogram turns at constant speed and is flat at a1 = π: from there it may go on crossed.
test("a parallelogram of Cartesian bodies stops where it is flat, in every form", function()
  local sys, at, a1 = four_bar(1, 1)
  local flat = math.pi - 1
  for _, form in ipairs { "acc", "ode", "project", "baumgarte", "ggl" } do
    local low = sys:reduce(form)
    for _, method in ipairs(form == "ggl" and {} or { "auto", "radau" }) do
      local sol = low:integrate { start = at, to = 10, rtol = 1e-7, method = method ~= "auto" and method or nil }
      has(sol.status, "the constraints C₁, C₃, C₅, C₇ are dependent (-∇C₁ + ∇C₃ + ∇C₅ + ∇C₇ = 0) there")
      has(sol.status, "no longer determine z₁, z₃, z₅, z₇")
      has(sol.status, "init{ fix = …, from = t }")
      expect(tonumber(sol.status:match "stopped at t = ([%d.]+)")):near(flat, 5e-4)
      local last = sol.t[#sol.t]
      expect(last <= flat):is_true()
      expect(sol:final(a1)):near(1 + last, 1e-5)
      expect(sol(a1, last/2)):near(1 + last/2, 1e-5)
    end
    local fixed = low:integrate { start = at, to = 4, dt = 0.05, method = rk.radau(3), direct = form == "ggl" }
    local names = form == "ggl" and "(3a), (3c), (3e), (3g)" or "C₁, C₃, C₅, C₇"
    has(fixed.status, "stopped at t = 2.142: the constraints " .. names .. " are dependent")
    expect(fixed.t[#fixed.t]):near(2.1, 1e-12)
  end
  local dummy = sys:reduce("dummy", { at = at }):integrate { start = at, to = 10, rtol = 1e-7 }
  has(dummy.status, "stopped at t = 2.1")
  has(dummy.status, "the constraints C₁, C₃, C₅, C₇ are dependent")
end)

test("only saved times: the run ends at the last one before", function()
  local sys, at, a1 = four_bar(1, 1)
  local sol = sys:reduce():integrate { start = at, times = { 0, 1, 2, 3, 4 }, rtol = 1e-7 }
  has(sol.status, "stopped at t = 2.14159")
  expect(#sol.t):equals(2)                                   -- the step from 1.96 on was taken back
end)

test("however the steps fall: points behind the flat one, that cannot be interpolated, do not hide it", function()
  local sys, at = four_bar(1, 1)
  local low = sys:reduce()
  for k = 1, 12 do
    local sol = low:integrate { start = at, to = 10, rtol = 1e-7*(1 + k/100) }
    has(sol.status, "stopped at t = 2.14159: the constraints C₁, C₃, C₅, C₇ are dependent")
  end
end)

test("guards = false goes on", function()
  local sys, at, a1 = four_bar(1, 1)
  local sol = sys:reduce():integrate { start = at, to = 2.5, rtol = 1e-7, guards = false }
  expect(sol.status):equals "finished"
  expect(function() sys:reduce():integrate { start = at, to = 1, guards = 3 } end):fails "guards"
end)

test("a start behind the flat position goes on", function()
  local sys, at, a1 = four_bar(1, math.pi + 0.2)
  local sol = sys:reduce():integrate { start = at, to = 2.5, rtol = 1e-8 }
  expect(sol.status):equals "finished"
  expect(sol:final(a1)):near(math.pi + 2.7, 1e-6)
end)

test("a linkage that is never flat turns without alarm", function()
  local sys, at, a1 = four_bar(1.6, 1)                       -- 1 + 2 < 2 + 1.6: the crank turns round
  for _, run in ipairs { { rtol = 1e-3 }, { rtol = 1e-6 }, { rtol = 1e-9 }, { rtol = 1e-6, method = "radau" },
    { dt = 0.05, method = rk.gauss(2) } } do
    run.start, run.to = at, 40
    local sol = sys:reduce():integrate(run)
    expect(sol.status):equals "finished"
    expect(math.abs(sol:final(a1)) > 20):is_true()
  end
end)

test("the same linkage by its angles, first order", function()
  local a, b, c, u, v, w, l1, l2 = vars "a b c u v w l1 l2"
  local function model(L3)
    return dae { der(a) ~ u, der(b) ~ v, der(c) ~ w,
      der(u) ~ l1*sin(a) - l2*cos(a), der(v) ~ 2*l1*sin(b) - 2*l2*cos(b), der(w) ~ -L3*l1*sin(c) + L3*l2*cos(c),
      0 ~ cos(a) + 2*cos(b) - L3*cos(c) - 2, 0 ~ sin(a) + 2*sin(b) - L3*sin(c) }
  end
  local sys = model(1)
  local at = sys:init { fix = { a = 1, u = 1 }, guess = { b = 0, c = 1 } }
  for _, form in ipairs { "project", "ode", "acc", "baumgarte" } do
    local sol = sys:reduce(form):integrate { start = at, to = 10, rtol = 1e-7 }
    has(sol.status, "the gradient of the constraint (7) is 0 there")
    has(sol.status, "no longer determine l₁")
    expect(tonumber(sol.status:match "stopped at t = ([%d.]+)")):near(math.pi - 1, 5e-4)
  end
  local other = model(3/2)
  local start = other:init { fix = { a = 1, u = 1 }, guess = { b = 0.2, c = 1 } }
  expect(other:reduce():integrate { start = start, to = 20, rtol = 1e-7 }.status):equals "finished"
end)

test("a chain of eight links between walls that move apart ends stretched", function()
  local n = 8
  local x, y = var("x", n - 1), var("y", n - 1)
  local function at_node(v, i, last) return i == 0 and 0 or i == n and last or v[i] end
  local wall = 6 + t                                          -- 8 links of length 1: stretched at t = 2
  local C, T, V, guess_x, guess_y = {}, 0, 0, {}, {}
  for i = 1, n do
    local dx, dy = at_node(x, i, wall) - at_node(x, i - 1, wall), at_node(y, i, 0) - at_node(y, i - 1, 0)
    C[i] = (dx^2 + dy^2 - 1)/2
    if i < n then
      T, V = T + (x[i].dot^2 + y[i].dot^2)/2, V + 9.81*y[i]
      guess_x[i], guess_y[i] = 6/n*i, -3*math.sin(math.pi*i/n)
    end
  end
  local sys = lagrange { q = vstack(x, y), T = T, V = V, C = C }
  local fix = {}
  for _, i in ipairs { 1, 2, 3 } do fix[x[i]], fix[x[i].dot] = 0, 0 end
  local at = sys:init { nearest = true, fix = { [x.dot] = zeros(n - 1, 1), [y.dot] = zeros(n - 1, 1), [x] = guess_x, [y] = guess_y } }
  for _, run in ipairs { { rtol = 1e-6 }, { rtol = 1e-6, method = "radau" } } do
    run.start, run.to = at, 3
    local sol = sys:reduce():integrate(run)
    has(sol.status, "stopped at t = ")
    has(sol.status, "C₁, C₂, C₃, C₄, C₅, C₆, … (8 in all) are dependent")
    expect(tonumber(sol.status:match "stopped at t = ([%d.]+)") <= 2.0001):is_true()
  end
end)

test("six coupled algebraic equations that lose their unknowns", function()
  local x, z = var "x", var("z", 6)                          -- z₁³ - z₁ + z₆/50 = x: a fold near z₁ = 1/√3, x = -0.38
  local equations = { der(x) ~ -1, 0 ~ z[1]^3 - z[1] + z[6]/50 - x }
  for i = 2, 6 do equations[i + 1] = 0 ~ z[i] - z[i - 1]/2 - sin(z[i % 6 + 1])/10 end
  local sys = dae(equations)
  local at = sys:init { fix = { x = 1 }, guess = { [z] = { 1.3, .7, .4, .2, .1, 0 } } }
  for _, run in ipairs { { rtol = 1e-6 }, { rtol = 1e-6, method = "radau" }, { rtol = 1e-6, method = "bdf" }, { dt = 0.02, method = rk.radau(2) } } do
    run.start, run.to = at, 3
    local sol = sys:integrate(run)
    has(sol.status, "he equations (2), (3), (4), (5), (6), (7) no longer determine z")
    expect(sol.t[#sol.t] < 1.45):is_true()
    expect(sol:final(z[1]) > 0.5):is_true()
  end
end)
