-- What estimates and other results were asked for, so that save can write the call that makes them again and
-- load gives a result with all its methods.

asked = setmetatable({}, { __mode = "k" })  -- result -> { function, arguments … }

-- Tables are copied: what a script does to its options afterwards is not part of the call.
local function kept(value)
  if type(value) ~= "table" or getmetatable(value) ~= nil then return value end
  local copy = {}
  for key, item in pairs(value) do copy[key] = item end
  return copy
end

local function remembering(name, f)
  return function(...)
    local results = table.pack(f(...))
    if type(results[1]) == "userdata" or type(results[1]) == "table" then
      local call = table.pack(...)
      for i = 1, call.n do call[i] = kept(call[i]) end
      call.name = name
      asked[results[1]] = call
    end
    return table.unpack(results, 1, results.n)
  end
end

-- Functions whose results follow from their arguments alone.
remembered = {}
for name in ([[fit arx iv4 fir armax oe bj pem n4sid compare order_scan lsq spa etfe welch coherence
  impulse_estimate cra rarx rarmax process_model tfest periodogram newton gauss_newton converge sweep]])
    :gmatch "%S+" do
  remembered[name] = install(name, remembering(name, named(name)))
end
for i = 1, #documented do
  local row = documented[i]
  local value = remembered[row.name]
  if value then row.value = value end  -- reading a value that is made later would cost here
end
