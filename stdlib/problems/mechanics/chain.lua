return {
  title = "A hanging chain of ten links",
  source = "benchmark of this project (docs/benchmarks.md#planar-chain), N = 10",
  statement = [[Point masses and massless links, let go from a straight line at 45 degrees.
    problems.chain.links(n) is the model with n links.]],
  tags = "mechanics nonlinear benchmark",
  index = 3, dof = 20, structural_index = 3, structural_dof = 20, verdict = "valid",
  to = 1, dt = 0.01, forms = { "acc", "ggl", "project" },
  links = function(n)
    local p = var("p", 2*n)
    local g = params "g=9.81"
    local m, l, V, C, before = 1/n, 1/n, 0, {}, vec { 0, 0 }
    for i = 1, n do
      local here = p:slice(2*i - 1, 2*i)
      local d = here - before
      C[i] = (d.T*d - l^2)/2
      V = V + m*g*here[2]
      before = here
    end
    return lagrange { q = p, T = m/2*p.dot.T*p.dot, V = V, C = C, name = "chain of " .. n .. " links" }
  end,
  build = function()
    local n, p = 10, var("p", 20)
    local model = include("problems/mechanics/chain").links(n)
    local fix, constraints = {}, {}
    for i = 1, n do
      fix[p[2*i - 1]], fix[p[2*i]] = i/n/math.sqrt(2), -i/n/math.sqrt(2)
      fix[p[2*i - 1].dot], fix[p[2*i].dot] = 0, 0
      constraints[i], constraints[i + n] = model.C[i], der(model.C[i])
    end
    return { model = model, constraints = constraints, fix = fix,
      reference = { [p[19]] = -0.6794899319, [p[20]] = -0.7271122386 } }
  end,
}
