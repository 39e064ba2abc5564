-- What a user hands to plot and its relatives: options, columns, labels.

local unpack = table.unpack
local M = {}


-- { title = … }, and {} after complete data; plot(x, {}) is a mistake with an empty y.
local function is_options(value, count)
  return type(value) == "table" and value[1] == nil and (next(value) ~= nil or count > 2)
end

-- The arguments without the table of options at their end; the options, checked.
function M.split_options(by, known, ...)
  local arguments = table.pack(...)
  for i = 1, arguments.n do
    if arguments[i] == nil then fail(("%s: argument %d is nil"):format(by, i)) end
  end
  local options = {}
  if is_options(arguments[arguments.n], arguments.n) then
    options = arguments[arguments.n]
    arguments[arguments.n], arguments.n = nil, arguments.n - 1
  end
  return arguments, check_options(by, options, known)
end

function M.is_solution(value) return object_type(value) == "solution" end

-- A hole would make a shorter list: it is reported.
function M.check_holes(by, list)
  local last = 0
  for key in pairs(list) do
    if math.type(key) ~= "integer" or key < 1 then
      fail(("%s: a list of expressions has no key '%s'; options are a table of their own"):format(by,
        tostring(key)))
    end
    last = math.max(last, key)
  end
  for i = 1, last do
    if list[i] == nil then fail(("%s: entry %d of the list is nil"):format(by, i)) end
  end
  return list
end

-- Columns inside a list, as in plot(x, {y1, y2}). Constants such as sqrt(2) are numbers, not columns.
function M.is_list_of_columns(value)
  return type(value) == "table" and (type(value[1]) == "table" or object_type(value[1]) == "matrix")
end

-- ── labels ─────────────────────────────────────────────────────────────────────────────────────────────────

function M.size(value) return value.rows * value.cols end

-- One label for each scalar in an expression or a column of them; figure{} finds the words for an expression.
function M.labels_of(expression, into)
  if object_type(expression) ~= "matrix" then
    into[#into + 1] = object_type(expression) and expression or tostring(expression)
  else
    for i = 1, M.size(expression) do M.labels_of(expression[i], into) end
  end
  return into
end

-- The same expression of several solutions is told apart by the number of the solution.
function M.add_suffixes(series)
  local times = {}
  for _, each in ipairs(series) do
    for _, label in ipairs(each.suffix and each.labels or {}) do
      local words = label_text(label)
      times[words] = (times[words] or 0) + 1
    end
  end
  for _, each in ipairs(series) do
    if each.suffix then
      for k, label in ipairs(each.labels) do
        local words = label_text(label)
        if times[words] > 1 then each.labels[k] = words .. each.suffix end
      end
      each.suffix = nil
    end
  end
end

-- options.labels = "x" or { "x", "y" } spread over the series in the order of their columns.
function M.spread_labels(by, series, options)
  local given = options.labels
  if given == nil then return end
  if type(given) ~= "table" then given = { given } end
  local at = 1
  for _, each in ipairs(series) do
    each.labels = { unpack(given, at, at + each.count - 1) }
    at = at + each.count
  end
  if #given >= at then
    fail(("%s: option 'labels' has %d labels for %d curve%s"):format(by, #given, at - 1,
      at == 2 and "" or "s"))
  end
end

return M
