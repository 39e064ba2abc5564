-- Pictures of a sweep.
local answers = include "many/answers"
local pictures = {}

local function title(e) return tostring(e) end

-- Options of a figure that a picture was given, before what it says by itself.
local function framed(given, own)
  for _, row in ipairs(plotting.options.frame) do
    if given[row.name] ~= nil then own[row.name] = given[row.name] end
  end
  return own
end

function pictures.histogram(s, e, options)
  local chosen = framed(options, { xlabel = title(e), ylabel = "runs" })
  chosen.bins = options.bins or #bin(answers.values(s, e, options.t)).counts
  return histogram(answers.values(s, e, options.t), chosen)
end

function pictures.density(s, e, options)
  local sample = answers.values(s, e, options.t)
  local curve = smooth_density(sample, nil, options.bandwidth)
  return plot(curve.x, curve.f, framed(options, { xlabel = title(e), ylabel = "density" }))
end

-- The list and the options of { 0.05, 0.25, title = "…" }.
local function levels_of(given)
  local levels, options = {}, {}
  for key, value in pairs(type(given) == "table" and given or { given }) do
    (math.type(key) == "integer" and levels or options)[key] = value
  end
  return #levels > 0 and levels or { 0.05, 0.25 }, check_options("fan", options, plotting.options.frame)
end

function pictures.fan(s, e, given)
  local levels, options = levels_of(given)
  local times, rows = s.t, s(e)
  local figures, median = {}, {}
  for _, p in ipairs(levels) do
    if type(p) ~= "number" or not (p > 0 and p < 0.5) then
      fail(("fan: %s is not a share between 0 and 0.5"):format(tostring(p)))
    end
    local low, high = {}, {}
    for i = 1, #times do
      local q = quantile(rows[i], { p, 1 - p })
      low[i], high[i] = q[1], q[2]
    end
    figures[#figures + 1] = band(times, low, high, framed(options, { xlabel = "t", ylabel = title(e) }))
  end
  for i = 1, #times do median[i] = quantile(rows[i], 0.5) end
  figures[#figures + 1] = plot(times, median)
  return overlay(table.unpack(figures))
end

function pictures.scatter(s, list)
  if object_type(list) or type(list) ~= "table" then list = { list } end
  local panels = {}
  for _, e in ipairs(list) do
    local values = answers.values(s, e)
    for _, name in ipairs(s.names) do
      panels[#panels + 1] = plot(s.params[name], values, { style = "dots", xlabel = name, ylabel = title(e) })
    end
  end
  if #panels == 1 then return panels[1] end
  return layout({ #list, #s.names }, table.unpack(panels))
end

function pictures.convergence(s, e, t)
  local values = answers.values(s, e, t)
  local n, mean, square = 0, 0, 0
  local x, y, low, high = {}, {}, {}, {}
  for i = 1, #values do
    local v = values[i]
    if v == v then
      n = n + 1
      local d = v - mean
      mean = mean + d/n
      square = square + d*(v - mean)
      local error = n > 1 and 1.959963984540054*math.sqrt(square/(n - 1)/n) or 0
      if n > 9 and (n % math.max(1, #values // 400) == 0 or i == #values) then
        x[#x + 1], y[#y + 1], low[#low + 1], high[#high + 1] = n, mean, mean - error, mean + error
      end
    end
  end
  if #x < 2 then fail "convergence: fewer than twelve runs have a value; make more" end
  return overlay(band(x, low, high, { xlabel = "runs", ylabel = "mean of " .. title(e) }), plot(x, y))
end

return pictures
