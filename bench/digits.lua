-- Digits reached against digits asked for: every problem with a reference, by every method, from rtol = 1e-4
-- to 1e-13.
--     pendula bench/digits.lua [-m method,method …] [words of a name]
-- A number is -log10 of the largest relative error of the components that count, at the end; in brackets: the
-- run was not finished. "–": the method refuses the model, or takes more steps than are allowed here. Behind
-- a row: the digits that the tightest run lacks of those it was asked for, where that is more than two.
local here = arg[0]:match "(.*/)" or "./"
local problems = assert(loadfile(here .. "problems.lua"))(here)
local tolerances = { 1e-4, 1e-6, 1e-8, 1e-10, 1e-11, 1e-12, 1e-13 }
local methods = { "default", "radau", "rodas", "bdf", "gauss", "rkc", "rock4", "dopri5", "dop853", "verner87",
  "verner98" }
if arg[1] == "-m" then
  methods = {}
  for name in arg[2]:gmatch "[^,]+" do methods[#methods + 1] = name end
  table.remove(arg, 1)
  table.remove(arg, 1)
end
local wanted = table.concat(arg, " ")

local function digits(sol, problem)
  local worst = 1e-16
  for name, exact in pairs(problem.reference) do
    local error = math.abs((sol:final(name) - exact)/exact)
    if error ~= error then return 0 end
    worst = math.max(worst, error)
  end
  return -math.log(worst, 10)
end

--- One cell; nil where there is nothing to be said.
local function cell(problem, model, method, rtol)
  local few = method == "bdf" or method == "rodas" or method == "dopri5"
  local good, sol = pcall(model.integrate, model, { start = problem.start, to = problem.to, rtol = rtol,
    atol = problem.atol and problem.atol(rtol) or rtol, method = method ~= "default" and method or nil,
    times = { problem.to }, max_steps = few and 100000 or 30000 })
  if not good then return nil, sol end
  if sol.status:find "max_steps" then return nil, sol.status end
  return sol.status == "finished" and string.format("%.1f", digits(sol, problem)) or "(stop)",
    sol:stats().method .. ": " .. sol.status, sol:stats()
end

for _, problem in ipairs(problems) do
  local runs = problem.reference and not problem.slow and not problem.tolerances
  if runs and problem.name:find(wanted, 1, true) then
    local model = problem.model(problem)
    model = problem.ours and problem.ours(model) or model:index() > 1 and model:reduce() or model
    print(problem.name)
    for _, method in ipairs(methods) do
      local row, last, note, any = {}, nil, "", false
      for k, rtol in ipairs(tolerances) do
        local text, words, stats = cell(problem, model, method, rtol)
        row[k] = string.format("%7s", text or "–")
        if text then any = true end
        if method == "default" and stats then note = stats.method .. "" end
        if text and tonumber(text) then last = { rtol, tonumber(text) } else note = words:gsub("\n.*", "") end
        if not text then break end
      end
      if any then
        local lacking = last and -math.log(last[1], 10) - last[2] or 0
        print(string.format("  %-10s%s  %s %s", method, table.concat(row),
          lacking > 2 and string.format("lacks %.1f", lacking) or "", note:sub(1, 70)))
        io.flush()
      end
    end
  end
end
