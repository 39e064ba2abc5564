-- Equations without real solution, or with such as determine nothing, have no index; where no values that
-- satisfy them are found, sys:index() asks for some.
local x, y, z, w = vars "x y z w"
local function refused(name, model, words)
  test(name, function()
    local ok, e = pcall(model.index, model)
    assert(not ok and tostring(e):find(words, 1, true), tostring(e))
  end)
end

refused("a square and an exponential", dae { x^2 + exp(y) ~ 0, y ~ t, der(w) ~ x },
  "equation (1)  x² + exp(y) = 0 has no solution")
refused("a product of exponentials", dae { exp(x)*exp(y) ~ 0, der(y) ~ x },
  "equation (1)  exp(x) exp(y) = 0 has no solution")
refused("a definite quadratic form below 0", dae { x^2 + x*y + y^2 ~ -1, der(y) ~ x },
  "equation (1)  x² + x y + y² = -1 has no solution")
refused("a circle of radius 0", dae { x^2 + y^2 + 1 ~ 2*x, der(y) ~ x },
  "is 0 = y² + (x - 1)², which has one sign")
refused("sum and product of two numbers", dae { x + y ~ 1, x*y ~ 5, der(w) ~ w },
  "the equations (1), (2) have no solution in common")
refused("complementary, with a negative sum", dae { 0 ~ min(x, y), x + y ~ -1, der(w) ~ w },
  "the equations (1), (2) have no solution in common")
refused("a contradiction among thirty equations", (function()
  local list, q = {}, {}
  for k = 1, 28 do q[k] = var("q" .. k); list[k] = der(q[k]) ~ -q[k]*(q[k - 1] or 1) end
  list[29], list[30] = x + y ~ 1, x*y ~ 5
  return dae(list)
end)(), "the equations (29), (30) have no solution in common")
refused("a pole approached by tanh", dae { tanh(x) ~ y, y ~ 1 + w^2, der(w) ~ x },
  "no values that satisfy the equations were found. If some exist, the structural index is 1, 1 free")
refused("a cubic with one real root for three",
  dae { x + y + z ~ 0, x*y + y*z + z*x ~ 1, x*y*z ~ 1, der(w) ~ w*x },
  "the equations (1), (2) have no solution in common")
refused("sine and cosine", dae { x ~ cos(y), z ~ sin(y), x^2 + z^2 ~ 2, der(w) ~ z },
  "the equations (1), (2), (3) have no solution in common")

refused("a plane beside a sphere", dae { x^2 + y^2 + z^2 ~ 1, x + y + z ~ 2, der(z) ~ x },
  "the equations (1), (2) have no solution in common")

test("a plane through a sphere", function()
  local m = dae { x^2 + y^2 + z^2 ~ 1, x + y + z ~ 1.7, der(z) ~ x }
  expect(m:index()):equals(1)
  expect(m:index(m:init { fix = { z = 0.6 }, guess = { x = 0.5 } })):equals(1)
end)
test("a start of another model is refused", function()
  local ok, e = pcall(function()
    return dae { der(x) ~ -x }:index(dae { der(y) ~ y }:init { fix = { y = 1 } })
  end)
  assert(not ok and tostring(e):find("start has no value for 'x': it belongs to another model", 1, true), e)
end)

test("a start says nothing where the structure is singular everywhere", function()
  local a = param("a", -0.5)
  local m = dae { der(x) + a*t*der(y) + (1 + a)*y ~ sin(t), x + a*t*y ~ cos(t) }
  local ok, e = pcall(m.index, m, m:init {})
  assert(not ok and tostring(e):find("a start has no effect on it", 1, true), e)
  expect(m:index()):equals(2)
end)

test("of functions of time, some have solutions", function()
  local u = input "u"
  local m = dae { x^2 + y^2 ~ u, der(y) ~ x, z ~ sqrt(u - 20) }
  assert(m:index() == 1 and m:dof() == 1)
end)

test("values near a solution serve where none are found", function()
  -- sin(10⁴ x) + x = 3·10⁴ has solutions near 3·10⁴ only
  local m = dae { log(x - 1e4)*sqrt(3e4 - x) ~ 5 + y, y ~ x*(x - 2.99e4), der(w) ~ w }
  local ok = pcall(m.index, m)
  if not ok then
    local start = m:init { fix = { w = 1 }, guess = { x = 2.99e4 } }
    assert(m:index(start) == 1 and m:dof(start) == 1)
  end
end)

test("rounding in place of a parameter's root says so", function()
  local a = param("a", math.sqrt(2))
  local m = dae { (a^2 - 2)*y ~ x, der(x) ~ -x }
  local ok, e = pcall(m.index, m)
  assert(not ok and tostring(e):find("the pencil sE - A is singular", 1, true), tostring(e))
  assert(tostring(m:structure()):find("for a ≠ √2: index 1, 1 free initial value", 1, true))
end)

test("cases where a factor of parameters vanishes, factor by factor", function()
  local a, b = params "a b"
  local text = tostring(dae { a*x + b*y ~ 1, b*x + a*y ~ sin(t), der(w) ~ x }:pencil())
  for _, case in ipairs { "for a = b: no index", "for a = -b: no index" } do
    assert(text:find(case, 1, true), text)
  end
  local circle = tostring(dae { (a*b - 1)*der(x) ~ -x + y, y ~ sin(t) }:structure())
  assert(circle:find("for a = 1/b: index 1, 0 free initial values", 1, true), circle)
end)

-- Two curves that touch have dependent gradients at their only common point, found by Newton to 10⁻⁸ only.
test("curves that touch have no index by ranks, curves that nearly touch have", function()
  local x, y, z, u = vars "x y z u"
  local touching = {
    { x^2 + y^2 ~ 1, (x - 2)^2 + y^2 ~ 1 },
    { der(u) ~ -u, x^2 + y^2 ~ 1, (x - 2)^2 + y^2 ~ 1 },
    { x^2 + y^2 + z^2 ~ 1, (x - 2)^2 + y^2 + z^2 ~ 1, z ~ y },
    { der(u) ~ y - u, y ~ cos(x), y ~ 1 + x^2 },
    { exp(x)*y ~ 1, y ~ 1 - x },
    { x*y ~ 1, x + y ~ 2 },
  }
  for _, unit in ipairs { 1e-6, 1e-3, 1, 1000 } do  -- centres 5 k apart, radii 2 k, 3 k
    for k = 1, 5 do
      local r = k*unit
      touching[#touching + 1] = { x^2 + y^2 ~ (2*r)^2, (x - 3*r)^2 + (y - 4*r)^2 ~ (3*r)^2 }
    end
  end
  for k, equations in ipairs(touching) do
    local found, index = pcall(function() return dae(equations):index() end)
    expect(("%d %s"):format(k, found and index or "none")):equals(k .. " none")
  end
  for _, equations in ipairs {
    { x^2 + y^2 ~ 1, (x - 2)^2 + y^2 ~ 1.2 },
    { x^2 + y^2 ~ 1, (x - 1.9999)^2 + y^2 ~ 1 },
    { x^2 + y^2 ~ 1, (x - 1.9999999)^2 + y^2 ~ 1 },
    { x^3 ~ y, y ~ 3*x - 2 },  -- touch at 1, cross at -2
  } do expect(dae(equations):index()):equals(1) end
end)

-- z cancels from exp(X) z exp(-X), but exp(10⁴ x) has no value at x = 1, nor tan(X)/sin(X) at 0.
test("what cancels is left out at a value where the equation is defined", function()
  for _, unit in ipairs { 1, 1e4, 1e9 } do
    local x, y, z = vars "x y z"
    local X = unit*x
    local sys = dae { der(X) + y*tan(X)*cos(X)/sin(X) ~ z, der(X) + y ~ exp(X)*z*exp(-X), X + y + z ~ sin(t) }
    expect(function() sys:index() end):fails "the equations depend on each other: one more is needed"
  end
end)
