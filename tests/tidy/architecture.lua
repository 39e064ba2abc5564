-- Who may include whom. A folder may include whatever its arrows reach; `shell` stops at its arrows: it sees
-- the core through lua.
local source, findings = require "source", require "findings"
local report = findings.report
local architecture = {}

-- Between layers, and between the folders of a layer, from the block "arrows" of docs/architecture.md.
local layers, folders = {}, {}
for line in source.read("docs/architecture.md"):match("```arrows\n(.-)```"):gmatch "[^\n]+" do
  local name, targets = line:match "^%S+", line:match "→%s*(.-)%s*$" or ""
  local layer, folder = name:match "^([^/]+)/(.*)$"
  if layer then
    folders[layer] = folders[layer] or {}
    folders[layer][folder == "." and "" or folder] = targets
  else
    layers[name] = targets
  end
end

-- The other layers never write to the terminal.
local prints = { plot = true, lua = true, shell = true, kernel = true }
local most_files = 30

-- What `name` reaches along `arrows`, itself included. A cycle in the table is an error of the table.
local function reach(arrows, name, stops, into, path)
  assert(not path[name], "docs/architecture.md: the arrows from '" .. name .. "' form a cycle")
  into[name] = true
  path[name] = true
  for to in (arrows[name] or ""):gmatch "%S+" do
    to = to == "." and "" or to                              -- the files of the layer itself
    if stops then into[to] = true else reach(arrows, to, stops, into, path) end
  end
  path[name] = nil
  return into
end

local function split(path)                                   -- "dae/rank/rank.hpp" -> "dae", "rank"
  local folder = path:match "^(.*)/[^/]*$" or ""
  return folder:match "^[^/]+" or folder, folder:match "^[^/]+/(.*)$" or ""
end

local function check_prints(file, bare)
  for number, line in source.lines(bare) do
    local call = line:match "%f[%w_]f?printf%s*%(" or line:match "%f[%w_]f?puts%s*%("
      or line:match "std::c[oe][ur][tr]%f[%W]"
    if call then report(file, number, "a numerical layer does not print: " .. call) end
  end
end

function architecture.check_file(file, text, bare)
  local layer, folder = split(file:sub(#"src/" + 1))
  if not layers[layer] then return report(file, 1, "belongs to no layer of docs/architecture.md") end
  local inner = folders[layer] or { [""] = "" }
  local lone = file:find "%.def$"
  if not inner[folder] and not lone then
    return report(file, 1, "belongs to no folder of docs/architecture.md")
  end
  local may = reach(layers, layer, layer == "shell", {}, {})
  local within = not lone and reach(inner, folder, false, {}, {})
  for number, line in source.lines(text) do
    local path = line:match '^%s*#%s*include%s+"([%w_/.]+)"'
    if path and path:find "^%.%.?/" then report(file, number, "includes are written from src") end
    if path and path:find "/" then
      local to, into = split(path)
      if not may[to] then report(file, number, layer .. " may not know " .. to) end
      if to == layer and within and not within[into] and not path:find "%.def$" then
        report(file, number, ("breaks the order of folders: %s/%s -> %s/%s"):format(layer, folder, to, into))
      end
    end
  end
  if not prints[layer] then check_prints(file, bare) end
end

-- A .cpp implements the header of its name, `part.hpp` beside it if it is called part_something.cpp, the only
-- header beside it that it includes, or of several the one it includes first. Files of lua/bind implement a
-- row of modules.cpp.
local function check_header_of(file, text, sources)
  local folder, name = file:match "^src/(.*)/([^/]*)%.cpp$"
  if name == "main" or folder:find "^lua/bind" then return end
  local stem = name
  repeat
    if sources[("src/%s/%s.hpp"):format(folder, stem)] then return end
    stem = stem:match "^(.*)_[^_]*$"
  until not stem
  local first, beside = text:match '#include "([^"]+)"', 0
  for path in text:gmatch '#include "([^"]+)/[^/"]*"' do
    if path == folder then beside = beside + 1 end
  end
  if beside == 1 or (first and first:match "^(.*)/[^/]*$" == folder) then return end
  report(file, 1,
    "implements which header? None has its name; include the one beside it that it implements first")
end

-- The tree in README.md names every layer and every folder of it.
local function check_readme()
  local text = source.read "README.md"
  for layer in pairs(layers) do
    local row = text:match("\n| `src/" .. layer .. "` |([^\n]*)")
    if not row then report("README.md", 1, "the tree does not name src/" .. layer) end
    for folder in pairs(row and folders[layer] or {}) do
      local name = folder:match "^[^/]*"
      if name ~= "" and not row:find("`" .. name .. "`", 1, true) then
        report("README.md", 1, ("the tree does not name src/%s/%s"):format(layer, name))
      end
    end
  end
end

-- The table of folders in docs/architecture.md has a row for every folder, or one for its layer that may name
-- it: `exact`. lua/bind is one row.
local function check_folder_table()
  local file = "docs/architecture.md"
  local text = source.read(file)
  for layer, arrows in pairs(folders) do
    local of_layer = text:match("\n| `src/" .. layer .. "` |([^\n]*)") or ""
    for folder in pairs(arrows) do
      local parent, name = folder:match "^(.*)/([^/]*)$"
      local of_parent = parent and text:match("\n| `src/" .. layer .. "/" .. parent .. "` |([^\n]*)") or ""
      local known = folder == "" or text:find("\n| `src/" .. layer .. "/" .. folder .. "` |", 1, true)
        or (of_layer .. of_parent):find("`" .. (name or folder) .. "`", 1, true) or parent == "bind"
      if not known then report(file, 1, ("no row says what src/%s/%s is for"):format(layer, folder)) end
    end
  end
end

-- One header of a folder begins with some lines on what the folder is for.
local function check_lectures(sources)
  local most = {}
  for file, text in pairs(sources) do
    local folder = file:match "^(src/.*)/[^/]*%.[ch]pp$"
    if folder then
      local head = file:find "%.hpp$" and ("\n" .. text):match "^[\n/][^#]*" or ""
      local _, count = head:gsub("\n//", "")
      most[folder] = math.max(most[folder] or 0, count)
    end
  end
  for folder, count in pairs(most) do
    if count < 5 then report(folder, 1, "no header here says in five lines or more what the folder is for") end
  end
end

--- Folders that are too full, files that nobody includes, the tree in README.md.
function architecture.check_all(sources)
  check_readme()
  check_folder_table()
  check_lectures(sources)
  local included, full = {}, {}
  for file, text in pairs(sources) do
    for path in text:gmatch '#%s*include%s+"([^"]+)"' do included["src/" .. path] = true end
    if file:find "^src/.*%.cpp$" then check_header_of(file, text, sources) end
    local folder = file:match "^(src/.*)/[^/]*$"
    if folder then full[folder] = (full[folder] or 0) + 1 end
  end
  for file in pairs(sources) do
    if file:find "^src/.*%.[hd][pe][pf]$" and not included[file] then
      report(file, 1, "nothing includes this file")
    end
  end
  for folder, number in pairs(full) do
    if number > most_files then
      report(folder, 1,
        ("%d files; the ceiling is %d: divide the folder"):format(number, most_files))
    end
  end
end

return architecture
