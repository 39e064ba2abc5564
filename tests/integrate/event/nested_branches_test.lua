-- Tables written as nested conditions: 20 and more borders, each of which the others hide.
local x, y = vars "x y"
local methods = { "auto", "radau", "bdf", "dopri5", "rodas" }

--- The piece of the first of n borders 1 … n that x lies below, else the last.
local function table_of(n, piece)
  local f = piece(n + 1)
  for k = n, 1, -1 do f = ifelse(lt(x, k), piece(k), f) end
  return f
end

--- How many of the borders in stats().borders are of a kind.
local function count(borders, kind)
  local n = 0
  for line in borders:gmatch "[^\n]+" do if line:find(kind, 1, true) then n = n + 1 end end
  return n
end

test("a jump behind any number of conditions is slid along", function()
  for _, at in ipairs { 2, 7, 12, 20 } do
    local f = table_of(20, function(k) return (k <= at and 1 or -1)*(1 + k/100) + 0*x end)
    for _, method in ipairs(methods) do
      local sol = dae { der(x) ~ f }:integrate { start = { [x] = 0.5 }, to = 40, method = method }
      expect(sol.status):equals "finished"
      expect(sol:final(x)):near(at, 1e-9)
    end
  end
end)

test("each border of a table is known by how it is continuous", function()
  local function hermite(k)                     -- sin and its slope at the borders: both sides agree in slope
    local s, a, b = x - (k - 1), math.sin(k - 1), math.sin(k)
    local da, db = math.cos(k - 1), math.cos(k)
    return a + s*(da + s*((3*(b - a) - 2*da - db) + s*(2*(a - b) + da + db)))
  end
  local function line(k) return math.sin(k - 1) + (math.sin(k) - math.sin(k - 1))*(x - (k - 1)) end
  local function step(k) return math.sin(k) + 0*x end
  for kind, piece in pairs { smooth = hermite, kink = line, jump = step } do
    local sys = dae { der(x) ~ 1, der(y) ~ table_of(12, piece) }
    local sol = sys:integrate { start = { [x] = 0.5, [y] = 0 }, to = 11.25, rtol = 1e-8, atol = 1e-8 }
    expect(sol.status):equals "finished"
    expect(count(sol:stats().borders, kind)):equals(12)
    local exact = 0                             -- the integral of the same pieces, by Simpson's rule
    for k = 1, 12 do
      local function at(value) return tonumber(tostring(subs(piece(k), { [x] = value }))) end
      local a, b = math.max(0.5, k - 1), math.min(11.75, k)
      exact = exact + (b - a)/6*(at(a) + 4*at((a + b)/2) + at(b))
    end
    expect(sol:final(y)):near(exact, 1e-6)
  end
end)

test("a jump behind conditions on eight other unknowns", function()
  local z = var("z", 8)
  local f = ifelse(lt(x, 1), 1, -1)
  local equations, start = {}, { [x] = 0 }
  for k = 1, 8 do
    f = ifelse(lt(z[k], 0), 1 + 0*x, f)
    equations[k], start[z[k]] = der(z[k]) ~ -z[k], 1
  end
  equations[9] = der(x) ~ f
  for _, method in ipairs(methods) do
    local sol = dae(equations):integrate { start = start, to = 4, method = method }
    expect(sol.status):equals "finished"
    expect(sol:final(x)):near(1, 1e-9)
    expect(sol:stats().steps < 400):equals(true)
  end
end)

test("what a table costs to prepare is in proportion to its size", function()
  local function prepared(n)
    local f = table_of(n, function(k) return (k - 1)^2 + (2*k - 1)*(x - (k - 1)) end)
    local sys, from = dae { der(x) ~ 1, der(y) ~ f + 0.001*n }, os.clock()
    expect(sys:integrate { start = { [x] = 0.5, [y] = 0 }, to = 2 }.status):equals "finished"
    return os.clock() - from
  end
  prepared(50)
  local function least(n) return math.min(prepared(n), prepared(n + 1), prepared(n + 2)) end
  expect(least(200) < 12*least(50)):equals(true)        -- 4, if in proportion, 16 … 64 where it was not
end)
