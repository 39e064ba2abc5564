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
  remark = [[Pattern and generic rank of the constraint Jacobian are those of four independent constraints.
    lagrange and sys:independent make a model with the multipliers of least norm.]],
  to = 1,
  build = function()
    local q, z = var("q", 4), var("z", 4)
    local C = vec{ (q[1]^2 + q[2]^2 - 1)/2, ((q[3] - 1)^2 + q[4]^2 - 1)/2, q[3] - q[1] - 1, q[4] - q[2] }
    return {
      model = dae { q.ddot ~ -jacobian(C, q).T*z - vec{0, 9.81, 0, 9.81}, 0 ~ C, name = "parallelogram" },
      constraints = {},
    }
  end,
}
