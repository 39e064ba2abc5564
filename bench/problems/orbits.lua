-- Celestial mechanics and other equations that are not stiff.
local list = {}
local function add(problem) list[#list + 1] = problem end

add {
  name = "Kepler, e = 0.9", to = 60, start = { x = 0.1, y = 0, u = 0, v = math.sqrt(19) },
  source = "Hairer, Lubich & Wanner, Geometric Numerical Integration, 2nd ed., §I.2",
  model = function()
    local x, y, u, v = vars "x y u v"
    local r3 = (x^2 + y^2)^(3/2)
    return dae { der(x) ~ u, der(y) ~ v, der(u) ~ -x/r3, der(v) ~ -y/r3 }
  end,
  count = { "x", "y", "u", "v" },
}

add {
  name = "Arenstorf orbit", to = 17.0652165601579625588917206249,
  start = { x = 0.994, y = 0, u = 0, v = -2.00158510637908252240537862224 },
  source = "Hairer, Nørsett & Wanner, Solving ODEs I, 2nd ed., §II.0",
  model = function()
    local x, y, u, v = vars "x y u v"
    local mu = 0.012277471
    local D1, D2 = ((x + mu)^2 + y^2)^(3/2), ((x - (1 - mu))^2 + y^2)^(3/2)
    return dae { der(x) ~ u, der(y) ~ v,
      der(u) ~ x + 2*v - (1 - mu)*(x + mu)/D1 - mu*(x - (1 - mu))/D2,
      der(v) ~ y - 2*u - (1 - mu)*y/D1 - mu*y/D2 }
  end,
  count = { "x" },
}

--- Bodies in a plane under their attraction.
local function bodies(name, to, source, mass, x0, y0, u0, v0)
  local N = #mass
  add {
    name = name, to = to, source = source,
    model = function(problem)
      local x, y, u, v = var("x", N), var("y", N), var("u", N), var("v", N)
      problem.start = { [x] = x0, [y] = y0, [u] = u0, [v] = v0 }
      local equations = {}
      for i = 1, N do
        local fx, fy = 0, 0
        for j = 1, N do
          if j ~= i then
            local dx, dy = x[j] - x[i], y[j] - y[i]
            local r3 = (dx^2 + dy^2)^(3/2)
            fx, fy = fx + mass[j]*dx/r3, fy + mass[j]*dy/r3
          end
        end
        for _, e in ipairs { der(x[i]) ~ u[i], der(y[i]) ~ v[i], der(u[i]) ~ fx, der(v[i]) ~ fy } do
          equations[#equations + 1] = e
        end
      end
      return dae(equations)
    end,
    count = { "x1", "y1", "u1", "x" .. N, "y" .. N },
  }
end

bodies("three bodies, 3-4-5", 10, "Szebehely & Peters, Astron. J. 72, 1967", { 3, 4, 5 },
  { 1, -2, 1 }, { 3, -1, -1 }, { 0, 0, 0 }, { 0, 0, 0 })
bodies("Pleiades", 3, "Hairer, Nørsett & Wanner, Solving ODEs I, 2nd ed., §II.10", { 1, 2, 3, 4, 5, 6, 7 },
  { 3, 3, -1, -3, 2, -2, 2 }, { 3, -3, 2, 0, 0, -4, 4 },
  { 0, 0, 0, 0, 0, 1.75, -1.5 }, { 0, 0, 0, -1.25, 1, 0, 0 })

add {
  name = "double pendulum", to = 5, start = { a = 2, b = 2.5, p = 0, q = 0 },
  source = "two unit masses on unit links, angles from the vertical",
  model = function()
    local a, b, p, q = vars "a b p q"
    local d = a - b
    local D = 2 - cos(d)^2
    return dae { der(a) ~ p, der(b) ~ q,
      der(p) ~ (-2*9.81*sin(a) + 9.81*cos(d)*sin(b) - sin(d)*(q^2 + p^2*cos(d)))/D,
      der(q) ~ (2*9.81*(sin(a)*cos(d) - sin(b)) + sin(d)*(2*p^2 + q^2*cos(d)))/D }
  end,
  count = { "a", "b", "p", "q" },
}

add {
  name = "Lorenz", to = 10, start = { x = -8, y = 8, z = 27 },
  source = "Lorenz, J. Atmos. Sci. 20, 1963",
  model = function()
    local x, y, z = vars "x y z"
    return dae { der(x) ~ 10*(y - x), der(y) ~ x*(28 - z) - y, der(z) ~ x*y - 8/3*z }
  end,
  count = { "x", "y", "z" },
}

return list
