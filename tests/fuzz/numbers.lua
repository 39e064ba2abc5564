-- Random models by random methods and tolerances. "finished" has to mean finite, and within 100 tolerances of
-- a second, tighter run by another method; else the run says that the errors of its steps add up to more.
--   pendula tests/fuzz/numbers.lua seed runs [wild] [z] [narrow]
-- narrow: peaks, steps and dips of width 10⁻² … 10⁻⁴ in place of |…|.
-- z: the last of the unknowns is algebraic, c = f(t, a, b) or c + c³/9 = f(t, a, b). wild: terms √|…|, whose
-- slope is infinite where they vanish, and quotients through 0 (docs/robustness.md: open findings).
local seed, runs = tonumber(arg[1] or 1), tonumber(arg[2] or 40)
local asked = table.concat(arg, " ", 3)
local wild, algebraic = asked:find "wild" ~= nil, asked:find "z" ~= nil
local narrow = asked:find "narrow" ~= nil
math.randomseed(seed)
local random = math.random
local function pick(list) return list[random(#list)] end
local function number() return math.floor((random() - 0.5)*60)/10 end

local names = { "a", "b", "c" }
local states = { var "a", var "b", var "c" }
local known = algebraic and { states[1], states[2] } or states  -- what equations are made of

local function feature(u)
  u = u*10^random(2, 4)
  return pick { exp(-u^2), 1/(1 + u^2), tanh(u), u/sqrt(u^2 + 1), 1/cosh(u), u*exp(-u^2), 1/(1 + u^4) }
end

local function term(depth)
  local kind = random(depth > 2 and 3 or 12)
  if kind == 1 then return number() end
  if kind <= 3 then return pick(known) end
  if kind == 4 then return t end
  if kind == 5 then return sin(term(depth + 1)) end
  if kind == 6 then return cos(term(depth + 1)) end
  if kind == 7 then return exp(-term(depth + 1)^2) end
  if kind == 8 then return term(depth + 1)*term(depth + 1) end
  if kind == 9 then return term(depth + 1)/(1 + term(depth + 1)^2) end
  if kind == 10 and narrow then return feature(term(depth + 1)) end
  if kind == 10 then return wild and sqrt(abs(term(depth + 1))) or abs(term(depth + 1)) end
  if kind == 11 then
    local above, below = term(depth + 1), wild and term(depth + 1) or 2 + cos(term(depth + 1))
    local good, quotient = pcall(function() return above/below end)  -- an exact 0 is refused
    return good and quotient or above
  end
  return term(depth + 1) - term(depth + 1)
end

-- Constants that overflow are refused where they are written: another one then.
local function made_of_term(equation)
  local good, made
  repeat good, made = pcall(function() return equation(term(0)) end) until good
  return made
end

local function equation(state)
  local damping = random(2) == 1 and random(0, 20) or 0
  return made_of_term(function(e) return der(state) ~ e - damping*state end)
end

-- Whether the equations explain what the check has found: an error of one tolerance at some moment grows to
-- a twentieth of it, or so much that the errors which the run states for its steps make it. No method
-- controls more than the error of each step. The runs from a moment are tight and compared with each other,
-- so that `sol` itself is not excused.
local function ill_conditioned(equations, options, sol, check)
  local stated = math.max(20, sol:stats().errors*math.sqrt(3))  -- the sum is of root mean squares
  local moments = {}  -- of time, and of steps: where they are short the equations vary most
  for k = 0, 15 do
    moments[#moments + 1] = options.to*k/16
    moments[#moments + 1] = sol.t[1 + k*(#sol.t - 1)//16]
  end
  local function moved(from, sign)
    local start = {}
    for i, state in ipairs(known) do
      local value = sol(state, from)
      start[names[i]] = value + sign*options.rtol*(math.abs(value) + 1e-3)
    end
    return dae(equations):integrate { start = start, from = from, to = options.to, rtol = options.rtol/100 }
  end
  for _, from in ipairs(moments) do
    local good, runs = pcall(function() return { moved(from, 0), moved(from, 1), moved(from, -1) } end)
    if not good then return true end
    for i, state in ipairs(states) do
      local row = check[i]
      if row.tolerances > 100 and row.at >= from then
        for _, run in ipairs(runs) do
          if run.status ~= "finished" then return true end
          local grown = math.abs(run(state, row.at) - runs[1](state, row.at))
          if not (grown*stated < row.difference) then return true end
        end
      end
    end
  end
  return false
end

local methods = { "radau", "bdf", "rodas", "gauss", "dopri5", "tsit5", "dop853" }
local made, finished, stopped, refused, unsure, said = 0, 0, 0, 0, 0, 0
for run = 1, runs do
  made = run
  local equations, start = {}, {}
  local size = random(1, 3)
  for i = 1, size do
    equations[i] = equation(states[i])
    start[names[i]] = number()/3
  end
  for i = size + 1, 3 do
    equations[i] = der(states[i]) ~ -states[i]
    start[names[i]] = 1
  end
  if algebraic then
    local c = states[3]
    equations[1] = der(states[1]) ~ c - random(0, 5)*states[1]
    local bent = random(2) == 1 and c^3/9 or 0
    equations[3] = made_of_term(function(e) return c + bent ~ e end)
    start[names[3]] = nil
  end
  local options = { start = start, to = pick { 0.3, 1, 3, 10 }, rtol = pick { 1e-4, 1e-6, 1e-8 },
    max_steps = 20000 }
  if random(3) > 1 then options.method = pick(methods) end
  local where = ("seed %d, run %d, %s, to %g, rtol %g: "):format(seed, run, options.method or "auto",
    options.to,
    options.rtol)
  local good, sol = pcall(function() return dae(equations):integrate(options) end)
  if not good then
    refused = refused + 1
    if tostring(sol):find("internal error", 1, true) then error(where .. tostring(sol), 0) end
  elseif sol.status ~= "finished" then
    stopped = stopped + 1
  else
    finished = finished + 1
    for _, state in ipairs(states) do
      local value = sol(state, options.to)
      if value ~= value or math.abs(value) == math.huge then
        error(where .. "finished with " .. tostring(value), 0)
      end
    end
    local done, check = pcall(sol.check, sol)
    if not done or check.second ~= "finished" then
      unsure = unsure + 1
    elseif not check.good then
      local unsure_itself = tostring(sol):find("sol:check() estimates", 1, true) ~= nil
      if unsure_itself or sol:stats().not_unique ~= "" then said = said + 1
      elseif ill_conditioned(equations, options, sol, check) then unsure = unsure + 1 else
        for i = 1, 3 do print(equations[i], start[names[i]]) end
        error(where .. tostring(check), 0)
      end
    end
  end
end
print(("%d runs: %d finished, %d stopped, %d refused, %d without a judge, %d off that say so"):format(made,
  finished, stopped, refused, unsure, said))
