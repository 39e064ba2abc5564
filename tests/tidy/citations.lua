-- What is cited exists, and every derivation is cited: sections of docs/, files named in docs/, functions
-- named in docs/architecture.md.
-- Nothing outside of the repository is cited but books and papers.
local source, findings = require "source", require "findings"
local report, lines = findings.report, source.lines
local citations = {}

-- The anchors of a Markdown file: <a id="name">, and headings as GitHub links them.
local function anchors(text)
  local known = {}
  for id in text:gmatch '<a%s+[idname]+="([^"]+)"' do known[id] = true end
  for _, line in lines(text) do
    local title = line:match "^#+%s+(.-)%s*$"
    if title then known[title:lower():gsub("[^%w%-_ \128-\255]", ""):gsub(" ", "-")] = true end
  end
  return known
end

local pages = {}                                             -- docs/x.md -> its anchors, or false
local function anchors_of(page)
  if pages[page] == nil then
    local text = source.read(page)
    pages[page] = text and anchors(text)
  end
  return pages[page]
end

local cited = {}                                             -- sections of docs/derivations.md

--- docs/page.md and docs/page.md#section in any text.
function citations.check_sections(file, text)
  if file:find "^tests/tidy" then return end
  if file:find "^src/" or file:find "^stdlib/" then
    for list in text:gmatch "derivations%.md(#[%w-]+[^\n]*)" do
      for section in list:gmatch "#([%w-]+)" do cited[section] = true end
    end
  end
  for number, line in lines(text) do
    if line:find("docs/", 1, true) then
      for page, rest in line:gmatch "%f[%w](docs/[%w_/-]+%.md)([^%s%)%]},;\"'`]*)" do
        local known = anchors_of(page)
        local anchor = rest:match "^#(.-)[.:]*$"
        if not known then
          report(file, number, page .. " does not exist")
        elseif anchor and not known[anchor] then
          report(file, number, page .. " has no anchor #" .. anchor)
        end
      end
    end
  end
end

--- Every derivation has a source that relies on it. To be called after all check_sections().
function citations.check_derivations(text)
  for number, line in lines(text) do
    local title = line:match "^## (.-)%s*$"
    local anchor = title and title:lower():gsub(" ", "-")
    if title and not cited[anchor] then
      report("docs/derivations.md", number, "no source cites this section, " .. anchor)
    end
  end
end

local outside = {
  "LANGUAGE%.md", "DESIGN%.md", "STYLE%.md", "BENCHMARKS%.md", "ERRATA%.md", "exam%.md", "%f[%w][Ee]xam %(%d",
  "of the exam %(", "[^%w]issue #?%d", "%f[%w]exam formula", "%f[%w]exam problem [%d]",
}

--- Documents that are not in the repository.
function citations.check_outside(file, text)
  if file:find "^tests/tidy" or file:find "^scripts/exam/" then return end
  for _, pattern in ipairs(outside) do
    if text:find(pattern) then
      for number, line in lines(text) do
        local found = line:match(pattern)
        if found then report(file, number, "cites what is not in the repository: " .. found) end
      end
    end
  end
end

local tops = " src stdlib tests scripts bench docs cmake base expr dae mech codegen method integrate lab lti "
  .. "sysid plot lua shell "

--- Files named between backticks in a Markdown file: `dae/rank/rank`, `tests/tidy.lua`, `src/lua/core/`.
function citations.check_paths(file, text, exists)
  for number, line in lines(text) do
    for token in line:gmatch "`([%w_./-]+)`" do
      local top = token:match "^([%w_]+)/[%w_]"
      if top and tops:find(" " .. top .. " ", 1, true) and not exists(token) then
        report(file, number, "names a file that does not exist: " .. token)
      end
    end
  end
end

--- Functions and types named between backticks in docs/architecture.md occur in the code.
function citations.check_names(file, text, words)
  for number, line in lines(text) do
    for token in line:gmatch "`([%a_][%w_:.]*)%(?%)?`" do
      local name = token:match "[%w_]+$"
      if name and not words[name] then report(file, number, "names what does not exist: " .. token) end
    end
  end
end

return citations
