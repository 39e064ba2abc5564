-- A rectifier of four ideal diodes: 0 ~ min(i, -u) says that a diode carries current or blocks.
local p, a, b, j = vars "p a b j"
local d = var("d", 4)
local C, R, Ri = params "C=1e-3 R=100 Ri=1"
local E = 10*sin(100*t)

local bridge = dae {
  C*der(p) ~ d[1] + d[2] - p/R,               -- the load, from p to ground
  a - b ~ E - Ri*j,                           -- the source between a and b
  j ~ d[1] - d[3], -j ~ d[2] - d[4],
  0 ~ min(d[1], p - a), 0 ~ min(d[2], p - b), -- from a and b to p
  0 ~ min(d[3], a), 0 ~ min(d[4], b),         -- from ground to a and b
}
local sol = bridge:integrate { start = { p = 0 }, to = 0.1, rtol = 1e-8 }
print(sol.status)
for i, use in ipairs(sol:switches()) do
  if i <= 5 then print(string.format("t = %.5f: %s", use.t, use.regime)) end
end
print(string.format("%.4f V", sol(p, 0.1)))
plot(sol, { p, E }, { title = "voltage of the load and of the source" }):save "diode_bridge.svg"
