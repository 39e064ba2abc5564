-- Explicit ODEs from textbooks, by which the choice of the method is judged (bench/choice.lua): a list of
-- { set, name, names or n, f, start, to }, and models of index 1, { set, name, build, to }. DETEST: Hull,
-- Enright, Fellen & Sedgwick, SIAM J. Numer. Anal. 9, 1972. STIFF DETEST: Enright, Hull & Lindberg, BIT 15,
-- 1975. The others have round numbers and stand for
-- their kinds: oscillators, kinetics, neurons, circuits, ecology, machines.
local list = {}
local class
local function ode(name, names, f, start, to)
  list[#list + 1] = { set = class, name = name, names = names, f = f, start = start, to = to }
end
local function each(name, n, f, start, to)  -- f(y) gives the list of x'
  list[#list + 1] = { set = class, name = name, n = n, f = f, start = start, to = to }
end
local function fill(n, v)
  local s = {}
  for i = 1, n do s[i] = type(v) == "function" and v(i) or v end
  return s
end
local S = math.sin

class = "DETEST"
ode("A1", "a", function(a) return -a end, {1}, 20)
ode("A2", "a", function(a) return -a^3/2 end, {1}, 20)
ode("A3", "a", function(a) return a*cos(t) end, {1}, 20)
ode("A4", "a", function(a) return a/4*(1 - a/20) end, {1}, 20)
ode("A5", "a", function(a) return (a - t)/(a + t) end, {4}, 20)
ode("B1", "a b", function(a, b) return 2*(a - a*b), -(b - a*b) end, {1, 3}, 20)
ode("B2", "a b c", function(a, b, c) return b - a, a - 2*b + c, b - c end, {2, 0, 1}, 20)
ode("B3", "a b c", function(a, b, c) return -a, a - b^2, b^2 end, {1, 0, 0}, 20)
ode("B4", "a b c", function(a, b, c) local r = sqrt(a^2 + b^2) return -b - a*c/r, a - b*c/r, a/r end, {3, 0,
  0}, 20)
ode("B5", "a b c", function(a, b, c) return b*c, -a*c, -.51*a*b end, {0, 1, 1}, 20)
ode("D3", "a b u v", function(a, b, u, v) local r = (a^2 + b^2)^(3/2) return u, v, -a/r, -b/r end, {0.5, 0,
  0, math.sqrt(3)}, 20)
ode("D5", "a b u v", function(a, b, u, v) local r = (a^2 + b^2)^(3/2) return u, v, -a/r, -b/r end, {0.1, 0,
  0, math.sqrt(19)}, 20)
ode("E2", "a b", function(a, b) return b, (1 - a^2)*b - a end, {2, 0}, 20)
ode("E3", "a b", function(a, b) return b, a^3/6 - a + 2*sin(2.78535*t) end, {0.1, 0}, 20)
ode("E4", "a b", function(a, b) return b, .032 - .4*b^2 end, {30, 0}, 20)
each("C1", 10, function(y) return fill(10,
  function(i) return i == 1 and -y[1] or i == 10 and y[9] or y[i-1] - y[i] end) end,
  fill(10, function(i) return i == 1 and 1 or 0 end), 20)
each("C3", 10, function(y) return fill(10,
  function(i) return (i > 1 and y[i-1] or 0) - 2*y[i] + (i < 10 and y[i+1] or 0) end) end,
  fill(10, function(i) return i == 1 and 1 or 0 end), 20)

class = "STIFF"
ode("A1", "a b c d", function(a, b, c, d) return -.5*a, -b, -100*c, -90*d end, {1, 1, 1, 1}, 20)
each("A2", 9, function(y) return fill(9, function(i)
  if i == 1 then return -1800*y[1] + 900*y[2] elseif i == 9 then return 1000*y[8] - 2000*y[9] + 1000 end
  return y[i-1] - 2*y[i] + y[i+1] end) end, fill(9, 0), 120)
ode("A3", "a b c d", function(a, b, c, d) return -1e4*a + 100*b - 10*c + d, -1e3*b + 10*c - 10*d, -c + 10*d,
  -.1*d end, {1, 1, 1, 1}, 20)
each("A4", 10, function(y) return fill(10, function(i) return -i^5*y[i] end) end, fill(10, 1), 1)
ode("B1", "a b c d", function(a, b, c, d) return -a + b, -100*a - b, -100*c + d, -10000*c - 100*d end, {1,
  0, 1, 0}, 20)
for k, al in ipairs { 3, 8, 25, 100 } do
  ode("B" .. k + 1, "a b c d p q", function(a, b, c, d, p, q) return -10*a + al*b, -al*a - 10*b, -4*c, -d,
    -.5*p, -.1*q end,
    {1, 1, 1, 1, 1, 1}, 20)
end
ode("C1", "a b c d", function(a, b, c, d) return -a + b^2 + c^2 + d^2, -10*b + 10*(c^2 + d^2),
  -40*c + 40*d^2, -100*d + 2 end, {1, 1, 1, 1}, 20)
for k, be in ipairs { .1, 1, 10, 20 } do
  ode("C" .. k + 1, "a b c d", function(a, b, c, d) return -a + 2, -10*b + be*a^2, -40*c + 4*be*(a^2 + b^2),
    -100*d + 10*be*(a^2 + b^2 + c^2) end, {1, 1, 1, 1}, 20)
end
ode("D1", "a b c", function(a, b, c) return .2*(b - a), 10*a - (60 - .125*c)*b + .125*c, 1 + 0*a end, {0, 0,
  0}, 400)
ode("D2", "a b c", function(a, b, c) return -.04*a + .01*b*c, 400*a - 100*b*c - 3000*b^2, 30*b^2 end, {1, 0,
  0}, 40)
ode("D3", "a b c d", function(a, b, c, d) return c - 100*a*b, c + 2*d - 100*a*b - 2e4*b^2, -c + 100*a*b,
  -d + 1e4*b^2 end, {1, 1, 0, 0}, 20)
ode("D4", "a b c", function(a, b, c) return -.013*a - 1000*a*c, -2500*b*c,
  -.013*a - 1000*a*c - 2500*b*c end, {1, 1, 0}, 50)
ode("D5", "a b", function(a, b) return .01 - (1 + (a + 1000)*(a + 1))*(.01 + a + b),
  .01 - (1 + b^2)*(.01 + a + b) end, {0, 0}, 100)
ode("D6", "a b c", function(a, b, c) local p, q = -a + 1e8*c*(1 - a), -10*b + 3e7*c*(1 - b) return p, q,
  -p - q end, {1, 0, 0}, 1)
ode("E1", "a b c d", function(a, b, c, d) local G = 100
  return b, c, d, (a^2 - sin(a) - G^4)*a + (b*c/(a^2 + 1) - 4*G^3)*b + (1 - 6*G^2)*c + (10*exp(-d^2) -
    4*G)*d + 1 end, {0, 0, 0, 0}, 1)
ode("E2", "a b", function(a, b) return b, 5*(1 - a^2)*b - a end, {2, 0}, 1)
ode("E3", "a b c", function(a, b, c) return -(55 + c)*a + 65*b, .0785*(a - b), .1*a end, {1, 1, 0}, 500)
ode("F1", "a b c d", function(a, b, c, d) local k = exp(20.7 - 1500/a)
  return 1.3*(c - a) + 10400*k*b, 1880*(d - b*(1 + k)), 1752 - 269*c + 267*a, .1 + 320*b - 321*d end, {50,
    0, 600, .1}, 1000)
ode("F2", "a b", function(a, b) return -a - a*b + 294*b, a*(1 - b)/98 - 3*b end, {1, 0}, 240)
ode("F3", "a b c d p", function(a, b, c, d, p) return -1e7*b*a + 10*c, -1e7*b*a - 1e7*b*p + 10*c + 10*d,
  1e7*b*a - 1.001e4*c + 1e-3*d, 1e4*c - 10.001*d + 1e7*b*p, 10*d - 1e7*b*p end, {4e-6, 1e-6, 0, 0, 0}, 100)
ode("F4", "a b c", function(a, b, c) return 77.27*(b - a*b + a - 8.375e-6*a^2), (-b - a*b + c)/77.27,
  .161*(a - c) end, {4, 1.1, 4}, 300)

class = "VDP"
for _, mu in ipairs { 1, 2, 3, 5, 8, 10, 20, 30, 100, 1000 } do
  ode("vdp " .. mu, "a b", function(a, b) return b, mu*(1 - a^2)*b - a end, {2, 0},
    mu <= 10 and 50 or 3.3*mu)
end

class = "OTHER"
for _, B in ipairs { 3, 4, 6, 8, 12 } do
  ode("Brusselator B=" .. B, "a b", function(a, b) return 1 + a^2*b - (B + 1)*a, B*a - a^2*b end, {1.5, 3},
    B < 8 and 40 or 60)
end
for _, mu in ipairs { 3, 8, 15 } do
  ode("forced vdp " .. mu, "a b", function(a, b) return b, mu*(1 - a^2)*b - a + 1.2*sin(t/2) end, {2, 0},
    60)
end
for _, l in ipairs { 5, 10, 30, 100, 1000, 1e5 } do
  ode("x'=-l(x-sin)+cos " .. l, "a", function(a) return -l*(a - sin(t)) + cos(t) end, {1}, 20)
end
for _, l in ipairs { 30, 300 } do
  ode("x'=-l(x-cos 5t) with pendulum " .. l, "a b c", function(a, b, c) return -l*(a - cos(5*t)), c,
    -sin(b)*(1 + a/10) end, {1, 1, 0}, 60)
end
for _, d in ipairs { 1e-2, 1e-3, 1e-4 } do
  ode("flame " .. d, "a", function(a) return a^2 - a^3 end, {d}, 2/d)
end
ode("explosion", "a b", function(a, b) return -a*exp(20*(1 - 1/b))*1e-2,
  a*exp(20*(1 - 1/b))*1e-2 - .1*(b - 0.9) end, {1, 0.9}, 60)
ode("Robertson 1e3", "a b c", function(a, b, c) return -.04*a + 1e4*b*c, .04*a - 1e4*b*c - 3e7*b^2,
  3e7*b^2 end, {1, 0, 0}, 1e3)
ode("HIRES", "a b c d p q r s", function(a, b, c, d, p, q, r, s)
  return -1.71*a + .43*b + 8.32*c + .0007, 1.71*a - 8.75*b, -10.03*c + .43*d + .035*p,
    8.32*b + 1.71*c - 1.12*d,
    -1.745*p + .43*q + .43*r, -280*q*s + .69*d + 1.71*p - .43*q + .69*r, 280*q*s - 1.81*r, -280*q*s + 1.81*r
  end, {1, 0, 0, 0, 0, 0, 0, .0057}, 321.8122)
for _, e in ipairs { .1, .03, .01 } do
  ode("FitzHugh-Nagumo " .. e, "a b", function(a, b) return (a - a^3/3 - b + .5)/e, a + .7 - .8*b end, {-1,
    0}, 30)
end
ode("Morris-Lecar", "v n", function(v, n) local m = (1 + tanh((v + 1.2)/18))/2
  local w = (1 + tanh((v - 2)/30))/2
  return (95 - 4.4*m*(v - 120) - 8*n*(v + 84) - 2*(v + 60))/20, .04*(w - n)*cosh((v - 2)/60) end, {-30, .1},
    500)
ode("Hodgkin-Huxley", "v m h n", function(v, m, h, n)
  local am, bm = .1*(v + 40)/(1 - exp(-(v + 40)/10)), 4*exp(-(v + 65)/18)
  local ah, bh = .07*exp(-(v + 65)/20), 1/(1 + exp(-(v + 35)/10))
  local an, bn = .01*(v + 55)/(1 - exp(-(v + 55)/10)), .125*exp(-(v + 65)/80)
  return 10.3 - 120*m^3*h*(v - 50) - 36*n^4*(v + 77) - .3*(v + 54.387), am*(1 - m) - bm*m,
    ah*(1 - h) - bh*h, an*(1 - n) - bn*n
  end, {-64, .06, .6, .33}, 100)
ode("Hindmarsh-Rose", "a b c", function(a, b, c) return b - a^3 + 3*a^2 - c + 3, 1 - 5*a^2 - b,
  .006*(4*(a + 1.6) - c) end, {-1, 0, 2}, 150)
ode("Lorenz 5", "a b c", function(a, b, c) return 10*(b - a), a*(28 - c) - b, a*b - 8/3*c end, {-8, 8, 27},
  5)
ode("Roessler", "a b c", function(a, b, c) return -b - c, a + .2*b, .2 + c*(a - 5.7) end, {1, 1, 0}, 40)
ode("Lotka-Volterra", "a b", function(a, b) return a*(1 - b), b*(a - 1) end, {3, 1}, 40)
ode("Rosenzweig-MacArthur", "a b", function(a, b) return 5*a*(1 - a/3) - 5*a*b/(1 + a),
  b*(a/(1 + a) - .3) end, {1, .5}, 100)
ode("Duffing", "a b", function(a, b) return b, a - a^3 - .25*b + .3*cos(t) end, {1, 0}, 50)
ode("Rayleigh 10", "a b", function(a, b) return b, 10*(1 - b^2/3)*b - a end, {2, 0}, 50)
for _, c in ipairs { 10, 100 } do
  ode("damped pendulum " .. c, "a b", function(a, b) return b, -c*b - c*sin(a) end, {2, 0}, 30)
end
ode("Josephson", "a b", function(a, b) return b, 50*(1.2 + sin(t/10) - b - sin(a)) end, {0, 0}, 60)
ode("Oregonator scaled", "a b c", function(a, b, c) return (a*(1 - a) + b*(8e-4 - a))/.04,
  (-8e-4*b - a*b + c)/4e-4*1e-1, a - c end, {.1, .1, .1}, 30)
ode("autocatalator", "a b", function(a, b) return .5 - a*b^2 - .01*a, (a*b^2 - b + .01*a)/.05 end, {1, .5},
  60)
ode("Lengyel-Epstein", "a b", function(a, b) return 10 - a - 4*a*b/(1 + a^2), 2*a*(1 - b/(1 + a^2)) end, {1,
  2}, 40)
ode("glycolysis", "a b", function(a, b) return -a + .08*b + a^2*b, .6 - .08*b - a^2*b end, {1, 1}, 60)
ode("repressilator", "a b c p q r", function(a, b, c, p, q, r)
  return -a + 200/(1 + r^2) + .2, -b + 200/(1 + p^2) + .2, -c + 200/(1 + q^2) + .2, 5*(a - p), 5*(b - q),
    5*(c - r) end, {1, 2, 3, 1, 1, 1}, 50)
ode("Goodwin", "a b c", function(a, b, c) return 1/(.1 + c^10) - .2*a, a - .2*b, .2*b - .2*c*(1 + 0*a) end,
  {.5, 1, 1}, 100)
ode("Olsen", "a b x y", function(a, b, x, y)
  return .5 - .0005*a*0 - .35*b*0 - 3*a*b*y/5 - .1*a + 0, .8 - .035*b*x*20 - 3*a*b*y/5,
    4*.25*b*x - 5*x^2 + 3*a*b*y/2.5 - 2*x + .001 + .02,
    5*x^2 - 5.35*y - 3*a*b*y/5 end, {1, 1, .1, .1}, 100)
ode("CSTR", "a b", function(a, b) local r = .072*(1 - a)*exp(b/(1 + b/20)) return -a + r,
  -b + 8*r - .3*b end, {0, 0}, 50)
ode("diode RC", "a b", function(a, b) local i = 1e-6*(exp((5*sin(t) - a)/.1) - 1)
  return i/.01 - a/1, (a - b)/.5 end, {0, 0}, 20)
ode("Chua", "a b c", function(a, b, c) return 9*(b - a + 8/7*a - .1*a^3), a - b + c, -14.3*b end, {.7, 0,
  0}, 15)
each("heat 10", 10, function(y) return fill(10,
  function(i) return 121*((i > 1 and y[i-1] or 0) - 2*y[i] + (i < 10 and y[i+1] or 0)) end) end,
  fill(10, function(i) return S(.3*i) end), 2)
each("heat 20 driven", 20, function(y) return fill(20,
  function(i) return 441*((i > 1 and y[i-1] or sin(3*t)) - 2*y[i] + (i < 20 and y[i+1] or 0)) end) end,
  fill(20, 0), 10)
each("repulsion chain", 12, function(y) return fill(12, function(i)
  if i <= 6 then return y[i + 6] end
  local j = i - 6
  return (j > 1 and y[j-1] or 0) - 2*y[j] + (j < 6 and y[j+1] or 0) - y[j]^3 end) end, fill(12,
    function(i) return i == 1 and 1 or 0.1 end), 40)
ode("stiff spring pendulum", "a b u v", function(a, b, u,
  v) local r = sqrt(a^2 + b^2) local l = 300*(r - 1)/r
  return u, v, -l*a, -l*b - 1 end, {1, 0, 0, 0}, 20)
ode("brake", "a b", function(a, b) return b, -a - 5e4*(1 - tanh(15*(t - 1)))*b + sin(t/3) end, {1, 0}, 200)
ode("brake put on", "a b", function(a, b) return b, -a - 500*(1 + tanh(3*(t - 20)))*b + sin(t/3) end, {1,
  0}, 60)
ode("laser", "a b c", function(a, b, c) return 100*(b - a), b*c - b, .5*(2 - c - a*b) end, {.1, .1, 1}, 100)
ode("ozone", "a b c", function(a, b, c) return -a*c - 2*a*b*.1 + 50*b^2*.1, 30*(1 - b) - 30*b*c,
  20*b*c*.1 - .5*c + .1 end, {1, 0, 1}, 40)

-- Models by which rules are checked that others suggested.
class = "CHECK"
ode("vdp 4", "a b", function(a, b) return b, 4*(1 - a^2)*b - a end, {2, 0}, 80)
ode("vdp 6.5", "a b", function(a, b) return b, 6.5*(1 - a^2)*b - a end, {1, 0}, 100)
ode("vdp 14", "a b", function(a, b) return b, 14*(1 - a^2)*b - a end, {1, 1}, 90)
ode("vdp 50", "a b", function(a, b) return b, 50*(1 - a^2)*b - a end, {1, 1}, 200)
ode("Brusselator 10", "a b", function(a, b) return 1 + a^2*b - 11*a, 10*a - a^2*b end, {1, 1}, 80)
ode("Brusselator A=2 B=9", "a b", function(a, b) return 2 + a^2*b - 10*a, 9*a - a^2*b end, {1, 1}, 40)
ode("Bonhoeffer", "a b", function(a, b) return 12*(b + a - a^3/3 - .4), -(a - .7 + .8*b)/12 end, {0, 0}, 80)
ode("Wilson-Cowan", "a b", function(a, b) local function s(z, k) return 1/(1 + exp(-k*z)) end
  return (-a + s(16*a - 12*b + 1.25 - 4, 1.3))*5, -b + s(15*a - 3*b - 3.7, 2) end, {.1, .05}, 60)
ode("Traub cell", "v n c", function(v, n, c) local m = 1/(1 + exp(-(v + 30)/7))
  return 20*(1.5 - 10*m^3*(1 - n)*(v - 50)/100 - 6*n*(v + 90)/30 - c*(v + 90)/50),
    (1/(1 + exp(-(v + 35)/6)) - n)/1.2,
    .02*(1/(1 + exp(-(v + 20)/10)) - c) end, {-60, .1, .2}, 100)
ode("Tyson cell cycle", "u v", function(u, v) return 180*(v - u)*(.018/180 + u^2) - 1.0*u, .015 - 1.0*u end,
  {.1, .2}, 200)
ode("CO oxidation", "a b c", function(a, b, c) local e = 1 - a - b - c
  return 2.5*e^2 - 10*a*b, 1.0*e*1.2 - .2*b - 10*a*b, .1*e - .05*c end, {.3, .2, .1}, 80)
ode("thermal runaway 2", "a b", function(a, b) return 5*exp(b - 5)*(1 - a),
  12*5*exp(b - 5)*(1 - a) - 2*b end, {0, 0}, 30)
ode("ignition", "a b", function(a, b) return -a*b, a*b - b + 1e-4*a*0 end, {12, 1e-6}, 60)
ode("SIR with seasons", "a b", function(a, b) local c = 60*(1 + .2*cos(6.28*t)) return .02*(1 - a) - c*a*b,
  c*a*b - 13*b end, {.3, .001}, 30)
ode("predator, fast prey", "a b", function(a, b) return 20*(a*(1 - a) - 2*a*b/(.3 + a)),
  a*b*2/(.3 + a) - .8*b end, {.5, .3}, 60)
ode("spruce budworm", "a b", function(a, b) return 10*(a*(1 - a/b) - 2*a^2/(.25 + a^2)),
  .3*b*(1 - b/12) - .04*a*0 - .02*a*b end, {.3, 2}, 60)
ode("SQUID", "a b", function(a, b) return b, 20*(.8*sin(.7*t) - b - sin(a)*1.5 - a/10) end, {0, 0}, 50)
ode("op-amp saturating", "a b", function(a, b) return 200*(tanh(3*(sin(t) - a))), 10*(a - b) end, {0, 0},
  30)
ode("rectifier", "a b", function(a, b) local i = .02*(1 + tanh(20*(sin(2*t) - a - .1)))*(sin(2*t) - a -
  .1)*100
  return 20*i - a, 3*(a - b) end, {0, 0}, 20)
ode("Colpitts", "a b c", function(a, b, c) return 5*(1 - exp(-b)) *1 + 5*(c) - 5*0, 5*c,
  -.33*(a + b)*1 - .7*c end, {.1, .1, .1}, 15)
ode("robot joint", "a b u v", function(a, b, u, v) return u, v, 50*(b - a) + 2*(v - u) - sin(a),
  400*(a - b) - 60*v - 40*(b - sin(t)) end, {0, 0, 0, 0}, 30)
ode("friction disc", "a b", function(a, b) return b,
  -a + tanh(30*(.5 - b))*(.6 + .4*exp(-4*(.5 - b)^2)) end, {0, 0}, 50)
ode("quarter car", "a b u v", function(a, b, u, v) return u, v, -20*(a - b) - 2*(u - v),
  200*(a - b) + 20*(u - v) - 2000*(b - sin(4*t)/10) - 30*v end,
  {0, 0, 0, 0}, 20)
ode("cooled reactor", "a b c", function(a, b, c) local r = a*exp(15 - 15/b)
  return 1 - a - r, 1 - b + .3*r - 2*(b - c), 40*(.95 - c) + 60*(b - c) end, {1, 1, .95}, 30)
ode("enzyme", "s e c p", function(s, e, c, p) return -50*s*e + 5*c, -50*s*e + 25*c, 50*s*e - 25*c, 20*c end,
  {1, .05, 0, 0}, 100)
ode("Chapman", "a b", function(a, b) local k = .5*(1 + tanh(4*sin(t/3))) return 2*k - 300*a*b*.1 - a,
  20*k*(1 - b) - 30*a*b end, {0, .1}, 40)
each("oscillator ring", 6, function(y) return fill(6,
  function(i) return 4*(-tanh(3*y[i > 1 and i - 1 or 5]) - y[i])*(i < 6 and 1 or .1) end) end,
  fill(6, function(i) return S(2*i) end), 40)
each("advection 15", 15, function(y) return fill(15,
  function(i) return 16*((i > 1 and y[i-1] or sin(2*t)) - y[i]) end) end, fill(15, 0), 10)
each("diffusion and reaction 12", 12, function(y) return fill(12, function(i)
  return 169*.3*((i > 1 and y[i-1] or 1) - 2*y[i] + (i < 12 and y[i+1] or 0)) + 8*y[i]*(1 - y[i]) end) end,
    fill(12, 0), 4)
each("three vdp", 6, function(y) return fill(6, function(i)
  if i <= 3 then return y[i + 3] end
  local j = i - 3
  return 5*j*(1 - y[j]^2)*y[i] - y[j] + .2*(y[j % 3 + 1] - y[j]) end) end, fill(6,
    function(i) return i <= 3 and 2 - .3*i or 0 end), 60)
each("kinetics 8", 8, function(y) return fill(8, function(i)
  local function r(k) return (k % 3 == 0 and 200 or 5)*y[k] end
  return (i > 1 and r(i - 1) or 1) - r(i) - (i > 2 and .5*y[i]*y[i-2] or 0) end) end, fill(8, 0), 30)

-- The same, written after the rules stood.
class = "CHECK 2"
ode("vdp 7 T=120", "a b", function(a, b) return b, 7*(1 - a^2)*b - a end, {0.5, 0}, 120)
ode("vdp 25", "a b", function(a, b) return b, 25*(1 - a^2)*b - a end, {2, -1}, 150)
ode("Lienard", "a b", function(a, b) return 6*(b - (a^5/5 - a)), -a end, {1.5, 0}, 60)
ode("two coupled FHN", "a b c d", function(a, b, c, d) return 12*(a - a^3/3 - b + .1*(c - a)),
  a + .7 - .8*b, 12*(c - c^3/3 - d + .1*(a - c)) + 4, c + .7 - .8*d end, {-1, 0, 1, .5}, 60)
ode("Nagumo pulse cell", "a b", function(a, b) return 50*(a*(a - .1)*(1 - a) - b + .2), .5*(a - 2*b) end,
  {0, 0}, 80)
ode("bursting thermostat", "a b c", function(a, b, c) return -20*(a - tanh(8*(b - c))), -b + 1.5 - a,
  .05*(b - c) end, {0, .5, .6}, 100)
ode("DC motor with load", "i w q", function(i, w, q) return (12*sin(.5*t) - 1.2*i - .05*w)/.002*.01,
  5*i - .1*w - 2*tanh(10*w), w end, {0, 0, 0}, 40)
ode("buffer pH", "a b c", function(a, b, c) return .1 - 80*a*b + .2*c, .02*(1 + sin(t)) - 80*a*b + .2*c,
  80*a*b - .3*c end, {.1, 0, 0}, 50)
ode("Michaelis with inflow", "s p", function(s, p) return .5 + .4*sin(t) - 6*s/(.05 + s),
  6*s/(.05 + s) - 2*p end, {.1, 0}, 60)
ode("tank with valve", "h v", function(h, v) return .3*(1 + sin(t)) - v*sqrt(h + .01),
  30*(tanh(2*(h - .5)) + 1 - v) end, {.4, .5}, 60)
ode("phase lock loop", "p q", function(p, q) return q - 8*sin(p), 3 - 25*q + 25*.9*cos(.4*t) end, {0, 0},
  60)
ode("glow discharge", "a b", function(a, b) return 40*(1 - a - a*b), .8*a*b*4 - b + .001 end, {1, .01}, 60)
ode("SEIR", "s e i", function(s, e, i) local f = 1.8*(1 + .3*sin(.5*t))*s*i return .02*(1 - s) - f,
  f - 5*e - .02*e, 5*e - i end, {.8, .01, .01}, 120)
ode("laser with fast polarisation", "e p d", function(e, p, d) return 2*(p - e), 40*(e*d - p),
  1.5*(1.8 - d) - 4*e*p end, {.1, .1, 1}, 60)
ode("gene toggle", "a b m", function(a, b, m) return 5/(1 + b^4) - a + .5*sin(.3*t), 5/(1 + a^4) - b,
  60*(a - m) end, {1, 1.2, 0}, 60)
ode("sedimenting pendulum", "a b c", function(a, b, c) return b, -sin(a) - .02*b + .2*c,
  -200*(c - cos(a)*sin(t)) end, {1, 0, 0}, 50)
ode("snap-through arch", "a b", function(a, b) return b, 80*(a - a^3) - 25*b + 30*cos(.8*t) end, {1, 0}, 60)
ode("stiff then free", "a b", function(a, b) return b, -a - 2000*exp(-t)*(b + .1) end, {1, 0}, 120)
ode("free then stiff", "a b", function(a, b) return b, -a - 3*(1 + tanh(t - 30))*50*b end, {1, 0}, 70)
ode("decaying reactions", "a b c d", function(a, b, c, d) return -3*a, 3*a - 90*b, 90*b - 1*c, c - .1*d end,
  {1, 0, 0, 0}, 40)
each("diffusion ring 8 driven", 8, function(y) return fill(8,
  function(i) return 30*(y[i % 8 + 1] - 2*y[i] + y[(i + 6) % 8 + 1]) + (i == 1 and sin(t) or -.1*y[i]) end)
  end, fill(8, 0), 30)
each("RC ladder 12 driven", 12, function(y) return fill(12,
  function(i) return 20*((i > 1 and y[i-1] or sin(4*t)) - y[i]) + (i < 12 and 20*(y[i+1] - y[i]) or 0) end)
  end, fill(12, 0), 20)
each("coupled Brusselators", 4, function(y) local function f(a, b, o) return 1 + a^2*b - 7*a + .3*(o - a),
  6*a - a^2*b end
  local p, q = f(y[1], y[2], y[3]) local r, s = f(y[3], y[4], y[1]) return { p, q, r, s } end, {1, 1, 1.2,
    5}, 60)
each("neural mass 6", 6, function(y) local function S(v) return 5/(1 + exp(.56*(6 - v))) end
  return { y[4], y[5], y[6], 3.25*100*S(y[2] - y[3])*.01 - 2*y[4]*10 - 100*y[1],
    3.25*100*(1.2 + .8*S(1.35*y[1])*.1) - 20*y[5] - 100*y[2],
    22*50*.25*.3*S(.3*y[1]) - 10*y[6] - 25*y[3] } end, fill(6, 0), 20)

-- Index 1, every z in equations that are not linear in it, some beside borders that contain it. build() gives
-- the model, its start, and the states that are compared.
class = "INDEX 1"
local function index1(name, to, build)
  list[#list + 1] = { set = class, name = name, to = to, build = function()
    local equations, fix, guess, states = build()
    local model = dae(equations)
    return model, model:init { fix = fix, guess = guess }, states
  end }
end
for _, n in ipairs { 20, 80 } do  -- q adsorbed, c in the fluid
  index1("adsorption column " .. n, 8, function()
    local q, c = var("q", n), var("c", n)
    local equations, fix, guess, states = {}, {}, {}, {}
    for i = 1, n do
      equations[i] = der(q[i]) ~ n*((i > 1 and c[i-1] or 1 + 0.3*sin(t)) - c[i])
      equations[n + i] = 0 ~ c[i] + 4*c[i]/(0.2 + c[i]) - q[i]
      fix[q[i]], guess[c[i]], states[i] = 0.02, 0.001, q[i]
    end
    return equations, fix, guess, states
  end)
end
index1("journal bearing", 40, function()  -- the eccentricity e carries the load, heat thins the oil
  local w, T, e = vars "w T e"
  local drag = w*exp(-T/2)/sqrt(1 - e^2)
  return { der(w) ~ 2 - 0.4*drag - 0.3*w, der(T) ~ 0.8*w*drag - T,
    0 ~ 3*w*exp(-T/2)*e/(1 - e^2)^1.5 - 1 - 0.6*sin(2*t) }, { [w] = 1, [T] = 0 }, { [e] = 0.3 }, { w, T }
end)
index1("valve and accumulator", 40, function()
  local p, h, q = vars "p h q"
  return { der(p) ~ 50*(q - (0.51 + 0.49*sin(t))*tanh(3*p)), der(h) ~ 0.4 - q,
    0 ~ q + 0.5*q*sqrt(q^2 + 0.01) - h + p }, { [p] = 0.5, [h] = 1 }, { [q] = 0.3 }, { p, h }
end)
index1("snubber", 60, function()
  local x, v, z = vars "x v z"
  local stops = ifelse(gt(z, 0.4), -2*(z - 0.4), 0) + ifelse(lt(z, -0.3), -3*(z + 0.3), 0)
  return { der(x) ~ v, der(v) ~ -x - z - 0.1*v + stops + 0.5*sin(1.7*t),
    0 ~ z + 2*z^3 + 0.2*sinh(z) - x - 0.2*v }, { [x] = 1, [v] = 0 }, { [z] = 0.3 }, { x, v }
end)
index1("chain with stops", 30, function()
  local n = 8
  local x, v, z = var("x", n), var("v", n), var("z", n)
  local equations, fix, guess, states = {}, {}, {}, {}
  for i = 1, n do
    equations[#equations + 1] = der(x[i]) ~ v[i]
    equations[#equations + 1] = der(v[i]) ~ 4*((i > 1 and x[i-1] or 0.3*sin(1.3*t)) - 2*x[i] +
      (i < n and x[i+1] or 0)) - 0.1*v[i] - ifelse(gt(z[i], 0.2), 20*(z[i] - 0.2), 0)
    equations[#equations + 1] = 0 ~ z[i] + z[i]^3 - x[i]
    fix[x[i]], fix[v[i]], guess[z[i]], states[i], states[n + i] = 0, 0, 0, x[i], v[i]
  end
  return equations, fix, guess, states
end)
return list
