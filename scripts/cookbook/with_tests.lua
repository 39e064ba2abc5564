-- A script that tests itself: pendula test with_tests.lua says so in one line, pendula with_tests.lua just
-- runs.
x, v = vars "x v"
swing = dae { der(x) ~ v, der(v) ~ -sin(x) }
energy = v^2/2 - cos(x)
sol = swing:integrate { start = { x = 1, v = 0 }, to = 20, rtol = 1e-9, atol = 1e-9 }

test("energy is kept", function()
  expect(sol(energy, 20)):near(sol(energy, 0), 1e-6)
end)
test("small swings have the period 2 π", function()
  local small = swing:integrate { start = { x = 0.01, v = 0 }, to = 7, rtol = 1e-9, atol = 1e-12,
    events = { { when = x, direction = -1 } } }
  expect(4*small.events[1].t):near(2*math.pi, 1e-4)
end)
test("a start without v is refused", function()
  expect(function() swing:integrate { start = { x = 1 }, to = 1 } end):fails "v"
end)
print(("energy at the end: %.6f"):format(sol(energy, 20)))
