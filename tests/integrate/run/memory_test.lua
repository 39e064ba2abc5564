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

-- Kilobytes per call, once the caches are full.
local function growth(warm, calls, f)
  for i = 1, warm do f(0.31 + 1.0137*i) end
  local before = resident()
  for i = warm + 1, warm + calls do f(0.31 + 1.0137*i) end
  return (resident() - before)/calls
end

test("runs with other starts and parameters keep nothing", function()
  local spring = dae { der(x) ~ v, der(v) ~ -k*x }
  expect(growth(6000, 4000, function(c)
    spring:integrate { start = { x = c, v = 0 }, to = 0.1, params = { k = c } }
  end) < 0.7):equals(true)
end)

test("models made anew with other constants keep their constants", function()
  expect(growth(4000, 2000, function(c)
    dae { der(x) ~ v, der(v) ~ -c*x } :integrate { start = { x = 1, v = 0 }, to = 0.1 }
  end) < 2):equals(true)
end)
