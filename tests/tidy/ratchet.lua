-- Findings, and what is still allowed of them. A rule that came after the code has an allowance per place in
-- allowed.lua: more than that is a finding, less is a note. `lua5.4 tests/tidy.lua --tighten` writes the
-- present numbers back; it lowers allowances and never raises one.
local source = require "source"
local ratchet = { findings = 0, notes = 0 }
local allowed = require "allowed"
local present = {}                                            -- rule -> place -> number

--- While this is set, findings go there alone: for trying rules.
ratchet.recorder = nil

function ratchet.report(file, line, message)
  if ratchet.recorder then return ratchet.recorder(message) end
  ratchet.findings = ratchet.findings + 1
  print(("%s:%d: %s"):format(file, line, message))
end

--- Reports unless the number of findings of a rule at a place (a file, a class, an arrow) is allowed.
function ratchet.check(rule, place, number, file, line, message)
  if number == 0 then return end
  if ratchet.recorder then return ratchet.recorder(message) end
  present[rule] = present[rule] or {}
  present[rule][place] = number
  local limit = (allowed[rule] or {})[place] or 0
  if number > limit then
    local known = limit > 0 and (" (%d; allowed are %d: tests/tidy/allowed.lua)"):format(number, limit) or ""
    ratchet.report(file, line, message .. known)
  end
end

local function sorted(t)
  local keys = {}
  for key in pairs(t) do keys[#keys + 1] = key end
  table.sort(keys)
  return keys
end

--- Says which allowances are too high.
function ratchet.finish()
  local loose = 0
  for rule, places in pairs(allowed) do
    for place, limit in pairs(places) do
      if ((present[rule] or {})[place] or 0) < limit then loose = loose + 1 end
    end
  end
  if loose > 0 then
    print(loose .. " allowances of tests/tidy/allowed.lua are too high: lua5.4 tests/tidy.lua --tighten")
  end
  if ratchet.findings > 0 then print(ratchet.findings .. " findings") end
end

--- Writes allowed.lua with the smaller of the present and the allowed numbers; `first`: the present ones.
function ratchet.tighten(first)
  local out = { "-- What the rules of tests/tidy do not yet forbid, per place. Numbers only fall: they are",
                "-- written by tests/tidy.lua --tighten. A file that is renamed takes its row along.", "return {" }
  for _, rule in ipairs(sorted(first and present or allowed)) do
    local rows = {}
    for _, place in ipairs(sorted(present[rule] or {})) do
      local limit = (allowed[rule] or {})[place]
      local number = present[rule][place]
      if first or limit then
        rows[#rows + 1] = ("    [%q] = %d,"):format(place, first and number or math.min(limit, number))
      end
    end
    if #rows > 0 then
      out[#out + 1] = ("  %s = {\n%s\n  },"):format(rule, table.concat(rows, "\n"))
    end
  end
  out[#out + 1] = "}\n"
  local handle = assert(io.open(source.root .. "/tests/tidy/allowed.lua", "w"))
  handle:write(table.concat(out, "\n"))
  handle:close()
end

return ratchet
