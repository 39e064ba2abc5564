-- What the steps of all methods are written with: names of unknowns, weighted sums, Newton's method.

local model_parts = include "algebra/model_parts"

local subscripts = { [0] = "₀", "₁", "₂", "₃", "₄", "₅", "₆", "₇", "₈", "₉" }
local function subscript(n)
  return (tostring(n):gsub("%d", function(d) return subscripts[tonumber(d)] end))
end

-- New unknowns for a list of states: one symbol, or a column.
local function stand_ins(name, like)
  if #like == 0 then return {} end
  if #like == 1 then return { var(name) } end
  return model_parts.entries(var(name, #like))
end

local function put(list, replacements)
  local result = {}
  for i, e in ipairs(list) do result[i] = next(replacements) and subs(e, replacements) or e end
  return result
end

local function pairing(from, to, into)
  for i, key in ipairs(from) do into[key] = to[i] end
  return into
end

local function indented(value, label)
  local lines, first = {}, true
  for line in tostring(value):gmatch "[^\n]+" do
    lines[#lines + 1] = "     " .. (first and label or (" "):rep(utf8.len(label))) .. line
    first = false
  end
  return table.concat(lines, "\n")
end

local function number_text(c) return math.type(c) == "float" and ("%.8g"):format(c) or tostring(c) end

-- "1/4 K₁ + (1/4 - √3/6) K₂".
local function weighted_sum(coefficients_, names)
  local text = ""
  for i, c in ipairs(coefficients_) do
    if c ~= 0 then
      local shown = number_text(c)
      local minus = shown:sub(1, 1) == "-" and not shown:find(" [+-] ")
      if minus then shown = shown:sub(2) end
      if shown == "1" then shown = "" elseif shown:find " [+-] " then shown = "(" .. shown
        .. ") " else shown = shown .. " " end
      text = text .. (text == "" and (minus and "-" or "") or minus and " - " or " + ") .. shown .. names[i]
    end
  end
  return text == "" and "0" or text
end

-- "x_k", "x_k + Δt K₁", "x_k + Δt (1/2 K₁ + 1/2 K₂)".
local function stage_text(row, names)
  local sum, count = weighted_sum(row, names), 0
  for i = 1, #row do if row[i] ~= 0 then count = count + 1 end end
  if count == 0 then return "x_k" end
  return "x_k + Δt " .. (count == 1 and row[1] == 1 and sum or "(" .. sum .. ")")
end

-- ", u(t_k + 1/2 Δt)" where there are inputs, ", t_k + 1/2 Δt" where the time occurs.
local function input_text(p, c)
  local at = "t_k" .. (c == 0 and "" or " + " .. weighted_sum({ c }, { "Δt" }))
  return (#p.inputs > 0 and ", u(" .. at .. ")" or "") .. (p.timed and ", " .. at or "")
end

local function row_of(matrix, i)
  local row = {}
  for j = 1, matrix.cols do row[j] = matrix(i, j) end
  return row
end

local function newton_lines(add, start)
  add "Newton's method:  repeat"
  add "     solve M Δw = -r(w, x_k),  w ← w + α Δw   (α = 1, or smaller where ‖r‖ would grow)"
  add("     until ‖r(w, x_k)‖ ≤ tol;  start: " .. start)
end

-- What M says of the index: a line where M is not regular for small Δt. `top` is what has to be regular.
local function regularity(top, unknowns, explicit)
  if rank(top) == #unknowns then return nil end
  return explicit and "     M is singular for every Δt: the index is above 1. Reduce it first, sys:reduce()."
    or "     M tends to a singular matrix as Δt → 0: the index is above 1. sys:reduce() lowers it."
end

return { subscript = subscript, stand_ins = stand_ins, put = put, pairing = pairing, indented = indented,
  weighted_sum = weighted_sum, stage_text = stage_text, input_text = input_text, row_of = row_of,
  newton_lines = newton_lines, number_text = number_text, regularity = regularity }
