-- Contact: either there is a gap, or there is a force: 0 ~ min(gap, force).
x, y, v, w, la = vars "x y v w la"
g = 9.81

-- ── a ball on a floor: without an event plastic, with one by the law v → -e v ──
ball = dae { der(x) ~ v, der(v) ~ -g + la, 0 ~ min(x, la) }
print(ball:index(), ball:init{ fix = { x = 0, v = 0 } }(la))
drop = ball:integrate { start = { x = 1, v = 0 }, to = 6,
  events = { { when = x, direction = -1, reset = { [v] = -0.8*v } } } }
regimes = drop:switches()
last = regimes[#regimes]
print(drop.status)
print(("%s from t = %.4f on, height %.6f, force %.4f"):format(last.regime, last.t, drop(x, 6), drop(la, 6)))

-- ── a ball in a box: four walls that give back half of the speed ──
l = var("l", 4)
box = dae { der(x) ~ v, der(y) ~ w, der(v) ~ l[1] - l[2], der(w) ~ -g + l[3] - l[4],
  0 ~ min(x, l[1]), 0 ~ min(1 - x, l[2]), 0 ~ min(y, l[3]), 0 ~ min(1 - y, l[4]) }
walls = {}
for i, wall in ipairs { { x, v }, { 1 - x, v }, { y, w }, { 1 - y, w } } do
  walls[i] = { when = wall[1], direction = -1, reset = { [wall[2]] = -wall[2]/2 } }
end
flight = box:integrate { start = { x = 0.5, y = 0.5, v = 1, w = 0 }, to = 2.3, events = walls }
print(("%s: x = %.4f, y = %.4f, force of the floor %.4f"):format(flight.status, flight(x, 2.3),
  flight(y, 2.3), flight(l[3], 2)))
