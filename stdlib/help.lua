-- help(), apropos, examples: what the documentation rows say, laid out for a terminal.

local sheet = include "help/sheet"
local say, show, shown_page = sheet.say, sheet.show, sheet.shown_page
local columns, wrapped = sheet.columns, sheet.wrapped
local print_pairs, print_list = sheet.print_pairs, sheet.print_list
local print_entry, print_concept, print_example = sheet.print_entry, sheet.print_concept, sheet.print_example

-- ── the entries ────────────────────────────────────────────────────────────────────────────────────────────

-- "model:reduce" -> "model", ":", "reduce";  "sin" -> nil, "", "sin"
local function split_name(name)
  local owner, separator, member = name:match "^([^:#.]+)([:#.])(.+)$"
  if owner then return owner, separator, member end
  return nil, "", name
end

include "help/examples"

local cache, cached_count

-- All documented things: C++ rows in the order of the modules, then the stdlib's own. `value` is what the
-- name stands for.
function entries()
  if cache and cached_count == #documented then return cache end
  cache, cached_count = {}, #documented
  specimens = rawget(_ENV, "specimens") or include "help/specimens"
  for _, row in ipairs(rows()) do
    row.is_value = row.name:sub(1, 1) == "="
    row.name = row.name:gsub("^=", "")
    cache[#cache + 1] = row
  end
  for _, row in ipairs(documented) do
    if row.describe then
      row.describe(row)
      row.describe = nil
    end
    cache[#cache + 1] = row
  end
  for _, page in ipairs(rawget(_ENV, "concepts") or include "concepts/init") do cache[#cache + 1] = page end
  for _, row in ipairs(cache) do
    row.owner, row.separator, row.member = split_name(row.name)
    if row.example == "" then shown_by_specimen(row) end
    if row.value == nil then row.value = named(row.name) end
  end
  return cache
end

local function is_member(entry) return entry.separator == ":" or entry.separator == "#" end
local function is_metamethod(entry) return entry.separator == ":" and entry.member:sub(1, 2) == "__" end

-- ── finding ────────────────────────────────────────────────────────────────────────────────────────────────

local function all(predicate)
  local found = {}
  for _, entry in ipairs(entries()) do
    if predicate(entry) then found[#found + 1] = entry end
  end
  return found
end

-- The entries a user may mean by `name`: its full name; a member's bare name; "sys:reduce" for any variable
-- name.
-- help "~" is the page of what the sign does with expressions.
local signs = { ["+"] = "__add", ["-"] = "__sub", ["*"] = "__mul", ["/"] = "__div", ["^"] = "__pow",
  ["~"] = "__bxor", ["=="] = "__eq", ["~="] = "__eq", ["<"] = "__lt", [">"] = "__lt", ["<="] = "__le",
  [">="] = "__le", ["//"] = "__idiv", ["%"] = "__mod", ["#"] = "__len" }

local function find(name)
  if signs[name] then name = "expr:" .. signs[name] end
  local found = all(function(e) return e.name == name end)
  if #found > 0 then return found end
  local owner, separator, member = split_name(name)
  if separator == "." or separator == ":" then
    local variable = rawget(_G, owner)
    local type_name = object_type(variable)
    found = all(function(e)
      return is_member(e) and e.member == member and (e.owner == owner or not type_name
        or e.owner == type_name)
    end)
  elseif separator == "" then
    found = all(function(e) return e.member == name end)
  end
  return found
end

local searcher
local function search(words)
  searcher = searcher or include "help/search"
  return searcher(words)
end

local function members_of_type(type_name)
  return all(function(e) return is_member(e) and e.owner == type_name and not is_metamethod(e) end)
end

local function all_names()
  local names, seen = {}, {}
  local function add(name)
    if name and not seen[name] then
      seen[name] = true
      names[#names + 1] = name
    end
  end
  for _, entry in ipairs(entries()) do
    if not is_metamethod(entry) then
      add(entry.name)
      add(entry.member)
      add(entry.owner)
      add(entry.module)
    end
  end
  return names
end

-- ── the pages ──────────────────────────────────────────────────────────────────────────────────────────────

local function help_type(type_name)
  local members = members_of_type(type_name)
  local operators = all(function(e) return is_metamethod(e) and e.owner == type_name and e.sig ~= "" end)
  if #members + #operators == 0 then return false end
  say(type_name)
  local specimen = specimens[type_name] and specimens[type_name][2] or ""
  for line in specimen:gmatch "[^\n]+" do say("    > " .. line) end
  for _, part in ipairs { { "fields", "#" }, { "methods", ":" } } do
    local list = {}
    for _, entry in ipairs(members) do
      if entry.separator == part[2] then list[#list + 1] = entry end
    end
    if #list > 0 then
      say(part[1])
      print_list(list)
    end
  end
  if #operators > 0 then
    say("operators")
    print_list(operators)
  end
  return true
end

local function help_library(name)
  local list = all(function(e) return e.separator == "." and e.owner == name end)
  if #list == 0 then return false end
  say(name)
  print_list(list)
  return true
end

-- Members are left out where the page of their type stands above.
local function help_module(name, below_type)
  local list = all(function(e)
    return e.module == name and not is_metamethod(e) and not (below_type and is_member(e))
  end)
  if #list == 0 then return false end
  say(list[1].title ~= "" and list[1].title or name)
  print_list(list)
  return true
end

-- The names of a module on one line of the overview; of a long library (rk, problems) the first ones.
local shown_of_library = 8

local function names_line(names, module)
  if #names <= 2*shown_of_library or not names[#names]:find(".", 1, true) then
    return table.concat(names, " ")
  end
  return table.concat(names, " ", 1, shown_of_library)
    .. (' … and %d more: help "%s"'):format(#names - shown_of_library, module)
end

-- What the library itself is written with, and programs that drive it; help and apropos explain it.
local seldom_typed = {}
for name in ([[undifferentiated operation symbols_in terms share_interval bin smooth_density method_families
  solution_of_parts store_info random_at parallel_calls read_mat write_mat continuous_errors held_response
  label_text ipairs]]):gmatch "%S+" do seldom_typed[name] = true end

local function in_overview(entry)
  return not (is_member(entry) or seldom_typed[entry.name] or entry.owner == "shards")
end

local function overview()
  say("Lua 5.4 and a vocabulary for dynamic systems.")
  for _, line in ipairs(wrapped('help "name" explains a name or a concept, help "several words" searches, '
    .. 'help(value) explains a value, apropos "word" searches all help texts, examples "name" shows it in '
    .. 'use. '
    .. 'The tour: scripts/tour.lua; the language: docs/language.md.', columns())) do say(line) end
  say()
  local lines, by_module = {}, {}
  for _, entry in ipairs(entries()) do
    local line = by_module[entry.module]
    if not line then
      line = { entry.title ~= "" and entry.title or entry.module, {}, entry.module }
      by_module[entry.module] = line
    end
    if in_overview(entry) then
      if #line[2] == 0 then lines[#lines + 1] = line end
      table.insert(line[2], entry.name)
    end
  end
  for _, line in ipairs(lines) do line[2] = names_line(line[2], line[3]) end
  local types_line = {}
  for _, name in ipairs(types()) do
    if #members_of_type(name) > 0 then types_line[#types_line + 1] = name end
  end
  if #types_line > 0 then lines[#lines + 1] = { "Types of values", table.concat(types_line, " ") } end
  print_pairs(lines, 0)
end

-- The parts of this name in the libraries of components: help "clutch", help "translational.mass".
local function parts_called(name)
  local found = {}
  for _, entry in ipairs(entries()) do
    for _, part in ipairs(entry.parts or {}) do
      local whole = entry.name .. "." .. part
      if part == name or whole == name or whole == "components." .. name then
        found[#found + 1] = { whole, named(entry.name)[part] }
      end
    end
  end
  return found
end

-- One part has its page, several of one name a line each.
local function help_part(name, only_lines)
  local found = parts_called(name)
  if #found == 1 and not only_lines then
    say(found[1][1]:gsub("[^.]*$", "") .. shown(found[1][2]))
  elseif #found > 0 then
    if only_lines then say() end
    local rows = {}
    for _, part in ipairs(found) do rows[#rows + 1] = { part[1], part[2].text } end
    print_pairs(rows, 0)
    say(('  (help "%s" has its equations)'):format(found[1][1]))
  end
  return #found > 0
end

local function help_name(name)
  local found = find(name)
  for i, entry in ipairs(found) do
    if i > 1 then say() end
    print_entry(entry)
  end
  local shown = #found > 0
  -- A word may name a function and a type ("expr") or a library and a module ("dae"): show both.
  for _, page in ipairs { help_type, help_library, #found == 0 and help_module or nil } do
    if shown and (page == help_type and #members_of_type(name) > 0) then say() end
    shown = page(name, shown) or shown
  end
  if shown then return end
  if name:find "%s" then
    local list = search(name)
    if #list > 0 then
      say(("pages about '%s', the nearest first:"):format(name))
      return print_list({ table.unpack(list, 1, 12) })
    end
  end
  for _, page in ipairs(entries()) do  -- "stiff" is a word of the page "stiffness"
    if page.is_concept and (" " .. page.words .. " "):find(" " .. name:lower() .. " ", 1, true) then
      print_concept(page)
      help_part(name, true)
      return
    end
  end
  if help_part(name) then return end
  local _, why = pcall(function() return _G[name] end)  -- a name of another language has a remedy
  local remedy = type(why) == "string" and why:match "undefined variable '.-': (.+)$"
  if remedy then return say(name .. ": " .. remedy) end
  local builtin = rawget(_G, name:match "^[^.:]+" or name)
  if builtin ~= nil and named(name) == nil and (type(builtin) == "function" or type(builtin) == "table") then
    say(name .. " is not from Pendula; Lua's own functions are described at "
      .. "https://www.lua.org/manual/5.4/")
    return
  end
  fail("help: there is nothing called '" .. name .. "'." .. did_you_mean(name, all_names())
       .. ' (search: apropos "' .. name .. '")')
end

-- The calls of a list in lines; a call is not broken.
local function say_next(calls)
  local line = "next  "
  for i, call in ipairs(calls) do
    local item = call .. (i < #calls and "," or "")
    if width(line) + 2 + width(item) > columns() and line:find "%S" then
      say((line:gsub("%s+$", "")))
      line = "      "
    end
    line = line .. " " .. item
  end
  say(line)
end

local most_lines = 5  -- of the value itself, at the head of its page

-- What the prompt shows of a function; nil of one that is not from here.
function function_text(value)
  for _, entry in ipairs(entries()) do
    if not entry.is_concept and rawequal(entry.value, value) then
      return ('a function: %s  (help "%s")'):format(entry.sig, entry.name)
    end
  end
end

local function help_value(value)
  local type_name = object_type(value)
  if type_name then
    local count = 0
    for line in (shown(value) .. "\n"):gmatch "([^\n]*)\n" do
      count = count + 1
      if count <= most_lines then say(line) elseif count == most_lines + 1 then say "…" end
    end
    local next_steps = include "help/next"
    if next_steps[type_name] then say_next(next_steps[type_name]) end
    say()
    if not help_type(type_name) then say(type_name .. ": a value without fields or methods") end
    return
  end
  for _, entry in ipairs(entries()) do
    if value ~= nil and rawequal(entry.value, value) then return help_name(entry.name) end
  end
  if type(value) == "function" then
    say("a function without documentation")
  elseif value == nil then
    fail 'help: got nil; write help "name" with quotes, or help() for the overview'
  elseif type(getmetatable(value)) == "string" then  -- a library, a part: they say what they are
    if not help_library(getmetatable(value)) then say(shown(value)) end
  else
    say("a " .. type(value) .. ": " .. shown(value))
  end
end

doc { name = "help", module = "help", title = "Help", sig = "help([name or value])",
  text = "Explains a name, a function or a value; without an argument it lists everything.",
  example = 'help "apropos"', gives = [[
apropos(word)
  Lists everything whose name, signature or text contains the word.
    > apropos "apropos"
      apropos(word)  Lists everything whose name, signature or text contains the word.]],
  function(...)
    local what = ...
    if select("#", ...) == 0 then return shown_page(overview) end
    return shown_page(type(what) == "string" and help_name or help_value, what)
  end }

doc { name = "apropos", module = "help", sig = "apropos(word)",
  text = "Lists everything whose name, signature or text contains the word.",
  example = 'apropos "apropos"',
  gives = "  apropos(word)  Lists everything whose name, signature or text contains the word.",
  function(word)
    if type(word) ~= "string" or word == "" then fail 'apropos: expected a word, as in apropos "index"' end
    local found = search(word)
    if #found == 0 then
      print("nothing mentions '" .. word .. "'." .. did_you_mean(word, all_names()))
      return
    end
    shown_page(print_list, found)
  end }

doc { name = "examples", module = "help", sig = "examples(name)",
  text = "Shows the examples of a name and every other example that uses it, with their output.",
  example = 'examples "apropos"',
  function(name)
    if type(name) ~= "string" then fail 'examples: expected a name, as in examples "help"' end
    local found = find(name)
    if #found == 0 then
      fail("examples: there is nothing called '" .. name .. "'." .. did_you_mean(name, all_names()))
    end
    local _, _, member = split_name(name)
    local uses = "%f[%w_]" .. member:gsub("%W", "%%%0") .. "%f[^%w_]"
    local own = {}
    for _, entry in ipairs(found) do own[entry] = true end
    -- What an example tests or where it puts its files says nothing of other names.
    local function shows(e)
      return not (own[e] or e.by_specimen) and e.example:find(uses)
        and not (e.example:find "%f[%w]expect%(" or e.example:find "os%.tmpname" or e.example:find ":match")
    end
    local list = all(function(e) return own[e] and e.example ~= "" end)
    for _, entry in ipairs(all(shows)) do list[#list + 1] = entry end
    if #list == 0 then return print("no examples of " .. name) end
    shown_page(function()
      for i, entry in ipairs(list) do
        if i > 1 then say() end
        print_example(entry, 0)
      end
    end)
  end }
