-- Form "array" at borders of piecewise equations where its rows lose rank: a pendulum whose pivot has dry
-- friction comes to rest there, and u = v = 0 do not determine where it is.
local x, y, u, v, la, th, w = vars "x y u v la theta omega"
local turns = sign(x*v - y*u)/2
local pendulum = dae { der(x) ~ u, der(y) ~ v, der(u) ~ -la*x + y*turns, der(v) ~ -la*y - 9.81 - x*turns,
  0 ~ x^2 + y^2 - 1 }
local by_angle = dae { der(th) ~ w, der(w) ~ -9.81*sin(th) - sign(w)/2 }

test("a pendulum with dry friction turns back where it came to rest", function()
  local at = pendulum:init { fix = { x = math.sin(1.2), u = 0 }, guess = { y = -math.cos(1.2) } }
  local right = by_angle:integrate { start = { [th] = 1.2, [w] = 0 }, to = 6, rtol = 1e-10 }
  for _, method in ipairs { "radau", "bdf" } do
    for _, rtol in ipairs { 1e-4, 1e-5, 1e-7 } do
      local sol = pendulum:reduce("array", { at = at }):integrate {
        start = at, to = 6, method = method, rtol = rtol }
      expect(sol.status):equals "finished"
      for k = 1, 12 do expect(sol(x, k/2)):near(math.sin(right(th, k/2)), 2e-3 + 100*rtol) end
    end
  end
end)
