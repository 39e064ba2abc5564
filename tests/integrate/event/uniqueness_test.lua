-- Where the slope of the equations is infinite, more than one solution may go on: that is said, and not where
-- only one does.

local families = dofile "tests/families.lua"
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
  expect(remark({ der(x) ~ sqrt(2*9.81*abs(x)) }, { x = 0 }, 1)):matches "√%(19.62 |x|%)"
  expect(remark({ der(x) ~ sqrt(abs(-3*c*x)/7) }, { x = 0 }, 1)):matches "x = 0 there"
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

test("at rest on a root of second and third order", function()
  local v = var "v_rest"
  for _, method in ipairs { "auto", "radau", "dopri5", "rodas", "bdf" } do
    local said = remark({ der(x, 2) ~ sqrt(abs(x)) }, { x = 0, [der(x)] = 0 }, 1, { method = method })
    expect(said):matches "^not unique from t = 0 on: x = 0 there, where √|x|"
  end
  expect(remark({ der(x) ~ v, der(v) ~ 3*abs(x)^(1/3) }, { x = 0, [v] = 0 }, 1)):matches "x = 0"
  local spring = { der(x) ~ v, 2*der(v) ~ q, 0 ~ q - c*sqrt(max(x, 0)) }
  expect(remark(spring, { x = 0, [v] = 0 }, 1)):matches "x = 0"
  local at_rest = { x = 0, [der(x)] = 0, [der(x, 2)] = 0 }
  expect(remark({ der(x, 3) ~ sqrt(abs(x)) }, at_rest, 1)):matches "x = 0"
  expect(remark({ der(x, 2) ~ sqrt(abs(x - t)) }, { x = 0, [der(x)] = 1 }, 1)):matches "x %- t = 0"
  for _, s in ipairs { 1e-9, 1e6 } do  -- in other units
    for _, T in ipairs { 1e-6, 1e4 } do
      local said = remark({ der(x, 2) ~ math.sqrt(s)/T^2*sqrt(abs(x)) }, { x = 0, [der(x)] = 0 }, T)
      expect(said):matches "not unique"
    end
  end
end)

test("of second order with one solution only", function()
  local function falls(f, x0, v0) return remark({ der(x, 2) ~ f }, { x = x0, [der(x)] = v0 }, 1) end
  expect(falls(sqrt(abs(x)), 0, 1)):equals ""  -- passes
  expect(falls(sqrt(abs(x)), 0, -0.1)):equals ""
  expect(falls(1 + sqrt(abs(x)), 0, 0)):equals ""  -- is pushed off
  expect(falls(-sign(x)*sqrt(abs(x)), 0, 0)):equals ""  -- is pulled back
  expect(falls(abs(x)^1.5, 0, 0)):equals ""  -- a finite slope
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
  local friction = -sign(y)*sqrt(abs(y))
  expect(remark({ der(x) ~ y, der(y) ~ friction }, { x = 0, y = 1 }, 4)):equals ""
end)

-- Implicit methods need a Jacobian at the start, which is infinite there.
test("tanks that are empty at the start", function()
  local a = 0.1
  local half = a*(2*math.log(2) - 1)  -- dt = 2 s ds/(a - s), s = √x: s = a/2
  for _, method in ipairs(families.with("auto", "dopri5")) do
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
    expect(sol:stats().not_unique):equals ""
    for k = 1, 3 do expect(sol(h[k], 600)/steady):near(4 - k, 1e-4) end
  end
end)

test("ten tanks in a row in centimetres", function()
  local h, start, equations = {}, {}, {}
  for k = 1, 10 do
    h[k] = var("h" .. k)
    start[h[k]] = 0
  end
  local function flow(k)
    if k == 0 then return 100 end
    if k == 10 then return 5*sqrt(2*981*max(h[10], 0)) end
    return 5*sign(h[k] - h[k + 1])*sqrt(2*981*abs(h[k] - h[k + 1]))
  end
  for k = 1, 10 do equations[k] = 2000*der(h[k]) ~ flow(k - 1) - flow(k) end
  local sol = dae(equations):integrate { start = start, to = 36000 }
  expect(sol.status):equals "finished"
  expect(sol:stats().not_unique):equals ""
  expect(sol(h[1], 36000)/(10*20^2/(2*981))):near(1, 1e-4)
end)

-- A run in parts, here by regimes, says what one of them has found, and how many tolerances they err.
test("a run by regimes keeps what its parts have found", function()
  local force, v = var "l", var "v"
  local falling = { der(x) ~ v, der(v) ~ -9.81 + force, 0 ~ min(x, force), der(y) ~ sqrt(y) }
  local sol = dae(falling):integrate { start = { x = 1, v = 0, y = 0 }, to = 2 }
  expect(sol.status):equals "finished"
  expect(sol:stats().not_unique):matches "y = 0 there"
  expect(tostring(sol)):matches "not unique"
  expect(sol:stats().errors > 0):equals(true)
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

-- x′ = x/t: x = c t for every c, so all solutions meet at 0. About a = 0 the equation of b is that of its
-- leading terms, b′ = (a² - b²/2)/(2 a²), which b = k a solves where a′ = -3/2 and -3 k = 1 - k²/2: k = 3
-- ± √11. That with the greater k takes all that come, and behind 0 they part: ∂b′/∂b = -k/(2 a).
test("a divisor that vanishes with its dividend lets solutions meet and part", function()
  local a = var "a"
  for _, method in ipairs(families.with("dopri5", "tsit5")) do
    local sol = dae { der(x) ~ x/t } :integrate { start = { x = 1 }, from = -1, to = 1, method = method }
    expect(sol.status):equals "finished"
    expect(sol:stats().not_unique):matches "^not unique from t = %S+ on: t = 0 there"
    expect(tonumber(sol:stats().not_unique:match "t = (%S+) on")):near(0, 1e-9)
    local pair = { der(a) ~ -3/2, der(y) ~ (cos(y) - exp(-a^2))/(2*a^2) - y }
    sol = dae(pair):integrate { start = { a = 1/3, y = 0.1 }, to = 0.3, method = method }
    if sol.status == "finished" then
      expect(sol:stats().not_unique):matches "a = 0 there"
      expect(tonumber(sol:stats().not_unique:match "t = (%S+) on")):near(2/9, 1e-6)
    else
      expect(sol.status):matches "a is almost 0 there"
    end
  end
end)

test("a divisor whose quotient is smooth does not", function()
  local a = var "a"
  local smooth = { sin(a)/a, (1 - cos(a))/a^2, (exp(a) - 1)/a, y*sin(a)/a, y*(exp(a) - 1)/a, 10*y*a/sin(a) }
  for i, f in ipairs(smooth) do
    for _, sign in ipairs { 1, -1 } do
      for _, method in ipairs { "dopri5", "radau", "bdf", "rodas" } do
        local said = remark({ der(a) ~ -1.5 + 0.1*y, der(y) ~ sign*f - y }, { a = 0.1, y = 0.3 }, 0.15,
          { method = method })
        expect(i .. method .. said):equals(i .. method)
      end
    end
  end
end)
