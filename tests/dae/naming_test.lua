-- Equation numbers mean one equation each, and what is said about conditions names those that they come from.
local E = mat { { 1, 1, 0 }, { 0, 0, 1 }, { 1, 1, 1 } }

test("conditions of a linear model are combinations of its equations, which can be checked by hand",
  function()
  local list = tostring(dae.linear { E = E, A = eye(3) }:constraints())
  expect(list):matches "%(1c%) %- %(1a%) %- %(1b%): +0 = x₁ %+ x₂ %- x₃"
  expect(list):matches "%(1c%)′ %- %(1a%)′ %- %(1b%)′ %- %(1a%) %+ %(1b%): +0 = x₁ %- x₂"
  -- many equations: counted instead of written out
  local x = var("x", 9)
  local e, sum = {}, 8*der(x[9])
  for k = 1, 8 do e[k] = der(x[k]) + der(x[9]) ~ x[k] sum = sum + der(x[k]) end
  e[9] = sum ~ x[9]
  expect(tostring(dae(e):constraints())):matches "with 8 other equations and derivatives"
end)

test("an equation that took the place of another has a number of its own, in every form", function()
  local sys = dae.linear { E = E, A = eye(3) }
  local story = tostring(sys:reduce "acc":trace())
  expect(story):matches "replaces %(1c%) as %(1c%*%)"
  expect(story):matches "%(1b%) %+ %(1c%*%)′ %- %(1a%)"
  expect(story):matches "%(1b%*%)  0 = x₁ %- x₂   is differentiated once\n     d/dt:  0 = x₁′ %- x₂′"
  expect(story):matches "no longer imposes %(1b%*%): the start must satisfy it"
  expect(tostring(sys:reduce "acc")):matches "%(1a%)   x₁′ %+ x₂′ = x₁\n"
  expect(tostring(sys:reduce "acc")):matches "%(1b%*%)  0 = x₁′ %- x₂′ +%[%(1b%*%) differentiated%]"
  expect(tostring(sys:reduce "baumgarte")):matches "%[%(1b%*%) stabilised%]"
  expect(tostring(sys:init { fix = { x1 = 1 } }:ledger())):matches "%(1b%*%)  ≤ 1e%-12  0 = x₁ %- x₂"
  expect(sys:reduce "acc":trace "latex"):matches "differentiated once"
end)

test("rows of a column of which some are differentiated are told one by one", function()
  local x, z = var("x", 2), var("z", 2)
  local sys = dae.semi_explicit { x = x, z = z, f = { z[1], z[2] }, g = { x[1] - sin(t), x[2] + z[2] } }
  local low = sys:reduce "acc"
  expect(tostring(low:trace())):matches "%(2a%)  0 = x₁ %- sin%(t%)   is differentiated once"
  expect(tostring(low)):matches "%(2a%*%)  0 = x₁′ %- cos%(t%) +%[%(2a%) differentiated%]"
  expect(tostring(low)):matches "%(2b%)   0 = x₂ %+ z₂"
end)

test("what the index of a model with unspecified functions depends on", function()
  local x, z, u, F, f, h = var("x", 3), var("Z", 2), input "u", func("F", 5), func("f", 3), func("h", 2)
  expect(tostring(dae.implicit { x = x, z = z, u = u,
    F = F(x.dot, x, z, u) })):matches "holds +index 1 where ∂F/∂%(x′, z%) is nonsingular"
  expect(tostring(dae.semi_explicit { x = x, z = z, f = f(x, z), g = h(x) })):matches(
    "index 2 where ∂g/∂x ∂f/∂z is nonsingular, with x′ = f and 0 = g the equations %(2a%), %(2b%); where it is singular everywhere, the index is at least 3")
end)

test("redundant constraints are named", function()
  local q = var("q", 4)                                    -- a parallelogram with a third bar
  local z = var("z", 4)
  local C = vec{ (q[1]^2 + q[2]^2 - 1)/2, ((q[3] - 1)^2 + q[4]^2 - 1)/2, q[3] - q[1] - 1, q[4] - q[2] }
  local sys = dae { q.ddot ~ -jacobian(C, q).T*z - vec{0, 9.81, 0, 9.81}, 0 ~ C }
  expect(function() return sys:index() end):fails("the constraints (2a), (2b), (2c), (2d) follow from each other: "
    .. "(2b) = (2a) + (q₁/2 + q₃/2 - 1/2) (2c) + (q₂/2 + q₄/2) (2d)")
end)

test("a name that is near no other is refused with the names there are", function()
  local x, v = vars "x v"
  local sys = dae { der(x) ~ v, der(v) ~ -x }
  expect(function() sys:integrate { start = { pressure = 1 }, to = 1 } end):fails
    "start: unknown symbol 'pressure'. Known here: x, v."
end)

test("a state whose derivative alone stands in the equations has a declared start", function()
  local h, s = var "h_fall", var "s_fall"
  local fall = dae { der(h) ~ s, der(s) ~ -9.81, start = { h_fall = 2 }, guess = { s_fall = 1 } }
  expect(fall:init { fix = { s_fall = 0 } }(h)):equals(2)
end)

test("units and words stand in the ledger, of derivatives too", function()
  local h = var("height_h", { unit = "m", text = "height" })
  local v, a = var("speed_v", { unit = "m/s" }), var("force_a", { unit = "N" })
  local sys = dae { der(h) ~ v, der(v) ~ -h, a ~ 2*v.dot }
  local ledger = tostring(sys:init { fix = { [h] = 1, [v] = 0 } }:ledger())
  for _, line in ipairs { "height_h +1  m +fixed +height\n", "height_h′ +0  m/s +computed\n",
    "speed_v′ +%-1  m/s² +computed", "force_a +%-2  N +computed" } do expect(ledger):matches(line) end
  expect(h.ddot.label):equals "height_h″ [m/s²]"
  expect(v.ddot.label):equals "speed_v″ [m/s³]"
  local x = var "no_unit"
  expect(tostring(dae { der(x) ~ -x }:init { fix = { [x] = 1 } }:ledger())):matches "no_unit +1  fixed\n"
end)
