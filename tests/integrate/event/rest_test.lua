-- A ball that comes to rest on ground that is not at 0. Its last bounces are lower than the rounding of its
-- height: they were missed, and the ball fell through the ground without a word.
-- The bounces accumulate at √(2 h/g) (1 + 2 e/(1 - e)) after a fall from h.

local families = dofile "tests/families.lua"
local g = 9.81

local function comes_to_rest(sol, time, tolerance)
  expect(sol.status):matches "accumulate"
  local last = sol.events[#sol.events].t
  expect(last/time):near(1, tolerance)
end

test("on ground at any height, in any unit", function()
  local y, v = vars "y v"
  for _, ground in ipairs { 1, -3, 1e3 } do
    for _, unit in ipairs { 1e-6, 1, 1e6 } do
      for _, e in ipairs { 0.3, 0.7, 0.9 } do
        local ball = dae { der(y) ~ v, der(v) ~ -g*unit }
        local sol = ball:integrate { start = { y = (ground + 1)*unit, v = 0 }, to = 20, rtol = 1e-9,
          events = { { when = y - ground*unit, direction = -1, reset = { [v] = -e*v } } } }
        comes_to_rest(sol, math.sqrt(2/g)*(1 + 2*e/(1 - e)), 1e-5)
      end
    end
  end
end)

test("on a moving table, by every method", function()
  local y, v = vars "y v"
  local table_, e = sin(4*t)/20, 0.7
  local ball = dae { der(y) ~ v, der(v) ~ -g }
  local bounce = { when = y - table_, direction = -1, reset = { [v] = (1 + e)*der(table_) - e*v } }
  for _, method in ipairs(families.with("auto", "tsit5", "dop853")) do
    local sol = ball:integrate { start = { y = 1, v = 0 }, to = 3, rtol = 1e-9, atol = 1e-12, method = method,
      events = { bounce } }
    comes_to_rest(sol, 2.551566, 1e-5)
  end
end)

test("on an inclined plane with a condition of two states, and of an algebraic variable", function()
  local x, y, u, v, d = vars "x y u v d"
  local e, slope = 0.5, 1/4                               -- (1, slope)/√(1 + slope²) along the plane
  local across = (v - slope*u)/(1 + slope^2)              -- normal velocity beside the normal (-slope, 1)
  local reset = { [u] = u + (1 + e)*slope*across, [v] = v - (1 + e)*across }
  local ball = { der(x) ~ u, der(y) ~ v, der(u) ~ 0, der(v) ~ -g }
  local start = { x = 0, y = 3, u = 0, v = 0 }
  local time = math.sqrt(2/g)*(1 + 2*e/(1 - e))
  local sol = dae(ball):integrate { start = start, to = 5, rtol = 1e-9,
    events = { { when = y - slope*x - 2, direction = -1, reset = reset } } }
  comes_to_rest(sol, time, 1e-6)
  ball[5] = 0 ~ d - y + slope*x + 2
  for _, method in ipairs { "auto", "dopri5", "radau", "rodas" } do
    sol = dae(ball):integrate { start = start, to = 5, rtol = 1e-9, method = method,
      events = { { when = d, direction = -1, reset = reset } } }
    comes_to_rest(sol, time, 1e-6)
  end
end)
