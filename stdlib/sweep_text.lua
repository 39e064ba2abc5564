-- The text of a sweep: model and options in the notation of save, so that load and other machines can make it
-- again. The fingerprint of a store is a hash of it.

local saving = include "saving"

-- How the runs are shared out; what does not touch their results.
local elsewhere = { store = true, workers = true, limit = true, retry = true, open = true, shards = true,
  on = true, progress = true }

-- Estimates of a fit among params become the components of a joint distribution, by name.
local function named_estimates(options)
  local params = options.params
  if params == nil then return end
  if object_type(params) then params = { params } end
  local plain = {}
  for key, value in pairs(params) do
    if math.type(key) ~= "integer" then plain[key] = value end
  end
  for _, estimate in ipairs(params) do
    local joint = normal(estimate.theta, estimate.cov)
    for i, name in ipairs(estimate.names) do
      local state = name:match "^(.*)%(0%)$"
      if state then
        local start = {}
        for key, value in pairs(options.start) do start[key] = value end
        start[state] = joint[i]
        options.start = start
      else
        plain[name] = joint[i]
      end
    end
  end
  options.params = plain
end

-- A value that cannot be written down: its place is remembered, its contents enter the fingerprint.
local function opaque(writer, place, contents)
  writer.hidden[#writer.hidden + 1] = place
  writer.contents[#writer.contents + 1] = contents
  return "nil"
end

-- An input whose function gives an expression is that expression.
local function callback(writer, f)
  if writer.place:find "^inputs" then
    local good, value = pcall(f, t)
    if good and (type(value) == "number" or object_type(value) == "expr") then return writer:text(value) end
  end
  return opaque(writer, writer.place, function_bytes(f))
end

-- The text of the model, that of the options, and a list of the places that they leave out.
return function(sys, options)
  local kept = {}
  for key, value in pairs(options) do
    if not elsewhere[key] then kept[key] = value end
  end
  named_estimates(kept)
  local writer = saving.new_writer { by = "sweep", model = "sys", opaque = opaque, callback = callback,
    lists = true, hidden = {}, contents = {} }
  local text = writer:table(kept)
  writer.lines[#writer.lines + 1] = "return " .. text .. "\n"
  return sys:code(), table.concat(writer.lines, "\n"), table.concat(writer.hidden, ", "),
    table.concat(writer.contents, "\0")
end
