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
    local reason = tostring(latex):match "latex: (.*)"
      or "a " .. (object_type(value) or type(value)) .. " has no latex()"
    fail("save: " .. reason .. "; a .tex file takes every result that has latex(), "
      .. "figures, or a list of these and of texts")
  end
  local is_inner = latex:find "^%s*\\begin{aligned}" or latex:find "^%s*\\begin{array}"
  local is_page = not is_inner and (latex:find "^%s*\\begin{align" or latex:find "\\begin{equation"
    or latex:find "\\\\\n%a" or latex:find "\\noindent" or latex:find "\\begin{center}")
  return is_page and latex or "\\begin{equation*}\n" .. latex .. "\n\\end{equation*}"
end

-- A formula that is wider than its line is set smaller: nothing runs over the edge of the page.
local fitting = [[
\newsavebox{\formula}
\newcommand{\fitted}[2][\linewidth]{\sbox{\formula}{$\displaystyle #2$}%
  \ifdim\wd\formula>#1\resizebox{#1}{!}{\usebox{\formula}}\else#2\fi}]]

local function fitted(latex)
  latex = latex:gsub("\\begin{equation%*}\n(.-)\n\\end{equation%*}", function(body)
    local formula, tag = body:match "^(.-)%s*(\\tag{[^}]*})$"
    return ("\\begin{equation*}\n\\fitted{%s}%s\n\\end{equation*}"):format(formula or body,
      tag and " " .. tag or "")
  end)
  latex = latex:gsub("(\\hspace%*{%d+em}%$)([^$\n]+)(%$)", "%1\\fitted[0.9\\linewidth]{%2}%3")
  return (latex:gsub("\\begin{align%*?}\n.-\n\\end{align%*?}", function(rows)
    rows = rows:gsub("(&= )([^\n]-)( \\%a*tag)", "%1\\fitted[0.7\\linewidth]{%2}%3")
    return (rows:gsub("(\n  0 &= )([^\n\\][^\n]-)( ?\\?\\?\n)", "%1\\fitted[0.8\\linewidth]{%2}%3"))
  end))
end

-- Figure k of a document is a PDF file beside it, answer-1.pdf beside answer.tex.
local function picture_of(figure, file, k)
  local name = file:gsub("%.tex$", "-" .. k .. ".pdf")
  figure:save(name)
  return "\\begin{center}\\includegraphics[width=0.8\\textwidth]{" .. name:match "[^/]*$" .. "}\\end{center}"
end

local function document_of(value, file)
  local is_list = type(value) == "table" and getmetatable(value) == nil
  local parts, pictures = {}, 0
  for _, part in ipairs(is_list and value or { value }) do
    if object_type(part) == "figure" then pictures = pictures + 1 end
    parts[#parts + 1] = object_type(part) == "figure" and picture_of(part, file, pictures)
      or fitted(fragment_of(part))
  end
  local preamble = {
    "\\documentclass[11pt,a4paper]{article}", "\\usepackage[T1]{fontenc}",
    "\\usepackage{amsmath,graphicx}",
    "\\usepackage[margin=25mm]{geometry}", "\\setlength{\\parindent}{0pt}", "\\allowdisplaybreaks",
    fitting,
  }
  return table.concat(preamble, "\n") .. "\n\\begin{document}\n" .. table.concat(parts, "\n\n")
    .. "\n\\end{document}\n"
end

-- A name that MATLAB takes: x′ is x_dot, motor.w motor_w, q[1] q_1.
local function plain_name(name, taken)
  local plain = name:gsub("\u{2032}", "_dot"):gsub("'", "_dot"):gsub("[^%w_]+", "_"):gsub("_+$", "")
  if not plain:find "^%a" then plain = "x_" .. plain end
  local free, number = plain, 1
  while taken[free] do
    number = number + 1
    free = plain .. "_" .. number
  end
  taken[free] = true
  return free
end

-- The columns of a solution, or the numbers, lists and matrices in a table, as a list of { name, matrix }.
local function matrices_of(value)
  local list, taken = {}, {}
  local function add(name, item)
    local good, matrix = pcall(function() return type(item) == "number" and { item } or item end)
    if good and (type(matrix) == "table" or object_type(matrix) == "matrix") then
      list[#list + 1] = { plain_name(name, taken), matrix }
    end
  end
  if object_type(value) == "solution" then
    add("t", value.t)
    for _, part in ipairs { value.model.differential, value.model.algebraic } do
      for i = 1, #part do add(tostring(part[i]), value(part[i])) end
    end
  elseif type(value) == "table" and getmetatable(value) == nil then
    local names = {}
    for name in pairs(value) do
      if type(name) == "string" then names[#names + 1] = name end
    end
    table.sort(names)
    for _, name in ipairs(names) do add(name, value[name]) end
  else
    add("x", value)
  end
  if #list == 0 then
    fail 'save: a .mat file takes solutions, data, matrices, and tables { name = matrix }'
  end
  return list
end

local function save_mat(file, value)
  if object_type(value) == "iddata" then return value:save(file) end
  write_mat(file, matrices_of(value))
end

doc { name = "save", module = "files", title = "Files", sig = "save(file [, value])",
  text = [[Writes a value to a file that load turns into the same value, in a new session too: models (with
    name, parameter values and form), expressions, matrices, equations, starts, data, linear systems,
    tableaus, distributions, solutions (with the interpolation between their points), figures, numbers, texts
    and tables of these. Estimates (fit, arx, spa, …), newton, converge and sweeps in memory are kept as the
    call that made them, which load makes again. Of any other result the fields are kept, as a table. A
    solution keeps the options of integrate except Lua functions: inputs become expressions or
    samples. A sweep in a store (sweep{ …, store = "runs.db" }) is there already. save "work.pend" without a
    value keeps all variables of the session. The ending chooses other formats: .tex is a LaTeX
    document of whatever has latex(), or of a list of these, of figures (PDF files beside it) and of texts;
    .mat is a MATLAB file of a solution, data, or a table of numbers and matrices. The file appears
  complete or not at all.]], example = [[
    x = var "x"
    name = os.tmpname() .. ".lua"
    save(name, dae{ der(x) ~ -2*x }:integrate{ start = { x = 1 }, to = 1, rtol = 1e-9, atol = 1e-9 })
    return ("%.6f"):format(load(name)(x, 0.5))]], gives = "0.367879",
  function(file, ...)
    if type(file) ~= "string" then fail 'save: expected a file name first, as in save("model.lua", sys)' end
    if select("#", ...) == 0 then
      if file:find "%.pend$" then return save_session(file) end
      fail 'save: expected a value second; save "work.pend" saves all variables of the session'
    end
    local value = ...
    if file:find "%.mat$" then return save_mat(file, value) end
    source_of = source_of or include("saving").text
    write_file(file, file:find "%.tex$" and document_of(value, file) or source_of(value), "save")
  end }

-- A column title is quoted where it contains a comma or a quote.
local function quoted(title)
  if title:find '[,"\n]' then return '"' .. title:gsub('"', '""') .. '"' end
  return title
end

-- The columns of a table of values: t, then every entry of every expression.
local function csv_columns(sol, list, times)
  local titles, columns = { "t" }, { times or sol.t }
  for _, expression in ipairs(list) do
    local values = times and sol(expression, times) or sol(expression)
    local entries = values.cols == 1 and { expression } or expression
    for j = 1, values.cols do
      titles[#titles + 1] = tostring(entries[j])
      columns[#columns + 1] = values:col(j)
    end
  end
  return titles, columns
end

local csv_options = { option("times", "list", "the times of the rows; without it those that were saved") }

doc { name = "solution:csv", module = "files", sig = 'sol:csv(file [, { expressions }] [, { times = }])',
  text = [[Writes the saved times and values as a table with commas and a line of titles: the states and
    algebraic variables, or the expressions that are named. 17 digits, so that reading it gives the same
    numbers. iddata reads tables with equal steps: sol:csv("run.csv", { times = linspace(0, 10, 201) }).]],
  options = csv_options,
  example = [[x = var "x"
sol = dae{ der(x) ~ -2*x }:integrate{ start = { x = 1 }, to = 1, dt = 0.5, method = rk.euler }
name = os.tmpname()
sol:csv(name)
for line in io.lines(name) do print(line) end]], gives = "t,x\n0,1\n0.5,0\n1,0",
  function(sol, file, list, options)
    if options == nil and type(list) == "table" and #list == 0 then list, options = nil, list end
    local times = check_options("csv", options or {}, csv_options).times
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
    local titles, columns = csv_columns(sol, list, times)
    for j, title in ipairs(titles) do titles[j] = quoted(title) end
    local lines = { table.concat(titles, ",") }
    for i = 1, #columns[1] do
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

-- What is in a store; errors in the name of the function that the user called.
function info_of_store(by, file)
  local good, info = pcall(store_info, file)
  if good then return info end
  if type(info) ~= "string" then error(info, 0) end  -- an interrupt
  fail(by .. ": " .. info:gsub("^.-store_info: ", "", 1))
end

-- The sweep in a store, without making any run.
local function load_sweep(file)
  local info = info_of_store("load", file)
  if info.hidden:find "inputs" then
    fail(("load: the store '%s' does not hold %s, Lua functions of the script that made it; call the sweep "
      .. "of that script again: stored runs are not computed again"):format(file, info.hidden))
  end
  local sys = read_saved(info.model, file)
  local options = read_saved(info.options, file, { sys = sys })
  options.store, options.open = file, true
  return sweep(sys, options)
end

doc { name = "load", module = "files", sig = "load(file) -> value or load(chunk [, name [, mode [, environment]]]) -> function",
  text = [[The value in a file that save wrote ("model.lua"). The file is read as data: it can name symbols,
    functions and models of the vocabulary and nothing else, so a file from somebody else can be opened
    without looking into it; also the sweep in a store ("runs.db"); load "run.mat" gives the
    matrices of a MATLAB file by name, iddata(load "d.mat") data; load "work.pend" sets the variables
    of a session. A Lua program is run by dofile. Anything but a file name is Lua's own load, which
    compiles a chunk.]],
  example = 'load "return 1 + 1"()', gives = "2",
  function(chunk, ...)
    if type(chunk) ~= "string" and type(chunk) ~= "function" then
      fail(("load: expected a file name, a chunk of Lua text or a function that gives its pieces, got %s")
        :format(type(chunk)))
    end
    local lone = type(chunk) == "string" and select("#", ...) == 0
    if lone and chunk:find "^[^\n]*%.mat$" then return read_mat(chunk) end
    local is_store = lone and chunk:find "^[^\n]*%.db$"
    local is_file = lone and (chunk:find "^[^\n]*%.lua$" or chunk:find "^[^\n]*%.pend$")
    if not is_file and not is_store then return lua_load(chunk, ...) end
    read_saved = read_saved or include "saved"
    if is_store then return load_sweep(chunk) end
    local text = read_file(chunk)
    if text:find "^%-%- A session" then return load_session(chunk) end
    return read_saved(text, chunk)
  end }
