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

-- ── going on from a solution ───────────────────────────────────────────────────────────────────────────────

-- The values of the parameters of a run.
local function parameters_of(sol)
  local values = {}
  for i = 1, #sol.model.parameters do
    local p = sol.model.parameters[i]
    values[p] = sol:final(p)
  end
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
    local model, fix, guess = sol.model, {}, {}
    time = time or sol.t[#sol.t]
    for i = 1, #model.differential do fix[model.differential[i]] = sol(model.differential[i], time) end
    for i = 1, #model.algebraic do guess[model.algebraic[i]] = sol(model.algebraic[i], time) end
    return model:init { fix = fix, guess = guess, from = time, params = parameters_of(sol),
      nearest = model.form == "",
      consistent = model.form == "", inputs = options and options.inputs }
  end }

local function options_behind_a_start()
  local rows = {}
  for _, row in ipairs(options_of "model:integrate") do
    if row.name ~= "start" and row.name ~= "from" then rows[#rows + 1] = row end
  end
  return rows
end

doc { name = "solution:continue", module = "integrate", sig = "sol:continue{ to =, … } -> solution",
  text = "Integrates on from the end of a solution; the options are those of integrate, without start "
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
