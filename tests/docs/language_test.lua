-- The examples of docs/language.md are true: its lua blocks run one after another, like a session, and what a
-- print writes is what the comment `--> text` behind it says: its values between
-- semicolons, on one line, numbers with six digits.
local root = os.getenv "PENDULA_ROOT" or "."
local page = "docs/language.md"

local function blocks_of(text)
  local blocks, block, number = {}, nil, 0
  for line in text:gmatch "([^\n]*)\n" do
    number = number + 1
    if line:match "^```" then
      if block then blocks[#blocks + 1] = block end
      block = not block and line == "```lua" and { first = number + 1, lines = {} } or nil
    elseif block then
      block.lines[#block.lines + 1] = line
    end
  end
  return blocks
end

local printed
local session = setmetatable({
  print = function(...)
    local words = table.pack(...)
    for i = 1, words.n do
      local word = math.type(words[i]) == "float" and ("%.6g"):format(words[i]) or tostring(words[i])
      words[i] = word:gsub("%s+", " "):gsub("^ ", ""):gsub(" $", "")
    end
    printed[#printed + 1] = table.concat(words, "; ")
  end,
}, { __index = _G })

local handle = assert(io.open(root .. "/" .. page))
local text = handle:read "a"
handle:close()

for _, block in ipairs(blocks_of(text)) do
  test(("%s, line %d"):format(page, block.first), function()
    printed = {}
    local code = ("\n"):rep(block.first - 1) .. table.concat(block.lines, "\n")
    assert(load(code, "@" .. page, "t", session))()
    local said = {}
    for _, line in ipairs(block.lines) do said[#said + 1] = line:match "%-%-> (.*)$" end
    for i = 1, math.max(#said, #printed) do
      expect(printed[i] or "nothing was printed"):equals(said[i] or "no comment says what is printed")
    end
    expect(true):equals(true)
  end)
end
