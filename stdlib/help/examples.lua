-- Examples of the documentation: how they run, how they are shown, and those made of specimens.

-- Splits "statements; expression" so that the expression's value can be printed: tries every separator from
-- the end.
function compiled_example(code, env)
  local chunk = load("return " .. code, "=example", "t", env)
  if chunk then return chunk end
  for at = #code, 1, -1 do
    local c = code:sub(at, at)
    if (c == "\n" or c == ";") and not code:find("^%s*end%f[%W]", at + 1) then  -- not the end of a loop
      chunk = load(code:sub(1, at) .. " return " .. code:sub(at + 1), "=example", "t", env)
      if chunk then return chunk end
    end
  end
  return load(code, "=example", "t", env)
end

-- An example as it would be typed: every statement on a line of its own, the last value without return.
function typed_example(example)
  local out, rest = {}, example
  local at = 1
  while true do
    local first, last = rest:find(";?[ ;][ ]+", at)
    if not first then break end
    local before, after = rest:sub(1, first - 1), rest:sub(last + 1)
    if not before:find "\n%s*$" and not after:find "^%-%-" and load(before) and compiled_example(after) then
      out[#out + 1], rest, at = before, after, 1
    else
      at = last + 1
    end
  end
  out[#out + 1] = rest
  return (("\n" .. table.concat(out, "\n")):gsub("\nreturn ", "\n"):sub(2))
end

-- The example of a row that has none of its own: a value of its type shows a field, what print says, the
-- length, or a method without arguments.
function shown_by_specimen(row)
  local specimen = row.owner and specimens[row.owner]
  if not specimen or row.sig == "" then return end
  local shows = row.separator == "#" and "%s." .. row.member or row.member == "__tostring" and "%s"
    or row.member == "__len" and "#%s" or row.sig:find("()", 1, true) and "%s:" .. row.member .. "()"
  if not shows then return end
  row.by_specimen = shows:format(specimen[1])
  row.example = specimen[2]:gsub("%s*$", "\n") .. "return " .. row.by_specimen
end
