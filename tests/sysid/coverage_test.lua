-- 95 % intervals of every estimator in a few runs each (coverage.lua); ./dev intervals makes 2000.
local coverage = dofile "tests/sysid/coverage.lua"

for _, one in ipairs(coverage.cases) do
  test(one.name .. ": 95 % intervals", function()
    local share = coverage.share(one, one.quick)
    if not (math.abs(share - 0.95) <= coverage.slack(one.quick)) then
      error(("%s covers %.1f %%"):format(one.name, 100 * share))
    end
  end)
end
