-- What bench/instructions.sh counts: one case per call, always the same work.     pendula bench/instructions.lua radau
local function pendulum()
  local th = var "th"
  return dae { der(th, 2) ~ -9.81*sin(th) }, { th = 1, [th.dot] = 0 }
end

local function robertson()
  local a, b, c = vars "a b c"
  return dae { der(a) ~ -0.04*a + 1e4*b*c, der(b) ~ 0.04*a - 1e4*b*c - 3e7*b^2, 0 ~ a + b + c - 1 }, { a = 1, b = 0 }
end

local function ladder(N)
  local w, v = var("w", N), var("v", N)
  local equations, zero = {}, {}
  for k = 1, N do
    local before = k > 1 and v[k - 1] or 2*sin(2*pi*1e5*t)
    local current = (w[k] - v[k])/10
    if k < N then current = current + (w[k + 1] - v[k])/10 end
    equations[#equations + 1] = 0 ~ (before - w[k])/10 + (v[k] - w[k])/10 - 1e-12*(exp(w[k]/0.02585) - 1)
    equations[#equations + 1] = 1e-9*der(v[k]) ~ current
    zero[k] = 0
  end
  return dae(equations), { [v] = zero, [w] = zero }
end

local cases = {
  explicit = function() return "dop853", 10, 1e-8, pendulum() end,
  radau = function() return "radau", 4e7, 1e-8, robertson() end,
  bdf = function() return "bdf", 4e7, 1e-6, robertson() end,
  rodas = function() return "rodas", 1e-5, 1e-4, ladder(300) end,
}
local method, to, rtol, model, start = assert(cases[arg[1]], "unknown case")()
local sol = model:integrate { start = start, to = to, rtol = rtol, atol = rtol*1e-4, times = { to }, method = method }
print(arg[1], sol.status, sol:stats().steps)
