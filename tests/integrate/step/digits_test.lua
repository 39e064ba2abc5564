-- Never fewer digits than asked for without a word: with rtol the error falls to eleven digits, or the run
-- says why it does not get there.
local amplified = { car_axis = 10, pendulum_acceleration = 100, cart_pendulum = 10, pendulum = 10,
  pendulum_velocity = 10, ring_modulator = 10, transistor_amplifier = 10,
  squeezer = 10 }                                              -- stiff springs, drift
local unfit = { reissig = true, opamp_integrator = true }  -- x′ and z do not follow from their equations

local names = { "auto" }
for _, name in ipairs(dofile "tests/families.lua".implicit) do
  if name ~= "gauss" then names[#names + 1] = name end
end

for _, p in ipairs(problems.list()) do
  if p.to and (p.exact or p.reference) and p.index and not unfit[p.name] then
    test("eleven digits: " .. p.name, function()
      local model = p.index <= 1 and p() or p():reduce()
      for _, method in ipairs(names) do
        for _, tol in ipairs { 1e-8, 1e-11 } do
          local good, sol = pcall(model.integrate, model, { start = p:start(), to = p.to, method = method,
            inputs = p.inputs, rtol = tol, atol = 1e-2*tol })
          if good and sol.status == "finished" then
            local error = p:error(sol)
            local reference = p.exact and 0 or 10^-(p.digits or 10)
            -- a hundred local errors add up; those of bdf are a fifth of tol each, and all have one sign
            local sum = method == "bdf" and math.max(100, sol:stats().steps/5) or 100
            if not (error <= sum*tol*(amplified[p.name] or 1) + 10*reference) then
              expect(("%s, rtol = %g: error %.1e"):format(method, tol, error)):equals "smaller"
            end
          end
        end
      end
    end)
  end
end
