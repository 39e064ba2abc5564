-- Vectors, matrices and linear algebra (docs/language.md#symbols-and-expressions): every name, and every
-- refusal with its text.
local x, y, z = vars "x y z"
local q = var("q", 6)
local m, g = params "m=1 g=9.81"
local p1, p2 = q:slice(1, 3), q:slice(4, 6)
local A = mat{ { 1, 2 }, { 3, 4 } }

local function shows(value, text) expect(tostring(value)):equals(text) end
local function fails(f, text) expect(f):fails(text) end

-- ── vectors and matrices ──

test("making and joining", function()
  expect(vec{ 1, 2, 3 } == vec(1, 2, 3)):is_true()
  expect(vec{ p1, 5, p2 }.rows):equals(7)
  expect(mat{ { A, vec{ 5, 6 } }, { 7, 8, 9 } } == mat{ { 1, 2, 5 }, { 3, 4, 6 }, { 7, 8, 9 } }):is_true()
  expect(vstack(A, { { 5, 6 } })(3, 2)):equals(6)
  expect(hstack(p1, p2) == hstack(q:slice(1, 3), q:slice(4, 6))):is_true()
  expect(blkdiag(A, 1, A).rows):equals(5)
  expect(diag{ 1, 2 } == mat{ { 1, 0 }, { 0, 2 } }):is_true()
  expect(diag(A) == vec{ 1, 4 }):is_true()
  expect(eye(3):block(1, 2, 1, 3) == mat{ { 1, 0, 0 }, { 0, 1, 0 } }):is_true()
  expect(ones(2, 2)*2 == mat{ { 2, 2 }, { 2, 2 } }):is_true()
  expect(zeros(0, 3).cols):equals(3)
  expect(linspace(0, 1, 11)):near({ 0, .1, .2, .3, .4, .5, .6, .7, .8, .9, 1 }, 1e-15)
  expect(cross({ 1, 2, 3 }, { 4, 5, 6 }) == vec{ -3, 6, -3 }):is_true()
  expect(norm{ 3, 4 } == 5):is_true()
  expect(norm(p1)^2 == p1.T*p1):is_true()
  expect(sum{ 1, 2, 3 }):equals(6)
  expect(sum{ p1, p2 } == p1 + p2):is_true()
  expect(sum{}):equals(0)
  expect(sum(A) == 10):is_true()
  expect(map({ 1, 2 }, function(v, i) return v*i end)):equals({ 1, 4 })
  expect(map(p1, function(e) return e^2 end)[2] == q[2]^2):is_true()
end)

test("lists are checked", function()
  fails(function() vec{ 1, nil, 3 } end, "entry 2 of the list is nil")
  fails(function() vec{ x = 1 } end, "it has the key 'x'")
  fails(function() mat{ { 1, 2 }, { 3 } } end, "row 2 of the matrix has 1 entry but row 1 has 2")
  fails(function() vec{ 1, "a" } end, "entry 2 of the list: 'a' is not a number")
  fails(function() vec{ 1, true } end, "not a boolean")
  fails(function() vec{ { 1, 2 }, { 3, 4 } } end, "a vector has one column")
  fails(function() vec{ 0/0 } end, "entry 1 of the list is nan")
  fails(function() zeros(1e9) end, "too large: at most 10 million entries")
  fails(function() zeros(1e5, 1e5) end, "too large")
  fails(function() eye(-1) end, "a size cannot be negative")
  fails(function() linspace(0, 1, 1) end, "at least 2 points")
  fails(function() cross({ 1, 2 }, { 3, 4 }) end, "two vectors with 3 entries")
  fails(function() dot({ 1, 2 }, { 3, 4, 5 }) end, "have no inner product")
  fails(function() norm(A) end, "must be a vector")
  fails(function() hstack(A, p1) end, "they need as many rows")
  fails(function() sum(1, 2) end, "expected one list")
  fails(function() map(q, function() return "a" end) end, "what the function returned for entry 1")
  fails(function() map(q, function() error "mine" end) end, "mine")
end)

test("indexing", function()
  expect(A[2] == mat{ { 3, 4 } }):is_true()
  expect(A(1, 2)):equals(2)
  expect(A:col(2) == vec{ 2, 4 }):is_true()
  expect(A.T(1, 2)):equals(3)
  expect(q.T[2] == q[2]):is_true()
  expect(x[1] == x):is_true()
  expect(x.T == x):is_true()
  expect(#x):equals(1)
  expect(q.T:slice(2, 3).cols):equals(2)
  expect(A:slice(2, 2) == A[2]):is_true()
  expect(p1:slice(2, 1).rows):equals(0)
  fails(function() return q[7] end, "entry 7 is out of range: a 6×1 column has 6 entries")
  fails(function() return q[0] end, "(the first is 1)")
  fails(function() return q[1.5] end, "not an integer")
  fails(function() return A[3] end, "row 3 is out of range: a 2×2 matrix has 2 rows")
  fails(function() return A(1, 3) end, "column 3 is out of range: a 2×2 matrix has 2 columns")
  fails(function() return A(1) end, "as in A(2, 3)")
  fails(function() return A:block(1, 3, 1, 1) end, "rows 1 to 3 are out of range")
  fails(function() return q:slice(5, 7) end, "entries 5 to 7 are out of range")
  fails(function() return x[2] end, "index 2 is out of range: a scalar has 1 entry")
end)

test("walking", function()
  local seen = {}
  for i, e in ipairs(p1) do seen[i] = e end
  expect(#seen == 3 and seen[3] == q[3]):is_true()
  local n = 0
  for i, e in pairs(A) do n = n + i*#e end
  expect(n):equals(6)
  for i, e in ipairs{ "a", "b" } do expect(i == 1 or e == "b"):is_true() end
  expect(select("#", table.unpack(p1))):equals(3)
end)

-- ── linear algebra ──

test("exact linear algebra", function()
  local H = mat{ { 1, "1/2", "1/3" }, { "1/2", "1/3", "1/4" }, { "1/3", "1/4", "1/5" } }
  expect(det(H) == rational "1/2160"):is_true()
  expect(inv(H)(3, 3)):equals(180)
  expect(H*inv(H) == eye(3)):is_true()
  expect(solve(H, { 1, 0, 0 }) == vec{ 9, -36, 30 }):is_true()
  expect(rank{ { 1, 2, 3 }, { 2, 4, 6 }, { 0, 0, 1 } }):equals(2)
  expect(charpoly(A) == vec{ 1, -5, -2 }):is_true()
  expect(det(A) == -2):is_true()
  expect(eig{ { 2, 1 }, { 1, 2 } }.values == vec{ 1, 3 }):is_true()
  shows(eig{ { 0, 1 }, { -1, 0 } }, "eigenvalues: -i, i")
  shows(eig{ { 1, 2 }, { 3, 4 } }, "eigenvalues: 5/2 - √33/2, 5/2 + √33/2")
  expect(eig{ { 1, 1, 0 }, { 0, 1, 1 }, { 0, 0, 1 } }.values == vec{ 1, 1, 1 }):is_true()
  fails(function() inv{ { 1, 2 }, { 2, 4 } } end, "A v = 0 for v = (2, -1)")
  fails(function() det{ { 1, 2 } } end, "must be square, not a 1×2 row")
  fails(function() solve(A, { 1, 2, 3 }) end, "2 rows but the right-hand side has 3")
end)

test("symbolic linear algebra", function()
  local B = mat{ { x, 1 }, { 1, y } }
  expect(simplify(det(B) - (x*y - 1)) == 0):is_true()
  expect(simplify(B*inv(B)) == eye(2)):is_true()
  expect(rank{ { x, x*y }, { 1, y } }):equals(1)
  expect(rank{ { sin(x)^2 + cos(x)^2, 1 }, { 1, 1 } }):equals(1)
  expect(simplify(charpoly(B)[2] + x + y) == 0):is_true()
  expect(simplify(charpoly(B, z) - (z^2 - (x + y)*z + x*y - 1)) == 0):is_true()
  local s = solve({ { 2*m, m }, { m, m } }, { -m*g, 0 })
  expect(simplify(s + vec{ g, -g }) == zeros(2)):is_true()
  local n = 7
  local rows = {}
  for i = 1, n do rows[i] = {} for j = 1, n do rows[i][j] = i == j and x + i or j - i == 1 and y or 1 end end
  local big, point = mat(rows), { x = 0.3, y = 0.7 }
  expect(evaluate(det(big), point)):near(det(evaluate(big, point)), 1e-10)
  expect(evaluate(solve(big, ones(n)), point)):near(solve(evaluate(big, point), linspace(1, 1, n)), 1e-10)
  fails(function() inv{ { x, 2*x }, { 1, 2 } } end, "singular for all values of its symbols")
  fails(function() eig(B) end, "eigenvalues need numbers")
end)

test("linear algebra on doubles", function()
  local D = evaluate(A)
  expect(det(D)):near(-2, 1e-14)
  expect(inv(D)*D):near(eye(2), 1e-14)
  expect(rank(D)):equals(2)
  local e = eig(evaluate(mat{ { 0, 1 }, { -2, -2 } }))
  expect(e.re):near({ -1, -1 }, 1e-12)
  expect(e.im):near({ -1, 1 }, 1e-12)
  fails(function() return e.values end, "some eigenvalues are complex")
  fails(function() inv(evaluate(mat{ { 1, 2 }, { 2, 4 } })) end, "singular to working precision")
end)

test("expm", function()
  expect(expm{ { 0, 1 }, { 0, 0 } } == mat{ { 1, 1 }, { 0, 1 } }):is_true()
  local E = expm(mat{ { 1, 1 }, { 0, 2 } }*t)
  expect(simplify(der(E) - mat{ { 1, 1 }, { 0, 2 } }*E) == zeros(2, 2)):is_true()
  expect(evaluate(E, { t = 0 })):near(eye(2), 0)
  local J = mat{ { -1, 1, 0 }, { 0, -1, 1 }, { 0, 0, -1 } }
  expect(evaluate(expm(J*t), { t = 0.7 })):near(expm(evaluate(J*rational "7/10")), 1e-13)
  expect(expm{ { 0.0, 1 }, { -1, 0 } }(1, 1)):near(math.cos(1), 1e-14)
  expect(evaluate(expm{ { x, 1 }, { y, x } }, { x = 0.3, y = 2 })):near(expm{ { 0.3, 1 }, { 2, 0.3 } }, 1e-13)
  fails(function() expm{ { x, 1, y }, { y, z, 1 }, { z, 1, x } } end, "no exact form")
end)

test("implicit_jacobian: the rank condition is asked for where r = 0", function()
  fails(function() implicit_jacobian((z - y)^2, z, y) end,
    "the rank condition fails on the whole solution set")
  fails(function() implicit_jacobian({ (x - y)^2, x + z }, { x, z }, y) end, "sufficient, not necessary")
  expect(implicit_jacobian(z^3 - y, z, y) == 1/(3*z^2)):is_true()          -- regular where y ≠ 0
  expect(implicit_jacobian({ (x - y)*(x - 2*y) }, { x }, { y }) ~= nil):is_true()
  local f = func("f", 1)
  expect(tostring(implicit_jacobian(f(z, y), z, y))):equals "-(∂f/∂y)/(∂f/∂z)"
end)

test("implicit_jacobian", function()
  expect(simplify(implicit_jacobian(z^2 - y, z, y) - 1/(2*z)) == 0):is_true()
  local J = implicit_jacobian({ x + y - z, x*y }, { x, y }, z)
  expect(evaluate(J, { x = 2, y = 1 })):near({ 2, -1 }, 1e-14)
  fails(function() implicit_jacobian(y + 0*x, x, y) end, "not regular")
  fails(function() implicit_jacobian({ x, y }, x, y) end, "r has 2 equations but z has 1 unknown")
end)

test("large matrices are computed in a process of their own, with the same results", function()
  math.randomseed(4)
  local n, rows = 240, {}
  for i = 1, n do
    rows[i] = {}
    for j = 1, n do rows[i][j] = math.random() - 0.5 end
    rows[i][i] = rows[i][i] + 0.1*n
  end
  local A = evaluate(mat(rows))
  local e = eig(A)
  local sum = 0
  for i = 1, n do sum = sum + e.re[i] - rows[i][i] end
  expect(sum):near(0, 1e-9*n)                           -- 40 n³ > 10⁹: in a child
  expect(rank(A)):equals(n)
  local back = expm(A/(10*n))*expm(-A/(10*n))
  expect(back(1, 1)):near(1, 1e-10)
  expect(back(n, 1)):near(0, 1e-10)
  for _, size in ipairs { 2, 40, 720 } do
    local singular = {}
    for i = 1, size do
      singular[i] = {}
      for j = 1, size do singular[i][j] = i == j and i < size and 1 or 0 end
    end
    singular = evaluate(mat(singular))                  -- one pivot is exactly 0
    expect(function() return inv(singular) end):fails "singular to working precision"
    expect(function() return solve(singular, ones(size, 1)) end):fails "singular to working precision"
    expect(rank(singular)):equals(size - 1)
  end
end)

test("ipairs walks through everything that is counted", function()
  local x, y = vars "x y"
  local function walked(list)
    local count = 0
    for i, each in ipairs(list) do
      count = count + 1
      expect(i):equals(count)
      expect(each ~= nil):is_true()
    end
    return count
  end
  local swing = dae { der(x) ~ y, 0 ~ x^2 - t^2 - 1 }
  expect(walked(swing:constraints())):equals(#swing:constraints())
  local runs = sweep(dae { der(x) ~ -x }, { start = { x = { 1, 2, 3 } }, to = 1 })
  expect(walked(runs)):equals(3)
  expect(walked(swing:reduce():integrate { start = { x = 1 }, to = 1 }:drift())):equals(1)
  expect(walked(x)):equals(1)
  expect(walked(eig { { 0, 1 }, { -4, 0 } })):equals(2)
  expect(walked { 1, 2 }):equals(2)
  expect(walked {}):equals(0)
end)

test("eigenvalues by number", function()
  local e = eig { { 0, 1 }, { -4, 0 } }
  expect(e[1].im):equals(-2)
  expect(e[2].im):equals(2)
  expect(eig { { 2, 1 }, { 1, 2 } }[2]):equals(3)
  expect(eig { { 1, 1 }, { 1, 0 } }[2]):equals((1 + sqrt(5))/2)
  expect(function() return e[3] end):fails "no eigenvalue number 3: the matrix has 2"
end)
