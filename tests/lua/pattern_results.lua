-- Prints the results of find, match, gsub and gmatch for random patterns: patterns_test.py compares two
-- programs.
local seed = 7
local function r(n) seed = (seed * 1103515245 + 12345) % 2147483648 return (seed >> 8) % n + 1 end
local atoms = { "a","b","c",".","%a","%d","%s","[ab]","[^ab]","[a-c]","%w","%.","x"," ","%%","[%a_]","[]]",
  "[^]]","%S","%A","%x","%p" }
local reps = { "","","","*","+","-","?" }
local function pattern()
  local p = r(8) == 1 and "^" or ""
  local open = 0
  for _ = 1, r(6) do
    local k = r(14)
    if k == 1 then p = p .. "(" open = open + 1
    elseif k == 2 and open > 0 then p = p .. ")" open = open - 1
    elseif k == 3 then p = p .. "%b()"
    elseif k == 4 then p = p .. "%f[%a]"
    elseif k == 5 then p = p .. "()"
    elseif k == 6 then p = p .. "%1"
    elseif k == 7 and r(6) == 1 then p = p .. ({ "[", "%", "%b", "%f", "[^", ")", "%9", "[a-" })[r(8)]
    else p = p .. atoms[r(#atoms)] .. reps[r(#reps)] end
  end
  for _ = 1, open do if r(5) > 1 then p = p .. ")" end end
  return p .. (r(6) == 1 and "$" or "")
end
local chars = { "a","b","c","x","1","2"," ","(",")",".","%","_","\0","é","]","-","A" }
local function subject()
  local t = {} for i = 1, r(14) - 1 do t[i] = chars[r(#chars)] end return table.concat(t)
end
local news = { "<%0>", "%1%1", "x", "", "%%", "%2", "%", "%a" }
local function show(ok, ...)
  local t = { tostring(ok) } for i = 1, select("#",
    ...) do t[#t + 1] = tostring((select(i, ...))) end local s = table.concat(t, "|")
    return (s:gsub("^false|.-:%d+: ", "false|"))
end
for _ = 1, tonumber(arg[1]) or 0 do
  local p, s = pattern(), subject()
  local init = r(5) == 1 and r(20) - 10 or nil
  io.write(("%q %q"):format(p, s), " ", show(pcall(string.find, s, p, init)), " ",
    show(pcall(string.match, s, p, init)), " ",
    show(pcall(string.gsub, s, p, news[r(#news)], r(4) == 1 and r(4) - 1 or nil)), " ",
      show(pcall(string.gsub, s, p, function(a) return r(3) == 1 and nil or "<" .. tostring(a) .. ">" end)),
      " ",
    show(pcall(function() local t = {} for a,
      b in s:gmatch(p) do t[#t + 1] = tostring(a) .. "," .. tostring(b) if #t > 30 then break end end
      return table.concat(t, ";") end)), "\n")
end
