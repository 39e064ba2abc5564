-- One step of a multistep method: the residual for x_{k+1} and z_{k+1}, its Jacobian, Newton's method.

local text = include "steps/text"
local stand_ins, put, pairing = text.stand_ins, text.put, text.pairing
local indented, weighted_sum = text.indented, text.weighted_sum

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
  local x1, z1 = stand_ins("x_new", p.x), stand_ins("z_new", p.z)
  local old = {}
  for j = 1, m do old[j] = stand_ins(j == 1 and "x_k" or "x_old_" .. ("abcde"):sub(j - 1, j - 1), p.x) end
  local dt, r, w = param "dt", {}, {}
  local replacements = pairing(p.z, z1, pairing(p.x, x1, { [pendula.t] = param "t_k" + dt }))
  pairing(p.inputs, stand_ins("u_new", p.inputs), replacements)
  local minus = history:sub(1, 1) == "-" and " - " .. history:sub(2) or " + " .. history
  local step = b == 1 and "Δt" or tostring(b) .. " Δt"
  local differences = {}
  for i = 1, #p.x do
    differences[i] = x1[i]
    for j = 1, m do differences[i] = differences[i] + past[j]*old[j][i] end
  end
  if p.F then
    add(("     F((x_{k+1}%s)/(%s), x_{k+1}%s%s) = 0"):format(minus, step, z and ", z_{k+1}" or "",
      #p.inputs > 0 and ", u_{k+1}" or ""))
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
    add(indented(jacobian(vec(p.F), vec(p.rates)), "F_x′ = "))
    add(indented(jacobian(vec(p.F), vec(p.x)), "F_x = "))
    if z then add(indented(jacobian(vec(p.F), vec(p.z)), "F_z = ")) end
  else
    add(("     M = [ I - %s f_x%s ]"):format(step, z and (",  -%s f_z;  g_x,  g_z"):format(step) or ""))
    add(indented(jacobian(vec(p.f), vec(p.x)), "f_x = "))
    if z then
      add(indented(jacobian(vec(p.f), vec(p.z)), "f_z = "))
      add(indented(jacobian(vec(p.g), vec(p.x)), "g_x = "))
      add(indented(jacobian(vec(p.g), vec(p.z)), "g_z = "))
      add(text.regularity(jacobian(vec(p.g), vec(p.z)), p.z)
        or "     regular for small Δt where g_z is regular (index 1).")
    end
  end
  text.newton_lines(add, "the values extrapolated from the last steps")
  add(("Step:  x_{k+1}%s the solution; %s."):format(z and " and z_{k+1} are" or " is",
    m == 1 and "no starting values are needed"
    or m == 2 and "the first step uses a method of order 1"
    or ("the first %d steps use methods of lower order"):format(m - 1)))
  return lines
end

return { multistep = bdf_step }
