-- What it costs to look for singularities of a mechanism along its solution.

test("guards that turn well above zero cost few evaluations of a step", function()
  local problem = problems.squeezer
  local low, start = problem.model:reduce(), problem:start()
  for _, rtol in ipairs { 1e-4, 1e-6 } do
    local stats = low:integrate { start = start, to = problem.to, rtol = rtol, atol = rtol,
      method = "verner87" }:stats()
    local steps = 13*(stats.steps + stats.rejected)    -- 13 stages
    expect(stats.evaluations < 2*steps):is_true()
  end
end)
