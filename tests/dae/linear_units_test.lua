-- Random linear models T P N Q x′ = P Q x + f: blocks of N nilpotent of length up to 4, or 1, and integer
-- P, Q of determinant 1; f is what a chosen solution needs. Fast and slow units of time, at t = 0, too: there
-- powers of t vanish whose coefficients are large.
local function draws(seed)
  local state = seed*7919 + 17
  return function(n)
    state = (state*1103515245 + 12345) % 2147483648
    return state//65536 % n + 1
  end
end

local function unimodular(n, draw)
  local A = {}
  for i = 1, n do
    A[i] = {}
    for j = 1, n do A[i][j] = i == j and 1 or 0 end
  end
  for _ = 1, 3*n do
    local i, j, c = draw(n), draw(n), draw(2)*2 - 3
    local sum = {}
    for k = 1, n do sum[k] = A[i][k] + c*A[j][k] end
    local small = i ~= j
    for k = 1, n do small = small and math.abs(sum[k]) <= 20 end
    if small then A[i] = sum end
  end
  return A
end

local function times(A, B)
  local C = {}
  for i = 1, #A do
    C[i] = {}
    for j = 1, #A do
      C[i][j] = 0
      for k = 1, #A do C[i][j] = C[i][j] + A[i][k]*B[k][j] end
    end
  end
  return C
end

--- The model, its unknowns, their values as expressions, index and degrees of freedom.
local function model(seed, T)
  local draw = draws(seed)
  local n, index, dof, N = 3 + draw(5), 0, 0, {}
  for i = 1, n do
    N[i] = {}
    for j = 1, n do N[i][j] = 0 end
  end
  local i = 1
  while i <= n do
    local length = draw(3) == 1 and 0 or math.min(draw(4), n - i + 1)
    for k = i, i + length - 2 do N[k][k + 1] = 1 end
    if length == 0 then N[i][i], dof = 1, dof + 1 end
    index, i = math.max(index, length), i + math.max(length, 1)
  end
  local P, Q = unimodular(n, draw), unimodular(n, draw)
  local A, B, s = times(times(P, N), Q), times(P, Q), t/T
  local x, exact, equations = var("x", n), {}, {}
  for k = 1, n do
    local size, pace = draw(5)/2, draw(4)
    exact[k] = ({ size*sin(pace*s + k), size*exp(-pace*s), size*s^3/6, size*cos(pace*s) + 1 })[k % 4 + 1]
  end
  for r = 1, n do
    local left, right = 0, 0
    for c = 1, n do
      left = left + T*A[r][c]*der(x[c])
      right = right + B[r][c]*x[c] + T*A[r][c]*diff(exact[c], t) - B[r][c]*exact[c]
    end
    equations[r] = left ~ right
  end
  return dae(equations), x, exact, index, dof
end

test("random linear models in units of time: index, degrees of freedom, the start near a guess", function()
  for seed = 1, 16 do
    for _, T in ipairs { 1, 1e6, 1e-9 } do
      local sys, x, exact, index, dof = model(seed, T)
      expect(sys:index()):equals(index)
      expect(sys:dof()):equals(dof)
      for _, time in ipairs { 0, 0.2*T } do
        local guess, value = {}, {}
        for k = 1, #exact do
          value[k] = fn({t}, exact[k])(time)
          guess[x[k]] = dof == 0 and 1 or value[k]
        end
        local at = sys:init { from = time, guess = guess }
        for k = 1, #exact do expect(at(x[k])):near(value[k], 1e-7) end
      end
    end
  end
end)

test("a mass that is small beside the force is no rounding error", function()
  local x, v, N = vars "x v N"
  for _, units in ipairs { { 1000, 1e-6 }, { 1e6, 1e-6 }, { 100, 1e-7 }, { 1, 1 } } do
    local L, S = units[1], units[2]
    local motion = 1.4122530911118*S^2*der(v) ~ 2.594544977881*L*sin(t/S) - 8.5402*x - 0.3*S*v + N
    expect(dae { 0 ~ N, der(x) ~ v, motion }:index()):equals(1)
    expect(dae { 0 ~ x - 0.327*L, der(x) ~ v, motion }:index()):equals(3)
  end
end)
