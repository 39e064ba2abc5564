-- Small additions to models, written in Lua.

doc { name = "matrix_form:solve", module = "mech", sig = "form:solve() -> column",
  text = "The unknowns [q″; z] of the matrix form, solved symbolically.",
  example = [[
    q = var "q"
    return lagrange{ q = q, T = q.dot^2, V = 3*q^2 }.matrix_form:solve()]], gives = "-3 q",
  function(form)
    if object_type(form) ~= "matrix_form" then
      fail "solve: expected a matrix form, as in sys.matrix_form:solve()"
    end
    return solve(form.A, form.c)
  end }

-- ── what is read by a name or a number that is no member ──

local function contains(column, name)
  for i = 1, #column do
    if tostring(column[i]) == name then return true end
  end
end

doc { name = "model:__index", module = "DAE", sig = "sys.m",
  text = "Always an error that says where the values of parameters and variables are.",
  example = "return pcall(function() return dae{ der(var 'x') ~ 1 }.x end)",
  gives = "false example:1: 'x' is a variable of the model: its values are those of a start or a solution, "
    .. "sol(x)",
  function(sys, key)
    if type(key) ~= "string" then return nil end
    if contains(sys.parameters, key) then
      fail(("'%s' is a parameter: its value is sys.values.%s, others sys:with{ %s = 2 }"):format(key, key,
        key))
    elseif contains(sys.differential, key) or contains(sys.algebraic, key) then
      fail(("'%s' is a variable of the model: its values are those of a start or a solution, sol(%s)"):format(
        key, key))
    end
  end }

doc { name = "solution:__index", module = "integrate", sig = "sol.x",
  text = "Always an error: the values of a variable are sol(x), those at a time sol(x, 2).",
  example = "x = var 'x'  sol = dae{ der(x) ~ 1 }:integrate{ start = { x = 1 }, to = 1 }\n"
    .. "return select(2, pcall(function() return sol.x end))",
  gives = "example:2: 'x' is a variable: its values are sol(x), at a time sol(x, 2)",
  function(sol, key)
    if key == "start" or key == "y0" or key == "x0" then
      fail(("the start of a solution is sol:state(sol.t[1]), a start at any time sol:state(t)"))
    elseif type(key) == "number" then
      fail(("a solution has no entries: the values of x are sol(x), the times sol.t[%s]"):format(key))
    elseif contains(sol.model.differential, key) or contains(sol.model.algebraic, key) then
      fail(("'%s' is a variable: its values are sol(%s), at a time sol(%s, 2)"):format(key, key, key))
    end
  end }

-- ── going on from a solution ───────────────────────────────────────────────────────────────────────────────

-- { [x[1]] = …, … } of a column at a time of a solution.
local function values_at(sol, column, time)
  local values, list = {}, #column > 0 and sol(column, time)
  for i = 1, #column do values[column[i]] = #column > 1 and list[i] or list end
  return values
end

doc { name = "solution:state", module = "integrate", sig = "sol:state([t [, { inputs = }]]) -> start",
  text = "The start at a time of a solution (its end): for another integrate, with other options or another "
    .. "form of "
    .. "the model. The parameters are those of the run; inputs are given again.",
  example = [[
    x = var "x"
    m = dae{ der(x) ~ -x }
    sol = m:integrate{ start = { x = 1 }, to = 1, rtol = 1e-10, atol = 1e-10 }
    return ("%.6f"):format(m:integrate{ start = sol:state(), to = 2, rtol = 1e-10, atol = 1e-10 }(x, 2))]],
  gives = "0.135335", options = { option("inputs", "table", "as in integrate", "", "@inputs") },
  options_at = 3,
  function(sol, time, options)
    local model = sol.model
    time = time or sol.t[#sol.t]
    return model:init { fix = values_at(sol, model.differential, time),
      guess = values_at(sol, model.algebraic, time), from = time,
      params = values_at(sol, model.parameters, sol.t[#sol.t]),
      nearest = model.form == "", consistent = model.form == "", declared = false,
      inputs = options and options.inputs }
  end }

local function options_behind_a_start()
  local rows = {}
  for _, row in ipairs(options_of "model:integrate") do
    if row.name ~= "start" and row.name ~= "from" then rows[#rows + 1] = row end
  end
  return rows
end

doc { name = "solution:continue", module = "integrate", sig = "sol:continue{ to =, … } -> solution",
  text = "Continues a solution from its end; the options are those of integrate, without start "
    .. "and from.",
  example = [[
    x = var "x"
    sol = dae{ der(x) ~ -x }:integrate{ start = { x = 1 }, to = 1, rtol = 1e-10, atol = 1e-10 }
    return ("%.6f"):format(sol:continue{ to = 2, rtol = 1e-10, atol = 1e-10 }(x, 2))]], gives = "0.135335",
  options = options_behind_a_start, options_at = 2,
  function(sol, options)
    local all = {}
    for key, value in pairs(options) do all[key] = value end
    all.start = sol:state(nil, { inputs = options.inputs })
    return sol.model:integrate(all)
  end }
