-- Random processes as inputs, and parameters that only inputs contain.
x, v = vars "x v"
r = input "r"
A = param("A", 1)
integral = dae { der(x) ~ r }
oscillator = dae { der(x) ~ v, der(v) ~ -x - v + r }

test("parameters that only an input contains", function()
  local options = { start = { x = 0 }, to = 1, inputs = { [r] = A*t }, params = { A = 4 }, rtol = 1e-9 }
  expect(integral:integrate(options)(x, 1)):near(2, 1e-8)
  options.params = { A = { 2, 4 } }
  expect(sweep(integral, options):final(x)):near({ 1, 2 }, 1e-8)
  options.params = { A = uniform(1, 3) }
  options.runs, options.design = 256, "sobol"
  expect(sweep(integral, options):mean(x)):near(1, 1e-3)
  options.params = { B = 3 }
  expect(function() integral:integrate(options) end):fails "unknown"
end)

test("a process has the variance and the spectrum that were asked for", function()
  local p = random_process { band = { 0.5, 2 }, std = 2, lines = 24 }
  local s = sweep(integral, { start = { x = 0 }, to = 1, times = { 0.3, 1 }, inputs = { [r] = p },
    runs = 2048,
    design = "sobol", seed = 1 })
  expect(s:std(r, 0.3)):near(2, 0.1)
  expect(s:mean(r, 0.3)):near(0, 0.1)
  -- x(1) = ∫ r: variance Σ σ² |(e^{iω} - 1)/(iω)|²
  local variance, width = 0, 1.5/24
  for line = 1, 24 do
    local w = 2*math.pi*(0.5 + (line - 0.5)*width)
    variance = variance + 4/24*(2 - 2*math.cos(w))/w^2
  end
  expect(s:std(x)):near(math.sqrt(variance), 0.05*math.sqrt(variance))
end)

test("the response of an oscillator to white noise of a given spectrum", function()
  -- x″ + x′ + x = r with S(f) = 1 has variance S/4 (ζ = 1/2, ω = 1: S/(8 ζ ω³), one-sided S in Hz).
  local p = random_process { band = { 0, 1.5 }, spectrum = function() return 1 end, lines = 120 }
  local s = sweep(oscillator, { start = { x = 0, v = 0 }, to = 25, inputs = { [r] = p }, runs = 600, seed = 2,
    times = { 25 }, rtol = 1e-5 })
  expect(s:std(x)):near(0.5, 0.05)
end)

test("one realisation, and what is wrong", function()
  local p = random_process { band = { 1, 2 }, std = 1, lines = 4, mean = 3 }
  expect(evaluate(p:realisation(1), { t = 0.5 }) ~= evaluate(p:realisation(2), { t = 0.5 })):equals(true)
  expect(#integral:integrate { start = { x = 0 }, to = 1,
    inputs = { [r] = p:realisation(3) } }.t > 1):equals(true)
  expect(function() random_process { band = { 2, 1 }, std = 1 } end):fails "ascending"
  expect(function() random_process { band = { 1, 2 } } end):fails "one of them"
  expect(function() random_process { band = { 1, 2 }, std = 1, line = 3 } end):fails "Did you mean 'lines'?"
  expect(function() random_process { band = { 1, 2 },
    spectrum = function() return -1 end } end):fails "negative"
end)
