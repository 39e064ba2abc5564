-- Searching the documentation: apropos, and help with several words.

-- How well an entry fits a word: its name, a word of its name, of its signature, of its text, a part of a
-- word.
local function rank(entry, word)
  local whole = "%f[%w_]" .. word:gsub("%W", "%%%0") .. "%f[^%w_]"
  local name = entry.name:lower()
  if name == word then return 1 end
  if name:find(whole) or (entry.words or ""):lower():find(whole) then return 2 end
  if entry.sig:lower():find(whole) then return 3 end
  if entry.text:lower():find(whole) then return 4 end
  if (name .. "\n" .. entry.sig .. "\n" .. entry.text):lower():find(word, 1, true) then return 5 end
end

-- Words of a question that say nothing.
local empty_words = {}
for word in ("a an the of to in on for and or is are i how do does can what why with my it"):gmatch "%S+" do
  empty_words[word] = true
end

-- The entries that fit most of the words, best first, in the order of the documentation among equals.
return function(text)
  local words = {}
  for word in text:lower():gmatch "[%w_'.:]+" do
    if not empty_words[word] then words[#words + 1] = word end
  end
  local found = {}
  for place, entry in ipairs(entries()) do
    local fits, sum, partial = 0, 0, false
    for _, word in ipairs(words) do
      local own = rank(entry, word)
      if own then
        fits = fits + 1
        sum = sum + own
        partial = partial or own == 5
      end
    end
    if fits > 0 and not entry.name:find(":__", 1, true) then
      found[#found + 1] = { entry = entry, key = { -fits, sum + (entry.is_concept and -0.5 or 0), place },
        partial = partial }
    end
  end
  local most, whole = #found > 0 and math.huge or 0, false
  for _, each in ipairs(found) do most = math.min(most, each.key[1]) end
  for _, each in ipairs(found) do whole = whole or each.key[1] == most and not each.partial end
  table.sort(found, function(a, b)
    for k = 1, 3 do
      if a.key[k] ~= b.key[k] then return a.key[k] < b.key[k] end
    end
    return false
  end)
  local list = {}
  for _, each in ipairs(found) do
    if each.key[1] == most and not (whole and each.partial) then list[#list + 1] = each.entry end
  end
  return list
end
