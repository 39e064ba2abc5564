-- DETEST: the 25 nonstiff problems of Hull, Enright, Fellen & Sedgwick, SIAM J. Numer. Anal. 9, 1972, classes
-- A to E, from t = 0 to 20. The reference is exact where the paper has a formula, else the mean of two
-- methods that agree to 5e-10 (verner98 and radau, rtol = 1e-13). Each of the 10 to 100 steps adds an error
-- of the size of the tolerance, and what is there at a time is amplified by the flow up to the end: 100
-- tolerances times ‖∂y(20)/∂y(0)‖∞ are allowed, which the sensitivities give (1 for A1, 3942 for D5); bdf
-- takes up to 1000 steps and is allowed twice as much.
local y = var("y", 4)
local function list(n, f) local out = {}; for i = 1, n do out[i] = f(i) end; return out end
local function chain(n, first, last, inner)                   -- problems with n equations of one kind
  local q = var("q", n)
  return q, list(n, function(i)
    return der(q[i]) ~ (i == 1 and first(q) or i == n and last(q) or inner(q, i))
  end)
end
local function orbit(eccentricity)
  local r3 = (y[1]^2 + y[2]^2)^(3/2)
  return { der(y[1]) ~ y[3], der(y[2]) ~ y[4], der(y[3]) ~ -y[1]/r3, der(y[4]) ~ -y[2]/r3 },
    { 1 - eccentricity, 0, 0, sqrt((1 + eccentricity)/(1 - eccentricity)) }
end
local function outer_planets()
  local k2, m0, m = 2.95912208286, 1.00000597682, { .954786104043e-3, .285583733151e-3, .437273164546e-4,
    .517759138449e-4, .277777777778e-5 }
  local p, v = var("p", 15), var("w", 15)
  local start = { 3.42947415189, 3.35386959711, 1.35494901715, 6.64145542550, 5.97156957878, 2.18231499728,
    11.2630437207,
    14.6952576794, 6.27960525067, -30.1552268759, 1.65699966404, 1.43785752721, -21.1238353380, 28.4465098142,
      15.3882659679 }
  local speed = { -.557160570446, .505696783289, .230578543901, -.415570776342, .365682722812, .169143213293,
    -.325325669158,
    .189706021964, .0877265322780, -.0240476254170, -.287659532608, -.117219543175, -.176860753121,
      -.216393453025, -.0148647893090 }
  local at = list(5, function(j) return p:slice(3*j - 2, 3*j) end)
  local r3 = list(5, function(j) return norm(at[j])^3 end)
  local equations = { der(p) ~ v }
  for j = 1, 5 do
    local pull = -(m0 + m[j])*at[j]/r3[j]
    for k = 1, 5 do
      if k ~= j then pull = pull + m[k]*((at[k] - at[j])/norm(at[k] - at[j])^3 - at[k]/r3[k]) end
    end
    equations[#equations + 1] = der(v:slice(3*j - 2, 3*j)) ~ k2*pull
  end
  return vstack(p, v), equations, list(30, function(i) return i <= 15 and start[i] or speed[i - 15] end)
end

local function scalar(f, start, exact) return { y:slice(1, 1), { der(y[1]) ~ f }, { start },
  exact and { exact } } end
local problems = {
  A1 = scalar(-y[1], 1, math.exp(-20)),
  A2 = scalar(-y[1]^3/2, 1, 1/math.sqrt(21)),
  A3 = scalar(y[1]*cos(t), 1, math.exp(math.sin(20))),
  A4 = scalar(y[1]/4*(1 - y[1]/20), 1, 20/(1 + 19*math.exp(-5))),
  A5 = scalar((y[1] - t)/(y[1] + t), 4),
  B1 = { y:slice(1, 2), { der(y[1]) ~ 2*(y[1] - y[1]*y[2]), der(y[2]) ~ -(y[2] - y[1]*y[2]) }, { 1, 3 } },
  B2 = { y:slice(1, 3), { der(y[1]) ~ y[2] - y[1], der(y[2]) ~ y[1] - 2*y[2] + y[3],
    der(y[3]) ~ y[2] - y[3] }, { 2, 0, 1 },
    { 1 + math.exp(-60)/2 + math.exp(-20)/2, 1 - math.exp(-60), 1 + math.exp(-60)/2 - math.exp(-20)/2 } },
  B3 = { y:slice(1, 3), { der(y[1]) ~ -y[1], der(y[2]) ~ y[1] - y[2]^2, der(y[3]) ~ y[2]^2 }, { 1, 0, 0 } },
  B4 = { y:slice(1, 3), { der(y[1]) ~ -y[2] - y[1]*y[3]/norm(y:slice(1, 2)),
    der(y[2]) ~ y[1] - y[2]*y[3]/norm(y:slice(1, 2)),
    der(y[3]) ~ y[1]/norm(y:slice(1, 2)) }, { 3, 0, 0 } },
  B5 = { y:slice(1, 3), { der(y[1]) ~ y[2]*y[3], der(y[2]) ~ -y[1]*y[3], der(y[3]) ~ -.51*y[1]*y[2] },
    { 0, 1, 1 } },
  E1 = { y:slice(1, 2), { der(y[1]) ~ y[2], der(y[2]) ~ -(y[2]/(t + 1) + (1 - 0.25/(t + 1)^2)*y[1]) },
    { .6713967071418030, .09540051444747446 } },
  E2 = { y:slice(1, 2), { der(y[1]) ~ y[2], der(y[2]) ~ (1 - y[1]^2)*y[2] - y[1] }, { 2, 0 } },
  E3 = { y:slice(1, 2), { der(y[1]) ~ y[2], der(y[2]) ~ y[1]^3/6 - y[1] + 2*sin(2.78535*t) }, { 0, 0 } },
  E4 = { y:slice(1, 2), { der(y[1]) ~ y[2], der(y[2]) ~ .032 - .4*y[2]^2 }, { 30, 0 } },
  E5 = { y:slice(1, 2), { der(y[1]) ~ y[2], der(y[2]) ~ sqrt(1 + y[2]^2)/(25 - t) }, { 0, 0 } },
}
for i, e in ipairs { .1, .3, .5, .7, .9 } do
  local equations, start = orbit(e)
  problems["D" .. i] = { y, equations, start }
end
local function unit(n) return list(n, function(i) return i == 1 and 1 or 0 end) end
local c1, c1_equations = chain(10, function(q) return -q[1] end, function(q) return q[9] end, function(q, i)
  return q[i-1] - q[i] end)
problems.C1 = { c1, c1_equations, unit(10) }
local c2, c2_equations = chain(10, function(q) return -q[1] end, function(q) return 9*q[9] end, function(q, i)
  return (i-1)*q[i-1] - i*q[i] end)
problems.C2 = { c2, c2_equations, unit(10) }
for name, n in pairs { C3 = 10, C4 = 51 } do
  local q, equations = chain(n, function(q) return -2*q[1] + q[2] end, function(q) return q[n-1] - 2*q[n] end,
    function(q, i) return q[i-1] - 2*q[i] + q[i+1] end)
  problems[name] = { q, equations, unit(n) }
end
problems.C5 = { outer_planets() }

local names = {}
for name in pairs(problems) do names[#names + 1] = name end
table.sort(names)
expect(#names):equals(25)

local tested = {}                                              -- those for tight tolerances
for _, method in ipairs(methods()) do
  if (method.order or 5) >= (method.explicit and 5 or 4) then tested[#tested + 1] = method.name end
end
local function run(p, method, tol)
  return dae(p[2]):integrate { start = { [p[1]] = p[3] }, to = 20, method = method, rtol = tol, atol = tol }
end

for _, name in ipairs(names) do
  local p = problems[name]
  test("DETEST " .. name .. ": the tolerance is met", function()
    local reference = p[4]
    if not reference then
      local one, other = run(p, "verner98", 1e-13):final(), run(p, "radau", 1e-13):final()
      expect(one):near(other, 5e-10)
      reference = one
    end
    local flow = dae(p[2]):integrate { start = { [p[1]] = p[3] }, to = 20, sensitivities = { p[1] },
      rtol = 1e-6 }
    local columns = list(#p[1], function(j) return flow:sensitivity(p[1], p[1][j], 20) end)
    local amplification = 1
    for i = 1, #p[1] do
      local sum = 0
      for j = 1, #p[1] do sum = sum + math.abs(columns[j][i]) end
      amplification = math.max(amplification, sum)
    end
    for _, method in ipairs(tested) do
      for _, tol in ipairs { 1e-3, 1e-6, 1e-9 } do
        local sol = run(p, method, tol)
        expect(sol.status):equals "finished"
        local final = sol:final()
        local limit = (method == "bdf" and 200 or 100)*amplification*tol
        for i = 1, #reference do
          expect(math.abs(final[i] - reference[i]) <= limit*math.max(1, math.abs(reference[i]))):is_true()
        end
      end
    end
  end)
end
