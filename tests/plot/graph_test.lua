-- plot of expressions and functions over a range, of several solutions, and figures of several panels.
local x = var "x"

test("graphs of expressions and functions over a range", function()
  local a = param("a", 2)
  local function parts(fig) return fig:parts().series[1] end
  local s = parts(plot(sin(x), { -3, 3 }))
  expect(#s.x > 160):equals(true)
  for i = 1, #s.x - 1 do  -- halfway between two points the line is off by less than 1/500 of the height 2
    local m = (s.x[i] + s.x[i + 1])/2
    expect((s.y[i] + s.y[i + 1])/2):near(math.sin(m), 2/500)
  end
  expect(#parts(plot(math.floor, { 0.5, 3.5 })).breaks):equals(3)        -- jumps at 1, 2, 3
  local pole = parts(plot(tan(x), { -2, 2 }))                            -- no line through ± π/2
  local broken = {}
  for _, k in ipairs(pole.breaks) do broken[k] = true end
  for i = 2, #pole.x do
    local through = pole.y[i]*pole.y[i - 1] < 0 and math.abs(pole.y[i]) > 1
    expect(through and not broken[i]):equals(false)
  end
  expect(plot({ sin(x), cos(x) }, { 0, 1 }).labels):equals { "sin(x)", "cos(x)" }
  expect(#parts(plot(sqrt(x), { -1, 1 })).x < 2000):equals(true)  -- nan is not refined
  expect(tostring(plot({ 1, 2 }, { 3, 4 }))):equals "figure: 1 series, 2 points"
  expect(function() plot(a*sin(x), { 0, 1 }) end):fails "needs one symbol, but it has 2"
  expect(function() plot(x^2) end):fails "its graph is plot(x², { -1, 1 })"
end)

test("curves of two solutions have two names, styles of MATLAB lead to options", function()
  local sol = dae { der(x) ~ -x }:integrate { start = { x = 1 }, to = 1 }
  local fast = dae { der(x) ~ -2*x }:integrate { start = { x = 1 }, to = 1 }
  expect(plot(sol, x, fast, x).labels):equals { "x (1)", "x (2)" }
  expect(plot(sol, x, fast, 2*x).labels):equals { "x", "2 x" }
  expect(function() plot(sol, x, "r--") end):fails 'colour = "red", dash = "dashed"'
  expect(function() plot({ 1, 2 }, { 1, 2 }, "o") end):fails 'marker = "circle"'
end)

test("figures of several panels are put together panel by panel", function()
  local G, H = tf({ 1 }, { 1, 1 }), tf({ 1 }, { 1, 2 })
  local both = overlay(bode(G):plot(), bode(H):plot())
  expect(#both:parts().series):equals(2)
  expect(#both:parts().below[1]:parts().series):equals(2)
  expect(function() overlay(bode(G):plot(), plot { 1, 2 }) end):fails "one figure has 2 panels, the other 1"
end)
