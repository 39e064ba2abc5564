-- A pump into a tank: its head from a table of the maker, the flow from the balance of heads.
Q, h = vars "Q h"                                   -- m³/h, m
pump = lookup { x = { 0, 10, 20, 30, 40, 50 }, y = { 32, 31.2, 29, 25.1, 19, 10.5 }, kind = "pchip" }
pipe, area = 0.006, 12                              -- losses in m/(m³/h)², surface of the tank in m²
filling = dae { der(h) ~ Q/area, 0 ~ pump(Q) - pipe*Q*abs(Q) - h }
print("index", filling:index())

start = filling:init { fix = { h = 5 }, guess = { Q = 30 } }
full = filling:integrate { start = start, to = 24,
  events = { { when = h - 22, direction = 1, action = "stop" } } }
print(full.status, ("full after %.3f h"):format(full.t[#full.t]))
for _, level in ipairs { 5, 10, 15, 20 } do
  start = filling:init { fix = { h = level }, guess = { Q = 30 } }
  print(("h = %2d m: Q = %.3f m³/h, head of the pump %.3f m"):format(level, start(Q), pump(start(Q))))
end

-- the same table as a part, and what lies between the points as a choice
for _, kind in ipairs { "linear", "pchip", "spline" } do
  local curve = lookup { x = pump.x, y = pump.y, kind = kind }
  print(("%-7s %.4f m at 35 m³/h"):format(kind, curve(35)))
end
