-- How well a model of data, given by its polynomials, predicts data: A y = B/F u + C/D e.

local fit = {}

-- y = num/den x, coefficients of q⁻¹ from q⁰ on.
local function filter(num, den, x)
  local y = {}
  for t = 1, #x do
    local sum = 0
    for k = 1, math.min(#num, t) do sum = sum + num[k]*x[t - k + 1] end
    for k = 2, math.min(#den, t) do sum = sum - den[k]*y[t - k + 1] end
    y[t] = sum/den[1]
  end
  return y
end

local function numbers(list)
  local out = {}
  for i = 1, #(list or {}) do out[i] = type(list[i]) == "number" and list[i] or evaluate(list[i]) end
  return out[1] and out or { 1 }
end

-- A, C, D and F begin with 1: what is multiplied by anything else makes the errors as small as one likes.
local function monic(list, name)
  local out = numbers(list)
  if out[1] ~= 1 then fail(("the polynomial %s of a model of data begins with 1"):format(name)) end
  return out
end

-- 100 (1 - ‖ε‖/‖y - ȳ‖) % of the one-step prediction, one input and one output.
function fit.percent(model, d)
  local y, u = {}, {}
  for i = 1, #d.y do y[i], u[i] = d.y[i], d.u[i] end
  local A, B, C = monic(model.A, "A"), numbers(model.B or { 0 }), monic(model.C, "C")
  local D, F = monic(model.D, "D"), monic(model.F, "F")
  local left, right = filter(A, { 1 }, y), filter(B, F, u)
  for t = 1, #y do left[t] = left[t] - right[t] end
  local errors, mean = filter(D, C, left), 0
  for t = 1, #y do mean = mean + y[t]/#y end
  local above, below = 0, 0
  for t = 1, #y do
    above = above + errors[t]^2
    below = below + (y[t] - mean)^2
  end
  local percent = 100*(1 - math.sqrt(above/below))
  return percent == percent and percent or -math.huge
end

return fit
