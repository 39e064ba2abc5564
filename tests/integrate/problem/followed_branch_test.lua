-- Unknowns of an explicit stage are followed on their branch, in steps as long as the solution allows.

-- A parallelogram: crank of length r at the angle a, coupler of length l, whose angle b stays 0, rocker at
-- the angle c = a; with the position p of a point of the coupler, in units of length and time.
local function parallelogram(L, T)
  local a, b, c, p, v, w = vars "a b c p v w"
  local r, l = 1*L, 2*L
  return dae { a.dot ~ 1/T, p.dot ~ v,
    0 ~ r*cos(a) + l*cos(b) - r*cos(c) - l, 0 ~ r*sin(a) + l*sin(b) - r*sin(c),
    v ~ -r*sin(a)/T - l/2*sin(b)*w, w ~ c/T - a/T }, a, b, c, p
end

test("a bar that stays level, whose angle is 0, allows long steps in any unit", function()
  for _, unit in ipairs { { 1, 1 }, { 1000, 1e-3 }, { 1e-6, 60 } } do
    local L, T = table.unpack(unit)
    local sys, a, b, c, p = parallelogram(L, T)
    for _, method in ipairs { "dopri5", "dop853", "verner87" } do
      local sol = sys:integrate { start = { [a] = 1, [p] = L*cos(1), [b] = 0, [c] = 1 }, to = 2*T,
        rtol = 1e-7, method = method }
      expect(sol.status):equals "finished"
      expect(sol:final(c)):near(3, 1e-6)
      expect(sol:final(b)):near(0, 1e-6)
      expect(sol:final(p)):near(L*cos(3), 1e-5*L)
      expect(sol:stats().steps <= 60):is_true()
    end
  end
end)
