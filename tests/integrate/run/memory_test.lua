-- What a session keeps: runs, and models that are made anew, leave next to nothing behind.

local x, v, k = var "x", var "v", param("k", 2)

local function resident()
  collectgarbage()
  collectgarbage()
  for line in io.lines "/proc/self/status" do
    local kilobytes = line:match "^VmRSS:%s+(%d+)"
    if kilobytes then return tonumber(kilobytes) end
  end
end

-- Kilobytes per call, once the caches are full. The address sanitizer keeps what is given back, so that its
-- memory tells nothing.
local function growth(warm, calls, f)
  for i = 1, warm do f(0.31 + 1.0137*i) end
  local before = resident()
  for i = warm + 1, warm + calls do f(0.31 + 1.0137*i) end
  return os.getenv "PENDULA_SANITIZED" and 0 or (resident() - before)/calls
end

test("runs with other starts and parameters keep nothing", function()
  local spring = dae { der(x) ~ v, der(v) ~ -k*x }
  expect(growth(6000, 4000, function(c)
    spring:integrate { start = { x = c, v = 0 }, to = 0.1, params = { k = c } }
  end) < 0.7):equals(true)
end)

-- Expressions that nobody refers to any more are given back (docs/decisions/019), whatever else lives:
-- symbols, an old model, the values of the last turns. Each of these models makes 30.
test("models made anew with other constants keep nothing", function()
  local old = dae { der(x) ~ -k*x }
  local y, results = var "y", {}
  local function run(c)
    local a = 1 + c/7919
    local sys = dae {
      der(x) ~ a*x*(1 - x/7) + sin(a*y),
      der(y) ~ x*(a + 2) - y/a + (a*x + y)^3*exp(-a*y),
    }
    return sys:integrate { start = { x = 1, y = 0 }, to = 1e-3, method = "rk4", dt = 1e-3 }(x, 1e-3)
  end
  expect(growth(8000, 8000, function(c)
    local turn = math.floor(c) % 50
    results[turn] = { c = c, x = run(c) }
  end) < 0.3):equals(true)                                 -- 1.2 kB where they are kept
  for _, result in pairs(results) do expect(run(result.c)):equals(result.x) end
  expect(old:integrate { start = { x = 1 }, to = 1 }(x, 1)):near(math.exp(-2), 1e-6)
end)

test("products of matrices keep nothing", function()
  expect(growth(20000, 20000, function(c)
    return det(mat { { 1 + c, 2 }, { 3, c/13 } }*mat { { c, 1 }, { 1, 2 } })
  end) < 0.1):equals(true)                                 -- 2.4 kB where they are kept
end)
