-- Our integrators against IDA of SUNDIALS on the same models, at equal accuracy.     ./dev bench dae [problem
-- words]
--
-- For every problem both run through a ladder of tolerances; "digits" is -log10 of the largest relative error
-- of the components that count, at the end. The table shows, for 4, 6 and 8 digits, the fastest run of each
-- that is at least so accurate: time of integration alone, the least of several runs.
-- Under it: processor time from the start of the program to the first trajectory, by parts. "parse" reads all
-- problems.
local started = os.clock()
local here = arg[0]:match "(.*/)" or "./"
local problems = assert(loadfile(here .. "problems.lua"))(here)
local parsed = os.clock()
local wanted = table.concat(arg, " ")
local levels = { 4, 6, 8 }

local function digits(value, reference)
  local worst = 0
  for name, exact in pairs(reference) do
    local error = math.abs((value(name) - exact)/exact)
    if error ~= error then return -1 end
    worst = math.max(worst, error)
  end
  return worst == 0 and 16 or -math.log(worst, 10)
end

-- The least time of runs that together last a while; `run` returns seconds, digits and a text.
local function measured(run)
  local least, correct, note = run()
  if not least then return end
  local spent, count = least, 1
  while spent < 0.05 and count < 30 do
    local seconds = run()
    least, spent, count = math.min(least, seconds), spent + seconds, count + 1
  end
  return { seconds = least, digits = correct, note = note }
end

local function ladder(run, tolerances)
  local list = {}
  for k = 6, tolerances and 5 + #tolerances or 24 do
    local entry = measured(function() return run(tolerances and tolerances[k - 5] or 10^(-k/2)) end)
    if entry then list[#list + 1] = entry end
    if entry and entry.digits > levels[#levels] + 0.5 then break end
  end
  return list
end

local function fastest(list, level)
  local best
  for _, entry in ipairs(list) do
    if entry.digits >= level and (not best or entry.seconds < best.seconds) then best = entry end
  end
  return best
end

local function ida_run(problem, model)
  return function(rtol)
    local options = { start = problem.start, to = problem.to, rtol = rtol,
      atol = problem.atol and problem.atol(rtol) or rtol }
    for key, value in pairs(problem.ida or {}) do options[key] = value end
    local r = model:ida(options)
    if r.trouble then return end
    return r.seconds, digits(function(name) return r[name] end, problem.reference),
      string.format("%d steps", r.steps)
  end
end

local function our_run(problem, model, method)
  return function(rtol)
    local ok, sol = pcall(model.integrate, model, { start = problem.start, to = problem.to, rtol = rtol,
      method = method,
      atol = problem.atol and problem.atol(rtol) or rtol, times = { problem.to } })
    if not ok or sol.status ~= "finished" then return end
    local s = sol:stats()
    return s.time, digits(function(name) return sol(name, problem.to) end, problem.reference),
      string.format("%s, %d steps", s.method, s.steps)
  end
end

-- Model, index, form and a first integration at rtol = 1e-6, with the milliseconds each took.
local function first(problem)
  local parts, clock = {}, os.clock()
  local function part(name, value)
    local now = os.clock()
    parts[#parts + 1] = string.format("%s %.1f", name, (now - clock)*1e3)
    clock = now
    return value
  end
  local model = part("model", problem.model(problem))
  local index = part("index", model:index())
  local ours = part("form", problem.ours and problem.ours(model) or index > 1 and model:reduce() or model)
  if not problem.slow then
    local sol = ours:integrate { start = problem.start, to = problem.to, rtol = 1e-6, method = problem.method,
      atol = problem.atol and problem.atol(1e-6) or 1e-6, times = { problem.to } }
    part("start, compilation and integration", sol)
    parts[#parts] = parts[#parts] .. string.format(" (integration %.2f)", sol:stats().time*1e3)
  end
  return model, ours, table.concat(parts, ", ")
end

local function show(problem)
  local model, ours, parts = first(problem)
  local peer = problem.peer and problem.peer(model) or model
  local theirs = ladder(ida_run(problem, peer), problem.tolerances)
  local mine = ladder(our_run(problem, ours, problem.method), problem.tolerances)
  for _, level in ipairs(levels) do
    local a, b = fastest(theirs, level), fastest(mine, level)
    print(string.format("%-24s %3d   %10s  %10s  %8s   %-18s %s", level == levels[1] and problem.name or "",
      level,
      a and string.format("%.1f", a.seconds*1e6) or "–", b and string.format("%.1f", b.seconds*1e6) or "–",
      a and b and string.format("%.1f", a.seconds/b.seconds) or "–", a and a.note or "", b and b.note or ""))
  end
  print(string.format("%-24s       ms: %s", "", parts))
end

print "problem                  digits    IDA [µs]   ours [µs]  IDA/ours   IDA                ours"
print(string.format("ms of processor time: program started %.1f, problems parsed %.1f", started*1e3,
  (parsed - started)*1e3))
for _, problem in ipairs(problems) do
  if wanted == "" and not problem.slow or wanted ~= "" and problem.name:find(wanted, 1, true) then
    show(problem) end
end
