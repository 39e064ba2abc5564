-- Concepts of linear systems, identification, pictures and the session.

concept { name = "transfer function", see = "tf ss lti:poles lti:bode",
  words = "laplace poles zeros tf frequency",
  text = [[tf(num, den) or tf(expression, s): G(s) as a fraction of polynomials, exact. ss, zpk and tf
    change the form; poles, zeros, bode, step and margin analyse it.]],
  example = [[
    return tf({1}, {1, 3, 2}):poles()
  ]],
  gives = "poles: -2, -1" }

concept { name = "state feedback", see = "place lqr lqe",
  words = "place lqr pole placement regulator controller design",
  text = [[u = -K x with poles at given places (place) or by weights on states and inputs (lqr). kalman
    estimates states that are not measured.]],
  example = [[
    K = place({{0, 1}, {0, 0}}, {0, 1}, {-1, -2})
    return K
  ]],
  gives = "2  3" }

concept { name = "sampling", see = "c2d d2c",
  words = "discrete c2d zero order hold sample time",
  text = [[c2d(G, Ts, method) makes a discrete system: "zoh" holds the input between samples, "tustin"
    substitutes for s, "matched" keeps poles and zeros.]],
  example = [[
    return c2d(tf({1}, {1, 1}), 0.1).Ts
  ]],
  gives = "0.1" }

concept { name = "measured data", see = "iddata iddata.read",
  words = "data csv iddata measurement experiment read",
  text = [[iddata holds outputs y, inputs u and the sampling time; iddata.read takes columns of a CSV or
    MAT file by name. :split, :detrend, :slice prepare them.]],
  example = [[
    d = iddata{ y = {1, 2, 3, 4}, u = {0, 1, 0, 1}, Ts = 0.1 }
    return #d:split(0.5).y
  ]],
  gives = "2" }

concept { name = "identification", see = "arx armax oe n4sid validation",
  words = "arx armax estimate model from data system identification",
  text = [[Models from data: arx (least squares), armax, oe, bj (prediction errors), n4sid (state space).
    Validate on data that were not used: mod:fit(v), mod:validate(v); order_scan compares orders.]],
  example = [[
    u, y = {}, {}
    for k = 1, 40 do u[k] = (-1)^(k*k//3); y[k] = 0.5*(y[k-1] or 0) + (u[k-1] or 0) end
    return arx(iddata{ y = y, u = u }, { na = 1, nb = 1 }).theta
  ]],
  gives = [[
    -0.5
       1]] }

concept { name = "fitting parameters", see = "fit fit_result",
  words = "fit parameter estimation grey box calibrate",
  text = [[fit(sys, { params = { k }, data = d, y = x, start = { … } }) finds parameters of any model
    from data by Gauss-Newton with sensitivities, with standard deviations.]],
  example = [[
    x, k = var "x", param("k", 0.3)
    y = {} for i = 0, 9 do y[i + 1] = 2*math.exp(-0.5*i) end
    r = fit(dae{ der(x) ~ -k*x }, { params = {k}, data = iddata{ y = y, Ts = 1 }, y = x, start = { x = 2 } })
    return ("%.6f"):format(r(k))
  ]],
  gives = "0.500000" }

concept { name = "identifiability", see = "lsq fit_result",
  words = "identifiable rank unidentifiable correlation",
  text = [[A parameter is identifiable if the data change when it does. Where only a combination is
    (k*m), rank and r.unidentifiable say which; lsq names the combinations.]],
  example = [[
    return lsq({{1, 1}, {2, 2}, {3, 3}}, {1, 2, 3}).rank
  ]],
  gives = "1" }

concept { name = "confidence", see = "fit idmodel quantile",
  words = "standard deviation uncertainty covariance confidence interval",
  text = [[Estimates come with standard deviations from the curvature of the loss; mod.std, mod.cov,
    r.std. They hold for white residuals: validate first.]],
  example = [[
    r = lsq({{1, 0}, {1, 1}, {1, 2}, {1, 3}}, {0, 1.1, 1.9, 3})
    return #r.std
  ]],
  gives = "2" }

concept { name = "figures", see = "plot plot3 overlay layout",
  words = "plot picture graph axis options save svg png",
  text = [[plot makes a figure; at the prompt it is drawn, in a script :show() and :save "file.svg" do.
    Options are a table at the end: { title =, xlim =, style = … }. overlay and layout put figures
    together.]],
  example = [[
    return plot({0, 1, 2}, {0, 1, 4}, { title = "Squares", style = "points" })
  ]],
  gives = "figure 'Squares': 1 series, 3 points" }

concept { name = "phase portraits", see = "phase poincare",
  words = "phase plane nullcline direction field trajectory",
  text = [[phase(sys, x, y, { xlim =, ylim =, start = … }) draws directions, nullclines and trajectories
    of two states; poincare the points where a solution crosses a section.]],
  example = [[
    x, v = vars "x v"
    return #phase(dae{ der(x) ~ v, der(v) ~ -x }, x, v, { xlim = {-1, 1}, ylim = {-1, 1}, n = 5 }).labels
  ]],
  gives = "3" }

concept { name = "animations", see = "animate",
  words = "animate movie gif moving mechanism",
  text = [[animate(sol, { p1, p2 }) draws moving points joined by bars: :show() in the terminal, :save
    "a.svg", .html or .gif.]],
  example = [[
    th = var "theta"
    s = dae{ der(th, 2) ~ -sin(th) }:integrate{ start = { [th] = 1, [th.dot] = 0 }, to = 2 }
    return #animate(s, { vec(sin(th), -cos(th)) }, { fps = 10 }).frames
  ]],
  gives = "21" }

concept { name = "saving", see = "save load solution:csv",
  words = "save load file store session",
  text = [[save(file, value) writes a value as text that load reads as data, never as a program, in a new
    session too. sol:csv writes columns that iddata.read and others read.]],
  example = [[
    x = var "x"
    name = os.tmpname() .. ".lua"
    save(name, x^2 + 1)
    return load(name)
  ]],
  gives = "x² + 1" }

concept { name = "ans", see = "help",
  words = "last result previous answer",
  text = [[At the prompt, ans is the first value of the last line that had one. An expression is shown
    without print; a leading = is allowed.]],
  example = [[
    ans = 6*7
    return ans + 1
  ]],
  gives = "43" }

concept { name = "keys", see = "help",
  words = "keyboard shortcuts history completion tab ctrl-c prompt",
  text = [[Tab completes names, fields, options and their values; twice lists them. Up and Down recall
    entries, Ctrl-R searches them. Ctrl-C discards a line or stops a computation, Ctrl-D quits. word? is
    help "word".]],
  example = [[
    return #"Tab"
  ]],
  gives = "3" }

concept { name = "testing", see = "test expect",
  words = "test expect unit test check",
  text = [[test("name", function() … end) and expect(a):near(b, tol), :equals, :fails "words": pendula
    test folder runs them. Give every tolerance a reason.]],
  example = [[
    expect(0.1 + 0.2):near(0.3, 1e-12)
    return "passed"
  ]],
  gives = "passed" }

concept { name = "lua", see = "help",
  words = "language lua tables functions loops local",
  text = [[Scripts are Lua 5.4: local x = 1, function f(x) return x^2 end, for i = 1, 3 do … end, { 1, 2,
    k = 3 }. Equations are written with ~, unequal is ~=, comments begin with --.]],
  example = [[
    function square(n) return n*n end
    return square(12)
  ]],
  gives = "144" }
