-- A hair dryer: air is blown through a tube and heated at the inlet; u is the heating voltage, y the air
-- temperature at the outlet. 1000 samples, 0.08 s (Feedback PT326; L. Ljung; data: scripts/data/SOURCES.md).
--
--   ./dev run scripts/hairdryer.lua                   the numbers, and the figures with: … hairdryer.lua show

local here = (arg and arg[0] or ""):match "^(.*)/[^/]*$" or "scripts"
d = iddata.read(here .. "/data/hairdryer.csv", { y = "y_temp", u = "u_voltage", Ts = 0.08 })
print(d)

print "\nThe estimate every textbook prints: samples 1..300, na = 2, nb = 2, nk = 3"
first = d:slice(1, 300):detrend()
mod = arx(first, { na = 2, nb = 2, nk = 3 })
print(mod)
expect(mod.theta):near({ -1.27373875, 0.393546077, 0.0666178822, 0.0444818773 }, 1e-8)

print "\nWhich orders, which delay? Estimated on one half, validated on the other"
e, v = d:split(0.5)
e, v = e:detrend(), v:detrend()
scan = order_scan(e, v, { na = {1, 10}, nb = {1, 10}, nk = {1, 5} })
print(scan)
print(("the delay: best fit with nk = 1 … 5 at na = nb = 2"))
for i = 1, #scan do
  local s = scan[i]
  if s.na == 2 and s.nb == 2 then print(("  nk = %d  validation fit %.3f %%"):format(s.nk, s.fit)) end
end

print "\nFive model classes"
models = {
  arx   = arx(e, { na = 2, nb = 2, nk = 3 }),
  armax = armax(e, { na = 2, nb = 2, nc = 2, nk = 3 }),
  oe    = oe(e, { nb = 2, nf = 2, nk = 3 }),
  bj    = bj(e, { nb = 2, nf = 2, nc = 1, nd = 1, nk = 3 }),
  -- state space by subspaces: nothing to choose but the order
  n4sid = n4sid(e, 4),
}
print(models.oe)
print(models.bj)
print(models.n4sid)
print(compare(v, models))

print "\nDo the residuals contain information that the model lacks?"
for _, name in ipairs { "arx", "oe", "bj" } do
  print(name .. ": " .. tostring(models[name]:validate(v)))
end

print "\nIf all that is known of the noise is |e| ≤ 0.2: the set of parameters that samples 1..300 allow"
set = arx(first, { na = 2, nb = 2, nk = 3, noise = uniform(-0.2, 0.2) })
print(set)
print(("%d vertices, volume %.6g; the least-squares estimate lies inside: %s"):format(#set.vertices,
  set.volume,
  tostring(set:contains(mod.theta))))
print(("the noise must reach at least |e| = %.6f somewhere (samples %s decide)"):format(set.smallest_bound,
  table.concat(set.deciding, ", ")))

if arg and arg[1] == "show" then
  first:plot():show()
  models.bj:plot(v):show()
  compare(v, models):plot():show()
  scan:plot():show()
  models.oe:validate(v):plot():show()
  models.bj:validate(v):plot("cross"):show()
  set:plot("b3", "b4"):show()
end
