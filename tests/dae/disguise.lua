-- Models whose index, degrees of freedom and solution are known by construction: Weierstrass forms
--   v_i′ = -a_i v_i,   0 = w₁ + sin t,   w₂ = w₁′,   w₃ = w₂′ …        (index = length of the longest chain)
-- disguised by maps of the unknowns (sums, products, exponentials, functions of time), by combinations of
-- the equations with multipliers that vary, by the order of unknowns and equations, and by units between
-- 10⁻¹² and 10¹². Seeded: a seed gives the same model in every run.
--   pendula tests/dae/disguise.lua [first seed] [last seed]     the campaign; ./dev disguises
-- Run so far: 1 … 3000 (November 2026): all right; see disguise_test.lua.
local disguise = {}

local function draws(seed)
  local state = seed * 7919 + 17
  return function(n)                                        -- an integer in 1 … n
    state = (state * 1103515245 + 12345) % 2147483648
    return state // 65536 % n + 1
  end
end

local function shuffled(list, draw)
  local out = table.move(list, 1, #list, 1, {})
  for i = #out, 2, -1 do
    local j = draw(i)
    out[i], out[j] = out[j], out[i]
  end
  return out
end

-- w_i as a function of y_i and an earlier w, e, and the value of y_i for a value of w_i.
local kinds = {
  { w = function(own) return own end, y = function(w) return w end },
  { w = function(own, e) return own + e^2 / 2 end, y = function(w, e) return w - e^2 / 2 end },
  { w = function(own, e) return own + sin(e) end, y = function(w, e) return w - math.sin(e) end },
  { w = function(own, e) return own + e * cos(t) end,
    y = function(w, e, at) return w - e * math.cos(at) end },
  { w = function(own, e) return own + exp(e / 3) - 1 end,
    y = function(w, e) return w - math.exp(e / 3) + 1 end },
  { w = function(own, e) return own * exp(e / 5) end, y = function(w, e) return w * math.exp(-e / 5) end },
  { w = function(own, e) return own * (3 + sin(e)) end,
    y = function(w, e) return w / (3 + math.sin(e)) end },
  { w = function(own) return own + own^3 / 4 end, y = function(w)
    local y = w / (1 + math.abs(w) / 3)
    for _ = 1, 60 do y = y - (y + y^3 / 4 - w) / (1 + 3 * y^2 / 4) end
    return y
  end },
  { w = function(own) return own * (2 + cos(t)) end,
    y = function(w, _, at) return w / (2 + math.cos(at)) end },
  { w = function(own) return sinh(own) end, y = function(w) return math.log(w + math.sqrt(w^2 + 1)) end },
}

-- The k-th derivative of -sin t.
local function chain_value(k, at)
  return ({ -math.sin(at), -math.cos(at), math.sin(at), math.cos(at) })[k % 4 + 1]
end

-- { sys, y, unit, free (indices of y that are free), exact(at) -> values of y }
function disguise.model(seed, options)
  local draw = draws(seed)
  local n = options.dof + options.index + (options.second or 0)
  local y, unit, own, w, kind, before = {}, {}, {}, {}, {}, {}
  local places = shuffled((function() local l = {} for i = 1, n do l[i] = i end return l end)(), draw)
  for i = 1, n do
    y[i] = var("y" .. places[i])
    unit[i] = 10.0^math.floor((draw(25) - 13) * options.scale)
    own[i] = y[i] / unit[i]
    kind[i] = kinds[options.linear and 1 or i == 1 and ({ 1, 8, 9, 10 })[draw(4)] or draw(#kinds)]
    before[i] = i > 1 and draw(i - 1) or 1
    w[i] = kind[i].w(own[i], w[before[i]])
  end
  local F, rate = {}, {}
  for i = 1, options.dof do
    rate[i] = i / 2
    F[i] = der(w[i]) + rate[i] * w[i]
  end
  local function chain(first, length)
    for k = 1, length do
      F[first + k] = k == 1 and w[first + 1] + sin(t) or der(w[first + k - 1]) - w[first + k]
    end
  end
  chain(options.dof, options.index)
  chain(options.dof + options.index, options.second or 0)
  local equations = {}
  for i = 1, n do                                             -- a row of a triangular matrix with units
    local sum = F[i]
    if i > 1 then
      local j = draw(i - 1)
      local factor = options.linear and draw(3) - 2 or ({ cos(t), w[j], 0, 2 + sin(w[j]), exp(-t) })[draw(5)]
      sum = sum + factor * F[j]
    end
    equations[i] = sum * 10.0^math.floor((draw(25) - 13) * options.scale) ~ 0
  end
  local function exact(at)
    local values, target = {}, {}
    for i = 1, options.dof do target[i] = (0.5 + 0.2 * i) * math.exp(-rate[i] * (at - 0.3)) end
    for k = 1, options.index do target[options.dof + k] = chain_value(k - 1, at) end
    for k = 1, options.second or 0 do target[options.dof + options.index + k] = chain_value(k - 1, at) end
    for i = 1, n do values[i] = kind[i].y(target[i], target[before[i]], at) * unit[i] end
    return values
  end
  return { sys = dae(shuffled(equations, draw)), y = y, unit = unit, exact = exact, free = options.dof }
end

-- What a seed stands for.
function disguise.options(seed)
  local index = seed % 7
  return { index = index, dof = seed // 7 % 3 + (index == 0 and 1 or 0), linear = seed % 5 == 0,
    second = index > 1 and seed % 3 == 0 and draws(seed)(index - 1) or 0,
    scale = ({ 1, 0, 0.25, 0.5 })[seed // 3 % 4 + 1] }
end

-- The largest error of `of(y)` against `values`, in units of the unknowns, and where.
local function compared(m, of, values)
  local worst, where = 0, ""
  for i, y in ipairs(m.y) do
    local error = math.abs(of(y) - values[i]) / (math.abs(values[i]) + m.unit[i])
    if not (error <= worst) then worst, where = error, ("%s = %g, not %g"):format(y, of(y), values[i]) end
  end
  return worst, where
end

-- Forms that do not exist for a model, for the reason that they give.
local refusals = { "integrated as it stands", "sys:reduce() gives them", "has no differential variable",
  "is not linear in", "no constraint is differentiated twice", "the form is made for two", "has no row",
  "linear or quadratic in none", "is quadratic in", "all its states are independent",
  "do not determine all unknowns" }
local function is_refusal(text)
  for _, words in ipairs(refusals) do if text:find(words, 1, true) then return true end end
  return false
end

-- Tolerances in units of the unknowns and their derivatives, for those that a form has.
local function tolerances(m, start, low)
  local names, atol = {}, {}
  for _, list in ipairs { low.differential, low.algebraic } do
    for i = 1, #list do names[tostring(list[i])] = true end
  end
  for i, y in ipairs(m.y) do
    if names[tostring(y)] then
      atol[y] = 1e-9 * m.unit[i]
      for k = 1, 9 do                                        -- a derivative that is a state
        local leaf = der(y, k)
        local ok, why = pcall(low.integrate, low, { start = start, to = start.t, atol = { [leaf] = 1 } })
        if not ok and tostring(why):find "is not a state" then break end
        atol[leaf] = atol[y]
      end
    end
  end
  return atol
end

local function first_line(text) return (tostring(text):gsub("\n.*", "")) end

local every_form = { "auto", "array", "acc", "ggl", "baumgarte", "project", "dummy", "minimal", "ode" }

-- Calls wrong(what, text) for everything that is not as it has to be.
function disguise.check(seed, wrong, forms)
  local options = disguise.options(seed)
  local m = disguise.model(seed, options)
  local sys, at = m.sys, 0.3
  local function expected(what, wanted, f)
    local ok, found = pcall(f)
    if not ok then
      wrong(what, first_line(found))
    elseif found ~= wanted then
      wrong(what, ("%s, not %s"):format(found, wanted))
    end
  end
  expected("index", options.index, function() return sys:index() end)
  expected("dof", options.dof, function() return sys:dof() end)
  local exact, free, guess, all = m.exact(at), {}, {}, {}
  for i, y in ipairs(m.y) do
    (i <= m.free and free or guess)[y] = exact[i]
    all[y] = exact[i]
  end
  local function start(what, low, request)
    request.from = at
    local ok, found = pcall(function() return low:init(request) end)
    if not ok then return wrong(what, first_line(found)) end
    local worst, where = compared(m, found, exact)
    if worst > 1e-6 then return wrong(what, where) end
    return found
  end
  start("start from all true values", sys, { fix = all })
  local begin = start("start", sys, { fix = free, guess = guess })
  if not begin then return end
  for _, form in ipairs(forms or every_form) do
    local made, low = pcall(function()
      if form == "auto" then return sys:reduce() end
      return sys:reduce(form, form == "array" and { at = begin } or nil)   -- the rows that suit this start
    end)
    if not made then
      if not is_refusal(low) then wrong("reduce " .. form, first_line(low)) end
    else
      local ran, sol = pcall(function()
        local atol = tolerances(m, begin, low)
        return low:integrate { start = begin, from = at, to = at + 0.5, rtol = 1e-8, atol = atol }
      end)
      if not ran then
        wrong("integrate " .. form, first_line(sol))
      elseif sol.status ~= "finished" then
        wrong("integrate " .. form, sol.status)
      else
        local worst, where = compared(m, function(y) return sol(y, at + 0.5) end, m.exact(at + 0.5))
        if worst > 1e-4 then wrong("solution " .. form, where) end
      end
    end
  end
end

-- Seeds first … last; the number of things that are wrong.
function disguise.campaign(first, last)
  local count = 0
  for seed = first, last do
    local o = disguise.options(seed)
    disguise.check(seed, function(what, text)
      count = count + 1
      print(("seed %d, index %d (and %d), dof %d%s, units 10^±%g: %s: %s"):format(seed, o.index, o.second,
        o.dof, o.linear and ", linear" or "", 12 * o.scale, what, text))
    end)
  end
  print(("%d models, %d wrong"):format(last - first + 1, count))
  return count
end

if arg and arg[0] and arg[0]:find "disguise%.lua$" then
  os.exit(disguise.campaign(tonumber(arg[1] or 1), tonumber(arg[2] or 2000)) == 0)
end
return disguise
