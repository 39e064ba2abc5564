-- Lookup tables against the functions they must reproduce, and as right-hand sides.
local x, y = vars "x y"

local function samples(f, places)
  local values = {}
  for k, at in ipairs(places) do values[k] = f(at) end
  return values
end
local uneven = { -2, -1.5, -0.25, 0, 1, 1.75, 4 }

test("each kind reproduces the polynomials that it can", function()
  local degree = { linear = 1, spline = 3, pchip = 1 }
  local coefficients = { 0.7, -1.3, 0.4, 0.25 }
  for kind, n in pairs(degree) do
    for few = 2, #uneven do
      local places = { table.unpack(uneven, 1, few) }
      local most = math.min(n, few - 1)
      local function polynomial(at)
        local value = 0
        for k = most, 0, -1 do value = value*at + coefficients[k + 1] end
        return value
      end
      local f = lookup { x = places, y = samples(polynomial, places), kind = kind }
      for i = 0, 40 do
        local at = places[1] + (places[few] - places[1])*i/40
        expect(f(at)):near(polynomial(at), 1e-12)
      end
    end
  end
end)

test("the expression has the values of the function", function()
  for _, kind in ipairs { "linear", "pchip", "spline", "previous" } do
    for _, outside in ipairs { "hold", "extend" } do
      local f = lookup { x = uneven, y = samples(math.exp, uneven), kind = kind, outside = outside }
      local value = fn({ x }, f(x))
      for i = -20, 60 do
        local at = i/10 + 0.01
        expect(value(at)):near(f(at), 1e-13*(1 + math.abs(f(at))))
      end
      for _, at in ipairs(uneven) do expect(value(at)):near(f(at), 1e-13) end
      for k, at in ipairs(uneven) do expect(f(at)):near(math.exp(uneven[k]), 1e-13) end
    end
  end
end)

test("a spline converges with order 4, pchip with order 2 and more", function()
  local function error_of(kind, n)
    local places = {}
    for k = 0, n do places[k + 1] = 3*k/n end
    local f, worst = lookup { x = places, y = samples(math.exp, places), kind = kind }, 0
    for i = 0, 1000 do worst = math.max(worst, math.abs(f(3*i/1000) - math.exp(3*i/1000))) end
    return worst
  end
  local function order(kind) return math.log(error_of(kind, 40)/error_of(kind, 80), 2) end
  expect(order "spline"):near(4, 0.25)
  expect(order "linear"):near(2, 0.1)
  expect(order "pchip" > 1.9):equals(true)
end)

test("pchip keeps the shape of the points", function()
  -- published example: Fritsch & Carlson, SIAM J. Numer. Anal. 17, 1980, table 1 (RPN 14)
  local places = { 7.99, 8.09, 8.19, 8.7, 9.2, 10, 12, 15, 20 }
  local values = { 0, 2.76429e-5, 4.37498e-2, 0.169183, 0.469428, 0.943740, 0.998636, 0.999919, 0.999994 }
  local f = lookup { x = places, y = values, kind = "pchip" }
  local before = -1
  for i = 0, 2000 do
    local value = f(7.99 + (20 - 7.99)*i/2000)
    expect(value >= before - 1e-15):equals(true)
    before = value
  end
  local overshoots = lookup { x = places, y = values, kind = "spline" }
  expect(overshoots(11) > 1):equals(true)                    -- which a spline does not
end)

test("slopes: pchip and splines are continuously differentiable, splines twice", function()
  local function one_sided(f, at, side, order)               -- a difference of the expression's derivative
    local g = f(x)
    for _ = 1, order do g = diff(g, x) end
    return fn({ x }, g)(at + side*1e-9)
  end
  for kind, orders in pairs { pchip = 1, spline = 2 } do
    local f = lookup { x = uneven, y = samples(math.sin, uneven), kind = kind }
    for k = 2, #uneven - 1 do
      for order = 1, orders do
        expect(one_sided(f, uneven[k], -1, order)):near(one_sided(f, uneven[k], 1, order), 1e-7)
      end
    end
  end
end)

test("outside: the ends hold, or go on in a straight line", function()
  for _, kind in ipairs { "linear", "pchip", "spline" } do
    local hold = lookup { x = { 0, 1, 3 }, y = { 1, 2, 0 }, kind = kind }
    local extend = lookup { x = { 0, 1, 3 }, y = { 1, 2, 0 }, kind = kind, outside = "extend" }
    expect(hold(-5)):equals(1)
    expect(hold(9)):equals(0)
    expect(extend(-2) - extend(-1)):near(extend(-1) - extend(0), 1e-12)
    expect(extend(5) - extend(4)):near(extend(4) - extend(3), 1e-12)
  end
end)

test("two variables: bilinear", function()
  local function plane(u, v) return 1 + 2*u - v + 0.5*u*v end
  local us, vs, z = { 0, 1, 3 }, { -1, 0, 2, 5 }, {}
  for i, u in ipairs(us) do
    z[i] = {}
    for j, v in ipairs(vs) do z[i][j] = plane(u, v) end
  end
  local f = lookup { x = us, y = vs, z = z }
  local value = fn({ x, y }, f(x, y))
  for _, u in ipairs { 0, 0.4, 1, 2.9, 3 } do
    for _, v in ipairs { -1, -0.5, 0, 1.7, 4.9, 5 } do
      expect(f(u, v)):near(plane(u, v), 1e-12)
      expect(value(u, v)):near(plane(u, v), 1e-12)
    end
  end
  expect(f(9, 9)):near(plane(3, 5), 1e-12)
end)

test("as a right-hand side, by every method, with the borders known", function()
  local places = {}
  for k = 0, 9 do places[k + 1] = k/2 end
  local smooth = { linear = "kink", pchip = "smooth", spline = "smooth" }
  for kind, word in pairs(smooth) do
    local f, exact = lookup { x = places, y = samples(math.sin, places), kind = kind }, 0
    for k = 1, #places - 1 do                                -- Simpson's rule is exact for cubics
      local a, b = places[k], places[k + 1]
      exact = exact + (b - a)/6*(f(a) + 4*f((a + b)/2) + f(b))
    end
    for _, method in ipairs { "auto", "radau", "bdf", "dopri5", "rodas" } do
      local sol = dae { der(x) ~ 1, der(y) ~ f(x) }:integrate { start = { [x] = 0, [y] = 0 }, to = 4.5,
        rtol = 1e-8, atol = 1e-10, method = method }
      expect(sol:final(y)):near(exact, 1e-6)
      expect(sol:stats().borders):matches(": " .. word)
    end
  end
end)

test("values that are parameters are fitted", function()
  local a, b = params "a b"
  local f = lookup { x = { 0, 1, 2 }, y = { 0, a, b } }
  local sys = dae { der(x) ~ 1, der(y) ~ f(x) }
  local sol = sys:integrate { start = { [x] = 0, [y] = 0 }, to = 2, params = { [a] = 3, [b] = 5 } }
  expect(sol:final(y)):near(1.5 + 4, 1e-6)
end)

test("a picture shows the curve and its points", function()
  local f = lookup { x = uneven, y = samples(math.sin, uneven), kind = "pchip" }
  expect(tostring(f:plot { title = "A table" })):matches "figure"
  expect(tostring(lookup { x = { 0, 1 }, y = { 0, 1 }, z = { { 0, 1 }, { 1, 2 } } }:plot())):matches "figure"
  local good, message = pcall(function() return lookup { x = { 0, 1 }, y = { 0, param "p" } }:plot() end)
  expect(good):equals(false)
  expect(message):matches "y%[2%] = p has no value"
end)

test("columns are points, too, and lists that change later change no table", function()
  local column = lookup { x = linspace(0, 1, 5), y = linspace(0, 2, 5), kind = "spline" }
  expect(column(0.3)):near(0.6, 1e-15)
  local values = { 1, 2, 4 }
  local f = lookup { x = { 0, 1, 2 }, y = values }
  values[2], f.y[2], f.x[2] = 7, 7, 0.5
  expect(f(1)):equals(2)
  expect(f(1.5)):equals(3)
end)

local function says(name, call, words)
  test(name, function()
    local good, message = pcall(call)
    expect(good):equals(false)
    expect(message):matches(words)
  end)
end
local triangle = lookup { x = { 0, 1, 2 }, y = { 0, 1, 0 } }
local u = input "u"
says("a table that is not called, as an input", function()
  dae { der(x) ~ u }:integrate { start = { x = 0 }, to = 1, inputs = { u = triangle } }
end, "u is a lookup; call it with its argument")
says("a table that is not called, in an equation", function() return dae { der(x) ~ triangle } end,
  "is a lookup; call it with its argument")
says("a column as the argument", function() return triangle(vec { 1, 2 }) end,
  "not a matrix; call it for each")
says("a name as the argument", function() return triangle "x" end, "a number or an expression, not a string")

local function refused(name, options, words) says(name, function() return lookup(options) end, words) end
refused("points that do not grow", { x = { 0, 1, 1 }, y = { 1, 2, 3 } },
  "x must grow, but x%[3%] = 1 follows 1")
refused("values too few", { x = { 0, 1, 2 }, y = { 1, 2 } }, "y must be a list of 3 values")
refused("an unknown kind", { x = { 0, 1 }, y = { 1, 2 }, kind = "cubic" }, 'option .kind. must be .*"pchip"')
refused("a place that is no number", { x = { 0, "1" }, y = { 1, 2 } }, "x%[2%] = 1 is not a number")
refused("a spline through a parameter",
  { x = { 0, 1 }, y = { 1, param "p" }, kind = "spline" },
  "linear and previous take expressions")
refused("one point", { x = { 0 }, y = { 0 } }, "two numbers or more")
refused("rows of different lengths", { x = { 0, 1 }, y = { 0, 1 }, z = { { 1, 2 }, { 3 } } },
  "z%[2%] must be a list of 2 values")
refused("a value that is no number", { x = { 0, 1 }, y = { 0, 0/0 } }, "y%[2%] = %-?nan is not a number")
