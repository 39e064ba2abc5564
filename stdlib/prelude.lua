-- doc{}: how a library function written in Lua gets its name and its documentation, in one place.
--
--   doc { name = "settling_time", sig = "settling_time(wn, zeta) -> seconds", module = "lti",
--         text = "Time after which a second-order step response stays within 2 %.",
--         example = "settling_time(2, 0.5)", gives = "4.0",
--         function(wn, zeta) return 4 / (wn * zeta) end }
--
-- The name says what it is, as in the rows of C++ (src/lua/core/call.hpp): "f", "rk.f", "model:f", "model#f",
-- "model:__add".

-- sig, text, title: a line end counts as one blank, with the blanks around it. Of several lines of an example
-- or a result the indentation that they have in common is no part of it.
--
-- options = { { name =, type =, default =, text =, values = }, … }: as in the rows of C++ (OptionRow);
-- what is missing is "". check_options(by, options, known) refuses what is not among them.
--
-- An entry of a library that is seldom needed has load = function() … end instead of the value: it is made
-- when first touched. describe = function(entry) … end sets text and example when they are first read.

documented = {}  -- the entries, in order

local function lines(text)
  if not text then return "" end
  return text:find "\n" and block("\n" .. text) or text
end

local function complete(options)
  for _, option in ipairs(options or {}) do
    for _, key in ipairs { "type", "default", "text", "values" } do option[key] = option[key] or "" end
  end
  return options
end

function doc(entry)
  if type(entry) ~= "table" then fail("doc: expected a table { name =, sig =, text =, function … end }") end
  for _, key in ipairs { "name", "sig", "text" } do
    if type(entry[key]) ~= "string" then fail("doc: '" .. key .. "' must be a string") end
  end
  if entry[1] == nil and not entry.load then
    fail("doc: the function itself is missing (the last item of the table)")
  end
  documented[#documented + 1] = {
    name = entry.name, sig = prose(entry.sig), text = prose(entry.text), example = lines(entry.example),
    gives = lines(entry.gives), module = entry.module or "library", title = prose(entry.title or ""),
    value = entry[1], describe = entry.describe, options = complete(entry.options),
  }
  if entry.load then return install_lazy(entry.name, entry.load) end
  install(entry.name, entry[1])
  return entry[1]
end
