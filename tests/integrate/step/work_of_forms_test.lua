-- The work of a run grows with its digits as the order of the method tells, in every form of a model.
-- Newton's iterations of forms in which z follows from x′ look like diverging ones at first, and the
-- multipliers of "ggl" have no size of their own: pendulums took 3000 steps of radau and 1.8 million of bdf
-- at rtol 10⁻⁹.
local x, y, u, v, la = vars "x y u v la"
local function pendulum(T)
  return dae { der(x) ~ u, der(y) ~ v, der(u) ~ -la*x, der(v) ~ -la*y - 9.81/T^2, x^2 + y^2 ~ 1 }
end
local x1, y1, x2, y2, l1, l2 = vars "x1 y1 x2 y2 l1 l2"
local double = dae { der(x1, 2) ~ -2*l1*x1 - 2*l2*(x1 - x2), der(y1, 2) ~ -9.81 - 2*l1*y1 - 2*l2*(y1 - y2),
  der(x2, 2) ~ 2*l2*(x1 - x2), der(y2, 2) ~ -9.81 + 2*l2*(y1 - y2),
  x1^2 + y1^2 ~ 1, (x1 - x2)^2 + (y1 - y2)^2 ~ 1 }
local at_rest = { x1 = 1, y1 = 0, x2 = 2, y2 = 0, [der(x1)] = 0, [der(y1)] = 0, [der(x2)] = 0, [der(y2)] = 0 }
local leaning, level = { x = math.sin(1.2), y = -math.cos(1.2), u = 0, v = 0 }, { x = 1, y = 0, u = 0, v = 0 }
local models = {
  { pendulum(1), leaning, x, 1 }, { pendulum(1), level, x, 1 }, { double, at_rest, x2, 1 },
  { pendulum(1e3), leaning, x, 1e3 }, { pendulum(1e-6), level, x, 1e-6 } }

-- bdf of order 5 takes 10^(1/5) = 1.6 times the steps for a digit more, an estimate of order 4 10^(1/4) =
-- 1.8; a change of the order may double that once.
local growth, few = 4, 40
local errors = 300                              -- of the steps in sum, by stats(), in tolerances

for k, case in ipairs(models) do
  local model, start, shown, to = table.unpack(case)
  local fine = model:reduce("project"):integrate { start = start, to = to, rtol = 1e-12, method = "radau" }
  local exact = fine(shown, to)
  for _, form in ipairs { "ggl", "array", "dummy", "project", "baumgarte", "acc" } do
    test(("model %d, form %s"):format(k, form), function()
      local reduced = model:reduce(form)
      for _, method in ipairs { "radau", "bdf", form ~= "ggl" and to == 1 and "gauss" or nil } do
        local before
        for digits = 4, 11 do
          local sol = reduced:integrate { start = start, to = to, rtol = 10^-digits, method = method }
          expect(sol.status):equals "finished"
          local steps = #sol.t - 1
          if before and steps > growth*before + few then
            error(("%s, %d digits: %d steps after %d"):format(method, digits, steps, before))
          end
          before = math.max(before or 0, steps)
          expect(sol(shown, to)):near(exact, math.max(errors*10^-digits, 1e-10))
        end
      end
    end)
  end
end
