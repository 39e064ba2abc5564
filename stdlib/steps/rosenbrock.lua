-- One step of a Rosenbrock method: one matrix, one linear system for every stage. DAEs with B y′ = φ(t, y),
-- B = diag(I, 0): Hairer & Wanner, Solving ODEs II, 2nd ed., §VI.3.

local text = include "steps/text"
local subscript, stand_ins, put, pairing = text.subscript, text.stand_ins, text.put, text.pairing
local indented, weighted_sum = text.indented, text.weighted_sum

-- F(x′, x, z) = 0 as x′ = δ, 0 = F(δ, x, z).
local function solved_for_rates(p, add)
  local delta, values = stand_ins("delta", p.x), {}
  pairing(p.rates, delta, values)
  local z = {}
  for _, list in ipairs { delta, p.z } do for _, s in ipairs(list) do z[#z + 1] = s end end
  add "F(x′, x, z) = 0 is written x′ = δ, 0 = F(δ, x, z): δ joins the algebraic variables."
  return { x = p.x, z = z, f = delta, g = put(p.F, values), inputs = p.inputs, rates = p.rates }
end

local function joined(a, b)
  local list = {}
  for _, each in ipairs { a, b } do for _, e in ipairs(each) do list[#list + 1] = e end end
  return list
end

-- Whether the right sides change with t: by itself or by inputs.
local function moves(p)
  if #p.inputs > 0 then return true end
  for _, e in ipairs(joined(p.f, p.g)) do
    for _, s in ipairs(symbols_in(e)) do if s == t then return true end end
  end
  return false
end

local function matrix_lines(p, gamma, add)
  local dae = #p.z > 0
  add(("Matrix of the step, factored once, with γ = %s:"):format(text.number_text(gamma)))
  if not dae then
    local J = jacobian(vec(p.f), vec(p.x))
    add "     M = I - Δt γ J,  J = ∂f/∂x at (t_k, x_k)"
    add(indented(J, "J = "))
    return eye(#p.x) - param "dt"*param "gamma"*J
  end
  local y, phi = joined(p.x, p.z), joined(p.f, p.g)
  local J, B = jacobian(vec(phi), vec(y)), {}
  for i = 1, #y do
    B[i] = {}
    for j = 1, #y do B[i][j] = i == j and i <= #p.x and 1 or 0 end
  end
  add "     M = B - Δt γ J,  B = diag(I, 0),  J = [ f_x, f_z;  g_x, g_z ] at (t_k, x_k, z_k)"
  add(indented(J, "J = "))
  add(text.regularity(jacobian(vec(p.g), vec(p.z)), p.z)
    or "     regular for small Δt where g_z is regular (index 1).")
  return mat(B) - param "dt"*param "gamma"*J
end

-- A sum that follows another term: " + 0.2 k₁", " - 0.2 k₁", nothing for 0.
local function added(sum)
  if sum == "0" then return "" end
  return sum:sub(1, 1) == "-" and " - " .. sum:sub(2) or " + " .. sum
end

local widest = 110

local function stage_lines(p, method, add)
  local moving = moves(p)
  local phi, state = #p.z > 0 and "φ" or "f", #p.z > 0 and "y_k" or "x_k"
  local names = {}
  for i = 1, method.stages do names[i] = "k" .. subscript(i) end
  for i = 1, method.stages do
    local inner, outer, node, slope = {}, {}, 0, method.gamma
    for j = 1, i - 1 do
      inner[j], outer[j] = method.alpha(i, j), method.Gamma(i, j)
      node, slope = node + inner[j], slope + outer[j]
    end
    local at = added(weighted_sum(inner, names))
    local time = not moving and "" or node == 0 and "t_k, "
      or "t_k + " .. weighted_sum({ node }, { "Δt" }) .. ", "
    local line = ("     M k%s = Δt %s(%s%s%s)"):format(subscript(i), phi, time, state, at)
    local sum, rest = weighted_sum(outer, names), ""
    if sum ~= "0" then rest = " + Δt J (" .. sum .. ")" end
    if moving and math.abs(slope) > 1e-14 then
      rest = rest .. added(weighted_sum({ slope }, { "Δt²" })) .. (" ∂%s/∂t"):format(phi)
    end
    local fits = utf8.len(line .. rest) <= widest
    add(fits and line .. rest or line)
    if not fits then add("           " .. rest) end
  end
  return names, state
end

local function rosenbrock(p, method, result)
  local lines = {}
  local function add(line) lines[#lines + 1] = line end
  if p.F then p = solved_for_rates(p, add) end
  if #p.z > 0 then add "With y = (x, z) and φ = (f, g) the model is B y′ = φ(t, y)." end
  result.M = matrix_lines(p, method.gamma, add)
  add "Stages, one linear system each:"
  local names, state = stage_lines(p, method, add)
  add "No Newton iterations: the method is linearly implicit."
  local b = {}
  for i = 1, method.stages do b[i] = method.b[i] end
  local update = weighted_sum(b, names)
  add(("Step:  %s = %s%s"):format(state == "y_k" and "y_{k+1}" or "x_{k+1}", state, added(update)))
  return lines
end

return { rosenbrock = rosenbrock }
