return {
  title = "The lecture's nilpotent E: x = (-u″, -u′, -u)",
  source = "scripts/lecture/nilpotent.lua; Brenan, Campbell & Petzold, §2.3",
  statement = [[Nothing is free: the solution is the input and its derivatives. Implicit Euler errs by O(1) in
    x₁ at its first step, by O(h) after two steps, and by O(1/h²) after an inconsistent start.]],
  tags = "lecture linear",
  index = 3, dof = 0, structural_index = 3, structural_dof = 0, verdict = "valid",
  to = 2, dt = 0.1,
  build = function()
    local x, u = var("x", 3), input "u"
    return {
      model = dae.linear { E = { {0, 1, 0}, {0, 0, 1}, {0, 0, 0} }, A = eye(3), B = { {0}, {0}, {1} }, x = x,
        u = u,
        name = "nilpotent E" },
      constraints = { x[3] + u, x[2] + u.dot },
      inputs = { [u] = sin(t) },
      exact = { [x[1]] = sin(t), [x[2]] = -cos(t), [x[3]] = -sin(t) },
    }
  end,
}
