-- Figures in HTML: inline SVG. Several of one page must not share names, and what gnuplot says of itself is
-- left out, so that equal figures are equal texts.
local text = document.text
local M = {}

-- The names in an SVG text get a prefix; the title says what the figure shows.
local function on_page(svg, prefix, label)
  svg = svg:gsub("<title>.-</title>", "", 1):gsub("<desc>.-</desc>", "", 1)
    :gsub('%s+xmlns:xlink="[^"]*"', "")
  svg = svg:gsub("xlink:href", "href"):gsub('(%sid=["\'])', "%1" .. prefix)
    :gsub('(href=["\']#)', "%1" .. prefix):gsub("url%(%s*#", "url(#" .. prefix)
  local size = { svg:match 'width="(%d+)" height="(%d+)"' }
  svg = svg:gsub('<svg.->', ('<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="%s" '
    .. 'width="%s" height="%s" viewBox="0 0 %s %s">'):format(text.escaped(label):gsub("%%", "%%%%"), size[1],
      size[2], size[1], size[2]), 1)
  return (svg:gsub("\n%s*\n+", "\n"))
end

-- Animations are pictures as well: SVG that moves by itself.
function M.is_animation(any)
  local kind = type(any) == "table" and getmetatable(any)
  return type(kind) == "table" and kind.__name == "animation"
end

function M.is_picture(any) return object_type(any) == "figure" or M.is_animation(any) end

-- What a figure is called, for those who do not see it: its title and curves.
function M.label(figure)
  if M.is_animation(figure) then return figure.title or "animation" end
  local words = {}
  if figure.title ~= "" then words[1] = figure.title end
  for _, label in ipairs(figure.labels) do
    if label ~= "" then words[#words + 1] = label end
  end
  return #words > 0 and table.concat(words, ", ") or tostring(figure)
end

-- The SVG texts of pictures, those of figures by one start of gnuplot.
local function svg_texts(pictures)
  local figures, texts = {}, {}
  for _, picture in ipairs(pictures) do
    if not M.is_animation(picture) then figures[#figures + 1] = picture end
  end
  local drawn = #figures > 0 and figures[1]:svg(table.move(figures, 2, #figures, 1, {})) or {}
  local next_figure = 0
  for i, picture in ipairs(pictures) do
    if M.is_animation(picture) then
      texts[i] = picture:svg()
    else
      next_figure = next_figure + 1
      texts[i] = drawn[next_figure]
    end
  end
  return texts
end

-- HTML of each picture of a list; `first` numbers the names on the page. Where figures cannot be drawn (no
-- gnuplot), the drawings of the terminal stand instead, and why.
function M.html(pictures, first)
  local good, svgs = pcall(svg_texts, pictures)
  local out = {}
  for i, picture in ipairs(pictures) do
    local inside
    if good or M.is_animation(picture) then
      inside = on_page(good and svgs[i] or picture:svg(), ("f%d-"):format((first or 1) + i - 1),
        M.label(picture))
    else
      inside = '<pre class="text" tabindex="0">' .. text.escaped(picture:text(80))
        .. '</pre><figcaption class="error">' .. text.escaped(tostring(svgs)) .. "</figcaption>"
    end
    out[i] = "<figure>" .. inside .. "</figure>"
  end
  return out
end

return M
