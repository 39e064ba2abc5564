return {
  title = "A parallelogram with a bar too many",
  source = [[Haug, Computer Aided Kinematics and Dynamics, 1989, §3.6 (redundant constraints); García de Jalón
    & Gutiérrez-López, Multibody Syst. Dyn. 30, 2013]],
  statement = [[Two masses on rods of equal length, joined by a bar that keeps both coordinates: on the set
    that the four constraints describe, one of them is redundant, the motion is determined and the four
    multipliers are not.]],
  tags = "mechanics nonlinear failure",
  why = [[the gradients of the constraints depend on each other wherever they hold, so the multipliers are not
    determined]],
  structural_index = 3, structural_dof = 0, verdict = "identically singular",
  remark = "Pattern and generic rank of the constraint Jacobian are those of four independent constraints.",
  to = 1,
  build = function()
    local q = var("q", 4)
    return {
      model = lagrange { q = q, T = q.dot.T*q.dot/2, V = 9.81*(q[2] + q[4]), name = "parallelogram",
        C = { (q[1]^2 + q[2]^2 - 1)/2, ((q[3] - 1)^2 + q[4]^2 - 1)/2, q[3] - q[1] - 1, q[4] - q[2] } },
      constraints = {},
    }
  end,
}
