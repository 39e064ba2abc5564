-- A platform on parallel cranks: two of them hold it, the others follow. Which two determine the motion
-- changes along the way: two gradients are dependent where cranks point along the line between their pins.
-- The platform only translates, on a circle, as a pendulum with all its mass in one point.
local part_of = dofile "tests/part_of.lua"
local a, q = var "a", var("q", 3)
local g, r = 9.81, 0.5

local function platform(pins, unit)
  local C = {}
  for i, p in ipairs(pins) do
    local c, s = cos(q[3]), sin(q[3])
    local x, y = q[1] + unit*(p[1]*c - p[2]*s - p[1]), q[2] + unit*(p[1]*s + p[2]*c - p[2])
    C[i] = x^2 + y^2 - (r*unit)^2
  end
  local v = q.dot
  return lagrange { q = q, T = (v[1]^2 + v[2]^2)/2 + unit^2*v[3]^2/6, V = g*unit*q[2], C = C }
end

local four = { { -0.5, 0.1 }, { 0.7, -0.2 }, { 0.2, 0.4 }, { 1.1, 0.3 } }
local three = { { 0, 0 }, { 1, 0 }, { 0.3, 0.6 } }
local exact = dae { der(a, 2) ~ g/r*sin(a) }:integrate {
  start = { a = math.asin(0.6), [a.dot] = 0.25 }, to = 3, rtol = 1e-11 }

local function start_of(sys, unit)
  return sys:init { fix = { [q[1]] = 0.3*unit, [q[3]] = 0, [q[1].dot] = 0.1*unit },
    guess = { [q[2]] = 0.4*unit } }
end

-- Almost two turns; six positions where the pair that is in use is dependent.
test("the motion of the pendulum, whichever cranks hold the platform, in three units", function()
  local taken = part_of(5)
  for _, unit in ipairs { 1e-3, 1, 1000 } do
    for _, pins in ipairs { three, four } do
      if taken() then
        local sys = platform(pins, unit)
        expect(sys:index()):equals(3)
        expect(sys:dof()):equals(2)
        local sol = sys:reduce():integrate { start = start_of(sys, unit), to = 3, rtol = 1e-8 }
        expect(sol.status):equals "finished"
        for k = 1, 12 do
          expect(sol(q[1], k/4)/unit):near(r*math.sin(exact(a, k/4)), 1e-6)
          expect(sol(q[3], k/4)):near(0, 1e-7)
        end
      end
    end
  end
end)

-- A long step passes such a position from where a choice serves to where it serves again, which is noticed a
-- step later; the next choice begins where the gradients of the last one still tell the motion.
test("in another unit, at other tolerances: short steps and long ones", function()
  for _, unit in ipairs { 1, 1000, 1e6 } do
    for _, pins in ipairs { three, four } do
      local sys = platform(pins, unit)
      local form, start = sys:reduce(), start_of(sys, unit)
      for _, digits in ipairs { 5, 6.4, 7.8 } do
        local sol = form:integrate { start = start, to = 3, rtol = 10^-digits }
        expect(sol.status):equals "finished"
        expect(sol(q[1], 3)/unit):near(r*math.sin(exact(a, 3)), 30*10^-digits)
        expect(sol(q[3], 3)):near(0, 1e-6)
      end
    end
  end
end)

test("every form and method; times that are asked for", function()
  local sys = platform(four, 1)
  local start = start_of(sys, 1)
  local times = { 0.3, 0.39, 0.9, 1.5 }
  for _, form in ipairs { "acc", "ggl", "project", "baumgarte" } do
    for _, method in ipairs { "auto", "radau", "bdf", form ~= "ggl" and "dopri5" or nil } do
      local sol = sys:reduce(form):integrate { start = start, times = times, rtol = 1e-8, method = method }
      expect(form .. " " .. method .. " " .. sol.status):equals(form .. " " .. method .. " finished")
      for k, t in ipairs(times) do expect(sol(q[1])[k]):near(r*math.sin(exact(a, t)), 1e-5) end
    end
  end
end)

-- Where two cranks point along the line between their pins, the rows and states of these forms serve as
-- little as all others of the same constraints: first the constraints are chosen anew.
test("forms that choose states or rows anew, in any unit of length", function()
  local taken = part_of(3)
  for _, case in ipairs { { "dummy", 1e-3 }, { "dummy", 1 }, { "dummy", 1000 }, { "array", 1 } } do
    if taken() then
      local form, unit = case[1], case[2]
      local sys = platform(four, unit)
      local times = { 0.3, 0.39, 0.9, 1.5 }
      local sol = sys:reduce(form):integrate { start = start_of(sys, unit), times = times, rtol = 1e-7 }
      expect(form .. " " .. sol.status):equals(form .. " finished")
      for k, t in ipairs(times) do
        expect(sol(q[1])[k]/unit):near(r*math.sin(exact(a, t)), 1e-5)
        expect(sol(q[3])[k]):near(0, 1e-6)
      end
    end
  end
end)

--- The same equations, typed; the constraints that are independent at the start.
local function typed(pins, unit, gravity)
  local C = platform(pins, unit).C
  local z, law = var("z", #pins), {}
  for i, m in ipairs { 1, 1, unit^2/3 } do
    local force = 0
    for k = 1, #pins do force = force + z[k]*diff(C[k], q[i]) end
    law[i] = m*der(q[i], 2) ~ (i == 2 and -gravity*unit or 0) - force
  end
  for k = 1, #pins do law[3 + k] = 0 ~ C[k] end
  return dae(law):independent { fix = { [q[1]] = 0.3*unit, [q[3]] = 0 }, guess = { [q[2]] = 0.4*unit } }
end

test("models by independent{…} choose the kept constraints anew, in every form and unit", function()
  local taken = part_of(4)
  for _, form in ipairs { "acc", "ggl", "project", "baumgarte", "dummy" } do
    for _, unit in ipairs { 1e-3, 1, 1000 } do
      if taken() then
        local sys = typed(four, unit, g)
        local sol = sys:reduce(form):integrate { start = start_of(sys, unit), to = 3, rtol = 1e-7 }
        expect(form .. " " .. unit .. " " .. sol.status):equals(form .. " " .. unit .. " finished")
        for k = 1, 12 do
          expect(sol(q[1], k/4)/unit):near(r*math.sin(exact(a, k/4)), 1e-5)
          expect(sol(q[3], k/4)):near(0, 1e-6)
        end
      end
    end
  end
end)

test("multipliers of least norm, before and behind a change", function()
  local sys = platform(four, 1)
  local sol = sys:reduce():integrate { start = start_of(sys, 1), to = 1.5, rtol = 1e-9 }
  local z = var("z", 4)
  for k = 1, 15 do
    local t = k/10
    local x, y = sol(q[1], t), sol(q[2], t)
    -- (∂C/∂q)ᵀ z = f, z = (∂C/∂q) w, gradients 2 (x, y, pₓ y - p_y x), f the force of a pendulum of length r
    local lift = { 0, 0, 0, 0 }
    for i, p in ipairs(four) do lift[i] = p[1]*y - p[2]*x end
    local sum, square = 0, 0
    for i = 1, 4 do sum, square = sum + lift[i], square + lift[i]^2 end
    local speed = exact(a.dot, t)
    local needed = (speed^2*r - g*y/r)/(2*r)                     -- Σ zᵢ
    -- zᵢ = α + β liftᵢ, Σ zᵢ = needed, Σ zᵢ liftᵢ = 0
    local beta = -needed*sum/(4*square - sum^2)
    local alpha = (needed - beta*sum)/4
    for i = 1, 4 do expect(sol(z[i], t)):near(alpha + beta*lift[i], 1e-5*(1 + math.abs(needed))) end
  end
end)

test("where all gradients are dependent, the run ends", function()
  local flat = platform({ { 0, 0 }, { 1, 0 }, { 2, 0 } }, 1)
  local sol = flat:reduce():integrate { start = start_of(flat, 1), to = 1, rtol = 1e-8 }
  expect(sol.status):matches "^stopped at t = 0.%d+: the constraints C₁, C₂ are dependent"
  expect(math.abs(sol(q[2])[#sol(q[2])])):near(0, 1e-3)
end)

-- Beside a position in which the kept cranks hold the platform no longer, a step along the motion passes it.
test("constraints are found redundant beside positions in which two of them are dependent", function()
  local sys = platform(three, 1)
  for k = -100, 100, 2 do
    for _, off in ipairs { 0, 1e-9, -1e-9, 1e-8, -1e-8 } do
      local angle = 1.6041560589762 + k*1e-4
      local kept = sys:independent { guess = { [q[1]] = r*math.sin(angle), [q[3]] = off,
        [q[2]] = r*math.cos(angle)*(1 + off) } }
      expect(#kept.algebraic):equals(6)   -- z₁ … z₃, two of least norm, excess
    end
  end
end)

test("sensitivities follow one choice of constraints and end where it no longer serves", function()
  local gravity = param("gravity", g)
  for _, unit in ipairs { 1, 1000 } do
    local sys = typed(three, unit, gravity)
    local start = start_of(sys, unit)
    local sol = sys:reduce("acc"):integrate { start = start, to = 3, rtol = 1e-8,
      sensitivities = { gravity } }
    expect(sol.status):matches "^stopped at t = 0.3%d+: the constraints that this form keeps"
    local t = sol.t[#sol.t]
    expect(sol(q[1], t)/unit):near(r*math.sin(exact(a, t)), 1e-6)
  end
end)

-- Derivatives by differences of runs that choose the kept ones anew; the one with sensitivities cannot.
test("with sensitivities the run ends where the kept constraints are dependent, and says so", function()
  local G = param("gravity", 9.81)
  for _, unit in ipairs { 1, 1e-3, 1000 } do
    local C, v = {}, q.dot
    for i, p in ipairs(four) do
      local c, s = cos(q[3]), sin(q[3])
      local x, y = q[1] + unit*(p[1]*c - p[2]*s - p[1]), q[2] + unit*(p[1]*s + p[2]*c - p[2])
      C[i] = x^2 + y^2 - (r*unit)^2
    end
    local sys = lagrange { q = q, T = (v[1]^2 + v[2]^2)/2 + unit^2*v[3]^2/6, V = G*unit*q[2], C = C }
    local start, d = start_of(sys, unit), 1e-3
    for _, form in ipairs { "acc", "ggl", "project", "baumgarte" } do
      local low = sys:reduce(form)
      local sol = low:integrate { start = start, to = 3, rtol = 1e-8, sensitivities = { G } }
      expect(sol.status):matches "that this form keeps, C.1., C.2., become dependent here.*take differences"
      local function at(value)
        return low:integrate { start = start, to = 0.3, rtol = 1e-10, params = { [G] = value } } (q[1], 0.3)
      end
      local slope = (at(9.81 + d) - at(9.81 - d))/(2*d)
      expect(sol:sensitivity(q[1], G, 0.3)/unit):near(slope/unit, 1e-6)
    end
  end
end)
