-- Graphs of functions: plot(sin(x), { -3, 3 }), plot({ f, g }, { 0, 10 }).

local M = {}

local function is_function(value)
  local kind = object_type(value) or type(value)
  return kind == "function" or kind == "fn" or kind == "expr" and #symbols(value) > 0
end

local function is_range(value)
  return type(value) == "table" and #value == 2 and tonumber(value[1]) and tonumber(value[2])
end

-- Is that a call for graphs? A list of functions or one of them, then { from, to }.
function M.asked(first, range)
  if not is_range(range) then return false end
  if type(first) == "table" and object_type(first) == nil then first = first[1] end
  return is_function(first)
end

-- f as a function of one number, the name of its argument and its label.
local function readable(by, f)
  if object_type(f) ~= "expr" then return f end
  local unknown = symbols(f)
  if #unknown ~= 1 then
    fail(("%s: the graph of %s over { from, to } needs one symbol, but it has %d; put values in by subs(e, { %s "
      .. "= 2 })"):format(by, tostring(f), #unknown, tostring(unknown[2])))
  end
  local compiled = fn({ unknown[1] }, f)
  local function value(x)
    local good, y = pcall(compiled, x)
    if good then return y end
    if type(y) ~= "string" then error(y, 0) end  -- an interrupt
    return 0/0                                   -- 1/x at 0
  end
  return value, unknown[1], f
end

local pieces, deepest = 160, 8

-- Numbers of f between a and b until neighbours lie on a line to 1/1000 of the height; `breaks` where a jump
-- or a gap remains. Values that are no number are nan.
local function sampled(f, a, b)
  local function value(x)
    local y = f(x)
    if object_type(y) == "expr" then y = evaluate(y) end
    return type(y) == "number" and y or 0/0
  end
  local x, y, finite = {}, {}, {}
  for k = 0, pieces do
    x[k] = a + (b - a)*k/pieces
    y[k] = value(x[k])
    if y[k] - y[k] == 0 then finite[#finite + 1] = y[k] end
  end
  table.sort(finite)
  local function share(p) return finite[1 + math.floor(p*(#finite - 1) + 0.5)] or 0 end
  local height = share(0.95) - share(0.05)
  local px, py, breaks = { x[0] }, { y[0] }, {}
  local function add(x1, y1, x2, y2, depth)
    local xm = (x1 + x2)/2
    local ym = value(xm)
    local nowhere = y1 ~= y1 and ym ~= ym and y2 ~= y2
    local smooth = nowhere or math.abs(ym - (y1 + y2)/2) <= 1e-3*height
    if depth > 0 and not smooth and xm ~= x1 and xm ~= x2 then
      add(x1, y1, xm, ym, depth - 1)
      return add(xm, ym, x2, y2, depth - 1)
    end
    -- A jump is in one half of the interval, a steep part in both; nan is a gap by itself.
    local change = math.abs(y2 - y1)
    local one_half = math.max(math.abs(ym - y1), math.abs(y2 - ym)) > 0.9*change
    if not smooth and change > height/5 and one_half then breaks[#breaks + 1] = #px + 1 end
    px[#px + 1], py[#py + 1] = x2, y2
  end
  for k = 1, pieces do add(x[k - 1], y[k - 1], x[k], y[k], deepest) end
  return px, py, breaks, { share(0.05), share(0.95), finite[1] or 0, finite[#finite] or 0 }
end

-- What the frame shows of curves with poles: five times the height of nine tenths of the values.
local function limits(spread)
  local low, high, least, largest = math.huge, -math.huge, math.huge, -math.huge
  for _, s in ipairs(spread) do
    low, high = math.min(low, s[1]), math.max(high, s[2])
    least, largest = math.min(least, s[3]), math.max(largest, s[4])
  end
  local margin = 2*(high - low)
  if least >= low - margin and largest <= high + margin then return nil end
  return { math.max(least, low - margin), math.min(largest, high + margin) }
end

-- The series, the label of the x axis, the limits of y if there are poles.
function M.series(by, first, range)
  local a, b = tonumber(range[1]), tonumber(range[2])
  if not (a < b) then fail(("%s: the range { %s, %s } is empty"):format(by, range[1], range[2])) end
  local list = (type(first) == "table" and object_type(first) == nil) and first or { first }
  local series, spread, symbol = {}, {}, nil
  for _, each in ipairs(list) do
    if not is_function(each) then
      fail(("%s: %s is no function and no expression with a symbol"):format(by, tostring(each)))
    end
    local f, own, label = readable(by, each)
    symbol = symbol or own
    local x, y, breaks, s = sampled(f, a, b)
    spread[#spread + 1] = s
    series[#series + 1] = { x = x, y = y, breaks = breaks, count = 1, style = "line", labels = { label } }
  end
  return series, symbol, limits(spread)
end

return M
