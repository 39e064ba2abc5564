-- Motion along a line: flanges with a position s and a force f on the part.
local component, connector = named "component", named "connector"
local check = use "components/check"
local m = use "components/library" ("translational", "motion along a line; f is the force on the part")

m.flange = connector("translational flange", { across = { s = "m" }, through = { f = "N" },
  held_by = "a fixed point or a mass" })

local newton = "Newton, Principia, 1687"

-- Flanges a and b, the distance s from a to b and the force f that pulls them together where it is positive.
local function two_flanges(self, ...)
  self.a, self.b = m.flange, m.flange
  local s, f = self:var("s", { unit = "m", text = "distance" }), self:var("f", { unit = "N", text = "force" })
  return s, f, { s ~ self.b.s - self.a.s, self.b.f ~ f, self.a.f ~ -f }
end

local function with(list, ...)
  for _, equation in ipairs { ... } do list[#list + 1] = equation end
  return list
end

m.fixed = component("fixed", { s0 = { 0, unit = "m", text = "place" } }, function(self)
  self.flange = m.flange
  return { self.flange.s ~ self.s0 }
end, { text = "A point that does not move.", source = "definition",
  example = [[
    x = model { w = e.fixed{ s0 = 1 }, c = e.spring{ k = 3 }, p = e.position{ s = 3 },
                connect("w.flange", "c.a"), connect("c.b", "p.flange") }
    return x:init{}(x.c.f)]], gives = "6.0" })

m.mass = component("mass", { m = { 1, unit = "kg", text = "mass" }, s0 = { false, unit = "m",
  text = "place at the start" }, v0 = { false, unit = "m/s", text = "velocity at the start" } },
    function(self)
  self.flange = m.flange
  local s, v = self:var("s", { unit = "m", text = "position" }),
    self:var("v", { unit = "m/s", text = "velocity" })
  self:start(s, self.s0)
  self:start(v, self.v0)
  self.energy = self.m*v^2/2
  return { s ~ self.flange.s, v ~ der(s), self.m*der(s, 2) ~ self.flange.f }
end, { text = "m s″ = f; several parts can pull at its flange.", source = newton,
  example = [[
    x = model { m = e.mass{ m = 2, s0 = 1, v0 = 3 }, F = e.force{ f = 4 }, connect("m.flange", "F.flange") }
    return x:integrate{ to = 1 }(x.m.s, 1)]], gives = "5.0" })

m.spring = component("spring", { k = { 1, unit = "N/m", text = "stiffness" },
  s0 = { 0, unit = "m", text = "length without force" } }, function(self)
  local s, f, list = two_flanges(self)
  self.energy = self.k*(s - self.s0)^2/2
  return with(list, f ~ self.k*(s - self.s0))
end, { text = "f = k (s - s0).", source = "Hooke, De potentia restitutiva, 1678",
  example = [[
    x = model { c = e.spring{ k = 4, s0 = 1 }, m = e.mass{ m = 1, s0 = 2, v0 = 0 }, w = e.fixed{},
                connect("w.flange", "c.a"), connect("c.b", "m.flange") }
    return x:integrate{ to = math.pi/2, rtol = 1e-9 }(x.m.s, math.pi/2)]], gives = "0.0", })

m.damper = component("damper", { d = { 1, unit = "N*s/m", text = "viscosity" } }, function(self)
  local s, f, list = two_flanges(self)
  return with(list, f ~ self.d*der(s))
end, { text = "f = d s′.", source = newton,
  example = [[
    x = model { d = e.damper{ d = 2 }, m = e.mass{ m = 2, s0 = 0, v0 = 1 }, w = e.fixed{},
                connect("w.flange", "d.a"), connect("d.b", "m.flange") }
    return x:integrate{ to = 1 }(x.m.v, 1)]], gives = "0.3678794412" })

m.spring_damper = component("spring_damper", { k = { 1, unit = "N/m" }, d = { 1, unit = "N*s/m" },
  s0 = { 0, unit = "m", text = "length without force" } }, function(self)
  local s, f, list = two_flanges(self)
  return with(list, f ~ self.k*(s - self.s0) + self.d*der(s))
end, { text = "A spring and a damper side by side: f = k (s - s0) + d s′.", source = "Kelvin and Voigt",
  example = [[
    x = model { c = e.spring_damper{ k = 1, d = 2 }, m = e.mass{ m = 1, s0 = 1, v0 = 0 }, w = e.fixed{},
                connect("w.flange", "c.a"), connect("c.b", "m.flange") }
    return x:integrate{ to = 1 }(x.m.s, 1)]], gives = "0.7357588824" })

m.force = component("force", { f = { 0, unit = "N", text = "force, a number or an expression in t" } },
  function(self)
    self.flange = m.flange
    return { self.flange.f ~ -self.f }
  end, { text = "A force that is given.", source = "definition",
  example = [[
    x = model { F = e.force{ f = 6*t }, m = e.mass{ m = 2, s0 = 0, v0 = 0 }, connect("F.flange", "m.flange") }
    return x:integrate{ to = 2 }(x.m.s, 2)]], gives = "4.0" })

m.signal_force = component("signal_force", {}, function(self)
  self.flange = m.flange
  local f = self:input("f", { unit = "N" })
  return { self.flange.f ~ -f }
end, { text = "A force that a signal gives.", source = "definition",
  example = [[
    x = model { F = e.signal_force{}, m = e.mass{ m = 2, s0 = 0, v0 = 0 }, connect("F.f", 6*t),
                connect("F.flange", "m.flange") }
    return x:integrate{ to = 2 }(x.m.v, 2)]], gives = "6.0" })

m.position = component("position", { s = { 0, unit = "m", text = "place, a number or an expression in t" } },
  function(self)
    self.flange = m.flange
    return { self.flange.s ~ self.s }
  end, { text = "A motion that is given; the force follows.", source = "definition",
    example = [[
      x = model { p = e.position{ s = t^2 }, m = e.mass{ m = 3 }, connect("p.flange", "m.flange") }
      return x:dae():init{}(x.m.flange.f)]], gives = "6.0" })

m.sensor = component("sensor", {}, function(self)
  self.flange = m.flange
  local s = self:output("s", { unit = "m" })
  return { s ~ self.flange.s, self.flange.f ~ 0 }
end, { text = "The position as a signal.", source = "definition",
  example = [[
    x = model { p = e.position{ s = t^2 }, s = e.sensor{}, connect("p.flange", "s.flange") }
    return x:init{ from = 3 }(x.s.s)]], gives = "9.0" })

m.lever = component("lever", { ratio = { 1, text = "arm of b over arm of a" } }, function(self)
  check.not_zero(self, "ratio")
  self.a, self.b = m.flange, m.flange
  return { self.b.s ~ -self.ratio*self.a.s, self.a.f ~ self.ratio*self.b.f }
end, { text = "Small turns about a fixed point between a and b: s_b = -ratio s_a.", source = "Archimedes",
  example = [[
    x = model { h = e.lever{ ratio = 2 }, m = e.mass{ m = 1, s0 = 0, v0 = 0 }, F = e.force{ f = 6 },
                connect("F.flange", "h.a"), connect("h.b", "m.flange") }
    return x:integrate{ to = 1 }(x.m.s, 1)]], gives = "-1.5" })

-- ── friction and stops ─────────────────────────────────────────────────────────────────────────────────────

m.stop = component("stop", { k = { 1e5, unit = "N/m", text = "stiffness in contact" },
  d = { 10, unit = "N*s/m", text = "viscosity in contact" }, s0 = { 0, unit = "m", text = "gap" } },
  function(self)
    local s, f, list = two_flanges(self)
    return with(list, f ~ ifelse(lt(s, self.s0), min(0, self.k*(s - self.s0) + self.d*der(s)), 0))
  end, { text = "An elastic contact: pushes where the distance is less than s0, never pulls.",
    source = "Kelvin and Voigt, without adhesion",
  example = [[
    x = model { w = e.fixed{}, S = e.stop{ k = 100, d = 0 }, m = e.mass{ m = 1, s0 = 1, v0 = -1 },
                connect("w.flange", "S.a"), connect("S.b", "m.flange") }
    return x:integrate{ to = 3, rtol = 1e-9 }(x.m.s, 3) + math.pi/10]], gives = "2.0" })

-- Which wall a mass rests at, at the start.
local function wall_at(self)
  local given = self.given
  if type(given.v0) ~= "number" then return 0 end
  for _, wall in ipairs { { "smax", 1 }, { "smin", -1 } } do
    if given.s0 == given[wall[1]] then
      local speed = wall[2]*given.v0
      if speed > 0 then fail(("v0 = %g leads into the wall at s0 = %s"):format(given.v0, wall[1])) end
      if speed == 0 then return wall[2] end
    end
  end
  return 0
end

-- The discrete variable wall is 1 at smax and -1 at smin while the mass rests there, else 0:
--   wall² v′ + (1 - wall²) N = 0
-- is v′ = 0 in the one case and no force in the other. After an impact that would leave more slowly than
-- `rest` the mass stays, so that impacts do not accumulate; it is let go where the wall would have to pull.
m.mass_with_stops = component("mass_with_stops", { m = { 1, unit = "kg" }, smax = { 1, unit = "m" },
  smin = { -1, unit = "m" }, e = { 0.8, text = "restitution: velocity after over before" },
  rest = { 1e-3, unit = "m/s", text = "an impact that would leave more slowly is the last one" },
  s0 = { 0, unit = "m" }, v0 = { 0, unit = "m/s" } }, function(self)
  check.ordered(self, "smin", "smax")
  check.within(self, "e", 0, 1)
  check.within(self, "s0", "smin", "smax")
  check.positive(self, "rest")
  self.flange = m.flange
  local s, v = self:var("s", { unit = "m" }), self:var("v", { unit = "m/s" })
  local N = self:var("N", { unit = "N", text = "force of the wall it rests at" })
  local wall = self:discrete("wall", wall_at(self), { text = "1 at smax, -1 at smin, 0 between" })
  self:start(s, self.s0)
  self:start(v, self.v0)
  local held = wall^2
  local stays = lt(self.e*abs(v), self.rest)
  for _, side in ipairs { 1, -1 } do
    local place = side == 1 and self.smax or self.smin
    self:event { when = (1 - held)*(s - place) - side*held, direction = side,
      reset = { [v] = ifelse(stays, 0, -self.e*v), [wall] = ifelse(stays, side, 0) } }
  end
  self:event { when = wall*N - (1 - held), direction = 2, reset = { [wall] = 0 } }
  return { s ~ self.flange.s, der(s) ~ v, held*der(v) + (1 - held)*N ~ 0,
    self.m*der(v) ~ self.flange.f + N }
end, { text = "A mass between two walls: impacts with restitution, v⁺ = -e v⁻, and rest at a wall.",
  source = newton,
  example = [[
    x = model { m = e.mass_with_stops{ v0 = 1, e = 0.5 }, connect("m.flange") }
    return x:integrate{ to = 2 }(x.m.v, 2)]], gives = "-0.5" })

m.friction = component("friction", { F = { 1, unit = "N", text = "force when it slides" },
  Fs = { false, unit = "N", text = "largest force at rest; F if not given" },
  rest = { 1e-6, unit = "m/s", text = "slower than this counts as at rest" },
  mode0 = { 0, text = "at the start: 0 sticks, 1 and -1 slide; speeds decide where they differ" } },
  function(self)
  local s, f, list = two_flanges(self)
  local v = self:var("v", { unit = "m/s", text = "sliding velocity" })
  local static = self.given.Fs and self.Fs or self.F
  return with(list, v ~ der(s), use "components/friction" (self, v, f, self.F, static))
end, { text = "Dry friction between two flanges, with stick: slides with the force F, holds up to Fs.",
  source = "Coulomb, Théorie des machines simples, 1785",
  example = [[
    x = model { m = e.mass{ m = 1, s0 = 0, v0 = 4 }, R = e.friction{ F = 2, mode0 = 1 }, w = e.fixed{},
                connect("w.flange", "R.a"), connect("R.b", "m.flange") }
    return x:integrate{ to = 5 }(x.m.s, 5)]], gives = "4.0" })

return m
