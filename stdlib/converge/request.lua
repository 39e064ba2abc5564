-- What converge(sys, …) was asked for: the options, methods, steps and quantities, checked.

local function checked_options(sys, options)
  if object_type(sys) ~= "model" then
    fail("converge: expected a model first, converge(sys, { start = …, to = …, methods = {…}, dt = {…} "
      .. "}), got "
      .. (object_type(sys) or type(sys)))
  end
  if options.to == nil then fail "converge: the end is missing; give to = 2" end
  if options.start == nil then
    fail "converge: the start is missing; give start = { x = 1 } or a result of sys:init"
  end
  return options
end

-- The method that a name means with fixed steps: a family needs its number of stages or steps.
local function with_fixed_steps(name)
  local families = { radau = "rk.radau(3)", gauss = "rk.gauss(3)", bdf = "bdf(3)" }
  if not families[name] and name ~= "rodas" then return rk[name] end
  fail(('converge: method "%s" chooses its steps: give tolerances, rtol = { 1e-4, 1e-6 }, instead of dt%s')
    :format(name, families[name] and ", or a method with fixed steps, " .. families[name] or ""))
end

local function read_methods(options)
  local list = options.methods or options.method
  if list == nil then fail "converge: the methods are missing; give methods = { rk.rk4, rk.gauss(2) }" end
  if type(list) ~= "table" then list = { list } end
  if #list == 0 then fail "converge: methods is empty; give methods = { rk.rk4, rk.gauss(2) }" end
  local methods = {}
  for i, method in ipairs(list) do
    if type(method) ~= "string" and not object_type(method) then
      fail(("converge: methods[%d] must be a tableau or the name of a method, not a %s"):format(i,
        type(method)))
    end
    local each = { method = method, name = type(method) == "string" and method or method.name }
    if type(method) == "string" and not options.rtol then each.method = with_fixed_steps(method) end
    if type(each.method) ~= "string" then each.order = each.method:order() end
    methods[i] = each
  end
  return methods
end

-- The steps (or tolerances), from the largest to the smallest.
local function read_steps(options)
  local key = options.rtol and "rtol" or "dt"
  if options.rtol and options.dt then
    fail "converge: give dt = {…} for fixed steps or rtol = {…} for chosen ones, not both"
  end
  local given = options[key]
  if given == nil then fail "converge: the steps are missing; give dt = { 0.1, 0.05, 0.025 }" end
  if type(given) == "number" then given = { given } end
  local steps = {}
  for i = 1, #given do
    local h = given[i]
    if type(h) == "userdata" and object_type(h) == "expr" then h = evaluate(h) end
    if type(h) ~= "number" or not (h > 0) or h == math.huge then
      fail(("converge: %s[%d] = %s; it must be a positive number"):format(key, i, tostring(h)))
    end
    steps[i] = h
  end
  table.sort(steps, function(a, b) return a > b end)
  for i = 2, #steps do
    if steps[i] == steps[i - 1] then fail(("converge: %s contains %g twice"):format(key, steps[i])) end
  end
  if #steps < 2 then
    fail(("converge: a slope needs at least two values; give %s = { 0.1, 0.05, 0.025 }"):format(key))
  end
  return steps, key
end

local function contains(list, what)
  for i = 1, #list do if list[i] == what then return true end end
  return false
end

local function names_of(list)
  local names = {}
  for i = 1, #list do names[i] = tostring(list[i]) end
  return table.concat(names, ", ")
end

local function name_of(e) return e.name or tostring(e) end

-- exact = { x = …, [z] = …, [p] = { …, …, … }, [x^2 + y^2] = 1 }, in the order of the model and not of the
-- table.
local function keyed_quantities(exact, states, algebraic, add)
  local left, names = {}, {}
  local function note(name, key, value)
    if left[name] then fail(("converge: exact gives '%s' twice"):format(name)) end
    left[name] = { key = key, value = value }
    names[#names + 1] = name
  end
  for key, value in pairs(exact) do
    local kind = object_type(key)
    if kind == "matrix" then
      if #value ~= #key then fail(("converge: exact: %d values for a column of %d"):format(#value, #key)) end
      for i = 1, #key do note(name_of(key[i]), key[i], value[i]) end
    else
      note(kind == "expr" and name_of(key) or tostring(key), kind == "expr" and key or nil, value)
    end
  end
  local model = {}
  for _, list in ipairs { states, algebraic } do
    for i = 1, #list do
      local each = list[i]
      model[#model + 1] = each.name
      if left[each.name] then
        add(each, left[each.name].value)
        left[each.name] = nil
      end
    end
  end
  table.sort(names)
  for _, name in ipairs(names) do
    if left[name] then
      if not left[name].key then
        fail(("converge: exact: '%s' is not a variable of the model.%s"):format(name,
          did_you_mean(name, model)))
      end
      add(left[name].key, left[name].value)
    end
  end
end

-- { { what = expression, exact = expression or nil, algebraic = boolean }, … }
local function read_quantities(sys, options)
  local states, algebraic, exact = sys.differential, sys.algebraic, options.exact
  local quantities = {}
  local function add(what, value)
    quantities[#quantities + 1] = { what = what, exact = value, algebraic = contains(algebraic, what) }
  end
  if exact == nil then
    for i = 1, #states do add(states[i]) end
    for i = 1, #algebraic do add(algebraic[i]) end
    return quantities
  end
  if type(exact) == "function" then
    local good, value = pcall(exact, named "t")
    if not good then
      fail("converge: exact is a function that cannot be followed with the symbol t: " .. tostring(value))
    end
    exact = value
  end
  if type(exact) == "table" and #exact == 0 then
    keyed_quantities(exact, states, algebraic, add)
    return quantities
  end
  local list = (type(exact) == "table" or object_type(exact) == "matrix") and exact or { exact }
  if #list ~= #states then
    fail(("converge: exact gives %d expression%s for %d states (%s); give exact = { %s = … }"):format(#list,
      #list == 1 and "" or "s", #states, names_of(states), tostring(states[1])))
  end
  for i = 1, #list do add(states[i], list[i]) end
  return quantities
end

return { options = checked_options, methods = read_methods, steps = read_steps, quantities = read_quantities,
  name_of = name_of }
