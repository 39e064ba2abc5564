-- Constraints that follow from others where all hold, with factors that contain coordinates: by lagrange and
-- by hand.
local taken = dofile "tests/part_of.lua"(3)
local forms = { "acc", "ggl", "baumgarte", "project", "dummy", "ode", "array" }

local function every_form(sys, start, to, watched, wanted, tol)
  for _, form in ipairs(forms) do
    if taken() then
      local low = sys:reduce(form, form == "array" and { at = start } or nil)
      local sol = low:integrate { start = start, to = to, rtol = 1e-9, atol = 1e-12 }
      expect(form .. " " .. sol.status):equals(form .. " finished")
      expect(sol(watched, to)):near(wanted, tol)
    end
  end
end

-- Angle of a pendulum of length L, from the horizontal, at rest at first.
local function pendulum(L, first, to)
  local a = var "alpha"
  return dae { L*der(a, 2) ~ -9.81*cos(a) }
    :integrate { start = { alpha = first, [a.dot] = 0 }, to = to, rtol = 1e-11, atol = 1e-13 }(a, to)
end

test("a sphere, a plane and their cylinder, in any unit of length", function()
  for _, L in ipairs { 1, 10, 1e-3, 1e3 } do
    local q = var("q", 3)
    local sys = lagrange { q = q, T = q.dot.T*q.dot/2, V = 9.81*q[2],
      C = { q.T*q - L^2, q[3], q[1]^2 + q[2]^2 - L^2 } }
    expect(tostring(sys)):matches "C₃ follows from C₁, C₂: z of least norm, C₃ = C₁ %- q₃ C₂"
    expect(sys:index()):equals(3)
    expect(sys:dof()):equals(2)
    local to = 0.3*math.sqrt(L)
    local start = sys:init { fix = { [q[2]] = L*math.sin(0.5), [q[2].dot] = 0 },
      guess = { [q[1]] = L, [q[3]] = 0 } }
    every_form(sys, start, to, q[2], L*math.sin(pendulum(L, 0.5, to)), 1e-7*L)
    local z = sys.multipliers                             -- orthogonal to (1, -q₃, -1), and q₃ = 0
    expect(start(z[1])):near(start(z[3]), 1e-9*math.abs(start(z[1])))
  end
end)

test("products with a constraint, powers of it, functions of it", function()
  local x, y, w = vars "x y w"
  local g, h = x^2 + y^2 - 1, w - x
  local request = { fix = { [y] = math.sin(0.5), [y.dot] = 0 }, guess = { x = 0.9, w = 0.9 } }
  local cases = {             -- C, the words, z that must vanish
    { { g, g^2, h }, "C₂ = %(x² %+ y² %- 1%) C₁", 2 }, { { g^2, g, h }, "C₁ = %(x² %+ y² %- 1%) C₂", 1 },
    { { g*h, g, h }, "C₁ = %(w %- x%) C₂", 1 }, { { g, h, (x^2 + y^2)^2 - 1 }, "C₃ = %(x² %+ y² %+ 1%) C₁" },
    { { g, h, h*sin(x) + g }, "C₃ = C₁ %+ sin%(x%) C₂" },
    { { sin(g), h, g }, "gradients of C₁ … C₃: rank 2 of 3 where they hold" },
    { { g, exp(h) - 1, h, g^2 + h },
      "C₄ = %(x² %+ y² %- 1%) C₁ %+ C₃; gradients of C₁ … C₃: rank 2 of 3 where they hold" },
  }
  for _, case in ipairs(cases) do
    local T = (x.dot^2 + y.dot^2)/2 + 1e-9*w.dot^2
    local sys = lagrange { q = { x, y, w }, T = T, V = 9.81*y, C = case[1] }
    expect(tostring(sys)):matches(case[2])
    expect(sys:index()):equals(3)
    expect(sys:dof()):equals(2)
    local start = sys:init(request)
    if case[3] then expect(start(sys.multipliers[case[3]])):near(0, 1e-9) end
    every_form(sys, start, 0.3, y, math.sin(pendulum(1, 0.5, 0.3)), 1e-6)
  end
  expect(function() lagrange { q = { x, y, w }, T = dot(vec{ x, y, w }.dot, vec{ x, y, w }.dot)/2, V = y,
    C = { g, g^2 - 1 } } end):fails "redundant or contradicts"
end)

test("products with a constraint in any unit of length", function()
  local q = var("q", 2)
  for power = -9, 9, 3 do
    local L = 10.0^power
    local ball = lagrange { q = q, T = dot(q.dot, q.dot)/2, V = 9.81*L*q[2],
      C = { (q.T*q - L^2)/2, (q.T*q - L^2)*(1 + q[1]^2/L^2) } }
    expect(tostring(ball)):matches "C₂ follows from C₁: z of least norm, C₂ = "
  end
end)

-- By hand, z is not unique and there is no index; what follows from what is said, independent has the motion.
test("typed with dae, of second and of first order", function()
  for _, L in ipairs { 1, 10, 1e-3 } do
    local q, p, z = var("q", 3), var("p", 3), var("z", 3)
    local C = vec{ q.T*q - L^2, q[3], q[1]^2 + q[2]^2 - L^2 }
    local force = vec{ 0, -9.81, 0 } - jacobian(C, q).T*z
    local near = { [q[1]] = L*math.cos(0.5), [q[2]] = L*math.sin(0.5) }
    for _, sys in ipairs { dae { q.ddot ~ force, 0 ~ C }, dae { q.dot ~ p, 2*p.dot ~ 2*force, 0 ~ C } } do
      for _, ask in ipairs { sys.index, sys.init, sys.reduce } do
        expect(function() ask(sys) end):fails "- q₃ "
        expect(function() ask(sys) end):fails "z₁, z₂, z₃, are not unique, though the motion may be: sys:independent{"
      end
      local free = sys:independent { guess = near }
      expect(free:index()):equals(3)
      expect(free:dof()):equals(2)
      expect(tostring(free)):matches "z of least norm; gradients of the constraints: rank 2 of 3"
      local start = free:init { fix = { [q[2]] = L*math.sin(0.5), [q[2].dot] = 0 }, guess = near }
      local to = 0.3*math.sqrt(L)
      every_form(free, start, to, q[2], L*math.sin(pendulum(L, 0.5, to)), 1e-7*L)
    end
  end
end)

test("more constraints than coordinates, of a body that nothing can move", function()
  local x, y = vars "x y"
  local sys = lagrange { q = { x, y }, T = (x.dot^2 + y.dot^2)/2, V = 9.81*y,
    C = { x - 1, y - 2, x + y - 3, x*y - 2 } }
  expect(sys:dof()):equals(0)
  local at = sys:init {}
  expect(at(x)):near(1, 1e-12)
  expect(at(y)):near(2, 1e-12)
  local z = sys.multipliers                               -- shares of the weight, along the gradients
  expect(at(z[2] + z[3] + z[4])):near(-9.81, 1e-9)
  expect(at(z[1] + z[3] + 2*z[4])):near(0, 1e-9)
end)
