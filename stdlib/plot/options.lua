-- The options of figures, one row each: errors, help and Tab read them here.

local function row(name, kind, text, default, values)
  return { name = name, type = kind, text = text, default = default or "", values = values or "" }
end

local styles = "line|points|line+points|dots|impulses|steps|cells|fill"
local places = "top left|top right|bottom left|bottom right|above|right|below"

local all = {
  row("title", "string", "the title above the frame"),
  row("xlabel", "string or expression", "the label of the axis; an expression brings its unit"),
  row("ylabel", "string or expression", "the same of the y axis"),
  row("zlabel", "string or expression", "the same of the z axis"),
  row("labels", "list", "names of the curves in the legend"),
  row("legend", "boolean or string", "whether there is one, or its place", "", places),
  row("xlim", "list", "{ low, high }: the range that is shown"),
  row("ylim", "list", "the same of the y axis"),
  row("zlim", "list", "the same of the z axis"),
  row("xlog", "boolean", "logarithmic axis", "false"),
  row("ylog", "boolean", "logarithmic axis", "false"),
  row("xstep", "number", "distance of the ticks"),
  row("ystep", "number", "distance of the ticks"),
  row("style", "string or list", "how curves are drawn", "", styles),
  row("colour", "string or list", "a name or \"#rrggbb\", for all curves or one for each"),
  row("color", "string or list", "the same"),
  row("dash", "string or list", "how lines are broken", "", "solid|dashed|dotted|dashdot"),
  row("width", "number or list", "of lines, in pixels"),
  row("marker", "string or list", "of points", "", "circle|ring|square|box|triangle|diamond|plus|cross"),
  row("grid", "boolean", "thin lines at the ticks", "true"),
  row("hlines", "list", "lines across the frame: { 0, { 1, \"limit\" } }"),
  row("vlines", "list", "the same from bottom to top"),
  row("texts", "list", "words at places: { { x, y, \"words\" } }"),
  row("equal", "boolean", "one unit is equally long on all axes"),
  row("size", "list", "{ width, height } in pixels"),
  row("notes", "list", "small lines of text below the frame"),
  row("view", "list", "{ tilt, turn } in degrees: where it is seen from", "{60, 30}"),
  row("surfaces", "list", "nets one can see through: { sphere(1) }"),
  row("theme", "string", "colours of the page", "\"light\"", "light|dark"),
  row("right", "list", "numbers of the curves that belong to an axis on the right"),
  row("y2label", "string or expression", "the label of that axis"),
  row("y2lim", "list", "its range"),
}

local by_name = {}
for _, option in ipairs(all) do by_name[option.name] = option end

local M = {}

-- The rows of these names.
function M.named(names)
  local rows = {}
  for i, name in ipairs(names) do
    rows[i] = by_name[name] or error("no option of figures is called " .. name)
  end
  return rows
end

function M.joined(first, more)
  local rows = table.move(first, 1, #first, 1, {})
  return table.move(more, 1, #more, #rows + 1, rows)
end

M.flat = M.named { "title", "xlabel", "ylabel", "labels", "legend", "xlim", "ylim", "style", "equal", "size",
  "notes", "colour", "color", "dash", "width", "marker", "grid", "hlines", "vlines", "texts", "xlog", "ylog",
  "xstep", "ystep", "theme", "right", "y2label", "y2lim" }
M.space = M.named { "title", "xlabel", "ylabel", "zlabel", "labels", "legend", "xlim", "ylim", "zlim",
  "style",
  "equal", "size", "notes", "view", "surfaces", "colour", "color", "width", "theme" }
M.row = row

return M
