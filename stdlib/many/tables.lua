-- Tables of a sweep for other programs.
local tables = {}

local function columns(s, list)
  if list == nil then
    list = {}
    local model = s.model
    for _, part in ipairs { model.differential, model.algebraic } do
      for i = 1, #part do list[#list + 1] = part[i] end
    end
  elseif object_type(list) then
    list = { list }
  end
  local titles, values = { "run" }, {}
  for _, name in ipairs(s.names) do
    titles[#titles + 1], values[#values + 1] = name, s.params[name]
  end
  for _, e in ipairs(list) do
    local title = tostring(e)
    for _, name in ipairs(s.names) do if name == title then title = title .. " at the end" end end
    titles[#titles + 1], values[#values + 1] = title, s:final(e)
  end
  local why = {}
  for _, failure in ipairs(s.failures) do why[failure.index] = failure.why end
  return titles, values, why
end

local function csv_quoted(text)
  if text:find '[,"\n]' then return '"' .. text:gsub('"', '""') .. '"' end
  return text
end

function tables.csv(s, file, list)
  if type(file) ~= "string" then fail 'csv: expected a file name, as in s:csv "runs.csv"' end
  local titles, values, why = columns(s, list)
  titles[#titles + 1] = "failure"
  for i, title in ipairs(titles) do titles[i] = csv_quoted(title) end
  local lines = { table.concat(titles, ",") }
  for run = 1, #s do
    local row = { tostring(run) }
    for _, column in ipairs(values) do
      local v = column[run]
      row[#row + 1] = v == v and ("%.17g"):format(v) or ""
    end
    row[#row + 1] = csv_quoted((why[run] or ""):gsub("\n", " "))
    lines[#lines + 1] = table.concat(row, ",")
  end
  lines[#lines + 1] = ""
  write_file(file, table.concat(lines, "\n"), "csv")
end

local escapes = { ['"'] = '\\"', ["\\"] = "\\\\", ["\n"] = "\\n", ["\t"] = "\\t", ["\r"] = "\\r" }
local function json_text(text)
  return '"' .. text:gsub('[%c"\\]', function(c) return escapes[c] or ("\\u%04x"):format(c:byte()) end) .. '"'
end

function tables.json(s, file, list)
  if list == nil and type(file) ~= "string" then file, list = nil, file end
  if file ~= nil and type(file) ~= "string" then
    fail 'json: expected a file name first, as in s:json("runs.json", { x })'
  end
  local titles, values, why = columns(s, list)
  local lines = {}
  for run = 1, #s do
    local parts = { '"run": ' .. run }
    for i, column in ipairs(values) do
      local v = column[run]
      local finite = v == v and v ~= math.huge and v ~= -math.huge
      parts[#parts + 1] = json_text(titles[i + 1]) .. ": " .. (finite and ("%.17g"):format(v) or "null")
    end
    if why[run] then parts[#parts + 1] = '"failure": ' .. json_text(why[run]) end
    lines[run] = "  { " .. table.concat(parts, ", ") .. " }"
  end
  local text = "[\n" .. table.concat(lines, ",\n") .. "\n]\n"
  if file then write_file(file, text, "json") end
  return text
end

return tables
