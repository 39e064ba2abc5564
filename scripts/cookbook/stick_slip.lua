-- A block on a belt: it sticks until the spring pulls it off, slips back, and sticks again.
local x, v = vars "x v"
local k, m, speed, c = params "k=1 m=1 speed=0.2 c=0.3"

-- Coulomb friction that falls with the relative speed; sign(0) is any value between -1 and 1
local slip = v - speed
local belt = dae { der(x) ~ v, m*der(v) ~ -k*x - (1 - c*abs(slip))*sign(slip) }
local sol = belt:integrate { start = { x = 0, v = 0.2 }, to = 30, rtol = 1e-8 }
print(sol.status)
print(sol:stats().borders)

-- while it sticks, the spring force grows with the belt: it slips at k x = 1
for _, at in ipairs { 2, 4, 5, 6 } do
  print(string.format("t = %g: x = %.4f, v = %.4f", at, sol(x, at), sol(v, at)))
end
plot(sol, { x, v }, { title = "stick and slip" }):save "stick_slip.svg"
