-- Random piecewise equations with roots, logarithms and inverse functions in their pieces, defined on all of
-- a border or ending on it, jumps and kinks: methods of every kind against a tight tolerance.
local function u() return 2*math.random() - 1 end

local function random_model(seed)
  math.randomseed(seed)
  local random = math.random
  local n = random(1, 3)
  local x, start, equations = var("x", n), {}, {}
  local function linear()
    local e = u()/2
    for i = 1, n do e = e + u()*x[i] end
    return e
  end
  local function piece(s)
    return ({
      function() return sqrt(1.5 + random() + sin(linear())) end,
      function() return log(2.5 + cos(linear())) end,
      function() return sqrt(abs(s) + 0.05*random(0, 1)) end,
      function() return sqrt(16 - x[1]^2) end,
      function() return linear()/(2 + abs(linear())) end,
      function() return sqrt(max(0, s)) end,
      function() return log(1 + s^2) end,
      function() return asin(linear()/6) end,
      function() return (4 + x[1])^1.5/8 end })[random(9)]()
  end
  for i = 1, n do
    local s = linear() + (random() < 0.3 and u()*t or 0)
    local f = ({
      function() return ifelse(lt(s, 0), piece(s), piece(s)) end,
      function() return ifelse(gt(s, 0), piece(s), u()) + 0.3*sin(2*t) end,
      function() return max(piece(s), linear()) - 1 end,
      function() return sign(s)*piece(s)/2 end })[random(4)]()
    equations[i] = der(x[i]) ~ -x[i]*(0.2 + random()) + f + 2*u()*sin((1 + random())*t + u())
    start[i] = u()
  end
  return dae(equations), x, start, n
end

for seed = 1, 30 do
  test("model " .. seed, function()
    local sys, x, start, n = random_model(seed)
    local function run(method, rtol)
      return sys:integrate { to = 6, start = { [x] = start }, method = method, rtol = rtol, atol = rtol }
    end
    local exact = run("radau", 1e-10)
    expect(exact.status):equals "finished"
    for _, method in ipairs { "auto", "radau", "rodas", "dopri5", "bdf" } do
      for _, rtol in ipairs { 1e-4, 1e-6 } do
        local sol = run(method, rtol)
        expect(sol.status):equals "finished"
        for i = 1, n do expect(sol(x[i], 6)):near(exact(x[i], 6), 300*rtol) end
      end
    end
  end)
end
