-- Bodies, beams and plates.
local list = {}
local function add(problem) list[#list + 1] = problem end

--- A beam clamped at one end in N rigid pieces, a force at the other until t = π.
local function beam(N)
  return {
    name = "beam of " .. N .. " pieces", to = 5,
    source = "Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.1; Mazzia & Magherini, Test Set for IVP Solvers",
    model = function(problem)
      local th, om, w = var("th", N), var("om", N), var("w", N)
      local force = ifelse(lt(t, pi), 1.5*sin(t)^2, 0)
      local function S(i) return sin(th[i] - th[i - 1]) end
      local function C(i) return cos(th[i] - th[i - 1]) end
      local v, equations, zero = {}, {}, {}
      for i = 1, N do
        local bend = i == 1 and -3*th[1] + th[2] or i == N and th[N - 1] - th[N]
          or th[i - 1] - 2*th[i] + th[i + 1]
        v[i] = N^4*bend + N^2*force*(cos(th[i]) + sin(th[i]))
        zero[i] = 0
      end
      for i = 1, N do
        local right, row, turn = om[i]^2, (i == 1 and 1 or i == N and 3 or 2)*w[i],
          (i == 1 and 1 or i == N and 3 or 2)*v[i]
        if i > 1 then
          right, row = right - S(i)*v[i - 1], row - C(i)*w[i - 1]
          turn = turn - C(i)*v[i - 1] - S(i)*w[i - 1]
        end
        if i < N then
          right, row = right + S(i + 1)*v[i + 1], row - C(i + 1)*w[i + 1]
          turn = turn - C(i + 1)*v[i + 1] + S(i + 1)*w[i + 1]
        end
        equations[#equations + 1] = der(th[i]) ~ om[i]
        equations[#equations + 1] = der(om[i]) ~ turn
        equations[#equations + 1] = 0 ~ right - row
      end
      problem.start = { [th] = zero, [om] = zero }
      return dae(equations)
    end,
    sized = beam,
    stiff = true, count = { "th1", "th" .. N }, breaks = { math.pi }, precision = 1e-15,
  }
end
add(beam(40))

add {
  name = "plate", to = 7,
  source = "Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.10: a lorry on a plate of 8 × 5 points",
  model = function(problem)
    local nx, ny, dx = 8, 5, 2/9
    local u, v = var("u", nx*ny), var("v", nx*ny)
    local function at(i, j)                              -- supported: 0 on the edge, odd beyond it
      local sign = 1
      if i < 0 then i, sign = -i, -sign elseif i > nx + 1 then i, sign = 2*(nx + 1) - i, -sign end
      if j < 0 then j, sign = -j, -sign elseif j > ny + 1 then j, sign = 2*(ny + 1) - j, -sign end
      if i == 0 or j == 0 or i == nx + 1 or j == ny + 1 then return 0 end
      return sign*u[i + (j - 1)*nx]
    end
    local equations, zero = {}, {}
    for j = 1, ny do
      for i = 1, nx do
        local k, x = i + (j - 1)*nx, i*dx
        local bend = 20*at(i, j) - 8*(at(i + 1, j) + at(i - 1, j) + at(i, j + 1) + at(i, j - 1))
          + 2*(at(i + 1, j + 1) + at(i + 1, j - 1) + at(i - 1, j + 1) + at(i - 1, j - 1))
          + at(i + 2, j) + at(i - 2, j) + at(i, j + 2) + at(i, j - 2)
        local load = (j == 2 or j == 4) and 200*(exp(-5*(t - x - 2)^2) + exp(-5*(t - x - 5)^2)) or 0
        equations[#equations + 1] = der(u[k]) ~ v[k]
        equations[#equations + 1] = der(v[k]) ~ -1000*v[k] - 100/dx^4*bend + load
        zero[k] = 0
      end
    end
    problem.start = { [u] = zero, [v] = zero }
    return dae(equations)
  end,
  atol = function(rtol) return rtol*1e-3 end,
  stiff = true, count = { "u12", "v12", "u20" },
}

--- A crank, a rod that bends in two modes, and a block on a rail. damping: of the modes, as a share of the
-- stiffness.
local function flexible(name, stiffness, damping, to)
  add {
    name = name, to = to,
    source = "after Simeon, Modelling a flexible slider crank mechanism, Math. Comput. Modelling 24, 1996",
    model = function(problem)
      local a, b, s, q1, q2 = vars "a b s q1 q2"
      local l1, l2, m1, m2, m3 = 0.15, 0.30, 0.36, 0.15, 0.075
      local tip = vec { l1*cos(a), l1*sin(a) }
      local T = m1*l1^2/6*a.dot^2 + m3/2*s.dot^2
      -- Simpson's rule along the rod
      local points = 8
      for i = 0, points do
        local x = i/points
        local w = q1*math.sin(math.pi*x) + q2*math.sin(2*math.pi*x)
        local p = tip + vec { l2*x*cos(b) - w*sin(b), l2*x*sin(b) + w*cos(b) }
        local v = der(p)
        local weight = (i == 0 or i == points) and 1 or i % 2 == 1 and 4 or 2
        T = T + m2*weight/(3*points)/2*v.T*v
      end
      local V = stiffness/2*(q1^2 + 16*q2^2)
      local c = damping*stiffness
      local model = lagrange { q = vec { a, b, s, q1, q2 }, T = T, V = V,
        C = { tip[2] + l2*sin(b), tip[1] + l2*cos(b) - s },
        Q = { 0.05, 0, 0, -c*q1.dot, -16*c*q2.dot } }
      problem.start = model:init { fix = { [a] = 0, [a.dot] = 20, [q1] = 0, [q1.dot] = 0, [q2] = 0,
        [q2.dot] = 0 }, guess = { [b] = 0, [s] = 0.45 } }
      return model
    end,
    stiff = true, count = { "a", "b", "s", "q1" },
  }
end
flexible("flexible crank, soft", 1e3, 1e-4, 0.5)
flexible("flexible crank, stiff modes", 1e5, 1e-2, 0.5)
flexible("flexible crank, damped", 1e4, 3e-2, 0.5)

return list
