-- Reference end values of bench/problems, by two methods in quadruple precision: Radau IIA of order 13 and,
-- at another tolerance, Gauss of order 16 or (stiff = true) Radau IIA of order 17.
--     build/release/bench/bench_dae bench/reference.lua [words of a name]
-- Printed are the digits on which the two agree, at most 18; bench/problems/references.lua keeps them.
local here = arg[0]:match "(.*/)" or "./"
local problems = assert(loadfile(here .. "problems.lua"))(here)
local wanted = table.concat(arg, " ")

--- The digits that two texts of numbers share, and how many they are.
local function shared(a, b)
  local x, y = tonumber(a), tonumber(b)
  local mantissa = a:gsub("e.*", ""):gsub("[-.]", ""):gsub("^0+", "")
  local other = b:gsub("e.*", ""):gsub("[-.]", ""):gsub("^0+", "")
  local apart = math.abs(x - y)/math.abs(x)
  if apart > 1e-12 then return "", math.floor(-math.log(apart, 10)) end
  local n = 0
  while n < #mantissa and mantissa:byte(n + 1) == other:byte(n + 1) do n = n + 1 end
  return string.format("%.17g", x), n
end

for _, problem in ipairs(problems) do
  if problem.count and not problem.slow and problem.name:find(wanted, 1, true) then
    local began = os.clock()
    local model = problem.model(problem)
    local form = model:index() > 1 and model:reduce "acc" or model
    local size = problem.atol and problem.atol(1) or 1e-3
    local function run(stages, gauss, tolerance)
      local breaks = problem.breaks
      return form:quad { start = problem.start, to = problem.to, stages = stages, gauss = gauss,
        tolerance = tolerance, size = size, breaks = breaks }
    end
    local good, why = pcall(function()
      local a = run(7, false, problem.precision or 1e-20)
      local b = run(problem.stiff and 9 or 8, not problem.stiff, (problem.precision or 1e-20)*100)
      local least, parts = 99, {}
      for _, name in ipairs(problem.count) do
        if not a[name] then error("no component " .. name) end
        local text, n = shared(a[name], b[name])
        least = math.min(least, n)
        parts[#parts + 1] = string.format("%s = %s", name, text)
      end
      print(string.format('["%s"] = { %s },  -- %d digits; %d and %d steps, %.1f s', problem.name,
        table.concat(parts, ", "), least, a.steps, b.steps, os.clock() - began))
    end)
    if not good then print("-- " .. problem.name .. ": " .. tostring(why)) end
    io.flush()
  end
end
