-- The problems of bench/dae.lua. Equations, starts and reference values: docs/benchmarks.md; fields:
--   name, to, start      as given to integrate
--   model(problem)       what we are given: the model as one writes it, of any index
--   ours(model)          the form we integrate; without it model:reduce() where the index is above 1
--   peer(model)          the form IDA integrates (it takes index 0 and 1)
--   reference            end values of the components that count
--   atol(rtol)           where atol = rtol would be unfair
--   ida                  options for IDA
--   slow                 runs only when its name is given: ./dev bench dae "10^5"
--   tolerances           those that are tried, instead of 10^(-k/2); for large models
--   source               where it is from
--   count                names of the components that count; their values: bench/problems/references.lua
--   breaks, stiff, precision   for bench/reference.lua: where the equations are not smooth, what method,
--                        which tolerance
-- More of them, by subject: bench/problems/*.lua.
local list = {}
local folder = (...) or arg[0]:match "(.*/)" or "./"

local function add(problem) list[#list + 1] = problem end

add {
  name = "pendulum, index 3", to = 10, start = { x = 1, y = 0, u = 0, v = 0 },
  model = function()
    local x, y, u, v, lam = vars "x y u v lam"
    local g = param("g", 9.81)
    return dae { der(x) ~ u, der(y) ~ v, der(u) ~ -lam*x, der(v) ~ -lam*y - g, 0 ~ (x^2 + y^2 - 1)/2 }
  end,
  peer = function(model) return model:reduce "acc" end,
  -- closed form: cd(√g t | 1/2), 30 digits
  reference = { x = 0.275087462576115, y = -0.961419205099125, u = -4.17559810095173, v = -1.19474905456048 },
}

add {
  name = "car axis, index 3", to = 3,
  start = { xl = 0, yl = 1/2, xr = 1, yr = 1/2, ul = -1/2, vl = 0, ur = -1/2, vr = 0 },
  model = function()
    local xl, yl, xr, yr, ul, vl, ur, vr, lam1, lam2 = vars "xl yl xr yr ul vl ur vr lam1 lam2"
    local k, L, L0, r, w, g = 5e-4, 1, 1/2, 0.1, 10, 1
    local yb = r*sin(w*t)
    local xb = sqrt(L^2 - yb^2)
    local Ll, Lr = sqrt(xl^2 + yl^2), sqrt((xr - xb)^2 + (yr - yb)^2)
    return dae {
      der(xl) ~ ul, der(yl) ~ vl, der(xr) ~ ur, der(yr) ~ vr,
      k*der(ul) ~ (L0 - Ll)*xl/Ll + lam1*xb + 2*lam2*(xl - xr),
      k*der(vl) ~ (L0 - Ll)*yl/Ll + lam1*yb + 2*lam2*(yl - yr) - k*g,
      k*der(ur) ~ (L0 - Lr)*(xr - xb)/Lr - 2*lam2*(xl - xr),
      k*der(vr) ~ (L0 - Lr)*(yr - yb)/Lr - 2*lam2*(yl - yr) - k*g,
      0 ~ xb*xl + yb*yl, 0 ~ (xl - xr)^2 + (yl - yr)^2 - L^2 }
  end,
  peer = function(model) return model:reduce "acc" end,
  reference = { xl = 0.0493455784275242, yl = 0.496989460230008, xr = 1.04174252488543,
    yr = 0.373911027265366,
    ul = -0.077058368403592, vl = 0.00744686659206841, ur = 0.0175568157535418, vr = 0.7703410437796 },
}

add {
  name = "chemical Akzo Nobel", to = 180,
  start = { y1 = 0.444, y2 = 0.00123, y3 = 0, y4 = 0.007, y5 = 0 },
  model = function()
    local y1, y2, y3, y4, y5, y6 = vars "y1 y2 y3 y4 y5 y6"
    local k1, k2, k3, k4, K, klA, p, Ks, H = 18.7, 0.58, 0.09, 0.42, 34.4, 3.3, 0.9, 115.83, 737
    local r1, r2, r3 = k1*y1^4*sqrt(y2), k2*y3*y4, k2/K*y1*y5
    local r4, r5, Fin = k3*y1*y4^2, k4*y6^2*sqrt(y2), klA*(p/H - y2)
    return dae { der(y1) ~ -2*r1 + r2 - r3 - r4, der(y2) ~ -r1/2 - r4 - r5/2 + Fin, der(y3) ~ r1 - r2 + r3,
      der(y4) ~ -r2 + r3 - 2*r4, der(y5) ~ r2 - r3 + r5, 0 ~ Ks*y1*y4 - y6 }
  end,
  reference = { y1 = 0.1150794920661702, y2 = 0.1203831471567715e-2, y3 = 0.1611562887407974,
    y4 = 0.3656156421249283e-3, y5 = 0.1708010885264404e-1, y6 = 0.4873531310307455e-2 },
  atol = function(rtol) return rtol/100 end,
}

add {
  name = "transistor amplifier", to = 0.2,
  start = { y1 = 0, y2 = 3, y3 = 3, y4 = 6, y5 = 3, y6 = 3, y7 = 6, y8 = 0 },
  model = function()
    local y1, y2, y3, y4, y5, y6, y7, y8 = vars "y1 y2 y3 y4 y5 y6 y7 y8"
    local Ub, Uf, al, be, R0, R = 6, 0.026, 0.99, 1e-6, 1000, 9000
    local C1, C2, C3, C4, C5 = 1e-6, 2e-6, 3e-6, 4e-6, 5e-6
    local function g(x) return be*(exp(x/Uf) - 1) end
    local Ue = sin(200*pi*t)/10
    return dae {
      -C1*der(y1) + C1*der(y2) ~ (y1 - Ue)/R0,
      C1*der(y1) - C1*der(y2) ~ y2/R + (y2 - Ub)/R + (1 - al)*g(y2 - y3),
      -C2*der(y3) ~ y3/R - g(y2 - y3),
      -C3*der(y4) + C3*der(y5) ~ (y4 - Ub)/R + al*g(y2 - y3),
      C3*der(y4) - C3*der(y5) ~ y5/R + (y5 - Ub)/R + (1 - al)*g(y5 - y6),
      -C4*der(y6) ~ y6/R - g(y5 - y6),
      -C5*der(y7) + C5*der(y8) ~ (y7 - Ub)/R + al*g(y5 - y6),
      C5*der(y7) - C5*der(y8) ~ y8/R }
  end,
  reference = { y1 = -0.5562145012262709e-2, y2 = 0.3006522471903042e1, y3 = 0.2849958788608128e1,
    y4 = 0.2926422536206241e1, y5 = 0.2704617865010554e1, y6 = 0.2761837778393145e1,
      y7 = 0.4770927631616772e1,
    y8 = 0.1236995868091548e1 },
  ida = { coefficient = 0.1 },
}

add {
  name = "HIRES", to = 321.8122,
  start = { y1 = 1, y2 = 0, y3 = 0, y4 = 0, y5 = 0, y6 = 0, y7 = 0, y8 = 0.0057 },
  model = function()
    local y1, y2, y3, y4, y5, y6, y7, y8 = vars "y1 y2 y3 y4 y5 y6 y7 y8"
    local r = 280*y6*y8
    return dae { der(y1) ~ -1.71*y1 + .43*y2 + 8.32*y3 + .0007, der(y2) ~ 1.71*y1 - 8.75*y2,
      der(y3) ~ -10.03*y3 + .43*y4 + .035*y5, der(y4) ~ 8.32*y2 + 1.71*y3 - 1.12*y4,
      der(y5) ~ -1.745*y5 + .43*(y6 + y7), der(y6) ~ -r + .69*y4 + 1.71*y5 - .43*y6 + .69*y7,
      der(y7) ~ r - 1.81*y7, der(y8) ~ -r + 1.81*y7 }
  end,
  reference = { y1 = .7371312573325668e-3, y2 = .1442485726316185e-3, y3 = .5888729740967575e-4,
    y4 = .1175651343283149e-2, y5 = .2386356198831331e-2, y6 = .6238968252742796e-2,
      y7 = .2849998395185769e-2,
    y8 = .2850001604814231e-2 },
  atol = function(rtol) return rtol*1e-4 end,
}

add {
  name = "Robertson DAE, t = 4e7", to = 4e7, start = { y1 = 1, y2 = 0, y3 = 0 },
  model = function()
    local y1, y2, y3 = vars "y1 y2 y3"
    return dae { der(y1) ~ -0.04*y1 + 1e4*y2*y3, der(y2) ~ 0.04*y1 - 1e4*y2*y3 - 3e7*y2^2,
      0 ~ y1 + y2 + y3 - 1 }
  end,
  reference = { y1 = 5.2030718441205470e-5, y2 = 2.0813357318925326e-10, y3 = 0.99994796907342522 },
  atol = function(rtol) return rtol*1e-8 end,
}

-- Large models. x1000 is the last entry of the column x.

--- Point masses on massless links, hung at the origin, falling from a straight line at 45°.
local chain
function chain(N, reference)
  local problem
  problem = {
    name = "chain of " .. N .. " links", to = 1, tolerances = { 1e-4, 1e-5, 1e-6, 1e-7 },
    model = function()
      local x, y, u, v, lam = var("x", N), var("y", N), var("u", N), var("v", N), var("lam", N)
      local g, l, m, s = 9.81, 1/N, 1/N, math.sqrt(1/2)
      local start = { [x] = {}, [y] = {}, [u] = {}, [v] = {} }
      for i = 1, N do start[x][i], start[y][i], start[u][i], start[v][i] = i*l*s, -i*l*s, 0, 0 end
      problem.start = start
      local equations = {}
      local function add(equation) equations[#equations + 1] = equation end
      local function dx(i) return i > 1 and x[i] - x[i - 1] or x[1] end
      local function dy(i) return i > 1 and y[i] - y[i - 1] or y[1] end
      for i = 1, N do
        local fx, fy = -lam[i]*dx(i), -lam[i]*dy(i)
        if i < N then fx, fy = fx + lam[i + 1]*dx(i + 1), fy + lam[i + 1]*dy(i + 1) end
        add(der(x[i]) ~ u[i])
        add(der(y[i]) ~ v[i])
        add(m*der(u[i]) ~ fx)
        add(m*der(v[i]) ~ fy - m*g)
        add(0 ~ (dx(i)^2 + dy(i)^2 - l^2)/2)
      end
      return dae(equations)
    end,
    peer = function(model) return model:reduce("baumgarte", { alpha = 10 }) end,
    sized = chain,
    ida = { sparse = true, flush = true },
    reference = reference,
  }
  return problem
end

-- N = 10: docs/benchmarks.md; N = 1000: dop853, dopri5 and tsit5 at rtol = 1e-10 agree to 11 digits.
add(chain(10, { x10 = -0.6794899319, y10 = -0.7271122386 }))
add(chain(1000, { x1000 = -0.65986826492, y1000 = -0.74702424348 }))

--- Resistors, diodes and capacitors, cell after cell; a sine of 2 V at one end. What is counted has forgotten
-- the
--- other end: radau, bdf and rodas4 at rtol = 1e-11 agree to 10 digits for N = 200.
local diodes
function diodes(N, name, ida, slow)
  local problem
  problem = {
    name = name, to = 1e-5, slow = slow, tolerances = N > 10000 and { 1e-5, 1e-6, 1e-7 }
      or { 1e-4, 1e-5, 1e-6, 1e-7 },
    model = function()
      local w, v = var("w", N), var("v", N)
      local zero = {}
      for k = 1, N do zero[k] = 0 end
      problem.start = { [v] = zero, [w] = zero }
      local R, C, Is, VT = 10, 1e-9, 1e-12, 0.02585
      local equations = {}
      for k = 1, N do
        local before = k > 1 and v[k - 1] or 2*sin(2*pi*1e5*t)
        local current = (w[k] - v[k])/R
        if k < N then current = current + (w[k + 1] - v[k])/R end
        equations[#equations + 1] = 0 ~ (before - w[k])/R + (v[k] - w[k])/R - Is*(exp(w[k]/VT) - 1)
        equations[#equations + 1] = C*der(v[k]) ~ current
      end
      return dae(equations)
    end,
    ida = ida, sized = diodes,
    reference = { v5 = -0.53731799736, w6 = -0.56385766819 },
  }
  return problem
end

add(diodes(1000, "diodes, 10^3 nodes", { sparse = true, flush = true }))
add(diodes(10000, "diodes, 10^4 nodes", { sparse = true, flush = true }))
add(diodes(100000, "diodes, 10^5 nodes", { sparse = true, flush = true }, true))
add(diodes(100000, "diodes, 10^5, as shipped", { sparse = true }, true))

local references = assert(loadfile(folder .. "problems/references.lua"))()
for _, subject in ipairs { "orbits", "chemistry", "circuits", "mechanisms", "lattices" } do
  for _, problem in ipairs(assert(loadfile(folder .. "problems/" .. subject .. ".lua"))()) do
    problem.reference = references[problem.name]
    add(problem)
  end
end

return list
