-- Concepts of integration: methods, steps, tolerances, events, output.

concept { name = "stiffness", see = "model:integrate methods solution:stats",
  words = "stiff implicit method slow many steps",
  text = [[A problem is stiff where stability, not accuracy, limits the step of explicit methods: fast
    modes that have died out. Implicit methods (radau, bdf, rodas) take large steps there. Without a method,
    integrate chooses by the eigenvalues at the start; sol:stats() says why.]],
  example = [[
    x = var "x"
    sol = dae{ der(x) ~ -1e6*(x - cos(t)) }:integrate{ start = { x = 1 }, to = 1 }
    return sol:stats().steps < 200
  ]],
  gives = "true" }

concept { name = "tolerances", see = "model:integrate",
  words = "tolerance rtol atol accuracy error control precision",
  text = [[The estimated error of every step stays below atol + rtol |x|: rtol is relative (1e-3: three
    digits), atol is the size of negligible values, in units of the variable. The error at the end is usually
    some ten times larger; a second run with smaller tolerances shows it.]],
  example = [[
    x = var "x"
    m = dae{ der(x) ~ -x }
    function err(tol)
      local sol = m:integrate{ start = { x = 1 }, to = 1, rtol = tol, atol = tol }
      return math.abs(sol(x, 1) - math.exp(-1))
    end
    return err(1e-4) > err(1e-10), err(1e-10) < 1e-8
  ]],
  gives = "true true" }

concept { name = "methods", see = "methods rk bdf rosenbrock",
  words = "solver solvers integrator algorithm ode45 runge kutta",
  text = [[Not stiff: dopri5, tsit5, dop853, verner98 (explicit Runge-Kutta). Stiff or algebraic: radau
    (order 5 to 13), bdf (large systems), rodas (moderate tolerances). Mechanics over long times: gauss,
    symplectic. Any tableau with dt = makes fixed steps.]],
  example = [[
    x = var "x"
    m = dae{ der(x) ~ -x }
    return m:integrate{ start = { x = 1 }, to = 1, method = "tsit5" }:stats().method
  ]],
  gives = "tsit5" }

concept { name = "fixed steps", see = "model:integrate rk converge",
  words = "dt step size fixed constant step",
  text = [[With dt = the step is fixed, for any tableau: to study a method, or for real-time simulation. How
    fast the error falls with dt is the order: converge measures it.]],
  example = [[
    x = var "x"
    s = dae{ der(x) ~ -x }:integrate{ start = { x = 1 }, to = 1, dt = 0.25, method = rk.euler }
    return #s.t, s(x, 1)
  ]],
  gives = "5 0.31640625" }

concept { name = "events", see = "model:integrate",
  words = "event zero crossing bounce reset stop condition terminate",
  text = [[A zero of an expression along the solution, located to rounding accuracy. action = "stop" ends
    the run, reset sets states (a bounce), call runs a Lua function. direction = -1 takes falling zeros
    only.]],
  example = [[
    h, v = vars "h v"
    ball = dae{ der(h) ~ v, der(v) ~ -9.81 }
    s = ball:integrate{ start = { h = 1, v = 0 }, to = 5,
      events = { { when = h, direction = -1, action = "stop" } } }
    return s.status, ("%.6f"):format(s.t[#s.t])
  ]],
  gives = "event 0.451524" }

concept { name = "dense output", see = "solution",
  words = "interpolation values at any time sol(t)",
  text = [[A solution is a function: sol(e, t) evaluates any expression at any time with the accuracy of
    the method, not only at the steps. plot follows it to a fraction of a pixel.]],
  example = [[
    x = var "x"
    s = dae{ der(x) ~ -x }:integrate{ start = { x = 1 }, to = 2, rtol = 1e-10, atol = 1e-10 }
    return math.abs(s(x, 0.77) - math.exp(-0.77)) < 1e-9
  ]],
  gives = "true" }

concept { name = "order of a method", see = "converge tableau:order",
  words = "order convergence order conditions slope",
  text = [[A method has order p if its error falls like dtᵖ. It is proved by order conditions
    (tab:order()) and measured by converge. Stiff problems and algebraic variables may show less: order
    reduction.]],
  example = [[
    return rk.rk4:order(), rk.radau(2):order(), rk.radau(2):stage_order()
  ]],
  gives = "4 3 2" }

concept { name = "stability of methods", see = "tableau:is tableau:report",
  words = "a-stable l-stable stability function region",
  text = [[The stability function R(z) is the factor of a step for x′ = λx, z = λ dt. A-stable: |R| ≤ 1 in the
    left half plane; L-stable: also R(∞) = 0, so that fast modes vanish at once. tab:plot() draws the
    region.]],
  example = [[
    return rk.gauss(2):is "A-stable", rk.gauss(2):is "L-stable", rk.radau(2):is "L-stable"
  ]],
  gives = "true false true" }

concept { name = "butcher tableau", see = "tableau rk",
  words = "tableau coefficients a b c runge kutta own method",
  text = [[The coefficients A, b, c of a Runge-Kutta method. tableau{ A =, b =, c = } makes one from
    exact numbers ("1/2"); it is checked, reported and can be used as method = at once.]],
  example = [[
    tab = tableau{ A = { {0, 0}, {"1/2", 0} }, b = {0, 1}, c = {0, "1/2"} }
    return tab:order()
  ]],
  gives = "2" }

concept { name = "unfinished runs", see = "solution#status model:integrate",
  words = "status stopped singularity why did it stop pole",
  text = [[A run may end before `to`: an event, a pole, constraints that become dependent, too many
    steps. sol.status says where and why, the prompt warns, and sol:final() says at which time it is.]],
  example = [[
    x = var "x"
    s = dae{ der(x) ~ x^2 }:integrate{ start = { x = 1 }, to = 2 }
    return s.status ~= "finished", s.t[#s.t] < 1.01
  ]],
  gives = "true true" }

concept { name = "sensitivities", see = "model:integrate fit",
  words = "sensitivity derivative with respect to parameter gradient adjoint",
  text = [[∂x/∂p along the solution, from equations integrated beside the model: sensitivities = { p }.
    fit uses them.]],
  example = [[
    x, k = var "x", param("k", 2)
    m = dae{ der(x) ~ -k*x }
    s = m:integrate{ start = { x = 1 }, to = 1, sensitivities = { k }, rtol = 1e-8, atol = 1e-8 }
    return s.status
  ]],
  gives = "finished" }

concept { name = "parameter sweeps", see = "sweep",
  words = "sweep monte carlo many runs study scan",
  text = [[sweep integrates for many parameter values or starts, in parallel processes and SIMD lanes;
    distributions (normal, uniform …) are drawn from, by Monte Carlo, Latin hypercube or Sobol designs.]],
  example = [[
    x, k = var "x", param "k"
    s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2} } })
    return #s
  ]],
  gives = "2" }

concept { name = "symplectic integration", see = "rk tableau:is",
  words = "energy conservation long time hamiltonian",
  text = [[Symplectic methods (Gauss, fixed steps) keep the energy of a mechanism near its value for any
    time; others let it grow or fall slowly. Compare sol(sys.energy).]],
  example = [[
    return rk.gauss(2):is "symplectic", rk.rk4:is "symplectic"
  ]],
  gives = "true false" }

concept { name = "newton iteration", see = "newton gauss_newton",
  words = "newton roots nonlinear equations convergence basin",
  text = [[newton{ r =, start = } solves r(x) = 0 and keeps every iterate, with the order of convergence
    observed and explained. A line search (alpha = "line search") helps far from the root.]],
  example = [[
    x = var "x"
    return newton{ r = x^2 - 2, start = {1} }.converged
  ]],
  gives = "true" }

concept { name = "exact numbers", see = "rational simplify",
  words = "rational fraction decimal exact symbolic number precision",
  text = [[Integers, fractions ("1/3") and decimals stay exact in symbolic work; √2 and π are symbols.
    Doubles begin with integration. tonumber(e) and math functions make numbers of exact values.]],
  example = [[
    return rational "1/3" + rational "1/6", tonumber(sqrt(2)) == math.sqrt(2)
  ]],
  gives = "1/2 true" }
