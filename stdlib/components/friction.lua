-- Dry friction with stick, for translational.friction, rotational.friction and clutches.
--
-- The discrete variable mode is -1 or 1 while the surfaces slide and 0 while they stick:
--   (1 - mode²) v′ + mode² (f - mode·F) = 0
-- is v′ = 0 in the one case and f = ±F in the other. It changes where the force at rest exceeds what the
-- surfaces can hold, and where the sliding velocity becomes 0. What holds right after an event counts at once
-- (direction 2): surfaces that come to rest under too large a force slide on. A mode that the velocity
-- contradicts by more than `rest`, at the start or where a clutch without pressure chose a side, becomes its
-- sign.

-- v: sliding velocity, f: force against it, sliding and static: its size when it slides, its limit at rest.
return function(self, v, f, sliding, static)
  local mode = self:discrete("mode", self.mode0, { text = "-1, 1: slides; 0: sticks" })
  local sticks, slides = 1 - mode^2, mode^2
  self:event { when = sticks*(f - static) - slides, direction = 2, reset = { [mode] = 1 } }
  self:event { when = sticks*(-f - static) - slides, direction = 2, reset = { [mode] = -1 } }
  self:event { when = mode*v + sticks, direction = -1, reset = { [mode] = 0 } }
  local rest = self.rest
  self:event { when = sticks*v^2/rest - mode*v - rest, direction = 2, reset = { [mode] = sign(v) } }
  return sticks*der(v) + slides*(f - mode*sliding) ~ 0
end
