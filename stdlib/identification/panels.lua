-- Pictures of data with several outputs: a panel for each, or the one that the option `output` names.
local M = {}

-- draw(i, options) -> figure of output i. A title that is given stands over the first panel only.
function M.by_output(by, names, options, draw)
  local rest, which = {}, nil
  for key, value in pairs(options or {}) do
    if key == "output" then which = value else rest[key] = value end
  end
  if which == nil and #names == 1 then which = 1 end
  if which ~= nil then
    for i, name in ipairs(names) do if which == i or which == name then return draw(i, rest) end end
    fail(("%s: there is no output %s; there are %s"):format(by,
      type(which) == "string" and '"' .. which .. '"' or tostring(which), table.concat(names, ", ")))
  end
  local panels = {}
  for i = 1, #names do
    panels[i] = draw(i, rest)
    rest.title = nil
  end
  return panels[1]:page(1, { table.unpack(panels, 2) })
end

return M
