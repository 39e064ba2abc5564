-- spy: the pattern of a matrix.

local arguments, curves = plotting.arguments, plotting.series
local known = plotting.options.named { "title", "xlabel", "ylabel", "size", "notes", "theme" }

local function entries_of(by, matrix)
  if type(matrix) == "table" then
    local rows, cols = #matrix, type(matrix[1]) == "table" and #matrix[1] or 0
    for i = 1, rows do
      if type(matrix[i]) ~= "table" or #matrix[i] ~= cols then
        fail(by .. ": expected a matrix or a list of equally long rows")
      end
    end
    return rows, cols, function(i, j) return matrix[i][j] end
  end
  if object_type(matrix) ~= "matrix" then
    fail(by .. ": expected a matrix, got " .. (object_type(matrix) or type(matrix))) end
  return matrix.rows, matrix.cols, function(i, j) return matrix(i, j) end
end

doc { name = "spy", module = "plot", sig = "spy(matrix [, options]) -> figure",
  text = "The pattern of a matrix: a cell for every entry that is not zero.",
  example = "spy({{1, 0}, {2, 3}}).notes[1]", gives = "3 of 4 entries are not zero",
  options = known,
  function(matrix, options)
    local _, checked = arguments.split_options("spy", known, {}, options or {})
    local rows, cols, entry = entries_of("spy", matrix)
    if rows == 0 or cols == 0 then fail "spy: the matrix is empty" end
    local x, y = {}, {}
    for i = 1, rows do
      for j = 1, cols do
        if entry(i, j) ~= 0 then x[#x + 1], y[#y + 1] = j, i end
      end
    end
    if #x == 0 then fail(("spy: all %d entries are zero"):format(rows * cols)) end
    local description = curves.copy_options({
      by = "spy", series = { { x = x, y = y, style = "cells" } }, equal = true, xwhole = true, ywhole = true,
      yreversed = true, xlim = { 0.5, cols + 0.5 }, ylim = { 0.5, rows + 0.5 },
      notes = { ("%d of %d entries are not zero"):format(#x, rows * cols) } }, checked)
    return figure(description)
  end }
