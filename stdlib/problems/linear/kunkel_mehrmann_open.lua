return {
  title = "A pencil regular at every t, and yet infinitely many solutions",
  source = "Kunkel & Mehrmann, Differential-Algebraic Equations, EMS 2006, Example 3.1",
  statement = "det(s E(t) - A(t)) = 1 for every t, but x = c(t) (t, 1) is a solution for every function c.",
  tags = "linear failure singular",
  why = "x = c(t) (t, 1) solves it for every function c, so no number of differentiations gives x′",
  structural_index = 0, structural_dof = 2, verdict = "identically singular",
  remark = "Equation (1) is t times equation (2).",
  to = 1,
  build = function()
    local x1, x2 = vars "x1 x2"
    return {
      model = dae { -t*der(x1) + t^2*der(x2) ~ -x1, -der(x1) + t*der(x2) ~ -x2,
        name = "regular pencil, no unique solution" },
      constraints = { x1 - t*x2 },
    }
  end,
}
