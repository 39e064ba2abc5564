-- The problems of bench/hairer.py by Pendula: best times and end values, or reference values.
--     pendula bench/hairer.lua reference NAME
--     pendula bench/hairer.lua run NAME METHOD RTOL REPEATS        METHOD: default, or a name
local here = arg[0]:match "(.*/)" or "./"
local problems = assert(loadfile(here .. "problems.lua"))(here)
local what, name, method, rtol, repeats = arg[1], arg[2], arg[3], tonumber(arg[4]), tonumber(arg[5])

--- Charges on the unit sphere that repel each other, with friction.
local function particles(N)
  local problem = { name = "particles", to = 5 }
  function problem.model()
    local p, v, lam = {}, {}, var("lam", N)
    local xs, us = { var("x", N), var("y", N), var("z", N) }, { var("u", N), var("v", N), var("w", N) }
    local x0 = { {}, {}, {}, {}, {}, {} }
    for i = 1, N do
      p[i], v[i] = vec { xs[1][i], xs[2][i], xs[3][i] }, vec { us[1][i], us[2][i], us[3][i] }
      local z, phi = 1 - (2*i - 1)/N, (i - 1)*math.pi*(3 - math.sqrt(5))
      local r = math.sqrt(1 - z^2)
      local x, y = r*math.cos(phi), r*math.sin(phi)
      local w = (1 + z)/2
      for k, value in ipairs { x, y, z, -w*y, w*x, 0 } do x0[k][i] = value end
    end
    local equations = {}
    for i = 1, N do
      local g = -v[i]/2 - lam[i]*p[i]
      for j = 1, N do
        if j ~= i then
          local d = p[i] - p[j]
          g = g + d/(d.T*d)^(3/2)
        end
      end
      equations[#equations + 1] = der(p[i]) ~ v[i]
      equations[#equations + 1] = der(v[i]) ~ g
      equations[#equations + 1] = 0 ~ p[i].T*p[i] - 1
    end
    problem.start = { [xs[1]] = x0[1], [xs[2]] = x0[2], [xs[3]] = x0[3], [us[1]] = x0[4], [us[2]] = x0[5],
      [us[3]] = x0[6] }
    return dae(equations)
  end
  problem.count = { "x1", "y1", "z" .. N }
  return problem
end
problems[#problems + 1] = particles(20)

do                                                      -- Andrews' squeezer
  local library = _G.problems.squeezer
  local problem = { name = "squeezer", to = library.to, count = {} }
  problem.reference = {}
  for leaf, value in pairs(library.reference) do
    problem.count[#problem.count + 1] = tostring(leaf)
    problem.reference[tostring(leaf)] = value
  end
  function problem.model()
    problem.start = library:start()
    return library.model
  end
  problems[#problems + 1] = problem
end

for _, problem in ipairs(problems) do
  if problem.name == name then
    if what == "reference" then
      for leaf, value in pairs(problem.reference or {}) do print(leaf, string.format("%.17g", value)) end
      return
    end
    local model = problem.model(problem)
    if model:index() > 1 then model = model:reduce() end
    local known, start = pcall(model.init, model, { fix = problem.start })  -- else it is a start already
    if not known then start = problem.start end
    local least, sol = math.huge, nil
    for _ = 1, repeats do
      sol = model:integrate { start = start, to = problem.to, rtol = rtol, times = { problem.to },
        atol = problem.atol and problem.atol(rtol) or rtol, method = method ~= "default" and method or nil }
      least = math.min(least, sol:stats().time)
    end
    print("seconds", string.format("%.9g", least))
    print("method", sol:stats().method)
    for _, leaf in ipairs(problem.count) do print(leaf, string.format("%.17g", sol:final(leaf))) end
  end
end
