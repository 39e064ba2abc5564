-- The sheet that help() writes on: lines as wide as the screen, pairs in columns, entries, examples.

-- Lines are collected and shown together: what is longer than the screen is shown a screen at a time.
local collected = {}
local function say(line) collected[#collected + 1] = line or "" end

local function show()
  local text = table.concat(collected, "\n")
  collected = {}
  if screen_width() == 0 then print(text) else page(text .. "\n") end
end

-- Runs a page and shows what it says; what was said before an error is dropped.
local function shown_page(f, ...)
  collected = {}
  f(...)
  show()
end

local page_width = 96  -- of a page that goes into a file or a pipe

local function columns()
  local screen = screen_width()
  return screen == 0 and page_width or math.max(30, math.min(screen, 110))
end

local function pad(s, columns) return s .. (" "):rep(columns - width(s)) end

-- Words of `s` in lines of at most `columns`.
local function wrapped(s, columns)
  local lines, line = {}, ""
  for word in s:gmatch "%S+" do
    if line ~= "" and width(line) + 1 + width(word) > columns then
      lines[#lines + 1] = line
      line = word
    else
      line = line == "" and word or line .. " " .. word
    end
  end
  lines[#lines + 1] = line
  return lines
end

-- Two columns: { left, right } pairs, the right one wrapped. Wide left cells get a line of their own, and
-- in a narrow window all of them.
local function print_pairs(pairs_list, indent)
  local narrow, left_width = columns() < 60, 0
  for _, pair in ipairs(pairs_list) do
    local w = width(pair[1])
    if w <= 36 and not narrow then left_width = math.max(left_width, w) end
  end
  if narrow then left_width = 2 end
  local margin = (" "):rep(indent)
  for _, pair in ipairs(pairs_list) do
    local lines = wrapped(pair[2], columns() - indent - left_width - 2)
    local left = pair[1]
    if width(left) > left_width then
      say(margin .. left)
      left = ""
    end
    for i, line in ipairs(lines) do
      local text = margin .. pad(i == 1 and left or "", left_width) .. "  " .. line
      say((text:gsub("%s+$", "")))
    end
  end
end

local function first_sentence(text) return (text:match "^(.-[.!?])%s" or text):gsub("%s+", " ") end

-- Where a line of code is broken: behind a comma of its second half, else at its last blank; nil: nowhere.
local function place_of_break(line, columns)
  for _, mark in ipairs { ", ()", " ()" } do
    local at
    for stop in line:gmatch(mark) do
      local before = line:sub(1, stop - 2)
      if width(before) <= columns and (width(before) > columns/2 or mark == " ()") then at = stop end
    end
    if at and line:sub(1, at - 1):find "%S" then return at end
  end
end

-- A line of code in lines of at most `columns`; a comment that does not fit beside it stands above.
local function code_lines(line, columns)
  local lines, margin = {}, line:match "^ *"
  local code, comment = line:match "^(.-)%s*%-%-%s(.*)$"
  if code and width(line) > columns then
    for _, part in ipairs(wrapped(comment, columns - #margin - 3)) do
      lines[#lines + 1] = margin .. "-- " .. part
    end
    line = code
  end
  margin = margin .. "    "
  while width(line) > columns do
    local at = place_of_break(line, columns)
    if not at then break end
    lines[#lines + 1] = line:sub(1, at - 2)
    line = margin .. line:sub(at)
  end
  if line:find "%S" then lines[#lines + 1] = line end
  return lines
end

local function print_example(entry, indent)
  local margin = (" "):rep(indent)
  for line in typed_example(entry.example):gmatch "[^\n]+" do
    for _, part in ipairs(code_lines(line, columns() - indent - 2)) do say(margin .. "> " .. part) end
  end
  for line in entry.gives:gmatch "[^\n]+" do say(margin .. line) end
end

-- The words that an option can be: "acc|ggl" as \"acc\", \"ggl\".
local function choices(option)
  if option.values == "" or option.values:sub(1, 1) == "@" or option.type == "boolean" then return "" end
  return ': "' .. option.values:gsub("|", '", "') .. '"'
end

-- name = default   meaning (type): one row per option.
local function print_options(entry)
  local rows = {}
  for _, option in ipairs(entry.options) do
    local name = option.name:find "^%d" and ("argument " .. option.name) or option.name
    if option.default ~= "" then name = name .. " = " .. option.default end
    rows[#rows + 1] = { name, option.text .. choices(option) .. " (" .. option.type .. ")" }
  end
  say("  options")
  print_pairs(rows, 4)
end

-- A page about a word: what it means, an example, what to read next.
local function print_concept(page)
  say(page.name)
  for _, line in ipairs(wrapped(page.text, columns() - 2)) do say("  " .. line) end
  print_example(page, 4)
  local names = {}
  for name in page.see:gmatch "%S+" do names[#names + 1] = ('help "%s"'):format(name) end
  for _, line in ipairs(wrapped("See also " .. table.concat(names, ", ") .. ".", columns() - 2)) do
    say("  " .. line)
  end
end

local function print_entry(entry)
  if entry.is_concept then return print_concept(entry) end
  for i, line in ipairs(wrapped(entry.sig ~= "" and entry.sig or entry.name, columns() - 4)) do
    say((i > 1 and "    " or "") .. line)
  end
  for _, line in ipairs(wrapped(entry.text, columns() - 2)) do say("  " .. line) end
  if entry.options then print_options(entry) end
  if entry.example ~= "" then print_example(entry, 4) end
end

-- One line per entry: signature and first sentence.
local function print_list(list)
  local lines = {}
  for _, entry in ipairs(list) do
    lines[#lines + 1] = { entry.sig ~= "" and entry.sig or entry.name, first_sentence(entry.text) }
  end
  print_pairs(lines, 2)
end

return {
  say = say, shown_page = shown_page, columns = columns, wrapped = wrapped, print_pairs = print_pairs,
  print_concept = print_concept, print_entry = print_entry, print_list = print_list,
  print_example = print_example, show = show
}
