-- Random processes as inputs: sums of sines with random amplitudes (Shinozuka & Deodatis, Appl. Mech. Rev.
-- 44(4), 1991).
--
-- u(t) = Σ σₖ (cₖ cos 2πfₖt + sₖ sin 2πfₖt) with σₖ² = S(fₖ) Δf, fₖ in the middles of equal cells of the
-- band, and cₖ, sₖ independent standard normal numbers: Gaussian, stationary, with the one-sided spectrum S,
-- and again the same after 1/Δf.
local process = {}

function process.read(options)
  local band, lines = options.band, options.lines or 32
  local low, high = table.unpack(type(band) == "table" and band or {})
  if type(low) ~= "number" or type(high) ~= "number" or #band ~= 2 or not (low >= 0 and high > low) then
    fail "random_process: band = { 0.1, 5 } must be two frequencies in Hz, ascending"
  end
  if (options.std == nil) == (options.spectrum == nil) then
    fail "random_process: give std = 1 (an even spectrum) or spectrum = function(f) … end, one of them"
  end
  if math.type(lines) ~= "integer" or lines < 1 or lines > 2000 then
    fail(("random_process: lines = %s; it must be a whole number from 1 to 2000"):format(tostring(lines)))
  end
  local width, frequencies, sigmas = (band[2] - band[1])/lines, {}, {}
  for k = 1, lines do
    local f = band[1] + (k - 0.5)*width
    local density = options.spectrum and options.spectrum(f) or options.std^2/(band[2] - band[1])
    if type(density) ~= "number" or not (density >= 0) then
      fail(("random_process: spectrum(%g) = %s; it must be a number that is not negative"):format(f,
        tostring(density)))
    end
    frequencies[k], sigmas[k] = f, math.sqrt(density*width)
  end
  return { frequencies = frequencies, sigmas = sigmas, mean = options.mean or 0 }
end

-- The process with given amplitudes, numbers or parameters.
local function signal(self, amplitude)
  local u = self.mean
  for k, f in ipairs(self.frequencies) do
    local omega = 2*math.pi*f
    u = u + self.sigmas[k]*(amplitude("c", k)*cos(omega*t) + amplitude("s", k)*sin(omega*t))
  end
  return u
end

function process.realisation(self, seed_)
  local standard, count = normal(0, 1), 0
  return signal(self, function()
    count = count + 1
    return standard:quantile(random_at(seed_, count))
  end)
end

-- The process as an expression whose amplitudes are parameters, which params gets as normal numbers.
function process.expand(self, name, params)
  return signal(self, function(part, k)
    local amplitude = ("%s_%s%04d"):format(name, part, k)
    params[amplitude] = normal(0, 1)
    return param(amplitude, 0)
  end)
end

return process
