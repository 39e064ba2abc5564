-- Every form of reference problems: the same number of free initial values, or a reason.
local function both(sys, form)
  if form == "" then return sys:reduce() end
  return sys:reduce(form)
end

for _, name in ipairs { "exam_3d", "nilpotent", "hidden_sum", "scholz_steinbrecher", "mattsson_linear",
  "jay_index2",
  "jay_index3", "pendulum_velocity", "linear_combination", "substitution", "gear_petzold",
    "tracking_chain" } do
  test(name .. ": forms are equivalent or refused by name", function()
    local sys = problems[name]()
    local free = sys:dof()
    for _, form in ipairs { "", "acc", "ggl", "baumgarte", "project", "dummy", "minimal", "ode" } do
      local good, low = pcall(both, sys, form)
      if good then
        expect(low:dof()):equals(free)
      else
        expect(tostring(low):find('form "' .. form .. '"', 1, true) ~= nil):is_true()
      end
    end
  end)
end

test("exam 3(d): minimal keeps one free value and the mode 1/2; reduce() goes through the repaired equations",
  function()
  local sys = problems.exam_3d()
  local x = sys.differential
  local low = sys:reduce "minimal"
  expect(low:dof()):equals(1)
  local at = sys:init { fix = { [x[1]] = 2 } }
  expect(at(x[3])):near(4, 1e-14)
  for _, form in ipairs { "minimal", "project", "acc", "dummy" } do
    local sol = sys:reduce(form):integrate { start = at, to = 1, dt = 0.01, method = rk.gauss(3) }
    expect(sol(x[3], 1)):near(4*math.exp(0.5), 1e-11)
  end
  expect(sys:reduce():dof()):equals(1)
end)

test("a start keeps its inputs as expressions: reduced forms need their derivatives", function()
  local u = input "u"
  local x = var("x", 3)
  local sys = dae.linear { E = { { 0, 1, 0 }, { 0, 0, 1 }, { 0, 0, 0 } }, A = eye(3),
    B = { { 0 }, { 0 }, { 1 } },
    u = u, x = x }
  local given = { [u] = function(t) return sin(t) end }
  local at = sys:init { inputs = given }
  for _, form in ipairs { "acc", "project", "dummy" } do
    local sol = sys:reduce(form):integrate { start = at, to = 1, dt = 0.1, method = rk.gauss(3),
      inputs = given }
    expect(sol(x[1], 1)):near(math.sin(1), 1e-6)           -- x = (-u″, -u′, -u)
  end
end)

test("integrate refuses index 2 also where structure says 0", function()
  local sys = problems.exam_3d()
  expect(function() sys:integrate { start = problems.exam_3d:start(),
    to = 1 } end):fails "the model has index 2"
  -- as it stands
  local sol = sys:integrate { start = problems.exam_3d:start(), to = 1, direct = true, method = "radau" }
  expect(sol.status):equals "finished"
  -- structurally singular and of index 1: nothing to refuse
  local i1, i2 = vars "i1 i2"
  local transformer = dae { der(i1) + 2*der(i2) ~ sin(t) - i1, 2*der(i1) + 4*der(i2) ~ -i2 }
  expect(transformer:index()):equals(1)
  expect(transformer:integrate { start = transformer:init { fix = { i1 = 0 } },
    to = 1 }.status):equals "finished"
end)

test("form ggl is integrated at index 2, which it is made for", function()
  local p = problems.pendulum
  local at = p:start()
  local sol = p():reduce "ggl":integrate { start = at, to = 1, rtol = 1e-8, atol = 1e-8 }
  local x = var "x"
  expect(sol(x, 1)):near(p():reduce():integrate { start = at, to = 1, rtol = 1e-10, atol = 1e-10 }(x, 1),
    1e-6)
  expect(tostring(sol:stats())):matches "radau"
end)
