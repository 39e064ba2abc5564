-- Concepts of what people want to do: equilibria, equations, controllers, networks, other programs.

concept { name = "steady state", see = "equilibria model:linearize newton",
  words = "equilibrium equilibria operating point fixed point trim stationary",
  text = [[equilibria(sys) finds every point where nothing changes, in closed form where there is one, with
    its linearisation and whether it is stable. sys:linearize(at) makes a linear system there.]],
  example = [[
    x = var "x"
    points = equilibria(dae{ der(x) ~ x - x^3 })
    return #points, points[1][x], points[1].stable
  ]],
  gives = "3 0 false" }

concept { name = "solving equations", see = "solve roots newton gauss_newton",
  words = "nonlinear equations fsolve fzero root algebraic unknown system of equations",
  text = [[solve({ equations }, { unknowns }) gives all solutions in closed form, roots(equation, x) those of
    one; where there is none, newton{ r =, x =, start = } finds one from a start. solve(A, b) is the linear
    system.]],
  example = [[
    x, y = vars "x y"
    all = solve({ x + y ~ 3, x*y ~ 2 }, { x, y })
    print(#all, all[1][x], all[1][y])
    print(("%.6f"):format(newton{ r = cos(x) - x, x = x, start = 1 }.x))
  ]],
  gives = [[
    2 2 1
    0.739085]] }

concept { name = "vectors and matrices", see = "vec mat matrix solve eig",
  words = "matrix vector array linear algebra transpose indexing slice",
  text = [[vec{1, 2} is a column, mat{{1, 2}, {3, 4}} a matrix, of numbers or expressions; indices begin at 1,
    A(i, j) is an entry, A[i] a row, A.T the transpose. + - * ^ are those of matrices; solve(A, b), det, inv,
    eig, rank are exact where that means something. A list will do wherever a vector is expected.]],
  example = [[
    A = mat{{1, 2}, {3, 4}}
    return A*vec{1, 1}, A(1, 2), det(A), solve(A, { 1, 1 })
  ]],
  gives = "(3, 7) 2 -2 (-1, 1)" }

concept { name = "optimisation", see = "gauss_newton fit lqr",
  words = "minimise minimize minimum maximum optimal least squares optimum",
  text = [[Sums of squares are minimised by gauss_newton{ R =, x =, start = } (of expressions), by fit (of a
    model to data) and by lqr (of states and inputs). A smooth function has its extremes where its gradient
    is 0: newton{ r = gradient(f, x), … } or solve.]],
  example = [[
    x, y = vars "x y"
    f = (x - 1)^2 + 10*(y - x^2)^2
    return newton{ r = gradient(f, { x, y }), x = { x, y }, start = { 0.5, 0.5 } }.x
  ]],
  gives = [[
    1
    1]] }

concept { name = "boundary values", see = "newton fit model:integrate",
  words = "boundary value problem shooting bvp bvp4c solve_bvp two-point",
  text = [[Boundary value problems are solved by shooting: the missing initial value is a parameter of fit,
    and the wanted boundary values are its data.]],
  example = [[
    x = var "x"                                -- x″ = -x, x(0) = 0, x(1) = 1: x′(0) = 1/sin(1)
    sys = dae{ der(x, 2) ~ -x }
    wanted = iddata{ y = { 0, 1 }, Ts = 1 }
    r = fit(sys, { params = { x.dot }, data = wanted, y = x, start = { x = 0 }, guess = { [x.dot] = 1 } })
    return ("%.4f"):format(r(x.dot))
  ]],
  gives = "1.1884" }

concept { name = "partial differential equations", see = "model:integrate stiffness plot3",
  words = "pde pdes heat equation diffusion wave method of lines finite differences grid",
  text = [[On a grid a partial differential equation is a list of ordinary ones (method of lines). A column of
    unknowns and a loop write them; the method for stiff systems is chosen.]],
  example = [=[
    u = var("u", 9)                            -- u_t = u_xx on 0 < x < 1, 0 at both ends
    eqs, first = {}, {}
    for i = 1, 9 do
      local left, right = i > 1 and u[i-1] or 0, i < 9 and u[i+1] or 0
      eqs[i] = der(u[i]) ~ 100*(left - 2*u[i] + right)
      first[u[i]] = math.sin(math.pi*i/10)
    end
    sol = dae(eqs):integrate{ start = first, to = 0.1 }
    return ("%.3f"):format(sol:final(u[5]))
  ]=],
  gives = "0.376" }

concept { name = "controllers", see = "components.signals place lqr model:close",
  words = "pid pi controller feedback control loop anti-windup tuning simulink",
  text = [[components.signals.pid is a controller with limits and anti-windup in a model of parts; place and
    lqr compute state feedback; sys:close{ u = … } closes a loop by an equation; G:feedback() closes that of
    a linear system.]],
  example = [[
    G = tf({1}, {1, 1, 0})
    return (4*G):feedback():poles()
  ]],
  gives = "poles: -1/2 ± √15/2 i" }

concept { name = "root locus", see = "rlocus lti:poles margin",
  words = "rlocus locus gain poles closed loop",
  text = [[rlocus(G) draws how the poles of the closed loop move with the gain; the gain at which they cross
    into the right half plane is that of margin(G).]],
  example = [[
    G = tf({1}, {1, 3, 2, 0})
    print(rlocus(G).title)
    return margin(G).gain
  ]],
  gives = [[
    Root locus
    6.0]] }

concept { name = "delays", see = "delayed lti:c2d components.signals",
  words = "delay dead time transport lag dde pade exp(-s)",
  text = [[A delay of a linear system is exact: delayed(G, T), or exp(-T*s)*G in s = tf "s"; bode, step and
    c2d know it, :pade() makes it rational. In a model of parts components.signals.delay is such an
    approximation.]],
  example = [[
    G = delayed(tf({1}, {1, 1}), 2)
    return G:bode{ 1 }.phase(1, 1) < -45, G:step{ 0, 1, 3 }.y(2, 1)
  ]],
  gives = "true 0.0" }

concept { name = "networks and mechanisms", see = "model component connect components.electrical",
  words = "circuit circuits electrical friction contact spring damper motor part parts component modelica "
    .. "hydraulic thermal simscape diagram tree adapter",
  text = [[A model of parts: components.electrical, translational, rotational, planar, spatial, thermal,
    hydraulic, process and signals hold resistors, springs, friction, bodies, tanks; connect joins them.
    print(components.electrical) lists the components; m:tree() and m:diagram() show a model. Components
    with connectors of two kinds (dc_motor, rack, cylinder, heating_resistor) connect two domains.]],
  example = [[
    m = components.translational
    cart = model { m = m.mass{ m = 2, s0 = 1, v0 = 0 }, c = m.spring{ k = 8 }, wall = m.fixed{},
                   connect("wall.flange", "c.a"), connect("c.b", "m.flange") }
    return ("%.4f"):format(cart:integrate{ to = math.pi/2 }(cart.m.s, math.pi/2))
  ]],
  gives = "-1.0000" }

concept { name = "exporting", see = "solution:csv save figure:save latex",
  words = "export write file csv json excel python matlab mat tex data out",
  text = [[sol:csv(file) writes columns; :json() is text for other programs, pendula --json for all that a
    script prints; save "x.tex" writes LaTeX, fig:save "x.svg" (.pdf, .png) a picture, d:save "x.mat" data for
    MATLAB.]],
  example = [[
    x = var "x"
    sol = dae{ der(x) ~ -x }:integrate{ start = { x = 1 }, to = 1, dt = 0.5, method = rk.rk4 }
    name = os.tmpname() .. ".csv"
    sol:csv(name)
    return io.open(name):read "l"
  ]],
  gives = "t,x" }

concept { name = "reports and notebooks", see = "view save",
  words = "report html pdf document jupyter notebook kernel print page manual",
  text = [[pendula report exam.lua writes one page with text, code, formulas and figures (-o exam.pdf prints
    it); view(x) opens a page of one value; pendula kernel install makes Jupyter notebooks run here; pendula
    manual opens the manual.]],
  example = [[
    page = view(tf({1}, {1, 2, 1}), { file = os.tmpname() .. ".html", open = false })
    return io.open(page):read "a":find "<math" ~= nil
  ]],
  gives = "true" }

concept { name = "laplace transforms", see = "laplace_transform inverse_laplace tf",
  words = "laplace inverse transform s-domain",
  text = [[laplace_transform(f, t, s) and inverse_laplace(F, s, t) are symbolic; tf(F) makes a system of a
    fraction in s.]],
  example = [[
    s = param "s"
    return laplace_transform(1 - exp(-2*t), t, s), inverse_laplace(1/(s + 3), s, t)
  ]],
  gives = "2/(s (s + 2)) exp(-3 t)" }

concept { name = "noise", see = "random_process arx armax normal",
  words = "white noise random disturbance stochastic monte carlo measurement",
  text = [[In measurements: arx, armax, oe and bj differ by the noise they assume; noise = chooses others.
    As an input of a run: random_process{ band =, std = } is a signal in time. In parameters: sweep draws
    them from normal, uniform and other distributions.]],
  example = [[
    u, x = input "u", var "x"
    w = random_process{ band = { 0.1, 5 }, std = 2 }
    sol = dae{ der(x) ~ -x + u }:integrate{ start = { x = 0 }, to = 5, inputs = { u = w:realisation(1) } }
    return sol.status
  ]],
  gives = "finished" }

concept { name = "other programs", see = "help apropos",
  words = "matlab python julia modelica simulink octave mathematica scipy sympy coming from undo",
  text = [[Names of other programs lead to those of this one: type ode45, fsolve, syms or @variables, and the
    error says what to write. The manual has tables for MATLAB, Python, Julia and Modelica: pendula manual,
    "Coming from".]],
  example = [[
    expect(function() return ode45 end):fails "sys:integrate"
  ]] }
