return {
  title = "A singular arc of optimal control",
  source = [[optimality conditions of min ½∫(x₁² + x₂²) dt, x₁′ = x₂, x₂′ = u; Bryson & Ho, Applied Optimal
    Control, 1975, ch. 8]],
  statement = [[∂H/∂u = λ₂ does not contain u: two differentiations give u = x₁, one more its derivative. On
    the arc x₁″ = x₁.]],
  tags = "linear control",
  index = 3, dof = 2, structural_index = 3, structural_dof = 2, verdict = "valid",
  to = 1, dt = 0.1,
  build = function()
    local x1, x2, l1, l2, u = vars "x1 x2 lambda1 lambda2 u"
    return {
      model = dae { der(x1) ~ x2, der(x2) ~ u, der(l1) ~ -x1, der(l2) ~ -x2 - l1, 0 ~ l2,
        name = "singular arc" },
      constraints = { l2, x2 + l1 },
      fix = { [x1] = 1, [x2] = -1 },
      exact = { [x1] = exp(-t), [x2] = -exp(-t), [l1] = exp(-t), [l2] = 0*t, [u] = exp(-t) },
    }
  end,
}
