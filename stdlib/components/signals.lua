-- Signals: inputs and outputs that are connected by connect(a.y, b.u).
local component = named "component"
local check = use "components/check"
local s = use "components/library" ("signals", "blocks with inputs u and an output y")

local function block(self)
  return self:input "u", self:output "y"
end

-- ── algebra ────────────────────────────────────────────────────────────────────────────────────────────────

s.gain = component("gain", { k = 1 }, function(self)
  local u, y = block(self)
  return { y ~ self.k*u }
end, { text = "y = k u.", source = "definition",
  example = [[
    x = model { g = e.gain{ k = 3 }, connect("g.u", sin(t)), z = e.integrator{}, connect("g.y", "z.u") }
    return x:integrate{ to = math.pi }(x.z.y, math.pi)]], gives = "6.0" })

s.sum = component("sum", { signs = "++" }, function(self)
  local signs, total = self.given.signs, 0
  for k = 1, #signs do
    local u = self:input("u" .. k)
    total = signs:sub(k, k) == "-" and total - u or total + u
  end
  return { self:output "y" ~ total }
end, { text = "y = ±u1 ± u2 …; signs says how many and with which sign.", source = "definition",
  example = [[
    x = model { S = e.sum{ signs = "+-" }, connect("S.u1", 5), connect("S.u2", 3), z = e.integrator{},
                connect("S.y", "z.u") }
    return x:integrate{ to = 1 }(x.z.y, 1)]], gives = "2.0" })

s.product = component("product", {}, function(self)
  return { self:output "y" ~ self:input "u1"*self:input "u2" }
end, { text = "y = u1 u2.", source = "definition",
  example = [[
    x = model { P = e.product{}, connect("P.u1", 3), connect("P.u2", t), z = e.integrator{}, connect("P.y",
      "z.u") }
    return x:integrate{ to = 2 }(x.z.y, 2)]], gives = "6.0" })

s.saturation = component("saturation", { low = -1, high = 1 }, function(self)
  check.ordered(self, "low", "high")
  local u, y = block(self)
  return { y ~ min(self.high, max(self.low, u)) }
end, { text = "u, kept between low and high.", source = "definition",
  example = [[
    x = model { S = e.saturation{ high = 2 }, connect("S.u", 5), z = e.integrator{}, connect("S.y", "z.u") }
    return x:integrate{ to = 1 }(x.z.y, 1)]], gives = "2.0" })

s.dead_zone = component("dead_zone", { low = -1, high = 1 }, function(self)
  check.ordered(self, "low", "high")
  local u, y = block(self)
  return { y ~ max(u - self.high, 0) + min(u - self.low, 0) }
end, { text = "0 between low and high, else the distance beyond the limit.", source = "definition",
  example = [[
    x = model { D = e.dead_zone{}, connect("D.u", t - 1), z = e.integrator{}, connect("D.y", "z.u") }
    return x:integrate{ to = 4 }(x.z.y, 4)]], gives = "2.0" })

s.table = component("table", { x = { 0, 1 }, y = { 0, 1 }, kind = "linear", outside = "hold" },
  function(self)
    local u, y = block(self)
    local given = self.given
    return { y ~ lookup { x = given.x, y = given.y, kind = given.kind, outside = given.outside }(u) }
  end, { text = "A function through points; kind and outside as in lookup{ … }.", source = "definition",
  example = [[
    x = model { S = e.table{ x = {0, 1, 3}, y = {0, 10, 30} }, connect("S.u", 2), z = e.integrator{},
                connect("S.y", "z.u") }
    return x:integrate{ to = 1 }(x.z.y, 1)]], gives = "20.0" })

-- ── dynamics ───────────────────────────────────────────────────────────────────────────────────────────────

s.integrator = component("integrator", { k = 1, y0 = { 0, text = "value at the start" } }, function(self)
  local u, y = block(self)
  self:start(y, self.y0)
  return { der(y) ~ self.k*u }
end, { text = "y′ = k u.", source = "definition",
  example = [[
    x = model { z = e.integrator{ k = 2, y0 = 1 }, connect("z.u", 3) }
    return x:integrate{ to = 1 }(x.z.y, 1)]], gives = "7.0" })

s.first_order = component("first_order", { k = 1, T = { 1, unit = "s", text = "time constant" }, y0 = 0 },
  function(self)
    check.positive(self, "T")
    local u, y = block(self)
    self:start(y, self.y0)
    return { self.T*der(y) + y ~ self.k*u }
  end, { text = "k/(T s + 1).", source = "definition",
    example = [[
      x = model { z = e.first_order{ T = 2 }, connect("z.u", 1) }
      return x:integrate{ to = 2 }(x.z.y, 2)]], gives = "0.6321205588" })

s.filter = component("filter", { w = { 1, unit = "rad/s", text = "corner frequency" },
  D = { "1/2^(1/2)", text = "damping; 1/√2 is Butterworth's" } }, function(self)
  local u, y = block(self)
  local v = self:var "v"
  self:start(y, 0)
  self:start(v, 0)
  local D = self.given.D == "1/2^(1/2)" and 1/sqrt(2) or self.D
  return { der(y) ~ v, der(v) ~ self.w^2*(u - y) - 2*D*self.w*v }
end, { text = "Low-pass of second order.", source = "Butterworth, Wireless Engineer 7, 1930",
  example = [[
    x = model { z = e.filter{ w = 1, D = 1 }, connect("z.u", 1) }
    return x:integrate{ to = 1 }(x.z.y, 1)]], gives = "0.2642411177" })

s.derivative = component("derivative", { k = 1,
  T = { 0.01, unit = "s", text = "time constant of its filter" } },
  function(self)
    check.positive(self, "T")
    local u, y = block(self)
    local x = self:var "x"
    self:start(x, 0)
    return { self.T*der(x) ~ u - x, y ~ self.k*(u - x)/self.T }
  end, { text = "k s/(T s + 1).", source = "Åström & Hägglund, PID Controllers, §3.4",
  example = [[
    x = model { D = e.derivative{ k = 1, T = 0.5 }, connect("D.u", t) }
    return x:integrate{ to = 1 }(x.D.y, 1)]], gives = "0.8646647168" })

s.delay = component("delay", { T = { 1, unit = "s", text = "delay" } }, function(self)
  check.positive(self, "T")
  local u, y = block(self)
  local x1, x2 = self:vars "x1 x2"
  self:start(x1, 0)
  self:start(x2, 0)
  local w = 1/self.T
  return { der(x1) ~ x2, der(x2) ~ u - 6*w*x2 - 12*w^2*x1, y ~ u - 12*w*x2 }
end, { text = "e^{-Ts} by the Padé approximation of order 2, 2.",
  source = "Padé, 1892; Hairer & Wanner II, §IV.3",
  example = [[
    x = model { D = e.delay{ T = 1 }, connect("D.u", t) }
    return x:integrate{ to = 10, rtol = 1e-8 }(x.D.y, 10)]], gives = "9.0" })

s.pid = component("pid", { k = { 1, text = "gain" }, Ti = { 1, unit = "s", text = "integral time" },
  Td = { 0, unit = "s", text = "derivative time" }, N = { 10, text = "filter of the derivative: Td/N" },
  low = { -math.huge, text = "least output" }, high = { math.huge, text = "largest output" },
  Tt = { false, unit = "s", text = "tracking time of the anti-windup; Ti if not given" } }, function(self)
  check.ordered(self, "low", "high")
  local r, v, y = self:input "r", self:input "v", self:output "y"
  local given = self.given
  local z = self:var("z", { text = "integral part" })
  self:start(z, 0)
  local w, list = self.k*(r - v) + z, {}
  if given.Td ~= 0 then
    local x = self:var("x", { text = "filtered measurement" })
    self:start(x, 0)
    list[1] = self.Td/self.N*der(x) ~ v - x
    w = w - self.k*self.N*(v - x)
  end
  local limited = given.low ~= -math.huge or given.high ~= math.huge
  local u = w
  if given.high ~= math.huge then u = min(self.high, u) end
  if given.low ~= -math.huge then u = max(self.low, u) end
  list[#list + 1] = y ~ u
  list[#list + 1] = der(z) ~ self.k/self.Ti*(r - v) + (limited and (y - w)/(given.Tt and self.Tt or self.Ti)
    or 0)
  return list
end, { text = "Reference r, measurement v. The derivative sees the measurement only; where the output "
  .. "is at a "
    .. "limit, the integral follows it (back calculation).",
  source = "Åström & Hägglund, PID Controllers, §3.5",
  example = [[
    x = model { c = e.pid{ k = 2, Ti = 1 }, z = e.first_order{}, connect("c.r", 1), connect("z.y", "c.v"),
                connect("c.y", "z.u") }
    return x:integrate{ to = 1 }(x.z.y, 1)]], gives = "0.8646647168" })

-- ── sampling, states ───────────────────────────────────────────────────────────────────────────────────────

-- Ticks at t0, t0 + Ts, …: what outputs become, and then what states become.
local function clock(self, outputs, states)
  check.positive(self, "Ts")
  use "parts/clocks".run(self, self.Ts, self.t0, outputs, states)
end

local sampling = { Ts = { 1, unit = "s", text = "sample time" },
  t0 = { 0, unit = "s", text = "first sample" } }
local function sampled(more)
  local all = { y0 = { 0, text = "output before the first sample" } }
  for _, set in ipairs { sampling, more or {} } do
    for key, value in pairs(set) do all[key] = value end
  end
  return all
end

s.sampler = component("sampler", sampled(), function(self)
  local u = self:input "u"
  local y = self:discrete("y", self.y0)
  self:gives(y)
  clock(self, { [y] = u })
end, { text = "Takes u every Ts and holds it: a sampler with zero-order hold.",
  source = "Åström & Wittenmark, Computer-Controlled Systems, §2.3",
  example = [[
    x = model { s = e.sampler{ Ts = 0.5 }, connect("s.u", t), z = e.integrator{}, connect("s.y", "z.u") }
    return x:integrate{ to = 2 }(x.z.y, 2)]], gives = "1.5" })

s.discrete_pi = component("discrete_pi", sampled { k = 1, Ti = { 1, unit = "s" } }, function(self)
  local r, v = self:input "r", self:input "v"
  local y, z = self:discrete("y", self.y0), self:discrete("z", 0)
  self:gives(y)
  clock(self, { [y] = self.k*(r - v) + z }, { [z] = z + self.k*self.Ts/self.Ti*(r - v) })
end, { text = "A PI controller that runs every Ts.",
  source = "Åström & Wittenmark, Computer-Controlled Systems, §8.3",
  example = [[
    x = model { c = e.discrete_pi{ k = 2, Ti = 4 }, connect("c.r", 1), connect("c.v", 0), z = e.integrator{},
                connect("c.y", "z.u") }
    return x:integrate{ to = 4 }(x.z.y, 4)]], gives = "11.0" })

s.unit_delay = component("unit_delay", sampled(), function(self)
  local u = self:input "u"
  local y, held = self:discrete("y", self.y0), self:discrete("held", self.y0)
  self:gives(y)
  clock(self, { [y] = held }, { [held] = u })
end, { text = "The sample before: y_k = u_{k-1}.",
  source = "Åström & Wittenmark, Computer-Controlled Systems, §2.4",
  example = [[
    x = model { d = e.unit_delay{}, connect("d.u", t), z = e.integrator{}, connect("d.y", "z.u") }
    return x:integrate{ to = 4 }(x.z.y, 4)]], gives = "3.0" })

s.pulse = component("pulse", { period = { 1, unit = "s" },
  width = { 0.5, text = "part of the period in which it is high" }, low = 0, high = 1,
  t0 = { 0, unit = "s", text = "first rise" } }, function(self)
  check.positive(self, "period")
  check.between(self, "width", 0, 1)
  local y, on = self:output "y", self:discrete("on", 0)
  local tick = self:discrete("tick", self.t0, { unit = "s", text = "next change" })
  local lasts = self.period*(self.width + (1 - 2*self.width)*on)
  self:event { when = t - tick, direction = 2, reset = { [on] = 1 - on, [tick] = tick + lasts } }
  return { y ~ self.low + (self.high - self.low)*on }
end, { text = "Rectangles: high for a part of every period, from t0 on.", source = "definition",
  example = [[
    x = model { P = e.pulse{ period = 2, width = 0.25, high = 6, t0 = 1 }, z = e.integrator{},
                connect("P.y", "z.u") }
    return x:integrate{ to = 5 }(x.z.y, 5)]], gives = "6.0" })

s.relay = component("relay", { low = { -1, text = "switches off below" },
  high = { 1, text = "switches on above" },
  off = { 0, text = "output when off" }, on = { 1, text = "output when on" },
    y0 = { 0, text = "1: on at the start" } },
  function(self)
    check.ordered(self, "low", "high")
    local u, y = block(self)
    local state = self:discrete("state", self.y0)
    self:event { when = (1 - state)*(u - self.high) - state, direction = 2, reset = { [state] = 1 } }
    self:event { when = state*(self.low - u) - (1 - state), direction = 2, reset = { [state] = 0 } }
    return { y ~ self.off + (self.on - self.off)*state }
  end, { text = "Two positions with hysteresis: a thermostat.",
    source = "Tsypkin, Relay Control Systems, 1984",
  example = [[
    x = model { R = e.relay{}, connect("R.u", 2*sin(t)), z = e.integrator{}, connect("R.y", "z.u") }
    return x:integrate{ to = math.pi }(x.z.y, math.pi)]], gives = "2.617993878" })

-- states = 3, transitions = { { from = 1, to = 2, when = function(u) return u[1] - 5 end, direction = 1 } }
s.state_machine = component("state_machine", { states = 2, inputs = 1, initial = 1, transitions = {},
  y = {} }, function(self)
  local given, u = self.given, {}
  for k = 1, given.inputs do u[k] = self:input("u" .. k) end
  local state = self:discrete("state", given.initial)
  local since = self:discrete("since", 0, { unit = "s", text = "time of the last transition" })
  for k, change in ipairs(given.transitions) do
    if not (change.from and change.to and change.when) then
      fail(("state_machine: transition %d must be { from = 1, to = 2, when = function(u, since) … end }")
        :format(k))
    end
    local here = (state - change.from)^2             -- 0 where it may fire
    local g = change.when(u, t - since)
    self:event { when = ifelse(lt(here, 1/4), g, -1), direction = 2,
      reset = { [state] = change.to, [since] = t } }
  end
  local list, value = {}, given.y[#given.y]
  for k = given.states - 1, 1, -1 do value = ifelse(lt(state, k + 1/2), given.y[k], value) end
  if value ~= nil then list[1] = self:output "y" ~ value end
  return list
end, { text = "States 1 … n; a transition fires where its function of the inputs and of the time since the "
  .. "last one "
    .. "becomes positive. y is a list: the output in every state.",
  source = "Harel, Sci. Comput. Program. 8, 1987, without hierarchy",
  example = [[
    toggle = { { from = 1, to = 2, when = function(u, since) return since - 1 end },
               { from = 2, to = 1, when = function(u, since) return since - 2 end } }
    x = model { M = e.state_machine{ inputs = 0, transitions = toggle, y = { 0, 1 } }, z = e.integrator{},
                connect("M.y", "z.u") }
    return x:integrate{ to = 6 }(x.z.y, 6)]], gives = "4.0" })

return s
