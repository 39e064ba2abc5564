-- For a session at the prompt: what is defined, where one is, a record of the entries, an editor.

-- ── what is defined ────────────────────────────────────────────────────────────────────────────────────────

-- What is there before anything is typed.
local standard = {}
for name in pairs(_G) do standard[name] = true end
standard.arg = true

-- The variables of the session by name.
local function variables()
  local found = {}
  for name, value in pairs(_G) do
    if type(name) == "string" and not rawequal(value, named(name)) and not standard[name] then
      found[name] = value
    end
  end
  return found
end

-- One line about a value: the first line of its text, shortened.
local function summary(value, room)
  local text = shown(value):match "[^\n]*"
  if width(text) > room then text = text:sub(1, (utf8.offset(text, room - 1) or #text + 1) - 1) .. " …" end
  return text
end

doc { name = "who", module = "session", title = "The session", sig = "who()",
  text = "Lists the variables of the session: name, type, and the first line of the value.",
  example = "box = { 1, 2 }  who()",
  function()
    local names = {}
    for name in pairs(variables()) do names[#names + 1] = name end
    table.sort(names)
    local lines, widest = { { "name", "type", "value" } }, { 4, 4 }
    for i, name in ipairs(names) do
      local value = rawget(_G, name)
      lines[i + 1] = { name, object_type(value) or type(value), value }
      for k = 1, 2 do widest[k] = math.max(widest[k], width(lines[i + 1][k])) end
    end
    local screen = screen_width()
    local room = math.max(10, (screen == 0 and 80 or math.min(screen, 110)) - widest[1] - widest[2] - 6)
    for i = 2, #lines do lines[i][3] = summary(lines[i][3], room) end
    if #lines == 1 then return print "no variables yet" end
    local layout = include "layout"
    print(layout(lines))
  end }

local type_in_lua = type

doc { name = "type", module = "session", sig = "type(value, …) -> string",
  text = [[The type of a value: "model", "solution", "expr" and so on; of other values that of Lua:
    "number", "table", "nil" ….]],
  example = 'x = var "x"  return type(x), type(dae { der(x) ~ 1 }), type(1)', gives = "expr model number",
  function(...)
    if select("#", ...) == 0 then fail "type: expected a value" end
    return object_type((...)) or type_in_lua((...))
  end }
type = type_in_lua  -- of the files of the library, which ask for "userdata"

doc { name = "reset", module = "session", sig = "reset()",
  text = "Forgets the variables of the session. The folder and the history stay, and so do properties of "
    .. "symbols (positive, units).",
  example = "box = 1  reset()  return rawget(_G, 'box')", gives = "nil",
  function()
    for name in pairs(variables()) do rawset(_G, name, named(name)) end
  end }

-- ── folders ────────────────────────────────────────────────────────────────────────────────────────────────

doc { name = "pwd", module = "session", sig = "pwd() -> string",
  text = "The folder in which files are looked for.",
  example = "return #pwd() > 0", gives = "true", function() return working_folder() end }

doc { name = "cd", module = "session", sig = "cd(folder) -> string",
  text = "Changes the folder in which files are looked for; cd() goes home.",
  example = 'return cd "." == pwd()', gives = "true",
  function(folder)
    if folder == nil then folder = os.getenv "HOME" or "/" end
    if type(folder) ~= "string" then fail 'cd: expected the name of a folder, as in cd "models"' end
    if folder:sub(1, 1) == "~" then folder = (os.getenv "HOME" or "") .. folder:sub(2) end
    change_folder(folder)
    return working_folder()
  end }

-- Names in lines that fit the screen.
local names_in_lines = { __tostring = function(names)
  local columns = screen_width() == 0 and 100 or screen_width()
  local lines, line = {}, ""
  for _, name in ipairs(names) do
    if line ~= "" and width(line) + 2 + width(name) > columns then
      lines[#lines + 1] = line
      line = ""
    end
    line = line == "" and name or line .. "  " .. name
  end
  lines[#lines + 1] = line
  return table.concat(lines, "\n")
end }

doc { name = "ls", module = "session", sig = "ls([folder]) -> list",
  text = "The names in a folder, folders with a slash behind them; names that begin with a dot are left out.",
  example = "return type(ls()[1])",
  function(folder)
    if folder ~= nil and type(folder) ~= "string" then
      fail 'ls: expected the name of a folder, as in ls "models"'
    end
    return setmetatable(folder_names(folder or "."), names_in_lines)
  end }

-- ── time ───────────────────────────────────────────────────────────────────────────────────────────────────

doc { name = "timed", module = "session", sig = "timed(f) -> seconds, results …",
  text = "Calls a function and returns its processor time in s, then its results.",
  example = "return select(2, timed(function() return 6*7 end))", gives = "42",
  function(f)
    if type(f) ~= "function" then fail "timed: expected a function: timed(function() return … end)" end
    local begin = os.clock()
    local results = table.pack(f())
    return os.clock() - begin, table.unpack(results, 1, results.n)
  end }

-- ── record and editor ──────────────────────────────────────────────────────────────────────────────────────

-- The prompt appends every entry that worked to this file (src/shell/repl.cpp).
record_file = false

doc { name = "record", module = "session", sig = 'record "session.lua", record(false)',
  text = "From now on the entries that worked are written to a file, as a script that runs them again; "
    .. "record(false) ends it, record() says where it goes.",
  example = "return record()", gives = "nil",
  function(file)
    if file == nil then return record_file or nil end
    if file == false then
      record_file = false
      return
    end
    if type(file) ~= "string" then fail 'record: expected a file name, as in record "session.lua"' end
    write_file(file, "-- A session of Pendula.\n", "record")
    record_file = file:sub(1, 1) == "/" and file or working_folder() .. "/" .. file
  end }

-- The journal of a session that was cut off, as the prompt found it.
left_over = false
recovering = false  -- the journal whose entries the prompt runs next (src/shell/repl.cpp)

doc { name = "recover", module = "session", sig = "recover(), recover(false)",
  text = "Runs the entries of a session that ended unexpectedly (the terminal was closed, the machine went "
    .. "down) in this one, each by itself: one that fails is reported, and the next one runs. recover(false) forgets "
    .. "them. The prompt says when there is one.",
  example = "return type(recover)", gives = "function",
  function(wanted)
    local file = left_over
    if not file then fail "recover: no session was cut off" end
    left_over = false
    if wanted == false then return os.remove(file) and nil end
    recovering = file
  end }

doc { name = "edit", module = "session", sig = "edit(file)",
  text = "Opens a file in $VISUAL or $EDITOR and runs it afterwards, if it is a Lua script.",
  example = "return type(edit)", gives = "function",
  function(file)
    if type(file) ~= "string" then fail 'edit: expected a file name, as in edit "model.lua"' end
    if not os.execute "test -t 0 -a -t 1" then fail "edit: an editor needs a terminal" end
    local editor = os.getenv "VISUAL" or os.getenv "EDITOR" or "vi"
    local good = os.execute(("%s '%s'"):format(editor, (file:gsub("'", "'\\''"))))
    if not good then fail(("edit: %s ended with an error"):format(editor)) end
    if file:find "%.lua$" and io.open(file) then return dofile(file) end
  end }

-- ── a session in a file ────────────────────────────────────────────────────────────────────────────────────

doc { name = "save_session", module = "session", sig = "save_session(file) -> names",
  text = 'Saves every variable of the session that save can save, and says which ones it cannot; the same as '
    .. 'save "work.pend".',
  example = "return type(save_session)", gives = "function",
  function(file)
    if type(file) ~= "string" then
      fail 'save_session: expected a file name, as in save_session "work.pend"'
    end
    local source_of = include("saving").text
    local kept, names, others = {}, {}, {}
    for name, value in pairs(variables()) do
      if pcall(source_of, { value }) then
        kept[name] = value
        names[#names + 1] = name
      else
        others[#others + 1] = name
      end
    end
    table.sort(names)
    table.sort(others)
    write_file(file, "-- A session of Pendula: load sets its variables.\n" .. source_of(kept), "save_session")
    if #others > 0 then print("not saved: " .. table.concat(others, ", ")) end
    return names
  end }

doc { name = "load_session", module = "session", sig = "load_session(file) -> names",
  text = "Sets the variables in a file that save_session wrote; the same as load \"work.pend\". The file is "
    .. "read as "
    .. "data.",
  example = "return type(load_session)", gives = "function",
  function(file)
    if type(file) ~= "string" then
      fail 'load_session: expected a file name, as in load_session "work.pend"'
    end
    local source, why = io.open(file)
    if not source then fail("load_session: cannot read " .. why) end
    local text = source:read "a"
    source:close()
    local values = include "saved"(text, file)
    if type(values) ~= "table" or getmetatable(values) ~= nil then
      fail(("load_session: %s holds no session; its value is read by load"):format(file))
    end
    local names = {}
    for name, value in pairs(values) do
      if type(name) ~= "string" then fail(("load_session: %s holds no session"):format(file)) end
      rawset(_G, name, value)
      names[#names + 1] = name
    end
    table.sort(names)
    return names
  end }
