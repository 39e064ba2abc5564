-- Options of sweep in the words that C++ reads: parameters in the place of random processes and of a fit.
local process = include "many/process"
local options = {}

-- from = r: what r has estimated is drawn, its initial values are the start.
local function expand_fit(result, fit_result)
  result.from = nil
  local given = result.params
  result.params = { fit_result }
  if object_type(given) then given = { given } end
  for key, value in pairs(given or {}) do
    result.params[math.type(key) == "integer" and key + 1 or key] = value
  end
  for _, name in ipairs(fit_result.names) do
    if name:find "%(0%)$" then result.start = result.start or {} end
  end
end

local function expand_processes(result)
  local inputs, params = {}, {}
  for key, value in pairs(result.params or {}) do params[key] = value end
  for key, value in pairs(result.inputs) do
    if object_type(value) == "random_process" then
      local name = tostring(key):gsub("[^%w_]", "")
      value = process.expand(contents("random_process", value), name, params)
    end
    inputs[key] = value
  end
  result.inputs, result.params = inputs, params
end

function options.expand(given)
  local result = {}
  for key, value in pairs(given) do result[key] = value end
  if object_type(result.from) == "fit_result" then expand_fit(result, result.from) end
  if result.inputs then expand_processes(result) end
  return result
end

return options
