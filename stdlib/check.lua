-- sol:check(): the same run once more with a tenth of the tolerance and another method, and the differences.

local relative = 1e-6             -- rtol where none was given; atol is then a thousandth of it
local many = 400                  -- times that are compared
local generous = 100              -- differences of so many tolerances are what global errors may be

-- Which method judges which: of another kind, and good for the same problems.
local others = { radau = "bdf", bdf = "radau", rodas = "radau", gauss = "radau" }

local function divided(tolerance, factor)
  if type(tolerance) == "number" then return tolerance/factor end
  if type(tolerance) ~= "table" then return tolerance end
  local list = {}
  for key, value in pairs(tolerance) do list[key] = divided(value, factor) end
  return list
end

local function second_method(sol)
  local name = sol:stats().method
  if others[name] then return others[name] end
  return sol:stats().jacobians > 0 and "radau" or name:find "^dop" and "verner87" or "dop853"
end

-- At an event values jump, and two runs do not agree on the last digits of its time.
local function is_at_event(sol, time, span)
  for _, event in ipairs(sol.events) do
    if math.abs(event.t - time) <= 1e-6*span then return true end
  end
end

local function compared_times(sol)
  local t, times = sol.t, {}
  local step, span = math.max(1, (#t - 1)//many), t[#t] - t[1]
  for i = 1, #t, step do
    if t[i] ~= times[#times] and not is_at_event(sol, t[i], span) then times[#times + 1] = t[i] end
  end
  if times[#times] ~= t[#t] and not is_at_event(sol, t[#t], span) then times[#times + 1] = t[#t] end
  return times
end

-- The largest difference of one component, where it is, and how it compares with the tolerance. a, b: its
-- values at the times.
local function difference(component, a, b, times, options)
  local largest, at, size = 0, times[1], 0
  for i = 1, #times do
    local d = math.abs(a[i] - b[i])
    if not (d <= largest) then largest, at = d, times[i] end
    size = math.max(size, math.abs(b[i]))
  end
  local rtol = type(options.rtol) == "number" and options.rtol or relative
  local atol = type(options.atol) == "number" and options.atol or 1e-3*rtol
  return { name = tostring(component), difference = largest, at = at, size = size,
    tolerances = largest/(rtol*size + atol) }
end

-- A row for every component, in one look at each time.
local function differences(first, second, times, options, report)
  for _, part in ipairs { first.model.differential, first.model.algebraic } do
    if #part > 0 and #times > 0 then
      local a, b = first(part, times), second(part, times)
      for i = 1, #part do
        report[#report + 1] = difference(part[i], a:col(i), b:col(i), times, options)
      end
    end
  end
end

local function verdict_of(report)
  if report.first ~= report.second then
    return ("the runs end differently: %s; the second one: %s"):format(report.first, report.second)
  end
  local worst = report[1]
  for _, row in ipairs(report) do
    if not (row.tolerances <= worst.tolerances) then worst = row end
  end
  if not worst then return "there is nothing to compare" end
  if worst.tolerances ~= worst.tolerances or worst.difference == math.huge then
    return ("%s is not finite"):format(worst.name)
  end
  report.good = worst.tolerances <= generous
  return ("%s: %s differs by %.2g, %.3g tolerances"):format(report.good and "confirmed" or "NOT confirmed",
    worst.name, worst.difference, worst.tolerances)
end

doc { name = "solution:check", module = "integrate", sig = "sol:check([{ method = }]) -> check",
  text = [[An estimate of the global error: integrates once more, with a tenth of the tolerance and a method
    of another kind, and compares every state and algebraic variable at the saved times, but for those of
    events. [i] has name, difference, at, size, tolerances (the difference in units of atol + rtol |x|); .good
    says whether all are within 100. Functions of inputs and events are called again.]],
  example = [[x = var "x"
c = dae{ der(x) ~ -x }:integrate{ start = { x = 1 }, to = 1 }:check()
return c.good, #c, c[1].name]], gives = "true 1 x",
  options = { option("method", "string or tableau", "of the second run; else one of another kind", "",
    "@methods") },
  options_at = 2,
  function(sol, given)
    if object_type(sol) ~= "solution" then
      fail "check: expected a solution before the colon, as in sol:check()"
    end
    local options = sol.options
    if not options then fail "check: this solution comes from a sweep; integrate its run to check it" end
    local again = {}
    for key, value in pairs(options) do again[key] = value end
    local times = compared_times(sol)
    again.rtol = divided(options.rtol or relative, 10)
    if options.atol then again.atol = divided(options.atol, 10) end
    again.dt, again.dt0, again.sensitivities = nil, nil, nil
    again.times = nil
    again.method = given and given.method or second_method(sol)
    local second = sol.model:integrate(again)
    while times[#times] and times[#times] > second.t[#second.t] do times[#times] = nil end
    local report = { first = sol.status:match "^%a+", second = second.status:match "^%a+",
      methods = { sol:stats().method, second:stats().method }, good = false }
    differences(sol, second, times, options, report)
    report.verdict = verdict_of(report)
    return record("check", report)
  end }

doc { name = "check:__index", module = "integrate", sig = "c[i]",
  text = "A component, or a field of the check.",
  example = [[
    x, k = var "x", param "k"
    c = dae{ der(x) ~ -x }:integrate{ start = { x = 1 }, to = 1 }:check()
    c[1].name, c.good]], gives = "x true",
  function(self, key) return contents("check", self)[key] end }
doc { name = "check:__len", module = "integrate", sig = "#c", text = "The number of components.",
  function(self) return #contents("check", self) end }
doc { name = "check:__tostring", module = "integrate", sig = "print(c)",
  text = "The table of differences by component, and the verdict.",
  function(self)
    local report = contents("check", self)
    local lines = { ("check of %s by %s"):format(report.methods[1], report.methods[2]),
      ("  %-12s %12s %10s %12s %11s"):format("component", "difference", "at t", "size", "tolerances") }
    for _, row in ipairs(report) do
      lines[#lines + 1] = ("  %-12s %12.3g %10.5g %12.5g %11.3g"):format(row.name, row.difference, row.at,
        row.size, row.tolerances)
    end
    lines[#lines + 1] = report.verdict
    return table.concat(lines, "\n")
  end }
