return {
  title = "A ladder of diodes and capacitors",
  source = "benchmark of this project (docs/benchmarks.md#rc-diode-ladder), N = 10",
  statement = [[Each cell has an algebraic node with a diode and a capacitor. problems.diode_ladder.cells(n)
    is the model with n cells: sparse, of any size.]],
  tags = "circuit nonlinear benchmark",
  index = 1, dof = 10, structural_index = 1, structural_dof = 10, verdict = "valid",
  to = 1e-5, dt = 2e-8, digits = 8,
  cells = function(n)
    local w, v = var("w", n), var("v", n)
    local R, C, Is, VT = params "R=10 C=1e-9 I_s=1e-12 V_T=0.02585"
    local equations = { name = "ladder of " .. n .. " cells" }
    for k = 1, n do
      local before = k == 1 and 2*sin(200000*pi*t) or v[k - 1]
      equations[#equations + 1] = 0 ~ (before - w[k])/R + (v[k] - w[k])/R - Is*(exp(w[k]/VT) - 1)
      equations[#equations + 1] = C*der(v[k]) ~ (w[k] - v[k])/R + (k < n and (w[k + 1] - v[k])/R or 0)
    end
    return dae(equations)
  end,
  build = function()
    local w, v = var("w", 10), var("v", 10)
    local fix = {}
    for k = 1, 10 do fix[v[k]] = 0 end
    return { model = include("problems/benchmarks/diode_ladder").cells(10), constraints = {}, fix = fix,
      reference = { [v[5]] = -0.77291784, [w[6]] = -0.81843307 } }
  end,
}
