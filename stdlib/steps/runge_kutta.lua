-- One step of a Runge-Kutta method: the equations of its stages, their Jacobian in blocks, the update.

local text = include "steps/text"
local subscript, stand_ins, put, pairing = text.subscript, text.stand_ins, text.put, text.pairing
local indented, stage_text, input_text, row_of = text.indented, text.stage_text, text.input_text, text.row_of

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
    pairing(p.inputs, stand_ins("u" .. i, p.inputs), replacements)
    replacements[pendula.t] = param "t_k" + tab.c[i]*dt
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

local function unknown_rates(p)
  local list = {}
  for _, rate in ipairs(p.rates) do list[#list + 1] = rate end
  for _, z in ipairs(p.z) do list[#list + 1] = z end
  return list
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
  local some_explicit = false
  for i = 1, tab.stages do some_explicit = some_explicit or tab.A(i, i) == 0 end
  local index
  if p.F then
    index = text.regularity(jacobian(vec(p.F), vec(unknown_rates(p))), unknown_rates(p), some_explicit)
  elseif z then
    index = text.regularity(jacobian(vec(p.g), vec(p.z)), p.z, some_explicit)
  end
  if index then add(index) end
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
    text.newton_lines(add, "K and z of the last step, at first K = 0 and the given z")
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
  add "Repeated for k = 0, …, N - 1 it gives x_1, …, x_N."
  return lines
end

return { runge_kutta = runge_kutta }
