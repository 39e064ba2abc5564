-- What a model or a derivation prints, line by line as a textbook has it: used by the tests beside this file.
return function(value, ...)
  local text = tostring(value)
  for _, line in ipairs { ... } do
    if not text:find(line, 1, true) then error("no line '" .. line .. "' in\n" .. text, 2) end
  end
end
