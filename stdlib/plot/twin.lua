-- A second y axis: its curves are scaled to the left one, and its numbers stand on the right.

local function range_of(series)
  local low, high = math.huge, -math.huge
  for _, each in ipairs(series) do
    local y = each.y
    local n = type(y) == "table" and #y or y.rows * y.cols
    for i = 1, n do
      local value = y[i]
      if value == value and math.abs(value) < math.huge then
        low, high = math.min(low, value), math.max(high, value)
      end
    end
  end
  if low > high then return 0, 1 end
  if low == high then return low - 1, high + 1 end
  local margin = 0.04*(high - low)
  return low - margin, high + margin
end

local function limits(by, name, given, series)
  if given == nil then return range_of(series) end
  local low, high = given[1], given[2]
  if not low or not high or low >= high then fail(("%s: %s must be { low, high }"):format(by, name)) end
  return low, high
end

-- Scales the curves numbered in options.right; changes series and description.
return function(by, series, options, description)
  local on_right = {}
  for _, number in ipairs(type(options.right) == "table" and options.right or { options.right }) do
    if not series[number] then
      fail(("%s: option 'right' has the curve %s of %d curves"):format(by, tostring(number), #series))
    end
    on_right[number] = true
  end
  if options.ylog then fail(by .. ": a second y axis needs linear axes") end
  local left, right = {}, {}
  for i, each in ipairs(series) do table.insert(on_right[i] and right or left, each) end
  if #left == 0 then fail(by .. ": one curve at least belongs to the left axis") end
  local low, high = limits(by, "ylim", options.ylim, left)
  local low2, high2 = limits(by, "y2lim", options.y2lim, right)
  local scale = (high - low)/(high2 - low2)
  for _, each in ipairs(right) do
    local y = each.y
    local scaled = {}
    for i = 1, type(y) == "table" and #y or y.rows * y.cols do scaled[i] = low + (y[i] - low2)*scale end
    each.y = scaled
  end
  description.ylim, description.right = { low, high }, { low2, high2 }
  local only_left, only_right = left[1].labels, right[1].labels
  if description.ylabel == nil and #left == 1 and only_left then description.ylabel = only_left[1] end
  if description.y2label == nil and #right == 1 and only_right then description.y2label = only_right[1] end
end
