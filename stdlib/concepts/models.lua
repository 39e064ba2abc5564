-- Concepts of models, index and starts.

concept { name = "model", see = "dae lagrange model",
  words = "system equations dae ode differential equation",
  text = [[A model is a list of equations between unknown functions of time, with parameters and inputs.
    Unknowns whose derivatives occur are differential variables, the others are algebraic. A model is a
    value: every operation (with, reduce, first_order) returns a new one.]],
  example = [[
    x, v = vars "x v"
    m = dae{ der(x) ~ v, der(v) ~ -x }
    return m.kind, m:dof()
  ]],
  gives = "ODE 2" }

concept { name = "index", see = "model:index model:structure model:reduce",
  words = "differentiation index high index index 3",
  text = [[The differentiation index says how often equations must be differentiated until they determine
    the derivatives of all unknowns. 0: an explicit or implicit ODE; 1: algebraic equations that can be
    solved for their unknowns; 3: mechanisms with position constraints. From index 2 on there are hidden
    constraints, and integrators need a reduced form.]],
  example = [[
    x, y, z = vars "x y z"
    pendulum = dae{ der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - 9.81, 0 ~ x^2 + y^2 - 1 }
    return pendulum:index(), pendulum:reduce():index()
  ]],
  gives = "3 0" }

concept { name = "structural index", see = "model:structure",
  words = "signature matrix sigma method pryce pantelides",
  text = [[The index by the pattern of the equations (signature method): fast, but only a bound where terms
    cancel. sys:structure() says whether it is proved to be the differentiation index.]],
  example = [[
    x, z = vars "x z"
    s = dae{ der(x) ~ z, 0 ~ x - sin(t) }:structure()
    return s.structural_index, s.verdict
  ]],
  gives = "2 valid" }

concept { name = "hidden constraints", see = "model:constraints model:init",
  words = "consistency conditions",
  text = [[Conditions on the initial values that follow only after differentiation: the velocity along a
    rod is 0 because its length is constant. sys:constraints() lists them all, with the equation each came
    from.]],
  example = [[
    x, z = vars "x z"
    return #dae{ der(x) ~ z, 0 ~ x - sin(t) }:constraints()
  ]],
  gives = "1" }

concept { name = "index reduction", see = "model:reduce model:trace",
  words = "reduce reduction form",
  text = [[A form of lower index with the same solutions: "acc" differentiates constraints, "ggl" and
    "project" keep them, "baumgarte" lets errors decay, "dummy" and "minimal" leave as many states as there
    are degrees of freedom, "ode" is explicit. reduce() without a form chooses one, trace() shows every
    step.]],
  example = [[
    x, z = vars "x z"
    return dae{ der(x) ~ z, 0 ~ x - sin(t) }:reduce("acc").form
  ]],
  gives = "acc" }

concept { name = "degrees of freedom", see = "model:dof model:init",
  words = "dof number of free initial values",
  text = [[The number of initial values that can be chosen freely. A pendulum in Cartesian coordinates
    has four differential variables, but two degrees of freedom.]],
  example = [[
    x, y, z = vars "x y z"
    return dae{ der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - 9.81, 0 ~ x^2 + y^2 - 1 }:dof()
  ]],
  gives = "2" }

concept { name = "consistent start", see = "model:init start start:ledger",
  words = "initial values initial value initialization initialisation consistency "
    .. "initial condition conditions",
  text = [[Initial values that satisfy all equations, hidden ones included. init takes fixed values
    and guesses, and computes the rest; errors name the conflict or the values that are still free.]],
  example = [[
    x, y, z = vars "x y z"
    pendulum = dae{ der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - 9.81, 0 ~ x^2 + y^2 - 1 }
    at = pendulum:init{ fix = { x = 0.6, [x.dot] = 0 }, guess = { y = -0.8 } }
    return at(y), at(z)
  ]],
  gives = "-0.8 7.848" }

concept { name = "drift", see = "solution:drift model:reduce",
  words = "drift off constraint violation",
  text = [[Differentiated constraints are kept only up to errors of integration: C(t) grows, linearly or
    worse. Forms "project" and "ggl" have no drift, "baumgarte" lets it decay. sol:drift() compares each
    constraint with the law of its form.]],
  example = [[
    x, z = vars "x z"
    low = dae{ der(x) ~ z, 0 ~ x - sin(t) }:reduce "acc"
    sol = low:integrate{ start = { x = 0 }, to = 10, rtol = 1e-10, atol = 1e-10 }
    return math.abs(sol(x - sin(t), 10)) < 1e-6
  ]],
  gives = "true" }

concept { name = "parameters", see = "param params model:with",
  words = "parameter values constants",
  text = [[Constants with a name. A value belongs to the model: with{ m = 2 } makes a new model, params =
    { m = 2 } holds for one call, and equations keep the symbol.]],
  example = [[
    x, k = var "x", param("k", 1)
    m = dae{ der(x) ~ -k*x }
    return m:with{ k = 3 }:integrate{ start = { x = 1 }, to = 1 }(k)[1]
  ]],
  gives = "3.0" }

concept { name = "inputs", see = "input inputs model:integrate",
  words = "input forcing control signal",
  text = [[Known functions of time, given when a model is integrated: an expression in t, a Lua function,
    data or samples. An equation for the input of a model inside dae{ … } closes a loop: dae{ plant, u ~
    -10*x }.]],
  example = [[
    x, u = var "x", input "u"
    return dae{ der(x) ~ u }:integrate{ start = { x = 0 }, to = 2, inputs = { u = t } }(x, 2)
  ]],
  gives = "2.0" }

concept { name = "nested models", see = "dae",
  words = "compose composition subsystem feedback loop closed loop",
  text = [[A model may stand among the equations of another one, whose equations then determine its
    inputs: so a controller is connected to a plant without repeating the plant's equations.]],
  example = [[
    x, u = var "x", input "u"
    plant = dae{ der(x) ~ x + u }
    closed = dae{ plant, u ~ -3*x }
    return closed:integrate{ start = { x = 1 }, to = 1, rtol = 1e-9, atol = 1e-9 }(x, 1) < 0.14
  ]],
  gives = "true" }

concept { name = "units and labels", see = "var param",
  words = "unit label axis names",
  text = [[A symbol may have a unit and a description for axes and ledgers. Units are shown; sys:units()
    checks equations for them.]],
  example = [[
    s = var("s", { unit = "m", text = "position" })
    return plot({ 0, 1 }, { 0, 1 }, { ylabel = s })
  ]],
  gives = "figure: 1 series, 2 points" }

concept { name = "derivatives", see = "der diff jacobian gradient",
  words = "derivative der diff dot prime differentiate",
  text = [[der(x), x.dot and the name "x'" are the derivative by time; der(e) follows the chain rule.
    diff(e, x) is the partial derivative, in which other symbols stay constant.]],
  example = [[
    x, y = vars "x y"
    return der(x^2*y), diff(x^2*y, x)
  ]],
  gives = "2 x y x′ + x² y′ 2 x y" }

concept { name = "lagrange mechanics", see = "lagrange generalized_force model:trace",
  words = "lagrangian euler lagrange mechanics energy multipliers",
  text = [[lagrange{ q =, T =, V =, C = } derives the equations of motion from energies and constraints:
    W(q) q″ + (∂C/∂q)ᵀ z = rhs. The multipliers z are the constraint forces. trace() prints the derivation.]],
  example = [[
    th = var "theta"
    m, g, l = params "m=1 g=9.81 l=1"
    p = lagrange{ q = th, T = m*l^2*th.dot^2/2, V = -m*g*l*cos(th) }
    return p:index(), p:dof()
  ]],
  gives = "0 2" }

concept { name = "piecewise equations", see = "ifelse lt all any",
  words = "ifelse switch friction contact branch",
  text = [[ifelse(lt(x, 0), a, b) is an expression with branches. Integrators stop at the border, locate
    it and go on with the other branch.]],
  example = [[
    x = var "x"
    s = dae{ der(x) ~ ifelse(lt(x, 1), 2, 1) }:integrate{ start = { x = 0 }, to = 1.5 }
    return ("%.6f"):format(s(x, 1.5))
  ]],
  gives = "2.000000" }

concept { name = "linearization", see = "model:linearize ss",
  words = "linearize operating point small signal",
  text = [[The linear system of small deviations from a point: sys:linearize(at) gives a state space with
    the variables' names, for models of any index.]],
  example = [[
    th = var "theta"
    sys = dae{ der(th, 2) ~ -4*sin(th) }
    return sys:linearize(sys:init{ fix = { [th] = 0, [th.dot] = 0 } }):poles()
  ]],
  gives = "poles: ±2 i" }

concept { name = "pencil", see = "model:pencil dae.linear",
  words = "weierstrass matrix pencil finite modes linear dae",
  text = [[A linear model E x′ = A x + B u is described by sE - A: its determinant, finite modes and the
    Weierstrass form with nilpotent blocks, exactly.]],
  example = [[
    x, z = vars "x z"
    return dae{ der(x) ~ -2*x + z, 0 ~ z - x }:pencil().det
  ]],
  gives = "-s - 1" }
