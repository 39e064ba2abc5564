-- Parameters that no part can mean, said where the part stands. Only numbers are looked at.
local check = {}

local function number(self, key)
  local value = self.given[key]
  return type(value) == "number" and value or nil
end

local function bound(self, given)
  if type(given) == "string" then return number(self, given) end
  return given
end

function check.positive(self, key)
  local value = number(self, key)
  if value and value <= 0 then fail(("%s = %g must be greater than 0"):format(key, value)) end
end

function check.not_zero(self, key)
  if number(self, key) == 0 then fail(key .. " = 0: nothing is transmitted; leave the part out") end
end

function check.between(self, key, least, most)
  local value = number(self, key)
  if value and (value <= least or value >= most) then
    fail(("%s = %g must be between %g and %g"):format(key, value, least, most))
  end
end

-- Like between, the bounds included; they are numbers or names of parameters.
function check.within(self, key, least, most)
  local value = number(self, key)
  local a, b = bound(self, least), bound(self, most)
  if value and a and b and (value < a or value > b) then
    fail(("%s = %g must not be outside %g … %g"):format(key, value, a, b))
  end
end

-- low below high.
function check.ordered(self, low, high)
  local a, b = number(self, low), number(self, high)
  if a and b and a >= b then fail(("%s = %g must be less than %s = %g"):format(low, a, high, b)) end
end

return check
