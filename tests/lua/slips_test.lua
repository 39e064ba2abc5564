-- What users of MATLAB, Python, Julia and Modelica type first: each slip is accepted, or its error names the
-- remedy.

local setup = [[
  x, y, z = vars "x y z"
  q = var("q", 3)
  m, g, L = params "m=1 g=9.81 L=1"
  u = input "u"
  decay = dae { der(x) ~ -x }
  free = lagrange { q = q, T = m/2*q.dot.T*q.dot, V = m*g*q[3] }
  sol = decay:integrate { start = { x = 1 }, to = 1 }
  A = mat { { 2, 1 }, { 1, 3 } }
  b = vec { 1, 2 }
  G = tf({ 1 }, { 1, 1 })
  moved = dae { der(x) ~ -param("k", 2)*x }
]]

local function environment()
  local env = setmetatable({}, { __index = _G })
  assert(load(setup, "=setup", "t", env))()
  return env
end

-- ── accepted ───────────────────────────────────────────────────────────────────────────────────────────────

local accepted = {
  -- names as they are typed and as they are printed
  { 'dae { der(var "theta_1") ~ -var "theta_1" }:init { fix = { ["θ₁"] = 2 } }("theta_1")', "2.0" },
  { 'dae { der(var "theta") ~ -var "theta" }:init { fix = { theta = 2 } }("θ′")', "-2.0" },
  -- exact numbers are numbers
  { '("%.4f"):format(sqrt(5))', "2.2361" },
  { '("%.3f"):format(pi/4)', "0.785" },
  { '("%d"):format(rational "6/3")', "2" },
  { '("%g"):format(G:dcgain())', "1" },
  { '("%.2f"):format(solve(A, b)[2])', "0.60" },
  { 'tostring(d2c(c2d(tf({ 1 }, { 1, 1, 1 }), 0.1))):match "s².*1"', "s² + s + 1" },  -- 1 to rounding
  { '("%s"):format(sqrt(5))', "√5" },
  { '("%5.1f|%s"):format(rational "1/3", x)', "  0.3|x" },
  { "math.abs(-sqrt(2))", tostring(math.sqrt(2)) },
  { 'math.floor(rational "7/2")', "3" },
  { "math.max(pi, 3)", tostring(math.pi) },
  { "math.sin(pi/6)", tostring(math.sin(math.pi/6)) },
  { "tonumber(sqrt(2))", tostring(math.sqrt(2)) },
  { 'tonumber(rational "1/2")', "0.5" },
  -- parameters that the model does not know have their values
  { "sol(m*x, 0)", "1.0" },
  { "sol:final(2*g*x)/sol:final(x)", "19.62" },
  { "norm(b, 1)", "3" },
  { "norm(b, 2)", "√5" },
  { "norm(-b, 'inf')", "2" },
  { "norm({ x, y }, 1)", "|x| + |y|" },
  -- Lagrangians
  { "evaluate(lagrange { q = q, L = m/2*q.dot.T*q.dot - m*g*q[3] }.energy - free.energy, { [q] = { 1, "
    .. "2, 3 }, "
    .. "[q.dot] = { 4, 5, 6 } })", "0.0" },
  { "lagrange { q = q, T = m/2*q.dot.T*q.dot, C = { q.T*q ~ L^2 } }.C", "(qᵀq - L²)" },
  -- spelling of derivatives
  { "sol('x.dot', 0)", "-1.0" },
  { "sol('x_dot', 0)", "-1.0" },
  { "sol(\"x'\", 0)", "-1.0" },
  { "sol('x′', 0)", "-1.0" },
  -- what draws and writes itself
  { "plot(sol)", "figure: 1 series, 28 points" },
  { "sol:plot()", "figure: 1 series, 28 points" },
  { "sol:plot(x, { title = 'a' })", "figure 'a': 1 series, 28 points" },
  { "plot(sweep(moved, { start = { x = 1 }, to = 1, params = { k = { 1, 2 } } }), x)",
    "figure: 1 series, 2 points" },
  { "animate(sol, { { x, 0 } })", "animation: 1 point, 51 pictures, 2 s; :show(), :save \"file.svg\" (.svg, "
    .. ".html, .gif)" },
  { "latex(decay)", "\\begin{align}\n  \\dot{x} &= -x \\tag{1}\n\\end{align}" },
  { "G:json() == json(G)", "true" },
}

test("slips that are accepted", function()
  local complaints = {}
  for _, case in ipairs(accepted) do
    local chunk = assert(load("return " .. case[1], "=typed", "t", environment()))
    local good, value = pcall(chunk)
    if tostring(value) ~= case[2] then
      complaints[#complaints + 1] = case[1] .. "  ->  " .. tostring(value)
    end
  end
  if #complaints > 0 then error(table.concat(complaints, "\n"), 0) end
  expect(#complaints):equals(0)
end)

-- ── errors at run time ─────────────────────────────────────────────────────────────────────────────────────

local errors = {
  -- numbers and functions
  { '("%.4f"):format(x)', "takes a number, not the expression x", "evaluate" },
  { '("%d"):format(A)', "not a matrix", "m[1]" },
  { "math.sin(x)", "math.sin takes numbers, not the expression x", "sin takes expressions" },
  { "math.abs(x - 1)", "abs takes expressions" },
  { "math.floor(x)", "math.floor takes numbers" },
  { "x(0)", "is an expression and no function", "sol(x, t)" },
  { "x''", "x.ddot" },
  { "sol(1)", "expected an expression", "sol(x, 1)" },
  { "mat{1, 2; 3, 4}", "mat{{1, 2}, {3, 4}}" },
  { "mat{x, y}", "mat{{1, 2}, {3, 4}}", "vec{1, 2}" },
  { "lagrange{ q = q, T = 0, V = 0, inputs = { u = -x } }", "dae{ model, F ~" },
  { "dae{ der(x) ~ u }:integrate{ start = { x = 1 }, to = 1, inputs = { u = -10*x } }",
    "dae{ model, u ~ -10 x }" },
  -- derivatives and equations
  { "diff(x, t)", "der(e)" },
  { "diff(x^2*y, t)", "der(e)" },
  -- methods of integration
  { "decay:integrate { start = { x = 1 }, to = 1, method = 'ode45' }", 'method = "dopri5"' },
  { "decay:integrate { start = { x = 1 }, to = 1, method = 'RK45' }", 'method = "dopri5"' },
  { "decay:integrate { start = { x = 1 }, to = 1, method = 'ode15s' }", 'method = "bdf"' },
  { "decay:integrate { start = { x = 1 }, to = 1, method = 'LSODA' }", 'method = "bdf"' },
  { "decay:integrate { start = { x = 1 }, to = 1, method = 'ode23s' }", 'method = "rodas"' },
  { "decay:integrate { start = { x = 1 }, to = 1, method = 'ode23' }", "bogacki_shampine" },
  { "decay:integrate { start = { x = 1 }, to = 1, method = 'dassl' }", 'method = "bdf"' },
  { "decay:integrate { start = { x = 1 }, too = 1, frm = 2 }", "unknown options 'frm', 'too'" },
  -- members
  { "sol.x", "sol(x)" },
  { "sol.y", "sol(x)" },
  { "sol.time", "sol.t" },
  { "sol.start", "sol:state(t)" },
  { "moved:integrate { start = { x = 1 }, to = 2, k = 5 }", "params = { k = 1 }" },
  { "dae { der(x) ~ -kk*x }", 'A parameter is kk = param("kk", 1)' },
  { "series(sin(x), x)", "connects systems" },
  { "laplace(exp(-x))", "laplace_transform(e, t, s)" },
  { "sqrt(2):value()", "evaluate(e)" },
  { "float(sqrt(2))", "evaluate(e)" },
  { "scatter({1, 2}, {3, 4})", 'style = "points"' },
  { "stepinfo(G)", "r.overshoot" },
  { "bode(G, G)", "overlay(bode(G):plot(), bode(H):plot())" },
  { "sol[1]", "sol.t[1]" },
  { "#sol", "#sol.t" },
  { "sol.events()", "an entry of a list is events[1]" },
  { "sol:events()", "without ( )" },
  { "moved.k", "sys.values.k", "sys:with{ k = 2 }" },
  { "moved.x", "is a variable of the model" },
  { "eigen(A)", "eig(A)" },
  { "eigenvalues(A)", "eig(A)" },
  { "eig(G)", "G:poles()" },
  { "eig(decay)", "sys:linearize(at)" },
  { "(bode(decay))", "sys:linearize(at)" },
  { "(bode(ss({{-1}}, zeros(1, 0), {{1}}, zeros(1, 0))))", "the system has no input" },
  { "clear()", "reset()" },
  { "clc()", "Ctrl-L" },
  { "(sweep(moved, { start = { x = 1 }, to = 1, samples = 10, params = { k = normal(1, 0.1) } }))",
    "runs = 1000" },
  { "A:max()", "max(A)" },
  { "A:sum()", "sum(A)" },
  { "decay:simulate()", "sys:integrate{" },
  { "decay:solve()", "sys:integrate{" },
  { "decay.states", "sys.differential" },
  { "decay:subs { x = 1 }", "sys:with{" },
  { "x:subs { x = 1 }", "subs(e" },
  { "x:diff(x)", "diff(e, x)" },
  { "x:sin()", "sin(…)" },
  { "A.transpose", "A.T" },
  { "A:inv()", "inv(A)" },
  { "A:det()", "det(A)" },
  { "A.shape", "A.rows" },
  { "decay.integrate()", "before the colon" },
  { "decay.reduce()", "before the colon" },
  { "free.matrix_form.b", "form.c" },
  { "free.matrix_form.x", "form.unknowns" },
  { "tf(decay)", "linearize" },
  { "ss(decay)", "linearize" },
  { "zpk(decay)", "linearize" },
  { "sol:drift():csv 'x.csv'", "a drift has no field or method 'csv'" },
  { "sol:drift():plot()", "typed:1: a drift has no method 'plot'" },
  { "sol:stats():plott()", "a stats has no field or method 'plott'" },
  { "G:step():csv 'x.csv'", "has no field or method 'csv'" },
  -- names of other languages
  { "poles(G)", "it is a method", ":poles()" },
  { "index(decay)", "it is a method", ":index()" },
  { "simulate(decay)", "sys:integrate{" },
  { "(roots({ 1, 0, -1 }))", "roots(x^2 - 2, x)" },
  { "fsolve(x^2 - 2)", "newton" },
  { "ode { der(x) ~ -x }", "dae{" },
  { "ode45(decay)", "sys:integrate{" },
  { "odeint(decay)", "sys:integrate{" },
  { "solve_ivp(decay)", "sys:integrate{" },
  { "dsolve(decay)", "sys:integrate{" },
  { "syms 'x y'", 'vars "x y"' },
  { "symbols 'x y'", 'vars "x y"' },
  { "Symbol 'x'", 'var "x"' },
  { "True", "write true" },
  { "False", "write false" },
  { "None", "write nil" },
  { "null", "write nil" },
  { "NaN", "0/0" },
  { "Inf", "math.huge" },
  { "disp(x)", "print(x)" },
  { "printf 'a'", "print(" },
  { "fprintf 'a'", "print(" },
  { "transpose(A)", "A.T" },
  { "length(b)", "#x" },
  { "numel(b)", "#x" },
  { "size(A)", "A.rows" },
  { "array { 1, 2 }", "vec{1, 2}" },
  { "range(3)", "for i = 1, n do" },
  { "np.array", "vec{1, 2}" },
  { "plt.plot", "plot(x, y" },
  { "xlabel 'x'", "plot(x, y" },
  { "savefig 'a.svg'", ":save" },
  { "lsqnonlin(x)", "gauss_newton" },
  { "linsolve(A, b)", "solve(A, b)" },
  { "try(x)", "pcall" },
  { "quit()", "os.exit()" },
  { "tic()", "os.clock()" },
  { "str(x)", "tostring(x)" },
  { "typeof(x)", "help(x)" },
  { "Derivative(x, t)", "der(x)" },
  { "Eq(x, y)", "lhs ~ rhs" },
  { "lambda(x)", "function(x)" },
  { "Function 'f'", 'func "f"' },
  { "TransferFunction({1}, {1, 1})", "tf(" },
  -- options of other programs
  { "decay:integrate { start = { x = 1 }, tspan = { 0, 1 } }", "to = 10 is the end" },
  { "decay:integrate { x0 = 1, to = 1 }", "start = { x = 1 }" },
  { "decay:integrate { start = { x = 1 }, to = 1, solver = 'radau' }", 'method = "radau"' },
  { "decay:integrate { start = { x = 1 }, to = 1, RelTol = 1e-6 }", "rtol = 1e-6" },
  { "decay:integrate { start = { x = 1 }, to = 1, AbsTol = 1e-6 }", "atol = 1e-9" },
  { "decay:integrate { start = { x = 1 }, to = 1, t_eval = { 0, 1 } }", "times = linspace" },
  { "decay:integrate { start = { x = 1 }, to = 1, saveat = 0.1 }", "times = linspace" },
  { "decay:integrate { start = { x = 1 }, to = 1, step = 0.1 }", "dt = 0.01" },
  { "decay:integrate { start = { x = 1 }, to = 1, p = { k = 1 } }", "params = { m = 2 }" },
  { "decay:integrate { start = { x = 1 }, to = 1, callback = print }", "events = {" },
  { "decay:integrate { start = 1, to = 1 }", "expected a start or table", "{ x = 1, [x.dot] = 0 }" },
  { "decay:integrate(0, 1)", "expected a table of options" },
  { "(plot(sol, { x }, { linewidth = 2 }))", "width = 2" },
  { "(plot(sol, { x }, { ls = '--' }))", 'dash = "dashed"' },
  { "(plot(sol, { x }, { c = 'red' }))", 'colour = "red"' },
  { "(plot(sol, { x }, { figsize = { 8, 5 } }))", "size = { 800, 500 }" },
  { "(plot(sol, { x }, { loc = 'best' }))", 'legend = "top left"' },
  { "(plot(sol, { x }, { yscale = 'log' }))", "ylog = true" },
  { "(plot(sol, { x }, { legend = { 'a' } }))", "expected a boolean or string" },
  -- more names of other languages
  { "pole(G)", "G:poles()" },
  { "isstable(G)", "G:poles()" },
  { "ssdata(G)", "G:ss()" },
  { "tfdata(G)", "G:tf().num" },
  { "vpa(sqrt(2))", "evaluate(e)" },
  { "N(sqrt(2))", "evaluate(e)" },
  { "lambdify(x, x^2)", "fn({ x, y }, e)" },
  { "round(3.5)", "math.floor(x + 0.5)" },
  { "sort { 2, 1 }", "table.sort" },
  { "zip({}, {})", "a[i], b[i]" },
  { "where(x)", "ifelse(" },
  { "when(x)", "events = {" },
  { "reinit(x, 1)", "reset = {" },
  { "noEvent(x)", "without it" },
  { "homotopy(x, y)", "guess = {" },
  { "Real 'x'", 'var "x"' },
  { "time", "the time is t" },
  { "structural_simplify(decay)", "sys:reduce()" },
  { "remake(decay)", "sys:with{ m = 2 }" },
  { "Tsit5()", 'method = "tsit5"' },
  { "ode_solve(decay)", "sys:integrate{" },
  { "resid(G, G)", "mod:validate(d)" },
  { "ssest(G)", "n4sid(d, 2)" },
  { "fplot(sin(t))", "plot(sin(x), { -3, 3 })" },
  { "format 'long'", "%.10g" },
  { "iddata({ 1, 2 }, { 1, 2 }, 0.1)", "expected 1 argument, got 3", "iddata{ y =" },
  { "iddata { y = { 1, 2 }, u = { 1, 2 } }.InputData", "d.u" },
  { "iddata { y = { 1, 2 }, u = { 1, 2 } }.OutputData", "d.y" },
  -- arguments that no form takes were dropped in silence
  { "norm(b, 3)", '1, 2 or "inf"' },
  { "eye(2, 3)", "expected 1 argument, got 2", "eye(n)" },
  { "(gradient(x*y, x, y))", "expected 2 arguments, got 3", "gradient(e, x)" },
  { "(jacobian({ x*y }, x, y))", "expected 2 arguments, got 3" },
  { "(hessian(x*y, x, y))", "expected 2 arguments, got 3" },
  { "(solve({ x + y ~ 1, x - y ~ 0 }, x, y))", "expected 2 arguments, got 3", "unknowns" },
  { "eig(A, A)", "expected 1 argument, got 2" },
  { "inv(A, 1)", "expected 1 argument" },
  { "linspace(0, 1, 5, 6)", "expected 3 arguments, got 4" },
  { "dot(b, b, b)", "expected 2 arguments, got 3" },
  { "simplify(x, y)", "expected 1 argument, got 2" },
  { "decay:index(1)", "expected a start, got a number", "sys:index([start])" },
  { "decay:integrate({ start = { x = 1 }, to = 1 }, 5)", "expected 1 argument, got 2" },
  { "sol:final(x, 1)", "expected 1 argument, got 2" },
  { "(newton({ r = x^2 - 2, start = 1 }, 3))", "expected 1 argument, got 2" },
  { "subs(x^2, { x = 1 }, 3)", "expected 2 arguments, got 3" },
  -- numbers and functions of other languages
  { "ln(2)", "log(x)" },
  { "log10(100)", "log(x)/log(10)" },
  { "e^2", "exp(1)" },
  { "sec(x)", "1/cos(x)" },
  { "arcsin(x)", "asin" },
  { "heaviside(x)", "ifelse(lt(t, 0), 0, 1)" },
  { "floor(2.5)", "math.floor(x)" },
  { "mod(5, 3)", "a % b" },
  { "factorial(3)", "no such function" },
  { "mean { 1, 2 }", "sum(x)/#x" },
  { "std { 1, 2 }", "sqrt(#x - 1)" },
  { "median { 1, 2 }", "quantile(x, 0.5)" },
  { "horzcat(A, A)", "hstack(A, B)" },
  { "vertcat(A, A)", "vstack(A, B)" },
  { "reshape(A, 1, 4)", "hstack" },
  { "null(A)", "null_space(A)" },
  { "linalg.solve(A, b)", "without a prefix" },
  { "interp1({ 1 }, { 1 }, 1)", "inputs = {" },
  { "polyfit({ 1 }, { 1 }, 1)", "lsq(A, y)" },
  { "conv({ 1 }, { 1 })", "expand(p*q)" },
  { "fft { 1, 2 }", "welch(u)" },
  { "isnan(1)", "x ~= x" },
  { "randint(1, 6)", "math.random(1, 6)" },
  { "rng(1)", "seed(1)" },
  { "eval '1'", "load(text)()" },
  { "trapz({ 1 }, { 1 })", "integral(e, x, a, b)" },
  { "int(x, x)", "integral(e, x, a, b)" },
  { "limit(x, x, 0)", "no such function" },
  { "substitute(x, x, 2)", "subs(e, { x = 2 })" },
  { "grad(x*y)", "gradient(e, { x, y })" },
  { "decay:integrate { start = { x = 1 }, to = 1, method = radau }", 'method = "radau"' },
  { "tf(s)", 's = tf "s"' },
  { "pid(1, 2, 3)", "kp + ki/s" },
  { "decay:integrate { x = 1, to = 10 }", "start = { x = 1 }" },
  { "(plot(sin))", "plot(f, { 0, 1 })" },
  -- what is called, indexed, compared
  { "decay(0)", "sys:integrate{" },
  { "rk.euler(0.1)", "method = rk.euler" },
  { "rk.RK45", "rk.dopri5" },
  { "routh({ 1, 2, 3 })", "G:stability()" },
  { "G:at(1)", "G({ 0, w })" },
  { "G:stepinfo()", "r.settling_time" },
  { "bandwidth(G)", "bode(G)" },
  { "dae { der(q) ~ -q }:init { fix = { [q] = 2 } }", "'q' has 3; one value for all is 2*ones(3, 1)" },
  { "fit(moved, { params = { k = 1 }, data = { 1, 2 }, y = x })", "data = iddata{" },
  { "rk.RK4", "Did you mean 'rk4'?" },
  { "rk.crank_nicolson", "rk.trapezoid" },
  { "rk.bdf2", 'method = "bdf"' },
  { "rk.rk4:order_conditions(5)", "tab:conditions(5)" },
  { "rk.rk4:stability_function()", "tab:stability()" },
  { "delay(x, 1)", "exp(-T*s)", "components.signals.delay" },
  { "integral(exp(-x^2), x, 0, 1)", "no closed form is known for a term with exp(-x²)", "der(J) ~ e" },
  { "rk { A = { { 0 } }, b = { 1 } }", "tableau{" },
  { "A:T()", "without ( )" },
  { "sol[x]", "sol(x)" },
  { "(solve(x^2 - 1 == 0, x))", "lhs ~ rhs" },
  { "decay:integrate { start = { x = 1 }, to = 1, events = { { when = x == 0 } } }", "== compares" },
  { "decay:start()", "sys:init{" },
  { "decay:print()", "print(sys)" },
  { "decay:index_reduction()", "sys:reduce()" },
  { "free.mass_matrix", "sys.M" },
  { "sol.retcode", "sol.status" },
  { "sol.nsteps", "sol:stats()" },
  { "sol:len()", "#sol.t" },
  { "sol:export 'a.csv'", "sol:csv" },
  -- spelling
  { "decay:integrate { start = { xdot = 1 }, to = 1 }", "[x.dot]" },
  { 'var "x y"', "vars" },
  { "lagrange { q = q }", "L = T - V" },
  { "lagrange { q = q, L = 1, T = 2 }", "alone" },
}

test("slips whose error names the remedy", function()
  local complaints = {}
  for _, case in ipairs(errors) do
    local chunk = assert(load("return " .. case[1], "=typed", "t", environment()))
    local good, message = pcall(chunk)
    local text = tostring(message)
    for _, word in ipairs { table.unpack(case, 2) } do
      if good or not text:find(word, 1, true) then
        complaints[#complaints + 1] = ("%s  lacks  %s  ->  %s"):format(case[1], word, text)
      end
    end
    if not good and not text:find "^typed:1: " then
      complaints[#complaints + 1] = case[1] .. "  no place: " .. text
    end
  end
  if #complaints > 0 then error(table.concat(complaints, "\n"), 0) end
  expect(#complaints):equals(0)
end)

-- ── errors of syntax: the program names the remedy below Lua's message ─────────────────────────────────────

local syntax = {
  { "s = { x = 1, x.dot = 0 }", "[x.dot] = 0" },
  { "y = A'", "A.T" },
  { "y = A[1, 2]", "A(1, 2)" },
  { "y = A(:,1)", "A.T[1]" },
  { "function f(x) x^2 end", "function f(x) return x^2 end" },
  { "for i = 1, 3 do i end", "print(x)" },
  { "n = decay:index", "sys:index()" },
  { "y = A\\b", "solve(A, b)" },
  { "v = [1 2 3]", "{ 1, 2, 3 }" },
  { "v = [1, 2, 3]", "{ 1, 2, 3 }" },
  { "% a comment", "--" },
  { "x = 1\n# a comment", "--" },
  { "// a comment", "--" },
  { "for i=1:3 print(i) end", "for i = 1, 3 do" },
  { "for i in list: print(i)", "for i = 1, 3 do" },
  { "y = 2x", "2*x" },
  { "y = -2x", "2*x" },
  { "y = 2 + 3x^2", "2*x" },
  { "y = x.^2", "written ^" },
  { "y = x.*2", "* and ^" },
  { "y = x**2", "written ^" },
  { "if x == 3\n  y = 2\nend", "then" },
  { "while x < 3\n  x = 4\nend", "do" },
  { "if x != 3 then end", "~=" },
  { "if x && y then end", "and" },
  { "if x || y then end", "or" },
  { "x += 1", "x = x +" },
  { "x++", "x = x + 1" },
  { "def f(x):\n  return x", "function f(x)" },
  { "f(x) = x^2 -> 3", "function(x)" },
  { "f = lambda x: x^2", "function(x)" },
  { "f = @(x) x^2", "function(x)" },
  { "f = x => x^2", "function(x)" },
  { "import numpy", "dofile" },
  { "using Plots", "dofile" },
  { "let x = 1", "local x = 1" },
  { "x^2 + y^2 = 1", "lhs ~ rhs" },
  { "clear all", "reset()" },
  { "hold on", "f(x)" },
  { "y = 0:10", "linspace(0, 10, 101)" },
  { "y = x(1:3)", "linspace(0, 10, 101)" },
  { "!ls", "os.execute" },
  { "plot x y", "plot(x, y)" },
  { "print x", "print(x)" },
  { "if a then b() else if c then d() end", "elseif" },
}

test("slips of syntax", function()
  local program, file = os.getenv "PENDULA", os.tmpname()
  if not program then return expect(true):equals(true) end
  local complaints = {}
  for _, case in ipairs(syntax) do
    local out = assert(io.open(file, "w"))
    out:write(case[1], "\n")
    out:close()
    local run = assert(io.popen(("'%s' '%s' 2>&1"):format(program, file)))
    local said = run:read "a"
    run:close()
    local hint = said:match "Lua: (.*)" or ""
    if not hint:find(case[2], 1, true) then complaints[#complaints + 1] = case[1] .. "  ->  " .. said end
  end
  os.remove(file)
  if #complaints > 0 then error(table.concat(complaints, "\n"), 0) end
  expect(#accepted + #errors + #syntax >= 240):equals(true)
end)
