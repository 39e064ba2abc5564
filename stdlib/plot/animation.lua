-- animate: a mechanism that moves, from points along a solution: in the terminal, as SVG, HTML or GIF.

local arguments, options = plotting.arguments, plotting.options

local animation_options = options.joined(options.named { "title", "size", "xlim", "ylim", "theme" }, {
  option("seconds", "number", "duration; without it that of the run, between 2 and 20 s"),
  option("fps", "integer", "pictures per second", "25"),
  option("base", "list or boolean", "where the first bar begins, or false: no bar from there", "{0, 0}"),
  option("bars", "boolean", "lines from point to point", "true"),
  option("trail", "boolean", "the path of the last point", "true"),
  option("view", "list", "{ tilt, turn } in degrees, for points in space", "{60, 30}") })

-- ── what is seen ───────────────────────────────────────────────────────────────────────────────────────────

local function points_in(what)
  if object_type(what) == "matrix" then return { what } end
  if type(what) ~= "table" or #what == 0 then
    fail "animate: expected points: animate(sol, { p1, p2 }) with p1 = vec(x, y)"
  end
  local points = {}
  for i, point in ipairs(what) do
    if type(point) == "table" then point = vec(point) end
    points[i] = point
    if object_type(point) ~= "matrix" or not (point.rows*point.cols == 2 or point.rows*point.cols == 3) then
      fail(("animate: entry %d of the list must be a point vec(x, y) or vec(x, y, z)"):format(i))
    end
  end
  return points
end

-- Right and up on the sheet, as plot3 sees it: turned about the z axis, then tilted.
local function projection(view)
  local tilt, turn = math.rad(view[1]), math.rad(view[2])
  local ct, st, cu, su = math.cos(tilt), math.sin(tilt), math.cos(turn), math.sin(turn)
  return function(x, y, z)
    return cu*x + su*y, (-su*x + cu*y)*ct + z*st
  end
end

-- frames[k][i] = { x, y } of point i at the time of frame k.
local function frames_of(sol, points, times, view)
  local frames, project = {}, projection(view)
  for k = 1, #times do frames[k] = {} end
  for i, point in ipairs(points) do
    local values = sol(point, times)
    for k = 1, #times do
      if point.rows*point.cols == 3 then
        frames[k][i] = { project(values(k, 1), values(k, 2), values(k, 3)) }
      else
        frames[k][i] = { values(k, 1), values(k, 2) }
      end
    end
  end
  return frames
end

local function window(film, chosen)
  local low, high = { math.huge, math.huge }, { -math.huge, -math.huge }
  local function take(point)
    for a = 1, 2 do low[a], high[a] = math.min(low[a], point[a]), math.max(high[a], point[a]) end
  end
  for _, frame in ipairs(film.frames) do
    for _, point in ipairs(frame) do take(point) end
  end
  if film.base then take(film.base) end
  local span = math.max(high[1] - low[1], high[2] - low[2], 1e-12)
  local function limits(given, a)
    if given then return { tonumber(given[1]), tonumber(given[2]) } end
    local room = 0.08*span
    return { low[a] - room, high[a] + room }
  end
  return limits(chosen.xlim, 1), limits(chosen.ylim, 2)
end

local film_type = { __name = "animation" }
film_type.__index = film_type
function film_type.latex()
  fail 'latex: an animation has no LaTeX text; film:save "x.html" shows it'
end
film_type.__tostring = function(film)
  local points = #film.frames[1]
  return ('animation: %d point%s, %d pictures, %.3g s; :show(), :save "file.svg" (.svg, .html, .gif)')
    :format(points, points == 1 and "" or "s", #film.frames, film.seconds)
end

-- The points of the bars at frame k: the base, then every point.
local function bar_points(film, k)
  local list = {}
  if film.base then list[1] = film.base end
  for _, point in ipairs(film.frames[k]) do list[#list + 1] = point end
  return list
end

-- ── figures, for the terminal and GIF ──────────────────────────────────────────────────────────────────────

local function columns_of(points)
  local x, y = {}, {}
  for i, point in ipairs(points) do x[i], y[i] = point[1], point[2] end
  return x, y
end

local function picture(film, k)
  local series = {}
  if film.trail then
    local last, path = #film.frames[1], {}
    for j = math.max(1, k - 60), k do path[#path + 1] = film.frames[j][last] end
    local x, y = columns_of(path)
    series[#series + 1] = { x = x, y = y, style = "line", colour = "#D55E00", width = 1 }
  end
  local x, y = columns_of(bar_points(film, k))
  if film.bars then series[#series + 1] = { x = x, y = y, style = "line", colour = "#0072B2", width = 3 } end
  x, y = columns_of(film.frames[k])
  series[#series + 1] = { x = x, y = y, style = "points", colour = "#0072B2", marker = "circle" }
  return figure { by = "animate", series = series, equal = true, xlim = film.xlim, ylim = film.ylim,
    title = ("%st = %.2f"):format(film.title and film.title .. "   " or "", film.times[k]), size = film.size,
    theme = film.theme }
end

local function pictures(film, every)
  local first, others = nil, {}
  for k = 1, #film.frames, every or 1 do
    local each = picture(film, k)
    if first then others[#others + 1] = each else first = each end
  end
  return first, others
end

-- ── SVG that moves by itself ───────────────────────────────────────────────────────────────────────────────

local colours = {
  light = { page = "#FFFFFF", line = "#0072B2", trail = "#D55E00", text = "#333333", ground = "#DDDDDD" },
  dark = { page = "#14171A", line = "#56B4E9", trail = "#E69F00", text = "#E6E6E6", ground = "#33383D" },
}

local function escaped(text) return (text:gsub("[&<>\"]", { ["&"] = "&amp;", ["<"] = "&lt;", [">"] = "&gt;",
  ['"'] = "&quot;" })) end

-- From data to pixels, y upwards, one unit equally long on both axes.
local function scale_of(film)
  local width, height = table.unpack(film.size or { 640, 480 })
  local spans = { film.xlim[2] - film.xlim[1], film.ylim[2] - film.ylim[1] }
  local head = film.title and 40 or 16
  local unit = math.min((width - 32)/spans[1], (height - head - 40)/spans[2])
  local left = (width - unit*spans[1])/2
  local top = head + (height - head - 40 - unit*spans[2])/2
  return width, height, function(point)
    return left + unit*(point[1] - film.xlim[1]), top + unit*(film.ylim[2] - point[2])
  end
end

local function path_text(points, place)
  local list = {}
  for i, point in ipairs(points) do list[i] = ("%.2f,%.2f"):format(place(point)) end
  return table.concat(list, " ")
end

local function animated(attribute, values, seconds)
  return ('<animate attributeName="%s" dur="%.6gs" repeatCount="indefinite" values="%s"/>'):format(attribute,
    seconds,
    table.concat(values, ";"))
end

local function svg_text(film)
  local look = colours[film.theme or "light"] or colours.light
  local width, height, place = scale_of(film)
  local out = { ('<svg xmlns="http://www.w3.org/2000/svg" width="%d" height="%d" viewBox="0 0 %d %d" '
    .. 'role="img" aria-label="%s">'):format(width, height, width, height,
      escaped(film.title or "animation")),
    ('<rect width="100%%" height="100%%" fill="%s"/>'):format(look.page) }
  local function add(...) out[#out + 1] = (...):format(select(2, ...)) end
  if film.title then
    add('<text x="%d" y="26" text-anchor="middle" font-family="DejaVu Sans,Arial,sans-serif" font-size="16" '
      .. 'fill="%s">%s</text>', width//2, look.text, escaped(film.title))
  end
  local last = #film.frames[1]
  if film.trail then
    local path = {}
    for k, frame in ipairs(film.path) do path[k] = frame[1] end
    add('<polyline points="%s" fill="none" stroke="%s" stroke-width="1" opacity="0.35"/>',
      path_text(path, place),
      look.trail)
  end
  if film.bars and #bar_points(film, 1) > 1 then
    local values = {}
    for k = 1, #film.frames do values[k] = path_text(bar_points(film, k), place) end
    add('<polyline fill="none" stroke="%s" stroke-width="3" stroke-linecap="round" points="%s">%s</polyline>',
      look.line, values[1], animated("points", values, film.seconds))
  end
  if film.base then
    local x, y = place(film.base)
    add('<circle cx="%.2f" cy="%.2f" r="3" fill="%s"/>', x, y, look.text)
  end
  for i = 1, last do
    local xs, ys = {}, {}
    for k, frame in ipairs(film.frames) do
      local x, y = place(frame[i])
      xs[k], ys[k] = ("%.2f"):format(x), ("%.2f"):format(y)
    end
    add('<circle r="7" fill="%s" cx="%s" cy="%s">%s%s</circle>', look.line, xs[1], ys[1],
      animated("cx", xs, film.seconds), animated("cy", ys, film.seconds))
  end
  out[#out + 1] = "</svg>"
  return table.concat(out, "\n") .. "\n"
end

-- The page stops and moves the pictures by the functions of SVG itself.
local function html_text(film)
  return ([[<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>%s</title>
<style>body{font-family:sans-serif;margin:1em;background:%s;color:%s}#bar{width:24em}</style></head><body>
%s<p><button id="play">pause</button> <input id="bar" type="range" min="0" max="%.6g" step="0.01" value="0">
<output id="time"></output></p>
<script>
const svg = document.querySelector("svg"), bar = document.getElementById("bar");
const play = document.getElementById("play"), time = document.getElementById("time");
const from = %.17g, rate = %.17g, seconds = %.17g;
play.onclick = () => {
  if (svg.animationsPaused()) { svg.unpauseAnimations(); play.textContent = "pause"; }
  else { svg.pauseAnimations(); play.textContent = "play"; }
};
bar.oninput = () => { svg.pauseAnimations(); play.textContent = "play"; svg.setCurrentTime(+bar.value); };
setInterval(() => {
  const now = svg.getCurrentTime() %% seconds;
  if (!svg.animationsPaused()) bar.value = now;
  time.textContent = "t = " + (from + rate*now).toFixed(2);
}, 40);
</script></body></html>
]]):format(escaped(film.title or "animation"), (colours[film.theme or "light"] or colours.light).page,
    (colours[film.theme or "light"] or colours.light).text, svg_text(film), film.seconds, film.times[1],
    (film.times[#film.times] - film.times[1])/film.seconds, film.seconds)
end

-- ── methods ────────────────────────────────────────────────────────────────────────────────────────────────

function film_type:show()
  if document.recorder then return document.recorder:show(self) end
  local every = math.max(1, math.ceil(self.fps/15))  -- a terminal draws some fifteen pictures a second
  local first, others = pictures(self, every)
  first:play(others, self.seconds*every/#self.frames)
end

function film_type:save(file)
  if type(file) ~= "string" then fail 'animate: expected a file name, as in a:save "pendulum.svg"' end
  local ending = (file:match "%.(%w+)$" or ""):lower()
  if ending == "svg" then
    write_file(file, svg_text(self), "save")
  elseif ending == "html" or ending == "htm" then
    write_file(file, html_text(self), "save")
  elseif ending == "gif" then
    local first, others = pictures(self)
    first:film(others, file, self.seconds/#self.frames)
  else
    fail(("animate: unknown extension '.%s'; the extension says the format: .svg, .html or .gif"):format(
      ending))
  end
  if document.recorder then document.recorder:show(self) end
  return self
end

function film_type:svg() return svg_text(self) end

doc { name = "animate", module = "plot", sig = "animate(sol, { p1, p2, … } [, options]) -> animation",
  text = "A mechanism that moves: points along a solution, with bars from the base through all of them. "
    .. ":show() plays "
    .. "it in the terminal, :save writes .svg (moves by itself), .html (with a slider) or .gif.",
  example = [[
    th = var "theta"
    sol = dae{ der(th, 2) ~ -9.81*sin(th) }:integrate{ start = { [th] = 1, [th.dot] = 0 }, to = 2 }
    return animate(sol, { vec(sin(th), -cos(th)) })]],
  gives = 'animation: 1 point, 51 pictures, 2 s; :show(), :save "file.svg" (.svg, .html, .gif)',
  options = animation_options,
  function(sol, what, given)
    if not arguments.is_solution(sol) then fail "animate: expected a solution: animate(sol, { p1, p2 })" end
    local chosen = check_options("animate", given, animation_options)
    local points = points_in(what)
    local from, to = sol.t[1], sol.t[#sol.t]
    local seconds = chosen.seconds or math.max(2, math.min(20, to - from))
    local fps = chosen.fps or 25
    if not (seconds > 0 and fps > 0 and seconds*fps <= 5000) then
      fail "animate: seconds and fps must be positive, and make at most 5000 pictures"
    end
    local count = math.max(2, math.floor(seconds*fps + 0.5) + 1)
    local times = {}
    for k = 1, count do times[k] = from + (to - from)*(k - 1)/(count - 1) end
    local film = setmetatable({ times = times, seconds = seconds, fps = fps, title = chosen.title,
      size = chosen.size,
      theme = chosen.theme, trail = chosen.trail ~= false, bars = chosen.bars ~= false }, film_type)
    film.frames = frames_of(sol, points, times, chosen.view or { 60, 30 })
    local finer = {}                   -- the path is smooth whatever the number of pictures
    for k = 1, 4*count - 3 do finer[k] = from + (to - from)*(k - 1)/(4*count - 4) end
    film.path = frames_of(sol, { points[#points] }, finer, chosen.view or { 60, 30 })
    if chosen.base ~= false then film.base = chosen.base or { 0, 0 } end
    film.xlim, film.ylim = window(film, chosen)
    return film
  end }
