-- histogram: how often values fall into intervals.

local arguments, curves, options = plotting.arguments, plotting.series, plotting.options

local own = options.joined(options.flat, {
  option("bins", "integer or list", "how many intervals, or their ends; else by Freedman and Diaconis"),
  option("density", "boolean", "areas add up to 1, to compare with a probability density", "false") })

local function numbers(by, values)
  local kind = object_type(values)
  if type(values) ~= "table" and kind ~= "matrix" then
    fail(by .. ": expected a list or a column of numbers")
  end
  local list = {}
  for i = 1, kind and values.rows*values.cols or #values do
    local value = tonumber(values[i])
    if value and value == value and math.abs(value) < math.huge then list[#list + 1] = value end
  end
  if #list == 0 then fail(by .. ": there is no finite number among the values") end
  table.sort(list)
  return list
end

-- Width 2 IQR n^(-1/3) (Freedman and Diaconis, Z. Wahrscheinlichkeitstheorie 57, 1981), 1 to 200 intervals.
local function edges_of(by, sorted, bins)
  local low, high, n = sorted[1], sorted[#sorted], #sorted
  if type(bins) == "table" then
    for k = 2, #bins do
      if bins[k] <= bins[k - 1] then fail(by .. ": the ends of the bins must increase") end
    end
    if #bins < 2 then fail(by .. ": bins needs two ends at least") end
    return bins
  end
  if low == high then low, high = low - 0.5, high + 0.5 end
  if not bins then
    local spread = sorted[math.ceil(0.75*n)] - sorted[math.ceil(0.25*n)]
    bins = spread > 0 and math.ceil((high - low)/(2*spread*n^(-1/3))) or 10
    bins = math.max(1, math.min(200, bins))
  end
  if math.type(bins) ~= "integer" or bins < 1 then
    fail(by .. ": bins must be a whole number, or a list of ends")
  end
  local edges = {}
  for k = 0, bins do edges[k + 1] = low + (high - low)*k/bins end
  return edges
end

local function counts_of(sorted, edges)
  local counts, k, last = {}, 1, #edges - 1
  for i = 1, last do counts[i] = 0 end
  for _, value in ipairs(sorted) do
    while k < last and value >= edges[k + 1] do k = k + 1 end
    if value >= edges[1] and value <= edges[#edges] then counts[k] = counts[k] + 1 end
  end
  return counts
end

doc { name = "histogram", module = "plot", sig = "histogram(values [, options]) -> figure",
  text = "How many values fall into each of several intervals; with density = true the areas of the bars add "
    .. "up to 1.",
  example = "histogram({1, 2, 2, 3, 3, 3}, { bins = 3 })", gives = "figure: 1 series, 12 points",
  options = own,
  function(values, given)
    local chosen = check_options("histogram", given, own)
    local sorted = numbers("histogram", values)
    local edges = edges_of("histogram", sorted, chosen.bins)
    local counts = counts_of(sorted, edges)
    local x, y = {}, {}
    for k, count in ipairs(counts) do
      local width = edges[k + 1] - edges[k]
      local height = chosen.density and count/(#sorted*width) or count
      -- A bar: up, across and down; the thin gap tells neighbours apart.
      local gap = 0.02*width
      for _, point in ipairs { { edges[k] + gap, 0 }, { edges[k] + gap, height },
        { edges[k + 1] - gap, height },
        { edges[k + 1] - gap, 0 } } do
        x[#x + 1], y[#y + 1] = point[1], point[2]
      end
    end
    local series = { { x = x, y = y, style = "fill", count = 1 } }
    arguments.spread_labels("histogram", series, chosen)
    chosen.style = nil
    curves.set_looks("histogram", series, chosen)
    local description = curves.copy_options({ by = "histogram", series = series,
      ylabel = chosen.density and "density" or "count" }, chosen)
    description.bins, description.density = nil, nil
    return figure(description)
  end }
