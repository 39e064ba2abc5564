-- Partial differential equations on lines of points and grids.
local list = {}
local function add(problem) list[#list + 1] = problem end

--- Two species on a line.
local function brusselator(N)
  return {
    name = "Brusselator, " .. N .. " points", to = 10,
    source = "Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.10",
    model = function(problem)
      local u, v = var("u", N), var("v", N)
      local equations, u0, v0, D = {}, {}, {}, (N + 1)^2/50
      for i = 1, N do
        local ul, ur = i > 1 and u[i - 1] or 1, i < N and u[i + 1] or 1
        local vl, vr = i > 1 and v[i - 1] or 3, i < N and v[i + 1] or 3
        equations[#equations + 1] = der(u[i]) ~ 1 + u[i]^2*v[i] - 4*u[i] + D*(ul - 2*u[i] + ur)
        equations[#equations + 1] = der(v[i]) ~ 3*u[i] - u[i]^2*v[i] + D*(vl - 2*v[i] + vr)
        u0[i], v0[i] = 1 + math.sin(2*math.pi*i/(N + 1)), 3
      end
      problem.start = { [u] = u0, [v] = v0 }
      return dae(equations)
    end,
    ida = { sparse = true }, sized = brusselator,
    stiff = true, count = { "u1", "v1", "u" .. N//2, "v" .. N//2 },
  }
end
add(brusselator(40))
add(brusselator(500))

local function burgers(N)
  return {
    name = "Burgers, " .. N .. " points", to = 2.5,
    source = "Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.10",
    model = function(problem)
      local u, mu = var("u", N), 0.0003
      local equations, u0 = {}, {}
      for i = 1, N do
        local l, r, x = i > 1 and u[i - 1] or 0, i < N and u[i + 1] or 0, i/(N + 1)
        equations[i] = der(u[i]) ~ -(r^2 - l^2)*(N + 1)/4 + mu*(N + 1)^2*(l - 2*u[i] + r)
        u0[i] = 1.5*x*(1 - x)^2
      end
      problem.start = { [u] = u0 }
      return dae(equations)
    end,
    ida = { sparse = true }, sized = burgers,
    stiff = true, count = { "u" .. N//10, "u" .. N//5 },
  }
end
add(burgers(500))

--- u_t = Δu + f with a source that moves.
local function heat2(N)
  return {
    name = "heat, " .. N .. " × " .. N, to = 0.5,
    source = "Sommeijer, Shampine & Verwer, J. Comput. Appl. Math. 88, 1998, §5, with a moving source",
    model = function(problem)
      local u = var("u", N*N)
      local equations, u0 = {}, {}
      local function at(i, j) return i >= 1 and i <= N and j >= 1 and j <= N and u[i + (j - 1)*N] or 0 end
      for j = 1, N do
        for i = 1, N do
          local k, x, y = i + (j - 1)*N, i/(N + 1), j/(N + 1)
          equations[k] = der(u[k]) ~ (N + 1)^2*(at(i - 1, j) + at(i + 1, j) + at(i, j - 1) + at(i, j + 1)
            - 4*u[k]) + 100*math.exp(-20*((x - 0.3)^2 + (y - 0.4)^2))*sin(10*t)
          u0[k] = 16*x*(1 - x)*y*(1 - y)*math.exp(x)
        end
      end
      problem.start = { [u] = u0 }
      return dae(equations)
    end,
    ida = { sparse = true }, sized = heat2,
    stiff = true, count = { "u" .. N//3 + N*(N//2), "u" .. N*N//2 + N//2 },
  }
end
add(heat2(20))
add(heat2(50))

--- Nagumo's threshold-nerve-impulse with van der Pol's equation in a ring: the cusp catastrophe.
add {
  name = "CUSP", to = 1.1,
  source = "Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.10",
  model = function(problem)
    local N = 32
    local y, a, b = var("y", N), var("a", N), var("b", N)
    local eps, D = 1e-4, N^2/144
    local equations, y0, a0, b0 = {}, {}, {}, {}
    for i = 1, N do
      local l, r = i > 1 and i - 1 or N, i < N and i + 1 or 1
      local u = (y[i] - 0.7)*(y[i] - 1.3)
      local v = u/(u + 0.1)
      equations[#equations + 1] = der(y[i]) ~ -(y[i]^3 + a[i]*y[i] + b[i])/eps + D*(y[l] - 2*y[i] + y[r])
      equations[#equations + 1] = der(a[i]) ~ b[i] + 0.07*v + D*(a[l] - 2*a[i] + a[r])
      equations[#equations + 1] = der(b[i]) ~ (1 - a[i]^2)*b[i] - a[i] - 0.4*y[i] + 0.035*v
        + D*(b[l] - 2*b[i] + b[r])
      y0[i], a0[i], b0[i] = 0, -2*math.cos(2*i*math.pi/N), 2*math.sin(2*i*math.pi/N)
    end
    problem.start = { [y] = y0, [a] = a0, [b] = b0 }
    return dae(equations)
  end,
  stiff = true, count = { "y1", "a1", "b1" },
}

--- Antibodies that penetrate a tissue; t > 5: nothing comes in.
add {
  name = "Medical Akzo Nobel", to = 20,
  source = "Mazzia & Magherini, Test Set for IVP Solvers",
  model = function(problem)
    local N, k, c = 200, 100, 4
    local u, v = var("u", N), var("v", N)
    local inflow, dz = ifelse(lt(t, 5), 2, 0), 1/N
    local equations, u0, v0 = {}, {}, {}
    for j = 1, N do
      local z = j*dz
      local al, be = 2*(z - 1)^3/c^2, (z - 1)^4/c^2
      local l, r = j > 1 and u[j - 1] or inflow, j < N and u[j + 1] or u[N]
      equations[#equations + 1] = der(u[j]) ~ (j < N and al*(r - l)/(2*dz) + be*(l - 2*u[j] + r)/dz^2 or 0)
        - k*u[j]*v[j]
      equations[#equations + 1] = der(v[j]) ~ -k*u[j]*v[j]
      u0[j], v0[j] = 0, 1
    end
    problem.start = { [u] = u0, [v] = v0 }
    return dae(equations)
  end,
  ida = { sparse = true },
  atol = function(rtol) return rtol*1e-6 end,
  stiff = true, count = { "u40", "u79", "v79" }, breaks = { 5 },
}

return list
