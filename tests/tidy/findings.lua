-- What tidy finds: one line each, 'file:line: message'.
local findings = { number = 0 }

--- While this is set, findings go there alone: for trying rules.
findings.recorder = nil

function findings.report(file, line, message)
  if findings.recorder then return findings.recorder(message) end
  findings.number = findings.number + 1
  print(("%s:%d: %s"):format(file, line, message))
end

return findings
