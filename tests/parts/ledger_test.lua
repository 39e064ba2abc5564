-- Energy, charge and volume of every part in random networks; ./dev networks makes many more.
local ledger = dofile "tests/parts/ledger.lua"

for domain, kind in pairs(ledger.domains) do
  test(domain .. ": every part has its law", function()
    for _, name in ipairs(ledger.parts(domain)) do
      if not kind.recipes[name] then error(name .. " has no entry in tests/parts/ledger.lua") end
    end
  end)
  test(domain .. ": random networks balance, part by part", function()
    local seen, count = {}, 0
    for seed = 1, 6 do
      local faults, used = ledger.trial(domain, seed)
      if #faults > 0 then error(("seed %d: %s"):format(seed, table.concat(faults, "; "))) end
      for name in pairs(used) do seen[name] = true end
    end
    for _ in pairs(seen) do count = count + 1 end
    expect(count):equals(#ledger.parts(domain))
  end)
end

-- More free initial values than unknowns in the equations, W′ = … without W: index() left the array.
test("integrals that nothing depends on", function()
  expect(#ledger.trial("planar", 174)):equals(0)
end)

-- The sliding speed was ±2e-16 where a clutch began to slide: |w| took the wrong side for a whole step.
test("friction that begins to slide at the rounding of its speed", function()
  for seed = 65, 72 do expect(#ledger.trial("rotational", seed)):equals(0) end
end)
