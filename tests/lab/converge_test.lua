-- converge: slopes are orders, on ODEs and on DAEs as they stand.
local x, y, z, y1, y2 = vars "x y z y1 y2"
local decay = dae { der(x) ~ -2*x }
local steps = { 0.1, 0.05, 0.025 }

test("published end values: x' = -2x to t = 2 with dt = 0.1", function()
  local published = { 0.0115292150460685, 0.0188919613181312, 0.0183167933693744, 0.01831580208277 }
  local c = converge(decay, { start = { x = 1 }, to = 2,
    methods = { rk.euler, rk.midpoint, rk.rk4, rk.gauss(2) },
                              dt = { 0.1, 0.05 }, exact = exp(-2*t) })
  for i, value in ipairs(published) do
    expect(c.errors[i][1]):near(math.abs(value - math.exp(-4)), 1e-14)
  end
  expect(c.orders):equals { 1, 2, 4, 4 }
  expect(c.dt):equals { 0.1, 0.05 }
  expect(c.methods[3]):equals "rk4"
end)

test("exam 5(b): Gauss with s = 1, 2, 3 stages has slopes 2, 4, 6", function()
  local c = converge(decay, { start = { x = 1 }, to = 2, methods = { rk.gauss(1), rk.gauss(2), rk.gauss(3) },
    dt = steps,
                              exact = exp(-2*t) })
  for i = 1, 3 do
    expect(c.slopes[i]):near(2*i, 0.05)
    expect(c.orders[i]):equals(2*i)
  end
  expect(tostring(c):find "gauss%(3%) +6 +4.66e%-11" ~= nil):is_true()
  expect(tostring(plot(c)):find "6 series" ~= nil):is_true()
end)

test("without an exact solution: the same slopes against half the step, errors within the leading term",
  function()
  local sys = dae { der(x) ~ t*x^2 }
  local run = { start = { x = 0.5 }, to = 1, methods = { rk.heun, rk.rk4 }, dt = { 1/16, 1/32, 1/64 } }
  local own = converge(sys, run)
  run.exact = 1/(2 - t^2/2)
  local exact = converge(sys, run)
  for i = 1, 2 do
    expect(own.slopes[i]):near(own.orders[i], 0.15)
    expect(own.errors[i][3] / exact.errors[i][3]):near(1, 0.05)
  end
  run.exact, run.reference = nil, "self"
  expect(converge(sys, run).errors):equals(own.errors)
  run.reference = sys:integrate { start = { x = 0.5 }, to = 1, method = rk.gauss(5), dt = 1/32 }
  expect(converge(sys, run).errors[2][2] / exact.errors[2][2]):near(1, 1e-3)
end)

test("index 2 as it stands: Jay's problem has order 3 in y and 2 in z with two Radau stages, 5 and 3 with three", function()
  local jay = dae { der(y1) ~ y1*y2*z, der(y2) ~ y1^2*y2^2 - 3*y2^2*z, 0 ~ y1^2*y2 - 1 }
  local at = jay:init { fix = { y1 = 1 }, guess = { y2 = 1, z = 1 } }
  local c = converge(jay, { start = at, to = 1, methods = { rk.radau(2), rk.radau(3) }, dt = steps,
    direct = true,
                            exact = { y1 = exp(t), [y2] = exp(-2*t), z = exp(2*t) } })
  expect(c.slopes[1]):near(3, 0.15)
  expect(c.slopes[2]):near(5, 0.15)
  expect(c.algebraic.slopes[1]):near(2, 0.15)
  expect(c.algebraic.slopes[2]):near(3, 0.15)
  expect(c:of(z).slopes):equals(c.algebraic.slopes)
  expect(c:of(y1).names):equals { "y₁" }
  expect(tostring(c):find "order reduction" ~= nil):is_true()
  expect(function() c:of "w" end):fails "'w' was not measured; measured are y1, y2, z"
end)

test("adaptive methods: the error against the tolerance", function()
  local c = converge(decay, { start = { x = 1 }, to = 2, methods = { "dopri5" }, rtol = { 1e-4, 1e-6, 1e-8 },
                              exact = exp(-2*t), over = "all" })
  expect(c.slopes[1]):near(1, 0.3)
  for k = 1, 3 do expect(c.errors[1][k] <= 10*c.dt[k]):is_true() end
end)

test("a method that is exact for the problem has no slope", function()
  local c = converge(dae { der(x) ~ 2*t }, { start = { x = 0 }, to = 2, methods = { rk.rk4 },
    dt = { 0.5, 0.25 }, exact = t^2 })
  expect(c.slopes[1]):equals(false)
  expect(tostring(c):find "rounding" ~= nil):is_true()
end)

test("the costs are counted", function()
  local c = converge(decay, { start = { x = 1 }, to = 2, methods = { rk.rk4 }, dt = { 0.1, 0.05 },
    exact = exp(-2*t) })
  expect(c.steps[1]):equals { 20, 40 }
  expect(c.evaluations[1][2] >= 160):is_true()
end)

test("errors say what to write instead", function()
  local function fails(change, message)
    local o = { start = { x = 1 }, to = 1, methods = { rk.rk4 }, dt = { 0.1, 0.05 } }
    for key, value in pairs(change) do o[key] = value ~= "absent" and value or nil end
    expect(function() converge(decay, o) end):fails(message)
  end
  fails({ to = "absent" }, "the end is missing; give to = 2")
  fails({ start = "absent" }, "the start is missing")
  fails({ methods = "absent" }, "the methods are missing; give methods = { rk.rk4, rk.gauss(2) }")
  fails({ methods = {} }, "methods is empty")
  fails({ methods = { 3 } }, "methods[1] must be a tableau or the name of a method, not a number")
  fails({ methods = { "rk5" } }, "Did you mean 'rk4'?")
  fails({ dt = "absent" }, "the steps are missing")
  fails({ dt = { 0.1 } }, "a slope needs at least two values")
  fails({ dt = { 0.1, -1 } }, "dt[2] = -1; it must be a positive number")
  fails({ dt = { 0.1, 0/0 } }, "it must be a positive number")
  fails({ dt = { 0.1, 0.1 } }, "dt contains 0.1 twice")
  fails({ rtol = { 1e-3, 1e-6 } }, "not both")
  fails({ exact = { 1, 2 } }, "exact gives 2 expressions for 1 states (x)")
  fails({ exact = { y = 1 } }, "'y' is not a variable of the model")
  fails({ exact = function(time) return time < 1 and 1 or 0 end }, "cannot be followed with the symbol t")
  fails({ reference = 3 }, '("self" (the method at half the step) or a solution)')
  fails({ over = "most" }, 'must be "end"')
  fails({ exat = 1 }, "unknown option 'exat'. Did you mean 'exact'?")
  expect(function() converge(3, {}) end):fails "expected a model first"
  expect(function() converge(decay) end):fails "the end is missing"
  expect(function() converge(dae { der(x) ~ x^2 },
    { start = { x = 1 }, to = 4, methods = { rk.implicit_euler }, dt = { 0.1, 0.05 } }) end)
    :fails "converge: implicit_euler with dt = 0.1: stopped at"
end)

test("worker processes give the numbers of one process, bit for bit; a run that fails is a gap", function()
  local own = { start = { x = 1 }, to = 2, methods = { rk.rk4, rk.gauss(2), "dopri5" },
    dt = { 0.1, 0.05, 0.02 } }
  local adaptive = { start = { x = 1 }, to = 2, methods = { "radau", "bdf" }, rtol = { 1e-4, 1e-6, 1e-9 },
    exact = { x = exp(-2*t) } }
  for _, run in ipairs { own, adaptive } do
    run.workers = 1
    local one = converge(decay, run)
    for workers = 2, 3 do
      run.workers = workers
      local many = converge(decay, run)
      expect(many.errors):equals(one.errors)
      expect(many.evaluations):equals(one.evaluations)
      expect(tostring(many)):equals(tostring(one))
    end
  end
  local r = input "r"
  local driven = dae { der(x) ~ r - x }
  local function ends(time) return math.abs(time - 0.025) < 1e-9 and error "no value here" or 0 end
  local c = converge(driven, { start = { x = 1 }, to = 1, methods = { rk.heun }, dt = { 0.1, 0.05, 0.025 },
    inputs = { [r] = ends }, exact = exp(-t) })
  expect(c.slopes[1]):near(2, 0.1)
  expect(#c.failures):equals(1)
  expect(c.failures[1].step):equals(0.025)
  expect(tostring(c)):matches "heun with dt = 0.025 failed: .*no value here"
  expect(function()
    converge(driven, { start = { x = 1 }, to = 1, methods = { rk.heun }, dt = { 0.1, 0.05 }, exact = exp(-t),
      inputs = { [r] = function() error "no value at all" end } })
  end):fails "no value at all"
end)

test("an exact solution that is none is named", function()
  local study = { start = { x = 2 }, to = 1, methods = { rk.rk4 }, dt = { 0.1, 0.05 }, exact = exp(-2*t) }
  expect(tostring(converge(decay, study))):matches "not the solution from this start: they are 0.5 apart"
  study.start, study.exact = { x = 1 }, exp(-t)
  expect(tostring(converge(decay, study))):matches "is exact a solution of these equations%?"
  study.exact = exp(-2*t)
  local good = tostring(converge(decay, study))
  expect(good:find "apart" or good:find "exact a"):equals(nil)
  local instead_of = { radau = "rk.radau(3)", bdf = "bdf(3)", gauss = "rk.gauss(3)", rodas = "rtol" }
  for name, instead in pairs(instead_of) do
    study.methods = { name }
    expect(function() converge(decay, study) end):fails(instead)
  end
end)
