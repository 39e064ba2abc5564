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
  { "language", "The language", "docs/language.md", shown_only = true, weight = 0 },
  { "reference", "Reference" },
  { "glossary", "Glossary", "docs/glossary.md" },
  { "derivations", "Derivations", "docs/derivations.md", weight = -4 },
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

-- What the search finds: a title, a line below it, where it stands; more words, how much its kind counts, and
-- words that are as good as the title.
local function note(title, words, address, more, weight, names)
  table.insert(build.found, { title, words, address, more, weight, names or "" })
end

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

-- The text below each heading, in order, and the rows of its tables.
local function sections(source)
  local list, fenced = {}, false
  for line in source:gmatch "[^\n]+" do
    if line:find "^```" then fenced = not fenced end
    if line:find "^#+ " and not fenced then
      list[#list + 1] = { rows = {} }
    elseif #list > 0 then
      table.insert(list[#list], line)
      local there, here = line:match "^| (.-) | (.*) |$"
      if there and not there:find "^there" then table.insert(list[#list].rows, { there, here }) end
    end
  end
  return list
end

local most_words = 700                               -- bytes of a section that the search knows

local function markdown_page(own)
  local place = { session = session.new() }
  local source = embedded(own[3])
  local texts, count = sections(source), 0
  local html = markdown.html(source, { link = resolve, code = run_blocks(own, place),
    heading = function(level, title, id)
      count = count + 1
      local address, below = own[1] .. ".html#" .. id, texts[count] or { rows = {} }
      if level <= 3 then
        note(title, own[2], address, table.concat(below, " "):sub(1, most_words), own.weight or 1)
      end
      if own[1] == "coming-from" then
        for _, row in ipairs(below.rows) do
          note((row[1]:gsub("`", "")), title .. ": " .. row[2]:gsub("`", ""), address, "", 0)
        end
      end
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

-- ── the folder ─────────────────────────────────────────────────────────────────────────────────────────────

local function json(words)
  local escapes = { ['"'] = '\\"', ["\\"] = "\\\\", ["\n"] = "\\n", ["<"] = "\\u003c" }
  return '"' .. text.valid(words):gsub('["\\\n<]', escapes) .. '"'
end

local function write_index()
  local lines = {}
  for _, each in ipairs(build.found) do
    lines[#lines + 1] = ("[%s,%s,%s,%s,%d,%s]"):format(json(each[1]), json(each[2]), json(each[3]),
      json(each[4]), each[5], json(each[6]))
  end
  write_file(build.folder .. "/index.js", "var pendulaIndex = [\n" .. table.concat(lines, ",\n") .. "\n];\n",
    "manual")
end

local function make(folder)
  os.execute("mkdir -p " .. page.quoted(folder))
  build = { folder = folder, found = {}, problems = {}, write_page = write_page, note = note }
  for _, each in ipairs(pages) do
    if each[3] then markdown_page(each) end
  end
  document.reference(build)
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
