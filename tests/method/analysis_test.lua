-- What is known about methods: published facts, and properties that every registered method must have.
local x, y, z = vars "x y z"

local registered = {}
for name, tab in pairs(rk) do
  if type(tab) == "tableau" then registered[#registered + 1] = tab end
end
table.sort(registered, function(a, b) return a.name < b.name end)
local families = {}
for s = 1, 4 do
  families[#families + 1] = rk.gauss(s)
  families[#families + 1] = rk.radau(s)
  families[#families + 1] = rk.radau_ia(s)
  for _, kind in ipairs { "IIIA", "IIIB", "IIIC", "IIIC*", "IIID", "IIIE" } do
    if s > 1 then families[#families + 1] = rk.lobatto(kind, s) end
  end
end

test("stability limits to 12 digits (exam 5(d))", function()
  for name, limit in pairs { euler = -2, midpoint = -2, heun = -2, ralston = -2, kutta3 = -2.512745326618,
    heun3 = -2.512745326618,
                             ssprk33 = -2.512745326618, rk4 = -2.785293563405, kutta38 = -2.785293563405 } do
    expect(rk[name]:stability().real):near(limit, 5e-13)
  end
  expect(rk.rk4:stability().imaginary):near(2 * math.sqrt(2), 1e-15)
  expect(rk.kutta3:stability().imaginary):near(math.sqrt(3), 1e-15)
  expect(rk.heun:stability().imaginary):equals(0)
  expect(rk.gauss(3):stability().imaginary):equals(math.huge)
  expect(rk.radau(2):stability().real):equals(-math.huge)
end)

test("stability functions are exact", function()
  expect(rk.radau(2):stability().formula):equals "(1 + z/3)/(1 - 2z/3 + z²/6)"
  expect(rk.radau_ia(2):stability().formula):equals "(1 + z/3)/(1 - 2z/3 + z²/6)"
  expect(rk.lobatto("IIIC", 2):stability().formula):equals "1/(1 - z + z²/2)"
  expect(rk.gauss(4):stability().formula):equals "(1 + z/2 + 3z²/28 + z³/84 + z⁴/1680)/(1 - z/2 + 3z²/28 - z³/84 + z⁴/1680)"
  expect(rk.sdirk4:stability().formula:find("/(1 - z/4)⁵", 1, true) ~= nil):is_true()
  expect(rk.rk4:stability().R):equals(rk.kutta38:stability().R)
  -- R(z) for a Padé approximation and a value by the step itself.
  local sol = dae { der(x) ~ -3 * x }:integrate { start = { x = 1 }, to = 0.5, method = rk.radau(3),
    dt = 0.5 }
  expect(sol:final(x)):near(rk.radau(3):stability()(-1.5), 1e-14)
end)

test("A-, A(α)-, L- and algebraic stability (Hairer & Wanner II, Table IV.5.13, Thm IV.12.9)", function()
  for s = 1, 6 do
    expect(rk.gauss(s):is "A-stable"):is_true()
    expect(rk.gauss(s):is "L-stable"):is_false()
    expect(rk.gauss(s):is "algebraically stable"):is_true()
    for _, tab in ipairs { rk.radau(s), rk.radau_ia(s) } do
      expect(tab:is "L-stable"):is_true()
      expect(tab:is "algebraically stable"):is_true()
      expect(tab:order()):equals(2 * s - 1)
    end
    if s > 1 then
      for kind, facts in pairs { IIIA = { "A", s }, IIIB = { "A", s - 2 }, IIIC = { "L", s - 1 },
        IIID = { "A", s - 1 } } do
        local tab = rk.lobatto(kind, s)
        expect(tab:order()):equals(2 * s - 2)
        expect(tab:is "A-stable"):is_true()
        expect(tab:is "L-stable"):equals(facts[1] == "L")
        expect(tab:is "algebraically stable"):equals(kind == "IIIC" or kind == "IIID")
        if s > 2 then expect(tab:stage_order()):equals(facts[2] < 1 and 1 or facts[2]) end
      end
      expect(rk.lobatto("IIIC*", s):is "A-stable"):is_false()
      expect(rk.lobatto("IIID", s):is "symplectic"):is_true()
      expect(rk.lobatto("IIIE", s):is "symplectic"):is_true()
    end
  end
  expect(rk.sdirk2:is "L-stable"):is_true()
  expect(rk.sdirk3:is "L-stable"):is_true()
  expect(rk.tr_bdf2:is "l stable"):is_true()
  expect(rk.crouzeix:is "A-stable"):is_true()
  expect(rk.crouzeix:stability().infinity):near(1 - math.sqrt(3), 1e-15)
  expect(rk.dopri5:is "FSAL"):is_true()
  expect(rk.qin_zhang:is "symplectic"):is_true()
  expect(rk.esdirk43:is "SDIRK"):is_true()
  expect(function() return rk.rk4:is "A stabel" end):fails "Did you mean 'A-stable'"
end)

test("A(α) of a method that is not A-stable, against the angle at which |R| exceeds 1", function()
  -- SDIRK of order 3 with γ = 1/2: R(∞) is below 1 in modulus, yet it is not A-stable (γ < 1/3 or > 1.0686
  -- would be).
  local tab = rk.collocation { "1/2", 1, 2 }
  local st = tab:stability()
  if not st.A_stable and st.alpha > 0 then
    local function largest(angle)
      local worst = 0
      for k = -60, 60 do
        local r = 10 ^ (k / 20)
        local re, im = st(-r * math.cos(math.rad(angle)), r * math.sin(math.rad(angle)))
        worst = math.max(worst, re * re + im * im)
      end
      return worst
    end
    expect(largest(st.alpha - 0.01) <= 1):is_true()
    expect(largest(st.alpha + 0.5) > 1):is_true()
  end
end)

test("BDF: coefficients, error constants, angles (Hairer & Wanner II, §V.2)", function()
  local degrees = { 90, 90, 86.03, 73.35, 51.84, 17.84 }
  for k = 1, 6 do
    local m = bdf(k)
    expect(m:order()):equals(k)
    expect(m.error_constant):equals(-1 / (k + 1))
    expect(m:stability().alpha):near(degrees[k], 1e-4)
    expect(m:is "zero-stable"):is_true()
    expect(m:is "A-stable"):equals(k <= 2)
  end
  expect(tostring(bdf(3))):equals "bdf(3): 3 steps, order 3, implicit\n\n11/6·xₖ₊₁ - 3·xₖ + 3/2·xₖ₋₁ - 1/3·xₖ₋₂ = Δt fₖ₊₁"
  expect(function() bdf(7) end):fails "not zero-stable"
  expect(function() bdf(0) end):fails "between 1 and 6"
  expect(function() multistep { alpha = { 1, -1 }, beta = { 0, 2 } } end):fails "not consistent"
  local ab2 = multistep { alpha = { 1, -1, 0 }, beta = { 0, "3/2", "-1/2" } }
  expect(ab2:stability().real):near(-1, 1e-12)
  expect(multistep { alpha = { 1, -3, 2 }, beta = { 0, "1/2", "-3/2" } }:is "zero-stable"):is_false()
end)

test("Rosenbrock methods: orders, L-stability", function()
  for name, facts in pairs { ros2 = { 2, 2 }, ros3p = { 3, 3 }, rodas3 = { 3, 3 }, rodas4 = { 4, 4 },
    rodas4p = { 4, 4 }, rodas5p = { 5, 4 } } do
    local m = rosenbrock[name]
    expect(m:order()):equals(facts[1])
    expect(m:dae_order()):equals(facts[2])
    expect(m:stability().A_stable):is_true()
    expect(m:stability().L_stable):equals(name ~= "ros3p")
  end
  expect(rosenbrock.rodas4:dense_order()):equals(3)
  expect(rosenbrock.rodas5p:dense_order()):equals(4)
  expect(function() rosenbrock { gamma = "1/2", A = { {} }, C = { {} },
    m = { 1 } } end):fails "do not sum to 1"
  expect(function() rosenbrock { gamma = "1/2", A = { {} }, C = { {} }, m = { 2 },
    order = 3 } end):fails "order conditions give 2"
end)

test("order conditions: counts of trees, residuals of a method that misses them", function()
  local counts = { 1, 2, 4, 8, 17, 37, 85, 200, 486 }
  for p, count in ipairs(counts) do expect(#rk.euler:conditions(p)):equals(count) end
  local c = rk.rk4:conditions(5)
  local missed = 0
  for i = 1, #c do
    expect(c[i].met):equals(c[i].order <= 4)
    if c[i].formula == "bᵀc⁴" then expect(c[i].residual):equals(1 / 120) end
    missed = missed + (c[i].met and 0 or 1)
  end
  expect(missed):equals(9)
  expect(#rk.dopri5:conditions(5, { embedded = true })):equals(17)
  expect(function() rk.rk4:conditions(13) end):fails "between 1 and 12"
  expect(function() rk.rk4:conditions(3, { embedded = true }) end):fails "no embedded method"
end)

test("orthogonality and Lagrange polynomials", function()
  expect(rk.collocation { 0, 1 }:orthogonality()[1]):equals(-1 / 6)
  local gauss, radau = rk.gauss(3):orthogonality(4), rk.radau(3):orthogonality(4)
  for k = 1, 4 do
    expect(evaluate(gauss[k]) == 0):equals(k <= 3)
    expect(evaluate(radau[k]) == 0):equals(k <= 2)
  end
  local tab = rk.lobatto("IIIA", 4)
  local basis = tab:lagrange()
  for i = 1, 4 do
    for j = 1, 4 do
      expect(evaluate(basis.ell[j], { tau = tab.c[i] })):near(i == j and 1 or 0, 1e-14)
      expect(evaluate(basis.L[j], { tau = tab.c[i] })):near(evaluate(tab.A(i, j)), 1e-14)
    end
  end
  expect(function() rk.rk4:lagrange() end):fails "are equal"
end)

test("dense output has its order between the mesh points", function()
  local tau = 0.37
  for name, order in pairs { dopri5 = 4, tsit5 = 4, dop853 = 7 } do
    expect(rk[name]:dense_order()):equals(order)
    local dense, sum = rk[name].dense, 0
    for i = 1, dense.b.rows do
      for k = 1, dense.b.cols do sum = sum + evaluate(dense.b[i][k]) * tau^k end
    end
    expect(sum):near(tau, 1e-12)                           -- Σ bᵢ(θ) = θ
  end
  expect(function()
    tableau { A = { {}, { 1 } }, b = { "1/2", "1/2" },
      dense = { order = 2, b = { { 1, "-1/2" }, { 0, "1/3" } } } }
  end):fails "dense output of order 2 is claimed"
end)

test("orders to expect on DAEs (Hairer & Wanner II, Table VII.4.1)", function()
  for s = 2, 5 do
    local facts = { { rk.radau(s), 2 * s - 1, s }, { rk.radau_ia(s), s, s - 1 },
      { rk.lobatto("IIIC", s), 2 * s - 2, s - 1 },
                    { rk.gauss(s), s % 2 == 1 and s + 1 or s, s % 2 == 1 and s - 1 or s - 2 },
                    { rk.lobatto("IIIA", s), 2 * s - 2, s % 2 == 1 and s - 1 or s } }
    for _, fact in ipairs(facts) do
      local o = fact[1]:dae_orders()
      expect(o.x2):equals(fact[2])
      expect(o.z2):equals(fact[3])
    end
  end
  expect(rk.rk4:dae_orders().x2):equals(-1)
end)

test("verify() agrees with the coefficients for every method", function()
  for _, tab in ipairs { rk.radau(2), rk.radau(3), rk.lobatto("IIIC", 3), rk.gauss(2), rk.rk4, rk.tsit5,
    rk.tr_bdf2, rk.sdirk4 } do
    local v = tab:verify()
    if not v.ok then error(tostring(v)) end
  end
  local function measured(v, problem, quantity)
    for _, row in ipairs(v.rows) do
      if row.problem == problem and row.quantity == quantity then return row.measured end
    end
  end
  -- Jay's problem: the published orders, two-sided.
  for name, facts in pairs { r2 = { rk.radau(2), 3, 2 }, r3 = { rk.radau(3), 5, 3 },
    l3 = { rk.lobatto("IIIC", 3), 4, 2 } } do
    local v = facts[1]:verify()
    expect(measured(v, "index 2", "y")):near(facts[2], 0.3 / facts[2])
    expect(measured(v, "index 2", "z")):near(facts[3], 0.1 / facts[3])
  end
end)

test("symplectic methods keep quadratic invariants, others do not", function()
  -- The rigid body: x′ = (1/I₃ - 1/I₂) y z …, two quadratic invariants.
  local body = dae { der(x) ~ -0.5 * y * z, der(y) ~ x * z, der(z) ~ -0.25 * x * y }
  local function change(tab)
    local sol = body:integrate { start = { x = 1, y = 0.5, z = 0.8 }, to = 5, method = tab, dt = 0.25 }
    local invariant = x^2 + y^2 + 2 * z^2                  -- derivative -x y z + 2 x y z - x y z = 0
    return math.abs(sol(invariant, 5) - (1 + 0.25 + 2 * 0.64))
  end
  local list = { table.unpack(families) }
  for _, tab in ipairs(registered) do list[#list + 1] = tab end
  for _, tab in ipairs(list) do
    if tab:is "symplectic" then
      if change(tab) > 1e-12 then error(tab.name .. " is symplectic but changes the invariant by "
        .. change(tab)) end
    -- whose stages coincide: the implicit midpoint rule
    elseif tab:order() <= 2 and tab.name ~= "lobatto(IIIB, 2)" then
      if change(tab) < 1e-8 then error(tab.name .. " is not symplectic but keeps the invariant") end
    end
  end
end)

test("symmetric methods undo a step by a step backwards", function()
  local forth = dae { der(x) ~ x * y, der(y) ~ -x - y^2 / 2 }
  local back = dae { der(x) ~ -x * y, der(y) ~ x + y^2 / 2 }
  for _, tab in ipairs(families) do
    local one = forth:integrate { start = { x = 1, y = 0.5 }, to = 0.5, method = tab, dt = 0.5 }
    local two = back:integrate { start = { x = one:final(x), y = one:final(y) }, to = 0.5, method = tab,
      dt = 0.5 }
    local gap = math.abs(two:final(x) - 1) + math.abs(two:final(y) - 0.5)
    if tab:is "symmetric" ~= (gap < 1e-13) then error(("%s: symmetric %s, gap %.3g"):format(tab.name,
      tab:is "symmetric", gap)) end
  end
end)

test("tableaus that contradict themselves are refused with the reason", function()
  expect(function() tableau { A = { {}, { "1/2" } }, b = { 0, "1/2" } } end):fails "b sums to 1/2, not 1"
  expect(function() tableau { A = { {}, { "1/2" } }, b = { 0, 1 },
    c = { 0, "1/3" } } end):fails "row 2 of A sums to 1/2, but c[2] = 1/3"
  expect(function() tableau { A = { { "1/4", "1/4" }, { "1/2" } },
    b = { "1/2", "1/2" } } end):fails "rows may stop early only"
  expect(function() tableau { A = { {}, { 1, 2, 3 } }, b = { 0, 1 } } end):fails "row 2 of A"
  expect(function() tableau { A = { {}, { "half" } }, b = { 0, 1 } } end):fails "is not a number"
  expect(function() tableau { A = { {}, { "1/2" } }, b = { 0, 1 },
    order = 3 } end):fails "order conditions give 2"
  expect(function() tableau { A = { {}, { 1 / 0 } }, b = { 0, 1 } } end):fails "finite"
  expect(function() rk.lobatto("IIIF", 3) end):fails "unknown kind 'IIIF'"
  expect(function() rk.lobatto("IIIC", 1) end):fails "between 2 and"
  expect(function() rk.radau_ia(0) end):fails "between 1 and"
  expect(function() rk.collocation { "1/2", "1/2" } end):fails "are equal"
  expect(function() return rk.dorpi5 end):fails "Did you mean 'dopri5'"
  expect(function() return rosenbrock.rodas6 end):fails "rosenbrock"
end)

test("every method has a report and a picture", function()
  for _, tab in ipairs(registered) do
    expect(#tab:report() > 200):is_true()
    tab:plot()
  end
  for k = 1, 6 do expect(bdf(k):report():find("zero%-stability   yes") ~= nil):is_true() end
  bdf(4):plot()
  expect(#rosenbrock.rodas4:report() > 200):is_true()
  expect(rk.stages_for_order().rows[7][2]):equals "7"
end)

test("coefficients beyond the range of doubles are refused", function()
  expect(function() return rk.collocation { 1e-160, 2e-160, 3e-160 } end):fails "beyond the range of doubles"
  -- Weights of 1e250 and more; an infinity in GMP's numbers ends the program.
  for _, nodes in ipairs { { 1e-200, 1e-150, 1e-100 }, { 1e-300, 2e-300 }, { 5e-324, 1e-300, 1 } } do
    local made, tableau = pcall(rk.collocation, nodes)
    local text = tostring(made and tableau:stability() or tableau)
    expect(made or text:find "range" ~= nil):is_true()
  end
  expect(#tostring(rk.collocation { 1e-300, 1/3 }:stability()) > 0):is_true()
end)

test("a tableau can be read as it is printed", function()
  local rules = { rk.gauss(2), rk.gauss(3), rk.kutta38, rk.lobatto("IIIC", 3), rk.dopri5, rk.sdirk2 }
  for _, rule in ipairs(rules) do
    local read = tableau(tostring(rule))
    expect(read.A == rule.A and read.b == rule.b and read.c == rule.c):is_true()
    expect(read:order()):equals(rule:order())
  end
  local gauss = "1/2 - √3/6 | 1/4 1/4-2√3/12 \n 1/2+√(3)/6 | 1/4 + sqrt(3)/6 1/4 \n | 1/2 1/2"
  expect(tableau(gauss):order()):equals(4)
  expect(function() tableau "0 |\n 1/2 | 1/2 -\n | 0 1" end):fails "line 2: '1/2-' is not a number"
  expect(function() tableau "0 |\n 1/2 | 1/2\n | 0 √" end):fails "line 3"
end)

-- The error constant of order 79 is 10⁻¹¹⁸, below every tolerance: the search for the order had no end.
test("stability functions of many stages: order of the Padé approximant", function()
  for _, s in ipairs { 30, 38, 40 } do
    local radau, gauss = rk.radau(s):stability(), rk.gauss(s):stability()
    expect(radau.order):equals(2*s - 1)
    expect(gauss.order):equals(2*s)
    expect(radau.A_stable and gauss.A_stable):is_true()
  end
end)
