-- Verdicts that named the wrong reason.
local x, y = vars "x y"

test("Newton's method that runs away diverges; that the Jacobian vanishes far away is not the reason",
  function()
  for _, start in ipairs { 2, -2, 1.2 } do
    local k = newton { r = { tanh(x) }, x = { x }, start = { start } }
    expect(k.converged):equals(false)
    expect(k.status):equals "diverged"
    expect(tostring(k)):matches "the iterates diverge"
  end
  expect(newton { r = { x^2 + 1 }, x = { x }, start = { 0 } }.status):equals "singular Jacobian"
end)

test("Gauss–Newton whose unknowns lose their influence where ‖R‖ is huge has not converged", function()
  local g = gauss_newton { R = { 1 - (x + y*2), 2 - x*exp(y) }, x = { x, y }, start = { -0.5, 0.5 },
    alpha = 1 }
  expect(g.converged):equals(false)
  expect(g.status):equals "diverged"
  expect(tostring(g)):matches "Diverged: ‖R‖ has grown"
  expect(tostring(g):find("Not determined", 1, true)):equals(nil)
  local redundant = gauss_newton { R = { x + y - 1 }, x = { x, y }, start = { 0, 0 } }
  expect(redundant.converged):equals(true)
  expect(tostring(redundant)):matches "R does not change"
end)

test("the constants of a general solution are written out", function()
  local general = dae { der(x) ~ y, der(y) ~ -x }:pencil():solution()
  expect(tostring(general)):equals "(c₁ cos(t) + c₂ sin(t), c₂ cos(t) - c₁ sin(t))"
end)

test("a start that violates a constraint by its fixed values says which, at these values", function()
  local p = var("p", 3)
  local m, g, L = params "m=1 g=9.81 L=1"
  local ball = lagrange { q = p, T = m/2*p.dot.T*p.dot, V = m*g*p[3], C = { (p.T*p - L^2)/2 } }
  local good, problem = pcall(ball.init, ball, { fix = { [p] = { 1, 0, 0 }, [p.dot] = { 0.1, 1, 0 } } })
  expect(good):equals(false)
  expect(problem):matches "violated: C′:  0 ≠ 0.1 = pᵀp′"
  expect(problem:find("C:  0", 1, true)):equals(nil)
end)

test("models that are not square are called by their names", function()
  expect(tostring(dae { der(x) + der(y) ~ x })):matches "under%-determined: 1 equation for 2 unknowns"
  expect(tostring(dae { der(x) ~ x, x ~ 1 })):matches "over%-determined: 2 equations for 1 unknown"
end)

test("Gauss-Newton whose unknowns lose their influence far away has diverged, whether ‖R‖ grows or not",
  function()
  local a, b = vars "a b"
  local run = gauss_newton { R = { a*exp(b) - 1, a*exp(2*b) - 3, a*exp(3*b) - 9.5 }, x = { a, b },
    start = { -0.5, 0.5 },
    alpha = 1 }
  expect(run.converged):equals(false)
  expect(tostring(run)):matches "Diverged: ‖x‖ has grown from 0.707 to"
end)

test("Gauss-Newton that flees to a larger ‖R‖ has not converged, however little it grows", function()
  local a, b = vars "a b"
  for _, unit in ipairs { 1, 1e3, 1e-3 } do
    local R = {}
    for i = 1, 5 do R[i] = atan(a/unit + b*i/unit) end
    local run = gauss_newton { R = R, x = { a, b }, start = { -2.5*unit, 2.5*unit }, alpha = 1 }
    expect(run.status):equals "diverged"
  end
end)
