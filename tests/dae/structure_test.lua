-- structure(): Σ, offsets and the verdict, on models whose answer is known (issue 3; exam 3(d); Pryce 2001).

test("the planar pendulum: c = (0,0,2), d = (2,2,0), index 3, two free initial values, valid", function()
  local x, y, lam = vars "x y lambda"
  local g, L = params "g=9.81 L=1"
  local s = dae { der(x, 2) ~ -lam*x, der(y, 2) ~ -lam*y - g, 0 ~ x^2 + y^2 - L^2 }:structure()
  expect(s.c):equals { 0, 0, 2 }
  expect(s.d):equals { 2, 2, 0 }
  expect(s.structural_index):equals(3)
  expect(s.structural_dof):equals(2)
  expect(s.index):equals(3)
  expect(s.dof):equals(2)
  expect(s.verdict):equals("valid")
  expect(s.valid):equals(true)
end)

test("exam 3(d): structure says index 0 and three free values; the system Jacobian is identically singular", function()
  local s = dae.linear { E = { {1,1,0}, {0,0,1}, {1,1,1} }, A = eye(3) }:structure()
  expect(s.structural_index):equals(0)
  expect(s.structural_dof):equals(3)
  expect(s.verdict):equals("identically singular")
  expect(s.valid):equals(false)
end)

test("over- and under-determined parts are named", function()
  local x, y, z = vars "x y z"
  local s = dae { der(x) ~ y, 0 ~ x - 1, 0 ~ x - sin(t) }:structure()
  expect(s.verdict):equals("structurally singular")
  local text = tostring(dae { 0 ~ x - 1, 0 ~ x^2 - t, der(y) ~ z }:structure())
  expect(text:find("over-determined: 2 equations (1), (2) for 1 unknown x", 1, true) ~= nil):equals(true)
  expect(text:find("under-determined: 1 equation (3) for 2 unknowns y, z", 1, true) ~= nil):equals(true)
end)

test("sin² + cos² = 1 does not hide a singular Jacobian", function()
  local x, y, th = vars "x y theta"
  -- the second equation is the first again, in disguise
  local s = dae { 0 ~ x*(sin(th)^2 + cos(th)^2) + y, 0 ~ x + y, der(th) ~ x }:structure()
  expect(s.verdict):equals("identically singular")
end)
