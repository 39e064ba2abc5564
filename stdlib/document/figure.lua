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

-- What a figure is called, for those who do not see it: its title and curves.
function M.label(figure)
  local words = {}
  if figure.title ~= "" then words[1] = figure.title end
  for _, label in ipairs(figure.labels) do
    if label ~= "" then words[#words + 1] = label end
  end
  return #words > 0 and table.concat(words, ", ") or tostring(figure)
end

-- HTML of each figure of a list; `first` numbers the names on the page. Where figures cannot be drawn (no
-- gnuplot), the drawings of the terminal stand instead, and why.
function M.html(figures, first)
  if #figures == 0 then return {} end
  local others = table.move(figures, 2, #figures, 1, {})
  local good, svgs = pcall(function() return figures[1]:svg(others) end)
  local out = {}
  for i, figure in ipairs(figures) do
    local inside
    if good then
      inside = on_page(svgs[i], ("f%d-"):format((first or 1) + i - 1), M.label(figure))
    else
      inside = '<pre class="text" tabindex="0">' .. text.escaped(figure:text(80))
        .. '</pre><figcaption class="error">'
        .. text.escaped(tostring(svgs)) .. "</figcaption>"
    end
    out[i] = "<figure>" .. inside .. "</figure>"
  end
  return out
end

return M
