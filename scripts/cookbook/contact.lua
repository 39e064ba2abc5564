-- Contact: either there is a gap, or there is a force: 0 ~ min(gap, force).
local x, y, v, w, la, mu, th, om = vars "x y v w la mu th om"
local g = 9.81

-- ── a ball on a floor: without an event plastic, with one by the law v → -e v ──
local ball = dae { der(x) ~ v, der(v) ~ -g + la, 0 ~ min(x, la) }
print(ball:index(), ball:init{ fix = { x = 0, v = 0 } }(la))
local drop = ball:integrate { start = { x = 1, v = 0 }, to = 6,
  events = { { when = x, direction = -1, reset = { [v] = -0.8*v } } } }
local regimes = drop:switches()
print(drop.status)
local last = regimes[#regimes]
print(("%s from t = %.4f on, height %.6f, force %.4f"):format(last.regime, last.t, drop(x, 6), drop(la, 6)))

-- ── a rocking block on a smooth floor: two contacts, one of them ends where the other begins ──
local B, H, J = 1, 2, 5/3
local left, right = y - H*cos(th) - B*sin(th), y - H*cos(th) + B*sin(th)
local block = dae { der(y) ~ w, der(th) ~ om, der(w) ~ -g + la + mu,
  J*der(om) ~ la*(H*sin(th) - B*cos(th)) + mu*(H*sin(th) + B*cos(th)),
  0 ~ min(left, la), 0 ~ min(right, mu) }
local a = 0.1
local rock = block:integrate { start = { y = H*math.cos(a) + B*math.sin(a), th = a, w = 0, om = 0 }, to = 1,
  rtol = 1e-8 }
print(rock.status)
local first = rock:switches()[2].t
print(string.format("first impact at %.4f: share of ω kept %.4f, by hand %.4f", first,
  rock(om, first + 1e-9)/rock(om, first - 1e-9), (J - B^2)/(J + B^2)))
print(string.format("at rest: forces %.4f and %.4f", rock(la, 1), rock(mu, 1)))

-- ── a ball in a box: four walls that give back half of the speed ──
local l = var("l", 4)
local box = dae { der(x) ~ v, der(y) ~ w, der(v) ~ l[1] - l[2], der(w) ~ -g + l[3] - l[4],
  0 ~ min(x, l[1]), 0 ~ min(1 - x, l[2]), 0 ~ min(y, l[3]), 0 ~ min(1 - y, l[4]) }
local walls = {}
for _, wall in ipairs { { x, v }, { 1 - x, v }, { y, w }, { 1 - y, w } } do
  walls[#walls + 1] = { when = wall[1], direction = -1, reset = { [wall[2]] = -wall[2]/2 } }
end
local flight = box:integrate { start = { x = 0.5, y = 0.5, v = 1, w = 0 }, to = 2.3, events = walls }
print(string.format("%s: x = %.4f, y = %.4f, force of the floor %.4f", flight.status, flight(x, 2.3),
  flight(y, 2.3), flight(l[3], 2)))
