-- Bodies in space: frames with position r and orientation q (unit quaternions), force f on the part and n,
-- the
-- generalised force that belongs to q. A torque M (in space) is n = 2 Eᵀ(q) M.
local component, connector = named "component", named "connector"
local s = use "components/library" ("spatial", "rigid bodies in space; gravity pulls along -z")
local rotational = use "components/rotational"

s.frame = connector("spatial frame", { across = { r = { "m", 3 }, q = { "", 4 } },
  through = { f = { "N", 3 }, n = { "N*m", 4 } }, pairs = { r = "f", q = "n" },
  idle = { q = vec { 1, 0, 0, 0 } }, held_by = "a fixed frame, or to a body" })

local euler = "Euler parameters: Nikravesh, Computer-Aided Analysis of Mechanical Systems, ch. 6 and 11"

-- Axes of the body in space.
local function rotation(q)
  local a, b, c, d = q[1], q[2], q[3], q[4]
  return mat { { a^2 + b^2 - c^2 - d^2, 2*(b*c - a*d), 2*(b*d + a*c) },
               { 2*(b*c + a*d), a^2 - b^2 + c^2 - d^2, 2*(c*d - a*b) },
               { 2*(b*d - a*c), 2*(c*d + a*b), a^2 - b^2 - c^2 + d^2 } }
end
rawset(s, "rotation", rotation)

-- The speed of turning in the axes of the body is 2 G(q) q′.
local function body_rates(q)
  local a, b, c, d = q[1], q[2], q[3], q[4]
  return mat { { -b, a, d, -c }, { -c, -d, a, b }, { -d, c, -b, a } }
end

-- The same in the axes of space: 2 E(q) q′.
local function space_rates(q)
  local a, b, c, d = q[1], q[2], q[3], q[4]
  return mat { { -b, a, -d, c }, { -c, d, a, -b }, { -d, -c, b, a } }
end

local function list_of(v)
  local list = {}
  for k = 1, #v do list[k] = v[k] end
  return list
end

s.fixed = component("fixed", { r = { { 0, 0, 0 }, unit = "m" },
  q = { { 1, 0, 0, 0 }, text = "orientation, a unit quaternion" } }, function(self)
  self.frame = s.frame
  self:anchored(self.frame)
  return { self.frame.r ~ self.r, self.frame.q ~ vec(self.given.q) }
end, { text = "A frame at rest.", source = "definition",
  example = [[
    x = model { w = e.fixed{ r = {1, 2, 3} }, B = e.body{ m = 2 }, connect("w.frame", "B.frame") }
    return x:dae():init{}(x.B.frame.f[3])]], gives = "19.62" })

s.body = component("body", { m = { 1, unit = "kg" },
  J = { { 1, 1, 1 }, unit = "kg*m^2", text = "principal moments" },
  g = { 9.81, unit = "m/s^2" }, r0 = { false, unit = "m", text = "position at the start" },
  v0 = { false, unit = "m/s" }, q0 = { false, text = "orientation at the start" },
  w0 = { false, unit = "rad/s", text = "speed of turning at the start, in the axes of the body" } },
    function(self)
  self.frame = s.frame
  local r, q, w = self:var("r", 3), self:var("q", 4), self:var("w", 3)
  local lambda = self:var "lambda"
  local W = 2*body_rates(q)*q.dot
  local turning = (self.J[1]*W[1]^2 + self.J[2]*W[2]^2 + self.J[3]*W[3]^2)/2
  for k = 1, 3 do
    if self.given.r0 then self:start(r[k], self.r0[k]) end
    if self.given.v0 then self:start(der(r[k]), self.v0[k]) end
    if self.given.w0 then self:start(w[k], self.w0[k]) end
  end
  for k = 1, 4 do
    if self.given.q0 then self:start(q[k], self.q0[k]) else self:guess(q[k], k == 1 and 1 or 0) end
  end
  self.energy = self.m*(r.dot.T*r.dot)/2 + turning + self.m*self.g*r[3]
  local f = self.frame
  self:normalise(f, q.T*q ~ 1, lambda)
  return { r ~ f.r, q ~ f.q, w ~ W, self.m*der(r, 2) ~ f.f - vec { 0, 0, self.m*self.g },
    der(gradient(turning, q.dot)) - gradient(turning, q) ~ f.n + lambda*q }
end, { text = "A rigid body with its frame at the centre of mass, along its principal axes.", source = euler,
  example = [[
    x = model { B = e.body{ r0 = {0, 0, 0}, v0 = {1, 0, 9.81}, q0 = {1, 0, 0, 0}, w0 = {0, 0, 0} },
                connect("B.frame") }
    return x:reduce():integrate{ to = 2 }(x.B.r[3], 2)]], gives = "0.0" })

s.rod = component("rod", { d = { { 1, 0, 0 }, unit = "m", text = "from a to b, in the axes of a" } },
  function(self)
  self.a, self.b = s.frame, s.frame
  local a, b = self.a, self.b
  self:rigid(a, b)
  local arm = rotation(a.q)*self.d
  return { b.r ~ a.r + arm, b.q ~ a.q, zeros(3, 1) ~ a.f + b.f,
    zeros(4, 1) ~ a.n + b.n + jacobian(arm, a.q).T*b.f }
end, { text = "Two frames of one rigid body.", source = euler,
  example = [[
    x = model { A = e.body{ g = 0, r0 = {-1, 0, 0}, v0 = {0, -1, 0}, q0 = {1, 0, 0, 0}, w0 = {0, 0, 1} },
                R = e.rod{ d = {2, 0, 0} }, B = e.body{ g = 0 }, connect("A.frame", "R.a"), connect("R.b",
                  "B.frame") }
    return x:reduce():integrate{ to = math.pi/2, rtol = 1e-8 }(x.B.r[2], math.pi/2)]], gives = "1.0" })

-- A joint is its constraints c = 0 with multipliers: the through variables are their gradients.
local function joint(self, make)
  self.a, self.b = s.frame, s.frame
  local a, b = self.a, self.b
  local c = make(a, b)
  local z = self:var("z", #c)
  local work, zero = 0, {}
  for k = 1, #c do work, zero[k] = work + z[k]*c[k], 0 ~ c[k] end
  return { zero, a.f ~ gradient(work, a.r), b.f ~ gradient(work, b.r), a.n ~ gradient(work, a.q),
    b.n ~ gradient(work, b.q) }
end

-- Two directions at right angles to an axis of space: of the three axes, those that are not this one.
local function across(axis)
  local all = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }
  local index = ({ x = 1, y = 2, z = 3 })[axis]
  if not index then
    fail(("the axis of a joint is \"x\", \"y\" or \"z\", not '%s'"):format(tostring(axis)))
  end
  return vec(all[index]), vec(all[index % 3 + 1]), vec(all[(index + 1) % 3 + 1])
end

-- Of the turn from a to b, the vector part: 0 where the axes agree.
local function turn(a, b)
  local p, q = a.q, b.q
  return { p[1]*q[2] - p[2]*q[1] - p[3]*q[4] + p[4]*q[3], p[1]*q[3] - p[3]*q[1] - p[4]*q[2] + p[2]*q[4],
    p[1]*q[4] - p[4]*q[1] - p[2]*q[3] + p[3]*q[2] }
end

s.spherical = component("spherical", {}, function(self)
  return joint(self, function(a, b) return list_of(a.r - b.r) end)
end, { text = "A ball joint: the origins of a and b agree.", source = euler,
  example = [[
    x = model { w = e.fixed{}, j = e.spherical{}, R = e.rod{ d = {0, 0.6, -0.8} }, connect("w.frame", "j.a"),
                B = e.body{ m = 2, J = {1, 1, 1}, g = 8, q0 = {1, 0, 0, 0}, w0 = {0, 0, math.sqrt(10)} },
                connect("j.b", "R.a"), connect("R.b", "B.frame") }
    t1 = math.pi/math.sqrt(10)       -- conical pendulum: w² = g/h, half a turn
    return x:reduce():integrate{ to = t1, rtol = 1e-8 }(x.B.r[2], t1)]], gives = "-0.6" })

s.revolute = component("revolute", { axis = { "z", text = "x, y or z, of both frames" } }, function(self)
  return joint(self, function(a, b)
    local e, u, v = across(self.given.axis)
    local axis = rotation(b.q)*e
    local c = list_of(a.r - b.r)
    c[4], c[5] = dot(rotation(a.q)*u, axis), dot(rotation(a.q)*v, axis)
    return c
  end)
end, { text = "A hinge.", source = euler,
  example = [[
    x = model { w = e.fixed{}, j = e.revolute{ axis = "z" }, R = e.rod{ d = {2, 0, 0} }, connect("w.frame",
      "j.a"),
                B = e.body{ q0 = {1, 0, 0, 0}, w0 = {0, 0, 1} }, connect("j.b", "R.a"), connect("R.b",
                  "B.frame") }
    return x:reduce():integrate{ to = math.pi/2, rtol = 1e-8 }(x.B.r[2], math.pi/2)]], gives = "2.0" })

s.universal = component("universal", { a_axis = "x", b_axis = "y" }, function(self)
  return joint(self, function(a, b)
    local c = list_of(a.r - b.r)
    c[4] = dot(rotation(a.q)*(across(self.given.a_axis)), rotation(b.q)*(across(self.given.b_axis)))
    return c
  end)
end, { text = "Cardan's joint: an axis of a and one of b stay at right angles.", source = euler,
  example = [[
    x = model { w = e.fixed{}, j = e.universal{}, R = e.rod{ d = {0, 0, -2} }, connect("w.frame", "j.a"),
                B = e.body{ g = 0, q0 = {1, 0, 0, 0}, w0 = {1, 0, 0} }, connect("j.b", "R.a"), connect("R.b",
                  "B.frame") }
    return x:reduce():integrate{ to = math.pi/2, rtol = 1e-8 }(x.B.r[2], math.pi/2)]], gives = "2.0" })

s.prismatic = component("prismatic", { axis = "x" }, function(self)
  return joint(self, function(a, b)
    local _, u, v = across(self.given.axis)
    local c = turn(a, b)
    c[4], c[5] = dot(rotation(a.q)*u, b.r - a.r), dot(rotation(a.q)*v, b.r - a.r)
    return c
  end)
end, { text = "A slide without turning.", source = euler,
  example = [[
    x = model { w = e.fixed{}, j = e.prismatic{ axis = "z" }, B = e.body{ r0 = {0, 0, 0}, v0 = {0, 0, 9.81} },
                connect("w.frame", "j.a"), connect("j.b", "B.frame") }
    return x:reduce():integrate{ to = 1 }(x.B.r[3], 1)]], gives = "4.905" })

s.weld = component("weld", {}, function(self)
  return joint(self, function(a, b)
    local c = turn(a, b)
    for k = 1, 3 do c[3 + k] = a.r[k] - b.r[k] end
    return c
  end)
end, { text = "Two bodies become one.", source = euler,
  example = [[
    x = model { A = e.body{ g = 0, r0 = {0, 0, 0}, v0 = {0, 0, 0}, q0 = {1, 0, 0, 0}, w0 = {0, 0, 0} },
                j = e.weld{}, B = e.body{ g = 0 }, F = e.force{ f = {4, 0, 0} }, connect("A.frame",
                  "F.frame", "j.a"),
                connect("j.b", "B.frame") }
    return x:reduce():integrate{ to = 1 }(x.B.r[1], 1)]], gives = "1.0" })

s.spring = component("spring", { k = { 1, unit = "N/m" }, d = { 0, unit = "N*s/m" }, s0 = { 0, unit = "m" } },
  function(self)
    self.a, self.b = s.frame, s.frame
    local a, b = self.a, self.b
    self:idle(a, b)
    local length, f = self:var("s", { unit = "m" }), self:var("f", { unit = "N" })
    local way = b.r - a.r
    self.energy = self.k*(length - self.s0)^2/2
    return { length ~ norm(way),
      f ~ self.k*(length - self.s0) + (self.given.d ~= 0 and self.d*der(length) or 0),
      b.f ~ f/length*way, a.f ~ -f/length*way, a.n ~ zeros(4, 1), b.n ~ zeros(4, 1) }
  end, { text = "A spring and a parallel damper between two points.",
    source = "Hooke, De potentia restitutiva, 1678",
  example = [[
    x = model { w = e.fixed{}, c = e.spring{ k = 4, s0 = 1 }, connect("w.frame", "c.a"), connect("c.b",
      "B.frame"),
                B = e.body{ g = 0, r0 = {2, 0, 0}, v0 = {0, 0, 0}, q0 = {1, 0, 0, 0}, w0 = {0, 0, 0} } }
    return x:reduce():integrate{ to = math.pi/2, rtol = 1e-8 }(x.B.r[1], math.pi/2)]], gives = "0.0" })

s.drive = component("drive", { axis = { "z", text = "x, y or z, of both frames" },
  phi0 = { false, unit = "rad", text = "angle at the start" },
  w0 = { false, unit = "rad/s", text = "speed at the start" } }, function(self)
  self.a, self.b, self.flange = s.frame, s.frame, rotational.flange
  local a, b, flange = self.a, self.b, self.flange
  local phi, w = self:var("phi", { unit = "rad" }), self:var("w", { unit = "rad/s" })
  local z = self:var("z", { text = "its torque, doubled" })
  self:start(phi, self.phi0)
  self:start(w, self.w0)
  if not self.given.phi0 then self:guess(phi, 0) end
  across(self.given.axis)                                -- says which axes there are
  local along = turn(a, b)[({ x = 1, y = 2, z = 3 })[self.given.axis]]
  local scalar = dot(a.q, b.q)
  local c = scalar*sin(phi/2) - along*cos(phi/2)         -- 0 where b is turned by phi against a
  return { 0 ~ c, w ~ 2*(scalar*der(along) - along*der(scalar)), phi ~ flange.phi,
    flange.tau ~ z*diff(c, phi), a.f ~ zeros(3, 1), b.f ~ zeros(3, 1),
    a.n ~ z*gradient(c, a.q), b.n ~ z*gradient(c, b.q) }
end, { text = "The turn from a to b about an axis as a flange, beside the hinge between them: for motors, "
    .. "springs, brakes and starts.",
  source = euler,
  example = [[
    r = components.rotational
    x = model { w = e.fixed{}, j = e.revolute{ axis = "z" }, D = e.drive{ phi0 = 0, w0 = 0 },
                T = r.torque{ tau = 10 }, R = e.rod{ d = {2, 0, 0} }, B = e.body{},
                connect("w.frame", "j.a", "D.a"), connect("j.b", "D.b", "R.a"), connect("R.b", "B.frame"),
                connect("T.flange", "D.flange") }
    low = x:reduce()
    at = low:init{ guess = { ["B.q"] = {1, 0, 0, 0}, ["B.r"] = {2, 0, 0} } }
    return low:integrate{ start = at, to = 2, rtol = 1e-8 }(x.D.phi, 2)]], gives = "4.0" })

s.force = component("force", { f = { { 0, 0, 0 }, unit = "N" },
  M = { { 0, 0, 0 }, unit = "N*m", text = "torque" } }, function(self)
  self.frame = s.frame
  local M = self.given.M
  local turns = object_type(M) or M[1] ~= 0 or M[2] ~= 0 or M[3] ~= 0
  return { self.frame.f ~ -self.f,
    self.frame.n ~ (turns and -2*space_rates(self.frame.q).T*self.M or zeros(4, 1)) }
end, { text = "A force and a torque that are given, in the axes of space.", source = "definition",
  example = [[
    x = model { F = e.force{ f = {0, 0, 11.81}, M = {0, 0, 2} }, connect("F.frame", "B.frame"),
                B = e.body{ r0 = {0, 0, 0}, v0 = {0, 0, 0}, q0 = {1, 0, 0, 0}, w0 = {0, 0, 0} } }
    sol = x:reduce():integrate{ to = 3 }
    return sol(x.B.r[3], 3) + sol(x.B.w[3], 3)]], gives = "15.0" })

return s
