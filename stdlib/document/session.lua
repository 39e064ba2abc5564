-- Pieces of a document that run one after another like the lines of a session: what the last statement of
-- each gives is shown as the prompt would show it. What they leave in _G is taken back at the end.
local code, recording = document.code, document.recording
local M = {}

-- The source with its last statement as a value, where it is one.
function M.compile(source, name)
  local chunk = load("return " .. source, name, "t")
  if chunk then return chunk end
  local statements = code.statements(source)
  local last = statements[#statements]
  if last then
    chunk = load(source:sub(1, last.first - 1) .. "return " .. source:sub(last.first), name, "t")
  end
  if chunk then return chunk end
  return load(source, name, "t")
end

local Session = {}
Session.__index = Session

function M.new()
  local before = {}
  for key, value in next, _G do before[key] = value end
  return setmetatable({ record = recording.new(), before = before, count = 0 }, Session)
end

-- Runs a piece; `record.at` becomes its number, under which its output is kept. Returns the text of an
-- error, and whether it was Ctrl-C.
function Session:run(source, name)
  local record = self.record
  self.count = self.count + 1
  record.at = self.count
  return record:during(function()
    local chunk, problem = M.compile(source, name)
    local stopped
    if chunk then
      local values
      local good
      good, problem, stopped = run_user(function()
        values = table.pack(chunk())
        if values.n == 1 and values[1] ~= nil then
          record:show(values[1])
        elseif values.n > 1 then
          record:print(values)
        end
      end)
      if good then return nil end
    end
    record:drain()
    record:add { error = problem }
    return problem, stopped
  end)
end

-- The globals as they were before.
function Session:close()
  for key in next, _G do
    if self.before[key] == nil then rawset(_G, key, nil) end
  end
  for key, value in next, self.before do rawset(_G, key, value) end
end

return M
