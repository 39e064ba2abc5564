-- A thermostat: a room, its wall, a heater that a relay with hysteresis switches.
local h, s = components.thermal, components.signals
local house = model {
  room = h.capacity{ C = 10, T0 = 15 }, wall = h.conductor{ G = 1 }, outside = h.temperature{ T = 5 },
  sensor = h.sensor{}, relay = s.relay{ low = -21, high = -19, off = 0, on = 25, y0 = 1 },
    minus = s.gain{ k = -1 },
  heater = component("heater", {}, function(self)
    self.port = h.port
    return { self.port.Q ~ -self:input "Q" }
  end){},
  connect("room.port", "wall.a", "sensor.port", "heater.port"), connect("wall.b", "outside.port"),
  connect("sensor.T", "minus.u"), connect("minus.y", "relay.u"), connect("relay.y", "heater.Q") }
local sol = house:integrate{ to = 40, rtol = 1e-8 }
-- T' = (25 + 5 - T)/10 from 15 to 21, then (5 - T)/10 from 21 to 19, then up again
local up, down, again = 10*math.log(15/9), 10*math.log(16/14), 10*math.log(11/9)
print(("switches off at %.6f: T = %.6f"):format(up, sol(house.room.T, up)))
print(("switches on at  %.6f: T = %.6f"):format(up + down, sol(house.room.T, up + down)))
print(("off again at    %.6f: T = %.6f"):format(up + down + again, sol(house.room.T, up + down + again)))
print(plot(sol, house.room.T))
