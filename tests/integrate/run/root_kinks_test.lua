-- √(v²) is |v|: beside complementarity both sides are regimes.
local i, v = vars "i v"

test("an ideal diode behind √(sin² t), from the kink itself and from elsewhere", function()
  for _, unit in ipairs { 1, 1e-3, 1e6 } do
    local waves = { sqrt(sin(t)^2), sqrt(4*sin(t)^2)/2, sqrt(sin(t)^6)^(1/3), abs(sin(t)) }
    for k, wave in ipairs(waves) do
      local sys = dae { der(v)/10 ~ i - v/10, 0 ~ min(i, v - unit*wave) }
      for _, method in ipairs { "auto", "radau", "bdf", "dopri5" } do
        for _, from in ipairs { 0, 1.5 } do
          local sol = sys:integrate { start = { v = unit*from }, to = 7, rtol = 1e-8, atol = 1e-11*unit,
            method = method }
          expect(k .. " " .. method .. " " .. sol.status):equals(k .. " " .. method .. " finished")
          -- v′ = -v while nothing flows: from the peak until e^-(t - s) = |sin t|, tan s = -1
          local peak = 3*math.pi/4
          expect(sol(v, 2.5)/unit):near(math.sin(peak)*math.exp(-(2.5 - peak)), 1e-6)
          local current = (math.cos(7) + math.sin(7))/10
          expect({ sol:final(v)/unit, sol:final(i)/unit }):near({ math.sin(7), current }, 1e-6)
        end
      end
    end
  end
end)
