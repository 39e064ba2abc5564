-- Bodies in the plane: frames with position x, y, angle phi, forces fx, fy and torque tau on the part.
local component, connector = named "component", named "connector"
local p = use "components/library" ("planar", "rigid bodies in the x-y plane; gravity pulls along -y")
local rotational, translational = use "components/rotational", use "components/translational"

p.frame = connector("planar frame", { across = { x = "m", y = "m", phi = "rad" },
  through = { fx = "N", fy = "N", tau = "N*m" }, pairs = { x = "fx", y = "fy", phi = "tau" },
  idle = { phi = 0 }, held_by = "a fixed frame, or to a body" })

local euler = "Newton and Euler; Schiehlen & Eberhard, Technische Dynamik, §4"

-- A vector of a body in the plane of space.
local function turned(phi, x, y)
  return cos(phi)*x - sin(phi)*y, sin(phi)*x + cos(phi)*y
end

-- Forces at a and b cancel, and so do moments about a; dx, dy from a to b.
local function balance(a, b, dx, dy)
  return { 0 ~ a.fx + b.fx, 0 ~ a.fy + b.fy, 0 ~ a.tau + b.tau + dx*b.fy - dy*b.fx }
end

p.fixed = component("fixed", { x = { 0, unit = "m" }, y = { 0, unit = "m" }, phi = { 0, unit = "rad" } },
  function(self)
    self.frame = p.frame
    return { self.frame.x ~ self.x, self.frame.y ~ self.y, self.frame.phi ~ self.phi }
  end, { text = "A frame at rest.", source = "definition",
  example = [[
    x = model { w = e.fixed{ x = 1, phi = math.pi/2 }, r = e.rod{ dx = 2 }, B = e.body{ m = 2 },
                connect("w.frame", "r.a"), connect("r.b", "B.frame") }
    return x:dae():init{}(x.B.y)]], gives = "2.0" })

p.body = component("body", { m = { 1, unit = "kg" }, J = { 1, unit = "kg*m^2" },
  g = { 9.81, unit = "m/s^2", text = "gravity along -y" },
  x0 = { false, unit = "m" }, y0 = { false, unit = "m" }, phi0 = { false, unit = "rad" },
  vx0 = { false, unit = "m/s" }, vy0 = { false, unit = "m/s" }, w0 = { false, unit = "rad/s" } },
    function(self)
  self.frame = p.frame
  local x, y, phi = self:var("x", { unit = "m" }), self:var("y", { unit = "m" }),
    self:var("phi", { unit = "rad" })
  local vx, vy, w = self:var("vx", { unit = "m/s" }), self:var("vy", { unit = "m/s" }),
    self:var("w", { unit = "rad/s" })
  for _, pair in ipairs { { x, self.x0 }, { y, self.y0 }, { phi, self.phi0 }, { vx, self.vx0 },
    { vy, self.vy0 },
    { w, self.w0 } } do self:start(pair[1], pair[2]) end
  self.energy = self.m*(vx^2 + vy^2)/2 + self.J*w^2/2 + self.m*self.g*y
  local f = self.frame
  return { x ~ f.x, y ~ f.y, phi ~ f.phi, vx ~ der(x), vy ~ der(y), w ~ der(phi),
    self.m*der(x, 2) ~ f.fx, self.m*(der(y, 2) + self.g) ~ f.fy, self.J*der(phi, 2) ~ f.tau }
end, { text = "A rigid body with its frame at the centre of mass.", source = euler,
  example = [[
    x = model { B = e.body{ x0 = 0, y0 = 0, phi0 = 0, vx0 = 1, vy0 = 9.81, w0 = 0 }, connect("B.frame") }
    return x:integrate{ to = 2 }(x.B.y, 2)]], gives = "0.0" })

p.rod = component("rod", { dx = { 1, unit = "m" }, dy = { 0, unit = "m" } }, function(self)
  self.a, self.b = p.frame, p.frame
  local dx, dy = turned(self.a.phi, self.dx, self.dy)
  return { self.b.x ~ self.a.x + dx, self.b.y ~ self.a.y + dy, self.b.phi ~ self.a.phi,
    balance(self.a, self.b, dx, dy) }
end, { text = "Two frames of one rigid body: b is (dx, dy) from a, in the axes of a.", source = euler,
  example = [[
    x = model { w = e.fixed{ phi = math.pi/2 }, r = e.rod{ dx = 3, dy = 4 }, B = e.body{ m = 2 },
                connect("w.frame", "r.a"), connect("r.b", "B.frame") }
    at = x:dae():init{}
    return at(x.B.x) + at(x.r.a.tau)]], gives = "-82.48" })

p.revolute = component("revolute", { phi0 = { false, unit = "rad", text = "angle at the start" },
  w0 = { false, unit = "rad/s", text = "speed at the start" } }, function(self)
  self.a, self.b = p.frame, p.frame
  local axis = self:optional("axis", rotational.flange)
  local phi, w = self:var("phi", { unit = "rad" }), self:var("w", { unit = "rad/s" })
  self:start(phi, self.phi0)
  self:start(w, self.w0)
  return { self.a.x ~ self.b.x, self.a.y ~ self.b.y, self.b.phi ~ self.a.phi + phi, w ~ der(phi),
    axis.phi ~ phi,
    0 ~ self.a.fx + self.b.fx, 0 ~ self.a.fy + self.b.fy, self.a.tau ~ axis.tau, self.b.tau ~ -axis.tau }
end, { text = "A hinge; a drive or a spring can turn its axis.", source = euler,
  example = [[
    x = model { w = e.fixed{}, j = e.revolute{ phi0 = math.pi/2, w0 = 0 }, r = e.rod{ dx = 2 },
                B = e.body{ m = 3, J = 0 }, connect("w.frame", "j.a"), connect("j.b", "r.a"),
                connect("r.b", "B.frame") }
    return x:dof()]], gives = "2" })

p.prismatic = component("prismatic", { nx = 1, ny = 0,
  s0 = { false, unit = "m", text = "travel at the start" },
  v0 = { false, unit = "m/s", text = "speed at the start" } }, function(self)
  self.a, self.b = p.frame, p.frame
  local axis = self:optional("axis", translational.flange)
  local s, v = self:var("s", { unit = "m" }), self:var("v", { unit = "m/s" })
  self:start(s, self.s0)
  self:start(v, self.v0)
  local nx, ny = turned(self.a.phi, self.nx, self.ny)
  return { self.b.x ~ self.a.x + nx*s, self.b.y ~ self.a.y + ny*s, self.b.phi ~ self.a.phi, v ~ der(s),
    axis.s ~ s,
    balance(self.a, self.b, nx*s, ny*s), axis.f ~ -(nx*self.b.fx + ny*self.b.fy) }
end, { text = "A slide along (nx, ny), a unit vector in the axes of a.", source = euler,
  example = [[
    x = model { w = e.fixed{}, j = e.prismatic{ nx = 0, ny = 1, s0 = 0, v0 = 9.81 }, B = e.body{},
                connect("w.frame", "j.a"), connect("j.b", "B.frame") }
    return x:integrate{ to = 1 }(x.B.y, 1)]], gives = "4.905" })

p.spring = component("spring", { k = { 1, unit = "N/m" }, d = { 0, unit = "N*s/m", text = "viscosity" },
  s0 = { 0, unit = "m", text = "length without force" } }, function(self)
  self.a, self.b = p.frame, p.frame
  self:idle(self.a, self.b)
  local s, f = self:var("s", { unit = "m", text = "length" }), self:var("f", { unit = "N" })
  local dx, dy = self.b.x - self.a.x, self.b.y - self.a.y
  self.energy = self.k*(s - self.s0)^2/2
  return { s ~ sqrt(dx^2 + dy^2), f ~ self.k*(s - self.s0) + (self.given.d ~= 0 and self.d*der(s) or 0),
    self.b.fx ~ f*dx/s, self.b.fy ~ f*dy/s, self.a.fx ~ -f*dx/s, self.a.fy ~ -f*dy/s, self.a.tau ~ 0,
    self.b.tau ~ 0 }
end, { text = "A spring and a parallel damper between two points.",
  source = "Hooke, De potentia restitutiva, 1678",
  example = [[
    x = model { w = e.fixed{}, c = e.spring{ k = 4, s0 = 1 },
                B = e.body{ g = 0, x0 = 2, y0 = 0, phi0 = 0, vx0 = 0,
                vy0 = 0, w0 = 0 }, connect("w.frame", "c.a"), connect("c.b", "B.frame") }
    return x:integrate{ to = math.pi/2 }(x.B.x, math.pi/2)]], gives = "0.0" })

p.force = component("force", { fx = { 0, unit = "N" }, fy = { 0, unit = "N" }, tau = { 0, unit = "N*m" } },
  function(self)
    self.frame = p.frame
    local f = self.frame
    return { f.fx ~ -self.fx, f.fy ~ -self.fy, f.tau ~ -self.tau }
  end, { text = "A force and a torque that are given, in the axes of the plane.", source = "definition",
  example = [[
    x = model { F = e.force{ fx = 3, tau = 4 }, connect("B.frame", "F.frame"),
                B = e.body{ x0 = 0, y0 = 0, phi0 = 0, vx0 = 0, vy0 = 0, w0 = 0 } }
    sol = x:integrate{ to = 1 }
    return sol(x.B.x, 1) + sol(x.B.phi, 1)]], gives = "3.5" })

p.wheel = component("wheel", { r = { 1, unit = "m", text = "radius" }, x0 = { 0, unit = "m",
  text = "place of the centre where phi = 0" } }, function(self)
  self.frame = p.frame
  local N, F = self:var("N", { unit = "N", text = "normal force" }),
    self:var("F", { unit = "N", text = "friction" })
  local f = self.frame
  return { f.y ~ self.r, f.x ~ self.x0 - self.r*f.phi, f.fx ~ -F, f.fy ~ -N, f.tau ~ -self.r*F }
end, { text = "Rolls on the line y = 0 without slipping: x = x0 - r phi.", source = euler,
  example = [[
    x = model { W = e.wheel{ r = 2 }, B = e.body{ m = 1, J = 4, phi0 = 0, w0 = 0 }, F = e.force{ fx = 4 },
                connect("W.frame", "B.frame", "F.frame") }
    return x:integrate{ to = 1 }(x.B.x, 1)]], gives = "1.0" })

return p
