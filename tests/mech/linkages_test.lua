-- Planar linkages by points: their freedom, starts and motion where the same lengths allow other positions,
-- too (joints that coincide, a rigid assembly), in any unit of length.

-- Mass points of mass 1 in the plane, bars between them; a point given as numbers is fixed.
local function linkage(unit, points, bars)
  local q, start, T, V, C, at = {}, {}, 0, 0, {}, {}
  for _, p in ipairs(points) do
    local name, x, y, fixed = p[1], p[2]*unit, p[3]*unit, p[4]
    if fixed then
      at[name] = { x, y }
    else
      local v = var(name, 2)
      at[name] = v
      start[v[1]], start[v[2]], start[v[1].dot], start[v[2].dot] = x, y, 0, 0
      T, V = T + v.dot.T*v.dot/2, V + 9.81*unit*v[2]
      q[#q + 1], q[#q + 2] = v[1], v[2]
    end
  end
  for _, bar in ipairs(bars) do
    local one, other = at[bar[1]], at[bar[2]]
    C[#C + 1] = (one[1] - other[1])^2 + (one[2] - other[2])^2 - bar[3]*unit^2
  end
  return lagrange { q = q, T = T, V = V, C = C }, start, { C = C, E = T + V, at = at }
end

local taken = dofile "tests/part_of.lua"(3)
local forms = { "acc", "project", "ggl", "dummy", "array" }

-- Bars keep their lengths and the energy its value; `straight` at each end of the motion.
local function moves(sys, guess, parts, unit, straight)
  local start = sys:init { guess = guess }
  for where, wanted in pairs(guess) do expect(start(where)):near(wanted, 1e-9*unit) end
  for _, form in ipairs(forms) do
    if taken() then
      local sol = sys:reduce(form, form == "array" and { at = start } or nil)
        :integrate { start = start, to = 0.4, rtol = 1e-8, atol = 1e-10*unit }
      expect(form .. " " .. sol.status):equals(form .. " finished")
      for _, c in ipairs(parts.C) do expect(sol(c, 0.4)):near(0, 1e-7*unit^2) end
      expect(sol(parts.E, 0.4)):near(sol(parts.E, 0), 1e-6*unit^2)
      straight(sol)
    end
  end
end

local units = { 1, 1e-3, 1e-9, 1e6 }

test("Peaucellier's linkage: 2 free initial values, though A and D may coincide, and B and P", function()
  -- B on a circle through the origin, |A| = |D| = 5, rhombus of side 2: inversion, 21 = |B| |P|; P on a line
  local angle, r = 0.3, 1.6
  local b = { r + r*math.cos(angle), r*math.sin(angle) }
  local size = math.sqrt(b[1]^2 + b[2]^2)
  local along = (25 - 4 + size^2)/(2*size)                 -- of A and D, in the direction of B
  local across = math.sqrt(25 - along^2)
  local u, v = b[1]/size, b[2]/size
  for _, unit in ipairs(units) do
    local sys, guess, parts = linkage(unit, { { "O", 0, 0, true }, { "M", r, 0, true },
      { "A", along*u - across*v, along*v + across*u }, { "D", along*u + across*v, along*v - across*u },
      { "B", b[1], b[2] }, { "P", 21/size*u, 21/size*v } },
      { { "O", "A", 25 }, { "O", "D", 25 }, { "A", "B", 4 }, { "D", "B", 4 }, { "A", "P", 4 },
        { "D", "P", 4 }, { "M", "B", r^2 } })
    expect(sys:dof()):equals(2)
    expect(tostring(sys):find "least norm"):is_nil()
    moves(sys, guess, parts, unit,
      function(sol) expect(sol(parts.at.P[1], 0.4)):near(21/(2*r)*unit, 1e-7*unit) end)
  end
end)

test("Dixon's mechanism: nine bars between two perpendicular lines, rank 8", function()
  local a, b = { 1, 2, -3 }, { 1, -2, 4 }
  for _, unit in ipairs(units) do
    local points, bars = {}, {}
    for i = 1, 3 do
      points[i], points[3 + i] = { "X" .. i, a[i], 0, i == 1 }, { "Y" .. i, 0, b[i] }
      for j = 1, 3 do bars[#bars + 1] = { "X" .. i, "Y" .. j, a[i]^2 + b[j]^2 } end
    end
    local sys, guess, parts = linkage(unit, points, bars)
    expect(sys:dof()):equals(4)
    expect(tostring(sys)):matches "rank 8 of 9"
    moves(sys, guess, parts, unit, function() end)
  end
end)

test("a parallelogram with a third crank, which bears a pendulum: it moves, as nothing else does", function()
  for _, unit in ipairs(units) do
    local sys, guess, parts = linkage(unit, { { "O", 0, 0, true }, { "M", 1, 0, true }, { "N", 3, 0, true },
      { "A", 0.6, 0.8 }, { "B", 1.6, 0.8 }, { "D", 3.6, 0.8 }, { "P", 3.6, -0.2 } },
      { { "O", "A", 1 }, { "M", "B", 1 }, { "N", "D", 1 }, { "A", "B", 1 }, { "B", "D", 4 }, { "A", "D", 9 },
        { "D", "P", 1 } })
    expect(sys:dof()):equals(4)
    moves(sys, guess, parts, unit, function(sol)
      expect(sol(parts.at.D[1] - parts.at.A[1], 0.4)):near(3*unit, 1e-6*unit)
    end)
  end
end)

test("a square of 10⁻¹⁸ m² is an area, not a rounding error", function()
  local x, y, u, w = vars "x y u w"
  for _, unit in ipairs { 1, 1e-9 } do
    local r = 1.6*unit
    local sys = lagrange { q = { x, y, u, w }, T = (x.dot^2 + y.dot^2 + u.dot^2 + w.dot^2)/2, V = 9.81*unit*y,
      C = { (x - r)^2 + y^2 - r^2, (u - x)^2 + (w - y)^2 - (0.7*unit)^2 } }
    expect(sys:index()):equals(3)
    expect(tostring(sys:structure()):find "near%-singular"):is_nil()
  end
  local sys = dae { der(x) ~ u + x, 0 ~ x + math.sin(math.pi)*u - sin(t) }
  expect(tostring(sys:structure())):matches "near%-singular: 1.22e%-16 in %(2%)"
end)
