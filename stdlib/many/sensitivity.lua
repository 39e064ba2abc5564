-- Which of the quantities that vary matter: Sobol' indices and Morris' elementary effects.
local answers = include "many/answers"
local sensitivity = {}

local function require_design(s, name, what)
  if s.design ~= name then
    fail(('%s: the sweep must be made with design = "%s", this one has %s'):format(what, name,
      s.design and '"' .. s.design .. '"' or "lists"))
  end
end

-- Base points whose d + 2 runs all have a value: yA, yB and yAB[i].
local function base_points(values, d)
  local points = {}
  for first = 1, #values, d + 2 do
    local point, whole = {}, true
    for k = 0, d + 1 do
      local v = values[first + k]
      whole = whole and v == v
      point[k + 1] = v
    end
    if whole then points[#points + 1] = point end
  end
  return points
end

-- First (Saltelli) and total (Jansen) indices from some of the base points.
local function indices(points, chosen, d)
  local n, mean, square = 0, 0, 0
  for _, i in ipairs(chosen) do
    for k = 1, 2 do
      local v = points[i][k]
      n = n + 1
      local change = v - mean
      mean = mean + change/n
      square = square + change*(v - mean)
    end
  end
  local variance = square/(n - 1)
  local first, total = {}, {}
  for j = 1, d do
    local a, b = 0, 0
    for _, i in ipairs(chosen) do
      local p = points[i]
      a = a + (p[2] - mean)*(p[j + 2] - p[1])
      b = b + (p[1] - p[j + 2])^2
    end
    first[j], total[j] = a/#chosen/variance, b/(2*#chosen)/variance
  end
  return first, total, variance
end

local function interval(samples, confidence)
  local q = quantile(samples, { (1 - confidence)/2, (1 + confidence)/2 })
  return { q[1], q[2] }
end

-- The rows of a table of indices.
function sensitivity.text(names, first, total, first_interval, total_interval)
  local lines = { ("%-12s %8s %18s %8s %18s"):format("", "first", "interval", "total", "interval") }
  for j, name in ipairs(names) do
    local function between(list)
      return list and ("%8.4f…%7.4f"):format(list[j][1], list[j][2]) or ""
    end
    lines[#lines + 1] = ("%-12s %8.4f %20s %8.4f %20s"):format(name, first[j], between(first_interval),
      total[j],
      between(total_interval)):gsub("%s+$", "")
  end
  return table.concat(lines, "\n")
end

function sensitivity.sobol(s, e, options)
  options = options or {}
  require_design(s, "saltelli", "sobol")
  if s.correlated then fail "sobol: shares of variance are not defined for quantities that vary together" end
  local names, d = s.names, s.dimensions
  if #names ~= d then fail "sobol: parameters given as lists cannot be analysed; give numbers or distributions" end
  local points = base_points(answers.values(s, e, options.t), d)
  if #points < 2 then fail "sobol: fewer than two base points have all their runs; see s.failures" end
  local all = {}
  for i = 1, #points do all[i] = i end
  local first, total, variance = indices(points, all, d)
  if not (variance > 0) then fail "sobol: the value is the same in all runs" end
  local repeats, confidence = options.bootstrap or 200, options.confidence or 0.95
  local firsts, totals = {}, {}
  for j = 1, d do firsts[j], totals[j] = {}, {} end
  for b = 1, repeats do
    local chosen = {}
    for i = 1, #points do
      chosen[i] = 1 + math.floor(#points*random_at(options.seed or 0, (b - 1)*#points + i))
    end
    local f, g = indices(points, chosen, d)
    for j = 1, d do firsts[j][b], totals[j][b] = f[j], g[j] end
  end
  local first_interval, total_interval = {}, {}
  for j = 1, d do
    first_interval[j] = repeats > 0 and interval(firsts[j], confidence) or { first[j], first[j] }
    total_interval[j] = repeats > 0 and interval(totals[j], confidence) or { total[j], total[j] }
  end
  return record("sobol_indices", { names = names, first = first, total = total,
    first_interval = first_interval,
    total_interval = total_interval,
    text = sensitivity.text(names, first, total, first_interval, total_interval) })
end

function sensitivity.morris(s, e, t)
  require_design(s, "morris", "morris")
  local names, d, values = s.names, s.dimensions, answers.values(s, e, t)
  local n, sum, size, square = {}, {}, {}, {}
  for j = 1, d do n[j], sum[j], size[j], square[j] = 0, 0, 0, 0 end
  for first = 1, #values, d + 1 do
    for k = first, first + d - 1 do
      for j = 1, d do
        local step = s:unit(k + 1, j) - s:unit(k, j)
        local effect = (values[k + 1] - values[k])/step
        if step ~= 0 and effect == effect then
          n[j], sum[j], size[j], square[j] = n[j] + 1, sum[j] + effect, size[j] + math.abs(effect),
            square[j] + effect^2
        end
      end
    end
  end
  local mu, star, sigma, lines = {}, {}, {}, { ("%-12s %13s %13s %13s"):format("", "μ", "μ*", "σ") }
  for j = 1, d do
    if n[j] == 0 then fail "morris: no trajectory has a value; see s.failures" end
    mu[j], star[j] = sum[j]/n[j], size[j]/n[j]
    sigma[j] = n[j] > 1 and math.sqrt(math.max(0, square[j] - n[j]*mu[j]^2)/(n[j] - 1)) or 0
    lines[j + 1] = ("%-12s %12.5g %12.5g %12.5g"):format(names[j], mu[j], star[j], sigma[j])
  end
  return record("morris_effects", { names = names, mu = mu, mu_star = star, sigma = sigma,
    text = table.concat(lines, "\n") })
end

return sensitivity
