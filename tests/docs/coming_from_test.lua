-- The tables "Coming from …" of the manual: what stands in the right column is typed here, with the places
-- marked … filled in. A new row needs a line.
local before = [[
x, y, e, f = var "x", var "y", var "x"^2*var "y", var "x"^2
sys = dae { der(x) ~ -param("k", 1)*x }
sol = sys:integrate{ start = { x = 1 }, to = 10 }
A, b, a = mat{{1, 2}, {3, 4}}, vec{1, 2}, 1
G = tf({1}, {1, 2, 1})
d = iddata{ y = { 0, 1, 2, 1, 3, 4, 2, 1, 0, 1 }, u = { 1, 2, 1, 3, 2, 1, 0, 1, 2, 1 }, Ts = 1 }
h, v = vars "h v"
ball = dae { der(h) ~ v, der(v) ~ -9.81 }
el = components.electrical
R, C, Pin = el.resistor{ R = 1 }, el.capacitor{ C = 1, v0 = 0 }, el.pin
]]
local run = "sys:integrate{ start = { x = 1 }, to = 1, "
local typed = {
  ['x, y = vars "x y"'] = 'x, y = vars "x y"',
  ["diff(f, x); by time der(f)"] = "assert(diff(f, x) == 2*x) assert(der(f) == 2*x*x.dot)",
  ["sol = sys:integrate{ start = {…}, to = 10 }"] = "assert(sol.status == 'finished')",
  ['the method is chosen; method = "radau", "bdf"'] = run .. "method = 'radau' } "
    .. run .. "method = 'bdf' }",
  ["sys:init{ fix = {…}, guess = {…} }"] = "sys:init{ fix = { x = 1 }, guess = {} }",
  ["sol(x, 2.5)"] = "assert(math.abs(sol(x, 2.5) - math.exp(-2.5)) < 1e-3)",
  ["A*b, solve(A, b), A.T"] = "assert(A*b == vec{5, 11}) assert(A*solve(A, b) == b) assert(A.T(1, 2) == 3)",
  ["mat{{1, 2}, {3, 4}}"] = "assert(mat{{1, 2}, {3, 4}}(2, 1) == 3)",
  ["x[1], x[#x]"] = "assert(b[1] == 1 and b[#b] == 2)",
  ["iddata{ y =, u =, Ts = }, arx(d, { na = 2, nb = 2, nk = 1 })"] = "arx(d, { na = 2, nb = 2, nk = 1 })",
  ["tf({1}, {1, 2, 1}), G:bode()"] = "G:bode()",
  ["-- comment, ~=, not"] = "assert(1 ~= 2 and not false)  -- comment",
  ["for k = 1, 10 do … end"] = "for k = 1, 10 do x = k end",
  ['x = var "x"'] = 'x = var "x"',
  ['param("m", 1, { positive = true })'] = 'm = param("m", 1, { positive = true }) '
    .. "assert(simplify(sqrt(m^2)) == m)",
  ["x.dot or der(x)"] = "assert(x.dot == der(x))",
  ["a ~ b"] = "assert((a ~ x).rhs == x)",
  ["sys:integrate{ start = {…}, to = 10 }"] = run .. "}",
  ["fn({x, y}, e)"] = "assert(fn({x, y}, e)(2, 3) == 12)",
  ["newton{ r =, x =, start = }, gauss_newton{ R =, x =, start = }"] =
    "newton{ r = x^2 - 2, x = x, start = 1 } gauss_newton{ R = { x - 1, x - 2 }, x = {x}, start = {0} }",
  ["x^2"] = "assert((x^2):code())",
  ["x[1], #x"] = "assert(b[1] == 1 and #b == 2)",
  ["nil, true, and not"] = "assert(nil == nil and not false and true)",
  ["pcall(function() … end)"] = "assert(not pcall(function() error 'x' end))",
  ['x = var "x", k = param("k", 1)'] = 'x = var "x" k = param("k", 1)',
  ["der(x) ~ -k*x"] = 'k = param("k", 1) dae{ der(x) ~ -k*x }',
  ['sys:reduce(), sys:reduce "acc"'] = 'sys:reduce() sys:reduce "acc"',
  ['sys:integrate{ start =, to =, method = "tsit5" }'] = run .. "method = 'tsit5' }",
  ['"rodas", "radau", "bdf"'] = run .. "method = 'rodas' }",
  ["events = { { when =, reset = {…} } }"] =
    "ball:integrate{ start = { h = 1, v = 0 }, to = 1, events = { { when = h, direction = -1, "
    .. "reset = { [v] = -v } } } }",
  ["sweep(sys, { params = {…} })"] =
    "assert(#sweep(sys, { start = { x = 1 }, to = 1, params = { k = {1, 2} } }) == 2)",
  ["sys:with{ k = 2 }, or params = {…} for one run"] = "sys:with{ k = 2 } " .. run .. "params = { k = 2 } }",
  ["sys:init{ fix = { x = 1 } }"] = "assert(sys:init{ fix = { x = 1 } }(x) == 1)",
  ["sys:init{ guess = { x = 1 } }"] = "assert(sys:init{ guess = { x = 1 } }(x) == 1)",
  ['m = param("m", 1)'] = 'm = param("m", 1)',
  ["der(x) ~ v"] = "ball:dof()",
  ["ifelse(gt(x, 0), a, b)"] = "assert(evaluate(ifelse(gt(x, 0), 1, 2), { x = 3 }) == 1)",
  ["events = { { when = h, direction = -1, reset = { [v] = -v } } }"] =
    "ball:integrate{ start = { h = 1, v = 0 }, to = 1, "
    .. "events = { { when = h, direction = -1, reset = { [v] = -v } } } }",
  ["sys:reduce(); :trace() shows it"] = "sys:reduce():trace()",
  ['M = component("M", { k = 1 }, function(self) … return { … } end)'] =
    'M = component("M", { k = 1 }, function(self) local w = self:var "w" self:start(w, 1) '
    .. "return { der(w) ~ -self.k*w } end)"
    .. " assert(model{ m = M{} }:dof() == 1)",
  ['connector("pin", { across = { v = "V" }, through = { i = "A" } })'] =
    'connector("pin", { across = { v = "V" }, through = { i = "A" } })',
  ["R = components.electrical.resistor{ R = 100 }"] = "R = components.electrical.resistor{ R = 100 }",
  ["connect(R.n, C.p) in model { R = R, C = C, … }"] =
    "m = model { R = R, C = C, gnd = el.ground{}, connect(R.n, C.p), connect(C.n, R.p, 'gnd.p') } "
    .. "assert(m:dof() == 1)",
  ["components.spatial, components.planar"] = "assert(components.spatial and components.planar)",
  ["components.signals.sampler{ Ts = 0.1 }"] = "components.signals.sampler{ Ts = 0.1 }",
}

test("every line of the tables is true", function()
  local count = 0
  for line in io.open("docs/manual/coming-from.md"):read "a":gmatch "[^\n]+" do
    local here = line:match "^| .- | (.*) |$"
    if here and here ~= "here" then
      local code = typed[(here:gsub("`", ""))]
      if not code then error("coming-from.md: nobody has typed " .. here) end
      local env = setmetatable({}, { __index = _G })
      local good, problem = pcall(assert(load(before .. code, "=" .. here, "t", env)))
      if not good then error(tostring(problem), 0) end
      count = count + 1
    end
  end
  expect(count >= 45):equals(true)
end)

test("the names of other programs lead here", function()
  for name, remedy in pairs { ode45 = "sys:integrate", decic = "sys:init", deval = "sol(x", syms = "vars",
    solve_ivp = "sys:integrate", fsolve = "newton", lambdify = "fn(", Eq = "~", ODEProblem = "dae",
    reinit = "events", np = "vec", remake = "with" } do
    expect(function() return _G[name] end):fails(remedy)
  end
end)
