-- The reference in the manual: a page for each subject with its functions, options, examples and what they
-- show, and with the fields of its types.
local text, code = document.text, document.code
local session = document.session

local build                                          -- of the manual: problems, write_page, note

local function module_file(name) return "ref-" .. name:gsub("%W+", "-"):lower() end

local function is_hidden(entry) return entry.sig == "" end

-- Fields by type, as a list and by entry.
local function add_field(fields, entry)
  local own = fields[entry.owner]
  if not own then
    own = { type = entry.owner, specimen = specimens[entry.owner][2] }
    fields[entry.owner], fields[#fields + 1] = own, own
  end
  own[#own + 1], fields[entry] = entry, own
end

-- The entries of each module, in order.
local function modules()
  local list, named = {}, {}
  for _, entry in ipairs(entries()) do
    local key = module_file(entry.module)              -- modules that differ in case only share a page
    local own = named[key]
    if not own then
      own = { name = entry.module, title = entry.title ~= "" and entry.title or entry.module, entries = {},
        fields = {} }
      named[key] = own
      list[#list + 1] = own
    end
    if own.title == own.name and entry.title ~= "" then own.title = entry.title end
    if not is_hidden(entry) then
      own.entries[#own.entries + 1] = entry
      if entry.by_specimen and entry.separator == "#" then add_field(own.fields, entry) end
    end
  end
  return list
end

local function code_html(source)
  return '<pre class="code" tabindex="0"><code>' .. code.highlighted(typed_example(source)) .. "</code></pre>"
end

-- Runs examples; all with one record, so that their figures are drawn at once.
local Runner = {}
Runner.__index = Runner

local function new_runner()
  return setmetatable({ record = document.recording.new(), count = 0, shared = {} }, Runner)
end

-- The number of what a piece of source shows; `within`: a session it goes on with.
function Runner:run(source, name, within)
  local own = within or session.new()
  own.record, own.count = self.record, self.count
  self.count = self.count + 1
  local problem, stopped = own:run(source, "=" .. name)
  if not within then own:close() end
  if stopped then error(problem, 0) end
  if problem then table.insert(build.problems, name .. ": " .. problem) end
  return self.count
end

-- Fields of a type are read from one specimen; everything else that has an example runs it.
local function run_examples(module)
  local runner, numbers = new_runner(), {}
  for _, fields in ipairs(module.fields) do
    local own = session.new()
    runner:run(fields.specimen, fields.type, own)
    for _, entry in ipairs(fields) do
      numbers[entry] = runner:run("return " .. entry.by_specimen, entry.name, own)
    end
    own:close()
  end
  for _, entry in ipairs(module.entries) do
    if entry.example ~= "" and not numbers[entry] then
      numbers[entry] = runner:run(entry.example, entry.name)
    end
  end
  return runner.record, numbers
end

local function row_html(name, ...)
  return ('<th scope="row"><code>%s</code></th><td>%s</td>'):format(text.escaped(name),
    table.concat({ ... }, "</td><td>"))
end

local function table_html(head, rows)
  return '<div class="wide"><table><thead><tr><th>' .. table.concat(head, "</th><th>")
    .. "</th></tr></thead><tbody>\n<tr>" .. table.concat(rows, "</tr>\n<tr>") .. "</tr></tbody></table></div>"
end

local function options_html(entry)
  if not entry.options or #entry.options == 0 then return "" end
  local out = {}
  for _, option in ipairs(entry.options) do
    local choices = option.values:find "^[^@]" and ' "' .. option.values:gsub("|", '", "') .. '"' or ""
    local name = option.name:find "^%d" and "argument " .. option.name or option.name
    local default = option.default ~= "" and "<code>" .. text.escaped(option.default) .. "</code>" or ""
    out[#out + 1] = row_html(name, text.escaped(option.type), default, text.escaped(option.text .. choices))
  end
  return "<details><summary>options</summary>" .. table_html({ "option", "type", "default", "meaning" }, out)
    .. "</details>"
end

local function entry_html(entry, shows)
  local example = entry.example ~= "" and code_html(entry.example) or ""
  local output = shows ~= "" and '<section class="output">' .. shows .. "</section>" or ""
  return ('<section class="entry" id="%s"><h2><code>%s</code></h2><p>%s</p>%s%s%s</section>'):format(
    text.escaped(entry.name), text.escaped(entry.sig), text.escaped(entry.text), options_html(entry), example,
    output)
end

-- The fields of a type: how one comes by a value, and for each field what it means and is there.
local function fields_html(fields, shows)
  local out = {}
  for _, entry in ipairs(fields) do
    out[#out + 1] = row_html(entry.by_specimen, text.escaped(entry.text), shows(entry))
      :gsub("^<th", '<th id="' .. text.escaped(entry.name):gsub("%%", "%%%%") .. '"')
  end
  return '<section class="entry"><h2>Fields of ' .. text.escaped(fields.type) .. "</h2>"
    .. code_html(fields.specimen) .. table_html({ "field", "meaning", "here" }, out) .. "</section>"
end

-- What a name is called in lists: an operator by its signature.
local function label(entry)
  return entry.member and entry.member:find "^__" and entry.sig .. "  (" .. entry.owner .. ")" or entry.name
end

-- Concepts and functions come first in the search, then methods, fields and operators.
local function weight(entry)
  if entry.is_concept then return 8 end
  if entry.separator == "#" or entry.member == "latex" and entry.owner ~= "model" then return -7 end
  if entry.separator ~= ":" then return 4 end
  return entry.owner == "model" and 3 or 1
end

local function module_page(module)
  local record, numbers = run_examples(module)
  local drawn = record:drawings()
  local function shows(entry) return numbers[entry] and record:html(numbers[entry], drawn) or "" end
  local file = module_file(module.name) .. ".html"
  local out = { "<h1>" .. text.escaped(module.title) .. "</h1>", '<ul class="names">' }
  for _, entry in ipairs(module.entries) do
    out[#out + 1] = ('<li><a href="#%s">%s</a></li>'):format(text.escaped(entry.name),
      text.escaped(label(entry)))
    if not (entry.member and entry.member:find "^__") then
      build.note(entry.name, (entry.is_concept and "" or entry.sig .. " ") .. entry.text:match "^[^.]*",
        file .. "#" .. entry.name, entry.text, weight(entry), entry.words)
    end
  end
  out[#out + 1] = "</ul>"
  for _, entry in ipairs(module.entries) do
    local fields = module.fields[entry]
    if not fields then
      out[#out + 1] = entry_html(entry, shows(entry))
    elseif fields[1] == entry then
      out[#out + 1] = fields_html(fields, shows)
    end
  end
  build.write_page(module_file(module.name), module.title, table.concat(out, "\n"))
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
        text.escaped(label(entry)))
    end
    out[#out + 1] = "</ul>"
  end
  build.write_page("reference", "Reference", table.concat(out, "\n"))
end

return function(manual)
  build = manual
  local list = modules()
  for _, module in ipairs(list) do module_page(module) end
  reference_page(list)
end
