-- Many fits of one model: from other guesses, with a parameter held, to other data. Each is a call of r:refit
-- in a worker process; what comes back are its loss and its estimates.
local refits = {}

-- loss and estimates of n fits; what(i) gives the options of r:refit. Fits that fail are counted, and so are
-- those that Ctrl-C left.
local function fits(r, n, options, what)
  local results, failures, left = parallel_calls(n, function(i)
    local one = r:refit(what(i))
    local numbers = { one.loss }
    for j = 1, #one.theta do numbers[j + 1] = one.theta[j] end
    return numbers
  end, { seed = options.seed, workers = options.workers, title = "fits" })
  local list = {}
  for i = 1, n do
    if results[i] then
      local theta = {}
      for j = 2, #results[i] do theta[j - 1] = results[i][j] end
      list[#list + 1] = { loss = results[i][1], theta = theta, index = i }
    end
  end
  if #list == 0 then fail("every fit failed; the first: " .. failures[1].why) end
  return list, #failures, left
end

-- ", 2 failed, 5 not made (interrupted)"
local function lost_text(failed, left)
  return (failed > 0 and (", %d failed"):format(failed) or "")
    .. (left > 0 and (", %d not made (interrupted)"):format(left) or "")
end

local function with_defaults(given, defaults)
  return setmetatable({}, { __index = function(_, key)
    if given[key] ~= nil then return given[key] end
    return defaults[key]
  end })
end

local function whole(name, key, value, least)
  if math.type(value) ~= "integer" or value < least then
    fail(("%s: %s = %s; it must be a whole number of at least %d"):format(name, key, tostring(value), least))
  end
end

local function place_of(name, r, parameter)
  local wanted = tostring(parameter)
  for i, each in ipairs(r.names) do
    if each == wanted or each == wanted .. "(0)" then return i end
  end
  fail(("%s: %s was not estimated (params: %s)"):format(name, wanted, table.concat(r.names, ", ")))
end

-- The name under which r:refit knows an estimate: x(0) is the state x.
local function key_of(r, i) return (r.names[i]:gsub("%(0%)$", "")) end

-- Residuals of exact data are errors of the integration: what they say of the estimates is no interval.
local function require_noise(name, r)
  if not r.exact then return end
  fail(("%s: the data are exact, the model reproduces them to the accuracy of the integration (rms residual %.2g); "
    .. "without noise the estimates have no interval"):format(name, math.sqrt(r.loss)))
end

-- ── profile likelihood ─────────────────────────────────────────────────────────────────────────────────────

-- z = ± √(N ln(V/V̂)), nearly linear in the parameter, crosses ± √χ² at the ends of the interval.
local function crossing(points, side, limit)
  for i = 2, #points do
    local a, b = points[i - 1], points[i]
    if side < 0 then a, b = points[#points - i + 2], points[#points - i + 1] end
    if math.abs(a.z) <= limit and side*b.z > limit then
      return a.value + (b.value - a.value)*(side*limit - a.z)/(b.z - a.z)
    end
  end
  return nil
end

function refits.profile(r, parameter, given)
  local options = with_defaults(given, { points = 21, confidence = 0.95 })
  whole("profile", "points", options.points, 5)
  if not (options.confidence > 0 and options.confidence < 1) then
    fail(("profile: confidence = %g; it must lie between 0 and 1"):format(options.confidence))
  end
  local place = place_of("profile", r, parameter)
  local key, best, N = key_of(r, place), r.theta[place], #r.residuals
  require_noise("profile", r)
  local limit = normal(0, 1):quantile(0.5 + options.confidence/2)
  local deviation = r.std[place]
  if not (deviation > 0 and deviation < math.huge) then deviation = best ~= 0 and math.abs(best)/4 or 1 end
  local low, high = best - 2*limit*deviation, best + 2*limit*deviation
  if options.range then low, high = options.range[1], options.range[2] end
  local points, failed, left = { { value = best, z = 0, loss = r.loss } }, 0, 0
  local function add(from, to)
    local list, lost, unmade = fits(r, options.points, options, function(i)
      return { fixed = { [key] = from + (to - from)*(i - 1)/(options.points - 1) } }
    end)
    failed, left = failed + lost, left + unmade
    for _, one in ipairs(list) do
      local value = from + (to - from)*(one.index - 1)/(options.points - 1)
      points[#points + 1] = { value = value, loss = one.loss, theta = one.theta,
        z = (value < best and -1 or 1)*math.sqrt(math.max(0, N*math.log(one.loss/r.loss))) }
    end
    table.sort(points, function(a, b) return a.value < b.value end)
  end
  add(low, high)
  local from, to
  for _ = 1, options.range and 1 or 4 do                -- wider, by a factor of 2, where a side stays open
    from, to = crossing(points, -1, limit), crossing(points, 1, limit)
    if from and to or options.range or left > 0 then break end
    local width = high - low
    if not from then add(low - width, low) low = low - width end
    if not to then add(high, high + width) high = high + width end
  end
  local better
  for _, point in ipairs(points) do
    if point.loss < r.loss*(1 - 1e-6) and (not better or point.loss < better.loss) then better = point end
  end
  local values, losses = {}, {}
  for i, point in ipairs(points) do values[i], losses[i] = point.value, point.loss end
  local function border(value, side)
    return value and ("%.6g"):format(value) or ("open %s %.6g"):format(side, side == "below" and low or high)
  end
  local lines = { ("%s = %.6g; %g %% interval by profile likelihood: %s … %s"):format(r.names[place], best,
    100*options.confidence, border(from, "below"), border(to, "above")) }
  if not (from and to) and left == 0 then
    lines[#lines + 1] = ("  not identifiable on the open side: the other parameters compensate for %s")
      :format(r.names[place])
  end
  if better then
    lines[#lines + 1] = ("  a better fit exists: V = %.6g < %.6g at %s = %.6g; fit again from there"):format(
      better.loss, r.loss, r.names[place], better.value)
  end
  if failed + left > 0 then
    lines[#lines + 1] = ("  %d fits%s"):format(#points - 1, lost_text(failed, left))
  end
  return record("profile_result", { name = r.names[place], best = best, low = from, high = to,
    values = values, losses = losses, level = r.loss*math.exp(limit^2/N), failed = failed,
    text = table.concat(lines, "\n") })
end

function refits.plot_profile(p, options)
  local chosen = { xlabel = p.name, ylabel = "V", hlines = { p.level }, vlines = { p.low, p.high } }
  if not p.low then chosen.vlines = { p.high } end
  for key, value in pairs(options or {}) do chosen[key] = value end
  return plot(p.values, p.losses, chosen)
end

-- ── bootstrap ──────────────────────────────────────────────────────────────────────────────────────────────

-- Residuals of each output about their mean, as large as the noise: a fit with d estimates makes them
-- smaller by √(1 - d/N) (Efron & Tibshirani, 1993, §9.4).
local function noise_of(r)
  local y, list, N = r.data.y, {}, #r.residuals
  local growth = math.sqrt(N/(N - r.rank))
  for j = 1, y.cols do
    local e, sum = {}, 0
    for i = 1, y.rows do
      if y[i][j] == y[i][j] then
        e[#e + 1] = y[i][j] - r.simulated[i][j]
        sum = sum + e[#e]
      end
    end
    for i = 1, #e do e[i] = (e[i] - sum/#e)*growth end
    list[j] = e
  end
  return list
end

function refits.bootstrap(r, given)
  local options = with_defaults(given, { runs = 200, confidence = 0.95 })
  whole("bootstrap", "runs", options.runs, 10)
  require_noise("bootstrap", r)
  if #r.residuals <= r.rank then fail "bootstrap: there are no more samples than estimates" end
  local noise, y = noise_of(r), r.data.y
  local list, failed, left = fits(r, options.runs, options, function()
    local rows = {}
    for i = 1, y.rows do
      rows[i] = {}
      for j = 1, y.cols do
        local e = noise[j]
        local drawn = e[1 + math.min(#e - 1, math.floor(rand()*#e))]
        rows[i][j] = y[i][j] == y[i][j] and r.simulated[i][j] + drawn or 0/0
      end
    end
    return { y = rows }
  end)
  local std, low, high, thetas, lines = {}, {}, {}, {}, {}
  for k, name in ipairs(r.names) do
    local values, mean = {}, 0
    for i, one in ipairs(list) do
      values[i] = one.theta[k]
      mean = mean + values[i]/#list
    end
    local square = 0
    for _, v in ipairs(values) do square = square + (v - mean)^2 end
    std[k] = math.sqrt(square/(#list - 1))
    local q = quantile(values, { (1 - options.confidence)/2, (1 + options.confidence)/2 })
    low[k], high[k], thetas[k] = q[1], q[2], values
    lines[k] = ("  %s  %.6g ± %.4g (bias %.2g), %g %%: %.6g … %.6g"):format(name, r.theta[k], std[k],
      mean - r.theta[k], 100*options.confidence, q[1], q[2])
  end
  table.insert(lines, 1, ("bootstrap of %d fits%s"):format(#list, lost_text(failed, left)))
  return record("bootstrap_result", { names = r.names, std = std, low = low, high = high, values = thetas,
    failed = failed, text = table.concat(lines, "\n") })
end

-- ── cross-validation ───────────────────────────────────────────────────────────────────────────────────────

function refits.cross_validate(r, given)
  local options = with_defaults(given, { folds = 5 })
  local y = r.data.y
  whole("cross_validate", "folds", options.folds, 2)
  if options.folds > y.rows then
    fail(("cross_validate: folds = %d, but there are %d samples"):format(options.folds, y.rows))
  end
  local function left_out(i, fold) return (i - 1)*options.folds//y.rows + 1 == fold end
  local results, failures, left = parallel_calls(options.folds, function(fold)
    local rows = {}
    for i = 1, y.rows do
      rows[i] = {}
      for j = 1, y.cols do rows[i][j] = left_out(i, fold) and 0/0 or y[i][j] end
    end
    local one, square, count = r:refit{ y = rows }, 0, 0
    for i = 1, y.rows do
      for j = 1, y.cols do
        if left_out(i, fold) and y[i][j] == y[i][j] then
          square, count = square + (y[i][j] - one.simulated[i][j])^2, count + 1
        end
      end
    end
    return { square, count }
  end, { workers = options.workers, title = "folds" })
  if left > 0 then
    fail(("cross_validate: interrupted; %d of %d fits were made"):format(options.folds - left, options.folds))
  end
  if #failures > 0 then
    fail(("cross_validate: the fit without fold %d failed: %s"):format(failures[1].index, failures[1].why))
  end
  local square, count, folds = 0, 0, {}
  for i, one in ipairs(results) do
    square, count = square + one[1], count + one[2]
    folds[i] = math.sqrt(one[1]/one[2])
  end
  local rmse, own = math.sqrt(square/count), math.sqrt(r.loss)
  return record("cross_validation", { rmse = rmse, folds = folds,
    text = ("cross-validation in %d blocks: RMSE %.6g of samples left out, %.6g of samples fitted"):format(
      options.folds, rmse, own) })
end

-- ── several starts ─────────────────────────────────────────────────────────────────────────────────────────

-- The same minimum: what is left of an exact fit is rounding, which tells nothing.
local function alike(a, b)
  for i, value in ipairs(a) do
    if math.abs(value - b[i]) > 1e-5*math.max(math.abs(value), math.abs(b[i])) then return false end
  end
  return true
end

function refits.starts(r, given)
  local options = with_defaults(given, { runs = 20, spread = 1 })
  whole("starts", "runs", options.runs, 1)
  local lower, upper = options.lower or {}, options.upper or {}
  for _, list in ipairs { lower, upper } do
    for parameter in pairs(list) do place_of("starts", r, parameter) end
  end
  local function bound(list, i)
    for parameter, value in pairs(list) do
      if place_of("starts", r, parameter) == i then return value end
    end
  end
  local list, failed, left = fits(r, options.runs, options, function()
    local guess = {}
    for i = 1, #r.names do
      local low, high, best = bound(lower, i), bound(upper, i), r.theta[i]
      if low and high then
        guess[key_of(r, i)] = low + (high - low)*rand()
      else                                             -- the order of magnitude varies, the sign stays
        guess[key_of(r, i)] = best ~= 0 and best*math.exp(options.spread*randn()) or options.spread*randn()
      end
    end
    return { guess = guess }
  end)
  table.sort(list, function(a, b) return a.loss < b.loss or (a.loss == b.loss and a.index < b.index) end)
  local minima = {}
  for _, one in ipairs(list) do
    local last = minima[#minima]
    if last and (one.loss <= last.loss*(1 + 1e-3) or alike(one.theta, last.theta)) then
      last.count = last.count + 1
    else
      minima[#minima + 1] = { loss = one.loss, theta = one.theta, count = 1 }
    end
  end
  local guess = {}
  for i = 1, #r.names do guess[key_of(r, i)] = minima[1].theta[i] end
  local best = minima[1].loss < r.loss*(1 - 1e-9) and r:refit{ guess = guess } or r
  local lines = { ("%d fits from random guesses%s: %s"):format(#list, lost_text(failed, left),
    #minima == 1 and "one minimum" or #minima .. " different minima") }
  for i = 1, math.min(#minima, 5) do
    local parts = {}
    for k, name in ipairs(r.names) do parts[k] = ("%s = %.6g"):format(name, minima[i].theta[k]) end
    lines[#lines + 1] = ("  V = %.6g, %d times: %s"):format(minima[i].loss, minima[i].count,
      table.concat(parts, ", "))
  end
  if best ~= r then lines[#lines + 1] = ("  better than the fit so far, V = %.6g"):format(r.loss) end
  return record("starts_result", { best = best, minima = minima, failed = failed,
    text = table.concat(lines, "\n") })
end

return refits
