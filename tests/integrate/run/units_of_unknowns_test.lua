-- The same model in ten random systems of units: no run stops in one of them alone because it takes what is
-- small in its unit for 0. References: runs in SI units.
local x, y, u, v, l = vars "x y u v l"

local function random(seed)
  local state = seed * 7919 + 17
  return function()                                          -- a power of ten between 10⁻⁹ and 10⁹
    state = (state * 1103515245 + 12345) % 2147483648
    return 10.0^(state // 65536 % 19 - 9)
  end
end

-- name -> function(f, e): model, start, end, unknowns; f: units of the unknowns, e: factors of the equations
local models = {
  ["a pendulum with its multiplier"] = function(f, e)
    local X, Y, U, V, L = x/f[1], y/f[2], u/f[3], v/f[4], l/f[5]
    return dae { e[1]*(der(x)/f[1] - U) ~ 0, e[2]*(der(y)/f[2] - V) ~ 0, e[3]*(der(u)/f[3] + X*L) ~ 0,
      e[4]*(der(v)/f[4] + Y*L + 9.81) ~ 0, e[5]*(X^2 + Y^2 - 1) ~ 0 }:reduce(),
      { x = f[1], y = 0, u = 0, v = 0 }, 4, { x, y, u, v, l }
  end,
}

for name, make in pairs(models) do
  test(name .. ": ten systems of units", function()
    local ones = { 1, 1, 1, 1, 1 }
    local model, start, last = make(ones, ones)
    local exact = model:integrate { start = start, to = last, rtol = 1e-12, atol = 1e-14 }:final(y)
    for _, method in ipairs { "auto", "radau", "bdf" } do
      for seed = 1, 10 do
        local draw, f, e = random(seed), {}, {}
        for i = 1, 5 do f[i], e[i] = draw(), draw() end
        local other, begin, to, list = make(f, e)
        local atol = {}
        for i, unknown in ipairs(list) do if i < 5 then atol[unknown] = 1e-9*f[i] end end
        local sol = other:integrate { start = begin, to = to, method = method, atol = atol }
        expect(seed .. " " .. sol.status):equals(seed .. " finished")
        expect(sol:final(y)/f[2]):near(exact, 2e-4)
      end
    end
  end)
end
