-- converge(sys, …): the error against the step, for several methods. The order one observes is the slope.

local eps = 2.220446049250313e-16

local function checked_options(sys, options)
  if object_type(sys) ~= "model" then
    fail("converge: expected a model first, converge(sys, { start = …, to = …, methods = {…}, dt = {…} "
      .. "}), got "
      .. (object_type(sys) or type(sys)))
  end
  if options.to == nil then fail "converge: the end is missing; give to = 2" end
  if options.start == nil then
    fail "converge: the start is missing; give start = { x = 1 } or a result of sys:init"
  end
  return options
end

local function read_methods(options)
  local list = options.methods or options.method
  if list == nil then fail "converge: the methods are missing; give methods = { rk.rk4, rk.gauss(2) }" end
  if type(list) ~= "table" then list = { list } end
  if #list == 0 then fail "converge: methods is empty; give methods = { rk.rk4, rk.gauss(2) }" end
  local methods = {}
  for i, method in ipairs(list) do
    if type(method) ~= "string" and not object_type(method) then
      fail(("converge: methods[%d] must be a tableau or the name of a method, not a %s"):format(i,
        type(method)))
    end
    local each = { method = method, name = type(method) == "string" and method or method.name }
    if type(method) == "string" and not options.rtol then each.method = rk[method] end
    if type(each.method) ~= "string" then each.order = each.method:order() end
    methods[i] = each
  end
  return methods
end

-- The steps (or tolerances), from the largest to the smallest.
local function read_steps(options)
  local key = options.rtol and "rtol" or "dt"
  if options.rtol and options.dt then
    fail "converge: give dt = {…} for fixed steps or rtol = {…} for chosen ones, not both"
  end
  local given = options[key]
  if given == nil then fail "converge: the steps are missing; give dt = { 0.1, 0.05, 0.025 }" end
  if type(given) == "number" then given = { given } end
  local steps = {}
  for i = 1, #given do
    local h = given[i]
    if type(h) == "userdata" and object_type(h) == "expr" then h = evaluate(h) end
    if type(h) ~= "number" or not (h > 0) or h == math.huge then
      fail(("converge: %s[%d] = %s; it must be a positive number"):format(key, i, tostring(h)))
    end
    steps[i] = h
  end
  table.sort(steps, function(a, b) return a > b end)
  for i = 2, #steps do
    if steps[i] == steps[i - 1] then fail(("converge: %s contains %g twice"):format(key, steps[i])) end
  end
  if #steps < 2 then
    fail(("converge: a slope needs at least two values; give %s = { 0.1, 0.05, 0.025 }"):format(key))
  end
  return steps, key
end

local function contains(list, what)
  for i = 1, #list do if list[i] == what then return true end end
  return false
end

local function names_of(list)
  local names = {}
  for i = 1, #list do names[i] = tostring(list[i]) end
  return table.concat(names, ", ")
end

local function name_of(e) return e.name or tostring(e) end

-- exact = { x = …, [z] = …, [p] = { …, …, … }, [x^2 + y^2] = 1 }, in the order of the model and not of the
-- table.
local function keyed_quantities(exact, states, algebraic, add)
  local left, names = {}, {}
  local function note(name, key, value)
    if left[name] then fail(("converge: exact gives '%s' twice"):format(name)) end
    left[name] = { key = key, value = value }
    names[#names + 1] = name
  end
  for key, value in pairs(exact) do
    local kind = object_type(key)
    if kind == "matrix" then
      if #value ~= #key then fail(("converge: exact: %d values for a column of %d"):format(#value, #key)) end
      for i = 1, #key do note(name_of(key[i]), key[i], value[i]) end
    else
      note(kind == "expr" and name_of(key) or tostring(key), kind == "expr" and key or nil, value)
    end
  end
  local model = {}
  for _, list in ipairs { states, algebraic } do
    for i = 1, #list do
      local each = list[i]
      model[#model + 1] = each.name
      if left[each.name] then
        add(each, left[each.name].value)
        left[each.name] = nil
      end
    end
  end
  table.sort(names)
  for _, name in ipairs(names) do
    if left[name] then
      if not left[name].key then
        fail(("converge: exact: '%s' is not a variable of the model.%s"):format(name,
          did_you_mean(name, model)))
      end
      add(left[name].key, left[name].value)
    end
  end
end

-- { { what = expression, exact = expression or nil, algebraic = boolean }, … }
local function read_quantities(sys, options)
  local states, algebraic, exact = sys.differential, sys.algebraic, options.exact
  local quantities = {}
  local function add(what, value)
    quantities[#quantities + 1] = { what = what, exact = value, algebraic = contains(algebraic, what) }
  end
  if exact == nil then
    for i = 1, #states do add(states[i]) end
    for i = 1, #algebraic do add(algebraic[i]) end
    return quantities
  end
  if type(exact) == "function" then
    local good, value = pcall(exact, named "t")
    if not good then
      fail("converge: exact is a function that cannot be followed with the symbol t: " .. tostring(value))
    end
    exact = value
  end
  if type(exact) == "table" and #exact == 0 then
    keyed_quantities(exact, states, algebraic, add)
    return quantities
  end
  local list = (type(exact) == "table" or object_type(exact) == "matrix") and exact or { exact }
  if #list ~= #states then
    fail(("converge: exact gives %d expression%s for %d states (%s); give exact = { %s = … }"):format(#list,
      #list == 1 and "" or "s", #states, names_of(states), tostring(states[1])))
  end
  for i = 1, #list do add(states[i], list[i]) end
  return quantities
end

-- ── running ────────────────────────────────────────────────────────────────────────────────────────────────

local function integrate_with(sys, options, method, key, h)
  local o = { start = options.start, to = options.to, from = options.from, inputs = options.inputs,
    params = options.params,
              direct = options.direct, method = method, atol = options.atol }
  o[key] = h
  if key == "rtol" and o.atol == nil then o.atol = h end
  local sol = sys:integrate(o)
  if sol.status ~= "finished" then
    fail(("converge: %s with %s = %g: %s"):format(type(method) == "string" and method or method.name, key, h,
      sol.status))
  end
  return sol
end

local function values_at_end(sol, quantities)
  local values = {}
  for i, q in ipairs(quantities) do values[i] = sol:final(q.what) end
  return values
end

local function norm_of(list)
  local sum = 0
  for _, v in ipairs(list) do sum = sum + v*v end
  return math.sqrt(sum)
end

-- The errors of one run, by quantity: at the end, or the largest of all saved times.
local function errors_of(sol, quantities, reference, over)
  local errors = {}
  for i, q in ipairs(quantities) do
    if over == "all" and q.exact ~= nil then
      local got, want, most = sol(q.what), sol(q.exact + 0*named "t"), 0
      for k = 1, #got do most = math.max(most, math.abs(got[k] - want[k])) end
      errors[i] = most
    else
      local want = q.exact ~= nil and sol:final(q.exact) or reference[i]
      errors[i] = math.abs(sol:final(q.what) - want)
    end
  end
  return errors
end

local function reference_values(sys, options, quantities)
  local reference = options.reference
  if object_type(reference) == "solution" then return values_at_end(reference, quantities) end
  if reference ~= nil and reference ~= "self" then
    fail 'converge: reference must be "self" or a solution; an exact solution is given as exact = …'
  end
end

-- ── slopes ─────────────────────────────────────────────────────────────────────────────────────────────────

-- Errors at the level of rounding say nothing about the order; NaN is no error at all.
local function visible(error, scale, steps) return error > 100 * eps * scale * math.sqrt(steps) end

local function slopes_of(steps, errors, scale, interval, by_tolerance)
  local between, last = {}, nil
  for i = 2, #steps do
    local count = by_tolerance and 1e3 or interval/steps[i]
    if visible(errors[i], scale, count) and visible(errors[i - 1], scale, count) then
      between[i] = math.log(errors[i - 1]/errors[i]) / math.log(steps[i - 1]/steps[i])
      last = between[i]
    end
  end
  return last, between
end

-- Errors and slopes of the wanted quantities together (2-norm), as the result publishes them; nil if there
-- are none.
local function group_of(study, wanted)
  local group = { errors = {}, slopes = {}, orders = {}, local_slopes = {}, names = {} }
  local quantities, steps, scale = study.quantities, study.dt, 0
  for i, q in ipairs(quantities) do
    if wanted(q) then
      group.names[#group.names + 1] = tostring(q.what)
      scale = math.max(scale, study.scales[i] or 0)
    end
  end
  if #group.names == 0 then return nil end
  for m, method in ipairs(study.methods) do
    group.errors[m] = {}
    for k = 1, #steps do
      local parts, run = {}, study.runs[m][k]
      for i, q in ipairs(quantities) do
        if wanted(q) then parts[#parts + 1] = run and run.errors[i] or 0/0 end
      end
      group.errors[m][k] = norm_of(parts)
    end
    local slope, between = slopes_of(steps, group.errors[m], scale, study.interval, study.key == "rtol")
    group.slopes[m] = slope or false
    group.local_slopes[m] = between
    group.orders[m] = method.order or false
  end
  return group
end

-- ── the result ─────────────────────────────────────────────────────────────────────────────────────────────

local layout = include "layout"

local function rows_text(rows)
  -- numbers, behind the names of the methods
  local right = {}
  for j = 2, #rows[1] do right[j] = true end
  return layout(rows, right, 2)
end

local function number_text(value) return ("%.3g"):format(value) end

-- Three digits where rounding leaves them.
local function error_text(error, scale, steps)
  if error ~= error then return "–" end
  if not visible(error, scale, steps) then return "rounding" end
  return (visible(error/100, scale, steps) and "%.2e" or "%.0e"):format(error)
end

local function rounding_steps(study, h) return study.key == "rtol" and 1e3 or study.interval/h end

local function reduction_note(study, name, slope, order)
  local why = study.direct and "order reduction, the model is integrated at its index as it stands"
    or study.algebraic and "order reduction, or the steps are still too large"
    or [[the steps are still too large, the solution is not smooth enough, or the problem is stiff (order
      reduction)]]
  return ("  %s: observed %.1f, order %d: %s"):format(name, slope, order, prose(why))
end

local function group_text(study, group)
  local rows, notes = { { "method", "order" } }, {}
  for _, h in ipairs(study.dt) do table.insert(rows[1], study.key .. " = " .. number_text(h)) end
  table.insert(rows[1], "slope")
  for m, method in ipairs(study.methods) do
    local slope, order = group.slopes[m], group.orders[m]
    local row = { method.name, order and tostring(order) or "" }
    for k, h in ipairs(study.dt) do
      row[#row + 1] = error_text(group.errors[m][k], study.scale, rounding_steps(study, h))
    end
    row[#row + 1] = slope and ("%.2f"):format(slope) or "–"
    rows[#rows + 1] = row
    if slope and order and study.key == "dt" and slope < order - 0.5 then
      notes[#notes + 1] = reduction_note(study, method.name, slope, order)
    end
  end
  local text = rows_text(rows)
  if #notes > 0 then text = text .. "\n" .. table.concat(notes, "\n") end
  return text
end

local against_words = {
  exact = "against the exact solution", self = "against the same method at half the step",
  reference = "against the reference solution",
}

local function title_of(study, names)
  local what = #names <= 4 and table.concat(names, ", ")
    or ("%s … %s, %d variables"):format(names[1], names[#names], #names)
  local when = study.over == "all" and "over all times" or ("at t = %g"):format(study.to)
  return ("error of %s %s %s"):format(what, when, against_words[study.against])
end

local function text_of(study)
  local parts = {}
  for _, group in ipairs { study.main, study.other } do
    parts[#parts + 1] = title_of(study, group.names) .. "\n" .. group_text(study, group)
  end
  for _, each in ipairs(study.failures) do
    parts[#parts + 1] = ("  %s with %s = %g failed: %s"):format(each.method, study.key, each.step, each.why)
  end
  if study.left > 0 then parts[#parts + 1] = ("  interrupted: %d runs were not made"):format(study.left) end
  return table.concat(parts, "\n")
end

local function figure_of(study)
  local series, group = {}, study.main
  local coarse, fine = study.dt[1], study.dt[#study.dt]
  for m, method in ipairs(study.methods) do
    local x, y = {}, {}
    for k, h in ipairs(study.dt) do
      if group.errors[m][k] > 0 then x[#x + 1], y[#y + 1] = h, group.errors[m][k] end
    end
    if #x > 0 then
      local slope, p = group.slopes[m], group.orders[m]
      series[#series + 1] = { x = x, y = y, style = "points",
        labels = { slope and ("%s, slope %.2f"):format(method.name, slope) or method.name } }
      if p and study.key == "dt" then       -- the line of the order through the coarsest error
        local function on_line(h) return y[1] * (h/x[1])^p end
        series[#series + 1] = { x = { coarse, fine }, y = { on_line(coarse), on_line(fine) }, style = "line",
          labels = { "order " .. p } }
      end
    end
  end
  if #series == 0 then fail "plot: all errors are zero" end
  return figure { by = "plot", series = series, xlog = true, ylog = true, xlabel = study.key,
    ylabel = "error", title = "Convergence" }
end

-- ── the runs ───────────────────────────────────────────────────────────────────────────────────────────────

local costs = { "evaluations", "newton", "factorisations", "time", "steps" }

-- One run as a list of numbers, since it may be made in a worker process: values at the end, errors by
-- quantity (none against the method itself), costs.
local function one_run(sys, options, study, method, h)
  local sol = integrate_with(sys, options, method.method, study.key, h)
  local numbers, stats = values_at_end(sol, study.quantities), sol:stats()
  if study.against ~= "self" then
    local errors = errors_of(sol, study.quantities, study.reference, study.over)
    table.move(errors, 1, #errors, #numbers + 1, numbers)
  end
  for _, cost in ipairs(costs) do numbers[#numbers + 1] = stats[cost] end
  return numbers
end

local function run_of(numbers, study)
  local count, run = #study.quantities, {}
  local function taken(from)
    local list = {}
    for i = 1, count do list[i] = numbers[from + i] end
    return list
  end
  run.values = taken(0)
  if study.against ~= "self" then run.errors = taken(count) end
  for k, cost in ipairs(costs) do
    local value = numbers[#numbers - #costs + k]
    run[cost] = cost == "time" and value or math.tointeger(value)
  end
  return run
end

-- Every method with every step, and with half of it where the method is compared with itself.
local function asked_runs(study)
  local asked, place = {}, {}
  for m, method in ipairs(study.methods) do
    place[m] = {}
    local function ask(h)
      if place[m][h] then return end
      asked[#asked + 1] = { method = method, step = h }
      place[m][h] = #asked
    end
    for _, h in ipairs(study.dt) do
      ask(h)
      if study.against == "self" then ask(h/2) end
    end
  end
  return asked, place
end

-- e(h) ≈ |x_h - x_{h/2}| / (1 - 2^-p)
local function errors_against_itself(coarse, fine, order)
  local errors = {}
  for i = 1, #coarse.values do
    errors[i] = math.abs(coarse.values[i] - fine.values[i]) / (1 - 2^-(order or 1))
  end
  return errors
end

-- Integrates with every method and step: study.runs[m][k], false where a run failed or was not made, and the
-- largest value of every quantity.
local function run_all(sys, options, study)
  local asked, place = asked_runs(study)
  local results, failures, left = parallel_calls(#asked, function(i)
    return one_run(sys, options, study, asked[i].method, asked[i].step)
  end, { workers = options.workers, limit = options.limit, title = "converge" })
  if #failures == #asked then one_run(sys, options, study, asked[1].method, asked[1].step) end
  study.runs, study.scales, study.scale, study.failures, study.left = {}, {}, 0, {}, left
  for _, each in ipairs(failures) do
    local run = asked[each.index]
    study.failures[#study.failures + 1] = { method = run.method.name, step = run.step, why = each.why }
  end
  for m, method in ipairs(study.methods) do
    study.runs[m] = {}
    for k, h in ipairs(study.dt) do
      local numbers, finer = results[place[m][h]], results[place[m][h/2]]
      local run = numbers and run_of(numbers, study)
      if run and study.against == "self" then
        run.errors = finer and errors_against_itself(run, run_of(finer, study), method.order)
      end
      study.runs[m][k] = run and run.errors and run
      for i, v in ipairs(run and run.values or {}) do
        study.scales[i] = math.max(study.scales[i] or 0, math.abs(v))
        study.scale = math.max(study.scale, study.scales[i])
      end
    end
  end
end

local function converge(sys, options)
  options = checked_options(sys, options)
  local from = type(options.from) == "number" and options.from or 0
  local study = { methods = read_methods(options), to = options.to, over = options.over or "end",
    direct = options.direct, interval = math.abs(options.to - from) }
  study.dt, study.key = read_steps(options)
  study.quantities = read_quantities(sys, options)
  study.reference = options.exact == nil and reference_values(sys, options, study.quantities) or nil
  study.against = options.exact ~= nil and "exact" or study.reference and "reference" or "self"
  run_all(sys, options, study)
  study.single = {}
  for _, q in ipairs(study.quantities) do
    study.single[name_of(q.what)] = group_of(study, function(other) return other == q end)
  end
  local differential = group_of(study, function(q) return not q.algebraic end)
  study.algebraic = group_of(study, function(q) return q.algebraic end)
  study.main = differential or study.algebraic
  study.other = differential and study.algebraic
  return record("convergence", study)
end

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
  gives = "4.1 4", options = {
    option("start", "start or table", "a result of init, or { x = 1 }", "", "@variables"),
    option("to", "number", "the end"), option("from", "number", "the begin", "0"),
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
    option("over", "string", "the error at the end, or the largest at the saved times", '"end"', "end|all") },
  options_at = 2, converge }

local function field(name, sig, text, get)
  doc { name = "convergence#" .. name, module = "integrate", sig = sig, text = text,
    function(self) return get(contents("convergence", self)) end }
end

-- One figure of every run: list[i][k].
local function run_field(name, key, sig, text)
  field(name, sig, text, function(study)
    local lists = {}
    for m, runs in ipairs(study.runs) do
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
  "errors, slopes and orders of the algebraic variables; nil if the model has none.",
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
  text = "errors, slopes and orders of one variable alone.",
  function(self, what)
    local single = contents("convergence", self).single
    local group = single[type(what) == "string" and what or name_of(what)]
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
  function(self) return figure_of(contents("convergence", self)) end }

doc { name = "convergence:__tostring", module = "integrate", sig = "print(t)",
  text = "The table of errors and slopes; what stays below its order is named.",
  function(self) return text_of(contents("convergence", self)) end }
