return {
  title = "A chain of integrators with a prescribed output",
  source = [[Brenan, Campbell & Petzold, Numerical Solution of Initial-Value Problems in DAEs, SIAM 1996, §2
    (Hessenberg form)]],
  statement = [[Three integrators between the unknown control u and the prescribed x₁: Hessenberg form of size
    four, index 4, u = x₁‴.]],
  tags = "linear control",
  index = 4, dof = 0, structural_index = 4, structural_dof = 0, verdict = "valid",
  to = 1, dt = 0.1,
  build = function()
    local x1, x2, x3, u = vars "x1 x2 x3 u"
    return {
      model = dae { der(x1) ~ x2, der(x2) ~ x3, der(x3) ~ u, 0 ~ x1 - sin(t), name = "tracking" },
      constraints = { x1 - sin(t), x2 - cos(t), x3 + sin(t) },
      exact = { [x1] = sin(t), [x2] = cos(t), [x3] = -sin(t), [u] = -cos(t) },
    }
  end,
}
