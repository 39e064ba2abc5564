-- A rocking block on a smooth floor: two contacts, one of them ends where the other begins.
y, th, w, om, la, mu = vars "y th w om la mu"     -- height, angle, their speeds, forces at the two edges
B, H, J, g = 1, 2, 5/3, 9.81                      -- half width, half height, moment of inertia, m = 1
left, right = y - H*cos(th) - B*sin(th), y - H*cos(th) + B*sin(th)
block = dae { der(y) ~ w, der(th) ~ om, der(w) ~ -g + la + mu,
  J*der(om) ~ la*(H*sin(th) - B*cos(th)) + mu*(H*sin(th) + B*cos(th)),
  0 ~ min(left, la), 0 ~ min(right, mu) }

a = 0.1
rock = block:integrate { start = { y = H*math.cos(a) + B*math.sin(a), th = a, w = 0, om = 0 }, to = 1,
  rtol = 1e-8 }
print(rock.status)
first = rock:switches()[2].t
print(("first impact at %.4f: share of ω kept %.4f, by hand %.4f"):format(first,
  rock(om, first + 1e-9)/rock(om, first - 1e-9), (J - B^2)/(J + B^2)))
print(("at rest: forces %.4f and %.4f"):format(rock(la, 1), rock(mu, 1)))
