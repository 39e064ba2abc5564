-- explain_step(sys, method): the equations of one step, their Jacobian and Newton's method, as an exam asks
-- for them.

local model_parts = include "algebra/model_parts"

local most_written = 24        -- rows of r and M that are still a formula on paper

local function parts_of(sys)
  local kind = sys.kind
  local p
  if kind ~= "fully implicit" and kind ~= "implicit ODE" then p = model_parts.semi_explicit(sys) end
  p = p or model_parts.implicit(sys)
  p.inputs, p.rates = model_parts.entries(sys.inputs), {}
  for i, x in ipairs(p.x) do p.rates[i] = der(x) end
  for _, list in ipairs { p.f or {}, p.g or {}, p.F or {} } do
    for _, e in ipairs(list) do p.timed = p.timed or subs(e, { [pendula.t] = param "t_k" }) ~= e end
  end
  return p
end

local function heading(p, method)
  local model = p.F and "F(x′, x, z, u) = 0" or #p.z > 0 and "x′ = f(x, z, u), 0 = g(x, z, u)"
    or "x′ = f(x, u)"
  return ("One step of %s for %s,  n_x = %d, n_z = %d%s"):format(method.name, model, #p.x, #p.z,
    object_type(method) == "tableau" and ", s = " .. method.stages or "")
end

-- The symbols of r as they are written elsewhere: dt, x_new, x_old_a, x_old_b … are Δt, x_{k+1}, x_{k-1} …
local function in_notation(text)
  text = text:gsub("([xzu])_new", "%1_{k+1}"):gsub("x_old_(%l)", function(letter)
    return "x_{k-" .. letter:byte() - 96 .. "}"
  end)
  return (text:gsub("%f[%w_]dt%f[^%w_]", "Δt"))
end

local function in_latex_notation(latex)
  local function old(letter) return "_{k-" .. letter:byte() - 96 end
  latex = latex:gsub("_{\\mathrm{new}", "_{k+1"):gsub("_{\\mathrm{old\\_(%l)}", old)
  latex = latex:gsub("_{new,", "_{k+1,"):gsub("_{old_(%l)", old)
  return (latex:gsub("\\mathrm{dt}", "\\Delta t"))
end

local function written(result)
  local text = result.text
  if result.r and #result.r <= most_written then
    local names = {}
    for i = 1, #result.w do names[i] = tostring(result.w[i]) end
    text = text .. "\nWritten out, with w = (" .. table.concat(names, ", ") .. ")"
      .. (result.inputs and " and uᵢ the input at stage i:" or ":")
    for i = 1, #result.r do text = text .. "\n     0 = " .. tostring(result.r[i]) end
  end
  return in_notation(text)
end

local kinds = {
  tableau = include "steps/runge_kutta".runge_kutta,
  multistep = include "steps/multistep".multistep,
  rosenbrock = include "steps/rosenbrock".rosenbrock,
}

-- The methods that integrate takes by name; those of variable order at an order that fills a line.
local function named_method(name)
  if name == "radau" then return rk.radau(3) end
  if name == "gauss" then return rk.gauss(3) end
  if name == "bdf" then return bdf(2) end
  for _, family in ipairs { rk, rosenbrock } do
    local known, method = pcall(function() return family[name] end)
    if known then return method end
  end
end

local function explain_step(sys, method)
  sys = as_model(sys)
  if object_type(sys) ~= "model" then
    fail "explain_step: expected a model and a method: explain_step(sys, rk.gauss(2))"
  end
  if type(method) == "string" then method = named_method(method) end
  local make = kinds[object_type(method) or ""]
  if not make then
    fail 'explain_step: expected a method: rk.gauss(2), bdf(2), rosenbrock.rodas4, "radau", "dopri5"'
  end
  local p, result = parts_of(sys), {}
  local lines = make(p, method, result)
  table.insert(lines, 1, heading(p, method))
  result.text = table.concat(lines, "\n")
  result.inputs = object_type(method) == "tableau" and #p.inputs > 0
  function result.latex()
    local report = include "latex_report"
    local told = report.fragment(in_notation(result.text))
    if not result.r or #result.r > most_written then return told end
    local rows, longest = {}, 600            -- a wider matrix leaves the page
    for i = 1, #result.r do rows[i] = "  0 &= " .. report.broken(latex(result.r[i])) end
    local M = result.M:latex()
    if #M <= longest then rows[#rows + 1] = "  \\frac{\\partial r}{\\partial w} &= " .. M end
    return told .. "\n\\noindent Written out:\n\\begin{align*}\n"
      .. in_latex_notation(table.concat(rows, " \\\\\n")) .. "\n\\end{align*}"
  end
  return setmetatable(result, { __tostring = written, __name = "step" })
end

return { explain_step = explain_step }
