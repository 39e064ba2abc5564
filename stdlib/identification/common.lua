-- What estimates without a parametric model share: signals as lists, options, Fourier transforms, tails.
local common = {}

function common.data(by, d)
  if object_type(d) ~= "iddata" then fail(by .. ": expected data, iddata{ y = …, u = …, Ts = … }") end
  return d
end

-- One experiment with an input.
function common.one_record(by, d)
  common.data(by, d)
  if #d.u_names == 0 then
    fail(by .. ": the data has no input; periodogram(y) gives the spectrum of a signal")
  end
  if d.experiments and d.experiments > 1 then fail(by .. ": take one experiment with d:slice(…)") end
  return d
end

-- A column of a matrix as a list without its mean.
function common.centred(by, m, column)
  local list, sum = {}, 0
  for k = 1, m.rows do
    local v = m(k, column) + 0.0
    if v ~= v then fail(by .. ": samples are missing; fill them first: d:fill()") end
    list[k], sum = v, sum + v
  end
  for k = 1, #list do list[k] = list[k] - sum / #list end
  return list
end

-- An input that varies, and enough samples to say something about it.
function common.informative(by, d, u, i, least)
  local varies = false
  for t = 2, #u do varies = varies or u[t] ~= u[1] end
  if not varies then fail(("%s: the input %s does not vary"):format(by, d.u_names[i])) end
  if #u < least then
    fail(("%s: %d samples are too few; at least %d are needed"):format(by, #u, least))
  end
end

-- What estimators of polynomial models say of a signal far from 0 (offsets_in in C++): a list of lines.
function common.offset_remarks(d)
  local lines = {}
  for j, name in ipairs(d.y_names) do
    local sum, square, count, nearest = 0, 0, 0, math.huge
    for t = 1, d.y.rows do
      local v = d.y(t, j) + 0.0
      if v == v then sum, count = sum + v, count + 1 end
    end
    local mean = sum / count
    for t = 1, d.y.rows do
      local v = d.y(t, j) + 0.0
      if v == v then square, nearest = square + (v - mean)^2, math.min(nearest, mean < 0 and -v or v) end
    end
    local deviation = math.sqrt(square / math.max(1, count - 1))
    if count >= 20 and deviation > 0 and math.abs(mean) > 3 * deviation and nearest > deviation then
      lines[#lines + 1] = ("  warning: %s has the mean %.4g and deviates from it by %.3g; the model has no term for "
        .. "an offset: d:detrend() removes it"):format(name, mean, deviation)
    end
  end
  return lines
end

-- Adds what feedback in the data may mean for an estimate.
function common.feedback_remark(lines, d, output, consequence)
  local seen = d:feedback(output)
  if seen then
    lines[#lines + 1] = ("  warning: the data may have been taken in closed loop (%s of residuals and later inputs): %s")
      :format(seen, consequence)
  end
  return lines
end

-- Remarks of estimates of y = G u + v that take the noise as white.
function common.output_error_remarks(d)
  return common.feedback_remark(common.offset_remarks(d), d, 1,
    "the estimate may then be biased, because the noise is taken as white; arx, armax or bj are not")
end

-- A list of numbers from a list, a column or a row.
function common.list(by, x)
  local list = {}
  if object_type(x) == "matrix" then
    if x.rows ~= 1 and x.cols ~= 1 then fail(by .. ": expected one signal, a list or a column of numbers") end
    for k = 1, x.rows * x.cols do list[k] = evaluate(x[k]) + 0.0 end
    return list
  end
  if type(x) ~= "table" then fail(by .. ": expected one signal, a list or a column of numbers") end
  for k, v in ipairs(x) do
    if type(v) ~= "number" then fail(by .. ": expected one signal, a list or a column of numbers") end
    list[k] = v
  end
  return list
end

local function index_of(names, which)
  for k, name in ipairs(names) do if which == k or which == name then return k end end
end

-- y and u of the data, means removed, and their numbers.
function common.signals(by, d, options, least)
  options = options or {}
  local i, o = index_of(d.u_names, options.input or 1), index_of(d.y_names, options.output or 1)
  if not i then fail(("%s: there is no input %s"):format(by, tostring(options.input))) end
  if not o then fail(("%s: there is no output %s"):format(by, tostring(options.output))) end
  local y, u = common.centred(by, d.y, o), common.centred(by, d.u, i)
  common.informative(by, d, u, i, least or 1)
  return y, u, i, o
end

-- Powers of 2 by the algorithm of Cooley and Tukey, in place.
local function radix2(re, im, sign)
  local n, j = #re, 1
  for i = 1, n - 1 do
    if i < j then re[i], re[j], im[i], im[j] = re[j], re[i], im[j], im[i] end
    local m = n // 2
    while m >= 1 and j > m do j, m = j - m, m // 2 end
    j = j + m
  end
  local size = 2
  while size <= n do
    local half = size // 2
    for k = 0, half - 1 do
      local angle = sign * 2 * math.pi * k / size
      local c, s = math.cos(angle), math.sin(angle)
      for a = k + 1, n, size do
        local b = a + half
        local xr, xi = re[b] * c - im[b] * s, re[b] * s + im[b] * c
        re[b], im[b], re[a], im[a] = re[a] - xr, im[a] - xi, re[a] + xr, im[a] + xi
      end
    end
    size = size * 2
  end
end

-- Σ x(t) e^{-2πi k t/N}, k = 0 …, of a real list of any length (Bluestein, 1970).
function common.dft(x)
  local N, re, im = #x, {}, {}
  if N & (N - 1) == 0 then
    for t = 1, N do re[t], im[t] = x[t], 0 end
    radix2(re, im, -1)
    return re, im
  end
  local M = 1
  while M < 2 * N do M = 2 * M end
  local cosine, sine, br, bi = {}, {}, {}, {}
  for t = 1, M do re[t], im[t], br[t], bi[t] = 0, 0, 0, 0 end
  for t = 0, N - 1 do
    local angle = math.pi * (t * t % (2 * N)) / N
    cosine[t], sine[t] = math.cos(angle), math.sin(angle)
    re[t + 1], im[t + 1] = x[t + 1] * cosine[t], -x[t + 1] * sine[t]
    br[t + 1], bi[t + 1] = cosine[t], sine[t]
    if t > 0 then br[M - t + 1], bi[M - t + 1] = cosine[t], sine[t] end
  end
  radix2(re, im, -1)
  radix2(br, bi, -1)
  for t = 1, M do re[t], im[t] = re[t] * br[t] - im[t] * bi[t], re[t] * bi[t] + im[t] * br[t] end
  radix2(re, im, 1)
  local outr, outi = {}, {}
  for k = 0, N - 1 do
    local a, b = re[k + 1] / M, im[k + 1] / M
    outr[k + 1], outi[k + 1] = a * cosine[k] + b * sine[k], b * cosine[k] - a * sine[k]
  end
  return outr, outi
end

-- Ticks of a phase: every 45°, or 90° where the range is large.
function common.phase_step(degrees)
  local low, high = math.huge, -math.huge
  for _, v in ipairs(degrees) do low, high = math.min(low, v), math.max(high, v) end
  return high - low > 400 and 90 or 45
end

-- q with P(|X| > q) = 1 - level for a normal X.
function common.normal_quantile(level) return named "normal" (0, 1):quantile((1 + level) / 2) end

-- |zeros of 1 + c₁ q⁻¹ + …| < 1 (Schur and Cohn).
function common.stable(c)
  local a = { 1, table.unpack(c) }
  while #a > 1 do
    local n = #a
    local k = a[n] / a[1]
    if not (math.abs(k) < 1) then return false end
    local b = {}
    for i = 1, n - 1 do b[i] = a[i] - k * a[n - i + 1] end
    a = b
  end
  return true
end

return common
