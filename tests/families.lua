-- The adaptive methods that tests run over, from the table of method families: a family that is added there
-- is tested without being listed here. Explicit methods are tableaus, listed by methods(); tests name some.
local families = { implicit = {} }
for _, family in ipairs(method_families()) do
  if family.listed and not family.explicit then families.implicit[#families.implicit + 1] = family.name end
end

--- with(names …) -> a list of these, and of all implicit families.
function families.with(...)
  local list = { ... }
  return table.move(families.implicit, 1, #families.implicit, #list + 1, list)
end

return families
