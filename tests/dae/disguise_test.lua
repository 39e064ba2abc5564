-- Models whose index, degrees of freedom and solution are known by construction (disguise.lua);
-- ./dev disguises runs 2000 of them.
local part_of = dofile "tests/part_of.lua"
local disguise = dofile "tests/dae/disguise.lua"

local function check(seed, forms)
  local o, wrong = disguise.options(seed), {}
  disguise.check(seed, function(what, text) wrong[#wrong + 1] = what .. ": " .. text end, forms)
  expect(("seed %d, index %d, dof %d: %s"):format(seed, o.index, o.dof, table.concat(wrong, "; ")))
    :equals(("seed %d, index %d, dof %d: "):format(seed, o.index, o.dof))
end

test("index, degrees of freedom and starts of disguises of index 0 to 6", function()
  local taken = part_of(2)
  for seed = 1, 56 do
    if taken() and seed ~= 41 then check(seed, {}) end                             -- it takes seconds
  end
end)

test("every form of disguises of index 0 to 6 follows the solution", function()
  for _, seed in ipairs { 2, 3, 8, 10, 14, 16, 17, 25, 26, 58 } do check(seed) end
end)

test("forms whose rows are of high order, or that meet units far from 1, begin and run", function()
  local taken = part_of(2)
  for _, seed in ipairs { 131, 152, 271, 348, 46, 770, 805, 1045 } do
    if taken() then check(seed, { "array" }) end
  end
  for _, seed in ipairs { 153, 2586, 2677 } do check(seed, { "dummy" }) end
  check(24, { "ggl" })
end)

test("hyperbolic functions in units of 10⁻⁹ and less: starts and explicit forms", function()
  for _, seed in ipairs { 213, 289, 348, 407, 553 } do check(seed, { "auto", "minimal", "ode" }) end
end)

test("linear disguises of all indices in units between 10⁻¹² and 10¹²", function()
  for seed = 60, 480, 60 do check(seed, { "auto", "array" }) end
end)

test("form array begins where its rows are not linear in derivatives that nothing determines", function()
  local m = disguise.model(636, disguise.options(636))
  local exact, guess = m.exact(0.3), {}
  for i, y in ipairs(m.y) do guess[y] = exact[i] end
  local begin = m.sys:init { from = 0.3, guess = guess }
  local sol = m.sys:reduce("array", { at = begin })
    :integrate { start = begin, from = 0.3, to = 0.301, rtol = 1e-6 }
  expect(sol.status):equals "finished"
  for i, y in ipairs(m.y) do expect(sol(y, 0.3) / m.unit[i]):near(exact[i] / m.unit[i], 1e-9) end
end)
