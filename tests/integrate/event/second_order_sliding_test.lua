-- Sliding modes of second order, 0 = s = s′ in finite time: Levant, Sliding order and sliding accuracy in
-- sliding mode control, Int. J. Control 58, 1993. The roots of s have no derivative there.
local x, v, w = vars "x_sm v_sm w_sm"
local function root(s) return sqrt(abs(s))*sign(s) end

local function slides(sys, start, zero, methods)
  for _, method in ipairs(methods or { "auto", "dopri5", "bdf", "rodas" }) do
    for _, rtol in ipairs { 1e-8, 1e-6, 3e-5 } do
      local sol = sys:integrate { start = start, to = 15, rtol = rtol, method = method }
      expect(method .. " " .. sol.status):equals(method .. " finished")
      for _, e in ipairs(zero) do expect(math.abs(sol:final(e)) < 100*rtol):equals(true) end
      expect(sol:stats().borders):matches "the solution slides along it"
    end
  end
end

test("super-twisting: x and its disturbed derivative come to rest", function()
  local start = { [x] = 1, [v] = 0.3 }
  slides(dae { der(x) ~ -1.5*root(x) + v, der(v) ~ -1.1*sign(x) }, start, { x, v })
  slides(dae { der(x) ~ -1.5*root(x) + v + 0.3*sin(t), der(v) ~ -1.1*sign(x) }, start, { x, v + 0.3*sin(t) })
  slides(dae { der(x) ~ -1.5*root(x) - 2*x + v, der(v) ~ -1.1*sign(x) - 3*x + 0.4*cos(t) }, start, { x, v },
    { "auto", "dopri5", "rodas" })
end)

test("super-twisting in other units: factors do not make other borders", function()
  for _, S in ipairs { 1e-6, 1e6 } do
    for _, T in ipairs { 1e-3, 1e3 } do
      local sys = dae { der(x) ~ S/T*(-1.5*root(x/S)) + v, der(v) ~ -1.1*S/T^2*sign(x) }
      local sol = sys:integrate { start = { [x] = S, [v] = 0.3*S/T }, to = 15*T, rtol = 1e-6 }
      expect(sol.status):equals "finished"
      expect(math.abs(sol:final(x)) < 1e-4*S):equals(true)
      expect(math.abs(sol:final(v)) < 1e-4*S/T):equals(true)
    end
  end
end)

test("Levant's differentiator follows sin t and its derivative", function()
  local e = x - sin(t)
  slides(dae { der(x) ~ -1.5*root(e) + v, der(v) ~ -1.1*sign(e) }, { [x] = 1, [v] = 0.3 }, { e, v - cos(t) },
    { "auto", "dopri5" })
end)

test("a surface of two states, behind which an integrator stands", function()
  local plant = dae { der(x) ~ v, der(v) ~ w + 0.2*sin(3*t) - 1.5*root(v + x), der(w) ~ -1.1*sign(v + x) }
  slides(plant, { [x] = 1, [v] = 0.3, [w] = 0 }, { v + x }, { "auto", "dopri5" })
end)

-- Oscillations that are real are no sliding, however fast they are.
test("a ball in a valley keeps its energy", function()
  for _, k in ipairs { 0, 1e5 } do
    local energy = v^2/2 + 1e6*abs(x) + k*2/3*abs(x)^(3/2)
    local sol = dae { der(x) ~ v, der(v) ~ -1e6*sign(x) - k*root(x) }:integrate {
      start = { [x] = 1e-3, [v] = 0 }, to = 0.2, rtol = 1e-8, max_steps = 1e5 }
    expect(sol.status):equals "finished"
    expect(sol:final(energy) / sol(energy, 0)):near(1, 1e-4)
  end
end)
