-- What the analysis of large sparse models costs: pendula bench/structure.lua [most equations]
-- Seconds of CPU, one run each; "-": not tried at that size, or the form does not apply.
local most = tonumber(arg[1] or 100000)

local function seconds(f)
  collectgarbage()
  local before = os.clock()
  local ok, result = pcall(f)
  return ok and ("%.3f"):format(os.clock() - before) or "-", ok and result or nil
end

local shapes = {}

function shapes.ladder(n)                                  -- diodes and capacitors: index 1
  local N = n // 2
  local w, v = var("w", N), var("v", N)
  local e, fix = {}, {}
  for k = 1, N do
    local left = k > 1 and v[k-1] or 2*sin(2e5*pi*t)
    e[#e+1] = 0 ~ (left - w[k])/10 + (v[k] - w[k])/10 - 1e-12*(exp(w[k]/0.02585) - 1)
    e[#e+1] = 1e-9*der(v[k]) ~ (w[k] - v[k])/10 + (k < N and (w[k+1] - v[k])/10 or 0)
    fix[v[k]] = 0
  end
  return dae(e), fix
end

function shapes.loops(n)                                   -- pairs of capacitors in parallel: index 2
  local N = n // 3
  local v, w, i = var("v", N), var("w", N), var("i", N)
  local e, fix = {}, {}
  for k = 1, N do
    e[#e+1] = der(v[k]) ~ i[k] + (k > 1 and 0.1*(w[k-1] - v[k]) or 0)
    e[#e+1] = der(w[k]) ~ -i[k] - 0.3*w[k]
    e[#e+1] = 0 ~ v[k] - w[k]
    fix[v[k]] = 1
  end
  return dae(e), fix
end

function shapes.chain(n)                                   -- a planar chain of links: index 3
  local N = n // 3
  local x, y = var("x", N), var("y", N)
  local T, V, C, fix, s = 0, 0, {}, {}, math.sqrt(0.5)/N
  for i = 1, N do
    local dx, dy = x[i] - (i > 1 and x[i-1] or 0), y[i] - (i > 1 and y[i-1] or 0)
    C[i] = (dx^2 + dy^2 - 1/N^2)/2
    T = T + 1/(2*N)*(x[i].dot^2 + y[i].dot^2)
    V = V + 9.81/N*y[i]
    fix[x[i]], fix[y[i]], fix[x[i].dot], fix[y[i].dot] = s*i, -s*i, 0, 0
  end
  return lagrange { q = vstack(x, y), T = T, V = V, C = C }, fix
end

-- x₁ prescribed, xₖ′ = xₖ₊₁ in groups of ten: index 10
function shapes.cascade(n)
  local x, e = var("x", n // 10 * 10), {}
  for k = 1, #x do
    e[k] = k % 10 ~= 0 and der(x[k]) ~ x[k+1] or x[k-9] ~ sin(k > 10 and x[k-19] or t)
  end
  return dae(e), {}
end

print(("%-8s %9s %6s %4s %9s %9s %9s %12s %9s %9s %9s %9s"):format("model", "equations", "index", "dof",
  "make",
  "structure", "index()", "constraints", "acc", "dummy", "reduce()", "init"))
for _, name in ipairs { "ladder", "loops", "cascade", "chain" } do
  for _, n in ipairs { 1000, 10000, 100000 } do
    if n <= most and not (name == "chain" and n > 10000) then
      local sys, fix
      local row = { (seconds(function() sys, fix = shapes[name](n) end)) }
      row[2] = seconds(function() return sys:structure() end)
      row[3] = seconds(function() return sys:index() end)
      row[4] = seconds(function() return #sys:constraints() end)
      row[5] = seconds(function() return sys:reduce "acc" end)
      row[6] = n > 10000 and "-" or seconds(function() return sys:reduce "dummy" end)
      row[7] = n > 10000 and "-" or seconds(function() return sys:reduce() end)
      row[8] = n > 10000 and "-" or seconds(function() return sys:init { fix = fix } end)
      print(("%-8s %9d %6d %4d %9s %9s %9s %12s %9s %9s %9s %9s"):format(name, n, sys:index(), sys:dof(),
        table.unpack(row)))
    end
  end
end
