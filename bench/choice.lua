-- The default beside the best named method, the tolerance being whatever reaches the digits at the end: for
-- each set of bench/choice_models.lua and 4, 6, 8, 10 digits the geometric mean of their times, the worst,
-- and how many are above 1.3.
--     pendula bench/choice.lua [-v] [words of a name]     -v: a line for each model and number of digits
-- Times are least ones of several runs, taken in turn; on a loaded machine single ones err by a half, those
-- below 20 microseconds by more.
local here = arg[0]:match "(.*/)" or "./"
local models = dofile(here .. "choice_models.lua")
local detailed = arg[1] == "-v"
if detailed then table.remove(arg, 1) end
local wanted = table.concat(arg, " ")
local named = { "radau", "rodas4", "rodas5p", "verner87", "verner98", "dop853", "tsit5" }
local object = { rodas4 = rosenbrock.rodas4, rodas5p = rosenbrock.rodas5p }
local least_scale = 1e-2                     -- of the largest value: smaller ones count as so large

--- model, start, states
local function built(m)
  if m.build then return m.build() end
  local states, equations, start = {}, {}, {}
  if m.n then
    local y = var("y", m.n)
    for i = 1, m.n do states[i] = y[i] end
    start[y] = m.start
    for i, f in ipairs(m.f(y)) do equations[i] = der(y[i]) ~ f end
  else
    for name in m.names:gmatch "%S+" do states[#states + 1] = var(name) end
    for i, f in ipairs { m.f(table.unpack(states)) } do
      equations[i], start[states[i]] = der(states[i]) ~ f, m.start[i]
    end
  end
  return dae(equations), start, states
end

local function runner(m)
  local model, start, states = built(m)
  return function(method, rtol, most)
    local good, sol = pcall(model.integrate, model, { start = start, to = m.to, rtol = rtol, atol = rtol*1e-2,
      method = object[method] or method ~= "default" and method or nil, times = { m.to },
      max_steps = most or 20000 })
    if not good or sol.status ~= "finished" then return end
    local final = {}
    for i, s in ipairs(states) do final[i] = sol:final(s) end
    return final, sol:stats()
  end
end

local function digits(value, exact)
  local largest, worst = 0, 1e-16
  for _, v in ipairs(exact) do largest = math.max(largest, math.abs(v)) end
  for i, v in ipairs(exact) do
    worst = math.max(worst, math.abs(value[i] - v)/(math.abs(v) + least_scale*largest + 1e-300))
  end
  return -math.log(worst, 10)
end

--- The first tolerance by which a method reaches so many digits; nil where it does not.
local function reaching(run, method, level, exact)
  for k = 2*level, 2*level + 7 do
    local final, stats = run(method, 10^(-k/2))
    if not final then return end
    if digits(final, exact) >= level then
      return { method = method, rtol = 10^(-k/2), time = stats.time, used = stats.method }
    end
  end
end

--- Default ÷ best named method, both as they were found.
local function compared(run, level, exact)
  local mine, others = reaching(run, "default", level, exact), {}
  if not mine then return end
  for _, method in ipairs(named) do others[#others + 1] = reaching(run, method, level, exact) end
  table.sort(others, function(a, b) return a.time < b.time end)
  for _ = 1, mine.time > 0.02 and 3 or mine.time > 2e-3 and 12 or 60 do
    mine.time = math.min(mine.time, select(2, run("default", mine.rtol)).time)
    for k = 1, math.min(3, #others) do
      others[k].time = math.min(others[k].time, select(2, run(others[k].method, others[k].rtol)).time)
    end
  end
  table.sort(others, function(a, b) return a.time < b.time end)
  if others[1] then return mine.time/others[1].time, mine, others[1] end
end

local sets, rows = {}, {}
for _, m in ipairs(models) do
  if (m.set .. " " .. m.name):find(wanted, 1, true) then
    local run = runner(m)
    local exact, other = run("radau", 1e-13, 2e5), run("verner98", 1e-13, 2e5) or run("radau", 1e-12, 2e5)
    local known = exact and other and digits(other, exact) or 0
    if not rows[m.set] then
      sets[#sets + 1], rows[m.set] = m.set, {}
    end
    for _, level in ipairs { 4, 6, 8, 10 } do
      local ratio, mine, best
      if known >= level + 1 then ratio, mine, best = compared(run, level, exact) end
      if ratio then
        local row = rows[m.set][level] or { sum = 0, n = 0, worst = 0, above = 0 }
        rows[m.set][level] = row
        row.sum, row.n, row.worst = row.sum + math.log(ratio), row.n + 1, math.max(row.worst, ratio)
        if ratio > 1.3 then row.above = row.above + 1 end
        if detailed then
          print(string.format("%-8s %-34s %2d  %5.2f  %s at %.0e beside %s at %.0e", m.set, m.name, level,
            ratio, mine.used, mine.rtol, best.method, best.rtol))
        end
      end
    end
  end
end
print "set        4 digits: mean (worst) above 1.3    6                      8                      10"
for _, set in ipairs(sets) do
  local parts = {}
  for _, level in ipairs { 4, 6, 8, 10 } do
    local row = rows[set][level]
    parts[#parts + 1] = row and string.format("%.2f (%.1f) %d of %d", math.exp(row.sum/row.n), row.worst,
      row.above, row.n) or "–"
  end
  print(string.format("%-10s %s", set, table.concat(parts, "     ")))
end
