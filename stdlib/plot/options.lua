-- The options of figures, one row each: errors, help and Tab read them here.

local styles = "line|points|line+points|dots|impulses|steps|cells|fill"

-- What plot and its relatives add to figure{…}.
local own = {
  option("labels", "string, expression or list", "names of the curves in the legend"),
  option("style", "string or list", "how curves are drawn", "", styles),
  option("colour", "string or list", "a name or \"#rrggbb\", for all curves or one for each"),
  option("color", "string or list", "the same"),
  option("dash", "string or list", "how lines are broken", "", "solid|dashed|dotted|dashdot"),
  option("width", "number or list", "of lines, in pixels"),
  option("marker", "string or list", "of points", "", "circle|ring|square|box|triangle|diamond|plus|cross"),
  option("right", "list", "numbers of the curves that belong to an axis on the right"),
  option("y2lim", "list", "the range of the axis on the right"),
}

local by_name = {}
for _, list in ipairs { options_of "figure", own } do
  for _, option in ipairs(list) do by_name[option.name] = option end
end

local M = {}

-- The rows of these names.
function M.named(names)
  local rows = {}
  for i, name in ipairs(names) do
    rows[i] = by_name[name] or error("no option of figures is called " .. name)
  end
  return rows
end

M.joined = joined_options

M.flat = M.named { "title", "xlabel", "ylabel", "labels", "legend", "xlim", "ylim", "style", "equal", "size",
  "notes", "colour", "color", "dash", "width", "marker", "grid", "hlines", "vlines", "texts", "xlog", "ylog",
  "xstep", "ystep", "theme", "right", "y2label", "y2lim" }
-- Of what is drawn with colours and widths of its own.
M.frame = M.named { "title", "xlabel", "ylabel", "legend", "xlim", "ylim", "equal", "size", "notes", "grid",
  "hlines", "vlines", "texts", "xlog", "ylog", "xstep", "ystep", "theme" }
M.space = M.named { "title", "xlabel", "ylabel", "zlabel", "labels", "legend", "xlim", "ylim", "zlim",
  "style",
  "equal", "size", "notes", "view", "surfaces", "colour", "color", "width", "theme" }

return M
