-- Lookup tables: functions through measured points, as expressions with one border per point.

--- A copy of a list, or of a column or row.
local function list_of(list)
  local columns = object_type(list) == "matrix"
  local copy = {}
  for k = 1, columns and list.rows*list.cols or #list do copy[k] = list[k] end
  return copy
end

local function is_given(list) return type(list) == "table" or object_type(list) == "matrix" end

local function is_finite(value) return value == value and math.abs(value) ~= math.huge end

--- The places of the points: growing numbers, two or more.
local function places(what, list)
  local result = is_given(list) and list_of(list) or {}
  if #result < 2 then fail("lookup: " .. what .. " must be a list of two numbers or more") end
  for k, value in ipairs(result) do
    if not (math.type(value) and is_finite(value)) then
      fail(("lookup: %s[%d] = %s is not a number"):format(what, k, tostring(value)))
    end
    if k > 1 and not (value > result[k - 1]) then
      fail(("lookup: %s must grow, but %s[%d] = %s follows %s; sort the points and merge equal ones"):format(what,
        what, k, tostring(value), tostring(result[k - 1])))
    end
  end
  return result
end

local function values(what, list, n)
  local result = is_given(list) and list_of(list)
  if not result or #result ~= n then
    fail(("lookup: %s must be a list of %d values, one for each x; it has %s"):format(what, n,
      result and #result or "none"))
  end
  for k, value in ipairs(result) do
    if math.type(value) and not is_finite(value) then
      fail(("lookup: %s[%d] = %s is not a number"):format(what, k, tostring(value)))
    end
  end
  return result
end

local function numbers(kind, list)
  local result = {}
  for k = 1, #list do
    result[k] = math.type(list[k]) and list[k]
      or fail(("lookup: kind %s needs numbers, but y[%d] = %s is none; "
        .. "linear and previous take expressions"):format(kind, k, tostring(list[k])))
  end
  return result
end

local function widths(x, y)
  local h, slope = {}, {}
  for k = 1, #x - 1 do
    h[k] = x[k + 1] - x[k]
    slope[k] = (y[k + 1] - y[k])/h[k]
  end
  return h, slope
end

--- Slopes of a cubic that keeps the shape of the points: weighted harmonic means of the chords beside a
--- point, 0 at extrema (Fritsch & Butland, SIAM J. Sci. Stat. Comput. 5, 1984; Moler, Numerical Computing
--- with MATLAB, 2004, §3.4, also for the ends).
local function pchip_slopes(x, y)
  local h, chord = widths(x, y)
  local n = #x
  if n == 2 then return { chord[1], chord[1] } end
  local function at_end(h1, h2, c1, c2)
    local d = ((2*h1 + h2)*c1 - h1*c2)/(h1 + h2)
    if d*c1 <= 0 then return 0 end
    if c1*c2 <= 0 and math.abs(d) > 3*math.abs(c1) then return 3*c1 end
    return d
  end
  local d = { at_end(h[1], h[2], chord[1], chord[2]) }
  for k = 2, n - 1 do
    local a, b = chord[k - 1], chord[k]
    local w1, w2 = 2*h[k] + h[k - 1], h[k] + 2*h[k - 1]
    d[k] = a*b <= 0 and 0 or (w1 + w2)/(w1/a + w2/b)
  end
  d[n] = at_end(h[n - 1], h[n - 2], chord[n - 1], chord[n - 2])
  return d
end

--- Slopes of the cubic spline whose third derivative does not jump at the second point and the last but one
--- (de Boor, A Practical Guide to Splines, rev. ed. 2001, §IV, "not-a-knot").
local function spline_slopes(x, y)
  local h, chord = widths(x, y)
  local n = #x
  if n == 2 then return { chord[1], chord[1] } end
  if n == 3 then                                             -- the parabola
    local bend = (chord[2] - chord[1])/(h[1] + h[2])
    return { chord[1] - bend*h[1], chord[1] + bend*h[1], chord[2] + bend*h[2] }
  end
  local low, middle, high, right = {}, {}, {}, {}
  local function first(h1, h2, c1, c2) return ((h1 + 2*(h1 + h2))*h2*c1 + h1^2*c2)/(h1 + h2) end
  middle[1], high[1], right[1] = h[2], h[1] + h[2], first(h[1], h[2], chord[1], chord[2])
  for k = 2, n - 1 do
    low[k], middle[k], high[k] = h[k], 2*(h[k - 1] + h[k]), h[k - 1]
    right[k] = 3*(h[k]*chord[k - 1] + h[k - 1]*chord[k])
  end
  low[n], middle[n] = h[n - 1] + h[n - 2], h[n - 2]
  right[n] = first(h[n - 1], h[n - 2], chord[n - 1], chord[n - 2])
  for k = 2, n do
    local factor = low[k]/middle[k - 1]
    middle[k] = middle[k] - factor*high[k - 1]
    right[k] = right[k] - factor*right[k - 1]
  end
  local d = { [n] = right[n]/middle[n] }
  for k = n - 1, 1, -1 do d[k] = (right[k] - high[k]*d[k + 1])/middle[k] end
  return d
end

--- The pieces: piece[k](u) between x[k] and x[k + 1], piece[0] below, piece[n] above.
local function pieces_of(kind, outside, x, y)
  local n, piece, d = #x, {}, nil
  if kind == "previous" then
    for k = 1, n do piece[k] = function() return y[k] end end
    piece[0] = piece[1]
    return piece
  elseif kind == "linear" then
    for k = 1, n - 1 do
      local slope = (y[k + 1] - y[k])/(x[k + 1] - x[k])
      piece[k] = function(u) return y[k] + slope*(u - x[k]) end
    end
  else
    y = numbers(kind, y)
    d = (kind == "pchip" and pchip_slopes or spline_slopes)(x, y)
    for k = 1, n - 1 do
      local h = x[k + 1] - x[k]
      local chord = (y[k + 1] - y[k])/h
      local c2, c3 = (3*chord - 2*d[k] - d[k + 1])/h, (d[k] + d[k + 1] - 2*chord)/h^2
      piece[k] = function(u)
        local s = u - x[k]
        return y[k] + s*(d[k] + s*(c2 + s*c3))
      end
    end
  end
  local function line(k, slope) return function(u) return y[k] + slope*(u - x[k]) end end
  if outside == "hold" then
    piece[0], piece[n] = line(1, 0), line(n, 0)
  elseif d then
    piece[0], piece[n] = line(1, d[1]), line(n, d[n])
  else
    piece[0], piece[n] = piece[1], piece[n - 1]
  end
  return piece
end

--- The piece in which u lies, by halving.
local function chosen(x, piece, u)
  local is_number = math.type(u)
  local function among(from, to)                              -- pieces from … to
    if from == to then return piece[from](u) end
    local middle = (from + to + 1)//2
    if piece[from] == piece[to] and to - from == 1 then return piece[from](u) end
    if is_number then
      if u < x[middle] then return among(from, middle - 1) end
      return among(middle, to)
    end
    return ifelse(lt(u, x[middle]), among(from, middle - 1), among(middle, to))
  end
  return among(0, #x)
end

--- Rows of z as functions of the second argument, interpolated linearly in the first.
local function plane(x, y, z, outside)
  local rows = {}
  for i = 1, #x do rows[i] = pieces_of("linear", outside, y, values(("z[%d]"):format(i), z[i], #y)) end
  return function(u, v)
    local heights = {}
    for i = 1, #x do heights[i] = chosen(y, rows[i], v) end
    return chosen(x, pieces_of("linear", outside, x, heights), u)
  end
end

--- The curve with its points, a little beyond both ends; a table of two variables as a surface.
local function picture(self, options)
  local x, xs, ys = self.x, {}, {}
  if self.z then
    local all = { surfaces = { surface(self.value, { x[1], x[#x] }, { self.y[1], self.y[#self.y] }) } }
    for key, value in pairs(options or {}) do all[key] = value end
    return plot3(all)
  end
  for k, value in ipairs(self.y) do
    if not math.type(value) then
      fail(("lookup: y[%d] = %s has no value: a picture needs numbers"):format(k, tostring(value)))
    end
  end
  local count, beyond = 400, (x[#x] - x[1])/20
  for k = 0, count do
    xs[k + 1] = x[1] - beyond + k*(x[#x] - x[1] + 2*beyond)/count
    ys[k + 1] = self.value(xs[k + 1])
  end
  local base = { style = { "line", "points" }, labels = { self.kind, "points" } }
  for key, value in pairs(options or {}) do base[key] = value end
  return plot(xs, ys, x, self.y, base)
end

local function argument(u)
  if math.type(u) or object_type(u) == "expr" then return end
  local kind = object_type(u) or type(u)
  fail("lookup: the argument must be a number or an expression, not a " .. kind
    .. (kind == "matrix" and "; call it for each entry" or ""))
end

local methods = { plot = picture,
  latex = function() fail "lookup: a table has no LaTeX text; take the expression, f(x), and its latex()" end }
local about = { __index = methods, __name = "lookup",
  __call = function(self, u, v)
    if u == nil then fail "lookup: a table is called with its argument, f(x) or f(2.5)" end
    if self.z and v == nil then fail "lookup: a table of two variables is called with both, f(x, y)" end
    if not self.z and v ~= nil then fail "lookup: a table of one variable is called with one argument" end
    argument(u)
    if v ~= nil then argument(v) end
    return self.value(u, v)
  end,
  __tostring = function(self)
    local size = self.z and ("%d × %d"):format(#self.x, #self.y) or tostring(#self.x)
    return ("lookup table: %s points, %s, %s outside"):format(size, self.kind,
      self.outside == "hold" and "constant" or "extended")
  end }

doc { name = "lookup", sig = "lookup{ x =, y =, kind =, outside = } -> function",
  text = [[A function through points (x[k], y[k]): f(e) is an expression, f(2.5) a number. "linear";
    "pchip", cubics that keep the shape of the points: no extrema but theirs, continuous slope; "spline",
    the cubic spline with continuous curvature (not-a-knot); "previous", the value of the last point passed,
    which jumps. Outside of the points the first and last value hold, or the end is extended in a straight
    line. Runs locate the borders: stats().borders. y may be expressions (parameters to be fitted) where kind
    is linear or previous. With z a table of two variables, f(u, v), z[i][j] at x[i], y[j], bilinear.
    f:plot() draws a table.]],
  example = [[
    x = var "x"
    pump = lookup{ x = { 0, 1, 2 }, y = { 10, 9, 5 }, kind = "pchip" }
    head = dae{ der(x) ~ pump(x) - 5 }:integrate{ start = { x = 0 }, to = 20 }:final(x)
    return pump(0.5), ("%.4f"):format(head)
  ]],
  gives = "9.7 2.0000",
  options = { option("x", "list of numbers", "where the points are, growing"),
    option("y", "list", "values there; with z the places of the second variable"),
    option("z", "list of lists", "values of a table of two variables", ""),
    option("kind", "string", "interpolation between points", '"linear"', "linear|pchip|spline|previous"),
    option("outside", "string", "before the first and after the last point", '"hold"', "hold|extend") },
  options_at = 1,
  function(o)
    local kind, outside = o.kind or "linear", o.outside or "hold"
    local x, y = places("x", o.x), nil
    local self = setmetatable({ x = list_of(x), z = o.z, kind = kind, outside = outside }, about)
    if o.z then
      if kind ~= "linear" then fail "lookup: a table of two variables is linear" end
      y = places("y", o.y)
      self.value = plane(x, y, values("z", o.z, #x), outside)
    else
      y = values("y", o.y, #x)
      local piece = pieces_of(kind, outside, x, y)
      self.value = function(u) return chosen(x, piece, u) end
    end
    self.y = list_of(y)                              -- changes of these lists change nothing
    return self
  end }
