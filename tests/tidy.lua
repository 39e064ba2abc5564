-- tests/tidy.lua — the style that matters is a test: who may include whom, how long things get, what is left
-- behind. One line per finding, 'file:line: message'; exit status 1 when there is one. By hand:
-- lua5.4 tests/tidy.lua
package.path = (arg[0]:match "^(.*)/[^/]*$" or ".") .. "/tidy/?.lua;" .. package.path
local source, findings = require "source", require "findings"
local architecture, lengths = require "architecture", require "lengths"
local statements, citations = require "statements", require "citations"
local together = require "together"
require "examples"

local written = { [""] = true }                         -- endings of what we write; data and figures are free
for ending in ("cpp hpp def lua py sh md txt json 1 in cmake"):gmatch "%w+" do written[ending] = true end
local interactive = {}                                  -- scripts without .out: ["scripts/x.lua"] = "why"

local sources, bares, words = {}, {}, {}
for _, file in ipairs(source.files("src tests bench", "*.cpp", "*.hpp", "*.def")) do
  local text = source.read(file)
  local bare = source.code(text, "cpp")
  sources[file] = text
  if file:find "%.hpp$" and not text:find "#pragma once" then findings.report(file, 1, "no #pragma once") end
  for word in text:gmatch "[%a_][%w_]*" do words[word] = true end
  if file:find "^src/" then
    architecture.check_file(file, text, bare)
    lengths.check_cpp_functions(file, bare)
    lengths.check_classes(file, bare)
    statements.check_commas(file, bare)
    statements.check_casts(file, bare)
    statements.check_torn_strings(file, text)
  end
  if not file:find "%.def$" then bares[file] = bare end
end
statements.check_unused(bares, sources)
together.check(bares)
statements.check_type_names(sources)
architecture.check_all(sources)

for _, file in ipairs(source.files("stdlib tests", "*.lua")) do
  lengths.check_lua_functions(file, source.read(file))
end

local function exists(path)
  for _, prefix in ipairs { "", "src/" } do
    for _, ending in ipairs { "", ".hpp", ".cpp", ".lua", ".def" } do
      local handle = io.open(source.root .. "/" .. prefix .. path .. ending)
      if handle then handle:close() return true end
    end
  end
  return false
end

local pages = {}
for _, file in ipairs(source.files("src stdlib scripts tests bench docs cmake dev .ci *.md CMake*", "*")) do
  if written[file:match "%.(%w+)$" or ""] then
    local text = source.read(file)
    lengths.check_text(file, text)
    citations.check_sections(file, text)
    citations.check_outside(file, text)
    if file:find "%.md$" then pages[file] = text end
    if file:find "^stdlib/" then
      for word in text:gmatch "[%a_][%w_]*" do words[word] = true end
    end
  end
end
for file, text in pairs(pages) do citations.check_paths(file, text, exists) end
if pages["docs/derivations.md"] then citations.check_derivations(pages["docs/derivations.md"]) end
if pages["docs/architecture.md"] then
  citations.check_names("docs/architecture.md", pages["docs/architecture.md"], words)
end

for _, file in ipairs(source.files("scripts", "*.lua")) do
  -- scripts/grading is a course: tests/shell/grade_test.py holds its report.
  local graded = file:find "^scripts/grading/" ~= nil
  if not interactive[file] and not graded and not source.read((file:gsub("lua$", "out"))) then
    findings.report(file, 1, "no expected output beside it: SNAP_UPDATE=1 tests/scripts.sh " .. file)
  end
end

-- The top level is the README's tree; scripts that are run there leave figures and data behind.
local top = { ["CMakeLists.txt"] = true, ["CMakePresets.json"] = true, dev = true }
for file in io.popen("git -C '" .. source.root .. "' ls-files 2>/dev/null"):lines() do
  local stray = not file:find "/" and not file:find "^%." and not file:find "^%u+%.md$" and not top[file]
  if stray then findings.report(file, 1, "does not belong to the top level") end
end

if findings.number > 0 then print(findings.number .. " findings") end
os.exit(findings.number == 0)
