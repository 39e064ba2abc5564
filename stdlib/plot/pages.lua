-- overlay and layout: figures in one, figures on one page.

local unpack = table.unpack

doc { name = "overlay", module = "plot", sig = "overlay(figure, figure, …) -> figure",
  text = "The curves of several 2-D figures in one: titles, axes and everything else are those of the first.",
  example = "overlay(band({0, 1}, {0, 1}, {1, 2}), plot({0, 1}, {0.5, 1.5}))",
    gives = "figure: 2 series, 4 points",
  function(first, ...)
    for i, each in ipairs { first, ... } do
      if object_type(each) ~= "figure" then fail(("overlay: argument %d is not a figure"):format(i)) end
    end
    for _, each in ipairs { ... } do first = first:with(each) end
    return first
  end }

doc { name = "layout", module = "plot", sig = "layout({rows, columns}, figure, figure, …) -> figure",
  text = "Several 2-D figures on one page, row by row; in a terminal one under the other.",
  example = "layout({1, 2}, plot({0, 1}), plot({1, 0}))", gives = "figure: 1 series, 2 points, 2 panels",
  function(shape, ...)
    local panels = { ... }
    local rows, columns = unpack(type(shape) == "table" and shape or {})
    if math.type(rows) ~= "integer" or math.type(columns) ~= "integer" or rows < 1 or columns < 1 then
      fail "layout: the first argument says the number of rows and columns: layout({2, 1}, fig1, fig2)"
    end
    if #panels == 0 or #panels > rows * columns then
      fail(("layout: %d figures do not fit into %d × %d places"):format(#panels, rows, columns))
    end
    for i, each in ipairs(panels) do
      if object_type(each) ~= "figure" then fail(("layout: argument %d is not a figure"):format(i + 1)) end
    end
    return panels[1]:page(columns, { unpack(panels, 2) })
  end }
