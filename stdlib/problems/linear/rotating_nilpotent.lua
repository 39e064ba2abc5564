return {
  title = "A nilpotent block in a rotating frame",
  source = [[of the kind of Gear & Petzold, SIAM J. Numer. Anal. 21(4), 1984; Brenan, Campbell &
    Petzold, §2.4]],
  statement = [[N (Q(t)ᵀ x)′ = Q(t)ᵀ x + f with N³ = 0 and orthogonal Q: the pencil at a fixed t says nothing
    about it. Qᵀx = -(f + N f′ + N² f″), and no value is free.]],
  tags = "linear failure",
  index = 3, dof = 0, structural_index = 1, structural_dof = 2, verdict = "identically singular",
  remark = "Only combinations with functions of t as multipliers free the rows of their derivatives.",
  to = 1, dt = 0.05,
  build = function()
    local x = vec(vars "x1 x2 x3")
    local c, s = cos(t), sin(t)
    local Q = mat { { c, s, 0 }, { -s, c, 0 }, { 0, 0, 1 } } * mat { { 1, 0, 0 }, { 0, c, s }, { 0, -s, c } }
    local y = Q.T*x
    local exact = Q*vec { exp(-t) - 2 - s, -2*t - exp(-t), -t^2 }
    return {
      model = dae { der(y[2]) ~ y[1] + s, der(y[3]) ~ y[2] + exp(-t), 0 ~ y[3] + t^2,
        name = "rotating nilpotent block" },
      constraints = { y[3] + t^2, y[2] + exp(-t) + 2*t, y[1] + s + 2 - exp(-t) },
      fix = {},
      exact = { [x[1]] = exact[1], [x[2]] = exact[2], [x[3]] = exact[3] },
    }
  end,
}
