-- Numbers from a sweep: quantiles and probabilities.
local answers = {}

function answers.values(s, e, t)
  local column = t and s(e, t) or s:final(e)
  if column.cols ~= 1 then fail(("sweep: expected one expression, got %d"):format(column.cols)) end
  return column
end

function answers.quantile(s, e, p, t)
  if p == nil then fail "quantile: which? write s:quantile(x, 0.95) or s:quantile(x, { 0.05, 0.95 })" end
  return quantile(answers.values(s, e, t), p)
end

function answers.probability(s, condition, t, options)
  if type(t) == "table" then t, options = nil, t end
  local holds = answers.values(s, condition, t)
  local count, n = 0, 0
  for i = 1, #holds do
    local value = holds[i]
    if value == value then
      if value ~= 0 and value ~= 1 then
        fail(("probability: %s is not a condition; write lt(x, 0.2), gt(x, 1), all(…, …)"):format(
          tostring(condition)))
      end
      n = n + 1
      if value == 1 then count = count + 1 end
    end
  end
  if n == 0 then fail "probability: no run has a value there; see s.failures" end
  local low, high = share_interval(count, n, options)
  local text = ("%.6g, between %.6g and %.6g (%d of %d runs)"):format(count/n, low, high, count, n)
  return record("probability", { p = count/n, low = low, high = high, count = count, n = n, text = text })
end

return answers
