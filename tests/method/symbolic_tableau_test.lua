-- Tableaus with symbols, order conditions as sums, and steps explained.
local a, b1, b2, b3 = params "a b1 b2 b3"
local function has(text, words)
  local said = tostring(text)
  if not said:find(words, 1, true) then error("'" .. words .. "' is not in\n" .. said, 2) end
end

test("the family of two stages of order 2", function()
  local tab = tableau { A = { { 0, 0 }, { a, 0 } }, b = { b1, b2 } }
  has(tab, "2 stages with symbols")
  has(tab:order_conditions(2), "order 2  Σ bᵢ cᵢ = 1/2  a b₂ = 1/2")
  local family = tab:solve(2)
  expect(#family):equals(1)
  expect(family[1][b2]):equals(simplify(1/(2*a)))
  has(family, "a free")
  for _, value in ipairs { rational "1/2", 1, rational "2/3" } do        -- midpoint, Heun, Ralston
    local member = tab:subs { b1 = family[1][b1], b2 = family[1][b2] }:subs { a = value }
    expect(member:order()):equals(2)
  end
  expect(tab:subs { a = 1, b1 = 1, b2 = 0 }:order()):equals(1)
  expect(tab:latex()):matches "hline"
end)

test("three stages with nodes: the classical solution in c₂ and c₃", function()
  local c2, c3, a32 = params "c2 c3 a32"
  local tab = tableau { A = { {}, { c2 }, { c3 - a32, a32 } }, b = { b1, b2, b3 }, c = { 0, c2, c3 } }
  local found = tab:solve(3, { b1, b2, b3, a32 })
  local general = found[1]
  local values = { [b1] = general[b1], [b2] = general[b2], [b3] = general[b3], [a32] = general[a32] }
  expect(simplify(values[b2] - (3*c3 - 2)/(6*c2*(c3 - c2)))):equals(0)
  local kutta = tab:subs(values):subs { [c2] = rational "1/2", [c3] = 1 }
  expect(kutta:order()):equals(3)
  expect(kutta.b[2]):equals(rational "2/3")
end)

test("order conditions of trees: number, weights, verdicts", function()
  local counts = { 1, 2, 4, 8, 17, 37 }
  for p, count in ipairs(counts) do expect(#order_conditions(p)):equals(count) end
  has(order_conditions(4), "order 4  Σ bᵢ aᵢⱼ aⱼₖ cₖ = 1/24")
  has(order_conditions(3, rk.heun), "Σ bᵢ aᵢⱼ cⱼ = 1/6  missed: 0")
  for _, c in ipairs(order_conditions(4, rk.rk4)) do expect(c.met):is_true() end
  expect(function() order_conditions(7) end):fails "1 … 6"
end)

test("R(z) with symbols", function()
  local z = param "z"
  local tab = tableau { A = { { 0, 0 }, { a, 0 } }, b = { 1 - 1/(2*a), 1/(2*a) } }
  expect(tab:stability_function(z)):equals(1 + z + z^2/2)
  local g = param "gam"
  expect(simplify(tableau { A = { { g } }, b = {
    1 } }:stability_function(z) - (1 + (1 - g)*z)/(1 - g*z))):equals(0)
end)

local y, w, u = var "y", var "w", input "u"
local sys = dae { der(y) ~ -y + w + u, 0 ~ w^3 + w - y }

test("a step of an implicit method: unknowns, r, M, Newton, update", function()
  local step = explain_step(sys, rk.gauss(2))
  expect(step.size):equals(4)
  expect(#step.r):equals(4)
  expect(step.M.rows):equals(4)
  for _, words in ipairs { "w = (K₁, z₁, K₂, z₂)", "s (n_x + n_z) = 2 (1 + 1) = 4",
    "X₁ = x_k + Δt (1/4 K₁ + (1/4 - √3/6) K₂)", "K₁ - f(X₁, z₁, u(t_k + (1/2 - √3/6) Δt)) = 0",
    "δᵢⱼ I - Δt aᵢⱼ f_x,  -δᵢⱼ f_z", "g_z = 3 w² + 1", "solve M Δw = -r",
      "x_{k+1} = x_k + Δt (1/2 K₁ + 1/2 K₂)",
  } do has(step, words) end
  expect(simplify(step.M - jacobian(step.r, step.w))):equals(zeros(4, 4))
  has(explain_step(sys, rk.radau(2)), "stiffly accurate")
  expect(step.latex()):matches "begin{align%*}"
end)

test("BDF: the residual of the lecture; explicit and Rosenbrock methods; implicit models", function()
  has(explain_step(sys, bdf(1)), "x_{k+1} - x_k - Δt f(x_{k+1}, z_{k+1}, u_{k+1}) = 0")
  local two = explain_step(sys, bdf(2))
  has(two, "x_{k+1} - 4/3 x_k + 1/3 x_{k-1} - 2/3 Δt f(")
  has(two, "M = [ I - 2/3 Δt f_x,  -2/3 Δt f_z;  g_x,  g_z ]")
  expect(two.M(2, 1)):equals(-1)
  has(explain_step(dae { der(y) ~ -y^2 }, rk.rk4), "K₂ = f(x_k + Δt (1/2 K₁))")
  has(explain_step(dae { der(y) ~ -y^2 }, rosenbrock.ros2), "linearly implicit")
  local model = dae.implicit { x = { y }, z = { w }, F = { der(y)*(1 + w) + y, w - y^2 - w^3/10 } }
  has(explain_step(model, rk.radau(2)), "F(K₁, X₁, z₁) = 0")
  expect(function() explain_step(sys, "radar") end):fails "expected a method"
end)

test("every method explains every model: names, DAEs by Rosenbrock, second order, what is singular",
  function()
  local p, q = vars "p q"
  local second = dae { der(p, 2) ~ -p }
  local index1 = dae { der(p) ~ q - p, 0 ~ p^2 + q - 1 }
  local pendulum = lagrange { q = { p, q }, T = (p.dot^2 + q.dot^2)/2, V = 9.81*q, C = { (p^2 + q^2 - 1)/2 } }
  local implicit = dae { der(p)^2 + p + der(q)*w ~ 0, der(q) + p*w ~ 1, w + p*q ~ 0 }
  for _, model in ipairs { second, index1, pendulum, implicit, dae { der(p) ~ sin(t) - p } } do
    for _, method in ipairs { "radau", "gauss", "bdf", "dopri5", "rodas3", bdf(5), rk.sdirk2,
      rosenbrock.ros2 } do
      local step = explain_step(model, method)
      expect(tostring(step)):matches "One step of"
      expect(tostring(step):find("dt", 1, true)):equals(nil)
    end
  end
  local two = explain_step(index1, rosenbrock.ros2)
  has(two, "M = B - Δt γ J,  B = diag(I, 0),  J = [ f_x, f_z;  g_x, g_z ]")
  has(two, "M k₂ = Δt φ(y_k + k₁) + Δt J (-0.58578644 k₁)")
  has(explain_step(implicit, rosenbrock.ros2), "x′ = δ, 0 = F(δ, x, z)")
  has(explain_step(dae { der(p) ~ sin(t) - p }, rosenbrock.rodas3), "M k₁ = Δt f(t_k, x_k) + 0.5 Δt² ∂f/∂t")
  has(explain_step(dae { der(p) ~ sin(t) - p }, rosenbrock.rodas4),  -- was "+ -0.1043 Δt²"
    "x_k + 0.386 k₁) + Δt J (-0.3543 k₁) - 0.1043 Δt² ∂f/∂t")
  has(explain_step(pendulum, rk.rk4), "M is singular for every Δt: the index is above 1")
  has(explain_step(pendulum, rk.gauss(2)), "M tends to a singular matrix as Δt → 0: the index is above 1")
  has(explain_step(index1, bdf(3)), "x_{k+1} - 18 x_k/11 + 9 x_{k-1}/11 - 2 x_{k-2}/11")
end)

test("stability functions with symbols have Q(0) = 1 and P by powers of z", function()
  local z, theta, gamma = params "z theta gamma"
  local R = tableau { A = { { 0, 0 }, { 1 - theta, theta } }, b = { 1 - theta, theta }, c = { 0, 1 } }
  expect(tostring(R:stability_function(z))):equals "(z (1 - θ) + 1)/(1 - z θ)"
  local sdirk = tableau { A = { { gamma, 0 }, { 1 - 2*gamma, gamma } }, b = { "1/2", "1/2" } }
  -- Hairer & Wanner II, §IV.6
  local known = (1 + (1 - 2*gamma)*z + (1/2 - 2*gamma + gamma^2)*z^2)/(1 - gamma*z)^2
  expect(simplify(together(sdirk:stability_function(z) - known))):equals(0)
end)

test("reports of multistep methods name the zeros of rho and a weak instability", function()
  local leapfrog = multistep { name = "leapfrog", alpha = { 1, 0, -1 }, beta = { 0, 2, 0 } }:report()
  has(leapfrog, "yes: the zeros of ρ are 1 and -1")
  has(leapfrog, "no interval (-x, 0): on x′ = λx with λ < 0 errors grow for every step (weak instability)")
  local explicit = multistep { name = "explicit", alpha = { 1, 4, -5 }, beta = { 0, 4, 2 } }
  has(explicit:report(), "no: the zeros of ρ are 1 and -5")
  has(bdf(3):report(), "the zeros of ρ are 1 and 0.318182 ± 0.283864 i")
end)
