-- pendula report: runs a script and writes one page with its text, code, results and figures.
local text, code, markdown = document.text, document.code, document.markdown
local page, recorder = document.page, document.recording

local usage = [[
usage: pendula report [options] script.lua [arguments]

Runs the script and writes one self-contained page: its text (comments that begin with ---, in Markdown), its
code, its output with mathematics, its figures (:show() and :save), errors where they happened.

  -o FILE     the page, .html or .pdf (by chromium); without it script.html in this folder
  --timing    how long each statement took
  --fold      the code is folded
  --          what follows is the script's

A script that fails leaves its page as well; the exit status is then 1.
]]

-- ── the command line ───────────────────────────────────────────────────────────────────────────────────────

local function parse(words)
  local options, rest, at = { arguments = {} }, nil, 1
  while words[at] do
    local word = words[at]
    if rest or not word:find "^%-." then
      if options.script then table.insert(options.arguments, word) else options.script = word end
    elseif word == "--" then rest = true
    elseif word == "-o" then
      at = at + 1
      options.target = words[at] or fail "report: -o needs a file: pendula report exam.lua -o exam.html"
    elseif word == "--timing" then options.timing = true
    elseif word == "--fold" then options.fold = true
    elseif word == "--help" or word == "-h" then options.help = true
    elseif options.script then table.insert(options.arguments, word)
    else
      fail("report: unknown option '" .. word .. "'."
        .. did_you_mean(word, { "--timing", "--fold", "--help", "-o" }))
    end
    at = at + 1
  end
  return options
end

local function read_script(path)
  if path == "-" then return io.read "a", "=stdin" end
  local file, why = io.open(path, "rb")
  local source = file and file:read "a"
  if file then file:close() end
  if not source then
    fail("report: cannot read '" .. path .. "': " .. (why or "it is not a file"):gsub("^.-: ", ""))
  end
  return source, "@" .. path
end

local function default_target(script)
  if script == "-" then return "report.html" end
  return (script:match "[^/]*$":gsub("%.lua$", "")) .. ".html"
end

-- ── parts ──────────────────────────────────────────────────────────────────────────────────────────────────

local function is_text(line) return line:find "^%s*%-%-%-[^-]" ~= nil or line:find "^%s*%-%-%-%s*$" ~= nil end

-- The lines between two statements: text, and comments that stay with the code.
local function read_gap(gap, parts)
  local comments, words = {}, nil
  for line in (gap .. "\n"):gmatch "(.-)\n" do
    if is_text(line) then
      if not words then
        words = {}
        parts[#parts + 1] = { before = table.concat(comments, "\n"), words = words }
        comments = {}
      end
      words[#words + 1] = line:gsub("^%s*%-%-%- ?", "")
    else
      words = nil
      comments[#comments + 1] = line
    end
  end
  return table.concat(comments, "\n")
end

-- The script as a list of { words = lines of Markdown } and { first = i, last = j, source = … }, in order:
-- the statements i … j, which share a line.
local function parts_of(source, statements)
  local parts, at = {}, 1
  for i, statement in ipairs(statements) do
    local gap = source:sub(at, statement.first - 1)
    local tail = ""
    local own = source:sub(statement.first, statement.last)
    local line_mate = i > 1 and not gap:find("\n", 1, true)
    if i > 1 then tail, gap = gap:match "^([^\n]*)(.*)$" end     -- a comment behind the statement before
    if i > 1 then parts[#parts].source = parts[#parts].source .. tail end
    if line_mate then
      parts[#parts].source, parts[#parts].last = parts[#parts].source .. own, i
    else
      local comments = read_gap(gap:gsub("^\n", "", 1), parts)
      parts[#parts + 1] = { first = i, last = i, source = comments .. own }
    end
    at = statement.last + 1
  end
  local rest = source:sub(at)
  if #statements > 0 then
    local tail, after = rest:match "^([^\n]*)\n?(.*)$"
    parts[#parts].source = parts[#parts].source .. tail
    rest = after
  end
  local comments = read_gap(rest, parts)
  if comments:find "%S" then parts[#parts + 1] = { source = comments } end
  return parts
end

-- ── running ────────────────────────────────────────────────────────────────────────────────────────────────

local marker = "_pendula_statement"

local function compile(source, chunk, statements)
  local plain, problem = load(source, chunk, "t")
  if not plain then return nil, problem end
  local marked = code.marked(source, marker, statements)
  return marked and load(marked, chunk, "t") or plain
end

-- Runs the script; the recorder has what it shows. Returns the text of an error and whether it was Ctrl-C.
local function run(record, chunk, options, times)
  local began, exit_code
  local function leave()
    if began and record.at > 0 then
      times[record.at] = (times[record.at] or 0) + clock() - began - record.overhead
    end
    record.overhead = 0
  end
  rawset(_G, marker, function(i)
    record:drain()
    leave()
    record.at, began = i, clock()
  end)
  rawset(_G, "arg", table.move(options.arguments, 1, #options.arguments, 1, { [0] = options.script }))
  local exit = os.exit
  _G.os.exit = function(status)
    exit_code = status == nil and 0 or status == true and 0 or status or 1
    error("os.exit", 0)
  end
  local good, problem, stopped = run_user(chunk, table.unpack(options.arguments))
  leave()
  _G.os.exit = exit
  rawset(_G, marker, nil)
  if good or exit_code then return nil, false, exit_code end
  record:drain()
  record:add { error = problem }
  return problem, stopped
end

-- ── the page ───────────────────────────────────────────────────────────────────────────────────────────────

local function seconds(s)
  if s >= 9.95 then return ("%.0f s"):format(s) end
  return s >= 0.0995 and ("%.1f s"):format(s) or ("%.0f ms"):format(s*1000)
end

local function code_block(source, options, note)
  source = source:gsub("^%s*\n", ""):gsub("%s+$", "")
  if source == "" then return "" end
  local summary = (source:match "^%s*([^\n]*)" or ""):sub(1, 200)
  return ('<details class="code%s"%s><summary>%s%s</summary><pre class="code" tabindex="0"><code>%s</code>'
    .. "</pre></details>"):format(note and " skipped" or "", (options.fold or note) and "" or " open",
      '<span class="first">' .. text.escaped(text.valid(summary)) .. "</span>",
      note and '<span class="note">' .. note .. "</span>" or "", code.highlighted(source))
end

-- Statements that show nothing share a block of code with the next one that does.
local function body_of(parts, record, options, times)
  local drawn = record:drawings()
  local out, pending, spent = {}, {}, 0
  local function flush(skipped)
    if #pending > 0 then out[#out + 1] = code_block(table.concat(pending, "\n"), options, skipped) end
    if options.timing and spent >= 0.0005 then
      out[#out + 1] = '<p class="timing">' .. seconds(spent) .. "</p>"
    end
    pending, spent = {}, 0
  end
  local function results(first, last)
    local html = {}
    for i = first, last do html[#html + 1] = record.shows[i] and record:html(i, drawn) end
    if #html == 0 then return end
    flush()
    out[#out + 1] = '<section class="output">' .. table.concat(html, "\n") .. "</section>"
  end
  results(0, 0)
  for _, part in ipairs(parts) do
    local skipped = part.first and record.last and part.first > record.last
    if part.words then
      if part.before:find "%S" then pending[#pending + 1] = part.before end
      flush(skipped and "not run")
      out[#out + 1] = markdown.html(table.concat(part.words, "\n"))
    else
      pending[#pending + 1] = part.source
      for i = part.first or 1, part.last or 0 do spent = spent + (times[i] or 0) end
      if part.first then results(part.first, part.last) end
      if record.last and part.first and part.first <= record.last and part.last >= record.last then
        flush()
      end
    end
  end
  flush(record.last and "not run")
  return table.concat(out, "\n")
end

local function title_of(parts, script)
  for _, part in ipairs(parts) do
    for _, line in ipairs(part.words or {}) do
      local title = line:match "^#+%s+(.-)%s*$"
      if title then return title end
    end
  end
  return script
end

local function write_page(options, title, body)
  local html = page.html(title, body)
  if options.target:lower():find "%.pdf$" then return page.print_pdf(html, options.target, "report") end
  if not options.target:lower():find "%.html?$" then
    fail("report: the page is written to a file .html or .pdf, not '" .. options.target .. "'")
  end
  write_file(options.target, html, "report")
end

local function footer(options, times)
  local total = 0
  for _, s in pairs(times) do total = total + s end
  local name = options.script == "-" and "standard input" or options.script:match "[^/]*$"
  return ('<footer>%s%s</footer>'):format(text.escaped(name), options.timing and ", " .. seconds(total) or "")
end

return function(words)
  local options = parse(words)
  if options.help then
    io.write(usage)
    return 0
  end
  if not options.script then fail "report: which script? pendula report exam.lua -o exam.html" end
  options.target = options.target or default_target(options.script)
  local source, chunk_name = read_script(options.script)
  source = source:gsub("^\u{FEFF}", ""):gsub("^#[^\n]*", "")
  local statements = code.statements(source)
  local parts, times = parts_of(source, statements), {}
  local record = recorder.new()
  local chunk, problem = compile(source, chunk_name, statements)
  local stopped, exit_code
  if chunk then
    problem, stopped, exit_code = record:during(function() return run(record, chunk, options, times) end)
    record.last = (problem or exit_code) and record.at or nil
  else
    record:add { error = problem }
    record.last = 0
  end
  local title = title_of(parts, options.script)
  write_page(options, title, body_of(parts, record, options, times) .. "\n" .. footer(options, times))
  if problem then io.stderr:write(problem, "\n") end
  return stopped and 130 or problem and 1 or exit_code or 0
end
