-- The figures of stability regions in the complex plane: of one-step methods, |R(z)| = 1 (Hairer & Wanner,
-- Solving Ordinary Differential Equations II, §IV.3), and of multistep methods, the root locus curve (§V.1).

-- Closed curves as x, y lists, cut at NaN and where they leave the frame.
local function curves(rows, reach)
  local list, xs, ys = {}, {}, {}
  local function finish()
    if #xs > 1 then
      list[#list + 1] = xs
      list[#list + 1] = ys
    end
    xs, ys = {}, {}
  end
  for i = 1, rows.rows do
    local x, y = rows(i, 1), rows(i, 2)
    if x ~= x or x * x + y * y > reach * reach then
      finish()
    else
      xs[#xs + 1], ys[#ys + 1] = x, y
    end
  end
  finish()
  return list
end

local function extents(list)
  local box = { math.huge, -math.huge, 0 }  -- left, right, height above the real axis
  for i = 1, #list, 2 do
    for k = 1, #list[i] do
      box[1], box[2] = math.min(box[1], list[i][k]), math.max(box[2], list[i][k])
      box[3] = math.max(box[3], math.abs(list[i + 1][k]))
    end
  end
  return box
end

-- Between two ordinates over the same abscissas.
local function area(x, y, lower)
  return { x = x, y = y, lower = lower, style = "fill", colour = "#0072B2" }
end

-- What lies outside of a curve, above (side = 1) or below the real axis, within a frame around it.
local function outside(xs, ys, box, side)
  local room = 0.3*math.max(box[2] - box[1], box[3])
  local points = { { box[1] - room, 0 }, { box[1], 0 }, { box[2], 0 }, { box[2] + room, 0 } }
  for k = 1, #xs do
    if side*ys[k] >= 0 then points[#points + 1] = { xs[k], ys[k] } end
  end
  table.sort(points, function(a, b)
    return a[1] < b[1] or a[1] == b[1] and math.abs(a[2]) < math.abs(b[2])
  end)
  local x, y, edge = {}, {}, {}
  for i, point in ipairs(points) do x[i], y[i], edge[i] = point[1], point[2], side*(box[3] + room) end
  return area(x, edge, y)
end

-- The imaginary axis and the half-plane on its left.
local function half_plane(title, size)
  return { { x = { 0, 0 }, y = { -size, size }, style = "line", colour = "#0072B2",
    labels = { "|R(z)| = 1" } },
    area({ -size, 0 }, { size, size }, { -size, -size }) },
    { title = title, xlabel = "Re z", ylabel = "Im z", equal = true, legend = false, xlim = { -size, size },
      ylim = { -size, size } }
end

-- where: the side of the curve on which methods are stable: "inside", "outside", or neither.
local function picture(rows, reach, title, where)
  local list, series = curves(rows, reach), {}
  local sheet = { title = title, xlabel = "Re z", ylabel = "Im z", equal = true, legend = false }
  if where == "left" then series, sheet = half_plane(title, 8)
  elseif #list == 0 then fail((title .. ": no boundary within |z| ≤ %g"):format(reach)) end
  for i = 1, where == "left" and 0 or #list, 2 do
    series[#series + 1] = { x = list[i], y = list[i + 1], style = "line", colour = "#0072B2",
      labels = { i == 1 and "|R(z)| = 1" or "" } }
  end
  for i = 1, where == "inside" and #list or 0, 2 do
    series[#series + 1] = { x = list[i], y = list[i + 1], style = "fill", colour = "#0072B2" }
  end
  for _, side in ipairs(where == "outside" and #list == 2 and { 1, -1 } or {}) do
    series[#series + 1] = outside(list[1], list[2], extents(list), side)
  end
  sheet.series, sheet.by = series, "plot"
  return figure(sheet)
end

-- |R(z)| = 1 and the side of it on which the method is stable.
local function one_step(stability, name)
  local where = stability.A_stable and "outside" or "inside"
  local words = "stable " .. where
  if stability.imaginary == math.huge and stability.real == -math.huge
    and math.abs(stability.infinity) == 1 then
    where, words = "left", "stable in the left half-plane"
  end
  return picture(stability:boundary(720), 60, ("%s: |R(z)| = 1, %s"):format(name, words), where)
end

local function multistep(method)
  return picture(method:boundary(1441), 60, method.name .. ": root locus, stable outside", "locus")
end

return { one_step = one_step, multistep = multistep }
