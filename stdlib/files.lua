-- save and load: models and expressions as Lua files.

local lua_load = load
local kinds = { model = true, expr = true, matrix = true, equation = true }

doc { name = "save", module = "files", title = "Files", sig = "save(file, value)",
  text = [[Writes a model, an expression, a matrix or an equation to a Lua file that load (or dofile) turns
    into the same value, in a new session too. A model keeps its name, parameter values and the form it was
    reduced to.]],
  example = [[x = var "x"
name = os.tmpname() .. ".lua"
save(name, dae{ der(x) ~ -2*x })
return load(name).kind]], gives = "ODE",
  function(file, value)
    if type(file) ~= "string" then fail 'save: expected a file name first, as in save("model.lua", sys)' end
    local kind = object_type(value)
    if type(value) == "number" then kind = "expr" end
    if not kinds[kind] then
      fail("save: a model, an expression, a matrix or an equation can be saved, not "
        .. (kind and "a " .. kind or type(value))
          .. (kind == "solution" and '; sol:csv "run.csv" writes its values' or ""))
    end
    local text = type(value) == "number" and ("return %.17g\n"):format(value) or value:code()
    if kind ~= "model" and type(value) ~= "number" then text = "return " .. text .. "\n" end
    local out, why = io.open(file, "w")
    if not out then fail("save: cannot write " .. why) end
    out:write(text)
    out:close()
  end }

-- A column title is quoted where it contains a comma or a quote.
local function quoted(title)
  if title:find '[,"\n]' then return '"' .. title:gsub('"', '""') .. '"' end
  return title
end

-- The columns of a table of values: t, then every entry of every expression.
local function csv_columns(sol, list)
  local titles, columns = { "t" }, { sol.t }
  for _, expression in ipairs(list) do
    local values = sol(expression)
    local entries = values.cols == 1 and { expression } or expression
    for j = 1, values.cols do
      titles[#titles + 1] = tostring(entries[j])
      columns[#columns + 1] = values:col(j)
    end
  end
  return titles, columns
end

doc { name = "solution:csv", module = "files", sig = 'sol:csv(file [, { expressions }])',
  text = [[Writes the saved times and values as a table with commas and a line of titles: the states and
    algebraic variables, or the expressions that are named. 17 digits, so that reading it gives the same
    numbers.]],
  example = [[x = var "x"
sol = dae{ der(x) ~ -2*x }:integrate{ start = { x = 1 }, to = 1, dt = 0.5, method = rk.euler }
name = os.tmpname()
sol:csv(name)
for line in io.lines(name) do print(line) end]], gives = "t,x\n0,1\n0.5,0\n1,0",
  function(sol, file, list)
    if object_type(sol) ~= "solution" then fail 'csv: expected a solution, as in sol:csv "run.csv"' end
    if type(file) ~= "string" then fail 'csv: expected a file name, as in sol:csv "run.csv"' end
    if list == nil then
      list = {}
      for _, part in ipairs { sol.model.differential, sol.model.algebraic } do
        for i = 1, #part do list[#list + 1] = part[i] end
      end
    elseif object_type(list) then
      list = { list }
    end
    local titles, columns = csv_columns(sol, list)
    local out, why = io.open(file, "w")
    if not out then fail("csv: cannot write " .. why) end
    for j, title in ipairs(titles) do titles[j] = quoted(title) end
    out:write(table.concat(titles, ","), "\n")
    for i = 1, #sol.t do
      local row = {}
      for j, column in ipairs(columns) do row[j] = ("%.17g"):format(column[i]) end
      out:write(table.concat(row, ","), "\n")
    end
    out:close()
  end }

doc { name = "load", module = "files", sig = "load(file) -> value",
  text = [[Runs a Lua file ("model.lua") and returns its value: what save wrote. Anything else is Lua's own
    load, which compiles a chunk.]],
  example = 'load "return 1 + 1"()', gives = "2",
  function(chunk, ...)
    local is_file = type(chunk) == "string" and select("#", ...) == 0 and chunk:find "^[^\n]*%.lua$" ~= nil
    if not is_file then return lua_load(chunk, ...) end
    local file = io.open(chunk)
    if not file then fail("load: there is no file '" .. chunk .. "'") end
    file:close()
    local run, why = loadfile(chunk)
    if not run then fail("load: " .. why) end
    return run()
  end }
