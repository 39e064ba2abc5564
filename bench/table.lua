-- One line for each problem with a reference and each number of digits: what the default takes and reaches,
-- its time, that relative to the best named method, the best peer's relative to it, first and second call.
--     build/release/bench/bench_dae bench/table.lua [words of a name]
local here = arg[0]:match "(.*/)" or "./"
local problems = assert(loadfile(here .. "problems.lua"))(here)
local wanted = table.concat(arg, " ")
local named = { "radau", "rodas", "bdf", "rkc", "dopri5", "tsit5", "dop853", "verner87", "verner98" }
local peers = { "ida", "cvode", "adams", "erk" }

local function digits(value, reference)
  local worst = 1e-16
  for name, exact in pairs(reference) do
    local error = math.abs((value(name) - exact)/exact)
    if error ~= error then return 0 end
    worst = math.max(worst, error)
  end
  return -math.log(worst, 10)
end

--- Least seconds of three runs, digits, a text.
local function ours(problem, model, method, rtol)
  local least, reached, note
  for _ = 1, 3 do
    local good, sol = pcall(model.integrate, model, { start = problem.start, to = problem.to, rtol = rtol,
      atol = problem.atol and problem.atol(rtol) or rtol, method = method, times = { problem.to },
      max_steps = 20000 })
    if not good or sol.status ~= "finished" then return end
    local s = sol:stats()
    least, note = math.min(least or 1e9, s.time), s.method
    reached = digits(function(name) return sol:final(name) end, problem.reference)
    if least > 0.05 then break end
  end
  return least, reached, note
end

local function peer(problem, model, name, rtol)
  if #model.differential > 150 and name ~= "ida" then return end
  local good, r = pcall(model[name], model, { start = problem.start, to = problem.to, rtol = rtol,
    atol = problem.atol and problem.atol(rtol) or rtol,
    sparse = name == "ida" and #model.differential > 60 or nil })
  if not good or r.trouble then return end
  return r.seconds, digits(function(n) return r[n] end, problem.reference), name
end

--- The fastest run that reaches so many digits.
local function fastest(level, names, run)
  local best
  for _, name in ipairs(names) do
    for k = 2*level, 2*level + 10 do
      local seconds, reached, note = run(name, 10^(-k/2))
      if not seconds then break end
      if reached >= level then
        if not best or seconds < best[1] then best = { seconds, note } end
        break
      end
    end
  end
  return best
end

print [[
problem                      digits reached    ours    ÷ best named     best peer ÷ ours   calls [ms]
]]for _, problem in ipairs(problems) do
  if problem.reference and problem.source and not problem.slow and problem.name:find(wanted, 1, true) then
    local model = problem.model(problem)
    local form = model:index() > 1 and model:reduce() or model
    local index1 = model:index() > 1 and model:reduce "acc" or model
    local calls = {}
    for k = 1, 2 do
      local began = os.clock()
      form:integrate { start = problem.start, to = problem.to, times = { problem.to }, rtol = 1e-6,
        atol = problem.atol and problem.atol(1e-6) or 1e-6 }
      calls[k] = (os.clock() - began)*1e3
    end
    for _, level in ipairs { 4, 6, 8, 10 } do
      local mine, reached, note
      for k = 2*level, 2*level + 6 do
        mine, reached, note = ours(problem, form, nil, 10^(-k/2))
        if not mine or reached >= level then break end
      end
      if mine then
        local best = fastest(level, named, function(name, rtol)
          return ours(problem, form, name, rtol)
        end)
        local other = fastest(level, peers, function(name, rtol)
          return peer(problem, index1, name, rtol)
        end)
        print(string.format("%-28s %4d %6.1f %8.2f ms  %5.2f %-12s %6.1f %-6s %8.2f %8.2f  %s",
          level == 4 and problem.name or "", level, reached, mine*1e3, best and mine/best[1] or 0/0,
          best and best[2] or "–", other and other[1]/mine or 0/0, other and other[2] or "–", calls[1],
          calls[2], note))
        io.flush()
      end
    end
  end
end
