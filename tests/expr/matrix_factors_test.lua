-- svd, qr, lu, chol, pinv, null_space, kron against their definitions, on matrices of all shapes and scales.
local function random_matrix(rows, cols, scale) return evaluate(scale*randn(rows, cols)) end

local function largest(m)
  if type(m) == "number" then return math.abs(m) end
  local worst = 0
  for i = 1, m.rows do for j = 1, m.cols do worst = math.max(worst, math.abs(m(i, j))) end end
  return worst
end

local function orthonormal(Q) expect(largest(Q.T*Q - eye(Q.cols))):near(0, 1e-13) end

test("factors multiply to the matrix", function()
  seed(3)
  for _, shape in ipairs { { 1, 1 }, { 4, 4 }, { 7, 3 }, { 3, 7 }, { 40, 25 } } do
    for _, scale in ipairs { 1e-9, 1, 1e12 } do
      local A = random_matrix(shape[1], shape[2], scale)
      local U, s, V = svd(A)
      orthonormal(U)
      orthonormal(V)
      expect(largest(U*diag(s)*V.T - A)/largest(A)):near(0, 1e-13)
      for k = 2, #s do expect(s[k] <= s[k - 1]):equals(true) end
      local Q, R = qr(A)
      orthonormal(Q)
      expect(largest(Q*R - A)/largest(A)):near(0, 1e-13)
      for i = 1, R.rows do
        expect(R(i, i) >= 0):equals(true)
        for j = 1, i - 1 do expect(R(i, j)):equals(0) end
      end
      local B = pinv(A)                                   -- the four conditions of Penrose
      expect(largest(A*B*A - A)/largest(A)):near(0, 1e-12)
      expect(largest(B*A*B - B)/largest(B)):near(0, 1e-12)
      expect(largest((A*B).T - A*B)):near(0, 1e-12)
      expect(largest((B*A).T - B*A)):near(0, 1e-12)
    end
  end
end)

test("Gauss and Cholesky", function()
  seed(4)
  for _, n in ipairs { 1, 2, 6, 30 } do
    local A = random_matrix(n, n, 1)
    local L, U, P = lu(A)
    expect(largest(P*A - L*U)):near(0, 1e-12)
    expect(largest(P*P.T - eye(n))):equals(0)
    local S = A*A.T + eye(n)
    local C = chol(S)
    expect(largest(C*C.T - S)/largest(S)):near(0, 1e-14)
  end
  expect(function() chol{{1, 2}, {2, 1}} end):fails "leading minor of size 2 is negative"
  expect(function() chol{{1, 2}, {3, 9}} end):fails "A(2, 1) = 3 and A(1, 2) = 2"
  expect(function() lu{{1, 2, 3}} end):fails "square"
  expect(function() svd{{1, 0/0}} end):fails "is nan, not a number"
  expect(function() qr(var "x") end):fails "A"
end)

test("null spaces have the dimension that the rank leaves", function()
  seed(5)
  for rank_wanted = 1, 4 do
    local A = random_matrix(6, rank_wanted, 1)*random_matrix(rank_wanted, 5, 1e6)
    local N = null_space(A)
    expect(N.rows):equals(5)
    expect(N.cols):equals(5 - rank_wanted)
    expect(largest(A*N)/largest(A)):near(0, 1e-13)
    orthonormal(N)
  end
  expect(null_space{{1, 0}, {0, 1}}.cols):equals(0)
end)

test("Kronecker products of symbols; logarithmic spacing; norms of systems", function()
  local a = param "a"
  expect(kron({ { a, 0 }, { 0, 1 } }, { { 1, 2 } })):equals(mat{{a, 2*a, 0, 0}, {0, 0, 1, 2}})
  local A, X, B = randn(2, 2), randn(2, 2), randn(2, 2)
  local function stacked(M) return vec{ M(1, 1), M(2, 1), M(1, 2), M(2, 2) } end
  expect(largest(evaluate(kron(B.T, A)*stacked(X) - stacked(A*X*B)))):near(0, 1e-14)   -- vec(A X B)
  expect(logspace(-2, 2, 5)):near({ 0.01, 0.1, 1, 10, 100 }, 1e-14)
  expect(function() logspace(0, 400, 3) end):fails "to is an exponent of 10"
  expect(function() svd{{1, 2}, {5}} end):fails "row 2 of A has 1 entry but row 1 has 2"
  expect(norm(tf({1}, {1, 1}), 2)^2):near(0.5, 1e-14)
  expect(norm(tf({1}, {1, 0.2, 1}), "inf")):near(1/(0.2*math.sqrt(1 - 0.01)), 1e-9)    -- 1/(2ζ√(1 - ζ²))
end)
