-- Starts at double roots: repeated factors, folds and crossings. A fixed value is redundant where those
-- before it determine it, to whatever order.
local x, y, z, u, v = vars "x y z u v"

local function starts(model, fix)
  local at = model:init { fix = fix }
  local text = at:ledger()
  return at, function(name) return text:match("\n%s*" .. name .. "%s+%S+%s+([^\n]+)") end, text
end

--- 0 = e with x′ = -x, from fixed values: x is fixed, z redundant, one value free.
local function one_free(e, values)
  local at, word, text = starts(dae { der(x) ~ -x, 0 ~ e }, values)
  expect(at.free):equals(1)
  expect(word "x"):equals "fixed"
  expect(word "z"):equals "fixed (redundant, consistent)"
  assert(not text:find("at most", 1, true), text)
end

test("a square is refused however its terms are ordered", function()
  for _, e in ipairs {
    z^2 - 2*x*z + x^2, x^2 - 2*x*z + z^2, x*(x - 2*z) + z^2, (x - z)*(x - z), (z - x)^3, z^2*x^2 - 2*x*z + 1,
    z^2 - 2*z*sin(x) + sin(x)^2, (z - x)^2*(z + 2*x)^2, 4*z^2 - 4*z*x + x^2 - 2*z + x + 1/4
  } do
    local model = dae { der(x) ~ -x, 0 ~ e }
    for _, f in ipairs { model.index, model.dof, model.init } do
      local ok, why = pcall(f, model, f == model.init and { fix = { x = 1, z = 1 } } or nil)
      assert(not ok and tostring(why):find "gradient .*vanishes", tostring(e) .. ": " .. tostring(why))
    end
  end
end)

test("a repeated factor beside another", function()
  one_free(z^3 - 3*z + 2, { x = 1, z = 1 })
  one_free(2*x^3 - 3*x^2*z + z^3, { x = 1, z = 1 })
  one_free((z - x)^2*(z + 2*x), { x = 1, z = 1 })
  one_free((z - x)^2*(z + 2*x), { x = 1, z = -2 })
  one_free((z - cos(x))^2*(z + 1), { x = 0, z = 1 })
  local a = param("a", 1)
  one_free((z - x)*(z - a*x)*(z + x), { x = 1, z = 1 })
  local at = dae { der(x) ~ -x, 0 ~ z^3 - 3*x^2*z + 2*x^3 }:init { fix = { x = 0.3 }, guess = { z = 0.35 } }
  expect(at(z)):near(0.3, 1e-15)        -- all digits, where the cube leaves half of them
  expect(at.free):equals(1)
  at = dae { der(x) ~ -x, 0 ~ (z - x)*(z - a*x)*(z + 1) }:init { fix = { x = 0.7 }, guess = { z = 1.1 } }
  expect(at(z)):near(0.7, 1e-15)
end)

test("a repeated factor in a constraint of higher index", function()
  local m = dae { der(x) ~ u, der(u) ~ z, 0 ~ (x - sin(t))^2*(x + 3) }
  local at = m:init { from = 0.5, guess = { x = 0.4, u = 1, z = 0 } }
  expect(at(x)):near(math.sin(0.5), 1e-12)
  expect(at(u)):near(math.cos(0.5), 1e-12)
  expect(at(z)):near(-math.sin(0.5), 1e-12)
  expect(at.free):equals(0)
end)

test("a fold: the fixed state is what counts", function()
  for _, L in ipairs { 1, 1e-9, 1e6 } do
    one_free(z^2 - 2*L*z + L*x, { x = L, z = L })
    one_free(z^2 + (x - L)*(x + L), { x = L, z = 0 })
    one_free(L*x - z^3/L, { x = 0, z = 0 })
    one_free(1 - cos(z/L) - x/L, { x = 0, z = 0 })
  end
  local at, word = starts(dae { der(x) ~ -x, 0 ~ z^2 - 2*z + x }, { z = 1 })
  expect(at.free):equals(1)
  expect(at(x)):near(1, 1e-12)
  expect(word "z"):equals "fixed"
end)

test("a fold between states keeps what determines the other", function()
  local pend = dae { der(x) ~ u, der(y) ~ v, der(u) ~ -z*x, der(v) ~ -z*y - 9.81, 0 ~ x^2 + y^2 - 1 }
  local at, word = starts(pend, { x = 1, y = 0, v = 0 })
  expect(at.free):equals(2)
  expect(word "y"):equals "fixed"
  expect(word "x"):equals "fixed (redundant, consistent)"
end)

test("crossings and isolated points", function()
  one_free(z^2 - x^2, { x = 0, z = 0 })
  one_free(z*(z - sin(x)), { x = 0, z = 0 })
  one_free(z^2 - x*z - 6*x^2, { x = 0, z = 0 })
  local at, word = starts(dae { der(x) ~ -x, 0 ~ x^2 + x*z + z^2 }, { x = 0, z = 0 })
  expect(at.free):equals(0)
  expect(word "x"):equals "fixed (redundant, consistent)"
  expect(word "z"):equals "fixed (redundant, consistent)"
end)

test("where second derivatives do not tell, the start says so", function()
  local at, word, text = starts(dae { der(x) ~ -x, 0 ~ z^2 - x^3 }, { x = 0, z = 0 })
  expect(at.free):equals(2)
  assert(text:find("at most 2 free initial values", 1, true), text)
  assert(text:find("do not tell how many", 1, true), text)
end)
