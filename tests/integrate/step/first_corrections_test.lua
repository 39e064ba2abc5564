-- The first two corrections of Newton's iteration do not tell whether it converges: from a polynomial that is
-- continued, a small reaction intermediate is predicted many times its size, and products with it move the
-- others by as much once more (lengths 225 and 221, then 3). Steps were given up there, two of three, and
-- their sizes fell to a tenth. D6 of STIFF DETEST (Enright, Hull & Lindberg, BIT 15, 1975), a cycle of the
-- same kind with round numbers, and both in other units of time and amount.
local a, b, c = vars "a b c"

--- T units of time in 1, L units of amount in 1; the rates of what c does to a and to b, and the decay of b
local function cycle(name, T, L, fast, second, decay)
  local A, B, C = a/L, b/L, c/L
  local p, q = L*T*(-A + fast*C*(1 - A)), L*T*(-decay*B + second*C*(1 - B))
  return { name = name, model = dae { der(a) ~ p, der(b) ~ q, der(c) ~ -p - q }, L = L, to = 1/T,
    start = { [a] = L, [b] = 0, [c] = 0 } }
end

for _, case in ipairs { cycle("D6", 1, 1, 1e8, 3e7, 10), cycle("weaker", 1, 1, 1e7, 4e6, 3),
  cycle("D6, T = 10⁶, L = 10⁻⁹", 1e6, 1e-9, 1e8, 3e7, 10) } do
  local function run(rtol)
    return case.model:integrate { start = case.start, to = case.to, rtol = rtol, atol = 1e-2*rtol*case.L,
      method = "radau", times = { case.to } }
  end
  local exact = run(1e-13)
  for _, rtol in ipairs { 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9 } do
    test(("%s, rtol %g"):format(case.name, rtol), function()
      local sol = run(rtol)
      expect(sol.status):equals "finished"
      local stats = sol:stats()
      expect(stats.rejected <= stats.steps/4 + 1):equals(true)
      expect(stats.steps <= 25):equals(true)
      for _, v in ipairs { a, b } do
        expect(math.abs(sol:final(v) - exact:final(v)) <= 50*rtol*case.L):equals(true)
      end
    end)
  end
end
