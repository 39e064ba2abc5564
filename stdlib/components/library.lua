-- A library of parts as a table: unknown names are errors, print lists what there is.
local layout = include "layout"

return function(name, title)
  local order = {}
  local library = { __name = "library", __metatable = "library" }
  function library:__index(key)
    local known = {}
    for _, entry in ipairs(order) do known[#known + 1] = entry.name end
    fail(("components.%s has no part '%s'."):format(name, tostring(key))
      .. did_you_mean(tostring(key), known)
      .. (' (print(components.%s) lists them, help "%s" looks in all libraries)'):format(name, tostring(key)))
  end
  function library:__newindex(key, value)
    rawset(self, key, value)
    order[#order + 1] = { name = key, value = value }
  end
  function library:__tostring()
    local rows = {}
    for _, entry in ipairs(order) do
      local text = type(entry.value) == "table" and rawget(entry.value, "text") or ""
      rows[#rows + 1] = { entry.name, prose(text ~= "" and text or tostring(entry.value)) }
    end
    return ("components.%s: %s\n"):format(name, title) .. layout(rows)
  end
  -- The parts in order: for name, component in library() do.
  function library:__call()
    local i = 0
    return function()
      i = i + 1
      if order[i] then return order[i].name, order[i].value end
    end
  end
  return setmetatable({}, library)
end
