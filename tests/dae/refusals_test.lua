-- Texts of refusals that no other file asserts: the culprit, what was expected, the way out.
local x, y, z, w = vars "x y z w"
local function refused(name, f, text)
  test(name, function() expect(f):fails(text) end)
end

refused("a state that is no variable", function() return dae.semi_explicit { x = { param "a" }, f = { x } } end,
  "x must be made of variables (var \"x\"), got 'a'")
refused("no equations", function() return dae.semi_explicit { x = { x } } end,
  "expected { x =, z =, u =, f =, g = }: x and f are required")
refused("a matrix is missing", function() return dae.linear { E = { { 1 } } } end,
  "expected { E =, A =, B =, u = }: E and A are required")
refused("matrices of different sizes", function() return dae.linear { E = { { 1, 0 }, { 0, 1 } }, A = { { 1 } } } end,
  "E is 2×2, but A is 1×1; both must have the same size")
refused("B of another height", function() return dae.linear { E = eye(2), A = eye(2), B = { { 1 } } } end,
  "B has 1 rows, but E has 2")
refused("an equation without a symbol", function() return dae { der(x) ~ -x, vec { x - x + 1 } ~ vec { 0 } } end,
  "contains no symbol: it reads 0 = 1, which never holds")
refused("nothing unknown", function() return dae { param "a=1" ~ 0 } end,
  "the equations contain no unknown; declare unknowns with var or vars")
refused("a variable and a parameter of one name", function() return dae { der(x) ~ -x + param "x" } end,
  "two different symbols are called 'x' in this model; one is a variable, parameter or input of another kind: rename one")
refused("a declared algebraic variable with a derivative", function()
  return dae.semi_explicit { x = { x }, z = { z }, f = { -x }, g = { der(z) - x } }
end, "'z' was declared algebraic (z), but its derivative occurs; move it to x")
refused("a form that does not exist", function() return dae { der(x) ~ -x }:reduce "akk" end,
  "unknown form 'akk'. Forms: acc, ggl, baumgarte, project, dummy, minimal, ode")
refused("ggl of index 4", function()
  return dae { der(x) ~ y, der(y) ~ z, der(z) ~ w, 0 ~ x - sin(t) }:reduce "ggl"
end, "has to be differentiated 3 times, but the form is made for two (positions, velocities); use reduce \"acc\" or \"dummy\"")
refused("baumgarte with a gain that amplifies", function()
  return dae { der(x) ~ y, der(y) ~ -w*x, 0 ~ x^2 - 1 }:reduce("baumgarte", { alpha = -1 })
end, "must be positive: otherwise the violation of a constraint does not decay")
refused("a start of a symbol that is not there", function() return dae { der(x) ~ -x }:init { fix = { [y] = 1 } } end,
  "'y' is not an unknown of this model. Did you mean 'x'?")
