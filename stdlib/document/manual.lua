-- pendula manual: the manual as a folder of pages, made of the Markdown pages inside the program and the
-- rows of the documentation. Their examples run while the pages are made; what they show stands below them.
local text, code, markdown = document.text, document.code, document.markdown
local page, session = document.page, document.session

local usage = [[
usage: pendula manual [-o FOLDER]
       pendula manual --luals [-o FILE]

Opens the manual in the browser; it is made when it is opened for the first time.

  -o FOLDER   makes it in this folder instead
  --luals     writes the vocabulary for the Lua language server, by which editors complete and explain names
]]

-- Pages in the order of the navigation: file, title, source; those without a source are made here.
local pages = {
  { "index", "Pendula", "docs/manual/index.md" },
  { "tutorial", "Tutorial", "docs/manual/tutorial.md" },
  { "concepts", "Concepts", "docs/manual/concepts.md" },
  { "control", "Control", "docs/manual/control.md" },
  { "identification", "Identification", "docs/manual/identification.md" },
  { "cookbook", "Cookbook", "docs/manual/cookbook.md" },
  { "gallery", "Gallery", "docs/manual/gallery.md" },
  { "coming-from", "Coming from …", "docs/manual/coming-from.md" },
  { "language", "The language", "docs/language.md", shown_only = true },
  { "reference", "Reference" },
  { "glossary", "Glossary", "docs/glossary.md" },
  { "derivations", "Derivations", "docs/derivations.md" },
}

local by_source = {}
for _, each in ipairs(pages) do
  if each[3] then by_source[each[3]:match "[^/]*$"] = each[1] .. ".html" end
end

local build                                          -- what is being built: folder, found, problems

-- ── frame ──────────────────────────────────────────────────────────────────────────────────────────────────

local function navigation(current)
  local out = {}
  for _, each in ipairs(pages) do
    local mark = each[1] == current and ' aria-current="page"' or ""
    out[#out + 1] = ('<li><a href="%s.html"%s>%s</a></li>'):format(each[1], mark, text.escaped(each[2]))
  end
  return "<ul>" .. table.concat(out) .. "</ul>"
end

local template = [[
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{title}</title>
<link rel="stylesheet" href="page.css">
<link rel="stylesheet" href="manual.css">
</head>
<body>
<a class="skip" href="#content">To the text</a>
<header>
<nav aria-label="Pages">{navigation}</nav>
<form role="search" id="search"><label for="words">Search</label>
<input id="words" type="search" autocomplete="off"><ul id="found" aria-live="polite"></ul></form>
</header>
<main id="content" tabindex="-1">
{body}
</main>
<script src="index.js"></script>
<script src="manual.js"></script>
<script src="page.js"></script>
</body>
</html>
]]

local function write_page(file, title, body)
  local parts = { title = text.escaped(title == "Pendula" and title or title .. " – Pendula"), body = body,
    navigation = navigation(file) }
  write_file(build.folder .. "/" .. file .. ".html", (template:gsub("{(%l+)}", parts)), "manual")
end

local function note(title, words, address) table.insert(build.found, { title, words, address }) end

-- ── pages of Markdown ──────────────────────────────────────────────────────────────────────────────────────

local function resolve(target)
  if target:find "^%a[%w+.-]*:" or target:find "^#" then return target end
  local file, anchor = target:match "^([^#]*)(#?.*)$"
  local known = by_source[file:match "[^/]*$"]
  return known and known .. anchor or file:find "%.html$" and target or nil
end

local function run_blocks(own, place)
  return function(language, source)
    if language ~= "lua" or own.shown_only then return nil end
    local block = place.session.count + 1
    local problem, stopped = place.session:run(source, "=" .. own[1])
    if stopped then error(problem, 0) end
    if problem then table.insert(build.problems, own[1] .. ": " .. problem) end
    return ('<pre class="code" tabindex="0"><code>%s</code></pre>\0%d\0'):format(code.highlighted(source),
      block)
  end
end

local function markdown_page(own)
  local place = { session = session.new() }
  local html = markdown.html(embedded(own[3]), { link = resolve, code = run_blocks(own, place),
    heading = function(level, title, id)
      if level <= 3 then note(title, own[2], own[1] .. ".html#" .. id) end
    end })
  place.session:close()
  local record = place.session.record
  local drawn = record:drawings()
  html = html:gsub("\0(%d+)\0", function(i)
    local shows = record:html(tonumber(i), drawn)
    return shows ~= "" and '\n<section class="output">' .. shows .. "</section>" or ""
  end)
  write_page(own[1], own[2], html)
end

-- ── reference ──────────────────────────────────────────────────────────────────────────────────────────────

local function module_file(name) return "ref-" .. name:gsub("%W+", "-"):lower() end

local function is_hidden(entry) return entry.sig == "" end

-- The entries of each module, in order.
local function modules()
  local list, named = {}, {}
  for _, entry in ipairs(entries()) do
    local key = module_file(entry.module)              -- modules that differ in case only share a page
    local own = named[key]
    if not own then
      own = { name = entry.module, title = entry.title ~= "" and entry.title or entry.module, entries = {} }
      named[key] = own
      list[#list + 1] = own
    end
    if own.title == own.name and entry.title ~= "" then own.title = entry.title end
    if not is_hidden(entry) then own.entries[#own.entries + 1] = entry end
  end
  return list
end

local function example_html(entry, record, drawn, number)
  local shows = number and record:html(number, drawn) or ""
  local output = shows ~= "" and '<section class="output">' .. shows .. "</section>" or ""
  return '<pre class="code" tabindex="0"><code>' .. code.highlighted(entry.example) .. "</code></pre>"
    .. output
end

-- Runs the examples of a module, each in a session of its own but with one record, so that figures are
-- drawn at once.
local function run_examples(module)
  local record = document.recording.new()
  local numbers = {}
  for i, entry in ipairs(module.entries) do
    if entry.example ~= "" then
      local own = session.new()
      own.record, own.count = record, i - 1
      local problem, stopped = own:run(entry.example, "=" .. entry.name)
      own:close()
      if stopped then error(problem, 0) end
      if problem then table.insert(build.problems, entry.name .. ": " .. problem) end
      numbers[entry] = i
    end
  end
  return record, numbers
end

local function options_html(entry)
  if not entry.options or #entry.options == 0 then return "" end
  local out = {}
  for _, option in ipairs(entry.options) do
    local default = option.default ~= "" and " = " .. option.default or ""
    local choices = option.values:find "^[^@]" and ' "' .. option.values:gsub("|", '", "') .. '"' or ""
    out[#out + 1] = ("<tr><th><code>%s</code></th><td>%s (%s)</td></tr>"):format(
      text.escaped(option.name .. default), text.escaped(option.text .. choices), text.escaped(option.type))
  end
  return '<details><summary>options</summary><table class="facts">' .. table.concat(out)
    .. "</table></details>"
end

local function entry_html(entry, record, drawn, number)
  local example = entry.example ~= "" and example_html(entry, record, drawn, number) or ""
  return ('<section class="entry" id="%s"><h2><code>%s</code></h2><p>%s</p>%s%s</section>'):format(
    text.escaped(entry.name), text.escaped(entry.sig), text.escaped(entry.text), options_html(entry), example)
end

local function module_page(module)
  local record, numbers = run_examples(module)
  local drawn = record:drawings()
  local out = { "<h1>" .. text.escaped(module.title) .. "</h1>", '<ul class="names">' }
  for _, entry in ipairs(module.entries) do
    out[#out + 1] = ('<li><a href="#%s">%s</a></li>'):format(text.escaped(entry.name),
      text.escaped(entry.name))
    note(entry.name, entry.sig .. " " .. entry.text:match "^[^.]*",
      module_file(module.name) .. ".html#" .. entry.name)
  end
  out[#out + 1] = "</ul>"
  for _, entry in ipairs(module.entries) do
    out[#out + 1] = entry_html(entry, record, drawn, numbers[entry])
  end
  write_page(module_file(module.name), module.title, table.concat(out, "\n"))
end

local function reference_page(list)
  local out = { "<h1>Reference</h1><p>Every function, value and member, by subject. At the prompt "
    .. "<code>help \"name\"</code> says the same.</p>" }
  for _, module in ipairs(list) do
    local file = module_file(module.name) .. ".html"
    out[#out + 1] = ('<h2><a href="%s">%s</a></h2><ul class="names">'):format(file,
      text.escaped(module.title))
    for _, entry in ipairs(module.entries) do
      out[#out + 1] = ('<li><a href="%s#%s">%s</a></li>'):format(file, text.escaped(entry.name),
        text.escaped(entry.name))
    end
    out[#out + 1] = "</ul>"
  end
  write_page("reference", "Reference", table.concat(out, "\n"))
end

-- ── the folder ─────────────────────────────────────────────────────────────────────────────────────────────

local function json(words)
  local escapes = { ['"'] = '\\"', ["\\"] = "\\\\", ["\n"] = "\\n", ["<"] = "\\u003c" }
  return '"' .. text.valid(words):gsub('["\\\n<]', escapes) .. '"'
end

local function write_index()
  local lines = {}
  for _, each in ipairs(build.found) do
    lines[#lines + 1] = ("[%s,%s,%s]"):format(json(each[1]), json(each[2]), json(each[3]))
  end
  write_file(build.folder .. "/index.js", "var pendulaIndex = [\n" .. table.concat(lines, ",\n") .. "\n];\n",
    "manual")
end

local function make(folder)
  os.execute("mkdir -p " .. page.quoted(folder))
  build = { folder = folder, found = {}, problems = {} }
  for _, each in ipairs(pages) do
    if each[3] then markdown_page(each) end
  end
  local list = modules()
  for _, module in ipairs(list) do module_page(module) end
  reference_page(list)
  write_index()
  for _, file in ipairs { "page.js", "manual.css", "manual.js", "math.woff2" } do
    write_file(folder .. "/" .. file, embedded("document/" .. file), "manual")
  end
  write_file(folder .. "/page.css", '@font-face{font-family:"Latin Modern Math Subset";src:url(math.woff2) '
    .. 'format("woff2")}\n' .. embedded "document/page.css", "manual")
  for _, problem in ipairs(build.problems) do io.stderr:write("manual: ", problem, "\n") end
  return #build.problems == 0 and 0 or 1
end

local function cache_folder()
  local home = page.environment "XDG_CACHE_HOME" or (page.environment "HOME" or "/tmp") .. "/.cache"
  return home .. "/pendula/manual-" .. program_version
end

local function open_manual()
  local folder = cache_folder()
  local index = folder .. "/index.html"
  local stamp = io.open(folder .. "/complete")
  if stamp then
    stamp:close()
  else
    io.stderr:write("manual: making it in ", folder, " …\n")
    make(folder)
    write_file(folder .. "/complete", program_version .. "\n", "manual")
  end
  if not page.open(index) then print(index) end
  return 0
end

local function parse(words)
  local options, at = {}, 1
  while words[at] do
    local word = words[at]
    if word == "-o" then
      at = at + 1
      options.target = words[at] or fail "manual: -o needs a name: pendula manual -o folder"
    elseif word == "--luals" then options.luals = true
    elseif word == "--help" or word == "-h" then options.help = true
    else fail("manual: unknown option '" .. word .. "'."
      .. did_you_mean(word, { "--luals", "--help", "-o" })) end
    at = at + 1
  end
  return options
end

return function(words)
  local options = parse(words)
  if options.help then
    io.write(usage)
  elseif options.luals and options.target then
    write_file(options.target, document.luals(), "manual")
  elseif options.luals then
    io.write(document.luals())
  elseif options.target then
    return make(options.target)
  else
    return open_manual()
  end
  return 0
end
