-- A ball that loses a tenth of its speed at every bounce.
h, v = vars "h v"
ball = dae { der(h) ~ v, der(v) ~ -9.81 }
sol = ball:integrate { start = { h = 1, v = 0 }, to = 3,
  events = { { when = h, direction = -1, reset = { [v] = -0.9*v } } } }
print(sol.status)
print(("height at t = 3: %.4f"):format(sol:final(h)))
plot(sol, { h }, { title = "Bouncing ball", hlines = { 0 } }):save "ball.svg"
