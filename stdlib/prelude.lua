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
-- A call with more arguments than any form of sig shows is an error; … in sig stands for any number.
-- options = { option("runs", "integer", "how many", "1000"), … }: as in the rows of C++ (OptionRow). With
-- options_at = 2 the second argument is checked by them (check_options) before the function gets it, and is
-- {} where it is missing; a function that has its options in several places calls check_options itself.
-- options = function() … end makes the rows when they are first read, not at every start.
--
-- An entry of a library that is seldom needed has load = function() … end instead of the value: it is made
-- when first touched. describe = function(entry) … end sets text and example when they are first read.

documented = {}  -- the entries, in order

local function lines(text)
  if not text then return "" end
  return text:find "\n" and block("\n" .. text) or text
end

function option(name, type, text, default, values)
  return { name = name, type = type, text = text, default = default or "", values = values or "" }
end

-- Two tables of options; a text for a row that means something else here: { runs = "samples of a level" }.
function joined_options(first, more, texts)
  local rows, count = {}, #first
  for i = 1, count + #more do
    local row = first[i] or more[i - count]
    rows[i] = not (texts and texts[row.name]) and row
      or option(row.name, row.type, texts[row.name], row.default, row.values)
  end
  return rows
end

local unpack, pack, most = table.unpack, table.pack, math.max

-- What is documented is laid out when it is first read: a start reads nothing of it.
local laid_out = { sig = prose, text = prose, title = prose, example = lines, gives = lines }
local documentation = { __index = function(row, key)
  local source, value = rawget(row, "source"), nil
  if key == "options" then
    value = source.options
    if type(value) == "function" then value = value() end
  elseif laid_out[key] then
    value = laid_out[key](source[key] or "")
  end
  row[key] = value
  return value
end }

-- The function behind a check of its options.
local function checked(entry, row)
  local f, at = entry[1], entry.options_at
  if not at then return f end
  local by = entry.name:match "[^:.]+$"
  return function(...)
    local arguments = pack(...)
    arguments[at] = check_options(by, arguments[at], row.options)
    return f(unpack(arguments, 1, most(arguments.n, at)))
  end
end

function doc(entry)
  if type(entry) ~= "table" then fail("doc: expected a table { name =, sig =, text =, function … end }") end
  local name, sig, text = entry.name, entry.sig, entry.text
  if not (type(name) == "string" and type(sig) == "string" and type(text) == "string") then
    fail "doc: name, sig and text must be strings"
  end
  if entry[1] == nil and not entry.load then
    fail("doc: the function itself is missing (the last item of the table)")
  end
  local row = setmetatable({ name = name, module = entry.module or "library", describe = entry.describe,
    source = entry, value = entry[1] }, documentation)
  documented[#documented + 1] = row
  if entry.load then return install_lazy(name, entry.load) end
  row.value = install(name, checked(entry, row), sig)
  return row.value
end

-- "1 pole", "2 poles".
function counted(n, noun) return n .. " " .. noun .. (n == 1 and "" or "s") end

-- What print says of a result in LaTeX: the method latex of results that are tables.
function report_latex(value) return include "latex_report".fragment(tostring(value)) end
