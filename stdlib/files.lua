-- save and load: models and expressions as files; the values of a solution as a table with commas.

local lua_load = load
local source_of

-- A value as LaTeX for a page: formulas displayed, what is text or an environment already as it is.
local function fragment_of(value)
  if type(value) == "string" then return value end
  local good, latex = pcall(function() return value:latex() end)
  if not good and type(value) == "table" and type(value.latex) == "function" then
    good, latex = pcall(value.latex, value)
  end
  if not good then
    fail("save: " .. (object_type(value) or type(value))
      .. " has no latex(); a .tex file takes models, derivations, "
      .. "expressions, tableaus, identified models, or a list of these and of texts")
  end
  local is_inner = latex:find "^%s*\\begin{aligned}" or latex:find "^%s*\\begin{array}"
  local is_page = not is_inner and (latex:find "^%s*\\begin{align" or latex:find "\\begin{equation"
    or latex:find "\\\\\n%a")
  return is_page and latex or "\\begin{equation*}\n" .. latex .. "\n\\end{equation*}"
end

local function document_of(value)
  local is_list = type(value) == "table" and getmetatable(value) == nil
  local parts = {}
  for _, part in ipairs(is_list and value or { value }) do parts[#parts + 1] = fragment_of(part) end
  local preamble = {
    "\\documentclass[11pt,a4paper]{article}", "\\usepackage[T1]{fontenc}", "\\usepackage{amsmath}",
    "\\usepackage[margin=25mm]{geometry}", "\\setlength{\\parindent}{0pt}", "\\allowdisplaybreaks",
  }
  return table.concat(preamble, "\n") .. "\n\\begin{document}\n" .. table.concat(parts, "\n\n")
    .. "\n\\end{document}\n"
end

doc { name = "save", module = "files", title = "Files", sig = "save(file, value)",
  text = [[Writes a model, an expression, a matrix, an equation, a start, data, a linear system, a number, a
    text or a table of these to a file that load turns into the same value, in a new session too. A
    model keeps its name, parameter values and the form it was reduced to. A file named .tex is a
    LaTeX document that compiles as it is: of whatever has latex() (models, derivations, expressions,
    tableaus, identified models), or of a list of these and of texts. A solution is kept as a table
    { model, t, values, status, state }: the saved times, the values by name, and the start at its end. The
    file appears complete or not at all.]],
  example = [[
    x = var "x"
    name = os.tmpname() .. ".lua"
    save(name, dae{ der(x) ~ -2*x })
    return load(name).kind]], gives = "ODE",
  function(file, value)
    if type(file) ~= "string" then fail 'save: expected a file name first, as in save("model.lua", sys)' end
    source_of = source_of or include "saving"
    write_file(file, file:find "%.tex$" and document_of(value) or source_of(value), "save")
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
    for j, title in ipairs(titles) do titles[j] = quoted(title) end
    local lines = { table.concat(titles, ",") }
    for i = 1, #sol.t do
      local row = {}
      for j, column in ipairs(columns) do row[j] = ("%.17g"):format(column[i]) end
      lines[#lines + 1] = table.concat(row, ",")
    end
    lines[#lines + 1] = ""
    write_file(file, table.concat(lines, "\n"), "csv")
  end }

local function read_file(name)
  local file, why = io.open(name, "rb")
  if not file then
    if not why:find "No such file" then fail("load: cannot read " .. why) end
    fail("load: there is no file '" .. name .. "'")
  end
  local text
  text, why = file:read "a"
  file:close()
  if not text then fail(("load: cannot read '%s': %s"):format(name, why)) end
  return text
end

local read_saved

-- The sweep in a store, without making any run.
local function load_sweep(file)
  local info = store_info(file)
  if info.hidden:find "inputs" then
    fail(("load: the store '%s' does not hold %s, Lua functions of the script that made it; call the sweep "
      .. "of that script again: what is there is not computed twice"):format(file, info.hidden))
  end
  local sys = read_saved(info.model, file)
  local options = read_saved(info.options, file, { sys = sys })
  options.store, options.open = file, true
  return sweep(sys, options)
end

doc { name = "load", module = "files", sig = "load(file) -> value",
  text = [[The value in a file that save wrote ("model.lua"). The file is read as data: it can name symbols,
    functions and models of the vocabulary and nothing else, so a file from somebody else can be opened
    without looking into it; also the sweep in a store ("runs.db"). A Lua program is run by dofile. Anything
    but a file name is Lua's own load, which compiles a chunk.]],
  example = 'load "return 1 + 1"()', gives = "2",
  function(chunk, ...)
    if type(chunk) ~= "string" and type(chunk) ~= "function" then
      fail(("load: expected a file name, a chunk of Lua text or a function that gives its pieces, got %s")
        :format(type(chunk)))
    end
    local lone = type(chunk) == "string" and select("#", ...) == 0
    local is_file, is_store = lone and chunk:find "^[^\n]*%.lua$", lone and chunk:find "^[^\n]*%.db$"
    if not is_file and not is_store then return lua_load(chunk, ...) end
    read_saved = read_saved or include "saved"
    if is_store then return load_sweep(chunk) end
    return read_saved(read_file(chunk), chunk)
  end }
