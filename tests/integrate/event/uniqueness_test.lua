-- Where the slope of the equations is infinite, more than one solution may go on: that is said, and not where
-- only one does.

local x, y, q = var "x", var "y", var "q"
local c = param("c", 1)

local function remark(equations, start, to, options)
  options = options or {}
  options.start, options.to = start, to
  local sol = dae(equations):integrate(options)
  expect(sol.status):equals "finished"
  local said = sol:stats().not_unique
  expect(tostring(sol):find("not unique", 1, true) ~= nil):equals(said ~= "")
  return said
end

test("a solution that comes to rest on √|x| = 0 may leave it", function()
  for _, method in ipairs { "auto", "radau", "dopri5", "rodas", "bdf", "dop853" } do
    local said = remark({ der(x) ~ sqrt(abs(x)) }, { x = -0.05 }, 2, { method = method })
    expect(said):matches "x = 0 there, where √|x| has an infinite slope"
    expect(tonumber(said:match "from t = (%S+) on")):near(2*math.sqrt(0.05), 1e-3)  -- -x = (t₁ - t)²/4
  end
end)

test("starts on the root", function()
  local roots = { sqrt(x), sqrt(abs(x)), 3*x^(2/3), c*sqrt(max(x, 0)), sqrt(x)*(1 - x), sqrt(2*x)*exp(-x) }
  for _, f in ipairs(roots) do
    expect(remark({ der(x) ~ f }, { x = 0 }, 1)):matches "^not unique from t = 0 on: "
  end
  expect(remark({ der(x) ~ sqrt(abs(x - 1)) }, { x = 1 }, 1)):matches "x %- 1 = 0"
  expect(remark({ der(x) ~ q, 0 ~ q - sqrt(x) }, { x = 0 }, 1)):matches "√x"
  -- it leaves towards -∞
  expect(remark({ der(x) ~ -sqrt(abs(x)) }, { x = 0 }, 1)):matches "√|x|"
end)

test("the same in other units", function()
  for _, s in ipairs { 1e-9, 1e-3, 1e6 } do
    for _, T in ipairs { 1e-6, 1e4 } do
      local said = remark({ der(x) ~ math.sqrt(s)/T*sqrt(abs(x)) }, { x = -0.05*s }, 2*T)
      expect(said):matches "not unique"
    end
  end
end)

test("one solution only", function()
  local outflow = -c*sqrt(max(x, 0))
  expect(remark({ der(x) ~ outflow }, { x = 0.2 }, 2)):equals ""  -- a tank runs empty
  expect(remark({ der(x) ~ 0.1 + outflow }, { x = 0 }, 2)):equals ""  -- and is filled
  expect(remark({ der(x) ~ 1 + sqrt(abs(x)) }, { x = -0.5 }, 2)):equals ""  -- passes 0
  expect(remark({ der(x) ~ 1e-3 + sqrt(abs(x)) }, { x = -0.05 }, 2)):equals ""  -- and slowly
  expect(remark({ der(x) ~ sqrt(abs(x)) }, { x = 0.1 }, 2)):equals ""  -- has left
  expect(remark({ der(x) ~ sqrt(abs(sin(t))) }, { x = 0 }, 7)):equals ""  -- of t alone
  expect(remark({ der(x) ~ abs(x)^1.5 }, { x = 0 }, 1)):equals ""  -- a finite slope
  local flow = sign(x - y)*sqrt(abs(x - y))  -- two tanks until they are level
  expect(remark({ der(x) ~ -flow, der(y) ~ flow }, { x = 1, y = 0 }, 2)):equals ""
end)

-- Implicit methods need a Jacobian at the start, which is infinite there.
test("tanks that are empty at the start", function()
  local a = 0.1
  local half = a*(2*math.log(2) - 1)  -- dt = 2 s ds/(a - s), s = √x: s = a/2
  for _, method in ipairs { "auto", "radau", "dopri5", "rodas", "bdf", "gauss" } do
    for _, root in ipairs { sqrt(x), sqrt(max(x, 0)), sqrt(abs(x)), max(x, 0)^0.5 } do
      local sol = dae { der(x) ~ a - root } :integrate { start = { x = 0 }, to = 2, method = method }
      expect(sol.status):equals "finished"
      expect(sol(x, half)/(a/2)^2):near(1, 1e-4)
      expect(sol(x, 2)/a^2):near(1, 1e-4)
    end
    -- the first fills the second: what left one is in the other
    local above, below = sqrt(max(x, 0)), sqrt(max(y, 0))/2
    local sol = dae { der(x) ~ -above, der(y) ~ above - below, der(q) ~ below }
      :integrate { start = { x = 1, y = 0, q = 0 }, to = 1.9, method = method }
    expect(sol.status):equals "finished"
    expect(sol(x, 1.9)):near((1 - 1.9/2)^2, 1e-5)
    expect(sol(x + y + q, 1.9)):near(1, 1e-9)
  end
end)

test("three tanks that are empty and level at the start", function()
  local h = { var "h1", var "h2", var "h3" }
  local function flow(a, b) return 0.02*sign(a - b)*sqrt(2*9.81*abs(a - b)) end
  local out = 0.02*sqrt(2*9.81*max(h[3], 0))
  local first, second = flow(h[1], h[2]), flow(h[2], h[3])
  local tanks = dae { 0.5*der(h[1]) ~ 0.01 - first, 0.5*der(h[2]) ~ first - second,
    0.5*der(h[3]) ~ second - out }
  local steady = (0.01/0.02)^2/(2*9.81)  -- the same head over each of the three openings
  for _, method in ipairs { "auto", "radau", "rodas", "bdf", "dopri5" } do
    local sol = tanks:integrate { start = { h1 = 0, h2 = 0, h3 = 0 }, to = 600, method = method }
    expect(sol.status):equals "finished"
    for k = 1, 3 do expect(sol(h[k], 600)/steady):near(4 - k, 1e-4) end
  end
end)

test("a root that its argument leaves at 0 names what to write", function()
  local sol = dae { der(x) ~ -0.1*sqrt(x) } :integrate { start = { x = 1 }, to = 30 }
  expect(sol.status):matches "stopped at t = 20"
  expect(sol.status):matches "write max%(…, 0%) under the root"
  sol = dae { der(x) ~ -0.1*sqrt(max(x, 0)) } :integrate { start = { x = 1 }, to = 30 }
  expect(sol.status):equals "finished"
  expect(sol(x, 10)):near(0.25, 1e-6)
  expect(sol(x, 30)):near(0, 1e-9)
end)
