-- Texts of refusals that no other file asserts: the culprit, what was expected, the way out.
local x, y, z, w = vars "x y z w"
local function refused(name, f, text)
  test(name, function() expect(f):fails(text) end)
end

refused("a state that is no variable", function() return dae.semi_explicit { x = { param "a" },
  f = { x } } end,
  "x must be made of variables (var \"x\"), got 'a'")
refused("an algebraic variable that is an expression", function()
  return dae.semi_explicit { x = x, z = x + 2*z, f = z - x } end,
  "z must be made of variables (var \"z\"), got 'x + 2 z'")
refused("a state of an implicit model that is an expression", function()
  return dae.implicit { x = 2*x, F = der(x) - x } end,
  "x must be made of variables (var \"x\"), got '2 x'")
refused("an input that is an expression", function()
  return dae.semi_explicit { x = x, u = x + 1, f = -x } end,
  "u must be made of variables (var \"u\"), got 'x + 1'")
refused("a state that stands there twice", function()
  return dae.semi_explicit { x = { x, x }, f = { x, x } } end, "x contains x twice")
refused("no equations", function() return dae.semi_explicit { x = { x } } end,
  "expected { x =, z =, u =, f =, g = }: x and f are required")
refused("a matrix is missing", function() return dae.linear { E = { { 1 } } } end,
  "expected { E =, A =, B =, u = }: E and A are required")
refused("matrices of different sizes", function() return dae.linear { E = { { 1, 0 }, { 0, 1 } },
  A = { { 1 } } } end,
  "E is 2×2, but A is 1×1; both must have the same size")
refused("B of another height", function() return dae.linear { E = eye(2), A = eye(2), B = { { 1 } } } end,
  "B has 1 rows, but E has 2")
refused("an equation without a symbol", function()
  return dae { der(x) ~ -x, vec { x - x + 1 } ~ vec { 0 } } end,
  "contains no symbol: it reads 0 = 1, which never holds")
refused("nothing unknown", function() return dae { param "a=1" ~ 0 } end,
  "the equations contain no unknown; declare unknowns with var or vars")
refused("a variable and a parameter of one name", function() return dae { der(x) ~ -x + param "x" } end,
  "two different symbols are called 'x' in this model; one is a variable, parameter or input of another kind: rename one")
refused("a declared algebraic variable with a derivative", function()
  return dae.semi_explicit { x = { x }, z = { z }, f = { -x }, g = { der(z) - x } }
end, "'z' was declared algebraic (z), but its derivative occurs; move it to x")
refused("a form that does not exist", function() return dae { der(x) ~ -x }:reduce "akk" end,
  "unknown form 'akk'. Forms: acc, ggl, baumgarte, project, dummy, minimal, ode")
refused("ggl of index 4", function()
  return dae { der(x) ~ y, der(y) ~ z, der(z) ~ w, 0 ~ x - sin(t) }:reduce "ggl"
end, "has to be differentiated 3 times, but the form is made for two (positions, velocities); use reduce \"acc\" or \"dummy\"")
refused("baumgarte with a gain that amplifies", function()
  return dae { der(x) ~ y, der(y) ~ -w*x, 0 ~ x^2 - 1 }:reduce("baumgarte", { alpha = -1 })
end, "must be positive: otherwise the violation of a constraint does not decay")
refused("a start of a symbol that is not there", function()
  return dae { der(x) ~ -x }:init { fix = { [y] = 1 } } end,
  "fix: 'y' is not an unknown of this model")
refused("a guess of a symbol that is not there", function()
  return dae { der(x) ~ -x }:init { fix = { [x] = 1 }, guess = { [param "zz"] = 1 } } end,
  "guess: 'zz' is not an unknown of this model")

refused("an equation too few", function() return dae { der(x) ~ y, der(y) ~ z + x }:index() end,
  "the model has 2 equations for 3 unknowns\n  under-determined: 2 equations (1), (2) for 3 unknowns x, y, z\n"
  .. "  Add an equation, or let one of the unknowns be given: z = input \"z\".")
refused("an equation too many", function() return dae { der(x) ~ y, y ~ 1, x ~ 2 }:reduce "acc" end,
  "the model has 3 equations for 2 unknowns\n  over-determined: 3 equations (1), (2), (3) for 2 unknowns x, y\n"
  .. "  Remove one of the equations that are too many, or declare what should follow from it with var.")
refused("two equations for one combination", function()
  return dae { der(x) ~ y + z, 0 ~ x*(y + z) - 1, 0 ~ (y + z)^2 - x }:reduce "acc" end,
  "no index can be given: the system Jacobian of the structural analysis is singular (rank 2 of 3)")
refused("equations that contradict each other", function()
  return dae { der(x) + der(y) ~ 1, 2*der(x) + 2*der(y) ~ 3 }:index() end,
  "(2) - 2 (1):  0 = -1   the equations contradict each other")
refused("equations that depend on each other", function()
  return dae { der(x) + der(y) ~ x, 2*der(x) + 2*der(y) ~ 2*x }:reduce() end,
  "the pencil sE - A is singular (det(sE - A) = 0 for every s)")
refused("the pencil of a nonlinear model", function() return dae { der(x) ~ x^2 }:pencil() end,
  "equation (1) 'x′ = x²' is not linear: the term x² is not a constant times x; sys:linearize(at) makes a linear model at a point")
refused("the pencil of a time-varying model", function() return dae { der(x) ~ t*x }:pencil() end,
  "the coefficient -t of x in equation (1) 'x′ = t x' is not constant: it depends on t")
refused("modes of a pencil with an open parameter", function()
  return dae { der(x) ~ param "a"*x }:pencil().modes end,
  "the rest needs numbers, as in sys:with{ a = 1 }:pencil()")
local oscillator = dae { der(x) ~ y, der(y) ~ -2*x + input "u" }
refused("a forcing without a closed answer", function()
  return oscillator:pencil():solution({ x = 0, y = 0 }, { inputs = { u = tan(t) } }) end,
  "the forcing tan(t) is not a polynomial, exponential, sine or cosine of t; use sys:integrate{ … } for it")
refused("a forcing that grows like a mode with a root", function()
  return dae { der(x) ~ y, der(y) ~ 2*x + input "u" }:pencil():solution({ x = 0, y = 0 },
    { inputs = { u = exp(sqrt(2)*t) } })
end, "the forcing exp(√2 t) is in resonance with a mode of the system, and its exponent is not rational; use rational numbers")
refused("a start of a derivative", function() return oscillator:pencil():solution { [der(x)] = 1 } end,
  "x0: 'x′' is not a state of this system; its states are x, y")
refused("too many initial values", function() return oscillator:pencil():solution { 1, 2, 3 } end,
  "x0 has 3 entries for 2 unknowns; a table { x = 1 } gives only some of them")
refused("a column of another size", function() local q = var("q",
  2) return dae { der(q) ~ -q }:pencil():solution { q = { 1, 2, 3 } } end,
  "x0.q has 3 entries, 'q' has 2")
refused("a parameter that is not there", function()
  return dae { der(x) ~ -param("k", 1)*x }:with { kk = 2 } end,
  "parameters: unknown symbol 'kk'. Did you mean 'k'?")
refused("baumgarte with a gain that moves", function()
  return dae { der(x) ~ y, der(y) ~ -w*x, 0 ~ x^2 - 1 }:reduce("baumgarte", { alpha = x })
end, "alpha = x must be a number or made of parameters")
refused("a name that is no string", function() return dae { der(x) ~ -x, name = 3 } end,
  "name must be a string, got a number")
refused("a root with a vertical slope", function()
  return dae { der(x) ~ 1, 0 ~ sqrt(z) - x }:init { fix = { x = 1/2 }, guess = { z = 0 } } end,
  "equation (2)  0 = √z - x has no finite derivative with respect to z at z = 0; give a guess where it has one: guess = { z = … }")
refused("dummy of an ODE", function() return dae { der(x) ~ -x }:reduce "dummy" end,
  "no equation that has to be differentiated; it can be integrated as it stands")
refused("dummy at something else", function() return dae { der(x) ~ y, 0 ~ x - sin(t) }:reduce("dummy",
  { at = 3 }) end,
  "at = sys:init{ … })")
refused("dummy at the start of another model", function()
  return dae { der(x) ~ y, 0 ~ x - sin(t) }:reduce("dummy",
    { at = dae { der(w) ~ -w }:init { fix = { w = 1 } } })
end, "start has no value for 'x': it belongs to another model; make one with sys:init{ … }")
refused("minimal of an ODE", function() return dae { der(x) ~ -x }:reduce "minimal" end,
  "no constraint that has to be differentiated: all its states are independent; it can be integrated")
refused("project of an ODE", function() return dae { der(x) ~ -x }:reduce "project" end,
  "no constraint that could drift, so that there is nothing to project onto; it can be integrated as it stands")
refused("ggl of equations that are regularised", function()
  local a = param("a", -0.5)
  return dae { der(x) + a*t*der(y) + (1 + a)*y ~ sin(t), x + a*t*y ~ cos(t) }:reduce "ggl"
end, "the regularised equations have index 1 and no constraint that has to be differentiated; sys:reduce() gives them")
refused("ode of algebraic equations", function() return dae { 0 ~ x - 1 }:reduce "ode" end,
  "the model has no differential variable; its equations are algebraic, and sys:init{…} solves them")

-- parameters
local decay = dae { der(x) ~ -param "a"*x }
refused("a parameter without a value", function() return decay:init { fix = { x = 1 } } end,
  "parameter 'a' has no value; give one: sys:with{ a = … } or params = { a = … }")
refused("a parameter of another model, by its name", function()
  return decay:with { zz = 1 } end, "parameters: unknown symbol 'zz'")
refused("a parameter of another model, by its symbol", function() return decay:with { [param "b"] = 1 } end,
  "parameters: unknown symbol 'b'")
refused("a parameter of another model in params of init, by its symbol", function()
  return decay:init { fix = { x = 1 }, params = { a = 1, [param "zz"] = 1 } } end,
  "params: unknown symbol 'zz'")
refused("a parameter of another model in params of integrate, by its symbol", function()
  return decay:integrate { start = { x = 1 }, to = 1, params = { a = 1, [param "zz"] = 1 } } end,
  "params: unknown symbol 'zz'")
for _, value in ipairs { 1, { 1, 2 } } do
  refused("a parameter of another model in params of sweep, by its symbol", function()
    return sweep(decay, { start = { x = 1 }, to = 1, params = { a = { 1, 2 }, [param "zz"] = value } }) end,
    "params: unknown symbol 'zz'")
end
refused("more right sides than states", function() return dae.semi_explicit { x = { x }, f = { x, y } } end,
  "f has 2 rows, but there is 1 state in x")
refused("fewer right sides than states", function() return dae.semi_explicit { x = { x, y }, f = { x } } end,
  "f has 1 row, but there are 2 states in x")
refused("a constraint that is not there", function()
  return dae { der(x) ~ y, 0 ~ x - sin(t) }:constraints()[3] end,
  "there is 1 constraint; number 3 does not exist")

-- starts
for _, form in ipairs { "ode", "project" } do
  refused("a start where form " .. form .. " has divided by zero", function()
    local low = dae { der(y) + y ~ 0, y*z ~ 0, der(z) ~ y - x - z }:reduce(form)
    return low:init { guess = { y = 0.7, z = 0.9 } }
  end, "the start lies on a singular point (y = 0), where form \"" .. form .. "\" is not equivalent to the model")
end
local bob = dae { der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - 9.81, 0 ~ x^2 + y^2 - 1 }
refused("a conflict names what violates the equation that is shown", function()
  return bob:init { fix = { x = 1, y = 1, [x.dot] = 2 } } end,
  "conflict: x = 1, y = 1\n  violated: (3):  0 ≠ 1 = x² + y² - 1")
refused("a conflict of three among five", function()
  return dae { 0 ~ x + y + z - w, der(x) ~ -x, der(y) ~ -y, der(z) ~ z }
    :init { fix = { x = 1, y = 2, z = 3, w = 7, [x.dot] = -1 } } end,
  "conflict: x = 1, y = 2, z = 3, w = 7\n  violated: (1):  0 ≠ -1 = x + y + z - w")
refused("a condition between unknowns as a key of fix", function()
  return dae { der(x) ~ -x, der(y) ~ x }:init { fix = { x = 1, [x - y] = 2 } } end,
  "a key of fix must be a symbol, not the expression x - y; give it a name, an unknown d = var \"d\" with the "
  .. "equation d ~ x - y in the model, and write fix = { d = … }")
test("what the refusal of a condition names gives the start", function()
  local d = var "d"
  local at = dae { der(x) ~ -x, der(y) ~ x, d ~ x - y }:init { fix = { x = 1, d = 2 } }
  expect(at(y)):near(-1, 1e-15)
end)
