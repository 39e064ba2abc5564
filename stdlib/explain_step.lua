-- explain_step(sys, method): the equations of one step, their Jacobian and Newton's method, as an exam asks
-- for them.

local model_parts = include "algebra/model_parts"

local subscripts = { [0] = "₀", "₁", "₂", "₃", "₄", "₅", "₆", "₇", "₈", "₉" }
local function subscript(n)
  return (tostring(n):gsub("%d", function(d) return subscripts[tonumber(d)] end))
end

-- New unknowns for a list of states: one symbol, or a column.
local function stand_ins(name, like)
  if #like == 0 then return {} end
  if #like == 1 then return { var(name) } end
  return model_parts.entries(var(name, #like))
end

local function put(list, replacements)
  local result = {}
  for i, e in ipairs(list) do result[i] = next(replacements) and subs(e, replacements) or e end
  return result
end

local function pairing(from, to, into)
  for i, key in ipairs(from) do into[key] = to[i] end
  return into
end

local function indented(value, label)
  local lines, first = {}, true
  for line in tostring(value):gmatch "[^\n]+" do
    lines[#lines + 1] = "     " .. (first and label or (" "):rep(utf8.len(label))) .. line
    first = false
  end
  return table.concat(lines, "\n")
end

-- "1/4 K₁ + (1/4 - √3/6) K₂".
local function weighted_sum(coefficients_, names)
  local text = ""
  for i, c in ipairs(coefficients_) do
    if c ~= 0 then
      local shown = tostring(c)
      local minus = shown:sub(1, 1) == "-" and not shown:find(" [+-] ")
      if minus then shown = shown:sub(2) end
      if shown == "1" then shown = "" elseif shown:find " [+-] " then shown = "(" .. shown
        .. ") " else shown = shown .. " " end
      text = text .. (text == "" and (minus and "-" or "") or minus and " - " or " + ") .. shown .. names[i]
    end
  end
  return text == "" and "0" or text
end

-- "x_k", "x_k + Δt K₁", "x_k + Δt (1/2 K₁ + 1/2 K₂)".
local function stage_text(row, names)
  local sum, count = weighted_sum(row, names), 0
  for i = 1, #row do if row[i] ~= 0 then count = count + 1 end end
  if count == 0 then return "x_k" end
  return "x_k + Δt " .. (count == 1 and row[1] == 1 and sum or "(" .. sum .. ")")
end

-- ", u(t_k + 1/2 Δt)" where there are inputs.
local function input_text(p, c)
  if #p.inputs == 0 then return "" end
  return ", u(t_k" .. (c == 0 and "" or " + " .. weighted_sum({ c }, { "Δt" })) .. ")"
end

local function row_of(matrix, i)
  local row = {}
  for j = 1, matrix.cols do row[j] = matrix(i, j) end
  return row
end

local most_written = 24        -- rows of r and M that are still a formula on paper

-- ── Runge-Kutta ────────────────────────────────────────────────────────────────────────────────────────────

-- r(w) with w = (K₁, z₁, …): residuals of all stages, their unknowns, and the next x.
local function stages_of(p, tab, dt)
  local s, n = tab.stages, #p.x
  local K, z, w, r = {}, {}, {}, {}
  local xk = stand_ins("x_k", p.x)
  for i = 1, s do K[i], z[i] = stand_ins("K" .. i, p.x), stand_ins("z" .. i, p.z) end
  for i = 1, s do
    local replacements, X = {}, {}
    for k = 1, n do
      local sum = 0
      for j = 1, s do sum = sum + tab.A(i, j)*K[j][k] end
      X[k] = xk[k] + dt*sum
    end
    pairing(p.x, X, replacements)
    pairing(p.z, z[i], replacements)
    local function add(list) for _, e in ipairs(list) do r[#r + 1] = e end end
    if p.F then
      for k, x in ipairs(p.x) do replacements[der(x)] = K[i][k] end
      add(put(p.F, replacements))
    else
      local f = put(p.f, replacements)
      for k = 1, n do f[k] = K[i][k] - f[k] end
      add(f)
      add(put(p.g, replacements))
    end
    for _, unknown in ipairs(K[i]) do w[#w + 1] = unknown end
    for _, unknown in ipairs(z[i]) do w[#w + 1] = unknown end
  end
  return r, w
end

local function explicit_lines(p, tab, add)
  add "Stages, each from those before it:"
  for i = 1, tab.stages do
    add(("     K%s = f(%s%s)"):format(subscript(i), stage_text(row_of(tab.A, i), p.K),
      input_text(p, tab.c[i])))
  end
  add(indented(#p.f == 1 and p.f[1] or vec(p.f), "f = "))
  add "No equations have to be solved: no Newton iterations."
end

local function stage_lines(p, tab, add)
  local s, z = tab.stages, #p.z > 0
  add(("Unknowns of a step:  w = (%s),  s (n_x + n_z) = %d (%d + %d) = %d"):format(
    (function()
      local names = {}
      for i = 1, s do
        names[#names + 1] = "K" .. subscript(i)
        if z then names[#names + 1] = "z" .. subscript(i) end
      end
      return table.concat(names, ", ")
    end)(), s, #p.x, #p.z, s*(#p.x + #p.z)))
  add "Stages:"
  for i = 1, s do
    add(("     X%s = %s"):format(subscript(i), stage_text(row_of(tab.A, i), p.K)))
  end
  add "Equations r(w, x_k) = 0, for every stage:"
  for i = 1, s do
    local at = input_text(p, tab.c[i])
    local n = subscript(i)
    if p.F then
      add(("     F(K%s, X%s%s%s) = 0"):format(n, n, z and ", z" .. n or "", at))
    else
      add(("     K%s - f(X%s%s%s) = 0"):format(n, n, z and ", z" .. n or "", at))
      if z then add(("     g(X%s, z%s%s) = 0"):format(n, n, at)) end
    end
  end
end

local function block_lines(p, tab, add)
  local z = #p.z > 0
  add "Jacobian M = ∂r/∂w in blocks of stage i (rows) and stage j (columns), δᵢⱼ = 1 where i = j, else 0:"
  if p.F then
    add("     M_ij = [ δᵢⱼ F_x′ + Δt aᵢⱼ F_x" .. (z and ",  δᵢⱼ F_z ]" or " ]"))
    add(indented(jacobian(vec(p.F), vec(p.rates)), "F_x′ = "))
    add(indented(jacobian(vec(p.F), vec(p.x)), "F_x = "))
    if z then add(indented(jacobian(vec(p.F), vec(p.z)), "F_z = ")) end
  else
    add("     M_ij = [ δᵢⱼ I - Δt aᵢⱼ f_x" .. (z and ",  -δᵢⱼ f_z;  Δt aᵢⱼ g_x,  δᵢⱼ g_z ]" or " ]"))
    add(indented(jacobian(vec(p.f), vec(p.x)), "f_x = "))
    if z then
      add(indented(jacobian(vec(p.f), vec(p.z)), "f_z = "))
      add(indented(jacobian(vec(p.g), vec(p.x)), "g_x = "))
      add(indented(jacobian(vec(p.g), vec(p.z)), "g_z = "))
    end
  end
  add "     evaluated at (X_i, z_i) of the row."
end

local function newton_lines(add, start)
  add "Newton's method:  repeat"
  add "     solve M Δw = -r(w, x_k),  w ← w + α Δw   (α = 1, or smaller where ‖r‖ would grow)"
  add("     until ‖r(w, x_k)‖ ≤ tol;  start: " .. start)
end

local function last_row(tab)
  for j = 1, tab.stages do if tab.A(tab.stages, j) ~= tab.b[j] then return false end end
  return true
end

local function runge_kutta(p, tab, result)
  local lines = {}
  local function add(line) lines[#lines + 1] = line end
  p.K = {}
  for i = 1, tab.stages do p.K[i] = "K" .. subscript(i) end
  local explicit = tab:is "explicit" and not p.F and #p.z == 0
  if explicit then
    explicit_lines(p, tab, add)
  else
    stage_lines(p, tab, add)
    local r, w = stages_of(p, tab, param "dt")
    result.r, result.w = vec(r), vec(w)
    result.M = jacobian(result.r, result.w)
    block_lines(p, tab, add)
    newton_lines(add, "K and z of the last step, at first K = 0 and the given z")
    result.size = #w
  end
  local b = {}
  for i = 1, tab.stages do b[i] = tab.b[i] end
  add "Step:"
  add("     x_{k+1} = " .. stage_text(b, p.K))
  if #p.z > 0 then
    add(last_row(tab) and ("     z_{k+1} = z" .. subscript(tab.stages)
      .. " (stiffly accurate: the last stage is the step)")
      or p.F and "     z_{k+1} from F(x′, x_{k+1}, z) = 0" or "     z_{k+1} from 0 = g(x_{k+1}, z_{k+1})")
  end
  return lines
end

-- ── BDF ────────────────────────────────────────────────────────────────────────────────────────────────────

local function place(k) return k == 0 and "x_{k+1}" or k == 1 and "x_k" or "x_{k-" .. (k - 1) .. "}" end

local function bdf_step(p, method, result)
  local lines = {}
  local function add(line) lines[#lines + 1] = line end
  local alpha, m = method.alpha, method.steps
  local lead = alpha[1]
  local past, names = {}, {}
  for j = 1, m do past[j], names[j] = simplify(alpha[j + 1]/lead), place(j) end
  local b = simplify(1/lead)
  local history = weighted_sum(past, names)
  local z = #p.z > 0
  add(("Unknowns of a step:  w = (x_{k+1}%s),  n_x + n_z = %d + %d = %d"):format(z and ", z_{k+1}" or "",
    #p.x, #p.z,
    #p.x + #p.z))
  add "Equations r(w) = 0:"
  local x1, z1 = stand_ins("x1", p.x), stand_ins("z1", p.z)
  local old = {}
  for j = 1, m do old[j] = stand_ins("x_" .. (j == 1 and "k" or "k" .. (j - 1)), p.x) end
  local replacements = pairing(p.z, z1, pairing(p.x, x1, {}))
  local dt, r, w = param "dt", {}, {}
  local minus = history:sub(1, 1) == "-" and " - " .. history:sub(2) or " + " .. history
  local step = b == 1 and "Δt" or tostring(b) .. " Δt"
  local differences = {}
  for i = 1, #p.x do
    differences[i] = x1[i]
    for j = 1, m do differences[i] = differences[i] + past[j]*old[j][i] end
  end
  if p.F then
    add(("     F((x_{k+1}%s)/(%s), x_{k+1}%s, u_{k+1}) = 0"):format(minus, step, z and ", z_{k+1}" or ""))
    for i, x in ipairs(p.x) do replacements[der(x)] = differences[i]/(b*dt) end
    for _, e in ipairs(put(p.F, replacements)) do r[#r + 1] = e end
  else
    local arguments_ = "x_{k+1}" .. (z and ", z_{k+1}" or "") .. (#p.inputs > 0 and ", u_{k+1}" or "")
    add(("     x_{k+1}%s - %s f(%s) = 0"):format(minus, step, arguments_))
    if z then add(("     g(%s) = 0"):format(arguments_)) end
    for i, e in ipairs(put(p.f, replacements)) do r[i] = differences[i] - b*dt*e end
    for _, e in ipairs(put(p.g, replacements)) do r[#r + 1] = e end
  end
  for _, list in ipairs { x1, z1 } do for _, unknown in ipairs(list) do w[#w + 1] = unknown end end
  result.r, result.w, result.size = vec(r), vec(w), #w
  result.M = jacobian(result.r, result.w)
  add "Jacobian M = ∂r/∂w:"
  if p.F then
    add(("     M = [ F_x′/(%s) + F_x%s ]"):format(step, z and ",  F_z" or ""))
  else
    add(("     M = [ I - %s f_x%s ]"):format(step, z and (",  -%s f_z;  g_x,  g_z"):format(step) or ""))
    add(indented(jacobian(vec(p.f), vec(p.x)), "f_x = "))
    if z then
      add(indented(jacobian(vec(p.f), vec(p.z)), "f_z = "))
      add(indented(jacobian(vec(p.g), vec(p.x)), "g_x = "))
      add(indented(jacobian(vec(p.g), vec(p.z)), "g_z = "))
      add "     regular for small Δt where g_z is (index 1)."
    end
  end
  newton_lines(add, "the values extrapolated from the last steps")
  add(("Step:  x_{k+1}%s the solution; %s."):format(z and " and z_{k+1} are" or " is",
    m == 1 and "no starting values are needed"
    or m == 2 and "the first step uses a method of order 1"
    or ("the first %d steps use methods of lower order"):format(m - 1)))
  return lines
end

-- ── Rosenbrock ─────────────────────────────────────────────────────────────────────────────────────────────

local function rosenbrock_step(p, method, result)
  local lines = {}
  local function add(line) lines[#lines + 1] = line end
  if p.F or #p.z > 0 then
    fail 'explain_step: Rosenbrock methods are explained for x′ = f(x); reduce first: sys:reduce "ode"'
  end
  local s, gamma = method.stages, method.gamma
  local function shown(v) return ("%.8g"):format(v) end
  local J = jacobian(vec(p.f), vec(p.x))
  add(("Matrix of the step, factored once, with γ = %s:"):format(shown(gamma)))
  add "     M = I - Δt γ J,  J = ∂f/∂x at (t_k, x_k)"
  add(indented(J, "J = "))
  add "Stages, one linear system each:"
  for i = 1, s do
    local inner, outer = "", ""
    for j = 1, i - 1 do
      local a, g = method.alpha(i, j), method.Gamma(i, j)
      if a ~= 0 then inner = inner .. (" + %s k%s"):format(shown(a), subscript(j)) end
      if g ~= 0 then outer = outer .. (" + %s k%s"):format(shown(g), subscript(j)) end
    end
    add(("     M k%s = Δt f(x_k%s)%s"):format(subscript(i), inner,
      outer ~= "" and " + Δt J (" .. outer:sub(4) .. ")" or ""))
  end
  local sum = ""
  for i = 1, s do sum = sum .. (" + %s k%s"):format(shown(method.b[i]), subscript(i)) end
  add "No Newton iterations: the method is linearly implicit."
  add("Step:  x_{k+1} = x_k" .. sum)
  result.M = eye(#p.x) - param "dt"*param "gamma"*J
  return lines
end

-- ── the answer ─────────────────────────────────────────────────────────────────────────────────────────────

local function parts_of(sys)
  local kind = sys.kind
  local p
  if kind ~= "fully implicit" and kind ~= "implicit ODE" then p = model_parts.semi_explicit(sys) end
  p = p or model_parts.implicit(sys)
  p.inputs, p.rates = model_parts.entries(sys.inputs), {}
  for i, x in ipairs(p.x) do p.rates[i] = der(x) end
  return p
end

local function heading(p, method)
  local model = p.F and "F(x′, x, z, u) = 0" or #p.z > 0 and "x′ = f(x, z, u), 0 = g(x, z, u)"
    or "x′ = f(x, u)"
  return ("One step of %s for %s,  n_x = %d, n_z = %d%s"):format(method.name, model, #p.x, #p.z,
    object_type(method) == "tableau" and ", s = " .. method.stages or "")
end

local function written(result)
  local text = result.text
  if result.r and #result.r <= most_written then
    local names = {}
    for i = 1, #result.w do names[i] = tostring(result.w[i]) end
    text = text .. "\nWritten out, with w = (" .. table.concat(names, ", ") .. "):"
    for i = 1, #result.r do text = text .. "\n     0 = " .. tostring(result.r[i]) end
  end
  return text
end

local kinds = { tableau = runge_kutta, multistep = bdf_step, rosenbrock = rosenbrock_step }

local function explain_step(sys, method)
  if object_type(sys) ~= "model" then
    fail "explain_step: expected a model and a method: explain_step(sys, rk.gauss(2))"
  end
  local make = kinds[object_type(method) or ""]
  if not make then fail "explain_step: expected a method: rk.gauss(2), bdf(2), rosenbrock.rodas4" end
  local p, result = parts_of(sys), {}
  local lines = make(p, method, result)
  table.insert(lines, 1, heading(p, method))
  result.text = table.concat(lines, "\n")
  function result.latex()
    if not result.r then return "" end
    local rows, longest = {}, 1500
    for i = 1, #result.r do rows[i] = "  0 &= " .. latex(result.r[i]) end
    local M = result.M:latex()
    if #M <= longest then rows[#rows + 1] = "  \\frac{\\partial r}{\\partial w} &= " .. M end
    return "\\begin{align*}\n" .. table.concat(rows, " \\\\\n") .. "\n\\end{align*}"
  end
  return setmetatable(result, { __tostring = written, __name = "step" })
end

return { explain_step = explain_step }
