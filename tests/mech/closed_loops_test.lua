-- Closed loops: accelerations and multipliers by the mass matrix first, by pivots where that is not sound.

local function rod(r, a) return vec { r*cos(a), r*sin(a) } end

-- Of a polygon above a chord.
local function angle(k, n) return 1.2 - 2.4*(k - 1)/(n - 1) end

local function ending(lengths, unit)
  local x, y = 0, 0
  for k, L in ipairs(lengths) do
    x, y = x + L*unit*math.cos(angle(k, #lengths)), y + L*unit*math.sin(angle(k, #lengths))
  end
  return vec { x, y }
end

-- Rods from the origin to where the angles below end, absolute angles.
local function loop(lengths, masses, unit)
  local n = #lengths
  local a = var("a", n)
  local root, T, V = vec { 0, 0 }, 0, 0
  for k = 1, n do
    local L = lengths[k]*unit
    local centre = root + rod(L/2, a[k])
    local v = der(centre)
    T = T + masses[k]/2*v.T*v + masses[k]*L^2/24*a[k].dot^2
    V = V + 9.81*masses[k]*centre[2]*unit
    root = root + rod(L, a[k])
  end
  return lagrange { q = a, T = T, V = V, C = root - ending(lengths, unit) }, a, T + V
end

local function start_of(a)
  local n, fix, guess = #a, {}, {}
  for k = 1, n do guess[a[k]] = angle(k, n) end
  for k = 1, n - 2 do
    fix[a[k]], fix[a[k].dot] = angle(k, n), 0.4*(-1)^k
    guess[a[k]] = nil
  end
  return { fix = fix, guess = guess }
end

test("loops of four to seven rods: every form goes where index 1 with implicit steps goes, energy is kept", function()
  for n = 4, 7 do
    for unit = -1, 1 do
      local L, m = {}, {}
      for k = 1, n do L[k], m[k] = 1 + 0.3*math.sin(5*k + n), 10^(1.5*math.sin(3*k + unit)) end
      local given, a, energy = loop(L, m, 1000^unit)
      local at = given:init(start_of(a))
      local wanted = given:reduce "acc":integrate { start = at, to = 0.3, method = "radau", rtol = 1e-10,
        atol = 1e-11 }
      local forms = unit == 0 and { "ode", "project", "baumgarte", "ggl" } or { "project" }
      for _, form in ipairs(forms) do
        local sol = given:reduce(form):integrate { start = at, to = 0.3, rtol = 1e-10, atol = 1e-11 }
        expect(form .. " " .. sol.status):equals(form .. " finished")
        for k = 1, n do expect(math.abs(sol:final(a[k]) - wanted:final(a[k])) < 2e-7):is_true() end
        expect(math.abs(sol:final(energy)/at(energy) - 1) < 1e-7):is_true()
      end
    end
  end
end)

test("the derivation says how the system is solved", function()
  local L = { 1, 1, 1, 1 }
  local given = loop(L, { 1, 2, 3, 4 }, 1)
  local text = tostring(given:reduce "ode":trace())
  expect(text:find("then Cq W⁻¹ Cqᵀ", 1, true) ~= nil):is_true()
end)

-- Four-bar with a coupler of mass m: without mass, M is singular at every position.
test("a coupler that loses its mass after the reduction still moves", function()
  local m = param("m", 1)
  local L = { 1, 2, 1.5 }
  local a = var("a", 3)
  local p1, p2 = rod(1, a[1]), vec { 2, 0 } + rod(1.5, a[3])
  local v = der(p1 + rod(1, a[2]))
  local T = a[1].dot^2/6 + 1.5^2*a[3].dot^2/6 + m/2*v.T*v + m*4/24*a[2].dot^2
  local V = 9.81*(p1[2]/2 + (p2[2])/2 + m*(p1[2] + L[2]/2*sin(a[2])))
  local given = lagrange { q = a, T = T, V = V, C = p1 + rod(2, a[2]) - p2 }
  local start = { fix = { [a[1]] = 1, [a[1].dot] = 2 }, guess = { [a[2]] = 0.3, [a[3]] = 1.4 } }
  for _, form in ipairs { "ode", "project" } do
    local low = given:reduce(form)
    local ends = {}
    for k, mass in ipairs { 1e-9, 1e-12, 0 } do
      local params = { [m] = mass }
      local at = low:init { fix = start.fix, guess = start.guess, params = params }
      local sol = low:integrate { start = at, params = params, to = 1, rtol = 1e-9, atol = 1e-10 }
      expect(sol.status):equals "finished"
      ends[k] = sol:final(a[1])
    end
    expect(math.abs(ends[1] - ends[3]) < 1e-7):is_true()
    expect(math.abs(ends[2] - ends[3]) < 1e-7):is_true()
  end
end)

-- x with the mass cos² x is driven through the pole of its coordinate by y, to which it is tied.
test("a mass matrix that is singular on the way", function()
  local x, y = var("x", 2), var("y", 2)
  local T = (cos(x[1])^2*x[1].dot^2 + cos(x[2])^2*x[2].dot^2 + y.dot.T*y.dot)/2
  local V = (y[1] - y[2])^2/2
  local given = lagrange { q = vstack(x, y), T = T, V = V, C = x - y }
  local w = var("w", 2)
  local apart = lagrange { q = w, V = (w[1] - w[2])^2/2,
    T = ((1 + cos(w[1])^2)*w[1].dot^2 + (1 + cos(w[2])^2)*w[2].dot^2)/2 }
  local wanted = apart:integrate { start = { [w] = { 1, 0 }, [w.dot] = { 1, 2 } }, to = 4, rtol = 1e-11,
    atol = 1e-12 }
  local at = given:init { fix = { [y] = { 1, 0 }, [y.dot] = { 1, 2 } } }
  for _, form in ipairs { "ode", "project", "baumgarte" } do
    local sol = given:reduce(form):integrate { start = at, to = 4, rtol = 1e-10, atol = 1e-11 }
    expect(form .. " " .. sol.status):equals(form .. " finished")
    for k = 1, 2 do expect(math.abs(sol:final(y[k]) - wanted:final(w[k])) < 1e-7):is_true() end
  end
  -- at the pole itself, where no pivot of M is positive
  local there = given:init { fix = { [y] = { math.pi/2, math.pi/2 }, [y.dot] = { 1, 1 } } }
  local sol = given:reduce "ode":integrate { start = there, to = 0.1, rtol = 1e-10, atol = 1e-11 }
  expect(sol.status):equals "finished"
end)
