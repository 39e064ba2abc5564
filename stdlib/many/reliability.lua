-- Subset simulation: the probability that a limit state falls below zero, level by level. Au & Beck,
-- Probabilistic Eng. Mech. 16(4), 2001; proposals: Papaioannou et al., Prob. Eng. Mech. 41, 2015 (conditional
-- sampling: u' = ρ u + √(1 - ρ²) ξ keeps the normal distribution, accepted where g stays below the level).
local reliability = {}

local function sorted_names(params, start)
  local list = {}
  for place, entries in pairs { params = params or {}, start = start or {} } do
    for key, value in pairs(entries) do
      local kind = object_type(value)
      if kind == "joint_component" or kind == "joint_distribution" then
        fail "reliability: quantities that vary together are not treated; give independent distributions"
      end
      if kind == "density" then value = value.distribution kind = "distribution" end
      if kind == "distribution" then
        list[#list + 1] = { place = place, key = key, name = tostring(key), distribution = value }
      end
    end
  end
  table.sort(list, function(a, b) return a.place .. a.name < b.place .. b.name end)
  return list
end

local normal_cdf = normal(0, 1)

-- g for a list of points in the standard normal space, by one sweep over lists.
local function evaluate_points(problem, points)
  local options = {}
  for key, value in pairs(problem.options) do options[key] = value end
  for _, place in ipairs { "params", "start" } do
    local copy = {}
    for key, value in pairs(options[place] or {}) do copy[key] = value end
    options[place] = copy
  end
  for j, item in ipairs(problem.list) do
    local column = {}
    for i, u in ipairs(points) do column[i] = item.distribution:quantile(normal_cdf:cdf(u[j])) end
    options[item.place][item.key] = #column > 1 and column or { column[1], column[1] }
  end
  local s = sweep(problem.sys, options)
  problem.runs = problem.runs + #points
  local values, g = problem.t and s(problem.g, problem.t) or s:final(problem.g), {}
  for i = 1, #points do
    g[i] = values[i]
    if g[i] ~= g[i] then fail("reliability: a run failed: " .. s.failures[1].why) end
  end
  return g
end

local function normal_number(problem)
  problem.count = problem.count + 1
  return normal_cdf:quantile(random_at(problem.seed, problem.count))
end

-- New points from the seeds of a level: chains that move together, one step of all per sweep.
local function conditional(problem, seeds, g_seeds, level, n)
  local points, g, now, g_now = {}, {}, seeds, g_seeds
  local rho = 0.8
  while #points < n do
    local proposals = {}
    for i, u in ipairs(now) do
      local v = {}
      for j = 1, #problem.list do v[j] = rho*u[j] + math.sqrt(1 - rho^2)*normal_number(problem) end
      proposals[i] = v
    end
    local values = evaluate_points(problem, proposals)
    local next, g_next = {}, {}
    for i = 1, #now do
      local accepted = values[i] <= level
      next[i], g_next[i] = accepted and proposals[i] or now[i], accepted and values[i] or g_now[i]
      if #points < n then points[#points + 1], g[#g + 1] = next[i], g_next[i] end
    end
    now, g_now = next, g_next
  end
  return points, g
end

-- The share p of points that are inside, and its squared coefficient of variation, (1 - p)/(p n) (1 + γ): the
-- points of one chain, which stand `chains` apart, resemble each other (Au & Beck, 2001, eqs. 27 to 29).
local function share_of(inside, chains)
  local n, count = #inside, 0
  for i = 1, n do if inside[i] then count = count + 1 end end
  local p = count/n
  if count == 0 then return 0, 1 elseif count == n then return 1, 0 end
  local gamma = 0
  for lag = chains, n - 1, chains do
    local both = 0
    for i = 1, n - lag do if inside[i] and inside[i + lag] then both = both + 1 end end
    gamma = gamma + 2*(1 - lag/n)*(both/(n - lag) - p^2)/(p*(1 - p))
  end
  return p, (1 - p)/count*(1 + math.max(gamma, 0))
end

local function inside_of(g, level)
  local inside = {}
  for i = 1, #g do inside[i] = g[i] < level end
  return inside
end

function reliability.reliability(sys, given)
  local options = {}
  for key, value in pairs(given) do options[key] = value end
  local n, p0, seed_ = options.runs or 1000, options.p0 or 0.1, options.seed or 0
  if options.limit_state == nil then
    fail "reliability: limit_state is missing: an expression that is < 0 at failure"
  end
  if not (p0 > 0 and p0 < 0.5) then
    fail(("reliability: p0 = %g; it must lie between 0 and 0.5"):format(p0))
  end
  local problem = { sys = sys, g = options.limit_state, t = options.t, options = options, seed = seed_,
    count = 0,
    runs = 0, list = sorted_names(options.params, options.start) }
  if #problem.list == 0 then fail "reliability: params and start contain no distribution" end
  for _, key in ipairs { "limit_state", "runs", "p0", "seed", "t" } do options[key] = nil end
  local points = {}
  for i = 1, n do
    points[i] = {}
    for j = 1, #problem.list do points[i][j] = normal_number(problem) end
  end
  local g, chains = evaluate_points(problem, points), n
  local p, square, most, keep = 1, 0, 30, math.max(1, math.floor(p0*n))
  for level = 1, most do
    local order = {}
    for i = 1, n do order[i] = i end
    table.sort(order, function(a, b) return g[a] < g[b] or (g[a] == g[b] and a < b) end)
    local border = g[order[keep]]
    local last = border < 0 or level == most
    local share, variance = share_of(inside_of(g, last and 0 or g[order[keep + 1]]), chains)
    p, square = p*(last and share or keep/n), square + variance
    if last then
      return record("reliability_result", { p = p, cov = math.sqrt(square), levels = level,
        runs = problem.runs,
        text = ("probability of failure %.4g (coefficient of variation about %.2g), %s, %d runs")
          :format(p, math.sqrt(square), counted(level, "level"), problem.runs) })
    end
    local seeds, g_seeds = {}, {}
    for i = 1, keep do seeds[i], g_seeds[i] = points[order[i]], g[order[i]] end
    chains = keep
    points, g = conditional(problem, seeds, g_seeds, border, n)
  end
end

return reliability
