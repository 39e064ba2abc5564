-- Answers as text and back: what crosses from the process of a submission to that of the grader is data.

local read = include "saved"
local deepest = 6

local function number_text(value)
  if value ~= value then return "(0/0)" end
  if value == math.huge or value == -math.huge then return value > 0 and "(1/0)" or "(-1/0)" end
  local text = ("%.17g"):format(value)
  if math.type(value) == "float" and not text:find "[.e]" then text = text .. ".0" end
  return value < 0 and "(" .. text .. ")" or text
end

local text_of

local function list_text(list, depth)
  local parts = {}
  for i = 1, #list do parts[i] = text_of(list[i], depth + 1) end
  return "{" .. table.concat(parts, ", ") .. "}"
end

local function table_text(value, depth)
  local parts, keys = {}, {}
  for i = 1, rawlen(value) do parts[i] = text_of(rawget(value, i), depth + 1) end
  for key in next, value do
    if type(key) == "string" then keys[#keys + 1] = key end
  end
  table.sort(keys)
  for _, key in ipairs(keys) do
    parts[#parts + 1] = ("[%q] = %s"):format(key, text_of(rawget(value, key), depth + 1))
  end
  return "{" .. table.concat(parts, ", ") .. "}"
end

local function coefficients(column)
  local list = {}
  for i = 1, #column do list[i] = column[i] end
  return list
end

local objects = {
  expr = function(e) return "(" .. e:code() .. ")" end,
  matrix = function(m) return "(" .. m:code() .. ")" end,
  equation = function(e) return "(" .. e:code() .. ")" end,
  tableau = function(tab)
    local rows = {}
    for i = 1, tab.stages do rows[i] = coefficients(tab.A[i].T) end
    return ("tableau { A = %s, b = %s, c = %s }"):format(list_text(rows, 0),
      list_text(coefficients(tab.b), 0), list_text(coefficients(tab.c), 0))
  end,
  lti = function(g)
    local sampling = g.Ts > 0 and ", " .. number_text(g.Ts) or ""
    local good, num = pcall(function() return g.num end)
    if good then
      return ("tf(%s, %s%s)"):format(list_text(coefficients(num), 0),
        list_text(coefficients(g.den), 0), sampling)
    end
    return ("ss(%s, %s, %s, %s%s)"):format(g.A:code(), g.B:code(), g.C:code(), g.D:code(), sampling)
  end,
  complex = function(z) return ("complex(%s, %s)"):format(text_of(z.re), text_of(z.im)) end,
  roots = function(list) return list_text(coefficients(list), 0) end,
}

-- Polynomials of a model of data, as a table: { A = …, B = …, … }.
local function polynomials(model)
  local found = {}
  for _, name in ipairs { "A", "B", "C", "D", "F" } do
    local good, value = pcall(function() return model[name] end)
    if good and object_type(value) == "matrix" and (value.rows == 1 or value.cols == 1) then
      found[name] = coefficients(value.rows == 1 and value.T or value)
    end
  end
  return next(found) and found
end

function text_of(value, depth)
  depth = depth or 0
  if depth > deepest then fail "an answer is nested too deep" end
  local kind = object_type(value)
  if objects[kind] then return objects[kind](value) end
  if kind == "model" then
    if depth > 0 then fail "a model inside a list cannot be graded" end
    return value:code()
  end
  if kind == "idmodel" or kind == "idpoly" then return table_text(polynomials(value) or {}, depth) end
  if kind then fail(("a %s cannot be an answer"):format(kind)) end
  if type(value) == "number" then return number_text(value) end
  if type(value) == "string" then return ("%q"):format(value) end
  if type(value) == "boolean" then return tostring(value) end
  if type(value) == "table" then return table_text(value, depth) end
  fail(("a %s cannot be an answer"):format(type(value)))
end

local values = {}

-- The text of an answer; "" and why where it is none.
function values.text_of(value)
  local good, text = pcall(text_of, value)
  if not good then return "" end
  if not text:find "^local " and not text:find "return " then text = "return " .. text end
  return text
end

function values.read(text) return read(text, "the answer") end

return values
