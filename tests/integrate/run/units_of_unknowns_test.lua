-- The same model in ten random systems of units: no run stops in one of them alone because it takes what is
-- small in its unit for 0. References: runs in SI units.
local x, y, u, v, l = vars "x y u v l"

local function random(seed)
  local state = seed * 7919 + 17
  return function()                                          -- a power of ten between 10⁻⁹ and 10⁹
    state = (state * 1103515245 + 12345) % 2147483648
    return 10.0^(state // 65536 % 19 - 9)
  end
end

-- name -> function(f, e): model, start, end, unknowns; f: units of the unknowns, e: factors of the equations
local models = {
  ["a pendulum with its multiplier"] = function(f, e)
    local X, Y, U, V, L = x/f[1], y/f[2], u/f[3], v/f[4], l/f[5]
    return dae { e[1]*(der(x)/f[1] - U) ~ 0, e[2]*(der(y)/f[2] - V) ~ 0, e[3]*(der(u)/f[3] + X*L) ~ 0,
      e[4]*(der(v)/f[4] + Y*L + 9.81) ~ 0, e[5]*(X^2 + Y^2 - 1) ~ 0 }:reduce(),
      { x = f[1], y = 0, u = 0, v = 0 }, 4, { x, y, u, v, l }
  end,
}

for name, make in pairs(models) do
  test(name .. ": ten systems of units", function()
    local ones = { 1, 1, 1, 1, 1 }
    local model, start, last = make(ones, ones)
    local exact = model:integrate { start = start, to = last, rtol = 1e-12, atol = 1e-14 }:final(y)
    for _, method in ipairs { "auto", "radau", "bdf" } do
      for seed = 1, 10 do
        local draw, f, e = random(seed), {}, {}
        for i = 1, 5 do f[i], e[i] = draw(), draw() end
        local other, begin, to, list = make(f, e)
        local atol = {}
        for i, unknown in ipairs(list) do if i < 5 then atol[unknown] = 1e-9*f[i] end end
        local sol = other:integrate { start = begin, to = to, method = method, atol = atol }
        expect(seed .. " " .. sol.status):equals(seed .. " finished")
        expect(sol:final(y)/f[2]):near(exact, 2e-4)
      end
    end
  end)
end

test("large numbers are no reason for short steps: a spring pendulum in metres … picometres", function()
  local x1, y1, x2, y2 = vars "x1 y1 x2 y2"
  local function run(L, method)
    local sys = lagrange { q = { x1, y1, x2, y2 },
      T = (der(x1)^2 + der(y1)^2)/2 + 0.35*(der(x2)^2 + der(y2)^2),
      V = 9.81*L*(y1 + 0.7*y2) + 100*(sqrt((x2 - x1)^2 + (y2 - y1)^2) - 0.3*L)^2,
      C = { x1^2 + y1^2 - 0.25*L^2 } }
    local start = sys:init { fix = { x1 = 0.5*L, x2 = 0.8*L, y2 = 0, [der(x2)] = 0, [der(y2)] = 0,
      [der(y1)] = 0 }, guess = { y1 = 0 } }
    local sol = sys:reduce():integrate { start = start, to = 1, rtol = 1e-8, method = method }
    return sol(x1, 1)/L, sol(y2, 1)/L, sol:stats().steps
  end
  for _, method in ipairs { "auto", "radau", "bdf" } do   -- in picometres 1000, 48, 45 times before
    local a, b, steps = run(1, method)
    for _, L in ipairs { 1e3, 1e6, 1e9, 1e12 } do
      local c, d, more = run(L, method)
      expect(c):near(a, 1e-6)
      expect(d):near(b, 1e-6)
      expect(more < 1.3*steps):equals(true)
    end
  end
end)

test("what falls keeps its digits for six decades, and what oscillates is not loosened", function()
  for _, size in ipairs { 1, 1e4, 1e9, 1e15 } do
    local sol = dae { der(x) ~ -x }:integrate { start = { x = size }, to = 13.8, rtol = 1e-6 }
    expect(sol(x, 13.8)/size*math.exp(13.8)):near(1, 3e-6)
  end
  -- u′ times the length of the run is no size of u
  local wave = dae { der(u) ~ v, der(v) ~ -u }
    :integrate { start = { u = 0, v = 1 }, to = 2000*math.pi, rtol = 1e-8 }
  expect(wave:final(u)):near(0, 3e-5)
end)
