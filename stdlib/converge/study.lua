-- The work of converge(sys, …): runs, errors, slopes, the table and the figure.

local eps = 2.220446049250313e-16

local request = include "converge/request"
local name_of = request.name_of

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

-- |x - exact| at the start, the largest of all quantities: what no step makes smaller.
local function apart_at_start(sol, quantities)
  local apart, from = 0, sol.t[1]
  for _, q in ipairs(quantities) do
    local error = math.abs(sol(q.what, from) - sol(q.exact + 0*named "t", from))
    apart = math.max(apart, error / math.max(1, math.abs(sol(q.what, from))))
  end
  return apart
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

-- Errors that no step makes smaller; with "direct" a method may well not converge.
local function constant(errors)
  local low, high = math.huge, 0
  for _, e in ipairs(errors) do low, high = math.min(low, e), math.max(high, e) end
  return high < 1.05*low
end

local function reduction_note(study, name, slope, order, errors)
  local stays = study.against == "exact" and not study.direct and study.apart <= 1e-8 and constant(errors)
  local why = stays and "the error does not depend on the step: is exact a solution of these equations?"
    or study.direct and "order reduction, the model is integrated at its index as it stands"
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
      notes[#notes + 1] = reduction_note(study, method.name, slope, order, group.errors[m])
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
  if study.against == "exact" and study.apart > 1e-8 then
    parts[#parts + 1] = ("  exact is not the solution from this start: they are %.2g apart there")
      :format(study.apart)
  end
  for _, each in ipairs(study.failures) do
    parts[#parts + 1] = ("  %s with %s = %g failed: %s"):format(each.method, study.key, each.step, each.why)
  end
  if study.left > 0 then
    local runs = study.left == 1 and "run was" or "runs were"
    parts[#parts + 1] = ("  interrupted: %d %s not made"):format(study.left, runs)
  end
  return table.concat(parts, "\n")
end

local colours = { "blue", "red", "green", "purple", "orange", "sky" }

local function figure_of(study)
  local series, group = {}, study.main
  local coarse, fine = study.dt[1], study.dt[#study.dt]
  for m, method in ipairs(study.methods) do
    local x, y = {}, {}
    for k, h in ipairs(study.dt) do
      if group.errors[m][k] > 0 then x[#x + 1], y[#y + 1] = h, group.errors[m][k] end
    end
    if #x > 0 then
      local slope, p, colour = group.slopes[m], group.orders[m], colours[(m - 1) % #colours + 1]
      series[#series + 1] = { x = x, y = y, style = "points", colour = colour,
        labels = { slope and ("%s, slope %.2f"):format(method.name, slope) or method.name } }
      if p and study.key == "dt" then       -- the line of the order through the coarsest error
        local function on_line(h) return y[1] * (h/x[1])^p end
        series[#series + 1] = { x = { coarse, fine }, y = { on_line(coarse), on_line(fine) }, style = "line",
          colour = colour, dash = "dashed", labels = { "order " .. p } }
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
  numbers[#numbers + 1] = study.against == "exact" and apart_at_start(sol, study.quantities) or 0
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
  run.apart = numbers[#numbers - #costs]
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
      study.apart = math.max(study.apart or 0, run and run.apart or 0)
      for i, v in ipairs(run and run.values or {}) do
        study.scales[i] = math.max(study.scales[i] or 0, math.abs(v))
        study.scale = math.max(study.scale, study.scales[i])
      end
    end
  end
end

local function converge(sys, options)
  sys = as_model(sys)
  options = request.options(sys, options)
  local from = type(options.from) == "number" and options.from or 0
  local study = { methods = request.methods(options), to = options.to, over = options.over or "end",
    direct = options.direct, interval = math.abs(options.to - from) }
  study.dt, study.key = request.steps(options)
  study.quantities = request.quantities(sys, options)
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

return { converge = converge, name_of = name_of, text_of = text_of, figure_of = figure_of }
