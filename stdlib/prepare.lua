-- sys:prepare{ … }: a run whose equations, form and method are fixed, to be called with other numbers.

-- What is fixed; everything else that integrate takes may be given with every call.
local fixed = { form = true, method = true, inputs = true, events = true, sensitivities = true, direct = true,
  guards = true }

local function names(set)
  local list = {}
  for name in pairs(set) do list[#list + 1] = name end
  table.sort(list)
  return list
end

local rows_of_integrate
local function of_integrate()
  rows_of_integrate = rows_of_integrate or options_of "model:integrate"
  return rows_of_integrate
end

local Run = { __name = "prepared run" }
Run.__index = Run
function Run.latex() fail "latex: a prepared run has no LaTeX text; its model and its solutions have" end

-- integrate checks the values; here only whether all names are known, which costs more to say than to see.
local known
local function has_known_names(options)
  if type(options) ~= "table" or getmetatable(options) then return false end
  if not known then
    known = {}
    for _, row in ipairs(of_integrate()) do known[row.name] = true end
  end
  for name in pairs(options) do if not known[name] then return false end end
  return true
end

function Run:__call(options)
  if not has_known_names(options) then options = check_options("a prepared run", options, of_integrate()) end
  local all = {}
  for name, value in pairs(self.options) do all[name] = value end
  for name, value in pairs(options) do
    if fixed[name] then
      fail(("a prepared run: '%s' was fixed by prepare; make another one, sys:prepare{ %s = … }, or give it "
        .. "to sys:integrate"):format(name, name))
    end
    all[name] = value
  end
  return self.model:integrate(all)
end

function Run:__tostring()
  local given = {}
  for _, name in ipairs(names(self.options)) do given[#given + 1] = name end
  return ("prepared run of a model with %s%s%s: run{ start =, to =, … }"):format(
    counted(#self.model.equations, "equation"), self.model.form ~= "" and ', form "' .. self.model.form
      .. '"' or "",
    #given > 0 and ", given: " .. table.concat(given, ", ") or "")
end

doc { name = "model:prepare", module = "integrate",
  sig = "sys:prepare{ form =, method =, inputs =, events =, sensitivities =, direct =, guards =, … } -> run",
  text = [[
    A run to be repeated with other numbers: run{ start =, params =, rtol =, to = } has the
    result of sys:reduce(form):integrate{ … } with all these options. The form is derived once, and data that
    depend on the equations alone are kept as long as the run is. Numbers given to prepare hold where a call
    gives none. run.model is the model that is integrated, run.options the given options.]],
  example = [[
    x, k = var "x", param "k"
    run = dae{ der(x) ~ -k*x }:prepare{ to = 1, rtol = 1e-10 }
    return ("%.4f"):format(run{ start = { x = 1 }, params = { k = 2 } }:final(x))]],
  gives = "0.1353", options_at = 2,
  options = function()
    return joined_options({ option("form", "string", "the form that is integrated; else the model itself") },
      of_integrate())
  end,
  function(sys, options)
    local given = {}
    for name, value in pairs(options) do given[name] = value end
    local model = sys
    if options.form ~= nil then
      model, given.form = sys:reduce(options.form), nil
    elseif not options.direct and sys.form == "" and sys:index() > 1 then
      fail('prepare: the model has index ' .. sys:index() .. '; give the form that is integrated, '
        .. 'form = "project", or direct = true')
    end
    return setmetatable({ model = model, options = given }, Run)
  end }
