-- converge(sys, …): the error against the step, for several methods. The order one observes is the slope.
-- converge/study.lua does it, and is read when it is first used.

local function study() return include "converge/study" end

doc { name = "converge", module = "integrate",
  sig = [[converge(sys, { start =, to =, methods = {…}, dt = {…}, exact = e | reference = "self" | solution,
    over = "end" | "all", params =, inputs =, direct =, workers =, limit = }) -> convergence]],
  text = [[Integrates with every method and every step and measures the error: a table with the slope of log
    error over log dt between the two finest steps above rounding, beside the order of the method. exact: an
    expression in t for one state, a list in the order of sys.differential, or { x = …, z = … }; without it
    each run is compared with the same method at half the step. Differential and algebraic variables are
    measured separately. rtol = {…} instead of dt: the error against the tolerance of adaptive methods.
    The runs are made in worker processes (workers = 1: here), each within limit seconds; one that fails is a
    gap in the table and in t.failures. plot(t) draws errors and order lines.]],
  example = [[
    x = var "x"
    t4 = converge(dae{ der(x) ~ -2*x },
      { start = { x = 1 }, to = 2, methods = { rk.rk4 }, dt = { 0.2, 0.1, 0.05 }, exact = exp(-2*t) })
    print(("%.1f"):format(t4.slopes[1]), t4.orders[1])]],
  gives = "4.1 4", options = function() return {
    option("start", "start or table", "a result of init, or { x = 1 }", "", "@variables"),
    option("to", "number", "the end"), option("from", "number", "the beginning", "0"),
    option("methods", "list, string or tableau", "tableaus or names of methods", "", "@methods"),
    option("method", "list, string or tableau", "one of them", "", "@methods"),
    option("dt", "number or list", "fixed steps"),
    option("rtol", "number or list", "tolerances, instead of steps"),
    option("atol", "number or list", "with rtol: absolute tolerances"),
    option("exact", "expression, list, table or function", "the solution, as expressions in t"),
    option("reference", "string, solution or table", '"self" (the method at half the step) or a solution',
      '"self"', "self"),
    option("inputs", "table", "as in integrate", "", "@inputs"),
    option("params", "table", "values of parameters: { m = 2 }", "", "@parameters"),
    option("direct", "boolean", "as in integrate", "false"),
    option("workers", "integer", "worker processes; 1: here"),
    option("limit", "number", "seconds of a run"),
    option("over", "string", "the error at the end, or the largest at the saved times", '"end"', "end|all") }
  end,
  options_at = 2, function(...) return study().converge(...) end }

local function field(name, sig, text, get)
  doc { name = "convergence#" .. name, module = "integrate", sig = sig, text = text,
    function(self) return get(contents("convergence", self)) end }
end

-- One figure of every run: list[i][k].
local function run_field(name, key, sig, text)
  field(name, sig, text, function(c)
    local lists = {}
    for m, runs in ipairs(c.runs) do
      lists[m] = {}
      for k, run in ipairs(runs) do lists[m][k] = run and run[key] end
    end
    return lists
  end)
end

field("errors", "t.errors[i][k] -> number",
  "The error of method i with step k (2-norm over the differential variables).",
  function(study) return study.main.errors end)
field("slopes", "t.slopes[i] -> number",
  [[The observed order of method i: the slope between the two finest steps whose errors are above rounding;
    false if there are none.]],
  function(study) return study.main.slopes end)
field("local_slopes", "t.local_slopes[i][k] -> number", "The slope between steps k-1 and k.",
  function(study) return study.main.local_slopes end)
field("orders", "t.orders[i] -> integer", "The order of method i by its order conditions.",
  function(study) return study.main.orders end)
field("dt", "t.dt -> list", "The steps (or tolerances), from the largest to the smallest.",
  function(study) return study.dt end)
field("methods", "t.methods -> list of strings", "The names of the methods.", function(study)
  local names = {}
  for m, method in ipairs(study.methods) do names[m] = method.name end
  return names
end)
field("algebraic", "t.algebraic -> table",
  "The errors, slopes and orders of the algebraic variables; nil if the model has none.",
  function(study) return study.other end)
field("failures", "t.failures[i] -> { method =, step =, why = }",
  "The runs that failed; their errors are NaN. Where all runs fail, converge does.",
  function(study) return study.failures end)
run_field("evaluations", "evaluations", "t.evaluations[i][k] -> integer", "Evaluations of the equations.")
run_field("newton", "newton", "t.newton[i][k] -> integer", "Newton iterations.")
run_field("factorisations", "factorisations", "t.factorisations[i][k] -> integer", "LU factorisations.")
run_field("steps", "steps", "t.steps[i][k] -> integer", "Steps taken.")
run_field("times", "time", "t.times[i][k] -> seconds", "CPU time; differs from run to run.")

doc { name = "convergence:of", module = "integrate", sig = "t:of(x) -> table",
  text = "The fields errors, slopes and orders of one variable alone.",
  example = [[
    x, k = var "x", param "k"
    decay = dae{ der(x) ~ -2*x }
    c = converge(decay, { start = { x = 1 }, to = 2, methods = { rk.rk4 }, dt = { 0.2, 0.1, 0.05 },
      exact = { x = exp(-2*t) } })
    print(("%.1f"):format(c:of(x).slopes[1]))]], gives = "4.1",
  function(self, what)
    local single = contents("convergence", self).single
    local group = single[type(what) == "string" and what or study().name_of(what)]
    if not group then
      local names = {}
      for name in pairs(single) do names[#names + 1] = name end
      table.sort(names)
      fail(("of: '%s' was not measured; measured are %s"):format(tostring(what), table.concat(names, ", ")))
    end
    return group
  end }

doc { name = "convergence:plot", module = "integrate", sig = "t:plot() -> figure",
  text = "Error against step on logarithmic axes, with the line of each method's order.",
  example = [[
    x, k = var "x", param "k"
    decay = dae{ der(x) ~ -2*x }
    c = converge(decay, { start = { x = 1 }, to = 2, methods = { rk.heun, rk.rk4 }, dt = { 0.2, 0.1, 0.05 },
      exact = exp(-2*t) })
    c:plot()]], gives = "figure 'Convergence': 4 series, 10 points",
  function(self) return study().figure_of(contents("convergence", self)) end }

doc { name = "convergence:__tostring", module = "integrate", sig = "print(t)",
  text = "The table of errors and slopes, with the methods that stay below their order.",
  function(self) return study().text_of(contents("convergence", self)) end }
