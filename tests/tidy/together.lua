-- Files of a folder are compiled together (pendula_unity in CMakeLists.txt), so what one keeps to itself
-- must not have the name of what another one beside it keeps to itself.
local source, findings = require "source", require "findings"
local together = {}

-- What a line at the left margin defines: a constant, a type, or a function with its parameters (overloads
-- are legal).
local function defined_by(line)
  local head = line:gsub("%[%[.-%]%]%s*", ""):gsub("^inline ", "")
  local constant = head:match "^const[%w_:%s*<>,&]-([%w_]+)%s*[%[={]"
  if constant and not head:find "^const[^=]*%(" then return constant end
  local kind = head:match "^struct ([%w_]+) [{:]" or head:match "^class ([%w_]+) [{:]"
    or head:match "^enum class ([%w_]+)"
  if kind then return kind end
  local before, name, parameters = head:match "^([%a][%w_:<>,&*%s]-[%s&*])([%w_]+)(%b())"
  if name and not before:find "^return" then
    return name .. parameters:gsub("%s+[%w_]+%s*([,)])", "%1"):gsub("([&*])[%w_]+%s*([,)])", "%1%2")
  end
end

-- What follows an anonymous namespace is declared in headers, and unique by itself.
local function check_file(file, bare, seen)
  local inside = false
  for number, line in source.lines(bare) do
    inside = inside or line:find "^namespace {" ~= nil
    local name = inside and defined_by(line)
    if name and seen[name] and seen[name] ~= file then
      findings.report(file, number, name .. " is defined in " .. seen[name]
        .. " too, and both are compiled together: share it, or choose another name")
    elseif name then
      seen[name] = file
    end
  end
end

--- bares: [file] = text without comments and strings.
function together.check(bares)
  local files, folders = {}, {}
  for file in pairs(bares) do files[#files + 1] = file end
  table.sort(files)
  for _, file in ipairs(files) do
    if file:find "^src/.*%.cpp$" then
      local folder = file:match "^(.*)/"
      folders[folder] = folders[folder] or {}
      check_file(file, bares[file], folders[folder])
    end
  end
end

return together
