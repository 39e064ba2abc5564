-- Answers as text and back: what crosses from the process of a submission to that of the grader is data.

local saving, read = include "saving", include "saved"

-- Polynomials of a model of data, as a table: { A = …, B = …, … }.
local function polynomials(model)
  local found = {}
  for _, name in ipairs { "A", "B", "C", "D", "F" } do
    local good, value = pcall(function() return model[name] end)
    if good and object_type(value) == "matrix" and (value.rows == 1 or value.cols == 1) then
      found[name] = {}
      for i = 1, #value do found[name][i] = value[i] end
    end
  end
  return found
end

local answers = { expr = true, matrix = true, equation = true, tableau = true, lti = true, complex = true,
  roots = true }
local deepest = 6

-- What of a value is an answer: plain tables of it, tables that answer for themselves taken apart.
local function answer_of(value, depth)
  if depth > deepest then fail "an answer is nested too deep" end
  local kind = object_type(value)
  if answers[kind] or kind == "model" and depth == 0 then return value end
  if kind == "idmodel" or kind == "idpoly" then return polynomials(value) end
  if kind == "eigenvalues" then return answer_of(value.values, depth + 1) end
  if kind == "model" then fail "a model inside a list cannot be graded" end
  if kind then fail(("a %s cannot be an answer"):format(kind)) end
  if type(value) ~= "table" then return value end
  local kept = {}
  for key, item in next, value do
    if type(key) == "string" or math.type(key) == "integer" then kept[key] = answer_of(item, depth + 1) end
  end
  return kept
end

local values = {}

-- The text of an answer; "" where it is none.
function values.text_of(value)
  local good, text = pcall(function() return saving.text(answer_of(value, 0)) end)
  return good and text or ""
end

function values.read(text) return read(text, "the answer") end

return values
