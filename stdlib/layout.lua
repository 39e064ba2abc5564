-- Rows of strings as aligned columns; the first row is the head. right[j]: column j to the right; indent:
-- blanks before a row.
return function(rows, right, indent)
  local widths, lines = {}, {}
  for _, row in ipairs(rows) do
    for j, cell in ipairs(row) do widths[j] = math.max(widths[j] or 0, width(cell)) end
  end
  for i, row in ipairs(rows) do
    local cells = {}
    for j, cell in ipairs(row) do
      local blanks = (" "):rep(widths[j] - width(cell))
      cells[j] = right and right[j] and blanks .. cell or cell .. blanks
    end
    lines[i] = ((" "):rep(indent or 0) .. table.concat(cells, "  ")):gsub("%s+$", "")
  end
  return table.concat(lines, "\n")
end
